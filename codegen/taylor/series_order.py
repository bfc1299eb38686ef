"""Which order a tolerance asks for."""

from __future__ import annotations

ORDERS = ((1e-2, 8), (1e-4, 12), (1e-10, 16), (1e-13, 20))
"""Tolerances down to which an order is the fastest.

They were measured in full lanes on a linear chain, a pair of pendula, a slip of dry friction and the Lorenz equations, at
equal error.  They lie above the orders -log(tolerance)/2 + 1 of A. Jorba & M. Zou, Experimental Mathematics 14, 99 (2005),
section 3.1, because the convolutions, whose number grows with the square of the order, are the smaller part of a step.
"""

HIGHEST = 24

ORDERS_OF_LARGE = ((1e-10, 16), (0.0, 20))
"""The same for large nodes, of which two kernels are enough: they take longer to compile than most runs take."""

LINEAR = 1e-5
"""Tolerance from which linear equations take the highest order."""


def order_for(rtol: float, atol: float, linear: bool = False, large: bool = False) -> int:
    """Return the order of the Taylor step for these tolerances."""
    tolerance = max(rtol, atol)
    if linear and tolerance <= LINEAR:
        return HIGHEST
    if large:
        return next(order for limit, order in ORDERS_OF_LARGE if tolerance >= limit)
    return next((order for limit, order in ORDERS if tolerance >= limit), HIGHEST)
