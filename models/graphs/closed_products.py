"""Closed forms of products and unions of families, with symbols for all sizes.

The rules are those of `products.py`; eigenvectors are products of those of the factors, in its
numbering of the nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import product

import sympy as sp

from . import products
from .closed_forms import NODE, ClosedForm, Term
from .topology import Topology

Joined = Callable[[Topology, Topology], Topology]


def cartesian(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Return all sums of an eigenvalue of each; common symbols get a number in the second form."""
    both = None if first.degree is None else second.degree
    first, second = _apart(first, second)
    degree = None if both is None or second.degree is None else first.degree + second.degree
    terms = _pairs(first, second, lambda a, b: a + b)
    return _joined("cartesian", products.cartesian, first, second, terms, degree)


def kronecker(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Return (a + d)(b + e) - d e for eigenvalues a, b and in-degrees d, e."""
    first, second = _apart(first, second)
    d, e = first.degree, second.degree
    if d is None or e is None:
        odd = first if d is None else second
        raise ValueError(f"kronecker: nodes of {odd.name} differ in their in-degrees; no closed form is known")
    terms = _pairs(first, second, lambda a, b: (a + d) * (b + e) - d * e)
    return _joined("kronecker", products.kronecker, first, second, terms, d * e)


def union(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Return the eigenvalues of both; eigenvectors are zero on the nodes of the other graph."""
    first, second = _apart(first, second)
    n = first.size
    terms = [
        *(_held(term, sp.Piecewise((term.vector, n > NODE), (0, True))) for term in first.terms),
        *(_held(term, sp.Piecewise((0, n > NODE), (_at(term, NODE - n), True))) for term in second.terms),
    ]
    degree = first.degree if first.degree == second.degree else None
    found = _joined("union", products.union, first, second, tuple(terms), degree)
    return replace(found, size=n + second.size)


def box(part: ClosedForm, sizes: Sequence[sp.Expr], indices: Sequence[sp.Symbol]) -> ClosedForm:
    """Return the Cartesian product of chains or rings of these sizes."""
    (n,) = part.symbols
    ((old, _, _),) = part.terms[0].indices
    parts = [renamed(part, {n: size, old: k}) for size, k in zip(sizes, indices, strict=True)]
    return reduce(lambda found, one: cartesian(one, found), reversed(parts[:-1]), parts[-1])


def counters(sizes: Sequence[sp.Expr]) -> tuple[sp.Symbol, ...]:
    """Return an index for each direction: j and k of two, else k, k1 …; none is a size."""
    taken = {str(size) for size in sizes}
    letters = ["j", "k"] if len(sizes) == 2 else ["k", *(f"k{i}" for i in range(1, 2 * len(sizes)))]
    free = [letter for letter in [*letters, "l", "m", "k0"] if letter not in taken]
    return tuple(sp.Symbol(letter, integer=True, nonnegative=True) for letter in free[: len(sizes)])


def renamed(form: ClosedForm, new: Mapping[sp.Symbol, sp.Expr]) -> ClosedForm:
    """Return the form with other symbols, or numbers, for some of its symbols."""

    def put(part: sp.Expr | None) -> sp.Expr | None:
        return None if part is None else sp.S(part).xreplace(dict(new))

    def build(numbers: Mapping[sp.Symbol, int]) -> Topology:
        return form.graph_of({old: int(new.get(old, old).subs(numbers)) for old in form.symbols})

    small = next(
        (f"{old} = {value}" for old, value in new.items() if value.is_Integer and value < form.least_of(old)), ""
    )
    if small:
        raise ValueError(f"{form.name}: found {small}; expected a larger number")
    lowest = {new.get(old, old): form.least_of(old) for old in form.symbols if not new.get(old, old).is_Integer}
    return replace(
        form,
        terms=tuple(term.replaced(new) for term in form.terms),
        size=put(form.size),
        degree=put(form.degree),
        where=put(form.where),
        lowest=lowest,
        build=build,
    )


def _apart(first: ClosedForm, second: ClosedForm) -> tuple[ClosedForm, ClosedForm]:
    """Both forms; the second with other letters for those of the first."""
    taken = {str(s) for s in _letters(first)} | {str(NODE)}
    new = {}
    for symbol in sorted(_letters(second), key=str):
        name, number = str(symbol), 2
        while name in taken:
            name, number = f"{str(symbol).rstrip('0123456789')}{number}", number + 1
        if name != str(symbol):
            new[symbol] = sp.Symbol(name, integer=True, nonnegative=True)
        taken.add(name)
    return first, renamed(second, new)


def _letters(form: ClosedForm) -> set[sp.Symbol]:
    """All symbols of a form but that of the node."""
    indices = {s for term in form.terms for s, _, _ in (*term.indices, *term.numbered)}
    return set(form.symbols).union(indices, *(term.symbols for term in form.terms))


def _pairs(first: ClosedForm, second: ClosedForm, combine: Callable[[sp.Expr, sp.Expr], sp.Expr]) -> tuple[Term, ...]:
    """A term for each pair; node i is i // n of the first graph and i mod n of the second."""
    n, found = second.size, []
    for a, b in product(first.terms, second.terms):
        vector = None
        if a.vector is not None and b.vector is not None:
            vector = _at(a, sp.floor(NODE / n)) * _at(b, sp.Mod(NODE, n))
        indices, numbered = a.indices + b.indices, a.numbered + b.numbered
        found.append(
            Term(combine(a.value, b.value), a.times * b.times, indices, vector, numbered, sp.And(a.where, b.where))
        )
    return tuple(found)


def _at(term: Term, node: sp.Expr) -> sp.Expr:
    """Another entry of the eigenvector of a term."""
    return sp.S(term.vector).xreplace({NODE: node})


def _held(term: Term, vector: sp.Expr) -> Term:
    """The term with another eigenvector, if it has one."""
    return replace(term, vector=None if term.vector is None else vector)


def _joined(
    name: str, operation: Joined, first: ClosedForm, second: ClosedForm, terms: tuple[Term, ...], degree: sp.Expr | None
) -> ClosedForm:
    lowest = {s: form.least_of(s) for form in (first, second) for s in form.symbols}
    defective = " and ".join(dict.fromkeys(form.name for form in (first, second) if form.blocks))
    return ClosedForm(
        terms,
        first.size * second.size,
        note="; ".join(filter(None, (first.note, second.note))),
        blocks=f"defective, as {defective} is; Jordan blocks are found for given sizes" if defective else "",
        degree=degree,
        where=sp.And(first.where, second.where),
        lowest=lowest,
        name=f"{name}({first.name}, {second.name})",
        build=lambda numbers: operation(first.graph_of(numbers), second.graph_of(numbers)),
    )
