"""Variational equations: the linear equations of small deviations along an orbit.

`mode`, `network_variation` and `clustered` return the equations of the orbit and of the deviations separately, so that
any number of deviations are integrated along one orbit.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

import sympy as sp

from ..interactions.link import strength
from ..mechanics.calculus import derivative, kink_of
from ..mechanics.components import TIME, Edge, Node
from ..mechanics.jumps import discontinuity, rough_at
from ..symmetries.irreducible import plus
from .equations import Equations
from .mode_inertia import effective_slope
from .reduction import by_class, collapse
from .saltation import Events, of_mode, of_network, of_slots
from .synchrony import expect_no_friction_in_links, synchronous_node

if TYPE_CHECKING:
    from ..symmetries.clusters import Block, Clusters
    from ..symmetries.irreducible import Exact

MODE = (sp.Symbol("mode_alpha", real=True), sp.Symbol("mode_beta", real=True))
"""Real and imaginary part of the strength of a mode, alpha + i beta = -sigma gamma.

With several layers of links, the strength of layer l is mode_alpha_l + i mode_beta_l.
"""

PHASE = sp.Symbol("phase", real=True)
"""Shift of time in the equations of `phase_shifted`: t is replaced by t + phase."""

LOG_VOLUME = sp.Symbol("log_volume", real=True)
"""Integral of the divergence of one oscillator; summed over all oscillators: logarithm of a phase-space volume."""

Entry = tuple[tuple[int, int], sp.Expr]
"""((row, column), expression) of a matrix."""


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
        names, strengths = {*self.orbit.state, *self.orbit.parameters, "t"}, set(self.parameters)
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
            slopes = [e.diff(s) for s in e.free_symbols & strengths]
            if any(slope.free_symbols & strengths for slope in slopes):
                raise ValueError(f"variation: entry ({row}, {column}) is not linear in the strengths of a mode: {e}")

    def in_units(self, units: Sequence[sp.Expr]) -> Variation:
        """Return the system for deviations in these units of their components."""
        matrix = tuple(((r, c), e * units[c] / units[r]) for (r, c), e in self.matrix)
        return replace(self, matrix=matrix, events=self.events and self.events.in_units(units))

    def parts(self, e: sp.Expr) -> list[tuple[sp.Expr, sp.Expr]]:
        """Return the non-zero terms of an entry of A as pairs of a coefficient and its factor, a strength or 1."""
        used = [s for s in self.parameters if s in e.free_symbols]
        constant = e.xreplace(dict.fromkeys(used, sp.S.Zero))
        parts = [(constant, sp.S.One), *((e.diff(s), s) for s in used)]
        return [(coefficient, strength) for coefficient, strength in parts if coefficient != 0]


def expect_continuous(orbit: Equations) -> None:
    """Raise ValueError for rates that jump as functions of the state.

    The rate of `LOG_VOLUME` may jump, since no rate depends on this state.
    """
    # Jumps of the modes of contacts are allowed: saltation treats them at the events.
    templates = [(node.state, node.rhs, node.continuous) for node in orbit.nodes]
    templates += [(edge.here, edge.rhs, tuple(s for end in edge.end_states for s in end)) for edge in orbit.edges]
    for states, rates, moving in templates:
        deviating = [e for s, e in zip(states, rates, strict=True) if not s.name.startswith(LOG_VOLUME.name)]
        part = discontinuity(deviating, set(moving))
        if part is not None:
            raise ValueError(
                f"small deviations: found {part}, by which rates jump, and deviations too; expected continuous rates, or "
                'friction with contact = "set-valued"'
            )
    for node in orbit.nodes:
        _expect_slopes(node)


def _expect_slopes(node: Node) -> None:
    """Raise ValueError for powers |h|**p with p < 1 of a level h: their slope is infinite where the motion is at h = 0."""
    free = {mode: sp.S.One for mode in node.modes}
    levels = [condition.level for condition in node.conditions]
    for power in sorted({p for e in node.rhs for p in e.xreplace(free).atoms(sp.Pow)}, key=sp.default_sort_key):
        inner = kink_of(power.base)
        if inner is None or not (power.exp.is_number and 0 < power.exp < 1):
            continue
        if any(level != 0 and sp.cancel(inner / level).is_number for level in levels):
            raise ValueError(
                f"small deviations: found {power}, whose slope is infinite where slip begins; expected finite slopes, as of "
                "(w**2 + 1e-12)**(1/4) in place of sqrt(abs(w))"
            )


def mode(equations: Equations, plane: bool = False, by_weight: bool = False, size: int = 1) -> Variation:
    """Return the variational equation of one transversal mode along the synchronous orbit.

    With `by_weight` the strength is alpha = -gamma: links may have any parameters, but no inertia.

    A deviation along an eigenvector of G with eigenvalue gamma obeys d' = (J - alpha H) d with alpha = -sigma gamma.
    J is the Jacobian of one node; `source_slopes` returns H.

    * Several layers l of links with a common eigenvector: d' = (J - sum of alpha_l H_l) d, one strength for each layer.
    * Layers without common eigenvectors: a mode has `size` coordinates k, d_k' = J d_k - sum of alpha_lkj H_l d_j, where
      alpha_l = -sigma_l B_l and the matrices B_l are those of the G_l on an invariant subspace.
    * Links with inertia: the strength is tau = alpha/(1 + b alpha) (`synchain.models.dynamics.mode_inertia`).
    * Links h that act between equal states: the synchronous orbit is s' = F(s) + sigma k h(s, s), where k is the sum of
      the weights at every node.  J is the Jacobian of this equation: d' = (DF + sigma k D1h + sigma lambda D2h) d with
      the eigenvalue lambda = gamma + k of the matrix of weights.

    References
    ----------
    Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998); several layers: Sorrentino, New J. Phys. 14, 033035 (2012), and
    Zhang & Motter, SIAM Rev. 62, 817 (2020).
    """
    equations = equations.projected
    node = synchronous_node(equations)
    slopes = source_slopes(equations, by_weight)
    if node is not equations.node and (equations.inertial or equations.sticks):
        raise ValueError(
            "a link acts between equal states; expected links without inertia between nodes without set-valued friction"
        )
    more = {s for slope in slopes for e in slope for s in e.free_symbols} - {*node.state, *node.parameters}
    node = replace(node, parameters=(*node.parameters, *sorted(more, key=lambda s: s.name)))
    orbit = Equations.of_equal_nodes(node, None, 1)

    # the strength of each layer is a matrix: alpha alone, [[alpha, -beta], [beta, alpha]] for the real and imaginary
    # parts of a deviation, or one number for each pair of coordinates
    def symbols(s: sp.Symbol) -> list[sp.Symbol]:
        return [sp.Symbol(f"{s.name}_{k + 1}", real=True) for k in range(len(slopes))] if len(slopes) > 1 else [s]

    alphas, betas = map(symbols, MODE)
    if size > 1:
        pairs = list(itertools.product(range(1, size + 1), repeat=2))
        of_layers = [[sp.Symbol(f"{s.name}_{k}_{j}", real=True) for k, j in pairs] for s in alphas]
        strengths, alphas = [sp.Matrix(size, size, row) for row in of_layers], list(itertools.chain(*of_layers))
    elif plane:
        strengths, alphas = [sp.Matrix([[a, -b], [b, a]]) for a, b in zip(alphas, betas, strict=True)], alphas + betas
    else:
        strengths = [sp.Matrix([[a]]) for a in alphas]

    here = orbit.at_node(0)
    components, count = len(node.continuous), strengths[0].rows
    zero = sp.zeros(components, components)
    jacobian = sp.Matrix(node.jacobian())[:components, :components].xreplace(here)
    pushes = [slope[:components, :components].xreplace(here) for slope in slopes]
    links = [
        [sum((s[k, j] * push for s, push in zip(strengths, pushes, strict=True)), zero) for j in range(count)]
        for k in range(count)
    ]
    matrix = sp.Matrix(
        sp.BlockMatrix([[jacobian * int(k == j) - links[k][j] for j in range(count)] for k in range(count)])
    )
    free = dict.fromkeys(orbit.symbols(0)[components:], sp.S.One)
    events = of_mode(equations, orbit, [[link.xreplace(free) for link in row] for row in links])
    return Variation(orbit, count * components, _entries(matrix), tuple(alphas), events)


def network_variation(equations: Equations, names: Sequence[str] = ()) -> Variation:
    """Return the variational equation of the whole network, d' = J d, and of the derivatives by some parameters.

    The deviations of the parameters `names` follow those of the states and stay constant. With set-valued friction the
    deviation of a velocity is relative to the ground, whose velocity may depend on the parameters: it is zero in stick.
    """
    equations.expect_alike("variational equation of the whole network", varied_too=True, layers_too=True)
    size = equations.continuous_dimension
    entries = {key: e for key, e in equations.jacobian().items() if max(key) < size}
    grounds = [event.target for i in range(equations.n) for event in equations.events_at(i)] if names else []
    for column, name in enumerate(names, size):
        p = sp.Symbol(name, real=True)
        moved = {equations.n + i: derivative(target, p) for i, target in enumerate(grounds)}
        for row, e in enumerate(equations.rhs()[:size]):
            by_grounds = (entries[row, k] * speed for k, speed in moved.items() if (row, k) in entries)
            slope = sp.Add(derivative(e, p), *by_grounds)
            if slope != 0:
                entries[row, column] = slope
    return Variation(equations, size + len(names), tuple(sorted(entries.items())), (), of_network(equations, names))


@dataclass(frozen=True, slots=True)
class ClusterVariation:
    """The variational equation of all blocks of a cluster state, with the strengths that tell the blocks apart.

    A deviation has a number of slots for each cluster, as many as the largest block needs.  Slot k is a deviation from
    the orbit s_c of its cluster c and obeys

        d_k' = (D_c F + sum over links to other clusters of D1 h) d_k + sum over layers and slots j of B_kj D2 h d_j,

    where h is a link of weight 1 from the cluster of j to that of k.  The numbers B are the strengths.  The quotient's
    own motion is the deviation whose B holds the total weights between clusters.
    """

    variation: Variation
    rows: tuple[tuple[int, ...], ...]  # for each slot its rows in a deviation
    slots: tuple[tuple[int, ...], ...]  # for the quotient's own motion, then for each block: the slots it uses
    strengths: tuple[tuple[Exact, ...], ...]  # for the quotient's own motion, then for each block


def clustered(equations: Equations, clusters: Clusters) -> ClusterVariation:
    """Return the variational equation of a cluster state; the order of its layers is that of the equations.

    References
    ----------
    Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014); several layers and links that act between
    equal states: Zhang & Motter, SIAM Rev. 62, 817 (2020).
    """
    expect_no_friction_in_links("cluster states", equations)
    if max(clusters.classes) > 0:
        equations.expect_pairs("cluster states of several clusters")
    equations = equations.projected
    _expect_clusterable(equations)
    by_classes = by_class(equations, clusters.classes)
    edges = [{(a, b): e for (a, b), e in layer.edge_of} for layer in by_classes.layers]
    orbit = _with_parameters(collapse(by_classes, clusters.classes), edges)
    slot_clusters, used = _slots_of(clusters)
    symbols, strengths = _strengths_of(clusters, used)

    # rows of a deviation, slot by slot; contacts have none
    ends = list(accumulate((len(orbit.node_at(c).continuous) for c in slot_clusters), initial=0))
    rows = tuple(tuple(range(a, b)) for a, b in pairwise(ends))
    # what links of all layers add to the rates of slot k for a deviation in slot j
    kinds = [by_classes.kind_of[members[0]] for members in clusters.members]
    pushes: dict[tuple[int, int], sp.Matrix] = {}
    for (layer, k, j), symbol in symbols.items():
        c, d = slot_clusters[k], slot_clusters[j]
        slope = _slope(edges[layer][kinds[c], kinds[d]], orbit, c, d) * symbol
        pushes[k, j] = pushes.get((k, j), sp.zeros(*slope.shape)) + slope

    matrix = _matrix_of(orbit, slot_clusters, rows, pushes)
    if not orbit.forced and any(e.has(TIME) for _, e in matrix):
        raise ValueError(
            "cluster states: a link inside a cluster depends on time; expected one of states and parameters"
        )
    events = of_slots(by_classes, orbit, slot_clusters, rows, pushes)
    variation = Variation(orbit, ends[-1], matrix, tuple(symbols.values()), events)
    return ClusterVariation(variation, rows, used, strengths)


def _with_parameters(orbit: Equations, edges: Sequence[dict[tuple[int, int], Edge]]) -> Equations:
    """Return an orbit that also has the parameters of links inside clusters, which no rate of the orbit contains."""
    known = {*orbit.parameters, *orbit.state}
    more = {s for of_layer in edges for e in of_layer.values() for s in e.parameters if s.name not in known}
    first, *others = orbit.nodes
    extended = replace(first, parameters=(*first.parameters, *sorted(more, key=lambda s: s.name)))
    return replace(orbit, nodes=(extended, *others))


def _slots_of(clusters: Clusters) -> tuple[list[int], tuple[tuple[int, ...], ...]]:
    """Return the cluster of each slot, and the slots of the quotient's own motion and of each block.

    A cluster has as many slots as its largest block needs, and one at least.
    """
    count = len(clusters.members)
    sizes = [max([1, *(block.cluster_of.count(c) for block in clusters.blocks)]) for c in range(count)]
    slot_clusters = [c for c, size in enumerate(sizes) for _ in range(size)]
    of_blocks = (_slots(block.cluster_of, slot_clusters) for block in clusters.blocks)
    return slot_clusters, (_slots(range(count), slot_clusters), *of_blocks)


def _strengths_of(
    clusters: Clusters, used: Sequence[tuple[int, ...]]
) -> tuple[dict[tuple[int, int, int], sp.Symbol], tuple[tuple[Exact, ...], ...]]:
    """Return a symbol for each layer and pair of slots that some block couples, and the values for each block."""
    table: list[dict[tuple[int, int, int], Exact]] = [{} for _ in used]
    for row, slots, block in zip(table, used, (None, *clusters.blocks), strict=True):
        for layer, matrix in enumerate(_coupling_matrices(clusters, block)):
            pairs = itertools.product(enumerate(slots), repeat=2)
            row.update({(layer, k, j): matrix[r][c] for (r, k), (c, j) in pairs if matrix[r][c] != 0})
    order = sorted({key for row in table for key in row})
    symbols = {key: sp.Symbol("mode_{}_{}_{}".format(*(place + 1 for place in key)), real=True) for key in order}
    return symbols, tuple(tuple(row.get(key, Fraction(0)) for key in order) for row in table)


def _matrix_of(
    orbit: Equations,
    slot_clusters: Sequence[int],
    rows: Sequence[tuple[int, ...]],
    pushes: dict[tuple[int, int], sp.Matrix],
) -> tuple[Entry, ...]:
    """Return the matrix of the variational equation: the Jacobian of each slot's cluster, and the pushes of links."""
    entries: dict[tuple[int, int], sp.Expr] = {}
    jacobian, places = orbit.jacobian(), orbit.places
    for c, of_slot in zip(slot_clusters, rows, strict=True):
        for (r, row), (q, column) in itertools.product(enumerate(of_slot), repeat=2):
            entries[row, column] = jacobian.get((places[c][r], places[c][q]), sp.S.Zero)
    for (k, j), push in pushes.items():
        for (r, row), (q, column) in itertools.product(enumerate(rows[k]), enumerate(rows[j])):
            entries[row, column] = entries.get((row, column), sp.S.Zero) + push[r, q]
    return tuple((key, e) for key, e in sorted(entries.items()) if e != 0)


