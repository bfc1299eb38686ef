"""What a kernel records along the way: synchronisation error, section points and samples of the trajectory."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.lanes import absolute, any_lane, broadcast, lane_bits, load, maximum, select, sqrt, store
from .names import COMPONENTS, DENSE_ROWS, DIMENSION, MULTIPLICITY, NODES, PARAMETERS, WEIGHTED, WIDTH, section

# --- kernel text below ---
# A bank holds the cells in the lanes of one group: the state, the parameters, then what the drive remembers about each.
# Times count from BASE, the beginning of the current period of the drive, so that they keep their digits in long runs.
FIRST = DIMENSION + PARAMETERS
TIME, STEP, STOP, START, END, MEMORY, CHANGE, ACCEPTED, REJECTED = (FIRST + k for k in range(9))
SYNC, SYNC_SUM, SYNC_PEAK, NEXT_SAMPLE, SAMPLE_GAP, BASE, PERIOD, PERIODS = (FIRST + k for k in range(9, 17))
MODE, SMOOTH_STEPS, POWER, LAG, CYCLE, LEFT, SUM_BEFORE, SKIPPED = (FIRST + k for k in range(17, 25))
RUSH = FIRST + 25
SAVED = FIRST + 26
# How a cell ended.
FINISHED, BUDGET, UNDERFLOW, DIVERGED, INTERRUPTED, CHATTERING = 1, 2, 3, 4, 5, 6
# Columns of `control`, of `sums` and of `counts`.
RTOL, ATOL, FIRST_STEP, MAX_STEP, MAX_STEPS, DIRECTION, CANCEL, NO_JUMPS = 0, 1, 2, 3, 4, 5, 6, 7
MEAN, PEAK, LAST, STOPPED_AT = 0, 1, 2, 3
STATUS, N_ACCEPTED, N_REJECTED, N_POINTS, N_SKIPPED, N_SMOOTH = 0, 1, 2, 3, 4, 5
# So many events in a row without time passing are chattering.
LONGEST_RUSH = 200.0
# A state of this size, 2^53, has diverged: its neighbours are further apart than anything that happens at size one.
FAR = 9007199254740992.0
# The two ways to step.
STIFF, SMOOTH = 0, 1
ALL = (1 << WIDTH) - 1


@njit(error_model="numpy", forceinline=True)
def inside(theta, c, bank, y_new, dense):
    """State variable c at the fraction theta of the step."""
    inner = load(dense, (DENSE_ROWS - 1) * DIMENSION + c, WIDTH)
    for j in range(DENSE_ROWS - 2, -1, -1):
        inner = load(dense, j * DIMENSION + c, WIDTH) + theta * inner
    rest = 1.0 - theta
    return rest * load(bank, c, WIDTH) + theta * (load(y_new, c, WIDTH) + rest * inner)


@njit(error_model="numpy", forceinline=True)
def spread(bank):
    """Synchronisation error: sum over the oscillators of their distance from the first in state space."""
    total = broadcast(0.0, WIDTH)
    for i in range(1, NODES):
        square = broadcast(0.0, WIDTH)
        for c in range(COMPONENTS):
            gap = load(bank, c * NODES, WIDTH) - load(bank, c * NODES + i, WIDTH)
            square = square + gap * gap
        if WEIGHTED:  # noqa: SIM108  (a module without weights has no MULTIPLICITY)
            total = total + MULTIPLICITY[i] * sqrt(square)
        else:
            total = total + sqrt(square)
    return total


@njit(error_model="numpy", forceinline=True)
def observe(bank, h, counted, accept, y_new, dense, middle):
    """Add the step to the time integral of the synchronisation error (Simpson) and to its maximum."""
    for c in range(DIMENSION):
        store(middle, c, inside(broadcast(0.5, WIDTH), c, bank, y_new, dense))
    first, half, last = load(bank, SYNC, WIDTH), spread(middle), spread(y_new)
    area = h * (first + 4.0 * half + last) / 6.0
    peak = load(bank, SYNC_PEAK, WIDTH)
    store(bank, SYNC_SUM, load(bank, SYNC_SUM, WIDTH) + select(counted, area, 0.0))
    store(bank, SYNC_PEAK, select(counted, maximum(peak, maximum(first, maximum(half, last))), peak))
    store(bank, SYNC, select(accept, last, first))


@njit(error_model="numpy", forceinline=True)
def crosses(before, after, direction):
    """Where a section function goes through zero: falling (-1), rising (+1) or either way (0)."""
    falls, rises = (before > 0.0) & (after <= 0.0), (before < 0.0) & (after >= 0.0)
    if direction < 0.0:
        return falls
    if direction > 0.0:
        return rises
    return falls | rises


@njit(error_model="numpy")
def locate(hits, low, high, g_low, g_high, t, h, bank, y_new, dense):
    """Zero of the section function between two fractions of the step, to rounding, in the lanes of `hits`.

    Regula falsi with the Anderson-Bjorck weight (BIT 13, 253, 1973), bisection where that stalls.
    """
    a, b, fa, fb = select(hits, low, high), high, g_low, g_high
    for k in range(60):
        active = absolute(b - a) > 1e-15  # the others are done and must not move, whatever their neighbours need
        if not any_lane(active):
            break
        secant = b - fb * (b - a) / (fb - fa)
        good = (secant - a) * (b - secant) > 0.0
        c = select(good, secant, 0.5 * (a + b)) if k % 4 != 3 else 0.5 * (a + b)
        c = select(active, c, b)
        fc = section(c, t, h, bank, y_new, dense)
        done = (fc == 0.0) | (absolute(c - b) <= 1e-15)
        other = fc * fb < 0.0  # the zero lies between c and b
        weight = 1.0 - fc / fb
        near, f_near = select(other, b, a), select(other, fb, fa * select(weight > 0.0, weight, 0.5))
        a, fa = select(active, select(done, c, near), b), select(active, f_near, fa)
        b, fb = c, fc
    return b


@njit(error_model="numpy")
def keep_points(theta, hits, t, h, bank, y_new, dense, cell, counts, points):
    """Write the section points of the lanes in `hits`: time and state."""
    when = np.empty(WIDTH)
    where = np.empty(DIMENSION * WIDTH)
    store(when, 0, t + theta * h)
    for c in range(DIMENSION):
        store(where, c, inside(theta, c, bank, y_new, dense))
    for which in range(WIDTH):
        if (hits >> which) & 1:
            k = counts[cell[which], N_POINTS]
            counts[cell[which], N_POINTS] = k + 1
            if k < points.shape[1]:
                points[cell[which], k, 0] = when[which]
                for c in range(DIMENSION):
                    points[cell[which], k, c + 1] = where[c * WIDTH + which]


@njit(error_model="numpy")
def cut(counted, t, h, bank, y_new, dense, cell, counts, points, direction):
    """Find section points in either half of the step."""
    zero, half, one = broadcast(0.0, WIDTH), broadcast(0.5, WIDTH), broadcast(1.0, WIDTH)
    g0 = section(zero, t, h, bank, y_new, dense)
    g1 = section(half, t, h, bank, y_new, dense)
    g2 = section(one, t, h, bank, y_new, dense)
    early, late = crosses(g0, g1, direction) & counted, crosses(g1, g2, direction) & counted
    if any_lane(early):
        theta = locate(early, zero, half, g0, g1, t, h, bank, y_new, dense)
        keep_points(theta, lane_bits(early), t, h, bank, y_new, dense, cell, counts, points)
    if any_lane(late):
        theta = locate(late, half, one, g1, g2, t, h, bank, y_new, dense)
        keep_points(theta, lane_bits(late), t, h, bank, y_new, dense, cell, counts, points)


@njit(error_model="numpy")
def sample(bank, t_new, h, accepted, y_new, dense, cell, spans, samples):
    """Write the trajectory at the sample times inside the step."""
    ends, lengths = np.empty(WIDTH), np.empty(WIDTH)
    store(ends, 0, t_new)
    store(lengths, 0, h)
    place = np.empty(DIMENSION * WIDTH)
    for which in range(WIDTH):
        if not (accepted >> which) & 1:
            continue
        begin, end = spans[cell[which], 0], spans[cell[which], 1]
        reached = bank[BASE * WIDTH + which] + ends[which]
        if ends[which] >= bank[END * WIDTH + which] or reached >= end - 4e-16 * abs(end):  # the end of the last period
            reached = end
        gap = bank[SAMPLE_GAP * WIDTH + which]
        while bank[NEXT_SAMPLE * WIDTH + which] <= reached:
            wanted = bank[NEXT_SAMPLE * WIDTH + which]
            k = round((wanted - begin) / gap) if gap > 0.0 else 0
            if k >= samples.shape[1]:
                break
            theta = max(0.0, 1.0 - (reached - wanted) / lengths[which])
            following = begin + (k + 1) * gap if k + 2 != samples.shape[1] else end
            still = samples.shape[1] if following <= wanted else k + 1  # a window without length: all samples are equal
            for c in range(DIMENSION):
                store(place, c, inside(broadcast(theta, WIDTH), c, bank, y_new, dense))
                samples[cell[which], k:still, c] = place[c * WIDTH + which]
            bank[NEXT_SAMPLE * WIDTH + which] = following if still < samples.shape[1] else math.inf
