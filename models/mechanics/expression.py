"""Print and read expressions of models: the text in which scene files and results store a model.

`written` prints an expression and refuses functions that a model may not contain.  `read` parses the text without
executing it and returns the same expression.  `exact` converts an expression to a form that survives printing and
reading.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from keyword import iskeyword

import sympy as sp
from sympy.codegen.cfunctions import expm1, log1p
from sympy.logic.boolalg import Boolean

from ..inputs.checks import short_repr, suggestion
from ..inputs.expression_text import COMPOSED, FUNCTIONS, Expressions
from ..inputs.reader import NoMeaning, parse, unpaired
from ..inputs.unsupported import COMPLEX, unsupported
from .components import TIME
from .oscillator import FRICTION

LENGTH = 20_000
"""Most characters of a text (a choice)."""

_FORMS = 6
"""Most rounds of printing and reading until an expression no longer changes (a choice; nearly all need one)."""

DIGITS = 10**1000
"""Largest numerator and denominator of a number (a choice)."""

FRICTION_NAME = "friction"
"""Name in texts of the function that returns the friction coefficient at a sliding velocity."""

RESERVED = frozenset({"pi", TIME.name, FRICTION_NAME})
"""Names with a fixed meaning, which states and parameters cannot have."""

_FUNCTIONS = dict(sorted({**FUNCTIONS, **COMPOSED, FRICTION_NAME: FRICTION}.items()))
_NAMES = {function: name for name, function in FUNCTIONS.items()}
_REWRITTEN: Mapping[type, Callable[..., sp.Basic]] = {
    sp.cot: lambda x: sp.cos(x) / sp.sin(x),
    sp.sec: lambda x: 1 / sp.cos(x),
    sp.csc: lambda x: 1 / sp.sin(x),
    sp.coth: lambda x: 1 / sp.tanh(x),
    sp.sech: lambda x: 1 / sp.cosh(x),
    sp.csch: lambda x: 1 / sp.sinh(x),
    sp.Mod: COMPOSED["mod"],
    expm1: COMPOSED["expm1"],
    log1p: COMPOSED["log1p"],
    sp.Ne: lambda a, b: sp.Or(a < b, a > b),
    sp.Eq: lambda a, b: sp.And(a <= b, a >= b),
}
"""Replacements for functions and relations that SymPy produces and a model may not have: cot(x) from tan(pi/2 - x)."""
_SIGNS: Mapping[type, str] = {
    sp.StrictLessThan: "<",
    sp.LessThan: "<=",
    sp.StrictGreaterThan: ">",
    sp.GreaterThan: ">=",
}
_WORDS = frozenset({"if", "else", "and", "or"})
"""Keywords of Python that a text may have."""
_RELATIONS = {**{sign: relation for relation, sign in _SIGNS.items()}, "==": sp.Eq, "!=": sp.Ne}


def exact(what: str, value: object, names: Mapping[str, sp.Symbol]) -> sp.Expr:
    """Return an expression with real symbols, rational numbers and allowed functions that survives printing."""
    if isinstance(value, str):
        return _settled(what, read(what, value, names), names)
    if isinstance(value, bool) or not isinstance(value, int | float | Fraction | sp.Expr):
        kind = type(value).__name__
        raise TypeError(f"{what}: found {short_repr(value)} ({kind}); expected an expression")
    # Rewrite functions, declare symbols as real, make numbers exact; then iterate printing and reading.
    e = _rewritten(sp.sympify(value).replace(sp.Heaviside, _unit_step))
    undeclared = sorted({s.name for s in e.free_symbols} - {*names})
    if undeclared:
        raise ValueError(f"{what}: {_undeclared(undeclared[0], names)}")
    rationals = {number: _rational(what, number) for number in e.atoms(sp.Float)}
    symbols = {s: names[s.name] for s in e.free_symbols}
    try:
        text = written(e.xreplace({**rationals, **symbols}))
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None
    return _settled(what, read(what, text, names), names)


def _settled(what: str, e: sp.Expr, names: Mapping[str, sp.Symbol]) -> sp.Expr:
    """Return the form of an expression that survives printing and reading; ValueError if there is none."""
    # SymPy may reorder or evaluate an expression while reading, so iterate to a fixed point.
    for _ in range(_FORMS):
        try:
            again = read(what, written(e), names)
        except ValueError as error:
            reason = str(error).removeprefix(f"{what}: ")
            raise ValueError(
                f"{what}: {short_repr(e)} cannot be written as text: {reason}; write it otherwise"
            ) from None
        if again == e:
            return e
        e = again
    raise ValueError(f"{what}: found {short_repr(e)}, which SymPy changes each time it reads it; expected another form")


def _rewritten(e: sp.Expr) -> sp.Expr:
    """Write an expression with functions and relations that a model may have."""
    for function, replacement in _REWRITTEN.items():
        e = e.replace(function, replacement) if e.has(function) else e
    return e.replace(lambda part: part.is_Mul and part.has(sp.Abs), _with_limit)


def _with_limit(product: sp.Mul) -> sp.Expr:
    """Write x/sqrt(|x|) as sign(x) sqrt(|x|), and so every product x**k |x|**a with a < 0 < k + a: 0/0 at x = 0.

    In x |x|**(p - 1) with a parameter p, the numbers in the exponents decide: sign(x) |x|**p.
    """
    for size in product.args:
        # A factor |x|**degree with degree < 0, and a factor (c x)**k that outweighs it.
        base, degree = size.as_base_exp()
        lowest = degree.as_coeff_Add()[0]
        if not (isinstance(base, sp.Abs) and lowest.is_Rational and lowest < 0):
            continue
        for factor in product.args:
            x, k = factor.as_base_exp()
            ratio = sp.cancel(x / base.args[0]) if k.is_Integer and k + lowest >= 0 and k + degree != 0 else sp.nan
            if ratio.is_Rational:
                others = [each for each in product.args if each not in (size, factor)]
                sign = sp.sign(base.args[0]) if k % 2 else sp.S.One
                return sp.Mul(*others, ratio**k, sign, base ** (k + degree))
    return product


def _unit_step(x: sp.Expr, at_zero: sp.Expr = sp.S.Half) -> sp.Expr:
    """Write Heaviside's function by sign or Piecewise if its value at zero is 0, 1/2 or 1; else keep it."""
    if at_zero == sp.S.Half:
        return (1 + sp.sign(x)) / 2
    if at_zero in (0, 1):
        return sp.Piecewise((sp.S.One, x >= 0 if at_zero else x > 0), (sp.S.Zero, True))
    return sp.Heaviside(x, at_zero)