def _expect_clusterable(equations: Equations) -> None:
    """Raise ValueError for networks whose cluster states have no variational equation here."""
    equations.expect_exact_links("cluster states")
    if not equations.link_count:
        raise ValueError("these equations have no coupling; differences within clusters need links")
    if equations.inertial:
        raise ValueError("cluster states: found links with inertia, or a mass matrix; expected neither")
    if any(edge.oriented for edge in equations.edges):
        raise ValueError("cluster states: found links that tell their ends apart; expected links with weights alone")


def _slots(clusters: Sequence[int], slot_clusters: Sequence[int]) -> tuple[int, ...]:
    """Return the slot of each coordinate of a block, the first free one of its cluster."""
    taken: list[int] = []
    for c in clusters:
        taken.append(next(k for k, of in enumerate(slot_clusters) if of == c and k not in taken))
    return tuple(taken)


def _coupling_matrices(clusters: Clusters, block: Block | None) -> list[list[list[Exact]]]:
    """Return for each layer the matrix B of a block, or of the quotient's own motion.

    B is the matrix of weights minus the sums of weights inside clusters on its diagonal.  A block of G has all sums of
    weights there, so that those from other clusters are added.
    """
    of_layers: list[list[list[Exact]]] = []
    for layer, graph in enumerate(clusters.quotients):
        if block is None:
            of_layers.append(
                [[x if r != c else Fraction(0) for c, x in enumerate(row)] for r, row in enumerate(graph.rows)]
            )
            continue
        outside = [-graph.rows[c][c] for c in range(graph.n)]
        matrix = [list(row) for row in block.matrices[layer]]
        for k, c in enumerate(block.cluster_of):
            matrix[k][k] = plus(matrix[k][k], outside[c])
        of_layers.append(matrix)
    return of_layers


