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
# What must repeat for the future to repeat, saved behind state and parameters: the state and these of the clock.
REPEATING = (STEP, SYNC)
LONGEST_CYCLE = 32.0
# Taylor steps go on beyond the ends of periods, but for one in PROBE, a multiple of many lengths of cycles.  Once a state
# there is as near as NEAR, or so many rtol, to that at the last one, the steps stop at the ends of all periods.
PROBE, NEAR, JITTER = 60.0, 1e-6, 100.0


@njit(error_model="numpy")
def aligned(count):
    """Zeros that begin on a cache line: a register that lies across two is slow to read and slower to read back."""
    block = np.zeros(count + 8)
    shift = (64 - block.ctypes.data % 64) % 64 // 8
    return block[shift : shift + count]


@njit(error_model="numpy", forceinline=True)
def put(array, slot, which, value):
    """Write one number of one lane as part of a whole register: reading that register back need not wait for memory."""
    store(array, slot, select(one_lane(which, WIDTH), broadcast(value, WIDTH), load(array, slot, WIDTH)))


@njit(error_model="numpy")
def fill(which, cell, start, numbers, spans, control, clock, y, dims):
    """Put a cell into a lane; a lane without a cell of its own (cell < 0) idles on a copy of the first one."""
    idle, cell = cell < 0, max(cell, 0)
    for slot in range(CLOCK):
        put(clock, slot, which, 0.0)
    for slot in range(2 * dims.dimension + dims.parameters + len(REPEATING)):
        put(y, slot, which, 0.0)
    for c in range(dims.dimension):
        put(y, c, which, start[cell, c])
    for c in range(dims.parameters):
        put(y, dims.dimension + c, which, numbers[cell, c])
    put(clock, PERIOD, which, spans[cell, 2] if spans[cell, 2] > 0.0 else math.inf)
    put(clock, FROM, which, spans[cell, 0])
    put(clock, UNTIL, which, spans[cell, 1])
    if SERIES and not spans[cell, 3] > 0.0:
        put(clock, DUE, which, PROBE if dims.repeats else math.inf)
    put(clock, STEP, which, control[FIRST_STEP])
    put(clock, LONGEST, which, control[MAX_STEP])
    put(clock, LOOK, which, math.inf)
    put(clock, CHANGE, which, math.inf)
    put(clock, POWER, which, 1.0)
    put(clock, LEFT, which, -1.0)
    put(clock, NEXT_SAMPLE, which, spans[cell, 0])
    watch(which, control, clock)
    begin(which, cell, spans, clock)
    if idle:
        vacate(which, clock)


@njit(error_model="numpy")
def watch(which, control, clock):
    """Begin to watch the growth of a cell."""
    for group in (MARKED_AT, LAPSE, HIGH, RECORD, ORIGIN):
        put(clock, group, which, 0.0)
    put(clock, MARK, which, min(FIRST_MARK, control[MAX_STEPS]))


@njit(error_model="numpy")
def vacate(which, clock):
    """Let a lane run idly on what it holds: it never stops, and nobody asks for it."""
    for group in (STOP, START, END, PERIOD, BOUND, NEXT_SAMPLE):
        put(clock, group, which, math.inf)
    put(clock, ACCEPTED, which, -math.inf)


@njit(error_model="numpy")
def begin(which, cell, spans, clock):
    """Set the clock of a lane to the beginning of its current period and find the next stop."""
    period, periods = clock[PERIOD * WIDTH + which], clock[PERIODS * WIDTH + which]
    base = periods * period if periods > 0.0 else 0.0
    start, end = spans[cell, 0] - base, spans[cell, 1] - base
    put(clock, BASE, which, base)
    put(clock, TIME, which, 0.0)
    put(clock, START, which, start)
    put(clock, END, which, end)
    bound = period if periods + 1.0 >= clock[DUE * WIDTH + which] else math.inf
    put(clock, BOUND, which, bound)
    put(clock, STOP, which, min(start if start > 0.0 else end, bound))


