"""The record of section points: states, or what a section on a function keeps."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..driver.clock import DIRECTION, FURTHER, N_POINTS
from ..driver.dense import inside
from ..driver.names import WIDTH
from ..simd.lanes import any_lane, broadcast, lane_bits, load, store
from .crossings import between, crosses, locate, surface


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def keep(k, theta, t, h, y, y_new, dense, found, where, dims, section):
    """What is kept of a point of section k: the state, or its number and the values behind the section functions."""
    if dims.kept < 0:
        for c in range(dims.dimension):
            store(where, c, inside(theta, c, y, y_new, dense, dims))
        return
    section(theta, t, h, y, y_new, dense, found, dims[:2])
    store(where, 0, broadcast(1.0 * k, WIDTH))
    for c in range(dims.kept):
        store(where, c + 1, load(found, dims.sections + k * dims.kept + c, WIDTH))


@njit(error_model="numpy")
def keep_points(k, theta, hits, t, h, y, y_new, dense, found, cell, counts, points, dims, section):
    """Write the points of section k of the lanes in `hits`: time, and what is kept there."""
    size = points.shape[2] - 1
    when = np.empty(WIDTH)
    where = np.empty(size * WIDTH)
    store(when, 0, t + theta * h)
    keep(k, theta, t, h, y, y_new, dense, found, where, dims, section)
    for which in range(WIDTH):
        if (hits >> which) & 1:
            place = counts[cell[which], N_POINTS]
            counts[cell[which], N_POINTS] = place + 1
            if place < points.shape[1]:
                points[cell[which], place, 0] = when[which]
                for c in range(size):
                    points[cell[which], place, c + 1] = where[c * WIDTH + which]


@njit(error_model="numpy")
def cut_one(k, counted, t, h, y, y_new, dense, found, cell, counts, points, direction, dims, section):
    """Find points of section k between the looks into a step, and beside an extremum between two of them."""
    zero, share = broadcast(0.0, WIDTH), 1.0 / dims.looks  # a power of two
    before, g0 = zero / zero, surface(k, zero, t, h, y, y_new, dense, found, dims, section)
    g1 = surface(k, zero + share, t, h, y, y_new, dense, found, dims, section)
    for i in range(dims.looks):
        low, high, behind = zero + i * share, zero + (i + 1) * share, zero / zero
        if i + 2 <= dims.looks:
            behind = surface(k, zero + (i + 2) * share, t, h, y, y_new, dense, found, dims, section)
        middle, g = between(k, i, share, counted, before, g0, g1, behind, t, h, y, y_new, dense, found, dims, section)
        for left, right, g_left, g_right in ((low, middle, g0, g), (middle, high, g, g1)):
            hits = crosses(g_left, g_right, direction) & counted
            if any_lane(hits):
                theta = locate(k, hits, left, right, g_left, g_right, t, h, y, y_new, dense, found, dims, section)
                keep_points(
                    k, theta, lane_bits(hits), t, h, y, y_new, dense, found, cell, counts, points, dims, section
                )
        before, g0, g1 = g0, g1, behind


@njit(error_model="numpy", cache=True)
def cut(counted, t, h, y, y_new, dense, found, cell, counts, points, control, dims, section):
    """Find the section points of a step in the lanes of `counted`."""
    for k in range(dims.sections):
        way = control[DIRECTION if k == 0 else FURTHER + k - 1]
        cut_one(k, counted, t, h, y, y_new, dense, found, cell, counts, points, way, dims, section)
