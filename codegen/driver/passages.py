"""Events inside a step: detection and location in time, for contacts (`contacts`) and rows (`rows`) alike.

The gap of a contact or row (`gap_of`) is positive while it keeps its mode.  Gaps are compared with a scale, the largest
size of their terms at the looks into a step (`scale_of`): `smallest_gap` is the smallest ratio.  A step that would make a gap negative is
taken back and tried again with the length after which the gap has just passed zero, until the passage lies at its end
to within rounding.

A step ends at a jump or kink in time as well: a load that jumps there opens or closes gaps at once, and no
error shows it to a step in stick.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ..simd.lanes import absolute, any_lane, broadcast, load, maximum, minimum, select, store
from .clock_slots import ACCEPTED, N_POINTS, REJECTED, RUSH, STEP, STOP, UNTIL, WIDTH
from .gaps import clear_scales, gap_inside, gap_of, grown_scale, push, scale_of

# --- kernel text below ---
# A gap that is less than this part of its scale below zero counts as zero; a passage is never sought closer than the shortest step to it.
PASSED, SHORTEST = 1e-13, 1e-13
# Steps in which an event is looked for, equally spaced; a dip is followed to its bottom where a parabola through three
# looks comes down to this part of the third.
LOOKS, SHALLOW = 4, 0.2


@njit(error_model="numpy", forceinline=True)
def on_side(side, gap, out, dims):
    """Return the gap while all jumps and kinks in time are on their side, -1 behind the first of them."""
    return select(load(out, 9 * dims.rows, WIDTH) == side, gap, -1.0)


@njit(error_model="numpy", forceinline=True)
def keep_gaps(look, p, out, dims):
    """Store the gaps of all contacts at a look, and let their scales grow; return the smallest gap.

    The gaps of three looks are stored.
    """
    least = broadcast(1e300, WIDTH)
    for i in range(dims.rows):
        gap = gap_of(i, p, out, dims)
        store(out, (6 + look % 3) * dims.rows + i, gap)
        least = minimum(least, gap / grown_scale(i, out, dims))
    return least


@njit(error_model="numpy")
def bottom(i, theta, span, step, friction):
    """Return where the gap of a contact is least near a fraction of the step, by parabolas, and that gap.

    A gap that dips below zero and comes back between two looks would otherwise pass unseen.
    """
    gap_inside(theta, step, friction)
    dip, least = theta, gap_of(i, step.y, friction.out, friction.dims)
    for divisor in (8.0, 64.0):
        part = span / divisor
        gap_inside(dip - part, step, friction)
        before = gap_of(i, step.y, friction.out, friction.dims)
        gap_inside(dip + part, step, friction)
        after = gap_of(i, step.y, friction.out, friction.dims)
        bend, slope = before - 2.0 * least + after, 0.5 * (after - before)
        turn = minimum(maximum(select(bend > 0.0, -slope / bend, 0.0 * bend), -1.0), 1.0)
        shifted = minimum(maximum(dip + part * turn, maximum(theta - span, 0.0)), minimum(theta + span, 1.0))
        gap_inside(shifted, step, friction)
        gap = gap_of(i, step.y, friction.out, friction.dims)
        better = gap < least
        dip, least = select(better, shifted, dip), select(better, gap, least)
    return dip, least


@njit(error_model="numpy")
def first_dip(k, open_lanes, step, friction):
    """Return the first fraction (2: none) between looks k-2 and k where a gap dips below zero, and that gap."""
    span = 1.0 / LOOKS
    first, depth = broadcast(2.0, WIDTH), broadcast(0.0, WIDTH)
    out, dims = friction.out, friction.dims
    for i in range(dims.rows):
        earlier = load(out, (6 + (k - 2) % 3) * dims.rows + i, WIDTH)
        before = load(out, (6 + (k - 1) % 3) * dims.rows + i, WIDTH)
        gap = load(out, (6 + k % 3) * dims.rows + i, WIDTH)
        bend, slope = earlier - 2.0 * before + gap, 0.5 * (gap - earlier)
        dips = open_lanes & (absolute(slope) < 0.999 * bend) & (before - 0.5 * slope * slope / bend < SHALLOW * gap)
        if any_lane(dips):
            turn = minimum(maximum(span * (k - 1.0 - slope / bend), 0.0), 1.0)
            dip, least = bottom(i, turn, span, step, friction)
            least = least / scale_of(i, out, dims)
            sunk = dips & (least < -PASSED) & (dip < first)
            first, depth = select(sunk, dip, first), select(sunk, least, depth)
    return first, depth


@njit(error_model="numpy")
def first_passage(accept, step, friction):
    """Return the fraction of the step after which the first gap has just become negative; 2 in lanes where none does."""
    zero, span = broadcast(0.0, WIDTH), 1.0 / LOOKS
    low, high, f_low, f_high = zero, broadcast(2.0, WIDTH), zero, broadcast(-1.0, WIDTH)
    clear_scales(friction)
    push(step.t, step.y, step.y, friction)
    out, dims = friction.out, friction.dims
    side = load(out, 9 * dims.rows + 1, WIDTH)
    earlier, before, open_lanes = zero, keep_gaps(0, step.y, out, dims), accept
    for k in range(1, LOOKS + 1):
        theta = broadcast(k * span, WIDTH)
        if k == LOOKS:
            push(step.t + step.h, step.y_new, step.y, friction)
        else:
            gap_inside(theta, step, friction)
        gap = on_side(side, keep_gaps(k, step.y, out, dims), out, dims)
        hit = open_lanes & (gap < -PASSED)
        f_low, low = select(hit, maximum(before, 0.0), f_low), select(hit, theta - span, low)
        f_high, high = select(hit, gap, f_high), select(hit, theta, high)
        if k > 1:
            dip, least = first_dip(k, open_lanes & ~hit, step, friction)
            sunk, late = dip < 1.5, dip > theta - span
            f_low, low = (
                select(sunk, maximum(select(late, before, earlier), 0.0), f_low),
                select(sunk, select(late, theta - span, theta - 2.0 * span), low),
            )
            f_high, high = select(sunk, least, f_high), select(sunk, dip, high)
            hit = hit | sunk
        earlier, before, open_lanes = before, gap, open_lanes & ~hit
    return narrowed(side, low, high, f_low, f_high, step, friction)


@njit(error_model="numpy")
def narrowed(side, low, high, f_low, f_high, step, friction):
    """Return the end of the bracket `high` (2: no bracket), moved back until its gap is just below zero.

    Regula falsi with the weight of Anderson & Bjorck, BIT 13, 253 (1973), for the passage of a level just below zero.
    """
    bracketed = high < 1.5
    if any_lane(bracketed):
        level, last, depth = -0.75 * PASSED, 0.0 * high, f_high
        for k in range(60):
            active = bracketed & (depth < -PASSED) & (high - low > 1e-15)  # what it is there, whatever it weighs
            if not any_lane(active):
                break
            secant = high - (f_high - level) * (high - low) / (f_high - f_low)
            fit = (secant > low) & (secant < high)
            theta = 0.5 * (low + high) if k % 4 == 3 else select(fit, secant, 0.5 * (low + high))
            theta = select(active, theta, 0.0 * high)
            gap = on_side(side, gap_inside(theta, step, friction), friction.out, friction.dims)
            below = active & (gap < level + 0.25 * PASSED)
            above = active & ~(gap < level + 0.25 * PASSED)
            # an end that stays a second time is weighed less, the less the other one has gained
            left = 1.0 - (gap - level) / (select(below, f_high, f_low) - level)
            weight = select(left > 0.0, left, 0.5)
            less_low = select(below & (last < 0.0), level + weight * (f_low - level), f_low)
            less_high = select(above & (last > 0.0), level + weight * (f_high - level), f_high)
            high, f_high, depth = select(below, theta, high), select(below, gap, less_high), select(below, gap, depth)
            low, f_low = select(above, theta, low), select(above, gap, less_low)
            last = select(below, -1.0, select(above, 1.0, last))
    return high


@njit(error_model="numpy")
def note_events(lanes, time, cell, counts, points, friction):
    """Append the events of some lanes to the points of their cells: time, row, mode before and after."""
    out, rows, when = friction.out, friction.dims.rows, np.empty(WIDTH)
    store(when, 0, time)
    for lane in range(WIDTH):
        for row in range(rows if (lanes >> lane) & 1 else 0):
            if out[(6 * rows + row) * WIDTH + lane] == 0.0:
                continue
            # events beyond the room are counted and not stored
            index = counts[cell[lane], N_POINTS]
            counts[cell[lane], N_POINTS] = index + 1
            if index < points.shape[1]:
                points[cell[lane], index, 0], points[cell[lane], index, 1] = when[lane], row
                for k in range(2):
                    points[cell[lane], index, 2 + k] = out[((7 + k) * rows + row) * WIDTH + lane]


@njit(error_model="numpy", forceinline=True)
def shortest(t, clock):
    """Return the shortest step to an event."""
    return SHORTEST * maximum(t, minimum(load(clock, UNTIL, WIDTH), 1.0))


@njit(error_model="numpy", forceinline=True)
def note_rush(accept, t, h, clock):
    """Count the steps in a row that take no time."""
    short, rush = h <= 100.0 * shortest(t, clock), load(clock, RUSH, WIDTH)
    store(clock, RUSH, select(accept, select(short, rush + 1.0, 0.0), rush))


@njit(error_model="numpy", forceinline=True)
def take_back(accept, step, clock, friction):
    """Reject the steps that pass an event before their end, and aim at it; return the other accepted lanes."""
    t, h = step.t, step.h
    theta = first_passage(accept, step, friction)
    least = shortest(t, clock)
    wanted = maximum(theta * h, least)
    # behind a jump a gap is closed to the end of the step, however near it is
    early = accept & (theta < 1.5) & (t + wanted < t + h) & (h > 2.0 * least)
    # a gap that closes at once after it has opened may be an error of a long step: a shorter one will tell
    doubtful = early & (theta * h < least) & (h > 16.0 * least)
    store(clock, STEP, select(doubtful, 0.25 * h, load(clock, STEP, WIDTH)))
    store(clock, STOP, select(early & ~doubtful, t + wanted, load(clock, STOP, WIDTH)))
    store(clock, ACCEPTED, load(clock, ACCEPTED, WIDTH) - select(early, 1.0, 0.0 * h))
    store(clock, REJECTED, load(clock, REJECTED, WIDTH) + select(early, 1.0, 0.0 * h))
    note_rush(accept & ~early, t, h, clock)
    return accept & ~early
