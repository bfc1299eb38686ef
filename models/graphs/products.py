"""Graphs from graphs: products, unions, complements and scaled weights, with closed spectra.

The rules: A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), sections 1.3.6 (union),
1.3.8 (complement), 1.4.6 (Cartesian product) and 1.4.7 (Kronecker product).  Sums and products of
eigenvalues are merged exactly if all of them are rational, cosines or their short radicals; other
spectra come from the matrix itself.  A product costs no algebra: only `eigenvalues` loads SymPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from ..inputs.rational_text import rational
from .links import LINK_LIMIT, Link, one_degree
from .readers import as_topology
from .topology import Rule, Topology

if TYPE_CHECKING:
    import sympy as sp

    from ..algebra.cosine_sums import AngleSum

Listed: TypeAlias = "list[tuple[AngleSum, int]]"
Closed: TypeAlias = "list[tuple[sp.Expr, int]] | None"


def cartesian(first: Topology, second: Topology) -> Topology:
    """Return the Cartesian product: every eigenvalue is a sum of one of each graph.

    Node (i, k) is number i n + k, n the nodes of `second`; a link changes one of the two as in its
    graph.

    Raises
    ------
    ValueError
        On more than LINK_LIMIT links.
    """
    return _of_two("cartesian", Cartesian, first, second)


def kronecker(first: Topology, second: Topology) -> Topology:
    """Return the tensor product of the adjacency matrices.

    Node (i, k) feels (j, m) if i feels j and k feels m; weights multiply.  If all nodes of each
    graph have one in-degree, d and e, the eigenvalues are (a + d)(b + e) - d e.

    Raises
    ------
    ValueError
        On more than LINK_LIMIT links.
    """
    return _of_two("kronecker", Kronecker, first, second)


def union(first: Topology, second: Topology) -> Topology:
    """Return both graphs side by side, without links between them: the eigenvalues of both.

    Raises
    ------
    ValueError
        On more than LINK_LIMIT links.
    """
    return _of_two("union", Union, first, second)


def complement(graph: Topology) -> Topology:
    """Return the graph that joins exactly the pairs that this one does not: 0 and -(n + γ).

    Raises
    ------
    ValueError
        If a link is one-way or has a weight other than 1, or on more than LINK_LIMIT links.
    """
    graph = as_topology("complement", graph)
    name, rule = f"complement({_named(graph)})", Complement(graph)
    _small(name, rule.link_count)
    odd = next((link for link in graph.links if link[2] != 1), None)
    found = graph.asymmetry if odd is None else f"a link of weight {odd[2]}"
    if found:
        raise ValueError(f"{name}: found {found}; expected undirected links of weight 1")
    return _made(name, graph.n, rule)


def weighted(graph: Topology, factor: object) -> Topology:
    """Return the graph with all weights times a rational number; a float is its shortest decimal.

    Raises
    ------
    ValueError
        If the factor is 0.
    """
    graph = as_topology("weighted", graph)
    by = rational(factor, "factor")
    if not by:
        raise ValueError(f"weighted({_named(graph)}): factor = 0; expected another number: no link would be left")
    return _made(f"weighted({_named(graph)}, {by})", graph.n, Weighted(graph, by))


def factors(graph: Topology) -> tuple[Topology, Topology] | None:
    """Return the two graphs of which `cartesian` made a graph; None for any other."""
    rule = graph.rule
    return (rule.first, rule.second) if isinstance(rule, Cartesian) else None


@dataclass(frozen=True, slots=True)
class _OfTwo:
    """The common part of the rules of graphs from two graphs."""

    first: Topology
    second: Topology

    @property
    def undirected(self) -> bool:
        """True if both graphs are known to be symmetric."""
        return self.first.undirected and self.second.undirected

    @property
    def all_to_all(self) -> Fraction | None:
        """None: pairs of nodes are not joined alike."""
        return None

    @property
    def n(self) -> int:
        """The number of nodes: one for each pair of nodes of the graphs."""
        return self.first.n * self.second.n

    def spectra(self) -> tuple[Listed, Listed] | None:
        """The closed spectra of both graphs; None if one of them has none."""
        from ..spectra.angle_sums import angle_sums

        a, b = angle_sums(self.first), angle_sums(self.second)
        return None if a is None or b is None else (a, b)


@dataclass(frozen=True, slots=True)
class Cartesian(_OfTwo):
    """The rule of a Cartesian product: eigenvalues are sums."""

    @property
    def link_count(self) -> int:
        """The number of links."""
        return self.first.n * self.second.link_count + self.second.n * self.first.link_count

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links."""
        n = self.second.n
        links = [(i * n + k, j * n + k, w) for i, j, w in self.first.links for k in range(n)]
        links += [(i * n + k, i * n + m, w) for i in range(self.first.n) for k, m, w in self.second.links]
        return tuple(sorted(links))

    def eigenvalues(self) -> Closed:
        """List the sums of the eigenvalues."""
        from ..algebra.cosine_sums import expressions

        known = self.spectra()
        return None if known is None else expressions([(x + y, m * k) for (x, m), (y, k) in product(*known)])


