"""A run with events, as exported text: an adaptive step, the location of events, and the modes of rows behind them.

The functions below the mark are the text of exported Python modules; `in_c` (c_functions.py) translates them to C.
The decisions are those of the kernels (codegen/driver/decisions.py); the rest follows codegen/driver/rows.py and
passages.py, which give the sources.  `pushes` writes
GROUPS numbers for each row: those named LEVEL … NUMBER, then those of the event, IMPULSE … SHUT, the size of the terms of
the gap, its largest value in a step, the hardest impact since the stop closed, and the entries of K.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..driver.decisions import decide, eliminated, forces

Doubles = np.ndarray
Seen = Callable[[float, int, float, float], None] | None

DIMENSION = EVENT_ROWS = GROUPS = 1
A = C = E3 = E5 = DENSE = np.zeros(1)


def slopes(t: float, state: Doubles, numbers: Doubles, rates: Doubles) -> None:
    """Write d(state)/dt."""


def pushes(t: float, state: Doubles, numbers: Doubles, rows: Doubles) -> None:
    """Write the numbers of all rows."""


def strike(t: float, state: Doubles, numbers: Doubles, rows: Doubles) -> None:
    """Add impulses to a state, correct gaps, reset states, and store modes."""


# --- exported text below ---
LEVEL, GAP, MODE, SPEED, RATE, RATIO, LAW, NUMBER = 0, 1, 2, 3, 4, 5, 6, 7
IMPULSE, LIFT, FIRES, ROLE, BEFORE, SPEED_BEFORE, X, SHUT = 8, 9, 10, 11, 12, 13, 14, 15
SIZE, SCALE, HARDEST, STRONGEST, FELT, K = 16, 17, 18, 19, 20, 21
OF_SIGN, OF_STOP, OF_RESET = 0, 1, 2
UNTOUCHED, KNOWN, OPEN, RELEASED = 0, 1, 2, 3
FINISHED, AMBIGUOUS, CHATTERING, NO_STEP = 0, 1, 2, 3
PASSED, SHORTEST, NONE, LOWEST, PART = 1e-13, 1e-13, 1e-12, 1e-12, 0.015625


# --- decisions ---


def rebound(modes: Doubles, x: Doubles, a: int, first: int, size: int, rows: Doubles) -> int:
    """Note the impulse of a stop by Newton's law; return 0 if it fixes none: two stops feel each other, or e is not in 0..1."""
    at = (first + a) * GROUPS
    speed = rows[at + SPEED]
    stiff = rows[at + K + a]
    e = rows[at + RATIO]
    inward = rows[at + RATE]
    good = 1 if e >= -NONE and e <= 1.0 + NONE else 0
    for b in range(size):
        other = (first + b) * GROUPS
        inward -= rows[at + K + b] * x[b]
        hit = rows[other + GAP] <= 0.0 or modes[b] == 0.0
        if b != a and rows[other + LAW] == OF_STOP and hit and rows[at + K + b] != 0.0:
            good = 0
    rows[at + LIFT] = -rows[at + LEVEL] / stiff
    if speed < 0.0:
        return good
    # the speed at the gap 0; a stop closes when its rebounds have become LOWEST times as high as the first ones
    touch = math.sqrt(max(speed * speed + 2.0 * inward * rows[at + LEVEL], 0.0))
    after = e * touch
    hardest = max(rows[at + HARDEST], touch)
    strongest = max(rows[at + STRONGEST], abs(inward))
    if inward > 0.0 and e < 1.0 and after * after * strongest <= LOWEST * hardest * hardest * inward:
        after = 0.0
    rows[at + HARDEST] = hardest if after > 0.0 else 0.0
    rows[at + STRONGEST] = strongest if after > 0.0 else 0.0
    if after == 0.0:
        rows[at + ROLE] = OPEN
    rows[at + IMPULSE] = (speed + after) / stiff
    return good


