"""Families of graphs: `Family`, `topology` and the rule of a graph that a family made."""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache, wraps
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeAlias

from ..inputs import plugin_files
from ..inputs.options import Options, as_options
from ..inputs.plugin_files import PluginKind
from .links import LINK_LIMIT, Link
from .topology import Topology

if TYPE_CHECKING:
    import sympy as sp

Edges: TypeAlias = "Callable[..., Iterable[tuple[int, int, int | str | Fraction]]]"
Eigenvalues: TypeAlias = "Sequence[tuple[sp.Expr | int, int]] | None"

# Graph families: the files of the folder `topologies`.
TOPOLOGY = PluginKind(
    "topology",
    "topologies",
    lambda: (Family,),
    "Family(edges, minimum=…)",
    also={
        "cycle": "ring",
        "generalized_petersen": "petersen",
        "gnp_random": "erdos_renyi",
        "path": "chain",
        "prism": "circular_ladder",
        "watts_strogatz": "small_world",
    },
    near={
        "all_to_all": "complete",
        "biclique": "complete_bipartite",
        "cayley": "cayley_abelian",
        "clique": "complete",
        "cubic": "random_cubic",
        "gilbert": "erdos_renyi",
        "gnp": "erdos_renyi",
        "lattice": "grid",
        "line": "chain",
        "newman_watts": "small_world",
        "open_chain": "chain",
        "rook": "hamming",
        "triangular": "johnson",
        "turan": "complete_multipartite",
    },
)


class _Signature:
    """The signature of a call of a family: n, and the options with their defaults."""

    def __get__(self, instance: Family | None, owner: type[Family]) -> inspect.Signature:
        if instance is None:  # inspect.signature(Family) is the constructor's
            raise AttributeError("__signature__")
        kind = inspect.Parameter
        options = (kind(name, kind.KEYWORD_ONLY, default=value) for name, value in instance.options.items())
        return inspect.Signature([kind("n", kind.POSITIONAL_OR_KEYWORD, annotation=int), *options])


