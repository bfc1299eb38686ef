"""Hamming graph: the words of d (2) letters, joined if they differ in one (d = 2: the moves of a rook)."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integer_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def _letters(n: int, d: int) -> int:
    """Find q with n = q**d, the number of letters; ValueError if there is none."""
    if n == 1:
        return 1
    low, high = 1, 2
    while d < n.bit_length() and high**d < n:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if middle**d >= n else (middle, high)
    if d >= n.bit_length() or high**d != n:
        words = f"{low**d} (words of {d} of {low} letters) or {high**d} (of {high})" if low > 1 else f"2^{d} or more"
        raise ValueError(f"found n = {n} with d = {d}; expected a whole number to the power {d}, such as {words}")
    return high


def settle(n: int, d: object) -> dict[str, object]:
    """Check that n is a power q**d."""
    length = integer_option("d", d, 1)
    _letters(n, length)
    return {"d": length}


def edges(n: int, *, d: int = 2) -> Iterator[tuple[int, int, int]]:
    """Join each word to the words with one larger letter; the letters are the digits of the node's number to base q."""
    q = _letters(n, d)
    for i in range(n):
        for value in (q**k for k in range(d)):
            yield from ((i, i + step * value, 1) for step in range(1, q - i // value % q))


def spectrum(n: int, *, d: int = 2) -> Eigenvalues:
    """-q j, C(d, j) (q - 1)^j times, j = 0 … d."""
    q = _letters(n, d)
    return [(-q * j, comb(d, j) * (q - 1) ** j) for j in range(d + 1 if q > 1 else 1)]


def formula() -> ClosedForm:
    """-q j, C(d, j) (q - 1)^j times; eigenvectors are the characters of the group of words."""
    from sympy import Eq, I, KroneckerDelta, Mod, Product, S, Sum, binomial, exp, floor, pi

    from ..graphs.closed_forms import NODE, ClosedForm, D, J, K, M, Q, Term

    here, there = Mod(floor(NODE / Q**K), Q), Mod(floor(M / Q**K), Q)
    letters = Eq(Sum(1 - KroneckerDelta(there, 0), (K, 0, D - 1)), J)
    wave = Product(exp(2 * pi * I * here * there / Q), (K, 0, D - 1))
    times = binomial(D, J) * (Q - 1) ** J
    term = Term(-Q * J, times, ((J, S.Zero, D),), wave, ((M, S.Zero, Q**D - 1),), letters)
    note = "words of d of q letters; m has j digits other than 0 to the base q"
    return ClosedForm((term,), Q**D, {"d": D}, note=note, degree=D * (Q - 1), lowest={Q: 2})


TOPOLOGY = Family(
    edges,
    minimum=1,
    settle=settle,
    # Number of edges: each word has d (q - 1) neighbours.
    count=lambda n, *, d=2: n * d * (_letters(n, d) - 1) // 2,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, A. M. Cohen, A. Neumaier, Distance-Regular Graphs (Springer, 1989), section 9.2",
)
