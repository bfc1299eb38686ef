"""Frames of a lifted network: a cell for each direction, all with the orbit of the first (models/dynamics/lift.py)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.addresses import address
from .clock_slots import *
from .frames import LENGTHS, NEXT, PARTS, PRODUCTS, SHIFT, close_block, orthogonalise
from .sweep import drive

# --- kernel text below ---
# Rows of `places`: the columns of the states and of their deviations in a cell.
STATES, DEVIATIONS = 0, 1


@njit(error_model="numpy")
def enter_directions(start, basis, units, places):
    """Write the directions of a frame to the starts of the cells."""
    for k in range(start.shape[0]):
        for c in range(units.size):
            start[k, places[DEVIATIONS, c]] = units[c] * basis[c, k]


@njit(error_model="numpy")
def take_directions(start, end, basis, units, places, growth):
    """Write the orbit of the first cell to all starts, the directions at unit length to the frame, and their growth."""
    for k in range(start.shape[0]):
        square = 0.0
        for c in range(units.size):
            start[k, places[STATES, c]] = end[0, places[STATES, c]]
            basis[c, k] = end[k, places[DEVIATIONS, c]] / units[c]
            square += basis[c, k] ** 2
        length = math.sqrt(square)
        growth[k] = math.log(length) if length > 0.0 else -math.inf
        for c in range(units.size):
            basis[c, k] = basis[c, k] / length if length > 0.0 else 0.0


@njit(error_model="numpy", nogil=True, cache=True)
def drive_frame(functions, dims, multiplicity, rule, network, first, last, inputs, outputs, framing):
    """Run the cells first … last-1, one for each direction of a frame, over blocks of time.

    The arguments are those of `drive`, and framing: batches (any) numbers of blocks, each as long as spans tell; plan (4),
    frame (4, count), see `frames`; places (2, size); units (size) of the components of a direction; basis (size, count):
    the orthonormal directions, which are overwritten by the last ones; sums (batches, count + 1), to which the growth of the
    directions is added; steps (1), to which the numbers of steps of the cells are added.  start holds the orbit at the
    beginning and, after the call, at the end.  The call ends after a cell that fails.
    """
    start, values, spans, _ = inputs
    end, _, counts, _, _, _ = outputs
    batches, plan, frame, places, units, basis, sums, steps = framing
    count, size = frame.shape[1], units.size
    growth, lengths = np.empty(count), address(frame, LENGTHS * count)
    products = address(frame, PRODUCTS * count)
    for batch in range(batches.size):
        for _ in range(batches[batch]):
            enter_directions(start, basis, units, places)
            if plan[SHIFT] >= 0:
                for k in range(count):
                    values[k, plan[SHIFT]] = plan[NEXT] * spans[k, 1]
                plan[NEXT] = (plan[NEXT] + 1) % plan[PARTS]
            drive(functions, dims, multiplicity, rule, network, first, last, inputs, outputs)
            for k in range(count):
                taken = counts[k, N_ACCEPTED] + counts[k, N_REJECTED]
                steps[0] += taken
                spans[k, FIRST_OF_CELL] = spans[k, 1] / max(1, taken)
                if counts[k, STATUS] != FINISHED:
                    return
            take_directions(start, end, basis, units, places, growth)
            orthogonalise(address(basis, 0), size, count, count, lengths, products)
            close_block(growth, 0.0, False, inputs[3], frame, sums[batch])
