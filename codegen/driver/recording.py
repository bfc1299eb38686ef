"""What a kernel records along the way: synchronisation error, section points and samples of the trajectory."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.lanes import absolute, any_lane, broadcast, lane_bits, load, maximum, select, sqrt, store
from .dense import inside
from .names import SERIES, WIDTH
from .one_section import keep, surface

# --- kernel text below ---
# Each lane has its state in `y`, followed by its parameters, and what the driver remembers about it in `clock`.
# Times count from BASE, the beginning of the current period of the drive, so that they keep their digits in long runs.
TIME, STEP, STOP, START, END, MEMORY, CHANGE, ACCEPTED, REJECTED = 0, 1, 2, 3, 4, 5, 6, 7, 8
SYNC, SYNC_SUM, SYNC_PEAK, NEXT_SAMPLE, SAMPLE_GAP, BASE, PERIOD, PERIODS = 9, 10, 11, 12, 13, 14, 15, 16
MODE, SMOOTH_STEPS, POWER, SAVED_AT, CYCLE, LEFT, SUM_BEFORE, SKIPPED, RUSH = 17, 18, 19, 20, 21, 22, 23, 24, 25
HALTED, MARK, MARKED_AT, LAPSE, HIGH, RECORD, ORIGIN = 26, 27, 28, 29, 30, 31, 32
# Start and end of the window counted from t = 0; the period at whose end a step must stop; that end, if it is this period.
FROM, UNTIL, DUE, BOUND = 33, 34, 35, 36
CLOCK = 37
# How a cell ended.
FINISHED, BUDGET, UNDERFLOW, DIVERGED, INTERRUPTED, CHATTERING, STOPPED = 1, 2, 3, 4, 5, 6, 7
# Columns of `control`, of `sums` and of `counts`.
RTOL, ATOL, FIRST_STEP, MAX_STEP, MAX_STEPS, DIRECTION, CANCEL, NO_JUMPS, FURTHER = 0, 1, 2, 3, 4, 5, 6, 7, 8
MEAN, PEAK, LAST, STOPPED_AT = 0, 1, 2, 3
STATUS, N_ACCEPTED, N_REJECTED, N_POINTS, N_SKIPPED, N_SMOOTH = 0, 1, 2, 3, 4, 5
# So many events in a row without time passing are chattering.
LONGEST_RUSH = 200.0
# A state of this size, 2^53, has diverged: its neighbours are further apart than anything that happens at size one.
FAR = 9007199254740992.0
# Growth is looked at after so many steps, and each time that their number has doubled.  A doubling counts if it takes no
# more than PACE times the time of the last one while the state grows by CLIMB; together they must have raised it by TOWER.
FIRST_MARK, PACE, CLIMB, TOWER = 256.0, 1.1, 1.4142135623730951, 256.0
# The two ways to step.
STIFF, SMOOTH = 0, 1
ALL = (1 << WIDTH) - 1
# Pieces of a step between which a section function is looked at; a Taylor step is several times longer than others.
LOOKS = 8 if SERIES else 2


@njit(error_model="numpy", forceinline=True)
def spread(y, multiplicity, dims):
    """Synchronisation error: sum over the oscillators of their distance from the first in state space."""
    total = broadcast(0.0, WIDTH)
    for i in range(1, dims.nodes):
        square = broadcast(0.0, WIDTH)
        for c in range(dims.components - 1, -1, -1):
            gap = load(y, c * dims.nodes, WIDTH) - load(y, c * dims.nodes + i, WIDTH)
            square = square + gap * gap
        total = total + multiplicity[i] * sqrt(square)
    return total


@njit(error_model="numpy", forceinline=True)
def observe(clock, y, h, counted, accept, y_new, dense, middle, multiplicity, dims):
    """Add the step to the time integral of the synchronisation error (Simpson) and to its maximum."""
    peak, first, last = load(clock, SYNC_PEAK, WIDTH), load(clock, SYNC, WIDTH), spread(y_new, multiplicity, dims)
    panels = 4 if SERIES else 1  # of the rule; a Taylor step is several times longer than others
    total, half = first, broadcast(0.0, WIDTH)
    for k in range(1, 2 * panels):
        for c in range(dims.dimension):
            store(middle, c, inside(broadcast(0.5 * k / panels, WIDTH), c, y, y_new, dense, dims))
        value = spread(middle, multiplicity, dims)
        total = total + (4.0 if k % 2 else 2.0) * value
        half = maximum(half, value)
    area = h * (total + last) / (6.0 * panels)
    store(clock, SYNC_SUM, load(clock, SYNC_SUM, WIDTH) + select(counted, area, 0.0))
    store(clock, SYNC_PEAK, select(counted, maximum(peak, maximum(first, maximum(half, last))), peak))
    store(clock, SYNC, select(accept, last, first))


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
def locate(k, hits, low, high, g_low, g_high, t, h, y, y_new, dense, found, dims, section):
    """Zero of section function k between two fractions of the step, to rounding, in the lanes of `hits`.

    Regula falsi with the Anderson-Bjorck weight (BIT 13, 253, 1973), bisection where that stalls.
    """
    a, b, fa, fb = select(hits, low, high), high, g_low, g_high
    for tried in range(60):
        active = absolute(b - a) > 1e-15  # the others are done and must not move, whatever their neighbours need
        if not any_lane(active):
            break
        secant = b - fb * (b - a) / (fb - fa)
        good = (secant - a) * (b - secant) > 0.0
        c = select(good, secant, 0.5 * (a + b)) if tried % 4 != 3 else 0.5 * (a + b)
        c = select(active, c, b)
        fc = surface(k, c, t, h, y, y_new, dense, found, dims, section)
        done = (fc == 0.0) | (absolute(c - b) <= 1e-15)
        other = fc * fb < 0.0  # the zero lies between c and b
        weight = 1.0 - fc / fb
        near, f_near = select(other, b, a), select(other, fb, fa * select(weight > 0.0, weight, 0.5))
        a, fa = select(active, select(done, c, near), b), select(active, f_near, fa)
        b, fb = c, fc
    return b


@njit(error_model="numpy")
def keep_points(k, theta, hits, t, h, y, y_new, dense, found, cell, counts, points, dims, section):
    """Write the points of section k of the lanes in `hits`: time, and what is kept there."""
    size = points.shape[2] - 1
    when = np.empty(WIDTH)
    where = np.empty(size * WIDTH)
    store(when, 0, t + theta * h)
    keep(k, theta, t, h, y, y_new, dense, found, where, dims, section)
    for which in range(WIDTH):
        if (hits >> which) & 1:
            place = counts[cell[which], N_POINTS]
            counts[cell[which], N_POINTS] = place + 1
            if place < points.shape[1]:
                points[cell[which], place, 0] = when[which]
                for c in range(size):
                    points[cell[which], place, c + 1] = where[c * WIDTH + which]


@njit(error_model="numpy", forceinline=True)
def turning(i, before, first, last, behind):
    """Where a parabola through three of four equidistant values turns between the inner two, as the fraction of the step.

    `first` is the value at look i; the outer ones are NaN where the step ends.  Zero where nothing turns.
    """
    left, right = (
        0.5 * (before - last) / (before - 2.0 * first + last),
        0.5 * (first - behind) / (first - 2.0 * last + behind),
    )
    low, high = 0.5 if i > 0 else 0.0, 0.5 if i + 2 <= LOOKS else 1.0  # each turn is seen from the nearer look
    place = select((left > 0.0) & (left < high), left, 0.0)
    place = select((right + 1.0 > low) & (right < 0.0), right + 1.0, place)
    return select(place > 0.0, (i + place) / LOOKS, 0.0)


@njit(error_model="numpy")
def between(k, i, wanted, before, first, last, behind, t, h, y, y_new, dense, found, dims, section):
    """Where section function k turns between looks i and i + 1, and its value there; look i + 1 where it does not turn."""
    turn, place = turning(i, before, first, last, behind), broadcast((i + 1) / LOOKS, WIDTH)
    turns = (first * last > 0.0) & (turn > 0.0) & wanted
    if any_lane(turns):
        place = select(turns, turn, place)
        return place, select(turns, surface(k, place, t, h, y, y_new, dense, found, dims, section), last)
    return place, last


@njit(error_model="numpy")
def cut(k, counted, t, h, y, y_new, dense, found, cell, counts, points, direction, dims, section):
    """Find points of section k between the looks into a step, and beside an extremum between two of them."""
    zero = broadcast(0.0, WIDTH)
    before, g0 = zero / zero, surface(k, zero, t, h, y, y_new, dense, found, dims, section)
    g1 = surface(k, zero + 1.0 / LOOKS, t, h, y, y_new, dense, found, dims, section)
    for i in range(LOOKS):
        low, high, behind = zero + i / LOOKS, zero + (i + 1) / LOOKS, zero / zero
        if i + 2 <= LOOKS:
            behind = surface(k, zero + (i + 2) / LOOKS, t, h, y, y_new, dense, found, dims, section)
        middle, g = between(k, i, counted, before, g0, g1, behind, t, h, y, y_new, dense, found, dims, section)
        for left, right, g_left, g_right in ((low, middle, g0, g), (middle, high, g, g1)):
            hits = crosses(g_left, g_right, direction) & counted
            if any_lane(hits):
                theta = locate(k, hits, left, right, g_left, g_right, t, h, y, y_new, dense, found, dims, section)
                keep_points(
                    k, theta, lane_bits(hits), t, h, y, y_new, dense, found, cell, counts, points, dims, section
                )
        before, g0, g1 = g0, g1, behind


@njit(error_model="numpy")
def sample(clock, y, t_new, h, accepted, y_new, dense, cell, spans, samples, dims):
    """Write the trajectory at the sample times inside the step, the next one of each lane at once."""
    reached, lengths, thetas = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    due, still = np.empty(WIDTH, np.int64), np.empty(WIDTH, np.int64)
    store(reached, 0, t_new)
    store(lengths, 0, h)
    place = np.empty(dims.dimension * WIDTH)
    for which in range(WIDTH):
        end, at_end = spans[cell[which], 1], reached[which] >= clock[END * WIDTH + which]
        reached[which] += clock[BASE * WIDTH + which]
        if at_end or reached[which] >= end - 4e-16 * abs(end):  # the end of the last period
            reached[which] = end
        if not (accepted >> which) & 1:
            reached[which] = -math.inf
    while True:
        any_due = False
        for which in range(WIDTH):
            thetas[which], due[which] = 1.0, -1
            wanted = clock[NEXT_SAMPLE * WIDTH + which]
            if wanted > reached[which]:
                continue
            begin, end, gap = spans[cell[which], 0], spans[cell[which], 1], clock[SAMPLE_GAP * WIDTH + which]
            k = round((wanted - begin) / gap) if gap > 0.0 else 0
            if k >= samples.shape[1]:
                continue
            any_due = True
            thetas[which], due[which] = max(0.0, 1.0 - (reached[which] - wanted) / lengths[which]), k
            following = begin + (k + 1) * gap if k + 2 != samples.shape[1] else end
            still[which] = samples.shape[1] if following <= wanted else k + 1  # all samples of a window without length
            clock[NEXT_SAMPLE * WIDTH + which] = following if still[which] < samples.shape[1] else math.inf
        if not any_due:
            return
        for c in range(dims.dimension):
            store(place, c, inside(load(thetas, 0, WIDTH), c, y, y_new, dense, dims))
            for which in range(WIDTH):
                if due[which] >= 0:
                    samples[cell[which], due[which] : still[which], c] = place[c * WIDTH + which]
