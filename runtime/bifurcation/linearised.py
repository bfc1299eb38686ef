"""The rates of a network, its Jacobian and its mass matrix as numbers: templates evaluated for all nodes, and links, at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp
from scipy import sparse

from synchain.models.dynamics.equations import Equations, Layer
from synchain.models.graphs.links import Link
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Block, Edge, Node


@dataclass(frozen=True, slots=True)
class TemplateJacobian:
    """What the nodes of one kind, or the links of one template, add."""

    # rates and entries of blocks, one after the other, as a function of states and parameters
    function: Callable[..., list[float | np.ndarray]]
    own: np.ndarray  # (count, p): places of the states of each node, or of each link's target
    # (count, p): places by which rates are differentiated: `own`, and for links those of the source
    others: tuple[np.ndarray, ...]
    numbers: tuple[float | np.ndarray, ...]  # (count,): values of the parameters
    # sizes of the terms of the rates, as a function of states and parameters
    sizes: Callable[..., list[float | np.ndarray]]

    @classmethod
    def of(
        cls,
        symbols: list[sp.Symbol],
        rates: tuple[sp.Expr, ...],
        blocks: list[Block],
        places: tuple[np.ndarray, ...],
        numbers: list[float | np.ndarray],
    ) -> TemplateJacobian:
        """Compile a template."""
        entries = [e for block in blocks for row in block for e in row]
        states = frozenset(symbols[: sum(table.shape[1] for table in places)])
        made = sp.lambdify(symbols, [*rates, *entries], ["scipy", "numpy"])
        sizes = sp.lambdify(symbols, [term_size(e, states) for e in rates], ["scipy", "numpy"], cse=True)
        return cls(made, places[0], places, tuple(numbers), sizes)

    def __call__(self, state: np.ndarray) -> np.ndarray:
        """The values (count, all) of rates and entries at a state of the network."""
        return self._values(self.function, state)

    def term_sizes(self, state: np.ndarray) -> np.ndarray:
        """The sizes (count, p) of the terms of the rates at a state of the network."""
        return np.nan_to_num(self._values(self.sizes, state))  # 0 times an infinite slope

    def _values(self, function: Callable[..., list[float | np.ndarray]], state: np.ndarray) -> np.ndarray:
        states = [column for places in self.others for column in state[places].T]
        with np.errstate(all="ignore"):  # far from the start there may be no numbers
            found = function(*states, *self.numbers)
        return np.stack([np.broadcast_to(np.asarray(x, dtype=float), len(self.own)) for x in found], axis=1)


@dataclass(frozen=True, slots=True)
class Linearised:
    """The equations M d(state)/dt = r(state) of a network without a drive."""

    dimension: int  # number of states
    parts: tuple[TemplateJacobian, ...]  # what nodes and links add to r and to its Jacobian
    masses: tuple[TemplateJacobian, ...]  # what they add to M, as Jacobian blocks; empty if M is the identity

    @classmethod
    def of(cls, equations: Equations, values: Mapping[str, float]) -> Linearised:
        """Compile equations with the values of their parameters."""
        sources = [*_nodes(equations, values), *_links(equations, values)]
        parts = tuple(
            TemplateJacobian.of(symbols, rates, blocks, places, numbers)
            for symbols, rates, blocks, _, places, numbers in sources
        )
        masses = tuple(
            TemplateJacobian.of(symbols, (), masses, places, numbers)
            for symbols, _, _, masses, places, numbers in sources
            if masses and equations.inertial
        )
        return cls(equations.dimension, parts, masses)

    def rates(self, state: np.ndarray) -> np.ndarray:
        """Return r (dimension,) at a state."""
        rates = np.zeros(self.dimension)
        for part in self.parts:
            size = part.own.shape[1]
            np.add.at(rates, part.own, part(state)[:, :size])
        return rates

    def term_sizes(self, state: np.ndarray) -> np.ndarray:
        """Return the sizes (dimension,) of the terms of r at a state: r is zero to rounding if it is far smaller."""
        sizes = np.zeros(self.dimension)
        for part in self.parts:
            np.add.at(sizes, part.own, part.term_sizes(state))
        return sizes

    def jacobian(self, state: np.ndarray) -> sparse.csc_array:
        """Return the derivative of r by the state, in sparse form."""
        return self._assembled(self.parts, state, 1)

    def mass(self, state: np.ndarray) -> sparse.csc_array | None:
        """Return M in sparse form, None if it is the identity."""
        return self._assembled(self.masses, state, 0) if self.masses else None

    def _assembled(self, parts: tuple[TemplateJacobian, ...], state: np.ndarray, skipped: int) -> sparse.csc_array:
        """The blocks of some parts, which stand behind `skipped` rows of rates."""
        rows, columns, values = [], [], []
        for part in parts:
            size, found = part.own.shape[1], part(state)
            for k, others in enumerate(part.others):
                first = size * (skipped + k * size)
                block = found[:, first : first + size * size].reshape(-1, size, size)
                rows.append(np.broadcast_to(part.own[:, :, None], block.shape).ravel())
                columns.append(np.broadcast_to(others[:, None, :], block.shape).ravel())
                values.append(block.ravel())
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sparse.csc_array(sparse.coo_array(entries, shape=(self.dimension, self.dimension)))


def term_size(e: sp.Expr, states: frozenset[sp.Symbol]) -> sp.Expr:
    """The sum of the sizes of the terms of an expression of some states, which rounding is relative to: 2 + |x| of 2 - x.

    A function of u has the size |f(u)| + |f'(u)| times the size of u, which the rounding of u moves it by.
    """
    if e.is_Add:
        return sp.Add(*(term_size(term, states) for term in e.args))
    if e.is_Mul:
        return sp.Mul(*(term_size(factor, states) for factor in e.args))
    if isinstance(e, sp.Piecewise):
        return sp.Piecewise(*((term_size(branch, states), condition) for branch, condition in e.args))
    size, u = sp.Abs(e), sp.Dummy("u", real=True)
    for k, argument in enumerate(e.args):
        if isinstance(argument, sp.Expr) and argument.free_symbols & states:
            slope = derivative(e.func(*e.args[:k], u, *e.args[k + 1 :]), u).xreplace({u: argument})
            size += sp.Abs(slope) * term_size(argument, states)
    return size


Source = tuple[
    list[sp.Symbol], tuple[sp.Expr, ...], list[Block], list[Block], tuple[np.ndarray, ...], list[float | np.ndarray]
]
"""Symbols of states and parameters, rates, their derivatives, masses, places and numbers of a template."""


def _nodes(equations: Equations, values: Mapping[str, float]) -> Iterator[Source]:
    """The nodes, kind by kind."""
    for kind, node in enumerate(equations.nodes):
        nodes = [i for i, k in enumerate(equations.kind_of) if k == kind]
        places = np.array([equations.places[i] for i in nodes])
        numbers = [_of_nodes(equations, values, s.name, nodes) for s in node.parameters]
        yield [*node.state, *node.parameters], node.rhs, [node.jacobian()], [_inertia(node)], (places,), numbers


def _inertia(node: Node) -> Block:
    """The masses of a node, the identity if it has none."""
    size = len(node.state)
    return node.inertia or tuple(tuple(sp.Integer(int(i == j)) for j in range(size)) for i in range(size))


def _of_nodes(equations: Equations, values: Mapping[str, float], name: str, nodes: list[int]) -> float | np.ndarray:
    """A parameter, of each of some nodes if it has a value for each."""
    if name not in equations.varied:
        return values[name]
    return np.array([values[str(NodeName(name, i))] for i in nodes])


def _links(equations: Equations, values: Mapping[str, float]) -> Iterator[Source]:
    """The links, template by template."""
    for layer in equations.layers:
        for ends, edge in layer.edge_of:
            links = [link for link in layer.links if equations.ends(link) == ends]
            if links:
                yield _link(equations, values, layer, edge, links)


def _link(equations: Equations, values: Mapping[str, float], layer: Layer, edge: Edge, links: list[Link]) -> Source:
    """The links of one template."""
    targets, sources = [i for i, _, _ in links], [j for _, j, _ in links]
    places = tuple(np.array([equations.places[i] for i in nodes]) for nodes in (targets, sources))
    numbers: list[float | np.ndarray] = [np.array([float(weight) for _, _, weight in links])]
    for s in edge.parameters:
        if s.name in layer.varied:
            numbers.append(np.array([values[layer.name(s.name, link)] for link in links]))
        else:
            numbers.append(_of_nodes(equations, values, s.name, targets))
    numbers += [_of_nodes(equations, values, of.name, sources) for _, of in edge.theirs]
    symbols = [*edge.here, *edge.there, edge.weight, *edge.parameters, *(s for s, _ in edge.theirs)]
    return symbols, edge.rhs, [edge.jacobian_here(), edge.jacobian_there()], list(edge.inertia), places, numbers
