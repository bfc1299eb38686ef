"""Which rows (models/mechanics/rows.py) are held after an event.

A node below is any group of rows that are solved together: those of one node, or of the nodes that links join.
An event of a node has two parts.  Guards reset states and stops rebound: speeds jump.  Then all rows on their surfaces
are decided together (decisions.py).  Held rows are put on their surfaces, here and after each step.  A cell whose rows
have no single answer ends as AMBIGUOUS.

A stop closes when its rebounds have become LOWEST times as high as the first ones, in any unit.  After a rebound with the
speed u against the acceleration a the remaining ones take the time 2 u/(a (1 - e)) and pass on the same momentum as one
plastic impact (Budd & Dux, Phil. Trans. R. Soc. A 347, 365 (1994)).  The first ones are as high as u**2/(2 a) for the
largest u and the largest a at impacts since the stop was last closed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..simd.lanes import any_lane, broadcast, lane_bits, store
from .cells import put
from .clock_slots import *
from .decisions import decide, eliminated, forces
from .gaps import GAP, LAW, LEVEL, MODE, NUMBER, RATE, RATIO, SPEED, K, clear_scales, place, push, smallest_gap

# --- kernel text below ---
OF_SIGN, OF_STOP, OF_RESET, OF_STOP_IN_ORDER, OF_REDUNDANT_SIGN = 0.0, 1.0, 2.0, 3.0, 4.0
# What an event means for a row: nothing, its mode is known, it is decided, it lets go to the side of its force.
UNTOUCHED, KNOWN, OPEN, RELEASED = 0.0, 1.0, 2.0, 3.0
# Columns of the notes on rows: what the event means, mode and speed before, x before, 1 if the gap has closed, the sum
# of the changes of speed by impulses without their signs.
ROLE, BEFORE, SPEED_BEFORE, X, SHUT, FELT = 0, 1, 2, 3, 4, 5
NOTES = 6
# Numbers for each row of a node that is decided (decisions.py): groups of `pushes`, and notes in place of those it skips.
GROUPS = 64
# A pivot, or a change of a speed, this much smaller than what it is the difference of is zero.
NONE = 1e-12
# Height of the last rebound of a stop over that of the first ones (a choice).
LOWEST = 1e-12
# Most passes over stops that rebound in order (a choice).
PASSES = 10000


@njit(error_model="numpy", forceinline=True)
def number(group, row, lane, out, dims):
    """Return a number of a row in one lane."""
    return out[place(group, row, dims) * WIDTH + lane]


@njit(error_model="numpy", forceinline=True)
def is_sign(row, lane, out, dims):
    """Return True if a row is a contact or surface."""
    law = number(LAW, row, lane, out, dims)
    return law < OF_STOP or law > OF_STOP_IN_ORDER


@njit(error_model="numpy", forceinline=True)
def is_stop(row, lane, out, dims):
    """Return True if a row is a stop."""
    return not is_sign(row, lane, out, dims) and number(LAW, row, lane, out, dims) != OF_RESET


@njit(error_model="numpy", forceinline=True)
def clear_impulses(friction):
    """Set impulses, corrections of gaps and resets to zero."""
    for group in range(K + friction.dims.felt, K + friction.dims.felt + 3):
        for row in range(friction.dims.rows):
            store(friction.out, place(group, row, friction.dims), broadcast(0.0, WIDTH))


@njit(error_model="numpy", forceinline=True)
def strike(t, y, friction):
    """Apply impulses, corrections and resets, and store the modes."""
    if LOOPED:
        graph, weights = friction.network
        friction.functions.strike(t, y, y, friction.out, graph, weights)
    else:
        friction.functions.strike(t, y, y, friction.out)
    clear_impulses(friction)


@njit(error_model="numpy")
def gathered(notes, lane, first, size, friction):
    """Return the numbers of the rows of a node in one lane, for `decide` and `forces`."""
    rows, out, dims = np.zeros(size * GROUPS), friction.out, friction.dims
    for a in range(size):
        for note in (ROLE, BEFORE, X):
            rows[a * GROUPS + note] = notes[first + a, note]
        for group in (MODE, RATE, RATIO):
            rows[a * GROUPS + group] = number(group, first + a, lane, out, dims)
        sign, stop = is_sign(first + a, lane, out, dims), is_stop(first + a, lane, out, dims)
        rows[a * GROUPS + LAW] = OF_SIGN if sign else OF_STOP if stop else OF_RESET
        for b in range(size):
            rows[a * GROUPS + K + b] = number(K + b, first + a, lane, out, dims)
    return rows


@njit(error_model="numpy")
def any_redundant(first, lane, size, out, dims):
    """Return True if a contact of a node cannot slide while others stick."""
    found = False
    for a in range(size):
        found = found or number(LAW, first + a, lane, out, dims) == OF_REDUNDANT_SIGN
    return found


@njit(error_model="numpy")
def are_independent(on, size, rows):
    """Return True if K of the rows that are `on` their surfaces is regular."""
    matrix, right, modes = np.empty(size * size), np.zeros(size), np.empty(size)
    for a in range(size):
        modes[a] = 0.0 if on[a] else 1.0
        for b in range(size):
            matrix[a * size + b] = rows[a * GROUPS + K + b]
    return eliminated(matrix, right, modes, size) != 0.0


@njit(error_model="numpy")
def add_redundant(on, notes, lane, first, size, friction):
    """Add to the rows on their surfaces the contacts that cannot slide, as others hold their bodies."""
    out, dims = friction.out, friction.dims
    if not any_redundant(first, lane, size, out, dims):
        return
    basis, rows = np.zeros(size, np.bool_), gathered(notes, lane, first, size, friction)
    for a in range(size):
        basis[a] = on[a]
        if on[a]:
            basis[a] = are_independent(basis, size, rows)
    for a in range(size):
        if not on[a] and number(LAW, first + a, lane, out, dims) == OF_REDUNDANT_SIGN:
            basis[a] = True
            on[a] = not are_independent(basis, size, rows)
            basis[a] = False


@njit(error_model="numpy")
def share_forces(rows, notes, lane, first, size, friction):
    """Set the modes of contacts that cannot slide to the shares of their loads that they carry.

    The bodies are held by other rows, whose forces depend linearly on such a share.  The share is in the middle of
    those with which they can hold, so that no rounding error of a speed ends the hold.
    """
    out, dims = friction.out, friction.dims
    on, modes, low, high = np.zeros(size, np.bool_), np.empty(size), np.empty(size), np.empty(size)
    for a in range(size):
        modes[a] = rows[a * GROUPS + MODE]
        on[a] = modes[a] == 0.0
    add_redundant(on, notes, lane, first, size, friction)
    for a in range(size):
        if not (on[a] and rows[a * GROUPS + ROLE] == OPEN and modes[a] != 0.0):
            continue
        modes[a] = -1.0
        forces(modes, low, 0, size, rows)
        modes[a] = 1.0
        forces(modes, high, 0, size, rows)
        least, most = -1.0, 1.0
        for b in range(size):
            # b holds while x, which rises by `slope` with the share, is between -ratio, or 0 at a stop, and ratio
            slope, middle = 0.5 * (high[b] - low[b]), 0.5 * (high[b] + low[b])
            if modes[b] == 0.0 and slope != 0.0:
                stop, ratio = is_stop(first + b, lane, out, dims), rows[b * GROUPS + RATIO]
                one = ((0.0 if stop else -ratio) - middle) / slope
                other = (math.inf if stop else ratio - middle) / slope
                least, most = max(least, min(one, other)), min(most, max(one, other))
        share = 0.5 * (least + most)
        # 0 is the mode of rows that are held
        modes[a] = share if abs(share) > 0.1 * (most - least) else share + 0.2 * (most - least)
        rows[a * GROUPS + MODE] = modes[a]


@njit(error_model="numpy")
def begin_event(notes, lane, first, size, friction):
    """Note what an event means for the rows of a node, and set the impulses of stops; 2 if ambiguous, 1 if speeds jump."""
    out, dims = friction.out, friction.dims
    modes, x = np.empty(size), np.empty(size)
    speeds, hit, outcome = np.empty(size), np.zeros(size, np.bool_), 0
    resting, on = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    for a in range(size):
        modes[a] = number(MODE, first + a, lane, out, dims)
        resting[a] = modes[a] == 0.0
    forces(modes, x, 0, size, gathered(notes, lane, first, size, friction))
    add_redundant(resting, notes, lane, first, size, friction)
    for a in range(size):
        row = first + a
        law, shut = number(LAW, row, lane, out, dims), number(GAP, row, lane, out, dims) <= 0.0
        speeds[a] = number(SPEED, row, lane, out, dims)
        notes[row, BEFORE], notes[row, SPEED_BEFORE], notes[row, X] = 0.0 if resting[a] else modes[a], speeds[a], x[a]
        notes[row, SHUT] = 1.0 if shut and (modes[a] == 0.0 or not resting[a]) else 0.0
        if modes[a] == 0.0:
            notes[row, ROLE] = RELEASED if shut else OPEN
        else:
            notes[row, ROLE] = OPEN if shut and is_sign(row, lane, out, dims) else KNOWN
        on[a] = modes[a] == 0.0 or notes[row, ROLE] == OPEN
        if shut and law == OF_RESET:
            put(out, place(K + dims.felt + 2, row, dims), lane, 1.0)
            outcome = 1
        hit[a] = shut and is_stop(row, lane, out, dims) and modes[a] != 0.0
        outcome = 1 if hit[a] else outcome
    add_redundant(on, notes, lane, first, size, friction)
    for a in range(size):
        if on[a] and modes[a] != 0.0:
            notes[first + a, ROLE] = OPEN
    if outcome == 1 and not rebound(notes, hit, speeds, x, lane, first, size, friction):
        outcome = 2
    return outcome


@njit(error_model="numpy")
def rebound(notes, hit, speeds, x, lane, first, size, friction):
    """Set the impulses of the stops that are hit, and put their gaps to zero; return False if Newton's law fixes none.

    An impulse changes the speeds at other stops.  Those that are hit or closed then rebound too, if all are in order.
    """
    out, dims = friction.out, friction.dims
    left, coupled = np.zeros(size, np.bool_), False
    for a in range(size):
        if hit[a]:
            row = first + a
            left[a] = speeds[a] >= 0.0
            stiff = number(K + a, row, lane, out, dims)
            put(out, place(K + dims.felt + 1, row, dims), lane, -number(LEVEL, row, lane, out, dims) / stiff)
    turn, again = 0, True
    while again:
        if turn == PASSES:
            return False
        again = False
        for a in range(size):
            if not left[a]:
                continue
            row, left[a] = first + a, False
            # a restitution that depends on states is a number only now
            if not -NONE <= number(RATIO, row, lane, out, dims) <= 1.0 + NONE:
                return False
            impulse = impulse_of(notes, speeds, x, turn, a, lane, first, size, friction)
            put(out, place(K + dims.felt, row, dims), lane, number(K + dims.felt, row, lane, out, dims) + impulse)
            for b in range(size):
                change = number(K + a, first + b, lane, out, dims) * impulse
                notes[first + b, FELT] += abs(change)
                if b == a or change == 0.0:
                    continue
                speeds[b] -= change
                touches = is_stop(first + b, lane, out, dims) and (
                    hit[b] or number(MODE, first + b, lane, out, dims) == 0.0
                )
                if touches and not (in_order(row, lane, out, dims) and in_order(first + b, lane, out, dims)):
                    return False
                coupled = coupled or touches
                left[b] = touches and speeds[b] > NONE * notes[first + b, FELT]
                again = again or left[b]
        turn += 1
    for a in range(size):
        if coupled and hit[a]:
            moves_away = speeds[a] < -NONE * notes[first + a, FELT]
            notes[first + a, ROLE] = KNOWN if moves_away else OPEN
    return True


@njit(error_model="numpy", forceinline=True)
def in_order(row, lane, out, dims):
    """Return True if a row is a stop that rebounds in order."""
    return number(LAW, row, lane, out, dims) == OF_STOP_IN_ORDER


@njit(error_model="numpy")
def impulse_of(notes, speeds, x, turn, a, lane, first, size, friction):
    """Return the impulse of a stop by Newton's law, and change the speed of its gap; `turn` counts from its first impulse."""
    out, dims, impacts, row = friction.out, friction.dims, friction.impacts, first + a
    stiff, inward = number(K + a, row, lane, out, dims), number(RATE, row, lane, out, dims)
    for b in range(size):
        inward -= number(K + b, row, lane, out, dims) * x[b]
    # The speed at the gap 0, a depth before: energy is kept although the gap is put to zero.
    depth = number(LEVEL, row, lane, out, dims) if turn == 0 else 0.0
    speed = math.sqrt(max(speeds[a] * speeds[a] + 2.0 * inward * depth, 0.0))
    e = number(RATIO, row, lane, out, dims)
    after = e * speed
    hardest = max(impacts[row * WIDTH + lane], speed)
    strongest = max(impacts[(dims.rows + row) * WIDTH + lane], abs(inward))
    # heights after**2/(2 inward) and hardest**2/(2 strongest); impulses in turn have no height
    low = inward > 0.0 and after * after * strongest <= LOWEST * hardest * hardest * inward
    if e < 1.0 and (low or (turn > 0 and after * after <= LOWEST * hardest * hardest)):
        after = 0.0
    if after == 0.0:
        notes[row, ROLE], hardest, strongest = OPEN, 0.0, 0.0
    put(impacts, row, lane, hardest)
    put(impacts, dims.rows + row, lane, strongest)
    impulse = (speeds[a] + after) / stiff
    speeds[a] = -after
    return impulse


