"""Spectra of whole families in closed form, with the number of nodes as a symbol, and eigenvectors where they are simple.

A family's file may have `formula()`, which returns a ClosedForm made of the symbols below.  The tests prove each one for
all sizes up to 30 against the exact characteristic polynomial.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import sympy as sp

from .exact_text import exact_number
from .topology import Topology, family, names, topology

__all__ = ["NODE", "ClosedForm", "D", "J", "K", "N", "P", "Q", "Term", "closed_form", "formulas"]

N, K, J, P, Q, D, NODE = sp.symbols("n k j p q d i", integer=True, nonnegative=True)
"""Nodes; indices of eigenvalues; sizes of directions or groups; dimension; the number of a node, from 0."""

Index = tuple[sp.Symbol, sp.Expr, sp.Expr]


@dataclass(frozen=True, slots=True)
class Term:
    """Eigenvalues `value`, each `times` times, for every value low … high of the `indices` (symbol, low, high).

    `vector` is entry NODE of an eigenvector of each, where one is given.
    """

    value: sp.Expr
    times: sp.Expr = sp.S.One
    indices: tuple[Index, ...] = ()
    vector: sp.Expr | None = None

    @property
    def text(self) -> str:
        """The term in words: value (times) for k = low … high."""
        often = "" if self.times == 1 else f", {sp.sstr(self.times)} times"
        many = ", ".join(f"{s} = {sp.sstr(low)} … {sp.sstr(high)}" for s, low, high in self.indices)
        return f"{sp.sstr(self.value)}{often}{' for ' if many else ''}{many}"

    def at(self, numbers: Mapping[sp.Symbol, int]) -> Iterator[tuple[sp.Expr, int, dict[sp.Symbol, int]]]:
        """(eigenvalue, multiplicity, all numbers) for numbers in place of the sizes; nothing for multiplicity 0."""
        given, text = dict(numbers), sp.sstr(self.value)
        ends = [[int(end.subs(given)) for end in index[1:]] for index in self.indices]
        for place in product(*(range(low, high + 1) for low, high in ends)):
            chosen = given | {index[0]: k for index, k in zip(self.indices, place, strict=True)}
            count = int(self.times.subs(chosen))
            if count:
                yield exact_number(text, {str(s): k for s, k in chosen.items()}), count, chosen


@dataclass(frozen=True, slots=True)
class ClosedForm:
    """The spectrum of a family: its terms, the number of nodes `size` in its symbols, and options in these symbols."""

    terms: tuple[Term, ...]
    size: sp.Expr = N
    options: Mapping[str, Any] = field(default_factory=dict)
    least: int = 1
    note: str = ""

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The symbols for which numbers are to be put, sorted by name."""
        return tuple(sorted(self.size.free_symbols, key=str))

    def at(self, **numbers: int) -> list[tuple[sp.Expr, int]]:
        """Eigenvalues and multiplicities for numbers such as n=5 or p=3, q=4; equal ones are not merged.

        Raises ValueError where a number is missing, not known or too small.
        """
        given = self._given(numbers)
        return [(value, count) for term in self.terms for value, count, _ in term.at(given)]

    def graph(self, name: str, **numbers: int) -> Topology:
        """The graph of this family for the same numbers."""
        given = self._given(numbers)
        options = {key: _filled(value, given) for key, value in self.options.items()}
        return topology(name, int(self.size.subs(given)), **options)

    def as_dict(self) -> dict[str, Any]:
        """What `synchain spectrum FAMILY --symbolic --json` prints."""
        terms = [
            {
                "value": sp.sstr(term.value),
                "multiplicity": sp.sstr(term.times),
                "indices": [[str(s), sp.sstr(low), sp.sstr(high)] for s, low, high in term.indices],
                "vector": None if term.vector is None else sp.sstr(term.vector),
            }
            for term in self.terms
        ]
        return {"n": sp.sstr(self.size), "terms": terms, "note": self.note}

    def text(self, name: str) -> str:
        """The form as lines."""
        rows = [f"{name}, n = {sp.sstr(self.size)} nodes" if self.size != N else f"{name} of n nodes"]
        for term in self.terms:
            rows.append(f"  {term.text}")
            if term.vector is not None:
                rows.append(f"    eigenvector: {sp.sstr(term.vector)} at node i = 0 … n - 1")
        return "\n".join([*rows, *([f"  {self.note}"] if self.note else [])])

    def _given(self, numbers: Mapping[str, int]) -> dict[sp.Symbol, int]:
        known = {str(symbol): symbol for symbol in self.symbols}
        if set(numbers) != set(known):
            raise ValueError(f"found numbers for {sorted(numbers)}; expected them for {sorted(known)}")
        small = next((f"{key} = {value}" for key, value in numbers.items() if value < self.least), None)
        if small is not None:
            raise ValueError(f"found {small}; expected at least {self.least}")
        return {known[key]: value for key, value in numbers.items()}


def _filled(value: Any, given: Mapping[sp.Symbol, int]) -> Any:
    return tuple(_filled(part, given) for part in value) if isinstance(value, tuple) else int(sp.S(value).subs(given))


def formulas() -> tuple[str, ...]:
    """The families that have a closed form with symbols."""
    return tuple(name for name in names() if hasattr(family(name), "formula"))


def closed_form(name: str) -> ClosedForm:
    """The spectrum of a family with symbols for its size; ValueError where it has none."""
    module = family(name)
    if not hasattr(module, "formula"):
        raise ValueError(f"topology {name}: no closed form with symbols; known for {', '.join(formulas())}")
    found: ClosedForm = module.formula()
    return found
