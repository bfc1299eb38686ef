"""Statements of a program, and what can be read off them: operations, functions, names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from .expressions import (
    Call,
    Expression,
    Load,
    Name,
    Power,
    Product,
    Quotient,
    Sum,
    Value,
    as_expression,
)

__all__ = [
    "Accumulate", "Array", "Assign", "Block", "Comment", "Do", "Function", "Identity", "If", "Index", "Loop", "Return", "Statement", "Store", "accumulate",
    "called", "expressions", "let", "operations", "store", "used", "whole",
]  # fmt: skip


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
    """Statements for each whole number from `start` up to `stop`."""

    index: str
    start: Expression
    stop: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class If:
    """Statements that run if a condition holds."""

    condition: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Block:
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


Statement: TypeAlias = Array | Identity | Assign | Store | Accumulate | Loop | If | Block | Comment | Do | Return


@dataclass(frozen=True, slots=True)
class Function:
    """A function of a kernel; `inline` where its callers take over its body."""

    name: str
    arguments: tuple[str, ...]
    about: str
    body: tuple[Statement, ...]
    inline: bool = True


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


def expressions(statements: Iterable[Statement]) -> Iterator[Expression]:
    """Yield everything in the values of statements, inner blocks included; indices and conditions are not values."""
    for statement in statements:
        match statement:
            case Assign(_, value, False) | Store(_, _, value) | Accumulate(_, _, value):
                yield from value.walk()
            case Loop(_, _, _, body) | If(_, body) | Block(_, body):
                yield from expressions(body)
            case Do(call):
                yield from call.walk()
            case Return(values):
                for value in values:
                    yield from value.walk()


def called(statements: Iterable[Statement]) -> set[str]:
    """Return the names of the functions that are called."""
    return {e.function for e in expressions(statements) if isinstance(e, Call)}


def used(statements: Iterable[Statement]) -> set[str]:
    """Return the names of the variables and arrays that values are made of, and of the arrays that are written."""
    found = set()
    for e in expressions(statements):
        match e:
            case Name(text) | Load(text):
                found.add(text)
    return found | set(_written(statements))


def _written(statements: Iterable[Statement]) -> Iterator[str]:
    for statement in statements:
        match statement:
            case Store(array) | Accumulate(array):
                yield array
            case Loop(_, _, _, body) | If(_, body) | Block(_, body):
                yield from _written(body)


def operations(statements: Iterable[Statement]) -> int:
    """Return how many sums, differences, products and quotients the statements hold."""
    return sum(_cost(e) for e in expressions(statements)) + sum(_added(statements))


def _cost(e: Expression) -> int:
    match e:
        case Sum(parts) | Product(parts):
            return len(parts) - 1
        case Quotient() | Power():
            return 1
        case _:
            return 0


def _added(statements: Iterable[Statement]) -> Iterator[int]:
    for statement in statements:
        match statement:
            case Accumulate():
                yield 1
            case Loop(_, _, _, body) | If(_, body) | Block(_, body):
                yield from _added(body)
