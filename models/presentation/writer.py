"""Write expressions in the order of textbooks, as LaTeX or as plain Unicode text.

SymPy's printers sort sums and products alphabetically.  Here sums keep their order, as in x_2 - x_1;
in products numbers precede parameters, parameters precede variables, and functions are last.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import sympy as sp
from sympy.printing.pretty.pretty_symbology import greek_unicode

# Greek letters written in their variant form: (LaTeX, Unicode).
VARIANTS = {"theta": ("\\vartheta", "ϑ"), "epsilon": ("\\varepsilon", "ε")}
# Name of a function in SymPy -> name in LaTeX, if they differ.
NAMES = {"atan": "arctan", "asin": "arcsin", "acos": "arccos", "sign": "sgn"}

LATEX_FUNCTIONS = {
    "arccos",
    "arcsin",
    "arctan",
    "cos",
    "cosh",
    "exp",
    "log",
    "max",
    "min",
    "sin",
    "sinh",
    "tan",
    "tanh",
}


class Latex:
    """The style LaTeX, without \\left and \\right."""

    bars = True  # fractions have a bar: sums in them need no parentheses
    sums = "\\sum_j ", "\\sum_{j,k} "  # over the sources of links of two ends, of three
    dots = "\\dots"

    def words(self, text: str) -> str:
        return rf"\text{{{text}}}"

    def letter(self, name: str, index: str = "", primes: int = 0) -> str:
        """Write a symbol: a name, a subscript after its first '_', an index and primes."""
        base, *subscripts = filter(None, re.sub(r"(?<=[A-Za-z])(?=\d+(_|$))", "_", name).split("_"))
        below = ",".join([*map(self._word, subscripts), *filter(None, [index])])
        head = self._word(base)
        return head + (f"_{below}" if len(below) == 1 else f"_{{{below}}}" if below else "") + "'" * primes

    def _word(self, name: str) -> str:
        """Write a Greek letter as its symbol, a letter or number unchanged, a word upright."""
        if name in VARIANTS:
            return VARIANTS[name][0]
        if name in greek_unicode:
            return str(sp.latex(sp.Symbol(name)))
        return rf"\mathrm{{{name}}}" if len(name) > 1 and not name.isdigit() else name

    def product(self, factors: Sequence[str]) -> str:
        """Write factors side by side."""
        text = ""
        for factor in factors:
            touching = re.search(r"\\[A-Za-z]+$", text) and factor[0].isalpha()
            digits = text[-1:].isdigit() and factor[0].isdigit() and r"\cdot "
            text += (" " if touching else digits or "") + factor
        return text

    def fraction(self, top: str, bottom: str, single: bool) -> str:
        """Write a fraction; `single` if the bottom is one factor."""
        return rf"\frac{{{top}}}{{{bottom}}}"

    def beside(self, fraction: str) -> str:
        """Write a fraction that other factors follow."""
        return fraction

    def power(self, base: str, exponent: str) -> str:
        return f"{base}^{exponent}" if len(exponent) == 1 else f"{base}^{{{exponent}}}"

    def root(self, inside: str) -> str:
        return rf"\sqrt{{{inside}}}"

    def function(self, name: str) -> str:
        name = NAMES.get(name, name.lower() if name in ("Max", "Min") else name)
        if len(name) == 1:
            return name
        return f"\\{name}" if name in LATEX_FUNCTIONS else rf"\operatorname{{{name}}}"

    def other(self, e: sp.Expr) -> str:
        """Write an expression that has no rule here with SymPy's printer."""
        return str(sp.latex(e))


class Text:
    """The style plain text, with Greek letters and superscripts."""

    bars = False
    sums = "Σ_j", "Σ_jk"
    dots = "…"

    def words(self, text: str) -> str:
        return text

    def letter(self, name: str, index: str = "", primes: int = 0) -> str:
        base, _, subscript = name.partition("_")
        head = VARIANTS[base][1] if base in VARIANTS else greek_unicode.get(base, base)
        return "_".join(filter(None, (head, subscript, index))) + "'" * primes

    def product(self, factors: Sequence[str]) -> str:
        return " ".join(factors).replace(") (", ")(")

    def fraction(self, top: str, bottom: str, single: bool) -> str:
        return f"{top}/{bottom}" if single else f"{top}/({bottom})"

    def beside(self, fraction: str) -> str:
        return f"({fraction})"

    def power(self, base: str, exponent: str) -> str:
        if exponent.isdigit():
            return base + exponent.translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{base}^({exponent})"

    def root(self, inside: str) -> str:
        return f"sqrt({inside})"

    def function(self, name: str) -> str:
        return {"sign": "sgn"}.get(name, name)

    def other(self, e: sp.Expr) -> str:
        return str(sp.sstr(e))


