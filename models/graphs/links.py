"""Checks of the name, the size and the links of a graph."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from ..inputs.checks import instance, printable, shown, whole

__all__ = ["Link", "check_links"]

LINK_LIMIT = 4_000_000
"""More links than this are not built: they take more than 600 MB."""


def check_links(name: object, n: object, links: object) -> None:
    """Raise TypeError or ValueError where links (target, source, weight) of n nodes are not sorted and sound."""
    what = f"topology {printable('topology name', instance('topology name', name, str, 'text'))}"
    size = whole(f"{what}: n", n, -(10**18))
    if size < 1:
        raise ValueError(f"{what}: n = {size}; expected at least one node")
    before = (-1, -1)
    for link in instance(f"{what}: links", links, tuple, "a tuple of (target, source, weight)"):
        if not isinstance(link, tuple) or len(link) != 3:
            raise TypeError(f"{what}: found the link {shown(link)}; expected (target, source, weight)")
        target, source, weight = link
        sound = type(target) is int and type(source) is int and type(weight) is Fraction and weight
        if not (sound and 0 <= target < size and 0 <= source < size and target != source and before < (target, source)):
            _refuse(what, size, before, link)
        before = (target, source)


def _refuse(what: str, n: int, before: tuple[int, int], link: tuple[Any, Any, Any]) -> None:
    """Raise TypeError or ValueError that says what is wrong with a link."""
    target, source, weight = link
    if not isinstance(target, int) or not isinstance(source, int):
        raise TypeError(f"{what}: found the link {shown(link)}; expected (target, source, weight)")
    if not (0 <= target < n and 0 <= source < n) or target == source:
        raise ValueError(f"{what}: link {target} <- {source}; expected two different nodes of 0 … {n - 1}")
    if (target, source) <= before:
        raise ValueError(
            f"{what}: link {target} <- {source} is repeated or out of order; "
            "expected each pair once, sorted: add the weights up and sort"
        )
    if not isinstance(weight, Fraction) or not weight:
        raise ValueError(
            f"{what}: link {target} <- {source} has weight {weight!r}; "
            "expected a Fraction other than 0: leave the link out or give it a weight"
        )


Link = tuple[int, int, Fraction]
"""(target, source, weight): node `target` feels node `source`; indices start at 0."""


def _few(name: str, n: int, links: int) -> None:
    if links > LINK_LIMIT:
        raise ValueError(
            f"topology {name}: n = {n} has too many links, {links} or more; expected at most {LINK_LIMIT}: reduce n"
        )
