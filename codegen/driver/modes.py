"""One orbit after the other, each with all its modes: the driver of the kernels that carry deviations along an orbit.

A deviation grows or shrinks by any factor, so it is scaled by a power of two every few steps, which is
exact; the powers are counted.  Step sizes follow the errors of the orbit and of all modes.  Callers
sort modes by the size of their strength: the last register is stepped first, and if its error is too
large, no other one is.  Taylor steps follow the series of the orbit and of all modes.
"""

from __future__ import annotations

import math

from numba import njit

from ..simd.addresses import address
from ..simd.lanes import any_lane, broadcast, lane_bits, load, maximum, minimum, select, store
from .cells import aligned, begin, fill, lane_room, outcome, put, restart, turn_over, watch
from .clock_slots import *
from .control import accept_series, advance, aim, arrive, judge, pause, wrap
from .dense import inside
from .event_modes import begin_events_of_modes, pass_events
from .frames import GONE, LENGTHS, NEXT, PARTS, PRODUCTS, SHIFT, VOLUMES, close_block, drain, orthogonalise
from .passages import note_rush, take_back
from .propagators import TILE, TO, apply, larger, scale, settle, tabulate
from .records import *
from .stick_intervals import (
    apply_products,
    begin_interval,
    begin_products,
    close_batch,
    end_interval,
    interpolate_all,
    lay_out,
)

# --- kernel text below ---
# Steps between two scalings: a step's growth is bounded by its error, that of so many stays far from overflow.
BETWEEN_SCALINGS = 8
# Entry of the shared array: the length of the orbit's Taylor step.
LENGTH = 1
# Entry of `control`: how many times the tolerance of the orbit the modes are allowed.
LOOSENESS = 8


@njit(error_model="numpy")
def take_in(vectors, modes, registers, parts):
    """Put the deviations of a cell into registers."""
    for register in range(registers):
        for c in range(parts):
            for lane in range(LANES):
                modes[(parts * register + c) * LANES + lane] = vectors[c, register * LANES + lane]


@njit(error_model="numpy")
def hand_back(modes, powers, registers, vectors, growth, parts):
    """Write the deviations of a cell at unit length, and the logarithms of how much they have grown."""
    for register in range(registers):
        for lane in range(LANES):
            square = 0.0
            for c in range(parts):
                square += modes[(parts * register + c) * LANES + lane] ** 2
            length = math.sqrt(square)
            k = register * LANES + lane
            growth[k] = powers[k] * math.log(2.0) + math.log(length) if length != 0.0 else -math.inf
            for c in range(parts):
                value = modes[(parts * register + c) * LANES + lane]
                vectors[c, k] = value / length if length != 0.0 else 0.0


@njit(error_model="numpy")
def drop(modes, powers, registers, parts):
    """Set deviations to zero that have become too short for any tolerance."""
    for register in range(registers):
        short = load(powers, register, LANES) < GONE
        for c in range(parts):
            store(modes, parts * register + c, select(short, 0.0, load(modes, parts * register + c, LANES)))


@njit(error_model="numpy", forceinline=True)
def attempt(t, strengths, old, new, registers, orbit, tolerance, dims, functions):
    """Take one step of the orbit and its modes; return its length and the mask of acceptance.

    A Taylor step is as long as the series of the orbit and of all modes allow, or ends at the first event; it is rejected
    if a coefficient overflows.
    """
    clock, y, y_new, dense, shared = orbit.clock, orbit.y, orbit.y_new, orbit.dense, orbit.shared
    rtol, atol = orbit.control[RTOL], orbit.control[ATOL]
    if SERIES:
        limit = minimum(load(clock, STOP, WIDTH) - t, load(clock, LONGEST, WIDTH))
        length, reach = functions.step(t, limit, load(clock, STEP, WIDTH), y, y, y_new, dense, rtol, atol, shared)
        h, good = length, length > 0.0
        if any_lane(good):
            if CONTACTS:
                note_rush(good, t, length, clock)
                limit = select(length < reach, length, limit)
            store(shared, LENGTH, length)
            h = broadcast(functions.carry(shared, strengths, old, new, registers, tolerance), WIDTH)
            if any_lane(h < length):
                for c in range(dims.dimension):
                    store(y_new, c, inside(h / length, c, y, y_new, dense, dims))
        return h, accept_series(clock, h, limit)
    h = aim(clock)
    error = functions.step(t, h, y, y, y_new, dense, rtol, atol, shared)
    if any_lane(error <= 1.0) and registers > 0:
        worst = functions.carry(shared, strengths, old, new, registers - 1, registers, tolerance)
        if worst <= 1.0 and registers > 1:
            worst = larger(worst, functions.carry(shared, strengths, old, new, 0, registers - 1, tolerance))
        error = maximum(error, broadcast(worst if worst < 1e30 else 1e30, WIDTH))  # NaN is the largest
    accept = judge(clock, h, error, 1.0 / (dims.error_order + 1.0))
    if CONTACTS:
        accept = take_back(accept, Step(t, h, y, y_new, dense), clock, orbit.friction)
    return h, accept


