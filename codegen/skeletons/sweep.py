"""Runs cells of a sweep: lanes in step with each other, each with its own time, step size and parameters.

A cell starts at t = 0, lets transients pass until the start of its window, records until the end of it, and makes
room for the next one.  What a cell computes does not depend on its neighbours in the register.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from synchain.codegen.elementary import exp, log
from synchain.codegen.lanes import absolute, any_lane, broadcast, lane_bits, load, maximum, minimum, select, sqrt, store
from synchain.codegen.skeletons.names import (
    COMPONENTS,
    DENSE_ROWS,
    DIMENSION,
    ERROR_ORDER,
    LOOPED,
    NODES,
    PARAMETERS,
    SECTION,
    SYNC_ERROR,
    TRAJECTORY,
    WIDTH,
    WORKSPACE,
    section,
    step,
)  # fmt: skip

# --- kernel text below ---
# Groups of `lane`: what the drive remembers about the cell in each lane.
TIME, STEP, STOP, START, END, MEMORY, ACCEPTED, REJECTED = 0, 1, 2, 3, 4, 5, 6, 7
SYNC, SYNC_SUM, SYNC_PEAK, NEXT_SAMPLE, SAMPLE_GAP, GROUPS = 8, 9, 10, 11, 12, 13
# How a cell ended.
FINISHED, BUDGET, UNDERFLOW, DIVERGED, INTERRUPTED = 1, 2, 3, 4, 5
# Columns of `control`, of `sums` and of `counts`.
RTOL, ATOL, FIRST_STEP, MAX_STEP, MAX_STEPS, DIRECTION, CANCEL = 0, 1, 2, 3, 4, 5, 6
MEAN, PEAK, LAST, STOPPED_AT = 0, 1, 2, 3
STATUS, N_ACCEPTED, N_REJECTED, N_POINTS = 0, 1, 2, 3


@njit(error_model="numpy")
def fill(which, cell, start, numbers, spans, control, y, p, lane, samples):
    """Put a cell into a lane; a lane without a cell of its own (cell < 0) idles on a copy of the first one."""
    idle, cell = cell < 0, max(cell, 0)
    for c in range(DIMENSION):
        y[c * WIDTH + which] = start[cell, c]
    for c in range(PARAMETERS):
        p[c * WIDTH + which] = numbers[cell, c]
    for group in range(GROUPS):
        lane[group * WIDTH + which] = 0.0
    lane[STEP * WIDTH + which] = control[FIRST_STEP]
    lane[START * WIDTH + which] = spans[cell, 0]
    lane[END * WIDTH + which] = spans[cell, 1]
    lane[STOP * WIDTH + which] = spans[cell, 0] if spans[cell, 0] > 0.0 else spans[cell, 1]
    lane[NEXT_SAMPLE * WIDTH + which] = spans[cell, 0]
    if TRAJECTORY and samples.shape[1] > 1:
        lane[SAMPLE_GAP * WIDTH + which] = (spans[cell, 1] - spans[cell, 0]) / (samples.shape[1] - 1)
    if SYNC_ERROR:
        now = np.empty(WIDTH)
        store(now, 0, spread(y))
        lane[SYNC * WIDTH + which] = now[which]
    if idle:
        for group in (STOP, START, END, NEXT_SAMPLE):
            lane[group * WIDTH + which] = math.inf
        lane[ACCEPTED * WIDTH + which] = -math.inf


@njit(error_model="numpy", forceinline=True)
def aim(lane, control):
    """The step to try in each lane: the proposed one, cut to land on the next stop."""
    left = load(lane, STOP, WIDTH) - load(lane, TIME, WIDTH)
    return minimum(minimum(load(lane, STEP, WIDTH), control[MAX_STEP]), left)


@njit(error_model="numpy", forceinline=True)
def judge(lane, h, error):
    """Accept or reject by the error, propose the next step (PI control); returns the mask of accepted lanes.

    Source: Gustafsson, ACM Trans. Math. Softw. 20, 496 (1994); exponents 0.7 and 0.4 over the order of the estimate.
    """
    known = error < 1e30
    size = log(select(known, maximum(error, 1e-10), 1e30))
    accept = known & (error <= 1.0)
    power = 1.0 / (ERROR_ORDER + 1.0)
    memory = load(lane, MEMORY, WIDTH)
    change = select(accept, 0.4 * power * memory - 0.7 * power * size, -power * size)
    factor = 0.9 * exp(minimum(maximum(change, -2.3), 1.9))
    proposed = h * factor
    cut = h < load(lane, STEP, WIDTH)  # the step was cut to land on a stop: the old proposal still holds
    proposed = select(accept & cut, maximum(proposed, load(lane, STEP, WIDTH)), proposed)
    store(lane, STEP, proposed)
    store(lane, MEMORY, select(accept, maximum(size, -9.0), memory))
    store(lane, ACCEPTED, load(lane, ACCEPTED, WIDTH) + select(accept, 1.0, 0.0 * h))
    store(lane, REJECTED, load(lane, REJECTED, WIDTH) + select(accept, 0.0 * h, 1.0))
    return accept


@njit(error_model="numpy", forceinline=True)
def inside(theta, c, y, y_new, dense):
    """State variable c at the fraction theta of the step."""
    inner = load(dense, (DENSE_ROWS - 1) * DIMENSION + c, WIDTH)
    for j in range(DENSE_ROWS - 2, -1, -1):
        inner = load(dense, j * DIMENSION + c, WIDTH) + theta * inner
    rest = 1.0 - theta
    return rest * load(y, c, WIDTH) + theta * (load(y_new, c, WIDTH) + rest * inner)


@njit(error_model="numpy", forceinline=True)
def spread(y):
    """Synchronisation error: sum over the oscillators of their distance from the first in state space."""
    total = broadcast(0.0, WIDTH)
    for i in range(1, NODES):
        square = broadcast(0.0, WIDTH)
        for c in range(COMPONENTS):
            gap = load(y, c * NODES, WIDTH) - load(y, c * NODES + i, WIDTH)
            square = square + gap * gap
        total = total + sqrt(square)
    return total


@njit(error_model="numpy", forceinline=True)
def observe(lane, h, counted, accept, y, y_new, dense, middle):
    """Add the step to the time integral of the synchronisation error (Simpson) and to its maximum."""
    for c in range(DIMENSION):
        store(middle, c, inside(broadcast(0.5, WIDTH), c, y, y_new, dense))
    first, half, last = load(lane, SYNC, WIDTH), spread(middle), spread(y_new)
    area = h * (first + 4.0 * half + last) / 6.0
    peak = load(lane, SYNC_PEAK, WIDTH)
    store(lane, SYNC_SUM, load(lane, SYNC_SUM, WIDTH) + select(counted, area, 0.0))
    store(lane, SYNC_PEAK, select(counted, maximum(peak, maximum(first, maximum(half, last))), peak))
    store(lane, SYNC, select(accept, last, first))


@njit(error_model="numpy", forceinline=True)
def crosses(before, after, direction):
    """Where a section function goes through zero: falling (-1), rising (+1) or either way (0)."""
    falls, rises = (before > 0.0) & (after <= 0.0), (before < 0.0) & (after >= 0.0)
    if direction < 0.0:
        return falls
    if direction > 0.0:
        return rises
    return falls | rises


@njit(error_model="numpy")
def locate(hits, low, high, g_low, g_high, t, h, y, p, y_new, dense):
    """Zero of the section function between two fractions of the step, to rounding, in the lanes of `hits`.

    Regula falsi with the Anderson-Bjorck weight (BIT 13, 253, 1973), bisection where that stalls.
    """
    a, b, fa, fb = select(hits, low, high), high, g_low, g_high
    for k in range(60):
        active = absolute(b - a) > 1e-15  # the others are done and must not move, whatever their neighbours need
        if not any_lane(active):
            break
        secant = b - fb * (b - a) / (fb - fa)
        good = (secant - a) * (b - secant) > 0.0
        c = select(good, secant, 0.5 * (a + b)) if k % 4 != 3 else 0.5 * (a + b)
        c = select(active, c, b)
        fc = section(c, t, h, y, p, y_new, dense)
        done = (fc == 0.0) | (absolute(c - b) <= 1e-15)
        other = fc * fb < 0.0  # the zero lies between c and b
        weight = 1.0 - fc / fb
        near, f_near = select(other, b, a), select(other, fb, fa * select(weight > 0.0, weight, 0.5))
        a, fa = select(active, select(done, c, near), b), select(active, f_near, fa)
        b, fb = c, fc
    return b


@njit(error_model="numpy")
def keep_points(theta, hits, t, h, y, y_new, dense, cell, counts, points):
    """Write the section points of the lanes in `hits`: time and state."""
    when = np.empty(WIDTH)
    where = np.empty(DIMENSION * WIDTH)
    store(when, 0, t + theta * h)
    for c in range(DIMENSION):
        store(where, c, inside(theta, c, y, y_new, dense))
    for which in range(WIDTH):
        if (hits >> which) & 1:
            k = counts[cell[which], N_POINTS]
            counts[cell[which], N_POINTS] = k + 1
            if k < points.shape[1]:
                points[cell[which], k, 0] = when[which]
                for c in range(DIMENSION):
                    points[cell[which], k, c + 1] = where[c * WIDTH + which]


@njit(error_model="numpy")
def cut(counted, t, h, y, p, y_new, dense, cell, counts, points, direction):
    """Find section points in either half of the step."""
    zero, half, one = broadcast(0.0, WIDTH), broadcast(0.5, WIDTH), broadcast(1.0, WIDTH)
    g0 = section(zero, t, h, y, p, y_new, dense)
    g1 = section(half, t, h, y, p, y_new, dense)
    g2 = section(one, t, h, y, p, y_new, dense)
    early, late = crosses(g0, g1, direction) & counted, crosses(g1, g2, direction) & counted
    if any_lane(early):
        theta = locate(early, zero, half, g0, g1, t, h, y, p, y_new, dense)
        keep_points(theta, lane_bits(early), t, h, y, y_new, dense, cell, counts, points)
    if any_lane(late):
        theta = locate(late, half, one, g1, g2, t, h, y, p, y_new, dense)
        keep_points(theta, lane_bits(late), t, h, y, y_new, dense, cell, counts, points)


@njit(error_model="numpy")
def sample(lane, t_new, h, accepted, y, y_new, dense, cell, samples):
    """Write the trajectory at the sample times inside the step."""
    ends, lengths = np.empty(WIDTH), np.empty(WIDTH)
    store(ends, 0, t_new)
    store(lengths, 0, h)
    place = np.empty(DIMENSION * WIDTH)
    for which in range(WIDTH):
        gap = lane[SAMPLE_GAP * WIDTH + which]
        while (accepted >> which) & 1 and lane[NEXT_SAMPLE * WIDTH + which] <= ends[which]:
            begin, wanted = lane[START * WIDTH + which], lane[NEXT_SAMPLE * WIDTH + which]
            k = round((wanted - begin) / gap) if gap > 0.0 else 0
            if k >= samples.shape[1]:
                break
            theta = 1.0 - (ends[which] - wanted) / lengths[which]
            following = begin + (k + 1) * gap if k + 2 != samples.shape[1] else lane[END * WIDTH + which]
            still = samples.shape[1] if following <= wanted else k + 1  # a window without length: all samples are equal
            for c in range(DIMENSION):
                store(place, c, inside(broadcast(theta, WIDTH), c, y, y_new, dense))
                samples[cell[which], k:still, c] = place[c * WIDTH + which]
            lane[NEXT_SAMPLE * WIDTH + which] = following if still < samples.shape[1] else math.inf


@njit(error_model="numpy")
def outcome(which, lane, y, control):
    """Status of the cell in a lane, 0 while it runs."""
    t = lane[TIME * WIDTH + which]
    if t >= lane[END * WIDTH + which]:
        return FINISHED
    if control[CANCEL] != 0.0:
        return INTERRUPTED
    largest = 0.0
    for c in range(DIMENSION):
        size = abs(y[c * WIDTH + which])
        if not size < 1e100:  # NaN too
            return DIVERGED
        largest = max(largest, size)
    if lane[ACCEPTED * WIDTH + which] + lane[REJECTED * WIDTH + which] >= control[MAX_STEPS]:
        return BUDGET
    if lane[STEP * WIDTH + which] <= 4e-16 * max(1.0, t):
        return DIVERGED if largest > 1e8 else UNDERFLOW  # a blow-up in finite time stops the steps first
    return 0


@njit(error_model="numpy")
def finish(which, status, lane, y, cell, end, sums, counts):
    """Write what is known about the cell in a lane."""
    i = cell[which]
    for c in range(DIMENSION):
        end[i, c] = y[c * WIDTH + which]
    length = lane[END * WIDTH + which] - lane[START * WIDTH + which]
    sums[i, MEAN] = lane[SYNC_SUM * WIDTH + which] / length if length > 0.0 else lane[SYNC * WIDTH + which]
    sums[i, PEAK] = lane[SYNC_PEAK * WIDTH + which] if length > 0.0 else lane[SYNC * WIDTH + which]
    sums[i, LAST] = lane[SYNC * WIDTH + which]
    sums[i, STOPPED_AT] = lane[TIME * WIDTH + which]
    counts[i, STATUS] = status
    counts[i, N_ACCEPTED] = int(lane[ACCEPTED * WIDTH + which])
    counts[i, N_REJECTED] = int(lane[REJECTED * WIDTH + which])


@njit(error_model="numpy", forceinline=True)
def arrive(lane, t, h):
    """The time at the end of the step; a lane that reaches its next stop is set to that time exactly."""
    stop = load(lane, STOP, WIDTH)
    return select(h >= stop - t, stop, t + h)


@njit(error_model="numpy", forceinline=True)
def advance(lane, t, t_new, accept, y, y_new):
    """Move the accepted lanes on."""
    stop = load(lane, STOP, WIDTH)
    store(lane, TIME, select(accept, t_new, t))
    store(lane, STOP, select(accept & (t_new >= stop), load(lane, END, WIDTH), stop))
    for c in range(DIMENSION):
        store(y, c, select(accept, load(y_new, c, WIDTH), load(y, c, WIDTH)))


@njit(error_model="numpy")
def settle(queue, last, lane, y, p, cell, start, numbers, spans, control, end, sums, counts, samples):
    """Take finished cells out of their lanes and put the next ones in; returns the head of the queue."""
    for which in range(WIDTH):
        while cell[which] >= 0:
            status = outcome(which, lane, y, control)
            if status == 0:
                break
            finish(which, status, lane, y, cell, end, sums, counts)
            cell[which] = queue if queue < last and control[CANCEL] == 0.0 else -1
            fill(which, cell[which], start, numbers, spans, control, y, p, lane, samples)
            queue += 1
    return queue


@njit(error_model="numpy", forceinline=True)
def pause(lane, y, control):
    """Mask of lanes that need a look: stopped, out of budget, with a vanishing step, or out of bounds."""
    t, h = load(lane, TIME, WIDTH), load(lane, STEP, WIDTH)
    spent = load(lane, ACCEPTED, WIDTH) + load(lane, REJECTED, WIDTH) >= control[MAX_STEPS]
    largest = absolute(load(y, 0, WIDTH))
    for c in range(1, DIMENSION):
        largest = maximum(largest, absolute(load(y, c, WIDTH)))
    return (t >= load(lane, END, WIDTH)) | spent | (h <= 4e-16 * maximum(t, 1.0)) | (largest >= 1e100)


@njit(error_model="numpy", nogil=True, cache=True)
def drive(first, last, start, numbers, spans, control, end, sums, counts, points, samples, graph, weights):
    """Run the cells first … last-1.

    start (cells, DIMENSION), numbers (cells, PARAMETERS), spans (cells, 2): start and end of the window; control: see
    the column names above.  Filled: end (cells, DIMENSION), sums (cells, 4), counts (cells, 4), points (cells, room,
    DIMENSION + 1), samples (cells, samples, DIMENSION).  graph and weights: the links and the elimination program of a
    network that is stepped through in loops (codegen/sparse.py).
    """
    y, y_new, middle = np.zeros(DIMENSION * WIDTH), np.zeros(DIMENSION * WIDTH), np.zeros(DIMENSION * WIDTH)
    p, dense = np.ones(PARAMETERS * WIDTH), np.zeros((DENSE_ROWS * DIMENSION + WORKSPACE) * WIDTH)
    lane, cell = np.zeros(GROUPS * WIDTH), np.full(WIDTH, -1)
    queue = first
    for which in range(WIDTH):
        cell[which] = queue if queue < last else -1
        fill(which, cell[which], start, numbers, spans, control, y, p, lane, samples)
        queue += 1
    queue = settle(queue, last, lane, y, p, cell, start, numbers, spans, control, end, sums, counts, samples)
    while cell.max() >= 0:
        t, h = load(lane, TIME, WIDTH), aim(lane, control)
        if LOOPED:
            error = step(t, h, y, p, y_new, dense, control[RTOL], control[ATOL], graph, weights)
        else:
            error = step(t, h, y, p, y_new, dense, control[RTOL], control[ATOL])
        t_new = arrive(lane, t, h)
        accept = judge(lane, h, error)
        counted = accept & (t >= load(lane, START, WIDTH))
        if SYNC_ERROR:
            observe(lane, h, counted, accept, y, y_new, dense, middle)
        if SECTION and any_lane(counted):
            cut(counted, t, h, y, p, y_new, dense, cell, counts, points, control[DIRECTION])
        if TRAJECTORY and any_lane(accept):
            sample(lane, t_new, h, lane_bits(accept), y, y_new, dense, cell, samples)
        advance(lane, t, t_new, accept, y, y_new)
        if any_lane(pause(lane, y, control)) or control[CANCEL] != 0.0:
            queue = settle(queue, last, lane, y, p, cell, start, numbers, spans, control, end, sums, counts, samples)
