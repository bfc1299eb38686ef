"""Variational equations: the linear equations of small deviations along an orbit.

`mode`, `network_variation` and `clustered` return the equations of the orbit and of the deviations separately, so that
any number of deviations are integrated along one orbit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import sympy as sp

from ..interactions.link import strength
from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Edge, Node
from ..mechanics.jumps import discontinuity, rough_at
from .equations import Equations
from .mode_inertia import effective_slope
from .reduction import collapse
from .saltation import Entry, Events, of_blocks, of_mode, of_network
from .synchrony import synchronous_node

if TYPE_CHECKING:
    from ..symmetries.clusters import Block, Clusters

MODE = (sp.Symbol("mode_alpha", real=True), sp.Symbol("mode_beta", real=True))
"""Real and imaginary part of the strength of a mode, alpha + i beta = -sigma gamma.

With several layers of links, the strength of layer l is mode_alpha_l + i mode_beta_l.
"""

STRENGTH = sp.Symbol("mode_sigma", real=True)
"""Coupling strength sigma in the variational equation of a cluster state."""

PHASE = sp.Symbol("phase", real=True)
"""Shift of time in the equations of `phase_shifted`: t is replaced by t + phase."""

LOG_VOLUME = sp.Symbol("log_volume", real=True)
"""Integral of the divergence of one oscillator; summed over all oscillators: logarithm of a phase-space volume."""


@dataclass(frozen=True, slots=True)
class Variation:
    """A linear system d' = A d of small deviations along an orbit."""

    orbit: Equations
    size: int  # the number of deviations; the modes of contacts have none
    # The non-zero entries ((row, column), expression) of A, in the states and parameters of the orbit, t, `parameters`.
    matrix: tuple[Entry, ...]
    parameters: tuple[sp.Symbol, ...] = ()  # strengths, which differ from mode to mode; A is linear in the strengths
    events: Events | None = None  # saltation by stick and slip; None for smooth equations

    def __post_init__(self) -> None:
        names = {*self.orbit.state, *self.orbit.parameters, "t"}
        taken = names & {s.name for s in self.parameters}
        if taken:
            raise ValueError(f"the symbol {min(taken)!r} is needed for the strength of a mode; rename it in the model")
        if (self.events is not None) != self.orbit.sticks:
            raise ValueError("variation: events belong to set-valued friction, and to nothing else")
        expect_continuous(self.orbit)
        for (row, column), e in self.matrix:
            if not (0 <= row < self.size and 0 <= column < self.size):
                raise ValueError(f"variation: entry ({row}, {column}) is outside the {self.size} x {self.size} matrix")
            unknown = {s.name for s in e.free_symbols} - names - {s.name for s in self.parameters}
            if unknown:
                raise ValueError(f"variation: unknown symbol {min(unknown)!r} in entry ({row}, {column})")
            # Entries must be linear in the strengths: their coefficients are then evaluated once for all modes.
            slopes = [e.diff(s) for s in self.parameters]
            if any(slope.has(*self.parameters) for slope in slopes):
                raise ValueError(f"variation: entry ({row}, {column}) is not linear in the strengths of a mode: {e}")

    def parts(self, e: sp.Expr) -> list[tuple[sp.Expr, sp.Expr]]:
        """Return the non-zero terms of an entry of A as pairs of a coefficient and its factor, a strength or 1."""
        constant = e.xreplace(dict.fromkeys(self.parameters, sp.S.Zero))
        parts = [(constant, sp.S.One), *((e.diff(s), s) for s in self.parameters)]
        return [(coefficient, strength) for coefficient, strength in parts if coefficient != 0]


def expect_continuous(orbit: Equations) -> None:
    """Raise ValueError for rates that jump as functions of the state.

    The rate of `LOG_VOLUME` may jump, since no rate depends on this state.
    """
    # Jumps of the modes of contacts are allowed: saltation treats them at the events.
    templates = [(node.state, node.rhs, node.continuous) for node in orbit.nodes]
    templates += [(edge.here, edge.rhs, (*edge.here, *edge.there)) for edge in orbit.edges]
    for states, rates, moving in templates:
        deviating = [e for s, e in zip(states, rates, strict=True) if not s.name.startswith(LOG_VOLUME.name)]
        part = discontinuity(deviating, set(moving))
        if part is not None:
            raise ValueError(
                f"small deviations: found {part}, by which rates jump, and deviations too; expected continuous rates, or "
                'friction with contact = "set-valued"'
            )


