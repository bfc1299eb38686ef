"""Check the closed form of a large graph modulo large primes.

Modulo a prime p = 1 mod m the integers contain a root of unity ζ of order m.  There 2 cos(2πk/m)
equals ζ^k + ζ^-k, so that the check needs no cyclotomic algebra.  A non-zero polynomial over the
cyclotomic field is zero modulo few primes only (L. C. Washington, Introduction to Cyclotomic Fields,
Springer, 1997, chapter 2): such a prime divides the norm of a coefficient, and the norm, bounded by
the eigenvalues, has few large prime divisors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from hashlib import sha256
from math import lcm, log, log2
from operator import mul

import sympy as sp
from flint import fmpz, nmod_mat, nmod_poly

from ..algebra import cosines
from ..algebra.cosine_sums import read
from ..algebra.rationals import to_fraction
from .characteristic import pairwise_product, sparse
from .eigenvalue import ProofError
from .matrix import Matrix

PRIMES = 3  # number of primes with which `check_modulo` compares
BITS = 61  # the primes lie between 2**BITS and 2**(BITS + 1), so that residues fit into 64 bits
LONGEST = 10_000  # most roots of unity into which `_surd` expands a square root
# The number shift + Σ b exp(2πit), stored as (shift, ((t, b), …)).
Powers = tuple[Fraction, tuple[tuple[Fraction, Fraction], ...]]


def check_modulo(graph: Matrix, pairs: Sequence[tuple[sp.Expr, int]]) -> float | None:
    """Compare a closed form with the characteristic polynomial modulo PRIMES primes."""
    # Return the probability of missing a difference; None if a number is no sum of roots of unity. A hash of the closed
    # form selects the primes.
    all_powers = [(_powers(sp.sympify(number)), times) for number, times in pairs]
    claims = [(powers, times) for powers, times in all_powers if powers is not None]
    if len(claims) != len(all_powers):
        return None
    m = lcm(1, *(t.denominator for (_, terms), _ in claims for t, _ in terms))
    seed = f"{graph.name} {graph.n} {graph.options} {graph.link_count} {m}"
    for p, _ in zip(_primes(m, seed), range(PRIMES), strict=False):
        claimed = _claimed(claims, m, p)
        if claimed != _characteristic(graph, p):
            raise ProofError(
                f"spectrum of {graph.name} {graph.n}: the eigenvalues do not multiply out to the characteristic "
                f"polynomial modulo {p}: correct the closed form"
            )
    return _error_probability(graph, claims, m) ** PRIMES


def _powers(number: sp.Expr) -> Powers | None:
    """Write a number as a sum of roots of unity; None if no such form is recognised."""
    form = cosines.linear_exponential(number)
    if form is not None:
        a, b, k, m = form
        return a, ((Fraction(k, m), b),)
    real = read(number)
    if real is not None:
        return real.shift, tuple((turn, b) for t, b in real.terms for turn in (t, 1 - t))
    surd = _surd(number)
    if surd is not None:
        return surd
    re, im = number.as_real_imag()  # radicals of short angles: a + b I with a, b real sums
    first, second, quarter = read(re), read(sp.expand(im)), Fraction(1, 4)
    if first is None or second is None:
        return None
    terms = [(turn, b) for t, b in first.terms for turn in (t, 1 - t)]
    terms += [((turn + quarter) % 1, b) for t, b in second.terms for turn in (t, 1 - t)]
    return first.shift, (*terms, (quarter, second.shift))


def _surd(number: sp.Expr) -> Powers | None:
    """Expand a + b √c with c = 1 mod 4 by the Gauss sum √c = Σ_k exp(2πik²/c); None for any other number."""
    # See Washington 1997, chapter 6.
    a, scaled_root = number.as_coeff_Add()
    b, root = scaled_root.as_coeff_Mul()
    if not (a.is_Rational and b.is_Rational and root.is_Pow and root.exp == sp.S.Half and root.base.is_Integer):
        return None
    c, factor = int(root.base), to_fraction(b)
    if c % 4 != 1 or not 0 < c <= LONGEST:
        return None
    return to_fraction(a), tuple((Fraction(k * k % c, c), factor) for k in range(c))


def _primes(m: int, seed: str) -> Iterator[int]:
    """Yield primes p = 1 mod m of BITS + 1 bits; a hash gives the start of each search."""
    count = 0
    while True:
        start = int.from_bytes(sha256(f"{seed} {count}".encode()).digest()[:8], "big") % 2**BITS
        p = 2**BITS + start - start % m + (1 - 2**BITS) % m
        while not fmpz(p).is_prime():
            p += m
        count += 1
        if p < 2 ** (BITS + 1):
            yield p


def _unit(m: int, p: int) -> int:
    """Find z of order m modulo p: z^(m/q) is not 1 for every prime factor q of m."""
    prime_factors = [int(q) for q, _ in fmpz(m).factor()]
    candidates = (pow(g, (p - 1) // m, p) for g in range(2, p))
    return next(z for z in candidates if all(pow(z, m // q, p) != 1 for q in prime_factors))


def _residue(x: Fraction, p: int) -> int:
    return x.numerator * (1 if x.denominator == 1 else pow(x.denominator, -1, p)) % p


def _claimed(claims: Sequence[tuple[Powers, int]], m: int, p: int) -> nmod_poly:
    """Return the product of (z - number)^multiplicity over all claims, modulo p."""
    unit = _unit(m, p)
    factors = []
    for (shift, terms), times in claims:
        value = _residue(shift, p) + sum(_residue(b, p) * pow(unit, int(t * m), p) for t, b in terms)
        factors.append(nmod_poly([-value % p, 1], p) ** times)
    return pairwise_product(factors, mul)


def _characteristic(graph: Matrix, p: int) -> nmod_poly:
    # Convert each distinct weight only once.
    residues: dict[Fraction, int] = {}
    entries = {(i, i): 0 for i in range(graph.n)}
    for row, column, number in graph.entries:
        value = residues.get(number)
        if value is None:
            value = residues[number] = _residue(number, p)
        entries[row, column] = value
    polynomial = sparse(graph.n, entries, lambda c: nmod_poly([x % p for x in c], p))
    if polynomial is not None:
        return polynomial
    flat = [0] * graph.n**2
    for (i, j), value in entries.items():
        flat[i * graph.n + j] = value
    return nmod_mat(graph.n, graph.n, flat, p).charpoly()


def _error_probability(graph: Matrix, claims: Sequence[tuple[Powers, int]], m: int) -> float:
    """Estimate the largest share of primes modulo which two different polynomials agree."""
    # Bound the coefficients by the largest eigenvalue: by row sums of |G|, and by the claimed numbers.
    parts = [x for (a, terms), _ in claims for x in (a, *(b for _, b in terms))]
    scale = lcm(*{x.denominator for x in (*parts, *(w for _, _, w in graph.entries))})
    rows = [0.0] * graph.n
    for row, _, number in graph.entries:
        rows[row] += abs(number.numerator) / number.denominator
    largest = max(*rows, *(float(abs(a) + sum(abs(b) for _, b in c)) for (a, c), _ in claims))
    units = int(fmpz(m).euler_phi())
    bad = units * (graph.n * log2(1 + scale * largest) + 1) / BITS
    # About 2**BITS / (units * log(prime)) primes of this size are 1 mod m.
    return bad * units * (BITS + 1) * log(2.0) / 2.0**BITS
