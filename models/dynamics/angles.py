"""Angles: states in which the equations of a network are periodic."""

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
    """Return the period of each state of each kind of node, in which the equations repeat themselves.

    A state is an angle if it occurs only inside sines, cosines and tangents, as q*state + … with a rational number q.
    This must hold in the equations of its node and of all links, at the target and at the source.  Expressions are
    not simplified first.
    """
    # For each kind of node: expressions that contain its states, and the symbols of the states in these expressions.
    uses = [(kind, node.expressions, node.state) for kind, node in enumerate(equations.nodes)]
    for (target, source), edge in equations.edge_of:
        uses += [(target, edge.expressions, edge.here)]
        uses += [(source, edge.expressions, states) for states in edge.end_states[1:]]

    # For each state: periods of the waves that contain it, in units of pi; `bare`: states that occur outside of waves.
    bare = [set[int]() for _ in equations.nodes]
    turns = [[set[sp.Rational]() for _ in node.state] for node in equations.nodes]
    for kind, expressions, symbols in uses:
        number = {s: c for c, s in enumerate(symbols)}
        for s, period in _occurrences(expressions, number):
            if period is None:
                bare[kind].add(number[s])
            else:
                turns[kind][number[s]].add(period)

    def common(periods: Collection[sp.Rational]) -> float:
        """Return the smallest common multiple of rational numbers, times pi."""
        return math.pi * math.lcm(*(int(r.p) for r in periods)) / math.gcd(*(int(r.q) for r in periods))

    return tuple(
        tuple(common(periods) if periods and c not in bare[kind] else None for c, periods in enumerate(turns[kind]))
        for kind in range(len(equations.nodes))
    )


@lru_cache(maxsize=64)
def periods_of_states(equations: Equations) -> Periods:
    """Return the period of each state of the network, None for a state that is no angle; see `periods_of_kinds`."""
    by_kind, periods = periods_of_kinds(equations), dict[int, float | None]()
    for kind, places in zip(equations.kind_of, equations.places, strict=True):
        periods.update(zip(places, by_kind[kind], strict=True))
    return tuple(periods[slot] for slot in range(equations.dimension))


def _occurrences(
    expressions: Iterable[sp.Expr], symbols: Collection[sp.Symbol]
) -> Iterator[tuple[sp.Symbol, sp.Rational | None]]:
    """Yield each occurrence of a symbol with its period in units of pi; the period is None outside of sin, cos, tan."""
    waiting: list[sp.Basic] = list(expressions)
    seen = set[sp.Basic]()
    while waiting:
        e = waiting.pop()
        if e in seen:
            continue
        seen.add(e)
        if e in symbols:
            yield e, None
        # Outside of a sine, cosine or tangent: look into the arguments.
        elif (half_turns := HALF_TURNS.get(e.func)) is None:
            waiting += e.args
        else:
            # In sin(q x + …) the term q x gives x the period 2 pi/|q|; search the other terms for further waves.
            for term in sp.Add.make_args(e.args[0]):
                factor, inner = term.as_coeff_Mul()
                if inner in symbols and factor.is_Rational:
                    yield inner, half_turns / abs(factor)
                else:
                    waiting.append(term)
