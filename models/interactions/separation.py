"""Links whose rates are finite sums of products: a function of the target times a function of the source.

Between all pairs of nodes such a link needs the sums of its source functions alone, a mean field: one loop over the nodes
adds them up, another one applies them (Y. Kuramoto, Chemical Oscillations, Waves, and Turbulence, Springer, 1984, section
5.4, for the sine).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ..mechanics.components import Edge

__all__ = ["MOST_PRODUCTS", "Separated", "separated"]

MOST_PRODUCTS = 32
"""Most products in the rate of one state, and highest power of a sum that is multiplied out."""

_THEOREMS: dict[type[sp.Expr], Callable[[sp.Expr, sp.Expr], tuple[tuple[sp.Expr, sp.Expr], ...]]] = {
    sp.sin: lambda a, b: ((sp.sin(a), sp.cos(b)), (sp.cos(a), sp.sin(b))),
    sp.cos: lambda a, b: ((sp.cos(a), sp.cos(b)), (-sp.sin(a), sp.sin(b))),
    sp.sinh: lambda a, b: ((sp.sinh(a), sp.cosh(b)), (sp.cosh(a), sp.sinh(b))),
    sp.cosh: lambda a, b: ((sp.cosh(a), sp.cosh(b)), (sp.sinh(a), sp.sinh(b))),
    sp.exp: lambda a, b: ((sp.exp(a), sp.exp(b)),),
}
"""Addition theorems: f(a + b) as a sum of products."""

Symbols = frozenset[sp.Symbol]

Products = dict[sp.Expr, sp.Expr]
"""Functions of the target by the functions of the source that they are multiplied with."""


@dataclass(frozen=True, slots=True)
class Separated:
    """A link as sums of products.

    Parameters
    ----------
    sources : tuple of Expr
        Functions of the source, and of what all nodes share.
    factors : tuple of tuple of Expr
        For each state of the target the functions of the target that multiply these.
    own : tuple of Expr
        What the link would add between a node and itself: a sum over all nodes has it too much.
    shifted : tuple of int
        States of which the link feels differences alone.  All values of such a state may be counted from that of one node,
        so that sums of powers and of exponentials keep their digits however far all nodes have moved together.
    """

    sources: tuple[sp.Expr, ...]
    factors: tuple[tuple[sp.Expr, ...], ...]
    own: tuple[sp.Expr, ...]
    shifted: tuple[int, ...]


@lru_cache(maxsize=64)
def separated(edge: Edge, varied: tuple[str, ...] = ()) -> Separated | None:
    """Return a link as sums of products, None if none is found; the expanded difference is proved to be zero.

    Parameters
    ----------
    edge : Edge
        What a link adds.
    varied : tuple of str
        Parameters that have a value for each node.
    """
    if edge.inertia or edge.oriented:
        return None
    theirs = dict(edge.theirs)
    source = frozenset((*edge.there, *theirs))
    target = frozenset((*edge.here, *(s for s in edge.parameters if s.name in varied)))
    found = [_products(e, target, source) for e in edge.rhs]
    if any(products is None or len(products) > MOST_PRODUCTS for products in found):
        return None
    rows = [products for products in found if products is not None]
    if not all(_vanishes(e - sum(a * b for b, a in row.items())) for e, row in zip(edge.rhs, rows, strict=True)):
        return None
    sources = tuple(dict.fromkeys(b for row in rows for b in row))
    factors = tuple(tuple(row.get(b, sp.S.Zero) for b in sources) for row in rows)
    itself = {**dict(zip(edge.there, edge.here, strict=True)), **theirs}
    return Separated(sources, factors, tuple(e.xreplace(itself) for e in edge.rhs), _shifted(edge, sources))


def _products(e: sp.Expr, target: Symbols, source: Symbols) -> Products | None:
    """An expression as a sum of products, None if it is not seen to be one."""
    if not e.free_symbols & source:
        return {sp.S.One: e}
    if e.is_Add:
        return _sum([_products(part, target, source) for part in e.args])
    if e.is_Mul:
        found: Products | None = {sp.S.One: sp.S.One}
        for part in e.args:
            found = _times(found, _products(part, target, source))
        return found
    if not e.free_symbols & target:
        return _scaled(e, sp.S.One)
    if e.is_Pow and e.exp.is_Integer and 1 < e.exp <= MOST_PRODUCTS:
        base, found = _products(e.base, target, source), {sp.S.One: sp.S.One}
        for _ in range(int(e.exp)):
            found = _times(found, base)
        return found
    return _by_theorem(e, target, source)


def _by_theorem(e: sp.Expr, target: Symbols, source: Symbols) -> Products | None:
    """A function with an addition theorem whose argument is a function of the target plus one of the source."""
    theorem = _THEOREMS.get(e.func)
    if theorem is None:
        return None
    terms = sp.Add.make_args(sp.expand(e.args[0]))
    theirs = sp.Add(*(part for part in terms if part.free_symbols & source))
    own = sp.Add(*terms) - theirs
    if theirs.free_symbols & target:
        return None
    return _sum([_scaled(b, _without_lag(a, target)) for a, b in theorem(own, theirs)])


def _without_lag(e: sp.Expr, target: Symbols) -> sp.Expr:
    """A sine or cosine with what all nodes share in its argument as a factor: sin(x + a) = cos a sin x + sin a cos x."""
    wave = next(iter(e.atoms(sp.sin, sp.cos)), None)
    if wave is None:
        return e
    terms = sp.Add.make_args(wave.args[0])
    lag = sp.Add(*(part for part in terms if not part.free_symbols & target))
    if lag == 0:
        return e
    return e.xreplace({wave: sum(a * b for a, b in _THEOREMS[wave.func](sp.Add(*terms) - lag, lag))})


def _scaled(b: sp.Expr, a: sp.Expr) -> Products:
    """One product; a number in front of the source's function belongs to the target's."""
    number, rest = b.as_coeff_Mul()
    return {rest: number * a}


def _sum(parts: list[Products | None]) -> Products | None:
    total: Products = {}
    for part in parts:
        if part is None:
            return None
        for b, a in part.items():
            total[b] = total.get(b, sp.S.Zero) + a
    return {b: a for b, a in total.items() if a != 0}


def _times(left: Products | None, right: Products | None) -> Products | None:
    if left is None or right is None or len(left) * len(right) > MOST_PRODUCTS**2:
        return None
    return _sum([{b * d: a * c} for b, a in left.items() for d, c in right.items()])


def _vanishes(e: sp.Expr) -> bool:
    """True if an expression is proved to be zero: its expansion in exponentials has no term."""
    return bool(sp.expand(e.rewrite([sp.sin, sp.cos, sp.sinh, sp.cosh], sp.exp)) == 0)


def _shifted(edge: Edge, sources: tuple[sp.Expr, ...]) -> tuple[int, ...]:
    """States whose common shift changes nothing, but those that enter sines and cosines alone, which stay small."""
    distance = sp.Dummy("shift", real=True)
    found = []
    for k, (here, there) in enumerate(zip(edge.here, edge.there, strict=True)):
        waves = {wave: sp.Dummy(real=True) for b in sources for wave in b.atoms(sp.sin, sp.cos)}
        if not any(b.xreplace(waves).has(there) for b in sources):
            continue
        moved: Mapping[sp.Expr, sp.Expr] = {here: here + distance, there: there + distance}
        if all(_vanishes(e.xreplace(moved) - e) for e in edge.rhs):
            found.append(k)
    return tuple(found)
