"""Deviations at the events of the rows of one node, by the saltation matrices that `saltate` of the scene applies."""

from __future__ import annotations

import math

from numba import njit

from ..simd.lanes import any_lane
from .cells import put
from .clock_slots import *
from .rows import GAP, change_modes, number, smallest_gap

# --- kernel text below ---


@njit(error_model="numpy")
def begin_contacts(old, modes, orbit, dims, functions):
    """Let deviations begin along the surfaces of the rows that are held; return False, as no leg begins."""
    for register in range(modes.registers):
        functions.saltate(dims.rows, orbit.clock[TIME], orbit.y, orbit.y, modes.strengths, old, register)
    return False


@njit(error_model="numpy")
def pass_events(accept, t, strengths, old, active, modes, orbit, dims, functions):
    """Change the modes of rows after a step, and the deviations with them; return False, as no leg begins.

    If two rows of the node change at one instant, no single matrix tells what becomes of deviations.
    """
    y, row = orbit.y, -1
    if any_lane(accept):
        smallest_gap(t, y, y, orbit.friction)
        for i in range(dims.rows):
            if number(GAP, i, 0, orbit.friction.out, dims) <= 0.0:
                if row >= 0:
                    put(orbit.clock, RUSH, 0, math.inf)
                row = i
        for c in range(dims.dimension):
            orbit.slips[c] = y[c]
        change_modes(accept, t, y, orbit.friction)
        if row >= 0:
            for register in range(active):
                functions.saltate(row, orbit.clock[TIME], orbit.slips, y, strengths, old, register)
    return False
