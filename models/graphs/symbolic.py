"""Graphs whose weights are rational functions of symbols; nothing in a text is run.

Their spectrum holds for symbols as such (`synchain.models.spectra.symbolic_spectrum`); `SymbolicTopology.at` gives the graph for
particular numbers, with its own proved spectrum.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from math import comb
from operator import add, mul
from pathlib import Path
from typing import NoReturn

import sympy as sp

from ..inputs.rational_text import file_text, parse_rows, rational, square
from ..inputs.reader import Algebra, NoMeaning, parse
from ..spectra.symbolic_spectrum import SymbolicSpectrum, Z, symbolic_spectrum
from .topology import Topology, from_matrix

LARGEST, LENGTH, DEPTH, EXPONENT = 30, 200, 20, 12
DEGREE, TERMS, BITS = 60, 2000, 10_000
"""Largest degree, number of terms and bits of a number that a weight may have once it is multiplied out."""

_LETTERS = re.compile(r"[A-Za-z0-9_+\-*/(). ]*", re.ASCII)
_EXPECTED = "expected whole numbers, fractions, letters, + - * / **, e.g. a/2 or 1/(1+b)"


@dataclass(frozen=True, slots=True)
class SymbolicTopology:
    """`n` nodes and links (target, source, weight), the weights rational functions of symbols; made by `from_symbols`."""

    name: str
    n: int
    links: tuple[tuple[int, int, sp.Expr], ...]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The symbols of all weights, sorted by name."""
        return tuple(sorted(set().union(*(w.free_symbols for _, _, w in self.links)), key=str))

    @property
    def matrix(self) -> sp.ImmutableDenseMatrix:
        """G, every row of which sums to zero."""
        rows = sp.zeros(self.n)
        for target, source, w in self.links:
            rows[target, source] = w
            rows[target, target] -= w
        return sp.ImmutableDenseMatrix(rows.applyfunc(sp.cancel))

    @property
    def spectrum(self) -> SymbolicSpectrum:
        """The characteristic polynomial, factored (see `synchain.models.spectra.symbolic_spectrum`)."""
        return symbolic_spectrum(self.matrix, self.name)

    def at(self, **values: object) -> Topology:
        """The graph with rational numbers for all symbols; weights that become 0 are left out.

        Raises ValueError on a missing or unknown symbol, a number that is not rational and a division by zero.
        """
        known = {str(symbol): symbol for symbol in self.symbols}
        if set(values) != set(known):
            raise ValueError(f"{self.name}: found values of {sorted(values)}; expected them of {sorted(known)}")
        numbers = {known[key]: rational(value, f"{self.name}: {key}") for key, value in values.items()}
        exact = {symbol: sp.Rational(x.numerator, x.denominator) for symbol, x in numbers.items()}
        rows = [[sp.S.Zero] * self.n for _ in range(self.n)]
        for target, source, w in self.links:
            value = w.subs(exact)
            if not value.is_Rational:
                raise ValueError(
                    f"{self.name}: weight {w} of {target} <- {source} divides by zero; choose other values"
                )
            rows[target][source] = value
            rows[target][target] -= value
        return from_matrix(rows, self.name)


def from_symbols(rows: Iterable[Iterable[object]] | sp.MatrixBase, name: str = "matrix") -> SymbolicTopology:
    """The graph of a connectivity matrix of rational functions: SymPy expressions, numbers or texts such as "a/2".

    Every row must sum to zero.  Raises ValueError on another shape, a row sum that is not 0, more than LARGEST nodes and
    an entry that is no rational function.
    """
    table = square(rows, name)
    n = len(table)
    if n > LARGEST:
        raise ValueError(f"{name}: found {n} rows; expected a square of up to {LARGEST}")
    entries = [[weight(x, f"{name}: entry ({i + 1}, {j + 1})") for j, x in enumerate(r)] for i, r in enumerate(table)]
    for i, row in enumerate(entries):
        total = sp.cancel(sp.Add(*row))
        if total != 0:
            raise ValueError(
                f"{name}: row {i + 1} sums to {total}; expected 0, or the synchronous state is no solution"
            )
    links = tuple((i, j, x) for i, row in enumerate(entries) for j, x in enumerate(row) if i != j and x != 0)
    return SymbolicTopology(name, n, links)


def read_symbols(path: str | Path) -> SymbolicTopology:
    """The graph of a text file, as `topology.read_matrix` reads it, with letters in its entries; nothing in it is run."""
    text, name = file_text(path, "matrix file")
    return from_symbols(parse_rows(text, name), name)