def _slope(edge: Edge, orbit: Equations, c: int, d: int) -> sp.Matrix:
    """Return the derivative by the state of its source of a link of weight 1 from cluster d to cluster c."""
    if c == d:
        _check_smooth(edge, orbit.node_at(c))
    values = orbit.at_link((c, d, Fraction(1)), edge)
    rows, columns = len(orbit.node_at(c).continuous), len(orbit.node_at(d).continuous)
    return sp.Matrix(edge.jacobian_there())[:rows, :columns].xreplace(values)


def clock_shifted(equations: Equations) -> Equations:
    """Return the same equations with t + `PHASE` in place of the time t; `PHASE` is a new parameter."""

    def of_node(node: Node) -> Node:
        return replace(node, parameters=(*node.parameters, PHASE)).map(_later)

    def of_edge(edge: Edge) -> Edge:
        return replace(edge, parameters=(*edge.parameters, PHASE)).map(_later) if edge.forced else edge

    return equations.map_templates(of_node, of_edge)


def phase_shifted(variation: Variation) -> Variation:
    """Return the same variational equation along the orbit of `clock_shifted`."""
    matrix = tuple((key, _later(e)) for key, e in variation.matrix)
    events = None if variation.events is None else variation.events.map(_later)
    return replace(variation, orbit=clock_shifted(variation.orbit), matrix=matrix, events=events)


