"""The record of the trajectory."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..driver.clock_slots import BASE, END, NEXT_SAMPLE, WIDTH
from ..driver.dense import inside
from ..simd.lanes import load, store


# --- kernel text below ---
@njit(error_model="numpy", cache=True)
def sample(accepted, t_new, step, clock, cell, spans, samples, dims):
    """Write the trajectory at the sample times inside the step, the next one of each lane at once."""
    reached, lengths, thetas = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    due, still = np.empty(WIDTH, np.int64), np.empty(WIDTH, np.int64)
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
            wanted = clock[NEXT_SAMPLE * WIDTH + lane]
            if wanted > reached[lane]:
                continue
            begin, end = spans[cell[lane], 0], spans[cell[lane], 1]
            gap = (end - begin) / (samples.shape[1] - 1) if samples.shape[1] > 1 else 0.0
            k = round((wanted - begin) / gap) if gap > 0.0 else 0
            if k >= samples.shape[1]:
                continue
            any_due = True
            thetas[lane], due[lane] = max(0.0, 1.0 - (reached[lane] - wanted) / lengths[lane]), k
            following = begin + (k + 1) * gap if k + 2 != samples.shape[1] else end
            still[lane] = samples.shape[1] if following <= wanted else k + 1  # all samples of a window without length
            clock[NEXT_SAMPLE * WIDTH + lane] = following if still[lane] < samples.shape[1] else math.inf
        if not any_due:
            return
        # write one sample of every lane that is due
        for c in range(dims.dimension):
            store(states, c, inside(load(thetas, 0, WIDTH), c, step.y, step.y_new, step.dense, dims))
            for lane in range(WIDTH):
                if due[lane] >= 0:
                    samples[cell[lane], due[lane] : still[lane], c] = states[c * WIDTH + lane]
