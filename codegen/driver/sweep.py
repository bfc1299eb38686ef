"""Runs the cells of a sweep: lanes in step with each other, each with its own time, step size and parameters.

A cell starts at t = 0, lets transients pass until the start of its window, records until the end of
the window, and makes room for the next cell.  Its result does not depend on its neighbours in the
register.

In a kernel with two kinds of step (SWITCHING) every cell belongs to one of two groups of lanes, stiff
or smooth, and changes groups when its stiffness changes.  2 WIDTH - 1 cells are in flight, so that
one of the groups is always full.
"""

# ruff: noqa: I001  (the long lists of names stay short)
from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.lanes import any_lane
from ..simd.lanes import lane_bits
from ..simd.lanes import load
from ..simd.lanes import store
from .cells import SLOTS
from .cells import aligned
from .cells import fill
from .cells import finish
from .cells import held
from .cells import move
from .cells import occupied
from .cells import outcome
from .cells import put
from .cells import turn_over
from .cells import vacant
from .cells import vacate
from .cells import waiting
from .contacts import change_modes
from .contacts import take_back
from .control import advance
from .control import aim
from .control import arrive
from .control import judge
from .control import pause
from .control import turned
from .names import CONTACTS
from .names import DENSE_ROWS
from .names import DIMENSION
from .names import ERROR_ORDER
from .names import LOOPED
from .names import NODES
from .names import SECTION
from .names import SMOOTH_ERROR_ORDER
from .names import SWITCHING
from .names import SYNC_ERROR
from .names import TRAJECTORY
from .names import WIDTH
from .names import WORKSPACE
from .names import step
from .names import step_smooth
from .recording import ALL
from .recording import ATOL
from .recording import BASE
from .recording import CANCEL
from .recording import CHANGE
from .recording import DIRECTION
from .recording import MEMORY
from .recording import MODE
from .recording import PERIOD
from .recording import RTOL
from .recording import SMOOTH
from .recording import SMOOTH_STEPS
from .recording import START
from .recording import STIFF
from .recording import TIME
from .recording import cut
from .recording import observe
from .recording import sample


# --- kernel text below ---
@njit(error_model="numpy")
def settle(
    mode, look, flips, queue, last, bank, cell, away_bank, away_cell, lot_bank, lot_cell, start, numbers, spans, control,
    end, sums, counts, samples,
):  # fmt: skip
    """See to the lanes in `look`: periods turn over, finished cells leave, others change sides; returns the queue's head.

    A switching kernel admits new cells elsewhere; `away` are the lanes of the other kind, `lot` those of waiting cells.
    """
    for which in range(WIDTH):
        flip = (flips >> which) & 1 != 0
        while (look >> which) & 1:
            if cell[which] < 0:
                flip = False
                if not SWITCHING and queue < last and control[CANCEL] == 0.0:
                    cell[which] = queue
                    fill(which, queue, start, numbers, spans, control, bank, samples)
                    queue += 1
                elif not fetch(which, mode, bank, cell, lot_bank, lot_cell):
                    vacate(which, bank)
                    break
            status = outcome(which, bank, control)
            if status == 0 and bank[TIME * WIDTH + which] >= bank[PERIOD * WIDTH + which]:
                turn_over(which, cell[which], spans, control, bank)
                status = outcome(which, bank, control)
            if status != 0:
                finish(which, status, bank, cell[which], spans, end, sums, counts)
                cell[which] = -1
            elif SWITCHING and flip:
                change_sides(which, mode, bank, cell, away_bank, away_cell, lot_bank, lot_cell)
            else:
                break
    return queue


@njit(error_model="numpy")
def fetch(which, mode, bank, cell, lot_bank, lot_cell):
    """Give a waiting cell the free lane of its kind; returns whether there was one."""
    if SWITCHING:
        found = waiting(lot_bank, lot_cell, mode)
        if found >= 0:
            move(found, lot_bank, lot_cell, which, bank, cell)
            return True
    return False


@njit(error_model="numpy")
def change_sides(which, mode, bank, cell, away_bank, away_cell, lot_bank, lot_cell):
    """Move a cell to the other kind of step; where no lane is free there, it waits."""
    put(bank, MODE, which, 0.0 if mode == SMOOTH else 1.0)
    put(bank, MEMORY, which, 0.0)
    put(bank, CHANGE, which, math.inf)
    free = vacant(away_cell)
    if free >= 0:
        move(which, bank, cell, free, away_bank, away_cell)
    else:
        move(which, bank, cell, vacant(lot_cell), lot_bank, lot_cell)


@njit(error_model="numpy")
def admit(queue, last, flying, bank, cell, start, numbers, spans, control, samples):
    """Take cells from the queue into free lanes while fewer than `flying` are wanted; returns the head of the queue."""
    while flying > 0 and queue < last and control[CANCEL] == 0.0:
        which = vacant(cell)
        if which < 0:
            break
        cell[which] = queue
        fill(which, queue, start, numbers, spans, control, bank, samples)
        queue += 1
        flying -= 1
    return queue