@lru_cache(maxsize=256)
def _options(edges: Edges) -> Mapping[str, object]:
    """Return the keyword-only parameters of a function with their defaults."""
    parameters = inspect.signature(edges).parameters.values()
    return {p.name: p.default for p in parameters if p.kind is inspect.Parameter.KEYWORD_ONLY}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Family:
    """A family of graphs: a function of the number of nodes and of the options of the family.

    A plug-in file assigns a family to TOPOLOGY.  Two families are equal if their names are equal; the name of a file
    outside the package includes the digest of its text.  A family is pickled by name.

    Parameters
    ----------
    edges : callable
        ``edges(n, **options)`` yields (i, j, weight) once for each edge, with nodes counted from 0.  In a directed
        family it yields (target, source, weight) once for each link.  Weights are whole numbers, Fractions or texts
        such as "1/2".  The keyword-only arguments are the options of the family with their defaults; an option with
        the default None is stored only if it is set.
    minimum : int
        Smallest number of nodes.
    too_small : str
        Advice in the error message for n below the minimum.
    settle : callable, optional
        ``settle(n, **options)`` checks the options, and n if not every number of nodes is possible.  It returns the
        options in the form that a graph stores.  Required if the family has options.
    count, expected : callable, optional
        ``count(n, **options)`` is the number of edges, computed without building the graph.
        ``expected(n, **options)`` is the mean number of edges of a random graph.
    spectrum : callable, optional
        ``spectrum(n, **options)`` is a sequence of (eigenvalue of adjacency minus degree, multiplicity) with distinct
        eigenvalues, or None for an n without a closed form.  The sequence is proved before use.
    formula : callable, optional
        The closed form with symbols for the sizes, a `ClosedForm`.
    sides : callable, optional
        ``sides(n)`` is the number of nodes in each direction of a grid.
    directed : bool
        True if links are one-way.
    connected : bool
        False if a graph of the family may have several components.
    all_to_all : bool
        True if an edge of weight 1 joins every pair of nodes; such graphs are computed with mean fields.
    source : str
        Publication that defines the graph.
    name, summary : str
        Name of the plug-in, and one line for lists; both are taken from the plug-in file.

    Raises
    ------
    ValueError
        If the functions have different options, or an option has no default.

    See Also
    --------
    synchain.graphs.topology
    synchain.graphs.Topology

    Examples
    --------
    >>> from synchain.plugins import Family
    >>> pairs = Family(lambda n: ((i, i + 1, 1) for i in range(0, n - 1, 2)), minimum=2, connected=False, name="pairs")
    >>> pairs(4).link_count
    4
    """

    edges: Edges
    minimum: int
    too_small: str = "choose a larger n"
    settle: Callable[..., object] | None = None
    count: Callable[..., int] | None = None
    expected: Callable[..., int] | None = None
    spectrum: Callable[..., Eigenvalues] | None = None
    formula: Callable[..., Any] | None = None
    sides: Callable[[int], tuple[int, ...]] | None = None
    directed: bool = False
    connected: bool = True
    all_to_all: bool = False
    source: str = ""
    name: str = ""
    summary: str = ""
    link_limit: int = LINK_LIMIT  # most links of a graph
    __signature__ = _Signature()

    def __post_init__(self) -> None:
        if isinstance(self.minimum, bool) or not isinstance(self.minimum, int):
            raise TypeError(f"minimum is {self.minimum!r}; expected the smallest number of nodes, a whole number")
        for name, default in self.options.items():
            if default is inspect.Parameter.empty:
                raise ValueError(f"the option {name!r} of edges has no default; expected one, such as {name}=1")
        if self.options and self.settle is None:
            raise ValueError(
                f"found no settle for the options {', '.join(self.options)}; expected one that checks them"
            )
        # Each function takes n and all options of `edges`; further arguments must have defaults.
        for name in ("settle", "count", "expected", "spectrum"):
            if (function := getattr(self, name)) is not None:
                parameters = dict(list(inspect.signature(function).parameters.items())[1:])
                for option, parameter in parameters.items():
                    if option not in self.options and parameter.default is inspect.Parameter.empty:
                        raise ValueError(f"{name} has the argument {option!r}, which is no option of edges")
                for option in self.options:
                    if option not in parameters:
                        raise ValueError(f"{name} lacks the option {option!r} of edges; expected the same ones")

    @property
    def options(self) -> Mapping[str, object]:
        """The options with their defaults."""
        return _options(self.edges)

    def __call__(self, *n: object, **options: object) -> Topology:
        """Return the graph of `n` nodes; see `topology`."""
        sizes = (*n, *([options.pop("n")] if "n" in options else ()))
        if len(sizes) != 1:
            raise TypeError(
                f"topology {self.name}: found {len(sizes)} arguments for n; expected {self.name}{inspect.signature(self)}"
            )
        if isinstance(sizes[0], bool) or not hasattr(sizes[0], "__index__"):
            raise TypeError(
                f"topology {self.name}: n = {sizes[0]!r} is a {type(sizes[0]).__name__}; expected an integer"
            )
        size = operator.index(sizes[0])
        if size < self.minimum:
            raise ValueError(f"topology {self.name}: n = {size}; expected at least {self.minimum}: {self.too_small}")
        settled = self._settled(size, options)
        # Refuse a random graph with too many links now; refuse other graphs only when their links are listed.
        edge_count = self.count if self.expected is None and "seed" in self.options else self.expected
        if edge_count is not None:
            self.limit_links(size, self.links_of_edge * edge_count(size, **dict(settled)))
        return Topology(self.name, size, None, settled, FamilyRule(self, size, settled))

    def __eq__(self, other: object) -> bool:
        return self.name == other.name if isinstance(other, Family) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.name)

    def __repr__(self) -> str:
        return f"Family({self.name!r})"

    def __reduce__(self) -> tuple[Callable[[str], Family], tuple[str]]:
        return family, (self.name,)

    @property
    def links_of_edge(self) -> int:
        """The number of links of one edge."""
        return 1 if self.directed else 2

    def limit_links(self, n: int, links: int) -> None:
        """Raise ValueError if a graph of `n` nodes has too many links."""
        if links > self.link_limit:
            raise ValueError(
                f"topology {self.name}: n = {n} has too many links, {links} or more; "
                f"expected at most {self.link_limit}: reduce n"
            )

    def _settled(self, n: int, options: Mapping[str, object]) -> Options:
        """Check the options with `settle` and return them in the form that a graph stores."""
        for key in options:
            if key not in self.options:
                remedy = f"known: {', '.join(self.options)}" if self.options else "this family has none: remove it"
                raise ValueError(f"topology {self.name}: unknown option {key!r}; {remedy}")
        if self.settle is None:
            return ()
        try:
            settled = self.settle(n, **{**self.options, **options})
        except (ValueError, TypeError) as error:
            raise type(error)(f"topology {self.name}: {error}") from None
        except Exception as error:  # a mistake in a plug-in file
            raise plugin_files.located(error, self.settle) from error
        if not isinstance(settled, Mapping):
            raise ValueError(
                f"topology {self.name}: settle returns {settled!r}; expected a dict of the options; correct its file"
            )
        return as_options({key: value for key, value in settled.items() if value is not None})


