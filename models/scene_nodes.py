"""Groups of nodes that are of another kind than the rest of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Any

from .plugins import load, named, part
from .scene_checks import integer, known_keys, shown, table

__all__ = ["Group", "by_kind", "default_friction", "groups"]

MOST = 100_000
"""Most nodes that groups may name."""


@dataclass(frozen=True, slots=True)
class Group:
    """Nodes `at` (numbers from 1) of an oscillator with its friction law."""

    oscillator: str
    friction: str | None
    at: tuple[int, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the group in the names of a scene file."""
        return {"oscillator": str(self.oscillator), "friction": str(self.friction or "none"), "at": list(self.at)}


def default_friction(oscillator: str, friction: object) -> str | None:
    """Return the name of a friction law: of "default" the one that an oscillator starts with, of "none" None."""
    if friction == "default":
        return "exponential" if load("oscillator", oscillator).FRICTION else None
    if friction is None or part("friction", friction) == "none":
        return None
    law = named("friction", part("friction", friction))
    load("friction", law)  # an unknown name is refused even where nothing uses it
    return law


def groups(given: object, n: int) -> tuple[Group, ...]:
    """Return the groups of a list of tables with `oscillator`, `friction` and `at`; ValueError or TypeError else."""
    if given is None:
        return ()
    if isinstance(given, str | bytes | Mapping) or not isinstance(given, Iterable):
        raise TypeError(f"nodes: found {shown(given)}; expected tables, e.g. [{{oscillator = 'duffing', at = [1, 3]}}]")
    found: list[Group] = []
    taken: set[int] = set()
    for k, entry in enumerate(islice(given, MOST)):
        group = entry if isinstance(entry, Group) else _group(f"nodes {k + 1}", entry, n)
        twice = sorted(taken & set(group.at))
        if twice:
            raise ValueError(f"nodes {k + 1}: node {twice[0]} is in another group too; expected each node once")
        if max(group.at) > n:
            raise ValueError(f"nodes {k + 1}: found node {max(group.at)}; expected nodes 1 to {n}")
        taken.update(group.at)
        found.append(group)
    return tuple(found)


def _group(what: str, given: object, n: int) -> Group:
    entry = table(what, given)
    known_keys(what, entry, ("oscillator", "friction", "at"))
    for key in ("oscillator", "at"):
        if key not in entry:
            raise ValueError(f"{what}: {key!r} is missing; expected an oscillator and the numbers of its nodes, at")
    oscillator = named("oscillator", part(f"{what} oscillator", entry["oscillator"]))
    at = entry["at"]
    if isinstance(at, str | bytes | Mapping | set | frozenset) or not isinstance(at, Iterable):
        raise TypeError(f"{what}: at is {shown(at)}; expected a list of nodes, e.g. [1, 3]")
    numbers = tuple(sorted(integer(f"{what}: at", i, 1, n) for i in islice(at, n + 1)))
    if not numbers or len(set(numbers)) < len(numbers):
        raise ValueError(f"{what}: at is {shown(list(numbers))}; expected at least one node and each node once")
    return Group(oscillator, default_friction(oscillator, entry.get("friction", "default")), numbers)


@lru_cache(maxsize=64)
def by_kind(
    oscillator: str, friction: str | None, nodes: tuple[Group, ...], n: int
) -> tuple[tuple[tuple[str, str | None], ...], tuple[int, ...]]:
    """Return (oscillator, friction law) of each kind, in the order of their first nodes, and the kind of each node.

    Where all nodes are of one kind the second is empty.
    """
    of: list[tuple[str, str | None]] = [(oscillator, friction)] * n
    for group in nodes:
        for i in group.at:
            of[i - 1] = (group.oscillator, group.friction)
    templates = tuple(dict.fromkeys(of))
    return templates, tuple(templates.index(pair) for pair in of) if len(templates) > 1 else ()
