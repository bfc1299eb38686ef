"""Paley graph: the elements of a finite field (n a prime power 5, 9, 13 …), joined if they differ by a square."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def _prime_power(n: int) -> tuple[int, int] | None:
    """Return the prime p and the exponent e of n = p**e; None if n is no prime power."""
    from flint import fmpz

    if not (fmpz(n).is_perfect_power() or fmpz(n).is_prime()):
        return None
    (p, e), *others = fmpz(n).factor()
    return None if others else (int(p), int(e))


def settle(n: int) -> dict[str, object]:
    """Check that n is a prime power with n = 1 mod 4; otherwise -1 is no square, and links would be one-way."""
    if n % 4 != 1 or _prime_power(n) is None:
        below = next(m for m in range(n - 1, 4, -1) if m % 4 == 1 and _prime_power(m))
        above = next(m for m in range(n + 1, 2 * n) if m % 4 == 1 and _prime_power(m))
        raise ValueError(
            f"found n = {n}; expected a prime power that leaves 1 on division by 4, such as {below} or {above}"
        )
    return {}


def _squares(p: int, e: int) -> set[tuple[int, ...]]:
    """Return the non-zero squares of the field of p**e elements as coefficients, the constant first."""
    # Elements are polynomials over the integers mod p, reduced by the first irreducible polynomial of degree e.
    from flint import nmod_poly

    monic = (nmod_poly([*reversed(low), 1], p) for low in product(range(p), repeat=e))
    modulus = next(f for f in monic if [(g.degree(), m) for g, m in f.factor()[1]] == [(e, 1)])
    squares = set()
    for digits in product(range(p), repeat=e):
        square = nmod_poly(list(digits), p) ** 2 % modulus
        squares.add(tuple(int(square[k]) for k in range(e)))
    return squares - {(0,) * e}


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Yield the edges; the coefficients of element i are the digits of i to base p, the constant last."""
    power = _prime_power(n)
    if power is None:
        raise ValueError(f"found n = {n}; expected a prime power")
    p, e = power
    places = [p**k for k in range(e)]
    squares = [tuple(digits) for digits in _squares(p, e)]
    for i in range(n):
        here = [i // place % p for place in places]
        for square in squares:
            j = sum((a + b) % p * place for a, b, place in zip(here, square, places, strict=True))
            if i < j:
                yield i, j, 1


def spectrum(n: int) -> Eigenvalues:
    """0 once, -(n + √n)/2 and -(n - √n)/2, (n - 1)/2 times each."""
    from sympy import Integer, sqrt

    half = (n - 1) // 2
    return [(Integer(0), 1), *(((sign * sqrt(n) - n) / 2, half) for sign in (Integer(1), Integer(-1)))]


def formula() -> ClosedForm:
    """0, -(n + √n)/2, -(n - √n)/2."""
    from sympy import And, Eq, Mod, S, primenu, sqrt

    from ..graphs.closed_forms import ClosedForm, N, Term

    half = (N - 1) / 2
    terms = (Term(S.Zero, vector=S.One), Term((sqrt(N) - N) / 2, half), Term((-sqrt(N) - N) / 2, half))
    where = And(Eq(Mod(N, 4), 1), Eq(primenu(N), 1))
    return ClosedForm(terms, least=5, note="n a prime power that leaves 1 on division by 4", degree=half, where=where)


TOPOLOGY = Family(
    edges,
    minimum=5,
    settle=settle,
    # Number of edges: half of all pairs.
    count=lambda n: n * (n - 1) // 4,
    spectrum=spectrum,
    formula=formula,
    source="C. Godsil, G. Royle, Algebraic Graph Theory (Springer, 2001), chapter 10; R. E. A. C. Paley, J. Math. "
    "Phys. 12, 311 (1933)",
)
