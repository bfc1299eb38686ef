"""Energy and power of a network, as exact expressions for one node and one link of each kind.

The energy E is the sum of v dL/dv - L over nodes and links.  The power is dE/dt = sum v Q - (partial) dL/dt, where the
forces Q include -dR/dv of a Rayleigh function R.
Source: Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sect. 2.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import sympy as sp

from ..dynamics.equations import Equations
from ..dynamics.observable import ObservableRows, RowSum
from ..graphs.links import Link
from ..graphs.topology import Topology
from ..interactions.coupling import Coupling, LagrangianCoupling, Potential
from ..interactions.ends import Pair, Terms
from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, WEIGHT_NUMBER, Edge
from ..mechanics.contact import ContactModel
from ..mechanics.nondimensional import friction_coefficient, nondimensional
from ..mechanics.oscillator import FRICTION, FieldModel
from .model import Model, NodeKind


@dataclass(frozen=True, slots=True)
class Share:
    """The energy of one node or one link, and the power that the node or link feeds in."""

    energy: sp.Expr = sp.S.Zero
    power: sp.Expr = sp.S.Zero


@dataclass(frozen=True, slots=True)
class EnergyTerms:
    """Energy and power of one node of each kind and of one link of each `Edge`; all quantities are non-dimensional.

    `nodes` has the order of equations.nodes, `links` the order of equations.edges.  The expressions contain the states
    of the node, or of both ends of the link.  The links i -> j and j -> i are one spring or damper; `pairs` contains
    one of the two links.
    """

    equations: Equations
    nodes: tuple[Share, ...]
    links: tuple[Share, ...]

    @property
    def pairs(self) -> tuple[tuple[Link, int], ...]:
        """The link (target, source, weight) of each pair with target < source, and its index in equations.edges."""
        eq, pairs, first = self.equations, list[tuple[Link, int]](), 0
        for layer in (layer for layer in eq.layers if layer.links):
            edges = {ends: k for k, (ends, _) in enumerate(layer.edge_of, start=first)}
            first += len(edges)
            pairs += [(link, edges[eq.ends(link)]) for link in layer.links if link[0] < link[1]]
        return tuple(pairs)

    @property
    def conservative(self) -> bool:
        """True if no power is fed in or lost, for all values of the parameters."""
        return all(share.power == 0 for share in (*self.nodes, *self.links))

    def whole(self) -> tuple[sp.Expr, sp.Expr]:
        """Return energy and power of the whole network in its state symbols; meant for small n (algebra grows with n)."""
        shares = [(share, values) for share, places in self._shares() for values in places]
        energy = sp.Add(*(share.energy.xreplace(values) for share, values in shares))
        return energy, sp.Add(*(share.power.xreplace(values) for share, values in shares))

    def rows(self) -> tuple[sp.Expr, tuple[ObservableRows, ...]]:
        """Return the energy of the network for observables: sums over the nodes of each kind and links of each `Edge`."""
        rows = [
            ObservableRows.of(share.energy, places) for share, places in self._shares() if places and share.energy != 0
        ]
        return sp.Add(*(RowSum(sp.Integer(k)) for k in range(len(rows)))), tuple(rows)

    def _shares(self) -> list[tuple[Share, list[dict[sp.Symbol, sp.Expr]]]]:
        """Return the share of each kind of node and each `Edge`, with one substitution for each node or link."""
        eq = self.equations
        places = [list[dict[sp.Symbol, sp.Expr]]() for _ in (*self.nodes, *self.links)]
        for i, kind in enumerate(eq.kind_of):
            places[kind].append(dict(eq.at_node(i)))
        for link, k in self.pairs:
            places[len(self.nodes) + k].append(eq.at_link(link, eq.edges[k]))
        return list(zip((*self.nodes, *self.links), places, strict=True))


@lru_cache(maxsize=16)
def energy_of(model: Model, varied: tuple[str, ...] = ()) -> EnergyTerms:
    """Return the energy of a model's network."""
    kinds = model.kinds
    for kind in kinds:
        if isinstance(kind.oscillator.model, FieldModel):
            name = kind.oscillator.name
            raise ValueError(f"energy: oscillator {name!r} is a vector field; expected one with a Lagrangian")
    equations = model.equations(varied)
    equations.expect_pairs("energy")
    if equations.sticks:
        raise ValueError("energy: set-valued friction does work that is no function of the state; use contact 'atan'")
    nodes = tuple(_of_node(kind, model.contact) for kind in kinds)
    links, layers = [], []
    for (coupling, graph), layer in zip(model.linked, equations.layers, strict=True):
        _check(coupling, graph)
        edges = []
        for (a, b), edge in layer.edge_of:
            # The energy follows from the same terms as the forces of the link.
            pair = Pair((equations.nodes[a], equations.nodes[b]), (kinds[a].oscillator, kinds[b].oscillator))
            share, joint = _of_link(edge, pair, coupling.terms(pair), equations.varied)
            if WEIGHT_NUMBER.name in layer.varied:
                # Weights that are set for each run are the parameter `WEIGHT_NUMBER`.
                share = Share(*(e.xreplace({edge.weight: WEIGHT_NUMBER}) for e in (share.energy, share.power)))
            links.append(share)
            edges.append(((a, b), joint))
        layers.append(replace(layer, edge_of=tuple(edges)))
    return EnergyTerms(replace(equations, layers=tuple(layers)), nodes, tuple(links))


