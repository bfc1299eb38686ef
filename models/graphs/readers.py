"""Graphs from lists of edges, networkx graphs, sparse matrices, edge lists and GraphML files.

Objects are known by their methods, so that none of those packages is needed here.  An edge from u
to v means that v feels u: it becomes the link v <- u.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from fractions import Fraction
from numbers import Number
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ..inputs.checks import check_flag, check_integer, check_printable, short_repr, typed_repr
from ..inputs.rational_text import file_text, rational
from .links import LINK_LIMIT
from .topology import Topology, from_matrix

Weights = dict[tuple[int, int], Fraction]


def as_topology(what: str, value: object) -> Topology:
    """Return the graph that a value is, or stands for."""
    if isinstance(value, Topology):
        return value
    if is_graph(value):
        return from_graph(value)
    if hasattr(value, "tocoo"):
        return from_sparse(value)
    if hasattr(value, "tolist") and hasattr(value, "shape"):
        return from_matrix(value.tolist())
    raise TypeError(
        f"{what}: found {typed_repr(value)}; expected a graph, e.g. chain(4), a networkx graph or a connectivity "
        "matrix; make one of a list with from_edges or from_matrix"
    )


def from_edges(
    edges: Iterable[Sequence[object]], n: int | None = None, directed: bool = False, name: str = "edges"
) -> Topology:
    """Return the graph of a list of edges.

    Parameters
    ----------
    edges : iterable of (i, j) or (i, j, weight)
        Nodes are labels of any kind that can be hashed, numbers too; the weight is 1 without.  Whole numbers are put in
        ascending order, other labels in that of their first mention: the first one has the first state, such as
        ``x_1``.  Results and drawings name nodes by their labels.
    n : int, optional
        Number of nodes, which are 0 … n - 1 then, those without edges too.
    directed : bool, optional
        True if j feels i, but i does not feel j.
    name : str, optional
        What the graph is called.

    Raises
    ------
    ValueError
        On a loop, a repeated edge, a weight that is not rational or 0, and on a node outside 0 … n - 1.
    TypeError
        On nodes that cannot be hashed.
    """
    if n is not None:
        return edge_graph(edges, range(check_integer(f"{name}: n", n, 1)), directed, name)
    return edge_graph(edges, None, directed, name)


def edge_graph(edges: object, nodes: Sequence[Hashable] | None, directed: object, name: str) -> Topology:
    """Return the graph of a list of edges between given nodes, or between those that the edges name."""
    if isinstance(edges, str | bytes | Mapping) or not isinstance(edges, Iterable):
        raise TypeError(f"{name}: found {typed_repr(edges)}; expected a list of edges, e.g. [(0, 1), (1, 2, 0.5)]")
    one_way = check_flag("directed", directed)
    listed = [_edge(edge, f"{name}: edge {k}") for k, edge in enumerate(edges, start=1)]
    if nodes is None:
        nodes = sorted_labels(dict.fromkeys(node for edge in listed for node in edge[:2]))
    known = nodes if isinstance(nodes, range) else set(nodes)
    for k, edge in enumerate(listed, start=1):
        strange = next((node for node in edge[:2] if node not in known), None)
        if strange is not None:
            raise ValueError(
                f"{name}: edge {k}: found the node {short_repr(strange)}; expected one of {_listed(nodes)}"
            )
    return assembled(nodes, ((*edge, one_way) for edge in listed), name)


def _listed(nodes: Sequence[Hashable]) -> str:
    """The nodes in words, of many the first and the last."""
    return ", ".join(map(str, nodes)) if len(nodes) < 5 else f"{nodes[0]} … {nodes[-1]}"


def from_graph(graph: Any, weight: str | None = "weight", name: str = "graph") -> Topology:
    """Return the graph of a networkx graph, nodes in its order and with its labels.

    Edges of a directed graph act from their first node on their second; parallel edges of a
    multigraph add up.

    Parameters
    ----------
    graph : networkx graph
        An object with nodes, edges and is_directed.
    weight : str or None, optional
        The edge attribute that holds the weight, read through its decimal text; an edge without it has weight 1, and
        every edge for None.
    name : str, optional
        What the graph is called.

    Raises
    ------
    TypeError
        On another object.
    ValueError
        On loops, on weights that are not rational, and if no edge has an attribute that was named.
    """
    if not is_graph(graph):
        raise TypeError(f"{name} is a {type(graph).__name__}; expected a networkx graph (nodes, edges, is_directed)")
    nodes = list(graph.nodes())
    place = {node: k for k, node in enumerate(nodes)}
    many = bool(graph.is_multigraph()) if hasattr(graph, "is_multigraph") else False
    weights, called = Weights(), _GraphNames(name, [repr(node) for node in nodes])
    edges = list(graph.edges(data=True))
    known = sorted({str(key) for *_, data in edges for key in data})
    if edges and weight not in (None, "weight", *known):
        raise ValueError(f"{name}: no edge has the attribute {weight!r}; found {', '.join(known) or 'no attributes'}")
    for u, v, data in edges:
        value = rational(data.get(weight, 1), f"{name}: weight of edge {u!r} - {v!r}")
        _put(weights, place[v], place[u], value, graph.is_directed(), called, many)
    return _graph(name, len(nodes), weights, [_label(node, f"{name}: node") for node in nodes])


def is_graph(value: object) -> bool:
    """True for a Topology and for a graph of networkx."""
    return isinstance(value, Topology) or all(hasattr(value, need) for need in ("nodes", "edges", "is_directed"))


def from_sparse(matrix: object, adjacency: bool = False, name: str = "matrix") -> Topology:
    """Return the graph of a SciPy sparse matrix.

    Parameters
    ----------
    matrix : SciPy sparse matrix
        The connectivity matrix G with row sums of zero.
    adjacency : bool, optional
        True if the matrix holds the weights with which j acts on i instead.
    name : str, optional
        What the graph is called.

    Raises
    ------
    TypeError
        If the matrix has no `tocoo`.
    ValueError
        If it is not square, a row sum is not zero (beyond 1e-12 of its entries), or an adjacency
        matrix has a diagonal.
    """
    if not hasattr(matrix, "tocoo"):
        raise TypeError(f"{name} is a {type(matrix).__name__}; expected a SciPy sparse matrix (one that has tocoo)")
    entries = matrix.tocoo()
    if len(entries.shape) != 2:
        raise ValueError(f"{name} has the shape {entries.shape}; expected a square matrix")
    rows, columns = entries.shape
    if rows != columns:
        raise ValueError(f"{name} has {rows} rows and {columns} columns; expected a square matrix")
    weights, sums, sizes = Weights(), [Fraction(0)] * rows, [Fraction(0)] * rows
    for i, j, value in zip(entries.row.tolist(), entries.col.tolist(), entries.data.tolist(), strict=True):
        number = rational(value, f"{name}: entry ({i + 1}, {j + 1})")
        sums[i], sizes[i] = sums[i] + number, sizes[i] + abs(number)
        if i != j:
            weights[i, j] = weights.get((i, j), Fraction(0)) + number
        elif adjacency and number:
            raise ValueError(
                f"{name}: entry ({i + 1}, {i + 1}) is {number}; expected no diagonal in an adjacency matrix"
            )
    wrong = next((i for i in range(rows) if abs(sums[i]) * 10**12 > sizes[i]), None)
    if wrong is not None and not adjacency:
        raise ValueError(
            f"{name}: row {wrong + 1} sums to {sums[wrong]}; expected 0, or the synchronous state is no solution: "
            "correct its diagonal, or say adjacency=True"
        )
    return _graph(name, rows, weights)


def read_edges(path: str | Path, directed: bool = False) -> Topology:
    """Return the graph of a text file with an edge a line: two nodes and perhaps a weight.

    Nodes are any words; whole numbers are put in ascending order, other names in that of their
    first mention.  A line with one word is a node without edges; `#` starts a comment.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        On what `from_edges` refuses.
    """
    text, name = file_text(path, "edge file")
    one, most = Fraction(1), LINK_LIMIT if directed else LINK_LIMIT // 2
    edges: list[tuple[str, str, Fraction]] = []
    order: dict[str, None] = {}
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").split()
        if len(words) > 3:
            raise ValueError(f"{name}: line {number} has {len(words)} words; expected two nodes and perhaps a weight")
        order.update(dict.fromkeys(words[:2]))
        if len(words) > 1:
            edges.append((words[0], words[1], rational(words[2], f"{name}: line {number}") if words[2:] else one))
            if len(edges) > most:
                raise ValueError(f"{name}: line {number} has edge {most + 1}; expected at most {LINK_LIMIT} links")
    numbers = all(word.isascii() and word.isdecimal() and len(word) < 19 for word in order)
    nodes = sorted(order, key=int) if numbers else list(order)
    return assembled(nodes, [(u, v, weight, directed) for u, v, weight in edges], name, int if numbers else str)


def read_graphml(path: str | Path, weight: str = "weight") -> Topology:
    """Return the graph of a GraphML file, nodes in its order.

    Parameters
    ----------
    path : str or Path
        The file.
    weight : str, optional
        The name of the edge data that holds the weight; 1 without.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        On a document type, nested graphs, hyperedges, unknown nodes and what `from_edges` refuses.

    References
    ----------
    U. Brandes et al., Graph Drawing 2001, LNCS 2265, 501.
    """
    text, name = file_text(path, "GraphML file")
    nodes, edges = parsed(text, name, weight)
    return assembled(nodes, edges, name)


def assembled(
    nodes: Sequence[Hashable],
    edges: Iterable[tuple[Hashable, Hashable, object, bool]],
    name: str,
    label: Callable[[Any], object] = lambda node: node,
) -> Topology:
    """Return the graph of named nodes and edges (from, to, weight, one-way); the labels are `label` of the names."""
    for node in nodes:
        check_printable(f"{name}: node name", str(node))
    place = {node: k for k, node in enumerate(nodes)}
    weights, called = Weights(), _GraphNames(name, nodes)
    for u, v, value, directed in edges:
        number = value if type(value) is Fraction else rational(value, f"{name}: weight of edge {u} - {v}")
        _put(weights, place[v], place[u], number, directed, called)
    return _graph(name, len(nodes), weights, [*map(label, nodes)])


def sorted_labels(labels: Iterable[Hashable]) -> list[Hashable]:
    """Return whole numbers in ascending order, other labels as they are."""
    listed = list(labels)
    return sorted(listed) if all(type(label) is int for label in listed) else listed  # type: ignore[type-var]


@dataclass(frozen=True, slots=True)
class _GraphNames:
    """The names of a graph and its nodes, for messages."""

    graph: str
    nodes: Sequence[Hashable]

    def edge(self, source: int, target: int) -> str:
        return f"{self.graph}: edge {self.nodes[source]} - {self.nodes[target]}"


def _put(
    weights: Weights, target: int, source: int, value: Fraction, directed: bool, called: _GraphNames, many: bool = False
) -> None:
    """Add an edge; ValueError if it is a loop, has no weight or is there already."""
    if target == source:
        raise ValueError(
            f"{called.edge(source, target)} joins a node to itself; it has no effect on a difference: leave it out, or add "
            "what else a node does to itself to the rates of the node"
        )
    if not value:
        raise ValueError(f"{called.edge(source, target)} has weight 0; leave it out or give it a weight")
    for link in ((target, source),) if directed else ((target, source), (source, target)):
        if link not in weights:
            weights[link] = value
        elif many:
            weights[link] += value
        else:
            raise ValueError(
                f"{called.edge(source, target)} is given twice; expected each edge once: add the weights up"
            )


def _edge(edge: Sequence[object], where: str) -> tuple[Hashable, Hashable, Fraction]:
    unordered = isinstance(edge, str | bytes | Set | Mapping)
    if unordered or not hasattr(edge, "__len__") or len(edge) not in (2, 3):
        raise ValueError(f"{where} is {short_repr(edge)}; expected (i, j) or (i, j, weight)")
    i, j = (_label(node, f"{where}: node") for node in edge[:2])
    return i, j, rational(edge[2], where) if len(edge) == 3 else Fraction(1)


def _label(node: object, what: str) -> Hashable:
    """A label of a node; a number that is whole, 1.0 or that of NumPy, is an int, to which it is equal."""
    if node is None or not isinstance(node, Hashable):
        raise TypeError(f"{what}: found {typed_repr(node)}; expected a label: a number, a text or a tuple")
    if isinstance(node, Number) and not isinstance(node, bool) and (whole := _whole(node)) is not None:
        return whole
    return node


def _whole(number: Any) -> int | None:
    """The int that a number is equal to; None of any other number."""
    try:
        nearest = int(number)
    except (TypeError, ValueError, OverflowError):
        return None
    return nearest if nearest == number else None


def _graph(name: str, n: int, weights: Weights, labels: Sequence[object] | None = None) -> Topology:
    if len(weights) > LINK_LIMIT:
        raise ValueError(f"{name}: {len(weights)} links; expected at most {LINK_LIMIT}")
    links = tuple((i, j, weights[i, j]) for i, j in sorted(weights) if weights[i, j])
    return Topology(name, n, links, labels=labels)


Edge = tuple[str, str, object, bool]


def parsed(text: str, name: str, weight: str) -> tuple[list[str], list[Edge]]:
    """Return node names, and edges (from, to, weight as text, one-way); else ValueError."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # anywhere: what looks like a comment may be none
        raise ValueError(f"{name} declares a document type or entities; expected plain GraphML: remove <!DOCTYPE …>")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"{name} is no XML: {error}") from None
    graphs = [element for element in root.iter() if _tag(element) == "graph"]
    if _tag(root) != "graphml" or len(graphs) != 1:
        raise ValueError(f"{name} holds {len(graphs)} graphs in <{_tag(root)}>; expected one, not nested, in <graphml>")
    graph = graphs[0]
    keys, default = _keys(root, weight)
    nodes = [_attribute(element, "id", name) for element in graph if _tag(element) == "node"]
    if len(set(nodes)) != len(nodes):
        raise ValueError(f"{name} has two nodes of one id; expected each id once")
    return nodes, list(_edges(graph, set(nodes), keys, default, name))


