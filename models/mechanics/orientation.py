"""Links with a direction along which they are drawn: springs that are stiffer in tension than in compression.

A coupling whose energy changes where its two ends are exchanged, V(q_i, q_j) other than V(q_j, q_i), needs to know at
which end of a link node i is.  Its links carry that as the sign of their weight W, seen from the target: W = 1 where the
link runs from the target to the source, W = -1 where it runs from the source to the target.  The energy of the link is
then W^2 V_even + W V_odd, the parts of V that keep and that change their sign in the exchange.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import sympy as sp

from .components import Edge
from .coupling import WEIGHT

__all__ = ["is_oriented", "link_energy"]


def link_energy(energy: sp.Expr, ends: Mapping[sp.Symbol, sp.Symbol], weight: sp.Symbol) -> sp.Expr:
    """Return the energy (or Rayleigh function) of one link.

    Parameters
    ----------
    energy : Expr
        The function as a coupling has it, in the symbols of its two ends and `WEIGHT`.
    ends : mapping of Symbol to Symbol
        The symbols that take the place of those two, target first.
    weight : Symbol
        The symbol that takes the place of `WEIGHT`.
    """
    first, second = ends
    back = {first: ends[second], second: ends[first]}
    here, there = (energy.xreplace({**pair, WEIGHT: weight}) for pair in (ends, back))
    if sp.expand(here - there) == 0:
        return here
    here, there = (e.xreplace({weight: sp.S.One}) for e in (here, there))
    return sp.expand(weight**2 * (here + there) / 2 + weight * (here - there) / 2)


@lru_cache(maxsize=64)
def is_oriented(edge: Edge) -> bool:
    """Return True where the rates of a link do not just change their sign with its weight."""
    turned = {edge.weight: -edge.weight}
    return any(sp.expand(e + e.xreplace(turned)) != 0 for e in edge.rhs)
