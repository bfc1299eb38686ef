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
    """Count the values at a point: section functions, stored values of each, the stop, and the sizes of their terms."""
    return dims.sections * (2 + max(0, dims.kept)) + 2 * dims.stops


@njit(error_model="numpy", forceinline=True)
def evaluate(theta, row, zeros):
    """Compute all functions at a fraction of the step and write them to a row of values."""
    step, out = zeros.step, address(zeros.found, row * values_of(zeros.dims) * WIDTH)
    zeros.section(theta, step.t, step.h, step.y, step.y_new, step.dense, out, zeros.dims[:2])


@njit(error_model="numpy", forceinline=True)
def value_of(k, row, zeros):
    """Return function k in a row of values; the stop is the last one, behind the stored values of sections."""
    dims = zeros.dims
    column = k if k < dims.sections else dims.sections * (1 + max(0, dims.kept))
    return load(zeros.found, row * values_of(dims) + column, WIDTH)


@njit(error_model="numpy", forceinline=True)
def settled(k, row, zeros):
    """Return function k in a row of values, 0 where it is rounding of its terms."""
    dims, value = zeros.dims, value_of(k, row, zeros)
    size = load(zeros.found, (row + 1) * values_of(dims) - dims.sections - dims.stops + k, WIDTH)
    return select(absolute(value) <= NOISE * size, 0.0 * size, value)


@njit(error_model="numpy", forceinline=True)
def memory(k, zeros):
    """Return the slot of the depth of each lane for function k; its settled values at the points of a panel follow.

    In front are one row of values at any fraction of the step, and one for each point of a panel.
    """
    return (len(zeros.rule) + 1) * (values_of(zeros.dims) + k)


@njit(error_model="numpy", forceinline=True)
def at_point(k, point, zeros):
    """Return the settled value of function k at a point of the panel."""
    return load(zeros.found, memory(k, zeros) + 1 + point, WIDTH)


@njit(error_model="numpy")
def begin(k, wanted, zeros):
    """Let the lanes in `wanted` seek passages of function k in the next step."""
    store(zeros.found, memory(k, zeros), select(wanted, 0.0, broadcast(-1.0, WIDTH)))


@njit(error_model="numpy")
def look(panel, width, zeros):
    """Compute all functions at the points of a panel of a width, and settle them."""
    dims, rule = zeros.dims, zeros.rule
    for point in range(len(rule)):
        evaluate(broadcast((panel + rule[point, POINT]) * width, WIDTH), point + 1, zeros)
        for k in range(dims.sections + dims.stops):
            store(zeros.found, memory(k, zeros) + 1 + point, settled(k, point + 1, zeros))


@njit(error_model="numpy")
def ready(k, level, zeros, control):
    """Return the lanes that need not halve a panel of some level for function k, and whether others do.

    The memory of each lane holds its depth: the lane uses panels of that level and above.
    """
    slot = memory(k, zeros)
    depth = load(zeros.found, slot, WIDTH)
    wanted = depth >= 1.0 * level
    done = wanted
    if level < DEEPEST:
        done = wanted & simple(slot + 1, 1, zeros.found, zeros.rule, control)
    halved = wanted & ~done
    store(zeros.found, slot, select(halved, level + 1.0, select(done, 1.0 * level, depth)))
    return done, any_lane(halved)


@njit(error_model="numpy", forceinline=True)
def crosses(before, after, direction):
    """Return the lanes in which a section function goes through zero: falling (-1), rising (+1) or either way (0)."""
    falls, rises = (before > 0.0) & (after <= 0.0), (before < 0.0) & (after >= 0.0)
    if direction < 0.0:
        return falls
    if direction > 0.0:
        return rises
    return falls | rises


@njit(error_model="numpy")
def arrive(k, low, high, zeros):
    """Return where section function k comes to zero, or beyond, between two fractions of the step, by bisection."""
    a, b = low, high
    evaluate(low, 0, zeros)
    before = settled(k, 0, zeros)
    for _ in range(60):
        if not any_lane(absolute(b - a) > 1e-15):
            break
        c = 0.5 * (a + b)
        evaluate(c, 0, zeros)
        beyond = settled(k, 0, zeros) * before <= 0.0
        a, b = select(beyond, a, c), select(beyond, c, b)
    return b


@njit(error_model="numpy")
def locate(k, hits, point, panel, width, zeros):
    """Return the zero of section function k between two points of a panel, and the lanes of `hits` that have one.

    Regula falsi with the Anderson-Bjorck weight (BIT 13, 253, 1973), bisection where that stalls.  A stretch of zeros has
    its beginning as the zero; a pole is none.
    """
    low = broadcast((panel + zeros.rule[point, POINT]) * width, WIDTH)
    high = broadcast((panel + zeros.rule[point + 1, POINT]) * width, WIDTH)
    g_low, g_high = value_of(k, point + 1, zeros), value_of(k, point + 2, zeros)
    # without a change of sign the function stays zero from some fraction on
    stays = hits & ~(g_low * g_high < 0.0)
    a, b, fa, fb = select(hits & ~stays, low, high), high, g_low, g_high
    for tried in range(60):
        active = absolute(b - a) > 1e-15  # the others are done and must not move, whatever their neighbours need
        if not any_lane(active):
            break
        # every fourth step is a bisection, so that the bracket shrinks in any case
        secant = b - fb * (b - a) / (fb - fa)
        good = (secant - a) * (b - secant) > 0.0
        c = select(good, secant, 0.5 * (a + b)) if tried % 4 != 3 else 0.5 * (a + b)
        c = select(active, c, b)
        evaluate(c, 0, zeros)
        fc = value_of(k, 0, zeros)
        done = (fc == 0.0) | (absolute(c - b) <= 1e-15)
        other = fc * fb < 0.0  # the zero lies between c and b
        weight = 1.0 - fc / fb
        near, f_near = select(other, b, a), select(other, fb, fa * select(weight > 0.0, weight, 0.5))
        a, fa = select(active, select(done, c, near), b), select(active, f_near, fa)
        b, fb = c, fc
    # a zero that is zero just before too is the end of a stretch
    exact = hits & ~stays & (fb == 0.0)
    if any_lane(exact):
        evaluate(maximum(b - 1e-12, low), 0, zeros)
        stays = stays | (exact & (value_of(k, 0, zeros) == 0.0))
    if any_lane(stays):
        b = select(stays, arrive(k, low, b, zeros), b)
    # at a pole the function is larger than at the points
    return b, hits & (stays | (absolute(fb) <= 2.0 * maximum(absolute(g_low), absolute(g_high))))
