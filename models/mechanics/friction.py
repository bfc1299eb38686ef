"""Kinds of contact, and how a friction law that jumps is made smooth."""

from __future__ import annotations

import sympy as sp

from .parameter import Parameter

__all__ = ["CONTACTS", "KAPPA", "regularise"]

CONTACTS = ("atan", "sign", "set-valued")
"""How a jump is treated: smoothed by the arcus tangent, left as it is with sign(0) = 0, or as stick and slip."""

KAPPA = Parameter(1e5, "s/m", "steepness of the regularised jump, sgn w = (2/pi) atan(kappa w)", positive=True)


def regularise(expression: sp.Expr, kappa: sp.Symbol) -> sp.Expr:
    """Replace every sign(w) by (2/pi) atan(kappa w).

    The slope at w = 0 becomes 2 kappa/pi, and for |w| >> 1/kappa the error is 2/(pi kappa |w|).
    Source: Marszal et al., Eur. Phys. J. Special Topics (2016), eq. 5.
    """
    return expression.replace(sp.sign, lambda w: 2 * sp.atan(kappa * w) / sp.pi)
