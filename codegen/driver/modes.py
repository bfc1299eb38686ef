"""One orbit after the other, each with all its modes: the driver of the kernels that carry deviations along an orbit.

A deviation grows or shrinks by any factor, so it is scaled by a power of two every few steps, which is
exact; the powers are counted.  Step sizes follow the errors of the orbit and of the modes in the
first and the last register: callers sort modes by the size of their strength, so that the fastest
modes are watched.
"""

# ruff: noqa: I001  (the long lists of names stay short)
from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.lanes import absolute
from ..simd.lanes import any_lane
from ..simd.lanes import broadcast
from ..simd.lanes import lane_bits
from ..simd.lanes import load
from ..simd.lanes import maximum
from ..simd.lanes import scale_binary
from ..simd.lanes import select
from ..simd.lanes import split_binary
from ..simd.lanes import store
from .cells import SLOTS
from .cells import aligned
from .cells import fill
from .cells import outcome
from .cells import turn_over
from .contacts import change_modes
from .contacts import take_back
from .control import advance
from .control import aim
from .control import arrive
from .control import judge
from .control import pause
from .names import CONTACTS
from .names import DENSE_ROWS
from .names import DIMENSION
from .names import ERROR_ORDER
from .names import JUMPS
from .names import LANES
from .names import MODE_SIZE
from .names import NODES
from .names import OWNERS
from .names import SHARED
from .names import STRENGTHS
from .names import WIDTH
from .names import mode_step
from .names import release
from .names import step
from .recording import ACCEPTED
from .recording import ATOL
from .recording import BASE
from .recording import N_ACCEPTED
from .recording import N_REJECTED
from .recording import PERIOD
from .recording import REJECTED
from .recording import RTOL
from .recording import STATUS
from .recording import STOPPED_AT
from .recording import TIME

# --- kernel text below ---
# Steps between two scalings: a step's growth is bounded by its error, that of so many stays far from overflow.
BETWEEN_SCALINGS = 8
# Entry of `control`: how many times the tolerance of the orbit the modes are allowed.
LOOSENESS = 8


@njit(error_model="numpy")
def watched(shared, strengths, old, new, which, rtol):
    """Step the modes of one register and return the largest of their errors, in units of the tolerance of each."""
    error, size = mode_step(shared, strengths, old, new, which)
    ratios = np.empty(LANES)
    store(ratios, 0, error / (rtol * size + 2.2250738585072014e-308))
    worst = 0.0
    for lane in range(LANES):
        if not ratios[lane] <= worst:  # NaN too
            worst = ratios[lane]
    return worst


@njit(error_model="numpy")
def scale(modes, powers, registers):
    """Scale every deviation by a power of two to a size between 1 and 2; a deviation of zero stays zero."""
    for which in range(registers):
        size = absolute(load(modes, MODE_SIZE * which, LANES))
        for c in range(1, MODE_SIZE):
            size = maximum(size, absolute(load(modes, MODE_SIZE * which + c, LANES)))
        normal = (size > 1e-290) & (size < 1e290)
        _, power = split_binary(select(normal, size, 1.0), 1.0)
        for c in range(MODE_SIZE):
            value = load(modes, MODE_SIZE * which + c, LANES)
            store(modes, MODE_SIZE * which + c, value * scale_binary(broadcast(1.0, LANES), 6755399441055744.0 - power))
        store(powers, which, load(powers, which, LANES) + power)


@njit(error_model="numpy")
def brake(i, factor, modes, registers):
    """Multiply the velocities of deviations at contact i."""
    for which in range(registers):
        for c in range(MODE_SIZE):
            if OWNERS[c] == i:
                store(modes, MODE_SIZE * which + c, factor * load(modes, MODE_SIZE * which + c, LANES))


@njit(error_model="numpy")
def saltate(i, before, bank, out, strengths, modes, registers):
    """What an event of contact i does to deviations; `before` is its mode before."""
    after = bank[2 * NODES + i]
    if before == 0.0:
        if JUMPS:
            for which in range(registers):
                release(i, after, bank[TIME], bank, strengths, modes, which)
        return
    pushed, pulled = out[4 * NODES + i], out[5 * NODES + i]
    brake(i, 0.0 if after == 0.0 else pushed / pulled if after > 0.0 else pulled / pushed, modes, registers)


@njit(error_model="numpy")
def take_in(vectors, modes, registers):
    """Put the deviations of a cell into registers."""
    for which in range(registers):
        for c in range(MODE_SIZE):
            for lane in range(LANES):
                modes[(MODE_SIZE * which + c) * LANES + lane] = vectors[c, which * LANES + lane]


