"""Exact numbers written as text, read by a whitelist over `ast`: nothing in the text is run.

Accepted: whole numbers, the letters that are given values, ``pi`` and ``I``, ``+ - * / **``, parentheses, ``sqrt`` and
``sin cos exp`` of rational multiples of pi (of I*pi for exp).  Decimals are refused: they are no exact numbers.
"""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Mapping

import sympy as sp

from .equality import check_size, equal

__all__ = ["GRAMMAR", "exact_number", "whole_number"]

LENGTH, DEPTH, DIGITS, BITS = 300, 24, 30, 20_000
GRAMMAR = "whole numbers, + - * / **, parentheses, sqrt, I, and sin cos exp of rational multiples of pi"
_ALLOWED = re.compile(r"[0-9A-Za-z_.+\-*/() \t]*")
_DECIMAL = re.compile(r"(?<![A-Za-z_])(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE][+-]?[0-9]))(?:[eE][+-]?[0-9]+)?")


def exact_number(text: str, values: Mapping[str, int] | None = None) -> sp.Expr:
    """Return the number as a SymPy expression without floats; `values` are whole numbers for letters such as n.

    Raises ValueError on anything outside GRAMMAR, decimals, a division by zero, more than LENGTH characters, DEPTH nested
    operations or DIGITS digits, and on rationals beyond BITS bits.
    """
    stripped = text.strip()
    if len(stripped) > LENGTH:
        raise ValueError(f"number written as {len(stripped)} characters; expected at most {LENGTH}; shorten it")
    stray = stripped[_match_length(stripped) :]
    if stray:
        raise ValueError(f"character {stray[0]!r} in the number {stripped!r}; expected {GRAMMAR}; correct it")
    decimal = _DECIMAL.search(stripped)
    if decimal:
        raise ValueError(
            f"decimal {decimal[0]!r} in the number {stripped!r}; expected an exact number such as 1/2 or -2-sqrt(2); "
            "write ~ before a decimal to have it compared to its own digits, e.g. ~-3.414"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(stripped, mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"unreadable number {stripped!r}; expected {GRAMMAR}, e.g. -2-sqrt(2)") from None
    number = _value(tree.body, stripped, values or {}, 0)
    check_size(number)
    return number


def whole_number(text: str, values: Mapping[str, int] | None = None) -> int:
    """Return a whole number such as "n-2"; ValueError as `exact_number`, and where the value is not whole."""
    number = exact_number(text, values)
    if not number.is_Integer:
        raise ValueError(f"{text.strip()!r} is {number}; expected a whole number")
    return int(number)


def _match_length(text: str) -> int:
    found = _ALLOWED.match(text)
    return found.end() if found else 0


def _value(node: ast.AST, text: str, values: Mapping[str, int], depth: int) -> sp.Expr:
    if depth > DEPTH:
        raise ValueError(f"number {text!r} nests more than {DEPTH} operations; write it shorter")
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() as value):
            if value >= 10**DIGITS:
                raise ValueError(f"number {text!r} has a part of more than {DIGITS} digits; expected fewer")
            return sp.Integer(value)
        case ast.Name(id=name) if name in values:
            return sp.Integer(values[name])
        case ast.Name(id="I"):
            return sp.I
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            inner = _value(operand, text, values, depth + 1)
            return -inner if isinstance(sign, ast.USub) else inner
        case ast.BinOp(left=left, op=op, right=right):
            pair = (_value(left, text, values, depth + 1), _value(right, text, values, depth + 1))
            return _combined(op, *pair, text)
        case ast.Call(func=ast.Name(id="sqrt"), args=[argument], keywords=[]):
            return sp.sqrt(_value(argument, text, values, depth + 1))
        case ast.Call(func=ast.Name(id="sin" | "cos" | "exp" as name), args=[argument], keywords=[]):
            return _circular(name, argument, text, values, depth)
    known = ", ".join(values)
    letters = f" and the letters {known}" if values else ""
    hint = "; pi is read inside sin, cos and exp only" if isinstance(node, ast.Name) and node.id == "pi" else ""
    raise ValueError(f"{ast.unparse(node)!r} in the number {text!r}; expected {GRAMMAR}{letters}{hint}")


