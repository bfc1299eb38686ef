"""Friction laws, and the jump of a law at rest: smoothed, or as it is.

As it is, an oscillator sticks to its ground or slips over it in one of two directions.  A set-valued law says: while the
surfaces slide with w > 0 the friction coefficient is f(w), with w < 0 it is f(w) of the other sign, and at w = 0 it is
whatever holds the body, up to the static coefficient.  The equations carry a third state of each oscillator, its mode
`slip`: +1 and -1 while it slips with w > 0 and w < 0, 0 while it sticks.  Between events the mode does not change, and
every right-hand side is smooth.

Sources: Filippov, Differential Equations with Discontinuous Righthand Sides (Kluwer, 1988); Leine, van Campen, de Kraker
& van den Steen, Nonlinear Dynamics 16, 41 (1998).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import sympy as sp

from ..inputs.frozen import FrozenDict
from ..inputs.words import Word
from .jumps import rough_at
from .parameter import Parameter


class ContactModel(Word):
    """How the jump of a friction law at rest is treated."""

    ATAN = "atan"
    """Smoothed by the arcus tangent."""
    SIGN = "sign"
    """Left as it is, with sign(0) = 0."""
    SET_VALUED = "set-valued"
    """Stick and slip."""


KAPPA = Parameter(1e5, "s/m", "steepness of the regularised jump, sgn w = (2/pi) atan(kappa w)", positive=True)

SLIDING = sp.Symbol("w", real=True)
"""The sliding velocity, the argument of a friction law."""

SLIP = sp.Symbol("slip", real=True)
"""The mode of an oscillator: +1 or -1 while it slips, 0 while it sticks."""

TINY, SMALL = sp.Rational(1, 10**30), 1e-6
"""A sliding velocity next to none, and a coefficient that is larger only where a law jumps."""


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """The friction coefficient as a function of the sliding velocity.  Equal contents make equal laws.

    Parameters
    ----------
    name : str
        What messages and scene files call it.
    parameters : mapping of str to Parameter
        Parameters of the law, real symbols in its expressions.
    force : Expr
        Friction force over normal load, of the velocity w (`SLIDING`) of the ground relative to the body; w f(w) >= 0.
        Its jump at w = 0 is written with sign.
    static : Expr, optional
        The static friction coefficient if it exceeds f(0+); only set-valued contact knows it.
    order : tuple of (str, str)
        Pairs of parameters of which the first must not exceed the second under set-valued contact.
    self_exciting : bool
        True if the law is meant to feed energy.
    summary, source : str
        What it is, and where it was published.

    Raises
    ------
    ValueError
        If the force jumps at w = 0 by more than its signs do.
    """

    name: str
    parameters: FrozenDict[Parameter]
    force: sp.Expr
    static: sp.Expr | None = None
    order: tuple[tuple[str, str], ...] = ()
    self_exciting: bool = False
    summary: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if _jump(regularise(self.force, SLIDING, sp.S.One), SLIDING):
            raise ValueError(
                f"friction law {self.name!r}: found a jump at w = 0 in {self.force} that is not written with sign(w); "
                "expected it as in mu*sign(w)"
            )

    def __str__(self) -> str:
        return self.name

    @property
    def jumps(self) -> bool:
        """True if friction jumps at rest; without a jump nothing sticks."""
        return self.static is not None or _jump(self.force, SLIDING)


def regularise(law: sp.Expr, argument: sp.Symbol, kappa: sp.Expr) -> sp.Expr:
    """Replace every sign(w) that holds the argument by (2/pi) atan(kappa w).

    The slope at w = 0 becomes 2 kappa/pi, and for |w| >> 1/kappa the error is 2/(pi kappa |w|).

    References
    ----------
    Marszal et al., Eur. Phys. J. Special Topics (2016), eq. 5.
    """
    return law.replace(sp.sign, lambda w: 2 * sp.atan(kappa * w) / sp.pi if w.has(argument) else sp.sign(w))


def _jump(e: sp.Expr, argument: sp.Symbol) -> bool:
    """True if an expression jumps where its argument passes zero; other symbols are numbers without a meaning."""
    others = sorted(e.free_symbols - {argument}, key=str)
    numbers = {symbol: sp.Rational(2 * k + 3, 2 * k + 5) for k, symbol in enumerate(others)}
    above, below = (complex(e.xreplace({**numbers, argument: w}).evalf(60)) for w in (TINY, -TINY))
    return abs(above - below) > SMALL


@dataclass(frozen=True, slots=True)
class Contact:
    """What decides between stick and slip, in the symbols of a node.

    speed: velocity of the ground; sliding: the sliding velocity w; up, down: accelerations under the largest static
    friction in either direction, and pushed, pulled: those at which slip with w > 0 and w < 0 begins, all at the ground's
    velocity. A body sticks while down <= 0 <= up.
    """

    speed: sp.Expr
    sliding: sp.Expr
    up: sp.Expr
    down: sp.Expr
    pushed: sp.Expr
    pulled: sp.Expr
    shown: sp.Expr

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Contact:
        """The same with every expression changed."""
        return Contact(*(change(e) for e in self.expressions))

    def under(self, force: sp.Expr) -> Contact:
        """The same if a further force acts on the body, unit mass."""
        pushes = (e + force for e in (self.up, self.down, self.pushed, self.pulled, self.shown))
        return Contact(self.speed, self.sliding, *pushes)

    def gaps(self, mode: sp.Symbol) -> tuple[sp.Expr, sp.Expr]:
        """What is positive while the contact keeps its mode: in slip the sliding velocity along it, twice, in stick the
        distances of the load from the limits of static friction.
        """
        sliding, stuck = mode * self.sliding, 1 - mode**2
        return sliding + stuck * self.up, sliding - stuck * self.down

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All of them, in the order of the fields."""
        return self.speed, self.sliding, self.up, self.down, self.pushed, self.pulled, self.shown

    @property
    def jumps(self) -> bool:
        """True if the static coefficient exceeds that of slow slip, so that slip begins with a jump of
        acceleration."""
        return bool(sp.simplify(self.up - self.pushed) != 0 or sp.simplify(self.down - self.pulled) != 0)


