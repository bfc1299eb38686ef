"""The panels of a step: it is halved, and its halves are, where a record needs it; and what the points of each tell.

The polynomial through the values at the points is written in the Bernstein basis, whose coefficients bound it; its last
Legendre coefficients tell what it misses.
"""

from __future__ import annotations

from numba import njit

from ..driver.clock_slots import ATOL, RTOL, WIDTH
from ..simd.lanes import absolute, broadcast, load, maximum, minimum, select

# --- kernel text below ---
# Columns of the rule (codegen/kernels/observable_functions.py), which has a row for each point; behind TOP and NEXT stand the weights
# of lower Legendre coefficients, and a square matrix is the last.
POINT, WEIGHT, TOP, NEXT = 0, 1, 2, 3
# What a polynomial misses is taken to be less than MARGIN times the sum of the upper half of its Legendre coefficients.
MARGIN = 32.0
# Rounding of the coefficients in the Bernstein basis, as a part of the largest value.
ROUNDING = 1e-13
# Exponentials e^-u are no part of a value where u is above DEPTH, and the rule sees them where u changes by SPAN.
DEPTH, SPAN = 40.0, 20.0


@njit(error_model="numpy", forceinline=True)
def following(level, panel, halved):
    """Return level and index of the next panel, the first half of this one if it is `halved`; level 0 behind the last one.

    Panel k of some level spans k 2^-level … (k + 1) 2^-level of the step.
    """
    if halved:
        return level + 1, 2 * panel
    while panel & 1:
        level, panel = level - 1, panel >> 1
    return level, panel + 1


@njit(error_model="numpy", forceinline=True)
def combined(row, column, first, stride, values, rule):
    """Return the sum of the values of a function at the points of a panel times a row of the rule from a column on."""
    total = broadcast(0.0, WIDTH)
    for point in range(len(rule)):
        total = total + rule[row, column + point] * load(values, first + stride * point, WIDTH)
    return total


@njit(error_model="numpy", forceinline=True)
def upper(first, stride, values, rule):
    """Return the sum of the moduli of the upper half of the Legendre coefficients; NaN if a value is missing."""
    total = broadcast(0.0, WIDTH)
    for column in range(TOP, rule.shape[1] - len(rule)):
        coefficient = broadcast(0.0, WIDTH)
        for point in range(len(rule)):
            coefficient = coefficient + rule[point, column] * load(values, first + stride * point, WIDTH)
        total = total + absolute(coefficient)
    return total


@njit(error_model="numpy")
def simple(first, stride, values, rule, control):
    """Return the lanes where a function passes zero at most once in a panel, or has no value at all.

    It does so where all Bernstein coefficients lie on one side of zero; where all of their differences do, so that the
    function is monotonic; and where they change sides once and what the polynomial misses is within the tolerances.
    The value at a point stands `stride` behind that at the last one.
    """
    zero = broadcast(0.0, WIDTH)
    matrix = rule.shape[1] - len(rule)
    size, defined, missed = zero, zero > 0.0, MARGIN * upper(first, stride, values, rule)
    for point in range(len(rule)):
        value = load(values, first + stride * point, WIDTH)
        size, defined = maximum(size, absolute(value)), defined | (value == value)
    small = max(control[RTOL], ROUNDING) * size + control[ATOL]
    least, slack = maximum(missed, small), missed + ROUNDING * size
    side, changes, before = zero, zero, zero
    clear, rising, falling = zero == 0.0, zero == 0.0, zero == 0.0
    for row in range(len(rule)):
        coefficient = combined(row, matrix, first, stride, values, rule)
        sign = select(coefficient > least, 1.0, select(coefficient < -least, -1.0, zero))
        changes = changes + select(sign * side < 0.0, 1.0, zero)
        clear, side = clear & ~(sign == 0.0), select(sign == 0.0, side, sign)
        if row > 0:
            rising, falling = rising & (coefficient - before > slack), falling & (before - coefficient > slack)
        before = coefficient
    resolved = (missed <= small) & (changes < 1.5)
    return (clear & (changes == 0.0)) | rising | falling | resolved | ~defined


@njit(error_model="numpy")
def gentle(first, stride, values, rule):
    """Return the lanes where a function, cut at DEPTH, changes by less than SPAN in a panel, or has no value at a point."""
    matrix, missed = rule.shape[1] - len(rule), upper(first, stride, values, rule)
    low, high = load(values, first, WIDTH), load(values, first, WIDTH)
    for row in range(len(rule)):
        coefficient = combined(row, matrix, first, stride, values, rule)
        low, high = minimum(low, coefficient), maximum(high, coefficient)
    return ~(minimum(high + missed, DEPTH) - minimum(low - missed, DEPTH) > SPAN)