def _edges(graph: ElementTree.Element, nodes: set[str], keys: set[str], default: str, name: str) -> Iterator[Edge]:
    directed = graph.get("edgedefault", "undirected") == "directed"
    for element in graph:
        if _tag(element) == "hyperedge":
            raise ValueError(f"{name} has a hyperedge; expected edges of two nodes")
        if _tag(element) != "edge":
            continue
        ends = [_attribute(element, end, name) for end in ("source", "target")]
        unknown = next((end for end in ends if end not in nodes), None)
        if unknown is not None:
            raise ValueError(f"{name} has an edge to node {unknown!r}, which it does not list")
        given = [child.text or "" for child in element if _tag(child) == "data" and child.get("key") in keys]
        one_way = {"true": True, "false": False}.get(element.get("directed", ""), directed)
        yield ends[0], ends[1], given[0].strip() if given else default, one_way


def _keys(root: ElementTree.Element, weight: str) -> tuple[set[str], str]:
    """The ids of the weight of edges (one for each type of number), and its default."""
    ids, default = set[str](), "1"
    for element in root:
        if (
            _tag(element) == "key"
            and element.get("for", "all") in ("edge", "all")
            and element.get("attr.name") == weight
        ):
            ids.add(element.get("id", ""))
            default = next((child.text or "" for child in element if _tag(child) == "default"), default).strip()
    return ids, default


def _attribute(element: ElementTree.Element, key: str, name: str) -> str:
    value = element.get(key)
    if value is None:
        raise ValueError(f"{name}: <{_tag(element)}> has no {key!r}; expected one")
    return value


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]
