"""Graphs from lists of edges, networkx graphs, sparse matrices, edge lists and GraphML files.

Objects of networkx and SciPy are recognised by their methods, so that neither package is imported.  An
edge from u to v means that v feels u; the edge becomes a link with target v and source u.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence, Set
from fractions import Fraction
from numbers import Number
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ..inputs.checks import check_flag, check_integer, check_printable, short_repr, typed_repr
from ..inputs.rational_text import file_text, rational
from .links import LINK_LIMIT
from .topology import Topology, from_matrix


def as_topology(what: str, value: object) -> Topology:
    """Convert a Topology, a networkx graph, a sparse matrix or an array to a Topology."""
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
        Nodes are hashable labels, such as numbers or texts; the weight is 1 if it is left out.  Whole numbers are
        sorted; other labels keep the order of their first mention.  The first node has the state ``x_1``.  Results
        and drawings name nodes by their labels.
    n : int, optional
        Number of nodes.  If given, the nodes are 0 … n - 1, and some may have no edge.
    directed : bool, optional
        True if j feels i, but i does not feel j.
    name : str, optional
        Name of the graph.

    Raises
    ------
    ValueError
        On a loop, a repeated edge, a weight that is 0 or not rational, and on a node outside 0 … n - 1.
    TypeError
        On nodes that cannot be hashed.

    See Also
    --------
    synchain.graphs.from_matrix
    synchain.graphs.from_graph
    synchain.graphs.read_edges

    Examples
    --------
    >>> from synchain.graphs import from_edges
    >>> graph = from_edges([(0, 1), (1, 2, "1/2"), (2, 0)])
    >>> graph.n
    3
    >>> print(graph.spectrum)
    {0: 1, -2: 1, -3: 1}
    """
    nodes = None if n is None else range(check_integer(f"{name}: n", n, 1))
    return edge_graph(edges, nodes, directed, name)


def edge_graph(edges: object, nodes: Sequence[Hashable] | None, directed: object, name: str) -> Topology:
    """Return the graph of a list of edges; `nodes` None takes the labels in the edges as nodes."""
    if isinstance(edges, str | bytes | Mapping) or not isinstance(edges, Iterable):
        raise TypeError(f"{name}: found {typed_repr(edges)}; expected a list of edges, e.g. [(0, 1), (1, 2, 0.5)]")
    one_way = check_flag("directed", directed)
    listed: list[tuple[Hashable, Hashable, Fraction]] = []
    for number, edge in enumerate(edges, start=1):
        where = f"{name}: edge {number}"
        unordered = isinstance(edge, str | bytes | Set | Mapping)
        if unordered or not hasattr(edge, "__len__") or len(edge) not in (2, 3):
            raise ValueError(f"{where} is {short_repr(edge)}; expected (i, j) or (i, j, weight)")
        i, j = (_label(node, f"{where}: node") for node in edge[:2])
        listed.append((i, j, rational(edge[2], where) if len(edge) == 3 else Fraction(1)))
    if nodes is None:
        labels = list(dict.fromkeys(node for edge in listed for node in edge[:2]))
        nodes = sorted(labels) if all(type(label) is int for label in labels) else labels  # type: ignore[type-var]
    valid_nodes = nodes if isinstance(nodes, range) else set(nodes)
    for number, edge in enumerate(listed, start=1):
        unknown = next((node for node in edge[:2] if node not in valid_nodes), None)
        if unknown is not None:
            shown = ", ".join(map(str, nodes)) if len(nodes) < 5 else f"{nodes[0]} … {nodes[-1]}"
            raise ValueError(f"{name}: edge {number}: found the node {short_repr(unknown)}; expected one of {shown}")
    graph = _Graph(name, nodes)
    for i, j, weight in listed:
        graph.add(i, j, weight, one_way)
    return graph.topology(nodes)