def _later(e: sp.Expr) -> sp.Expr:
    return e.xreplace({TIME: TIME + PHASE})


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
        beyond = (*edge.beyond, sp.Symbol(f"{LOG_VOLUME}_beyond", real=True)) if edge.beyond else ()
        return replace(edge, here=(*edge.here, here), there=(*edge.there, there), beyond=beyond, rhs=rates)

    return equations.map_templates(of_node, of_edge)


def _entries(matrix: sp.Matrix) -> tuple[Entry, ...]:
    rows, columns = matrix.shape
    return tuple(((r, c), matrix[r, c]) for r in range(rows) for c in range(columns) if matrix[r, c] != 0)


def source_slopes(equations: Equations, by_weight: bool = False) -> tuple[sp.Matrix, ...]:
    """Return H of each layer: the derivative of a link of weight 1 by the state at its source, divided by the strength.

    The strength is sigma, or the only parameter that is a factor of the whole link; 1 with `by_weight`.
    """
    several, what = len(equations.layers) > 1, "transversal modes of complete synchronisation"
    equations = equations.projected
    equations.expect_alike(what, inertia_too=not (several or by_weight), layers_too=True)
    if not equations.layers:
        raise ValueError("these equations have no coupling; a transversal mode needs links")
    edges = [edge for layer in equations.layers for _, edge in layer.edge_of]
    slopes = tuple(_source_slope(edge, equations.node, by_weight) for edge in edges)
    return slopes if several or by_weight else (effective_slope(equations, slopes[0]),)


