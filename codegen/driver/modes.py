"""One orbit after the other, each with all its modes: the driver of the kernels that carry deviations along an orbit.

A deviation grows or shrinks by any factor, so it is scaled by a power of two every few steps, which is
exact; the powers are counted.  Step sizes follow the errors of the orbit and of the modes in the
first and the last register: callers sort modes by the size of their strength, so that the fastest
modes are watched.  Taylor steps follow the series of the orbit and of all modes.
"""

# ruff: noqa: I001  (the long lists of names stay short)
from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.addresses import address
from ..simd.lanes import absolute
from ..simd.lanes import any_lane
from ..simd.lanes import broadcast
from ..simd.lanes import lane_bits
from ..simd.lanes import load
from ..simd.lanes import maximum
from ..simd.lanes import minimum
from ..simd.lanes import scale_binary
from ..simd.lanes import select
from ..simd.lanes import split_binary
from ..simd.lanes import store
from .cells import REPEATING
from .cells import aligned
from .cells import begin
from .cells import fill
from .cells import outcome
from .cells import put
from .cells import restart
from .cells import turn_over
from .cells import watch
from .clock import ACCEPTED
from .clock import ATOL
from .clock import BASE
from .clock import BOUND
from .clock import CLOCK
from .clock import FINISHED
from .clock import MAX_STEP
from .clock import N_ACCEPTED
from .clock import N_REJECTED
from .clock import PERIODS
from .clock import REJECTED
from .clock import RTOL
from .clock import STATUS
from .clock import STEP
from .clock import STOP
from .clock import STOPPED_AT
from .clock import TIME
from .contacts import change_modes
from .contacts import note_rush
from .contacts import take_back
from .control import accept_series
from .control import advance
from .control import aim
from .control import arrive
from .control import judge
from .control import pause
from .control import wrap
from .dense import inside
from .names import CONTACTS
from .names import LANES
from .names import SERIES
from .names import WIDTH
from .propagators import NODE
from .propagators import PANEL
from .propagators import POINTS
from .propagators import TILE
from .propagators import EXTRAS
from .propagators import join
from .propagators import larger
from .propagators import level
from .propagators import misfit
from .propagators import part
from .propagators import settle
from .propagators import tabulate
from .propagators import transport

# --- kernel text below ---
# Steps between two scalings: a step's growth is bounded by its error, that of so many stays far from overflow.
BETWEEN_SCALINGS = 8
# Entry of the shared array: the length of the orbit's Taylor step.
LENGTH = 1
# Entry of `control`: how many times the tolerance of the orbit the modes are allowed.
LOOSENESS = 8


@njit(error_model="numpy")
def watched(shared, strengths, old, new, which, rtol, carry):
    """Step the modes of one register and return the largest of their errors, in units of the tolerance of each."""
    error, size = carry(shared, strengths, old, new, which, which + 1)
    ratios = np.empty(LANES)
    store(ratios, 0, error / (rtol * size + 2.2250738585072014e-308))
    worst = 0.0
    for lane in range(LANES):
        if not ratios[lane] <= worst:  # NaN too
            worst = ratios[lane]
    return worst


@njit(error_model="numpy")
def scale(modes, powers, registers, parts):
    """Scale every deviation by a power of two to a size between 1 and 2; a deviation of zero stays zero."""
    for which in range(registers):
        size = absolute(load(modes, parts * which, LANES))
        for c in range(1, parts):
            size = maximum(size, absolute(load(modes, parts * which + c, LANES)))
        normal = (size > 1e-290) & (size < 1e290)
        _, power = split_binary(select(normal, size, 1.0), 1.0)
        for c in range(parts):
            value = load(modes, parts * which + c, LANES)
            store(modes, parts * which + c, value * scale_binary(broadcast(1.0, LANES), 6755399441055744.0 - power))
        store(powers, which, load(powers, which, LANES) + power)


