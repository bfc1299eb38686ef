"""Exact eigenvalues of a connectivity matrix with multiplicities, proved by its characteristic polynomial.

A closed form is used where the family or operation that made the graph has one; any other rational matrix goes
through its exact characteristic polynomial and the factors of that over the rationals (python-flint), whose roots are
written as rationals, short real radicals, cosines of rational angles, or real and complex algebraic numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from math import lcm
from typing import Any, Literal, overload

import sympy as sp
from flint import fmpq, fmpq_poly, fmpz_mat

from .algebraic import ComplexRoot, RealRoot, coefficient_text, roots
from .balls import precision
from .continuant import banded, cyclic
from .descending import Descending
from .eigenvalue import Eigenvalue, ordered
from .expect import instance
from .jordan import blocks, semisimple
from .modular import check_modulo
from .plugins import OwnFile
from .proof import ProofError, check, minimal_polynomial
from .radicals import written
from .spectrum_table import table
from .topology import Topology, family, names, topology

__all__ = ["Eigenvalue", "ProofError", "Spectrum", "characteristic", "has_closed_form", "spectrum", "table"]

PROOF_LIMIT = 200
"""Up to so many nodes a closed form is proved when it is made; above only on request."""

CHECK_LIMIT = 400
"""Up to so many nodes it is multiplied out modulo primes, which takes about a second at most."""

DENSE_LIMIT = 1000
"""Largest matrix without a closed form."""

SHOWN = 1000
"""The text of a spectrum leaves out the middle of more eigenvalues than this."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """The distinct eigenvalues from 0 downwards by real part, conjugates side by side.

    `verified` is True where the product of (z - γ)^multiplicity was multiplied out and found equal to the
    exact characteristic polynomial; False says that nobody did (a closed form of a large graph).  There
    `eigenvalues` of a chain or ring are made one by one as they are asked for; elsewhere they are a tuple.  `chance` is
    not None where the two were found equal modulo large primes: about the chance that this misses a difference.
    """

    eigenvalues: Sequence[Eigenvalue]
    verified: bool = False
    chance: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.eigenvalues, Descending):
            for e in instance("spectrum", self.eigenvalues, (tuple, list), "Eigenvalues; take the spectrum of a graph"):
                instance("spectrum", e, Eigenvalue, "an Eigenvalue; take the spectrum of a graph")
        if not self.eigenvalues:
            raise ValueError("a spectrum without eigenvalues; expected at least one")

    @property
    def n(self) -> int:
        """Number of eigenvalues, each counted as often as it occurs."""
        if isinstance(self.eigenvalues, Descending):
            return self.eigenvalues.n
        return sum(self.multiplicities)

    def __len__(self) -> int:
        return len(self.eigenvalues)

    @overload
    def __getitem__(self, place: int) -> Eigenvalue: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[Eigenvalue]: ...
    def __getitem__(self, place: int | slice) -> Eigenvalue | Sequence[Eigenvalue]:
        return self.eigenvalues[place]

    def __iter__(self) -> Iterator[Eigenvalue]:
        return iter(self.eigenvalues)

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
    def defective(self) -> tuple[Eigenvalue, ...]:
        """The eigenvalues that are known to have fewer eigenvectors than their multiplicity says."""
        return () if isinstance(self.eigenvalues, Descending) else tuple(e for e in self.eigenvalues if e.defective)

    @property
    def zeros(self) -> int:
        """How often 0 is an eigenvalue."""
        if isinstance(self.eigenvalues, Descending):  # 0 is the first
            return self.eigenvalues[0].multiplicity
        return sum(e.multiplicity for e in self.eigenvalues if e.number is sp.S.Zero)

    @property
    def largest(self) -> sp.Expr:
        """The eigenvalue of largest modulus; of several, the first in the order of the spectrum."""
        if isinstance(self.eigenvalues, Descending):  # all real, none positive
            return self.eigenvalues[-1].exact
        return _farthest(self.eigenvalues, 1)

    @property
    def slowest(self) -> sp.Expr:
        """The eigenvalue other than 0 of smallest modulus, the first of several; ValueError where all are 0."""
        lazy = isinstance(self.eigenvalues, Descending)
        others = self.eigenvalues[1:2] if lazy else self.nonzero
        if not others:
            raise ValueError("all eigenvalues are 0; expected a graph with links")
        return others[0].exact if lazy else _farthest(others, -1)

    def evaluate(self, digits: int) -> tuple[sp.Expr, ...]:
        """The distinct eigenvalues as SymPy Floats, each within one unit of the last of `digits` digits."""
        return tuple(e.evaluate(digits) for e in self.eigenvalues)

    def as_dict(self) -> dict[str, Any]:
        """What `synchain spectrum --json` prints; a complex value is [real, imaginary].

        Each polynomial is written once; an eigenvalue that is given by one has its number and its own index as CRootOf.
        """
        numbers: dict[tuple[int, ...], int] = {}
        listed = []
        for e in self.eigenvalues:
            number, index, exact = None, None, None
            if isinstance(e.number, (RealRoot, ComplexRoot)):
                number, index = numbers.setdefault(e.number.polynomial, len(numbers)), e.number.index
                exact = f"CRootOf(p{number}, {index})"
            listed.append(
                {
                    "exact": exact or e.text,
                    "polynomial": number,
                    "index": index,
                    "value": [e.value.real, e.value.imag] if isinstance(e.value, complex) else e.value,
                    "multiplicity": e.multiplicity,
                    "geometric_multiplicity": e.geometric,
                    "jordan_blocks": None if e.blocks is None else [list(block) for block in e.blocks],
                }
            )
        polynomials = [[coefficient_text(c) for c in polynomial] for polynomial in numbers]
        return {
            "n": self.n,
            "polynomials": polynomials,
            "eigenvalues": listed,
            "verified": self.verified,
            "chance": self.chance,
        }

    def __repr__(self) -> str:
        many = len(self) > SHOWN
        shown = [f"{e}: {e.multiplicity}" for e in (self.eigenvalues[: SHOWN - 1] if many else self.eigenvalues)]
        last = [f"… ({len(self) - SHOWN} more)", f"{self[-1]}: {self[-1].multiplicity}"] if many else []
        return "{" + ", ".join(shown + last) + "}"


def _farthest(eigenvalues: Sequence[Eigenvalue], way: int) -> sp.Expr:
    """The eigenvalue of largest modulus, of smallest where `way` is -1; the first of those that 1024 bits hold equal."""
    top = max(way * abs(e.value) for e in eigenvalues)
    bound = top - 1e-12 * abs(top)
    best, bits = [e for e in eigenvalues if not way * abs(e.value) < bound], 64  # of infinite floats, all
    while len(best) > 1 and bits <= 1024:
        with precision(bits + 64):
            sizes = [way * abs(e.enclosure(bits)) for e in best]
            first = reduce(lambda a, b: b if b > a else a, sizes)
            best = [e for e, size in zip(best, sizes, strict=True) if not size < first]
        bits *= 4
    return best[0].exact


@lru_cache(maxsize=32)
def spectrum(graph: Topology, prove: bool | Literal["primes"] | None = None) -> Spectrum:
    """The exact spectrum of a graph's connectivity matrix.

    It proves itself; a closed form with more than PROOF_LIMIT nodes does so only where `prove` is True.  Up to CHECK_LIMIT
    nodes, and where `prove` is "primes", it is multiplied out modulo three large primes instead (1000 nodes: seconds).
    Raises ValueError on more than DENSE_LIMIT nodes without a closed form and where the closed form of a file outside
    the package is wrong, ProofError where another proof fails.
    """
    try:
        return _found(graph, prove)
    except ProofError as error:
        if isinstance(graph.name, OwnFile):
            raise ValueError(f"{graph.name.place}: {error}") from None
        raise


def _found(graph: Topology, prove: bool | Literal["primes"] | None) -> Spectrum:
    """The spectrum of a graph, by its closed form or by factors."""
    listed = _closed_form(graph)
    if prove is None:
        prove = graph.n <= PROOF_LIMIT or ("primes" if graph.n <= CHECK_LIMIT else False)
    if listed is not None and prove is not True:
        return _believed(graph, listed, check_modulo(graph, listed) if prove == "primes" else None)
    if listed is None and graph.n > DENSE_LIMIT:
        raise ValueError(
            f"topology {graph.name}: n = {graph.n} without a closed form; expected at most {DENSE_LIMIT} "
            "nodes: exact factors of larger matrices take too long"
        )
    polynomial = characteristic(graph)
    claims = _by_factors(graph, polynomial) if listed is None else _listed(graph, listed)
    check(claims, polynomial, f"{graph.name} {graph.n}")
    return Spectrum(ordered(claims), verified=True)


def characteristic(graph: Topology) -> fmpq_poly:
    """The exact characteristic polynomial det(z - G)."""
    scale = lcm(*(weight.denominator for _, _, weight in graph.links))
    entries = {(i, i): 0 for i in range(graph.n)}
    for target, source, weight in graph.links:
        whole = weight.numerator * (scale // weight.denominator)
        entries[target, source] = whole
        entries[target, target] -= whole
    if banded(graph.n, entries):
        found = fmpq_poly(cyclic(graph.n, entries))
    else:
        rows = [[entries.get((i, j), 0) for j in range(graph.n)] for i in range(graph.n)]
        found = fmpq_poly(fmpz_mat(rows).charpoly())
    return found if scale == 1 else found(fmpq_poly([0, scale])) / fmpq(scale) ** graph.n


def _closed_form(graph: Topology) -> Sequence[tuple[sp.Expr, int]] | None:
    """The eigenvalues that the graph's rule gives, or its family where the graph is really of that family."""
    if graph.rule is not None:
        return graph.rule()
    if graph.name not in names() or not hasattr(family(graph.name), "spectrum"):
        return None
    if graph.n < family(graph.name).MINIMUM:
        return None
    try:
        made = topology(graph.name, graph.n, **dict(graph.options))
    except ValueError:
        return None
    return made.rule() if made.rule is not None and made.links == graph.links else None