@njit(error_model="numpy")
def turn_over(which, cell, spans, control, clock, y, dims):
    """Begin the next period of the drive; jump where the computation is known to repeat itself."""
    put(clock, PERIODS, which, clock[PERIODS * WIDTH + which] + 1.0)
    restart(which, clock)
    if dims.repeats:
        if clock[DUE * WIDTH + which] > 0.0:
            approach(which, clock, y, control, dims)
        elif disturbed(which, clock):
            put(clock, CYCLE, which, 0.0)
            put(clock, POWER, which, 1.0)
            save(which, clock, y, dims)
        elif clock[CYCLE * WIDTH + which] == 0.0:
            compare(which, clock, y, dims)
        if clock[CYCLE * WIDTH + which] > 0.0 and control[NO_JUMPS] == 0.0:
            jump(which, cell, spans, clock)
    begin(which, cell, spans, clock)


@njit(error_model="numpy")
def settle_down(which, cell, spans, clock):
    """End a cell that is known to stay synchronous: its error counts as what it is now for the rest of the window."""
    error, start, end = clock[SYNC * WIDTH + which], spans[cell, 0], spans[cell, 1]
    now = clock[BASE * WIDTH + which] + clock[TIME * WIDTH + which]
    put(clock, SYNC_SUM, which, clock[SYNC_SUM * WIDTH + which] + error * (end - max(start, now)))
    put(clock, SYNC_PEAK, which, max(error, clock[SYNC_PEAK * WIDTH + which]))
    put(clock, END, which, -math.inf)


@njit(error_model="numpy")
def restart(which, clock):
    """Let the step control begin the period with nothing in mind but a power of two.

    What the steps of a period are then depends on the state at its beginning alone, and a computation on a periodic orbit
    comes to repeat itself, which the wandering of a step size that remembers would prevent.
    """
    _, exponent = math.frexp(clock[STEP * WIDTH + which])
    put(clock, STEP, which, math.ldexp(0.5, exponent))
    put(clock, MEMORY, which, 0.0)
    put(clock, CHANGE, which, math.inf)


@njit(error_model="numpy")
def approach(which, clock, y, control, dims):
    """Look whether a free clock comes near a motion that repeats itself: its steps stop at the ends of all periods then."""
    saved, gap, size = dims.dimension + dims.parameters, 0.0, 0.0
    for c in range(dims.dimension):
        gap += abs(y[c * WIDTH + which] - y[(saved + c) * WIDTH + which])
        size += abs(y[c * WIDTH + which])
    near = gap <= max(NEAR, JITTER * control[RTOL]) * size
    put(clock, DUE, which, 0.0 if near else clock[PERIODS * WIDTH + which] + PROBE)
    save(which, clock, y, dims)


@njit(error_model="numpy")
def disturbed(which, clock):
    """Whether the window began within a period after the saved one: a step ended there, as none does in other periods.

    What repeated itself before need not do so behind it: the state is another one, by as much as the tolerance allows.
    """
    period, start = clock[PERIOD * WIDTH + which], clock[FROM * WIDTH + which]
    begun = clock[SAVED_AT * WIDTH + which] * period < start < clock[PERIODS * WIDTH + which] * period
    return begun and math.floor(start / period + 0.5) * period != start


@njit(error_model="numpy")
def compare(which, clock, y, dims):
    """Look for a cycle of periods: compare with a saved period, and save the present one after 1, 2, 4 … 32, 32 … periods.

    Source: Brent, BIT Numerical Mathematics 20, 176 (1980), with a bound that finds short cycles soon.
    """
    saved, same = dims.dimension + dims.parameters, True
    for c in range(dims.dimension):
        same = same and y[c * WIDTH + which] == y[(saved + c) * WIDTH + which]
    for k, group in enumerate(REPEATING):
        same = same and clock[group * WIDTH + which] == y[(saved + dims.dimension + k) * WIDTH + which]
    lag = clock[PERIODS * WIDTH + which] - clock[SAVED_AT * WIDTH + which]
    if same:
        put(clock, CYCLE, which, lag)
    elif lag >= clock[POWER * WIDTH + which]:
        put(clock, POWER, which, min(LONGEST_CYCLE, clock[POWER * WIDTH + which] * 2.0))
        save(which, clock, y, dims)


