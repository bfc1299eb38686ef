"""The state inside a step."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import load, select
from .names import SERIES, WIDTH


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def inside(theta, c, y, y_new, dense, dims):
    """State variable c at the fraction theta of the step."""
    if SERIES:
        value = load(dense, (dims.dense_rows - 1) * dims.dimension + c, WIDTH)
        for j in range(dims.dense_rows - 2, -1, -1):
            value = load(dense, j * dims.dimension + c, WIDTH) + theta * value
        value = load(y, c, WIDTH) + theta * value
        return select(theta < 1.0, value, load(y_new, c, WIDTH))  # the end to the last bit
    inner = load(dense, (dims.dense_rows - 1) * dims.dimension + c, WIDTH)
    for j in range(dims.dense_rows - 2, -1, -1):
        inner = load(dense, j * dims.dimension + c, WIDTH) + theta * inner
    rest = 1.0 - theta
    return rest * load(y, c, WIDTH) + theta * (load(y_new, c, WIDTH) + rest * inner)
