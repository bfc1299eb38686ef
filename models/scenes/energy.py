"""The energy of a network and the power that changes it, as exact expressions for one node and one link of each kind.

E = sum over nodes of sum v dL/dv - L, plus the same of the links; dE/dt = sum v Q - (partial) dL/dt, plus what Rayleigh
functions of the links take away.
Source: Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sect. 2.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from ..dynamics.equations import Equations
from ..graphs.links import Link
from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Edge
from ..mechanics.coupling import MatrixCoupling
from ..mechanics.friction import ContactModel
from ..mechanics.link import link_energies
from ..mechanics.nondimensional import FRICTION, friction_coefficient, nondimensional
from ..mechanics.oscillator import FieldModel, Oscillator
from .model import NodeKind
from .scene import a_scene

if TYPE_CHECKING:
    from .scene import Scene

__all__ = ["Energy", "Share", "energy"]


@dataclass(frozen=True, slots=True)
class Share:
    """What one node or one link has of the energy of a network, and the power that it feeds in."""

    energy: sp.Expr = sp.S.Zero
    power: sp.Expr = sp.S.Zero


@dataclass(frozen=True, slots=True)
class Energy:
    """Energy and power of a node of each kind, in its states, and of a link of each edge, in those of its two ends.

    All is non-dimensional.  `nodes` follow equations.nodes, `links` equations.edges.  A pair of links, there and back, is
    one spring or damper: `pairs` are the links that count, each pair once.
    """

    equations: Equations
    nodes: tuple[Share, ...]
    links: tuple[Share, ...]

    @property
    def pairs(self) -> tuple[Link, ...]:
        """One link (target, source, weight) of each pair, the one whose target has the smaller number."""
        return tuple(link for link in self.equations.links if link[0] < link[1])

    @property
    def conservative(self) -> bool:
        """True if no power is fed in or lost, for all values of the parameters."""
        return all(share.power == 0 for share in (*self.nodes, *self.links))

    def of_link(self, link: Link) -> int:
        """Return which edge a link is of, its number in equations.edges."""
        eq = self.equations
        return [ends for ends, _ in eq.edge_of].index(eq.ends(link))

    def whole(self) -> tuple[sp.Expr, sp.Expr]:
        """Return energy and power of the whole network in its state symbols (algebra grows with n: meant for small n)."""
        eq = self.equations
        placed = [(self.nodes[eq.kind_of[i]], eq.at_node(i)) for i in range(eq.n)]
        shares: list[tuple[Share, dict[sp.Symbol, sp.Expr]]] = [
            *placed,
            *((self.links[self.of_link(p)], eq.at_link(p)) for p in self.pairs),
        ]
        found = sp.Add(*(share.energy.xreplace(values) for share, values in shares))
        return found, sp.Add(*(share.power.xreplace(values) for share, values in shares))


def energy(scene: Scene) -> Energy:
    """Return the energy of a scene's network.

    Raises ValueError for a vector field or a coupling by components, which have no energy, for one-way links, which have no
    potential, and for set-valued friction, whose force in stick is no function of the state.
    """
    kinds = a_scene(scene).model.kinds
    for kind in kinds:
        if isinstance(kind.oscillator.model, FieldModel):
            name = kind.oscillator.name
            raise ValueError(f"energy: oscillator {name!r} is a vector field; expected one with a Lagrangian")
    equations = scene.equations
    if equations.sticks:
        raise ValueError("energy: set-valued friction does work that is no function of the state; use contact 'atan'")
    nodes = tuple(_of_node(kind, scene.contact) for kind in kinds)
    return Energy(equations, nodes, _of_links(scene, [kind.oscillator for kind in kinds]))


def _of_node(kind: NodeKind, contact: ContactModel) -> Share:
    """Energy and power of one oscillator by itself."""
    system = nondimensional(kind.oscillator)
    lagrangian = system.kinetic - system.potential
    power = sp.Add(*(v * f for v, f in zip(system.velocities, system.forces, strict=True)))
    power -= derivative(lagrangian, TIME)
    if kind.friction is not None:
        power = power.replace(FRICTION, friction_coefficient(kind.friction, contact))
    return Share(_of_lagrangian(lagrangian, system.velocities), power)


def _of_links(scene: Scene, oscillators: Sequence[Oscillator]) -> tuple[Share, ...]:
    """Energy and power of one link of each edge."""
    equations = scene.equations
    if not equations.edges or scene.coupling is None:
        return ()
    if isinstance(scene.coupling, MatrixCoupling):
        raise ValueError(
            f"energy: the coupling {str(scene.coupling)!r} has none; expected a spring or damper by its name"
        )
    if not scene.topology.symmetric:
        raise ValueError(f"energy: {scene.topology.name}({scene.n}) has one-way links; expected links both ways")
    found = []
    for (a, b), edge in equations.edge_of:
        nodes = (equations.nodes[a], equations.nodes[b])
        found.append(_of_link(edge, *link_energies(scene.coupling, edge, nodes, (oscillators[a], oscillators[b]))))
    return tuple(found)


def _of_link(edge: Edge, kinetic: sp.Expr, potential: sp.Expr, dissipation: sp.Expr) -> Share:
    """The energy of a link, and the power it feeds in: minus v dR/dv at either end."""
    velocities = (*edge.here[len(edge.here) // 2 :], *edge.there[len(edge.there) // 2 :])
    lost = sp.Add(*(v * derivative(dissipation, v) for v in velocities))
    return Share(potential if kinetic == 0 else _of_lagrangian(kinetic - potential, velocities), -lost)


def _of_lagrangian(lagrangian: sp.Expr, velocities: Sequence[sp.Symbol]) -> sp.Expr:
    """The energy function sum v dL/dv - L."""
    return sp.expand(sp.Add(*(v * derivative(lagrangian, v) for v in velocities)) - lagrangian)