@njit(error_model="numpy")
def brake(i, factor, modes, registers, owners):
    """Multiply the velocities of deviations at contact i."""
    for which in range(registers):
        for c in range(owners.size):
            if owners[c] == i:
                store(modes, owners.size * which + c, factor * load(modes, owners.size * which + c, LANES))


@njit(error_model="numpy")
def saltate(i, before, time, y, out, strengths, modes, registers, owners, dims, release):
    """What an event of contact i does to deviations; `before` is its mode before."""
    after = y[2 * dims.nodes + i]
    if before == 0.0:
        if dims.jumps:
            for which in range(registers):
                release(i, after, time, y, strengths, modes, which)
        return
    pushed, pulled = out[4 * dims.nodes + i], out[5 * dims.nodes + i]
    brake(i, 0.0 if after == 0.0 else pushed / pulled if after > 0.0 else pulled / pushed, modes, registers, owners)


@njit(error_model="numpy")
def take_in(vectors, modes, registers, parts):
    """Put the deviations of a cell into registers."""
    for which in range(registers):
        for c in range(parts):
            for lane in range(LANES):
                modes[(parts * which + c) * LANES + lane] = vectors[c, which * LANES + lane]


@njit(error_model="numpy")
def hand_back(modes, powers, registers, vectors, growth, parts):
    """Write the deviations of a cell at unit length, and the logarithms of how much they have grown."""
    for which in range(registers):
        for lane in range(LANES):
            square = 0.0
            for c in range(parts):
                square += modes[(parts * which + c) * LANES + lane] ** 2
            length = math.sqrt(square)
            k = which * LANES + lane
            growth[k] = powers[k] * math.log(2.0) + math.log(length) if length != 0.0 else -math.inf
            for c in range(parts):
                value = modes[(parts * which + c) * LANES + lane]
                vectors[c, k] = value / length if length != 0.0 else 0.0


@njit(error_model="numpy", forceinline=True)
def attempt(
    t, clock, y, y_new, dense, middle, out, steering, shared, strengths, old, new, registers, tolerance, dims, functions,
):  # fmt: skip
    """One step of the orbit and its modes; returns its length and whether it is accepted.

    A Taylor step is as long as the series of the orbit and of all modes allow, or ends at the first event; it is rejected
    if a coefficient overflows.
    """
    if SERIES:
        limit = minimum(load(clock, STOP, WIDTH) - t, steering[MAX_STEP])
        own, reach = functions.step(
            t, limit, load(clock, STEP, WIDTH), y, y, y_new, dense, steering[RTOL], steering[ATOL], shared
        )
        h, good = own, own > 0.0
        if any_lane(good):
            if CONTACTS:
                note_rush(good, t, own, clock)
                limit = select(own < reach, own, limit)
            store(shared, LENGTH, own)
            h = broadcast(functions.carry(shared, strengths, old, new, registers, tolerance), WIDTH)
            if any_lane(h < own):
                for c in range(dims.dimension):
                    store(y_new, c, inside(h / own, c, y, y_new, dense, dims))
        return h, accept_series(clock, h, limit)
    h = aim(clock, steering)
    error = functions.step(t, h, y, y, y_new, dense, steering[RTOL], steering[ATOL], shared)
    if any_lane(error <= 1.0) and registers > 0:
        worst = watched(shared, strengths, old, new, registers - 1, tolerance, functions.carry)
        if worst <= 1.0 and registers > 1:
            worst = max(worst, watched(shared, strengths, old, new, 0, tolerance, functions.carry))
        error = maximum(error, broadcast(worst, WIDTH))
    accept = judge(clock, h, error, 1.0 / (dims.error_order + 1.0))
    if CONTACTS:
        accept = take_back(accept, t, h, clock, y, y_new, dense, middle, out, (), dims, functions.pushes)
    if any_lane(accept):
        functions.carry(shared, strengths, old, new, 1, registers - 1)
    return h, accept


@njit(error_model="numpy")
def renew(cell, spans, control, clock):
    """Let the next block begin at time 0 of the clock, with nothing in mind but a power of two as the step."""
    restart(0, clock)
    for group in (ACCEPTED, REJECTED, PERIODS):
        put(clock, group, 0, 0.0)
    watch(0, control, clock)
    begin(0, cell, spans, clock)


