"""Spectra of whole families in closed form, with symbols for the sizes, and simple eigenvectors.

A family's file may have `formula()`, which returns a ClosedForm of the symbols below.  The tests
prove each one for all sizes up to 30 against the exact characteristic polynomial.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import sympy as sp

from .families import family, names, topology
from .topology import Topology

__all__ = ["NODE", "ClosedForm", "D", "J", "K", "M", "N", "P", "Q", "Term", "closed_form", "entries", "formulas"]

N, K, J, P, Q, D, M, NODE = sp.symbols("n k j p q d m i", integer=True, nonnegative=True)
"""n: nodes; k, j: indices of eigenvalues; p, q: sizes of directions or groups; d: dimension;
m: number of an eigenvector; i: number of a node, from 0."""

Index = tuple[sp.Symbol, sp.Expr, sp.Expr]

_ENTRY = re.compile(r"[0-9]{1,9}|[a-hj-wyz][0-9]?")
"""A whole number or a letter other than i, the node, and x, which stands between sizes."""


@dataclass(frozen=True, slots=True)
class Term:
    """Eigenvalues of one form: one for each value of the indices, e.g. -4 sin²(kπ/n), k = 0 … n - 1."""

    value: sp.Expr  # the eigenvalue
    times: sp.Expr = sp.S.One  # its multiplicity
    indices: tuple[Index, ...] = ()  # there is an eigenvalue for every value low … high of these indices
    vector: sp.Expr | None = None  # entry NODE of an eigenvector
    numbered: tuple[Index, ...] = ()  # numbers of the eigenvectors of a multiple eigenvalue
    where: sp.Basic = sp.true  # condition on `numbered` for independent eigenvectors

    @property
    def text(self) -> str:
        """The term as text: value, multiplicity times for k = low … high."""
        times = "" if self.times == 1 else f", {sp.sstr(self.times)} times"
        return f"{sp.sstr(self.value)}{times}{_ranges(self.indices)}"

    def vector_text(self, size: sp.Expr) -> str:
        """Return the eigenvectors of a graph with `size` nodes as text."""
        condition = "" if self.where == sp.true else f", {sp.sstr(self.where)}"
        return f"{sp.sstr(self.vector)} at node i = 0 … {sp.sstr(size - 1)}{_ranges(self.numbered)}{condition}"

    @property
    def symbols(self) -> set[sp.Symbol]:
        """All symbols but that of the node."""
        ends = [end for index in (*self.indices, *self.numbered) for end in index]
        return set().union(*(sp.S(part).free_symbols for part in (self.value, self.times, self.where, *ends)))

    def at(self, sizes: Mapping[sp.Symbol, int]) -> Iterator[tuple[sp.Expr, int, dict[sp.Symbol, int]]]:
        """Yield (eigenvalue, multiplicity > 0, sizes and indices) for numbers in place of the sizes."""
        for values in _with_indices(self.indices, dict(sizes)):
            count = int(self.times.subs(values))
            if count:
                yield self.value.xreplace({s: sp.Integer(k) for s, k in values.items()}), count, values

    def vectors(self, values: Mapping[sp.Symbol, int]) -> Iterator[sp.Expr]:
        """Yield the eigenvectors of an eigenvalue as expressions in NODE; `values` are sizes and indices."""
        if self.vector is not None:
            for all_values in _with_indices(self.numbered, dict(values)):
                if self.where.subs(all_values).doit() == sp.true:
                    yield self.vector.subs(all_values).doit()

    def replaced(self, new: Mapping[sp.Symbol, sp.Expr]) -> Term:
        """Return the term with other expressions for some of its symbols, all at once."""

        def put(part: object) -> object:
            return sp.S(part).xreplace(dict(new))

        indices, numbered = (
            tuple((put(s), put(low), put(high)) for s, low, high in group) for group in (self.indices, self.numbered)
        )
        vector = None if self.vector is None else put(self.vector)
        return Term(put(self.value), put(self.times), indices, vector, numbered, put(self.where))


def _ranges(indices: tuple[Index, ...]) -> str:
    ranges = ", ".join(f"{s} = {sp.sstr(low)} … {sp.sstr(high)}" for s, low, high in indices)
    return f" for {ranges}" if ranges else ""


def _with_indices(indices: tuple[Index, ...], values: dict[sp.Symbol, int]) -> Iterator[dict[sp.Symbol, int]]:
    """Yield the values of the symbols with all values of the indices, whose ends depend on them."""
    ranges = [range(int(low.subs(values)), int(high.subs(values)) + 1) for _, low, high in indices]
    for numbers in product(*ranges):
        yield values | {index[0]: k for index, k in zip(indices, numbers, strict=True)}


@dataclass(frozen=True, slots=True)
class ClosedForm:
    """The spectrum of a family or product in symbols."""

    terms: tuple[Term, ...]  # the eigenvalues
    size: sp.Expr = N  # the number of nodes
    options: Mapping[str, object] = field(default_factory=dict)  # options of the family, expressions in the symbols
    least: int = 1  # smallest number for each symbol that is not in `lowest`
    note: str = ""  # further text for readers
    blocks: str = ""  # text on Jordan blocks larger than 1; not valid for products
    degree: sp.Expr | None = None  # the in-degree of every node; None if it is not one for all
    where: sp.Basic = sp.true  # condition on the numbers
    lowest: Mapping[sp.Symbol, int] = field(default_factory=dict)  # smallest numbers of single symbols
    name: str = ""  # name of the family with its options
    build: Callable[[Mapping[sp.Symbol, int]], Topology] | None = field(default=None, compare=False)  # makes a graph

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The symbols that take numbers, sorted by name."""
        return tuple(sorted(self.size.free_symbols | self.where.free_symbols, key=str))

    def least_of(self, symbol: sp.Symbol) -> int:
        """Return the smallest number for a symbol."""
        return self.lowest.get(symbol, self.least)

    def at(self, **numbers: int) -> list[tuple[sp.Expr, int]]:
        """Return eigenvalues and multiplicities for numbers such as n=5 or p=3, q=4.

        Equal eigenvalues are not merged.
        """
        sizes = self.by_symbol(numbers)
        return [(value, count) for term in self.terms for value, count, _ in term.at(sizes)]

    def graph(self, **numbers: int) -> Topology:
        """Return the graph for numbers as of `at`."""
        return self.graph_of(self.by_symbol(numbers))

    def graph_of(self, numbers: Mapping[sp.Symbol, int]) -> Topology:
        """Return the graph for numbers by symbols."""
        if self.build is None:
            raise ValueError("this closed form has no graph; expected one made by closed_form or a product of such")
        return self.build(numbers)

    def as_dict(self) -> dict[str, object]:
        """Return what `synchain spectrum FAMILY --symbolic --json` prints."""

        def ranges(indices: tuple[Index, ...]) -> list[list[str]]:
            return [[str(s), sp.sstr(low), sp.sstr(high)] for s, low, high in indices]

        terms = [
            {
                "value": sp.sstr(term.value),
                "multiplicity": sp.sstr(term.times),
                "indices": ranges(term.indices),
                "vector": None if term.vector is None else sp.sstr(term.vector),
                "numbered": ranges(term.numbered),
                "where": None if term.where == sp.true else sp.sstr(term.where),
            }
            for term in self.terms
        ]
        return {"n": sp.sstr(self.size), "terms": terms, "note": self.words}

    @property
    def words(self) -> str:
        """The note and the Jordan blocks."""
        return "; ".join(filter(None, (self.note, self.blocks)))

    @property
    def text(self) -> str:
        """The form as lines."""
        rows = [f"{self.name}, n = {sp.sstr(self.size)} nodes" if self.size != N else f"{self.name} of n nodes"]
        for term in self.terms:
            rows.append(f"  {term.text}")
            if term.vector is not None:
                rows.append(f"    eigenvector{'s' * bool(term.numbered)}: {term.vector_text(self.size)}")
        return "\n".join([*rows, *([f"  {self.words}"] if self.words else [])])

    def by_symbol(self, numbers: Mapping[str, int]) -> dict[sp.Symbol, int]:
        """Return numbers by symbols instead of names; ValueError as `at`."""
        symbols = {str(symbol): symbol for symbol in self.symbols}
        if set(numbers) != set(symbols):
            raise ValueError(f"found numbers for {sorted(numbers)}; expected them for {sorted(symbols)}")
        for key, value in numbers.items():
            if value < self.least_of(symbols[key]):
                raise ValueError(f"found {key} = {value}; expected at least {self.least_of(symbols[key])}")
        by_symbol = {symbols[key]: value for key, value in numbers.items()}
        if self.where.subs(by_symbol) != sp.true:
            raise ValueError(f"found {numbers}; expected {sp.sstr(self.where)}")
        return by_symbol


