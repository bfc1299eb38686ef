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

from ..simd.addresses import address
from ..simd.lanes import any_lane
from ..simd.lanes import lane_bits
from ..simd.lanes import load
from ..simd.lanes import minimum
from ..simd.lanes import store
from .cells import REPEATING
from .cells import aligned
from .cells import fill
from .cells import finish
from .cells import held
from .cells import move
from .cells import occupied
from .cells import outcome
from .cells import put
from .cells import settle_down
from .cells import turn_over
from .cells import vacant
from .cells import vacate
from .cells import waiting
from .contacts import change_modes
from .contacts import note_rush
from .contacts import take_back
from .control import accept_series
from .control import advance
from .control import aim
from .control import arrive
from .control import judge
from .control import pause
from .control import turned
from .control import wrap
from .names import ALL
from .names import ATOL
from .names import BASE
from .names import BOUND
from .names import CANCEL
from .names import CHANGE
from .names import CLOCK
from .names import CONTACTS
from .names import LEFT
from .names import LOOPED
from .names import MARK
from .names import MAX_STEP
from .names import MAX_STEPS
from .names import MEMORY
from .names import MODE
from .names import OBSERVED
from .names import RTOL
from .names import SERIES
from .names import SMOOTH
from .names import SMOOTH_STEPS
from .names import START
from .names import STEP
from .names import STIFF
from .names import STOP
from .names import SWITCHING
from .names import SYNC
from .names import TIME
from .names import WIDTH
from .spread import spread


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def whole(dims):
    """True if every step of the window counts: nothing in it can be left out."""
    return dims.sections + dims.observed + dims.sampled > 0


@njit(error_model="numpy")
def enter(which, cell, start, numbers, spans, control, clock, y, multiplicity, dims):
    """Put a cell into a lane, with what its records begin with."""
    fill(which, cell, start, numbers, spans, control, clock, y, dims)
    if whole(dims):
        put(clock, LEFT, which, 0.0)
    if dims.stops:
        put(clock, MARK, which, control[MAX_STEPS])
    if dims.components > 0:
        now = np.empty(WIDTH)
        store(now, 0, spread(y, multiplicity, dims))
        put(clock, SYNC, which, now[which])


