"""Exact eigenvalues of a connectivity matrix with multiplicities, proved by its characteristic polynomial.

A closed form is used where the family or operation that made the graph has one; any other rational matrix goes
through its exact characteristic polynomial and the factors of that over the rationals (python-flint), whose roots are
written as rationals, short real radicals, cosines of rational angles, or real and complex algebraic numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import sympy as sp
from flint import fmpq_poly

from ..algebra.cosines import written
from ..algebra.lazy import Descending
from ..algebra.minimal_polynomials import minimal_polynomial
from ..algebra.roots import roots
from ..inputs.plugins import OwnFile
from .characteristic import characteristic
from .eigenvalue import Eigenvalue, ordered
from .jordan import blocks
from .matrix import Matrix
from .modular import check_modulo
from .proof import ProofError, check
from .spectrum import Spectrum, table

__all__ = ["Eigenvalue", "ProofError", "has_closed_form", "spectrum", "table"]

PROOF_LIMIT = 200
"""Up to so many nodes a closed form is proved when it is made; above only on request."""

CHECK_LIMIT = 400
"""Up to so many nodes it is multiplied out modulo primes, which takes about a second at most."""

DENSE_LIMIT = 1000
"""Largest matrix without a closed form."""


@lru_cache(maxsize=32)
def spectrum(graph: Matrix, prove: bool | Literal["primes"] | None = None) -> Spectrum:
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


def _found(graph: Matrix, prove: bool | Literal["primes"] | None) -> Spectrum:
    """The spectrum of a graph, by its closed form or by factors."""
    listed = graph.closed_form()
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


def has_closed_form(graph: Matrix) -> bool:
    """True where the eigenvalues of a graph are known without its characteristic polynomial."""
    return graph.closed_form() is not None


def _believed(graph: Matrix, listed: Sequence[tuple[sp.Expr, int]], chance: float | None) -> Spectrum:
    """The spectrum of a closed form that is not multiplied out over the rationals."""
    if isinstance(listed, Descending):
        return Spectrum(Descending(len(listed), listed.n, lambda k: _claim(listed[k], True)), chance=chance)
    simple = graph.undirected
    return Spectrum(ordered([_claim(pair, simple) for pair in listed]), chance=chance)


def _claim(pair: tuple[sp.Expr, int], simple: bool) -> Eigenvalue:
    return Eigenvalue(sp.sympify(pair[0]), pair[1], ((1, pair[1]),) if simple else None)


def _listed(graph: Matrix, pairs: Sequence[tuple[sp.Expr, int]]) -> list[Eigenvalue]:
    """The eigenvalues of a closed form with their Jordan blocks."""
    if graph.undirected:
        return [_claim(pair, True) for pair in pairs]
    numbers = [(sp.sympify(number), count) for number, count in pairs]
    return [
        Eigenvalue(number, count, None if count == 1 else blocks(graph, minimal_polynomial(number), count))
        for number, count in numbers
    ]


def _by_factors(graph: Matrix, polynomial: fmpq_poly) -> list[Eigenvalue]:
    """The roots of each irreducible factor of the characteristic polynomial."""
    claims = []
    for factor, count in polynomial.factor()[1]:
        whole = tuple(int(c) for c in factor.numer().coeffs())
        numbers = written(factor) or roots(whole)
        found = blocks(graph, factor, count)
        claims += [Eigenvalue(number, count, found) for number in numbers]
    return claims
