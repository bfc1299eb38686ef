"""What a kernel adds up of observed values: integrals over the window by a rule of Gauss and Lobatto, and extremes."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..simd.addresses import address
from ..simd.lanes import broadcast, store
from .names import WIDTH
from .recording import ATOL, RTOL

# --- kernel text below ---
# Columns of `sums` behind those of every kernel: the time that was observed, then six columns for each value.
LENGTH, TALLIES, TALLY = 4, 5, 6
FIRST, SUM, SQUARES, LARGEST, LEAST, LATEST = 0, 1, 2, 3, 4, 5
# Each point of the rule has four numbers; no panel of a step is shorter than 2^-DEEPEST.
POINT, WEIGHT, TOP, NEXT, ROW, DEEPEST = 0, 1, 2, 3, 4, 12


@njit(error_model="numpy")
def rough(which, seen, rule, control, dims):
    """True if the rule is not good enough for a value of a lane: its last Legendre coefficients are too large.

    The rule is exact to about twice the degree of the interpolant, so its error is about the square of the last
    coefficient over the size of the value (Trefethen, SIAM Review 50, 67 (2008), theorem 4.5, for analytic functions).
    """
    for k in range(dims.observed):
        top = following = size = 0.0
        for point in range(len(rule) // ROW):
            value = seen[(point * dims.observed + k) * WIDTH + which]
            top += rule[ROW * point + TOP] * value
            following += rule[ROW * point + NEXT] * value
            size = max(size, abs(value))
        last = max(abs(top), abs(following))
        if last * last > size * (control[RTOL] * size + control[ATOL]):
            return True
    return False


@njit(error_model="numpy")
def add(which, i, length, seen, sums, rule, dims):
    """Add a panel of some length to the integrals of a cell, and look for extremes.

    The integrals are those of the distance from the first value, so that variances keep their digits.
    """
    for point in range(len(rule) // ROW):
        share, begins = length * rule[ROW * point + WEIGHT], point == 0 and sums[i, LENGTH] == 0.0
        for k in range(dims.observed):
            value, at = seen[(point * dims.observed + k) * WIDTH + which], TALLIES + TALLY * k
            if begins:
                sums[i, at + FIRST] = sums[i, at + LARGEST] = sums[i, at + LEAST] = value
            gap = value - sums[i, at + FIRST]
            sums[i, at + SUM] += share * gap
            sums[i, at + SQUARES] += share * gap * gap
            sums[i, at + LARGEST] = max(sums[i, at + LARGEST], value)
            sums[i, at + LEAST] = min(sums[i, at + LEAST], value)
            sums[i, at + LATEST] = value
    sums[i, LENGTH] += length


@njit(error_model="numpy")
def tally(counted, t, h, y, y_new, dense, seen, cell, sums, control, rule, dims, values):
    """Add the step of the lanes in `counted` to what is observed; its panels are halved where a value needs it.

    Panel k of some level spans k 2^-level … (k + 1) 2^-level of the step; each lane halves those that it needs.
    """
    points, lengths = len(rule) // ROW, np.empty(WIDTH)
    store(lengths, 0, h)
    open_lanes = np.zeros(DEEPEST + 1, np.int64)
    open_lanes[0], level, k = counted, 0, 0
    while True:
        width, halved = 1.0 / (1 << level), 0
        for point in range(points):
            theta = broadcast((k + rule[ROW * point + POINT]) * width, WIDTH)
            values(theta, t, h, y, y_new, dense, address(seen, point * dims.observed * WIDTH), dims)
        for which in range(WIDTH):
            if (open_lanes[level] >> which) & 1:
                if level < DEEPEST and rough(which, seen, rule, control, dims):
                    halved |= 1 << which
                else:
                    add(which, cell[which], width * lengths[which], seen, sums, rule, dims)
        if halved != 0:
            level, k = level + 1, 2 * k
            open_lanes[level] = halved
            continue
        while k & 1:
            level, k = level - 1, k >> 1
        if level == 0:
            break
        k += 1
