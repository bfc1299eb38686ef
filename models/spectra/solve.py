"""Exact eigenvalues of a rational matrix, proved by its characteristic polynomial.

A graph may have a closed form of its spectrum from its family or operation.  The eigenvalues of any
other rational matrix are the roots of the irreducible factors of its exact characteristic polynomial
(python-flint), written as rationals, short real radicals, cosines of rational angles, or real and
complex algebraic numbers.

The proof computes the product of (z - eigenvalue) exactly.  Group the claimed numbers by their exact
minimal polynomials p.  If a group has deg p distinct numbers, all of one multiplicity m, the product of
its factors is p**m.  No floats are compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import StrEnum
from functools import lru_cache

import sympy as sp
from flint import fmpq_poly

from ..algebra.cosines import written
from ..algebra.lazy import LazyEigenvalues
from ..algebra.minimal_polynomials import minimal_polynomial, monic
from ..algebra.roots import Root, roots
from ..inputs.plugin_files import OwnFile
from .characteristic import characteristic
from .eigenvalue import Eigenvalue, Number, ProofError, distinct, ordered
from .jordan import blocks
from .matrix import Matrix
from .modular import check_modulo
from .spectrum import Spectrum

DENSE_LIMIT = 1000  # most rows of a matrix without a closed form; exact factorisation of larger matrices takes too long


class Proof(StrEnum):
    """Method by which a closed form is compared with the characteristic polynomial of its graph."""

    EXACT = "exact"  # Multiply the closed form out over the rationals
    MODULAR = "modular"  # Multiply the closed form out modulo three large primes (seconds for 1000 nodes)
    NONE = "none"

    @classmethod
    def of_size(cls, n: int, exact: int = 200, modular: int = 400) -> Proof:
        """Return the proof for n nodes: EXACT up to `exact` nodes, MODULAR up to `modular` nodes, else NONE."""
        return cls.EXACT if n <= exact else cls.MODULAR if n <= modular else cls.NONE


@lru_cache(maxsize=32)
def spectrum(graph: Matrix, proof: Proof | None = None) -> Spectrum:
    """Return the exact spectrum of a rational matrix."""
    try:
        pairs = graph.closed_form()
        if pairs is None:
            # The irreducible factors of the characteristic polynomial give the spectrum and its proof.
            if graph.n > DENSE_LIMIT:
                raise ValueError(
                    f"topology {graph.name}: n = {graph.n} without a closed form; expected at most {DENSE_LIMIT} "
                    "nodes: exact factors of larger matrices take too long"
                )
            polynomial = characteristic(graph)
            claims = []
            for factor, count in polynomial.factor()[1]:
                coefficients = tuple(int(c) for c in factor.numer().coeffs())
                jordan = blocks(graph, factor, count)
                claims += [Eigenvalue(number, count, jordan) for number in written(factor) or roots(coefficients)]
            return _proved(graph, claims, polynomial)
        proof = proof or Proof.of_size(graph.n)
        if proof is Proof.EXACT:
            return _proved(graph, [_with_blocks(graph, pair) for pair in pairs], characteristic(graph))
        error_probability = check_modulo(graph, pairs) if proof is Proof.MODULAR else None
        if isinstance(pairs, LazyEigenvalues):
            lazy = LazyEigenvalues(len(pairs), pairs.n, lambda k: _candidate(pairs[k], True))
            return Spectrum(lazy, error_probability=error_probability)
        simple = graph.diagonalisable
        candidates = [_candidate(pair, simple) for pair in pairs]
        return Spectrum(ordered(candidates), error_probability=error_probability)
    except ProofError as error:
        if isinstance(graph.name, OwnFile):
            raise ValueError(f"{graph.name.path}: {error}") from None
        raise


def has_closed_form(graph: Matrix) -> bool:
    return graph.closed_form() is not None


def _candidate(pair: tuple[sp.Expr, int], simple: bool) -> Eigenvalue:
    """Make an eigenvalue of a closed form; its Jordan blocks have size 1 if `simple`, else they are unknown."""
    return Eigenvalue(sp.sympify(pair[0]), pair[1], ((1, pair[1]),) if simple else None)


def _with_blocks(graph: Matrix, pair: tuple[sp.Expr, int]) -> Eigenvalue:
    number, count = sp.sympify(pair[0]), pair[1]
    if count == 1 or graph.diagonalisable:
        return _candidate(pair, graph.diagonalisable)
    return Eigenvalue(number, count, blocks(graph, minimal_polynomial(number), count))


def _proved(graph: Matrix, claims: Sequence[Eigenvalue], polynomial: fmpq_poly) -> Spectrum:
    """Return the spectrum if the eigenvalues multiply out to the polynomial; else raise ProofError."""
    check(claims, polynomial, f"{graph.name} {graph.n}")
    return Spectrum(ordered(claims), verified=True)


def check(claims: Iterable[Eigenvalue], characteristic: fmpq_poly, name: str) -> None:
    """Raise ProofError unless the product of (z - eigenvalue) is the exact characteristic polynomial."""
    # Group the eigenvalues by minimal polynomial: each group must contain all roots, with one multiplicity.
    groups: dict[tuple[int, ...], list[Eigenvalue]] = {}
    for claim in claims:
        groups.setdefault(_key(claim.number), []).append(claim)
    product = fmpq_poly([1])
    for coefficients, members in groups.items():
        factor = monic(coefficients)
        counts = {claim.multiplicity for claim in members}
        if len(members) != factor.degree() or len(counts) != 1 or not distinct(members):
            shown = ", ".join(str(claim) for claim in members[:4])
            raise ProofError(
                f"spectrum of {name}: {len(members)} eigenvalues ({shown}, …) of multiplicities "
                f"{sorted(counts)} have the minimal polynomial {factor}; expected {factor.degree()} distinct "
                "ones of one multiplicity: correct the closed form"
            )
        product *= factor ** counts.pop()
    if product != characteristic:
        raise ProofError(
            f"spectrum of {name}: the eigenvalues multiply out to a polynomial of degree {product.degree()}; "
            f"expected the characteristic one, of degree {characteristic.degree()}: correct the closed form"
        )


def _key(number: Number) -> tuple[int, ...]:
    """Return the minimal polynomial as coprime integer coefficients, the leading coefficient positive."""
    if isinstance(number, Root):
        return number.polynomial
    return tuple(int(c) for c in minimal_polynomial(number).numer().coeffs())
