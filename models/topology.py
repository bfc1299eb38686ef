"""Who feels whom: a graph with exact weights, by name, from a matrix or from a file.

The connectivity matrix is G = weighted adjacency minus in-degree, so that every row sums to zero and the
coupling term is sigma * G * x.  Building a graph costs no algebra: only `matrix` and `spectrum` load SymPy; and a
family that counts its edges builds them when they are first asked for.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

from . import plugins
from .family_options import Options, settled
from .link_checks import check_links
from .rationals import file_text, parse_rows, rational_rows, total

if TYPE_CHECKING:
    import sympy as sp

    from .equations import Link
    from .spectrum import Spectrum

__all__ = ["Rule", "Topology", "family", "from_matrix", "names", "read_matrix", "ruled", "topology"]

Rule: TypeAlias = Callable[[], "Sequence[tuple[sp.Expr, int]] | None"]
"""Gives the eigenvalues of G with multiplicities, without repetition; None where no closed form is known."""

LINK_LIMIT = 4_000_000
"""More links than this are not built: they take more than 600 MB."""


@dataclass(frozen=True, slots=True)
class Topology:
    """`n` nodes and their sorted links (target, source, weight); an undirected edge is two links.

    `options` are the keywords with which its family made it.  Raises ValueError on a link outside the nodes, from a
    node to itself, repeated, unsorted or of no weight.
    """

    name: str
    n: int
    links: tuple[Link, ...]
    options: Options = ()
    _rule: Rule | None = field(default=None, init=False, repr=False, compare=False)
    _count: int = field(default=-1, init=False, repr=False, compare=False)

    if not TYPE_CHECKING:  # links that are not there yet

        def __getattr__(self, name: str) -> Any:
            if name != "links":
                raise AttributeError(f"'Topology' object has no attribute {name!r}")
            _few(self.name, self.n, self._count)
            module = family(self.name)
            made = Topology(self.name, self.n, tuple(_links(self.name, module, self.n, dict(self.options))))
            object.__setattr__(self, "links", made.links)
            return made.links

    def __post_init__(self) -> None:
        check_links(self.name, self.n, self.links)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Topology):
            return NotImplemented
        if (self.name, self.n, self.options) != (other.name, other.n, other.options):
            return False
        return (self._count >= 0 and other._count >= 0) or self.links == other.links

    def __hash__(self) -> int:
        return hash((self.name, self.n, self.options))

    @property
    def rule(self) -> Rule | None:
        """What gives the spectrum in closed form, where the graph was made by a family or an operation."""
        return self._rule

    @property
    def link_count(self) -> int:
        """The number of links, known without building them where the family counts them."""
        return self._count if self._count >= 0 else len(self.links)

    @property
    def symmetric(self) -> bool:
        """True where every link has its mirror image of equal weight, so that G = transpose(G)."""
        known = {(target, source): weight for target, source, weight in self.links}
        return all(known.get((source, target)) == weight for (target, source), weight in known.items())

    @property
    def components(self) -> int:
        """Number of weakly connected parts; where it is not 1 complete synchronisation is impossible."""
        parent = list(range(self.n))

        def root(i: int) -> int:
            while parent[i] != i:
                parent[i] = parent[parent[i]]
                i = parent[i]
            return i

        count = self.n
        for target, source, _ in self.links:
            a, b = root(target), root(source)
            if a != b:
                parent[max(a, b)] = min(a, b)
                count -= 1
        return count

    @property
    def leading_groups(self) -> int:
        """Number of groups of nodes that reach one another and that no other node acts on; at least 1.

        The starts of a search along the links cover all nodes; no start is reached from an earlier one.  Searched again
        from the last start backwards, those that are not reached yet are in groups of their own.
        """
        followers: list[list[int]] = [[] for _ in range(self.n)]
        for target, source, _ in self.links:
            followers[source].append(target)

        def starts(order: Iterable[int]) -> list[int]:
            found, reached = [], [False] * self.n
            for start in order:
                if not reached[start]:
                    found.append(start)
                    reached[start], waiting = True, [start]
                    while waiting:
                        new = [i for i in followers[waiting.pop()] if not reached[i]]
                        for i in new:
                            reached[i] = True
                        waiting += new
            return found

        return len(starts(reversed(starts(range(self.n)))))

    @property
    def rows(self) -> tuple[tuple[Fraction, ...], ...]:
        """G as n rows of n fractions."""
        zero = Fraction(0)
        table = [[zero] * self.n for _ in range(self.n)]
        for target, source, weight in self.links:
            table[target][source] = weight
            table[target][target] -= weight
        return tuple(tuple(row) for row in table)

    @property
    def matrix(self) -> sp.ImmutableDenseMatrix:
        """G as an immutable SymPy matrix, n x n."""
        import sympy as sp

        entries = [[sp.Rational(x.numerator, x.denominator) for x in row] for row in self.rows]
        return sp.ImmutableDenseMatrix(entries)

    @property
    def spectrum(self) -> Spectrum:
        """The exact eigenvalues of G with multiplicities (see `synchain.models.spectrum`)."""
        from .spectrum import spectrum

        return spectrum(self)

    def __repr__(self) -> str:
        more = "".join(f", {key}={value!r}" for key, value in self.options)
        return f"Topology({self.name!r}, n={self.n}{more}, {self.link_count} links)"


def names() -> tuple[str, ...]:
    """All topologies that `topology` knows: the files of the folder `topologies`, and entry points of other packages."""
    return plugins.names("topology")


def family(name: str) -> ModuleType:
    """The plug-in module of a topology, by name or by a path that `plugins.allow_code` allowed; else ValueError.

    A plug-in has SUMMARY, MINIMUM, SOURCE and `edges(n)`, which yields (i, j, weight) once for each edge,
    i < j; with DIRECTED = True it yields (target, source, weight) once for each link.  It may have
    `spectrum(n)`, a sequence of (eigenvalue of G as a SymPy expression, multiplicity) without repetition (or None for
    an n without a closed form), `count(n)`, the number of edges, or `expected(n)`, their mean number if chance decides,
    TOO_SMALL, what to do below MINIMUM, and CONNECTED = False where it may fall into parts.  Keyword-only parameters of
    `edges` with defaults are options of the family: `spectrum`, `count` and `expected` take the same ones, and
    `settle(n, **options)` checks them and returns them as they are stored (see `family_options`; None is not stored).
    """
    if not isinstance(name, str):
        raise TypeError(f"topology name {name!r} is no text; expected one of {', '.join(names())}")
    return plugins.load("topology", name)


def topology(name: str, n: int, **options: Any) -> Topology:
    """The named graph of `n` nodes, all weights as its family gives them, with the family's own options.

    Raises ValueError on an unknown name or option and on n below the family's minimum, and TypeError where n is no
    integer.  More than LINK_LIMIT links raise ValueError before any is built: at once where the family does not count
    them, else where they are first asked for.
    """
    module = family(name := plugins.named("topology", name))
    size = _size(name, n, module)
    chosen = settled(name, module, size, options)
    keywords = dict(chosen)
    rule = partial(_closed_form, name, size, chosen) if hasattr(module, "spectrum") else None
    each = 1 if getattr(module, "DIRECTED", False) else 2
    if not hasattr(module, "count"):
        if hasattr(module, "expected"):
            _few(name, size, each * module.expected(size, **keywords))
        found = tuple(_links(name, module, size, keywords))
        return ruled(Topology(name, size, found, chosen), rule, len(found))
    with plugins.blamed(module.count):
        count = each * module.count(size, **keywords)
    made = object.__new__(Topology)
    for key, value in (("name", name), ("n", size), ("options", chosen)):
        object.__setattr__(made, key, value)
    return ruled(made, rule, count)


def ruled(graph: Topology, rule: Rule | None, count: int = -1) -> Topology:
    """Give a graph that was just made its closed form, and the number of its links where its family made them all."""
    object.__setattr__(graph, "_rule", rule)
    object.__setattr__(graph, "_count", count)
    return graph


def _closed_form(name: str, n: int, options: Options) -> Sequence[tuple[sp.Expr, int]] | None:
    """What a family says of its spectrum; ValueError where a file outside the package gives no such list."""
    module = family(name)
    with plugins.blamed(module.spectrum):
        found: Sequence[tuple[sp.Expr, int]] | None = module.spectrum(n, **dict(options))
    if isinstance(name, plugins.OwnFile) and found is not None:
        for pair in found if isinstance(found, list | tuple) else (found,):
            if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], int) and pair[1] > 0):
                raise ValueError(
                    f"{name.place}: spectrum({n}) has {pair!r}; expected a list of (eigenvalue, multiplicity) or None"
                )
    return found


def _links(name: str, module: ModuleType, n: int, keywords: dict[str, Any]) -> Iterator[Link]:
    """The sorted links of a family's edges; ValueError where they are too many."""
    directed, one = getattr(module, "DIRECTED", False), Fraction(1)
    limit = LINK_LIMIT if directed else LINK_LIMIT // 2
    with plugins.blamed(module.edges):
        edges = module.edges(n, **keywords)
        found = [(i, j, one if weight == 1 else Fraction(weight)) for i, j, weight in islice(edges, limit + 1)]
    _few(name, n, len(found) if directed else 2 * len(found))
    if not directed:
        found += [(j, i, weight) for i, j, weight in found]
    found.sort(key=operator.itemgetter(0, 1))
    return iter(found)