def begin_event(first: int, size: int, rows: Doubles) -> int:
    """Note what an event means for the rows of a node, and the impulses of its stops; return AMBIGUOUS or FINISHED."""
    modes = np.empty(size)
    x = np.empty(size)
    outcome = FINISHED
    for a in range(size):
        modes[a] = rows[(first + a) * GROUPS + MODE]
    forces(modes, x, first, size, rows)
    for a in range(size):
        at = (first + a) * GROUPS
        shut = rows[at + GAP] <= 0.0
        rows[at + BEFORE] = modes[a]
        rows[at + SPEED_BEFORE] = rows[at + SPEED]
        rows[at + X] = x[a]
        rows[at + SHUT] = shut
        rows[at + ROLE] = OPEN if shut and rows[at + LAW] == OF_SIGN else KNOWN
        if modes[a] == 0.0:
            rows[at + ROLE] = RELEASED if shut else OPEN
        if shut and rows[at + LAW] == OF_RESET:
            rows[at + FIRES] = 1.0
        hit = shut and rows[at + LAW] == OF_STOP and modes[a] != 0.0
        if hit and rebound(modes, x, a, first, size, rows) == 0:
            outcome = AMBIGUOUS
    # the sum of the changes of each speed by impulses, without their signs
    for a in range(size):
        at = (first + a) * GROUPS
        rows[at + FELT] = 0.0
        for b in range(size):
            rows[at + FELT] += abs(rows[at + K + b] * rows[(first + b) * GROUPS + IMPULSE])
    return outcome


def after_jump(first: int, size: int, rows: Doubles) -> None:
    """Set the modes of rows whose speeds have jumped: they leave their surfaces."""
    for a in range(size):
        at = (first + a) * GROUPS
        speed = rows[at + SPEED]
        mode = rows[at + MODE]
        jump = speed - rows[at + SPEED_BEFORE]
        small = NONE * max(rows[at + FELT], max(abs(speed), abs(rows[at + SPEED_BEFORE])))
        if rows[at + LAW] == OF_SIGN and rows[at + ROLE] == KNOWN:
            rows[at + MODE] = -mode if mode * speed < 0.0 else mode
        elif rows[at + LAW] == OF_SIGN and abs(jump) > small:
            rows[at + ROLE] = KNOWN
            rows[at + MODE] = 1.0 if speed > 0.0 else -1.0
        elif rows[at + LAW] == OF_STOP and mode == 0.0 and jump < -small:
            rows[at + ROLE] = KNOWN
            rows[at + MODE] = 1.0


def project_held(first: int, size: int, rows: Doubles) -> None:
    """Note the impulses that put the held rows of a node onto their surfaces."""
    matrix = np.empty(size * size)
    right = np.empty(size)
    modes = np.empty(size)
    for a in range(size):
        modes[a] = rows[(first + a) * GROUPS + MODE]
    for _attempt in range(size):
        for a in range(size):
            at = (first + a) * GROUPS
            right[a] = rows[at + SPEED]
            for b in range(size):
                matrix[a * size + b] = rows[at + K + b]
        if eliminated(matrix, right, modes, size) != 0.0:
            break
        # rows that depend on each other: leave the last one out
        last = -1
        for a in range(size):
            if modes[a] == 0.0:
                last = a
        modes[last] = 1.0
    for a in range(size):
        at = (first + a) * GROUPS
        if modes[a] == 0.0:
            rows[at + IMPULSE] = right[a]
            if rows[at + LAW] == OF_STOP:
                rows[at + LIFT] = -rows[at + LEVEL] / rows[at + K + a]


def size_of(first: int, rows: Doubles) -> int:
    """Return the number of rows of a node from its first row."""
    size = 1
    while first + size < EVENT_ROWS and rows[(first + size) * GROUPS + NUMBER] != 0.0:
        size += 1
    return size


def clear(rows: Doubles) -> None:
    """Clear what the last event has noted about impulses."""
    for row in range(EVENT_ROWS):
        rows[row * GROUPS + IMPULSE] = 0.0
        rows[row * GROUPS + LIFT] = 0.0
        rows[row * GROUPS + FIRES] = 0.0


