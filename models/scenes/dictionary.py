"""Convert a scene to names and values in JSON types, and back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from ..definitions.table import as_name_or_table, as_text_or_table
from ..graphs.families import family, names, topology
from ..graphs.graph_text import checked_name, is_composed, read_graph
from ..graphs.hypergraph import Hypergraph, triangles
from ..graphs.readers import edge_graph
from ..graphs.topology import Topology, from_matrix, read_matrix
from ..inputs.checks import check_integer, check_keys, check_table, check_text, short_repr
from ..inputs.plugin_files import part
from ..interactions.coupling import split
from ..networks.model import MOST_NODES
from ..sweeps.distribution import Draw
from ..sweeps.draws import GRAPH, Draws, Graphs, RandomGraph
from ..sweeps.parameters import collected


def arguments(values: object, keywords: Iterable[str], folder: Path | None = None) -> dict[str, Any]:
    """Return the keywords of a scene from names and values of a scene file; relative paths start at `folder`."""
    table = check_table("scene", values)
    check_keys("scene", table, ["sweep" if name == "axes" else name for name in keywords])
    read: dict[str, Any] = {str(key): value for key, value in table.items()}
    if "sweep" in read:
        sweep = dict(check_table("sweep", read.pop("sweep")))
        if "zipped" in sweep and "zipped" in read:
            raise ValueError("zipped is given twice, in [sweep] and above; expected it once; remove one")
        read["zipped"] = sweep.pop("zipped", read.get("zipped", False))
        read["axes"] = sweep

    def each(value: object, reader: Callable[[int, Any], object]) -> object:
        """Read the entries of a list, counted from 1; return any other value, which `Scene` then refuses."""
        return [*map(reader, count(1), value)] if isinstance(value, list) else value

    def graph(what: str, value: object) -> Topology:
        return graph_of(check_table(what, value), folder)

    def layer(k: int, value: object) -> tuple[object, Topology]:
        what = f"links {k}"
        entry = check_table(what, value)
        check_keys(what, entry, ("coupling", "topology"))
        for key in ("coupling", "topology"):
            if key not in entry:
                raise ValueError(f"{what}: {key!r} is missing; expected a coupling and its graph")
        return _placed(entry["coupling"], folder), graph(f"{what}: topology", entry["topology"])

    def draws(value: object) -> object:
        drawn = dict(check_table("draws", value))
        if GRAPH in drawn:
            drawn[GRAPH] = each(drawn[GRAPH], lambda k, entry: graph(f"draw {GRAPH} {k}", entry))
        return drawn

    readers: dict[str, Callable[[Any], object]] = {
        "topology": partial(graph, "topology"),
        "links": lambda value: each(value, layer),
        "nodes": lambda value: each(value, lambda _, group: _placed(group, folder)),
        "draws": draws,
        **{name: partial(_placed, folder=folder) for name in ("oscillator", "friction", "coupling")},
        **{name: partial(check_table, name) for name in ("parameters", "initial", "observe", "sections")},
    }
    return {name: readers[name](value) if name in readers else value for name, value in read.items()}


def _placed(name: object, folder: Path | None) -> object:
    """Return a name, or a table of names, with relative paths to files of code resolved against `folder`."""
    if isinstance(name, Mapping):
        return {key: _placed(e, folder) if key in ("oscillator", "friction") else e for key, e in name.items()}
    if not isinstance(name, str) or folder is None or not split(name)[0].endswith(".py"):
        return name
    return str(folder / name)


def graph_of(table: Mapping[object, Any], folder: Path | None = None) -> Topology:
    """Return the graph of a table in a scene file; relative paths in it start at `folder`."""
    name = _placed(table.get("name"), folder)
    is_family = isinstance(name, str) and "matrix" not in table and (name in names() or name.endswith(".py"))
    options = family(str(name)).options if is_family else {}
    check_keys("topology", table, ("name", "n", *options, "matrix", "edges", "triangles", "labels", "directed", "file"))
    if "file" in table:
        return _of_file(table, folder)
    if "triangles" in table:
        check_keys("topology", table, ("name", "n", "triangles"))
        name = check_text("topology name", table.get("name", "triangles"))
        return checked_name("topology", triangles(table["triangles"], table.get("n"), name))
    if "edges" in table:
        return _of_edges(table)
    if "matrix" in table:
        name = check_text("topology name", table.get("name", "matrix"))
        graph = checked_name("topology", from_matrix(table["matrix"], name))
        if "n" in table and check_integer("topology n", table["n"], 1, MOST_NODES) != graph.n:
            rows = f"{graph.n} row{'s' * (graph.n != 1)}"
            raise ValueError(f"topology: n = {table['n']} but the matrix has {rows}; remove n")
        return graph
    for key in ("name", "n"):
        if key not in table:
            raise ValueError(
                f"topology: {key!r} is missing in {short_repr(dict(table))}; expected name and n, or edges, triangles, matrix, or file"
            )
    n = check_integer("topology n", table["n"], 0, MOST_NODES)
    text = part("topology name", name)
    if is_family or not is_composed(text):
        return topology(text, n, **{key: table[key] for key in options if key in table})
    # An operation such as "weighted(complete(100), 1/100)".
    graph = read_graph(text, MOST_NODES)
    if graph.n != n:
        raise ValueError(f"topology: n = {n} but {short_repr(text)} has {graph.n} nodes; expected n = {graph.n}")
    return graph


def _of_file(table: Mapping[object, Any], folder: Path | None) -> Topology:
    if len(table) > 1:
        raise ValueError(f"topology: found {short_repr(dict(table))}; expected 'file' alone; remove the other keys")
    path = Path(folder or ".", check_text("topology file", table["file"], 4096))
    try:
        return read_matrix(path)
    except OSError as error:
        raise ValueError(f"topology: {' '.join(str(error).split())}") from None


def _of_edges(table: Mapping[object, Any]) -> Topology:
    """Return the graph of a list of edges between nodes 1 … n, between `labels`, or between all names in the edges."""
    name = check_text("topology name", table.get("name", "edges"))
    if "n" in table and "labels" in table:
        raise ValueError("topology: found n beside labels; expected one of them; leave n out")
    labels = table.get("labels")
    if "n" in table:
        labels = range(1, check_integer("topology n", table["n"], 1, MOST_NODES) + 1)
    elif labels is not None and not isinstance(labels, list):
        raise TypeError(f"topology labels: found {short_repr(labels)}; expected a list of texts or whole numbers")
    graph = edge_graph(table["edges"], labels, table.get("directed", False), name)
    return checked_name("topology", Topology(name, graph.n, graph.links) if "n" in table else graph)


def as_dict(values: Mapping[str, Any], varied: Iterable[str]) -> dict[str, Any]:
    """Return a scene with all its values in JSON types, under the names of a scene file."""
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
            {"coupling": as_text_or_table(coupling), "topology": graph_table(graph)} for coupling, graph in layers
        ]
    written["nodes"] = [group.as_dict() for group in values["nodes"]]
    if values["atol"] == values["rtol"] / 10:  # leave out the default, so that it follows a changed rtol
        del written["atol"]
    written["parameters"] = collected(values["parameters"], varied)
    written["initial"] = {name: list(states) for name, states in values["initial"].items()}
    written["record"] = [str(record) for record in values["record"]]
    written["observe"] = {name: str(observable) for name, observable in values["observe"].items()}
    written["sections"] = {name: section.as_table() for name, section in values["sections"].items()}
    written["draws"] = {name: _draw(drawn) for name, drawn in values["draws"].items()}
    if not written["draws"]:
        del written["realisations"]
    for name in ("observe", "sections", "stop", "draws"):
        if not written[name]:
            del written[name]
    written["t_eval"] = list(values["t_eval"])
    del written["samples" if values["t_eval"] else "t_eval"]
    written["sweep"] = {axis.name: list(axis.values) for axis in written.pop("axes")}
    return written


def _draw(drawn: Draws) -> object:
    """Return a distribution or a random graph as text, and listed numbers or graphs as a list."""
    if isinstance(drawn, Draw | RandomGraph):
        return str(drawn)
    return [*map(graph_table, drawn.graphs)] if isinstance(drawn, Graphs) else [*map(list, drawn)]


def graph_table(graph: Topology) -> dict[str, object]:
    """Return a graph in JSON types for `graph_of`: its family and options, or its edges.

    A weighted complete graph may have too many links for a list, so it becomes text: "weighted(complete(100), 1/100)".
    """
    if isinstance(graph, Hypergraph):
        listed = [[i + 1, j + 1, k + 1, *([] if w == 1 else [str(w)])] for i, j, k, w in graph.triangles]
        return {"name": str(graph.name), "n": graph.n, "triangles": listed}
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
