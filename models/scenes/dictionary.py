"""A scene as names and values in JSON types, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..definitions.table import as_name_or_table, as_text_or_table
from ..graphs.families import family, names, topology
from ..graphs.graph_text import checked_name, is_composed, read_graph
from ..graphs.readers import edge_graph
from ..graphs.topology import Topology, from_matrix, read_matrix
from ..inputs.checks import check_integer, check_keys, check_table, check_text, short_repr
from ..inputs.plugins import part
from ..interactions.coupling import split
from ..networks.model import MOST_NODES
from ..sweeps.distribution import Draw
from ..sweeps.draw import GRAPH, Draws, Graphs, RandomGraph
from ..sweeps.parameters import collected


def arguments(values: object, keywords: Iterable[str], folder: Path | None = None) -> dict[str, Any]:
    """Return the keywords of a scene from names and values as in a scene file."""
    found = check_table("scene", values)
    check_keys("scene", found, ["sweep" if name == "axes" else name for name in keywords])
    given: dict[str, Any] = {str(key): value for key, value in found.items()}
    if "topology" in given:
        given["topology"] = graph_of(check_table("topology", given["topology"]), folder)
    if "sweep" in given:
        sweep = dict(check_table("sweep", given.pop("sweep")))
        if "zipped" in sweep and "zipped" in given:
            raise ValueError("zipped is given twice, in [sweep] and above; expected it once; remove one")
        given["zipped"] = sweep.pop("zipped", given.get("zipped", False))
        given["axes"] = sweep
    for name in ("parameters", "initial", "observe", "sections", "draws"):
        if name in given:
            check_table(name, given[name])
    graphs = given.get("draws", {}).get(GRAPH)
    if isinstance(graphs, list):
        tables = (check_table(f"draw {GRAPH} {k}", graph) for k, graph in enumerate(graphs, start=1))
        given["draws"] = {**given["draws"], GRAPH: [graph_of(table, folder) for table in tables]}
    for name in ("oscillator", "friction", "coupling"):
        if name in given:
            given[name] = _placed(given[name], folder)
    if isinstance(given.get("links"), list):
        given["links"] = [_layer(f"links {k}", entry, folder) for k, entry in enumerate(given["links"], start=1)]
    if isinstance(given.get("nodes"), list):
        given["nodes"] = [_placed(group, folder) for group in given["nodes"]]
    return given


def _placed(name: object, folder: Path | None) -> object:
    """The name of a part, or a table with such names; a path to a file of code starts in the folder of the scene file."""
    if isinstance(name, Mapping):
        return {key: _placed(e, folder) if key in ("oscillator", "friction") else e for key, e in name.items()}
    if not isinstance(name, str) or folder is None or not split(name)[0].endswith(".py"):
        return name
    return str(folder / name)


def _layer(what: str, given: object, folder: Path | None) -> tuple[object, Topology]:
    """A layer of links, {coupling = …, topology = …}."""
    table = check_table(what, given)
    check_keys(what, table, ("coupling", "topology"))
    for key in ("coupling", "topology"):
        if key not in table:
            raise ValueError(f"{what}: {key!r} is missing; expected a coupling and its graph")
    return _placed(table["coupling"], folder), graph_of(check_table(f"{what}: topology", table["topology"]), folder)


def graph_of(given: Mapping[object, Any], folder: Path | None = None) -> Topology:
    """Return the graph of a table in a scene file; relative paths in it start at `folder`."""
    name = _placed(given.get("name"), folder)
    known = isinstance(name, str) and "matrix" not in given and (name in names() or name.endswith(".py"))
    options = family(str(name)).options if known else {}
    check_keys("topology", given, ("name", "n", *options, "matrix", "edges", "labels", "directed", "file"))
    if "file" in given:
        return _of_file(given, folder)
    if "edges" in given:
        return _of_edges(given)
    if "matrix" in given:
        return _of_matrix(given)
    for key in ("name", "n"):
        if key not in given:
            found = short_repr(dict(given))
            raise ValueError(
                f"topology: {key!r} is missing in {found}; expected name and n, or edges, or matrix, or file"
            )
    n = check_integer("topology n", given["n"], 0, MOST_NODES)
    if not known and is_composed(part("topology name", name)):
        return _composed(str(name), n)
    chosen = {key: given[key] for key in options if key in given}
    return topology(part("topology name", name), n, **chosen)


def _composed(name: str, n: int) -> Topology:
    """The graph of a text such as "weighted(complete(100), 1/100)"."""
    graph = read_graph(name, MOST_NODES)
    if graph.n != n:
        raise ValueError(f"topology: n = {n} but {short_repr(name)} has {graph.n} nodes; expected n = {graph.n}")
    return graph


def _of_file(given: Mapping[object, Any], folder: Path | None) -> Topology:
    if len(given) > 1:
        raise ValueError(f"topology: found {short_repr(dict(given))}; expected 'file' alone; remove the other keys")
    path = Path(folder or ".", check_text("topology file", given["file"], 4096))
    try:
        return read_matrix(path)
    except OSError as error:
        raise ValueError(f"topology: {' '.join(str(error).split())}") from None


def _of_edges(given: Mapping[object, Any]) -> Topology:
    """The graph of a list of edges, of nodes 1 … n, of the nodes of `labels`, or of whatever nodes the edges name."""
    name = check_text("topology name", given.get("name", "edges"))
    if "n" in given and "labels" in given:
        raise ValueError("topology: found n beside labels; expected one of them; leave n out")
    labels = given.get("labels")
    if "n" in given:
        labels = range(1, check_integer("topology n", given["n"], 1, MOST_NODES) + 1)
    elif labels is not None and not isinstance(labels, list):
        raise TypeError(f"topology labels: found {short_repr(labels)}; expected a list of texts or whole numbers")
    graph = edge_graph(given["edges"], labels, given.get("directed", False), name)
    return checked_name("topology", Topology(name, graph.n, graph.links) if "n" in given else graph)


def _of_matrix(given: Mapping[object, Any]) -> Topology:
    name = check_text("topology name", given.get("name", "matrix"))
    graph = checked_name("topology", from_matrix(given["matrix"], name))
    if "n" in given and check_integer("topology n", given["n"], 1, MOST_NODES) != graph.n:
        raise ValueError(f"topology: n = {given['n']} but the matrix has {graph.n} row{'s' * (graph.n != 1)}; remove n")
    return graph


def as_dict(values: Mapping[str, Any], varied: Iterable[str]) -> dict[str, Any]:
    """Return a whole scene in JSON types, in the names of a scene file."""
    written = dict(values)
    for name in ("contact", "time_unit", "continuation", "section"):
        written[name] = str(values[name])
    for name in ("oscillator", "friction"):
        written[name] = "none" if values[name] is None else as_name_or_table(values[name])
    written["coupling"], written["topology"] = as_text_or_table(values["coupling"]), graph_table(values["topology"])
    layers = written.pop("links")
    if layers is not None:
        del written["coupling"], written["topology"]
        written["links"] = [
            {"coupling": as_text_or_table(own), "topology": graph_table(graph)} for own, graph in layers
        ]
    written["nodes"] = [group.as_dict() for group in values["nodes"]]
    if values["atol"] == values["rtol"] / 10:  # it follows rtol, in functions with a tolerance of their own too
        del written["atol"]
    written["parameters"] = collected(values["parameters"], varied)
    written["initial"] = {name: list(states) for name, states in values["initial"].items()}
    written["record"] = [str(record) for record in values["record"]]
    written["observe"] = {name: str(observable) for name, observable in values["observe"].items()}
    written["sections"] = {name: section.as_table() for name, section in values["sections"].items()}
    written["draws"] = {name: _draw(drawn) for name, drawn in values["draws"].items()}
    if not written["draws"]:
        del written["rng"], written["realisations"]
    for name in ("observe", "sections", "stop", "draws"):
        if not written[name]:
            del written[name]
    written["sweep"] = {axis.name: list(axis.values) for axis in written.pop("axes")}
    return written


def _draw(drawn: Draws) -> object:
    """A distribution or a random graph as text, or numbers or graphs by realisation."""
    if isinstance(drawn, Draw | RandomGraph):
        return str(drawn)
    return [*map(graph_table, drawn.graphs)] if isinstance(drawn, Graphs) else [*map(list, drawn)]


def graph_table(graph: Topology) -> dict[str, object]:
    """Return a graph in JSON types: its family and options, or its edges; `graph_of` reads it.

    Of a weighted complete graph, whose links may be too many to be listed, it is the text of the operation.
    """
    try:
        composed = graph.all_to_all is not None and is_composed(graph.name)
        same = (read_graph(graph.name) if composed else topology(graph.name, graph.n, **dict(graph.options))) == graph
    except (ValueError, TypeError):
        same = False
    if same:
        options = {key: list(value) if isinstance(value, tuple) else value for key, value in graph.options}
        return {"name": str(graph.name), "n": graph.n, **options}
    labels, one_way = graph.labels, not graph.symmetric
    edges: list[list[object]] = []
    for target, source, weight in graph.links:
        if one_way or source < target:
            number = () if weight == 1 else (int(weight) if weight.denominator == 1 else str(weight),)
            edges.append([labels[source], labels[target], *number])
    nodes = {"labels": list(labels)} if graph.labelled else {"n": graph.n}
    return {"name": str(graph.name), **nodes, **({"directed": True} if one_way else {}), "edges": edges}