Style: TypeAlias = Latex | Text  # a style: methods that join the parts of a formula to text


@dataclass(frozen=True, slots=True)
class ExpressionWriter:
    style: Style  # LaTeX or text
    letters: Mapping[sp.Symbol, str]  # symbol -> written form; other symbols are written by name
    variables: frozenset[sp.Symbol]  # symbols written after the parameters in products

    def total(self, terms: Iterable[sp.Expr]) -> str:
        text = ""
        for term in map(_turned, terms):
            negative = _negative(term)
            size = self._factor(-term) if negative and term.is_Add else self.write(-term if negative else term)
            text += (" - " if negative else " + ") + size if text else ("-" if negative else "") + size
        return text or "0"

    def write(self, e: sp.Expr) -> str:
        if isinstance(e, sp.Symbol):
            return self.letters.get(e, self.style.letter(e.name))
        if e.is_Add:
            return self.total(sorted(e.args, key=lambda x: (_negative(x), sp.count_ops(x), sp.default_sort_key(x))))
        if e.is_Integer and e >= 0:
            return str(e)
        if e.is_Rational or e.is_Mul or (e.is_Pow and e.exp.is_Rational and e.exp < 0):
            return "-" + self.write(-e) if _negative(e) else self._product(e)
        if e.is_Pow:
            return self._power(e)
        return self._called(e)

    def _called(self, e: sp.Expr) -> str:
        """Write a function or pi; write any other expression with SymPy's printer."""
        if e is sp.pi:
            return self.style.letter("pi")
        if isinstance(e, sp.Abs):
            return f"|{self.write(e.args[0])}|"
        if isinstance(e, sp.Function | sp.Max | sp.Min) and not e.is_Piecewise:
            inside = ", ".join(map(self.write, e.args))
            return f"{self.style.function(type(e).__name__)}({inside})"
        return self.style.other(e.xreplace({s: sp.Symbol(text) for s, text in self.letters.items()}))

    def factors(self, e: sp.Expr) -> list[str]:
        """Write the factors of a product in order, sums in parentheses."""
        return [self._factor(f) for f in sorted(sp.Mul.make_args(e), key=self._rank)]

    def _product(self, e: sp.Expr) -> str:
        top, bottom = _fraction(e)
        if bottom == 1:
            return self.style.product(self.factors(top))
        constant, variable = top.as_independent(*top.free_symbols, as_Add=False)
        if variable == 1 or not bottom.is_number:
            return self.style.fraction(self._part(top), self._part(bottom), not bottom.is_Mul)
        front = self.style.fraction(self._part(constant), self._part(bottom), not bottom.is_Mul)
        return self.style.product([self.style.beside(front), *self.factors(variable)])

    def _part(self, e: sp.Expr) -> str:
        if e.is_Mul:
            return self.style.product(self.factors(e))
        return self.write(e) if self.style.bars else self._factor(e)

    def _power(self, e: sp.Expr) -> str:
        base, exponent = e.as_base_exp()
        if exponent == sp.Rational(1, 2):
            return self.style.root(self.write(base))
        text = self.write(base)
        if not (isinstance(base, sp.Symbol | sp.Function) or base.is_Integer) or text.endswith("'"):
            text = f"({text})"
        return self.style.power(text, self.write(exponent))

    def _factor(self, e: sp.Expr) -> str:
        return f"({self.write(e)})" if e.is_Add or _negative(e) else self.write(e)

    def _rank(self, factor: sp.Expr) -> tuple[int, sp.Expr]:
        base = factor.as_base_exp()[0] if factor.is_Pow else factor
        if factor.is_number:
            rank = 0
        elif isinstance(base, sp.Symbol):
            rank = 2 if base in self.variables else 1
        else:
            rank = 3 if base.is_Add else 4
        return rank, sp.default_sort_key(factor)


def _negative(e: sp.Expr) -> bool:
    return bool(e.as_coeff_Mul()[0].is_negative)


def _turned(e: sp.Expr) -> sp.Expr:
    """Factor -1 out of sums with negative terms only: -(1 + a) d, not (-1 - a) d."""
    if not e.is_Mul:
        return e
    return sp.Mul(*(sp.Mul(-1, -f, evaluate=False) if f.is_Add and all(map(_negative, f.args)) else f for f in e.args))


def _fraction(e: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return numerator and denominator; unlike in SymPy, exp(-x) stays in the numerator."""
    top, bottom = [], []
    for factor in sp.Mul.make_args(e):
        if factor.is_Rational:
            top.append(sp.Integer(factor.p))
            bottom.append(sp.Integer(factor.q))
        elif factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
            bottom.append(1 / factor)
        else:
            top.append(factor)
    return sp.Mul(*top), sp.Mul(*bottom)
