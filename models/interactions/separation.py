"""Write the rate of a link as a finite sum of products: a function of the target times a function of the source.

On a complete graph such a link is a mean field: one loop over the nodes sums the functions of the source, and a second
loop applies the sums (Kuramoto, Chemical Oscillations, Waves, and Turbulence, Springer, 1984, section 5.4, for the
sine).  On any other graph each function is computed once for each node, and a link costs only the products.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ..mechanics.components import Edge

MOST_PRODUCTS = 32
"""Most products in the rate of one state, and highest power of a sum that is expanded (a choice)."""

ADDITION_THEOREMS: dict[type[sp.Expr], Callable[[sp.Expr, sp.Expr], tuple[tuple[sp.Expr, sp.Expr], ...]]] = {
    sp.sin: lambda a, b: ((sp.sin(a), sp.cos(b)), (sp.cos(a), sp.sin(b))),
    sp.cos: lambda a, b: ((sp.cos(a), sp.cos(b)), (-sp.sin(a), sp.sin(b))),
    sp.sinh: lambda a, b: ((sp.sinh(a), sp.cosh(b)), (sp.cosh(a), sp.sinh(b))),
    sp.cosh: lambda a, b: ((sp.cosh(a), sp.cosh(b)), (sp.sinh(a), sp.sinh(b))),
    sp.exp: lambda a, b: ((sp.exp(a), sp.exp(b)),),
}
"""Addition theorems: f(a + b) as a sum of products."""

_SLOPES = {sp.sin: (sp.cos, 1), sp.cos: (sp.sin, -1)}
"""The derivatives of waves, with their signs: f(x + lag) = cos(lag) f(x) + sin(lag) f'(x)."""

Symbols = frozenset[sp.Symbol]

Products = dict[tuple[sp.Expr, sp.Expr], sp.Expr]
"""A sum of products: for each pair (function of target, function of source) a coefficient common to all nodes."""


@dataclass(frozen=True, slots=True)
class Separated:
    """A link between all pairs of nodes as sums of products."""

    # For each state of the target the terms of its rate: coefficient, function of the target, function of the source.
    products: tuple[tuple[tuple[sp.Expr, sp.Expr, sp.Expr], ...], ...]
    own: tuple[sp.Expr, ...]  # rates of a link from a node to itself, to be subtracted from the sum over all nodes
    # States that occur only in differences. They may be measured from the state of one node, so that sums of powers and
    # exponentials do not lose digits when all nodes have moved far from the origin.
    shifted: tuple[int, ...]

    @property
    def sources(self) -> tuple[sp.Expr, ...]:
        """The distinct functions of the source."""
        return tuple(dict.fromkeys(source for row in self.products for _, _, source in row))


@dataclass(frozen=True, slots=True)
class Summed:
    """A link on any graph as products that are summed over the links of a node, and a remainder."""

    # For each state of the target the terms of its rate: coefficient common to all links, factor of the single link,
    # function of the target, function of the source.
    products: tuple[tuple[tuple[sp.Expr, sp.Expr, sp.Expr, sp.Expr], ...], ...]
    rest: tuple[sp.Expr, ...]  # for each state the remaining terms of the rate

    @property
    def sources(self) -> tuple[sp.Expr, ...]:
        """The distinct functions of the source."""
        return tuple(dict.fromkeys(source for row in self.products for *_, source in row if source != 1))


@lru_cache(maxsize=64)
def summed(edge: Edge, varied: tuple[str, ...] = (), numbered: tuple[str, ...] = ()) -> Summed | None:
    """Write the terms of a link with sines and cosines as products; return None if there is no such term.

    Sines and cosines are bounded, so the addition theorems cost at most a rounding error of the rate.  Powers and
    exponentials of differences stay in the remainder, because far from the origin their products are large and cancel.
    """
    if edge.inertia or edge.oriented or edge.forced or edge.beyond:
        return None
    source = frozenset((*edge.there, *(s for s, _ in edge.theirs)))
    target = frozenset((*edge.here, *(s for s in edge.parameters if s.name in varied)))
    of_link = (edge.weight, *(s for s in edge.parameters if s.name in numbered))
    rows, remainders = [], []
    for e in edge.rhs:
        row, remainder = [], []
        for term in sp.Add.make_args(e):
            products = _products(term, target, source, bounded=True)
            functions = [f for pair in products or () for f in pair]
            curved = any(not f.is_polynomial(*target, *source) for f in functions)
            alike = not any(f.has(*of_link) for f in functions)  # the same function for all links
            if curved and alike and products and _vanishes(term - sum(c * a * b for (a, b), c in products.items())):
                row += [(*c.as_independent(*of_link, as_Add=False), a, b) for (a, b), c in products.items()]
            else:
                remainder.append(term)
        rows.append(tuple(row))
        remainders.append(sp.Add(*remainder))
    return Summed(tuple(rows), tuple(remainders)) if any(rows) else None