@njit(error_model="numpy", forceinline=True)
def attempt(mode, bank, dense, y_new, middle, out, cell, spans, control, counts, points, samples, graph, weights):
    """One step of all lanes of a group; returns the lanes that need a look, and those that change sides, as bits."""
    t, h = load(bank, TIME, WIDTH), aim(bank, control)
    power = 1.0 / (ERROR_ORDER + 1.0)
    if SWITCHING:
        if mode == SMOOTH:
            error, rate = step_smooth(t, h, bank, bank, y_new, dense, control[RTOL], control[ATOL])
            power = 1.0 / (SMOOTH_ERROR_ORDER + 1.0)
            store(bank, SMOOTH_STEPS, load(bank, SMOOTH_STEPS, WIDTH) + 1.0)
        else:
            error, rate = step(t, h, bank, bank, y_new, dense, control[RTOL], control[ATOL])
    elif LOOPED:
        error = step(t, h, bank, bank, y_new, dense, control[RTOL], control[ATOL], graph, weights)
    else:
        error = step(t, h, bank, bank, y_new, dense, control[RTOL], control[ATOL])
    t_new = arrive(bank, t, h)
    accept = judge(bank, h, error, power)
    if CONTACTS:
        accept = take_back(accept, t, h, bank, y_new, dense, middle, out, (graph, weights))
    counted = accept & (t >= load(bank, START, WIDTH))
    if SYNC_ERROR:
        observe(bank, h, counted, accept, y_new, dense, middle)
    if SECTION and any_lane(counted):
        now = load(bank, BASE, WIDTH) + t
        cut(counted, now, h, bank, y_new, dense, cell, counts, points, control[DIRECTION])
    if TRAJECTORY and any_lane(accept):
        sample(bank, t_new, h, lane_bits(accept), y_new, dense, cell, spans, samples)
    advance(bank, t, t_new, accept, y_new)
    if CONTACTS:
        change_modes(accept, t_new, bank, out, (graph, weights))
    flips = 0
    if SWITCHING:
        flips = lane_bits(turned(bank, accept, rate, mode))
    return ALL if control[CANCEL] != 0.0 else lane_bits(pause(bank, control)) | flips, flips


@njit(error_model="numpy", nogil=True, cache=True)
def drive(first, last, start, numbers, spans, control, end, sums, counts, points, samples, graph, weights):
    """Run the cells first … last-1.

    start (cells, DIMENSION), numbers (cells, PARAMETERS), spans (cells, 4): start and end of the window, the period after
    which the right-hand side repeats (0: none), and the synchronisation error below which a cell that records nothing
    else may end early (0: never); control: see the column names above.  Filled: end (cells, DIMENSION), sums (cells, 4),
    counts (cells, 6), points (cells, room, DIMENSION + 1), samples (cells, samples, DIMENSION).  graph and weights: the
    links and the elimination program of a network that is stepped through in loops (codegen/sparse.py).
    """
    y_new, middle, bank = aligned(DIMENSION * WIDTH), aligned(DIMENSION * WIDTH), aligned(SLOTS * WIDTH)
    dense, cell = aligned((DENSE_ROWS * DIMENSION + WORKSPACE) * WIDTH), np.full(WIDTH, -1)
    size = SLOTS * WIDTH if SWITCHING else 0
    away_bank, away_dense, away_cell = aligned(size), aligned(DENSE_ROWS * DIMENSION * WIDTH), np.full(WIDTH, -1)
    lot_bank, lot_cell = aligned(size), np.full(WIDTH, -1)
    out = aligned(9 * NODES * WIDTH if CONTACTS else 0)
    for which in range(WIDTH):
        fill(which, -1, start, numbers, spans, control, bank, samples)
        if SWITCHING:
            fill(which, -1, start, numbers, spans, control, away_bank, samples)
    mode, queue, look, flips = STIFF, first, ALL, 0
    while True:
        if SWITCHING and look != 0:
            room = 2 * WIDTH - 1 - occupied(cell) - occupied(away_cell) - occupied(lot_cell)
            head = queue
            flips = flips & held(cell)  # an idle lane may ask for anything; who moves in must not inherit it
            if mode == STIFF:
                queue = admit(queue, last, room, bank, cell, start, numbers, spans, control, samples)
                look = look if queue == head else ALL
            else:
                queue = admit(queue, last, room, away_bank, away_cell, start, numbers, spans, control, samples)
            queue = admit(
                queue, last, room - (queue - head), lot_bank, lot_cell, start, numbers, spans, control, samples
            )
        if look != 0:
            queue = settle(
                mode, look, flips, queue, last, bank, cell, away_bank, away_cell, lot_bank, lot_cell, start, numbers,
                spans, control, end, sums, counts, samples,
            )  # fmt: skip
            full, other, flips = occupied(cell), occupied(away_cell), 0
            waits = occupied(lot_cell) > 0 or (queue < last and control[CANCEL] == 0.0)
            if SWITCHING and full < WIDTH and (other > full or (full + other == 0 and waits)):
                mode, look = 1 - mode, ALL
                bank, away_bank = away_bank, bank
                dense, away_dense = away_dense, dense
                cell, away_cell = away_cell, cell
                continue
            if full == 0:
                break
        look, flips = attempt(
            mode, bank, dense, y_new, middle, out, cell, spans, control, counts, points, samples, graph, weights
        )
