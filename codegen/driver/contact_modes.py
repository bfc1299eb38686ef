"""Deviations at the events of contacts: velocities stop, turn, or jump where a body lets go and friction drops at once."""

from __future__ import annotations

from numba import njit

from ..simd.lanes import load, store
from .clock_slots import LANES, TIME
from .contacts import change_modes


# --- kernel text below ---
@njit(error_model="numpy")
def brake(i, factor, modes, registers, owners):
    """Multiply the velocities of deviations at contact i."""
    for register in range(registers):
        for c in range(owners.size):
            if owners[c] == i:
                store(modes, owners.size * register + c, factor * load(modes, owners.size * register + c, LANES))


@njit(error_model="numpy")
def saltate(i, before, strengths, deviations, registers, orbit, owners, dims, release):
    """Change deviations by an event of contact i; `before` is its mode before."""
    y, out = orbit.y, orbit.friction.out
    after = y[2 * dims.nodes + i]
    if before == 0.0:
        if dims.jumps:
            for register in range(registers):
                release(i, after, orbit.clock[TIME], y, strengths, deviations, register)
        return
    pushed, pulled = out[4 * dims.nodes + i], out[5 * dims.nodes + i]
    factor = 0.0 if after == 0.0 else pushed / pulled if after > 0.0 else pulled / pushed
    brake(i, factor, deviations, registers, owners)


@njit(error_model="numpy")
def begin_contacts(old, modes, orbit, dims, functions):
    """Stop the velocities of deviations at contacts that stick at the start; return True if there are any."""
    sticks = False
    for i in range(dims.nodes):
        if orbit.y[2 * dims.nodes + i] == 0.0:
            brake(i, 0.0, old, modes.registers, modes.owners)
            sticks = True
    return sticks


@njit(error_model="numpy")
def pass_events(accept, t, strengths, old, active, modes, orbit, dims, functions):
    """Change the modes of contacts after a step, and the deviations with them; return True if a body has landed."""
    y, landed = orbit.y, False
    for i in range(dims.nodes):
        orbit.slips[i] = y[2 * dims.nodes + i]
    change_modes(accept, t, y, orbit.friction)
    for i in range(dims.nodes):
        if y[2 * dims.nodes + i] != orbit.slips[i]:
            saltate(i, orbit.slips[i], strengths, old, active, orbit, modes.owners, dims, functions.release)
            landed = landed or y[2 * dims.nodes + i] == 0.0
    return landed
