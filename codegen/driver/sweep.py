"""Runs the cells of a sweep: lanes in step with each other, each with its own time, step size and parameters.

A cell starts at t = 0, lets transients pass until the start of its window, records until the end of
the window, and makes room for the next cell.  Its result does not depend on its neighbours in the
register.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ..simd.addresses import address
from ..simd.lanes import any_lane, lane_bits, load, minimum, store
from .cells import REPEATING, aligned, come_back, fill, finish, outcome, put, settle_down, turn_over, vacate
from .clock_slots import *
from .contacts import change_modes, note_rush, take_back
from .control import accept_series, advance, aim, arrive, judge, pause, wrap
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
    put(clock, STEP, which, spans[max(cell, 0), FIRST_OF_CELL])
    put(clock, LONGEST, which, spans[max(cell, 0), LONGEST_OF_CELL])
    put(clock, LOOK, which, spans[max(cell, 0), FIRST_LOOK])
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
    look, queue, last, clock, y, cell, start, numbers, spans, control, end, sums, counts, lanes, multiplicity, dims,
):  # fmt: skip
    """See to the lanes in `look`: periods turn over, finished cells leave, new ones enter; returns the queue's head."""
    for which in range(WIDTH):
        while (look >> which) & 1:
            if cell[which] < 0:
                if queue == last or control[CANCEL] != 0.0:
                    vacate(which, clock)
                    break
                cell[which] = queue
                if counts[queue, STATUS] == PAUSED:
                    come_back(which, clock, y, lanes[queue])
                else:
                    enter(which, queue, start, numbers, spans, control, clock, y, multiplicity, dims)
                queue += 1
            status = outcome(which, clock, y, control, dims)
            if status == 0 and clock[TIME * WIDTH + which] >= clock[BOUND * WIDTH + which]:
                turn_over(which, cell[which], spans, control, clock, y, dims)
                near = clock[SYNC * WIDTH + which] < spans[cell[which], 3]
                if near and dims.components > 0 and not whole(dims):
                    settle_down(which, cell[which], spans, clock)
                status = outcome(which, clock, y, control, dims)
            if status == 0:
                break
            finish(which, status, clock, y, cell[which], spans, end, sums, counts, lanes, dims)
            cell[which] = -1
    return queue


@njit(error_model="numpy", forceinline=True)
def attempt(clock, y, dense, y_new, middle, out, control, dims, functions, network):
    """One step of all lanes: times, lengths and the mask of accepted steps."""
    t, h = load(clock, TIME, WIDTH), aim(clock)
    if SERIES:
        limit = minimum(load(clock, STOP, WIDTH) - t, load(clock, LONGEST, WIDTH))
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
        return t, h, accept
    if LOOPED:
        graph, weights = network
        error = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL], graph, weights)
    else:
        error = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL])
    accept = judge(clock, h, error, 1.0 / (dims.error_order + 1.0))
    if CONTACTS:
        accept = take_back(accept, t, h, clock, y, y_new, dense, middle, out, network, dims, functions.pushes)
    return t, h, accept


@njit(error_model="numpy", nogil=True, cache=True)
def drive(
    functions, dims, multiplicity, rule, network, first, last, start, numbers, spans, control, end, sums, counts, points,
    samples, lanes,
):  # fmt: skip
    """Run the cells first … last-1.

    functions: those of a scene and those that record.  dims: the sizes of its arrays; what is 0 there is not recorded,
    and its functions are not called.
    multiplicity (nodes): how many oscillators each node stands for.  rule (points, 4 + points): of the panels of a step
    (codegen/kernels/observable_text.py).  network: of one that is stepped through in loops, the arrays of its
    program (codegen/steps/sparse_plan.py) and the weights of its links.
    start (cells, dimension), numbers (cells, parameters), spans (cells, 7): start and end of the window, the period after
    which the right-hand side repeats (0: none), the synchronisation error below which a cell that records nothing
    else may end early (0: never), the first step, the longest one, and the steps after which the cell first looks
    whether to pause; control: see the column names above.  Filled: end (cells, dimension), sums (cells, 4,
    or more if values are observed), counts (cells, 5 or more), points (cells, room, dimension + 1, or
    2 + kept of sections on functions), samples (cells, samples, dimension), lanes (cells, any): those of
    cells that pause, and of cells whose steps underflow; a cell that has paused goes on from there.
    """
    steering, members = address(control, 0), address(multiplicity, 0)
    size, rows = dims.dimension, dims.dense_rows * dims.dimension
    group = CLOCK + 2 * size + dims.parameters + len(REPEATING)
    scratch = 9 * dims.nodes + 2 if CONTACTS else 0
    watched = len(rule) * (dims.observed + dims.gaps + dims.depths)
    crossed = (len(rule) + 1) * (dims.sections * (3 + max(0, dims.kept)) + 3 * dims.stops)
    block = aligned((2 * size + group + rows + dims.workspace + scratch + watched + crossed) * WIDTH)
    y_new, middle, out = address(block, 0), address(block, size * WIDTH), address(block, 2 * size * WIDTH)
    first_group = (2 * size + scratch) * WIDTH
    clock, y = address(block, first_group), address(block, first_group + CLOCK * WIDTH)
    dense = address(block, first_group + group * WIDTH)
    seen = address(dense, (rows + dims.workspace) * WIDTH)
    found = address(seen, watched * WIDTH)
    cell = np.full(WIDTH, -1)
    for which in range(WIDTH):
        enter(which, -1, start, numbers, spans, control, clock, y, members, dims)
    for i in range(first, last):
        if counts[i, STATUS] == PAUSED:
            continue
        for column in range(OBSERVED, sums.shape[1]):
            sums[i, column] = 0.0
    queue, look = first, ALL
    while True:
        if look != 0:
            queue = settle(
                look, queue, last, clock, y, cell, start, numbers, spans, control, end, sums, counts, lanes, members,
                dims,
            )  # fmt: skip
            # stop once no lane holds a cell
            busy = False
            for which in range(WIDTH):
                busy = busy or cell[which] >= 0
            if not busy:
                break
        t, h, accept = attempt(clock, y, dense, y_new, middle, out, steering, dims, functions, network)
        if dims.stops:
            h = functions.halt(accept, t, h, clock, y, y_new, dense, found, steering, rule, dims, functions.section)
        # record what the step passed
        t_new = arrive(clock, t, h)
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
            functions.sample(lane_bits(accept), t_new, h, clock, y, y_new, dense, cell, spans, samples, dims)
        # move the accepted lanes on
        largest = advance(clock, y, t, t_new, accept, y_new, dims)
        if CONTACTS:
            change_modes(accept, t_new, y, out, network, dims, functions.pushes)
        if SERIES:
            wrap(clock)
        look = ALL if steering[CANCEL] != 0.0 else lane_bits(pause(clock, largest))
    block[0] = 0.0  # the memory behind the addresses is held until here
