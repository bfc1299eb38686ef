"""Links with a direction along which they are drawn: springs that are stiffer in tension than in compression.

A coupling whose energy changes where its two ends are exchanged, V(q_i, q_j) other than V(q_j, q_i), needs to know at
which end of a link node i is.  Its links carry that as the sign of their weight W, seen from the target: W = 1 where the
link runs from the target to the source, W = -1 where it runs from the source to the target.  The energy of the link is
then W^2 V_even + W V_odd, the parts of V that keep and that change their sign in the exchange.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import sympy as sp

from .equations import Edge, Link
from .plugins import call
from .topology import Topology

__all__ = ["drawn", "is_oriented", "link_energy"]


def link_energy(
    function: Callable[..., Any], ends: Mapping[str, sp.Symbol], weight: sp.Symbol, given: Mapping[str, sp.Symbol]
) -> sp.Expr:
    """Return the energy (or Rayleigh function) of one link; `ends` names its two ends, target first."""
    first, second = ends
    back = {first: ends[second], second: ends[first]}
    here = sp.sympify(call(function, {**ends, **given, "weight": weight}))
    there = sp.sympify(call(function, {**back, **given, "weight": weight}))
    if sp.expand(here - there) == 0:
        return here
    here, there = (e.xreplace({weight: sp.S.One}) for e in (here, there))
    return sp.expand(weight**2 * (here + there) / 2 + weight * (here - there) / 2)


@lru_cache(maxsize=64)
def is_oriented(edge: Edge) -> bool:
    """Return True where the rates of a link do not just change their sign with its weight."""
    turned = {edge.weight: -edge.weight}
    return any(sp.expand(e + e.xreplace(turned)) != 0 for e in edge.rhs)


def drawn(graph: Topology) -> tuple[Link, ...]:
    """Return the links of a graph with the sign of their direction as weight.

    A link runs from the smaller to the larger number; on a graph that looks alike from every node (a ring) it runs the
    shorter way round, so that the last link runs from the last node to the first.
    Raises ValueError for one-way links and for weights other than 1: strength and direction share one number.
    """
    if not graph.symmetric or any(weight != 1 for _, _, weight in graph.links):
        raise ValueError(
            f"topology {graph.name}({graph.n}): found one-way links or weights other than 1; expected neither, since this "
            "coupling tells the two ends of a link apart: choose another graph or coupling"
        )
    return tuple(_directed(graph))


def _directed(graph: Topology) -> Iterator[Link]:
    n = graph.n
    pairs = {(i, j) for i, j, _ in graph.links}
    alike = all(((i + 1) % n, (j + 1) % n) in pairs for i, j in pairs)
    for i, j, _ in graph.links:
        way, back = (j - i) % n, (i - j) % n
        forward = way < back if alike and way != back else i < j
        yield i, j, Fraction(1 if forward else -1)
