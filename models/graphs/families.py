"""Families of graphs: what their plug-in files must hold, a file as a value, and the graphs that it makes."""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import wraps
from itertools import islice
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

from ..inputs import plugins
from ..inputs.options import Options, as_options
from ..inputs.plugin_file import PluginFile
from ..inputs.plugins import PluginKind
from .links import LINK_LIMIT, Link
from .topology import Topology

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["KNOWN", "TOPOLOGY", "Family", "FamilyRule", "check_topology", "family", "names", "topology"]

Edges: TypeAlias = "Callable[..., Iterable[tuple[int, int, int | str | Fraction]]]"
Eigenvalues: TypeAlias = "Sequence[tuple[sp.Expr, int]] | None"

KNOWN = (
    *("SUMMARY", "SOURCE", "MINIMUM", "TOO_SMALL", "DIRECTED", "CONNECTED", "ALL_TO_ALL"),
    *("edges", "settle", "count", "expected", "spectrum", "formula", "sides"),
)
"""The public names that the file of a topology may define."""


def _defaults(module: ModuleType) -> dict[str, object]:
    """The options of a family with their defaults: the keyword-only parameters of its `edges`."""
    found = inspect.signature(module.edges).parameters.values()
    return {p.name: p.default for p in found if p.kind is inspect.Parameter.KEYWORD_ONLY}


def check_topology(module: ModuleType, where: str, text: bytes) -> None:
    """Raise ValueError if a module is no topology."""
    file = PluginFile.of("topology", KNOWN, module, where, text)
    file.check_names(("SUMMARY", "MINIMUM", "edges"))
    file.check_values()
    least = file.get("MINIMUM")
    if isinstance(least, bool) or not isinstance(least, int):
        raise file.wrong("MINIMUM", f"MINIMUM is {least!r}; expected the smallest number of nodes, a whole number")
    options = _defaults(file.module)
    for name, value in options.items():
        if value is inspect.Parameter.empty:
            raise file.wrong("edges", f"the option {name!r} of edges has no default; expected one, such as {name}=1")
    if options:
        file.need("settle")
    for function in file.defined(("settle", "count", "expected", "spectrum")):
        strange = [name for name in list(inspect.signature(file.get(function)).parameters)[1:] if name not in options]
        if strange:
            raise file.wrong(function, f"{function} asks for {strange[0]!r}, which is no option of edges")
    for function in file.defined(("settle", "count", "expected", "spectrum")):
        missing = [name for name in options if name not in inspect.signature(file.get(function)).parameters]
        if missing:
            raise file.wrong(function, f"{function} lacks the option {missing[0]!r} of edges; expected the same ones")


