"""Numbers such as -4*sin(k*pi/n)**2 read straight into sums of cosines: a hundred times faster than by SymPy.

A letter such as k may stay open: the text is then read once for all its values.  Only what is surely such a sum is read;
everything else, wrong texts too, is left to `exact_text.exact_number`.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import lcm

from .cosine_sums import AngleSum, folded_sum

__all__ = ["Wave", "angle_number", "angle_wave"]

_CIRCULAR = re.compile(r"[0-9A-Za-z_+\-*/() \t]*\b(?:sin|cos)\([0-9A-Za-z_+\-*/() \t]*", re.ASCII)
LENGTH, DEPTH, TERMS, POWER, WHOLE, DENOMINATOR = 300, 24, 16, 4, 10**10, 10**10

Linear = tuple[Fraction, Fraction]
"""a + b k, k the open letter."""


class _Other(Exception):
    """The text is something else."""


@dataclass(frozen=True, slots=True)
class Wave:
    """shift + Σ 2 f cos(2π(a + b k)) over `terms`, (a, b): f, of an open whole number k."""

    shift: Fraction
    terms: Mapping[Linear, Fraction] = field(default_factory=dict)

    def __add__(self, other: Wave) -> Wave:
        counts = dict(self.terms)
        for turn, factor in other.terms.items():
            counts[turn] = counts.get(turn, Fraction(0)) + factor
        return Wave(self.shift + other.shift, {turn: factor for turn, factor in counts.items() if factor})

    def __neg__(self) -> Wave:
        return Wave(-self.shift, {turn: -factor for turn, factor in self.terms.items()})

    def __mul__(self, other: Wave) -> Wave:
        """2 cos x · 2 cos y = 2 cos(x + y) + 2 cos(x - y); a cosine of 0 goes into the shift."""
        found = Wave(self.shift * other.shift)
        for shift, terms in ((self.shift, other.terms), (other.shift, self.terms)):
            found += Wave(Fraction(0), {turn: shift * factor for turn, factor in terms.items() if shift})
        for ((a, b), f), ((c, d), g) in product(self.terms.items(), other.terms.items()):
            found += Wave(Fraction(0), {_even(a + c, b + d): f * g})
            found += Wave(2 * f * g) if (a, b) == (c, d) else Wave(Fraction(0), {_even(a - c, b - d): f * g})
        return found

    def at(self, low: int, high: int) -> list[AngleSum]:
        """The numbers for k = low … high."""
        unit = lcm(*(part.denominator for turn in self.terms for part in turn))
        steps = [(int(a * unit), int(b * unit), factor) for (a, b), factor in self.terms.items()]
        return [
            folded_sum(self.shift, [((a + b * k) % unit, factor) for a, b, factor in steps], unit)
            for k in range(low, high + 1)
        ]


def _even(a: Fraction, b: Fraction) -> Linear:
    """One form for the angles of equal cosines, but for those of constants: whole turns off, k with a positive factor."""
    return (-a % 1, -b) if b < 0 else (a % 1, b)


def angle_number(text: str, values: Mapping[str, int]) -> AngleSum | None:
    """The number, or None where it is not a short sum of products of rationals, sines and cosines."""
    found = angle_wave(text, values)
    return None if found is None else found.at(0, 0)[0]


def angle_wave(text: str, values: Mapping[str, int], letter: str = "") -> Wave | None:
    """The numbers for all values of a letter; None as `angle_number`, and where it stands outside sines and cosines."""
    tree = _tree(text.strip())
    try:
        return None if tree is None else _value(tree, values, letter, 0)
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


def _value(node: ast.expr, values: Mapping[str, int], letter: str, depth: int) -> Wave:
    if depth > DEPTH:
        raise _Other
    match node:
        case ast.Constant(value=int() as value) if not isinstance(value, bool) and value < WHOLE:
            return Wave(Fraction(value))
        case ast.Name(id=name) if name in values:
            return Wave(Fraction(values[name]))
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, values, letter, depth + 1)
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int() as power)) if 0 < power <= POWER:
            base = found = _value(left, values, letter, depth + 1)
            for _ in range(power - 1):
                found = _small(found * base)
            return found
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() as op, right=right):
            return _combined(op, *(_value(side, values, letter, depth + 1) for side in (left, right)))
        case ast.Call(func=ast.Name(id="sin" | "cos" as name), args=[argument], keywords=[]):
            a, b = (x / 2 for x in _turn(argument, values, letter, depth + 1))
            a, b = (Fraction(1, 4) - a, -b) if name == "sin" else (a, b)
            if max(a.denominator, b.denominator) > DENOMINATOR:
                raise _Other
            return Wave(Fraction(0), {_even(a, b): Fraction(1, 2)})
    raise _Other


def _combined(op: ast.operator, a: Wave, b: Wave) -> Wave:
    if isinstance(op, ast.Add):
        return _small(a + b)
    if isinstance(op, ast.Sub):
        return _small(a + -b)
    if isinstance(op, ast.Mult):
        return _small(a * b)
    if b.terms:
        raise _Other
    return a * Wave(1 / b.shift)


def _small(found: Wave) -> Wave:
    if len(found.terms) > TERMS:
        raise _Other
    return found


def _turn(node: ast.expr, values: Mapping[str, int], letter: str, depth: int) -> Linear:
    """The factor of pi in an angle."""
    match node:
        case ast.Name(id="pi"):
            return Fraction(1), Fraction(0)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            a, b = _turn(inner, values, letter, depth + 1)
            return -a, -b
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            first = _has_pi(left)
            if first == _has_pi(right):
                raise _Other
            angle, factor = (left, right) if first else (right, left)
            return _scaled(_turn(angle, values, letter, depth + 1), _linear(factor, values, letter, depth + 1))
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            a, b = _turn(left, values, letter, depth + 1)
            by = _rational(right, values, depth + 1)
            return a / by, b / by
    raise _Other


def _has_pi(node: ast.expr) -> bool:
    return any(isinstance(part, ast.Name) and part.id == "pi" for part in ast.walk(node))


def _scaled(x: Linear, y: Linear) -> Linear:
    """A product of which one factor has no open letter."""
    if x[1] and y[1]:
        raise _Other
    return x[0] * y[0], x[0] * y[1] + x[1] * y[0]


def _linear(node: ast.expr, values: Mapping[str, int], letter: str, depth: int) -> Linear:
    """A rational number, or one that hangs linearly on the open letter."""
    if depth > DEPTH:
        raise _Other
    if not any(isinstance(part, ast.Name) and part.id == letter for part in ast.walk(node)):
        return _rational(node, values, depth), Fraction(0)
    match node:
        case ast.Name():
            return Fraction(0), Fraction(1)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            a, b = _linear(inner, values, letter, depth + 1)
            return -a, -b
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            a, b = _linear(left, values, letter, depth + 1)
            by = _rational(right, values, depth + 1)
            return a / by, b / by
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() as op, right=right):
            x, y = (_linear(side, values, letter, depth + 1) for side in (left, right))
            if isinstance(op, ast.Mult):
                return _scaled(x, y)
            return (x[0] + y[0], x[1] + y[1]) if isinstance(op, ast.Add) else (x[0] - y[0], x[1] - y[1])
    raise _Other


def _rational(node: ast.expr, values: Mapping[str, int], depth: int) -> Fraction:
    found = _value(node, values, "", depth)
    if found.terms:
        raise _Other
    return found.shift