@njit(error_model="numpy")
def settle(
    mode, look, flips, queue, last, clock, y, cell, away_clock, away_y, away_cell, lot_clock, lot_y, lot_cell, start,
    numbers, spans, control, end, sums, counts, multiplicity, dims,
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
                    enter(which, queue, start, numbers, spans, control, clock, y, multiplicity, dims)
                    queue += 1
                elif not fetch(which, mode, clock, y, cell, lot_clock, lot_y, lot_cell, dims):
                    vacate(which, clock)
                    break
            status = outcome(which, clock, y, control, dims)
            if status == 0 and clock[TIME * WIDTH + which] >= clock[BOUND * WIDTH + which]:
                turn_over(which, cell[which], spans, control, clock, y, dims)
                near = clock[SYNC * WIDTH + which] < spans[cell[which], 3]
                if near and dims.components > 0 and not whole(dims):
                    settle_down(which, cell[which], spans, clock)
                status = outcome(which, clock, y, control, dims)
            if status != 0:
                finish(which, status, clock, y, cell[which], spans, end, sums, counts, dims)
                cell[which] = -1
            elif SWITCHING and flip:
                change_sides(
                    which, mode, clock, y, cell, away_clock, away_y, away_cell, lot_clock, lot_y, lot_cell, dims
                )
            else:
                break
    return queue


@njit(error_model="numpy")
def fetch(which, mode, clock, y, cell, lot_clock, lot_y, lot_cell, dims):
    """Give a waiting cell the free lane of its kind; returns whether there was one."""
    if SWITCHING:
        found = waiting(lot_clock, lot_cell, mode)
        if found >= 0:
            move(found, lot_clock, lot_y, lot_cell, which, clock, y, cell, dims)
            return True
    return False


@njit(error_model="numpy")
def change_sides(which, mode, clock, y, cell, away_clock, away_y, away_cell, lot_clock, lot_y, lot_cell, dims):
    """Move a cell to the other kind of step; where no lane is free there, it waits."""
    put(clock, MODE, which, 0.0 if mode == SMOOTH else 1.0)
    put(clock, MEMORY, which, 0.0)
    put(clock, CHANGE, which, math.inf)
    free = vacant(away_cell)
    if free >= 0:
        move(which, clock, y, cell, free, away_clock, away_y, away_cell, dims)
    else:
        move(which, clock, y, cell, vacant(lot_cell), lot_clock, lot_y, lot_cell, dims)


@njit(error_model="numpy")
def admit(queue, last, flying, clock, y, cell, start, numbers, spans, control, multiplicity, dims):
    """Take cells from the queue into free lanes while fewer than `flying` are wanted; returns the head of the queue."""
    while flying > 0 and queue < last and control[CANCEL] == 0.0:
        which = vacant(cell)
        if which < 0:
            break
        cell[which] = queue
        enter(which, queue, start, numbers, spans, control, clock, y, multiplicity, dims)
        queue += 1
        flying -= 1
    return queue


@njit(error_model="numpy", forceinline=True)
def attempt(mode, clock, y, dense, y_new, middle, out, control, dims, functions, network):
    """One step of all lanes of a group: times, lengths, the mask of accepted steps and a bound of the eigenvalues."""
    t, h = load(clock, TIME, WIDTH), aim(clock, control)
    power, rate = 1.0 / (dims.error_order + 1.0), h
    if SERIES:
        limit = minimum(load(clock, STOP, WIDTH) - t, control[MAX_STEP])
        if LOOPED:
            graph, weights = network
            h, reach = functions.step(
                t, limit, load(clock, STEP, WIDTH), y, y, y_new, dense, control[RTOL], control[ATOL], graph, weights
            )
        else:
            h, reach = functions.step(
                t, limit, load(clock, STEP, WIDTH), y, y, y_new, dense, control[RTOL], control[ATOL]
            )
        accept = accept_series(clock, reach, limit)
        if CONTACTS:
            note_rush(accept, t, h, clock)
        return t, h, accept, rate
    if SWITCHING:
        if mode == SMOOTH:
            error, rate = functions.step_smooth(t, h, y, y, y_new, dense, control[RTOL], control[ATOL])
            power = 1.0 / (dims.smooth_error_order + 1.0)
            store(clock, SMOOTH_STEPS, load(clock, SMOOTH_STEPS, WIDTH) + 1.0)
        else:
            error, rate = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL])
    elif LOOPED:
        graph, weights = network
        error = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL], graph, weights)
    else:
        error = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL])
    accept = judge(clock, h, error, power)
    if CONTACTS:
        accept = take_back(accept, t, h, clock, y, y_new, dense, middle, out, network, dims, functions.pushes)
    return t, h, accept, rate


@njit(error_model="numpy", forceinline=True)
def conclude(mode, t, h, accept, rate, clock, y, y_new, out, control, dims, pushes, network):
    """Move the accepted lanes on; returns the lanes that need a look, and those that change sides, as bits."""
    t_new = arrive(clock, t, h)
    largest = advance(clock, y, t, t_new, accept, y_new, dims)
    if CONTACTS:
        change_modes(accept, t_new, y, out, network, dims, pushes)
    if SERIES:
        wrap(clock)
    flips = 0
    if SWITCHING:
        flips = lane_bits(turned(clock, accept, rate, mode))
    return ALL if control[CANCEL] != 0.0 else lane_bits(pause(clock, largest)) | flips, flips