def mode(equations: Equations, plane: bool = False) -> Variation:
    """Return the variational equation of one transversal mode along the synchronous orbit.

    A deviation along an eigenvector of G with eigenvalue gamma obeys d' = (J - alpha H) d with alpha = -sigma gamma.
    J is the Jacobian of one node; `source_slopes` returns H.

    * Several layers l of links with a common eigenvector: d' = (J - sum of alpha_l H_l) d, one strength for each layer.
    * Links with inertia: the strength is tau = alpha/(1 + b alpha) (`synchain.models.dynamics.mode_inertia`).
    * Links h that act between equal states: the synchronous orbit is s' = F(s) + sigma k h(s, s), where k is the sum of
      the weights at every node.  J is the Jacobian of this equation: d' = (DF + sigma k D1h + sigma lambda D2h) d with
      the eigenvalue lambda = gamma + k of the matrix of weights.

    References
    ----------
    Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998); several layers: Sorrentino, New J. Phys. 14, 033035 (2012).
    """
    node = synchronous_node(equations)
    slopes = source_slopes(equations)
    if node is not equations.node and (equations.inertial or equations.sticks):
        raise ValueError(
            "a link acts between equal states; expected links without inertia between nodes without set-valued friction"
        )
    more = {s for slope in slopes for e in slope for s in e.free_symbols} - {*node.state, *node.parameters}
    node = replace(node, parameters=(*node.parameters, *sorted(more, key=lambda s: s.name)))
    orbit = Equations.of_equal_nodes(node, None, 1)

    # d' = (J - sum of alpha_l H_l) d; in the plane of complex strengths d' = (J - (alpha + i beta) H) d by real parts.
    here = orbit.at_node(0)
    size = len(node.continuous)
    jacobian = sp.Matrix(node.jacobian())[:size, :size].xreplace(here)
    pushes = [slope[:size, :size].xreplace(here) for slope in slopes]
    alphas, betas = ((s,) for s in MODE)
    if len(slopes) > 1:
        alphas, betas = (tuple(sp.Symbol(f"{s.name}_{k + 1}", real=True) for k in range(len(slopes))) for s in MODE)
    events = of_mode(equations, orbit, slopes[0], MODE, plane)
    real = jacobian - sum((s * push for s, push in zip(alphas, pushes, strict=True)), sp.zeros(size, size))
    if not plane:
        return Variation(orbit, size, _entries(real), alphas, events)
    aside = sum((s * push for s, push in zip(betas, pushes, strict=True)), sp.zeros(size, size))
    both = sp.Matrix(sp.BlockMatrix([[real, aside], [-aside, real]]))
    return Variation(orbit, 2 * size, _entries(both), (*alphas, *betas), events)


def network_variation(equations: Equations) -> Variation:
    """Return the variational equation of the whole network, d' = J d."""
    equations.expect_alike("variational equation of the whole network", varied_too=True, layers_too=True)
    size = equations.n * len(equations.node.continuous)
    matrix = tuple((key, e) for key, e in equations.jacobian().items() if max(key) < size)
    return Variation(equations, size, matrix, (), of_network(equations))


def clustered(equations: Equations, clusters: Clusters) -> Variation:
    """Return the variational equation of a cluster state.

    The orbit is a solution of the quotient network.  Coordinate k of a block is a deviation from the orbit s_c of its
    cluster c and obeys d_k' = J(s_c) d_k + sigma sum_l B_kl H d_l, where B is the matrix of the block.

    References
    ----------
    Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014).
    """
    equations.expect_alike("cluster states")
    slope = _constant_slope(equations)
    orbit = collapse(equations, clusters.classes)
    components = len(orbit.node.continuous)
    # The deviations of the quotient network come first, then the blocks of differences within clusters.
    first = orbit.n * components
    entries = {key: e for key, e in orbit.jacobian().items() if max(key) < first}
    for block in clusters.blocks:
        for (row, column), e in _of_block(block, orbit, slope):
            key = (first + row, first + column)
            entries[key] = entries.get(key, sp.S.Zero) + e
        first += len(block.nodes) * components
    matrix = tuple((key, e) for key, e in sorted(entries.items()) if e != 0)
    return Variation(orbit, first, matrix, (STRENGTH,), of_blocks(equations, clusters.blocks, orbit, slope, STRENGTH))


def _of_block(block: Block, orbit: Equations, slope: sp.Matrix) -> Iterator[tuple[tuple[int, int], sp.Expr]]:
    """Yield ((row, column), entry) of one block, component by component; keys repeat."""
    size, jacobian, components = len(block.nodes), orbit.node.jacobian(), len(orbit.node.continuous)
    for r, line in enumerate(jacobian[:components]):
        for c, entry in enumerate(line[:components]):
            for k, cluster in enumerate(block.nodes):
                yield (r * size + k, c * size + k), entry.xreplace(orbit.at_node(cluster))
                for j, weight in enumerate(block.matrix[k]):
                    factor = sp.Rational(weight.numerator, weight.denominator)
                    push = slope[r, c].xreplace(orbit.at_node(cluster))
                    yield (r * size + k, c * size + j), STRENGTH * factor * push


