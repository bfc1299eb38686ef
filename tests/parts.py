"""What is derived from the parts of a model, by the names of their files; a value of a test's own may take the place of a name."""

from __future__ import annotations

from fractions import Fraction

from synchain.models.dynamics import network
from synchain.models.graphs.topology import Topology
from synchain.models.interactions import link
from synchain.models.interactions.coupling import Coupling
from synchain.models.mechanics.components import Edge, Node
from synchain.models.mechanics.contact import FrictionLaw
from synchain.models.mechanics.oscillator import LagrangianModel, Oscillator
from synchain.models.mechanics.parameter import Parameter
from synchain.models.networks.layers import as_coupling, as_law, as_oscillator

__all__ = ["connectivity", "coupling_of", "edge", "is_lagrangian", "law_of", "node", "oscillator_of", "parameters"]


def oscillator_of(part: str | Oscillator) -> Oscillator:
    return as_oscillator(part)


def law_of(part: str | FrictionLaw) -> FrictionLaw:
    law = as_law(part, as_oscillator("friction"))
    assert law is not None
    return law


def coupling_of(part: str | Coupling) -> Coupling:
    coupling = as_coupling(part)
    assert coupling is not None
    return coupling


def is_lagrangian(name: str) -> bool:
    return isinstance(as_oscillator(name).model, LagrangianModel)


def node(oscillator: str | Oscillator, friction: str | FrictionLaw | None = None, contact: str = "atan") -> Node:
    return network.node(oscillator_of(oscillator), None if friction is None else law_of(friction), contact)


def parameters(
    oscillator: str | Oscillator,
    friction: str | FrictionLaw | None = None,
    contact: str = "atan",
    coupling: str | Coupling | None = None,
) -> dict[str, Parameter]:
    law = None if friction is None else law_of(friction)
    joined = as_coupling(coupling)
    return network.parameters(oscillator_of(oscillator), law, contact, () if joined is None else (joined,))


def edge(coupling: str | Coupling, single: Node, oscillator: str | Oscillator | None = None) -> Edge:
    return link.edge(coupling_of(coupling), single, None if oscillator is None else oscillator_of(oscillator))


def connectivity(coupling: str | Coupling, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    return network.connectivity(coupling_of(coupling), graph)
