"""Gaps: numbers that are positive while the modes of contacts and rows last, and the functions of a scene that give them.

The gap of a slipping contact is its sliding velocity in the direction of slip; that of a sticking one is the distance of
its load from the limits of static friction.  The gaps of rows (models/mechanics/rows.py) are compared with a scale, the
largest size of their terms at the looks into a step; the scale of a contact is 1.
"""

from __future__ import annotations

from numba import njit

from ..simd.lanes import absolute, broadcast, load, maximum, minimum, select, store
from .clock_slots import LOOPED, ROWS, WIDTH
from .dense import inside

# --- kernel text below ---
# Groups of `pushes` and `strike` of rows: six in front of the looks, the others behind the numbers on jumps in time.
LEVEL, GAP, MODE, SPEED, RATE, RATIO, LAW, NUMBER, SIZE, K = 0, 1, 2, 3, 4, 5, 9, 10, 11, 12
# The part of the terms of a gap with which it is compared: PASSED (passages.py) of it are 7 rounding errors of the terms.
PART = 1.0 / 64.0


@njit(error_model="numpy", forceinline=True)
def place(group, row, dims):
    """Return the place of a number of a row."""
    return group * dims.rows + row + (2 if group >= 9 else 0)


@njit(error_model="numpy", forceinline=True)
def push(t, y, p, friction):
    """Compute the numbers of all contacts or rows at a state."""
    if LOOPED:
        graph, weights = friction.network
        friction.functions.pushes(t, y, p, friction.out, graph, weights)
    else:
        friction.functions.pushes(t, y, p, friction.out)


@njit(error_model="numpy", forceinline=True)
def gap_of(i, p, out, dims):
    """Return the gap of one contact or row from the output of `pushes`."""
    if ROWS:
        return load(out, place(GAP, i, dims), WIDTH)
    slip = load(p, 2 * dims.rows + i, WIDTH)
    held = minimum(load(out, 2 * dims.rows + i, WIDTH), -load(out, 3 * dims.rows + i, WIDTH))
    return select(absolute(slip) < 0.5, held, slip * load(out, i, WIDTH))


@njit(error_model="numpy", forceinline=True)
def scale_of(i, out, dims):
    """Return the scale of a gap."""
    return load(out, place(K + dims.felt + 3, i, dims), WIDTH) if ROWS else broadcast(1.0, WIDTH)


@njit(error_model="numpy", forceinline=True)
def grown_scale(i, out, dims):
    """Return the scale of a gap at a look, which is at least a part of the terms of the gap, and store it."""
    scale = scale_of(i, out, dims)
    if ROWS:
        scale = maximum(scale, PART * load(out, place(SIZE, i, dims), WIDTH))
        store(out, place(K + dims.felt + 3, i, dims), scale)
    return scale


@njit(error_model="numpy", forceinline=True)
def clear_scales(friction):
    """Let the scales of gaps begin anew in a step."""
    for i in range(friction.dims.rows if ROWS else 0):
        store(friction.out, place(K + friction.dims.felt + 3, i, friction.dims), broadcast(1e-300, WIDTH))


@njit(error_model="numpy", forceinline=True)
def smallest_gap(t, y, p, friction):
    """Return the smallest gap at a state, each in parts of its scale."""
    push(t, y, p, friction)
    least = broadcast(1e300, WIDTH)
    for i in range(friction.dims.rows):
        gap = gap_of(i, p, friction.out, friction.dims)
        least = minimum(least, gap / scale_of(i, friction.out, friction.dims))
    return least


@njit(error_model="numpy")
def gap_inside(theta, step, friction):
    """Return the smallest gap at a fraction of the step."""
    dims = friction.dims
    # modes last for the whole step; those of contacts follow positions and velocities
    for c in range(dims.dimension if ROWS else 2 * dims.rows):
        store(friction.middle, c, inside(theta, c, step.y, step.y_new, step.dense, dims))
    return smallest_gap(step.t + theta * step.h, friction.middle, step.y, friction)
