"""Replace the loop over pairs by loops over nodes, for links that are sums of products f(target) g(source).

    rate of node i = sum over k of target_k(i) * (sum over j of source_k(j))

`MeanField`: every pair is linked. A first loop over the nodes adds up the source functions; a second loop adds the
rates. The sums are compensated, so that their error does not grow with the number of nodes (W. Kahan, Commun. ACM 8, 40
(1965)).
`LinkSums`: the links are listed. A loop over the nodes computes the source functions, a loop over the links adds them
up at the targets, and a second loop over the nodes adds the rates.

Between the loops, the part FIELD of the workspace holds one number of each node for each function.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import AllPairs
from synchain.models.interactions.separation import Separated, Summed, separated, summed
from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import Expression, Load, Name, Value, as_expression
from ..program.lowering import lower
from ..program.passes import StraightLine, real, share
from ..program.statements import Loop, Statement, accumulate, let, store
from .blocks import assigned
from .places import Joint, StateLayout, add_to, link_ends, named, span
from .step import NOW, lane


@dataclass(frozen=True, slots=True)
class MeanField:
    """The links between all pairs of nodes, as sums over the nodes."""

    # shifted: states that enter the links only as differences between nodes. sums: the functions of the source that are
    # summed, by the name of each sum. shared: products of sums and of factors that all nodes share, by name. rates: the
    # rates of a node, in the names of `sums` and `shared` and in functions of the node.

    edge: Edge
    node: Node
    shifted: tuple[int, ...]
    sums: dict[sp.Symbol, sp.Expr]
    shared: dict[sp.Symbol, sp.Expr]
    rates: tuple[sp.Expr, ...]

    @classmethod
    def of(cls, number: int, edge: Edge, node: Node, pairs: AllPairs, parts: Separated) -> MeanField:
        weight = {edge.weight: sp.Rational(pairs.weight.numerator, pairs.weight.denominator)}
        symbols = {e: real(f"sum_{number}_{k}") for k, e in enumerate(parts.sources) if e != 1}
        totals = {sp.S.One: sp.Integer(pairs.n), **symbols}
        shared: dict[sp.Expr, sp.Symbol] = {}
        rates = []
        for itself, row in zip(parts.own, parts.products, strict=True):
            # add the sums that multiply the same function of the target, then multiply once
            grouped: dict[sp.Expr, sp.Expr] = {}
            for factor, target, source in row:
                grouped[target] = grouped.get(target, sp.S.Zero) + factor.xreplace(weight) * totals[source]
            # the sums run over all nodes, but a node has no link to itself: subtract that term
            rate = -itself.xreplace(weight)
            for target, total in grouped.items():
                s = shared.setdefault(total, real(f"sum_{number}_of_{len(shared)}"))
                rate += target.xreplace(weight) * s
            rates.append(rate)
        sums = {s: e.xreplace(weight) for e, s in symbols.items()}
        return cls(edge, node, parts.shifted, sums, {s: e for e, s in shared.items()}, tuple(rates))

    @property
    def alike(self) -> dict[sp.Symbol, sp.Expr]:
        """Functions that occur both at the source and at the target, by the names of their sums."""
        functions = {s: e.xreplace(_as_target(self.edge)) for s, e in self.sums.items()}
        return {s: e for s, e in functions.items() if not e.is_Symbol and any(rate.has(e) for rate in self.rates)}

    def statements(self, places: StateLayout, base: str, out: str, start: int = 0) -> list[Statement]:
        """Write both loops for the states in vector `base`, with the shared terms between; the rates are added to
        `out`.

        A function that occurs at the source and at the target is computed once and stored in a row of FIELD, from
        `start` on.
        """
        names = (real(f"sum_part_{k}") for k in count())
        swap = named(Joint(self.edge, self.node, self.node, span("e", 0))) | NOW
        rows = _rows(self.alike, start)
        # 1. the sums, of states minus those of the first node if `shifted`
        statements = places.read(self.node, base, "_first", "0") if self.shifted else []
        used = {s for e in self.sums.values() for s in e.free_symbols}
        body = share([e.xreplace(swap) for e in self.sums.values()], names)
        loop = [*self._states(places, base, "_there", "j"), *places.of_source(self.edge, used), *assigned(body)]
        for total, e in zip(self.sums, body.results, strict=True):
            statements += [let(total.name, 0.0 * Name("h")), let(f"{total}_rest", 0.0 * Name("h"))]
            if total in rows:
                loop += [let(f"{total}_own", lower(e)), store("dense", rows[total] + "j", f"{total}_own")]
                e = real(f"{total}_own")
            loop += compensated(total.name, lower(e))
        if self.sums:
            statements.append(span("j", "NODES").over(loop))
        # 2. sums times the factors that all nodes share
        statements += [let(s.name, lower(e.xreplace(NOW))) for s, e in self.shared.items()]
        # 3. the rates
        kept = {e: real(f"{s}_own") for s, e in self.alike.items()}
        body = share([e.xreplace(kept).xreplace(swap) for e in self.rates], names)
        loads = [*self._states(places, base, "_here", "i"), *places.own(body.symbols)]
        loads += [let(f"{s}_own", Load("dense", row + "i")) for s, row in rows.items()]
        return [*statements, _applied(places, out, loads, body)]

    def _states(self, places: StateLayout, base: str, suffix: str, index: str) -> list[Statement]:
        """Load the states of a node, `shifted` ones minus those of the first node, so that sums keep digits."""
        shifted = [self.node.state[k].name for k in self.shifted]
        moved = [let(f"{name}{suffix}", Name(f"{name}{suffix}") - Name(f"{name}_first")) for name in shifted]
        return [*places.read(self.node, base, suffix, index), *moved]


@dataclass(frozen=True, slots=True)
class LinkSums:
    """The terms of a joint's links that are products f(target) g(source), as sums over the links of each node."""

    # functions: the functions g of the source, by name. sums: by the name of each sum, the factor of each link and the
    # name of the function g that the factor multiplies (or one). factors: functions of parameters that all links share,
    # by name. rates: the rates of a node, in the names of `sums` and `factors` and in functions of the node.

    joint: Joint
    functions: dict[sp.Symbol, sp.Expr]
    sums: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]]
    factors: dict[sp.Symbol, sp.Expr]
    rates: tuple[sp.Expr, ...]

    @classmethod
    def of(cls, number: int, joint: Joint, parts: Summed) -> LinkSums:
        """Return the sums of joint number `number`."""
        functions = {e: real(f"sum_{number}_from_{k}") for k, e in enumerate(parts.sources)}
        sums: dict[tuple[sp.Expr, sp.Expr], sp.Symbol] = {}
        factors: dict[sp.Expr, sp.Symbol] = {}
        rates = []
        for row in parts.products:
            grouped: dict[sp.Expr, sp.Expr] = {}
            for factor, of_link, target, source in row:
                part = (of_link, functions.get(source, sp.S.One))
                total = sums.setdefault(part, real(f"sum_{number}_{len(sums)}"))
                # compute a function or a power once, outside of the loops
                if factor.atoms(sp.Function, sp.Pow):
                    factor = factors.setdefault(factor, real(f"sum_{number}_by_{len(factors)}"))
                grouped[target] = grouped.get(target, sp.S.Zero) + factor * total
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
        """Number of rows of FIELD: numbers of each node that are stored between the loops."""
        return len(self.functions) + len(self.sums)

    def of_node(self) -> list[sp.Expr]:
        """Return the functions of the source, in the states and parameters of a node."""
        edge = self.joint.edge
        swap = {**dict(zip(edge.there, self.joint.source.state, strict=True)), **dict(edge.theirs)}
        return [e.xreplace(swap) for e in self.functions.values()]

    def applied(self) -> list[sp.Expr]:
        """Return the rates. Functions that occur at the target and at the source are replaced by their names."""
        alike = {e.xreplace(_as_target(self.joint.edge)): s for s, e in self.functions.items()}
        return [e.xreplace(alike) for e in self.rates]

    def statements(self, places: StateLayout, base: str, out: str, start: int) -> list[Statement]:
        """Write the loops for the states in `base`; add the rates to `out`, and use rows of FIELD from `start` on."""
        names = (real(f"sum_part_{k}") for k in count())
        joint, edge, nodes = self.joint, self.joint.edge, span("j", "NODES")
        swap, rows = named(joint), _rows((*self.functions, *self.sums), start)
        # 1. store the functions of each source, and zeros where the sums will be
        body = share([e.xreplace(swap) for e in self.functions.values()], names)
        used = {s for e in self.functions.values() for s in e.free_symbols}
        first = [*places.read(joint.source, base, "_there", "j"), *places.of_source(edge, used), *assigned(body)]
        for s, e in zip(self.functions, body.results, strict=True):
            first.append(store("dense", rows[s] + "j", lane(lower(e))))
        first += [store("dense", rows[s] + "j", 0.0 * Name("h")) for s in self.sums]
        # 2. sums over the links of each target
        used = {s for factor, _ in self.sums.values() for s in factor.free_symbols}
        second = [*link_ends(edge, edge.weight.name), *places.of_link(edge, used)]
        second += [let(s.name, Load("dense", rows[s] + "j")) for s in self.functions]
        second += [accumulate("dense", rows[s] + "i", lower(a * b)) for s, (a, b) in self.sums.items()]
        # 3. the rates
        body = share([e.xreplace(swap) for e in self.applied()], names)
        loads = [*places.read(joint.target, base, "_here", "i"), *places.own(body.symbols)]
        loads += [let(s.name, Load("dense", row + "i")) for s, row in rows.items() if s in body.symbols]
        factors = [let(s.name, lower(e)) for s, e in self.factors.items()]
        return [*factors, nodes.over(first), joint.span.over(second), _applied(places, out, loads, body)]


