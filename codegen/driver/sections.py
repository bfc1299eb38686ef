"""Sections on functions: each point has the number of its section, and the values that this section keeps."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import broadcast, load, store
from .names import WIDTH


# --- kernel text below ---
@njit(error_model="numpy")
def surface(k, theta, t, h, y, y_new, dense, found, dims, section):
    """Section function k at the fraction theta of the step."""
    section(theta, t, h, y, y_new, dense, found, dims)
    return load(found, k, WIDTH)


@njit(error_model="numpy")
def keep(k, theta, t, h, y, y_new, dense, found, where, dims, section):
    """What is kept of a point of section k: its number, then the values behind the section functions."""
    section(theta, t, h, y, y_new, dense, found, dims)
    store(where, 0, broadcast(1.0 * k, WIDTH))
    for c in range(dims.kept):
        store(where, c + 1, load(found, dims.sections + k * dims.kept + c, WIDTH))
