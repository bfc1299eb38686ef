"""Parameter values of a scene: one number, one for each node (a_1 … a_n), or one for each link (k_1_2 …)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, TypeAlias, TypeVar

from ..dynamics.periodicity import Drive, as_function, drive_of, names_in
from ..graphs.readers import as_topology, is_graph
from ..inputs.checks import check_number, check_table, first_of, is_row, short_repr
from ..inputs.frozen import FrozenDict
from ..inputs.names import LinkName, NodeName
from ..networks.model import WEIGHTS, Model, NodeKind, in_range
from .axis import Axis

T = TypeVar("T")

Place: TypeAlias = NodeName | LinkName  # the name of a parameter at one node or one link


def parameters(model: Model, table: object, axes: Sequence[Axis]) -> FrozenDict[float]:
    """Return every parameter with its value."""
    # A parameter that differs from node to node, or is swept at a single node, is returned as a_1 … a_n. A parameter
    # that differs from link to link, or is swept at a single link, is returned as k_1_2 … (the link from node 2 to 1).
    read = _Table(model)
    for name, value in check_table("parameters", {} if table is None else table).items():
        if not isinstance(name, str):
            raise TypeError(f"parameters: key {short_repr(name)} is a {type(name).__name__}; expected text")
        read.add(name, value)
    single = (model.single(axis.name) for axis in axes)
    swept = {parts.base for parts in single if parts is not None}
    values: dict[str, float] = {}
    for name, value in read.shared.items():
        by_place = read.by_place(name, value, name in swept)
        if by_place and (name in swept or len(set(by_place.values())) > 1):
            named = {str(place): number for place, number in by_place.items()}
            if taken := named.keys() & model.parameters.keys():
                raise ValueError(
                    f"parameter {name!r}: found a number for each node or link, but {min(taken)!r} stands for two parameters; "
                    "rename one"
                )
            values |= named
        else:
            values[name] = next(iter(by_place.values()), value)
    if WEIGHTS in swept - set(values):
        names, ((_, graph),) = model.link_names(WEIGHTS), model.linked
        values |= {str(names[i, j]): float(weight) for i, j, weight in graph.links}
    return FrozenDict(values)


class _Table:
    """Read the parameters of a model from a table: numbers for all, lists, and numbers of one node or link."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.shared = {name: float(parameter.default) for name, parameter in model.parameters.items()}
        mixed = model.parameters if len(model.kinds) > 1 else ()  # kinds of nodes may have different defaults
        self.lists = {name: _at_nodes(model, name, model.defaults(name)) for name in mixed}
        self.single: dict[str, dict[Place, float]] = {}

    def add(self, name: str, value: Any) -> None:
        """Add one entry of the table; raise ValueError or TypeError as `parameters` does."""
        model, valid = self.model, self.model.parameters
        place = model.single(name)
        if WEIGHTS not in valid and (name if place is None else place.base) == WEIGHTS:
            raise ValueError(
                f"parameter {name!r}: the graph has the weights of links; expected an axis such as {WEIGHTS}_1_2 = [0.5, 1], "
                f"or draws of {WEIGHTS}"
            )
        if place is not None:
            self.single.setdefault(place.base, {})[place] = in_range(name, value, valid[place.base])
        elif name not in valid:
            raise ValueError(model.unknown(name, "parameter", valid))
        elif not model.holders(name) and (is_graph(value) or _listed(value)):
            self.lists[name] = _for_each_link(model, name, value)
        elif _listed(value):
            self.lists[name] = _at_nodes(model, name, _for_each_node(model, name, value))
        else:
            self.shared[name] = in_range(name, value, valid[name])
            self.lists.pop(name, None)

    def by_place(self, name: str, shared: float, swept: bool) -> dict[Place, float]:
        """Return the value of a parameter at each node or link; empty if one number holds for all of them."""
        if not (swept or name in self.lists or name in self.single):
            return {}
        nodes: Iterable[Place] = [NodeName(name, i) for i in self.model.holders(name)]
        places = nodes or self.model.link_names(name).values()
        return dict.fromkeys(places, shared) | self.lists.get(name, {}) | self.single.get(name, {})


