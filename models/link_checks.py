"""Checks of the name, the size and the links of a graph."""

from __future__ import annotations

from fractions import Fraction

from .expect import instance, whole
from .scene_checks import shown

__all__ = ["check_links"]


def check_links(name: object, n: object, links: object) -> None:
    """Raise TypeError or ValueError where links (target, source, weight) of n nodes are not sorted and sound."""
    what = f"topology {instance('topology name', name, str, 'text')}"
    size = whole(f"{what}: n", n, -(10**18))
    if size < 1:
        raise ValueError(f"{what}: n = {size}; expected at least one node")
    last = (-1, -1)
    for link in instance(f"{what}: links", links, tuple, "a tuple of (target, source, weight)"):
        last = _check(what, size, link, last)


def _check(what: str, n: int, link: object, last: tuple[int, int]) -> tuple[int, int]:
    """The two nodes of a link that comes after `last`."""
    match link:
        case (int() as target, int() as source, weight):
            pass
        case _:
            raise TypeError(f"{what}: found the link {shown(link)}; expected (target, source, weight)")
    if not (0 <= target < n and 0 <= source < n) or target == source:
        raise ValueError(f"{what}: link {target} <- {source}; expected two different nodes of 0 … {n - 1}")
    if (target, source) <= last:
        raise ValueError(
            f"{what}: link {target} <- {source} is repeated or out of order; "
            "expected each pair once, sorted: add the weights up and sort"
        )
    if not isinstance(weight, Fraction) or not weight:
        raise ValueError(
            f"{what}: link {target} <- {source} has weight {weight!r}; "
            "expected a Fraction other than 0: leave the link out or give it a weight"
        )
    return target, source
