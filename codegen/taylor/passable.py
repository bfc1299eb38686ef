"""Which equations a Taylor step can integrate: obstacles, singular places, kinks, linearity.

A step needs a series of every right-hand side, up to its end.  Kinks and jumps are passed one side at a time
(`event_location`), as long as motion crosses them; functions without a recurrence, and pieces that have no value where they
are not chosen, are obstacles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set

import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.jumps import JUMPING, KINKED, gaps_of, jumps

from .jump_series import decided_by_gaps
from .series_graph import LANE_FUNCTIONS, inverse_of

SIDED = (*KINKED, *JUMPING, Piecewise)
"""Functions that a step passes one side at a time."""

SINGULAR = (sp.log, sp.tan, sp.asin, sp.acos, sp.acosh, sp.atanh)
"""Functions with a pole, or without a value for some arguments."""

STEEP = (sp.asin, sp.acos, sp.acosh)
"""Functions with a value and no slope at the ends of their domain."""

BOUNDED = (sp.sin, sp.cos, sp.tanh, sp.erf, sp.asinh)
"""Functions that stay small, or nearly so, where their argument has a pole."""

Ends = tuple[tuple[sp.Symbol, ...], ...]


def taylor_obstacle(equations: Equations) -> sp.Expr | None:
    """Return a part of some equations that no Taylor step passes; None if there is none."""
    return next(iter(_obstacles(equations)), None)


def check_passable(equations: Equations) -> None:
    """Raise ValueError for equations with a part that no Taylor step passes."""
    for part, why in _obstacles(equations).items():
        raise ValueError(
            f"taylor: found {part}, {why}; expected functions with a series between zeros, and jumps that motion passes; "
            "use integrator dop853 or rodas5p"
        )


def unpassed(equations: Equations) -> Iterator[sp.Expr]:
    """Yield the parts of some equations with a jump that no Taylor step passes.

    Motion can slide along a jump that enters the rate of what it depends on: sign(v) in the rate of v, not in that of x.
    Contacts take the loads of bodies that stick as continuous, and the solution of a mass matrix jumps as a whole.
    """
    parts_of = [(rates, ends, jumps(rates, moving)) for rates, ends, moving in _templates(equations)]
    jumping = {c for rates, ends, parts in parts_of for c in range(len(ends[0])) if rates[c].has(*parts)}
    for _, ends, parts in parts_of:
        for part in parts:
            gaps = list(gaps_of(part))
            depends = {c for end in ends for c, s in enumerate(end) if any(gap.has(s) for gap in gaps)}
            if not decided_by_gaps(part) or depends & jumping or equations.sticks or equations.inertial:
                yield part


def may_cross_singularity(equations: Equations) -> bool:
    """Return True if motion may pass a singular place: the end of an arc, log|x| at 0, tanh(1/x) at its pole."""
    return any(
        _ends_series(part, moving)
        for rates, _, moving in _templates(equations)
        for e in rates
        for part in e.atoms(sp.Function, sp.Pow)
    )


def is_analytic(equations: Equations) -> bool:
    """Return True if no rate has a jump or a kink in the states or in time."""
    return not any(
        part.free_symbols & moving and type(part) not in LANE_FUNCTIONS
        for rates, _, moving in _templates(equations)
        for e in rates
        for part in e.atoms(sp.Function, *KINKED)
    )


def is_linear(equations: Equations) -> bool:
    """Return True if the rates are sums of states with constant coefficients and of terms of time."""
    parts = [(node.rhs, node.state) for node in equations.nodes]
    parts += [(edge.rhs, (*edge.here, *edge.there)) for edge in equations.edges]
    # `any` stops at the first slope that moves: all slopes of large nodes take seconds
    moving_slopes = (
        derivative(e, s).free_symbols & {TIME, *states} for rates, states in parts for e in rates for s in states
    )
    return not any(moving_slopes) and equations.constant_mass


def _templates(equations: Equations) -> Iterator[tuple[Sequence[sp.Expr], Ends, set[sp.Symbol]]]:
    """Yield right-hand sides and masses of each kind of node and link, the states at each end, and all that moves."""
    for node in equations.nodes:
        yield (*node.rhs, *(e for row in node.inertia for e in row)), (node.state,), {TIME, *node.state}
    for edge in equations.edges:
        yield edge.expressions, (edge.here, edge.there), {TIME, *edge.here, *edge.there}


def _obstacles(equations: Equations) -> dict[sp.Expr, str]:
    """Return the parts that no Taylor step passes, in a fixed order, and why."""
    why = dict.fromkeys(unpassed(equations), "along which motion may slide, or which a contact or a mass matrix feels")
    for rates, _, moving in _templates(equations):
        # functions without a recurrence, and roots at a kink
        functions = {f for e in rates for f in e.atoms(sp.Function) if not isinstance(f, (*LANE_FUNCTIONS, *SIDED))}
        powers = (p for e in rates for p in e.atoms(sp.Pow) if p.exp.is_integer is not True)
        roots = {p for p in powers if any(isinstance(f, SIDED) for f in sp.Mul.make_args(p.base))}
        unserial = {f for f in functions if f.free_symbols & moving} | {
            p for p in roots if p.base.free_symbols & moving
        }
        # all pieces of a choice have series, chosen or not, so that a piece without a value ends a step; series of an arc
        # carry on over a pole of its argument
        sided = {part for e in rates for part in e.atoms(Piecewise, *JUMPING, sp.atan)}
        guarding = {
            part
            for part in sided
            if any(_is_singular(e, moving) for a in part.args for e in a.atoms(sp.Pow, sp.Function))
        }
        why |= dict.fromkeys(unserial, "which has no series")
        why |= dict.fromkeys(guarding, "a part of which has a pole, or no value, somewhere")
    return {part: why[part] for part in sorted(why, key=sp.default_sort_key)}


def _is_singular(e: sp.Expr, moving: Set[sp.Symbol]) -> bool:
    """Return True for a root, a quotient or a function that has a pole, or no value, for some arguments."""
    argument = e.args[0]
    if not argument.free_symbols & moving or argument.is_positive:
        return False
    if isinstance(e, sp.Pow):
        return bool(e.exp.is_integer is not True or e.exp.is_negative)
    return isinstance(e, SINGULAR)


def _is_pole(e: sp.Expr) -> bool:
    """Return True for a negative power or a tangent."""
    return bool(isinstance(e, sp.tan) or (e.is_Pow and e.exp.is_negative))


def _ends_series(e: sp.Expr, moving: Set[sp.Symbol]) -> bool:
    """Return True for a part that stays finite, or has a finite integral, where its series ends.

    exp(-1/x) of a temperature never comes near its pole and does not count; exp(-1/x**2) and exp(-1/cos(t)) do.
    """
    argument = e.args[0]
    if isinstance(e, STEEP):
        return bool(argument.free_symbols & moving)
    if isinstance(e, sp.log):
        return isinstance(argument, sp.Abs) and bool(argument.free_symbols & moving)
    poles = [p for p in argument.atoms(sp.Pow, sp.tan) if _is_pole(p) and _is_singular(p, moving)]
    if isinstance(e, sp.exp):
        return any(p.free_symbols & moving == {TIME} or (p.is_Pow and p.exp.is_even) for p in poles)
    return bool(poles) and (isinstance(e, BOUNDED) or (_is_pole(e) and inverse_of(argument) is not None))
