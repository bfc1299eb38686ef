"""Where the loops of a kernel find what belongs to a node and to a link.

Nodes of one kind are numbered as they are, and state c of node i stands at c*NODES + i.  Nodes of several kinds are numbered
kind after kind and links joint after joint, so that one loop has nodes, or links, of one template; the array `where` says at
c*NODES + i where state c of node i stands, and in further rows which parameters the node has for itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link
from synchain.models.mechanics.components import Edge, Node

from ..program.passes import Body

__all__ = ["Joint", "Kind", "Places", "by_joint", "by_kind", "joint_numbers", "named", "table"]


@dataclass(frozen=True, slots=True)
class Kind:
    """The nodes of one kind: their template, its number, and the head of the loop over them."""

    node: Node
    number: int
    head: str


@dataclass(frozen=True, slots=True)
class Joint:
    """The links of one template, between nodes `target` and `source`, and the head of the loop over them."""

    edge: Edge
    target: Node
    source: Node
    head: str


class Places:
    """The texts by which loops over the nodes and links of a network read and write."""

    def __init__(self, equations: Equations) -> None:
        self.equations, self.mixed = equations, equations.mixed
        self.size = max(len(node.state) for node in equations.nodes)
        self.kinds, self.joints = _kinds(equations), _joints(equations)
        self.slots: dict[str, int] = {}
        if equations.varied:
            self.slots = {name: slot for slot, name in enumerate(equations.parameters, start=equations.dimension)}

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Loops over all states for what is done to each alike: the head of each, and the place of a state."""
        if self.mixed:
            return [("for i in range(DIMENSION):", "i")]
        return [("for i in range(NODES):", f"{c}*NODES + i") for c in range(self.size)]

    def place(self, c: int, index: str = "i") -> str:
        """Where state c of a node stands."""
        return f"where[{c}*NODES + {index}]" if self.mixed else f"{c}*NODES + {index}"

    def read(self, node: Node, base: str, suffix: str = "", index: str = "i", prefix: str = "") -> list[str]:
        """Load the states of one node from an array or a part of the workspace."""
        array, offset = ("y", "") if base == "y" else ("dense", f"{base} + ")
        return [
            f"{prefix}{s.name}{suffix} = load({array}, {offset}{self.place(c, index)}, WIDTH)"
            for c, s in enumerate(node.state)
        ]

    def own(self, body: Body) -> list[str]:
        """Load the parameters that a node has for itself, those that a body uses."""
        used = {s.name for s in body.symbols}
        lines = []
        for row, name in enumerate(self.equations.varied, start=self.size):
            if name in used:
                slot = f"where[{row}*NODES + i]" if self.mixed else f"{self.slots[f'{name}_1']} + i"
                lines.append(f"{name} = load(p, {slot}, WIDTH)")
        return lines

    def entry(self, slot: str, a: int, b: int) -> str:
        """Where an entry of a node's or a link's block stands in a matrix, by the array of its slots."""
        length, index = ("NODES", "i") if slot == "node_slot" else ("target.size", "e")
        return f"{slot}[{a * self.size + b}*{length} + {index}]"

    def ends(self, edge: Edge) -> list[str]:
        """The two ends of a link and its weight."""
        return ["i, j = target[e], source[e]", f"{edge.weight.name} = weights[e]"]


def named(joint: Joint) -> dict[sp.Symbol, sp.Symbol]:
    """Return what the states at both ends of a link are called in its loop."""
    ends = ((joint.edge.here, joint.target, "_here"), (joint.edge.there, joint.source, "_there"))
    return {
        s: sp.Symbol(f"{own.name}{suffix}", real=True)
        for symbols, node, suffix in ends
        for s, own in zip(symbols, node.state, strict=True)
    }


def _kinds(equations: Equations) -> tuple[Kind, ...]:
    counts = [equations.kind_of.count(k) for k in range(len(equations.nodes))]
    heads = _heads("i", counts) if equations.mixed else ["for i in range(NODES):"]
    return tuple(Kind(node, k, head) for k, (node, head) in enumerate(zip(equations.nodes, heads, strict=True)))


def _joints(equations: Equations) -> tuple[Joint, ...]:
    if not equations.links:
        return ()
    numbers, nodes = joint_numbers(equations), equations.nodes
    counts = [numbers.count(k) for k in range(len(equations.edge_of))]
    heads = _heads("e", counts) if equations.mixed else ["for e in range(target.size):"]
    return tuple(
        Joint(edge, nodes[a], nodes[b], head) for ((a, b), edge), head in zip(equations.edge_of, heads, strict=True)
    )


def _heads(index: str, counts: Sequence[int]) -> list[str]:
    """Heads of loops that follow each other through a numbering."""
    ends = list(accumulate(counts, initial=0))
    return [f"for {index} in range({a}, {b}):" for a, b in pairwise(ends)]


def joint_numbers(equations: Equations) -> list[int]:
    """Return which joint each link is of, by its number."""
    number = {ends: k for k, (ends, _) in enumerate(equations.edge_of)}
    return [number[equations.ends(link)] for link in equations.links]


def by_kind(equations: Equations) -> list[int]:
    """Return the nodes (0-based) in the order in which a kernel numbers them: kind after kind."""
    return sorted(range(equations.n), key=equations.kind_of.__getitem__)


def by_joint(equations: Equations) -> tuple[Link, ...]:
    """Return the links in the order in which a kernel numbers them: joint after joint."""
    pairs = zip(joint_numbers(equations), equations.links, strict=True)
    return tuple(link for _, link in sorted(pairs, key=lambda pair: pair[0]))


def table(equations: Equations) -> np.ndarray:
    """Return `where`, (most states of a node + parameters with a value for each node) * n slots of a bank, -1 where none."""
    size = max(len(node.state) for node in equations.nodes)
    slots = {name: k for k, name in enumerate(equations.parameters, start=equations.dimension)}
    found = np.full((size + len(equations.varied), equations.n), -1, np.int64)
    places = equations.places
    for number, i in enumerate(by_kind(equations)):
        found[: len(places[i]), number] = places[i]
        for row, name in enumerate(equations.varied, start=size):
            found[row, number] = slots.get(f"{name}_{i + 1}", -1)
    return found.reshape(-1)
