"""`Topology`, a graph with exact weights, and its construction from a matrix or a file.

The connectivity matrix is G = weighted adjacency minus in-degree: every row sums to zero, and the
coupling term is sigma * G * x.  Only `matrix` and `spectrum` load SymPy.  A graph with a rule
builds its links on first use.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from ..inputs.checks import check_instance, check_integer, check_printable, short_repr, typed_repr
from ..inputs.display import HasDrawing
from ..inputs.options import Options
from ..inputs.rational_text import file_text, parse_rows, rational_rows, total
from .links import Link, join
from .matrices import Exact, GraphMatrix, MatrixKind

if TYPE_CHECKING:
    import sympy as sp


class Rule(Protocol):
    """Protocol of the family or operation that made a graph: compute links, and facts that need no links."""

    # Equal rules make equal graphs.

    @property
    def link_count(self) -> int | None:
        """The number of links; None if only building the links can tell."""

    @property
    def undirected(self) -> bool:
        """True if G is known to be symmetric."""

    @property
    def all_to_all(self) -> Fraction | None:
        """The common weight if each node is known to feel every other node with one weight; else None."""

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links."""

    def eigenvalues(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the eigenvalues of G with multiplicities, each once; None without a closed form."""


@dataclass(frozen=True, slots=True, init=False, eq=False)
class Topology(Exact, HasDrawing):
    """`n` nodes and their sorted links (target, source, weight); an undirected edge is two links.

    Parameters
    ----------
    name : str
        Name of the graph.
    n : int
        Number of nodes.
    links : tuple of (int, int, Fraction), optional
        Target, source and weight of each link, sorted.  Leave the links out for a graph with a `rule`,
        which builds them on first use.
    options : tuple of (str, value)
        Keywords with which the family made the graph.
    rule : Rule, optional
        The family or operation that made the graph.
    labels : sequence, optional
        Distinct names of the nodes: numbers, texts or other values, such as the nodes of a networkx graph.  If all
        labels are whole numbers, they stay numbers; otherwise all are converted to text.  The default is 1 … n.

    Raises
    ------
    ValueError, TypeError
        If there are not n distinct labels, or if a link refers to an unknown node, joins a node to itself, is repeated,
        out of order or without weight.

    See Also
    --------
    synchain.graphs.from_edges
    synchain.graphs.topology
    synchain.graphs.Spectrum

    Examples
    --------
    >>> import synchain as sc
    >>> graph = sc.graphs.chain(4)
    >>> graph
    Topology('chain', n=4, 3 edges)
    >>> print(graph.spectrum)
    {0: 1, -2 + sqrt(2): 1, -2: 1, -2 - sqrt(2): 1}
    """

    name: str
    n: int
    options: Options
    rule: Rule | None
    _links: tuple[Link, ...] | None
    _labels: tuple[int, ...] | tuple[str, ...] | None

    def __init__(
        self,
        name: str,
        n: int,
        links: tuple[Link, ...] | None = None,
        options: Options = (),
        rule: Rule | None = None,
        labels: Sequence[object] | None = None,
    ) -> None:
        if links is not None or rule is None:
            _check_size(name, n)
            _check_links(name, n, links)
        own_labels = None if labels is None else _node_labels(name, n, labels)
        values = {"name": name, "n": n, "options": options, "rule": rule, "_links": links, "_labels": own_labels}
        for key, value in values.items():
            object.__setattr__(self, key, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Topology):
            return NotImplemented
        if (self.name, self.n, self.options, self._labels) != (other.name, other.n, other.options, other._labels):
            return False
        return (self.rule is not None and self.rule == other.rule) or self.links == other.links

    def __hash__(self) -> int:
        return hash((self.name, self.n, self.options))

    @property
    def labels(self) -> Sequence[int] | Sequence[str]:
        """Names of the nodes in order: the labels given to the graph, else 1 … n."""
        return range(1, self.n + 1) if self._labels is None else self._labels

    @property
    def labelled(self) -> bool:
        """True if the nodes were given labels."""
        return self._labels is not None

    @property
    def links(self) -> tuple[Link, ...]:
        """The links (target, source, weight), sorted; a rule builds them on first use."""
        if self._links is None and self.rule is not None:
            links = self.rule.links()
            _check_links(self.name, self.n, links)
            object.__setattr__(self, "_links", links)
        return self._links or ()

    @property
    def link_count(self) -> int:
        """The number of links; a rule may count links without building them."""
        count = None if self.rule is None else self.rule.link_count
        return len(self.links) if count is None else count

    @property
    def undirected(self) -> bool:
        """True if G is known to be symmetric: by its rule, or else by its links."""
        return self.symmetric if self.rule is None else self.rule.undirected

    @property
    def all_to_all(self) -> Fraction | None:
        """The common weight if, by the rule, each node feels every other node with one weight; else None.

        No links are built.  Such graphs are computed with mean fields (docs/links.md).
        """
        return None if self.rule is None else self.rule.all_to_all

    def closed_form(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the eigenvalues of G with multiplicities, each once; None without a closed form."""
        return None if self.rule is None else self.rule.eigenvalues()

    @property
    def symmetric(self) -> bool:
        """True if every link has its mirror image of equal weight, so that G = transpose(G)."""
        return not self.asymmetry

    @property
    def asymmetry(self) -> str:
        """Message on the first pair of nodes whose links in the two directions differ; "" for a symmetric graph."""
        weights = {} if self.all_to_all is not None else {link[:2]: link[2] for link in self.links}
        for (target, source), weight in weights.items():
            back = weights.get((source, target))
            if back is None:
                return f"one-way links, first from {self.labels[source]} to {self.labels[target]}"
            if back != weight:
                return f"the weights {back} from {self.labels[target]} to {self.labels[source]} and {weight} back"
        return ""

    @property
    def components(self) -> int:
        """Number of weakly connected parts; above 1, complete synchronisation is impossible."""
        if self.all_to_all is not None:
            return 1
        return 1 + max(join(self.n, ((target, source) for target, source, _ in self.links)))

    @property
    def leading_groups(self) -> int:
        """Number of groups of nodes that reach one another and feel no other node; at least 1.

        The groups are the source components of the directed graph.  If there is one group, 0 is a simple
        eigenvalue of G.
        """
        if self.all_to_all is not None:
            return 1
        # Shortcut for most families: if each node but 0 feels a node with a smaller number, node 0 reaches all.
        # Links are sorted, so the reversed loop ends with the smallest source of each target.
        earliest = {target: source for target, source, _ in reversed(self.links)}
        if all(earliest.get(i, i) < i for i in range(1, self.n)):
            return 1
        followers: list[list[int]] = [[] for _ in range(self.n)]
        for target, source, _ in self.links:
            followers[source].append(target)

        def starts(order: Iterable[int]) -> list[int]:
            """Search depth first from each node not yet reached; return the nodes where searches started."""
            roots, reached = [], [False] * self.n
            for start in order:
                if not reached[start]:
                    roots.append(start)
                    reached[start], waiting = True, [start]
                    while waiting:
                        new = [i for i in followers[waiting.pop()] if not reached[i]]
                        for i in new:
                            reached[i] = True
                        waiting += new
            return roots

        # The starts in `first` reach all nodes, and no start is reached from an earlier start.  Search from the
        # starts in reverse: a start not reached from a later start lies in a source component, one in each.
        first = starts(range(self.n))
        return len(starts(reversed(first))) if len(first) > 1 else 1

    @property
    def diagonalisable(self) -> bool:
        """True if G is known to have a basis of eigenvectors, being symmetric."""
        return self.undirected

    @property
    def entries(self) -> tuple[tuple[int, int, Fraction], ...]:
        """The non-zero entries of G as (row, column, entry): the links, then the diagonal."""
        degrees = ((i, total(weight for _, _, weight in row)) for i, row in groupby(self.links, itemgetter(0)))
        return (*self.links, *((i, i, -degree) for i, degree in degrees if degree))

    @property
    def adjacency(self) -> GraphMatrix:
        """The weights W, without a diagonal: row i feels column j."""
        return GraphMatrix(self, MatrixKind.ADJACENCY)

    @property
    def laplacian(self) -> GraphMatrix:
        """The Laplacian D - W, which is -G, with the row sums D of W."""
        return GraphMatrix(self, MatrixKind.LAPLACIAN)

    @property
    def signless_laplacian(self) -> GraphMatrix:
        """The signless Laplacian D + W; ValueError if links are one-way."""
        return GraphMatrix(self, MatrixKind.SIGNLESS)

    @property
    def random_walk_laplacian(self) -> GraphMatrix:
        """The random-walk Laplacian 1 - W/D; ValueError if links are one-way or a degree is not positive.

        The matrix is rational and similar to the normalised Laplacian 1 - D^(-1/2) W D^(-1/2), so both have
        the same eigenvalues.
        """
        return GraphMatrix(self, MatrixKind.RANDOM_WALK)

    @property
    def spanning_trees(self) -> Fraction:
        """The number of spanning trees, each counted with the product of its weights.

        See `synchain.models.spectra.tree_spectrum`.
        """
        from ..spectra.tree_spectrum import spanning_trees

        return spanning_trees(self)

    @property
    def kirchhoff_index(self) -> Fraction:
        """The sum of the resistances between all pairs of nodes; see `synchain.models.spectra.tree_spectrum`."""
        from ..spectra.tree_spectrum import kirchhoff_index

        return kirchhoff_index(self)

    def to_networkx(self) -> Any:
        """Convert the graph to a networkx graph; networkx must be installed.

        Returns
        -------
        networkx.Graph or networkx.DiGraph
            Nodes are the labels, or 0 … n - 1 without labels.  The edge attribute `weight` is an int or a Fraction.
            A graph that is not symmetric becomes a DiGraph: an edge from j to i means that i feels j.
            `from_graph` converts back to the same links.

        Raises
        ------
        ModuleNotFoundError
            If networkx is not installed.
        """
        try:
            networkx = import_module("networkx")
        except ModuleNotFoundError:
            raise ModuleNotFoundError(
                'to_networkx needs the package networkx; install it: python -m pip install "synchain[graphs]"'
            ) from None
        symmetric = self.symmetric
        graph = networkx.Graph(name=self.name) if symmetric else networkx.DiGraph(name=self.name)
        nodes = self.labels if self.labelled else range(self.n)
        graph.add_nodes_from(nodes)
        for target, source, weight in self.links:
            if not symmetric or source < target:  # one edge stands for both links
                value = int(weight) if weight.denominator == 1 else weight
                graph.add_edge(nodes[source], nodes[target], weight=value)
        return graph

    def __repr__(self) -> str:
        options = "".join(f", {key}={value!r}" for key, value in self.options)
        return f"Topology({self.name!r}, n={self.n}{options}, {edges_text(self)})"


def edges_text(graph: Topology) -> str:
    """Return "4 edges" for an undirected graph (two opposite links are one edge), else "4 links"."""
    count, word = (graph.link_count // 2, "edge") if graph.undirected else (graph.link_count, "link")
    return f"{count} {word}{'s' * (count != 1)}"


def from_matrix(rows: Iterable[Iterable[object]] | sp.MatrixBase, name: str = "matrix") -> Topology:
    """Return the graph of a connectivity matrix G; one-way links are allowed.

    Parameters
    ----------
    rows : iterable of rows, or SymPy matrix
        Square, rational, every row sum zero.  Entries are integers, fractions, decimals, floats
        (a float stands for its shortest decimal: 0.1 is 1/10), texts such as "1/2", or SymPy
        rationals.  If the sum of a row with floats is zero to 1e-12 of the row's entries, the diagonal
        entry is adjusted so that the sum is exactly zero.
    name : str, optional
        Name of the graph.

    Returns
    -------
    Topology
        The graph.

    Raises
    ------
    ValueError
        On a wrong shape, a wrong number or a row sum other than zero.
    TypeError
        On an entry that is no number.

    See Also
    --------
    synchain.graphs.from_edges
    synchain.graphs.from_sparse
    synchain.graphs.read_matrix

    Examples
    --------
    >>> from synchain.graphs import from_matrix
    >>> print(from_matrix([[-1, 1, 0], [1, -2, 1], [0, 1, -1]]).spectrum)
    {0: 1, -1: 1, -3: 1}
    """
    table = [list(row) for row in rational_rows(rows, name)]
    entries = rows.tolist() if hasattr(rows, "tolist") else rows
    for i, row in enumerate(table):
        excess = total(row)
        if not excess:
            continue
        # Floats and decimal texts may be rounded.  An iterator is already consumed, so its entries count as exact.
        rounded = isinstance(entries, list | tuple) and any(
            isinstance(entry, float) or (isinstance(entry, str) and not set(entry).isdisjoint(".eE"))
            for entry in entries[i]
        )
        if not rounded or abs(excess) > total(map(abs, row)) / 10**12:
            adjacency = not any(row[k] for k, row in enumerate(table))
            remedy = "; of an adjacency matrix take from_sparse(scipy.sparse.coo_array(A), adjacency=True)"
            raise ValueError(
                f"{name}: row {i + 1} sums to {excess}; expected 0, or the synchronous state is no solution: "
                f"set its diagonal entry {row[i]} to {row[i] - excess}{remedy if adjacency else ''}"
            )
        row[i] -= excess
    links = tuple((i, j, weight) for i, row in enumerate(table) for j, weight in enumerate(row) if weight and i != j)
    return Topology(name, len(table), links)


def read_matrix(path: str | Path) -> Topology:
    """Read a graph from a text file with a connectivity matrix, one row a line.

    Entries such as 1/2, -3 or 0.25 are separated by blanks or commas; `#` starts a comment; empty
    lines are skipped.  Text is parsed, not run.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        On a folder, on more than FILE_LIMIT bytes or on text that is no number, and as `from_matrix` raises.

    See Also
    --------
    synchain.graphs.from_matrix
    synchain.graphs.read_edges

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from synchain.graphs import read_matrix
    >>> file = Path(mkdtemp()) / "pair.csv"
    >>> _ = file.write_text("-1,1\\n1,-1\\n")
    >>> print(read_matrix(file).spectrum)
    {0: 1, -2: 1}
    """
    text, name = file_text(path, "matrix file", "a text file of rows")
    return from_matrix(parse_rows(text, name), name)


def _check_size(name: object, n: object) -> None:
    """Raise TypeError or ValueError for a name that is no text or a wrong number of nodes."""
    what = f"topology {check_printable('topology name', check_instance('topology name', name, str, 'text'))}"
    size = check_integer(f"{what}: n", n, -(10**18))
    if size < 1:
        raise ValueError(f"{what}: n = {size}; expected at least one node")


def _node_labels(name: str, n: int, labels: Sequence[object]) -> tuple[int, ...] | tuple[str, ...]:
    """Return the labels, as texts unless all are whole numbers; ValueError if there are not n distinct labels."""
    if all(type(label) is int for label in labels):
        integers = tuple(label for label in labels if isinstance(label, int))
        if len(integers) == n == len(set(integers)):
            return integers
    texts = tuple(label if isinstance(label, str) else str(label) for label in labels)
    if len(set(texts)) < len(texts):  # tell 1 and "1" apart by their repr
        texts = tuple(map(repr, labels))
    if len(texts) != n or len(set(texts)) < n:
        raise ValueError(f"topology {name}: found the labels {short_repr(texts)}; expected {n} different ones")
    for text in texts:
        check_printable(f"topology {name}: label of a node", text)
    return texts


def _check_links(name: str, n: int, links: object) -> None:
    """Raise TypeError or ValueError unless the links of n nodes are valid and sorted."""
    if not isinstance(links, tuple):
        raise TypeError(
            f"topology {name}: links: found {typed_repr(links)}; expected a tuple of (target, source, weight)"
        )
    before = (-1, -1)
    for link in links:
        if not isinstance(link, tuple) or len(link) != 3:
            raise TypeError(f"topology {name}: found the link {short_repr(link)}; expected (target, source, weight)")
        target, source, weight = link
        # One fast test accepts nearly all valid links; the tests below choose the message for an invalid link.
        typed = type(target) is int and type(source) is int and type(weight) is Fraction
        if typed and weight and 0 <= target < n and 0 <= source < n and target != source and before < link[:2]:
            before = link[:2]
            continue
        if not isinstance(target, int) or not isinstance(source, int):
            raise TypeError(f"topology {name}: found the link {short_repr(link)}; expected (target, source, weight)")
        where = f"topology {name}: link {target} <- {source}"
        if not (0 <= target < n and 0 <= source < n) or target == source:
            raise ValueError(f"{where}; expected two different nodes of 0 … {n - 1}")
        if (target, source) <= before:
            raise ValueError(
                f"{where} is repeated or out of order; expected each pair once, sorted: add the weights up and sort"
            )
        if not isinstance(weight, Fraction) or not weight:
            raise ValueError(
                f"{where} has weight {weight!r}; expected a Fraction other than 0: leave the link out or give it a weight"
            )
        before = (target, source)  # a valid link with a boolean node or a subclass of Fraction
