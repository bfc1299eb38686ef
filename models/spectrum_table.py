"""A spectrum as a table of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .algebraic import ComplexRoot, RealRoot
from .eigenvalue import Eigenvalue, decimal

if TYPE_CHECKING:
    from .spectrum import Spectrum

__all__ = ["table"]


def table(found: Spectrum, limit: int | None = None) -> str:
    """The spectrum as text: exact, decimal, multiplicity; long polynomials are cut short.

    Of more than `limit` distinct eigenvalues the first and the last are shown, `limit` in all.
    """
    head = ("exact", "decimal", "multiplicity")
    many = limit is not None and len(found) > limit
    half = (limit or 0) // 2
    shown = [*found[:half], *found[len(found) - half :]] if many else list(found.eigenvalues)
    lines = [(_short(e), decimal(e.value), str(e.multiplicity)) for e in shown]
    wide = [max(len(line[k]) for line in (head, *lines)) for k in range(3)]
    rows = [f"{a:<{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}" for a, b, c in (head, *lines)]
    if found.defective:
        words = ("Jordan blocks", *(_blocks(e) for e in shown))
        rows = [f"{row}  {word}" for row, word in zip(rows, words, strict=True)]
    if many:
        rows.insert(half + 1, f"… ({len(found) - 2 * half} more)")
    state = "proved" if found.verified else "not proved (closed form of a large graph)"
    if found.chance is not None:
        state = f"the same modulo three large primes (a difference would show but for a chance of {found.chance:.0e})"
    rows.append(f"{found.n} eigenvalues, {len(found)} distinct; characteristic polynomial: {state}")
    if found.defective:
        rows.append(
            "defective: of a block of size s, errors go as t^(s-1) exp(lambda t), lambda the exponent of its mode"
        )
    return "\n".join(rows)


def _blocks(e: Eigenvalue) -> str:
    """Sizes of blocks, as 3, 1 (2 times)."""
    if e.blocks is None:
        return "not computed"
    return ", ".join(f"{size}" if times == 1 else f"{size} ({times} times)" for size, times in e.blocks)


def _short(e: Eigenvalue) -> str:
    if len(e.text) <= 60 or not isinstance(e.number, (RealRoot, ComplexRoot)):
        return e.text
    return f"root {e.number.index} of a polynomial of degree {len(e.number.polynomial) - 1}"
