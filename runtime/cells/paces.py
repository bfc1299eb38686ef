"""Compute rates of decay, growth, turning and change of motions in all cells, from the slopes of the first nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import sympy as sp

from synchain.codegen.steps.mass_solve import turned_masses
from synchain.codegen.taylor import is_analytic, is_large
from synchain.models.dynamics.equations import Equations, Layer, Triad
from synchain.models.graphs.links import AllPairs, Link
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics.components import TIME, Block, Edge, Node

from .stiffness_rates import eigenvalue_rates, turns

# Slopes are computed for at most this number of nodes, and of links of one layer: a choice for speed.
NODES, LINKS = 50, 5000
# The change of rates is measured over this part of the shortest time of a motion: a choice far above rounding.
SHIFT = 1e-6
# Rates, and changes of rates, that NOISE tolerances of the state could cause count as errors of steps: a choice.
NOISE = 10.0
BLOCK = 4096  # number of cells that are computed at once: a choice that bounds the memory
# STEP: length of steps along the imaginary axis. ENDLESS: a larger slope counts as infinite; such a step gives 1e100
# for the infinite slope of sqrt(x) at 0.
STEP, ENDLESS = 1e-200, 1e60

Column = int | np.ndarray


class Paces(NamedTuple):
    """Rates per unit of time in each cell (cells,)."""

    # From the eigenvalues: `fastest` is the fastest decay or growth, `turning` the fastest rotation, `growth` the
    # fastest growth, `parted` the fastest decay that is far faster than the slowest motion of its node; `size` bounds
    # all eigenvalues. `going` is the relative change of the rates along the motion, 0 at rest. `fastest` is inf if a
    # rate is finite but has an infinite slope.

    fastest: np.ndarray
    turning: np.ndarray
    growth: np.ndarray
    parted: np.ndarray
    going: np.ndarray
    size: np.ndarray


@dataclass(frozen=True, slots=True)
class TemplateRates:
    """The nodes of one kind, or the links of one template, as functions of arrays."""

    # rates, and the entries of their derivatives by the states of the node, or of the link's target, row by row
    rates: Callable[..., list[float | np.ndarray]]
    slopes: Callable[..., list[float | np.ndarray]]
    # (count, p): indices of the states of each node or of each link's target; of its source, None for nodes
    states: np.ndarray
    source: np.ndarray | None
    targets: np.ndarray  # (count,): the nodes
    columns: tuple[Column, ...]  # (count,): columns among the parameters of a cell
    weights: np.ndarray | None = None  # (count,): weights of links
    share: float = 1.0  # number of links that each link represents
    # for each smoothed jump: index of a state among the arguments, and the value of this state in the middle of the
    # jump
    turned: tuple[tuple[int, Callable[..., list[float | np.ndarray]]], ...] = ()

    def arguments(self, state: np.ndarray, parameters: np.ndarray, time: np.ndarray) -> list[np.ndarray]:
        """Return states, weights, parameters and the time, each (cells, count) or (cells, 1)."""
        ends = (self.states,) if self.source is None else (self.states, self.source)
        arguments = [state[:, column] for indices in ends for column in indices.T]
        arguments += [] if self.weights is None else [self.weights]
        arguments += [parameters[:, [c] if isinstance(c, int) else c] for c in self.columns]
        return [*arguments, time[:, None]]

    def values(self, function: Callable[..., list[float | np.ndarray]], arguments: list[np.ndarray]) -> np.ndarray:
        """Return the values of a function, (cells, count, entries)."""
        shape = len(arguments[0]), len(self.states)
        with np.errstate(all="ignore"):
            entries = [np.broadcast_to(np.asarray(e, dtype=float), shape) for e in function(*arguments)]
            return self.share * np.stack(entries, axis=-1)


class Templates:
    """Rates and slopes of the first nodes of a network."""

    def __init__(self, equations: Equations) -> None:
        self.dimension = equations.dimension
        self.nodes = min(equations.n, NODES)
        self.size = max(len(node.state) for node in equations.nodes)
        slots = {name: k for k, name in enumerate(equations.parameters)}
        self.parts = (*_node_parts(equations, slots), *_link_parts(equations, slots))
        self.masses = tuple(_mass_parts(equations, slots))

    def paces(
        self,
        state: np.ndarray,
        parameters: np.ndarray,
        time: np.ndarray,
        shortest: np.ndarray,
        noise: np.ndarray | None,
    ) -> Paces:
        """Return how fast the cells of some rows move."""
        # Shapes: state (cells, dimension), parameters (cells, count), time (cells,), shortest (cells,), noise (cells,
        # dimension).
        if len(state) > BLOCK:
            each = [
                self.paces(state[k], parameters[k], time[k], shortest[k], None if noise is None else noise[k])
                for k in (slice(i, i + BLOCK) for i in range(0, len(state), BLOCK))
            ]
            return Paces(*map(np.concatenate, zip(*each, strict=True)))
        rates, blocks = self._rates(state, parameters, time), self.blocks(state, parameters, time)
        with np.errstate(all="ignore"):
            size = _sizes(blocks)
            size = np.where(np.isnan(size), np.inf, size)
            size = np.where((size == np.inf) & ~np.isfinite(rates).all(axis=1), 0.0, size)  # rates are undefined
            # Follow the motion for a short time, and compare its rates, relative to the states or to their noise.
            step = SHIFT * np.minimum(1.0 / np.maximum(size, 1e-300), shortest)
            ahead = self._rates(state + step[:, None] * rates, parameters, time + step)
            scale = np.maximum(np.abs(state), np.finfo(float).tiny) if noise is None else noise
            speed = np.nan_to_num(np.abs(rates) / scale, nan=0.0).max(axis=1)
            turn = np.nan_to_num(np.abs(ahead - rates) / scale, nan=0.0).max(axis=1) / step
            if noise is not None:
                turn = np.where(speed > NOISE * size, np.maximum(turn - NOISE * size**2, 0.0), 0.0)
            going = np.where(speed > 0.0, turn / speed, 0.0)
        return Paces(*eigenvalue_rates(blocks), going, size)

    def reach(self, state: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the distance (cells,) that the initial rates cover in the shortest time of the motion."""
        time = np.zeros(len(state))
        with np.errstate(all="ignore"):
            speed = np.abs(self._rates(state, parameters, time)).max(axis=1)
            return np.asarray(np.nan_to_num(speed / _sizes(self.blocks(state, parameters, time)), nan=0.0, posinf=0.0))

    def layers(self, state: np.ndarray, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the blocks (cells, count, p, p) of nodes and links in the middle of each smoothed jump, and near it."""
        for part in self.parts:
            for k, middle in part.turned:
                arguments = part.arguments(state, parameters, np.zeros(len(state)))
                (value,) = np.moveaxis(part.values(middle, arguments), -1, 0) / part.share
                for shift in (-1e-9, 0.0, 1e-9):
                    arguments[k] = value + shift * (1.0 + np.abs(value))
                    slopes = part.values(part.slopes, arguments).reshape(*value.shape, part.states.shape[1], -1)
                    yield (1.0 if part.source is None else 2.0) * slopes

    def _rates(self, state: np.ndarray, parameters: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return the rates (cells, dimension); those of nodes after the first ones are set to zero."""
        rates = np.zeros((len(state), self.dimension))
        for part in self.parts:
            of_part = part.values(part.rates, part.arguments(state, parameters, time))
            np.add.at(rates.T, part.states, np.moveaxis(of_part, 0, -1))
        for part, inverse in self._inverse_masses(state, parameters, time):
            rates[:, part.states] = np.einsum("cnij,cnj->cni", inverse, rates[:, part.states])
        return rates

    def blocks(self, state: np.ndarray, parameters: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return the diagonal blocks (cells, nodes, p, p) of the Jacobian."""
        # Terms of links count twice, a bound for springs.
        blocks = np.zeros((len(state), self.nodes, self.size, self.size))
        for part in self.parts:
            size = part.states.shape[1]
            slopes = part.values(part.slopes, part.arguments(state, parameters, time))
            with np.errstate(all="ignore"):
                slopes = (1.0 if part.source is None else 2.0) * slopes.reshape(len(state), -1, size, size)
                np.add.at(np.moveaxis(blocks, 1, 0)[:, :, :size, :size], part.targets, np.moveaxis(slopes, 1, 0))
        rates = self._rates(state, parameters, time) if self.masses else np.empty(0)
        for part, inverse in self._inverse_masses(state, parameters, time):
            size = part.states.shape[1]
            with np.errstate(all="ignore"):  # F = M^-1 r: M dF/dy = dr/dy - d(M F)/dy at fixed F
                fixed = [*part.arguments(state, parameters, time), *np.moveaxis(rates[:, part.states], -1, 0)]
                turned = part.values(part.slopes, fixed).reshape(len(state), -1, size, size)
                blocks[:, part.targets, :size, :size] = inverse @ (blocks[:, part.targets, :size, :size] - turned)
        return blocks

    def _inverse_masses(
        self, state: np.ndarray, parameters: np.ndarray, time: np.ndarray
    ) -> Iterator[tuple[TemplateRates, np.ndarray]]:
        """Yield the inverse mass matrices (cells, count, p, p) of nodes that have one; NaN where it is singular."""
        for part in self.masses:
            size = part.states.shape[1]
            masses = part.values(part.rates, part.arguments(state, parameters, time)).reshape(
                len(state), -1, size, size
            )
            singular = ~np.isfinite(masses).all(axis=(2, 3)) | (np.linalg.det(np.nan_to_num(masses)) == 0.0)
            masses[singular] = np.eye(size)
            inverse = np.linalg.inv(masses)
            inverse[singular] = np.nan
            yield part, inverse


def _sizes(blocks: np.ndarray) -> np.ndarray:
    """Return bounds (cells,) of the eigenvalues of blocks (cells, count, p, p): Frobenius norms."""
    return np.asarray(np.sqrt((blocks**2).sum(axis=(2, 3))).max(axis=1))


def fastest_rates(equations: Equations, states: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Return the fastest decay, growth or turning (states,) at states (states, dimension) for one row of parameters."""
    count = len(states)
    paces = Templates(equations).paces(states, np.tile(parameters, (count, 1)), np.zeros(count), np.ones(count), None)
    return np.asarray(np.maximum(paces.fastest, paces.turning))


def _node_parts(equations: Equations, slots: dict[str, int]) -> Iterator[TemplateRates]:
    """Yield the first nodes, kind by kind."""
    for kind, node in enumerate(equations.nodes):
        nodes = [i for i, k in enumerate(equations.kind_of[:NODES]) if k == kind]
        if nodes and is_large(equations) and is_analytic(equations):
            part = _node_part(equations, slots, node, nodes, node.rhs, ())
            turned = _turned((*node.state, *node.parameters, TIME), node.rhs, node.state)
            yield replace(part, slopes=_complex_steps(part.rates, len(node.state)), turned=turned)
        elif nodes:
            yield _node_part(equations, slots, node, nodes, node.rhs, node.jacobian())


def _mass_parts(equations: Equations, slots: dict[str, int]) -> Iterator[TemplateRates]:
    """Yield the mass matrices of the first nodes that have one."""
    for kind, node in enumerate(equations.nodes):
        nodes = [i for i, k in enumerate(equations.kind_of[:NODES]) if k == kind]
        if nodes and node.inertia:
            rates = tuple(sp.Dummy(s.name, real=True) for s in node.state)
            turned = _function((*node.state, *node.parameters, TIME, *rates), _flat(turned_masses(node, list(rates))))
            yield replace(_node_part(equations, slots, node, nodes, _flat(node.inertia), ()), slopes=turned)


def _node_part(
    equations: Equations, slots: dict[str, int], node: Node, nodes: list[int], rates: tuple[sp.Expr, ...], block: Block
) -> TemplateRates:
    symbols = (*node.state, *node.parameters, TIME)
    return TemplateRates(
        _function(symbols, rates),
        _function(symbols, _flat(block)),
        np.array([equations.places[i] for i in nodes]),
        None,
        np.array(nodes),
        tuple(_of_nodes(equations, slots, s.name, nodes) for s in node.parameters),
        turned=_turned(symbols, rates, node.state) if block else (),
    )


def _link_parts(equations: Equations, slots: dict[str, int]) -> Iterator[TemplateRates]:
    """Yield the links that the first nodes feel, template by template."""
    for layer in equations.layers:
        pairs, share, links = layer.links, 1.0, list[Link | Triad]()
        if isinstance(pairs, AllPairs):
            # All pairs of nodes: take a few evenly spread sources of each node, each of which represents several.
            count = min(pairs.n, NODES)
            each = min(pairs.n - 1, LINKS // count)
            gaps = [1 + k * (pairs.n - 1) // each for k in range(each)]
            links = [(i, (i + gap) % pairs.n, pairs.weight) for i in range(count) for gap in gaps]
            share = (pairs.n - 1) / max(each, 1)
        else:
            links = [link for link in layer.each() if link[0] < NODES][:LINKS]
        for ends, edge in layer.edge_of:
            alike = [link for link in links if equations.ends(link) == ends]
            if alike:
                yield _link_part(equations, slots, layer, edge, alike, share)


def _link_part(
    equations: Equations, slots: dict[str, int], layer: Layer, edge: Edge, links: list[Link | Triad], share: float
) -> TemplateRates:
    targets, sources = [link[0] for link in links], [link[1] for link in links]
    # The states of both sources of a link of three ends follow each other.
    felt = [[place for i in (link[1], *link[3:]) for place in equations.places[i]] for link in links]
    columns: list[Column] = []
    for s in edge.parameters:
        if s.name in layer.varied:
            columns.append(np.array([slots[layer.name(s.name, (link[0], link[1], link[2]))] for link in links]))
        else:
            columns.append(_of_nodes(equations, slots, s.name, targets))
    columns += [_of_nodes(equations, slots, of.name, sources) for _, of in edge.theirs]
    states = [s for end in edge.end_states for s in end]
    symbols = (*states, edge.weight, *edge.parameters, *(s for s, _ in edge.theirs), TIME)
    return TemplateRates(
        _function(symbols, edge.rhs),
        _function(symbols, _flat(edge.jacobian_here())),
        np.array([equations.places[i] for i in targets]),
        np.array(felt),
        np.array(targets),
        tuple(columns),
        np.array([[float(link[2]) for link in links]]),
        share,
        _turned(symbols, edge.rhs, edge.here),
    )


def _flat(block: Block) -> tuple[sp.Expr, ...]:
    return tuple(e for row in block for e in row)


def _of_nodes(equations: Equations, slots: dict[str, int], name: str, nodes: list[int]) -> Column:
    if name not in equations.varied:
        return slots[name]
    return np.array([slots[str(NodeName(name, i))] for i in nodes])


def _turned(
    symbols: tuple[sp.Symbol, ...], rates: tuple[sp.Expr, ...], states: tuple[sp.Symbol, ...]
) -> tuple[tuple[int, Callable[..., list[float | np.ndarray]]], ...]:
    """Return, for each smoothed jump, the index of a state among the arguments and its value at the jump's middle."""
    return tuple((symbols.index(state), _function(symbols, (middle,))) for state, middle in turns(rates, states))


def _complex_steps(
    rates: Callable[..., list[float | np.ndarray]], size: int
) -> Callable[..., list[float | np.ndarray]]:
    """Return the slopes of analytic rates, row by row, from steps along the imaginary axis."""
    # Symbolic derivatives of large nodes would take seconds. Source: W. Squire, G. Trapp, SIAM Review 40, 110 (1998).

    def slopes(*arguments: np.ndarray) -> list[float | np.ndarray]:
        shape = np.broadcast_shapes(*(np.shape(e) for e in arguments))
        steps = 1j * STEP * np.eye(size)[:, :, None, None]
        shifted = rates(*(e + step for e, step in zip(arguments[:size], steps, strict=True)), *arguments[size:])
        imaginary = [np.imag(np.broadcast_to(np.asarray(e), (size, *shape))) / STEP for e in shifted]
        return [np.where(np.abs(e) < ENDLESS, e, np.copysign(np.inf, e)) for row in imaginary for e in row]

    return slopes


@lru_cache(maxsize=256)
def _function(symbols: tuple[sp.Symbol, ...], entries: tuple[sp.Expr, ...]) -> Callable[..., list[float | np.ndarray]]:
    """Return expressions as a function of arrays that computes common parts once."""
    function: Callable[..., list[float | np.ndarray]] = sp.lambdify(
        symbols, list(entries), ["scipy", "numpy"], cse=True
    )
    return function
