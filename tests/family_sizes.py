"""Which numbers of nodes the families of graphs have, written down apart from their files."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from synchain.models.graphs.families import family, names

RESTRICTED: dict[str, Callable[[int], bool]] = {
    "cayley_dihedral": lambda n: n % 2 == 0,
    "circular_ladder": lambda n: n % 2 == 0,
    "hamming": lambda n: n in (1, 4, 9, 16, 25, 36, 49, 64),
    "johnson": lambda n: n in (1, 3, 6, 10, 15, 21, 28, 36, 45, 55),
    "kneser": lambda n: n in (6, 10, 15, 21, 28, 36, 45, 55),
    "paley": lambda n: n in (5, 9, 13, 17, 25, 29, 37, 41, 49, 53),
    "petersen": lambda n: n % 2 == 0,
}
"""Families that have not all numbers of nodes from their smallest on, with their default options, up to 55 nodes."""


def has(name: str, n: int) -> bool:
    """True if a family has a graph of n nodes."""
    return n >= family(name).minimum and (name not in RESTRICTED or RESTRICTED[name](n))


def sizes(name: str, wanted: Iterable[int]) -> list[int]:
    """Those of some numbers of nodes that a family has."""
    return [n for n in wanted if has(name, n)]


def size(name: str, n: int) -> int:
    """The smallest number of nodes of a family that is n or more."""
    return next(m for m in range(n, n + 30) if has(name, m))


def cases(*wanted: int) -> list[tuple[str, int]]:
    """Each family with the smallest sizes that are these or more, each once."""
    return [(name, n) for name in names() for n in sorted({size(name, n) for n in wanted})]