def _at_nodes(model: Model, name: str, values: Iterable[float]) -> dict[Place, float]:
    return {NodeName(name, i): value for i, value in zip(model.holders(name), values, strict=True)}


def _listed(value: object) -> bool:
    return is_row(value) and not isinstance(value, Mapping) and not is_graph(value)


def _for_each_link(model: Model, name: str, value: Any) -> dict[Place, float]:
    """Return the values of a parameter of links from a list, a matrix, or the weights of a graph."""
    # A list has the order of the links of the graph, or of the edges (i < j) if links run both ways.
    parameter, links = model.parameters[name], model.link_names(name)
    what = f"parameter {name!r}{model.on_graph(name)}"
    if is_graph(value):
        table = {(i, j): float(weight) for i, j, weight in as_topology(what, value).links}
    else:
        if isinstance(value, set | frozenset):
            raise TypeError(f"{what}: found a set, which has no order; expected a number or a list")
        listed, count = first_of(value.tolist() if hasattr(value, "tolist") else value, max(len(links), model.n))
        if any(map(_listed, listed)):
            table = _matrix(what, model.n, listed)
        else:
            table = in_order(what, links, listed, count, f"; {a_sweep(name)}")
    for i, j in sorted(table.keys() ^ links.keys()):
        if (i, j) in links or check_number(what, table[i, j]) != 0:
            excess = "no number" if (i, j) in links else "a number without a link"
            more = "; a matrix may have the number 0" if (i, j) in links else ""
            raise ValueError(
                f"{what}: found {excess} where node {i + 1} feels node {j + 1}; expected one for each link, no others{more}"
            )
    checked = {at: in_range(str(link), table[at], parameter) for at, link in links.items()}
    return by_name(what, links, checked)


def a_sweep(name: str) -> str:
    """Return how to compare the numbers of a list, for messages about its length."""
    return f"numbers to compare are an axis: run(scene, {name}=[…])"


def by_name(
    what: str, links: Mapping[tuple[int, int], LinkName], table: Mapping[tuple[int, int], float]
) -> dict[Place, float]:
    """Return the numbers of a table of links (target, source) by the names of the links."""
    named: dict[Place, float] = {}
    for at, link in links.items():
        if named.setdefault(link, table[at]) != table[at]:
            raise ValueError(
                f"{what}: found {named[link]!r} and {table[at]!r} at nodes {link.target + 1} and {link.source + 1}; "
                "expected one number for both directions of a link that acts on both of its ends"
            )
    return named


def in_order(
    what: str, links: Mapping[tuple[int, int], LinkName], listed: Sequence[T], count: str, more: str = ""
) -> dict[tuple[int, int], T]:
    """Return the numbers of a list, one for each edge or each link, by (target, source)."""
    edges = [at for at in links if at[0] < at[1]] if all(at[::-1] in links for at in links) else []
    if len(listed) == len(edges) != 0:
        table = dict(zip(edges, listed, strict=True))
        return table | {at[::-1]: number for at, number in table.items()}
    if len(listed) != len(links):
        expected = f"{len(edges)} values, one for each edge, or " if edges else ""
        raise ValueError(
            f"{what}: found {count} values for {len(links)} links; expected {expected}one for each link, or one number for all{more}"
        )
    return dict(zip(links, listed, strict=True))


def _matrix(what: str, n: int, listed: Sequence[Any]) -> dict[tuple[int, int], Any]:
    """Return the entries of a matrix by target (row) and source (column)."""
    rows = [list(islice(row, n + 1)) if _listed(row) else [] for row in listed]
    if len(rows) != n or any(len(row) != n for row in rows):
        raise ValueError(f"{what}: found rows of numbers; expected a matrix of {n} rows of {n} numbers")
    return {(i, j): number for i, row in enumerate(rows) for j, number in enumerate(row)}


