"""The record of the trajectory."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..driver.clock_slots import BASE, END, NEXT_SAMPLE, UNIT_OF_CELL, WIDTH
from ..driver.dense import inside
from ..simd.lanes import load, store


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def sample_time(k, count, cell, spans, control, dims):
    """Return the time of sample k of a cell, counted from t = 0; infinite behind the last sample."""
    if not k < count:
        return math.inf
    begin, end = spans[cell, 0], spans[cell, 1]
    if dims.sampled == 2:
        return control[control.size - count + int(k)] * spans[cell, UNIT_OF_CELL]
    if k + 1.0 == count and count > 1:
        return end
    return begin + k * ((end - begin) / (count - 1)) if count > 1 else begin


@njit(error_model="numpy", cache=True)
def sample(accepted, t_new, step, clock, cell, spans, samples, control, dims):
    """Write the trajectory at the sample times inside the step, the next one of each lane at once."""
    reached, lengths, thetas = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    due, count = np.empty(WIDTH, np.int64), samples.shape[1]
    store(reached, 0, t_new)
    store(lengths, 0, step.h)
    states = np.empty(dims.dimension * WIDTH)
    # the time that each accepted lane has reached, from t = 0
    for lane in range(WIDTH):
        end, at_end = spans[cell[lane], 1], reached[lane] >= clock[END * WIDTH + lane]
        reached[lane] += clock[BASE * WIDTH + lane]
        if at_end or reached[lane] >= end - 4e-16 * abs(end):  # the end of the last period
            reached[lane] = end
        if not (accepted >> lane) & 1:
            reached[lane] = -math.inf
    while True:
        # the next sample time of each lane, as a fraction of the step
        any_due = False
        for lane in range(WIDTH):
            thetas[lane], due[lane] = 1.0, -1
            following = clock[NEXT_SAMPLE * WIDTH + lane]
            wanted = sample_time(following, count, cell[lane], spans, control, dims)
            if wanted > reached[lane]:
                continue
            any_due = True
            thetas[lane], due[lane] = max(0.0, 1.0 - (reached[lane] - wanted) / lengths[lane]), int(following)
            clock[NEXT_SAMPLE * WIDTH + lane] = following + 1.0
        if not any_due:
            return
        # write one sample of every lane that is due
        for c in range(dims.dimension):
            store(states, c, inside(load(thetas, 0, WIDTH), c, step.y, step.y_new, step.dense, dims))
            for lane in range(WIDTH):
                if due[lane] >= 0:
                    samples[cell[lane], due[lane], c] = states[c * WIDTH + lane]
