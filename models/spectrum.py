"""Exact eigenvalues of a connectivity matrix with multiplicities, proved by its characteristic polynomial.

A family's closed form is used where its file has one; any other rational matrix goes through its exact
characteristic polynomial and the factors of that over the rationals (python-flint), whose roots are written
as rationals, short real radicals, cosines of rational angles, or real and complex algebraic numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache, reduce
from typing import Any

import sympy as sp
from flint import fmpq, fmpq_mat, fmpq_poly

from . import angles
from .algebraic import ComplexRoot, RealRoot, approximate, complex_roots, real_roots
from .balls import Ball, accurate, decimals, enclose, nearest, precision
from .proof import ProofError, check, distinct
from .topology import Topology, family, names, topology

__all__ = ["Eigenvalue", "ProofError", "Spectrum", "spectrum", "table"]

PROOF_LIMIT = 200
"""Up to so many nodes a closed form is proved when it is made; above only on request."""

DENSE_LIMIT = 1000
"""Largest matrix without a closed form."""


@dataclass(frozen=True, slots=True)
class Eigenvalue:
    """An exact number with its algebraic multiplicity.

    `number` is a SymPy expression or an algebraic number that is not written as radicals; `value` is the
    nearest float, or complex.
    """

    number: sp.Expr | RealRoot | ComplexRoot
    multiplicity: int
    value: float | complex = field(init=False, compare=False)

    def __post_init__(self) -> None:
        count = self.multiplicity
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise ValueError(f"eigenvalue {self.text}: multiplicity {count!r}; expected an integer >= 1")
        object.__setattr__(self, "value", nearest(self._ball))

    @property
    def exact(self) -> sp.Expr:
        """The number as a SymPy expression (CRootOf where no shorter form is known)."""
        return self.number.expression if isinstance(self.number, (RealRoot, ComplexRoot)) else self.number

    @property
    def text(self) -> str:
        """The exact number as text that SymPy reads back."""
        return self.number.text if isinstance(self.number, (RealRoot, ComplexRoot)) else sp.sstr(self.number)

    def enclosure(self, bits: int) -> Ball:
        """A certified ball (flint.arb or flint.acb) of radius below 2**-bits times the modulus."""
        return accurate(self._ball, bits)

    def evaluate(self, digits: int) -> sp.Expr:
        """The value as a SymPy Float, within one unit of the last of `digits` significant digits."""
        if isinstance(digits, bool) or not isinstance(digits, int) or digits < 1:
            raise ValueError(f"digits = {digits!r}; expected a positive integer")
        return decimals(self._ball, digits)

    def _ball(self, bits: int) -> Ball:
        if isinstance(self.number, (RealRoot, ComplexRoot)):
            return self.number.enclosure(bits)
        return enclose(self.number, bits)

    def __str__(self) -> str:
        text = self.text
        if len(text) <= 60 or not isinstance(self.number, (RealRoot, ComplexRoot)):
            return text
        return f"{_decimal(self.value)} (degree {len(self.number.polynomial) - 1})"


@dataclass(frozen=True, slots=True)
class Spectrum:
    """The distinct eigenvalues from 0 downwards by real part, conjugates side by side.

    `verified` is True where the product of (z - γ)^multiplicity was multiplied out and found equal to the
    exact characteristic polynomial; False says that nobody looked (a closed form above PROOF_LIMIT nodes).
    """

    eigenvalues: tuple[Eigenvalue, ...]
    verified: bool = False

    def __post_init__(self) -> None:
        if not self.eigenvalues:
            raise ValueError("a spectrum without eigenvalues; expected at least one")

    @property
    def n(self) -> int:
        """Number of eigenvalues, each counted as often as it occurs."""
        return sum(self.multiplicities)

    @property
    def exact(self) -> tuple[sp.Expr, ...]:
        """The distinct eigenvalues as SymPy expressions."""
        return tuple(e.exact for e in self.eigenvalues)

    @property
    def values(self) -> tuple[float | complex, ...]:
        """The distinct eigenvalues as nearest floats, complex where they are complex."""
        return tuple(e.value for e in self.eigenvalues)

    @property
    def multiplicities(self) -> tuple[int, ...]:
        """How often each distinct eigenvalue occurs (algebraic multiplicity)."""
        return tuple(e.multiplicity for e in self.eigenvalues)

    @property
    def nonzero(self) -> tuple[Eigenvalue, ...]:
        """The eigenvalues other than 0: the transverse modes of a connected graph."""
        return tuple(e for e in self.eigenvalues if e.number is not sp.S.Zero)

    @property
    def largest(self) -> sp.Expr:
        """The eigenvalue of largest modulus; of several, the first in the order of the spectrum."""
        near = max(abs(value) for value in self.values) * (1 - 1e-12)
        best, bits = [e for e in self.eigenvalues if abs(e.value) >= near], 64
        while len(best) > 1 and bits <= 1024:
            with precision(bits + 64):
                sizes = [abs(e.enclosure(bits)) for e in best]
                top = reduce(lambda a, b: b if b > a else a, sizes)
                best = [e for e, size in zip(best, sizes, strict=True) if not size < top]
            bits *= 4
        return best[0].exact

    def evaluate(self, digits: int) -> tuple[sp.Expr, ...]:
        """The distinct eigenvalues as SymPy Floats, each within one unit of the last of `digits` digits."""
        return tuple(e.evaluate(digits) for e in self.eigenvalues)

    def as_dict(self) -> dict[str, Any]:
        """What `synchain spectrum --json` prints; a complex value is [real, imaginary]."""
        listed = [
            {
                "exact": e.text,
                "value": [e.value.real, e.value.imag] if isinstance(e.value, complex) else e.value,
                "multiplicity": e.multiplicity,
            }
            for e in self.eigenvalues
        ]
        return {"n": self.n, "eigenvalues": listed, "verified": self.verified}

    def __repr__(self) -> str:
        return "{" + ", ".join(f"{e}: {e.multiplicity}" for e in self.eigenvalues) + "}"


@lru_cache(maxsize=32)
def spectrum(graph: Topology, prove: bool | None = None) -> Spectrum:
    """The exact spectrum of a graph's connectivity matrix.

    It proves itself; a closed form with more than PROOF_LIMIT nodes does so only where `prove` is True.
    Raises ProofError where the proof fails, ValueError on more than DENSE_LIMIT nodes without a closed form.
    """
    claims = _closed_form(graph)
    if claims is not None and not (graph.n <= PROOF_LIMIT if prove is None else prove):
        return Spectrum(_ordered(claims))
    if claims is None and graph.n > DENSE_LIMIT:
        raise ValueError(
            f"topology {graph.name}: n = {graph.n} without a closed form; expected at most {DENSE_LIMIT} "
            "nodes: exact factors of larger matrices take too long"
        )
    characteristic = fmpq_mat([[_exact(x) for x in row] for row in graph.rows]).charpoly()
    if claims is None:
        claims = _by_factors(graph, characteristic)
    check(claims, characteristic, f"{graph.name} {graph.n}")
    return Spectrum(_ordered(claims), verified=True)


def _closed_form(graph: Topology) -> list[Eigenvalue] | None:
    """The eigenvalues that the family's file gives, where it does and the graph is really of that family."""
    if graph.name not in names() or not hasattr(family(graph.name), "spectrum"):
        return None
    if graph.n < family(graph.name).MINIMUM or topology(graph.name, graph.n).links != graph.links:
        return None
    return [Eigenvalue(sp.sympify(number), count) for number, count in family(graph.name).spectrum(graph.n)]


