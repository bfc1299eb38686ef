"""Branch-free elementary functions of lanes, one polynomial for the whole reduced range.

Reductions follow the classical scheme (Cody & Waite, *Software Manual for the Elementary Functions*, 1980; the
logarithm's final sum as in Tang, ACM Trans. Math. Softw. 16, 378, 1990).  The polynomials are our own Remez fits in
50-digit arithmetic, weighted by the relative error of the result; the bound stands beside each.
The circular functions subtract three parts of pi/2: their error is below 1.5 units in the last place up to |x| = 1e9, below
2e-15 up to 1e15, and beyond, where neighbouring doubles lie further apart than a radian matters, they stay within [-1, 1].
"""

from __future__ import annotations

from typing import Any

from numba import njit

from .lanes import absolute, copysign, fma, round_even, scale_binary, select, split_binary
from .lanes import floor as floor  # re-exported: kernels take all their functions from here
from .lanes import sqrt as sqrt

__all__ = ["atan", "cos", "exp", "expm1", "floor", "log", "sign", "sin", "sincos", "sqrt", "tanh"]

MAGIC = 6755399441055744.0  # 1.5 * 2**52: adding it rounds to an integer and leaves that in the low bits
LOG2E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.6931471805599453, 2.3190468138462996e-17
LN2_SHORT, LN2_REST = 0.6931471803691238, 1.9082149292705877e-10  # the first has 21 trailing zero bits
HALF_PI, HALF_PI_LOW, HALF_PI_REST = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33
RELATIVE_LOW = HALF_PI_LOW / HALF_PI
TWO_OVER_PI = 0.6366197723675814


def lane_function(function: Any) -> Any:
    """Compile for lanes and always inline."""
    return njit(function, error_model="numpy", forceinline=True)


@lane_function
def _exp_tail(r):
    """exp(r) - 1 - r for |r| <= ln(2)/2, error 3.7e-18 of exp(r)."""
    z = r * r
    even = fma(2.763036861363753e-07, z, 2.480149279994166e-05)
    even = fma(fma(fma(even, z, 0.0013888888943875358), z, 0.04166666666652943), z, 0.5000000000000011)
    odd = fma(2.4999076361394543e-08, z, 2.755759036424531e-06)
    odd = fma(fma(fma(odd, z, 0.0001984126950115741), z, 0.008333333333497358), z, 0.16666666666666408)
    return z * fma(odd, r, even)


@lane_function
def exp(x):
    """e**x; 0 below -745.2, inf above 709.8."""
    y = select(x > 710.0, 710.0, select(x < -746.0, -746.0, x))
    shifted = fma(y, LOG2E, MAGIC)
    k = shifted - MAGIC
    r = fma(k, -LN2_LOW, fma(k, -LN2_HIGH, y))
    e = 1.0 + (r + _exp_tail(r))
    half = fma(k, 0.5, MAGIC)  # 2**k in two factors, so that neither over- nor underflows
    rest = (k - (half - MAGIC)) + MAGIC
    result = scale_binary(e, half) * scale_binary(e * 0.0 + 1.0, rest)
    return select(x == x, result, x)


@lane_function
def _expm1_parts(x):
    """e**x - 1 as the sum of a double and a small correction, for |x| <= 700 (clamped there)."""
    y = select(x > 700.0, 700.0, select(x < -700.0, -700.0, x))
    shifted = fma(y, LOG2E, MAGIC)
    k = shifted - MAGIC
    high = fma(k, -LN2_HIGH, y)  # exact
    r = fma(k, -LN2_LOW, high)
    tail = _exp_tail(r)
    p = r + tail
    rest = ((r - p) + tail) + fma(k, -LN2_LOW, high - r)
    scale = scale_binary(r * 0.0 + 1.0, shifted)
    base = scale - 1.0
    whole = fma(scale, p, base)
    return whole, fma(scale, rest, fma(scale, p, base - whole))


@lane_function
def expm1(x):
    """e**x - 1 without cancellation, for |x| <= 700 (clamped there)."""
    whole, rest = _expm1_parts(x)
    return copysign(select(x == x, whole + rest, x), x)