@njit(error_model="numpy")
def save(which, clock, y, dims):
    """Save the state and what else must repeat, behind state and parameters."""
    saved = dims.dimension + dims.parameters
    put(clock, SAVED_AT, which, clock[PERIODS * WIDTH + which])
    for c in range(dims.dimension):
        put(y, saved + c, which, y[c * WIDTH + which])
    for k, group in enumerate(REPEATING):
        put(y, saved + dims.dimension + k, which, clock[group * WIDTH + which])


@njit(error_model="numpy")
def jump(which, cell, spans, clock):
    """Leave out whole cycles: before the window always, inside it after one whole cycle was measured, unless LEFT is 0."""
    period, now = clock[PERIOD * WIDTH + which], clock[PERIODS * WIDTH + which]
    cycle = clock[CYCLE * WIDTH + which]
    start, end = spans[cell, 0], spans[cell, 1]
    if now * period < start:
        leap(which, math.floor((start / period - now) / cycle + 1e-9) * cycle, clock)
    else:
        left = clock[LEFT * WIDTH + which]
        if left < 0.0:
            put(clock, LEFT, which, cycle)
            put(clock, SUM_BEFORE, which, clock[SYNC_SUM * WIDTH + which])
        elif left > 0.0:
            put(clock, LEFT, which, left - 1.0)
            if left == 1.0:
                cycles = max(0.0, math.floor((end / period - now) / cycle + 1e-9))
                leap(which, cycles * cycle, clock)
                gain = clock[SYNC_SUM * WIDTH + which] - clock[SUM_BEFORE * WIDTH + which]
                put(clock, SYNC_SUM, which, clock[SYNC_SUM * WIDTH + which] + cycles * gain)


@njit(error_model="numpy")
def leap(which, periods, clock):
    """Move the clock on by whole periods."""
    put(clock, PERIODS, which, clock[PERIODS * WIDTH + which] + max(0.0, periods))
    put(clock, SKIPPED, which, clock[SKIPPED * WIDTH + which] + max(0.0, periods))


@njit(error_model="numpy")
def unbounded(which, clock, control):
    """Whether the state grows while the steps shrink with it, so that their number will not reach the end.

    Looks when the number of steps has doubled.  If doublings take equal times, the work grows exponentially; bounded
    motions have work in proportion to time, and an angle that turns ever faster has a power of it: their doublings take
    longer and longer.  Those of a jump between slow motions take ever shorter.  Even if growth ended here, the steps
    that are left would not do.
    """
    steps = clock[ACCEPTED * WIDTH + which] + clock[REJECTED * WIDTH + which]
    if steps < clock[MARK * WIDTH + which]:
        return False
    t, size, before = clock[TIME * WIDTH + which], clock[HIGH * WIDTH + which], clock[LAPSE * WIDTH + which]
    now = clock[BASE * WIDTH + which] + t
    lapse = now - clock[MARKED_AT * WIDTH + which]
    if size < CLIMB * clock[RECORD * WIDTH + which] or max(lapse, before) > PACE * min(lapse, before):
        put(clock, ORIGIN, which, size)
    put(clock, MARK, which, min(2.0 * steps, control[MAX_STEPS]))
    put(clock, MARKED_AT, which, now)
    put(clock, LAPSE, which, lapse)
    put(clock, RECORD, which, size)
    put(clock, HIGH, which, 0.0)
    if size < TOWER * clock[ORIGIN * WIDTH + which]:
        return False
    left = clock[END * WIDTH + which] - t
    return steps + 0.5 * steps * left / lapse >= control[MAX_STEPS]


