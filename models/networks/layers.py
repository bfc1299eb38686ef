"""Convert values, names of plug-ins and tables of a scene file into the parts of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import islice

from ..definitions.loader import load_friction_law, load_oscillator, read_coupling
from ..definitions.table import coupling_of_table, law_of_table, oscillator_of_table
from ..graphs import readers
from ..graphs.families import topology
from ..graphs.graph_text import checked_name
from ..graphs.topology import Topology
from ..inputs.checks import check_integer, check_keys, check_table, short_repr
from ..inputs.plugin_files import part
from ..interactions.coupling import COUPLINGS, Coupling
from ..mechanics.contact import ContactModel, FrictionLaw
from ..mechanics.oscillator import Oscillator
from .model import Group

MOST = 100_000
"""Most groups, and most layers, of a scene (a choice)."""


def as_oscillator(value: object, what: str = "oscillator") -> Oscillator:
    """Return an oscillator from an Oscillator, a table or a name; raise ValueError or TypeError for other values."""
    if isinstance(value, Mapping):
        return oscillator_of_table(value)
    return value if isinstance(value, Oscillator) else load_oscillator(part(what, value))


def as_law(value: object, oscillator: Oscillator) -> FrictionLaw | None:
    """Return a friction law from a FrictionLaw, a table or a name; None for "none"."""
    if value == "default":
        return oscillator.friction
    if value is None or isinstance(value, FrictionLaw):
        return value
    if isinstance(value, Mapping):
        return law_of_table(value)
    name = part("friction", value)
    return None if name == "none" else load_friction_law(name)


def as_contact(value: object, oscillators: Iterable[Oscillator]) -> ContactModel:
    """Return the contact model of a text; for None the default of the oscillators that have friction.

    Raises ValueError if the defaults of these oscillators differ.
    """
    if value is not None:
        contact = ContactModel.parse("contact", value)
        if contact is not ContactModel.ATAN and not any(oscillator.has_contact for oscillator in oscillators):
            raise ValueError(
                f"contact: found {str(contact)!r} and no node with friction; expected a node with friction"
            )
        return contact
    contacts = dict.fromkeys(oscillator.contact for oscillator in oscillators if oscillator.has_contact)
    if len(contacts) > 1:
        raise ValueError(f"contact: the nodes have {' and '.join(map(repr, contacts))}; expected one; give contact")
    return next(iter(contacts), ContactModel.ATAN)


def as_coupling(value: object) -> Coupling | None:
    """Return a coupling from a Coupling, a text or a table of expressions; None for None and "none"."""
    if value is None or isinstance(value, COUPLINGS):
        return value
    if isinstance(value, Mapping):
        return coupling_of_table(value)
    if isinstance(value, Topology):
        raise TypeError(f"coupling: found the graph {value.name}({value.n}); expected a coupling; write topology=…")
    text = part("coupling", value)
    return None if text == "none" else read_coupling(text)


def as_topology(value: object) -> Topology:
    """Return a graph from a Topology or another form of a graph; a single node for None."""
    return topology("chain", 1) if value is None else checked_name("topology", readers.as_topology("topology", value))


def as_layers(links: object, coupling: Coupling | None, graph: object) -> tuple[tuple[Coupling | None, Topology], ...]:
    """Return the layers of links of a scene."""
    if links is None:
        return ((coupling, as_topology(graph)),)
    if graph is not None:
        raise ValueError("links: found a topology beside it; expected each layer with its own graph; leave one out")
    if isinstance(links, str | bytes | Mapping) or not isinstance(links, Iterable):
        raise TypeError(f"links: found {short_repr(links)}; expected pairs, e.g. [('spring', ring(4))]")
    layers: list[tuple[Coupling | None, Topology]] = []
    for k, entry in enumerate(islice(links, MOST), start=1):
        if not isinstance(entry, tuple | list) or len(entry) != 2:
            raise TypeError(f"links {k}: found {short_repr(entry)}; expected a pair (coupling, graph)")
        layers.append((as_coupling(entry[0]), as_topology(entry[1])))
    if not layers:
        raise ValueError("links: found no layer; expected one at least, e.g. [('spring', ring(4))]")
    # All layers must have the same number of nodes.
    sizes = sorted({graph.n for _, graph in layers})
    if len(sizes) > 1:
        raise ValueError(f"links: found graphs of {', '.join(map(str, sizes))} nodes; expected one number of nodes")
    return tuple(layers)


def as_groups(value: object, n: int) -> tuple[Group, ...]:
    """Return the groups of nodes of a list of tables."""
    if value is None:
        return ()
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise TypeError(
            f"nodes: found {short_repr(value)}; expected tables, e.g. [{{oscillator = 'duffing', at = [1, 3]}}]"
        )
    groups: list[Group] = []
    taken: set[int] = set()
    for k, entry in enumerate(islice(value, MOST)):
        group = entry if isinstance(entry, Group) else _group(f"nodes {k + 1}", entry, n)
        twice = sorted(taken & set(group.at))
        if twice:
            raise ValueError(f"nodes {k + 1}: node {twice[0]} is in another group too; expected each node once")
        if max(group.at) > n:
            raise ValueError(f"nodes {k + 1}: found node {max(group.at)}; expected nodes 1 to {n}")
        taken.update(group.at)
        groups.append(group)
    return tuple(groups)


def _group(what: str, value: object, n: int) -> Group:
    entry = check_table(what, value)
    check_keys(what, entry, ("oscillator", "friction", "at"))
    for key in ("oscillator", "at"):
        if key not in entry:
            raise ValueError(f"{what}: {key!r} is missing; expected an oscillator and the numbers of its nodes, at")
    oscillator = as_oscillator(entry["oscillator"], f"{what} oscillator")
    at = entry["at"]
    if isinstance(at, str | bytes | Mapping | set | frozenset) or not isinstance(at, Iterable):
        raise TypeError(f"{what}: at is {short_repr(at)}; expected a list of nodes, e.g. [1, 3]")
    nodes = tuple(sorted(check_integer(f"{what}: at", i, 1, n) for i in islice(at, n + 1)))
    if not nodes or len(set(nodes)) < len(nodes):
        raise ValueError(f"{what}: at is {short_repr(list(nodes))}; expected at least one node and each node once")
    return Group(oscillator, as_law(entry.get("friction", "default"), oscillator), nodes)
