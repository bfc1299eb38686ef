"""The synchronisation error of a state."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import broadcast, load, sqrt
from .clock_slots import WIDTH


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def spread(y, multiplicity, dims):
    """Return the synchronisation error: the sum of the distances of the oscillators from the first in state space."""
    total = broadcast(0.0, WIDTH)
    for i in range(1, dims.nodes):
        square = broadcast(0.0, WIDTH)
        for c in range(dims.components - 1, -1, -1):
            gap = load(y, c * dims.nodes, WIDTH) - load(y, c * dims.nodes + i, WIDTH)
            square = square + gap * gap
        total = total + multiplicity[i] * sqrt(square)
    return total
