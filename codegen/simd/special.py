"""Further elementary functions of lanes, composed of those in codegen/simd/elementary.py.

The polynomials `ERF` and `ERFCX` are Chebyshev fits made for this file in 40-digit arithmetic; the text below each
gives its largest error.
"""

from __future__ import annotations

from math import inf, nan

from .elementary import HALF_PI, LN2_HIGH, PI, atan, cos, exp, expm1, lane_function, log, sin
from .lane_types import constant_like
from .lanes import absolute, copysign, floor, maximum, minimum, multiply_add, on_bits, select, sqrt

__all__ = [
    "acos",
    "acosh",
    "asin",
    "asinh",
    "atan2",
    "atanh",
    "ceiling",
    "cosh",
    "erf",
    "power",
    "power_of_two",
    "sinh",
    "tan",
]

ERF = (
    1.1283791670955126, -0.37612638903183543, 0.11283791670945006, -0.02686617064323777, 0.0052239776071164225,
    -0.0008548325975389692, 0.00012055294904839707, -1.492473690741966e-05, 1.6447424703317362e-06,
    -1.6208483801871705e-07, 1.3720064546777686e-08, -7.795898827002142e-10,
)  # fmt: skip
"""erf(x)/x in powers of x**2 on [0, 1]; error 7.4e-18."""
ERFCX = (
    0.25539567631050575, -0.4271858474139584, 0.24165819424246646, -0.07897858101573213, 0.003732892404327764,
    0.006997461739200444, -0.0008471432509203844, -0.000981977026567889, 4.355560219515472e-05, 0.00017436116545392264,
    2.7525480361206068e-05, -2.7579864674305787e-05, -1.396807230177146e-05, 1.392621183618803e-06,
    3.789215643758464e-06, 1.1780775215625583e-06, -5.322696855655786e-07, -4.215301054238321e-07,
)  # fmt: skip
"""exp(x**2) erfc(x) in powers of (x - 2)/(x + 2) for x on [1, 6]; error 2.4e-19."""


@lane_function
def tan(x):
    """Return the tangent, as accurate as sine and cosine."""
    return sin(x) / cos(x)


@lane_function
def sinh(x):
    """Return the hyperbolic sine; infinite above 709.8."""
    size = absolute(x)
    e = expm1(select(size < 1.0, size, 0.0))
    large = exp(size)
    return copysign(select(size < 1.0, 0.5 * (e + e / (e + 1.0)), 0.5 * large - 0.5 / large), x)


@lane_function
def cosh(x):
    """Return the hyperbolic cosine; infinite above 709.8."""
    large = exp(absolute(x))
    return 0.5 * large + 0.5 / large


@lane_function
def asin(x):
    """Return the inverse sine; NaN beyond [-1, 1]."""
    return atan(x / sqrt((1.0 - x) * (1.0 + x)))


@lane_function
def acos(x):
    """Return the inverse cosine; NaN beyond [-1, 1]."""
    return 2.0 * atan(sqrt((1.0 - x) / (1.0 + x)))


@lane_function
def _log_of_more(x):
    """log(1 + x) for x >= 0, corrected to first order by the rounding error of 1 + x."""
    more = 1.0 + x
    return select(more < 1e300, log(more) - ((more - 1.0) - x) / more, log(x))


@lane_function
def asinh(x):
    """Return the inverse hyperbolic sine."""
    # log(|x| + sqrt(1 + x**2)); beyond 1e9, where x**2 could overflow, it is log(2 |x|) to rounding
    size = absolute(x)
    low = minimum(size, 1e9)
    square = low * low
    value = _log_of_more(low + square / (1.0 + sqrt(1.0 + square)))
    value = select(size > 1e9, log(size) + LN2_HIGH, value)
    return select(x == x, copysign(value, x), x)


@lane_function
def acosh(x):
    """Return the inverse hyperbolic cosine; NaN below 1."""
    over = x - 1.0
    low = minimum(over, 1e9)
    value = _log_of_more(low + sqrt(low * (low + 2.0)))
    value = select(over > 1e9, log(x) + LN2_HIGH, value)
    return select(over >= 0.0, value, nan)


@lane_function
def atanh(x):
    """Return the inverse hyperbolic tangent; infinite at -1 and 1, NaN beyond."""
    size = absolute(x)
    value = 0.5 * _log_of_more(2.0 * size / (1.0 - size))
    value = select(size == 1.0, inf, value)
    return select(size <= 1.0, copysign(value, x), nan)


@lane_function
def atan2(y, x):
    """Return the angle of the point (x, y), from -pi to pi."""
    # the angle to the nearer axis, at most pi/4, then reflected at the diagonal, the y axis and the x axis
    high, wide = absolute(y), absolute(x)
    steep = high > wide
    large = maximum(high, wide)
    ratio = minimum(high, wide) / select(large > 0.0, large, 1.0)
    angle = atan(select(high == wide, select(large > 0.0, 1.0, 0.0), ratio))  # also if both are infinite
    angle = select(steep, HALF_PI - angle, angle)
    angle = select(copysign(1.0 + 0.0 * angle, x) < 0.0, PI - angle, angle)
    return select((x == x) & (y == y), copysign(angle, y), x + y)


@lane_function
def ceiling(x):
    """Return the smallest integer that is not smaller than x."""
    return -floor(-x)


@lane_function
def erf(x):
    """Return the error function."""
    size = absolute(x)
    # |x| < 1: its own series
    z = x * x
    small = z * 0.0 + ERF[11]
    for k in range(10, -1, -1):
        small = multiply_add(small, z, ERF[k])
    # |x| >= 1: 1 - exp(-x**2) ERFCX(x); at 6 it is 1 to rounding
    far = minimum(size, 6.0)
    t = (far - 2.0) / (far + 2.0)
    large = t * 0.0 + ERFCX[17]
    for k in range(16, -1, -1):
        large = multiply_add(large, t, ERFCX[k])
    large = 1.0 - exp(-far * far) * large
    return select(x == x, select(size < 1.0, small * x, copysign(large, x)), x)


@lane_function
def power(x, y):
    """Return x**y for x > 0 as exp(y log x); the relative error is that of y log x times |y log x|; NaN for x < 0."""
    return exp(y * log(x))


power_of_two = on_bits(lambda b, x: b.and_(x, constant_like(x, 0x7FF << 52)), 1)
"""The largest power of two that is not larger than a positive number: its exponent bits; NaN becomes infinite."""