@njit(error_model="numpy", nogil=True, cache=True)
def march(
    functions, dims, owners, first, last, start, numbers, spans, control, strengths, vectors, growth, end, sums, counts,
    batches, places, panels, weights, travellers, gains, misfits,
):  # fmt: skip
    """Run the cells first … last-1, each an orbit with all modes.

    functions: those of a scene.  dims: the sizes of its arrays.  owners (mode): the contact that each component of a
    deviation is a velocity of, -1 for the others.
    start, numbers, spans, control, end, sums, counts as in a sweep.  strengths (dims.strengths, modes): the same for all
    cells, sorted by size; vectors (cells, mode, modes): deviations at the start.  The number of modes is a multiple of
    LANES.

    batches (any): how many blocks follow each other, each as long as spans say and each with the same deviations at its
    start; the orbit goes on.  Without panels there is one block, and vectors are overwritten by the deviations at its end
    at unit length, growth (cells, modes) by the logarithm of the length at the end, -inf for a deviation that has become
    zero.  With panels, places (nodes, columns) are the modes whose deviations are the columns of a propagator; weights
    and panels as in `propagators`.  travellers (cells, registers of strengths * mode * LANES) are deviations of unit
    length that the propagators move from block to block; gains (cells, batches, strengths) are filled with the logarithm
    of their growth over each batch, misfits (cells) with the largest error of the interpolation.
    """
    registers, parts, kinds = growth.shape[1] // LANES, owners.size, dims.strengths
    size, steering, slips = dims.dimension, address(control, 0), np.zeros(dims.nodes)
    orbit = CLOCK + 2 * size + dims.parameters + len(REPEATING)
    rows = dims.dense_rows * size + dims.workspace
    block = aligned(orbit + 2 * size + rows + 9 * dims.nodes + 2 + dims.shared)
    clock, y, y_new = address(block, 0), address(block, CLOCK), address(block, orbit)
    middle, dense = address(y_new, size), address(y_new, 2 * size)
    out = address(dense, rows)
    shared = address(out, 9 * dims.nodes + 2)
    columns, stride, groups = places.shape[1], registers * LANES, gains.shape[2] // LANES
    room = registers * (2 * parts + 2 + max(1, kinds) + columns * parts) + groups + parts * (1 + TILE * columns)
    deviations = aligned((room + registers * (4 + max(1, kinds))) * LANES)
    old, new = address(deviations, 0), address(deviations, registers * parts * LANES)
    powers = address(new, registers * parts * LANES)
    strong = address(powers, registers * LANES)
    exponents = address(strong, registers * max(1, kinds) * LANES)
    table = address(exponents, registers * LANES)
    lifts = address(table, columns * parts * stride)
    found = address(lifts, groups * LANES)
    heads = address(found, parts * (1 + TILE * columns) * LANES)
    head_powers = address(heads, stride)
    alone = address(head_powers, stride)  # strengths, of one deviation for each node
    nodes, spots, given = places.shape[0], address(places, 0), address(weights, 0)
    few, left = (nodes + LANES - 1) // LANES, 1 if owners[0] >= 0 else 0
    narrow = panels.shape[0] > 0 and columns == 2 and parts == 2
    for node in range(nodes):
        for k in range(kinds):
            alone[(kinds * (node // LANES) + k) * LANES + node % LANES] = strengths[k, int(places[node, 0])]
    for which in range(registers):
        for k in range(kinds):
            for lane in range(LANES):
                strong[(kinds * which + k) * LANES + lane] = strengths[k, which * LANES + lane]
    tolerance = control[RTOL] * control[LOOSENESS]
    for cell in range(first, last):
        fill(0, cell, start, numbers, spans, control, clock, y, dims)
        status, begun, moved = FINISHED, False, address(travellers, cell * groups * parts * LANES)
        for batch in range(batches.size):
            for _ in range(batches[batch]):
                if status != FINISHED:
                    break
                if begun:
                    renew(cell, spans, control, clock)
                begun = True
                take_in(vectors[cell], old, registers, parts)
                for k in range(registers * LANES):
                    powers[k] = 0.0
                active, carried, landed, parted = registers, strong, False, False
                if CONTACTS:
                    for i in range(dims.nodes):
                        if y[2 * dims.nodes + i] == 0.0:
                            brake(
                                i, 0.0, old, registers, owners
                            )  # a velocity beside that of the ground is lost at once
                            landed = True
                status, taken = outcome(0, clock, y, control, dims), 0
                while status == 0:
                    if CONTACTS:  # noqa: SIM102  (Numba leaves out what a constant excludes)
                        if narrow and landed and not parted:
                            part(old, powers, spots, nodes, left, heads, head_powers, new, few)
                            old, new, active, carried, parted = new, old, few, alone, True
                    still = parted and y[2 * dims.nodes] == 0.0  # a place that sticks stays
                    moving, t = 0 if still else active, load(clock, TIME, WIDTH)
                    h, accept = attempt(
                        t, clock, y, y_new, dense, middle, out, steering, shared, carried, old, new, moving, tolerance,
                        dims, functions,
                    )  # fmt: skip
                    t_new = arrive(clock, t, h)
                    if any_lane(accept) and not still:
                        old, new = new, old
                        taken += 1
                        if taken % BETWEEN_SCALINGS == 0:
                            scale(old, powers, active, parts)
                    largest = advance(clock, y, t, t_new, accept, y_new, dims)
                    if CONTACTS:
                        for i in range(dims.nodes):
                            slips[i] = y[2 * dims.nodes + i]
                        change_modes(accept, t_new, y, out, (), dims, functions.pushes)
                        for i in range(dims.nodes):
                            if y[2 * dims.nodes + i] != slips[i]:
                                saltate(
                                    i, slips[i], clock[TIME], y, out, carried, old, active, owners, dims,
                                    functions.release,
                                )  # fmt: skip
                                landed = landed or y[2 * dims.nodes + i] == 0.0
                    if SERIES:
                        wrap(clock)
                    if lane_bits(pause(clock, largest)) != 0:
                        status = outcome(0, clock, y, control, dims)
                        if status == 0 and clock[TIME] >= clock[BOUND]:
                            turn_over(0, cell, spans, control, clock, y, dims)
                            status = outcome(0, clock, y, control, dims)
                counts[cell, N_ACCEPTED] += int(clock[ACCEPTED])
                counts[cell, N_REJECTED] += int(clock[REJECTED])
                if panels.shape[0]:
                    if CONTACTS:  # noqa: SIM102
                        if parted:
                            join(old, powers, spots, nodes, heads, head_powers, new)
                            old, new = new, old
                    scale(old, powers, registers, parts)
                    tabulate(old, powers, spots, nodes, columns, table, exponents, parts, stride)
                    for k in range(panels.shape[0]):
                        panel = address(panels, len(PANEL) * k)
                        points = int(panel[POINTS])
                        if points:
                            level(
                                int(panel[NODE]), points + int(panel[EXTRAS]), table, exponents, columns * parts, stride
                            )  # fmt: skip
                            misfits[cell] = larger(misfits[cell], misfit(panel, given, table, columns, parts, stride))
                        transport(panel, given, table, exponents, moved, lifts, found, columns, parts, stride)
                    scale(moved, lifts, groups, parts)
            if panels.shape[0]:
                settle(moved, lifts, groups, address(gains, (cell * batches.size + batch) * groups * LANES), parts)
        if not panels.shape[0]:
            hand_back(old, powers, registers, vectors[cell], growth[cell], parts)
        for c in range(dims.dimension):
            end[cell, c] = y[c]
        sums[cell, STOPPED_AT] = clock[BASE] + clock[TIME]
        counts[cell, STATUS] = status
    block[0] = deviations[0] = 0.0  # the memory behind the addresses is held until here
