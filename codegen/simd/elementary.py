"""Branch-free elementary functions of lanes, one polynomial for the whole reduced range.

Reductions follow the classical scheme (Cody & Waite, *Software Manual for the Elementary Functions*, 1980; the
logarithm's final sum as in Tang, ACM Trans. Math. Softw. 16, 378, 1990).  `fma` is used if the rounding error of the
product matters, otherwise `multiply_add`, which rounds twice on old processors.  Polynomials are evaluated by Estrin's
scheme (Proc. Western Joint Computer Conf. 17, 33, 1960), in which few operations depend on each other.

The polynomials are Remez fits made for this file, weighted by the relative error of the result.  `ATAN`, `SINE` and
`EXP` are fitted in 40-digit arithmetic on 120 Chebyshev points.  In `ATAN` and `SINE`, each of the three lowest
coefficients is rounded to double precision, and then the higher coefficients are fitted again.  The text below each
polynomial gives the error with rounded coefficients; tests/codegen/simd/test_elementary_fits.py repeats these three
fits.

Sine and cosine subtract a multiple of pi, which is split into three doubles.  Their error is below 1.5 units in the
last place up to |x| = 1e9, and below 2e-15 up to |x| = 1e15.  For larger |x|, the distance between neighbouring doubles
is not small compared with a period; the results have no accuracy, but lie within [-1, 1].
"""

from __future__ import annotations

from math import inf, nan
from typing import Any

from ..front_end.decorator import njit
from .lanes import (
    absolute,
    copysign,
    flip_if_odd,
    floor,  # re-exported: kernels take all their functions from here
    fma,
    multiply_add,
    scale_binary,
    select,
    split_binary,
    sqrt,
)

__all__ = ["atan", "cos", "exp", "expm1", "floor", "log", "sign", "sin", "sqrt", "tanh"]

MAGIC = (
    6755399441055744.0  # 1.5 * 2**52: the sum with it is rounded to an integer, whose lowest bits are those of the sum
)
LOG2E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.6931471805599453, 2.3190468138462996e-17
LN2_SHORT, LN2_REST = (
    0.6931471803691238,
    1.9082149292705877e-10,
)  # the first has 21 trailing zero bits: k times it is exact
PI, PI_LOW, PI_REST = 3.141592653589793, 1.2246467991473532e-16, -2.9947698097183397e-33
ONE_OVER_PI = 0.3183098861837907
HALF_PI, HALF_PI_LOW = 1.5707963267948966, 6.123233995736766e-17
LARGE, SMALL = 2.0**64, 2.0**-64  # factors that keep 2**k of `exp` within the normal numbers
SMALLEST_NORMAL, LARGEST = 2.2250738585072014e-308, 1.7976931348623157e308
SQRT_HALF = 0.7071067811865476

ATAN = (
    -0.3333333333333307, 0.19999999999951767, -0.14285714282588532, 0.11111111007341806, -0.09090907007653506,
    0.07692279886203458, -0.06666404395844483, 0.058805296233745794, -0.05253525896124795, 0.04722345218764209,
    -0.042192351159500145, 0.03664298511646974, -0.029905468449123198, 0.021986734417333814, -0.013902253878486147,
    0.007197654934215261, -0.0028854901193220857, 0.0008315171861774984, -0.000152201928520457, 1.3229077289707739e-05,
)  # fmt: skip
"""(atan(t)/t - 1)/z in powers of z = t**2 on [2**-20, 1]; error of atan(t) 7.1e-18 of it."""
SINE = (
    -0.16666666666666666, 0.008333333333333203, -0.0001984126984121048, 2.7557319211140833e-06, -2.5052106859338075e-08,
    1.6058938506704054e-10, -7.642949572367172e-13, 2.720641811447777e-15,
)  # fmt: skip
"""(sin(r)/r - 1)/z in powers of z = r**2 on [2**-20, 2.5]; error of sin(r) 3.5e-19 of it."""
EXP = (
    0.5000000000000011, 0.16666666666666416, 0.041666666666530024, 0.008333333333493037, 0.0013888888943660216,
    0.00019841269509323866, 2.4801493071126753e-05, 2.755758419712008e-06, 2.7630257481410706e-07, 2.5000675852100195e-08,
)  # fmt: skip
"""(exp(r) - 1 - r)/r**2 in powers of r for |r| <= 0.3466; error of exp(r) 1.1e-17 of it."""
LOG = (
    0.3333333333333333, 0.20000000000003143, 0.1428571428453648, 0.11111111324377015, 0.09090887754046581,
    0.07693548837276801, 0.06624980704723496, 0.06626380506870277,
)  # fmt: skip
"""(atanh(s)/s - 1)/z in powers of z = s**2 for |s| <= 0.1716; error of atanh(s) 3.0e-19 of it."""


