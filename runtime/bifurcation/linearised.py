"""The equations M(x) dx/dt = r(x) of an undriven network as numbers: r, its Jacobian dr/dx and the mass matrix M.

All nodes of a kind share their expressions, and so do all links of a layer between two kinds.  Each such template is
compiled once to a NumPy function and evaluated for all of its nodes or links at once.  r is the sum of what nodes and links
add to it; Jacobian and mass matrix are sums of small dense blocks, assembled into sparse matrices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
import sympy as sp
from scipy import sparse

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics.calculus import NOTHING, derivative
from synchain.models.mechanics.components import Block

Values = Callable[..., list[float | np.ndarray]]
"""Expressions as a function of states and parameters, each a number or an array (count,)."""

Parameter: TypeAlias = str | tuple[str, ...] | np.ndarray
"""The name of a parameter, its names at all nodes or links, or the weights of links."""


class TermTemplate(NamedTuple):
    """The expressions of all nodes of a kind, or of all links of a layer between two kinds; `count` of them."""

    states: list[sp.Symbol]  # of the node; of the link's target, then of its source
    others: list[sp.Symbol]  # weight and parameters
    rates: tuple[sp.Expr, ...]  # (p,): added to the rates of a node
    masses: list[Block]  # (p, p) each: what is added to M, a block for each array of `indices`
    # (count, p) each: indices of the node's states in the state of the network; for links of the target's, of the source's
    indices: tuple[np.ndarray, ...]
    parameters: list[Parameter]

    def along(self) -> TermTemplate:
        """Return the template of r_x u, where the direction u follows the state of the network in one vector."""
        directions = [sp.Symbol(f"along {s.name}", real=True) for s in self.states]
        pairs = [*zip(self.states, directions, strict=True)]
        rates = tuple(sp.Add(*(derivative(e, s) * u for s, u in pairs)) for e in self.rates)
        if self.others[: len(directions)] == directions:  # a second derivative along the same direction
            return self._replace(rates=rates)
        # The directions are further states by which nothing is differentiated.
        return self._replace(others=[*directions, *self.others], rates=rates)


@dataclass(frozen=True, slots=True)
class TemplateFunction:
    """A compiled template: rates and matrix entries of all its nodes or links at a state of the network."""

    rates: Values
    term_sizes: Values  # `term_size` of each rate
    entries: Values  # entries of a sparse matrix, those that vanish identically left out
    inputs: tuple[np.ndarray, ...]  # (count, p) each: indices of the states among the arguments
    pattern: tuple[np.ndarray, np.ndarray]  # (entries, count) each: row and column of each entry
    names: tuple[Parameter, ...]
    parameters: tuple[float | np.ndarray, ...] = ()  # one value for all, or (count,)

    @classmethod
    def of(cls, template: TermTemplate, dimension: int, blocks: Sequence[Block]) -> TemplateFunction:
        """Compile the rates of a template, and the blocks of a matrix, one for each array of indices."""
        symbols, indices = [*template.states, *template.others], template.indices
        places = [
            (k, i, j)
            for k, block in enumerate(blocks)
            for i, row in enumerate(block)
            for j, entry in enumerate(row)
            if entry != 0
        ]
        rows, columns = ([indices[0][:, i] for _, i, _ in places], [indices[k][:, j] for k, _, j in places])
        # Directions stand before the parameters; they are taken from the second half of the vector.
        directions = len(template.others) - len(template.parameters)
        inputs = (*indices, *(each + dimension for each in indices)) if directions else indices
        shape, states = (len(places), len(indices[0])), frozenset(template.states)
        sized = template.rates if blocks else ()  # higher derivatives have no equations to solve
        return cls(
            sp.lambdify(symbols, template.rates, ["scipy", "numpy"]),
            sp.lambdify(symbols, [term_size(e, states) for e in sized], ["scipy", "numpy"], cse=True),
            sp.lambdify(symbols, [blocks[k][i][j] for k, i, j in places], ["scipy", "numpy"]),
            inputs,
            (np.reshape(rows, shape), np.reshape(columns, shape)),
            tuple(template.parameters),
        )

    def at(self, values: Mapping[str, float]) -> TemplateFunction:
        """Return the same functions with numbers for the parameters."""

        def number(name: Parameter) -> float | np.ndarray:
            if isinstance(name, str):
                return values[name]
            return np.array([values[each] for each in name]) if isinstance(name, tuple) else name

        return replace(self, parameters=tuple(map(number, self.names)))

    def evaluate(self, function: Values, state: np.ndarray) -> np.ndarray:
        """Evaluate one of the functions at a state of the network. Shapes: returns (expressions, count)."""
        states = [column for indices in self.inputs for column in state[indices].T]
        with np.errstate(all="ignore"):  # far from the start rates may overflow or have no value
            results = function(*states, *self.parameters)
        columns = np.empty((len(results), len(self.inputs[0])))
        for column, result in zip(columns, results, strict=True):
            column[:] = result
        return columns


@dataclass(frozen=True, slots=True)
class Linearised:
    """The equations M(x) dx/dt = r(x) of a network without a drive."""

    equations: Equations
    dimension: int  # number of states
    rate_templates: tuple[TemplateFunction, ...]  # rates and blocks of the Jacobian
    mass_templates: tuple[TemplateFunction, ...]  # blocks of M alone; empty if M is the identity
    templates: tuple[TermTemplate, ...]
    constant_mass: bool  # False if M depends on the state

    @classmethod
    def of(cls, equations: Equations, values: Mapping[str, float]) -> Linearised:
        """Compile equations with the values of their parameters."""
        return _compiled(equations).at(values)

    def at(self, values: Mapping[str, float]) -> Linearised:
        """Return the equations with other values of their parameters; nothing is compiled."""
        rates, masses = (tuple(each.at(values) for each in part) for part in (self.rate_templates, self.mass_templates))
        return replace(self, rate_templates=rates, mass_templates=masses)

    def sized(self, values: Mapping[str, float]) -> Linearised:
        """Return equations whose Jacobian holds the `term_size` of each entry, to which its rounding is relative."""

        def sizes(template: TermTemplate) -> list[Block]:
            states = frozenset(template.states)
            return [tuple(tuple(term_size(e, states) for e in row) for row in block) for block in _slopes(template)]

        rates = (TemplateFunction.of(each, self.dimension, sizes(each)).at(values) for each in self.templates)
        return replace(self, rate_templates=tuple(rates))

    def along(self, order: int) -> Linearised:
        """Return the derivative of r along u of an order, r_x u or r_xx u u, as a function of the vector (x, u).

        The first one has a Jacobian by x, r_xx u. Parameters have no values before `at`.
        """
        return _along(self.equations, order)

    def rates(self, state: np.ndarray) -> np.ndarray:
        """Return r (dimension,) at a state."""
        sums = np.zeros(self.dimension)
        for each in self.rate_templates:
            np.add.at(sums, each.inputs[0].T, each.evaluate(each.rates, state))
        return sums

    def term_sizes(self, state: np.ndarray) -> np.ndarray:
        """Return the sizes (dimension,) of the terms of r at a state: r is zero to rounding if it is far smaller."""
        sums = np.zeros(self.dimension)
        for each in self.rate_templates:  # 0 times an infinite slope is no number
            np.add.at(sums, each.inputs[0].T, np.nan_to_num(each.evaluate(each.term_sizes, state)))
        return sums

    def jacobian(self, state: np.ndarray) -> sparse.csc_array:
        """Return the derivative of r by the state, in sparse form."""
        return self._assemble(self.rate_templates, state)

    def dense_jacobian(self, state: np.ndarray) -> np.ndarray:
        """Return the derivative of r by the state; of few states a sparse form takes more time than its entries."""
        matrix = np.zeros((self.dimension, self.dimension))
        for each in self.rate_templates:
            np.add.at(matrix, each.pattern, each.evaluate(each.entries, state))
        return matrix

    def mass(self, state: np.ndarray) -> sparse.csc_array | None:
        """Return M in sparse form, None if it is the identity."""
        return self._assemble(self.mass_templates, state) if self.mass_templates else None

    def _assemble(self, templates: tuple[TemplateFunction, ...], state: np.ndarray) -> sparse.csc_array:
        """Add the entries of templates into a matrix."""
        entries = np.concatenate([each.evaluate(each.entries, state).ravel() for each in templates])
        rows, columns = (np.concatenate([each.pattern[k].ravel() for each in templates]) for k in (0, 1))
        return sparse.csc_array(sparse.coo_array((entries, (rows, columns)), shape=(self.dimension, self.dimension)))


@lru_cache(maxsize=32)
def _compiled(equations: Equations) -> Linearised:
    """Compile equations; their parameters have no values before `at`."""
    templates = (*_node_templates(equations), *_link_templates(equations))
    heavy = [each for each in templates if each.masses] if equations.inertial else []
    masses = (TemplateFunction.of(each._replace(rates=()), equations.dimension, each.masses) for each in heavy)
    rates = (TemplateFunction.of(each, equations.dimension, _slopes(each)) for each in templates)
    return Linearised(equations, equations.dimension, tuple(rates), tuple(masses), templates, equations.constant_mass)


@lru_cache(maxsize=32)
def _along(equations: Equations, order: int) -> Linearised:
    """Compile the derivative of an order of the rates along a direction."""
    network = _compiled(equations)
    templates = network.templates
    for _ in range(order):
        templates = tuple(each.along() for each in templates)
    blocks = [_slopes(each) if order == 1 else [] for each in templates]
    pairs = zip(templates, blocks, strict=True)
    functions = (TemplateFunction.of(each, network.dimension, slopes) for each, slopes in pairs)
    return replace(network, rate_templates=tuple(functions))


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


def _slopes(template: TermTemplate) -> list[Block]:
    """Return the derivatives of the rates by the states of each array of indices."""
    ends = np.cumsum([0, *(each.shape[1] for each in template.indices)])
    groups = [template.states[a:b] for a, b in pairwise(ends)]
    # an infinite slope at rest is refused, unlike one that a motion only passes (NOTHING)
    exact = {NOTHING: sp.S.Zero}
    return [tuple(tuple(derivative(e, s).xreplace(exact) for s in group) for e in template.rates) for group in groups]


def _node_templates(equations: Equations) -> Iterator[TermTemplate]:
    """Yield the template of each kind of nodes."""
    for kind, node in enumerate(equations.nodes):
        nodes = [i for i, k in enumerate(equations.kind_of) if k == kind]
        states = np.array([equations.places[i] for i in nodes])
        parameters = [_at_nodes(equations, s.name, nodes) for s in node.parameters]
        size = len(node.state)
        inertia = node.inertia or tuple(tuple(sp.Integer(int(i == j)) for j in range(size)) for i in range(size))
        yield TermTemplate([*node.state], [*node.parameters], node.rhs, [inertia], (states,), parameters)


def _link_templates(equations: Equations) -> Iterator[TermTemplate]:
    """Yield the template of the links of each layer between each two kinds."""
    equations.expect_pairs("equilibria")
    for layer in equations.layers:
        for ends, edge in layer.edge_of:
            links = [link for link in layer.links if equations.ends(link) == ends]
            if not links:
                continue
            targets, sources = [i for i, _, _ in links], [j for _, j, _ in links]
            states = tuple(np.array([equations.places[i] for i in nodes]) for nodes in (targets, sources))
            # The weight; parameters of the link, where the layer varies them, else of the target; those of the source.
            parameters: list[Parameter] = [np.array([float(weight) for _, _, weight in links])]
            for s in edge.parameters:
                by_link = tuple(layer.name(s.name, link) for link in links) if s.name in layer.varied else None
                parameters.append(by_link or _at_nodes(equations, s.name, targets))
            parameters += [_at_nodes(equations, of.name, sources) for _, of in edge.theirs]
            others = [edge.weight, *edge.parameters, *(s for s, _ in edge.theirs)]
            yield TermTemplate([*edge.here, *edge.there], others, edge.rhs, list(edge.inertia), states, parameters)


def _at_nodes(equations: Equations, name: str, nodes: list[int]) -> Parameter:
    """Return the name of a parameter, or its names at some nodes if it varies between nodes."""
    return tuple(str(NodeName(name, i)) for i in nodes) if name in equations.varied else name
