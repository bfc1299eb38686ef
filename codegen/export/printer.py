"""Expressions as text of C99, of Python on NumPy arrays, and of Python that Numba compiles.

Constants are folded and printed as the shortest decimal that reads back as the nearest double; a factor 1/q is a division.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp

__all__ = ["NUMBA", "NUMPY", "C", "Dialect", "decimal", "write"]

_SUM, _TERM, _ATOM = range(3)
_SMOOTH = ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "floor")
_INVERSE = {
    "asin": "arcsin",
    "acos": "arccos",
    "atan": "arctan",
    "asinh": "arcsinh",
    "acosh": "arccosh",
    "atanh": "arctanh",
}


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a language calls functions (SymPy's name -> its own), powers, choices and logic."""

    calls: Mapping[str, str]
    power: str
    choice: str
    both: str
    either: str


def _calls(prefix: str, **special: str) -> dict[str, str]:
    return {**{name: prefix + name for name in (*_SMOOTH, *_INVERSE, "atan2", "sqrt")}, **special}


C = Dialect(
    _calls("", Abs="fabs", sign="sign", Max="fmax", Min="fmin", ceiling="ceil"),
    "pow({base}, {exponent})", "({condition} ? {yes} : {no})", " && ", " || ",
)  # fmt: skip
NUMBA = Dialect(
    _calls("math.", Abs="abs", sign="np.sign", Max="max", Min="min", ceiling="math.ceil"),
    "{base}**{exponent}", "({yes} if {condition} else {no})", " and ", " or ",
)  # fmt: skip
NUMPY = Dialect(
    _calls("np.", **{name: f"np.{own}" for name, own in _INVERSE.items()}, atan2="np.arctan2", Abs="np.abs",
           sign="np.sign", Max="np.maximum", Min="np.minimum", ceiling="np.ceil"),
    "{base}**{exponent}", "np.where({condition}, {yes}, {no})", " & ", " | ",
)  # fmt: skip


def write(expression: sp.Expr, dialect: Dialect) -> str:
    """Return the expression as text; ValueError for unknown functions, floats and constants that are not real."""
    return _Writer(dialect).text(sp.sympify(expression), _SUM)


def decimal(number: sp.Expr | Fraction) -> str:
    """Return the shortest decimal that reads back as the double nearest to an exact number; ValueError beyond its range."""
    try:
        if isinstance(number, Fraction):
            value = float(number)
        elif number.is_Rational:
            value = float(Fraction(int(number.p), int(number.q)))
        else:
            value = float(sp.N(number, 50))
    except (OverflowError, TypeError):
        value = float("inf")
    if not abs(value) < float("inf"):
        raise ValueError(f"the number {number} does not fit into a double; expected a real one up to 1.8e308; rescale")
    return repr(value)