def _undeclared(name: str, names: Mapping[str, sp.Symbol]) -> str:
    return f"undeclared symbol {short_repr(name)}; declared: {', '.join(names)}{suggestion(name, names)}"


def _rational(what: str, number: sp.Float) -> sp.Rational:
    """Return a decimal as a fraction: the shortest decimal of a double, all digits of a longer number."""
    if not number.is_finite:
        raise ValueError(f"{what}: found {number}; expected finite real numbers")
    return sp.Rational(repr(float(number)) if number._prec <= 53 else str(number))


# -- from expressions to text ------------------------------------------------------------------------------------

_CHOICE, _OR, _AND, _NOT, _COMPARE, _SUM, _PRODUCT, _POWER, _ATOM = range(9)
"""Precedence of operators, loosest first."""

_LONGEST = 8
"""Most terms or factors in a row (a choice); parentheses halve longer rows, to limit the depth of the parser."""


def written(e: sp.Basic) -> str:
    """Return an expression as text from which `read` returns the same expression."""
    return _inside(e, _CHOICE)


def _inside(e: sp.Basic, level: int) -> str:
    """Return the text of an expression, in parentheses if its operator is looser than `level`."""
    text, precedence = _text(e)
    return text if precedence >= level else f"({text})"


def _text(e: sp.Basic) -> tuple[str, int]:
    """Return the text of an expression and its precedence."""
    if isinstance(e, sp.Symbol):
        return e.name, _ATOM
    if isinstance(e, sp.Number) or e in (sp.pi, sp.E):
        return _number(e)
    if isinstance(e, sp.Add):
        return _row([_signed(term) for term in e.as_ordered_terms()]), _SUM
    if isinstance(e, sp.Mul):
        return _product(e)
    if isinstance(e, sp.Pow):
        return _power(e)
    if isinstance(e, sp.Piecewise):
        return _choice(e), _CHOICE
    if type(e) in _SIGNS:
        return f"{_inside(e.args[0], _SUM)} {_SIGNS[type(e)]} {_inside(e.args[1], _SUM)}", _COMPARE
    if isinstance(e, sp.Not):
        return f"not {_inside(e.args[0], _NOT)}", _NOT
    if isinstance(e, sp.ITE):  # if-then-else between conditions, from a comparison with a Piecewise
        condition, yes, no = e.args
        return _text(sp.Or(sp.And(condition, yes), sp.And(sp.Not(condition), no)))
    if isinstance(e, sp.And | sp.Or):
        word, level = ("and", _AND) if isinstance(e, sp.And) else ("or", _OR)
        parts = (_inside(part, level + 1) for part in sorted(e.args, key=sp.default_sort_key))
        return f" {word} ".join(parts), level
    return _call(e)


