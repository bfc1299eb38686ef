"""Products and unions of families written as text: cartesian(chain(4), torus(12, shape=(3, 4))), or without sizes.

Such texts are the names that `products` gives its graphs.  They are read by a whitelist over `ast`: nothing in them is run.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from ..inputs.checks import shown
from . import products
from .families import topology
from .topology import Topology

if TYPE_CHECKING:
    from .closed_forms import ClosedForm

__all__ = ["is_composed", "read_form", "read_graph"]

LENGTH, DEPTH = 300, 8
PAIRS, SIZED = ("cartesian", "kronecker", "union"), ("complement", "weighted")
"""Operations of two graphs, and of one: these have no closed form without sizes."""

T = TypeVar("T")


def is_composed(text: str) -> bool:
    """True where a text is one of an operation on graphs, not the name of a family."""
    return "(" in text


def read_graph(text: str, largest: int | None = None) -> Topology:
    """The graph of a text; families have their size as first argument, then their options by name.

    Operations: cartesian, kronecker and union of two, complement, weighted(graph, number).  Raises ValueError on anything
    else, and on a graph of more than `largest` nodes before its links are made.
    """
    return _graph(_parsed(text), text, largest, 0)


def read_form(text: str) -> ClosedForm:
    """The closed form of a text without sizes: cartesian, kronecker and union of families, options with letters.

    Raises ValueError on anything else, and where no closed form with symbols is known.
    """
    return _form(_parsed(text), text, 0)


def _parsed(text: str) -> ast.expr | None:
    """The tree of a text; None where it is too long or no expression."""
    try:
        return ast.parse(text.strip(), mode="eval").body if len(text) <= LENGTH else None
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _unreadable(text: str) -> ValueError:
    known = ", ".join((*PAIRS, *SIZED))
    return ValueError(f"unreadable graph {shown(text)}; expected {known}, e.g. cartesian(chain(4), ring(5))")


def _graph(node: ast.expr | None, text: str, largest: int | None, depth: int) -> Topology:
    match node:
        case ast.Call(func=ast.Name(id=name), args=[a, b], keywords=[]) if name in PAIRS and depth < DEPTH:
            first, second = (_graph(part, text, largest, depth + 1) for part in (a, b))
            _fits(first.n + second.n if name == "union" else first.n * second.n, text, largest)
            return _pair(name, products)(first, second)
        case ast.Call(func=ast.Name(id="complement"), args=[a], keywords=[]) if depth < DEPTH:
            return products.complement(_graph(a, text, largest, depth + 1))
        case ast.Call(func=ast.Name(id="weighted"), args=[a, b], keywords=[]) if depth < DEPTH:
            return products.weighted(_graph(a, text, largest, depth + 1), _option(b, text))
        case ast.Call(func=ast.Name(id=name), args=[ast.Constant(value=int() as n)]) if not isinstance(n, bool):
            _fits(n, text, largest)
            return topology(name, n, **_options(node.keywords, text))
    raise _unreadable(text)


def _form(node: ast.expr | None, text: str, depth: int) -> ClosedForm:
    from . import closed_products
    from .closed_forms import closed_form

    match node:
        case ast.Name(id=name):
            return closed_form(name)
        case ast.Call(func=ast.Name(id=name), args=[a, b], keywords=[]) if name in PAIRS and depth < DEPTH:
            return _pair(name, closed_products)(_form(a, text, depth + 1), _form(b, text, depth + 1))
        case ast.Call(func=ast.Name(id=name), args=[]):
            return closed_form(name, **_options(node.keywords, text))
        case ast.Call(func=ast.Name(id=name)) if name in SIZED:
            raise ValueError(
                f"{shown(text)}: {name} has no closed form without sizes; expected a graph with its size, "
                "e.g. complement(chain(4))"
            )
    raise ValueError(
        f"unreadable closed form {shown(text)}; expected {', '.join(PAIRS)} of families without sizes, "
        "e.g. cartesian(chain, torus(shape=(p, q)))"
    )


def _pair(name: str, home: object) -> Callable[[T, T], T]:
    found: Callable[[T, T], T] = getattr(home, name)
    return found


def _options(keywords: list[ast.keyword], text: str) -> dict[str, str]:
    if any(keyword.arg is None for keyword in keywords):
        raise _unreadable(text)
    return {str(keyword.arg): _option(keyword.value, text) for keyword in keywords}


def _option(node: ast.expr, text: str) -> str:
    """The value of an option as a command line has it: (3, 4) as 3,4; 1 / 10 as 1/10; digits stay as they are written."""
    if isinstance(node, ast.Tuple):
        return ",".join(_option(element, text) for element in node.elts)
    return (ast.get_source_segment(text.strip(), node) or "").replace(" ", "")


def _fits(n: int, text: str, largest: int | None) -> None:
    if largest is not None and n > largest:
        raise ValueError(f"{text[:60]}: {n} nodes; expected at most {largest}")
