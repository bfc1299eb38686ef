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
from .cells import aligned, come_back, fill, finish, lane_room, outcome, put, settle_down, turn_over, vacate
from .clock_slots import *
from .contacts import change_modes
from .control import accept_series, advance, aim, arrive, judge, pause, wrap
from .passages import note_events, note_rush, take_back
from .records import EventWorkspace, Results, Rows, Step
from .spread import spread


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def counts_every_step(dims):
    """Return True if every step of the window is recorded, so that no cycle can be left out."""
    return dims.sections + dims.observed + dims.sampled + dims.events > 0


@njit(error_model="numpy")
def note_error(lanes, clock, y, multiplicity, dims):
    """Store the synchronisation error of some lanes, with which their next step begins."""
    now = np.empty(WIDTH)
    store(now, 0, spread(y, multiplicity, dims))
    for lane in range(WIDTH):
        if (lanes >> lane) & 1:
            put(clock, SYNC, lane, now[lane])


@njit(error_model="numpy")
def enter(lane, cell, rows, clock, y, multiplicity, dims):
    """Put a cell into a lane, with the first values of its records."""
    fill(lane, cell, rows, clock, y, dims)
    put(clock, STEP, lane, rows.spans[max(cell, 0), FIRST_OF_CELL])
    put(clock, LONGEST, lane, rows.spans[max(cell, 0), LONGEST_OF_CELL])
    put(clock, LOOK, lane, rows.spans[max(cell, 0), FIRST_LOOK])
    if counts_every_step(dims):
        put(clock, LEFT, lane, 0.0)
    if dims.stops:
        put(clock, MARK, lane, rows.control[MAX_STEPS])
    if dims.components > 0:
        note_error(1 << lane, clock, y, multiplicity, dims)


@njit(error_model="numpy")
def turn(lane, cell, rows, clock, y, dims):
    """Return the status of the cell in a lane; a cell at the end of its period begins the next one first."""
    status = outcome(lane, clock, y, rows.control, dims)
    if status == 0 and clock[TIME * WIDTH + lane] >= clock[BOUND * WIDTH + lane]:
        turn_over(lane, cell, rows.spans, rows.control, clock, y, dims)
        near = clock[SYNC * WIDTH + lane] < rows.spans[cell, 3]
        if near and dims.components > 0 and not counts_every_step(dims):
            settle_down(lane, cell, rows.spans, clock)
        status = outcome(lane, clock, y, rows.control, dims)
    return status


@njit(error_model="numpy")
def refill_lanes(look, queue, last, cell, clock, y, rows, results, multiplicity, dims):
    """Replace the finished cells of the lanes in `look` by the next ones of the queue; return the head of the queue."""
    for lane in range(WIDTH):
        # a cell may finish as soon as it enters, so the lane takes cells until one runs
        while (look >> lane) & 1:
            if cell[lane] < 0:
                if queue == last or rows.control[CANCEL] != 0.0:
                    vacate(lane, clock)
                    break
                cell[lane] = queue
                if results.counts[queue, STATUS] == PAUSED:
                    come_back(lane, clock, y, results.paused[queue])
                else:
                    enter(lane, queue, rows, clock, y, multiplicity, dims)
                queue += 1
            status = turn(lane, cell[lane], rows, clock, y, dims)
            if status == 0:
                break
            finish(lane, status, clock, y, cell[lane], rows.spans, results, dims)
            cell[lane] = -1
    return queue


@njit(error_model="numpy", forceinline=True)
def attempt(clock, y, dense, y_new, control, dims, functions, friction):
    """Take one step of all lanes; return their times and lengths, and the mask of accepted steps."""
    t, h = load(clock, TIME, WIDTH), aim(clock)
    if SERIES:
        limit = minimum(load(clock, STOP, WIDTH) - t, load(clock, LONGEST, WIDTH))
        if LOOPED:
            graph, weights = friction.network
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
        graph, weights = friction.network
        error = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL], graph, weights)
    else:
        error = functions.step(t, h, y, y, y_new, dense, control[RTOL], control[ATOL])
    accept = judge(clock, h, error, 1.0 / (dims.error_order + 1.0))
    if CONTACTS:
        accept = take_back(accept, Step(t, h, y, y_new, dense), clock, friction)
    return t, h, accept


