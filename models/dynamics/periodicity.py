"""Frequencies of the drive in the equations of a network, and their common period."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache

import sympy as sp
from sympy.core.relational import Relational
from sympy.simplify.fu import TR8

from ..mechanics.components import TIME, Edge, Node
from ..mechanics.jumps import JUMPING, KINKED, gaps_of
from .equations import Equations

HIGHEST, MOST_TIMES = 8, 64
"""Highest power of sines and cosines that is expanded into a sum, and largest divisor of a period (choices)."""

LARGEST, ROUNDING = 1000, 1e-14
"""Largest denominator of a ratio of two frequencies, and the relative rounding error of such a ratio (choices)."""


@dataclass(frozen=True, slots=True)
class Drive:
    """The drive of a network, derived from its equations."""

    waves: tuple[sp.Expr, ...] = ()  # angular frequencies of the sines and cosines of time, in the parameters
    # The right-hand side has the least period 2 pi/|frequency|; None if it is not periodic. If the values of the
    # parameters decide on periodicity, the frequency is the function `common` of the waves.
    frequency: sp.Expr | None = None
    problem: str = ""  # the reason for no period (at all or at some values), as a predicate of "the oscillator …"
    # pi over the time in which other functions of time rise and fall again: sqrt(pi)/w for exp(-(t/w)**2).
    bends: tuple[sp.Expr, ...] = ()
    gaps: tuple[sp.Expr, ...] = ()  # expressions of time that are zero where the drive jumps or has a kink
    # Arguments of functions such as tanh, which rise once near the zero of the argument, while it changes by about one.
    rises: tuple[sp.Expr, ...] = ()

    @property
    def paces(self) -> tuple[sp.Expr, ...]:
        """pi over each of the times in which the drive rises and falls again: all of `waves` and `bends`."""
        return (*self.waves, *self.bends)

    @property
    def by_values(self) -> bool:
        """True if the values of the parameters decide whether there is a period."""
        return self.frequency is not None and self.frequency.has(common)


class common(sp.Function):
    """The largest number of which all arguments other than 0 are integer multiples; nan if there is none."""

    is_real = True


def _common(*waves: float) -> float:
    """Return the value of `common`; ratios of frequencies count as rational if small integers match to rounding."""
    moving = [abs(wave) for wave in waves if wave]
    if not moving:
        return 0.0
    ratios = [Fraction(wave / moving[0]).limit_denominator(LARGEST) for wave in moving]
    if not all(math.isclose(r, wave / moving[0], rel_tol=ROUNDING) for r, wave in zip(ratios, moving, strict=True)):
        return math.nan
    return moving[0] * math.gcd(*(r.numerator for r in ratios)) / math.lcm(*(r.denominator for r in ratios))


def angular_frequency(equations: Equations) -> sp.Expr | None:
    """Return the angular frequency of the drive, None if no period is known (see `Drive`)."""
    return drive_of((*equations.nodes, *equations.edges), equations.differing).frequency


@lru_cache(maxsize=64)
def drive_of(templates: tuple[Node | Edge, ...], varied: tuple[str, ...] = ()) -> Drive:
    """Return the drive of a network."""
    if not any(template.forced for template in templates):
        return Drive(problem="is not driven")
    jumping, rising = (set[sp.Expr]().union(*map(of, templates)) for of in (gaps, rises))
    bends, zeros, turns = (tuple(sorted(e, key=sp.default_sort_key)) for e in (_bends(templates), jumping, rising))
    return replace(_periodic(templates, varied), bends=bends, gaps=zeros, rises=turns)


def _periodic(templates: tuple[Node | Edge, ...], varied: tuple[str, ...]) -> Drive:
    """Return the waves of a driven network and the largest frequency that divides all of them."""
    # Collect the frequencies of the unchanged rates. Time must occur only in sines and cosines.
    frequencies: set[sp.Expr] = set()
    modes = {row.mode.name for template in templates if isinstance(template, Node) for row in template.rows}
    rates_of = [(e, _local(template)) for template in templates for e in _off_surfaces(template, modes)]
    without = [_without_waves(e, states, frequencies) for e, states in rates_of]
    waves = tuple(sorted(frequencies, key=sp.default_sort_key))
    if any(e.has(TIME) for e in without):
        return Drive(waves, problem="depends on time other than by sines and cosines of a t + b, a constant")
    differing = sorted({s.name for wave in waves for s in wave.free_symbols} & set(varied))
    if differing:
        problem = f"is driven at a frequency that differs from node to node or link to link ({', '.join(differing)})"
        return Drive(waves, problem=problem)

    # Write products and powers as sums of waves: cos(w t)**2 has only the frequency 2 w.
    rates = [(_sum_of_waves(e), states) for e, states in rates_of if e.has(TIME)]
    summed: set[sp.Expr] = set()
    for e, states in rates:
        _without_waves(e, states, summed)
    paces = tuple(sorted(summed, key=sp.default_sort_key)) or waves
    ratios = [sp.cancel(wave / paces[0]) for wave in paces]
    other = next((wave for wave, ratio in zip(paces, ratios, strict=True) if not ratio.is_Rational), None)
    if other is not None:  # the values of the parameters decide
        return Drive(waves, common(*paces), f"is driven at {paces[0]} and {other}, which have no common period")
    share = sp.Rational(math.gcd(*(int(r.p) for r in ratios)), math.lcm(*(int(r.q) for r in ratios)))
    frequency = share * paces[0]

    # Rates such as |sin(w t)| have a shorter period: divide the period by 2, 3 and 5 as often as they repeat.
    times = 1
    for k in (2, 3, 5):
        while times < MOST_TIMES and all(_repeats(e, states, frequency, k * times) for e, states in rates):
            times *= k
    return Drive(waves, times * share * paces[0])


def _off_surfaces(template: Node | Edge, modes: set[str]) -> tuple[sp.Expr, ...]:
    """Return expressions that repeat themselves in time where all rates and events do.

    The rates on surfaces follow from those off all surfaces, from pushes and from levels, which are much shorter.
    """
    rows = template.rows if isinstance(template, Node) else ()
    of_rows = (e for row in rows for e in (row.level, row.ratio, *row.push, *(e for _, e in row.sets)))
    free = {s: sp.S.One for s in _local(template) if s.name in modes or s.name[:-2] in modes}
    return tuple(e.xreplace(free) for e in (*template.driven, *of_rows))


def _sum_of_waves(e: sp.Expr) -> sp.Expr:
    """Write products and powers of sines and cosines of time as sums; keep factors without time."""
    free: dict[sp.Basic, sp.Dummy] = {}

    def without_free(part: sp.Basic) -> sp.Basic:
        if part.has(TIME):
            return part.func(*map(without_free, part.args)) if part.args else part
        return part if part.is_Atom or not isinstance(part, sp.Expr) else free.setdefault(part, sp.Dummy(real=True))

    timed = without_free(e)
    if max((p.exp for p in timed.atoms(sp.Pow) if p.exp.is_Integer), default=0) <= HIGHEST:
        for _ in range(HIGHEST):  # a pass halves the powers
            before, timed = timed, TR8(sp.expand(timed))
            if timed == before:
                break
    return timed.xreplace({dummy: part for part, dummy in free.items()})


def _repeats(e: sp.Expr, states: set[sp.Symbol], frequency: sp.Expr, parts: int) -> bool:
    """Return True if a rate is the same 1/parts of a period later."""
    slopes = {wave: _slope(wave, states) for wave in e.atoms(sp.sin, sp.cos)}
    turns = {
        wave: 2 * sp.pi / parts * sp.cancel(slope / frequency) for wave, slope in slopes.items() if slope is not None
    }
    later = e.xreplace({wave: wave.func(sp.expand(wave.args[0]) + turn) for wave, turn in turns.items()})
    return bool(_ordered(later) == _ordered(e) or sp.expand(later - e) == 0)


def _ordered(e: sp.Expr) -> sp.Expr:
    """Write a choice of two cases with the condition that SymPy sorts first: c, or not c with the cases exchanged.

    At isolated times the result may differ.
    """

    def chosen(*cases: tuple[sp.Expr, sp.Basic]) -> sp.Expr:
        if len(cases) != 2 or cases[1][1] != sp.true or not isinstance(cases[0][1], Relational):
            return sp.Piecewise(*cases)
        (one, condition), (other, _) = cases
        gap = condition.gts - condition.lts
        turned = sp.default_sort_key(-gap) < sp.default_sort_key(gap)
        return sp.Piecewise((other, -gap > 0), (one, True)) if turned else sp.Piecewise((one, gap > 0), (other, True))

    return e.replace(sp.Piecewise, chosen)


def _local(template: Node | Edge) -> set[sp.Symbol]:
    """Return the symbols of a template that are not constant over a network: states, weights, source parameters."""
    if isinstance(template, Node):
        return set(template.state)
    states = {s for end in template.end_states for s in end}
    return {*states, template.weight, *(s for s, _ in template.theirs)}


def _without_waves(e: sp.Expr, states: set[sp.Symbol], frequencies: set[sp.Expr]) -> sp.Expr:
    """Replace each sine and cosine of a t + b by a symbol; collect the frequencies a."""

    def note(wave: sp.Expr) -> sp.Expr:
        slope = _slope(wave, states)
        if slope is None:
            return wave
        frequencies.add(slope)
        return sp.Symbol("wave")

    return e.replace(lambda a: isinstance(a, sp.sin | sp.cos) and a.has(TIME), note)


def _slope(wave: sp.Expr, states: set[sp.Symbol]) -> sp.Expr | None:
    """Return the constant a of a function of a t + b; None for any other argument."""
    if not wave.has(TIME):
        return None
    slope = sp.diff(wave.args[0], TIME)
    steady = slope != 0 and not slope.has(TIME, *states)
    return slope if steady and not sp.expand(wave.args[0] - slope * TIME).has(TIME) else None


def _bends(templates: tuple[Node | Edge, ...]) -> set[sp.Expr]:
    """Return pi over the times in which functions of time other than sines and cosines rise and fall again."""
    bends: set[sp.Expr] = set()
    for template in templates:
        states = _local(template)
        for e in template.driven:
            for part in e.atoms(sp.Function, sp.Max, sp.Min, sp.Pow, Relational):
                for inner, power in _bent(part):
                    if inner.has(TIME) and not inner.free_symbols & states:
                        bends |= set(_paces(sp.expand(inner), power, isinstance(part, sp.cosh)))
    return bends


def _bent(part: sp.Basic) -> Iterator[tuple[sp.Expr, int]]:
    """Yield the arguments of a nonlinear function, each with the power to which the function raises the argument."""
    if isinstance(part, Relational):
        yield part.lhs - part.rhs, 1
    elif isinstance(part, sp.Pow):
        if part.exp.is_negative or (part.exp.is_Integer and part.exp > 3):
            yield part.base, int(part.exp) if part.exp.is_positive else 1
    elif not isinstance(part, sp.sin | sp.cos | sp.log | sp.Piecewise):
        yield from ((a, 1) for a in part.args)


def gaps(template: Node | Edge) -> set[sp.Expr]:
    """Return expressions of time that pass zero where the rates of a template jump or have a kink."""
    parts = {part for e in template.driven for part in e.atoms(*KINKED, *JUMPING, Relational)}
    return _of_time(template, (gap for part in parts for gap in gaps_of(part)))


def rises(template: Node | Edge) -> set[sp.Expr]:
    """Return expressions of time that pass zero where a part of the rates, such as tanh, rises once and stays.

    A part that rises and falls again near one time, such as tanh**2, tanh tanh or exp(-|t|), gives two expressions.
    """
    rising: set[sp.Expr] = set()
    for e in template.driven:
        bases = [p.base for p in e.atoms(sp.Pow) if p.exp.is_number and p.exp > 1]
        for part in e.atoms(*RISING):
            zeros = set(_risen(part))
            # tanh**2, tanh*tanh and exp(-|t|) fall again after their rise: add a second expression for the fall.
            squared = any(base.has(part) for base in bases)
            multiplied = zeros and any(sum(f.has(part) for f in product.args) > 1 for product in e.atoms(sp.Mul))
            falling = {zero + 2 for zero in zeros} if part.has(sp.Abs) or squared or multiplied else set()
            rising |= zeros | falling
    return _of_time(template, rising)


def _of_time(template: Node | Edge, expressions: Iterable[sp.Expr]) -> set[sp.Expr]:
    """Select the expressions that depend on time and on no state of a template."""
    return {e for e in expressions if e.has(TIME) and not e.free_symbols & _local(template)}


RISING = (sp.tanh, sp.erf, sp.exp, sp.Pow)
"""Functions that rise once; exp counts only in 1/(c + d exp(x)) and in exp(-|x|)."""


def _risen(part: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the argument of tanh or erf, and x - log(c/d) for 1/(c + d exp(x)); without absolute values."""
    if isinstance(part, sp.Pow):
        waves = [a for a in sp.Add.make_args(part.base) if isinstance(a.as_coeff_Mul()[1], sp.exp)]
        if part.exp.is_negative and len(waves) == 1:
            factor, wave = waves[0].as_coeff_Mul()
            constant = part.base - waves[0]
            # 1/(c + d exp(x)) is halfway where c = d exp(x), at x = log(c/d).
            if factor.is_positive and constant.is_number and constant.is_positive:
                yield wave.args[0] - sp.log(constant / factor)
    elif not isinstance(part, sp.exp) or part.has(sp.Abs):
        yield part.args[0].replace(sp.Abs, lambda size: size)