@njit(error_model="numpy")
def after_jump(notes, lane, first, size, friction):
    """Find the modes of rows whose speeds have jumped: they leave their surfaces."""
    out, dims = friction.out, friction.dims
    for a in range(size):
        row = first + a
        sign, mode = is_sign(row, lane, out, dims), number(MODE, row, lane, out, dims)
        speed, before = number(SPEED, row, lane, out, dims), notes[row, SPEED_BEFORE]
        jump, small = speed - before, NONE * max(notes[row, FELT], max(abs(speed), abs(before)))
        if sign and notes[row, ROLE] == KNOWN:
            put(out, place(MODE, row, dims), lane, -mode if mode * speed < 0.0 else mode)
        elif sign:
            if abs(jump) > small:
                notes[row, ROLE] = KNOWN
                put(out, place(MODE, row, dims), lane, 1.0 if speed > 0.0 else -1.0)
        elif is_stop(row, lane, out, dims) and mode == 0.0 and jump < -small:
            notes[row, ROLE] = KNOWN
            put(out, place(MODE, row, dims), lane, 1.0)


@njit(error_model="numpy")
def project_held(lane, first, size, friction):
    """Set the impulses that put the held rows of a node onto their surfaces; return True if there are any."""
    out, dims, felt = friction.out, friction.dims, friction.dims.felt
    matrix, right, modes = np.empty(size * size), np.empty(size), np.empty(size)
    for a in range(size):
        modes[a] = number(MODE, first + a, lane, out, dims)
    for _ in range(size):
        for a in range(size):
            right[a] = number(SPEED, first + a, lane, out, dims)
            for b in range(size):
                matrix[a * size + b] = number(K + b, first + a, lane, out, dims)
        if eliminated(matrix, right, modes, size) != 0.0:
            break
        for a in range(size - 1, -1, -1):  # rows that depend on each other: leave the last one out
            if modes[a] == 0.0:
                modes[a] = 1.0
                break
    found = False
    for a in range(size):
        if modes[a] == 0.0:
            row, found = first + a, True
            put(out, place(K + felt, row, dims), lane, right[a])
            if is_stop(row, lane, out, dims):
                stiff = number(K + a, row, lane, out, dims)
                put(out, place(K + felt + 1, row, dims), lane, -number(LEVEL, row, lane, out, dims) / stiff)
    return found