def from_graph(graph: Any, weight: str | None = "weight", name: str = "graph") -> Topology:
    """Convert a networkx graph; nodes keep their order and their labels.

    Edges of a directed graph act from their first node on their second; parallel edges of a
    multigraph add up.

    Parameters
    ----------
    graph : networkx graph
        An object with nodes, edges and is_directed.
    weight : str or None, optional
        The edge attribute that holds the weight; a float stands for its shortest decimal.  An edge without the
        attribute has weight 1.  With None every edge has weight 1.
    name : str, optional
        Name of the graph.

    Raises
    ------
    TypeError
        On another object.
    ValueError
        On loops, on weights that are not rational, and if no edge has the attribute `weight` (the default is
        allowed to be missing).

    See Also
    --------
    synchain.graphs.from_edges
    synchain.graphs.read_graphml

    Examples
    --------
    >>> import networkx as nx
    >>> from synchain.graphs import from_graph
    >>> print(from_graph(nx.petersen_graph()).spectrum)
    {0: 1, -2: 5, -5: 4}
    """
    if not is_graph(graph):
        raise TypeError(f"{name} is a {type(graph).__name__}; expected a networkx graph (nodes, edges, is_directed)")
    edges = list(graph.edges(data=True))
    attributes = sorted({str(key) for *_, data in edges for key in data})
    if edges and weight not in (None, "weight", *attributes):
        found = ", ".join(attributes) or "no attributes"
        raise ValueError(f"{name}: no edge has the attribute {weight!r}; found {found}")
    built = _Graph(name, list(graph.nodes()), shown=repr)
    parallel = hasattr(graph, "is_multigraph") and bool(graph.is_multigraph())
    for u, v, data in edges:
        value = rational(data.get(weight, 1), f"{name}: weight of edge {u!r} - {v!r}")
        built.add(u, v, value, graph.is_directed(), parallel)
    return built.topology([_label(node, f"{name}: node") for node in built.nodes])


def is_graph(value: object) -> bool:
    return isinstance(value, Topology) or all(hasattr(value, need) for need in ("nodes", "edges", "is_directed"))


def from_sparse(matrix: object, adjacency: bool = False, name: str = "matrix") -> Topology:
    """Convert a SciPy sparse matrix to a graph.

    Parameters
    ----------
    matrix : SciPy sparse matrix
        The connectivity matrix G with row sums of zero.
    adjacency : bool, optional
        True if entry (i, j) is instead the weight with which node j acts on node i.
    name : str, optional
        Name of the graph.

    Raises
    ------
    TypeError
        If the matrix has no `tocoo`.
    ValueError
        If the matrix is not square, if a row sum of G exceeds 1e-12 of the row's entries, or if an adjacency
        matrix has a non-zero diagonal.

    See Also
    --------
    synchain.graphs.from_matrix
    synchain.graphs.from_edges

    Examples
    --------
    >>> from scipy.sparse import coo_array
    >>> from synchain.graphs import from_sparse
    >>> adjacency = coo_array(([1.0, 1.0], ([0, 1], [1, 0])), shape=(2, 2))
    >>> print(from_sparse(adjacency, adjacency=True).spectrum)
    {0: 1, -2: 1}
    """
    if not hasattr(matrix, "tocoo"):
        raise TypeError(f"{name} is a {type(matrix).__name__}; expected a SciPy sparse matrix (one that has tocoo)")
    entries = matrix.tocoo()
    if len(entries.shape) != 2:
        raise ValueError(f"{name} has the shape {entries.shape}; expected a square matrix")
    rows, columns = entries.shape
    if rows != columns:
        raise ValueError(f"{name} has {rows} rows and {columns} columns; expected a square matrix")
    graph = _Graph(name, range(rows))
    sums, sizes = [Fraction(0)] * rows, [Fraction(0)] * rows  # of each row: Σ entries and Σ |entries|
    for i, j, value in zip(entries.row.tolist(), entries.col.tolist(), entries.data.tolist(), strict=True):
        entry = rational(value, f"{name}: entry ({i + 1}, {j + 1})")
        sums[i], sizes[i] = sums[i] + entry, sizes[i] + abs(entry)
        if i != j:  # SciPy adds up entries of one position
            graph.weights[i, j] = graph.weights.get((i, j), Fraction(0)) + entry
        elif adjacency and entry:
            raise ValueError(
                f"{name}: entry ({i + 1}, {i + 1}) is {entry}; expected no diagonal in an adjacency matrix"
            )
    wrong = next((i for i in range(rows) if abs(sums[i]) * 10**12 > sizes[i]), None)
    if wrong is not None and not adjacency:
        raise ValueError(
            f"{name}: row {wrong + 1} sums to {sums[wrong]}; expected 0, or the synchronous state is no solution: "
            "correct its diagonal, or say adjacency=True"
        )
    return graph.topology(None)


