"""Couplings given by the entries of a matrix H: "y->x" lets the difference of y between two nodes enter the rate of x.

A link of weight w from node j to node i adds sigma w H (s_j - s_i) to the rates of the states s_i, so the entry
"1/2 y->x" is 1/2 in the row of x and the column of y.  H is the matrix of the master stability function (Pecora & Carroll,
Phys. Rev. Lett. 80, 2109 (1998)).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction

from ..inputs import plugins
from ..inputs.checks import shown, suggestion, text
from .definition import COUPLING
from .parameter import Parameter

__all__ = [
    "PARAMETERS",
    "canonical",
    "canonical_coordinates",
    "coordinates_of",
    "entries",
    "is_matrix",
    "named",
    "split",
]

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


_CHOSEN = re.compile(r"(?P<name>\S.*?)\s+on\s+(?P<coordinates>[^\W\d]\w*(?:\s*,\s*[^\W\d]\w*)*)\s*")


def split(coupling: str) -> tuple[str, tuple[str, ...] | None]:
    """Return the name of the coupling's file and the coordinates that it was given, None for all of them."""
    match = _CHOSEN.fullmatch(coupling)
    if match is None:
        return coupling, None
    return _spelt(coupling, match["name"]), tuple(part.strip() for part in match["coordinates"].split(","))


def named(coupling: str) -> str:
    """Return the coupling as scenes keep it, see `plugins.named`; ValueError where its file cannot be loaded."""
    if is_matrix(coupling):
        return coupling
    own = plugins.named(COUPLING, split(coupling)[0])
    return _spelt(own, coupling)


def _spelt(coupling: str, name: str) -> str:
    """A part of the text of a coupling, or more of it: of the same file where it is one."""
    return coupling.spelt(name) if isinstance(coupling, plugins.OwnFile) else name


def coordinates_of(coupling: str, known: tuple[str, ...]) -> tuple[int, ...]:
    """Return the numbers of the coordinates that a coupling joins, out of those of a node, in ascending order.

    Raises ValueError for an unknown coordinate and for one that is named twice.
    """
    _, chosen = split(coupling)
    if chosen is None:
        return tuple(range(len(known)))
    if not known:
        raise ValueError(
            f"coupling {shown(coupling)}: found oscillators without coordinates, which are vector fields; expected "
            "a coupling by components, e.g. 'x->x'"
        )
    for name in chosen:
        if name not in known:
            raise ValueError(
                f"coupling {shown(coupling)}: unknown coordinate {shown(name)}; known: {', '.join(known)}"
                f"{suggestion(name, known) or '; name coordinates of the oscillator'}"
            )
    if len(set(chosen)) < len(chosen):
        raise ValueError(f"coupling {shown(coupling)}: found a coordinate twice; expected each once; leave one out")
    return tuple(k for k, name in enumerate(known) if name in chosen)


def canonical_coordinates(coupling: str, known: tuple[str, ...]) -> str:
    """Return the same coupling in one spelling: coordinates in the order of the node, none where it joins them all.

    Raises ValueError as `coordinates_of` does.
    """
    chosen = coordinates_of(coupling, known)
    name = split(coupling)[0]
    return name if len(chosen) == len(known) else _spelt(name, f"{name} on {', '.join(known[k] for k in chosen)}")
