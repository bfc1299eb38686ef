"""The record of synchronisation errors."""

from __future__ import annotations

from numba import njit

from ..driver.clock_slots import SERIES, SYNC, SYNC_PEAK, SYNC_SUM, WIDTH
from ..driver.dense import inside
from ..driver.spread import spread
from ..simd.lanes import broadcast, load, maximum, select, store


# --- kernel text below ---
@njit(error_model="numpy", cache=True)
def observe(counted, accept, step, clock, middle, multiplicity, dims):
    """Add the step to the time integral of the synchronisation error (Simpson) and to its maximum."""
    y, y_new, dense = step.y, step.y_new, step.dense
    peak, first, last = load(clock, SYNC_PEAK, WIDTH), load(clock, SYNC, WIDTH), spread(y_new, multiplicity, dims)
    panels = 4 if SERIES else 1  # of the rule; a Taylor step is several times longer than others
    total, half = first, broadcast(0.0, WIDTH)
    for k in range(1, 2 * panels):
        for c in range(dims.dimension):
            store(middle, c, inside(broadcast(0.5 * k / panels, WIDTH), c, y, y_new, dense, dims))
        value = spread(middle, multiplicity, dims)
        total = total + (4.0 if k % 2 else 2.0) * value
        half = maximum(half, value)
    area = step.h * (total + last) / (6.0 * panels)
    store(clock, SYNC_SUM, load(clock, SYNC_SUM, WIDTH) + select(counted, area, 0.0))
    store(clock, SYNC_PEAK, select(counted, maximum(peak, maximum(first, maximum(half, last))), peak))
    store(clock, SYNC, select(accept, last, first))