def lane_function(function: Any) -> Any:
    """Compile for lanes and always inline."""
    return njit(error_model="numpy", forceinline=True)(function)


@lane_function
def _four(c0, c1, c2, c3, x, square):
    """c0 + c1 x + c2 x**2 + c3 x**3."""
    return multiply_add(multiply_add(c3, x, c2), square, multiply_add(c1, x, c0))


@lane_function
def _exp_series(r, z):
    """(exp(r) - 1 - r)/z with z = r**2."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = EXP
    w = z * z
    return multiply_add(
        multiply_add(multiply_add(c9, r, c8), w, _four(c4, c5, c6, c7, r, z)), w, _four(c0, c1, c2, c3, r, z)
    )


@lane_function
def exp(x):
    """Return e**x; 0 below -745.2, inf above 709.8."""
    y = select(x < -746.0, -746.0, x)
    y = select(y > 710.0, 710.0, y)  # NaN passes
    # x = k ln 2 + r with |r| <= ln(2)/2, and p = e**r - 1
    shifted = multiply_add(y, LOG2E, MAGIC)
    k = shifted - MAGIC
    r = multiply_add(k, -LN2_LOW, fma(k, -LN2_HIGH, y))
    z = r * r
    p = multiply_add(z, _exp_series(r, z), r)
    # 2**k in two factors, so that neither over- nor underflows
    factor = scale_binary(select(x < 0.0, LARGE, SMALL), shifted)
    return multiply_add(factor, p, factor) * select(x < 0.0, SMALL, LARGE)


@lane_function
def _expm1_parts(x):
    """Return e**x - 1 as the sum of a double and a small correction, for |x| <= 700 (clamped there)."""
    y = select(x < -700.0, -700.0, x)
    y = select(y > 700.0, 700.0, y)
    shifted = multiply_add(y, LOG2E, MAGIC)
    k = shifted - MAGIC
    reduced = fma(k, -LN2_HIGH, y)  # exact
    r = multiply_add(k, -LN2_LOW, reduced)
    # p + p_error = e**r - 1, with the errors of the sums r + tail and reduced - k LN2_LOW
    z = r * r
    tail = z * _exp_series(r, z)
    p = r + tail
    p_error = ((r - p) + tail) + multiply_add(k, -LN2_LOW, reduced - r)
    # 2**k (p + p_error) + (2**k - 1), with the error of this sum
    scale = scale_binary(r * 0.0 + 1.0, shifted)
    base = scale - 1.0
    value = multiply_add(scale, p, base)
    return value, multiply_add(scale, p_error, multiply_add(scale, p, base - value))


@lane_function
def expm1(x):
    """Return e**x - 1 without cancellation, for |x| <= 700 (clamped there)."""
    value, correction = _expm1_parts(x)
    return copysign(select(x == x, value + correction, x), x)


@lane_function
def log(x):
    """Return the natural logarithm; -inf at 0, NaN below."""
    # x = m 2**k with m in [sqrt(1/2), sqrt(2)); numbers that are not normal are multiplied by 2**54 first
    tiny = x < SMALLEST_NORMAL
    m, k = split_binary(select(tiny, x * 18014398509481984.0, x), SQRT_HALF)
    k = select(tiny, k - 54.0, k)
    # log(1 + f) = 2 atanh(s) = f - (f**2/2 - s (f**2/2 + tail)), where tail = 2 z LOG(z)
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    c0, c1, c2, c3, c4, c5, c6, c7 = LOG
    even = multiply_add(multiply_add(c6, w, c4), w, c2)
    odd = multiply_add(multiply_add(c7, w, c5), w, c3)
    odd = multiply_add(odd, w, c1)
    tail = 2.0 * z * (c0 + z * multiply_add(even, z, odd))
    square = 0.5 * f * f
    result = k * LN2_SHORT - ((square - multiply_add(s, square + tail, k * LN2_REST)) - f)
    result = select(x == 0.0, -inf, result)
    result = select(x > LARGEST, x, result)
    return select(x >= 0.0, result, nan)


@lane_function
def _atan_series(z):
    """(atan(t)/t - 1)/z with z = t**2."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, d0, d1, d2, d3, d4, d5, d6, d7, d8, d9 = ATAN
    z2 = z * z
    z4 = z2 * z2
    z8 = z4 * z4
    low = multiply_add(_four(c5, c6, c7, c8, z, z2), z4, _four(c1, c2, c3, c4, z, z2))
    middle = multiply_add(_four(d3, d4, d5, d6, z, z2), z4, _four(c9, d0, d1, d2, z, z2))
    high = multiply_add(d9, z2, multiply_add(d8, z, d7))
    # add c0, the largest coefficient, last, so that its sum is rounded only once
    return multiply_add(multiply_add(multiply_add(high, z8, middle), z8, low), z, c0)