def _of_node(kind: NodeKind, contact: ContactModel) -> Share:
    """Return energy and power of one uncoupled oscillator."""
    system = nondimensional(kind.oscillator)
    lagrangian = system.kinetic - system.potential
    power = sp.Add(*(v * f for v, f in zip(system.velocities, system.forces, strict=True)))
    power -= derivative(lagrangian, TIME)
    if kind.friction is not None:
        power = power.replace(FRICTION, friction_coefficient(kind.friction, contact))
    return Share(_of_lagrangian(lagrangian, system.velocities), power)


def _check(coupling: Coupling, graph: Topology) -> None:
    """Raise ValueError for links without an energy."""
    if not isinstance(coupling, LagrangianCoupling | Potential):
        raise ValueError(f"energy: the coupling '{coupling}' has none; expected a spring or damper by its name")
    if coupling.forced:
        raise ValueError(f"energy: the coupling '{coupling}' depends on time; expected one that does not")
    if graph.asymmetry:
        raise ValueError(
            f"energy: found {graph.asymmetry} in {graph.name}({graph.n}); expected links of equal weights both ways"
        )


def _of_link(edge: Edge, pair: Pair, terms: Terms, varied: tuple[str, ...]) -> tuple[Share, Edge]:
    """Return energy and power (-v dR/dv at both ends) of a link, and the edge with all parameters of the energy."""
    shared = {s: parameter for s, parameter in pair.theirs.items() if parameter.name not in varied}
    kinetic, potential, dissipation = (e.xreplace(shared) for e in (terms.kinetic, terms.potential, terms.dissipation))
    lost = sp.Add(*(v * derivative(dissipation, v) for v in pair.velocities))
    share = Share(potential if kinetic == 0 else _of_lagrangian(kinetic - potential, pair.velocities), -lost)
    used = share.energy.free_symbols | share.power.free_symbols
    more = tuple(s for s in pair.nodes[0].parameters if s in used and s not in edge.parameters)
    theirs = tuple((s, parameter) for s, parameter in pair.theirs.items() if s in used)
    return share, replace(edge, parameters=(*edge.parameters, *more), theirs=theirs)


def _of_lagrangian(lagrangian: sp.Expr, velocities: Sequence[sp.Symbol]) -> sp.Expr:
    """Return the energy function sum v dL/dv - L."""
    return sp.expand(sp.Add(*(v * derivative(lagrangian, v) for v in velocities)) - lagrangian)
