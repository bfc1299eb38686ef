"""A spectrum as a table of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .algebraic import ComplexRoot, RealRoot
from .eigenvalue import Eigenvalue, decimal

if TYPE_CHECKING:
    from .spectrum import Spectrum

__all__ = ["table"]


def table(found: Spectrum) -> str:
    """The spectrum as text: exact, decimal, multiplicity; long polynomials are cut short."""
    head = ("exact", "decimal", "multiplicity")
    lines = [(_short(e), decimal(e.value), str(e.multiplicity)) for e in found.eigenvalues]
    wide = [max(len(line[k]) for line in (head, *lines)) for k in range(3)]
    rows = [f"{a:<{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}" for a, b, c in (head, *lines)]
    state = "proved" if found.verified else "not proved (closed form of a large graph)"
    rows.append(f"{found.n} eigenvalues, {len(lines)} distinct; characteristic polynomial: {state}")
    return "\n".join(rows)


def _short(e: Eigenvalue) -> str:
    if len(e.text) <= 60 or not isinstance(e.number, (RealRoot, ComplexRoot)):
        return e.text
    return f"root {e.number.index} of a polynomial of degree {len(e.number.polynomial) - 1}"