@njit(error_model="numpy", nogil=True, cache=True)
def drive(
    functions, dims, multiplicity, rule, network, first, last, start, numbers, spans, control, end, sums, counts, points,
    samples,
):  # fmt: skip
    """Run the cells first … last-1.

    functions: those of a scene and those that record.  dims: the sizes of its arrays; what is 0 there is not recorded,
    and its functions are not called.
    multiplicity (nodes): how many oscillators each node stands for.  rule (points, 4 + points): of the panels of a step
    (codegen/kernels/observed.py).  network: of one that is stepped through in loops, the arrays of its
    program (codegen/steps/program.py) and the weights of its links.
    start (cells, dimension), numbers (cells, parameters), spans (cells, 4): start and end of the window, the period after
    which the right-hand side repeats (0: none), and the synchronisation error below which a cell that records nothing
    else may end early (0: never); control: see the column names above.  Filled: end (cells, dimension), sums (cells, 4,
    or more if values are observed), counts (cells, 6), points (cells, room, dimension + 1, or
    2 + kept of sections on functions), samples (cells, samples, dimension).
    """
    steering, members = address(control, 0), address(multiplicity, 0)
    size, rows = dims.dimension, dims.dense_rows * dims.dimension
    group = CLOCK + 2 * size + dims.parameters + len(REPEATING)
    groups = 3 if SWITCHING else 1
    scratch = 9 * dims.nodes + 2 if CONTACTS else 0
    watched = len(rule) * (dims.observed + dims.gaps + dims.depths)
    crossed = (len(rule) + 1) * (dims.sections * (3 + max(0, dims.kept)) + 3 * dims.stops)
    block = aligned((2 * size + groups * (group + rows) + dims.workspace + scratch + watched + crossed) * WIDTH)
    y_new, middle, out = address(block, 0), address(block, size * WIDTH), address(block, 2 * size * WIDTH)
    first_group = (2 * size + scratch) * WIDTH
    clock, y = address(block, first_group), address(block, first_group + CLOCK * WIDTH)
    dense = address(block, first_group + groups * group * WIDTH)
    seen = address(dense, (groups * rows + dims.workspace) * WIDTH)
    found = address(seen, watched * WIDTH)
    away_clock, away_y, away_dense, lot_clock, lot_y = clock, y, dense, clock, y
    cell, away_cell, lot_cell = np.full(WIDTH, -1), np.full(WIDTH, -1), np.full(WIDTH, -1)
    for which in range(WIDTH):
        enter(which, -1, start, numbers, spans, control, clock, y, members, dims)
    if SWITCHING:
        away_clock, away_y = address(clock, group * WIDTH), address(y, group * WIDTH)
        lot_clock, lot_y = address(away_clock, group * WIDTH), address(away_y, group * WIDTH)
        away_dense = address(dense, rows * WIDTH)
        for which in range(WIDTH):
            enter(which, -1, start, numbers, spans, control, away_clock, away_y, members, dims)
    for i in range(first, last):
        for column in range(OBSERVED, sums.shape[1]):
            sums[i, column] = 0.0
    mode, queue, look, flips = STIFF, first, ALL, 0
    while True:
        if SWITCHING and look != 0:
            room = 2 * WIDTH - 1 - occupied(cell) - occupied(away_cell) - occupied(lot_cell)
            head = queue
            flips = flips & held(cell)  # an idle lane may ask for anything; who moves in must not inherit it
            if mode == STIFF:
                queue = admit(queue, last, room, clock, y, cell, start, numbers, spans, control, members, dims)
                look = look if queue == head else ALL
            else:
                queue = admit(
                    queue, last, room, away_clock, away_y, away_cell, start, numbers, spans, control, members, dims
                )
            room -= queue - head
            queue = admit(queue, last, room, lot_clock, lot_y, lot_cell, start, numbers, spans, control, members, dims)
        if look != 0:
            queue = settle(
                mode, look, flips, queue, last, clock, y, cell, away_clock, away_y, away_cell, lot_clock, lot_y, lot_cell,
                start, numbers, spans, control, end, sums, counts, members, dims,
            )  # fmt: skip
            full, other, flips = occupied(cell), occupied(away_cell), 0
            waits = occupied(lot_cell) > 0 or (queue < last and control[CANCEL] == 0.0)
            if SWITCHING and full < WIDTH and (other > full or (full + other == 0 and waits)):
                mode, look = 1 - mode, ALL
                clock, away_clock = away_clock, clock
                y, away_y = away_y, y
                dense, away_dense = away_dense, dense
                cell, away_cell = away_cell, cell
                continue
            if full == 0:
                break
        t, h, accept, rate = attempt(mode, clock, y, dense, y_new, middle, out, steering, dims, functions, network)
        if dims.stops:
            h = functions.halt(accept, t, h, clock, y, y_new, dense, found, steering, rule, dims, functions.section)
        counted, now = accept & (t >= load(clock, START, WIDTH)), load(clock, BASE, WIDTH) + t
        if dims.components > 0:
            functions.observe(counted, accept, h, clock, y, y_new, dense, middle, members, dims)
        if dims.sections > 0 and any_lane(counted):
            functions.cut(
                counted, now, h, y, y_new, dense, found, cell, counts, points, steering, rule, dims, functions.section
            )
        if dims.observed > 0 and any_lane(counted):
            functions.tally(
                lane_bits(counted), now, h, y, y_new, dense, seen, cell, sums, steering, rule, dims, functions.values
            )
        if dims.sampled and any_lane(accept):
            functions.sample(
                lane_bits(accept), arrive(clock, t, h), h, clock, y, y_new, dense, cell, spans, samples, dims
            )
        look, flips = conclude(
            mode, t, h, accept, rate, clock, y, y_new, out, steering, dims, functions.pushes, network
        )
    block[0] = 0.0  # the memory behind the addresses is held until here