def read_edges(path: str | Path, directed: bool = False) -> Topology:
    """Read a graph from a text file with one edge a line: two nodes and an optional weight.

    Nodes are words.  If all nodes are whole numbers, they are sorted; otherwise nodes keep the order of
    their first mention.  A line with one word is a node without edges; `#` starts a comment.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        As `from_edges` raises.

    See Also
    --------
    synchain.graphs.from_edges
    synchain.graphs.read_matrix
    synchain.graphs.read_graphml

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from synchain.graphs import read_edges
    >>> file = Path(mkdtemp()) / "triangle.txt"
    >>> _ = file.write_text("0 1\\n1 2\\n2 0\\n")
    >>> print(read_edges(file).spectrum)
    {0: 1, -3: 2}
    """
    text, name = file_text(path, "edge file")
    one, most = Fraction(1), LINK_LIMIT if directed else LINK_LIMIT // 2
    edges: list[tuple[str, str, Fraction]] = []
    mentioned: dict[str, None] = {}
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").split()
        if len(words) > 3:
            raise ValueError(f"{name}: line {number} has {len(words)} words; expected two nodes and perhaps a weight")
        mentioned.update(dict.fromkeys(words[:2]))
        if len(words) > 1:
            edges.append((words[0], words[1], rational(words[2], f"{name}: line {number}") if words[2:] else one))
            if len(edges) > most:
                raise ValueError(f"{name}: line {number} has edge {most + 1}; expected at most {LINK_LIMIT} links")
    # if all nodes are whole numbers below 10^18, sort them and keep them as numbers
    numeric = all(word.isascii() and word.isdecimal() and len(word) < 19 for word in mentioned)
    nodes = sorted(mentioned, key=int) if numeric else list(mentioned)
    graph = _Graph(name, nodes)
    for u, v, weight in edges:
        graph.add(u, v, weight, directed)
    return graph.topology([*map(int, nodes)] if numeric else nodes)


def read_graphml(path: str | Path, weight: str = "weight") -> Topology:
    """Read a graph from a GraphML file; nodes keep the order of the file.

    Parameters
    ----------
    path : str or Path
        The file.
    weight : str, optional
        The name of the edge data that holds the weight; an edge without such data has weight 1.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        On a document type, nested graphs, hyperedges or unknown nodes, and as `from_edges` raises.

    See Also
    --------
    synchain.graphs.from_graph
    synchain.graphs.read_edges

    References
    ----------
    U. Brandes et al., Graph Drawing 2001, LNCS 2265, 501.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import networkx as nx
    >>> from synchain.graphs import read_graphml
    >>> file = Path(mkdtemp()) / "path.graphml"
    >>> nx.write_graphml(nx.path_graph(3), file)
    >>> print(read_graphml(file).spectrum)
    {0: 1, -1: 1, -3: 1}
    """
    text, name = file_text(path, "GraphML file")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # even inside a comment, whose limits are unsure
        raise ValueError(f"{name} declares a document type or entities; expected plain GraphML: remove <!DOCTYPE …>")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"{name} is no XML: {error}") from None
    graphs = [element for element in root.iter() if _tag(element) == "graph"]
    if _tag(root) != "graphml" or len(graphs) != 1:
        raise ValueError(f"{name} holds {len(graphs)} graphs in <{_tag(root)}>; expected one, not nested, in <graphml>")

    # collect the ids of the weight (one <key> for each number type), and the default weight
    keys, default = set[str](), "1"
    for element in root:
        for_edges = _tag(element) == "key" and element.get("for", "all") in ("edge", "all")
        if for_edges and element.get("attr.name") == weight:
            keys.add(element.get("id", ""))
            default = next((child.text or "" for child in element if _tag(child) == "default"), default).strip()

    nodes = [_attribute(element, "id", name) for element in graphs[0] if _tag(element) == "node"]
    if len(set(nodes)) != len(nodes):
        raise ValueError(f"{name} has two nodes of one id; expected each id once")
    built = _Graph(name, nodes)
    directed = graphs[0].get("edgedefault", "undirected") == "directed"
    for element in graphs[0]:
        if _tag(element) == "hyperedge":
            raise ValueError(f"{name} has a hyperedge; expected edges of two nodes")
        if _tag(element) != "edge":
            continue
        source, target = (_attribute(element, end, name) for end in ("source", "target"))
        for end in (source, target):
            if end not in built.index:
                raise ValueError(f"{name} has an edge to node {end!r}, which it does not list")
        data = [child.text or "" for child in element if _tag(child) == "data" and child.get("key") in keys]
        value = rational(data[0].strip() if data else default, f"{name}: weight of edge {source} - {target}")
        one_way = {"true": True, "false": False}.get(element.get("directed", ""), directed)
        built.add(source, target, value, one_way)
    return built.topology(nodes)


