"""Sparse elimination by a program that was planned once: the linear algebra of networks too large to write out.

`work` holds lanes.  The matrix stands from group `first` on: the diagonal, then the other entries,
row after row in the order of elimination; within a row those of earlier pivots come first.
`Program` in codegen/steps/sparse_plan.py describes the integer arrays.  `apart` is 0 if the elimination
is exact.  Otherwise the factors stand so many groups behind the matrix and have only the entries for
which the rows have room, and every solution is refined to rounding.
"""

from __future__ import annotations

import math

from numba import njit

from ..simd.lanes import absolute, any_lane, broadcast, load, maximum, select, store
from .clock_slots import DIMENSION, WIDTH

# --- kernel text below ---
REFINEMENTS = 30


@njit(error_model="numpy")
def factorise(work, first, apart, scratch, order, place, row_start, after_start, column):
    """Factorise the matrix, row by row in a scratch vector; the inverse pivots, NaN of infinite ones, replace the diagonal."""
    if apart > 0:
        for k in range(DIMENSION + column.size):
            store(work, first + apart + k, load(work, first + k, WIDTH))
    first, off_diagonal = first + apart, first + apart + DIMENSION
    for q in range(DIMENSION):
        k = order[q]
        store(work, scratch + k, load(work, first + k, WIDTH))
        for s in range(row_start[q], row_start[q + 1]):
            store(work, scratch + column[s], load(work, off_diagonal + s, WIDTH))
        for s in range(row_start[q], after_start[q]):
            j = column[s]
            factor = load(work, scratch + j, WIDTH) * load(work, first + j, WIDTH)
            store(work, off_diagonal + s, factor)
            for u in range(after_start[place[j]], row_start[place[j] + 1]):
                old = load(work, scratch + column[u], WIDTH)
                store(work, scratch + column[u], old - factor * load(work, off_diagonal + u, WIDTH))
        for s in range(after_start[q], row_start[q + 1]):
            store(work, off_diagonal + s, load(work, scratch + column[s], WIDTH))
        pivot = load(work, scratch + k, WIDTH)
        store(work, first + k, 1.0 / pivot + 0.0 * pivot)


@njit(error_model="numpy")
def substitute(work, first, x, order, row_start, after_start, column):
    """Solve in place by the factors for the right-hand side in the groups from x on."""
    off_diagonal = first + DIMENSION
    for q in range(DIMENSION):
        value = load(work, x + order[q], WIDTH)
        for s in range(row_start[q], after_start[q]):
            value = value - load(work, off_diagonal + s, WIDTH) * load(work, x + column[s], WIDTH)
        store(work, x + order[q], value)
    for q in range(DIMENSION - 1, -1, -1):
        value = load(work, x + order[q], WIDTH)
        for s in range(after_start[q], row_start[q + 1]):
            value = value - load(work, off_diagonal + s, WIDTH) * load(work, x + column[s], WIDTH)
        store(work, x + order[q], value * load(work, first + order[q], WIDTH))


@njit(error_model="numpy")
def residual(work, first, x, right, out, order, row_start, column):
    """Write the residual at x: right-hand side minus matrix times x."""
    off_diagonal = first + DIMENSION
    for q in range(DIMENSION):
        k = order[q]
        value = load(work, right + k, WIDTH) - load(work, first + k, WIDTH) * load(work, x + k, WIDTH)
        for s in range(row_start[q], row_start[q + 1]):
            value = value - load(work, off_diagonal + s, WIDTH) * load(work, x + column[s], WIDTH)
        store(work, out + k, value)


@njit(error_model="numpy")
def largest(work, x):
    """Return the largest modulus of a vector."""
    size = broadcast(0.0, WIDTH)
    for k in range(DIMENSION):
        size = maximum(size, absolute(load(work, x + k, WIDTH)))
    return size


@njit(error_model="numpy")
def solve(work, first, apart, x, right, change, order, row_start, after_start, column):
    """Solve in place for the right-hand side in the groups from x on; `right` and `change` are scratch vectors.

    Refinement ends, each lane by itself, where the correction times its own rate of decrease is below rounding (Hairer &
    Wanner, Solving Ordinary Differential Equations II, 1996, section IV.8); a lane whose corrections do not decrease gets
    NaN, and so its step is rejected and tried again shorter, where the diagonal weighs more.
    """
    if apart > 0:
        for k in range(DIMENSION):
            store(work, right + k, load(work, x + k, WIDTH))
    substitute(work, first + apart, x, order, row_start, after_start, column)
    if apart == 0:
        return
    scale = before = largest(work, x)
    active, failed = before > 0.0, before < 0.0
    for _ in range(REFINEMENTS):
        if not any_lane(active):
            break
        residual(work, first, x, right, change, order, row_start, column)
        substitute(work, first + apart, change, order, row_start, after_start, column)
        size = largest(work, change)
        for k in range(DIMENSION):
            old = load(work, x + k, WIDTH)
            store(work, x + k, select(active, old + load(work, change + k, WIDTH), old))
        done = (size * size <= 1e-16 * scale * before) | (size <= 4e-15 * scale)
        failed = failed | (active & ~done & ~(size < 0.5 * before))
        active = active & ~done & ~failed
        before = size
    failed = failed | active
    for k in range(DIMENSION):
        store(work, x + k, select(failed, math.nan, load(work, x + k, WIDTH)))
