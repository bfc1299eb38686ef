"""Surfaces of a vector field, the zeros of the arguments of signs in its rates, which motion crosses or slides along.

Beside a surface h = 0 the rates are f+ and f-.  On the surface Filippov's convex rule takes f = (f+ + f-)/2 + x (f+ - f-)/2
with the number x in [-1, 1] for which the motion stays there.  A function of one sign, such as exp(sign(h)), is written in
this form; it is the same off the surface.  In a sum of signs the rules of several surfaces agree with each other at their
intersections; a product of two signs leaves more than one motion there and is refused.

Sources: Filippov, Differential Equations with Discontinuous Righthand Sides (Kluwer, 1988), chapter 2; Utkin, Sliding
Modes in Control and Optimization (Springer, 1992); Alexander & Seidman, Houston J. Math. 24, 545 (1998).
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from .calculus import derivative
from .jumps import INEQUALITIES
from .rows import Law, Surface


def sliding_surfaces(state: Sequence[sp.Symbol], rates: Sequence[sp.Expr]) -> tuple[tuple[sp.Expr, ...], list[Surface]]:
    """Return the rates without the signs that become surfaces, and these surfaces."""
    plain = [e.replace(Piecewise, _by_sign) for e in rates]
    moving = set(state)
    signs = sorted({s for e in plain for s in e.atoms(sp.sign) if s.free_symbols & moving}, key=sp.default_sort_key)
    swap = {s: sp.Dummy(f"s{k}", real=True) for k, s in enumerate(signs)}
    smooth, pushes = [e.xreplace(swap) for e in plain], {}
    for sign, s in swap.items():
        # linear in the sign: exact at +1 and -1
        pushes[sign] = [sp.expand(e.xreplace({s: sp.S.One}) - e.xreplace({s: sp.S.NegativeOne})) / 2 for e in smooth]
    held = [
        sign
        for sign, push in pushes.items()
        if sp.simplify(sp.Add(*(derivative(sign.args[0], x) * g for x, g in zip(state, push, strict=True)))) != 0
    ]
    if not signs:
        raise ValueError("contact 'set-valued': found no sign of states in the rates; leave it out")
    for sign in held:
        other = next((each for each in held if each is not sign and any(e.has(swap[each]) for e in pushes[sign])), None)
        if other is not None:
            raise ValueError(
                f"sliding along {sign.args[0]} = 0 and {other.args[0]} = 0 at once is not defined by {sign}*{other}; write a "
                "sum, or contact='sign'"
            )
    # a sign along which motion can only cross is a row as well, unless a product holds it
    crossed = [
        sign
        for sign in signs
        if sign not in held
        and not any(e.has(swap[sign]) for push in pushes.values() for e in push)
        and not any(e.has(*swap.values()) for e in pushes[sign])
    ]
    held += crossed
    for sign in held:
        s = swap[sign]
        smooth = [(e.xreplace({s: sp.S.One}) + e.xreplace({s: sp.S.NegativeOne})) / 2 for e in smooth]
    back = {s: sign for sign, s in swap.items()}
    surfaces = [Surface(Law.SIGN, sign.args[0], tuple(e.xreplace(back) for e in pushes[sign])) for sign in held]
    return tuple(sp.expand(e).xreplace(back) for e in smooth), surfaces


def _by_sign(*pieces: tuple[sp.Expr, sp.Basic]) -> sp.Expr:
    """Write a choice between two values by the sign of the difference that decides; keep others."""
    if len(pieces) == 2 and isinstance(pieces[0][1], INEQUALITIES):
        (first, condition), (second, _) = pieces
        larger = isinstance(condition, sp.StrictGreaterThan | sp.GreaterThan)
        sign = sp.sign(condition.lhs - condition.rhs) * (1 if larger else -1)
        return (first + second) / 2 + sign * (first - second) / 2
    return Piecewise(*pieces)
