"""The record of observed values: integrals over the window by a rule of Gauss and Lobatto, and extremes."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..driver.clock_slots import ATOL, OBSERVED, RTOL, WIDTH
from ..driver.records import Tallied
from ..simd.addresses import address
from ..simd.lanes import broadcast, lane_bits, load, store
from .panels import NEXT, POINT, TOP, WEIGHT, following, gentle, simple

# --- kernel text below ---
# Columns of `sums` behind the time that was observed: seven for each value.
TALLIES, TALLY = OBSERVED + 1, 7
FIRST, SUM, SQUARES, LARGEST, LEAST, LATEST, SIZE = 0, 1, 2, 3, 4, 5, 6
# Panels up to this width, 2^-12 of a step, hold a jump or a singularity; they are halved while their integral is inexact.
NARROW = 0.000244140625
# No panel of a step is shorter than 2^-DEEPEST.
DEEPEST = 40
# Fast changes between the points are sought in panels longer than 2^-SOUGHT of a step (a choice).
SOUGHT = 20
# Most parabolas for an extreme between the points of a panel.
CLIMBS = 8


@njit(error_model="numpy", forceinline=True)
def computed(dims):
    """Count the values at a point: observed values, and the gaps and depths that locate their fast changes."""
    return dims.observed + dims.gaps + dims.depths


@njit(error_model="numpy")
def hidden(seen, rule, control, dims):
    """Return the lanes in which an observed value may have kinks, jumps or narrow peaks between the points of a panel.

    Lanes without them have none in the halves of the panel.
    """
    count = computed(dims)
    good = broadcast(0.0, WIDTH) == 0.0
    for k in range(dims.observed, dims.observed + dims.gaps):
        good = good & simple(k, count, seen, rule, control)
    for k in range(dims.observed + dims.gaps, count):
        good = good & gentle(k, count, seen, rule)
    return lane_bits(~good)


@njit(error_model="numpy")
def rough(lane, i, width, seen, sums, rule, control, dims):
    """Return True if the rule is too coarse for a value of a lane: its last Legendre coefficients are too large.

    The rule is exact to about twice the degree of the interpolant, so its error is about the square of the last
    coefficient over the size of the value (Trefethen, SIAM Review 50, 67 (2008), theorem 4.5, for analytic functions).  A
    narrow panel is compared with the size of the value at the points of the whole step; a value that is not exact enough
    in the narrowest panel is NaN.
    """
    coarse = False
    for k in range(dims.observed):
        top = following = size = 0.0
        for point in range(len(rule)):
            value = seen[(point * computed(dims) + k) * WIDTH + lane]
            top += rule[point, TOP] * value
            following += rule[point, NEXT] * value
            size = max(size, abs(value))
        last, at = max(abs(top), abs(following)), TALLIES + TALLY * k
        if width == 1.0:
            sums[i, at + SIZE] = size
        allowed = control[RTOL] * sums[i, at + SIZE] + control[ATOL]
        if last * last > size * (control[RTOL] * size + control[ATOL]):
            coarse = coarse | (width > NARROW) | (16.0 * width * last > allowed)
            if width * (1 << DEEPEST) <= 1.0 and width * last > 16.0 * allowed:
                sums[i, at + SUM] = math.nan
    return coarse


@njit(error_model="numpy")
def add(lane, i, length, seen, sums, rule, dims):
    """Add a panel of some length to the integrals of a cell, and look for extremes.

    The integrals are those of the distance from the first value, so that variances keep their digits.
    """
    for point in range(len(rule)):
        share, begins = length * rule[point, WEIGHT], point == 0 and sums[i, OBSERVED] == 0.0
        for k in range(dims.observed):
            value, at = seen[(point * computed(dims) + k) * WIDTH + lane], TALLIES + TALLY * k
            if begins:
                sums[i, at + FIRST] = sums[i, at + LARGEST] = sums[i, at + LEAST] = value
            gap = value - sums[i, at + FIRST]
            sums[i, at + SUM] += share * gap
            sums[i, at + SQUARES] += share * gap * gap
            sums[i, at + LARGEST] = max(sums[i, at + LARGEST], value)
            sums[i, at + LEAST] = min(sums[i, at + LEAST], value)
            sums[i, at + LATEST] = value
    sums[i, OBSERVED] += length


@njit(error_model="numpy", forceinline=True)
def vertex(a, m, b, at_a, at_m, at_b):
    """Return the vertex of the parabola through three points, and its value; m if it opens upwards."""
    left, right = (at_m - at_a) / (m - a), (at_b - at_m) / (b - m)
    bend = (right - left) / (b - a)
    if not bend < 0.0:
        return m, at_m
    top = 0.5 * (a + m - left / bend)
    return top, at_a + (top - a) * (left + bend * (top - m))


@njit(error_model="numpy")
def bracket(lane, k, sign, best, seen, rule, ends, dims):
    """Write to `ends` the points of a panel around the maximum of sign * value k, and its values there.

    Return the maximum of the parabola through them, as a fraction of the panel, and whether it exceeds `best`.
    """
    last, higher, guess = len(rule) - 1, False, 0.0
    for point in range(last + 1):
        low, high, centre = max(point - 1, 0), min(point + 1, last), min(max(point, 1), last - 1)
        at_low, at_point, at_high = (
            sign * seen[(low * computed(dims) + k) * WIDTH + lane],
            sign * seen[(point * computed(dims) + k) * WIDTH + lane],
            sign * seen[(high * computed(dims) + k) * WIDTH + lane],
        )
        if at_low > at_point or at_high > at_point:
            continue
        top, height = vertex(
            rule[centre - 1, POINT],
            rule[centre, POINT],
            rule[centre + 1, POINT],
            sign * seen[((centre - 1) * computed(dims) + k) * WIDTH + lane],
            sign * seen[(centre * computed(dims) + k) * WIDTH + lane],
            sign * seen[((centre + 1) * computed(dims) + k) * WIDTH + lane],
        )
        if height > best and rule[low, POINT] < top < rule[high, POINT]:
            higher, best, guess = True, height, top
            ends[0], ends[1], ends[2] = rule[low, POINT], rule[point, POINT], rule[high, POINT]
            ends[3], ends[4], ends[5] = at_low, at_point, at_high
    return guess, higher


@njit(error_model="numpy", forceinline=True)
def evaluate(theta, out, tallied):
    """Compute all values at a fraction of the step."""
    step = tallied.step
    tallied.values(theta, step.t, step.h, step.y, step.y_new, step.dense, out, tallied.dims[:2])


@njit(error_model="numpy")
def narrow(row, u, at_u):
    """Shrink a bracket by the height at u: `row` holds three fractions, the middle one highest, and their heights."""
    a, m, b, at_a, at_m, at_b = row[0], row[1], row[2], row[3], row[4], row[5]
    if at_u > at_m:
        (a, at_a), (b, at_b) = ((m, at_m), (b, at_b)) if u > m else ((a, at_a), (m, at_m))
        m, at_m = u, at_u
    else:
        (a, at_a), (b, at_b) = ((a, at_a), (u, at_u)) if u > m else ((u, at_u), (b, at_b))
    row[0], row[1], row[2], row[3], row[4], row[5] = a, m, b, at_a, at_m, at_b


@njit(error_model="numpy")
def climb(added, begin, width, tallied, cell, sums, control):
    """Raise the extremes of the cells in `added` to those between the points of a panel, by successive parabolas.

    Only an extreme beyond those that are known is sought, and no closer than the tolerances.
    """
    seen, rule, dims = tallied.seen, tallied.rule, tallied.dims
    ends, there, at = np.empty((WIDTH, 6)), np.empty(WIDTH), np.empty(computed(dims) * WIDTH)
    for k in range(dims.observed):
        for column in (LARGEST, LEAST):
            sign, extreme, open_lanes = 1.0 if column == LARGEST else -1.0, TALLIES + TALLY * k + column, 0
            # 1. bracket an extreme in each lane
            for lane in range(WIDTH):
                there[lane] = 0.0
                if (added >> lane) & 1:
                    best = sign * sums[cell[lane], extreme]
                    best += control[RTOL] * abs(best) + control[ATOL]
                    there[lane], higher = bracket(lane, k, sign, best, seen, rule, ends[lane], dims)
                    open_lanes |= higher << lane
            # 2. move to the vertex of the parabola through each bracket, until it rises by less than the tolerances
            for _ in range(CLIMBS):
                if open_lanes == 0:
                    break
                evaluate((load(there, 0, WIDTH) + begin) * width, address(at, 0), tallied)
                for lane in range(WIDTH):
                    if (open_lanes >> lane) & 1:
                        row = ends[lane]
                        narrow(row, there[lane], sign * at[k * WIDTH + lane])
                        a, m, b, at_a, at_m, at_b = row[0], row[1], row[2], row[3], row[4], row[5]
                        sums[cell[lane], extreme] = sign * max(sign * sums[cell[lane], extreme], at_m)
                        there[lane], height = vertex(a, m, b, at_a, at_m, at_b) if a < m < b else (m, at_m)
                        if not (
                            a < there[lane] < b and height - at_m > 0.1 * (control[RTOL] * abs(at_m) + control[ATOL])
                        ):
                            open_lanes &= ~(1 << lane)


@njit(error_model="numpy", cache=True)
def tally(counted, step, seen, cell, sums, control, rule, dims, values):
    """Add the step of the lanes in `counted` to the tallies; each lane halves the panels that it needs."""
    tallied, points, lengths = Tallied(step, seen, rule, dims, values), len(rule), np.empty(WIDTH)
    store(lengths, 0, step.h)
    # of each level: lanes that still need its panels, and lanes that seek kinks and jumps there
    open_lanes, sought = np.zeros(DEEPEST + 1, np.int64), np.zeros(DEEPEST + 1, np.int64)
    open_lanes[0], sought[0], level, k = counted, counted, 0, 0
    while True:
        # 1. values at the points of panel k of the level
        width, halved, added = 1.0 / (1 << level), 0, 0
        for point in range(points):
            theta = broadcast((k + rule[point, POINT]) * width, WIDTH)
            evaluate(theta, address(seen, point * computed(dims) * WIDTH), tallied)
        unseen = sought[level]
        if unseen != 0:
            unseen &= hidden(seen, rule, control, dims) if level < SOUGHT else 0
        # 2. each lane adds the panel, or halves it
        for lane in range(WIDTH):
            if (open_lanes[level] >> lane) & 1:
                bad = rough(lane, cell[lane], width, seen, sums, rule, control, dims) | ((unseen >> lane) & 1 != 0)
                if bad and level < DEEPEST:
                    halved |= 1 << lane
                else:
                    add(lane, cell[lane], width * lengths[lane], seen, sums, rule, dims)
                    added |= 1 << lane
        climb(added, float(k), width, tallied, cell, sums, control)
        # 3. the next panel: the first half of this one, or the one behind it
        level, k = following(level, k, halved != 0)
        if level == 0:
            break
        if halved != 0:
            open_lanes[level], sought[level] = halved, unseen
