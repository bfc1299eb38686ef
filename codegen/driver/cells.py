"""The life of a cell: it enters a lane, turns over with every period of the drive, and leaves with a status.

A computation that repeats itself bit for bit from one period of the drive to a later one does so for
ever.  Such a cell jumps over as many whole cycles as fit before its window and, if only sums are
recorded, inside it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.lanes import broadcast, load, one_lane, select, store
from .clock_slots import *

# --- kernel text below ---
# If the state and these slots of the clock repeat, the future repeats; they are saved behind state and parameters.
REPEATING = (STEP, SYNC)
LONGEST_CYCLE = 32.0  # periods; longer cycles are not found (a choice)
# Taylor steps pass the ends of periods except every PROBE-th, a multiple of many lengths of cycles.  Once two successive
# states there differ by less than NEAR, or JITTER rtol, the steps stop at the ends of all periods (choices).
PROBE, NEAR, JITTER = 60.0, 1e-6, 100.0


@njit(error_model="numpy")
def aligned(count):
    """Return zeros that begin on a cache line: a register across two of them is slow to read and slower to read back."""
    block = np.zeros(count + 8)
    shift = (64 - block.ctypes.data % 64) % 64 // 8
    return block[shift : shift + count]


@njit(error_model="numpy", forceinline=True)
def put(array, slot, lane, value):
    """Write one number of one lane as part of a whole register, so that reading the register back need not wait for memory."""
    store(array, slot, select(one_lane(lane, WIDTH), broadcast(value, WIDTH), load(array, slot, WIDTH)))


@njit(error_model="numpy", forceinline=True)
def lane_room(dims):
    """Return the number of slots behind the clock of a lane: state, parameters, what may repeat, impacts of rows."""
    return 2 * dims.dimension + dims.parameters + len(REPEATING) + 2 * dims.rows


@njit(error_model="numpy")
def fill(lane, cell, rows, clock, y, dims):
    """Put a cell into a lane; a lane without a cell (cell < 0) idles on a copy of the first one."""
    idle, cell = cell < 0, max(cell, 0)
    spans, control = rows.spans, rows.control
    for slot in range(CLOCK):
        put(clock, slot, lane, 0.0)
    for slot in range(lane_room(dims)):
        put(y, slot, lane, 0.0)
    for c in range(dims.dimension):
        put(y, c, lane, rows.start[cell, c])
    for c in range(dims.parameters):
        put(y, dims.dimension + c, lane, rows.values[cell, c])
    put(clock, PERIOD, lane, spans[cell, 2] if spans[cell, 2] > 0.0 else math.inf)
    put(clock, FROM, lane, spans[cell, 0])
    put(clock, UNTIL, lane, spans[cell, 1])
    if SERIES and not spans[cell, 3] > 0.0:
        put(clock, DUE, lane, PROBE if dims.repeats else math.inf)
    put(clock, STEP, lane, control[FIRST_STEP])
    put(clock, LONGEST, lane, control[MAX_STEP])
    put(clock, LOOK, lane, math.inf)
    put(clock, CHANGE, lane, math.inf)
    put(clock, POWER, lane, 1.0)
    put(clock, LEFT, lane, -1.0)
    watch(lane, control, clock)
    begin(lane, cell, spans, clock)
    if idle:
        vacate(lane, clock)


@njit(error_model="numpy")
def watch(lane, control, clock):
    """Begin to watch the growth of a cell."""
    for group in (MARKED_AT, LAPSE, HIGH, RECORD, ORIGIN):
        put(clock, group, lane, 0.0)
    put(clock, MARK, lane, min(FIRST_MARK, control[MAX_STEPS]))


@njit(error_model="numpy")
def vacate(lane, clock):
    """Let a lane run idly on its present state, without stops and results."""
    for group in (STOP, START, END, PERIOD, BOUND, NEXT_SAMPLE):
        put(clock, group, lane, math.inf)
    put(clock, ACCEPTED, lane, -math.inf)


@njit(error_model="numpy")
def begin(lane, cell, spans, clock):
    """Set the clock of a lane to the beginning of its current period and find the next stop."""
    period, periods = clock[PERIOD * WIDTH + lane], clock[PERIODS * WIDTH + lane]
    base = periods * period if periods > 0.0 else 0.0
    start, end = spans[cell, 0] - base, spans[cell, 1] - base
    put(clock, BASE, lane, base)
    put(clock, TIME, lane, 0.0)
    put(clock, START, lane, start)
    put(clock, END, lane, end)
    bound = period if periods + 1.0 >= clock[DUE * WIDTH + lane] else math.inf
    put(clock, BOUND, lane, bound)
    put(clock, STOP, lane, min(start if start > 0.0 else end, bound))


@njit(error_model="numpy")
def turn_over(lane, cell, spans, control, clock, y, dims):
    """Begin the next period of the drive; skip whole cycles if the computation repeats itself."""
    put(clock, PERIODS, lane, clock[PERIODS * WIDTH + lane] + 1.0)
    restart(lane, clock)
    if dims.repeats:
        if clock[DUE * WIDTH + lane] > 0.0:
            approach(lane, clock, y, control, dims)
        elif disturbed(lane, clock):
            put(clock, CYCLE, lane, 0.0)
            put(clock, POWER, lane, 1.0)
            save(lane, clock, y, dims)
        elif clock[CYCLE * WIDTH + lane] == 0.0:
            compare(lane, clock, y, dims)
        if clock[CYCLE * WIDTH + lane] > 0.0 and control[NO_JUMPS] == 0.0:
            jump(lane, cell, spans, clock)
    begin(lane, cell, spans, clock)


@njit(error_model="numpy")
def settle_down(lane, cell, spans, clock):
    """End a cell that stays synchronous; its present error counts for the remaining window."""
    error, start, end = clock[SYNC * WIDTH + lane], spans[cell, 0], spans[cell, 1]
    now = clock[BASE * WIDTH + lane] + clock[TIME * WIDTH + lane]
    put(clock, SYNC_SUM, lane, clock[SYNC_SUM * WIDTH + lane] + error * (end - max(start, now)))
    put(clock, SYNC_PEAK, lane, max(error, clock[SYNC_PEAK * WIDTH + lane]))
    put(clock, END, lane, -math.inf)


@njit(error_model="numpy")
def restart(lane, clock):
    """Let the step control begin the period with a power of two as the step and no other memory.

    The steps of a period then depend only on the state at its beginning, so that the computation of a periodic orbit
    repeats itself bit for bit after a transient.
    """
    _, exponent = math.frexp(clock[STEP * WIDTH + lane])
    put(clock, STEP, lane, math.ldexp(0.5, exponent))
    put(clock, MEMORY, lane, 0.0)
    put(clock, CHANGE, lane, math.inf)


@njit(error_model="numpy")
def approach(lane, clock, y, control, dims):
    """Test whether a free clock is near a periodic motion; if it is, steps stop at the ends of all periods."""
    saved, gap, size = dims.dimension + dims.parameters, 0.0, 0.0
    for c in range(dims.dimension):
        gap += abs(y[c * WIDTH + lane] - y[(saved + c) * WIDTH + lane])
        size += abs(y[c * WIDTH + lane])
    near = gap <= max(NEAR, JITTER * control[RTOL]) * size
    put(clock, DUE, lane, 0.0 if near else clock[PERIODS * WIDTH + lane] + PROBE)
    save(lane, clock, y, dims)


@njit(error_model="numpy")
def disturbed(lane, clock):
    """Return True if the window began within a period after the saved one: only in that period a step ends there.

    The additional end of a step changes the state within the tolerance, so that an earlier cycle need not go on.
    """
    period, start = clock[PERIOD * WIDTH + lane], clock[FROM * WIDTH + lane]
    begun = clock[SAVED_AT * WIDTH + lane] * period < start < clock[PERIODS * WIDTH + lane] * period
    return begun and math.floor(start / period + 0.5) * period != start


@njit(error_model="numpy")
def compare(lane, clock, y, dims):
    """Look for a cycle of periods: compare with a saved period, and save the present one after 1, 2, 4 … 32, 32 … periods.

    Source: Brent, BIT Numerical Mathematics 20, 176 (1980), with a bound that finds short cycles soon.
    """
    saved, same = dims.dimension + dims.parameters, True
    for c in range(dims.dimension):
        same = same and y[c * WIDTH + lane] == y[(saved + c) * WIDTH + lane]
    for k, group in enumerate(REPEATING):
        same = same and clock[group * WIDTH + lane] == y[(saved + dims.dimension + k) * WIDTH + lane]
    lag = clock[PERIODS * WIDTH + lane] - clock[SAVED_AT * WIDTH + lane]
    if same:
        put(clock, CYCLE, lane, lag)
    elif lag >= clock[POWER * WIDTH + lane]:
        put(clock, POWER, lane, min(LONGEST_CYCLE, clock[POWER * WIDTH + lane] * 2.0))
        save(lane, clock, y, dims)


@njit(error_model="numpy")
def save(lane, clock, y, dims):
    """Save the state and the slots REPEATING of the clock, behind state and parameters."""
    saved = dims.dimension + dims.parameters
    put(clock, SAVED_AT, lane, clock[PERIODS * WIDTH + lane])
    for c in range(dims.dimension):
        put(y, saved + c, lane, y[c * WIDTH + lane])
    for k, group in enumerate(REPEATING):
        put(y, saved + dims.dimension + k, lane, clock[group * WIDTH + lane])


@njit(error_model="numpy")
def jump(lane, cell, spans, clock):
    """Skip whole cycles: before the window always, inside it once a whole cycle was measured, unless LEFT is 0."""
    period, now = clock[PERIOD * WIDTH + lane], clock[PERIODS * WIDTH + lane]
    cycle = clock[CYCLE * WIDTH + lane]
    start, end = spans[cell, 0], spans[cell, 1]
    if now * period < start:
        leap(lane, math.floor((start / period - now) / cycle + 1e-9) * cycle, clock)
    else:
        left = clock[LEFT * WIDTH + lane]
        if left < 0.0:
            put(clock, LEFT, lane, cycle)
            put(clock, SUM_BEFORE, lane, clock[SYNC_SUM * WIDTH + lane])
        elif left > 0.0:
            put(clock, LEFT, lane, left - 1.0)
            if left == 1.0:
                cycles = max(0.0, math.floor((end / period - now) / cycle + 1e-9))
                leap(lane, cycles * cycle, clock)
                gain = clock[SYNC_SUM * WIDTH + lane] - clock[SUM_BEFORE * WIDTH + lane]
                put(clock, SYNC_SUM, lane, clock[SYNC_SUM * WIDTH + lane] + cycles * gain)


@njit(error_model="numpy")
def leap(lane, periods, clock):
    """Move the clock on by whole periods."""
    put(clock, PERIODS, lane, clock[PERIODS * WIDTH + lane] + max(0.0, periods))
    put(clock, SKIPPED, lane, clock[SKIPPED * WIDTH + lane] + max(0.0, periods))


@njit(error_model="numpy")
def unbounded(lane, clock, control):
    """Return True if the state grows and the steps shrink with it, so that MAX_STEPS steps will not reach the end.

    The test runs when the number of steps has doubled.  If doublings take equal times, the work grows exponentially.
    A bounded motion has work in proportion to time, and an angle that turns ever faster has work like a power of time:
    their doublings take longer and longer.  Doublings at a jump between slow motions become shorter and shorter.
    The remaining steps must be too few even if growth ends now.
    """
    steps = clock[ACCEPTED * WIDTH + lane] + clock[REJECTED * WIDTH + lane]
    if steps < clock[MARK * WIDTH + lane]:
        return False
    t, size, before = clock[TIME * WIDTH + lane], clock[HIGH * WIDTH + lane], clock[LAPSE * WIDTH + lane]
    now = clock[BASE * WIDTH + lane] + t
    lapse = now - clock[MARKED_AT * WIDTH + lane]
    if size < CLIMB * clock[RECORD * WIDTH + lane] or max(lapse, before) > PACE * min(lapse, before):
        put(clock, ORIGIN, lane, size)
    put(clock, MARK, lane, min(2.0 * steps, control[MAX_STEPS]))
    put(clock, MARKED_AT, lane, now)
    put(clock, LAPSE, lane, lapse)
    put(clock, RECORD, lane, size)
    put(clock, HIGH, lane, 0.0)
    if size < TOWER * clock[ORIGIN * WIDTH + lane]:
        return False
    left = clock[END * WIDTH + lane] - t
    return steps + 0.5 * steps * left / lapse >= control[MAX_STEPS]


@njit(error_model="numpy")
def outcome(lane, clock, y, control, dims):
    """Return the status of the cell in a lane, 0 while it runs."""
    t = clock[TIME * WIDTH + lane]
    largest = 0.0
    for c in range(dims.dimension):
        size = abs(y[c * WIDTH + lane])
        if not size < FAR:  # NaN too
            return DIVERGED
        largest = max(largest, size)
    if clock[HALTED * WIDTH + lane] != 0.0:
        return STOPPED
    if t >= clock[END * WIDTH + lane]:
        return FINISHED
    if control[CANCEL] != 0.0:
        return INTERRUPTED
    if clock[ACCEPTED * WIDTH + lane] + clock[REJECTED * WIDTH + lane] >= control[MAX_STEPS]:
        return BUDGET
    if unbounded(lane, clock, control):
        return DIVERGED
    if pauses(lane, clock):
        return PAUSED
    if CONTACTS and clock[RUSH * WIDTH + lane] >= LONGEST_RUSH:
        return AMBIGUOUS if clock[RUSH * WIDTH + lane] == math.inf else CHATTERING
    if clock[STEP * WIDTH + lane] <= 4e-16 * max(min(1.0, clock[UNTIL * WIDTH + lane]), t):
        return DIVERGED if largest > 1e8 else UNDERFLOW  # a blow-up in finite time stops the steps first
    return 0


@njit(error_model="numpy")
def pauses(lane, clock):
    """Return True if a cell must pause for another choice of its integrator; each test is LOOKS times as many steps later."""
    steps = clock[ACCEPTED * WIDTH + lane] + clock[REJECTED * WIDTH + lane]
    if steps < clock[LOOK * WIDTH + lane]:
        return False
    now, until = clock[BASE * WIDTH + lane] + clock[TIME * WIDTH + lane], clock[UNTIL * WIDTH + lane]
    taken, lapse = steps - clock[LOOK * WIDTH + lane] / LOOKS, now - clock[LOOKED_AT * WIDTH + lane]
    put(clock, LOOK, lane, LOOKS * steps)
    put(clock, LOOKED_AT, lane, now)
    return taken * (until - now) >= WORTH * lapse


@njit(error_model="numpy")
def come_back(lane, clock, y, saved):
    """Put a paused cell back into a lane, with the same bits."""
    for slot in range(CLOCK):
        put(clock, slot, lane, saved[slot])
    for slot in range(saved.size - CLOCK):
        put(y, slot, lane, saved[CLOCK + slot])


@njit(error_model="numpy")
def finish(lane, status, clock, y, i, spans, results, dims):
    """Write the results of the cell in a lane."""
    end, sums, counts, paused = results.end, results.sums, results.counts, results.paused
    # a cell that another integrator may continue leaves its whole lane
    comes_back = (status == PAUSED) | (status == UNDERFLOW)
    if paused.shape[0] > 0 and comes_back:
        for slot in range(CLOCK):
            paused[i, slot] = clock[slot * WIDTH + lane]
        for slot in range(paused.shape[1] - CLOCK):
            paused[i, CLOCK + slot] = y[slot * WIDTH + lane]
    for c in range(dims.dimension):
        end[i, c] = y[c * WIDTH + lane]
    # averages over the window, which a stop may have cut short
    stopped, early = clock[BASE * WIDTH + lane] + clock[TIME * WIDTH + lane], clock[END * WIDTH + lane] == -math.inf
    length = (stopped if status == STOPPED else spans[i, 1]) - spans[i, 0]
    sums[i, MEAN] = clock[SYNC_SUM * WIDTH + lane] / length if length > 0.0 else clock[SYNC * WIDTH + lane]
    sums[i, PEAK] = clock[SYNC_PEAK * WIDTH + lane] if length > 0.0 else clock[SYNC * WIDTH + lane]
    sums[i, LAST] = clock[SYNC * WIDTH + lane]
    sums[i, STOPPED_AT] = spans[i, 1] if status == FINISHED and spans[i, 1] > 0.0 and not early else stopped
    counts[i, STATUS] = status
    counts[i, N_ACCEPTED] = int(clock[ACCEPTED * WIDTH + lane])
    counts[i, N_REJECTED] = int(clock[REJECTED * WIDTH + lane])
    counts[i, N_SKIPPED] = int(clock[SKIPPED * WIDTH + lane])
