"""Decide if a Taylor step can integrate some equations: find obstacles, singularities, kinks, and linear equations.

A step needs the series of every right-hand side up to the end of the step.  A step passes a kink or a jump one side at
a time (`event_location`), provided that motion crosses the kink and does not slide along it.  Obstacles are functions
without a recurrence, and pieces of a Piecewise that have no value where other pieces are chosen.
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
"""Functions that have a pole, or no real value for some arguments."""

STEEP = (sp.asin, sp.acos, sp.acosh)
"""Functions that have a value, but no finite slope, at an end of their domain."""

BOUNDED = (sp.sin, sp.cos, sp.tanh, sp.erf, sp.asinh)
"""Functions that stay bounded, or grow only like a logarithm (asinh), at a pole of their argument."""

Ends = tuple[tuple[sp.Symbol, ...], ...]


def taylor_obstacle(equations: Equations) -> sp.Expr | None:
    """Return the first part of the equations that no Taylor step can pass; None if there is no such part."""
    return next(iter(_obstacles(equations)), None)


def check_passable(equations: Equations) -> None:
    """Raise ValueError if the equations contain a part that no Taylor step can pass."""
    for part, why in _obstacles(equations).items():
        raise ValueError(
            f"taylor: found {part}, {why}; expected functions with a series between zeros, and jumps that motion passes; "
            "use integrator dop853 or rodas5p"
        )


def unpassed(equations: Equations) -> Iterator[sp.Expr]:
    """Yield the parts with a jump that no Taylor step can pass.

    Motion can slide along a jump if the jump enters the rate of a state on which the jump depends: sign(v) in the rate
    of v, but not in the rate of x.  Contacts require continuous loads on sticking bodies.  With a mass matrix, a jump
    in one right-hand side makes all coupled rates jump.
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
    """Return True if motion may cross a singularity: asin(x) at x = 1, log|x| at 0, tanh(1/x) at 0."""
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
    parts += [(edge.rhs, tuple(s for end in edge.end_states for s in end)) for edge in equations.edges]
    # `any` stops at the first slope that depends on a state; differentiating all rates of a large node takes seconds
    moving_slopes = (
        derivative(e, s).free_symbols & {TIME, *states} for rates, states in parts for e in rates for s in states
    )
    return not any(moving_slopes) and equations.constant_mass


def _templates(equations: Equations) -> Iterator[tuple[Sequence[sp.Expr], Ends, set[sp.Symbol]]]:
    """Yield, for each kind of node and link: right-hand sides and masses, states at each end, all moving symbols."""
    for node in equations.nodes:
        yield (*node.rhs, *(e for row in node.inertia for e in row)), (node.state,), {TIME, *node.state}
    for edge in equations.edges:
        yield edge.expressions, edge.end_states, {TIME, *(s for end in edge.end_states for s in end)}


def _obstacles(equations: Equations) -> dict[sp.Expr, str]:
    """Return the parts that no Taylor step can pass, in a fixed order, each with the reason."""
    why = dict.fromkeys(unpassed(equations), "along which motion may slide, or which a contact or a mass matrix feels")
    for rates, _, moving in _templates(equations):
        # functions without a recurrence, and roots of a value that has a kink
        functions = {f for e in rates for f in e.atoms(sp.Function) if not isinstance(f, (*LANE_FUNCTIONS, *SIDED))}
        powers = (p for e in rates for p in e.atoms(sp.Pow) if p.exp.is_integer is not True)
        roots = {p for p in powers if any(isinstance(f, SIDED) for f in sp.Mul.make_args(p.base))}
        unserial = {f for f in functions if f.free_symbols & moving} | {
            p for p in roots if p.base.free_symbols & moving
        }
        # a step computes the series of all pieces of a choice, even of those not chosen: a piece without a value breaks
        # the step.  the series of atan continues analytically across a pole of the argument, where atan itself jumps
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
    """Return True for a root, a quotient or a function that has a pole, or no real value, for some arguments."""
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
    """Return True if an expression stays finite, or has a finite integral, at a singularity that ends its series.

    Motion can reach such a singularity, for example in exp(-1/x**2) and exp(-1/cos(t)).  exp(-1/x) does not count: x is
    then a temperature, which stays away from 0.
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