def _source_slope(edge: Edge, node: Node, by_weight: bool) -> sp.Matrix:
    """Return H of one layer, without inertia."""
    sigma = sp.S.One if by_weight else strength(edge, node.parameters)
    equal = _check_smooth(edge, node)
    # The derivative must be sigma W H(s), where W is the weight: then sigma gamma is the strength of a mode.
    weighted = sp.Matrix(edge.jacobian_there()).xreplace(equal)
    matrix = weighted.xreplace({edge.weight: sp.S.One})
    zero = sp.zeros(*matrix.shape)
    if not edge.oriented and (weighted - edge.weight * matrix).applyfunc(sp.simplify) != zero:
        raise ValueError(
            "links are not proportional to their weight; the modes of the graph are no modes of the network"
        )
    slope = matrix if by_weight else matrix.diff(sigma)
    if (matrix - sigma * slope).applyfunc(sp.simplify) != zero:
        raise ValueError(f"links are not proportional to {sigma}; a mode has no single strength alpha")
    if slope.has(TIME):
        raise ValueError("between equal states links depend on time; expected on states and parameters alone")
    return slope


def _check_smooth(edge: Edge, node: Node) -> dict[sp.Symbol, sp.Expr]:
    """Raise ValueError for a link without a derivative between equal states; return the values of its symbols there."""
    equal = {**dict(zip((*edge.here, *edge.there), node.state * 2, strict=True)), **dict(edge.theirs)}
    part = next((part for e in edge.rhs if (part := rough_at(e, equal, edge.there)) is not None), None)
    if part is not None:
        raise ValueError(
            f"small deviations: found {part}, by which a link jumps or has a kink between equal states; expected a derivative there"
        )
    return equal