@lru_cache(maxsize=64)
def separated(edge: Edge, varied: tuple[str, ...] = ()) -> Separated | None:
    """Return a link as sums of products; None unless the difference from the link is proved to be zero."""
    if edge.inertia or edge.oriented or edge.beyond:
        return None
    # Symbols of the source, and of the target with parameters that differ from node to node.
    theirs = dict(edge.theirs)
    source = frozenset((*edge.there, *theirs))
    target = frozenset((*edge.here, *(s for s in edge.parameters if s.name in varied)))
    rows = []
    for e in edge.rhs:
        row = _products(e, target, source)
        if row is None or len(row) > MOST_PRODUCTS or not _vanishes(e - sum(c * a * b for (a, b), c in row.items())):
            return None
        rows.append(tuple((c, a, b) for (a, b), c in row.items()))
    # The sum over all nodes includes h(s, s), the term of the node with itself.
    itself = {**dict(zip(edge.there, edge.here, strict=True)), **theirs}
    own = tuple(e.xreplace(itself) for e in edge.rhs)
    return Separated(tuple(rows), own, _shifted(edge, {b for row in rows for _, _, b in row}))


def _products(e: sp.Expr, target: Symbols, source: Symbols, bounded: bool = False) -> Products | None:
    """Write an expression as a sum of products; None if no rule applies. `bounded`: only of sines and cosines."""
    # A constant, or a function of one end, is already a product.
    here, there = bool(e.free_symbols & target), bool(e.free_symbols & source)
    if not here and not there:
        return {(sp.S.One, sp.S.One): e} if e != 0 else {}
    if e.is_Mul:
        product: Products | None = {(sp.S.One, sp.S.One): sp.S.One}
        for part in e.args:
            product = _times(product, _products(part, target, source, bounded))
        return product
    if not there:
        return {(e, sp.S.One): sp.S.One}
    if e.is_Add and not bounded:
        return _sum([_products(part, target, source) for part in e.args])
    if not here:
        return {(sp.S.One, e): sp.S.One}
    states = target | source
    # Separate a sum term by term if no term is a polynomial of states.
    if e.is_Add and not any(part.free_symbols & states and part.is_polynomial(*states) for part in e.args):
        return _sum([_products(part, target, source, bounded) for part in e.args])
    if bounded and e.func not in _SLOPES:
        return None
    if e.is_Pow and e.exp.is_Integer and 1 < e.exp <= MOST_PRODUCTS:
        base = _products(e.base, target, source)
        power: Products | None = {(sp.S.One, sp.S.One): sp.S.One}
        for _ in range(int(e.exp)):
            power = _times(power, base)
        return power
    return _by_theorem(e, target, source)


def _by_theorem(e: sp.Expr, target: Symbols, source: Symbols) -> Products | None:
    """Apply the addition theorem to f(own + theirs + lag): terms of the target, of the source, and of neither."""
    theorem = ADDITION_THEOREMS.get(e.func)
    if theorem is None:
        return None
    terms = sp.Add.make_args(sp.expand(e.args[0]))
    theirs = sp.Add(*(part for part in terms if part.free_symbols & source))
    own = sp.Add(*(part for part in terms if part.free_symbols & target))
    lag = sp.Add(*terms) - theirs - own
    if theirs.free_symbols & target:
        return None
    if e.func not in _SLOPES:
        return _sum([_one(sp.S.One, a, b) for a, b in theorem(own + lag, theirs)])
    # cos(lag) and sin(lag) become coefficients, so that a lag costs nothing at the nodes.
    slope, sign = _SLOPES[e.func]
    turned = ((sp.cos(lag), e.func), (sign * sp.sin(lag), slope))
    return _sum([_one(c, a, b) for c, wave in turned for a, b in ADDITION_THEOREMS[wave](own, theirs)])


def _one(c: sp.Expr, a: sp.Expr, b: sp.Expr) -> Products:
    """Return one product; move numerical factors of both functions into the coefficient."""
    (p, a), (q, b) = a.as_coeff_Mul(), b.as_coeff_Mul()
    return {(a, b): p * q * c}


def _sum(parts: list[Products | None]) -> Products | None:
    total: Products = {}
    for part in parts:
        if part is None:
            return None
        for key, c in part.items():
            total[key] = total.get(key, sp.S.Zero) + c
    return {key: c for key, c in total.items() if c != 0}


def _times(left: Products | None, right: Products | None) -> Products | None:
    if left is None or right is None or len(left) * len(right) > MOST_PRODUCTS**2:
        return None
    return _sum([_one(c * d, a * g, b * h) for (a, b), c in left.items() for (g, h), d in right.items()])


def _vanishes(e: sp.Expr) -> bool:
    """Return True if an expression, written in exponentials and expanded, is 0."""
    return bool(sp.expand(e.rewrite([sp.sin, sp.cos, sp.sinh, sp.cosh], sp.exp)) == 0)


def _shifted(edge: Edge, sources: set[sp.Expr]) -> tuple[int, ...]:
    """Return the states whose common shift does not change the link; skip states only inside sines and cosines."""
    distance = sp.Dummy("shift", real=True)
    shifted = []
    for k, (here, there) in enumerate(zip(edge.here, edge.there, strict=True)):
        # Sines and cosines are bounded: states in them alone need no shift.
        waves = {wave: sp.Dummy(real=True) for b in sources for wave in b.atoms(sp.sin, sp.cos)}
        if not any(b.xreplace(waves).has(there) for b in sources):
            continue
        moved: Mapping[sp.Expr, sp.Expr] = {here: here + distance, there: there + distance}
        if all(_vanishes(e.xreplace(moved) - e) for e in edge.rhs):
            shifted.append(k)
    return tuple(shifted)
