"""Graphs from graphs: products, unions, complements and scaled weights, with their spectra in closed form where known.

The rules: A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), sections 1.3.6 (union), 1.3.8 (complement),
1.4.6 (Cartesian product) and 1.4.7 (Kronecker product).  Sums and products of eigenvalues are merged exactly where all of
them are rational, cosines or their short radicals; other spectra come from the matrix itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, TypeAlias

from .expect import a_graph
from .rationals import rational
from .topology import LINK_LIMIT, Rule, Topology, ruled

if TYPE_CHECKING:
    import sympy as sp

    from .angle_sums import AngleSum
    from .equations import Link

__all__ = ["cartesian", "complement", "factors", "kronecker", "union", "weighted"]

Listed: TypeAlias = "list[tuple[AngleSum, int]]"
Closed: TypeAlias = "list[tuple[sp.Expr, int]] | None"


def cartesian(first: Topology, second: Topology) -> Topology:
    """The Cartesian product: node (i, k) is number i n + k of second's n; links change one of the two as in its graph.

    Every eigenvalue is a sum of one of each graph.  Raises ValueError on more than LINK_LIMIT links.
    """
    a_graph("cartesian: first", first)
    n = a_graph("cartesian: second", second).n
    name = f"cartesian({_named(first)}, {_named(second)})"
    _small(name, first.n * second.link_count + n * first.link_count)
    links = [(i * n + k, j * n + k, w) for i, j, w in first.links for k in range(n)]
    links += [(i * n + k, i * n + m, w) for i in range(first.n) for k, m, w in second.links]
    return _made(name, first.n * n, links, partial(_products, first, second, None))


def kronecker(first: Topology, second: Topology) -> Topology:
    """The tensor product of the adjacency matrices: (i, k) feels (j, m) where i feels j and k feels m; weights multiply.

    Where all nodes of each graph have one in-degree, d and e, the eigenvalues are (a + d)(b + e) - d e.  Raises
    ValueError on more than LINK_LIMIT links.
    """
    a_graph("kronecker: first", first)
    n = a_graph("kronecker: second", second).n
    name = f"kronecker({_named(first)}, {_named(second)})"
    _small(name, first.link_count * second.link_count)
    links = [(i * n + k, j * n + m, v * w) for i, j, v in first.links for k, m, w in second.links]
    d, e = _degree(first), _degree(second)
    rule = None if d is None or e is None else partial(_products, first, second, (d, e))
    return _made(name, first.n * n, links, rule)


def factors(graph: Topology) -> tuple[Topology, Topology] | None:
    """The two graphs of which `cartesian` made a graph; None for any other."""
    rule = graph.rule
    if isinstance(rule, partial) and rule.func is _products and rule.args[2] is None:
        return rule.args[0], rule.args[1]
    return None


def union(first: Topology, second: Topology) -> Topology:
    """Both graphs side by side, without links between them: the eigenvalues of both.

    Raises ValueError on more than LINK_LIMIT links.
    """
    n = a_graph("union: first", first).n
    a_graph("union: second", second)
    name = f"union({_named(first)}, {_named(second)})"
    _small(name, first.link_count + second.link_count)
    links = [*first.links, *((i + n, j + n, w) for i, j, w in second.links)]
    return _made(name, n + second.n, links, partial(_both, first, second))


def complement(graph: Topology) -> Topology:
    """The graph that joins exactly the pairs which this one does not: eigenvalues 0 and -(n + γ).

    Raises ValueError where a link is one-way or has a weight other than 1, or on more than LINK_LIMIT links.
    """
    n = a_graph("complement", graph).n
    name = f"complement({_named(graph)})"
    _small(name, n * (n - 1) - graph.link_count)
    odd = next((link for link in graph.links if link[2] != 1), None)
    if odd is not None or not graph.symmetric:
        found = f"a link of weight {odd[2]}" if odd is not None else "one-way links"
        raise ValueError(f"{name}: found {found}; expected undirected links of weight 1")
    present = {(i, j) for i, j, _ in graph.links}
    links = [(i, j, Fraction(1)) for i in range(n) for j in range(n) if i != j and (i, j) not in present]
    return _made(name, n, links, partial(_others, graph))


def weighted(graph: Topology, factor: Any) -> Topology:
    """The graph with all weights times a rational number other than 0 (a float means its shortest decimal)."""
    a_graph("weighted", graph)
    by = rational(factor, "factor")
    if not by:
        raise ValueError(f"weighted({_named(graph)}): factor = 0; expected another number: no link would be left")
    links = [(i, j, w * by) for i, j, w in graph.links]
    return _made(f"weighted({_named(graph)}, {by})", graph.n, links, partial(_scaled, graph, by))


def _named(graph: Topology) -> str:
    more = "".join(f", {key}={value}" for key, value in graph.options)
    return graph.name if "(" in graph.name else f"{graph.name}({graph.n}{more})"


def _small(name: str, links: int) -> None:
    if links > LINK_LIMIT:
        raise ValueError(f"{name}: {links} links; expected at most {LINK_LIMIT}: take smaller graphs")


def _made(name: str, n: int, links: Iterable[Link], rule: Rule | None) -> Topology:
    return ruled(Topology(name, n, tuple(sorted(links))), rule)


def _degree(graph: Topology) -> Fraction | None:
    """The sum of weights that every node feels, where it is one for all; else None."""
    sums = [Fraction(0)] * graph.n
    for target, _, weight in graph.links:
        sums[target] += weight
    return sums[0] if len(set(sums)) == 1 else None


def _listed(graph: Topology) -> Listed | None:
    """The closed spectrum of a graph, or that of a small matrix, as sums of cosines; None where it is not of them."""
    from .angle_sums import read

    rule = graph.rule() if graph.rule is not None else None
    if rule is None:
        rule = [(e.exact, e.multiplicity) for e in graph.spectrum.eigenvalues] if graph.n <= 100 else None
    if rule is None:
        return None
    found = [(read(number), times) for number, times in rule]
    return None if any(a is None for a, _ in found) else [(a, times) for a, times in found if a is not None]


def _products(first: Topology, second: Topology, degrees: tuple[Fraction, Fraction] | None) -> Closed:
    """Sums of the eigenvalues, or with the in-degrees d and e (a + d)(b + e) - d e."""
    from .angle_sums import AngleSum

    a, b = _listed(first), _listed(second)
    if a is None or b is None:
        return None
    d, e = (AngleSum.rational(x) for x in degrees or (0, 0))
    if degrees is None:
        return _written([(x + y, m * k) for (x, m), (y, k) in product(a, b)])
    return _written([((x + d) * (y + e) + -(d * e), m * k) for (x, m), (y, k) in product(a, b)])


def _both(first: Topology, second: Topology) -> Closed:
    a, b = _listed(first), _listed(second)
    return None if a is None or b is None else _written(a + b)


def _others(graph: Topology) -> Closed:
    """Of 0 one stays; all others become -(n + γ)."""
    from .angle_sums import AngleSum

    known = _listed(graph)
    if known is None:
        return None
    whole = AngleSum.rational(-graph.n)
    others = [(whole + -a, times - a.vanishes()) for a, times in known]
    return _written([(AngleSum.rational(0), 1), *((a, times) for a, times in others if times)])


def _scaled(graph: Topology, factor: Fraction) -> Closed:
    from .angle_sums import AngleSum

    known = _listed(graph)
    return None if known is None else _written([(AngleSum.rational(factor) * a, times) for a, times in known])


def _written(numbers: Listed) -> Closed:
    """Equal numbers merged, written as SymPy expressions."""
    from .angle_sums import expression, merged

    return [(expression(a), times) for a, times in merged(numbers)]
