"""What a scene's model knows: its equations, its parameters and the names of its states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any

from ..graphs.topology import Topology
from ..inputs.checks import integer, known_keys, number, shown, suggestion, table
from ..inputs.frozen import Frozen
from ..inputs.plugins import load, named, part
from ..mechanics.definition import FRICTION_LAW, OSCILLATOR

if TYPE_CHECKING:
    from ..dynamics.equations import Equations
    from ..mechanics.components import Node
    from ..mechanics.parameter import Parameter

__all__ = [
    "Group",
    "bare",
    "by_kind",
    "check_links",
    "check_state",
    "components",
    "coordinate_names",
    "default_friction",
    "derived",
    "groups",
    "in_range",
    "known_parameters",
    "model_parameters",
    "node",
    "unknown",
]


@lru_cache(maxsize=64)
def known_parameters(oscillator: str, friction: str | None, contact: str, coupling: str | None) -> Frozen[Parameter]:
    """Return every parameter of a model with its default, unit and range."""
    from ..dynamics.network import parameters

    return Frozen(parameters(oscillator, friction, contact, coupling))


def node(oscillator: str, friction: str | None, contact: str) -> Node:
    """Return the equations of one oscillator."""
    from ..dynamics import network

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
    from ..dynamics import network

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
    from ..mechanics.link import check_coupling

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
    from ..inputs.plugins import load
    from ..mechanics.nondimensional import coordinates

    templates, _ = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    models = [load(OSCILLATOR, oscillator) for oscillator, _ in templates]
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


MOST = 100_000
"""Most nodes that groups may name."""


@dataclass(frozen=True, slots=True)
class Group:
    """Nodes `at` (numbers from 1) of an oscillator with its friction law."""

    oscillator: str
    friction: str | None
    at: tuple[int, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the group in the names of a scene file."""
        return {"oscillator": str(self.oscillator), "friction": str(self.friction or "none"), "at": list(self.at)}


def default_friction(oscillator: str, friction: object) -> str | None:
    """Return the name of a friction law: of "default" the one that an oscillator starts with, of "none" None."""
    if friction == "default":
        return "exponential" if load(OSCILLATOR, oscillator).FRICTION else None
    if friction is None or part("friction", friction) == "none":
        return None
    law = named(FRICTION_LAW, part("friction", friction))
    load(FRICTION_LAW, law)  # an unknown name is refused even where nothing uses it
    return law


def groups(given: object, n: int) -> tuple[Group, ...]:
    """Return the groups of a list of tables with `oscillator`, `friction` and `at`; ValueError or TypeError else."""
    if given is None:
        return ()
    if isinstance(given, str | bytes | Mapping) or not isinstance(given, Iterable):
        raise TypeError(f"nodes: found {shown(given)}; expected tables, e.g. [{{oscillator = 'duffing', at = [1, 3]}}]")
    found: list[Group] = []
    taken: set[int] = set()
    for k, entry in enumerate(islice(given, MOST)):
        group = entry if isinstance(entry, Group) else _group(f"nodes {k + 1}", entry, n)
        twice = sorted(taken & set(group.at))
        if twice:
            raise ValueError(f"nodes {k + 1}: node {twice[0]} is in another group too; expected each node once")
        if max(group.at) > n:
            raise ValueError(f"nodes {k + 1}: found node {max(group.at)}; expected nodes 1 to {n}")
        taken.update(group.at)
        found.append(group)
    return tuple(found)


def _group(what: str, given: object, n: int) -> Group:
    entry = table(what, given)
    known_keys(what, entry, ("oscillator", "friction", "at"))
    for key in ("oscillator", "at"):
        if key not in entry:
            raise ValueError(f"{what}: {key!r} is missing; expected an oscillator and the numbers of its nodes, at")
    oscillator = named(OSCILLATOR, part(f"{what} oscillator", entry["oscillator"]))
    at = entry["at"]
    if isinstance(at, str | bytes | Mapping | set | frozenset) or not isinstance(at, Iterable):
        raise TypeError(f"{what}: at is {shown(at)}; expected a list of nodes, e.g. [1, 3]")
    numbers = tuple(sorted(integer(f"{what}: at", i, 1, n) for i in islice(at, n + 1)))
    if not numbers or len(set(numbers)) < len(numbers):
        raise ValueError(f"{what}: at is {shown(list(numbers))}; expected at least one node and each node once")
    return Group(oscillator, default_friction(oscillator, entry.get("friction", "default")), numbers)


@lru_cache(maxsize=64)
def by_kind(
    oscillator: str, friction: str | None, nodes: tuple[Group, ...], n: int
) -> tuple[tuple[tuple[str, str | None], ...], tuple[int, ...]]:
    """Return (oscillator, friction law) of each kind, in the order of their first nodes, and the kind of each node.

    Where all nodes are of one kind the second is empty.
    """
    of: list[tuple[str, str | None]] = [(oscillator, friction)] * n
    for group in nodes:
        for i in group.at:
            of[i - 1] = (group.oscillator, group.friction)
    templates = tuple(dict.fromkeys(of))
    return templates, tuple(templates.index(pair) for pair in of) if len(templates) > 1 else ()
