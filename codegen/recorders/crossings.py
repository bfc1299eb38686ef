"""The zeros of functions of the state inside a step."""

from __future__ import annotations

from numba import njit

from ..driver.names import WIDTH
from ..simd.lanes import absolute, any_lane, broadcast, load, select


# --- kernel text below ---
@njit(error_model="numpy", forceinline=True)
def surface(k, theta, t, h, y, y_new, dense, found, dims, section):
    """Section function k at the fraction theta of the step."""
    section(theta, t, h, y, y_new, dense, found, dims[:2])
    return load(found, k, WIDTH)


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
def locate(k, hits, low, high, g_low, g_high, t, h, y, y_new, dense, found, dims, section):
    """Zero of section function k between two fractions of the step, to rounding, in the lanes of `hits`.

    Regula falsi with the Anderson-Bjorck weight (BIT 13, 253, 1973), bisection where that stalls.
    """
    a, b, fa, fb = select(hits, low, high), high, g_low, g_high
    for tried in range(60):
        active = absolute(b - a) > 1e-15  # the others are done and must not move, whatever their neighbours need
        if not any_lane(active):
            break
        secant = b - fb * (b - a) / (fb - fa)
        good = (secant - a) * (b - secant) > 0.0
        c = select(good, secant, 0.5 * (a + b)) if tried % 4 != 3 else 0.5 * (a + b)
        c = select(active, c, b)
        fc = surface(k, c, t, h, y, y_new, dense, found, dims, section)
        done = (fc == 0.0) | (absolute(c - b) <= 1e-15)
        other = fc * fb < 0.0  # the zero lies between c and b
        weight = 1.0 - fc / fb
        near, f_near = select(other, b, a), select(other, fb, fa * select(weight > 0.0, weight, 0.5))
        a, fa = select(active, select(done, c, near), b), select(active, f_near, fa)
        b, fb = c, fc
    return b


@njit(error_model="numpy", forceinline=True)
def turning(i, looks, share, before, first, last, behind):
    """Where a parabola through three of four equidistant values turns between the inner two, as the fraction of the step.

    `first` is the value at look i; the outer ones are NaN where the step ends.  Zero where nothing turns.
    """
    left, right = (
        0.5 * (before - last) / (before - 2.0 * first + last),
        0.5 * (first - behind) / (first - 2.0 * last + behind),
    )
    low, high = 0.5 if i > 0 else 0.0, 0.5 if i + 2 <= looks else 1.0  # each turn is seen from the nearer look
    place = select((left > 0.0) & (left < high), left, 0.0)
    place = select((right + 1.0 > low) & (right < 0.0), right + 1.0, place)
    return select(place > 0.0, (i + place) * share, 0.0)


@njit(error_model="numpy")
def between(k, i, share, wanted, before, first, last, behind, t, h, y, y_new, dense, found, dims, section):
    """Where section function k turns between looks i and i + 1, and its value there; look i + 1 where it does not turn."""
    turn, place = turning(i, dims.looks, share, before, first, last, behind), broadcast((i + 1) * share, WIDTH)
    turns = (first * last > 0.0) & (turn > 0.0) & wanted
    if any_lane(turns):
        place = select(turns, turn, place)
        return place, select(turns, surface(k, place, t, h, y, y_new, dense, found, dims, section), last)
    return place, last