def _number(e: sp.Expr) -> tuple[str, int]:
    if e == sp.pi:
        return "pi", _ATOM
    if e == sp.E:
        return "exp(1)", _ATOM
    if not isinstance(e, sp.Rational):
        raise ValueError(f"found {e}; expected rational numbers, decimals and pi")
    if e < 0:
        return f"-{_inside(-e, _PRODUCT)}", _SUM
    return (str(e.p), _ATOM) if e.q == 1 else (f"{e.p}/{e.q}", _PRODUCT)


def _signed(term: sp.Expr) -> tuple[str, str]:
    """Return the sign of a term, and the text of the term without the sign."""
    if term.as_coeff_Mul()[0].is_negative:
        return "-", _inside(_negated(term), _PRODUCT)
    return "+", _inside(term, _PRODUCT)


def _negated(e: sp.Expr) -> sp.Expr:
    """Return the negative of a product with a negative number in front, its other factors unchanged."""
    number, others = e.as_coeff_Mul()
    return -number if others == 1 else sp.Mul(-number, *sp.Mul.make_args(others))


def _row(terms: Sequence[tuple[str, str]]) -> str:
    """Return the text of a sum of signed terms."""
    if len(terms) > _LONGEST:
        half = len(terms) // 2
        return f"({_row(terms[:half])}) + ({_row(terms[half:])})"
    (sign, first), *others = terms
    if sign == "-":  # -(a + b)*c would be read as (-a - b)*c
        first = f"-({first})" if first.startswith("(") else f"-{first}"
    return first + "".join(f" {sign} {text}" for sign, text in others)


def _product(e: sp.Mul) -> tuple[str, int]:
    """Return the text of a product, factors and divisions from left to right."""
    number, others = e.as_coeff_Mul()
    if not isinstance(number, sp.Rational):
        raise ValueError(f"found {number}; expected rational numbers, decimals and pi")
    if number < 0:
        return _row([("-", _inside(_negated(e), _PRODUCT))]), _SUM
    factors = others.as_ordered_factors()
    below = [factor for factor in factors if isinstance(factor, sp.Pow) and factor.exp.is_Rational and factor.exp < 0]
    above = [_inside(factor, _POWER) for factor in factors if factor not in below]
    divisors = [_inside(1 / factor, _POWER) for factor in below]
    last = any(isinstance(factor, sp.Add) for factor in factors)  # print the number last: in front, SymPy expands it
    if number.p != 1 and not last:
        above.insert(0, str(number.p))
    text = "/".join([_factors(above) if above else "1", *divisors])
    if number.p != 1 and last:
        text += f"*{number.p}"
    return (text if number.q == 1 else f"{text}/{number.q}"), _PRODUCT


def _factors(factors: Sequence[str]) -> str:
    if len(factors) > _LONGEST:
        half = len(factors) // 2
        return f"({_factors(factors[:half])})*({_factors(factors[half:])})"
    return "*".join(factors)


def _power(e: sp.Pow) -> tuple[str, int]:
    base, exponent = e.base, e.exp
    if exponent.is_Rational and exponent < 0:
        return f"1/{_inside(1 / e, _POWER)}", _PRODUCT
    if exponent == sp.Rational(1, 2):
        return f"sqrt({written(base)})", _ATOM
    return f"{_inside(base, _ATOM)}**{_inside(exponent, _ATOM)}", _POWER


