"""Sparse elimination by a program that was planned once: the linear algebra of networks too large to write out.

`work` holds lanes.  The matrix stands from group `first` on: the diagonal, then the entries of `ProgramArrays`
(codegen/sparse.py), which also explains the integer arrays.
"""

from __future__ import annotations

from numba import njit

from synchain.codegen.lanes import load, store
from synchain.codegen.skeletons.names import DIMENSION, WIDTH


# --- kernel text below ---
@njit(error_model="numpy")
def factorise(work, first, order, below_start, below_slot, update_start, update_to, update_from):
    """Factorise the matrix in place; the inverse pivots replace the diagonal."""
    for q in range(DIMENSION):
        k = order[q]
        inverse = 1.0 / load(work, first + k, WIDTH)
        store(work, first + k, inverse)
        for b in range(below_start[q], below_start[q + 1]):
            factor = load(work, first + below_slot[b], WIDTH) * inverse
            store(work, first + below_slot[b], factor)
            for u in range(update_start[b], update_start[b + 1]):
                old = load(work, first + update_to[u], WIDTH)
                store(work, first + update_to[u], old - factor * load(work, first + update_from[u], WIDTH))


@njit(error_model="numpy")
def solve(work, first, x, order, below_start, below_slot, below_row, after_start, after_slot, after_column):
    """Solve in place for the right-hand side that stands from group x on."""
    for q in range(DIMENSION):
        pivot = load(work, x + order[q], WIDTH)
        for b in range(below_start[q], below_start[q + 1]):
            old = load(work, x + below_row[b], WIDTH)
            store(work, x + below_row[b], old - load(work, first + below_slot[b], WIDTH) * pivot)
    for q in range(DIMENSION - 1, -1, -1):
        value = load(work, x + order[q], WIDTH)
        for a in range(after_start[q], after_start[q + 1]):
            value = value - load(work, first + after_slot[a], WIDTH) * load(work, x + after_column[a], WIDTH)
        store(work, x + order[q], value * load(work, first + order[q], WIDTH))
