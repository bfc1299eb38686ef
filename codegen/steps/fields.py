"""The statements of a mean field: a loop over the nodes that adds up what they are as sources, and one that applies the sums.

The sums are compensated, so that their error does not grow with the number of nodes (W. Kahan, Commun. ACM 8, 40 (1965)).
Links in a list whose rates are products of both ends take a loop over the nodes, one over the links that adds up, and one over
the nodes that applies the sums of each.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import count

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import AllPairs
from synchain.models.interactions.separation import Separated, Summed, separated, summed
from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import Load, Name, Value, as_expression, plus
from ..program.lowering import lower
from ..program.passes import real, share
from ..program.statements import Statement, accumulate, let, store
from .blocks import assigned
from .places import Joint, StateLayout, link_ends, named, span
from .step import NOW, lane


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

    def statements(self, places: StateLayout, base: str, out: str, kept: int = 0) -> list[Statement]:
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

    def states(self, places: StateLayout, base: str, suffix: str, index: str) -> list[Statement]:
        """Load the states of a node; those of which differences alone matter are counted from the first node's."""
        found = places.read(self.node, base, suffix, index)
        for k in self.shifted:
            name = self.node.state[k].name
            found.append(let(f"{name}{suffix}", Name(f"{name}{suffix}") - Name(f"{name}_first")))
        return found


@dataclass(frozen=True, slots=True)
class LinkSums:
    """The links of a joint that are products of both ends, as functions of the source, sums over links, and rates.

    functions: those of the source, by names.  sums: what each link multiplies one of these by, and the name of that (one if
    there is none), by the names of the sums.  factors: functions of parameters that all links share, by names.  rates: what
    is added to the rates of a node, in these names and functions of it.
    """

    joint: Joint
    functions: dict[sp.Symbol, sp.Expr]
    sums: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]]
    factors: dict[sp.Symbol, sp.Expr]
    rates: tuple[sp.Expr, ...]

    @classmethod
    def of(cls, number: int, joint: Joint, parts: Summed) -> LinkSums:
        """Those of the joint of some number."""
        functions = {e: real(f"sum_{number}_from_{k}") for k, e in enumerate(parts.sources)}
        sums: dict[tuple[sp.Expr, sp.Expr], sp.Symbol] = {}
        factors: dict[sp.Expr, sp.Symbol] = {}
        rates = []
        for row in parts.products:
            grouped: dict[sp.Expr, sp.Expr] = {}
            for shared, own, target, source in row:
                part = (own, functions.get(source, sp.S.One))
                total = sums.setdefault(part, real(f"sum_{number}_{len(sums)}"))
                if shared.atoms(sp.Function, sp.Pow):
                    shared = factors.setdefault(shared, real(f"sum_{number}_by_{len(factors)}"))
                grouped[target] = grouped.get(target, sp.S.Zero) + shared * total
            rates.append(sp.Add(*(target * total for target, total in grouped.items())))
        return cls(
            joint,
            {s: e for e, s in functions.items()},
            {s: part for part, s in sums.items()},
            {s: e for e, s in factors.items()},
            tuple(rates),
        )

    @property
    def kept(self) -> int:
        """Numbers of each node that stand in memory between the loops."""
        return len(self.functions) + len(self.sums)

    @property
    def alike(self) -> dict[sp.Expr, sp.Symbol]:
        """What functions of the target that are functions of the source too are called."""
        edge = self.joint.edge
        swap = {**dict(zip(edge.there, edge.here, strict=True)), **dict(edge.theirs)}
        return {e.xreplace(swap): s for s, e in self.functions.items()}

    def of_node(self) -> list[sp.Expr]:
        """The functions, of the states and parameters of a node."""
        edge = self.joint.edge
        swap = {**dict(zip(edge.there, self.joint.source.state, strict=True)), **dict(edge.theirs)}
        return [e.xreplace(swap) for e in self.functions.values()]

    def applied(self) -> list[sp.Expr]:
        """The rates, with functions of the target by the names of those of the source where they are alike."""
        return [e.xreplace(self.alike) for e in self.rates]

    def statements(self, places: StateLayout, base: str, out: str, kept: int) -> list[Statement]:
        """The loops at one vector of states, which add to the slopes in `out`; FIELD has `kept` numbers of each node before."""
        joint, names, nodes = self.joint, (real(f"sum_part_{k}") for k in count()), span("j", "NODES")
        at = {s: Name("FIELD") + k * Name("NODES") for k, s in enumerate((*self.functions, *self.sums), start=kept)}
        swap = named(joint)
        body = share([e.xreplace(swap) for e in self.functions.values()], names)
        used = {s for e in self.functions.values() for s in e.free_symbols}
        made = [*places.read(joint.source, base, "_there", "j"), *places.of_source(joint.edge, used), *assigned(body)]
        made += [store("dense", at[s] + "j", lane(lower(e))) for s, e in zip(self.functions, body.results, strict=True)]
        made += [store("dense", at[s] + "j", 0.0 * Name("h")) for s in self.sums]
        weight = joint.edge.weight.name
        own = {s for factor, _ in self.sums.values() for s in factor.free_symbols}
        added = [*link_ends(joint.edge, weight), *places.of_link(joint.edge, own)]
        added += [let(s.name, Load("dense", place + "j")) for s, place in at.items() if s in self.functions]
        added += [accumulate("dense", at[s] + "i", lower(a * b)) for s, (a, b) in self.sums.items()]
        body = share([e.xreplace(swap) for e in self.applied()], names)
        here = [*places.read(joint.target, base, "_here", "i"), *places.own(body.symbols)]
        here += [let(s.name, Load("dense", place + "i")) for s, place in at.items() if s in body.symbols]
        here += assigned(body)
        for c, e in enumerate(body.results):
            if e != 0:
                here.append(accumulate("dense", plus(Name(out), places.place(c)), lower(e)))
        factors = [let(s.name, lower(e)) for s, e in self.factors.items()]
        return [*factors, nodes.over(made), joint.span.over(added), span("i", "NODES").over(here)]


def link_sums(equations: Equations, joints: Iterable[Joint]) -> tuple[list[LinkSums], list[Joint]]:
    """Return the links that are summed by nodes, and the joints of those, or the parts of those, that are not.

    Networks with several kinds of nodes, and with contacts, have all links by themselves.
    """
    found, rest = list[LinkSums](), list[Joint]()
    alike = not (equations.mixed or equations.sticks)
    for number, joint in enumerate(joints, start=len(equations.fields)):
        parts = summed(joint.edge, equations.varied, tuple(equations.numbered)) if alike else None
        if parts is not None:
            found.append(LinkSums.of(number, joint, parts))
            joint = replace(joint, edge=replace(joint.edge, rhs=parts.rest))
        if joint.edge.acts:
            rest.append(joint)
    return found, rest


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