def _as_target(edge: Edge) -> dict[sp.Symbol, sp.Symbol]:
    """Return the map from states and parameters of the source to those of the target."""
    return {**dict(zip(edge.there, edge.here, strict=True)), **dict(edge.theirs)}


def _rows(symbols: Iterable[sp.Symbol], start: int) -> Mapping[sp.Symbol, Expression]:
    """Return, for each symbol, the index in FIELD of its value at node 0; row `start` belongs to the first symbol."""
    return {s: Name("FIELD") + k * Name("NODES") for k, s in enumerate(symbols, start=start)}


def _applied(places: StateLayout, out: str, loads: Sequence[Statement], body: StraightLine) -> Loop:
    """Write the loop over the nodes that adds the results of `body` to the rates in `out`."""
    rates = [add_to(out, places.place(c), lower(e)) for c, e in enumerate(body.results) if e != 0]
    return span("i", "NODES").over([*loads, *assigned(body), *rates])


def mean_fields(equations: Equations) -> list[MeanField]:
    """Return the mean fields of a network of equal nodes."""
    fields = []
    for number, (edge, pairs) in enumerate(equations.fields):
        parts = separated(edge, equations.varied)
        if parts is None:
            raise RuntimeError(
                f"the rates {edge.rhs} of links of all pairs do not separate; this is a mistake in the program"
            )
        fields.append(MeanField.of(number, edge, equations.node, pairs, parts))
    return fields


def link_sums(equations: Equations, joints: Iterable[Joint]) -> tuple[list[LinkSums], list[Joint]]:
    """Return the sums over links, and the joints with the terms that are no products."""
    # Networks with contacts or with several kinds of nodes return no sums.
    sums, others = list[LinkSums](), list[Joint]()
    if equations.mixed or equations.sticks:
        return sums, [joint for joint in joints if joint.edge.acts]
    for number, joint in enumerate(joints, start=len(equations.fields)):
        parts = summed(joint.edge, equations.varied, tuple(equations.numbered))
        if parts is not None:
            sums.append(LinkSums.of(number, joint, parts))
            joint = replace(joint, edge=replace(joint.edge, rhs=parts.rest))
        if joint.edge.acts:
            others.append(joint)
    return sums, others


def compensated(total: str, value: Value) -> Iterator[Statement]:
    """Add a value to a sum by Kahan's rule: store the rounding error, and subtract it from the next value."""
    rest, part, new = (f"{total}_{word}" for word in ("rest", "part", "new"))
    yield let(part, as_expression(value) - Name(rest))
    yield let(new, Name(total) + part)
    yield let(rest, (Name(new) - Name(total)) - Name(part))
    yield let(total, new)