@njit(error_model="numpy")
def hand_back(modes, powers, registers, vectors, growth):
    """Write the deviations of a cell at unit length, and the logarithms of how much they have grown."""
    for which in range(registers):
        for lane in range(LANES):
            square = 0.0
            for c in range(MODE_SIZE):
                square += modes[(MODE_SIZE * which + c) * LANES + lane] ** 2
            length = math.sqrt(square)
            k = which * LANES + lane
            growth[k] = powers[k] * math.log(2.0) + math.log(length) if length != 0.0 else -math.inf
            for c in range(MODE_SIZE):
                value = modes[(MODE_SIZE * which + c) * LANES + lane]
                vectors[c, k] = value / length if length != 0.0 else 0.0


@njit(error_model="numpy", nogil=True, cache=True)
def march(first, last, start, numbers, spans, control, strengths, vectors, growth, end, sums, counts, samples):
    """Run the cells first … last-1, each an orbit with all modes.

    start, numbers, spans, control, end, sums, counts as in a sweep.  strengths (STRENGTHS, modes): the same for all
    cells, sorted by size; vectors (cells, MODE_SIZE, modes): deviations at the start, overwritten by those at the end at
    unit length; growth (cells, modes): filled with the logarithm of the length at the end, -inf for a deviation that has
    become zero. The number of modes is a multiple of LANES.  samples is not used.
    """
    registers = growth.shape[1] // LANES
    y_new, bank, shared = aligned(DIMENSION), aligned(SLOTS), aligned(SHARED)
    old, new = aligned(registers * MODE_SIZE * LANES), aligned(registers * MODE_SIZE * LANES)
    dense, middle, out = aligned(DENSE_ROWS * DIMENSION), aligned(DIMENSION), aligned(9 * NODES)
    slips = np.zeros(NODES)
    powers, strong = aligned(registers * LANES), aligned(registers * max(1, STRENGTHS) * LANES)
    for which in range(registers):
        for k in range(STRENGTHS):
            for lane in range(LANES):
                strong[(STRENGTHS * which + k) * LANES + lane] = strengths[k, which * LANES + lane]
    tolerance = control[RTOL] * control[LOOSENESS]
    for cell in range(first, last):
        fill(0, cell, start, numbers, spans, control, bank, samples)
        take_in(vectors[cell], old, registers)
        if CONTACTS:
            for i in range(NODES):
                if bank[2 * NODES + i] == 0.0:
                    brake(i, 0.0, old, registers)  # a velocity beside that of the ground is lost at once
        powers[:] = 0.0
        status, taken = outcome(0, bank, control), 0
        while status == 0:
            t, h = load(bank, TIME, WIDTH), aim(bank, control)
            error = step(t, h, bank, bank, y_new, dense, control[RTOL], control[ATOL], shared)
            if any_lane(error <= 1.0):
                worst = watched(shared, strong, old, new, registers - 1, tolerance)
                if worst <= 1.0 and registers > 1:
                    worst = max(worst, watched(shared, strong, old, new, 0, tolerance))
                error = maximum(error, broadcast(worst, WIDTH))
            t_new = arrive(bank, t, h)
            accept = judge(bank, h, error, 1.0 / (ERROR_ORDER + 1.0))
            if CONTACTS:
                accept = take_back(accept, t, h, bank, y_new, dense, middle, out, ())
            if any_lane(accept):
                for which in range(1, registers - 1):
                    mode_step(shared, strong, old, new, which)
                old, new = new, old
                taken += 1
                if taken % BETWEEN_SCALINGS == 0:
                    scale(old, powers, registers)
            advance(bank, t, t_new, accept, y_new)
            if CONTACTS:
                for i in range(NODES):
                    slips[i] = bank[2 * NODES + i]
                change_modes(accept, t_new, bank, out, ())
                for i in range(NODES):
                    if bank[2 * NODES + i] != slips[i]:
                        saltate(i, slips[i], bank, out, strong, old, registers)
            if lane_bits(pause(bank, control)) != 0:
                status = outcome(0, bank, control)
                if status == 0 and bank[TIME] >= bank[PERIOD]:
                    turn_over(0, cell, spans, control, bank)
                    status = outcome(0, bank, control)
        hand_back(old, powers, registers, vectors[cell], growth[cell])
        for c in range(DIMENSION):
            end[cell, c] = bank[c]
        sums[cell, STOPPED_AT] = bank[BASE] + bank[TIME]
        counts[cell, STATUS] = status
        counts[cell, N_ACCEPTED] = int(bank[ACCEPTED])
        counts[cell, N_REJECTED] = int(bank[REJECTED])
