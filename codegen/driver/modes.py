"""One orbit after the other, each with all its modes: the driver of the kernels that carry deviations along an orbit.

A deviation grows or shrinks by any factor, so it is scaled by a power of two every few steps, which is
exact; the powers are counted.  Step sizes follow the errors of the orbit and of all modes.  Callers
sort modes by the size of their strength: the last register is stepped first, and if its error is too
large, no other one is.  Taylor steps follow the series of the orbit and of all modes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.addresses import address
from ..simd.lanes import any_lane, broadcast, lane_bits, load, maximum, minimum, select, store
from .cells import REPEATING, aligned, begin, fill, outcome, put, restart, turn_over, watch
from .clock_slots import *
from .contacts import change_modes, note_rush, take_back
from .control import accept_series, advance, aim, arrive, judge, pause, wrap
from .dense import inside
from .landings import begin_leg, begin_products, bring, close_batch, hand_over, land, lay_out
from .propagators import TILE, TO, apply, larger, scale, settle, tabulate

# --- kernel text below ---
# Steps between two scalings: a step's growth is bounded by its error, that of so many stays far from overflow.
BETWEEN_SCALINGS = 8
# Entry of the shared array: the length of the orbit's Taylor step.
LENGTH = 1
# Entry of `control`: how many times the tolerance of the orbit the modes are allowed.
LOOSENESS = 8


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
        limit = minimum(load(clock, STOP, WIDTH) - t, load(clock, LONGEST, WIDTH))
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
    h = aim(clock)
    error = functions.step(t, h, y, y, y_new, dense, steering[RTOL], steering[ATOL], shared)
    if any_lane(error <= 1.0) and registers > 0:
        worst = functions.carry(shared, strengths, old, new, registers - 1, registers, tolerance)
        if worst <= 1.0 and registers > 1:
            worst = larger(worst, functions.carry(shared, strengths, old, new, 0, registers - 1, tolerance))
        error = maximum(error, broadcast(worst if worst < 1e30 else 1e30, WIDTH))  # NaN is the largest
    accept = judge(clock, h, error, 1.0 / (dims.error_order + 1.0))
    if CONTACTS:
        accept = take_back(accept, t, h, clock, y, y_new, dense, middle, out, (), dims, functions.pushes)
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
    batches, places, panels, weights, travellers, gains, misfits, legs, shares, where, tracks,
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

    legs, shares (any): of bodies that stick, panels and weights that give the nodes of `panels` from the nodes that are
    integrated; where (nodes of panels): their places in registers.  Deviations are cut at landings then, not at the ends of
    blocks; every block of time they are moved to all strengths.

    tracks (cells, batches, any), or none: filled with the state and the deviations at the beginning of each batch.
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
    sticks, room = legs.shape[0] > 0, int(legs[legs.shape[0] - 1, TO]) * LANES if legs.shape[0] else 0
    held = registers * (2 * parts + 2 + 2 * max(1, kinds) + columns * parts) + 3 * groups
    deviations = aligned((held + parts * (1 + TILE * columns)) * LANES + 9 * room)
    old, new = address(deviations, 0), address(deviations, registers * parts * LANES)
    powers = address(new, registers * parts * LANES)
    strong = address(powers, registers * LANES)
    alone = address(strong, registers * max(1, kinds) * LANES)  # strengths, of one deviation for each node
    exponents = address(alone, registers * max(1, kinds) * LANES)
    table = address(exponents, registers * LANES)
    lifts = address(table, columns * parts * stride)
    kept, kept_powers = address(lifts, groups * LANES), address(lifts, 2 * groups * LANES)
    found = address(lifts, 3 * groups * LANES)
    share = address(found, parts * (1 + TILE * columns) * LANES)
    share_powers, fine = address(share, room), address(share, 2 * room)
    heights, work = address(share, 6 * room), address(share, 7 * room)
    ways = (legs, address(shares, 0), where)
    products = (share, share_powers, fine, heights, work, kept, kept_powers)
    nodes, spots, given = places.shape[0], address(places, 0), address(weights, 0)
    few, left = (nodes + LANES - 1) // LANES, 1 if owners[0] >= 0 else 0
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
        parted, fresh, landed, cut_at = False, True, False, 0.0
        for batch in range(batches.size):
            if tracks.shape[1]:
                for c in range(size):
                    tracks[cell, batch, c] = y[c]
                for k in range(groups * parts * LANES):
                    tracks[cell, batch, size + k] = moved[k]
            for _ in range(batches[batch]):
                if status != FINISHED:
                    break
                if begun:
                    renew(cell, spans, control, clock)
                begun, taken, status = True, 0, outcome(0, clock, y, control, dims)
                while True:
                    if fresh:
                        take_in(vectors[cell], old, registers, parts)
                        for k in range(registers * LANES):
                            powers[k] = 0.0
                        active, carried, parted, fresh = registers, strong, False, False
                        if CONTACTS:
                            for i in range(dims.nodes):
                                if y[2 * dims.nodes + i] == 0.0:  # a velocity beside that of the ground is lost at once
                                    brake(i, 0.0, old, registers, owners)
                                    landed = True
                    if CONTACTS:  # noqa: SIM102  (Numba leaves out what a constant excludes)
                        if sticks:
                            now, error = clock[BASE] + clock[TIME], 0.0
                            long = now - cut_at > spans[cell, 1] and y[2 * dims.nodes] != 0.0
                            if landed and parted:
                                lay_out(old, powers, few, table, exponents, stride)
                                error = land(table, exponents, stride, left, ways, products)
                            elif landed or long:
                                error = bring(
                                    parted, old, powers, spots, few, nodes, table, exponents, stride, panels, given,
                                    ways, products, moved, lifts, found, groups,
                                )  # fmt: skip
                                fresh, parted = not landed, False
                            if landed:
                                if not parted:
                                    begin_products(moved, lifts, left, legs, products, groups)
                                begin_leg(old, powers, few, left)
                                parted, active, carried = True, few, alone
                            if landed or long:
                                misfits[cell], cut_at, landed = larger(misfits[cell], error), now, False
                    if status != 0:
                        break
                    if fresh:
                        continue
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
                if not sticks:
                    fresh = True
                    if panels.shape[0]:
                        scale(old, powers, registers, parts)
                        tabulate(old, powers, spots, nodes, columns, table, exponents, parts, stride)
                        error = apply(panels, given, table, exponents, moved, lifts, found, columns, parts, stride)
                        misfits[cell] = larger(misfits[cell], error)
                        scale(moved, lifts, groups, parts)
                if CONTACTS:  # noqa: SIM102
                    if parted:
                        misfits[cell] = larger(misfits[cell], hand_over(panels, given, ways, products, groups))
                cut_at -= clock[BASE] + clock[TIME]
            if panels.shape[0]:
                at = address(gains, (cell * batches.size + batch) * groups * LANES)
                if CONTACTS:
                    if sticks and parted and batch < batches.size - 1 and not tracks.shape[1]:
                        close_batch(groups, products, at)
                        continue
                    if sticks and not fresh:
                        error = bring(
                            parted, old, powers, spots, few, nodes, table, exponents, stride, panels, given, ways,
                            products, moved, lifts, found, groups,
                        )  # fmt: skip
                        misfits[cell], fresh = larger(misfits[cell], error), not parted
                settle(moved, lifts, groups, at, parts, kept, kept_powers, parted)
        if not panels.shape[0]:
            hand_back(old, powers, registers, vectors[cell], growth[cell], parts)
        for c in range(dims.dimension):
            end[cell, c] = y[c]
        sums[cell, STOPPED_AT] = clock[BASE] + clock[TIME]
        counts[cell, STATUS] = status
    block[0] = deviations[0] = 0.0  # the memory behind the addresses is held until here
