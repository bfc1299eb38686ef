"""The model of a network: oscillators by kind, their friction laws, couplings and their graphs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from heapq import nsmallest
from itertools import islice
from types import MappingProxyType

from ..definitions.table import as_name_or_table
from ..dynamics import network
from ..dynamics.equations import Equations
from ..graphs.families import topology
from ..graphs.hypergraph import Hypergraph
from ..graphs.links import LINK_LIMIT, numbered
from ..graphs.topology import Topology
from ..inputs.checks import check_number, listed, short_repr, suggestion
from ..inputs.frozen import FrozenDict
from ..inputs.names import LinkName, NodeName
from ..inputs.unsupported import unsupported
from ..interactions.coupling import Coupling, LagrangianCoupling, Potential
from ..mechanics.components import WEIGHT_NUMBER
from ..mechanics.contact import ContactModel, FrictionLaw
from ..mechanics.oscillator import Oscillator
from ..mechanics.parameter import Parameter

MOST_NODES = 1_000_000
"""Most nodes of a model (a choice: measured 2 s and 700 MB)."""

MOST_NUMBERED = 1_000_000
"""Most links with separate values of a parameter (a choice); names and values of more links take gigabytes."""

WEIGHTS = WEIGHT_NUMBER.name
"""Name of the weights of links in runs that draw or sweep weights."""

_WEIGHT = Parameter(1.0, "1", "weight of a link")


@dataclass(frozen=True, slots=True)
class NodeKind:
    """An oscillator with its friction law; None for an oscillator without friction."""

    oscillator: Oscillator
    friction: FrictionLaw | None


@dataclass(frozen=True, slots=True)
class Group:
    """The nodes `at` (numbers from 1), which are an oscillator with a friction law."""

    oscillator: Oscillator
    friction: FrictionLaw | None
    at: tuple[int, ...]

    def as_dict(self) -> dict[str, object]:
        """Return the group as a table of a scene file."""
        law = "none" if self.friction is None else as_name_or_table(self.friction)
        return {"oscillator": as_name_or_table(self.oscillator), "friction": law, "at": list(self.at)}


@dataclass(frozen=True, slots=True)
class Model:
    """Oscillators, friction and couplings, which determine the equations of a network."""

    kinds: tuple[NodeKind, ...]  # the kinds of nodes, in the order of their first nodes
    kind_of: tuple[int, ...]  # the kind of each node
    contact: ContactModel  # treatment of the jump of a friction law at rest
    layers: tuple[tuple[Coupling | None, Topology], ...]  # couplings and their graphs, at least one, of equal size
    unlinked: Equations = field(init=False, repr=False, compare=False)  # the equations of the nodes without links
    # Parameters of all kinds, with the default of the first kind that has the name, and of couplings that have links.
    parameters: FrozenDict[Parameter] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Several kinds, several layers and forced links need events as rows.
        rows = len(self.kinds) > 1 or len(self.linked) > 1 or any(coupling.forced for coupling, _ in self.linked)
        of_links = network.modes_of_links(self.linked, self.kind_of)
        object.__setattr__(self, "unlinked", _unlinked(self.kinds, self.kind_of, self.contact, rows, of_links))
        couplings = tuple(coupling for coupling, _ in self.linked)
        object.__setattr__(self, "parameters", _parameters(self.kinds, self.contact, couplings))

    def __reduce__(self) -> tuple[type[Model], tuple[object, ...]]:
        return Model, (self.kinds, self.kind_of, self.contact, self.layers)

    @classmethod
    def of(
        cls,
        kind: NodeKind,
        groups: tuple[Group, ...],
        contact: ContactModel,
        layers: tuple[tuple[Coupling | None, Topology], ...],
    ) -> Model:
        """Return the model of nodes of one kind, except the nodes of `groups`, with couplings in canonical spelling."""
        graph = layers[0][1]
        if graph.n > MOST_NODES:
            raise ValueError(
                f"topology {graph.name}: n = {graph.n}; expected at most {MOST_NODES} nodes in a model: reduce n"
            )
        # Equal groups become one kind; kinds are numbered in the order of their first nodes.
        all_kinds = [kind, *(NodeKind(group.oscillator, group.friction) for group in groups)]
        nodes = [0] * graph.n
        for group, of_group in zip(groups, all_kinds[1:], strict=True):
            for i in group.at:
                nodes[i - 1] = all_kinds.index(of_group)
        kinds = tuple(all_kinds[k] for k in dict.fromkeys(nodes))
        model = cls(kinds, numbered(nodes), contact, tuple((None, graph) for _, graph in layers))

        # Bring each coupling into its canonical spelling, which depends on the components of the nodes.
        spelt = []
        for coupling, graph in layers:
            if coupling is None and graph.link_count:
                raise ValueError(
                    f"coupling: found none for {graph.name}({graph.n}), which has links; "
                    "expected the name of a coupling, e.g. 'spring'"
                )
            canonical = None if coupling is None else coupling.canonical(model.components, model.coordinates)
            spelt.append((canonical, graph))
        model = replace(model, layers=tuple(spelt))
        model.check_links()
        return model

    @property
    def n(self) -> int:
        """Number of oscillators."""
        return len(self.kind_of)

    @property
    def linked(self) -> tuple[tuple[Coupling, Topology], ...]:
        """The layers that have links."""
        return tuple((coupling, graph) for coupling, graph in self.layers if coupling is not None and graph.link_count)

    @property
    def topology(self) -> Topology:
        """The graph of a single layer, or the union of the graphs of several layers."""
        graphs = tuple(graph for _, graph in self.layers)
        return graphs[0] if len(graphs) == 1 else union_of(graphs, " and ".join(graph.name for graph in graphs))

    @property
    def forced(self) -> bool:
        """True if time occurs explicitly in the equations."""
        return any(node.forced for node in self.unlinked.nodes) or any(coupling.forced for coupling, _ in self.linked)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the state components of the oscillators, such as ("x", "v")."""
        return self.unlinked.components

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the oscillators, the components that have a velocity."""
        return tuple(dict.fromkeys(name for kind in self.kinds for name in kind.oscillator.coordinates))

    def equations(self, varied: tuple[str, ...] = ()) -> Equations:
        """Return the equations of the network; parameters in `varied` have a value for each node or each link."""
        return _equations(self, varied)

    def check_links(self) -> None:
        """Raise ValueError if a coupling cannot join the oscillators of a graph with links."""
        several, hyper = len(self.kinds) > 1, any(isinstance(graph, Hypergraph) for _, graph in self.linked)
        if several or hyper or any(graph.link_count > LINK_LIMIT for _, graph in self.linked):
            self.equations()
        for coupling, _ in self.linked if len(self.kinds) == 1 else ():
            coupling.check_ends(self.unlinked.node)

    def holders(self, name: str) -> tuple[int, ...]:
        """Return the nodes (counted from 0) that have a parameter; empty for a parameter of links."""
        apart = self.unlinked
        return apart.holders(name) if any(s.name == name for node in apart.nodes for s in node.parameters) else ()

    def defaults(self, name: str) -> list[float]:
        """Return the default of a parameter at each node that has the parameter; kinds may have different defaults."""
        tables = [_kind_parameters(kind, self.contact, ()) for kind in self.kinds]
        return [float(tables[self.kind_of[i]][name].default) for i in self.holders(name)]

    def node_parameter(self, name: str) -> NodeName | None:
        """Split the name of a parameter of one node, "a_2", into parameter and node; None for any other name."""
        parts = None if name in self.parameters else NodeName.parse(name)
        return parts if parts is not None and parts.index in self.holders(parts.base) else None

    def parameter(self, name: str) -> Parameter | None:
        """Return the parameter of a name such as "a", "a_2" or "k_1_2"; None for an unknown name."""
        parts = self.single(name)
        if parts is not None and parts.base == WEIGHTS and WEIGHTS not in self.parameters:
            return _WEIGHT
        return self.parameters.get(name if parts is None else parts.base)

    def single(self, name: str) -> NodeName | LinkName | None:
        """Split the name of a parameter of one node or one link; raise ValueError if the name has both meanings."""
        node, link = self.node_parameter(name), self.link_parameter(name)
        if node is not None and link is not None:
            raise ValueError(
                f"parameter {name!r}: found {node.base!r} of a node and {link.base!r} of a link by this name; "
                "expected one of them; rename the other"
            )
        return node or link

    def link_parameter(self, name: str) -> LinkName | None:
        """Split the name of a parameter of one link, "k_1_2", into parameter, target, source; else return None."""
        parts = None if name in self.parameters else LinkName.parse(name)
        if parts is None or self.link_names(parts.base).get((parts.target, parts.source)) != parts:
            return None
        return parts

    def link_names(self, name: str) -> Mapping[tuple[int, int], LinkName]:
        """Return the name of a parameter at each link (target, source), also of the weights "W".

        The result is empty for a parameter of nodes.  The links i -> j and j -> i have one name if the coupling acts on
        both ends.  Raises ValueError for more than MOST_NUMBERED links.
        """
        return _link_names(self, name)

    def on_graph(self, name: str) -> str:
        """Return " on ring(4)" for messages: the graph whose links have the parameter `name`, or the weights "W"."""
        graphs = (graph for coupling, graph in self.linked if name in (*coupling.parameters, WEIGHTS))
        return "".join(f" on {graph.name}({graph.n})" for graph in islice(graphs, 1))

    def no_link(self, name: str) -> str:
        """Return a message why no link has a name such as "k_1_9", with valid names; "" for a name of another form."""
        link = LinkName.parse(name)
        names = {} if link is None else self.link_names(link.base)
        if link is None or not names:
            return ""
        # The link exists, but both directions share the name with the smaller node first.
        back = names.get((link.target, link.source))
        if back is not None:
            return f"expected {str(back)!r}, the one number of a link that acts on both of its ends"
        valid = dict.fromkeys(names.values())
        near = nsmallest(3, valid, key=lambda one: abs(one.target - link.target) + abs(one.source - link.source))
        return (
            f"found no link where node {link.target + 1} feels node {link.source + 1}; expected one of the {len(valid)}, "
            f"such as {', '.join(map(str, near))}"
        )

    def unknown(self, name: str, what: str, valid_names: Iterable[str]) -> str:
        """Return the error message for an unknown name, or for a parameter of a coupling without links."""
        known, reason = tuple(valid_names), self.no_link(name) or unsupported(name)
        if reason:
            return f"unknown {what} {name!r}; {reason}"
        for coupling, graph in self.layers:
            if not graph.link_count and coupling is not None and name in coupling.parameters:
                return (
                    f"{what} {name!r} couples oscillators, but {graph.name}({graph.n}) has no links: "
                    f"there is nothing to couple; leave it out or take at least two oscillators, e.g. chain(2)"
                )
        return f"unknown {what} {short_repr(name)}; known: {listed(known)}{suggestion(name, known)}"

    def check_state(self, name: str, what: str) -> None:
        """Raise ValueError if a name such as "v_2" is no state of the network; `what` begins the message."""
        apart, parts = self.unlinked, NodeName.parse(name)
        if parts is not None and parts.base in apart.components and parts.index in apart.holders(parts.base):
            return
        states = ", ".join(_states(c, apart.holders(c)) for c in apart.components)
        raise ValueError(f"unknown {what} {short_repr(name)}; expected a state: {states}; correct the name")


@lru_cache(maxsize=64)
def _unlinked(
    kinds: tuple[NodeKind, ...],
    kind_of: tuple[int, ...],
    contact: ContactModel,
    rows: bool,
    of_links: tuple[tuple[str, ...], ...] | None,
) -> Equations:
    """Return the equations of nodes without links."""
    modes = [None] * len(kinds) if of_links is None else of_links
    pairs = zip(kinds, modes, strict=True)
    nodes = [network.node(kind.oscillator, kind.friction, contact, rows, names) for kind, names in pairs]
    return network.layered_network([kind.oscillator for kind in kinds], nodes, kind_of, ())


@lru_cache(maxsize=64)
def union_of(graphs: tuple[Topology, ...], name: str) -> Topology:
    """Return the union of graphs: a link of weight 1 wherever one of them has a link.

    Raises ValueError if two graphs have different labels of nodes, or the same labels in another order.
    """
    n, labels = graphs[0].n, None
    for graph in graphs:
        if graph.labelled and tuple(graph.labels) != (labels or tuple(graph.labels)):
            raise ValueError(
                f"links: found the nodes {short_repr(labels)} and {short_repr(graph.labels)}; expected one order of the same "
                "labels in all graphs"
            )
        labels = tuple(graph.labels) if graph.labelled else labels
    # A complete graph contains every other graph, and needs no list of links.
    if any(graph.all_to_all is not None for graph in graphs):
        return Topology(name, n, rule=topology("complete", n).rule, labels=labels)
    pairs = sorted({link[:2] for graph in graphs for link in graph.links})
    return Topology(name, n, tuple((*p, Fraction(1)) for p in pairs), labels=labels)


@lru_cache(maxsize=64)
def _equations(model: Model, varied: tuple[str, ...]) -> Equations:
    """Return the equations of a whole network."""
    oscillators = [kind.oscillator for kind in model.kinds]
    return network.layered_network(oscillators, model.unlinked.nodes, model.kind_of, model.linked, varied)


@lru_cache(maxsize=64)
def _link_names(model: Model, name: str) -> Mapping[tuple[int, int], LinkName]:
    """Return the name of a parameter of links, or of the weights, at each link (target, source)."""
    link_names: dict[tuple[int, int], LinkName] = {}
    weights = name == WEIGHTS and name not in model.parameters and len(model.linked) == 1
    for coupling, graph in () if model.holders(name) else model.linked:
        if weights or name in coupling.parameters:
            if graph.link_count > MOST_NUMBERED:
                raise ValueError(
                    f"{name}: found numbers of {graph.link_count} links; expected at most {MOST_NUMBERED} links with numbers of "
                    "their own"
                )
            # The forces of an energy act on both ends, so both directions of a link share one value.
            mutual = isinstance(coupling, LagrangianCoupling | Potential) and graph.symmetric
            for target, source, _ in graph.links:
                ends = (source, target) if mutual and source < target else (target, source)
                link_names[target, source] = link_names[ends] if ends in link_names else LinkName(name, *ends)
    return MappingProxyType(link_names)


@lru_cache(maxsize=64)
def _kind_parameters(kind: NodeKind, contact: ContactModel, couplings: tuple[Coupling, ...]) -> FrozenDict[Parameter]:
    """Return every parameter of nodes of one kind with its default, unit and range."""
    return FrozenDict(network.parameters(kind.oscillator, kind.friction, contact, couplings))


@lru_cache(maxsize=64)
def _parameters(
    kinds: tuple[NodeKind, ...], contact: ContactModel, couplings: tuple[Coupling, ...]
) -> FrozenDict[Parameter]:
    """Return the parameters of all kinds, with the default of the first kind that has a name, then of couplings."""
    parameters: dict[str, Parameter] = {}
    for joined in ((), couplings):
        for kind in kinds:
            for name, parameter in _kind_parameters(kind, contact, joined).items():
                parameters.setdefault(name, parameter)
    return FrozenDict(parameters)


def _states(component: str, holders: tuple[int, ...]) -> str:
    """Return the states of one component as text: x_1 … x_4, or theta_2, theta_3 if only some nodes have it."""
    if len(holders) > 1 and holders == tuple(range(len(holders))):
        return f"{component}_1 … {component}_{len(holders)}"
    return ", ".join(str(NodeName(component, i)) for i in holders)


def in_range(name: str, value: object, parameter: Parameter) -> float:
    """Return the value of a parameter as a float in its range; ValueError or TypeError for any other value."""
    return parameter.check(name, check_number(name, value))