def settle(t: float, state: Doubles, numbers: Doubles, rows: Doubles) -> int:
    """Decide the modes of nodes with an event, and put their held rows onto the surfaces."""
    outcome = FINISHED
    first = 0
    pushes(t, state, numbers, rows)
    clear(rows)
    while first < EVENT_ROWS:
        size = size_of(first, rows)
        if rows[first * GROUPS + ROLE] != UNTOUCHED:
            after_jump(first, size, rows)
            if decide(first, size, rows) != 1:
                outcome = AMBIGUOUS
            project_held(first, size, rows)
        first += size
    strike(t, state, numbers, rows)
    return outcome


def change_modes(t: float, state: Doubles, numbers: Doubles, rows: Doubles) -> int:
    """Let rows with closed gaps rebound, reset, be held, slip or open; keep held rows on their surfaces."""
    outcome = FINISHED
    events = 0
    first = 0
    pushes(t, state, numbers, rows)
    clear(rows)
    while first < EVENT_ROWS:
        size = size_of(first, rows)
        closed = 0
        for row in range(first, first + size):
            rows[row * GROUPS + ROLE] = UNTOUCHED
            rows[row * GROUPS + SHUT] = 0.0
            rows[row * GROUPS + BEFORE] = rows[row * GROUPS + MODE]
            if rows[row * GROUPS + GAP] <= 0.0:
                closed = 1
        if closed == 1:
            events = 1
            if begin_event(first, size, rows) != FINISHED:
                outcome = AMBIGUOUS
        else:
            project_held(first, size, rows)
        first += size
    strike(t, state, numbers, rows)
    if events == 1 and settle(t, state, numbers, rows) != FINISHED:
        outcome = AMBIGUOUS
    return outcome


def begin(t: float, state: Doubles, numbers: Doubles) -> int:
    """Set the modes of a state at the start, from levels and forces; return AMBIGUOUS for a start behind a stop or guard."""
    rows = np.empty(EVENT_ROWS * GROUPS)
    pushes(t, state, numbers, rows)
    clear(rows)
    for row in range(EVENT_ROWS):
        at = row * GROUPS
        on = rows[at + LEVEL] == 0.0 and rows[at + SPEED] == 0.0
        rows[at + MODE] = 1.0
        if rows[at + LAW] == OF_SIGN and rows[at + LEVEL] < 0.0:
            rows[at + MODE] = -1.0
        rows[at + ROLE] = OPEN if on and rows[at + LAW] != OF_RESET else KNOWN
        rows[at + BEFORE] = 0.0
        rows[at + SPEED_BEFORE] = rows[at + SPEED]
        inwards = rows[at + LEVEL] == 0.0 and rows[at + SPEED] > 0.0
        if rows[at + LAW] == OF_STOP and (rows[at + LEVEL] < 0.0 or inwards):
            return AMBIGUOUS
        if rows[at + LAW] == OF_RESET and rows[at + LEVEL] >= 0.0:
            return AMBIGUOUS
    strike(t, state, numbers, rows)
    return settle(t, state, numbers, rows)


