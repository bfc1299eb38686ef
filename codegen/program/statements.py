"""Statements of a program, and what can be read off them: operations, functions, names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from .expressions import Call, Expression, Load, Name, Power, Product, Quotient, Sum, Value, as_expression


@dataclass(frozen=True, slots=True)
class Assign:
    """Variables get the results of an expression; `whole` where these are indices."""

    targets: tuple[str, ...]
    value: Expression
    whole: bool = False


Index: TypeAlias = Expression | tuple[Expression, Expression]
"""The place of an element, or its row and column."""


@dataclass(frozen=True, slots=True)
class Store:
    """A value goes to a place of an array."""

    array: str
    index: Index
    value: Expression


@dataclass(frozen=True, slots=True)
class Accumulate:
    """A value is added to what stands at a place of an array."""

    array: str
    index: Index
    value: Expression


@dataclass(frozen=True, slots=True)
class Array:
    """A new array of some size."""

    name: str
    size: Expression


@dataclass(frozen=True, slots=True)
class Identity:
    """A new square matrix with ones on its diagonal."""

    name: str
    size: Expression


@dataclass(frozen=True, slots=True)
class Loop:
    """Statements for each whole number from `start` up to `stop`, or down to it; `stop` is not one of them."""

    index: str
    start: Expression
    stop: Expression
    body: tuple[Statement, ...]
    step: int = 1


@dataclass(frozen=True, slots=True)
class Repeat:
    """Statements that run once, and again as long as a condition holds behind them."""

    body: tuple[Statement, ...]
    condition: Expression


@dataclass(frozen=True, slots=True)
class If:
    """Statements that run if a condition holds."""

    condition: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Titled:
    """Statements with a title, and variables of their own where a language has that."""

    title: str
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Comment:
    """A line for readers."""

    text: str


@dataclass(frozen=True, slots=True)
class Do:
    """A call for what it does to its arguments."""

    call: Call


@dataclass(frozen=True, slots=True)
class Return:
    """The end of a function and its results, with a remark."""

    values: tuple[Expression, ...]
    remark: str = ""


Statement: TypeAlias = (
    Array | Identity | Assign | Store | Accumulate | Loop | Repeat | If | Titled | Comment | Do | Return
)


class Role(Enum):
    """What becomes of a function: its callers take over its body, or call it, or a driver does."""

    INLINED = "inlined"
    CALLED = "called"
    ENTRY = "entry"


@dataclass(frozen=True, slots=True)
class Function:
    """A function of a kernel."""

    name: str
    arguments: tuple[str, ...]
    about: str
    body: tuple[Statement, ...]
    role: Role = Role.INLINED


def let(name: str, value: Value) -> Assign:
    """Return the statement that gives one variable a value."""
    return Assign((name,), as_expression(value))


def whole(name: str, value: Value) -> Assign:
    """Return the statement that gives an index a value."""
    return Assign((name,), as_expression(value), whole=True)


def store(array: str, index: Value, value: Value) -> Store:
    """Return the statement that stores a value."""
    return Store(array, as_expression(index), as_expression(value))


def accumulate(array: str, index: Value, value: Value) -> Accumulate:
    """Return the statement that adds a value to what stands at a place."""
    return Accumulate(array, as_expression(index), as_expression(value))


def walk(statements: Iterable[Statement]) -> Iterator[Statement]:
    """Yield all statements, those of inner blocks too."""
    for statement in statements:
        yield statement
        if isinstance(statement, Loop | Repeat | If | Titled):
            yield from walk(statement.body)


def values(statements: Iterable[Statement]) -> Iterator[Expression]:
    """Yield what is computed: neither the places where it goes, nor conditions, nor indices."""
    for statement in walk(statements):
        match statement:
            case Assign(_, value, False) | Store(_, _, value) | Accumulate(_, _, value) | Do(value):
                yield value
            case Return(results):
                yield from results


def called(statements: Iterable[Statement]) -> set[str]:
    """Return the names of the functions that are called."""
    return {e.function for value in values(statements) for e in value.walk() if isinstance(e, Call)}


def targets(statements: Iterable[Statement]) -> list[str]:
    """Return the names of the variables that get values, outside of loops, in the order in which they get them."""
    return list(dict.fromkeys(name for s in statements if isinstance(s, Assign) for name in s.targets))


def mentioned(statements: Iterable[Statement]) -> set[str]:
    """Return the names of all variables and arrays that are read or written, in places and bounds too."""
    found = set()
    for s in walk(statements):
        parts = [
            getattr(s, name) for name in ("value", "index", "start", "stop", "condition", "call") if hasattr(s, name)
        ]
        parts += s.values if isinstance(s, Return) else ()
        found |= {s.array} if isinstance(s, Store | Accumulate) else set()
        for e in (e for part in parts if isinstance(part, Expression) for e in part.walk()):
            found |= {e.text.partition(".")[0]} if isinstance(e, Name) else {e.array} if isinstance(e, Load) else set()
    return found


def used(statements: Sequence[Statement]) -> set[str]:
    """Return the names of the variables and arrays in values, and of the arrays that are written."""
    found = {s.array for s in walk(statements) if isinstance(s, Store | Accumulate)}
    for value in values(statements):
        for e in value.walk():
            match e:
                case Name(text) | Load(text):
                    found.add(text)
    return found


def operations(statements: Sequence[Statement]) -> int:
    """Return how many sums, differences, products and quotients the statements hold."""
    return sum(map(_cost, values(statements))) + sum(isinstance(s, Accumulate) for s in walk(statements))


def _cost(e: Expression) -> int:
    match e:
        case Load():
            return 0
        case Sum(parts) | Product(parts):
            own = len(parts) - 1
        case _:
            own = int(isinstance(e, Quotient | Power))
    return own + sum(map(_cost, e.parts))
