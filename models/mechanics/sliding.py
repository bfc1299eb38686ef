"""Surfaces of a vector field, the zeros of the arguments of signs in its rates, which motion crosses or slides along.

Beside a surface h = 0 the rates are f+ and f-.  On the surface Filippov's convex rule takes f = (f+ + f-)/2 + x (f+ - f-)/2
with the number x in [-1, 1] for which the motion stays there.  A function of one sign, such as exp(sign(h)), is written in
this form; it is the same off the surface.  In a sum of signs the rules of several surfaces agree with each other at their
intersections; a product of two signs leaves more than one motion there and is refused.

Sources: Filippov, Differential Equations with Discontinuous Righthand Sides (Kluwer, 1988), chapter 2; Utkin, Sliding
Modes in Control and Optimization (Springer, 1992); Alexander & Seidman, Houston J. Math. 24, 545 (1998).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from .calculus import derivative
from .jumps import INEQUALITIES
from .rows import Law, Surface


def sliding_surfaces(state: Sequence[sp.Symbol], rates: Sequence[sp.Expr]) -> tuple[tuple[sp.Expr, ...], list[Surface]]:
    """Return the rates without the signs that become surfaces, and these surfaces."""
    plain = [e.replace(Piecewise, _by_sign) for e in rates]
    signs = sorted({s for e in plain for s in e.atoms(sp.sign) if s.has(*state)}, key=sp.default_sort_key)
    if not signs:
        raise ValueError("contact 'set-valued': found no sign of states in the rates; leave it out")
    swap = {sign: sp.Dummy(f"s{k}", real=True) for k, sign in enumerate(signs)}
    smooth = [e.xreplace(swap) for e in plain]
    # linear in the sign: exact at +1 and -1
    sides = {
        sign: [[e.xreplace({s: one}) for e in smooth] for one in (sp.S.One, -sp.S.One)] for sign, s in swap.items()
    }
    pushes = {sign: [sp.expand(up - down) / 2 for up, down in zip(*both, strict=True)] for sign, both in sides.items()}
    held = [sign for sign in signs if _may_be_held(sign, state, pushes[sign])]
    _refuse_products(held, swap, pushes)
    held += [sign for sign in signs if sign not in held and _stands_alone(sign, swap, pushes)]
    for s in map(swap.__getitem__, held):
        smooth = [(e.xreplace({s: sp.S.One}) + e.xreplace({s: sp.S.NegativeOne})) / 2 for e in smooth]
    back = {s: sign for sign, s in swap.items()}
    surfaces = [Surface(Law.SIGN, sign.args[0], tuple(e.xreplace(back) for e in pushes[sign])) for sign in held]
    return tuple(sp.expand(e).xreplace(back) for e in smooth), surfaces


Pushes = Mapping[sp.Expr, Sequence[sp.Expr]]
"""For each sign what one unit of it adds to each rate."""


def _may_be_held(sign: sp.Expr, state: Sequence[sp.Symbol], push: Sequence[sp.Expr]) -> bool:
    """Return True if the sign changes the rate of its own level; otherwise motion can only cross its surface."""
    felt = sp.Add(*(derivative(sign.args[0], x) * g for x, g in zip(state, push, strict=True)))
    return bool(sp.simplify(felt) != 0)


def _refuse_products(held: Sequence[sp.Expr], swap: Mapping[sp.Expr, sp.Symbol], pushes: Pushes) -> None:
    for sign in held:
        other = next((each for each in held if each is not sign and any(e.has(swap[each]) for e in pushes[sign])), None)
        if other is not None:
            raise ValueError(
                f"sliding along {sign.args[0]} = 0 and {other.args[0]} = 0 at once is not defined by {sign}*{other}; write a "
                "sum, or contact='sign'"
            )


def _stands_alone(sign: sp.Expr, swap: Mapping[sp.Expr, sp.Symbol], pushes: Pushes) -> bool:
    """Return True if no product contains the sign: it is then a row as well, which motion crosses."""
    others = any(e.has(swap[sign]) for push in pushes.values() for e in push)
    return not others and not any(e.has(*swap.values()) for e in pushes[sign])


def _by_sign(*pieces: tuple[sp.Expr, sp.Basic]) -> sp.Expr:
    """Write a choice between two values by the sign of the difference that decides; keep others."""
    if len(pieces) == 2 and isinstance(pieces[0][1], INEQUALITIES):
        (first, condition), (second, _) = pieces
        larger = isinstance(condition, sp.StrictGreaterThan | sp.GreaterThan)
        sign = sp.sign(condition.lhs - condition.rhs) * (1 if larger else -1)
        return (first + second) / 2 + sign * (first - second) / 2
    return Piecewise(*pieces)