@njit(error_model="numpy", nogil=True, cache=True)
def drive(functions, dims, multiplicity, rule, network, first, last, inputs, outputs):
    """Run the cells first … last-1.

    functions: those of the scene and the recorders.  dims: `Dimensions`; the recorder of a size that is 0 is not called.
    multiplicity (nodes): oscillators that each node represents.  rule (points, 4 + points): rule of the panels of a step
    (codegen/kernels/observable_functions.py).  network: of steps in loops, the arrays of the elimination program
    (codegen/steps/sparse_plan.py) and the weights of the links, else ().  inputs: the fields of `Rows` as a tuple.
    outputs: the fields of `Results` as a tuple; a cell whose status is PAUSED continues from its saved lane.
    """
    # Python passes plain tuples, whose types Numba finds faster than those of records
    start, values, spans, control = inputs
    end, sums, counts, points, samples, paused = outputs
    rows, results = Rows(start, values, spans, control), Results(end, sums, counts, points, samples, paused)
    steering, members = address(control, 0), address(multiplicity, 0)

    # 1. Lay out the workspace: y_new, middle, contacts, clock, y, dense output, values of observables and of sections.
    size, dense_size = dims.dimension, dims.dense_rows * dims.dimension
    lane_size = CLOCK + lane_room(dims)
    observed = len(rule) * (dims.observed + dims.gaps + dims.depths)
    crossed = (len(rule) + 1) * (dims.sections * (3 + max(0, dims.kept)) + 3 * dims.stops)
    block = aligned((2 * size + lane_size + dense_size + dims.workspace + dims.contacts + observed + crossed) * WIDTH)
    y_new, middle, out = address(block, 0), address(block, size * WIDTH), address(block, 2 * size * WIDTH)
    first_lane = (2 * size + dims.contacts) * WIDTH
    clock, y = address(block, first_lane), address(block, first_lane + CLOCK * WIDTH)
    dense = address(block, first_lane + lane_size * WIDTH)
    seen = address(dense, (dense_size + dims.workspace) * WIDTH)
    crossings = address(seen, observed * WIDTH)
    impacts = address(y, (lane_room(dims) - 2 * dims.rows) * WIDTH)
    friction = EventWorkspace(middle, out, clock, steering, network, dims, functions, impacts)

    # 2. All lanes are empty; tallies of cells that do not continue begin at 0.
    cell = np.full(WIDTH, -1)
    for lane in range(WIDTH):
        enter(lane, -1, rows, clock, y, members, dims)
    for i in range(first, last):
        if counts[i, STATUS] == PAUSED:
            continue
        for column in range(OBSERVED, sums.shape[1]):
            sums[i, column] = 0.0

    queue, look = first, ALL
    while True:
        # 3. Lanes in `look` turn over their period or change their cell. The end: no lane holds a cell.
        if look != 0:
            queue = refill_lanes(look, queue, last, cell, clock, y, rows, results, members, dims)
            busy = False
            for lane in range(WIDTH):
                busy = busy or cell[lane] >= 0
            if not busy:
                break

        # 4. One step of all lanes; a stop may end it early.
        t, h, accept = attempt(clock, y, dense, y_new, steering, dims, functions, friction)
        if dims.stops:
            h = functions.halt(
                accept, Step(t, h, y, y_new, dense), clock, crossings, steering, rule, dims, functions.section
            )

        # 5. Record inside the accepted steps; `counted` are those in the window, `now` is their time from t = 0.
        t_new = arrive(clock, t, h)
        counted, now = accept & (t >= load(clock, START, WIDTH)), load(clock, BASE, WIDTH) + t
        step = Step(now, h, y, y_new, dense)
        if dims.components > 0:
            functions.observe(counted, accept, step, clock, middle, members, dims)
        if dims.sections > 0 and any_lane(counted):
            functions.cut(counted, step, crossings, cell, counts, points, steering, rule, dims, functions.section)
        if dims.observed > 0 and any_lane(counted):
            functions.tally(lane_bits(counted), step, seen, cell, sums, steering, rule, dims, functions.values)
        if dims.sampled and any_lane(accept):
            functions.sample(lane_bits(accept), t_new, step, clock, cell, spans, samples, control, dims)

        # 6. Move the accepted lanes to the end of the step, and find the lanes that step 3 must look at.
        largest = advance(clock, y, t, t_new, accept, y_new, dims)
        if CONTACTS:
            changed = change_modes(accept, t_new, y, friction)
            if dims.components > 0 and dims.felt > 0 and changed != 0:  # an impact or a reset may have moved the state
                note_error(changed, clock, y, members, dims)
            changed &= lane_bits(counted)
            if dims.events and changed != 0:
                note_events(changed, load(clock, BASE, WIDTH) + t_new, cell, counts, points, friction)
        if SERIES:
            wrap(clock)
        look = ALL if steering[CANCEL] != 0.0 else lane_bits(pause(clock, largest))
    block[0] = 0.0  # the memory behind the addresses is held until here