@njit(error_model="numpy")
def outcome(which, clock, y, control, dims):
    """Status of the cell in a lane, 0 while it runs."""
    t = clock[TIME * WIDTH + which]
    largest = 0.0
    for c in range(dims.dimension):
        size = abs(y[c * WIDTH + which])
        if not size < FAR:  # NaN too
            return DIVERGED
        largest = max(largest, size)
    if clock[HALTED * WIDTH + which] != 0.0:
        return STOPPED
    if t >= clock[END * WIDTH + which]:
        return FINISHED
    if control[CANCEL] != 0.0:
        return INTERRUPTED
    if clock[ACCEPTED * WIDTH + which] + clock[REJECTED * WIDTH + which] >= control[MAX_STEPS]:
        return BUDGET
    if unbounded(which, clock, control):
        return DIVERGED
    if pauses(which, clock):
        return PAUSED
    if CONTACTS and clock[RUSH * WIDTH + which] >= LONGEST_RUSH:
        return CHATTERING
    if clock[STEP * WIDTH + which] <= 4e-16 * max(min(1.0, clock[UNTIL * WIDTH + which]), t):
        return DIVERGED if largest > 1e8 else UNDERFLOW  # a blow-up in finite time stops the steps first
    return 0


@njit(error_model="numpy")
def pauses(which, clock):
    """Whether a cell is to pause, so that its integrator is looked at: at LOOKS times as many steps each time."""
    steps = clock[ACCEPTED * WIDTH + which] + clock[REJECTED * WIDTH + which]
    if steps < clock[LOOK * WIDTH + which]:
        return False
    now, until = clock[BASE * WIDTH + which] + clock[TIME * WIDTH + which], clock[UNTIL * WIDTH + which]
    taken, lapse = steps - clock[LOOK * WIDTH + which] / LOOKS, now - clock[LOOKED_AT * WIDTH + which]
    put(clock, LOOK, which, LOOKS * steps)
    put(clock, LOOKED_AT, which, now)
    return taken * (until - now) >= WORTH * lapse


@njit(error_model="numpy")
def come_back(which, clock, y, lane):
    """Put a cell that has paused into a lane, to the last bit as it left it."""
    for slot in range(CLOCK):
        put(clock, slot, which, lane[slot])
    for slot in range(lane.size - CLOCK):
        put(y, slot, which, lane[CLOCK + slot])


@njit(error_model="numpy")
def finish(which, status, clock, y, i, spans, end, sums, counts, lanes, dims):
    """Write what is known about the cell in a lane."""
    comes_back = (status == PAUSED) | (status == UNDERFLOW)
    if lanes.shape[0] > 0 and comes_back:
        for slot in range(CLOCK):
            lanes[i, slot] = clock[slot * WIDTH + which]
        for slot in range(lanes.shape[1] - CLOCK):
            lanes[i, CLOCK + slot] = y[slot * WIDTH + which]
    for c in range(dims.dimension):
        end[i, c] = y[c * WIDTH + which]
    stopped, early = clock[BASE * WIDTH + which] + clock[TIME * WIDTH + which], clock[END * WIDTH + which] == -math.inf
    length = (stopped if status == STOPPED else spans[i, 1]) - spans[i, 0]
    sums[i, MEAN] = clock[SYNC_SUM * WIDTH + which] / length if length > 0.0 else clock[SYNC * WIDTH + which]
    sums[i, PEAK] = clock[SYNC_PEAK * WIDTH + which] if length > 0.0 else clock[SYNC * WIDTH + which]
    sums[i, LAST] = clock[SYNC * WIDTH + which]
    sums[i, STOPPED_AT] = spans[i, 1] if status == FINISHED and spans[i, 1] > 0.0 and not early else stopped
    counts[i, STATUS] = status
    counts[i, N_ACCEPTED] = int(clock[ACCEPTED * WIDTH + which])
    counts[i, N_REJECTED] = int(clock[REJECTED * WIDTH + which])
    counts[i, N_SKIPPED] = int(clock[SKIPPED * WIDTH + which])