@lane_function
def log(x):
    """Natural logarithm; -inf at 0, NaN below."""
    tiny = x < 2.2250738585072014e-308
    m, k = split_binary(select(tiny, x * 18014398509481984.0, x), 0.7071067811865476)
    k = select(tiny, k - 54.0, k)
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = fma(fma(0.06624980704723496, w, 0.09090887754046581), w, 0.1428571428453648)
    odd = fma(fma(fma(0.06626380506870277, w, 0.07693548837276801), w, 0.11111111324377015), w, 0.20000000000003143)
    tail = 2.0 * z * (0.3333333333333333 + z * fma(even, z, odd))
    square = 0.5 * f * f
    result = k * LN2_SHORT - ((square - fma(s, square + tail, k * LN2_REST)) - f)
    result = select(x == 0.0, -1.0 / (x * x), result)
    result = select(x > 1.7976931348623157e308, x, result)
    return select(x >= 0.0, result, (x - x) / (x - x))


@lane_function
def atan(x):
    """Inverse tangent; polynomial error 1.3e-18 for |t| <= tan(pi/8), reached through 0, pi/4 or pi/2."""
    size = absolute(x)
    middle, big = size > 0.4142135623730951, size > 2.414213562373095
    middle = middle & ~big
    above = select(middle, size - 1.0, select(big, -1.0, size))
    below = select(middle, size + 1.0, select(big, size, 1.0))
    start = select(middle, 0.5 * HALF_PI, select(big, HALF_PI, 0.0))
    inverse = 1.0 / below
    t = above * inverse
    # what rounding took from size - 1, size + 1 and the quotient; it counts in the middle alone
    lost = (size - (above + 1.0)) - t * (size - (below - 1.0))
    lost = select(middle, (fma(-t, below, above) + lost) * inverse, 0.0)
    z = t * t
    w = z * z
    even = fma(fma(-0.017905033261262727, w, -0.05039190093682711), w, -0.0666309918872905)
    even = fma(fma(fma(even, w, -0.09090897725139548), w, -0.1428571428016644), w, -0.333333333333332)
    odd = fma(fma(0.03806213295635326, w, 0.05847859183584845), w, 0.076920597158101)
    odd = fma(fma(odd, w, 0.11111110782150155), w, 0.19999999999953247)
    p = fma(t * z, fma(odd, z, even), fma(start, RELATIVE_LOW, lost))
    total = start + t
    return copysign(total + (((start - total) + t) + p), x)


@lane_function
def sincos(x):
    """The pair (sin x, cos x); NaN for infinite x, no accuracy for |x| > 1e15."""
    k = round_even(x * TWO_OVER_PI)
    r = fma(k, -HALF_PI_REST, fma(k, -HALF_PI_LOW, fma(k, -HALF_PI, x)))
    r = select(absolute(r) < 1.0, r, r * 0.0)
    z = r * r
    s = fma(fma(1.5896681864241067e-10, z, -2.505075630735003e-08), z, 2.755731368145892e-06)
    s = fma(fma(fma(s, z, -0.00019841269829780957), z, 0.008333333333322384), z, -0.16666666666666632)
    s = fma(s, r * z, r)
    c = fma(fma(-1.1359566430737872e-11, z, 2.0875721777215395e-09), z, -2.7557314341943445e-07)
    c = fma(fma(fma(c, z, 2.4801587289448662e-05), z, -0.0013888888888874075), z, 0.0416666666666666)
    half = 0.5 * z
    top = 1.0 - half
    c = top + (((1.0 - top) - half) + z * z * c)
    turn = k - 4.0 * floor(k * 0.25)
    swap = (turn == 1.0) | (turn == 3.0)
    sine = select(swap, c, s)
    cosine = select(swap, s, c)
    sine = select(turn > 1.5, -sine, sine)
    cosine = select((turn == 1.0) | (turn == 2.0), -cosine, cosine)
    return sine, cosine


@lane_function
def sin(x):
    """Sine."""
    return select(x == 0.0, x, sincos(x)[0])


@lane_function
def cos(x):
    """Cosine."""
    return sincos(x)[1]


@lane_function
def tanh(x):
    """Hyperbolic tangent, from e = exp(2|x|) - 1 as e/(e + 2) with the residual of the quotient."""
    size = absolute(x)
    e, e_rest = _expm1_parts(2.0 * select(size > 20.0, 20.0, size))
    below = e + 2.0
    part = below - 2.0
    below_rest = ((2.0 - (below - part)) + (e - part)) + e_rest
    inverse = 1.0 / below
    q = e * inverse
    return copysign(select(x == x, fma(fma(-q, below, e) + (e_rest - q * below_rest), inverse, q), x), x)


@lane_function
def sign(x):
    """-1, 0 or 1; NaN stays NaN."""
    return select(x == 0.0, x, copysign(select(x == x, 1.0, x), x))
