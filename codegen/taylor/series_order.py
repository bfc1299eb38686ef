"""The order of Taylor steps for a tolerance.

A. Jorba & M. Zou, Experimental Mathematics 14, 99 (2005), section 3.1, derive the order -log(tolerance)/2 + 1 for steps
whose work grows with the square of the order.  The orders below are higher: only convolutions grow with the square, and
they are the smaller part of a step here.
"""

from __future__ import annotations

ORDERS = ((1e-2, 8), (1e-4, 12), (1e-10, 16), (1e-13, 20))
"""Pairs (tolerance, order): the order is the fastest down to this tolerance.

Measured at equal error in full lanes on a linear chain, a pair of pendula, a slip of dry friction and the Lorenz equations.
"""

HIGHEST = 24
"""The order for all smaller tolerances, and for linear equations."""

ORDERS_OF_LARGE = ((1e-10, 16), (0.0, 20))
"""The same for large nodes.  Only two orders, to compile few kernels: compilation takes longer than most runs."""

LINEAR = 1e-5
"""Largest tolerance at which linear equations take the order HIGHEST; their steps have no convolutions."""


def order_for(rtol: float, atol: float, linear: bool = False, large: bool = False) -> int:
    """Return the order of the Taylor step for these tolerances."""
    tolerance = max(rtol, atol)
    if linear and tolerance <= LINEAR:
        return HIGHEST
    return next((order for limit, order in (ORDERS_OF_LARGE if large else ORDERS) if tolerance >= limit), HIGHEST)
