"""Step control of all lanes at once: the size of a step, its acceptance, and the next size."""

from __future__ import annotations

import math

from numba import njit

from ..simd.elementary import exp, log
from ..simd.lanes import absolute, any_lane, broadcast, floor, fma, load, maximum, minimum, select, store, truncated
from ..simd.special import power_of_two
from .clock_slots import *


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def aim(clock):
    """Return the step size of each lane: the proposed one, cut to land on the next stop."""
    left = load(clock, STOP, WIDTH) - load(clock, TIME, WIDTH)
    return minimum(minimum(load(clock, STEP, WIDTH), load(clock, LONGEST, WIDTH)), left)


@njit(error_model="numpy", forceinline=True)
def judge(clock, h, error, power):
    """Accept or reject steps by their errors, propose the next ones; return the mask of accepted lanes.

    `power` is one over the order of the error.  The proposal is that of PI control (exponents 0.7 and 0.4), or that of
    predictive control where it is smaller: it extrapolates the trend of the steps, which saves rejections on the way into a
    sharp turn.  Steps keep 9 bits, so that rounding noise in the error does not reach the step.
    Sources: Gustafsson, ACM Trans. Math. Softw. 20, 496 (1994), sections 3 and 5.
    """
    finite = error < 1e30
    size = log(select(finite, maximum(error, 1e-10), 1e30))
    accept = finite & (error <= 1.0)
    memory, before = load(clock, MEMORY, WIDTH), load(clock, CHANGE, WIDTH)
    steady = power * (0.4 * memory - 0.7 * size)
    predicted = before + power * (memory - 2.0 * size)
    change = select(accept, minimum(steady, predicted), -power * size) - 0.10536051565782628  # the logarithm of 0.9
    change = minimum(maximum(change, -2.4), 1.8)
    proposed = h * exp(change)
    cut_short = h < load(clock, STEP, WIDTH)  # to land on a stop: the old proposal still holds
    proposed = select(accept & cut_short, maximum(proposed, load(clock, STEP, WIDTH)), proposed)
    store(clock, STEP, truncated(proposed))
    store(clock, MEMORY, select(accept, maximum(size, -9.0), memory))
    store(clock, CHANGE, select(accept & ~cut_short, change, math.inf))
    store(clock, ACCEPTED, load(clock, ACCEPTED, WIDTH) + select(accept, 1.0, 0.0 * h))
    store(clock, REJECTED, load(clock, REJECTED, WIDTH) + select(accept, 0.0 * h, 1.0))
    return accept


@njit(error_model="numpy", forceinline=True)
def accept_series(clock, h, limit):
    """Accept steps by their lengths and store their scale, a power of two; after a length of NaN the scale is smaller."""
    accept, scale = h > 0.0, load(clock, STEP, WIDTH)
    taken = power_of_two(select(accept, h, 1.0))
    scale_after = select(h < limit, taken, maximum(scale, taken))  # a step that was cut short says no more than that
    store(clock, STEP, select(accept, scale_after, 0.0625 * scale))
    store(clock, ACCEPTED, load(clock, ACCEPTED, WIDTH) + select(accept, 1.0, 0.0 * scale))
    store(clock, REJECTED, load(clock, REJECTED, WIDTH) + select(accept, 0.0 * scale, 1.0))
    return accept


@njit(error_model="numpy", forceinline=True)
def arrive(clock, t, h):
    """Return the time at the end of the step; a lane that reaches its next stop gets exactly its time."""
    stop = load(clock, STOP, WIDTH)
    return select(h >= stop - t, stop, t + h)


@njit(error_model="numpy", forceinline=True)
def next_stop(clock, t):
    """Return the next stop: the start of the window, the end of the period if it is due, or the end of the run."""
    last, start = minimum(load(clock, END, WIDTH), load(clock, BOUND, WIDTH)), load(clock, START, WIDTH)
    return select(t < start, minimum(start, last), last)


@njit(error_model="numpy", forceinline=True)
def advance(clock, y, t, t_new, accept, y_new, dims):
    """Move the accepted lanes to the end of the step; return the largest modulus of each state."""
    stop, following = load(clock, STOP, WIDTH), next_stop(clock, t_new)
    store(clock, TIME, select(accept, t_new, t))
    store(clock, STOP, select(accept & (t_new >= stop), following, stop))
    largest = broadcast(0.0, WIDTH)
    for c in range(dims.dimension):
        value = select(accept, load(y_new, c, WIDTH), load(y, c, WIDTH))
        store(y, c, value)
        largest = maximum(largest, absolute(value))
    store(clock, HIGH, maximum(load(clock, HIGH, WIDTH), largest))
    return largest


@njit(error_model="numpy", forceinline=True)
def wrap(clock):
    """Let clocks beyond the end of a period count from that end."""
    t, period, end = load(clock, TIME, WIDTH), load(clock, PERIOD, WIDTH), load(clock, END, WIDTH)
    turned = (t >= period) & (t < minimum(load(clock, BOUND, WIDTH), end))
    if any_lane(turned):
        turns = floor(t / period)
        passed, now = load(clock, PERIODS, WIDTH) + turns, fma(-turns, period, t)
        base, bound, before = passed * period, load(clock, BOUND, WIDTH), load(clock, START, WIDTH)
        start = load(clock, FROM, WIDTH) - base
        start = select(t >= before, minimum(start, now), start)  # a window that has begun stays so
        store(clock, START, select(turned, start, before))
        store(clock, END, select(turned, load(clock, UNTIL, WIDTH) - base, end))
        store(clock, BOUND, select(turned & (passed + 1.0 >= load(clock, DUE, WIDTH)), period, bound))
        store(clock, STOP, select(turned, next_stop(clock, now), load(clock, STOP, WIDTH)))
        store(clock, BASE, select(turned, base, load(clock, BASE, WIDTH)))
        store(clock, PERIODS, select(turned, passed, load(clock, PERIODS, WIDTH)))
        store(clock, TIME, select(turned, now, t))


@njit(error_model="numpy", forceinline=True)
def pause(clock, largest):
    """Return the lanes at a stop, at a mark of their steps, with a vanishing step, or out of bounds."""
    t, h = load(clock, TIME, WIDTH), load(clock, STEP, WIDTH)
    due = minimum(load(clock, MARK, WIDTH), load(clock, LOOK, WIDTH))
    marked = load(clock, ACCEPTED, WIDTH) + load(clock, REJECTED, WIDTH) >= due
    stopped = (t >= load(clock, END, WIDTH)) | (t >= load(clock, BOUND, WIDTH))
    due_now = stopped | marked | (h <= 4e-16 * maximum(t, 1.0)) | (largest >= FAR)
    return due_now | (load(clock, RUSH, WIDTH) >= LONGEST_RUSH) if CONTACTS else due_now
