"""What a scene's model knows: its equations, its parameters and the names of its states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .scene_checks import Frozen, number, shown, suggestion
from .topology import Topology

if TYPE_CHECKING:
    from .equations import Equations, Node
    from .parameter import Parameter

__all__ = [
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


@lru_cache(maxsize=64)
def node(oscillator: str, friction: str | None, contact: str) -> Node:
    """Return the equations of one oscillator."""
    from . import network

    return network.node(oscillator, friction, contact)


@lru_cache(maxsize=64)
def derived(oscillator: str, friction: str | None, contact: str, coupling: str | None, graph: Topology) -> Equations:
    """Return the equations of the whole network."""
    from . import network

    single = node(oscillator, friction, contact)
    edge = network.edge(coupling, single, oscillator) if coupling is not None and graph.links else None
    return network.network(single, edge, graph)


def check_links(made: Mapping[str, Any]) -> None:
    """Raise ValueError where the coupling cannot join the oscillators of a scene with links."""
    from .network import check_coupling

    if made["topology"].links and made["coupling"] is not None:
        check_coupling(made["coupling"], node(made["oscillator"], made["friction"], made["contact"]))


def components(made: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the state components of one oscillator, such as ("x", "v")."""
    return tuple(s.name for s in node(made["oscillator"], made["friction"], made["contact"]).state)


def coordinate_names(made: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the coordinates of one oscillator, those components that have a velocity."""
    from .nondimensional import coordinates
    from .plugins import load

    model = load("oscillator", made["oscillator"])
    return () if hasattr(model, "field") else tuple(coordinates(model))


def model_parameters(made: Mapping[str, Any]) -> Frozen[Parameter]:
    """Return the parameters that a scene has: those of its coupling only where its graph has links."""
    coupling = made["coupling"] if made["topology"].links else None
    return known_parameters(made["oscillator"], made["friction"], made["contact"], coupling)


def unknown(made: Mapping[str, Any], name: str, what: str, known: Iterable[str]) -> str:
    """Return the sentence that refuses a name; a coupling parameter without links has its own."""
    graph, known = made["topology"], tuple(known)
    if not graph.links and made["coupling"] is not None:
        coupled = known_parameters(made["oscillator"], made["friction"], made["contact"], made["coupling"])
        if name in coupled:
            return (
                f"{what} {name!r} couples oscillators, but {graph.name}({graph.n}) has no links: "
                f"there is nothing to couple; leave it out or take at least two oscillators, e.g. chain(2)"
            )
    return f"unknown {what} {shown(name)}; known: {', '.join(known)}{suggestion(name, known)}"


def in_range(name: str, value: object, parameter: Parameter) -> float:
    """Return the value of a parameter as a float in its range."""
    return parameter.check(name, number(name, value))


def check_state(name: str, own: tuple[str, ...], n: int, what: str) -> None:
    """Raise ValueError where a name such as "v_2" is no state of `n` oscillators with components `own`."""
    component, _, index = name.rpartition("_")
    if component in own and index.isascii() and index.isdecimal() and len(index) < 10 and index[0] != "0":
        number_of = int(index)
    else:
        number_of = n + 1
    if number_of <= n:
        return
    known = ", ".join(f"{c}_1" if n == 1 else f"{c}_1 … {c}_{n}" for c in own)
    raise ValueError(f"unknown {what} {shown(name)}; expected a state: {known}; correct the name")