def weight(entry: object, where: str) -> sp.Expr:
    """A rational function in lowest terms; ValueError on anything else, and on the letter z."""
    if isinstance(entry, str):
        found = _read(entry.strip(), where)
    elif isinstance(entry, sp.Expr) and entry.free_symbols:
        found = entry
    else:
        number = rational(entry, where)
        found = sp.Rational(number.numerator, number.denominator)
    if found.has(sp.zoo, sp.nan) or not found.is_rational_function(*found.free_symbols) or found.atoms(sp.Float):
        raise ValueError(f"{where} is {entry}; {_EXPECTED}")
    if Z in found.free_symbols or any(str(s) == "z" for s in found.free_symbols):
        raise ValueError(f"{where} is {entry}; z is the variable of the characteristic polynomial: rename the weight")
    _check_size(found, where)
    return sp.cancel(found)


@dataclass(frozen=True, slots=True)
class _Size:
    """At most so many terms above and below the line, and so high a degree, of an expression that is multiplied out."""

    above: int = 1
    below: int = 1
    degree: int = 0

    def __add__(self, other: _Size) -> _Size:
        above = self.above * other.below + other.above * self.below
        below = self.below * other.below
        join = max if below == 1 else add
        return _Size(above, below, join(self.degree, other.degree))

    def __mul__(self, other: _Size) -> _Size:
        return _Size(self.above * other.above, self.below * other.below, self.degree + other.degree)

    def __pow__(self, power: int) -> _Size:
        if power < 0:
            return _Size(self.below, self.above, self.degree) ** -power
        return _Size(comb(self.above + power - 1, power), comb(self.below + power - 1, power), self.degree * power)


def _check_size(found: sp.Expr, where: str) -> None:
    """Refuse an expression that is too large multiplied out, before it is."""

    def size(e: sp.Expr) -> _Size:
        if e.is_Symbol:
            return _Size(degree=1)
        if e.is_Pow and e.exp.is_Integer:
            inner = size(e.base)
            made = inner ** int(e.exp) if inner.degree * abs(int(e.exp)) <= DEGREE else _Size(degree=DEGREE + 1)
        elif e.is_Add or e.is_Mul:
            parts = [size(part) for part in e.args]
            made = reduce(add if e.is_Add else mul, parts)
        else:
            return _Size()
        if made.degree > DEGREE or max(made.above, made.below) > TERMS:
            raise ValueError(
                f"{where} may have more than {TERMS} terms or a degree above {DEGREE} when multiplied out; "
                "write it shorter or give the weight a letter of its own"
            )
        return made

    size(found)


def _read(text: str, where: str) -> sp.Expr:
    if len(text) > LENGTH or not _LETTERS.fullmatch(text):
        raise ValueError(f"{where} is {text[:40]!r}; {_EXPECTED}")
    expression = parse(text)
    if expression is None:
        raise ValueError(f"{where} is {text!r}; {_EXPECTED}")
    return expression.evaluate(_Weights(text, where))


@dataclass(frozen=True, slots=True)
class _Weights(Algebra[sp.Expr]):
    """Rational functions of symbols, as they are written: nothing is multiplied out."""

    text: str
    where: str
    deepest = DEPTH

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        raise ValueError(f"{self.where} is {self.text!r}; {_EXPECTED}")

    def refuse_depth(self) -> NoReturn:
        raise ValueError(f"{self.where} is {self.text!r}, nested more than {DEPTH} times; write it shorter")

    def number(self, value: int | float) -> sp.Expr:
        number = rational(value, self.where)
        return sp.Rational(number.numerator, number.denominator)

    def name(self, name: str) -> sp.Expr:
        return sp.Symbol(name)

    def negative(self, value: sp.Expr) -> sp.Expr:
        return -value

    def add(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return a + b

    def multiply(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return a * b

    def divide(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return a / b

    def power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        raise NoMeaning

    def whole_power(self, base: sp.Expr, exponent: int) -> sp.Expr:
        if not 0 < exponent <= EXPONENT:
            raise NoMeaning
        if base.is_Rational and exponent * max(int(base.p).bit_length(), int(base.q).bit_length()) > BITS:
            raise ValueError(
                f"{self.where} is {self.text!r}, a number of more than {BITS} bits; expected a smaller one"
            )
        return base**exponent
