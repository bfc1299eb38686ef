"""The derivative of the state inside a step."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import load
from .clock_slots import SERIES, WIDTH


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def slope(theta, c, y, y_new, dense, dims):
    """Return the derivative of state variable c by the fraction of the step; only the first two of `dims` are read."""
    dimension, rows = dims[0], dims[1]
    inner = load(dense, (rows - 1) * dimension + c, WIDTH)
    bent = 0.0 * inner
    for j in range(rows - 2, -1, -1):
        bent = inner + theta * bent
        inner = load(dense, j * dimension + c, WIDTH) + theta * inner
    if SERIES:
        return inner + theta * bent
    change = load(y_new, c, WIDTH) - load(y, c, WIDTH)
    return change + (1.0 - 2.0 * theta) * inner + theta * (1.0 - theta) * bent