def _for_each_node(model: Model, name: str, value: Any) -> list[float]:
    """Return the values of a list, one for each node that has the parameter; ValueError for another length."""
    parameter, holders = model.parameters[name], model.holders(name)
    n = len(holders)
    if isinstance(value, set | frozenset):
        raise TypeError(f"parameter {name!r}: found a set, which has no order; expected a number or {n} numbers")
    listed, count = first_of(value.tolist() if hasattr(value, "tolist") else value, n)
    if len(listed) != n:
        raise ValueError(
            f"parameter {name!r}: found {count} values for {n} oscillators; expected {n} values or one number for all; "
            f"{a_sweep(name)}"
        )
    return [in_range(str(NodeName(name, i)), entry, parameter) for i, entry in zip(holders, listed, strict=True)]


def varied(values: Mapping[str, float], valid_names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of parameters with a value for each node or each link; "W" for swept weights."""
    names = dict.fromkeys(valid_names)
    weights = WEIGHTS not in names and any((link := LinkName.parse(name)) and link.base == WEIGHTS for name in values)
    return (*(name for name in names if name not in values), *((WEIGHTS,) if weights else ()))


def at_nodes(model: Model, values: Mapping[str, T]) -> Iterator[tuple[NodeKind, dict[str, T]]]:
    """Yield kind and parameter values of each node; skip nodes that equal an earlier node."""
    names = model.parameters
    holders = {name: dict.fromkeys(model.holders(name)) for name in names if name not in values}
    seen = set()
    for i in range(model.n if len(model.kinds) > 1 or holders else 1):
        at_node = {
            name: values[str(NodeName(name, i)) if name in holders else name]
            for name in names
            if i in holders.get(name, (i,))
        }
        key = (model.kind_of[i], *at_node.items())
        if key not in seen:
            seen.add(key)
            yield model.kinds[model.kind_of[i]], at_node


def at_links(model: Model, values: Mapping[str, object]) -> Iterator[tuple[Any, dict[str, str]]]:
    """Yield each coupling with events, and the names of its parameters' values at each link; once if all are equal."""
    for coupling, graph in model.linked:
        if getattr(coupling, "events", ()):
            differing = {name: model.link_names(name) for name in coupling.parameters if name not in values}
            for i, j, _ in graph.links if differing else islice(graph.links, 1):
                at_link = {p: str(differing[p].get((i, j), p)) if p in differing else p for p in coupling.parameters}
                yield coupling, {p: name for p, name in at_link.items() if name in values}


def drive(model: Model, values: Mapping[str, float]) -> Drive:
    timed = any(coupling.forced for coupling, _ in model.linked)
    differing = varied(values, model.parameters)
    edges = model.equations(differing).edges if timed else ()
    motion = drive_of((*model.unlinked.nodes, *edges), differing)
    if motion.frequency is None or not motion.by_values:
        return motion
    value = as_function(motion.frequency)(*(values[name] for name in names_in(motion.frequency)))
    return replace(motion, frequency=None) if math.isnan(value) else motion


def without(model: Model, values: Mapping[object, object], names: Iterable[str]) -> dict[object, object]:
    """Return the parameter values without entries of single nodes or links, such as a_2, of the parameters `names`."""
    remaining, replaced = dict(values), set(names)
    for name in values:
        parts = model.single(name) if isinstance(name, str) else None
        if parts is not None and parts.base in replaced:
            del remaining[name]
    return remaining


def collected(values: Mapping[str, float], varied: Iterable[str]) -> dict[str, float | list[float]]:
    """Return the parameters in the form of a scene file: parameters in `varied` as lists; weights are left out."""
    lists: dict[str, list[float]] = {name: [] for name in varied}
    table: dict[str, float | list[float]] = {}
    for name, value in values.items():
        parts = next((p for p in (LinkName.parse(name), NodeName.parse(name)) if p and p.base in lists), None)
        if parts is not None and parts.base == WEIGHTS and isinstance(parts, LinkName):
            continue
        if parts is not None:
            lists[parts.base].append(value)
            table.setdefault(parts.base, lists[parts.base])
        else:
            table[name] = value
    return table
