"""The record of section points: states, or what a section on a function keeps."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..driver.clock_slots import DIRECTION, FURTHER, N_POINTS, WIDTH
from ..driver.dense import inside
from ..simd.lanes import any_lane, broadcast, lane_bits, load, store
from .crossings import at_point, begin, crosses, locate, look, ready
from .panels import following


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
def cut_panel(
    k, done, place, width, t, h, y, y_new, dense, found, cell, counts, points, direction, rule, dims, section
):  # fmt: skip
    """Find the points of section k between the points of a panel, in the lanes of `done`."""
    for point in range(len(rule) - 1):
        g_low, g_high = at_point(k, point, found, rule, dims), at_point(k, point + 1, found, rule, dims)
        hits = crosses(g_low, g_high, direction) & done
        if any_lane(hits):
            theta, hits = locate(k, hits, point, place, width, t, h, y, y_new, dense, found, rule, dims, section)
            keep_points(k, theta, lane_bits(hits), t, h, y, y_new, dense, found, cell, counts, points, dims, section)


@njit(error_model="numpy", cache=True)
def cut(counted, t, h, y, y_new, dense, found, cell, counts, points, control, rule, dims, section):
    """Find the section points of a step in the lanes of `counted`."""
    for k in range(dims.sections):
        begin(k, counted, found, rule, dims)
    level, place = 0, 0
    while True:
        width, halved = 1.0 / (1 << level), False
        look(place, width, t, h, y, y_new, dense, found, rule, dims, section)
        for k in range(dims.sections):
            way = control[DIRECTION if k == 0 else FURTHER + k - 1]
            done, deeper = ready(k, level, found, rule, control, dims)
            cut_panel(
                k, done, place, width, t, h, y, y_new, dense, found, cell, counts, points, way, rule, dims, section
            )
            halved = halved | deeper
        level, place = following(level, place, halved)
        if level == 0:
            break
