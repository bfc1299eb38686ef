"""Translate SymPy expressions to expressions of a program, and choose how to compute powers, roots and constants.

`Lowering` translates for lanes: a power becomes products and roots, a constant becomes one double. `Library` translates
for languages with a mathematical library. Both raise an error for a function without a counterpart, for a
floating-point number and for a constant that is not real.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import sympy as sp
from sympy.logic.boolalg import Boolean

from . import functions
from .expressions import (
    ONE,
    Call,
    Compare,
    Conditional,
    Expression,
    Junction,
    Name,
    Negation,
    Not,
    Number,
    PowerExpr,
    ProductExpr,
    Quotient,
    Sum,
    call,
    product,
)

SIGNS = {sp.StrictLessThan: "<", sp.LessThan: "<=", sp.StrictGreaterThan: ">", sp.GreaterThan: ">="}

LARGEST_POWER = 16  # largest integer exponent for which lanes compute a power as a product. A choice.


class UnprintableError(ValueError):
    """Raised for an expression that cannot be translated to code; the message names the part and the remedy."""


class Lowering:
    names: Mapping[str, str] = functions.LANES

    def __call__(self, e: sp.Expr) -> Expression:
        if e.is_Symbol:
            return Name(e.name)
        if e.is_Float:
            raise UnprintableError(f"floating-point number {e} in an expression; make it a parameter or a Rational")
        if self.is_constant(e):
            return number(e)
        if e.is_Add:
            # put positive terms first, so that a sum does not begin with a minus sign
            terms = sorted(e.args, key=lambda term: (_is_negative(term), sp.default_sort_key(term)))
            return Sum(tuple(Negation(self(-t)) if _is_negative(t) else self(t) for t in terms))
        if e.is_Mul:
            return Negation(self(-e)) if _is_negative(e) else self.product(e)
        if e.is_Pow:
            return self.power(e.base, e.exp)
        if isinstance(e, sp.Piecewise):
            return self.choice(e)
        if isinstance(e, Boolean):
            return self.condition(e)
        return self.function(e)

    def is_constant(self, e: sp.Expr) -> bool:
        """Return True for a real constant that is folded into one double: rationals, pi, e and functions of these."""
        return bool(e.is_number) and not e.atoms(sp.Float) and e.is_real is True

    def product(self, e: sp.Mul) -> Expression:
        """Return a product: one constant first, then the factors; negative powers become divisors."""
        constants = [f for f in e.args if self.is_constant(f)]
        factors = [f for f in e.args if f not in constants]
        below = [f for f in factors if f.is_Pow and f.exp.is_number and f.exp.is_negative and f.base != sp.E]
        above = [self(f) for f in factors if f not in below]
        coefficient = sp.Mul(*constants)
        top = product(above if coefficient == 1 else [number(coefficient), *above])
        return Quotient(top, product([self(1 / f) for f in below])) if below else top

    def power(self, base: sp.Expr, exponent: sp.Expr) -> Expression:
        if base == sp.E:
            return call("exp", self(exponent))
        if exponent.is_number and exponent.is_negative:
            return Quotient(ONE, self(1 / base**exponent))
        if exponent == sp.Rational(1, 2):
            return call("sqrt", self(base))
        if exponent.is_Rational and exponent.q == 2:
            return ProductExpr((self(base ** (exponent - sp.Rational(1, 2))), call("sqrt", self(base))))
        return self.general_power(base, exponent)

    def general_power(self, base: sp.Expr, exponent: sp.Expr) -> Expression:
        """Return a power whose exponent is neither negative nor half an odd integer."""
        if not exponent.is_Integer:
            return call("exp", self(exponent * sp.log(base)))
        if exponent > LARGEST_POWER:
            raise UnprintableError(
                f"no printing rule for the power {base**exponent}; expected whole exponents up to {LARGEST_POWER}"
            )
        return ProductExpr((self(base),) * int(exponent))

    def function(self, e: sp.Expr) -> Expression:
        """Return the call of a function; Max and Min of several arguments become nested calls with two arguments."""
        name = functions.FUNCTIONS.get(type(e), "")
        if name not in self.names:
            functions_here = ", ".join(sorted(set(self.names) - {"sqrt"}))
            raise UnprintableError(
                f"no printing rule for {type(e).__name__} in {e}; known: {functions_here}, sqrt, powers, Piecewise"
            )
        arguments = [self(a) for a in e.args]
        while len(arguments) > 2:
            arguments[-2:] = [Call(name, tuple(arguments[-2:]))]
        return Call(name, tuple(arguments))

    def choice(self, e: sp.Piecewise) -> Expression:
        """Return a Piecewise as nested choices: the first condition that holds selects the value."""
        value, condition = e.args[-1]
        if condition is not sp.true:
            raise UnprintableError(f"{e} has no value where no condition holds; end it with (value, True)")
        choice = self(value)
        for value, condition in reversed(e.args[:-1]):
            choice = Conditional(self.condition(condition), self(value), choice)
        return choice

    def condition(self, e: Boolean) -> Expression:
        """Return a condition; a symbol in the condition names a condition that was computed before."""
        e = sp.to_nnf(e, simplify=False)  # then only names are negated
        if e.is_Symbol:
            return Name(e.name)
        if isinstance(e, sp.Not) and e.args[0].is_Symbol:
            return Not(Name(e.args[0].name))
        if isinstance(e, sp.And | sp.Or):
            parts = sorted(e.args, key=sp.default_sort_key)
            return Junction("and" if isinstance(e, sp.And) else "or", tuple(map(self.condition, parts)))
        for kind, sign in SIGNS.items():
            if isinstance(e, kind):
                return Compare(sign, self(e.lhs), self(e.rhs))
        raise UnprintableError(f"no printing rule for the condition {e}; use <, <=, >, >=, And, Or, Not")


class Library(Lowering):
    """Translate for languages with a mathematical library: keep any power, and write factors 1/q as divisions."""

    names = functions.C99

    def is_constant(self, e: sp.Expr) -> bool:
        """Return True for every constant; `number` raises an error for a constant that is not real."""
        return bool(e.is_number) and not e.atoms(sp.Float)

    def product(self, e: sp.Mul) -> Expression:
        """Return a product; negative rational powers and the denominator of a constant become divisors."""
        coefficient = sp.Mul(*(f for f in e.args if f.is_number))
        factors = [f for f in e.args if not f.is_number]
        below = [f for f in factors if f.is_Pow and f.exp.is_Rational and f.exp < 0]
        above = _flat([self(f) for f in factors if f not in below])
        under = [self(1 / f) for f in below]
        under = _flat(under) if len(under) > 1 else under
        if coefficient.is_Rational and coefficient.p == 1 and coefficient.q > 1 and above:
            under.insert(0, number(sp.Integer(coefficient.q)))  # x/3 rounds once, x*(1/3) twice
        elif coefficient != 1:
            above.insert(0, number(coefficient))
        return Quotient(product(above), product(under)) if under else product(above)

    def power(self, base: sp.Expr, exponent: sp.Expr) -> Expression:
        """Return a power; a square root becomes sqrt, other roots stay powers."""
        if base == sp.E or exponent == sp.Rational(1, 2) or (exponent.is_Rational and exponent < 0):
            return super().power(base, exponent)
        return self.general_power(base, exponent)

    def general_power(self, base: sp.Expr, exponent: sp.Expr) -> Expression:
        """Return a power; a small power of a variable becomes a product."""
        if exponent.is_Integer and base.is_Symbol and exponent <= 4:
            return ProductExpr((self(base),) * int(exponent))
        return PowerExpr(self(base), Number(int(exponent)) if exponent.is_Integer else self(exponent))


lower = Lowering()  # translates a SymPy expression to an expression for lanes


def number(e: sp.Expr | Fraction) -> Number:
    """Return the double nearest to an exact number."""
    try:
        if isinstance(e, Fraction) or e.is_Rational:
            value = float(Fraction(e.numerator, e.denominator))
        else:
            value = float(sp.N(e, 50))
    except (OverflowError, TypeError):
        value = float("inf")
    if not abs(value) < float("inf"):
        raise UnprintableError(f"the number {e} does not fit into a double; rescale the equations")
    return Number(value)


def _flat(factors: Sequence[Expression]) -> list[Expression]:
    return [part for f in factors for part in (f.factors if isinstance(f, ProductExpr) else (f,))]


def _is_negative(e: sp.Expr) -> bool:
    return bool(e.could_extract_minus_sign()) and (e.is_Number or e.is_Mul)