@dataclass(frozen=True, slots=True)
class Kronecker(_OfTwo):
    """The rule of a tensor product: eigenvalues are known if each graph has one in-degree."""

    @property
    def link_count(self) -> int:
        """The number of links."""
        return self.first.link_count * self.second.link_count

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links."""
        n = self.second.n
        links = [(i * n + k, j * n + m, v * w) for i, j, v in self.first.links for k, m, w in self.second.links]
        return tuple(sorted(links))

    def eigenvalues(self) -> Closed:
        """List (a + d)(b + e) - d e, d and e the in-degrees."""
        from ..algebra.cosine_sums import AngleSum, expressions

        first, second = (one_degree(graph.n, graph.links) for graph in (self.first, self.second))
        if first is None or second is None or (known := self.spectra()) is None:
            return None
        d, e = AngleSum.rational(first), AngleSum.rational(second)
        return expressions([((x + d) * (y + e) + -(d * e), m * k) for (x, m), (y, k) in product(*known)])


@dataclass(frozen=True, slots=True)
class Union(_OfTwo):
    """The rule of two graphs side by side."""

    @property
    def n(self) -> int:
        """The number of nodes."""
        return self.first.n + self.second.n

    @property
    def link_count(self) -> int:
        """The number of links."""
        return self.first.link_count + self.second.link_count

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links."""
        n = self.first.n
        return (*self.first.links, *((i + n, j + n, w) for i, j, w in self.second.links))

    def eigenvalues(self) -> Closed:
        """List the eigenvalues of both."""
        from ..algebra.cosine_sums import expressions

        known = self.spectra()
        return None if known is None else expressions([*known[0], *known[1]])


@dataclass(frozen=True, slots=True)
class Complement:
    """The rule of a complement: one eigenvalue 0 stays, all others become -(n + γ)."""

    graph: Topology

    @property
    def link_count(self) -> int:
        """The number of links."""
        return self.graph.n * (self.graph.n - 1) - self.graph.link_count

    @property
    def undirected(self) -> bool:
        """True: only undirected graphs have a complement here."""
        return True

    @property
    def all_to_all(self) -> Fraction | None:
        """1 for the complement of a graph without links."""
        return None if self.graph.link_count else Fraction(1)

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links."""
        n, present = self.graph.n, {(i, j) for i, j, _ in self.graph.links}
        return tuple((i, j, Fraction(1)) for i in range(n) for j in range(n) if i != j and (i, j) not in present)

    def eigenvalues(self) -> Closed:
        """List 0 and the numbers -(n + γ)."""
        from ..algebra.cosine_sums import AngleSum, expressions
        from ..spectra.angle_sums import angle_sums

        known = angle_sums(self.graph)
        if known is None:
            return None
        whole = AngleSum.rational(-self.graph.n)
        others = [(whole + -a, times - a.vanishes()) for a, times in known]
        return expressions([(AngleSum.rational(0), 1), *((a, times) for a, times in others if times)])


@dataclass(frozen=True, slots=True)
class Weighted:
    """The rule of a graph with all weights times one number."""

    graph: Topology
    factor: Fraction

    @property
    def link_count(self) -> int:
        """The number of links."""
        return self.graph.link_count

    @property
    def undirected(self) -> bool:
        """True if the graph is known to be symmetric."""
        return self.graph.undirected

    @property
    def all_to_all(self) -> Fraction | None:
        """The weight of the graph's links times the factor, if it joins all pairs alike."""
        weight = self.graph.all_to_all
        return None if weight is None else weight * self.factor

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links."""
        return tuple((i, j, w * self.factor) for i, j, w in self.graph.links)

    def eigenvalues(self) -> Closed:
        """List the eigenvalues times the factor."""
        from ..algebra.cosine_sums import AngleSum, expressions
        from ..spectra.angle_sums import angle_sums

        known, by = angle_sums(self.graph), AngleSum.rational(self.factor)
        return None if known is None else expressions([(by * a, times) for a, times in known])


def _named(graph: Topology) -> str:
    more = "".join(f", {key}={value}" for key, value in graph.options)
    return graph.name if "(" in graph.name else f"{graph.name}({graph.n}{more})"


def _of_two(name: str, operation: type[Cartesian | Kronecker | Union], first: object, second: object) -> Topology:
    """The graph that an operation makes of two."""
    rule = operation(as_topology(f"{name}: first", first), as_topology(f"{name}: second", second))
    return _made(f"{name}({_named(rule.first)}, {_named(rule.second)})", rule.n, rule)


def _small(name: str, links: int) -> None:
    if links > LINK_LIMIT:
        raise ValueError(f"{name}: {links} links; expected at most {LINK_LIMIT}: take smaller graphs")


def _made(name: str, n: int, rule: Rule) -> Topology:
    if rule.all_to_all is None:
        _small(name, rule.link_count or 0)
    return Topology(name, n, rule=rule)
