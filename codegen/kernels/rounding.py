"""How large the terms of an expression are, of which rounding is a part."""

from __future__ import annotations

import sympy as sp

from synchain.models.dynamics.observable import AtNode, NodeMaximum, NodeMean, NodeMinimum, NodeSum, Rate, RowSum
from synchain.models.mechanics.jumps import JUMPING

LEVEL = (sp.acos, sp.acosh, sp.asin, sp.asinh, sp.atan, sp.atan2, sp.atanh, sp.erf, sp.log, sp.tanh)
"""Functions that turn a large argument, and its rounding, into a number of the order of one."""


def magnitude(e: sp.Expr) -> sp.Expr:
    """Return a size of which the rounding of an expression is a small multiple of the unit roundoff.

    It is the sum of the sizes of the terms, not the size of their sum: x_1 - x_2 is as large as the two states.  This is
    an estimate to first order, after the running error analysis of Higham, *Accuracy and Stability of Numerical Algorithms*,
    2nd ed. (SIAM, 2002), section 3.3.
    """
    if e.is_Atom or isinstance(e, (Rate, RowSum, AtNode, *JUMPING)):
        return sp.Abs(e)
    sizes = [magnitude(a) for a in e.args]
    if isinstance(e, (sp.Add, sp.Mul, sp.Max, sp.Min, NodeSum, NodeMean, NodeMaximum, NodeMinimum)):
        combine = {sp.Min: sp.Max, NodeMinimum: NodeMaximum}.get(type(e), e.func)
        return combine(*sizes)
    if isinstance(e, sp.Abs):
        return sizes[0]
    if isinstance(e, sp.Pow):
        return sizes[0] ** e.exp if e.exp.is_positive else sp.Abs(e)
    if isinstance(e, sp.exp):
        return e * (1 + sizes[0])
    rest = sp.Add(*sizes)
    return sp.Abs(e) + (sp.Min(1, rest) if isinstance(e, LEVEL) else rest)