def entries(what: str, sizes: str | Iterable[object]) -> tuple[sp.Expr, ...]:
    """Return the whole numbers and symbols of a list or a text such as "pxq"; else ValueError."""
    parts = re.split("[,x]", sizes.replace(" ", "")) if isinstance(sizes, str) else list(sizes)
    wrong = next((part for part in parts if not _ENTRY.fullmatch(str(part))), None)
    if wrong is not None or not parts:
        raise ValueError(f"{what} = {sizes!r}; expected whole numbers or letters other than i and x, e.g. pxq or 1,3,s")
    return tuple(
        sp.Integer(str(part)) if str(part).isdigit() else sp.Symbol(str(part), integer=True, nonnegative=True)
        for part in parts
    )


def formulas() -> tuple[str, ...]:
    """Return the names of the families that have a closed form with symbols."""
    return tuple(name for name in names() if family(name).formula is not None)


def closed_form(name: str, **options: object) -> ClosedForm:
    """Return the spectrum of a family with symbols for its size."""
    name, formula = family(name).name, family(name).formula
    if formula is None:
        raise ValueError(f"topology {name}: no closed form with symbols; known for {', '.join(formulas())}")
    valid_options = tuple(inspect.signature(formula).parameters)
    unknown = sorted(set(options) - set(valid_options))
    if unknown:
        valid = ", ".join(valid_options) or "none"
        raise ValueError(f"topology {name}: option {unknown[0]!r} with symbols; known: {valid}")
    try:
        form: ClosedForm = formula(**options)
    except ValueError as error:
        raise ValueError(f"topology {name}: {error}") from None
    shown = ", ".join(
        f"{key}=({', '.join(map(str, value))})" if isinstance(value, tuple) else f"{key}={value}"
        for key, value in form.options.items()
        if key in options
    )

    def build(numbers: Mapping[sp.Symbol, int]) -> Topology:
        def put(value: object) -> object:
            return tuple(map(put, value)) if isinstance(value, tuple) else int(sp.S(value).subs(numbers))

        sized = {key: put(value) for key, value in form.options.items()}
        return topology(name, int(form.size.subs(numbers)), **sized)

    return replace(form, name=f"{name}({shown})" if shown else name, build=build)
