"""The statements of a mean field: a loop over the nodes that adds up what they are as sources, and one that applies the sums.

The sums are compensated, so that their error does not grow with the number of nodes (W. Kahan, Commun. ACM 8, 40 (1965)).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import AllPairs
from synchain.models.interactions.separation import Separated, separated
from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import Load, Name, Value, as_expression, plus
from ..program.lowering import lower
from ..program.passes import Body, real, share
from ..program.statements import Statement, accumulate, let, store
from .places import Joint, Places, named, span
from .step import NOW

__all__ = ["MeanField", "compensated", "mean_fields"]


@dataclass(frozen=True, slots=True)
class MeanField:
    """The links of all pairs of a network, as what is done with them: sums, factors that all nodes share, and rates.

    sums: the functions of the source that are summed, by names.  shared: sums of these with factors that no node has for
    itself, by names.  rates: what is added to the rates of a node, in these names and functions of the node.
    """

    edge: Edge
    node: Node
    shifted: tuple[int, ...]
    sums: dict[sp.Symbol, sp.Expr]
    shared: dict[sp.Symbol, sp.Expr]
    rates: tuple[sp.Expr, ...]

    @classmethod
    def of(cls, number: int, edge: Edge, node: Node, pairs: AllPairs, parts: Separated) -> MeanField:
        """The mean field of this number among those of a network."""
        weight = {edge.weight: sp.Rational(pairs.weight.numerator, pairs.weight.denominator)}
        symbols = {e: real(f"sum_{number}_{k}") for k, e in enumerate(parts.sources) if e != 1}
        totals = {sp.S.One: sp.Integer(pairs.n), **symbols}
        shared: dict[sp.Expr, sp.Symbol] = {}
        rates = []
        for own, row in zip(parts.own, parts.products, strict=True):
            grouped: dict[sp.Expr, sp.Expr] = {}
            for factor, target, source in row:
                grouped[target] = grouped.get(target, sp.S.Zero) + factor.xreplace(weight) * totals[source]
            rate = -own.xreplace(weight)
            for target, total in grouped.items():
                s = shared.setdefault(total, real(f"sum_{number}_of_{len(shared)}"))
                rate += target.xreplace(weight) * s
            rates.append(rate)
        sums = {s: e.xreplace(weight) for e, s in symbols.items()}
        return cls(edge, node, parts.shifted, sums, {s: e for e, s in shared.items()}, tuple(rates))

    @property
    def alike(self) -> dict[sp.Symbol, sp.Expr]:
        """The functions of the source that occur as functions of the target too, by the names of their sums."""
        swap = {**dict(zip(self.edge.there, self.edge.here, strict=True)), **dict(self.edge.theirs)}
        found = {s: e.xreplace(swap) for s, e in self.sums.items()}
        return {s: e for s, e in found.items() if not e.is_Symbol and any(rate.has(e) for rate in self.rates)}

    def statements(self, places: Places, base: str, out: str, kept: int = 0) -> list[Statement]:
        """Both loops, at one vector of states; they add to the slopes in `out`.

        What a node is as a source and as a target is computed once, and stands in FIELD behind `kept` others meanwhile.
        """
        names = (real(f"sum_part_{k}") for k in count())
        swap = named(Joint(self.edge, self.node, self.node, span("e", 0))) | NOW
        found = places.read(self.node, base, "_first", "0") if self.shifted else []
        at = {s: Name("FIELD") + k * Name("NODES") for k, s in enumerate(self.alike, start=kept)}
        used = {s for e in self.sums.values() for s in e.free_symbols}
        body = share([e.xreplace(swap) for e in self.sums.values()], names)
        there = self.states(places, base, "_there", "j")
        there += places.of_source(self.edge, used)
        there += assigned(body)
        for total, e in zip(self.sums, body.results, strict=True):
            found += [let(total.name, 0.0 * Name("h")), let(f"{total}_rest", 0.0 * Name("h"))]
            if total in at:
                there += [let(f"{total}_own", lower(e)), store("dense", at[total] + "j", f"{total}_own")]
                e = real(f"{total}_own")
            there += compensated(total.name, lower(e))
        if self.sums:
            found.append(span("j", "NODES").over(there))
        found += [let(s.name, lower(e.xreplace(NOW))) for s, e in self.shared.items()]
        own = {e: real(f"{s}_own") for s, e in self.alike.items()}
        body = share([e.xreplace(own).xreplace(swap) for e in self.rates], names)
        here = [*self.states(places, base, "_here", "i"), *places.own(body.symbols)]
        here += [let(f"{s}_own", Load("dense", place + "i")) for s, place in at.items()]
        here += assigned(body)
        for c, e in enumerate(body.results):
            if e != 0:
                here.append(accumulate("dense", plus(Name(out), places.place(c)), lower(e)))
        return [*found, span("i", "NODES").over(here)]

    def states(self, places: Places, base: str, suffix: str, index: str) -> list[Statement]:
        """Load the states of a node; those of which differences alone matter are counted from the first node's."""
        found = places.read(self.node, base, suffix, index)
        for k in self.shifted:
            name = self.node.state[k].name
            found.append(let(f"{name}{suffix}", Name(f"{name}{suffix}") - Name(f"{name}_first")))
        return found


def mean_fields(equations: Equations) -> list[MeanField]:
    """Return the mean fields of a network of equal nodes."""
    found = []
    for number, (edge, pairs) in enumerate(equations.fields):
        parts = separated(edge, equations.varied)
        if parts is None:
            raise RuntimeError(
                f"the rates {edge.rhs} of links of all pairs do not separate; this is a mistake in the program"
            )
        found.append(MeanField.of(number, edge, equations.node, pairs, parts))
    return found


def compensated(total: str, value: Value) -> Iterator[Statement]:
    """Add a value to a sum and keep what rounding cuts off for the next one."""
    rest, part, new = (f"{total}_{word}" for word in ("rest", "part", "new"))
    yield let(part, as_expression(value) - Name(rest))
    yield let(new, Name(total) + part)
    yield let(rest, (Name(new) - Name(total)) - Name(part))
    yield let(total, new)


def assigned(body: Body) -> list[Statement]:
    """The statements of a body."""
    return [let(s.name, lower(e)) for s, e in body.statements]