@lane_function
def atan(x):
    """Return the inverse tangent."""
    # atan(|x|) = pi/2 + atan(-1/|x|) where |x| > 1
    size = absolute(x)
    beyond = size > 1.0
    t = select(beyond, -1.0 / size, size)
    z = t * t
    p = multiply_add(t * z, _atan_series(z), select(beyond, HALF_PI_LOW, 0.0))
    return copysign((select(beyond, HALF_PI, 0.0) + t) + p, x)


@lane_function
def _alternating_sine(x, k, shifted):
    """sin(x - k pi), its sign changed where `shifted` is odd; within [-1, 1] for any k."""
    r = multiply_add(k, -PI_REST, multiply_add(k, -PI_LOW, fma(k, -PI, x)))
    z = r * r
    w = z * z
    c0, c1, c2, c3, c4, c5, c6, c7 = SINE
    high = multiply_add(c7, w, multiply_add(c6, z, c5))
    series = multiply_add(high, w * w, _four(c1, c2, c3, c4, z, w))
    cube = multiply_add(r, z, r * fma(r, r, -z))  # corrects the rounding error of r**2, which matters near maxima
    # z <= (pi/2)**2 = 2.47; a larger one comes from an x beyond the accuracy of the reduction
    return flip_if_odd(select(z < 3.25, multiply_add(cube, multiply_add(series, z, c0), r), r * 0.0), shifted)


@lane_function
def sin(x):
    """Return the sine; NaN for infinite x, no accuracy for |x| > 1e15."""
    shifted = multiply_add(x, ONE_OVER_PI, MAGIC)
    return select(x == 0.0, x, _alternating_sine(x, shifted - MAGIC, shifted))


@lane_function
def cos(x):
    """Return the cosine; NaN for infinite x, no accuracy for |x| > 1e15."""
    # cos(x) = sin(x + pi/2): k is the half-integer nearest to x/pi
    shifted = multiply_add(x, ONE_OVER_PI, 0.5) + MAGIC
    return _alternating_sine(x, (shifted - MAGIC) - 0.5, shifted)


@lane_function
def tanh(x):
    """Return the hyperbolic tangent."""
    # e/(e + 2) with e = exp(2|x|) - 1; beyond |x| = 20 it is 1 to rounding
    size = absolute(x)
    e, e_error = _expm1_parts(2.0 * select(size > 20.0, 20.0, size))
    below = e + 2.0
    part = below - 2.0
    below_error = ((2.0 - (below - part)) + (e - part)) + e_error
    # correct the rounded quotient q by one Newton step with the residual e - q*below
    inverse = 1.0 / below
    q = e * inverse
    return copysign(select(x == x, multiply_add(fma(-q, below, e) + (e_error - q * below_error), inverse, q), x), x)


@lane_function
def sign(x):
    """Return -1, 0 or 1; NaN stays NaN."""
    return select(x == 0.0, x, copysign(select(x == x, 1.0, x), x))
