"""Spectra of matrices of rational functions: characteristic polynomial, irreducible factors, roots up to degree 2.

All results hold for generic symbols; for particular numbers eigenvalues may coincide.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from .eigenvalue import ProofError

Z = sp.Symbol("z")  # the variable of characteristic polynomials; no weight may have this name


@dataclass(frozen=True, slots=True)
class SymbolicSpectrum:
    """The monic characteristic polynomial in z and its irreducible factors with multiplicities, for generic symbols."""

    polynomial: sp.Poly
    factors: tuple[tuple[sp.Poly, int], ...]

    @property
    def eigenvalues(self) -> tuple[tuple[sp.Expr, int], ...]:
        """(root, multiplicity) for the roots of all factors of degree 1 and 2."""
        return tuple((root, count) for factor, count in self.factors for root in _roots(factor))

    @property
    def unsolved(self) -> tuple[tuple[sp.Poly, int], ...]:
        """The factors of higher degree."""
        return tuple((factor, count) for factor, count in self.factors if factor.degree() > 2)

    @property
    def text(self) -> str:
        rows = [f"characteristic polynomial: {sp.sstr(_product(self.factors))}"]
        rows += [f"  {sp.sstr(root)}{_often(count)}" for root, count in self.eigenvalues]
        rows += [f"  the roots of {sp.sstr(f.as_expr())}{_often(count)}" for f, count in self.unsolved]
        return "\n".join(rows)

    def as_dict(self) -> dict[str, object]:
        """Return the JSON of `synchain spectrum --symbolic --matrix FILE --json`."""
        return {
            "n": self.polynomial.degree(),
            "polynomial": sp.sstr(self.polynomial.as_expr()),
            "factors": [{"factor": sp.sstr(f.as_expr()), "multiplicity": count} for f, count in self.factors],
            "eigenvalues": [{"exact": sp.sstr(root), "multiplicity": count} for root, count in self.eigenvalues],
        }


def symbolic_spectrum(matrix: sp.ImmutableDenseMatrix, name: str) -> SymbolicSpectrum:
    """Compute and factor the characteristic polynomial of a matrix of rational functions."""
    over_field = DomainMatrix.from_Matrix(matrix)
    coefficients = [over_field.domain.to_sympy(c) for c in over_field.charpoly()]
    polynomial = sp.Poly(coefficients, Z)
    numerator = sp.numer(sp.together(polynomial.as_expr()))
    factors = [(sp.Poly(f, Z), count) for f, count in sp.factor_list(numerator)[1] if f.has(Z)]
    monic = tuple(
        (sp.Poly([sp.cancel(c / f.LC()) for c in f.all_coeffs()], Z), count)
        for f, count in sorted(factors, key=lambda f: (f[0].degree(), str(f[0])))
    )
    if sp.cancel(sp.expand(_product(monic)) - polynomial.as_expr()) != 0:
        raise ProofError(f"spectrum of {name}: the factors do not multiply to the characteristic polynomial")
    return SymbolicSpectrum(polynomial, monic)


def _roots(factor: sp.Poly) -> list[sp.Expr]:
    """Return the roots of a monic factor of degree 1 or 2; an empty list for a higher degree."""
    c = factor.all_coeffs()
    if len(c) == 2:
        return [-c[1]]
    if len(c) == 3:
        middle, root = -c[1] / 2, sp.sqrt(sp.factor(c[1] ** 2 / 4 - c[2]))
        return [middle + root, middle - root]
    return []


def _product(factors: Iterable[tuple[sp.Poly, int]]) -> sp.Expr:
    return sp.Mul(*(f.as_expr() ** count for f, count in factors))


def _often(count: int) -> str:
    return "" if count == 1 else f", {count} times"
