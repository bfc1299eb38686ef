"""Numbers such as -4*sin(k*pi/n)**2 read straight into sums of cosines: a hundred times faster than by SymPy.

Only what is surely such a sum is read; everything else, wrong texts too, is left to `exact_text.exact_number`.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache

from .angle_sums import AngleSum

__all__ = ["angle_number"]

_CIRCULAR = re.compile(r"[0-9A-Za-z_+\-*/() \t]*\b(?:sin|cos)\([0-9A-Za-z_+\-*/() \t]*", re.ASCII)
LENGTH, DEPTH, TERMS, POWER, WHOLE, DENOMINATOR = 300, 24, 8, 4, 10**9, 10_000


class _Other(Exception):
    """The text is something else."""


def angle_number(text: str, values: Mapping[str, int]) -> AngleSum | None:
    """The number, or None where it is not a short sum of products of rationals, sines and cosines."""
    tree = _tree(text.strip())
    try:
        return None if tree is None else _value(tree, values, 0)
    except (_Other, ZeroDivisionError):
        return None


@lru_cache(maxsize=64)
def _tree(text: str) -> ast.expr | None:
    if len(text) > LENGTH or not _CIRCULAR.fullmatch(text):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _value(node: ast.expr, values: Mapping[str, int], depth: int) -> AngleSum:
    if depth > DEPTH:
        raise _Other
    match node:
        case ast.Constant(value=int() as value) if not isinstance(value, bool) and value < WHOLE:
            return AngleSum.rational(value)
        case ast.Name(id=name) if name in values:
            return AngleSum.rational(values[name])
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, values, depth + 1)
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int() as power)) if 0 < power <= POWER:
            base = found = _value(left, values, depth + 1)
            for _ in range(power - 1):
                found = _small(found * base)
            return found
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() as op, right=right):
            return _combined(op, _value(left, values, depth + 1), _value(right, values, depth + 1))
        case ast.Call(func=ast.Name(id="sin" | "cos" as name), args=[argument], keywords=[]):
            turn = _turn(argument, values, depth + 1) / 2
            turn = Fraction(1, 4) - turn if name == "sin" else turn
            if turn.denominator > DENOMINATOR:
                raise _Other
            return AngleSum.cosine(0, Fraction(1, 2), turn.numerator, turn.denominator)
    raise _Other


def _combined(op: ast.operator, a: AngleSum, b: AngleSum) -> AngleSum:
    if isinstance(op, ast.Add):
        return _small(a + b)
    if isinstance(op, ast.Sub):
        return _small(a + -b)
    if isinstance(op, ast.Mult):
        return _small(a * b)
    if b.terms:
        raise _Other
    return a * AngleSum.rational(1 / b.shift)


def _small(found: AngleSum) -> AngleSum:
    if len(found.terms) > TERMS:
        raise _Other
    return found


def _turn(node: ast.expr, values: Mapping[str, int], depth: int) -> Fraction:
    """The factor of pi in an angle."""
    match node:
        case ast.Name(id="pi"):
            return Fraction(1)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_turn(inner, values, depth + 1)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            first = _has_pi(left)
            if first == _has_pi(right):
                raise _Other
            angle, factor = (left, right) if first else (right, left)
            return _turn(angle, values, depth + 1) * _rational(factor, values, depth + 1)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _turn(left, values, depth + 1) / _rational(right, values, depth + 1)
    raise _Other


def _has_pi(node: ast.expr) -> bool:
    return any(isinstance(part, ast.Name) and part.id == "pi" for part in ast.walk(node))


def _rational(node: ast.expr, values: Mapping[str, int], depth: int) -> Fraction:
    found = _value(node, values, depth)
    if found.terms:
        raise _Other
    return found.shift