def _few(name: str, n: int, links: int) -> None:
    if links > LINK_LIMIT:
        raise ValueError(
            f"topology {name}: n = {n} has too many links, {links} or more; expected at most {LINK_LIMIT}: reduce n"
        )


def _size(name: str, n: Any, module: ModuleType) -> int:
    if isinstance(n, bool) or not hasattr(n, "__index__"):
        raise TypeError(f"topology {name}: n = {n!r} is a {type(n).__name__}; expected an integer")
    size = operator.index(n)
    if size < module.MINIMUM:
        advice = getattr(module, "TOO_SMALL", "choose a larger n")
        raise ValueError(f"topology {name}: n = {size}; expected at least {module.MINIMUM}: {advice}")
    return size


def from_matrix(rows: Iterable[Iterable[Any]] | sp.MatrixBase, name: str = "matrix") -> Topology:
    """The graph of a connectivity matrix G: square, rational, every row sum zero; one-way links are allowed.

    Entries are integers, fractions, decimals, floats (read through their shortest decimal text: 0.1 is 1/10),
    texts such as "1/2", or SymPy rationals.  A row with floats whose sum is zero but for rounding (1e-12 of its
    entries) gets the diagonal entry that makes it exactly zero.  Raises ValueError on a wrong shape, a wrong number
    or a row sum other than zero, and TypeError on anything that is no number.
    """
    table = [list(row) for row in rational_rows(rows, name)]
    given = rows.tolist() if hasattr(rows, "tolist") else rows  # an iterator is used up by now: its numbers are exact
    for i, row in enumerate(table):
        excess = total(row)
        if not excess:
            continue
        rounded = isinstance(given, list | tuple) and any(map(_rounded, given[i]))
        if not rounded or abs(excess) > total(map(abs, row)) / 10**12:
            raise ValueError(
                f"{name}: row {i + 1} sums to {excess}; expected 0, or the synchronous state is no solution: "
                f"set its diagonal entry {row[i]} to {row[i] - excess}"
            )
        row[i] -= excess
    links = tuple((i, j, weight) for i, row in enumerate(table) for j, weight in enumerate(row) if weight and i != j)
    return Topology(name, len(table), links)


def _rounded(entry: Any) -> bool:
    """True for a float, or a text that may be one: its decimals can be those of a rounded number."""
    return isinstance(entry, float) or (isinstance(entry, str) and not set(entry).isdisjoint(".eE"))


def read_matrix(path: str | Path) -> Topology:
    """The graph of a connectivity matrix in a text file: one row a line, entries as 1/2, -3 or 0.25.

    Entries are separated by blanks or commas; `#` starts a comment; empty lines are skipped.  Nothing in the
    file is evaluated.  Raises FileNotFoundError, and ValueError on a folder, on more than FILE_LIMIT bytes,
    on text that is no number and on whatever `from_matrix` refuses.
    """
    text, name = file_text(path, "matrix file", "a text file of rows")
    return from_matrix(parse_rows(text, name), name)
