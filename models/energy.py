"""The energy of a network and the power that changes it, as exact expressions for one node and one link.

E = sum over nodes of sum v dL/dv - L, plus the potentials of the links; dE/dt = sum v Q - (partial) dL/dt, plus what
Rayleigh functions of the links take away.
Source: Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sect. 2.7.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from .calculus import derivative
from .coupling_matrix import is_matrix
from .coupling_name import coordinates_of, split
from .equations import TIME, Equations, Link
from .expect import a_scene
from .link import pair_energy
from .nondimensional import FRICTION, friction_coefficient, nondimensional
from .plugins import load

if TYPE_CHECKING:
    from .scene import Scene

__all__ = ["Energy", "energy"]


@dataclass(frozen=True, slots=True)
class Energy:
    """Energy and power of one node, in its states, and of one link, in those of its two ends; non-dimensional.

    A pair of links, there and back, is one spring or damper: `pairs` are the links that count, each pair once.
    """

    equations: Equations
    node: sp.Expr
    node_power: sp.Expr
    link: sp.Expr
    link_power: sp.Expr

    @property
    def pairs(self) -> tuple[Link, ...]:
        """One link (target, source, weight) of each pair, the one whose target has the smaller number."""
        return tuple(link for link in self.equations.links if link[0] < link[1])

    @property
    def conservative(self) -> bool:
        """True where no power is fed in or lost, for all values of the parameters."""
        return self.node_power == 0 and self.link_power == 0

    def whole(self) -> tuple[sp.Expr, sp.Expr]:
        """Return energy and power of the whole network in its state symbols (algebra grows with n: meant for small n)."""
        return self._sum(self.node, self.link), self._sum(self.node_power, self.link_power)

    def _sum(self, node: sp.Expr, link: sp.Expr) -> sp.Expr:
        own = [node.xreplace(self.equations.at_node(i)) for i in range(self.equations.n)]
        return sp.Add(*own, *(link.xreplace(dict(self.equations.at_link(pair))) for pair in self.pairs))


def energy(scene: Scene) -> Energy:
    """Return the energy of a scene's network.

    Raises ValueError for a vector field or a coupling by components, which have no energy, for one-way links, which have no
    potential, and for set-valued friction, whose force in stick is no function of the state.
    """
    module = load("oscillator", a_scene(scene).oscillator)
    if hasattr(module, "field"):
        raise ValueError(f"energy: oscillator {scene.oscillator!r} is a vector field; expected one with a Lagrangian")
    equations = scene.equations
    if equations.node.contact is not None:
        raise ValueError("energy: set-valued friction does work that is no function of the state; use contact 'atan'")
    if equations.mixed or equations.inertial:
        equations.expect_alike("energy")
    system = nondimensional(module)
    lagrangian = system.kinetic - system.potential
    momenta = [derivative(lagrangian, v) for v in system.velocities]
    own = sp.Add(*(v * p for v, p in zip(system.velocities, momenta, strict=True))) - lagrangian
    power = sp.Add(*(v * f for v, f in zip(system.velocities, system.forces, strict=True)))
    power -= derivative(lagrangian, TIME)
    if scene.friction is not None:
        coefficient = friction_coefficient(load("friction", scene.friction), scene.contact)
        power = power.replace(FRICTION, coefficient)
    potential, lost = _of_link(scene, equations)
    return Energy(equations, sp.expand(own), power, potential, lost)


def _of_link(scene: Scene, equations: Equations) -> tuple[sp.Expr, sp.Expr]:
    """The potential of a link, and the power it feeds in: minus v dR/dv at either end."""
    edge = equations.edge
    if edge is None or not equations.links or scene.coupling is None:
        return sp.S.Zero, sp.S.Zero
    if is_matrix(scene.coupling):
        raise ValueError(f"energy: the coupling {scene.coupling!r} has none; expected a spring or damper by its name")
    if not scene.topology.symmetric:
        raise ValueError(f"energy: {scene.topology.name}({scene.n}) has one-way links; expected links both ways")
    half = len(edge.here) // 2
    module = load("coupling", split(scene.coupling)[0])
    strengths = {name: sp.Symbol(name, real=True) for name in module.PARAMETERS}
    chosen = coordinates_of(scene.coupling, tuple(s.name for s in equations.node.state[:half]))
    potential, dissipation = pair_energy(module, edge.here, edge.there, edge.weight, strengths, chosen)
    return potential, -sp.Add(*_works(dissipation, (*edge.here[half:], *edge.there[half:])))


def _works(dissipation: sp.Expr, velocities: tuple[sp.Symbol, ...]) -> Iterator[sp.Expr]:
    return (v * derivative(dissipation, v) for v in velocities)
