"""Cash-Karp: explicit Runge-Kutta method of order 5(4) with 6 stages, the one the source paper integrates with.

The dense output is the cubic Hermite polynomial, which needs one more stage: the slope at the new point.
"""

from fractions import Fraction as _F

KIND = "explicit"
ORDER = 5
ERROR_ORDER = 4
DENSE_ORDER = 3
SOURCE = "Cash & Karp, ACM Transactions on Mathematical Software 16, 201 (1990)"


def _row(*numbers: str) -> tuple[float, ...]:
    return tuple(float(_F(number)) for number in numbers)


B = _row("37/378", "0", "250/621", "125/594", "0", "512/1771")
_B4 = _row("2825/27648", "0", "18575/48384", "13525/55296", "277/14336", "1/4")
A: tuple[tuple[float, ...], ...] = (
    (),
    _row("1/5"),
    _row("3/40", "9/40"),
    _row("3/10", "-9/10", "6/5"),
    _row("-11/54", "5/2", "-70/27", "35/27"),
    _row("1631/55296", "175/512", "575/13824", "44275/110592", "253/4096"),
    B,
)
C = (*_row("0", "1/5", "3/10", "3/5", "1", "7/8"), 1.0)
E = (tuple(high - low for high, low in zip(B, _B4, strict=True)),)
# Hermite: y(theta) - chord = theta (1-theta) ((1-theta) (h f0 - dy) - theta (h f1 - dy)), with dy = h sum b k
DENSE = (
    (1.0 - B[0], *(-b for b in B[1:]), 0.0),
    (2.0 * B[0] - 1.0, *(2.0 * b for b in B[1:]), -1.0),
)
