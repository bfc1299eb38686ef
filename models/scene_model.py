"""What a scene's model knows: its equations, its parameters and the names of its states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .scene_checks import Frozen, number, shown, suggestion
from .scene_nodes import by_kind
from .topology import Topology

if TYPE_CHECKING:
    from .equations import Equations, Node
    from .parameter import Parameter

__all__ = [
    "bare",
    "check_links",
    "check_state",
    "components",
    "coordinate_names",
    "derived",
    "in_range",
    "known_parameters",
    "model_parameters",
    "node",
    "unknown",
]


@lru_cache(maxsize=64)
def known_parameters(oscillator: str, friction: str | None, contact: str, coupling: str | None) -> Frozen[Parameter]:
    """Return every parameter of a model with its default, unit and range."""
    from .network import parameters

    return Frozen(parameters(oscillator, friction, contact, coupling))


def node(oscillator: str, friction: str | None, contact: str) -> Node:
    """Return the equations of one oscillator."""
    from . import network

    return network.node(oscillator, friction, contact)


@lru_cache(maxsize=64)
def derived(
    templates: tuple[tuple[str, str | None], ...],
    kinds: tuple[int, ...],
    contact: str,
    coupling: str | None,
    graph: Topology,
    varied: tuple[str, ...] = (),
) -> Equations:
    """Return the equations of the whole network: oscillators and laws by kind, and the kind of each node.

    One kind needs no `kinds`; the parameters of `varied` have a value for each node.
    """
    from . import network

    singles = [node(oscillator, friction, contact) for oscillator, friction in templates]
    coupling = coupling if graph.links else None
    if kinds:
        names = [oscillator for oscillator, _ in templates]
        return network.mixed_network(names, singles, kinds, coupling, graph, varied)
    edge = network.edge(coupling, singles[0], templates[0][0]) if coupling is not None else None
    return network.network(singles[0], edge, graph, varied)


def bare(made: Mapping[str, Any]) -> Equations:
    """Return the equations of a scene's nodes without their links."""
    templates, kinds = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    return derived(templates, kinds, made["contact"], None, made["topology"])


def check_links(made: Mapping[str, Any]) -> None:
    """Raise ValueError where the coupling cannot join the oscillators of a scene with links."""
    from .network import check_coupling

    if not made["topology"].links or made["coupling"] is None:
        return
    templates, kinds = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    if kinds:
        derived(templates, kinds, made["contact"], made["coupling"], made["topology"])
    else:
        check_coupling(made["coupling"], node(*templates[0], made["contact"]))


def components(made: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the state components of the oscillators, such as ("x", "v")."""
    return bare(made).components


def coordinate_names(made: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the coordinates of a scene's oscillators, those components that have a velocity."""
    from .nondimensional import coordinates
    from .plugins import load

    templates, _ = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    models = [load("oscillator", oscillator) for oscillator, _ in templates]
    return tuple(dict.fromkeys(name for model in models if not hasattr(model, "field") for name in coordinates(model)))


def model_parameters(made: Mapping[str, Any]) -> Frozen[Parameter]:
    """Return the parameters that a scene has: those of its coupling only where its graph has links."""
    coupling = made["coupling"] if made["topology"].links else None
    templates, _ = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    return _all_parameters(templates, made["contact"], coupling)


@lru_cache(maxsize=64)
def _all_parameters(
    templates: tuple[tuple[str, str | None], ...], contact: str, coupling: str | None
) -> Frozen[Parameter]:
    """The parameters of all kinds, each with the default of the first kind that has it, then those of the coupling."""
    found: dict[str, Parameter] = {}
    for oscillator, friction in templates:
        for name, parameter in known_parameters(oscillator, friction, contact, None).items():
            found.setdefault(name, parameter)
    for oscillator, friction in templates:
        for name, parameter in known_parameters(oscillator, friction, contact, coupling).items():
            found.setdefault(name, parameter)
    return Frozen(found)


def unknown(made: Mapping[str, Any], name: str, what: str, known: Iterable[str]) -> str:
    """Return the sentence that refuses a name; a coupling parameter without links has its own."""
    graph, known = made["topology"], tuple(known)
    if not graph.links and made["coupling"] is not None:
        templates, _ = by_kind(made["oscillator"], made["friction"], made["nodes"], graph.n)
        coupled = _all_parameters(templates, made["contact"], made["coupling"])
        if name in coupled:
            return (
                f"{what} {name!r} couples oscillators, but {graph.name}({graph.n}) has no links: "
                f"there is nothing to couple; leave it out or take at least two oscillators, e.g. chain(2)"
            )
    return f"unknown {what} {shown(name)}; known: {', '.join(known)}{suggestion(name, known)}"


def in_range(name: str, value: object, parameter: Parameter) -> float:
    """Return the value of a parameter as a float in its range."""
    return parameter.check(name, number(name, value))


def check_state(made: Mapping[str, Any], name: str, what: str) -> None:
    """Raise ValueError where a name such as "v_2" is no state of a scene's network."""
    network = bare(made)
    component, _, index = name.rpartition("_")
    holders = network.holders(component) if component in network.components else ()
    if index.isascii() and index.isdecimal() and len(index) < 10 and index[0] != "0" and int(index) - 1 in holders:
        return
    known = ", ".join(_states(c, network.holders(c)) for c in network.components)
    raise ValueError(f"unknown {what} {shown(name)}; expected a state: {known}; correct the name")


def _states(component: str, holders: tuple[int, ...]) -> str:
    """The states of one component: x_1 … x_4, or of some nodes only theta_2, theta_3."""
    if len(holders) > 1 and holders == tuple(range(len(holders))):
        return f"{component}_1 … {component}_{len(holders)}"
    return ", ".join(f"{component}_{i + 1}" for i in holders)