def _combined(op: ast.operator, a: sp.Expr, b: sp.Expr, text: str) -> sp.Expr:
    if isinstance(op, ast.Add):
        result = a + b
    elif isinstance(op, ast.Sub):
        result = a - b
    elif isinstance(op, ast.Mult):
        result = a * b
    elif isinstance(op, ast.Div):
        result = a / _divisor(b, text)
    elif isinstance(op, ast.Pow):
        result = _power(a, b, text)
    else:
        raise ValueError(f"unknown operation in the number {text!r}; expected {GRAMMAR}")
    if result.is_Rational and max(int(result.p).bit_length(), int(result.q).bit_length()) > BITS:
        raise ValueError(f"number {text!r} grows beyond {BITS} bits; expected a smaller one")
    return result


def _divisor(b: sp.Expr, text: str) -> sp.Expr:
    check_size(b)
    if equal(b, sp.S.Zero):
        raise ValueError(f"number {text!r} divides by zero; correct it")
    return b


def _power(base: sp.Expr, exponent: sp.Expr, text: str) -> sp.Expr:
    if not exponent.is_Rational or abs(exponent.p) > 64 or exponent.q > 12:
        raise ValueError(f"exponent {exponent} in the number {text!r}; expected p/q with |p| <= 64 and q <= 12")
    if exponent < 0:
        _divisor(base, text)
    if base.is_Rational and abs(exponent.p) * math.log2(max(abs(base.p), base.q, 2)) > BITS:
        raise ValueError(f"number {text!r} grows beyond {BITS} bits; expected a smaller one")
    return base**exponent


def _circular(name: str, argument: ast.AST, text: str, values: Mapping[str, int], depth: int) -> sp.Expr:
    """sin, cos or exp: the argument is read with pi as a letter, and its factor must be rational."""
    angle = sp.Dummy("pi", real=True)
    inner = _angle(argument, text, values, depth + 1, angle)
    turn = inner.coeff(angle, 1) / (sp.I if name == "exp" else 1)
    if sp.expand(inner - turn * angle * (sp.I if name == "exp" else 1)) != 0 or not turn.is_Rational:
        unit = "I*pi" if name == "exp" else "pi"
        raise ValueError(f"{name}({ast.unparse(argument)}) in the number {text!r}; expected a rational times {unit}")
    if turn.q > 10_000:
        raise ValueError(f"{name}({ast.unparse(argument)}) in the number {text!r}; expected a denominator up to 10000")
    turn -= 2 * sp.floor(turn / 2)
    if name == "exp":
        return sp.exp(turn * sp.pi * sp.I)
    short = turn.q in (1, 2, 3, 4, 6)  # SymPy writes others as nested radicals, which generate far larger fields
    return (sp.sin if name == "sin" else sp.cos)(turn * sp.pi, evaluate=short)


def _angle(node: ast.AST, text: str, values: Mapping[str, int], depth: int, angle: sp.Symbol) -> sp.Expr:
    """An argument as a multiple of the letter that stands for pi."""
    if depth > DEPTH:
        raise ValueError(f"number {text!r} nests more than {DEPTH} operations; write it shorter")
    match node:
        case ast.Name(id="pi"):
            return angle
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_angle(operand, text, values, depth + 1, angle)
        case ast.BinOp(left=left, op=ast.Mult() | ast.Div() | ast.Add() | ast.Sub() as op, right=right):
            a, b = (_angle(side, text, values, depth + 1, angle) for side in (left, right))
            if isinstance(op, ast.Div) and b.has(angle):
                raise ValueError(f"number {text!r} divides by pi; expected a rational times pi")
            return sp.expand(_combined(op, a, b, text))
    return _value(node, text, values, depth)
