"""Where a series leaves its side of zero: the functions that a step with kinks is written with.

Between kinks the solution is analytic. A step that would pass a kink ends just behind it, and the next one finds itself on
the other side: nothing has to be remembered.
"""

from __future__ import annotations

__all__ = ["PASSAGE"]

PASSAGE = '''
PASSED, ROUNDING = 1e-10, 1e-15
NEAREST = 1e-8


@njit(error_model='numpy', forceinline=True)
def side_of(value, least):
    """The side of zero on which a value lies, 0 within `least` of zero."""
    return select(value > least, 1.0, select(value < -least, -1.0, 0.0*value))


@njit(error_model='numpy')
def passage(side, size, dense, first, stride, degree, ratio):
    """How far, at most to `ratio`, until a series has just left its side of zero.

    Its coefficients stand from group `first` on, each `stride` behind the last. What bounds the bend of the series bounds it
    from below by a parabola, whose zero lies before its own, so that the first passage is found whatever comes later; the
    zeros converge like those of Newton's method. A passage counts once it has gone a small part of the way that the series
    goes in the step, and more than rounding of `size`; the step ends there. What is neglected is of the order of that part
    squared.  Products are added by `fma`, so that every width has the same bits.
    """
    bend, spread = 0.0*ratio, 0.0*ratio
    for k in range(degree, 1, -1):
        part = absolute(load(dense, first + k*stride, WIDTH))
        bend, spread = fma(bend, ratio, k*(k - 1.0)*part), fma(spread, ratio, part)
    spread = fma(spread, ratio, absolute(load(dense, first + stride, WIDTH)))*ratio
    unit = side/maximum(fma(0.0*ratio + 1e-4, size, spread), 1e-300)
    bend = absolute(unit)*bend
    value, slope = fma(unit, load(dense, first, WIDTH), 0.75*PASSED), unit*load(dense, first + stride, WIDTH)
    active, place = absolute(side) > 0.5, select(absolute(side) > 0.5, 0.0, ratio)
    for _ in range(60):
        root = sqrt(fma(slope, slope, 2.0*bend*value))
        reach = select(slope > 0.0, (slope + root)/bend, 2.0*value/(root - slope))
        place = select(active, minimum(place + reach, ratio), place)
        active = active & (place < ratio)
        if not any_lane(active):
            break
        value, slope = 0.0*ratio, 0.0*ratio
        for k in range(degree, 0, -1):
            part = load(dense, first + k*stride, WIDTH)
            value, slope = fma(value, place, part), fma(slope, place, 1.0*k*part)
        value, slope = fma(unit, fma(value, place, load(dense, first, WIDTH)), 0.75*PASSED), unit*slope
        active = active & (value > 0.25*PASSED)
    return minimum(maximum(place, NEAREST*ratio), ratio)
'''.strip()