def stages(t: float, h: float, state: Doubles, numbers: Doubles, k: Doubles, end: Doubles) -> None:
    """Compute the 16 stages of DOP853 from the first one, and the state at the end of the step."""
    middle = np.empty(DIMENSION)
    slope = np.empty(DIMENSION)
    for i in range(1, 16):
        for c in range(DIMENSION):
            total = 0.0
            for j in range(i):
                total += A[i * (i - 1) // 2 + j] * k[DIMENSION * j + c]
            middle[c] = state[c] + h * total
            if i == 12:
                end[c] = middle[c]
        slopes(t + C[i] * h, middle, numbers, slope)
        for c in range(DIMENSION):
            k[DIMENSION * i + c] = slope[c]


def error_of(h: float, state: Doubles, end: Doubles, k: Doubles, rtol: float, atol: float) -> float:
    """Return the error of a step in units of the tolerance (Hairer, Norsett & Wanner, section II.10)."""
    high = 0.0
    low = 0.0
    for c in range(DIMENSION):
        scale = atol + rtol * max(abs(state[c]), abs(end[c]))
        fifth = 0.0
        third = 0.0
        for j in range(12):
            fifth += E5[j] * k[DIMENSION * j + c]
            third += E3[j] * k[DIMENSION * j + c]
        high += (fifth / scale) * (fifth / scale)
        low += (third / scale) * (third / scale)
    if high == 0.0:
        return 0.0
    return h * high / math.sqrt((high + 0.01 * low) * DIMENSION)


def path_of(h: float, state: Doubles, end: Doubles, k: Doubles, path: Doubles) -> None:
    """Write the states in a step, a polynomial of degree 7: both ends, and six rows of coefficients."""
    for c in range(DIMENSION):
        path[c] = state[c]
        path[DIMENSION + c] = end[c]
        for i in range(6):
            total = 0.0
            for j in range(16):
                total += DENSE[16 * i + j] * k[DIMENSION * j + c]
            path[DIMENSION * (i + 2) + c] = h * total


def gap_inside(theta: float, t: float, h: float, path: Doubles, numbers: Doubles, rows: Doubles) -> float:
    """Compute the numbers of all rows at a fraction of the step; return the smallest gap over its scale."""
    middle = np.empty(DIMENSION)
    for c in range(DIMENSION):
        inner = 0.0
        for i in range(7, 1, -1):
            inner = path[DIMENSION * i + c] + theta * inner
        middle[c] = (1.0 - theta) * path[c] + theta * (path[DIMENSION + c] + (1.0 - theta) * inner)
    pushes(t + theta * h, middle, numbers, rows)
    least = 1e300
    for row in range(EVENT_ROWS):
        at = row * GROUPS
        rows[at + SCALE] = max(rows[at + SCALE], PART * rows[at + SIZE])
        least = min(least, rows[at + GAP] / rows[at + SCALE])
    return least


def bottom(row: int, theta: float, t: float, h: float, path: Doubles, numbers: Doubles, rows: Doubles) -> float:
    """Return where the gap of a row is least near a fraction of the step, by parabolas; leave its numbers in `rows`."""
    at = row * GROUPS + GAP
    gap_inside(theta, t, h, path, numbers, rows)
    least = rows[at]
    part = 0.25
    for _attempt in range(3):
        part = part / 8.0
        gap_inside(theta - part, t, h, path, numbers, rows)
        before = rows[at]
        gap_inside(theta + part, t, h, path, numbers, rows)
        bend = before - 2.0 * least + rows[at]
        slope = 0.5 * (rows[at] - before)
        turn = theta - part * max(-1.0, min(1.0, slope / bend)) if bend > 0.0 else theta
        turn = max(0.0, min(1.0, turn))
        gap_inside(turn, t, h, path, numbers, rows)
        if rows[at] < least:
            least = rows[at]
            theta = turn
    gap_inside(theta, t, h, path, numbers, rows)
    return theta


def narrowed(low: float, high: float, t: float, h: float, path: Doubles, numbers: Doubles, rows: Doubles) -> float:
    """Move the upper end of a bracket to where its gap is just below zero, by regula falsi and bisection."""
    level = -0.75 * PASSED
    above = max(0.0, gap_inside(low, t, h, path, numbers, rows)) - level
    below = gap_inside(high, t, h, path, numbers, rows) - level
    depth = below
    side = 0
    for attempt in range(60):
        if depth >= level or high - low <= 1e-15:
            break
        theta = high - below * (high - low) / (below - above)
        if attempt % 4 == 3 or not (low < theta and theta < high):
            theta = 0.5 * (low + high)
        gap = gap_inside(theta, t, h, path, numbers, rows) - level
        # an end that stays a second time counts half (Illinois)
        if gap < 0.25 * PASSED:
            above *= 0.5 if side < 0 else 1.0
            high = theta
            below = gap
            depth = gap
            side = -1
        else:
            below *= 0.5 if side > 0 else 1.0
            low = theta
            above = gap
            side = 1
    return high


def passage(t: float, h: float, path: Doubles, numbers: Doubles, rows: Doubles) -> float:
    """Return the fraction of the step behind which the first gap has just closed; 2 if none closes."""
    gaps = np.empty(3 * EVENT_ROWS)
    for row in range(EVENT_ROWS):
        rows[row * GROUPS + SCALE] = 1e-300
    high = 2.0
    for look in range(5):
        theta = 0.25 * look
        gap = gap_inside(theta, t, h, path, numbers, rows)
        for row in range(EVENT_ROWS):
            gaps[look % 3 * EVENT_ROWS + row] = rows[row * GROUPS + GAP]
        if look > 0 and gap < -PASSED:
            high = theta
        # a gap that dips below zero and comes back between two looks
        for row in range(EVENT_ROWS if look > 1 else 0):
            last = gaps[look % 3 * EVENT_ROWS + row]
            before = gaps[(look + 2) % 3 * EVENT_ROWS + row]
            earlier = gaps[(look + 1) % 3 * EVENT_ROWS + row]
            bend = earlier - 2.0 * before + last
            slope = 0.5 * (last - earlier)
            if abs(slope) < 0.999 * bend and before - 0.5 * slope * slope / bend < 0.2 * last:
                dip = bottom(row, theta - 0.25 - 0.25 * slope / bend, t, h, path, numbers, rows)
                if rows[row * GROUPS + GAP] < -PASSED * rows[row * GROUPS + SCALE]:
                    high = min(high, dip)
        if high < 1.5:
            low = max(0.0, high - 0.25)
            return narrowed(low, high, t, h, path, numbers, rows)
    return high


def run(start: float, stop: float, state: Doubles, numbers: Doubles, rtol: float, atol: float, seen: Seen) -> int:
    """Move a state from one time to another through all events; return FINISHED, or why not.

    `seen` is called at each event with time, row, mode before and after.  Held rows have the mode 0.
    """
    k = np.empty(16 * DIMENSION)
    first = np.empty(DIMENSION)
    end = np.empty(DIMENSION)
    path = np.empty(8 * DIMENSION)
    rows = np.empty(EVENT_ROWS * GROUPS)
    for row in range(EVENT_ROWS):
        rows[row * GROUPS + HARDEST] = 0.0
        rows[row * GROUPS + STRONGEST] = 0.0
    t = start
    h = 0.001 * (stop - start)
    aim = stop - start
    rush = 0
    renewed = 0
    while t < stop:
        if renewed == 0:
            slopes(t, state, numbers, first)
            for c in range(DIMENSION):
                k[c] = first[c]
            renewed = 1
        least = SHORTEST * max(min(1.0, stop - start), abs(t))
        taken = min(h, min(aim, stop - t))
        stages(t, taken, state, numbers, k, end)
        error = error_of(taken, state, end, k, rtol, atol)
        if not error <= 1.0:
            h = taken * (max(0.1, 0.9 * error**-0.125) if error < 1e30 else 0.1)
            if h < least:
                return NO_STEP
            aim = h
            continue
        path_of(taken, state, end, k, path)
        theta = passage(t, taken, path, numbers, rows)
        if theta < 1.5 and theta * taken < least and taken > 16.0 * least:
            # a gap that closes at once after it has opened may be an error of a long step
            h = 0.25 * taken
            continue
        if theta < 1.0 and max(theta * taken, least) < taken and taken > 2.0 * least:
            aim = max(theta * taken, least)
            continue
        for c in range(DIMENSION):
            state[c] = end[c]
        t = stop if taken >= stop - t else t + taken
        # a step that was cut at an event tells little about the next one
        longer = taken * (min(6.0, 0.9 * error**-0.125) if error > 0.0 else 6.0)
        h = longer if taken == h else max(h, longer)
        aim = stop - t
        rush = rush + 1 if taken <= 100.0 * least else 0
        renewed = 0
        outcome = change_modes(t, state, numbers, rows)
        for row in range(EVENT_ROWS):
            changed = rows[row * GROUPS + BEFORE] != rows[row * GROUPS + MODE]
            if seen and (changed or rows[row * GROUPS + SHUT] != 0.0):
                seen(t, row, rows[row * GROUPS + BEFORE], rows[row * GROUPS + MODE])
        if outcome != FINISHED:
            return outcome
        if rush >= 200:
            return CHATTERING
    return FINISHED
