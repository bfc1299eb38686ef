"""The section of a kernel that has one, on a state: its points have the whole state."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import store
from .dense import inside


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def surface(k, theta, t, h, y, y_new, dense, found, dims, section):
    """The section function at the fraction theta of the step."""
    return section(theta, t, h, y, y_new, dense, dims)


@njit(error_model="numpy", forceinline=True)
def keep(k, theta, t, h, y, y_new, dense, found, where, dims, section):
    """What is kept of a section point: the state."""
    for c in range(dims.dimension):
        store(where, c, inside(theta, c, y, y_new, dense, dims))