class _Writer:
    def __init__(self, dialect: Dialect) -> None:
        self.dialect = dialect

    def text(self, e: sp.Expr, level: int) -> str:
        words, tight = self.piece(e)
        return words if tight >= level else f"({words})"

    def piece(self, e: sp.Expr) -> tuple[str, int]:
        if e.is_Symbol:
            return e.name, _ATOM
        if e.atoms(sp.Float):
            raise ValueError(f"floating-point number in {e}; expected a parameter or a Rational")
        if e.is_number:
            words = decimal(e)
            return words, _SUM if words.startswith("-") else _ATOM
        if e.is_Add:
            return self.sum(e), _SUM
        if e.is_Mul:
            return self.product(e)
        if isinstance(e, sp.exp):
            return self.call("exp", e.args), _ATOM
        if e.is_Pow:
            return self.power(e.base, e.exp)
        if isinstance(e, sp.Piecewise):
            return self.choice(e), _ATOM
        return self.call(type(e).__name__, e.args), _ATOM

    def call(self, name: str, arguments: Any) -> str:
        if name not in self.dialect.calls:
            known = ", ".join(sorted(self.dialect.calls))
            raise ValueError(f"no counterpart of the function {name}; known: {known}; rewrite the model with these")
        if name in ("Max", "Min") and len(arguments) > 2:
            rest = self.call(name, arguments[1:])
            return f"{self.dialect.calls[name]}({self.text(arguments[0], _SUM)}, {rest})"
        return f"{self.dialect.calls[name]}({', '.join(self.text(a, _SUM) for a in arguments)})"

    def sum(self, e: sp.Expr) -> str:
        terms = sorted(e.args, key=lambda term: (_minus(term), sp.default_sort_key(term)))
        words = self.text(terms[0], _SUM)
        for term in terms[1:]:
            words += f" - {self.text(-term, _TERM)}" if _minus(term) else f" + {self.text(term, _TERM)}"
        return words

    def product(self, e: sp.Expr) -> tuple[str, int]:
        if _minus(e):
            return f"-{self.text(-e, _TERM)}", _SUM
        factor = sp.Mul(*(a for a in e.args if a.is_number))
        rest = [a for a in e.args if not a.is_number]
        below = [1 / a for a in rest if a.is_Pow and a.exp.is_Rational and a.exp < 0]
        above = [self.text(a, _TERM) for a in rest if not (a.is_Pow and a.exp.is_Rational and a.exp < 0)]
        under = [self.text(a, _ATOM if len(below) == 1 else _TERM) for a in below]
        if factor.is_Rational and factor.p == 1 and factor.q > 1 and above:
            under.insert(0, decimal(sp.Integer(factor.q)))
        elif factor != 1:
            above.insert(0, decimal(factor))
        top = "*".join(above) or "1.0"
        if not under:
            return top, _TERM
        return f"{top}/{under[0]}" if len(under) == 1 else f"{top}/({'*'.join(under)})", _TERM

    def power(self, base: sp.Expr, exponent: sp.Expr) -> tuple[str, int]:
        if base == sp.E:
            return self.call("exp", (exponent,)), _ATOM
        if exponent.is_Rational and exponent < 0:
            return f"1.0/{self.text(base**-exponent, _ATOM)}", _TERM
        if exponent == sp.Rational(1, 2):
            return self.call("sqrt", (base,)), _ATOM
        if exponent.is_Integer and base.is_Symbol and exponent <= 4:
            return "*".join([base.name] * int(exponent)), _TERM
        c_call = self.dialect.power.startswith("pow(")
        words = str(exponent) if exponent.is_Integer and not c_call else self.text(exponent, _SUM if c_call else _ATOM)
        return self.dialect.power.format(base=self.text(base, _SUM if c_call else _ATOM), exponent=words), (
            _ATOM if c_call else _TERM
        )

    def choice(self, e: sp.Piecewise) -> str:
        value, condition = e.args[-1]
        if condition is not sp.true:
            raise ValueError(f"{e} has no value where no condition holds; end it with (value, True)")
        words = self.text(value, _SUM)
        for value, condition in reversed(e.args[:-1]):
            plain = sp.to_nnf(condition, simplify=False)  # negations are carried inwards
            parts = {"condition": self.relation(plain), "yes": self.text(value, _SUM), "no": words}
            words = self.dialect.choice.format(**parts)
        return words

    def relation(self, e: Any) -> str:
        if isinstance(e, (sp.And, sp.Or)):
            sign = self.dialect.both if isinstance(e, sp.And) else self.dialect.either
            return sign.join(f"({self.relation(a)})" for a in sorted(e.args, key=sp.default_sort_key))
        for kind, sign in ((sp.Lt, "<"), (sp.Le, "<="), (sp.Gt, ">"), (sp.Ge, ">=")):
            if isinstance(e, kind):
                return f"{self.text(e.lhs, _TERM)} {sign} {self.text(e.rhs, _TERM)}"
        raise ValueError(f"no counterpart of the condition {e}; expected <, <=, >, >=, And, Or, Not")


def _minus(e: sp.Expr) -> bool:
    return bool((e.is_Number or e.is_Mul) and e.could_extract_minus_sign())
