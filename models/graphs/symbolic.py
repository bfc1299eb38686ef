"""Graphs whose weights are rational functions of symbols; text is parsed, not run.

The spectrum holds for generic symbols (`synchain.models.spectra.symbolic_spectrum`).  `SymbolicTopology.at` returns
the graph for particular numbers; its spectrum is computed and proved anew.
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

from ..algebra.rationals import to_sympy
from ..inputs.rational_text import file_text, parse_rows, rational, square
from ..inputs.reader import Algebra, NoMeaning, parse
from ..spectra.symbolic_spectrum import SymbolicSpectrum, Z, symbolic_spectrum
from .topology import Topology, from_matrix

# Limits, all choices: nodes, characters of a weight, nested operations, exponent.
LARGEST, LENGTH, DEPTH, EXPONENT = 30, 200, 20, 12
# Limits of an expanded weight, all choices: degree, number of terms, bits of a number.
DEGREE, TERMS, BITS = 60, 2000, 10_000

_LETTERS = re.compile(r"[A-Za-z0-9_+\-*/(). ]*", re.ASCII)
_EXPECTED = "expected whole numbers, fractions, letters, + - * / **, e.g. a/2 or 1/(1+b)"


@dataclass(frozen=True, slots=True)
class SymbolicTopology:
    """A graph of `n` nodes with links (target, source, weight); weights are rational functions. See `from_symbols`."""

    name: str
    n: int
    links: tuple[tuple[int, int, sp.Expr], ...]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        return tuple(sorted(set().union(*(w.free_symbols for _, _, w in self.links)), key=str))

    @property
    def matrix(self) -> sp.ImmutableDenseMatrix:
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
        """Substitute rational numbers for all symbols; links whose weights become 0 are left out."""
        # Raises ValueError on a missing or unknown symbol, a number that is not rational and a division by zero.
        symbols = {str(symbol): symbol for symbol in self.symbols}
        if set(values) != set(symbols):
            raise ValueError(f"{self.name}: found values of {sorted(values)}; expected them of {sorted(symbols)}")
        exact = {symbols[key]: to_sympy(rational(value, f"{self.name}: {key}")) for key, value in values.items()}
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
    """Return the graph of a connectivity matrix of rational functions: SymPy expressions, numbers or texts such as "a/2".

    Every row must sum to zero.  Raises ValueError on another shape, a row sum that is not 0, more than LARGEST nodes and
    an entry that is no rational function.

    See Also
    --------
    synchain.graphs.from_matrix
    synchain.graphs.joint_spectrum

    Examples
    --------
    >>> from synchain.graphs import from_symbols
    >>> graph = from_symbols([["-a", "a"], ["b", "-b"]])
    >>> [str(factor.as_expr()) for factor, _ in graph.spectrum.factors]
    ['a + b + z', 'z']
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
    """Read a graph from a text file like `topology.read_matrix`, with letters in entries; the text is not run."""
    text, name = file_text(path, "matrix file")
    return from_symbols(parse_rows(text, name), name)


def weight(entry: object, where: str) -> sp.Expr:
    """Return a rational function in lowest terms; ValueError for any other entry, and for the letter z."""
    if isinstance(entry, str):
        text = entry.strip()
        if len(text) > LENGTH or not _LETTERS.fullmatch(text):
            raise ValueError(f"{where} is {text[:40]!r}; {_EXPECTED}")
        parsed = parse(text)
        if parsed is None:
            raise ValueError(f"{where} is {text!r}; {_EXPECTED}")
        expr = parsed.evaluate(_Weights(text, where))
    elif isinstance(entry, sp.Expr) and entry.free_symbols:
        expr = entry
    else:
        expr = to_sympy(rational(entry, where))
    if expr.has(sp.zoo, sp.nan) or not expr.is_rational_function(*expr.free_symbols) or expr.atoms(sp.Float):
        raise ValueError(f"{where} is {entry}; {_EXPECTED}")
    if Z in expr.free_symbols or any(str(s) == "z" for s in expr.free_symbols):
        raise ValueError(f"{where} is {entry}; z is the variable of the characteristic polynomial: rename the weight")
    _size(expr, where)
    return sp.cancel(expr)


@dataclass(frozen=True, slots=True)
class _Size:
    """Upper bounds for an expanded rational function: terms of numerator and denominator, and degree."""

    above: int = 1
    below: int = 1
    degree: int = 0

    def __add__(self, other: _Size) -> _Size:  # a/b + c/d = (a d + c b) / (b d)
        above = self.above * other.below + other.above * self.below
        below = self.below * other.below
        join = max if below == 1 else add
        return _Size(above, below, join(self.degree, other.degree))

    def __mul__(self, other: _Size) -> _Size:
        return _Size(self.above * other.above, self.below * other.below, self.degree + other.degree)

    def __pow__(self, power: int) -> _Size:
        if power < 0:
            return _Size(self.below, self.above, self.degree) ** -power
        # (m terms)**power has C(m + power - 1, power) terms: multisets of `power` out of m
        return _Size(comb(self.above + power - 1, power), comb(self.below + power - 1, power), self.degree * power)


def _size(expr: sp.Expr, where: str) -> _Size:
    """Bound the size of an expression before expansion; ValueError if it exceeds the limits."""
    if expr.is_Symbol:
        return _Size(degree=1)
    if expr.is_Pow and expr.exp.is_Integer:
        base, power = _size(expr.base, where), int(expr.exp)
        size = base**power if base.degree * abs(power) <= DEGREE else _Size(degree=DEGREE + 1)
    elif expr.is_Add or expr.is_Mul:
        size = reduce(add if expr.is_Add else mul, [_size(part, where) for part in expr.args])
    else:
        return _Size()
    if size.degree > DEGREE or max(size.above, size.below) > TERMS:
        raise ValueError(
            f"{where} may have more than {TERMS} terms or a degree above {DEGREE} when multiplied out; "
            "write it shorter or give the weight a letter of its own"
        )
    return size


@dataclass(frozen=True, slots=True)
class _Weights(Algebra[sp.Expr]):
    """Read rational functions of symbols without expanding them."""

    text: str
    where: str
    deepest = DEPTH

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        raise ValueError(f"{self.where} is {self.text!r}; {_EXPECTED}")

    def refuse_depth(self) -> NoReturn:
        raise ValueError(f"{self.where} is {self.text!r}, nested more than {DEPTH} times; write it shorter")

    def number(self, value: int | float) -> sp.Expr:
        return to_sympy(rational(value, self.where))

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
