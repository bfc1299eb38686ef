"""Keywords of graph families: which there are, and the one form in which a value is stored.

A stored value is a whole number, a text or a tuple of whole numbers, so that it can stand in a scene file.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..inputs import plugins
from ..inputs.checks import instance, typed
from ..inputs.options import Options, as_options
from ..inputs.plugins import located
from .family_file import TOPOLOGY, defaults
from .links import LINK_LIMIT, _few
from .topology import Topology

if TYPE_CHECKING:
    import sympy as sp

    from .links import Link

__all__ = ["FamilyRule", "a_graph", "defaults", "family", "names", "settled", "topology"]


def settled(name: str, module: ModuleType, n: int, given: Mapping[str, Any]) -> Options:
    """The options of a graph of a family: those given, the others as its file has them, checked by its `settle`.

    Raises ValueError on an option that the family lacks and on whatever `settle` refuses.
    """
    known = defaults(module)
    for key in given:
        if key not in known:
            words = f"known: {', '.join(known)}" if known else "this family has none: remove it"
            raise ValueError(f"topology {name}: unknown option {key!r}; {words}")
    if not known:
        return ()
    try:
        found = module.settle(n, **{**known, **given})
    except (ValueError, TypeError) as error:
        raise type(error)(f"topology {name}: {error}") from None
    except Exception as error:
        raise located(error, module.settle) from error
    if not isinstance(found, Mapping):
        raise ValueError(f"topology {name}: settle returns {found!r}; expected a dict of the options; correct its file")
    return as_options({key: value for key, value in found.items() if value is not None})


def a_graph(what: str, value: object) -> Topology:
    """Return the value where it is a Topology, else raise TypeError."""
    if all(hasattr(value, need) for need in ("nodes", "edges", "is_directed")):
        raise TypeError(f"{what}: found {typed(value)}; expected a graph such as chain(4); make it with from_graph")
    return instance(what, value, Topology, "a graph, e.g. chain(4)")


def names() -> tuple[str, ...]:
    """All topologies that `topology` knows: the files of the folder `topologies`, and entry points of other packages."""
    return plugins.names(TOPOLOGY)


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
    return plugins.load(TOPOLOGY, name)


def topology(name: str, n: int, **options: Any) -> Topology:
    """The named graph of `n` nodes, all weights as its family gives them, with the family's own options.

    Raises ValueError on an unknown name or option and on n below the family's minimum, and TypeError where n is no
    integer.  More than LINK_LIMIT links raise ValueError before any is built: at once where the family does not count
    them, else where they are first asked for.
    """
    module = family(name := plugins.named(TOPOLOGY, name))
    size = _size(name, n, module)
    chosen = settled(name, module, size, options)
    if hasattr(module, "expected"):
        _few(name, size, _each(module) * module.expected(size, **dict(chosen)))
    return Topology(name, size, None, chosen, FamilyRule(name, size, chosen))


@dataclass(frozen=True, slots=True)
class FamilyRule:
    """The rule of a graph that a family made: the name of the family, the number of nodes and the options."""

    name: str
    n: int
    options: Options

    @property
    def link_count(self) -> int | None:
        """The number of links; None if the family does not count its edges."""
        module = family(self.name)
        if not hasattr(module, "count"):
            return None
        with plugins.blamed(module.count):
            return _each(module) * int(module.count(self.n, **dict(self.options)))

    @property
    def undirected(self) -> bool:
        """True if the family joins nodes both ways."""
        return not getattr(family(self.name), "DIRECTED", False)

    def links(self) -> tuple[Link, ...]:
        """Build the sorted links; ValueError if they are more than LINK_LIMIT."""
        _few(self.name, self.n, self.link_count or 0)
        return _links(self.name, family(self.name), self.n, dict(self.options))

    def eigenvalues(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the eigenvalues of G with multiplicities; None if the family has no closed form.

        Raises ValueError if a file outside the package gives no such list.
        """
        module = family(self.name)
        if not hasattr(module, "spectrum"):
            return None
        with plugins.blamed(module.spectrum):
            pairs: Sequence[tuple[sp.Expr, int]] | None = module.spectrum(self.n, **dict(self.options))
        if isinstance(self.name, plugins.OwnFile) and pairs is not None:
            for pair in pairs if isinstance(pairs, list | tuple) else (pairs,):
                if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], int) and pair[1] > 0):
                    raise ValueError(
                        f"{self.name.place}: spectrum({self.n}) has {pair!r}; "
                        "expected a list of (eigenvalue, multiplicity) or None"
                    )
        return pairs


def _each(module: ModuleType) -> int:
    """The number of links of one edge."""
    return 1 if getattr(module, "DIRECTED", False) else 2


def _links(name: str, module: ModuleType, n: int, keywords: dict[str, Any]) -> tuple[Link, ...]:
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
    return tuple(found)


def _size(name: str, n: Any, module: ModuleType) -> int:
    if isinstance(n, bool) or not hasattr(n, "__index__"):
        raise TypeError(f"topology {name}: n = {n!r} is a {type(n).__name__}; expected an integer")
    size = operator.index(n)
    if size < module.MINIMUM:
        advice = getattr(module, "TOO_SMALL", "choose a larger n")
        raise ValueError(f"topology {name}: n = {size}; expected at least {module.MINIMUM}: {advice}")
    return size