def _by_factors(graph: Topology, characteristic: fmpq_poly) -> list[Eigenvalue]:
    """The roots of each irreducible factor of the characteristic polynomial."""
    hints: dict[int, Sequence[fmpq]] = {}

    def isolate(polynomial: tuple[int, ...]) -> Sequence[RealRoot | ComplexRoot]:
        for bits in (64, 128, 512) if graph.symmetric else ():
            if bits not in hints:
                hints[bits] = approximate(graph.rows, bits)
            found = real_roots(polynomial, hints[bits])
            if found is not None:
                return found
        return complex_roots(polynomial)

    claims = []
    for factor, count in characteristic.factor()[1]:
        numbers = _written(factor) or isolate(tuple(int(c) for c in factor.numer().coeffs()))
        claims += [Eigenvalue(number, count) for number in numbers]
    return claims


def _written(factor: fmpq_poly) -> list[sp.Expr] | None:
    """The roots of an irreducible polynomial in closed form, where a short one is known."""
    monic = factor / factor[factor.degree()]
    c = [sp.Rational(int(x.p), int(x.q)) for x in monic.coeffs()]
    if len(c) == 2:
        return [-c[0]]
    if len(c) == 3:
        root = sp.sqrt(c[1] ** 2 / 4 - c[0])
        return [sp.expand(-c[1] / 2 + root), sp.expand(-c[1] / 2 - root)]
    quartic = _biquadratic(monic) if len(c) == 5 else None
    return angles.cosine_roots(monic) or quartic or angles.exponential_roots(monic)


