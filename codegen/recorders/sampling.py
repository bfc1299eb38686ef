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
def sample(accepted, t_new, h, clock, y, y_new, dense, cell, spans, samples, dims):
    """Write the trajectory at the sample times inside the step, the next one of each lane at once."""
    reached, lengths, thetas = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    due, still = np.empty(WIDTH, np.int64), np.empty(WIDTH, np.int64)
    store(reached, 0, t_new)
    store(lengths, 0, h)
    place = np.empty(dims.dimension * WIDTH)
    for which in range(WIDTH):
        end, at_end = spans[cell[which], 1], reached[which] >= clock[END * WIDTH + which]
        reached[which] += clock[BASE * WIDTH + which]
        if at_end or reached[which] >= end - 4e-16 * abs(end):  # the end of the last period
            reached[which] = end
        if not (accepted >> which) & 1:
            reached[which] = -math.inf
    while True:
        any_due = False
        for which in range(WIDTH):
            thetas[which], due[which] = 1.0, -1
            wanted = clock[NEXT_SAMPLE * WIDTH + which]
            if wanted > reached[which]:
                continue
            begin, end = spans[cell[which], 0], spans[cell[which], 1]
            gap = (end - begin) / (samples.shape[1] - 1) if samples.shape[1] > 1 else 0.0
            k = round((wanted - begin) / gap) if gap > 0.0 else 0
            if k >= samples.shape[1]:
                continue
            any_due = True
            thetas[which], due[which] = max(0.0, 1.0 - (reached[which] - wanted) / lengths[which]), k
            following = begin + (k + 1) * gap if k + 2 != samples.shape[1] else end
            still[which] = samples.shape[1] if following <= wanted else k + 1  # all samples of a window without length
            clock[NEXT_SAMPLE * WIDTH + which] = following if still[which] < samples.shape[1] else math.inf
        if not any_due:
            return
        for c in range(dims.dimension):
            store(place, c, inside(load(thetas, 0, WIDTH), c, y, y_new, dense, dims))
            for which in range(WIDTH):
                if due[which] >= 0:
                    samples[cell[which], due[which] : still[which], c] = place[c * WIDTH + which]