def _paces(inner: sp.Expr, power: int, even: bool) -> Iterator[sp.Expr]:
    """Yield pi over the times in which a function with the argument `inner` bends.

    In such a time the phase of a wave in `inner` changes by pi.  So does a polynomial in time of degree two or more,
    or of degree one in an `even` function.
    """
    slopes = {wave: slope for wave in inner.atoms(sp.sin, sp.cos) if (slope := _slope(wave, set())) is not None}
    sizes = {wave: sp.Abs(inner.coeff(wave)) for wave in slopes}
    if sizes and not any(size.has(TIME) for size in sizes.values()):
        yield sp.sqrt(sp.pi * power * sum(sizes[wave] * slope**2 for wave, slope in slopes.items()))
    if power == 1 and inner.is_polynomial(TIME):
        polynomial = sp.Poly(inner, TIME)
        degree = polynomial.degree()
        if degree > 1 or (degree == 1 and even):
            yield sp.pi * (sp.Abs(polynomial.LC()) / sp.pi) ** sp.Rational(1, degree)


@lru_cache(maxsize=64)
def as_function(frequency: sp.Expr) -> Callable[..., float]:
    """Return a frequency as a function of numbers in the order of `names_in`; nan if undefined."""
    names = [sp.Symbol(name, real=True) for name in names_in(frequency)]
    evaluate = sp.lambdify(names, frequency, [{"common": _common}, "math"])

    # Return nan outside the domain of the frequency, such as for the square root of -1.
    def value(*parameters: float) -> float:
        try:
            return float(evaluate(*parameters))
        except (ArithmeticError, TypeError, ValueError):
            return math.nan

    return value


@lru_cache(maxsize=1024)
def names_in(frequency: sp.Expr) -> tuple[str, ...]:
    """Return the names of the parameters that a frequency depends on."""
    return tuple(sorted(s.name for s in frequency.free_symbols))


def period_of(frequency: float) -> float | None:
    """Return the period of an angular frequency; None if there is none, as at the frequency 0."""
    if not frequency:
        return None
    period = 2 * math.pi / abs(frequency)
    return period if 0.0 < period < math.inf else None