@njit(error_model="numpy")
def renew(cell, spans, control, clock):
    """Let the next block begin at time 0 of the clock, with nothing in mind but a power of two as the step."""
    restart(0, clock)
    for group in (ACCEPTED, REJECTED, PERIODS):
        put(clock, group, 0, 0.0)
    watch(0, control, clock)
    begin(0, cell, spans, clock)


@njit(error_model="numpy")
def begin_deviations(cell, old, modes, orbit, dims, functions):
    """Let the deviations of a cell begin; return True if a contact sticks, which takes their velocities at once."""
    take_in(modes.vectors[cell], old, modes.registers, modes.parts)
    for k in range(modes.registers * LANES):
        modes.powers[k] = 0.0
    if CONTACTS:
        return begin_events_of_modes(old, modes, orbit, dims, functions)
    return False


@njit(error_model="numpy")
def cut_interval(carried, modes, nodes, panels, targets, stick):
    """End an interval at a landing, or propagators that have become too long; return the error and the deviations to go on with."""
    old, new, _, in_interval, landed, cut_at = carried
    error, fresh = 0.0, False
    if landed and in_interval:
        lay_out(old, modes.powers, modes.node_registers, nodes)
        error = end_interval(nodes, stick)
    else:
        error = interpolate_all(in_interval, old, modes, nodes, panels, targets, stick)
        fresh, in_interval = not landed, False
    if landed:
        if not in_interval:
            begin_products(targets, stick)
        begin_interval(old, modes.powers, modes.node_registers)
        in_interval = True
    return error, Carried(old, new, fresh, in_interval, False, cut_at)


@njit(error_model="numpy")
def take_step(taken, carried, modes, orbit, dims, functions):
    """Take one step; return the number of accepted ones, the largest modulus of the state, and the deviations."""
    old, new, fresh, in_interval, landed, cut_at = carried
    clock, y = orbit.clock, orbit.y
    active = modes.node_registers if in_interval else modes.registers
    strengths = modes.node_strengths if in_interval else modes.strengths
    still = in_interval and y[2 * dims.nodes] == 0.0  # a deviation of a body that sticks is constant
    moving, t = 0 if still else active, load(clock, TIME, WIDTH)
    h, accept = attempt(t, strengths, old, new, moving, orbit, modes.tolerance, dims, functions)
    t_new = arrive(clock, t, h)
    if any_lane(accept) and not still:
        old, new = new, old
        taken += 1
        if taken % BETWEEN_SCALINGS == 0:
            scale(old, modes.powers, active, modes.parts)
            if modes.framed:
                drop(old, modes.powers, active, modes.parts)
    largest = advance(clock, y, t, t_new, accept, orbit.y_new, dims)
    if CONTACTS:
        landed = pass_events(accept, t_new, strengths, old, active, modes, orbit, dims, functions) or landed
    if SERIES:
        wrap(clock)
    return taken, largest, Carried(old, new, fresh, in_interval, landed, cut_at)


