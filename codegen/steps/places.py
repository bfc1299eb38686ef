"""Compute the index of each state, parameter and matrix entry of a node or a link in the arrays of a kernel.

Nodes of one kind keep their numbers: state c of node i is entry c*NODES + i of the whole state.
Nodes of several kinds are renumbered kind after kind, and links joint after joint. Each loop then runs over nodes or
links of one template. The integer array `where` holds at

    c*NODES + i             the index of state c of node i in the whole state,
    (size + k)*NODES + i    the slot, for node i, of the k-th parameter that differs between nodes,
    behind + k*LINKS + e    the slot, for link e, of the k-th parameter that differs between links,
    second + e              the second source of link e, if links have three ends;

`size` is the largest number of states of a node, and -1 stands for a missing state or parameter. With one kind of
nodes, `where` holds the rows of links only (behind = 0).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate as running_sums
from itertools import pairwise

import numpy as np
import sympy as sp
from sympy.core.relational import Relational

from synchain.models.dynamics.angles import periods_of_kinds
from synchain.models.dynamics.equations import Equations, Layer, Triad
from synchain.models.graphs.links import Link
from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import Expression, Load, Name, Number, Value, as_expression, call, plus
from ..program.passes import real
from ..program.statements import Assign, Loop, Statement, accumulate, let, store, whole


@dataclass(frozen=True, slots=True)
class Span:
    index: str
    start: Expression
    stop: Expression

    def over(self, body: Iterable[Statement]) -> Loop:
        """Return the loop over the range with these statements as its body."""
        return Loop(self.index, self.start, self.stop, tuple(body))


def span(index: str, stop: Value, start: Value = 0) -> Span:
    return Span(index, as_expression(start), as_expression(stop))


def load_from(vector: str, place: Expression) -> Load:
    """Load from a vector of the workspace `dense`."""
    return Load("dense", plus(Name(vector), place))


def store_in(vector: str, place: Expression, value: Value) -> Statement:
    return store("dense", plus(Name(vector), place), value)


def add_to(vector: str, place: Expression, value: Value) -> Statement:
    return accumulate("dense", plus(Name(vector), place), value)


@dataclass(frozen=True, slots=True)
class NodeKindLayout:
    """The nodes of one kind: template, number of the kind, range of the node numbers."""

    node: Node
    number: int
    span: Span


@dataclass(frozen=True, slots=True)
class Joint:
    """The links of one template between two kinds of nodes, and the range of the link numbers."""

    edge: Edge
    target: Node
    source: Node
    span: Span


class StateLayout:
    """Make the loops over nodes and links of a network, and the indices at which the loops read and write."""

    def __init__(self, equations: Equations) -> None:
        nodes, self.mixed = equations.nodes, equations.mixed
        self.size = max(len(node.state) for node in nodes)
        self.periods = periods_of_kinds(equations)
        self.varied, self.numbered = equations.varied, tuple(equations.numbered)
        self.links = sum(len(layer.links) for layer in equations.listed)
        self.behind = (self.size + len(self.varied)) * equations.n if self.mixed else 0
        self.second = self.behind + len(self.numbered) * self.links
        self.slots = {name: slot for slot, name in enumerate(equations.parameters, start=equations.dimension)}

        def ranges(index: str, stop: str, counts: Sequence[int]) -> list[Span]:
            # with a single template the bound is a named constant, so that the text is the same for all sizes
            if len(counts) == 1 and not self.mixed:
                return [span(index, stop)]
            return [span(index, b, a) for a, b in pairwise(running_sums(counts, initial=0))]

        of_kinds = ranges("i", "NODES", [equations.kind_of.count(k) for k in range(len(nodes))])
        self.kinds = tuple(NodeKindLayout(*each) for each in zip(nodes, range(len(nodes)), of_kinds, strict=True))
        templates = [pair for layer in equations.listed for pair in layer.edge_of]
        counts = Counter(joint_numbers(equations))
        of_joints = ranges("e", "target.size", [counts[k] for k in range(len(templates))])
        self.joints = tuple(
            Joint(edge, nodes[a], nodes[b], links) for ((a, b), edge), links in zip(templates, of_joints, strict=True)
        )

    @property
    def rows(self) -> list[tuple[Span, Expression]]:
        """Loops over all states, each with the index of a state; nodes of one kind have one loop per state."""
        if self.mixed:
            return [(span("i", "DIMENSION"), Name("i"))]
        return [(span("i", "NODES"), self.place(c)) for c in range(self.size)]

    @property
    def measured(self) -> list[tuple[Span, Expression, float | None]]:
        """Loops over all states, each with the index of a state and its period, None if the state is no angle."""
        if len(alike := {period for periods in self.periods for period in periods}) == 1:
            (common,) = alike
            return [(span, place, common) for span, place in self.rows]
        kinds = zip(self.kinds, self.periods, strict=True)
        return [(kind.span, self.place(c), period) for kind, periods in kinds for c, period in enumerate(periods)]

    def row_of(self, c: int) -> int:
        """Return the index in `rows` of the loop that contains state c of the nodes."""
        return 0 if self.mixed else c

    def place(self, c: int, index: str = "i") -> Expression:
        """Return the index of state c of a node in the whole state."""
        number = c * Name("NODES") + index
        return Load("where", number, None) if self.mixed else number

    def entry(self, slot: str, a: int, b: int) -> Expression:
        """Return the matrix slot of entry (a, b) in a block of a node or a link; `slot` names the array of slots."""
        length, index = ("NODES", "i") if slot == "node_slot" else ("target.size", "e")
        return Load(slot, (a * self.size + b) * Name(length) + index, None)

    def read(self, node: Node, base: str, suffix: str = "", index: str = "i", prefix: str = "") -> list[Statement]:
        """Load the states of a node from the array `y` or from a vector of the workspace."""
        places = [self.place(c, index) for c in range(len(node.state))]
        loads = [Load("y", at) if base == "y" else load_from(base, at) for at in places]
        return [let(f"{prefix}{s.name}{suffix}", load) for s, load in zip(node.state, loads, strict=True)]

    def _parameter(self, number: int, index: str) -> Expression:
        """Return the slot, in the bank of parameters, of a node's value of the parameter varied[number]."""
        if self.mixed:
            return self.place(self.size + number, index)
        return Number(self.slots[f"{self.varied[number]}_1"]) + index

    def ends(self, edge: Edge, weight: str, source: str = "j") -> list[Statement]:
        """Load the ends of link e and its weight; the second source of a link of three ends is node `k_beyond`."""
        loads = link_ends(edge, weight, source)
        return [*loads, whole("k_beyond", Load("where", self.second + Name("e"), None))] if edge.beyond else loads

    def own(self, used: Container[sp.Symbol]) -> list[Assign]:
        """Load those parameters in `used` that differ from node to node, for node i."""
        loads = ((name, Load("p", self._parameter(k, "i"))) for k, name in enumerate(self.varied))
        return [let(name, load) for name, load in loads if real(name) in used]

    def of_source(self, edge: Edge, used: Container[sp.Symbol], index: str = "j") -> list[Assign]:
        """Load those parameters in `used` that a link reads from its source node."""
        names = [parameter.name for s, parameter in edge.theirs if s in used]
        return [let(f"{name}_there", Load("p", self._parameter(self.varied.index(name), index))) for name in names]

    def of_link(self, edge: Edge, used: Container[sp.Symbol], index: str = "j") -> list[Assign]:
        """Load those parameters in `used` that differ between nodes or links: of target, source and link."""
        places = ((name, Number(self.behind + k * self.links) + "e") for k, name in enumerate(self.numbered))
        of_links = [let(name, Load("p", Load("where", at, None))) for name, at in places if real(name) in used]
        return [*self.own(used), *self.of_source(edge, used, index), *of_links]


