"""The end of a cell where a function of its state passes zero."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import any_lane, broadcast, load, select, store
from .dense import inside
from .names import SERIES, WIDTH
from .recording import BASE, HALTED, crosses, locate
from .sections import surface


# --- kernel text below ---
@njit(error_model="numpy")
def shorten(hits, part, y, y_new, dense, dims):
    """Let the step of some lanes end at a fraction of it: the new state, and the dense output of the shorter step."""
    for c in range(dims.dimension):
        old, end = load(y, c, WIDTH), inside(part, c, y, y_new, dense, dims)
        carried = part * (load(y_new, c, WIDTH) - old) - (end - old)
        before, power = 0.0 * part, part
        for j in range(dims.dense_rows):
            row = load(dense, j * dims.dimension + c, WIDTH)
            if SERIES:
                fresh = power * row
            else:
                carried = carried + power * (row - before)
                fresh = carried
            store(dense, j * dims.dimension + c, select(hits, fresh, row))
            before, power = row, power * part
        store(y_new, c, select(hits, end, load(y_new, c, WIDTH)))


@njit(error_model="numpy")
def halt(accept, t, h, clock, y, y_new, dense, found, dims, section):
    """End the step of a lane where the last section function passes zero, and mark the lane; returns the lengths."""
    now, k = load(clock, BASE, WIDTH) + t, dims.sections * (1 + dims.kept)
    zero, half, one = broadcast(0.0, WIDTH), broadcast(0.5, WIDTH), broadcast(1.0, WIDTH)
    g0 = surface(k, zero, now, h, y, y_new, dense, found, dims, section)
    g1 = surface(k, half, now, h, y, y_new, dense, found, dims, section)
    g2 = surface(k, one, now, h, y, y_new, dense, found, dims, section)
    early = crosses(g0, g1, 0.0) & accept
    late = crosses(g1, g2, 0.0) & accept & ~early
    hits, part = early | late, one
    if any_lane(hits):
        if any_lane(early):
            place = locate(k, early, zero, half, g0, g1, now, h, y, y_new, dense, found, dims, section)
            part = select(early, place, part)
        if any_lane(late):
            place = locate(k, late, half, one, g1, g2, now, h, y, y_new, dense, found, dims, section)
            part = select(late, place, part)
        shorten(hits, part, y, y_new, dense, dims)
        store(clock, HALTED, select(hits, one, load(clock, HALTED, WIDTH)))
    return part * h
