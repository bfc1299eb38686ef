"""Where the loops of a kernel find what belongs to a node and to a link.

Nodes of one kind are numbered as they are, and state c of node i stands at c*NODES + i.  Nodes of several kinds are numbered
kind after kind and links joint after joint, so that one loop has nodes, or links, of one template; the array `where` says at
c*NODES + i where state c of node i stands, and in further rows which parameters the node has for itself.  Behind them
it says at k*LINKS + e where link e has its own number of the k-th parameter that differs from link to link.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
import sympy as sp
from sympy.core.relational import Relational

from synchain.models.dynamics.angles import periods_of_kinds
from synchain.models.dynamics.equations import Equations, Layer
from synchain.models.graphs.links import Link
from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import Expression, Load, Name, Number, Value, as_expression, call, plus
from ..program.passes import real
from ..program.statements import Assign, Loop, Statement, let, whole


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a numbering, for loops."""

    index: str
    start: Expression
    stop: Expression

    def over(self, body: Iterable[Statement]) -> Loop:
        """The loop over it."""
        return Loop(self.index, self.start, self.stop, tuple(body))


def span(index: str, stop: Value, start: Value = 0) -> Span:
    """The numbers from `start` up to `stop`."""
    return Span(index, as_expression(start), as_expression(stop))


def parts(index: str, counts: Sequence[int]) -> list[Span]:
    """Parts of a numbering of these lengths, one after another."""
    return [span(index, b, a) for a, b in pairwise(accumulate(counts, initial=0))]


@dataclass(frozen=True, slots=True)
class NodeKindLayout:
    """The nodes of one kind: their template, its number, and where they stand in the numbering."""

    node: Node
    number: int
    span: Span


@dataclass(frozen=True, slots=True)
class Joint:
    """The links of one template, between nodes `target` and `source`, and where they stand in the numbering."""

    edge: Edge
    target: Node
    source: Node
    span: Span


class StateLayout:
    """The places where loops over the nodes and links of a network read and write; this one has nodes of one kind."""

    def __init__(self, equations: Equations) -> None:
        self.size = max(len(node.state) for node in equations.nodes)
        self.periods = periods_of_kinds(equations)
        self.varied, self.numbered = equations.varied, tuple(equations.numbered)
        self.links = sum(len(layer.links) for layer in equations.listed)
        self.behind = (self.size + len(self.varied)) * equations.n if equations.mixed else 0
        self.slots = {name: slot for slot, name in enumerate(equations.parameters, start=equations.dimension)}
        counts = [equations.kind_of.count(k) for k in range(len(equations.nodes))]
        parts = zip(equations.nodes, self.spans("i", "NODES", counts), strict=True)
        self.kinds = tuple(NodeKindLayout(node, k, part) for k, (node, part) in enumerate(parts))
        numbers, nodes = Counter(joint_numbers(equations)), equations.nodes
        templates = [pair for layer in equations.listed for pair in layer.edge_of]
        shares = [numbers[k] for k in range(len(templates))]
        ends = zip(templates, self.spans("e", "target.size", shares), strict=True)
        self.joints = tuple(Joint(edge, nodes[a], nodes[b], part) for ((a, b), edge), part in ends)

    def spans(self, index: str, stop: str, counts: Sequence[int]) -> list[Span]:
        """The parts of a numbering that have one template each, one after another; a single part is the whole."""
        return [span(index, stop)] if len(counts) == 1 else parts(index, counts)

    @property
    def rows(self) -> list[tuple[Span, Expression]]:
        """Loops over all states, one for those with a time slope of one meaning, and the place of a state."""
        return [(span("i", "NODES"), self.place(c)) for c in range(self.size)]

    @property
    def measured(self) -> list[tuple[Span, Expression, float | None]]:
        """Loops over all states, the place of a state, and the period of the states of a loop if they are angles."""
        if len(alike := {period for periods in self.periods for period in periods}) == 1:
            (common,) = alike
            return [(span, place, common) for span, place in self.rows]
        kinds = zip(self.kinds, self.periods, strict=True)
        return [(kind.span, self.place(c), period) for kind, own in kinds for c, period in enumerate(own)]

    def row_of(self, c: int) -> int:
        """Which of the `rows` has state c of the nodes."""
        return c

    def place(self, c: int, index: str = "i") -> Expression:
        """Where state c of a node stands."""
        return c * Name("NODES") + index

    def parameter(self, number: int, index: str = "i") -> Expression:
        """Where a node has its own value of one of the parameters that differ."""
        return Number(self.slots[f"{self.varied[number]}_1"]) + index

    def read(self, node: Node, base: str, suffix: str = "", index: str = "i", prefix: str = "") -> list[Statement]:
        """Load the states of one node from an array or a part of the workspace."""
        places = [self.place(c, index) for c in range(len(node.state))]
        loads = [Load("y", at) if base == "y" else Load("dense", plus(Name(base), at)) for at in places]
        return [let(f"{prefix}{s.name}{suffix}", load) for s, load in zip(node.state, loads, strict=True)]

    def own(self, used: Container[sp.Symbol]) -> list[Assign]:
        """Load the parameters that a node has for itself, those `used`."""
        return [let(name, Load("p", self.parameter(k))) for k, name in enumerate(self.varied) if real(name) in used]

    def of_source(self, edge: Edge, used: Container[sp.Symbol], index: str = "j") -> list[Assign]:
        """Load the parameters that a link takes of its source, those `used`."""
        taken = [own.name for s, own in edge.theirs if s in used]
        return [let(f"{name}_there", Load("p", self.parameter(self.varied.index(name), index))) for name in taken]

    def of_link(self, edge: Edge, used: Container[sp.Symbol], index: str = "j") -> list[Assign]:
        """Load the parameters `used` that differ: those of the target, those of the source, and those of the link."""
        places = ((name, Number(self.behind + k * self.links) + "e") for k, name in enumerate(self.numbered))
        numbers = [let(name, Load("p", Load("where", at, None))) for name, at in places if real(name) in used]
        return [*self.own(used), *self.of_source(edge, used, index), *numbers]

    def entry(self, slot: str, a: int, b: int) -> Expression:
        """Where an entry of a node's or a link's block stands in a matrix, by the array of its slots."""
        length, index = ("NODES", "i") if slot == "node_slot" else ("target.size", "e")
        return Load(slot, (a * self.size + b) * Name(length) + index, None)


