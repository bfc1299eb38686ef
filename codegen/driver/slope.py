"""The derivative of the state inside a step."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import load
from .names import SERIES, WIDTH


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def slope(theta, c, y, y_new, dense, dims):
    """Derivative of state variable c by the fraction of the step."""
    inner = load(dense, (dims.dense_rows - 1) * dims.dimension + c, WIDTH)
    bent = 0.0 * inner
    for j in range(dims.dense_rows - 2, -1, -1):
        bent = inner + theta * bent
        inner = load(dense, j * dims.dimension + c, WIDTH) + theta * inner
    if SERIES:
        return inner + theta * bent
    change = load(y_new, c, WIDTH) - load(y, c, WIDTH)
    return change + (1.0 - 2.0 * theta) * inner + theta * (1.0 - theta) * bent