def set_valued(
    acceleration: sp.Expr,
    friction: sp.Function,
    law: sp.Expr,
    argument: sp.Symbol,
    static: sp.Expr | None,
    place: sp.Symbol,
    velocity: sp.Symbol,
) -> tuple[sp.Expr, Contact]:
    """Return the acceleration in all modes and the contact conditions."""
    applied = sorted(acceleration.atoms(friction), key=str)
    if len(applied) != 1:
        raise ValueError(f"set-valued contact: friction acts {len(applied)} times in {acceleration}; expected once")
    sliding = sp.expand(applied[0].args[0])
    speed = _ground(sliding, place, velocity)
    moving = _moving(law, argument)
    slow = _at_rest(moving, argument)
    largest = slow if static is None else static
    if largest == 0:
        raise ValueError(
            f"set-valued contact: the law {law.xreplace({argument: SLIDING})} has no jump at w = 0, so nothing sticks; use contact 'atan'"
        )
    hidden = sp.Dummy("f", real=True)
    plain = acceleration.xreplace({applied[0]: hidden})
    load = plain.diff(hidden)
    if load.has(hidden):
        raise ValueError(f"set-valued contact: friction acts nonlinearly in {acceleration}; expected a multiple of it")
    if load.has(velocity):
        raise ValueError(
            f"set-valued contact: found friction under the load {load}, which depends on the velocity {velocity}; expected a load of places and time"
        )
    at_rest = plain.xreplace({velocity: speed})
    up, down = (at_rest.xreplace({hidden: sign * largest}) for sign in (1, -1))
    pushed, pulled = (at_rest.xreplace({hidden: sign * slow}) for sign in (1, -1))
    shown = plain.xreplace({hidden: law.xreplace({argument: sliding})})
    rate = plain.xreplace({hidden: _beyond_rest(moving, argument).xreplace({argument: sliding})})
    return rate, Contact(speed, sliding, up, down, pushed, pulled, shown)


