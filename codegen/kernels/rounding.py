"""Estimate the rounding error of an expression from the sizes of its terms."""

from __future__ import annotations

import sympy as sp

from synchain.models.dynamics.observable import AtNode, NodeMaximum, NodeMean, NodeMinimum, NodeSum, Rate, RowSum
from synchain.models.mechanics.jumps import JUMPING

# Functions that grow at most like a logarithm: the rounding error of a large argument adds at most 1 to the size.
LEVEL = (sp.acos, sp.acosh, sp.asin, sp.asinh, sp.atan, sp.atan2, sp.atanh, sp.erf, sp.log, sp.tanh)


def magnitude(e: sp.Expr) -> sp.Expr:
    """Return a size: the rounding error of an expression is a small multiple of it times the unit roundoff."""
    # Running error analysis to first order: Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed.
    # (SIAM, 2002), section 3.3. The sizes of terms are added: x_1 - x_2 has the size |x_1| + |x_2|.
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
    of_arguments = sp.Add(*sizes)
    return sp.Abs(e) + (sp.Min(1, of_arguments) if isinstance(e, LEVEL) else of_arguments)
