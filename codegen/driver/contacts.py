"""Contacts of one coordinate on a ground of constant velocity: their gaps, and how they stick, slip and turn.

The gap of a slipping contact is its sliding velocity in the direction of slip; that of a sticking one is the distance of
its load from the limits of static friction.  All contacts that have passed change together.
"""

from __future__ import annotations

from numba import njit

from ..simd.lanes import absolute, any_lane, broadcast, lane_bits, load, minimum, select, store
from .clock_slots import LOOPED, WIDTH
from .dense import inside


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def gap_of(i, p, out, dims):
    """Return the gap of one contact from the output of `pushes`."""
    slip = load(p, 2 * dims.nodes + i, WIDTH)
    held = minimum(load(out, 2 * dims.nodes + i, WIDTH), -load(out, 3 * dims.nodes + i, WIDTH))
    return select(absolute(slip) < 0.5, held, slip * load(out, i, WIDTH))


@njit(error_model="numpy", forceinline=True)
def push(t, y, p, friction):
    """Compute the numbers of all contacts at a state."""
    if LOOPED:
        graph, weights = friction.network
        friction.functions.pushes(t, y, p, friction.out, graph, weights)
    else:
        friction.functions.pushes(t, y, p, friction.out)


@njit(error_model="numpy", forceinline=True)
def smallest_gap(t, y, p, friction):
    """Return the smallest gap of all contacts at a state."""
    push(t, y, p, friction)
    least = broadcast(1e300, WIDTH)
    for i in range(friction.dims.nodes):
        least = minimum(least, gap_of(i, p, friction.out, friction.dims))
    return least


@njit(error_model="numpy", forceinline=True)
def scale_of(i, out, dims):
    """Return the scale of a gap: 1."""
    return broadcast(1.0, WIDTH)


@njit(error_model="numpy", forceinline=True)
def grown_scale(i, out, dims):
    """Return the scale of a gap at a look: 1."""
    return broadcast(1.0, WIDTH)


@njit(error_model="numpy", forceinline=True)
def clear_scales(friction):
    """Do nothing: the scales are 1."""


@njit(error_model="numpy")
def gap_inside(theta, step, friction):
    """Return the smallest gap at a fraction of the step."""
    nodes = friction.dims.nodes
    for i in range(nodes):  # both states of a node together, so that neither waits for the other
        position = inside(theta, i, step.y, step.y_new, step.dense, friction.dims)
        speed = inside(theta, nodes + i, step.y, step.y_new, step.dense, friction.dims)
        store(friction.middle, i, position)
        store(friction.middle, nodes + i, speed)
    return smallest_gap(step.t + theta * step.h, friction.middle, step.y, friction)


@njit(error_model="numpy")
def change_modes(moved, t, y, friction):
    """Let every contact with a closed gap stick, slip or turn, by the forces on it; return the lanes with events.

    `t` is the time of the event.  The groups of the looks get, for the record of events: 1 for an event, mode before, after.
    """
    shut = moved & (smallest_gap(t, y, y, friction) <= 0.0)
    if not any_lane(shut):
        return 0
    out, dims = friction.out, friction.dims
    for i in range(dims.nodes):
        slip, speed = load(y, 2 * dims.nodes + i, WIDTH), load(y, dims.nodes + i, WIDTH)
        up, down = load(out, 2 * dims.nodes + i, WIDTH), load(out, 3 * dims.nodes + i, WIDTH)
        sticking = absolute(slip) < 0.5
        touch = moved & ~sticking & (slip * load(out, i, WIDTH) <= 0.0)
        leave = moved & sticking & (minimum(up, -down) <= 0.0)
        lands = select(up < 0.0, 1.0, select(down > 0.0, -1.0, broadcast(0.0, WIDTH)))
        leaves = select(up <= 0.0, 1.0, -1.0 + 0.0 * slip)
        store(y, dims.nodes + i, select(touch, load(out, dims.nodes + i, WIDTH), speed))
        after = select(touch, lands, select(leave, leaves, slip))
        store(y, 2 * dims.nodes + i, after)
        store(out, 6 * dims.nodes + i, select(touch | leave, 1.0, 0.0 * slip))
        store(out, 7 * dims.nodes + i, slip)
        store(out, 8 * dims.nodes + i, after)
    return lane_bits(shut)
