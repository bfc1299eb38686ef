"""Which coordinates a coupling joins: "spring on x" joins x alone, "spring on x, y" both, "spring" every coordinate."""

from __future__ import annotations

import re

from . import plugins
from .coupling_matrix import is_matrix
from .scene_checks import shown, suggestion

__all__ = ["canonical", "coordinates_of", "named", "split"]

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
    own = plugins.named("coupling", split(coupling)[0])
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


def canonical(coupling: str, known: tuple[str, ...]) -> str:
    """Return the same coupling in one spelling: coordinates in the order of the node, none where it joins them all.

    Raises ValueError as `coordinates_of` does.
    """
    chosen = coordinates_of(coupling, known)
    name = split(coupling)[0]
    return name if len(chosen) == len(known) else _spelt(name, f"{name} on {', '.join(known[k] for k in chosen)}")