class MixedPlaces(StateLayout):
    """Nodes of several kinds: their states stand where the array `where` says."""

    def spans(self, index: str, stop: str, counts: Sequence[int]) -> list[Span]:
        """Parts that follow each other through a numbering."""
        return parts(index, counts)

    @property
    def rows(self) -> list[tuple[Span, Expression]]:
        """One loop over all states."""
        return [(span("i", "DIMENSION"), Name("i"))]

    def row_of(self, c: int) -> int:
        """The only row."""
        return 0

    def place(self, c: int, index: str = "i") -> Expression:
        """Where state c of a node stands."""
        return Load("where", super().place(c, index), None)

    def parameter(self, number: int, index: str = "i") -> Expression:
        """Where a node has its own value of one of the parameters that differ."""
        return self.place(self.size + number, index)


def places(equations: Equations) -> StateLayout:
    """Return where loops find the nodes and links of a network."""
    return (MixedPlaces if equations.mixed else StateLayout)(equations)


def link_ends(edge: Edge, weight: str, source: str = "j") -> list[Statement]:
    """The two ends of a link and its weight, by what they are called; a function of the weight alone needs a register."""
    i, j, w = (Load(array, Name("e"), None) for array in ("target", "source", "weights"))
    parts = (part for e in edge.expressions for part in e.atoms(sp.Function, sp.Pow))
    taken = [part.args[0] for part in parts] + [c.lhs - c.rhs for e in edge.expressions for c in e.atoms(Relational)]
    alone = any(argument.free_symbols == {edge.weight} for argument in taken)
    return [whole("i", i), whole(source, j), let(weight, call("broadcast", w, "WIDTH") if alone else w)]


def named(joint: Joint) -> dict[sp.Symbol, sp.Symbol]:
    """Return what the states at both ends of a link, and parameters of its source, are called in its loop."""
    ends = ((joint.edge.here, joint.target, "_here"), (joint.edge.there, joint.source, "_there"))
    states = {
        s: real(f"{own.name}{suffix}")
        for symbols, node, suffix in ends
        for s, own in zip(symbols, node.state, strict=True)
    }
    return states | theirs(joint.edge)


def theirs(edge: Edge) -> dict[sp.Symbol, sp.Symbol]:
    """Return what the parameters are called that a link takes of its source."""
    return {s: real(f"{own.name}_there") for s, own in edge.theirs}


def joint_numbers(equations: Equations) -> list[int]:
    """Return which joint each listed link is of, by its number."""
    found, first = list[int](), 0
    for layer in equations.listed:
        number = {ends: k for k, (ends, _) in enumerate(layer.edge_of, start=first)}
        alike = len(number) == 1
        found += [first] * len(layer.links) if alike else [number[equations.ends(link)] for link in layer.links]
        first += len(number)
    return found


def by_kind(equations: Equations) -> list[int]:
    """Return the nodes (0-based) in the order in which a kernel numbers them: kind after kind."""
    return sorted(range(equations.n), key=equations.kind_of.__getitem__)


def by_joint(equations: Equations) -> tuple[Link, ...]:
    """Return the listed links in the order in which a kernel numbers them: joint after joint, of each the first of all nodes.

    Neighbours in this order add to different nodes, so that no addition waits for the one before.
    """
    return tuple(link for link, _ in _by_joint(equations))


def _by_joint(equations: Equations) -> list[tuple[Link, Layer]]:
    links = ((link, layer) for layer in equations.listed for link in layer.links)
    pairs, numbers, seen = list(links), joint_numbers(equations), Counter[tuple[int, int]]()
    keys = list[tuple[int, int]]()
    for number, (link, _) in zip(numbers, pairs, strict=True):
        keys.append((number, seen[number, link[0]]))
        seen[number, link[0]] += 1
    return [pairs[k] for k in sorted(range(len(pairs)), key=keys.__getitem__)]


def link_table(equations: Equations) -> np.ndarray:
    """Return (parameters with a number for each link) * links slots of a bank, -1 for links of other layers."""
    slots = {name: k for k, name in enumerate(equations.parameters, start=equations.dimension)}
    links = _by_joint(equations) if equations.numbered else []
    found = [
        slots[layer.name(name, link)] if name in layer.varied else -1
        for name in equations.numbered
        for link, layer in links
    ]
    return np.array(found, np.int64)


def table(equations: Equations) -> np.ndarray:
    """Return (most states of a node + parameters with a value for each node) * n slots of a bank, -1 where none."""
    size = max(len(node.state) for node in equations.nodes)
    slots = {name: k for k, name in enumerate(equations.parameters, start=equations.dimension)}
    found = np.full((size + len(equations.varied), equations.n), -1, np.int64)
    places = equations.places
    for number, i in enumerate(by_kind(equations)):
        found[: len(places[i]), number] = places[i]
        for row, name in enumerate(equations.varied, start=size):
            found[row, number] = slots.get(f"{name}_{i + 1}", -1)
    return found.reshape(-1)