def has_closed_form(graph: Topology) -> bool:
    """True where the eigenvalues of a graph are known without its characteristic polynomial."""
    return _closed_form(graph) is not None


def _believed(graph: Topology, listed: Sequence[tuple[sp.Expr, int]], chance: float | None) -> Spectrum:
    """The spectrum of a closed form that is not multiplied out over the rationals."""
    if isinstance(listed, Descending):
        return Spectrum(Descending(len(listed), listed.n, lambda k: _claim(listed[k], True)), chance=chance)
    simple = semisimple(graph)
    return Spectrum(ordered([_claim(pair, simple) for pair in listed]), chance=chance)


def _claim(pair: tuple[sp.Expr, int], simple: bool) -> Eigenvalue:
    return Eigenvalue(sp.sympify(pair[0]), pair[1], ((1, pair[1]),) if simple else None)


def _listed(graph: Topology, pairs: Sequence[tuple[sp.Expr, int]]) -> list[Eigenvalue]:
    """The eigenvalues of a closed form with their Jordan blocks."""
    if semisimple(graph):
        return [_claim(pair, True) for pair in pairs]
    numbers = [(sp.sympify(number), count) for number, count in pairs]
    return [
        Eigenvalue(number, count, None if count == 1 else blocks(graph, minimal_polynomial(number), count))
        for number, count in numbers
    ]


def _by_factors(graph: Topology, polynomial: fmpq_poly) -> list[Eigenvalue]:
    """The roots of each irreducible factor of the characteristic polynomial."""
    claims = []
    for factor, count in polynomial.factor()[1]:
        whole = tuple(int(c) for c in factor.numer().coeffs())
        numbers = written(factor) or roots(whole)
        found = blocks(graph, factor, count)
        claims += [Eigenvalue(number, count, found) for number in numbers]
    return claims