@njit(error_model="numpy")
def run_block(cell, carried, rows, errors, modes, orbit, nodes, panels, targets, stick, dims, functions):
    """Integrate over one block of time; return the status of the orbit and the deviations."""
    clock, y, taken = orbit.clock, orbit.y, 0
    status = outcome(0, clock, y, rows.control, dims)
    while True:
        # 1. begin the deviations anew, or cut where a body has landed or the last cut is a block ago
        if carried.fresh:
            sticks = begin_deviations(cell, carried.old, modes, orbit, dims, functions)
            carried = Carried(carried.old, carried.new, False, False, carried.landed or sticks, carried.cut_at)
        if CONTACTS:  # noqa: SIM102  (Numba leaves out what a constant excludes)
            if stick.panels.shape[0] > 0:
                now = clock[BASE] + clock[TIME]
                long = now - carried.cut_at > rows.spans[cell, 1] and y[2 * dims.nodes] != 0.0
                if carried.landed or long:
                    error, cut = cut_interval(carried, modes, nodes, panels, targets, stick)
                    carried = Carried(cut.old, cut.new, cut.fresh, cut.in_interval, False, now)
                    errors[cell] = larger(errors[cell], error)
        # 2. end here, so that a landing in the last step is cut
        if status != 0:
            break
        if carried.fresh:
            continue
        # 3. one step; then look where the period or the block ends
        taken, largest, carried = take_step(taken, carried, modes, orbit, dims, functions)
        if lane_bits(pause(clock, largest)) != 0:
            status = outcome(0, clock, y, rows.control, dims)
            if status == 0 and clock[TIME] >= clock[BOUND]:
                turn_over(0, cell, rows.spans, rows.control, clock, y, dims)
                status = outcome(0, clock, y, rows.control, dims)
    return status, carried


@njit(error_model="numpy")
def apply_propagators(old, modes, nodes, panels, targets):
    """Move the deviations of all strengths by the propagators of a block; return the error of the interpolation."""
    columns, parts = nodes.columns, nodes.parts
    scale(old, modes.powers, modes.registers, parts)
    tabulate(old, modes.powers, nodes.places, nodes.nodes, columns, nodes.table, nodes.exponents, parts, nodes.stride)
    error = apply(
        panels.panels, panels.weights, nodes.table, nodes.exponents, targets.moved, targets.lifts,
        targets.found, columns, parts, nodes.stride,
    )  # fmt: skip
    scale(targets.moved, targets.lifts, targets.groups, parts)
    return error