@njit(error_model="numpy", forceinline=True)
def size_of(first, lane, out, dims):
    """Return the number of rows of a node from its first row."""
    size = 1
    while first + size < dims.rows and number(NUMBER, first + size, lane, out, dims) != 0.0:
        size += 1
    return size


@njit(error_model="numpy")
def begin_events(lanes, notes, friction):
    """Begin the events of nodes with closed gaps and keep the held rows of all others; return True if a speed changes."""
    out, dims, struck = friction.out, friction.dims, False
    for lane in range(WIDTH):
        first = 0
        while (lanes >> lane) & 1 and first < dims.rows:
            size, closed = size_of(first, lane, out, dims), False
            for row in range(first, first + size):
                notes[lane, row, BEFORE] = number(MODE, row, lane, out, dims)
                closed = closed or number(GAP, row, lane, out, dims) <= 0.0
            if closed:
                outcome = begin_event(notes[lane], lane, first, size, friction)
                struck = struck or outcome > 0
                if outcome == 2:
                    put(friction.clock, RUSH, lane, math.inf)
            else:
                struck = project_held(lane, first, size, friction) or struck
            first += size
    return struck


@njit(error_model="numpy")
def end_events(lanes, notes, friction):
    """Decide the modes of all nodes with events, from the speeds after the impacts."""
    out, dims = friction.out, friction.dims
    for lane in range(WIDTH):
        first = 0
        while (lanes >> lane) & 1 and first < dims.rows:
            size, closed = size_of(first, lane, out, dims), False
            for row in range(first, first + size):
                closed = closed or notes[lane, row, ROLE] != UNTOUCHED
            if closed:
                after_jump(notes[lane], lane, first, size, friction)
                rows = gathered(notes[lane], lane, first, size, friction)
                sets, several = decide(0, size, rows), any_redundant(first, lane, size, out, dims)
                if sets == 0 or (sets > 1 and not several):
                    put(friction.clock, RUSH, lane, math.inf)
                if several:
                    share_forces(rows, notes[lane], lane, first, size, friction)
                for a in range(size):
                    put(out, place(MODE, first + a, dims), lane, rows[a * GROUPS + MODE])
                project_held(lane, first, size, friction)
            first += size


