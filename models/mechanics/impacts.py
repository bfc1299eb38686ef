"""Events that a model declares: contacts with friction, stops and resets, as values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ..inputs.frozen import FrozenDict
from .contact import FrictionLaw


@dataclass(frozen=True, slots=True)
class Friction:
    """A contact with dry friction, whose force follows from virtual work: Q = -load f(w) dw/dv.

    Parameters
    ----------
    sliding : Expr or str
        The sliding velocity w of the ground relative to the body, linear in the velocities.
    load : Expr, number or str
        The normal load, a factor of the friction coefficient.
    law : FrictionLaw or str, optional
        The friction law of this contact; by default that of the oscillator.

    See Also
    --------
    friction : The friction coefficient in a force that is written out.

    Examples
    --------
    The slider of a crank, whose velocity is -R omega sin(theta):

    >>> import sympy as sp
    >>> from synchain import Friction, Lagrangian
    >>> th, om, R, N = sp.symbols("th om R N")
    >>> crank = Lagrangian(om**2/2, 0, coordinates={th: om}, parameters={R: 1, N: 0.3}, contact="set-valued",
    ...                    events=[Friction(-R*om*sp.sin(th), load=N, law="coulomb")])
    >>> crank.model.events[0].load
    N
    """

    sliding: Any
    load: Any = 1
    law: FrictionLaw | str | None = None

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        return self.sliding, self.load

    def map(self, change: Callable[[str, Any], sp.Expr], state: Callable[[object], str]) -> Friction:
        """Return the event with every expression changed; `change` takes the name of each."""
        return Friction(change("sliding velocity", self.sliding), change("load", self.load), self.law)


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop that a body hits: its gap stays positive or zero.

    At an impact the rate of the gap changes its sign and is multiplied by the restitution (Newton's law).  A stop whose
    rebounds are 1e-12 times as high as the first ones closes; it then presses on the body until the pressure is zero.

    Parameters
    ----------
    gap : Expr or str
        The distance to the stop, a function of coordinates and time.
    restitution : Expr, number or str
        Speed after over speed before the impact, from 0 to 1.  It may depend on the state before the impact.
    in_order : bool
        What happens if stops that influence each other are hit at the same time, where Newton's law has no unique answer.
        True: they rebound one after another, a node's own stops first, then those of the links in the order of the graph,
        again and again until no body approaches one.  False: the cell ends as AMBIGUOUS.

    See Also
    --------
    Lagrangian : The keyword `events` takes stops.

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapter 5.

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain import Lagrangian, Stop
    >>> y, v, g, e = sp.symbols("y v g e")
    >>> ball = Lagrangian(v**2/2, g*y, coordinates={y: v}, parameters={g: 9.81, e: 0.8}, events=[Stop(y, restitution=e)])
    >>> ball.model.events
    (Stop(gap=y, restitution=e, in_order=False),)
    """

    gap: Any
    restitution: Any = 0
    in_order: bool = False

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        return self.gap, self.restitution

    def map(self, change: Callable[[str, Any], sp.Expr], state: Callable[[object], str]) -> Stop:
        """Return the event with every expression changed; `change` takes the name of each."""
        e = change("restitution", self.restitution)
        if e.is_number and not 0 <= e <= 1:
            raise ValueError(f"stop {self.gap}: found the restitution {e}; expected a number from 0 to 1")
        if not isinstance(self.in_order, bool):
            raise TypeError(f"stop {self.gap}: found in_order = {self.in_order!r}; expected True or False")
        return Stop(change("gap", self.gap), e, self.in_order)


@dataclass(frozen=True, slots=True)
class Reset:
    """A jump of states where a guard passes zero upwards, as in neurons that integrate and fire.

    Parameters
    ----------
    guard : Expr or str
        A function of states and time, negative before the jump.
    sets : mapping
        State -> its value just after, in terms of the values just before.

    See Also
    --------
    Field : The keyword `events` takes resets.

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain import Field, Reset
    >>> v, I = sp.symbols("v I")
    >>> Field({v: I - v}, parameters={I: 1.2}, events=[Reset(v - 1, {v: 0})]).states
    ('v',)
    """

    guard: Any
    sets: Mapping[Any, Any]

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        return self.guard, *self.sets.values()

    def map(self, change: Callable[[str, Any], sp.Expr], state: Callable[[object], str]) -> Reset:
        """Return the event with every expression changed; `change` takes the name of each."""
        guard = change("guard", self.guard)
        sets = {state(key): change(f"value of {key}", value) for key, value in self.sets.items()}
        if not sets:
            raise ValueError(f"reset {guard}: found no new values; expected a value of at least one state")
        after = guard.xreplace({sp.Symbol(name, real=True): value for name, value in sets.items()})
        if after.is_number and after >= 0:
            raise ValueError(
                f"reset {guard}: found the guard {after} just after; expected a negative value, else it fires without end"
            )
        return Reset(guard, FrozenDict(sets))


EventDefinition = Friction | Stop | Reset
"""An event of a model."""
