"""Deviations at the events of contacts and rows, by the saltation matrices that `saltate` of the scene applies."""

from __future__ import annotations

import math

from numba import njit

from ..simd.lanes import any_lane
from .cells import put
from .clock_slots import *
from .contacts import change_modes
from .gaps import GAP, LAW, MODE, NUMBER, RATIO, push
from .rows import OF_SIGN, number

# --- kernel text below ---


@njit(error_model="numpy")
def begin_events_of_modes(old, modes, orbit, dims, functions):
    """Let deviations begin along the surfaces of what is held; return True if a contact sticks, which begins an interval."""
    for register in range(modes.registers):
        functions.saltate(dims.rows, orbit.clock[TIME], orbit.y, orbit.y, modes.strengths, old, register)
    sticks = False
    for i in range(0 if ROWS else dims.rows):
        sticks = sticks or orbit.y[2 * dims.rows + i] == 0.0
    return sticks


@njit(error_model="numpy", forceinline=True)
def releases_with_a_drop(row, out, dims):
    """Return True for a held row under static friction above kinetic friction."""
    drops = number(LAW, row, 0, out, dims) == OF_SIGN and number(RATIO, row, 0, out, dims) > 1.0
    return drops and number(MODE, row, 0, out, dims) == 0.0


@njit(error_model="numpy")
def note_closed_rows(t, orbit, dims):
    """Set `changed` to 1 for rows with a closed gap.

    Equal events of several nodes commute.  If two rows of one node change at one instant, or if the load that ends a
    hold by static friction changes with the events of other nodes, no single matrix tells what becomes of deviations.
    """
    out, last, drop, kind = orbit.friction.out, -1.0, False, -1.0
    push(t, orbit.y, orbit.y, orbit.friction)
    for row in range(dims.rows):
        if number(GAP, row, 0, out, dims) <= 0.0:
            index = number(NUMBER, row, 0, out, dims)
            drop = drop or releases_with_a_drop(row, out, dims)
            if last == row - index or (drop and kind >= 0.0 and index != kind):
                put(orbit.clock, RUSH, 0, math.inf)
            last, kind = row - index, index
            orbit.changed[row] = 1.0


@njit(error_model="numpy")
def pass_events(accept, t, strengths, old, active, modes, orbit, dims, functions):
    """Change modes after a step, and the deviations with them; return True if a contact has begun to stick."""
    y, before, changed, landed = orbit.y, orbit.before, orbit.changed, False
    if not any_lane(accept):
        return False
    for row in range(dims.rows):
        changed[row] = 0.0
    if ROWS:
        note_closed_rows(t, orbit, dims)
    for c in range(dims.dimension):
        before[c] = y[c]
    change_modes(accept, t, y, orbit.friction)
    for row in range(dims.rows):
        if not ROWS:
            after = y[2 * dims.rows + row]
            changed[row] = 1.0 if after != before[2 * dims.rows + row] else 0.0
            landed = landed or (changed[row] != 0.0 and after == 0.0)
        if changed[row] != 0.0:
            for register in range(active):
                functions.saltate(row, orbit.clock[TIME], before, y, strengths, old, register)
    return landed