@njit(error_model="numpy")
def load_strengths(strengths, places, modes, kinds):
    """Put the strengths of all deviations, and of one deviation of each node, into registers."""
    for node in range(places.shape[0]):
        for k in range(kinds):
            slot = (kinds * (node // LANES) + k) * LANES + node % LANES
            modes.node_strengths[slot] = strengths[k, int(places[node, 0])]
    for register in range(modes.registers):
        for k in range(kinds):
            for lane in range(LANES):
                modes.strengths[(kinds * register + k) * LANES + lane] = strengths[k, register * LANES + lane]


@njit(error_model="numpy")
def note_start(batch_start, y, moved, size, count):
    """Write the state and the deviations at the beginning of a batch."""
    for c in range(size):
        batch_start[c] = y[c]
    for k in range(count):
        batch_start[size + k] = moved[k]


@njit(error_model="numpy")
def turn_phase(cell, plan, spans, y, size):
    """Write the phase with which the next block of a frame begins."""
    if plan.size and plan[SHIFT] >= 0:
        y[size + plan[SHIFT]] = plan[NEXT] * spans[cell, 1]
        plan[NEXT] = (plan[NEXT] + 1) % plan[PARTS]


@njit(error_model="numpy")
def end_block_of_frame(cell, old, growth, gains, framing, orbit, modes, dims):
    """Make the directions of a frame orthogonal, and add the growth of directions and volume to `gains`."""
    (plan, frame), parts, vectors = framing, modes.parts, modes.vectors
    hand_back(old, modes.powers, modes.registers, vectors[cell], growth[cell], parts)
    stride = modes.registers * LANES
    lengths, products = address(frame, LENGTHS * frame.shape[1]), address(frame, PRODUCTS * frame.shape[1])
    orthogonalise(address(vectors, cell * parts * stride), parts, stride, frame.shape[1], lengths, products)
    volume = drain(orbit.y, dims.dimension, plan[VOLUMES])
    whole = plan[VOLUMES] > 0 and frame.shape[1] == parts
    close_block(growth[cell], volume, whole, orbit.control, frame, gains)


@njit(error_model="numpy")
def end_batch(at, goes_on, carried, modes, nodes, panels, targets, stick):
    """Write the growth of the deviations to `at` and begin the next batch at unit length; return the error."""
    error = 0.0
    if CONTACTS:  # noqa: SIM102
        if stick.panels.shape[0] > 0:
            if carried.in_interval and goes_on:
                # between two landings the components that the last one has left are enough
                close_batch(targets, at)
                return error, carried
            if not carried.fresh:
                error = interpolate_all(carried.in_interval, carried.old, modes, nodes, panels, targets, stick)
                old, new, _, in_interval, landed, cut_at = carried
                carried = Carried(old, new, not in_interval, in_interval, landed, cut_at)
    settle(
        targets.moved, targets.lifts, targets.groups, at, modes.parts, targets.kept, targets.kept_powers,
        carried.in_interval,
    )  # fmt: skip
    return error, carried


@njit(error_model="numpy", nogil=True, cache=True)
def march(functions, dims, first, last, inputs, deviations, outputs, propagation, framing):
    """Run the cells first … last-1, each an orbit with all modes.

    functions: those of a scene.  dims: the sizes of its arrays.

    inputs: start, values, spans, control as in a sweep.  outputs: end, sums, counts as in a sweep.

    deviations: strengths (dims.strengths, modes), the same for all cells, sorted by size; vectors (cells, mode, modes),
    deviations at the start; growth (cells, modes).  The number of modes is a multiple of LANES.

    propagation:
    batches (any): numbers of blocks that follow each other, each as long as spans tell and each with the same deviations at
    its start; the orbit goes on.  Without panels there is one block, and vectors are overwritten by the deviations at its
    end at unit length, growth by the logarithm of the length at the end, -inf for a deviation that has become zero.  With
    panels, places (nodes, columns) are the modes whose deviations are the columns of a propagator; panels and weights as
    in `propagators`.  targets (cells, registers of strengths * mode * LANES) are deviations of unit length that the
    propagators move from block to block; gains (cells, batches, strengths) are filled with the logarithm of their growth
    over each batch, errors (cells) with the largest error of the interpolation.
    intervals, shares (any): of bodies that stick, panels and weights that give the nodes of `panels` from the nodes that are
    integrated; where (nodes of panels): their places in registers.  Deviations are cut at landings then, not at the ends of
    blocks; every block of time they are moved to all strengths.
    batch_starts (cells, batches, any), or none: filled with the state and the deviations at the beginning of each batch.

    frame: plan (4) and frame (4, count), see `frames`, or none.  The first `count` deviations of a single cell are made
    orthogonal after each block; vectors are overwritten by the last ones.  gains (1, batches, count + 1) are filled with
    the growth of the directions and of the volume over each batch.
    """
    # Python passes plain tuples, whose types Numba finds faster than those of records
    start, values, spans, control = inputs
    strengths, vectors, growth = deviations
    end, sums, counts = outputs
    batches, places, panel_rows, weights, moving, gains, errors, interval_rows, shares, where, batch_starts = (
        propagation
    )
    plan, frame = framing
    rows, panels = Rows(start, values, spans, control), Panels(panel_rows, address(weights, 0))

    # 1. Workspace of the orbit.
    size, kinds, contact_size = dims.dimension, dims.strengths, dims.contacts
    lane_size, dense_size = CLOCK + lane_room(dims), dims.dense_rows * size + dims.workspace
    block = aligned(lane_size + 2 * size + dense_size + contact_size + dims.shared + size + dims.rows)
    clock, y, y_new = address(block, 0), address(block, CLOCK), address(block, lane_size)
    middle, dense = address(y_new, size), address(y_new, 2 * size)
    out = address(dense, dense_size)
    shared = address(out, contact_size)
    before = address(shared, dims.shared)
    impacts = address(y, lane_room(dims) - 2 * dims.rows)
    friction = EventWorkspace(middle, out, clock, address(control, 0), (), dims, functions, impacts)
    orbit = Orbit(clock, y, y_new, dense, shared, before, address(before, size), address(control, 0), friction)

    # 2. Workspace of the deviations, in registers.
    registers, parts, columns = growth.shape[1] // LANES, vectors.shape[1], places.shape[1]
    stride, groups = registers * LANES, 0 if plan.size else gains.shape[2] // LANES
    sticks, room = (
        interval_rows.shape[0] > 0,
        int(interval_rows[interval_rows.shape[0] - 1, TO]) * LANES if interval_rows.shape[0] else 0,
    )
    held = registers * (2 * parts + 2 + 2 * max(1, kinds) + columns * parts) + 3 * groups
    memory = aligned((held + parts * (1 + TILE * columns)) * LANES + 9 * room)
    old, new = address(memory, 0), address(memory, registers * parts * LANES)
    powers = address(new, registers * parts * LANES)
    mode_strengths = address(powers, registers * LANES)
    node_strengths = address(mode_strengths, registers * max(1, kinds) * LANES)
    exponents = address(node_strengths, registers * max(1, kinds) * LANES)
    table = address(exponents, registers * LANES)
    lifts = address(table, columns * parts * stride)
    kept, kept_powers = address(lifts, groups * LANES), address(lifts, 2 * groups * LANES)
    found = address(lifts, 3 * groups * LANES)
    share = address(found, parts * (1 + TILE * columns) * LANES)
    share_powers, fine = address(share, room), address(share, 2 * room)
    heights, work = address(share, 6 * room), address(share, 7 * room)
    count = places.shape[0]
    few = (count + LANES - 1) // LANES
    tolerance = control[RTOL] * control[LOOSENESS]
    modes = Modes(vectors, parts, tolerance, plan.size > 0, registers, few, powers, mode_strengths, node_strengths)
    nodes = Propagators(table, exponents, stride, address(places, 0), count, columns, parts)
    stick = StickIntervals(interval_rows, address(shares, 0), where, share, share_powers, fine, heights, work)
    load_strengths(strengths, places, modes, kinds)

    for cell in range(first, last):
        fill(0, cell, rows, clock, y, dims)
        status, begun, moved = FINISHED, False, address(moving, cell * groups * parts * LANES)
        targets, carried = (
            Targets(groups, moved, lifts, found, kept, kept_powers),
            Carried(old, new, True, False, False, 0.0),
        )
        for batch in range(batches.size):
            if batch_starts.shape[1]:
                note_start(batch_starts[cell, batch], y, moved, size, groups * parts * LANES)
            # 3. Blocks of time; after each, propagators move the deviations of all strengths.
            for _ in range(batches[batch]):
                if status != FINISHED:
                    break
                if begun:
                    renew(cell, spans, control, clock)
                begun = True
                turn_phase(cell, plan, spans, y, size)
                status, carried = run_block(
                    cell, carried, rows, errors, modes, orbit, nodes, panels, targets, stick, dims, functions
                )
                counts[cell, N_ACCEPTED] += int(clock[ACCEPTED])
                counts[cell, N_REJECTED] += int(clock[REJECTED])
                fresh = carried.fresh
                if not sticks:
                    fresh = True
                    if panel_rows.shape[0]:
                        error = apply_propagators(carried.old, modes, nodes, panels, targets)
                        errors[cell] = larger(errors[cell], error)
                if plan.size:
                    end_block_of_frame(cell, carried.old, growth, gains[cell, batch], (plan, frame), orbit, modes, dims)
                if CONTACTS:  # noqa: SIM102
                    if carried.in_interval:
                        errors[cell] = larger(errors[cell], apply_products(panels, targets, stick))
                cut_at = carried.cut_at - (clock[BASE] + clock[TIME])
                carried = Carried(carried.old, carried.new, fresh, carried.in_interval, carried.landed, cut_at)
            # 4. The end of a batch: growth of the deviations, which begin the next one at unit length.
            if panel_rows.shape[0]:
                at = address(gains, (cell * batches.size + batch) * groups * LANES)
                goes_on = batch < batches.size - 1 and not batch_starts.shape[1]
                error, carried = end_batch(at, goes_on, carried, modes, nodes, panels, targets, stick)
                errors[cell] = larger(errors[cell], error)
        # 5. The end of the cell.
        if not panel_rows.shape[0] and not plan.size:
            hand_back(carried.old, powers, registers, vectors[cell], growth[cell], parts)
        for c in range(dims.dimension):
            end[cell, c] = y[c]
        sums[cell, STOPPED_AT] = clock[BASE] + clock[TIME]
        counts[cell, STATUS] = status
    block[0] = memory[0] = 0.0  # the memory behind the addresses is held until here
