"""Events: surfaces at which the rates of a node jump, and on which the motion can be held.

The rate of one state y contains the sign of a level h(state, t).  The mode of an event is a further state that changes
only at events.  Off the surface h = 0 the mode is the sign of h, +1 or -1, and all rates are smooth.  While y is held
on the surface the mode is 0.  The motion is held as long as the rates on both sides push towards the surface
(Filippov's sliding mode).  Set-valued friction is such an event: h is the sliding velocity w and y the velocity of the
body, which sticks to the ground until the load exceeds static friction.

Sources: Filippov, Differential Equations with Discontinuous Righthand Sides (Kluwer, 1988), chapter 2; Leine &
Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from .contact import SLIDING, SLIP, beyond_rest, coefficient_at_rest, in_slip


@dataclass(frozen=True, slots=True)
class Event:
    """A surface level = 0 on which one state of a node can be held, in the symbols of the node.

    Limits and departures are rates of this state on the surface; the first of a pair belongs to level > 0, the second
    to level < 0.
    """

    mode: sp.Symbol  # the further state: the sign of the level, or 0 while the motion is held
    level: sp.Expr  # friction: the sliding velocity w; it falls with the held state
    target: sp.Expr  # value of the held state on the surface; friction: the velocity of the ground
    limits: tuple[sp.Expr, sp.Expr]  # rates under static friction; motion is held while limits[1] <= 0 <= limits[0]
    departures: tuple[sp.Expr, sp.Expr]  # rates at the start of slip; equal to `limits` if f_s = f(0+)
    shown: sp.Expr  # the rate off the surface with sign(level) in place of the mode, for printing

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Event:
        """Return the event with every symbol and expression changed."""
        limits, departures = ((change(above), change(below)) for above, below in (self.limits, self.departures))
        return Event(change(self.mode), change(self.level), change(self.target), limits, departures, change(self.shown))

    def under(self, force: sp.Expr) -> Event:
        """Return the event with a further force on the held body, which has unit mass."""
        limits, departures = ((above + force, below + force) for above, below in (self.limits, self.departures))
        return replace(self, limits=limits, departures=departures, shown=self.shown + force)

    @property
    def gaps(self) -> tuple[sp.Expr, sp.Expr]:
        """Two expressions that are positive while the mode lasts.

        Off the surface both are |level|; on the surface they are the distances of 0 from the two limits.
        """
        size, held = self.mode * self.level, 1 - self.mode**2
        return size + held * self.limits[0], size - held * self.limits[1]

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions, in the order in which `Equations.digest` reads them."""
        return self.target, self.level, *self.limits, *self.departures, self.shown

    @property
    def jumps(self) -> bool:
        """True if the rate jumps at the start of slip, because static friction exceeds the friction of slow slip."""
        return any(sp.simplify(a - b) != 0 for a, b in zip(self.limits, self.departures, strict=True))


def on_steady_ground(
    accelerations: Sequence[sp.Expr],
    friction: sp.Function,
    positions: Sequence[sp.Symbol],
    velocities: Sequence[sp.Symbol],
) -> bool:
    """Return True for friction that acts once, on one coordinate, against a ground of constant velocity."""
    applied = {f for e in accelerations for f in e.atoms(friction)}
    if len(accelerations) != 1 or len(applied) != 1:
        return False
    sliding, (velocity,) = sp.expand(applied.pop().args[0]), velocities
    slope = sliding.diff(velocity)
    return bool(slope.is_number) and not sp.expand(sliding - slope * velocity).has(
        *positions, sp.Symbol("t", real=True)
    )


def set_valued(
    acceleration: sp.Expr,
    friction: sp.Function,
    law: sp.Expr,
    argument: sp.Symbol,
    static: sp.Expr | None,
    velocity: sp.Symbol,
) -> tuple[sp.Expr, Event]:
    """Return the acceleration in slip and the event of set-valued friction for an acceleration with friction(w)."""
    applied = sorted(acceleration.atoms(friction), key=str)
    if len(applied) != 1:
        raise ValueError(f"set-valued contact: friction acts {len(applied)} times in {acceleration}; expected once")

    # The velocity of the ground, at which the sliding velocity w(v) = 0.
    sliding = sp.expand(applied[0].args[0])
    slope = sliding.diff(velocity)
    if not (slope.is_number and slope.is_negative):
        raise ValueError(f"set-valued contact: the sliding velocity {sliding} must fall with {velocity}, linearly")
    ground = sp.solve(sliding, velocity)[0]

    # The coefficients f(0+) of slow slip and f_s of stick.
    moving = in_slip(law, argument)
    slow = coefficient_at_rest(moving, argument)
    largest = slow if static is None else static
    if largest == 0:
        raise ValueError(
            f"set-valued contact: the law {law.xreplace({argument: SLIDING})} has no jump at w = 0, so nothing sticks; use contact 'atan'"
        )

    # The acceleration as a function of the friction coefficient, linear in it: a(c) = a(0) + load c.
    coefficient = sp.Dummy("f", real=True)
    plain = acceleration.xreplace({applied[0]: coefficient})
    load = plain.diff(coefficient)
    if load.has(coefficient):
        raise ValueError(f"set-valued contact: friction acts nonlinearly in {acceleration}; expected a multiple of it")
    if load.has(velocity):
        raise ValueError(
            f"set-valued contact: found friction under the load {load}, which depends on the velocity {velocity}; expected a load of places and time"
        )
    on_ground = plain.xreplace({velocity: ground})
    limits, departures = (
        (on_ground.xreplace({coefficient: f}), on_ground.xreplace({coefficient: -f})) for f in (largest, slow)
    )
    shown = plain.xreplace({coefficient: law.xreplace({argument: sliding})})
    rate = plain.xreplace({coefficient: beyond_rest(moving, argument).xreplace({argument: sliding})})
    return rate, Event(SLIP, sliding, ground, limits, departures, shown)
