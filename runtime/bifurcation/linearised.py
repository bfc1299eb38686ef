"""The equations M(x) dx/dt = r(x) of an undriven network as numbers: r, its Jacobian dr/dx and the mass matrix M.

All nodes of a kind share their expressions, and so do all links of a layer between two kinds.  Each such template is
compiled once to a NumPy function and evaluated for all of its nodes or links at once.  r is the sum of what nodes and links
add to it; Jacobian and mass matrix are sums of small dense blocks, assembled into sparse matrices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import sympy as sp
from scipy import sparse

from synchain.models.dynamics.equations import Equations, Layer
from synchain.models.graphs.links import Link
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Block, Edge

Values = Callable[..., list[float | np.ndarray]]
"""Expressions as a function of states and parameters, each a number or an array (count,)."""


class TermTemplate(NamedTuple):
    """The expressions of all nodes of a kind, or of all links of a layer between two kinds; `count` of them."""

    symbols: list[sp.Symbol]  # of the states, then of the parameters
    rates: tuple[sp.Expr, ...]  # (p,): added to the rates of a node
    slopes: list[Block]  # (p, p) each: derivatives of the rates by the states of each array of `states`
    masses: list[Block]  # (p, p) each: what is added to M, block by block as `slopes`
    # (count, p) each: indices of the node's states in the state of the network; for links of the target's, of the source's
    states: tuple[np.ndarray, ...]
    parameters: list[float | np.ndarray]  # one value for all, or (count,)


@dataclass(frozen=True, slots=True)
class TemplateFunction:
    """A compiled template: rates and blocks of all its nodes or links at a state of the network."""

    values: Values  # rates, then the entries of the blocks row by row
    term_sizes: Values  # `term_size` of each rate
    states: tuple[np.ndarray, ...]  # as in `TermTemplate`
    parameters: tuple[float | np.ndarray, ...]

    @classmethod
    def of(cls, template: TermTemplate, rates: tuple[sp.Expr, ...], blocks: list[Block]) -> TemplateFunction:
        """Compile rates and blocks of a template."""
        symbols, entries = template.symbols, [e for block in blocks for row in block for e in row]
        states = frozenset(symbols[: sum(indices.shape[1] for indices in template.states)])
        values = sp.lambdify(symbols, [*rates, *entries], ["scipy", "numpy"])
        sizes = sp.lambdify(symbols, [term_size(e, states) for e in rates], ["scipy", "numpy"], cse=True)
        return cls(values, sizes, template.states, tuple(template.parameters))

    @property
    def rows(self) -> np.ndarray:
        """Indices (count, p) of the rates that are added to."""
        return self.states[0]

    def evaluate(self, function: Values, state: np.ndarray) -> np.ndarray:
        """Evaluate one of the functions at a state of the network. Shapes: returns (count, expressions)."""
        columns = [column for indices in self.states for column in state[indices].T]
        with np.errstate(all="ignore"):  # far from the start rates may overflow or have no value
            results = function(*columns, *self.parameters)
        return np.stack([np.broadcast_to(np.asarray(x, dtype=float), len(self.rows)) for x in results], axis=1)


@dataclass(frozen=True, slots=True)
class Linearised:
    """The equations M(x) dx/dt = r(x) of a network without a drive."""

    dimension: int  # number of states
    rate_templates: tuple[TemplateFunction, ...]  # rates and blocks of the Jacobian
    mass_templates: tuple[TemplateFunction, ...]  # blocks of M alone; empty if M is the identity

    @classmethod
    def of(cls, equations: Equations, values: Mapping[str, float]) -> Linearised:
        """Compile equations with the values of their parameters."""
        templates = [*_node_templates(equations, values), *_link_templates(equations, values)]
        rates = tuple(TemplateFunction.of(each, each.rates, each.slopes) for each in templates)
        heavy = [each for each in templates if each.masses] if equations.inertial else []
        return cls(equations.dimension, rates, tuple(TemplateFunction.of(each, (), each.masses) for each in heavy))

    def rates(self, state: np.ndarray) -> np.ndarray:
        """Return r (dimension,) at a state."""
        rates = np.zeros(self.dimension)
        for template in self.rate_templates:
            values = template.evaluate(template.values, state)
            np.add.at(rates, template.rows, values[:, : template.rows.shape[1]])
        return rates

    def term_sizes(self, state: np.ndarray) -> np.ndarray:
        """Return the sizes (dimension,) of the terms of r at a state: r is zero to rounding if it is far smaller."""
        sizes = np.zeros(self.dimension)
        for template in self.rate_templates:
            values = template.evaluate(template.term_sizes, state)
            np.add.at(sizes, template.rows, np.nan_to_num(values))  # 0 times an infinite slope is no number
        return sizes

    def jacobian(self, state: np.ndarray) -> sparse.csc_array:
        """Return the derivative of r by the state, in sparse form."""
        return self._assemble(self.rate_templates, state, 1)

    def mass(self, state: np.ndarray) -> sparse.csc_array | None:
        """Return M in sparse form, None if it is the identity."""
        return self._assemble(self.mass_templates, state, 0) if self.mass_templates else None

    def _assemble(self, templates: tuple[TemplateFunction, ...], state: np.ndarray, skipped: int) -> sparse.csc_array:
        """Add the blocks of templates into a matrix; in their values `skipped` rows of rates come first."""
        rows, columns, entries = [], [], []
        for template in templates:
            size, values = template.rows.shape[1], template.evaluate(template.values, state)
            for k, states in enumerate(template.states):
                first = size * (skipped + k * size)
                block = values[:, first : first + size * size].reshape(-1, size, size)
                rows.append(np.broadcast_to(template.rows[:, :, None], block.shape).ravel())
                columns.append(np.broadcast_to(states[:, None, :], block.shape).ravel())
                entries.append(block.ravel())
        triplets = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
        return sparse.csc_array(sparse.coo_array(triplets, shape=(self.dimension, self.dimension)))


def term_size(e: sp.Expr, states: frozenset[sp.Symbol]) -> sp.Expr:
    """Return the sum of the sizes of an expression's terms, to which its rounding error is relative: 2 + |x| of 2 - x.

    A function of u has the size |f(u)| + |f'(u)| times the size of u, as the rounding of u moves it by the second term.
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