def _attribute(element: ElementTree.Element, key: str, name: str) -> str:
    value = element.get(key)
    if value is None:
        raise ValueError(f"{name}: <{_tag(element)}> has no {key!r}; expected one")
    return value


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]  # without its namespace


class _Graph:
    """Builder of a graph: nodes, and the weight of each link (target, source)."""

    def __init__(self, name: str, nodes: Sequence[Hashable], shown: Callable[[object], str] = str) -> None:
        for node in nodes if shown is str and not isinstance(nodes, range) else ():
            check_printable(f"{name}: node name", str(node))
        self.name, self.nodes, self.shown = name, nodes, shown
        self.index = {node: k for k, node in enumerate(nodes)}
        self.weights: dict[tuple[int, int], Fraction] = {}

    def add(self, u: Hashable, v: Hashable, weight: Fraction, directed: bool, parallel: bool = False) -> None:
        """Add an edge from u to v; add weights of parallel edges, or raise ValueError if `parallel` is false."""
        source, target = self.index[u], self.index[v]
        links = ((target, source),) if directed else ((target, source), (source, target))
        problem = ""
        if target == source:
            problem = (
                "joins a node to itself; it has no effect on a difference: leave it out, or add "
                "what else a node does to itself to the rates of the node"
            )
        elif not weight:
            problem = "has weight 0; leave it out or give it a weight"
        elif not parallel and any(link in self.weights for link in links):
            problem = "is given twice; expected each edge once: add the weights up"
        if problem:
            raise ValueError(f"{self.name}: edge {self.shown(u)} - {self.shown(v)} {problem}")
        for link in links:
            self.weights[link] = self.weights[link] + weight if link in self.weights else weight

    def topology(self, labels: Sequence[object] | None) -> Topology:
        """Return the graph without the links whose parallel weights cancel."""
        if len(self.weights) > LINK_LIMIT:
            raise ValueError(f"{self.name}: {len(self.weights)} links; expected at most {LINK_LIMIT}")
        links = tuple((i, j, self.weights[i, j]) for i, j in sorted(self.weights) if self.weights[i, j])
        return Topology(self.name, len(self.nodes), links, labels=labels)


def _label(node: object, what: str) -> Hashable:
    """Return the label of a node; convert a whole number of another type, such as 1.0 or numpy.int64(1), to int."""
    if node is None or not isinstance(node, Hashable):
        raise TypeError(f"{what}: found {typed_repr(node)}; expected a label: a number, a text or a tuple")
    if not isinstance(node, Number) or isinstance(node, bool):
        return node
    number: Any = node
    try:
        nearest = int(number)
    except (TypeError, ValueError, OverflowError):  # complex, nan, inf
        return node
    return nearest if nearest == number else node
