"""Make graphs from graphs: products, unions, complements and scaled weights, with spectra in closed form.

The rules: A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), sections 1.3.6 (union),
1.3.8 (complement), 1.4.6 (Cartesian product) and 1.4.7 (Kronecker product).  A spectrum has a closed
form if all eigenvalues of the factors are rational, cosines of rational angles, or short radicals of
such cosines; equal sums and products are then merged exactly.  All other spectra are computed from
the matrix.  Only `eigenvalues` loads SymPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import prod
from typing import TYPE_CHECKING, TypeAlias

from ..inputs.rational_text import rational
from .links import LINK_LIMIT, Link, one_degree
from .readers import as_topology
from .topology import Topology

if TYPE_CHECKING:
    import sympy as sp

    from ..algebra.cosine_sums import AngleSum

Sums: TypeAlias = "list[tuple[AngleSum, int]]"
Closed: TypeAlias = "list[tuple[sp.Expr, int]] | None"


def cartesian(first: Topology, second: Topology) -> Topology:
    """Return the Cartesian product; its eigenvalues are all sums a + b of eigenvalues of the two graphs.

    Node (i, k) has the number i n + k, where n is the number of nodes of `second`.  A link of
    `first` changes i alone, a link of `second` changes k alone.

    Raises
    ------
    ValueError
        On more than LINK_LIMIT links.

    See Also
    --------
    synchain.graphs.kronecker
    synchain.graphs.union

    Examples
    --------
    >>> from synchain.graphs import cartesian, chain, ring
    >>> print(cartesian(ring(3), chain(2)).spectrum)
    {0: 1, -2: 1, -3: 2, -5: 2}
    """
    return _of_two(Cartesian, first, second)


def kronecker(first: Topology, second: Topology) -> Topology:
    """Return the tensor product of the adjacency matrices.

    Node (i, k) feels (j, m) if i feels j and k feels m; weights multiply.  If all nodes of the first
    graph have the in-degree d and all nodes of the second e, the eigenvalues are (a + d)(b + e) - d e
    for eigenvalues a and b of the two graphs.

    Raises
    ------
    ValueError
        On more than LINK_LIMIT links.

    See Also
    --------
    synchain.graphs.cartesian

    Examples
    --------
    >>> from synchain.graphs import complete, kronecker
    >>> kronecker(complete(3), complete(2)).n
    6
    """
    return _of_two(Kronecker, first, second)


def union(first: Topology, second: Topology) -> Topology:
    """Return both graphs side by side, without links between them; the spectrum is the union of both spectra.

    Raises
    ------
    ValueError
        On more than LINK_LIMIT links.

    See Also
    --------
    synchain.graphs.cartesian
    synchain.graphs.complement

    Examples
    --------
    >>> from synchain.graphs import chain, ring, union
    >>> print(union(ring(3), chain(2)).spectrum)
    {0: 2, -2: 1, -3: 2}
    """
    return _of_two(Union, first, second)


def complement(graph: Topology) -> Topology:
    """Return the complement, which joins exactly the pairs that `graph` does not join.

    Its eigenvalues are 0 and -(n + γ), γ the eigenvalues of `graph` without the 0 of equal states.

    Raises
    ------
    ValueError
        If a link is one-way or has a weight other than 1, or on more than LINK_LIMIT links.

    See Also
    --------
    synchain.graphs.union

    Examples
    --------
    >>> from synchain.graphs import complement, ring
    >>> print(complement(ring(5)).spectrum)
    {0: 1, -5/2 + sqrt(5)/2: 2, -5/2 - sqrt(5)/2: 2}
    """
    graph = as_topology("complement", graph)
    rule = Complement((graph,))
    name = f"complement({_call(graph)})"
    _check_link_count(name, rule.link_count)
    odd = next((link for link in graph.links if link[2] != 1), None)
    obstacle = graph.asymmetry if odd is None else f"a link of weight {odd[2]}"
    if obstacle:
        raise ValueError(f"{name}: found {obstacle}; expected undirected links of weight 1")
    return _graph(name, rule)


def weighted(graph: Topology, factor: object) -> Topology:
    """Multiply all weights by a rational number; a float stands for its shortest decimal.

    Raises
    ------
    ValueError
        If the factor is 0.

    See Also
    --------
    synchain.graphs.from_edges

    Examples
    --------
    >>> from synchain.graphs import chain, weighted
    >>> print(weighted(chain(3), "1/3").spectrum)
    {0: 1, -1/3: 1, -1: 1}
    """
    graph = as_topology("weighted", graph)
    exact = rational(factor, "factor")
    if not exact:
        raise ValueError(f"weighted({_call(graph)}): factor = 0; expected another number: no link would be left")
    return _graph(f"weighted({_call(graph)}, {exact})", Weighted((graph,), exact))


def factors(graph: Topology) -> tuple[Topology, Topology] | None:
    """Return the two factors of a graph that `cartesian` made; None for any other graph."""
    if not isinstance(graph.rule, Cartesian):
        return None
    first, second = graph.rule.graphs
    return first, second


@dataclass(frozen=True, slots=True)
class _Operation:
    """Base of the rules below; a subclass counts links, lists links and lists eigenvalues."""

    graphs: tuple[Topology, ...]

    @property
    def n(self) -> int:
        """Number of nodes of the result, by default of a product."""
        return prod(graph.n for graph in self.graphs)

    @property
    def link_count(self) -> int:
        raise NotImplementedError

    @property
    def undirected(self) -> bool:
        """True if all graphs are known to be symmetric."""
        return all(graph.undirected for graph in self.graphs)

    @property
    def all_to_all(self) -> Fraction | None:
        """None, unless a subclass joins all pairs of nodes with one weight."""
        return None

    def links(self) -> tuple[Link, ...]:
        raise NotImplementedError

    def eigenvalues(self) -> Closed:
        raise NotImplementedError


def _eigenvalues(graphs: tuple[Topology, ...], combine: Callable[..., Sums]) -> Closed:
    """Apply `combine` to the eigenvalues of the graphs; None if an eigenvalue is no sum of cosines."""
    from ..algebra.cosine_sums import expressions
    from ..spectra.angle_sums import angle_sums

    spectra = [angle_sums(graph) for graph in graphs]
    return None if None in spectra else expressions(combine(*spectra))


@dataclass(frozen=True, slots=True)
class Cartesian(_Operation):
    """Rule of a Cartesian product (Brouwer & Haemers 1.4.6): eigenvalues a + b."""

    @property
    def link_count(self) -> int:
        first, second = self.graphs
        return first.n * second.link_count + second.n * first.link_count

    def links(self) -> tuple[Link, ...]:
        first, second = self.graphs
        n = second.n
        links = [(i * n + k, j * n + k, w) for i, j, w in first.links for k in range(n)]
        links += [(i * n + k, i * n + m, w) for i in range(first.n) for k, m, w in second.links]
        return tuple(sorted(links))

    def eigenvalues(self) -> Closed:
        return _eigenvalues(self.graphs, lambda a, b: [(x + y, m * k) for (x, m), (y, k) in product(a, b)])


@dataclass(frozen=True, slots=True)
class Kronecker(_Operation):
    """Rule of a tensor product (1.4.7): eigenvalues (a + d)(b + e) - d e for common in-degrees d and e."""

    @property
    def link_count(self) -> int:
        return prod(graph.link_count for graph in self.graphs)

    def links(self) -> tuple[Link, ...]:
        first, second = self.graphs
        n = second.n
        links = [(i * n + k, j * n + m, v * w) for i, j, v in first.links for k, m, w in second.links]
        return tuple(sorted(links))

    def eigenvalues(self) -> Closed:
        from ..algebra.cosine_sums import AngleSum

        first, second = (one_degree(graph.n, graph.links) for graph in self.graphs)
        if first is None or second is None:
            return None
        # The weights W = G + degree have eigenvalues a + d and b + e; those of a tensor product multiply.
        d, e = AngleSum.rational(first), AngleSum.rational(second)
        return _eigenvalues(
            self.graphs, lambda a, b: [((x + d) * (y + e) + -(d * e), m * k) for (x, m), (y, k) in product(a, b)]
        )


@dataclass(frozen=True, slots=True)
class Union(_Operation):
    """Rule of two graphs side by side (1.3.6): the eigenvalues of both."""

    @property
    def n(self) -> int:
        return sum(graph.n for graph in self.graphs)

    @property
    def link_count(self) -> int:
        return sum(graph.link_count for graph in self.graphs)

    def links(self) -> tuple[Link, ...]:
        first, second = self.graphs
        return (*first.links, *((i + first.n, j + first.n, w) for i, j, w in second.links))

    def eigenvalues(self) -> Closed:
        return _eigenvalues(self.graphs, lambda a, b: [*a, *b])


@dataclass(frozen=True, slots=True)
class Complement(_Operation):
    """Rule of a complement (1.3.8): the vector of ones keeps the eigenvalue 0, each other γ becomes -(n + γ)."""

    @property
    def link_count(self) -> int:
        return self.n * (self.n - 1) - self.graphs[0].link_count

    @property
    def undirected(self) -> bool:
        """True: `complement` refuses one-way links."""
        return True

    @property
    def all_to_all(self) -> Fraction | None:
        """1 for the complement of a graph without links; else None."""
        return None if self.graphs[0].link_count else Fraction(1)

    def links(self) -> tuple[Link, ...]:
        n, present = self.n, {(i, j) for i, j, _ in self.graphs[0].links}
        return tuple((i, j, Fraction(1)) for i in range(n) for j in range(n) if i != j and (i, j) not in present)

    def eigenvalues(self) -> Closed:
        from ..algebra.cosine_sums import AngleSum

        n = AngleSum.rational(self.n)

        def combine(pairs: Sums) -> Sums:
            others = [(-(n + a), times - a.vanishes()) for a, times in pairs]
            return [(AngleSum.rational(0), 1), *((a, times) for a, times in others if times)]

        return _eigenvalues(self.graphs, combine)


@dataclass(frozen=True, slots=True)
class Weighted(_Operation):
    """Rule of a graph with all weights multiplied by one factor: eigenvalues are multiplied by it too."""

    factor: Fraction

    @property
    def link_count(self) -> int:
        return self.graphs[0].link_count

    @property
    def all_to_all(self) -> Fraction | None:
        """The common weight of the links between all pairs, times the factor; None for any other graph."""
        weight = self.graphs[0].all_to_all
        return None if weight is None else weight * self.factor

    def links(self) -> tuple[Link, ...]:
        return tuple((i, j, w * self.factor) for i, j, w in self.graphs[0].links)

    def eigenvalues(self) -> Closed:
        from ..algebra.cosine_sums import AngleSum

        factor = AngleSum.rational(self.factor)
        return _eigenvalues(self.graphs, lambda pairs: [(factor * a, times) for a, times in pairs])


def _of_two(operation: type[_Operation], first: object, second: object) -> Topology:
    name = operation.__name__.lower()
    graphs = as_topology(f"{name}: first", first), as_topology(f"{name}: second", second)
    return _graph(f"{name}({', '.join(map(_call, graphs))})", operation(graphs))


def _call(graph: Topology) -> str:
    """Return the text from which `graph_text` reads the graph: ring(5), torus(12, shape=(3, 4)), union(…)."""
    options = "".join(f", {key}={value}" for key, value in graph.options)
    return graph.name if "(" in graph.name else f"{graph.name}({graph.n}{options})"


def _graph(name: str, rule: _Operation) -> Topology:
    if rule.all_to_all is None:  # links between all pairs take no memory
        _check_link_count(name, rule.link_count)
    return Topology(name, rule.n, rule=rule)


def _check_link_count(name: str, links: int) -> None:
    if links > LINK_LIMIT:
        raise ValueError(f"{name}: {links} links; expected at most {LINK_LIMIT}: take smaller graphs")
