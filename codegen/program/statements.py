"""Statements of a program, and functions that list their operations, called functions and names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from .expressions import Call, Expression, Load, Name, PowerExpr, ProductExpr, Quotient, Sum, Value, as_expression


@dataclass(frozen=True, slots=True)
class Assign:
    """Assign the results of an expression to variables; `whole` is True for integers such as indices."""

    targets: tuple[str, ...]
    value: Expression
    whole: bool = False


Index: TypeAlias = Expression | tuple[Expression, Expression]  # the index of an element, or its row and column


@dataclass(frozen=True, slots=True)
class Store:
    array: str
    index: Index
    value: Expression


@dataclass(frozen=True, slots=True)
class Accumulate:
    array: str
    index: Index
    value: Expression


@dataclass(frozen=True, slots=True)
class Array:
    name: str
    size: Expression


@dataclass(frozen=True, slots=True)
class Identity:
    name: str
    size: Expression


@dataclass(frozen=True, slots=True)
class Loop:
    """Run statements for each integer from `start`, up or down, to `stop` (exclusive)."""

    index: str
    start: Expression
    stop: Expression
    body: tuple[Statement, ...]
    step: int = 1


@dataclass(frozen=True, slots=True)
class Repeat:
    """Run statements once, then repeat them while a condition holds."""

    body: tuple[Statement, ...]
    condition: Expression


@dataclass(frozen=True, slots=True)
class If:
    condition: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Titled:
    """Run statements below a comment; their variables are local in languages with blocks."""

    title: str
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Comment:
    text: str


@dataclass(frozen=True, slots=True)
class Do:
    """Call a function for its effect on its arguments."""

    call: Call


@dataclass(frozen=True, slots=True)
class Return:
    values: tuple[Expression, ...]
    remark: str = ""


Statement: TypeAlias = (
    Array | Identity | Assign | Store | Accumulate | Loop | Repeat | If | Titled | Comment | Do | Return
)


class Role(Enum):
    """Compilation of a function: inlined into its callers, called by them, or called by a driver."""

    INLINED = "inlined"
    CALLED = "called"
    ENTRY = "entry"


@dataclass(frozen=True, slots=True)
class Function:
    name: str
    arguments: tuple[str, ...]
    about: str
    body: tuple[Statement, ...]
    role: Role = Role.INLINED


def let(name: str, value: Value) -> Assign:
    """Return the statement that assigns a floating-point value."""
    return Assign((name,), as_expression(value))


def whole(name: str, value: Value) -> Assign:
    """Return the statement that assigns an integer, such as an index."""
    return Assign((name,), as_expression(value), whole=True)


def store(array: str, index: Value, value: Value) -> Store:
    return Store(array, as_expression(index), as_expression(value))


def accumulate(array: str, index: Value, value: Value) -> Accumulate:
    return Accumulate(array, as_expression(index), as_expression(value))


def walk(statements: Iterable[Statement]) -> Iterator[Statement]:
    """Yield all statements, including those of inner blocks."""
    for statement in statements:
        yield statement
        if isinstance(statement, Loop | Repeat | If | Titled):
            yield from walk(statement.body)


def values(statements: Iterable[Statement]) -> Iterator[Expression]:
    """Yield the values that the statements compute, except conditions and indices."""
    for statement in walk(statements):
        match statement:
            case Assign(_, value, False) | Store(_, _, value) | Accumulate(_, _, value) | Do(value):
                yield value
            case Return(results):
                yield from results


def called(statements: Iterable[Statement]) -> set[str]:
    return {e.function for value in values(statements) for e in value.walk() if isinstance(e, Call)}


def targets(statements: Iterable[Statement]) -> list[str]:
    """Return the variables assigned outside of blocks, in the order of their first assignment."""
    return list(dict.fromkeys(name for s in statements if isinstance(s, Assign) for name in s.targets))


def mentioned(statements: Iterable[Statement]) -> set[str]:
    """Return variables and arrays that are read (indices, bounds and conditions too), and arrays that are written."""
    names = set()
    fields = ("value", "index", "start", "stop", "condition", "call")
    for s in walk(statements):
        parts = [getattr(s, name) for name in fields if hasattr(s, name)]
        parts += s.values if isinstance(s, Return) else ()
        if isinstance(s, Store | Accumulate):
            names.add(s.array)
        # the loop index is a string, not an expression: skip strings
        for e in (e for part in parts if isinstance(part, Expression) for e in part.walk()):
            match e:
                case Name(text):
                    names.add(text.partition(".")[0])  # column of column.size
                case Load(array):
                    names.add(array)
    return names


def operations(statements: Sequence[Statement]) -> int:
    """Count sums, differences, products and quotients; count the body of a loop or block once."""
    return sum(map(_cost, values(statements))) + sum(isinstance(s, Accumulate) for s in walk(statements))


def _cost(e: Expression) -> int:
    match e:
        case Load():
            return 0
        case Sum(parts) | ProductExpr(parts):
            cost = len(parts) - 1
        case _:
            cost = int(isinstance(e, Quotient | PowerExpr))
    return cost + sum(map(_cost, e.parts))