def link_ends(edge: Edge, weight: str, source: str = "j") -> list[Statement]:
    """Load both ends of link e and its weight."""
    i, j, w = (Load(array, Name("e"), None) for array in ("target", "source", "weights"))
    # if a function or a condition contains only the weight, its argument must be a register: broadcast the weight
    parts = (part for e in edge.expressions for part in e.atoms(sp.Function, sp.Pow))
    values = [part.args[0] for part in parts] + [c.lhs - c.rhs for e in edge.expressions for c in e.atoms(Relational)]
    alone = any(value.free_symbols == {edge.weight} for value in values)
    return [whole("i", i), whole(source, j), let(weight, call("broadcast", w, "WIDTH") if alone else w)]


def named(joint: Joint) -> dict[sp.Symbol, sp.Symbol]:
    """Return the map from states at both ends of a link, and parameters of the source, to their names in the loop."""
    ends = [(joint.edge.here, joint.target, "_here"), (joint.edge.there, joint.source, "_there")]
    ends += [(joint.edge.beyond, joint.source, "_beyond")] if joint.edge.beyond else []
    states = {
        s: real(f"{state.name}{suffix}")
        for symbols, node, suffix in ends
        for s, state in zip(symbols, node.state, strict=True)
    }
    return states | theirs(joint.edge)


