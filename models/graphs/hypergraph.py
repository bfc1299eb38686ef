"""Graphs of triangles with exact weights: who feels which two others together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, permutations

from ..inputs.checks import check_integer, short_repr, typed_repr
from ..inputs.rational_text import rational
from .topology import Topology

Triangle = tuple[int, int, int, Fraction]  # three nodes i < j < k, counted from 0, and the weight of their triangle


@dataclass(frozen=True, slots=True, init=False, eq=False)
class Hypergraph(Topology):
    """Triangles of nodes: each node of a triangle feels the other two together.

    As a `Topology` it holds the generalised Laplacian of three-body links: the weight of a link is the sum of the
    weights of all triangles that contain it, so that `spectrum` is the exact spectrum of that Laplacian.

    Parameters
    ----------
    name : str
        Name of the graph.
    n : int
        Number of nodes.
    triangles : tuple of (int, int, int, Fraction)
        Nodes i < j < k of each triangle, and its weight; sorted.

    See Also
    --------
    triangles : Makes a hypergraph from a list, or from all triangles of a graph.

    References
    ----------
    Gambuzza et al., Nat. Commun. 12, 1255 (2021).

    Examples
    --------
    >>> import synchain as sc
    >>> graph = sc.graphs.triangles([(1, 2, 3), (2, 3, 4, "1/2")])
    >>> graph.triangles
    ((0, 1, 2, Fraction(1, 1)), (1, 2, 3, Fraction(1, 2)))
    """

    triangles: tuple[Triangle, ...]

    def __init__(self, name: str, n: int, triangles: tuple[Triangle, ...]) -> None:
        weights: dict[tuple[int, int], Fraction] = {}
        for *nodes, weight in triangles:
            for i, j in permutations(nodes, 2):
                weights[i, j] = weights.get((i, j), Fraction(0)) + weight
        # Call the initialiser by name: a class with slots is made twice, and `super()` would find the first one.
        Topology.__init__(self, name, n, tuple((*pair, w) for pair, w in sorted(weights.items()) if w))
        object.__setattr__(self, "triangles", triangles)

    def __reduce__(self) -> tuple[type[Hypergraph], tuple[object, ...]]:
        return Hypergraph, (self.name, self.n, self.triangles)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Hypergraph):
            return False if isinstance(other, Topology) else NotImplemented
        return (self.name, self.n, self.triangles) == (other.name, other.n, other.triangles)

    def __hash__(self) -> int:
        return hash((self.name, self.n, self.triangles))

    @property
    def triads(self) -> tuple[tuple[int, int, Fraction, int], ...]:
        """Target, source, weight and second source: six for each triangle, sorted by target and sources."""
        ordered = ((i, j, weight, k) for *nodes, weight in self.triangles for i, j, k in permutations(nodes))
        return tuple(sorted(ordered, key=lambda triad: (triad[0], triad[1], triad[3])))

    def __repr__(self) -> str:
        count = len(self.triangles)
        return f"Hypergraph({self.name!r}, n={self.n}, {count} triangle{'s' * (count != 1)})"


def triangles(of: Topology | Iterable[Sequence[object]], n: int | None = None, name: str = "triangles") -> Hypergraph:
    """Return the hypergraph of a list of triangles, or of all triangles of a graph.

    Parameters
    ----------
    of : Topology or iterable of (i, j, k) or (i, j, k, weight)
        An undirected graph, or triangles between the nodes 1 … n. The weight is 1 if it is left out.
    n : int, optional
        Number of nodes, by default the largest in the list.
    name : str, optional
        Name of the hypergraph.

    Returns
    -------
    Hypergraph

    Raises
    ------
    ValueError
        On a triangle whose nodes are not different or not in 1 … n, on a repeated triangle, on a weight that is 0 or
        not rational, and on a graph with one-way links.

    See Also
    --------
    synchain.graphs.Hypergraph

    Examples
    --------
    Two triangles with a common edge; the generalised Laplacian has the spectrum

    >>> from synchain.graphs import complete, triangles
    >>> print(triangles([(1, 2, 3), (2, 3, 4)]).spectrum)
    {0: 1, -2: 1, -4: 1, -6: 1}
    >>> triangles(complete(4))
    Hypergraph('triangles', n=4, 4 triangles)
    """
    if isinstance(of, Topology):
        if of.asymmetry:
            raise ValueError(f"triangles: found {of.asymmetry} in {of.name}({of.n}); expected an undirected graph")
        pairs = {link[:2] for link in of.links}
        found = [t for t in combinations(range(of.n), 3) if all(pair in pairs for pair in combinations(t, 2))]
        return Hypergraph(name, of.n, tuple((*t, Fraction(1)) for t in found))
    if isinstance(of, str | bytes | Mapping) or not isinstance(of, Iterable):
        raise TypeError(f"{name}: found {typed_repr(of)}; expected a graph or a list of triangles, e.g. [(1, 2, 3)]")
    listed: dict[tuple[int, ...], Fraction] = {}
    for number, entry in enumerate(of, start=1):
        where = f"{name}: triangle {number}"
        if not isinstance(entry, Sequence) or isinstance(entry, str | bytes) or len(entry) not in (3, 4):
            raise ValueError(f"{where} is {short_repr(entry)}; expected (i, j, k) or (i, j, k, weight)")
        nodes = tuple(sorted(check_integer(f"{where}: node", node, 1) - 1 for node in entry[:3]))
        weight = rational(entry[3], where) if len(entry) == 4 else Fraction(1)
        if len(set(nodes)) < 3 or nodes in listed or not weight:
            problem = "is repeated" if nodes in listed else "has equal nodes" if weight else "has the weight 0"
            raise ValueError(
                f"{where} {problem}: {short_repr(entry)}; expected three different nodes, each triangle once"
            )
        listed[nodes] = weight
    largest = max((nodes[-1] + 1 for nodes in listed), default=1)
    size = largest if n is None else check_integer(f"{name}: n", n, largest)
    return Hypergraph(name, size, tuple((i, j, k, listed[i, j, k]) for i, j, k in sorted(listed)))