@njit(error_model="numpy")
def record_modes(lanes, notes, friction):
    """Write what the record of events reads to the groups of the looks: 1 for an event, mode before, mode after."""
    out, dims = friction.out, friction.dims
    for lane in range(WIDTH):
        first = 0
        while (lanes >> lane) & 1 and first < dims.rows:
            size = size_of(first, lane, out, dims)
            resting = np.zeros(size, np.bool_)
            for a in range(size):
                resting[a] = number(MODE, first + a, lane, out, dims) == 0.0
            add_redundant(resting, notes[lane], lane, first, size, friction)
            for a in range(size):
                row = first + a
                before, after = notes[lane, row, BEFORE], 0.0 if resting[a] else number(MODE, row, lane, out, dims)
                put(out, place(6, row, dims), lane, 1.0 if notes[lane, row, SHUT] != 0.0 or before != after else 0.0)
                put(out, place(7, row, dims), lane, before)
                put(out, place(8, row, dims), lane, after)
            first += size


@njit(error_model="numpy")
def change_modes(moved, t, y, friction):
    """Let the rows of every node with a closed gap rebound, reset, be held, slip or open; return the lanes with events.

    Held rows are kept on their surfaces.
    """
    if not any_lane(moved):
        return 0
    clear_scales(friction)
    events = lane_bits(moved & (smallest_gap(t, y, y, friction) <= 0.0))
    clear_impulses(friction)
    notes = np.zeros((WIDTH, friction.dims.rows, NOTES))
    # 1. Speeds jump: stops rebound, guards reset states, held rows return to their surfaces.
    struck = begin_events(lane_bits(moved), notes, friction)
    if struck:
        strike(t, y, friction)
    if events == 0:
        return 0
    # 2. Modes change, by the speeds and forces after the jumps.
    if struck:
        push(t, y, y, friction)
    end_events(events, notes, friction)
    strike(t, y, friction)
    record_modes(events, notes, friction)
    return events