@dataclass(frozen=True, slots=True)
class FamilyRule:
    """Links and spectrum of a graph that a family made; see `Rule`."""

    family: Family
    n: int
    options: Options

    @property
    def link_count(self) -> int | None:
        """The number of links; None if the family does not count its edges."""
        count = self.family.count
        return None if count is None else self.family.links_of_edge * int(count(self.n, **dict(self.options)))

    @property
    def undirected(self) -> bool:
        return not self.family.directed

    @property
    def all_to_all(self) -> Fraction | None:
        """1, the weight of all links, if the family joins all pairs of nodes; else None."""
        return Fraction(1) if self.family.all_to_all else None

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links; ValueError for more than `link_limit`."""
        family, one = self.family, Fraction(1)
        # Check the count first.  A family without `count` is read up to the limit only, to bound the memory.
        family.limit_links(self.n, self.link_count or 0)
        edges = islice(family.edges(self.n, **dict(self.options)), family.link_limit // family.links_of_edge + 1)
        links = [(i, j, one if weight == 1 else Fraction(weight)) for i, j, weight in edges]  # share one Fraction
        family.limit_links(self.n, family.links_of_edge * len(links))
        if not family.directed:
            links += [(j, i, weight) for i, j, weight in links]
        links.sort(key=operator.itemgetter(0, 1))
        return tuple(links)

    def eigenvalues(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the eigenvalues of G with multiplicities; None if the family has no closed form."""
        pairs = None if self.family.spectrum is None else self.family.spectrum(self.n, **dict(self.options))
        if not isinstance(pairs, list | tuple):  # a lazy sequence already has SymPy numbers
            return pairs
        from sympy import Integer

        return [(Integer(value) if isinstance(value, int) else value, count) for value, count in pairs]


def topology(name: str, n: int, **options: object) -> Topology:
    """Return the graph of a family by its name.

    Parameters
    ----------
    name : str
        Name of a family (see `names`), or path of a file that `allow_code` has allowed.
    n : int
        Number of nodes.
    **options
        Options of the family; the family sets the weights.

    Returns
    -------
    Topology
        The graph.  Its links are built on first use.

    Raises
    ------
    TypeError
        If n is no integer.
    ValueError
        On an unknown name or option, on n below the family's minimum, and on more than LINK_LIMIT
        links.  Links are counted before any is built: in this call for a random graph, for other
        graphs on first use of their links.

    See Also
    --------
    synchain.graphs.Topology
    synchain.plugins.Family

    Examples
    --------
    >>> from synchain.graphs import topology
    >>> topology("circulant", 10, offsets=(1, 3))
    Topology('circulant', n=10, offsets=(1, 3), 20 edges)
    """
    return family(name)(n, **options)


def names() -> tuple[str, ...]:
    """Return the names of all families, sorted: shipped files and entry points."""
    return plugin_files.names(TOPOLOGY)


def family(name: str) -> Family:
    """Return a family of graphs by its name, or by a path that `allow_code` has allowed."""
    if not isinstance(name, str):
        raise TypeError(f"topology name {name!r} is no text; expected one of {', '.join(names())}")
    canonical = plugin_files.named(TOPOLOGY, name)
    loaded: Family = plugin_files.load(TOPOLOGY, canonical)
    if plugin_files.is_shipped(TOPOLOGY, canonical):
        return loaded

    # Wrap the functions of a plug-in file: errors name file and line, and returned values are checked.
    def blamed(function: Callable[..., Any] | None) -> Callable[..., Any] | None:
        return None if function is None else plugin_files.blamed(function)(function)

    @wraps(loaded.edges)
    def edges(n: int, **options: object) -> Iterator[tuple[int, int, Fraction]]:
        with plugin_files.blamed(loaded.edges):
            yield from ((i, j, Fraction(weight)) for i, j, weight in loaded.edges(n, **options))

    guarded = replace(loaded, edges=edges, count=blamed(loaded.count), expected=blamed(loaded.expected))
    if (spectrum := loaded.spectrum) is None:
        return guarded

    @wraps(spectrum)
    def checked(n: int, **options: object) -> Eigenvalues:
        with plugin_files.blamed(spectrum):
            pairs: Eigenvalues = spectrum(n, **options)
        for pair in () if pairs is None else pairs if isinstance(pairs, Sequence) else (pairs,):
            if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], int) and pair[1] > 0):
                raise ValueError(
                    f"{getattr(canonical, 'path', name)}: spectrum({n}) has {pair!r}; expected a list of "
                    "(eigenvalue, multiplicity) or None"
                )
        return pairs

    return replace(guarded, spectrum=checked)
