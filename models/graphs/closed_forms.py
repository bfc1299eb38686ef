"""Spectra of whole families in closed form, with symbols for the sizes, and simple eigenvectors.

The `formula` of a family returns a ClosedForm in the symbols below.  Tests prove each closed form
for all sizes up to 30 against the exact characteristic polynomial.
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

# n: nodes; k, j: indices of eigenvalues; p, q: sizes of directions or groups; d: dimension; m: number of an
# eigenvector; i: number of a node, from 0.
N, K, J, P, Q, D, M, NODE = sp.symbols("n k j p q d m i", integer=True, nonnegative=True)

Index = tuple[sp.Symbol, sp.Expr, sp.Expr]

# A whole number or a letter, except i (the node) and x (the separator of sizes, as in pxq).
_ENTRY = re.compile(r"[0-9]{1,9}|[a-hj-wyz][0-9]?")


@dataclass(frozen=True, slots=True)
class Term:
    """A formula for eigenvalues, one for each value of its indices: -4 sin²(kπ/n), k = 0 … n - 1."""

    value: sp.Expr  # the eigenvalue
    times: sp.Expr = sp.S.One  # its multiplicity
    indices: tuple[Index, ...] = ()  # (k, low, high): one eigenvalue for each k = low … high
    vector: sp.Expr | None = None  # entry NODE of an eigenvector
    numbered: tuple[Index, ...] = ()  # indices that number the eigenvectors of a multiple eigenvalue
    where: sp.Basic = sp.true  # condition on `numbered` for independent eigenvectors

    @property
    def text(self) -> str:
        """Text such as "-2*k, binomial(d, k) times for k = 0 … d"."""
        times = "" if self.times == 1 else f", {sp.sstr(self.times)} times"
        return f"{sp.sstr(self.value)}{times}{_ranges(self.indices)}"

    def vector_text(self, size: sp.Expr) -> str:
        """Return the eigenvectors of a graph with `size` nodes as text."""
        condition = "" if self.where == sp.true else f", {sp.sstr(self.where)}"
        return f"{sp.sstr(self.vector)} at node i = 0 … {sp.sstr(size - 1)}{_ranges(self.numbered)}{condition}"

    @property
    def symbols(self) -> set[sp.Symbol]:
        ends = [end for index in (*self.indices, *self.numbered) for end in index]
        return set().union(*(sp.S(part).free_symbols for part in (self.value, self.times, self.where, *ends)))

    def at(self, sizes: Mapping[sp.Symbol, int]) -> Iterator[tuple[sp.Expr, int, dict[sp.Symbol, int]]]:
        """Yield (eigenvalue, multiplicity > 0, values of sizes and indices) for numeric sizes."""
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
    """Extend `values` by every combination of the indices; ends of an index may depend on earlier values."""
    ranges = [range(int(low.subs(values)), int(high.subs(values)) + 1) for _, low, high in indices]
    for numbers in product(*ranges):
        yield values | {index[0]: k for index, k in zip(indices, numbers, strict=True)}


@dataclass(frozen=True, slots=True)
class ClosedForm:
    terms: tuple[Term, ...]  # the eigenvalues
    size: sp.Expr = N  # the number of nodes
    options: Mapping[str, object] = field(default_factory=dict)  # option of the family -> expression in the symbols
    least: int = 1  # smallest number for each symbol that is not in `lowest`
    note: str = ""  # further text for readers
    blocks: str = ""  # text on Jordan blocks larger than 1; not valid for products
    degree: sp.Expr | None = None  # common in-degree of all nodes; None if they differ
    where: sp.Basic = sp.true  # condition on the sizes
    lowest: Mapping[sp.Symbol, int] = field(default_factory=dict)  # smallest number for particular symbols
    name: str = ""  # name of the family with its options
    build: Callable[[Mapping[sp.Symbol, int]], Topology] | None = field(default=None, compare=False)  # numbers -> graph

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The symbols that `at` replaces by numbers, sorted by name."""
        return tuple(sorted(self.size.free_symbols | self.where.free_symbols, key=str))

    def least_of(self, symbol: sp.Symbol) -> int:
        return self.lowest.get(symbol, self.least)

    def at(self, **numbers: int) -> list[tuple[sp.Expr, int]]:
        """Return eigenvalues and multiplicities for numbers such as n=5 or p=3, q=4."""
        # Equal eigenvalues are not merged.
        sizes = self.by_symbol(numbers)
        return [(value, count) for term in self.terms for value, count, _ in term.at(sizes)]

    def graph(self, **numbers: int) -> Topology:
        """Return the graph for numbers such as n=5; see `at`."""
        return self.graph_of(self.by_symbol(numbers))

    def graph_of(self, numbers: Mapping[sp.Symbol, int]) -> Topology:
        """Return the graph for a mapping symbol -> number."""
        if self.build is None:
            raise ValueError("this closed form has no graph; expected one made by closed_form or a product of such")
        return self.build(numbers)

    def as_dict(self) -> dict[str, object]:
        """Return the dictionary that `synchain spectrum FAMILY --symbolic --json` prints."""

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
        """The text on particularities: note and Jordan blocks."""
        return "; ".join(filter(None, (self.note, self.blocks)))

    @property
    def text(self) -> str:
        rows = [f"{self.name}, n = {sp.sstr(self.size)} nodes" if self.size != N else f"{self.name} of n nodes"]
        for term in self.terms:
            rows.append(f"  {term.text}")
            if term.vector is not None:
                rows.append(f"    eigenvector{'s' * bool(term.numbered)}: {term.vector_text(self.size)}")
        return "\n".join([*rows, *([f"  {self.words}"] if self.words else [])])

    def by_symbol(self, numbers: Mapping[str, int]) -> dict[sp.Symbol, int]:
        """Replace names by symbols in a mapping to numbers; ValueError for a wrong name or a number out of range."""
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
    """Read whole numbers and symbols from a list or a text such as "pxq"; ValueError for any other entry."""
    parts = re.split("[,x]", sizes.replace(" ", "")) if isinstance(sizes, str) else list(sizes)
    wrong = next((part for part in parts if not _ENTRY.fullmatch(str(part))), None)
    if wrong is not None or not parts:
        raise ValueError(f"{what} = {sizes!r}; expected whole numbers or letters other than i and x, e.g. pxq or 1,3,s")
    return tuple(
        sp.Integer(str(part)) if str(part).isdigit() else sp.Symbol(str(part), integer=True, nonnegative=True)
        for part in parts
    )


def formulas() -> tuple[str, ...]:
    """Return the names of the families with a closed form."""
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
    # Name the form with the given options only, as in torus(shape=(p, q)).
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