def _choice(e: sp.Piecewise) -> str:
    *others, (last, condition) = e.args
    if condition is not sp.true:
        raise ValueError(f"{e} has no value where no condition holds; end it with (value, True)")
    parts = [f"{_inside(value, _OR)} if {_inside(condition, _OR)} else " for value, condition in others]
    return "".join(parts) + _inside(last, _OR)


def _call(e: sp.Basic) -> tuple[str, int]:
    name = FRICTION_NAME if e.func == FRICTION else _NAMES.get(e.func)
    if name is None:
        kind = "the function" if isinstance(e, sp.Function) else "the piece"
        raise ValueError(
            f"found {kind} {short_repr(e)}; known: {', '.join((*FUNCTIONS, *COMPOSED))}, friction, powers, Piecewise with <, <=, >, >=, Eq, Ne"
        )
    arguments = sorted(e.args, key=sp.default_sort_key) if e.func in (sp.Max, sp.Min) else e.args
    return f"{name}({', '.join(map(written, arguments))})", _ATOM


# -- from text to expressions ------------------------------------------------------------------------------------


def read(what: str, text: str, names: Mapping[str, sp.Symbol]) -> sp.Expr:
    """Parse a text into an expression without executing it."""
    if len(text) > LENGTH:
        raise ValueError(f"{what}: found {len(text)} characters; expected at most {LENGTH}")
    # Python's parser reads the text; reserved words have a separate message.
    expression = parse(text)
    if expression is None:
        word = next((w for w in re.findall(r"\w+", text) if iskeyword(w) and w not in _WORDS), None)
        if word is not None:
            raise ValueError(
                f"{what}: {word!r} is a word of Python, which no text can use; call a parameter {word}_ or {word[:3]}"
            )
        raise ValueError(
            f"{what}: unreadable expression {short_repr(text)}{unpaired(text)}; expected such as '-k*x + u*cos(omega*t)'"
        )
    e = _rewritten(_OfModels(what, names).read(expression))
    if e.has(sp.I):
        raise ValueError(f"{what}: found the complex {short_repr(e)}; expected a real value; {COMPLEX}")
    return e


@dataclass(frozen=True, slots=True)
class _OfModels(Expressions):
    """Read expressions in declared symbols, with the friction function and conditions."""

    names: Mapping[str, sp.Symbol]
    whole = DIGITS
    numbers = "finite real numbers (of a complex state, real and imaginary part are two states)"
    functions = _FUNCTIONS

    def pieces(self) -> str:
        return f"pi, + - * / **, {' '.join((*FUNCTIONS, *COMPOSED))} friction, a if x > 0 else b, and {', '.join(self.names)}"

    def function(self, name: str) -> Callable[..., sp.Expr] | None:
        if reason := unsupported(name):
            raise NoMeaning(reason)
        return self.functions.get(name)

    def name(self, name: str) -> sp.Basic:
        if name in self.names:
            return self.names[name]
        if name == "pi":
            return sp.pi
        raise NoMeaning(_undeclared(name, self.names))

    def compare(self, sign: str, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        return _RELATIONS[sign](self.value(a), self.value(b))

    def junction(self, word: str, conditions: Sequence[sp.Basic]) -> sp.Basic:
        return (sp.And if word == "and" else sp.Or)(*map(self.condition, conditions))

    def contrary(self, condition: sp.Basic) -> sp.Basic:
        return sp.Not(self.condition(condition))

    def choice(self, condition: sp.Basic, value: sp.Basic, otherwise: sp.Basic) -> sp.Basic:
        last = otherwise.args if isinstance(otherwise, sp.Piecewise) else ((self.value(otherwise), sp.true),)
        return sp.Piecewise((self.value(value), self.condition(condition)), *last)

    def fits(self, number: sp.Expr) -> bool:
        return Expressions.fits(self, number) and bool(number.is_Rational or sp.N(number).is_real)

    def condition(self, e: sp.Basic) -> Boolean:
        """Return `e` if it is a condition; raise ValueError for a value."""
        if not isinstance(e, Boolean) or isinstance(e, sp.Expr):
            raise NoMeaning(f"found {short_repr(e)}, which is no condition; expected one such as x > 0")
        return e
