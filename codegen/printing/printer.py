"""SymPy expressions as the text of Python code on lanes.

The text is meant to be read: minimal parentheses, quotients as quotients, small integer powers as products.
Nothing is guessed: a function without a rule, a floating-point number or a complex constant is an error.
"""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.logic.boolalg import Boolean

__all__ = ["FUNCTIONS", "UnprintableError", "show"]

FUNCTIONS = {
    sp.exp: "exp", sp.log: "log", sp.sin: "sin", sp.cos: "cos", sp.atan: "atan", sp.tanh: "tanh",
    sp.Abs: "absolute", sp.sign: "sign", sp.Max: "maximum", sp.Min: "minimum", sp.floor: "floor",
}  # fmt: skip
"""What a kernel can call, by SymPy class."""

SUM, TERM, FACTOR, ATOM = range(4)
"""How tightly a piece of text holds together."""


class UnprintableError(ValueError):
    """An expression that generated code cannot express; the message names the part and the remedy."""


def show(expression: sp.Expr) -> str:
    """Return the expression as Python text.

    Raises UnprintableError for an unknown function, a floating-point number or a non-real constant.
    """
    return _text(sp.sympify(expression), SUM)


def _text(e: sp.Expr, level: int) -> str:
    text, tight = _piece(e)
    return text if tight >= level else f"({text})"


def _piece(e: sp.Expr) -> tuple[str, int]:
    if e.is_Symbol:
        return e.name, ATOM
    if e.is_Float:
        raise UnprintableError(f"floating-point number {e} in an expression; make it a parameter or a Rational")
    if e.is_number and _is_constant(e):
        return _number(e)
    if e.is_Add:
        return _sum(e), SUM
    if e.is_Mul:
        return _product(e)
    if e.is_Pow:
        return _power(e)
    if isinstance(e, sp.Piecewise):
        return _piecewise(e), ATOM
    if isinstance(e, Boolean):
        return _condition(e), SUM
    for kind, name in FUNCTIONS.items():
        if isinstance(e, kind):
            return _call(name, e.args), ATOM
    known = ", ".join(sorted(FUNCTIONS.values()))
    raise UnprintableError(f"no printing rule for {type(e).__name__} in {e}; known: {known}, sqrt, powers, Piecewise")


def _number(e: sp.Expr) -> tuple[str, int]:
    value = float(e if e.is_Rational else e.evalf(30))
    if not abs(value) <= 1.7976931348623157e308:
        raise UnprintableError(f"the number {e} does not fit into a double; rescale the equations")
    return repr(value), ATOM if value >= 0 else SUM


def _call(name: str, arguments: Any) -> str:
    if len(arguments) > 2:  # Max and Min of several: nested pairs
        return f"{name}({_text(arguments[0], SUM)}, {_call(name, arguments[1:])})"
    return f"{name}({', '.join(_text(a, SUM) for a in arguments)})"


def _sum(e: sp.Expr) -> str:
    terms = sorted(e.args, key=lambda term: (_negative(term), sp.default_sort_key(term)))
    text = _text(terms[0], SUM)
    for term in terms[1:]:
        text += f" - {_text(-term, TERM)}" if _negative(term) else f" + {_text(term, TERM)}"
    return text


def _negative(e: sp.Expr) -> bool:
    return bool(e.could_extract_minus_sign()) and (e.is_Number or e.is_Mul)


def _product(e: sp.Expr) -> tuple[str, int]:
    if _negative(e):
        return f"-{_text(-e, TERM)}", SUM
    numbers: list[sp.Expr] = []
    factors: list[sp.Expr] = []
    for factor in e.args:
        (numbers if factor.is_number and _is_constant(factor) else factors).append(factor)
    coefficient = sp.Mul(*numbers)
    above = [] if coefficient == 1 else [_number(coefficient)[0]]
    above += [_text(f, FACTOR) for f in factors if not _is_divisor(f)]
    below = [_text(1 / f, FACTOR) for f in factors if _is_divisor(f)]
    top = "*".join(above) or "1.0"
    if not below:
        return top, TERM
    bottom = "*".join(below)  # each of them holds together as one factor
    return f"{top}/{bottom}" if len(below) == 1 else f"{top}/({bottom})", TERM


def _is_constant(e: sp.Expr) -> bool:
    """A real number that can be folded into one double: rationals, pi, e, and whatever is made of them."""
    return not e.atoms(sp.Float) and e.is_real is True


def _is_divisor(e: sp.Expr) -> bool:
    return bool(e.is_Pow and e.exp.is_number and e.exp.is_negative and e.base != sp.E)


def _power(e: sp.Expr) -> tuple[str, int]:
    base, exponent = e.base, e.exp
    if base == sp.E:
        return f"exp({_text(exponent, SUM)})", ATOM
    if exponent.is_number and exponent.is_negative:
        return f"1.0/{_text(1 / e, ATOM)}", TERM
    if exponent == sp.Rational(1, 2):
        return f"sqrt({_text(base, SUM)})", ATOM
    if exponent.is_Integer and exponent <= 16:
        return "*".join([_text(base, ATOM)] * int(exponent)), TERM
    if exponent.is_Rational and exponent.q == 2:
        whole = _text(base ** (exponent - sp.Rational(1, 2)), FACTOR)
        return f"{whole}*sqrt({_text(base, SUM)})", TERM
    raise UnprintableError(f"no printing rule for the power {e}; use integer or half-integer powers, or exp and log")


def _piecewise(e: sp.Piecewise) -> str:
    value, condition = e.args[-1]
    if condition is not sp.true:
        raise UnprintableError(f"{e} has no value where no condition holds; end it with (value, True)")
    text = _text(value, SUM)
    for value, condition in reversed(e.args[:-1]):
        text = f"select({_condition(condition)}, {_text(value, SUM)}, {text})"
    return text


def _condition(e: Any) -> str:
    """A condition, whose negations are carried inwards; a symbol names one that was computed before."""
    e = sp.to_nnf(e, simplify=False)
    if e.is_Symbol:
        return str(e.name)
    if isinstance(e, sp.Not) and e.args[0].is_Symbol:
        return f"~{e.args[0].name}"
    if isinstance(e, sp.And | sp.Or):
        sign = " & " if isinstance(e, sp.And) else " | "
        return sign.join(_part(a) for a in sorted(e.args, key=sp.default_sort_key))
    signs = {sp.StrictLessThan: "<", sp.LessThan: "<=", sp.StrictGreaterThan: ">", sp.GreaterThan: ">="}
    for kind, sign in signs.items():
        if isinstance(e, kind):
            return f"{_text(e.lhs, TERM)} {sign} {_text(e.rhs, TERM)}"
    raise UnprintableError(f"no printing rule for the condition {e}; use <, <=, >, >=, And, Or, Not")


def _part(e: Any) -> str:
    """A part of a condition, in parentheses unless it is a name."""
    text = _condition(e)
    return text if text.lstrip("~").isidentifier() else f"({text})"