def _ground(sliding: sp.Expr, place: sp.Symbol, velocity: sp.Symbol) -> sp.Expr:
    """The velocity at which the sliding velocity is zero; ValueError if that is no constant, or it does not fall."""
    slope = sliding.diff(velocity)
    if not (slope.is_number and slope.is_negative):
        raise ValueError(f"set-valued contact: the sliding velocity {sliding} must fall with {velocity}, linearly")
    speed = sp.solve(sliding, velocity)[0]
    for symbol in (place, sp.Symbol("t", real=True)):
        if speed.has(symbol):
            raise ValueError(
                f"set-valued contact: found a ground with the velocity {speed}, which changes with {symbol}; "
                "expected a ground of constant velocity; use contact 'atan'"
            )
    return speed


def _moving(law: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """The law in slip, with the mode for the sign of its argument; ValueError if it is not odd or not smooth at zero."""
    what, speed = f"set-valued contact: the law {law.xreplace({argument: SLIDING})}", sp.Dummy("w", positive=True)
    both = sp.simplify(law.xreplace({argument: speed}) + law.xreplace({argument: -speed}))
    if both != 0:
        raise ValueError(f"{what} has f(w) + f(-w) = {both.xreplace({speed: SLIDING})}; expected 0, an odd law")
    moving = _by_mode(law, argument)
    slipping = moving.xreplace({SLIP: sp.S.One})
    if _at_rest(slipping, argument).has(sp.nan, sp.zoo, sp.oo, -sp.oo):
        raise ValueError(f"{what} has no finite value at w = 0; expected one for slow slip")
    if _jump(slipping, argument) or rough_at(slipping, {argument: sp.S.Zero}, [argument]) is not None:
        raise ValueError(f"{what} has another kink at w = 0 than sign(w) and |w| have; expected these alone")
    return moving


def _at_rest(moving: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """The limit of a law in slip as w falls to zero: powers of w with a letter as exponent, which is positive, go to zero."""
    speed = sp.Dummy("w", positive=True)
    above = moving.xreplace({argument: speed, SLIP: sp.S.One})
    powers = {p: sp.S.Zero for p in _powers_from_zero(above, speed) if not p.exp.is_number}
    return above.xreplace(powers).xreplace({speed: sp.S.Zero})


def _powers_from_zero(e: sp.Expr, argument: sp.Symbol) -> list[sp.Pow]:
    """The powers in an expression that are no polynomials and whose base is zero with the argument."""
    powers = (p for p in e.atoms(sp.Pow) if not p.exp.is_integer and p.base.has(argument))
    return [p for p in powers if p.base.xreplace({argument: sp.S.Zero}) == 0]


def _beyond_rest(moving: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """The law in slip with |w|**p for (s w)**p, which has no value where trial steps go past rest."""
    powers = _powers_from_zero(moving, argument)
    return moving.xreplace({p: sp.Abs(p.base.xreplace({SLIP: sp.S.One})) ** p.exp for p in powers})


def _by_mode(e: sp.Basic, argument: sp.Symbol) -> sp.Basic:
    """An expression with the mode for the signs that follow that of its argument; others stay."""
    if isinstance(e, sp.Abs | sp.sign):
        return sp.Mul(
            *(_factor_by_mode(e.func, factor, argument) for factor in sp.Mul.make_args(sp.factor_terms(e.args[0])))
        )
    return e.func(*(_by_mode(part, argument) for part in e.args)) if e.args else e


def _factor_by_mode(outer: type[sp.Abs | sp.sign], factor: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """The sign or the size of a factor: by the mode if SymPy knows its sign on either side of zero."""
    speed = sp.Dummy("w", positive=True)
    above, below = (sp.sign(factor.xreplace({argument: w})) for w in (speed, -speed))
    inner = _by_mode(factor, argument)
    if not (above.is_number and below.is_number):
        return outer(inner)
    sign = above if above == below else above * SLIP
    return sign if outer is sp.sign else sign * inner
