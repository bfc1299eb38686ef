"""How contacts of one coordinate on a ground of constant velocity stick, slip and turn; all with closed gaps change together."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import absolute, any_lane, broadcast, lane_bits, load, minimum, select, store
from .clock_slots import WIDTH
from .gaps import smallest_gap


# --- kernel text below ---
@njit(error_model="numpy")
def change_modes(moved, t, y, friction):
    """Let every contact with a closed gap stick, slip or turn, by the forces on it; return the lanes with events.

    `t` is the time of the event.  The groups of the looks get, for the record of events: 1 for an event, mode before, after.
    """
    shut = moved & (smallest_gap(t, y, y, friction) <= 0.0)
    if not any_lane(shut):
        return 0
    out, dims = friction.out, friction.dims
    for i in range(dims.rows):
        slip, speed = load(y, 2 * dims.rows + i, WIDTH), load(y, dims.rows + i, WIDTH)
        up, down = load(out, 2 * dims.rows + i, WIDTH), load(out, 3 * dims.rows + i, WIDTH)
        sticking = absolute(slip) < 0.5
        touch = moved & ~sticking & (slip * load(out, i, WIDTH) <= 0.0)
        leave = moved & sticking & (minimum(up, -down) <= 0.0)
        lands = select(up < 0.0, 1.0, select(down > 0.0, -1.0, broadcast(0.0, WIDTH)))
        leaves = select(up <= 0.0, 1.0, -1.0 + 0.0 * slip)
        store(y, dims.rows + i, select(touch, load(out, dims.rows + i, WIDTH), speed))
        after = select(touch, lands, select(leave, leaves, slip))
        store(y, 2 * dims.rows + i, after)
        store(out, 6 * dims.rows + i, select(touch | leave, 1.0, 0.0 * slip))
        store(out, 7 * dims.rows + i, slip)
        store(out, 8 * dims.rows + i, after)
    return lane_bits(shut)