def _constant_slope(equations: Equations) -> sp.Matrix:
    """Return H of a link that is linear in the difference of the states at its ends; else raise ValueError."""
    edge = equations.edge
    if edge is not None and not edge.diffusive:
        raise ValueError(
            "a link acts between equal states, which cluster states do not allow yet; expected links that vanish there"
        )
    if edge is None:
        raise ValueError("these equations have no coupling; differences within clusters need links")
    (slope,) = source_slopes(equations)
    size = len(equations.node.continuous)
    # With set-valued friction links move a body only in slip: set the mode to 1.
    slips = dict.fromkeys(edge.here[size:], sp.S.One)
    here, there = (
        sp.Matrix(block)[:size, :size].xreplace(slips) for block in (edge.jacobian_here(), edge.jacobian_there())
    )
    if there.has(*edge.here, *edge.there) or (here + there).applyfunc(sp.simplify) != sp.zeros(*here.shape):
        raise ValueError(
            f"a link {', '.join(map(str, edge.rhs))} has a derivative that depends on the states it joins; cluster states "
            "need one that is linear in their difference"
        )
    return slope


def phase_shifted(variation: Variation) -> Variation:
    """Return the same equations with t + `PHASE` in place of the time t; `PHASE` is a new parameter."""

    def later(e: sp.Expr) -> sp.Expr:
        return e.xreplace({TIME: TIME + PHASE})

    def of_node(node: Node) -> Node:
        return replace(node, parameters=(*node.parameters, PHASE)).map(later)

    def of_edge(edge: Edge) -> Edge:
        return replace(edge, parameters=(*edge.parameters, PHASE)).map(later) if edge.forced else edge

    orbit = variation.orbit.map_templates(of_node, of_edge)
    matrix = tuple((key, later(e)) for key, e in variation.matrix)
    events = None if variation.events is None else variation.events.map(later)
    return replace(variation, orbit=orbit, matrix=matrix, events=events)


def with_volume(equations: Equations) -> Equations:
    """Return the equations with one more state of each node, the integral of its divergence.

    The sum of `LOG_VOLUME` over the nodes is the logarithm of a volume in phase space that moves with the flow
    (Liouville's formula).
    """
    if equations.sticks:
        raise ValueError("volumes of states: found set-valued friction, whose stick makes them zero")
    equations.expect_alike("volumes of states", varied_too=True, layers_too=True)

    def divergence(rates: tuple[sp.Expr, ...], states: tuple[sp.Symbol, ...]) -> sp.Expr:
        return sp.Add(*(derivative(e, s) for e, s in zip(rates, states, strict=True)))

    def of_node(node: Node) -> Node:
        return Node((*node.state, LOG_VOLUME), (*node.rhs, divergence(node.rhs, node.state)), node.parameters)

    def of_edge(edge: Edge) -> Edge:
        here, there = (sp.Symbol(f"{LOG_VOLUME}_{end}", real=True) for end in ("here", "there"))
        rates = (*edge.rhs, divergence(edge.rhs, edge.here))
        return replace(edge, here=(*edge.here, here), there=(*edge.there, there), rhs=rates)

    return equations.map_templates(of_node, of_edge)


def _entries(matrix: sp.Matrix) -> tuple[Entry, ...]:
    rows, columns = matrix.shape
    return tuple(((r, c), matrix[r, c]) for r in range(rows) for c in range(columns) if matrix[r, c] != 0)


def source_slopes(equations: Equations) -> tuple[sp.Matrix, ...]:
    """Return H of each layer: the derivative of a link of weight 1 by the state at its source, divided by the strength.

    The strength is sigma, or the only parameter that is a factor of the whole link.
    """
    several = len(equations.layers) > 1
    equations.expect_alike("transversal modes of complete synchronisation", inertia_too=not several, layers_too=True)
    if not equations.layers:
        raise ValueError("these equations have no coupling; a transversal mode needs links")
    slopes = tuple(_source_slope(edge, equations.node) for layer in equations.layers for _, edge in layer.edge_of)
    return slopes if several else (effective_slope(equations, slopes[0]),)


def _source_slope(edge: Edge, node: Node) -> sp.Matrix:
    """Return H of one layer, without inertia."""
    sigma = strength(edge, node.parameters)
    equal = {**dict(zip((*edge.here, *edge.there), node.state * 2, strict=True)), **dict(edge.theirs)}
    part = next((part for e in edge.rhs if (part := rough_at(e, equal, edge.there)) is not None), None)
    if part is not None:
        raise ValueError(
            f"small deviations: found {part}, by which a link jumps or has a kink between equal states; expected a derivative there"
        )
    # The derivative must be sigma W H(s), where W is the weight: then sigma gamma is the strength of a mode.
    weighted = sp.Matrix(edge.jacobian_there()).xreplace(equal)
    matrix = weighted.xreplace({edge.weight: sp.S.One})
    zero = sp.zeros(*matrix.shape)
    if not edge.oriented and (weighted - edge.weight * matrix).applyfunc(sp.simplify) != zero:
        raise ValueError(
            "links are not proportional to their weight; the modes of the graph are no modes of the network"
        )
    slope = matrix.diff(sigma)
    if (matrix - sigma * slope).applyfunc(sp.simplify) != zero:
        raise ValueError(f"links are not proportional to {sigma}; a mode has no single strength alpha")
    if slope.has(TIME):
        raise ValueError("between equal states links depend on time; expected on states and parameters alone")
    return slope
