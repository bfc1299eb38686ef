"""Closed forms of products and unions of families, with symbols for all sizes.

`graph_products.py` states the rules and the numbering of the nodes.  Each eigenvector of a product is the
Kronecker product of eigenvectors of the factors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import product

import sympy as sp

from . import graph_products
from .closed_forms import NODE, ClosedForm, Term
from .topology import Topology

Joined = Callable[[Topology, Topology], Topology]


def cartesian(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Return all sums a + b of eigenvalues of the factors; symbols common to both are renamed in the second."""
    second = _apart(first, second)
    degree = None if first.degree is None or second.degree is None else first.degree + second.degree
    return _joined(graph_products.cartesian, first, second, _pairs(first, second, lambda a, b: a + b), degree)


def kronecker(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Return (a + d)(b + e) - d e for eigenvalues a, b and in-degrees d, e."""
    second = _apart(first, second)
    d, e = first.degree, second.degree
    if d is None or e is None:
        odd = first if d is None else second
        raise ValueError(f"kronecker: nodes of {odd.name} differ in their in-degrees; no closed form is known")
    terms = _pairs(first, second, lambda a, b: (a + d) * (b + e) - d * e)
    return _joined(graph_products.kronecker, first, second, terms, d * e)


def union(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Return the eigenvalues of both graphs; each eigenvector is zero on the nodes of the other graph."""
    second = _apart(first, second)
    n = first.size
    terms: list[Term] = []
    for term in (*first.terms, *second.terms):
        vector = term.vector
        if vector is not None and len(terms) < len(first.terms):
            vector = sp.Piecewise((vector, n > NODE), (0, True))
        elif vector is not None:
            vector = sp.Piecewise((0, n > NODE), (_at(term, NODE - n), True))
        terms.append(replace(term, vector=vector))
    degree = first.degree if first.degree == second.degree else None
    return replace(_joined(graph_products.union, first, second, tuple(terms), degree), size=n + second.size)


def box(part: ClosedForm, sizes: Sequence[sp.Expr], indices: Sequence[sp.Symbol]) -> ClosedForm:
    """Return the closed-form spectrum of a Cartesian product of chains or rings (grid, torus)."""
    # `indices` are the indices of the eigenvalue in each direction.
    (n,) = part.symbols
    ((old, _, _),) = part.terms[0].indices
    parts = [renamed(part, {n: size, old: k}) for size, k in zip(sizes, indices, strict=True)]
    return reduce(lambda later, earlier: cartesian(earlier, later), reversed(parts[:-1]), parts[-1])


def counters(sizes: Sequence[sp.Expr]) -> tuple[sp.Symbol, ...]:
    """Choose an index for each direction, j and k for two, else k, k1 …, distinct from the letters of sizes."""
    taken = {str(size) for size in sizes}
    letters = ["j", "k"] if len(sizes) == 2 else ["k", *(f"k{i}" for i in range(1, 2 * len(sizes)))]
    free = [letter for letter in [*letters, "l", "m", "k0"] if letter not in taken]
    return tuple(sp.Symbol(letter, integer=True, nonnegative=True) for letter in free[: len(sizes)])


def renamed(form: ClosedForm, new: Mapping[sp.Symbol, sp.Expr]) -> ClosedForm:
    def put(part: sp.Expr | None) -> sp.Expr | None:
        return None if part is None else sp.S(part).xreplace(dict(new))

    def build(numbers: Mapping[sp.Symbol, int]) -> Topology:
        return form.graph_of({old: int(new.get(old, old).subs(numbers)) for old in form.symbols})

    for old, value in new.items():
        if value.is_Integer and value < form.least_of(old):
            raise ValueError(f"{form.name}: found {old} = {value}; expected a larger number")
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


def _apart(first: ClosedForm, second: ClosedForm) -> ClosedForm:
    """Rename the symbols of the second form that the first form uses too."""
    # k becomes k2, k3, … until no symbol of the first form, nor the node, has that name
    taken = {str(s) for s in _letters(first)} | {str(NODE)}
    new = {}
    for symbol in sorted(_letters(second), key=str):
        name, number = str(symbol), 2
        while name in taken:
            name, number = f"{str(symbol).rstrip('0123456789')}{number}", number + 1
        if name != str(symbol):
            new[symbol] = sp.Symbol(name, integer=True, nonnegative=True)
        taken.add(name)
    return renamed(second, new)


def _letters(form: ClosedForm) -> set[sp.Symbol]:
    """Return all symbols of a form, except NODE."""
    indices = {s for term in form.terms for s, _, _ in (*term.indices, *term.numbered)}
    return set(form.symbols).union(indices, *(term.symbols for term in form.terms))


def _pairs(first: ClosedForm, second: ClosedForm, combine: Callable[[sp.Expr, sp.Expr], sp.Expr]) -> tuple[Term, ...]:
    """Combine each pair of terms; node i is the pair (i // n, i mod n), n the size of the second graph."""
    n, terms = second.size, []
    for a, b in product(first.terms, second.terms):
        vector = None
        if a.vector is not None and b.vector is not None:
            vector = _at(a, sp.floor(NODE / n)) * _at(b, sp.Mod(NODE, n))
        terms.append(
            Term(
                combine(a.value, b.value),
                a.times * b.times,
                a.indices + b.indices,
                vector,
                a.numbered + b.numbered,
                sp.And(a.where, b.where),
            )
        )
    return tuple(terms)


def _at(term: Term, node: sp.Expr) -> sp.Expr:
    """Return the entry of a term's eigenvector at the node with the number `node`."""
    return sp.S(term.vector).xreplace({NODE: node})


def _joined(
    operation: Joined, first: ClosedForm, second: ClosedForm, terms: tuple[Term, ...], degree: sp.Expr | None
) -> ClosedForm:
    """Build the closed form of an operation of `products` from its terms; it has first.size * second.size nodes."""
    defective = " and ".join(dict.fromkeys(form.name for form in (first, second) if form.blocks))
    return ClosedForm(
        terms,
        first.size * second.size,
        note="; ".join(filter(None, (first.note, second.note))),
        blocks=f"defective, as {defective} is; Jordan blocks are found for given sizes" if defective else "",
        degree=degree,
        where=sp.And(first.where, second.where),
        lowest={s: form.least_of(s) for form in (first, second) for s in form.symbols},
        name=f"{operation.__name__}({first.name}, {second.name})",
        build=lambda numbers: operation(first.graph_of(numbers), second.graph_of(numbers)),
    )
