"""Deviations at the events of the rows of one node, by the saltation matrices that `saltate` of the scene applies."""

from __future__ import annotations

import math

from numba import njit

from ..simd.lanes import any_lane
from .cells import put
from .clock_slots import *
from .rows import GAP, LAW, MODE, NUMBER, OF_SIGN, RATIO, change_modes, number, push

# --- kernel text below ---


@njit(error_model="numpy")
def begin_contacts(old, modes, orbit, dims, functions):
    """Let deviations begin along the surfaces of the rows that are held; return False, as no leg begins."""
    for register in range(modes.registers):
        functions.saltate(dims.rows, orbit.clock[TIME], orbit.y, orbit.y, modes.strengths, old, register)
    return False


@njit(error_model="numpy", forceinline=True)
def releases_with_a_drop(row, out, dims):
    """Return True for a held row under static friction above kinetic friction."""
    drops = number(LAW, row, 0, out, dims) == OF_SIGN and number(RATIO, row, 0, out, dims) > 1.0
    return drops and number(MODE, row, 0, out, dims) == 0.0


@njit(error_model="numpy")
def pass_events(accept, t, strengths, old, active, modes, orbit, dims, functions):
    """Change the modes of rows after a step, and the deviations with them; return False, as no leg begins.

    Equal events of several nodes commute.  If two rows of one node change at one instant, or if the load that ends a
    hold by static friction changes with the events of other nodes, no single matrix tells what becomes of deviations.
    """
    y, out, last, drop, kind = orbit.y, orbit.friction.out, -1.0, False, -1.0
    if any_lane(accept):
        push(t, y, y, orbit.friction)
        for row in range(dims.rows):
            orbit.slips[dims.dimension + row] = 0.0
            if number(GAP, row, 0, out, dims) <= 0.0:
                index = number(NUMBER, row, 0, out, dims)
                drop = drop or releases_with_a_drop(row, out, dims)
                if last == row - index or (drop and kind >= 0.0 and index != kind):
                    put(orbit.clock, RUSH, 0, math.inf)
                last, kind = row - index, index
                orbit.slips[dims.dimension + row] = 1.0
        for c in range(dims.dimension):
            orbit.slips[c] = y[c]
        change_modes(accept, t, y, orbit.friction)
        for row in range(dims.rows if last >= 0.0 else 0):
            if orbit.slips[dims.dimension + row] != 0.0:
                for register in range(active):
                    functions.saltate(row, orbit.clock[TIME], orbit.slips, y, strengths, old, register)
    return False
