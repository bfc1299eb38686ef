"""Record section points: the states, or the expressions that a section on a function lists."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..driver.clock_slots import DIRECTION, FURTHER, N_POINTS, WIDTH
from ..driver.dense import inside
from ..driver.records import Zeros
from ..simd.lanes import any_lane, broadcast, lane_bits, load, store
from .crossings import at_point, begin, crosses, evaluate, locate, look, ready
from .panels import following


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def keep(k, theta, zeros, where):
    """Write a point of section k: the state, or the number k and the stored values of the section."""
    step, dims = zeros.step, zeros.dims
    if dims.kept < 0:
        for c in range(dims.dimension):
            store(where, c, inside(theta, c, step.y, step.y_new, step.dense, dims))
        return
    evaluate(theta, 0, zeros)
    store(where, 0, broadcast(1.0 * k, WIDTH))
    for c in range(dims.kept):
        store(where, c + 1, load(zeros.found, dims.sections + k * dims.kept + c, WIDTH))


@njit(error_model="numpy")
def keep_points(k, theta, hits, zeros, cell, counts, points):
    """Append the points of section k of the lanes in `hits`, with their times, to the points of their cells."""
    size = points.shape[2] - 1
    when = np.empty(WIDTH)
    where = np.empty(size * WIDTH)
    store(when, 0, zeros.step.t + theta * zeros.step.h)
    keep(k, theta, zeros, where)
    for lane in range(WIDTH):
        if (hits >> lane) & 1:
            # points beyond the room are counted and not stored
            index = counts[cell[lane], N_POINTS]
            counts[cell[lane], N_POINTS] = index + 1
            if index < points.shape[1]:
                points[cell[lane], index, 0] = when[lane]
                for c in range(size):
                    points[cell[lane], index, c + 1] = where[c * WIDTH + lane]


@njit(error_model="numpy")
def cut_panel(k, done, panel, width, zeros, cell, counts, points, direction):
    """Find the points of section k between the points of a panel, in the lanes of `done`."""
    for point in range(len(zeros.rule) - 1):
        g_low, g_high = at_point(k, point, zeros), at_point(k, point + 1, zeros)
        hits = crosses(g_low, g_high, direction) & done
        if any_lane(hits):
            theta, hits = locate(k, hits, point, panel, width, zeros)
            keep_points(k, theta, lane_bits(hits), zeros, cell, counts, points)


@njit(error_model="numpy", cache=True)
def cut(counted, step, found, cell, counts, points, control, rule, dims, section):
    """Find the section points of a step in the lanes of `counted`."""
    zeros = Zeros(step, found, rule, dims, section)
    for k in range(dims.sections):
        begin(k, counted, zeros)
    level, panel = 0, 0
    while True:
        # all sections share the values in a panel; each halves the panel where it needs that
        width, halved = 1.0 / (1 << level), False
        look(panel, width, zeros)
        for k in range(dims.sections):
            direction = control[DIRECTION if k == 0 else FURTHER + k - 1]
            done, deeper = ready(k, level, zeros, control)
            cut_panel(k, done, panel, width, zeros, cell, counts, points, direction)
            halved = halved | deeper
        level, panel = following(level, panel, halved)
        if level == 0:
            break
