"""Couplings given by the entries of a matrix H: "y->x" lets the difference of y between two nodes enter the rate of x.

A link of weight w from node j to node i adds sigma w H (s_j - s_i) to the rates of the states s_i, so the entry
"1/2 y->x" is 1/2 in the row of x and the column of y.  H is the matrix of the master stability function (Pecora & Carroll,
Phys. Rev. Lett. 80, 2109 (1998)).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction

from .parameter import Parameter
from .scene_checks import shown, suggestion, text

__all__ = ["PARAMETERS", "canonical", "entries", "is_matrix"]

PARAMETERS = {"sigma": Parameter(0.0, "1", "strength of the coupling")}
"""The parameters of every such coupling; sigma may be negative."""

_NUMBER = r"[0-9]{1,9}(?:/[0-9]{1,9}|\.[0-9]{1,9})?"
_NAME = r"[^\W\d]\w*"
_ENTRY = re.compile(rf"\s*([+-]?)\s*(?:({_NUMBER})\s*\*?\s*)?({_NAME})\s*->\s*({_NAME})\s*")
_EXPECTED = "expected 'a->b', the difference of a into the rate of b, with a rational factor or none: '1/2 x->y'"


def is_matrix(coupling: str) -> bool:
    """Return True where the name of a coupling is a text of entries such as "x->x, 1/2 y->z"."""
    return "->" in coupling


def entries(coupling: str, state: tuple[str, ...] | None = None) -> dict[tuple[str, str], Fraction]:
    """Return (from component, into the rate of component) -> factor, in the order of the text.

    Raises ValueError where the text is no list of entries, an entry repeats or has the factor 0, and for components
    outside `state`, the names of a node's states, where these are given.
    """
    found: dict[tuple[str, str], Fraction] = {}
    for source, target, factor in _read(coupling):
        for name in (source, target):
            if state is not None and name not in state:
                raise ValueError(
                    f"coupling {shown(coupling)}: unknown component {shown(name)}; known: {', '.join(state)}"
                    f"{suggestion(name, state) or '; name states of the oscillator'}"
                )
        if (source, target) in found:
            raise ValueError(
                f"coupling {shown(coupling)}: '{source}->{target}' occurs twice; expected each entry once; add the factors"
            )
        found[source, target] = factor
    return found


def canonical(coupling: str, state: tuple[str, ...]) -> str:
    """Return the same coupling in one spelling: reduced fractions, entries ordered by target and source as in `state`.

    Raises ValueError as `entries` does, and where the result is too long for a scene.
    """
    found = entries(coupling, state)
    order = sorted(found, key=lambda pair: (state.index(pair[1]), state.index(pair[0])))
    return text("coupling", ", ".join(f"{_front(found[pair])}{pair[0]}->{pair[1]}" for pair in order))


def _read(coupling: str) -> Iterator[tuple[str, str, Fraction]]:
    for part in coupling.split(","):
        match = _ENTRY.fullmatch(part)
        if match is None:
            raise ValueError(f"coupling {shown(coupling)}: cannot read {shown(part.strip())}; {_EXPECTED}; correct it")
        sign, number, source, target = match.groups()
        try:
            factor = Fraction(number or 1) * (-1 if sign == "-" else 1)
        except ZeroDivisionError:
            raise ValueError(f"coupling {shown(coupling)}: {number} divides by zero; {_EXPECTED}; correct it") from None
        if factor == 0:
            raise ValueError(
                f"coupling {shown(coupling)}: the factor of '{source}->{target}' is 0; expected another; leave it out"
            )
        yield source, target, factor


def _front(factor: Fraction) -> str:
    """A factor as it stands before its entry: nothing for 1, a sign alone for -1."""
    if abs(factor) == 1:
        return "" if factor > 0 else "-"
    return f"{factor} "
