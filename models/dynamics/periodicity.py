"""Frequencies of the drive in the equations of a network, and their common period."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ..mechanics.components import TIME, Edge, Node
from .equations import Equations

__all__ = ["Drive", "angular_frequency", "as_function", "drive_of", "names_in", "period_of"]


@dataclass(frozen=True, slots=True)
class Drive:
    """The drive of a network, derived from its equations.

    Attributes
    ----------
    waves : tuple of Expr
        Angular frequencies of the sines and cosines of time, expressions of the parameters.
    frequency : Expr or None
        The largest angular frequency of which all waves are whole multiples, so that the right-hand
        side has the period 2 pi over its absolute value; None if there is no such frequency.
    problem : str
        Why there is none, as a predicate of the oscillator.
    """

    waves: tuple[sp.Expr, ...] = ()
    frequency: sp.Expr | None = None
    problem: str = ""


def angular_frequency(equations: Equations) -> sp.Expr | None:
    """Return the angular frequency of the drive, None if no period is known (see `Drive`)."""
    return drive_of((*equations.nodes, *equations.edges), equations.varied).frequency


@lru_cache(maxsize=64)
def drive_of(templates: tuple[Node | Edge, ...], varied: tuple[str, ...] = ()) -> Drive:
    """Return the drive of a network.

    Parameters
    ----------
    templates : tuple of Node or Edge
        The templates of the nodes and links.
    varied : tuple of str
        Names of parameters that differ from node to node.
    """
    if not any(template.forced for template in templates):
        return Drive(problem="is not driven")
    waves: set[sp.Expr] = set()
    rest = [_without_waves(e, _local(template), waves) for template in templates for e in template.rhs]
    found = tuple(sorted(waves, key=sp.default_sort_key))
    if any(e.has(TIME) for e in rest):
        return Drive(found, problem="depends on time other than by sines and cosines of a t + b, a constant")
    own = sorted({s.name for wave in found for s in wave.free_symbols} & set(varied))
    if own:
        return Drive(found, problem=f"is driven at a frequency that differs from node to node ({', '.join(own)})")
    ratios = [sp.cancel(wave / found[0]) for wave in found]
    strange = next((wave for wave, ratio in zip(found, ratios, strict=True) if not ratio.is_Rational), None)
    if strange is not None:
        return Drive(found, problem=f"is driven at {found[0]} and {strange}, which have no common period")
    share = sp.Rational(math.gcd(*(int(r.p) for r in ratios)), math.lcm(*(int(r.q) for r in ratios)))
    return Drive(found, share * found[0])


def _local(template: Node | Edge) -> set[sp.Symbol]:
    """What is no constant of a whole network: the states, and what differs from link to link."""
    if isinstance(template, Node):
        return set(template.state)
    return {*template.here, *template.there, template.weight, *(s for s, _ in template.theirs)}


def _without_waves(e: sp.Expr, states: set[sp.Symbol], found: set[sp.Expr]) -> sp.Expr:
    """Replace each sine and cosine of a t + b by a symbol; collect the frequencies a."""

    def note(wave: sp.Expr) -> sp.Expr:
        phase = wave.args[0]
        slope = sp.diff(phase, TIME)
        if slope.has(TIME, *states) or slope == 0 or sp.expand(phase - slope * TIME).has(TIME):
            return wave
        found.add(slope)
        return sp.Symbol("wave")

    return e.replace(lambda a: isinstance(a, sp.sin | sp.cos) and a.has(TIME), note)


@lru_cache(maxsize=64)
def as_function(frequency: sp.Expr) -> Callable[..., float]:
    """Return a frequency as a function of numbers in the order of `names_in`; nan if undefined."""
    written = sp.lambdify([sp.Symbol(name, real=True) for name in names_in(frequency)], frequency, "math")

    def value(*numbers: float) -> float:
        try:
            return float(written(*numbers))
        except (ArithmeticError, TypeError, ValueError):
            return math.nan

    return value


def names_in(frequency: sp.Expr) -> tuple[str, ...]:
    """Names of the parameters that a frequency depends on."""
    return tuple(sorted(s.name for s in frequency.free_symbols))


def period_of(frequency: float) -> float | None:
    """Return the period of an angular frequency; None if there is none, as at the frequency 0."""
    if not frequency:
        return None
    found = 2 * math.pi / abs(frequency)
    return found if 0.0 < found < math.inf else None
