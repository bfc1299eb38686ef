"""The state inside a step."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import load, select
from .clock_slots import SERIES, WIDTH


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def inside(theta, c, y, y_new, dense, dims):
    """Return state variable c at the fraction theta of the step; only the first two of `dims` are read."""
    dimension, rows = dims[0], dims[1]
    if SERIES:
        value = load(dense, (rows - 1) * dimension + c, WIDTH)
        for j in range(rows - 2, -1, -1):
            value = load(dense, j * dimension + c, WIDTH) + theta * value
        value = load(y, c, WIDTH) + theta * value
        return select(theta < 1.0, value, load(y_new, c, WIDTH))  # the end to the last bit
    inner = load(dense, (rows - 1) * dimension + c, WIDTH)
    for j in range(rows - 2, -1, -1):
        inner = load(dense, j * dimension + c, WIDTH) + theta * inner
    left = 1.0 - theta
    return left * load(y, c, WIDTH) + theta * (load(y_new, c, WIDTH) + left * inner)
