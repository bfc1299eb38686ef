"""The end of a cell where a function of its state passes zero."""

from __future__ import annotations

from numba import njit

from ..driver.clock_slots import BASE, HALTED, MARK, SERIES, WIDTH
from ..driver.dense import inside
from ..driver.records import Step, Zeros
from ..simd.lanes import any_lane, broadcast, load, select, store
from .crossings import at_point, begin, crosses, locate, look, ready
from .panels import following


# --- kernel text below ---
@njit(error_model="numpy")
def shorten(hits, part, step, dims):
    """Let the step of some lanes end at a fraction of it: the new state, and the dense output of the shorter step."""
    y, y_new, dense = step.y, step.y_new, step.dense
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
def halt(accept, step, clock, found, control, rule, dims, section):
    """End the step of a lane where the last section function passes zero, and mark the lane; return the lengths."""
    now, k, h = load(clock, BASE, WIDTH) + step.t, dims.sections, step.h
    zeros = Zeros(Step(now, h, step.y, step.y_new, step.dense), found, rule, dims, section)
    part, hits = broadcast(1.0, WIDTH), accept & ~accept
    begin(k, accept, zeros)
    level, panel = 0, 0
    while True:
        width = 1.0 / (1 << level)
        look(panel, width, zeros)
        done, halved = ready(k, level, zeros, control)
        for point in range(len(rule) - 1):
            g_low, g_high = at_point(k, point, zeros), at_point(k, point + 1, zeros)
            passes = crosses(g_low, g_high, 0.0) & done & ~hits
            if any_lane(passes):
                zero, passes = locate(k, passes, point, panel, width, zeros)
                part, hits = select(passes, zero, part), hits | passes
        level, panel = following(level, panel, halved)
        if level == 0:
            break
    if any_lane(hits):
        shorten(hits, part, step, dims)
        store(clock, HALTED, select(hits, 1.0, load(clock, HALTED, WIDTH)))
        store(clock, MARK, select(hits, 0.0, load(clock, MARK, WIDTH)))  # at once, they need a look
    return part * h