TOPOLOGY = PluginKind(
    "topology",
    "topologies",
    check_topology,
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
"""Graph families: the files of the folder `topologies`."""


class _Signature:
    """The signature of a call of a family: n, and its options with their defaults; the class has its own."""

    def __get__(self, made: Family | None, owner: type[Family]) -> inspect.Signature:
        if made is None:
            raise AttributeError("__signature__")
        kind = inspect.Parameter
        options = (kind(name, kind.KEYWORD_ONLY, default=value) for name, value in made.options.items())
        return inspect.Signature([kind("n", kind.POSITIONAL_OR_KEYWORD, annotation=int), *options])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Family:
    """A family of graphs: a function of the number of nodes and of the options of the family.

    Families are equal if their names are; that of a file outside the package stands for one text
    of that file.  A family pickles as its name.
    """

    name: str  # the name of the plug-in
    summary: str  # one line for lists
    minimum: int  # smallest number of nodes
    # ``edges(n, **options)`` yields (i, j, weight) once for each edge, i < j; of a directed family (target, source,
    # weight) once for each link
    edges: Edges
    source: str = ""  # where the graph comes from
    too_small: str = "choose a larger n"  # what to do if n is below the minimum
    directed: bool = False  # True if links are one-way
    connected: bool = True  # False if a graph may fall into parts
    all_to_all: bool = False  # True if every pair of nodes is joined by an edge of weight 1
    # the options with their defaults; None if an option is not stored unless it is set
    options: Mapping[str, object] = field(default_factory=dict)
    # ``settle(n, **options)`` checks the options, and n if the family has not all numbers of nodes, and returns the
    # options as they are stored
    settle: Callable[..., object] | None = None
    # ``count(n, **options)`` is the number of edges; ``expected(n, **options)`` is their mean number if chance
    # decides
    count: Callable[..., int] | None = None
    expected: Callable[..., int] | None = None
    # ``spectrum(n, **options)`` is a sequence of (eigenvalue of G, multiplicity) without repetition, or None for an n
    # without a closed form
    spectrum: Callable[..., Eigenvalues] | None = None
    formula: Callable[..., Any] | None = None  # the closed form with symbols for the sizes
    # ``sides(n)`` is the number of nodes in each direction of a grid
    sides: Callable[[int], tuple[int, ...]] | None = None
    link_limit: int = LINK_LIMIT  # greatest number of links of a graph
    __signature__ = _Signature()

    def __call__(self, *n: object, **options: object) -> Topology:
        """Return the graph of `n` nodes; see `topology`."""
        sizes = (*n, *([options.pop("n")] if "n" in options else ()))
        if len(sizes) != 1:
            raise TypeError(
                f"topology {self.name}: found {len(sizes)} arguments for n; expected {self.name}{inspect.signature(self)}"
            )
        size = self._size(sizes[0])
        settled = self._settled(size, options)
        number = self.count if self.expected is None and "seed" in self.options else self.expected
        if number is not None:  # of graphs by chance, which are drawn to be used at once
            self.limit_links(size, self.links_of_edge * number(size, **dict(settled)))
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

    def _size(self, n: object) -> int:
        """The number of nodes; TypeError if it is no integer, ValueError if it is too small."""
        if isinstance(n, bool) or not hasattr(n, "__index__"):
            raise TypeError(f"topology {self.name}: n = {n!r} is a {type(n).__name__}; expected an integer")
        size = operator.index(n)
        if size < self.minimum:
            raise ValueError(f"topology {self.name}: n = {size}; expected at least {self.minimum}: {self.too_small}")
        return size

    def _settled(self, n: int, options: Mapping[str, object]) -> Options:
        """All options as they are stored, checked by the family's `settle`."""
        for key in options:
            if key not in self.options:
                words = f"known: {', '.join(self.options)}" if self.options else "this family has none: remove it"
                raise ValueError(f"topology {self.name}: unknown option {key!r}; {words}")
        if self.settle is None:
            return ()
        try:
            settled = self.settle(n, **{**self.options, **options})
        except (ValueError, TypeError) as error:
            raise type(error)(f"topology {self.name}: {error}") from None
        except Exception as error:
            raise plugins.located(error, self.settle) from error
        if not isinstance(settled, Mapping):
            raise ValueError(
                f"topology {self.name}: settle returns {settled!r}; expected a dict of the options; correct its file"
            )
        return as_options({key: value for key, value in settled.items() if value is not None})


@dataclass(frozen=True, slots=True)
class FamilyRule:
    """The rule of a graph that a family made: the family, the number of nodes and the options."""

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
        """True if the family joins nodes both ways."""
        return not self.family.directed

    @property
    def all_to_all(self) -> Fraction | None:
        """1 if the family joins all pairs of nodes."""
        return Fraction(1) if self.family.all_to_all else None

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links; ValueError if they are too many."""
        family, one = self.family, Fraction(1)
        family.limit_links(self.n, self.link_count or 0)
        edges = islice(family.edges(self.n, **dict(self.options)), family.link_limit // family.links_of_edge + 1)
        links = [(i, j, one if weight == 1 else Fraction(weight)) for i, j, weight in edges]
        family.limit_links(self.n, family.links_of_edge * len(links))
        if not family.directed:
            links += [(j, i, weight) for i, j, weight in links]
        links.sort(key=operator.itemgetter(0, 1))
        return tuple(links)

    def eigenvalues(self) -> Eigenvalues:
        """List the eigenvalues of G with multiplicities; None if the family has no closed form.

        Raises ValueError if a file outside the package gives no such list.
        """
        spectrum = self.family.spectrum
        return None if spectrum is None else spectrum(self.n, **dict(self.options))


def topology(name: str, n: int, **options: object) -> Topology:
    """Return the graph of a family by its name.

    Parameters
    ----------
    name : str
        Name of a family (see `names`), or path of a file that `allow_code` has allowed.
    n : int
        Number of nodes.
    **options
        Options of the family; weights are those of the family.

    Returns
    -------
    Topology
        The graph.  Its links are built when they are first asked for.

    Raises
    ------
    TypeError
        If n is no integer.
    ValueError
        On an unknown name or option, on n below the family's minimum, and on more than LINK_LIMIT
        links before any is built: at once if the graph is drawn by chance, else when they are
        first asked for.
    """
    return family(name)(n, **options)


def names() -> tuple[str, ...]:
    """Return the names of all families, sorted: shipped files and entry points."""
    return plugins.names(TOPOLOGY)


def family(name: str) -> Family:
    """Return a family of graphs by its name, or by a path that `allow_code` has allowed."""
    if not isinstance(name, str):
        raise TypeError(f"topology name {name!r} is no text; expected one of {', '.join(names())}")
    known = plugins.named(TOPOLOGY, name)
    return _of_module(known, plugins.load(TOPOLOGY, known))


_ATTRIBUTES = {
    "SUMMARY": "summary",
    "MINIMUM": "minimum",
    "SOURCE": "source",
    "TOO_SMALL": "too_small",
    "DIRECTED": "directed",
    "CONNECTED": "connected",
    "ALL_TO_ALL": "all_to_all",
    "settle": "settle",
    "formula": "formula",
    "sides": "sides",
}
"""Names of a file that a family takes as they are."""


def _of_module(name: str, module: ModuleType) -> Family:
    """The family of a module; errors of functions from outside the package name file and line."""
    parts = {attribute: getattr(module, key) for key, attribute in _ATTRIBUTES.items() if hasattr(module, key)}
    outside = not module.__name__.startswith(f"{plugins.PACKAGE}.")
    for key in ("count", "expected", "spectrum"):
        if hasattr(module, key):
            function = getattr(module, key)
            parts[key] = plugins.blamed(function)(function) if outside else function
    if isinstance(name, plugins.OwnFile) and "spectrum" in parts:
        parts["spectrum"] = _checked(parts["spectrum"], name.place)
    edges = _blamed_edges(module.edges) if outside else module.edges
    return Family(name=name, edges=edges, options=_defaults(module), **parts)


def _blamed_edges(edges: Edges) -> Edges:
    """Edges whose errors name file and line, wrong weights too."""

    @wraps(edges)
    def blamed_edges(n: int, **options: object) -> Iterator[tuple[int, int, Fraction]]:
        with plugins.blamed(edges):
            yield from ((i, j, Fraction(weight)) for i, j, weight in edges(n, **options))

    return blamed_edges


def _checked(spectrum: Callable[..., Eigenvalues], place: str) -> Callable[..., Eigenvalues]:
    """A closed form that raises ValueError if it is no list of (eigenvalue, multiplicity)."""

    @wraps(spectrum)
    def checked(n: int, **options: object) -> Eigenvalues:
        pairs: Eigenvalues = spectrum(n, **options)
        for pair in () if pairs is None else pairs if isinstance(pairs, list | tuple) else (pairs,):
            if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], int) and pair[1] > 0):
                raise ValueError(
                    f"{place}: spectrum({n}) has {pair!r}; expected a list of (eigenvalue, multiplicity) or None"
                )
        return pairs

    return checked
