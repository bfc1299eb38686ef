"""The zeros of functions of the state inside a step.

A step is one panel at first.  All functions are computed at the points of the rule of a panel, which is halved until each
of them passes zero in it at most once.
"""

from __future__ import annotations

from numba import njit

from ..driver.clock_slots import WIDTH
from ..simd.addresses import address
from ..simd.lanes import absolute, any_lane, broadcast, load, maximum, select, store
from .panels import POINT, simple

# --- kernel text below ---
# No panel of a step is shorter than 2^-DEEPEST.
DEEPEST = 12
# Rounding of a function, as a part of the size of its terms.
NOISE = 1.5e-14


@njit(error_model="numpy", forceinline=True)
def values_of(dims):
    """How many values the section functions, what their points keep, the stop, and the sizes of the terms are."""
    return dims.sections * (2 + max(0, dims.kept)) + 2 * dims.stops


@njit(error_model="numpy", forceinline=True)
def value_of(k, row, found, dims):
    """Function k in a row of values; the stop is the last one, behind what the points of sections keep."""
    place = k if k < dims.sections else dims.sections * (1 + max(0, dims.kept))
    return load(found, row * values_of(dims) + place, WIDTH)


@njit(error_model="numpy", forceinline=True)
def settled(k, row, found, dims):
    """Function k in a row of values, 0 where it is rounding of its terms."""
    value = value_of(k, row, found, dims)
    size = load(found, (row + 1) * values_of(dims) - dims.sections - dims.stops + k, WIDTH)
    return select(absolute(value) <= NOISE * size, 0.0 * size, value)


@njit(error_model="numpy", forceinline=True)
def memory(k, rule, dims):
    """Where function k has how deep its lanes go, and behind it its settled values at the points of a panel.

    Before that stand one row of values, of a place beside the points, and one for each point.
    """
    return (len(rule) + 1) * (values_of(dims) + k)


@njit(error_model="numpy", forceinline=True)
def at_point(k, point, found, rule, dims):
    """The settled value of function k at a point of the panel."""
    return load(found, memory(k, rule, dims) + 1 + point, WIDTH)


@njit(error_model="numpy")
def begin(k, wanted, found, rule, dims):
    """Let the lanes in `wanted` seek passages of function k in the next step."""
    store(found, memory(k, rule, dims), select(wanted, 0.0, broadcast(-1.0, WIDTH)))


@njit(error_model="numpy")
def look(place, width, t, h, y, y_new, dense, found, rule, dims, section):
    """Compute all functions at the points of a panel, and settle them."""
    for point in range(len(rule)):
        theta = broadcast((place + rule[point, POINT]) * width, WIDTH)
        section(theta, t, h, y, y_new, dense, address(found, (point + 1) * values_of(dims) * WIDTH), dims[:2])
        for k in range(dims.sections + dims.stops):
            store(found, memory(k, rule, dims) + 1 + point, settled(k, point + 1, found, dims))


@njit(error_model="numpy")
def ready(k, level, found, rule, control, dims):
    """The lanes that need not halve a panel of some level for function k, and whether others do.

    Each lane remembers how deep it goes: it looks at panels of that level and above.
    """
    place = memory(k, rule, dims)
    depth = load(found, place, WIDTH)
    wanted = depth >= 1.0 * level
    done = wanted
    if level < DEEPEST:
        done = wanted & simple(memory(k, rule, dims) + 1, 1, found, rule, control)
    halved = wanted & ~done
    store(found, place, select(halved, level + 1.0, select(done, 1.0 * level, depth)))
    return done, any_lane(halved)


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
def arrive(k, low, high, t, h, y, y_new, dense, found, dims, section):
    """Where section function k comes to zero, or goes beyond, between two fractions of the step, by bisection."""
    a, b = low, high
    section(low, t, h, y, y_new, dense, found, dims[:2])
    before = settled(k, 0, found, dims)
    for _ in range(60):
        if not any_lane(absolute(b - a) > 1e-15):
            break
        c = 0.5 * (a + b)
        section(c, t, h, y, y_new, dense, found, dims[:2])
        beyond = settled(k, 0, found, dims) * before <= 0.0
        a, b = select(beyond, a, c), select(beyond, c, b)
    return b


@njit(error_model="numpy")
def locate(k, hits, point, place, width, t, h, y, y_new, dense, found, rule, dims, section):
    """Zero of section function k between two points of a panel, to rounding, in the lanes of `hits`, and these lanes.

    Regula falsi with the Anderson-Bjorck weight (BIT 13, 253, 1973), bisection where that stalls.  A stretch of zeros has
    its beginning as the zero; a pole is none.
    """
    low = broadcast((place + rule[point, POINT]) * width, WIDTH)
    high = broadcast((place + rule[point + 1, POINT]) * width, WIDTH)
    g_low, g_high = value_of(k, point + 1, found, dims), value_of(k, point + 2, found, dims)
    stays = hits & ~(g_low * g_high < 0.0)
    a, b, fa, fb = select(hits & ~stays, low, high), high, g_low, g_high
    for tried in range(60):
        active = absolute(b - a) > 1e-15  # the others are done and must not move, whatever their neighbours need
        if not any_lane(active):
            break
        secant = b - fb * (b - a) / (fb - fa)
        good = (secant - a) * (b - secant) > 0.0
        c = select(good, secant, 0.5 * (a + b)) if tried % 4 != 3 else 0.5 * (a + b)
        c = select(active, c, b)
        section(c, t, h, y, y_new, dense, found, dims[:2])
        fc = value_of(k, 0, found, dims)
        done = (fc == 0.0) | (absolute(c - b) <= 1e-15)
        other = fc * fb < 0.0  # the zero lies between c and b
        weight = 1.0 - fc / fb
        near, f_near = select(other, b, a), select(other, fb, fa * select(weight > 0.0, weight, 0.5))
        a, fa = select(active, select(done, c, near), b), select(active, f_near, fa)
        b, fb = c, fc
    zeros = hits & ~stays & (fb == 0.0)
    if any_lane(zeros):
        section(maximum(b - 1e-12, low), t, h, y, y_new, dense, found, dims[:2])
        stays = stays | (zeros & (value_of(k, 0, found, dims) == 0.0))
    if any_lane(stays):
        b = select(stays, arrive(k, low, b, t, h, y, y_new, dense, found, dims, section), b)
    return b, hits & (stays | (absolute(fb) <= 2.0 * maximum(absolute(g_low), absolute(g_high))))
