"""Read operations on families of graphs from text: cartesian(chain(4), torus(12, shape=(3, 4))), or without sizes.

`products` names its graphs by such texts.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NoReturn, TypeVar

from ..inputs.checks import short_repr
from ..inputs.reader import Algebra, NoMeaning, parse, unpaired
from . import graph_products
from .families import TOPOLOGY, family, names, topology
from .topology import Topology

if TYPE_CHECKING:
    from .closed_forms import ClosedForm

V = TypeVar("V")

LENGTH, DEPTH = 300, 8  # most characters of a text, and most nested operations; both are choices
LARGEST = 1_000_000  # most nodes of a graph whose name `checked_name` reads, a choice
PAIRS = ("cartesian", "kronecker", "union")  # operations on two graphs or on two closed forms
SIZED = ("complement", "weighted")  # operations on one graph; none has a closed form without sizes


def is_composed(text: str) -> bool:
    """Return whether a text is an operation on graphs, not the name of a family."""
    return "(" in text


def read_graph(text: str, largest: int | None = None, seeds: Iterator[int] | None = None) -> Topology:
    """Return the graph of a text; the arguments of a family are its size, then its options by name."""
    return _value(_Graphs(text, largest, seeds))


def checked_name(what: str, graph: Topology) -> Topology:
    """Return the graph unchanged; ValueError if `read_graph` would read its name as a graph with other links."""
    composed = is_composed(graph.name)
    if graph.rule is not None or not (composed or graph.name in (*names(), *TOPOLOGY.also)):
        return graph
    text = graph.name if composed else f"{graph.name}({graph.n})"
    # A name that cannot be read as an operation is free; the name of a family with a wrong size is not.
    try:
        named = read_graph(text, LARGEST)
        same = named.n == graph.n and named.links == graph.links
    except (ValueError, TypeError):
        same = composed  # unreadable: parentheses that are part of a free name
    if not same:
        raise ValueError(
            f"{what}: found the name {short_repr(graph.name)} and links other than those of {text}; expected a graph by "
            "name and n, or links under a name of their own"
        )
    return graph


def read_form(text: str) -> ClosedForm:
    """Return the closed form of a text without sizes: cartesian, kronecker and union of families, with letters."""
    return _value(_Forms(text))


@dataclass(frozen=True, slots=True)
class _Composed(Algebra[V]):
    """Base of the algebras for graphs and closed forms; an error quotes the whole text."""

    text: str
    deepest = DEPTH
    what: ClassVar[str]
    expected: ClassVar[str]

    @property
    def unreadable(self) -> ValueError:
        """The error for a text that is no operation."""
        return ValueError(
            f"unreadable {self.what} {short_repr(self.text)}{unpaired(self.text)}; expected {self.expected}"
        )

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        raise self.unreadable

    def refuse_depth(self) -> NoReturn:
        raise self.unreadable


def _value(composed: _Composed[V]) -> V:
    """Evaluate the text; ValueError if it is too long or cannot be read."""
    expression = parse(composed.text) if len(composed.text) <= LENGTH else None
    if expression is None:
        raise composed.unreadable
    return expression.evaluate(composed)


@dataclass(frozen=True, slots=True)
class _Graphs(_Composed[Topology]):
    """Graphs: families with their sizes, and operations on them."""

    largest: int | None
    seeds: Iterator[int] | None = None  # one for each graph of a random family
    what = "graph"
    expected = f"{', '.join((*PAIRS, *SIZED))}, e.g. cartesian(chain(4), ring(5))"

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Topology] | None]:
        # evaluate graphs with this algebra; pass sizes and factors on as text
        if function in PAIRS and count == 2 and not options:
            return self, self
        if function == "complement" and count == 1 and not options:
            return (self,)
        if function == "weighted" and count == 2 and not options:
            return self, None
        if count != 1:
            raise NoMeaning
        return (None,)

    def call(self, function: str, arguments: Sequence[Topology | str], options: Mapping[str, str]) -> Topology:
        match function, arguments:
            case "cartesian" | "kronecker" | "union", [Topology() as first, Topology() as second]:
                self._check_size(first.n + second.n if function == "union" else first.n * second.n)
                operation: Callable[[Topology, Topology], Topology] = getattr(graph_products, function)
                return operation(first, second)
            case "complement", [Topology() as graph]:
                return graph_products.complement(graph)
            case "weighted", [Topology() as graph, str() as factor]:
                return graph_products.weighted(graph, factor)
            case _, [str() as size] if size[:1].isdigit():
                try:
                    n = int(size, 0)
                except ValueError:
                    raise NoMeaning from None
                self._check_size(n)
                if self.seeds is None or "seed" not in family(function).options:
                    return topology(function, n, **options)
                if "seed" in options:
                    raise ValueError(f"{self.text[:60]}: found a seed; expected none where seeds are drawn")
                return topology(function, n, **options, seed=next(self.seeds))
        raise NoMeaning

    def _check_size(self, n: int) -> None:
        if self.largest is not None and n > self.largest:
            raise ValueError(f"{self.text[:60]}: {n} nodes; expected at most {self.largest}")


@dataclass(frozen=True, slots=True)
class _Forms(_Composed["ClosedForm"]):
    """Closed forms: families without sizes, and the operations that keep them closed forms."""

    what = "closed form"
    expected = f"{', '.join(PAIRS)} of families without sizes, e.g. cartesian(chain, torus(shape=(p, q)))"

    def name(self, name: str) -> ClosedForm:
        from .closed_forms import closed_form

        return closed_form(name)

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[ClosedForm]]:
        if function in PAIRS and count == 2 and not options:
            return self, self
        if count == 0:
            return ()
        if function in SIZED:
            raise ValueError(
                f"{short_repr(self.text)}: {function} has no closed form without sizes; expected a graph with its size, "
                "e.g. complement(chain(4))"
            )
        raise NoMeaning

    def call(self, function: str, arguments: Sequence[ClosedForm], options: Mapping[str, str]) -> ClosedForm:
        from . import closed_products
        from .closed_forms import closed_form

        if not arguments:
            return closed_form(function, **options)
        operation: Callable[..., ClosedForm] = getattr(closed_products, function)
        return operation(*arguments)