def _node_templates(equations: Equations, values: Mapping[str, float]) -> Iterator[TermTemplate]:
    """Yield the template of each kind of nodes."""
    for kind, node in enumerate(equations.nodes):
        nodes = [i for i, k in enumerate(equations.kind_of) if k == kind]
        states = np.array([equations.places[i] for i in nodes])
        parameters = [_at_nodes(equations, values, s.name, nodes) for s in node.parameters]
        size = len(node.state)
        inertia = node.inertia or tuple(tuple(sp.Integer(int(i == j)) for j in range(size)) for i in range(size))
        symbols = [*node.state, *node.parameters]
        yield TermTemplate(symbols, node.rhs, [node.jacobian()], [inertia], (states,), parameters)


def _link_templates(equations: Equations, values: Mapping[str, float]) -> Iterator[TermTemplate]:
    """Yield the template of the links of each layer between each two kinds."""
    for layer in equations.layers:
        for ends, edge in layer.edge_of:
            links = [link for link in layer.links if equations.ends(link) == ends]
            if links:
                yield _link_template(equations, values, layer, edge, links)


def _link_template(
    equations: Equations, values: Mapping[str, float], layer: Layer, edge: Edge, links: list[Link]
) -> TermTemplate:
    """Return the template of some links of a layer."""
    targets, sources = [i for i, _, _ in links], [j for _, j, _ in links]
    states = tuple(np.array([equations.places[i] for i in nodes]) for nodes in (targets, sources))
    # Parameters: the weight; those of the link, where the layer varies them, else of the target; those of the source.
    parameters: list[float | np.ndarray] = [np.array([float(weight) for _, _, weight in links])]
    for s in edge.parameters:
        if s.name in layer.varied:
            parameters.append(np.array([values[layer.name(s.name, link)] for link in links]))
        else:
            parameters.append(_at_nodes(equations, values, s.name, targets))
    parameters += [_at_nodes(equations, values, of.name, sources) for _, of in edge.theirs]
    symbols = [*edge.here, *edge.there, edge.weight, *edge.parameters, *(s for s, _ in edge.theirs)]
    slopes = [edge.jacobian_here(), edge.jacobian_there()]
    return TermTemplate(symbols, edge.rhs, slopes, list(edge.inertia), states, parameters)


def _at_nodes(equations: Equations, values: Mapping[str, float], name: str, nodes: list[int]) -> float | np.ndarray:
    """Return the value of a parameter: one for all, or that of each node if it varies between nodes."""
    if name not in equations.varied:
        return values[name]
    return np.array([values[str(NodeName(name, i))] for i in nodes])
