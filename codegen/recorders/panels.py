"""The panels of a step: it is halved, and its halves are, where a record needs it; and the points of each."""

from __future__ import annotations

from numba import njit

# --- kernel text below ---
# Columns of the rule (codegen/kernels/observed.py), which has a row for each point; behind TOP and NEXT stand the weights
# of lower Legendre coefficients, and a square matrix is the last.
POINT, WEIGHT, TOP, NEXT = 0, 1, 2, 3


@njit(error_model="numpy", forceinline=True)
def following(level, place, halved):
    """The level and place of the next panel, its own first half if one is `halved`; level 0 behind the last one.

    Panel k of some level spans k 2^-level … (k + 1) 2^-level of the step.
    """
    if halved:
        return level + 1, 2 * place
    while place & 1:
        level, place = level - 1, place >> 1
    return level, place + 1
