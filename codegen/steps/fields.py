"""The statements of a mean field: a loop over the nodes that adds up what they are as sources, and one that applies the sums.

The sums are compensated, so that their error does not grow with the number of nodes (W. Kahan, Commun. ACM 8, 40 (1965)).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import AllPairs
from synchain.models.interactions.separation import Separated, separated
from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import Expression, Name, plus
from ..program.lowering import lower
from ..program.passes import Body, share
from ..program.statements import Statement, accumulate, let
from .places import Joint, Places, named, span
from .step import NOW, lane

__all__ = ["MeanField", "compensated", "mean_fields"]


@dataclass(frozen=True, slots=True)
class MeanField:
    """The links of all pairs as sums of products; `edge` and `node` are their template and that of the nodes."""

    edge: Edge
    node: Node
    pairs: AllPairs
    parts: Separated

    def totals(self) -> list[sp.Symbol]:
        """What the sums of the source functions are called."""
        return [sp.Symbol(f"sum_{m}", real=True) for m in range(len(self.parts.sources))]

    def added(self) -> dict[sp.Symbol, int]:
        """The sums to be formed, and which source function each is of; the sum of ones is the number of nodes."""
        return {s: m for m, s in enumerate(self.totals()) if self.parts.sources[m] != 1}

    def rates(self) -> list[sp.Expr]:
        """What the field adds to the rates of a node, in the names of the sums; the node's own part is subtracted."""
        known = {s: sp.Integer(self.pairs.n) for s in self.totals() if s not in self.added()}
        totals = [known.get(s, s) for s in self.totals()]
        weight = {self.edge.weight: sp.Rational(self.pairs.weight.numerator, self.pairs.weight.denominator)}
        found = (
            sp.Add(*(a * s for a, s in zip(row, totals, strict=True))) - own
            for row, own in zip(self.parts.factors, self.parts.own, strict=True)
        )
        return [e.xreplace(weight) for e in found]

    def statements(self, places: Places, base: str, out: str) -> list[Statement]:
        """Both loops, at one vector of states; they add to the slopes in `out`."""
        names = (sp.Symbol(f"sum_part_{k}", real=True) for k in range(10**9))
        swap = named(Joint(self.edge, self.node, self.node, span("e", 0))) | NOW
        weight = {self.edge.weight: sp.Rational(self.pairs.weight.numerator, self.pairs.weight.denominator)}
        added = self.added()
        sources = [self.parts.sources[m].xreplace(weight).xreplace(swap) for m in added.values()]
        totals = [s.name for s in added]
        found: list[Statement] = []
        if self.parts.shifted:
            found += places.read(self.node, base, "_first", "0")
        for total in totals:
            found += [let(total, 0.0 * Name("h")), let(f"{total}_rest", 0.0 * Name("h"))]
        body = share(sources, names)
        there = self.states(places, base, "_there", "j")
        there += [let(name, load) for name, load in places.of_source(self.edge, self.used(sources, swap))]
        there += assigned(body)
        for total, e in zip(totals, body.results, strict=True):
            there += compensated(total, lane(lower(e)))
        if totals:
            found.append(span("j", "NODES").over(there))
        body = share([e.xreplace(swap) for e in self.rates()], names)
        here = self.states(places, base, "_here", "i") + places.own(body) + assigned(body)
        for c, e in enumerate(body.results):
            if e != 0:
                here.append(accumulate("dense", plus(Name(out), places.place(c)), lower(e)))
        return [*found, span("i", "NODES").over(here)]

    def states(self, places: Places, base: str, suffix: str, index: str) -> list[Statement]:
        """Load the states of a node; those of which differences alone matter are counted from the first node's."""
        found = places.read(self.node, base, suffix, index)
        for k in self.parts.shifted:
            name = self.node.state[k].name
            found.append(let(f"{name}{suffix}", Name(f"{name}{suffix}") - Name(f"{name}_first")))
        return found

    def used(self, sources: list[sp.Expr], swap: dict[sp.Symbol, sp.Symbol]) -> set[sp.Symbol]:
        """The parameters of the source that the source functions use."""
        symbols = {s for e in sources for s in e.free_symbols}
        return {s for s, _ in self.edge.theirs if swap[s] in symbols}


def mean_fields(equations: Equations) -> list[MeanField]:
    """Return the mean fields of a network of equal nodes."""
    found = []
    for edge, pairs in equations.fields:
        parts = separated(edge, equations.varied)
        if parts is None:
            raise RuntimeError(f"the rates {edge.rhs} of links of all pairs do not separate; this is a mistake in the program")
        found.append(MeanField(edge, equations.node, pairs, parts))
    return found


def compensated(total: str, value: Expression) -> Iterator[Statement]:
    """Add a value to a sum and keep what rounding cuts off for the next one."""
    rest, part, new = (f"{total}_{word}" for word in ("rest", "part", "new"))
    yield let(part, value - Name(rest))
    yield let(new, Name(total) + part)
    yield let(rest, (Name(new) - Name(total)) - Name(part))
    yield let(total, new)


def assigned(body: Body) -> list[Statement]:
    """The statements of a body."""
    return [let(s.name, lower(e)) for s, e in body.statements]
