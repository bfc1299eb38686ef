"""The end of a cell where a function of its state passes zero."""

from __future__ import annotations

from numba import njit

from ..driver.clock import BASE, HALTED, MARK
from ..driver.dense import inside
from ..driver.names import SERIES, WIDTH
from ..simd.lanes import any_lane, broadcast, load, select, store
from .crossings import between, crosses, locate, surface


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


@njit(error_model="numpy", cache=True)
def halt(accept, t, h, clock, y, y_new, dense, found, dims, section):
    """End the step of a lane where the last section function passes zero, and mark the lane; returns the lengths."""
    now, k = load(clock, BASE, WIDTH) + t, dims.sections * (1 + dims.kept)
    zero, part, share = broadcast(0.0, WIDTH), broadcast(1.0, WIDTH), 1.0 / dims.looks  # a power of two
    before, g0 = zero / zero, surface(k, zero, now, h, y, y_new, dense, found, dims, section)
    g1 = surface(k, zero + share, now, h, y, y_new, dense, found, dims, section)
    hits = accept & (zero > 0.0)
    for i in range(dims.looks):
        low, behind = zero + i * share, zero / zero
        if i + 2 <= dims.looks:
            behind = surface(k, zero + (i + 2) * share, now, h, y, y_new, dense, found, dims, section)
        middle, g = between(
            k, i, share, accept & ~hits, before, g0, g1, behind, now, h, y, y_new, dense, found, dims, section
        )
        passes = crosses(g0, g, 0.0) & accept & ~hits
        if any_lane(passes):
            place = locate(k, passes, low, middle, g0, g, now, h, y, y_new, dense, found, dims, section)
            part, hits = select(passes, place, part), hits | passes
        before, g0, g1 = g0, g1, behind
    if any_lane(hits):
        shorten(hits, part, y, y_new, dense, dims)
        store(clock, HALTED, select(hits, 1.0, load(clock, HALTED, WIDTH)))
        store(clock, MARK, select(hits, 0.0, load(clock, MARK, WIDTH)))  # at once, they need a look
    return part * h