def theirs(edge: Edge) -> dict[sp.Symbol, sp.Symbol]:
    """Return the map from parameters that a link reads from its source to their names in the loop."""
    return {s: real(f"{parameter.name}_there") for s, parameter in edge.theirs}


# -- the numbering of nodes and links -------------------------------------------------------------------------


def joint_numbers(equations: Equations) -> list[int]:
    """Return, for each listed link, the number of its joint."""
    numbers, first = list[int](), 0
    for layer in equations.listed:
        number = {ends: k for k, (ends, _) in enumerate(layer.edge_of, start=first)}
        if len(number) == 1:
            numbers += [first] * len(layer.links)
        else:
            numbers += [number[equations.ends(link)] for link in layer.links]
        first += len(number)
    return numbers


def by_kind(equations: Equations) -> list[int]:
    """Return the nodes (0-based) in the order in which a kernel numbers them: kind after kind."""
    return sorted(range(equations.n), key=equations.kind_of.__getitem__)


def by_joint(equations: Equations) -> list[tuple[Link | Triad, Layer]]:
    """Return the listed links and their layers in a kernel's order: joint after joint, then by rank at the target."""
    # Consecutive links then add to different nodes, so that no addition waits for the previous one.
    ranks, ordered = Counter[tuple[int, int]](), []
    pairs = ((link, layer) for layer in equations.listed for link in layer.each())
    for number, (link, layer) in zip(joint_numbers(equations), pairs, strict=True):
        ordered.append((number, ranks[number, link[0]], link, layer))
        ranks[number, link[0]] += 1
    ordered.sort(key=lambda each: each[:2])  # Python's sort is stable: equal keys keep the order of the links
    return [(link, layer) for _, _, link, layer in ordered]


def where_table(equations: Equations) -> np.ndarray:
    """Return the array `where` (see the head of this file); empty if all nodes and all links are alike."""
    slots = {name: k for k, name in enumerate(equations.parameters, start=equations.dimension)}
    # rows of nodes: indices of states, then slots of parameters; -1 if a node lacks one
    of_nodes: list[np.ndarray] = []
    if equations.mixed:
        size = max(len(node.state) for node in equations.nodes)
        table = np.full((size + len(equations.varied), equations.n), -1, np.int64)
        places = equations.places
        for number, i in enumerate(by_kind(equations)):
            table[: len(places[i]), number] = places[i]
            table[size:, number] = [slots.get(f"{name}_{i + 1}", -1) for name in equations.varied]
        of_nodes = [table.reshape(-1)]
    # rows of links: slots of parameters, in the order of a kernel
    links = by_joint(equations) if equations.numbered or equations.triadic else []
    of_links = [
        slots[layer.name(name, (link[0], link[1], link[2]))] if name in layer.varied else -1
        for name in equations.numbered
        for link, layer in links
    ]
    if equations.triadic:
        of_links += [link[3] if len(link) == 4 else -1 for link, _ in links]
    return np.concatenate([*of_nodes, np.array(of_links, np.int64)])