def _biquadratic(monic: fmpq_poly) -> list[sp.Expr] | None:
    """Real nested roots a ± sqrt(b ± sqrt(c)), or a ± sqrt(b) ± sqrt(c), of a quartic that has them."""
    shift = monic[3] / 4
    even = monic(fmpq_poly([-shift, 1]))
    p, q, discriminant = even[2], even[0], even[2] ** 2 - 4 * even[0]
    if even[1] != 0 or discriminant < 0 or p > 0 or q < 0:
        return None
    a, b, c = (sp.Rational(int(x.p), int(x.q)) for x in (-shift, -p / 2, discriminant / 4))
    product = sp.sqrt(sp.Rational(int(q.p), int(q.q)))
    if product.is_Rational:
        parts = [sp.sqrt((b + product) / 2), sp.sqrt((b - product) / 2)]
        roots = [a + s * parts[0] + t * parts[1] for s in (1, -1) for t in (1, -1)]
    else:
        roots = [a + s * sp.sqrt(b + t * sp.sqrt(c)) for s in (1, -1) for t in (1, -1)]
    return roots if all(len(sp.sstr(root)) <= 60 for root in roots) else None


def _ordered(claims: Sequence[Eigenvalue]) -> tuple[Eigenvalue, ...]:
    """From 0 downwards by real part; reals compared by certified balls, conjugates side by side."""
    if any(isinstance(e.value, complex) for e in claims):
        return tuple(sorted(claims, key=_complex_key))
    if len({e.value for e in claims}) == len(claims):
        return tuple(sorted(claims, key=lambda e: e.value.real, reverse=True))
    if not distinct(claims):
        raise ProofError(f"two of {len(claims)} eigenvalues coincide; expected distinct ones")
    return tuple(sorted(claims, key=_midpoint, reverse=True))


def _complex_key(e: Eigenvalue) -> tuple[float, float, float]:
    return -round(e.value.real, 12), abs(e.value.imag), e.value.imag


def _midpoint(e: Eigenvalue) -> fmpq:
    mantissa, exponent = e.enclosure(4200).mid().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def _exact(x: Fraction) -> fmpq:
    return fmpq(x.numerator, x.denominator)


def table(found: Spectrum) -> str:
    """The spectrum as text: exact, decimal, multiplicity; long polynomials are cut short."""
    head = ("exact", "decimal", "multiplicity")
    lines = [(_short(e), _decimal(e.value), str(e.multiplicity)) for e in found.eigenvalues]
    wide = [max(len(line[k]) for line in (head, *lines)) for k in range(3)]
    rows = [f"{a:<{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}" for a, b, c in (head, *lines)]
    state = "proved" if found.verified else "not proved (closed form of a large graph)"
    rows.append(f"{found.n} eigenvalues, {len(lines)} distinct; characteristic polynomial: {state}")
    return "\n".join(rows)


def _short(e: Eigenvalue) -> str:
    if len(e.text) <= 60 or not isinstance(e.number, (RealRoot, ComplexRoot)):
        return e.text
    return f"root {e.number.index} of a polynomial of degree {len(e.number.polynomial) - 1}"


def _decimal(value: float | complex) -> str:
    if isinstance(value, complex):
        return f"{value.real:.15g} {'-' if value.imag < 0 else '+'} {abs(value.imag):.15g}i"
    return f"{value:.16g}"
