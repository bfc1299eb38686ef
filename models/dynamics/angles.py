"""States in which the equations of a network are periodic: angles, of which only the value modulo a period counts."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import lru_cache

import sympy as sp

from .equations import Equations

HALF_TURNS: Mapping[type[sp.Basic], int] = {sp.sin: 2, sp.cos: 2, sp.tan: 1}
"""Periods of functions of an angle, in units of pi."""

Periods = tuple[float | None, ...]
"""The period of each state of a node; None for a state that is no angle."""


@lru_cache(maxsize=64)
def periods_of_kinds(equations: Equations) -> tuple[Periods, ...]:
    """Return the periods in which the equations repeat themselves, by kind of node and by state.

    A state is an angle if it occurs only as q*state + … within sines, cosines and tangents, with rational numbers q: in the
    equations of its node, and in those of all links as the state of the target and as that of the source.  The form of the
    equations decides; nothing is simplified.
    """
    bare = [set[int]() for _ in equations.nodes]
    turns = [[set[sp.Rational]() for _ in node.state] for node in equations.nodes]
    for kind, expressions, symbols in _uses(equations):
        number = {s: c for c, s in enumerate(symbols)}
        for s, period in _occurrences(expressions, number):
            if period is None:
                bare[kind].add(number[s])
            else:
                turns[kind][number[s]].add(period)
    return tuple(
        tuple(_common(periods) if periods and c not in bare[kind] else None for c, periods in enumerate(turns[kind]))
        for kind in range(len(equations.nodes))
    )


@lru_cache(maxsize=64)
def periods_of_states(equations: Equations) -> Periods:
    """Return the period of each state of the network, None for a state that is no angle; see `periods_of_kinds`."""
    by_kind, periods = periods_of_kinds(equations), dict[int, float | None]()
    for kind, places in zip(equations.kind_of, equations.places, strict=True):
        periods.update(zip(places, by_kind[kind], strict=True))
    return tuple(periods[slot] for slot in range(equations.dimension))


def _uses(equations: Equations) -> Iterator[tuple[int, Iterable[sp.Expr], tuple[sp.Symbol, ...]]]:
    """Yield kinds of nodes with the expressions that their states enter, and what the states are called there."""
    for kind, node in enumerate(equations.nodes):
        yield kind, node.expressions, node.state
    for (target, source), edge in equations.edge_of:
        yield target, edge.expressions, edge.here
        yield source, edge.expressions, edge.there


def _occurrences(
    expressions: Iterable[sp.Expr], symbols: Collection[sp.Symbol]
) -> Iterator[tuple[sp.Symbol, sp.Rational | None]]:
    """Yield each symbol where it occurs, with the period of that term in units of pi, None outside of such terms."""
    waiting: list[sp.Basic] = list(expressions)
    seen = set[sp.Basic]()
    while waiting:
        e = waiting.pop()
        if e in seen:
            continue
        seen.add(e)
        if e in symbols:
            yield e, None
        elif (half_turns := HALF_TURNS.get(e.func)) is None:
            waiting += e.args
        else:
            for term in sp.Add.make_args(e.args[0]):
                factor, inner = term.as_coeff_Mul()
                if inner in symbols and factor.is_Rational:
                    yield inner, half_turns / abs(factor)
                else:
                    waiting.append(term)


def _common(periods: Collection[sp.Rational]) -> float:
    """The smallest common multiple of some rational numbers, times pi."""
    return math.pi * math.lcm(*(int(r.p) for r in periods)) / math.gcd(*(int(r.q) for r in periods))
