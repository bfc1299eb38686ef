"""The order of Taylor steps for a tolerance.

A. Jorba & M. Zou, Experimental Mathematics 14, 99 (2005), section 3.1, derive the order -log(tolerance)/2 + 1 for work that
grows with its square.  The orders below are higher, because the convolutions, which make that square, are the smaller part
of a step here.
"""

from __future__ import annotations

ORDERS = ((1e-2, 8), (1e-4, 12), (1e-10, 16), (1e-13, 20))
"""Tolerances down to which an order is the fastest.

Measured at equal error in full lanes on a linear chain, a pair of pendula, a slip of dry friction and the Lorenz equations.
"""

HIGHEST = 24
"""The order below all these tolerances, and of linear equations."""

ORDERS_OF_LARGE = ((1e-10, 16), (0.0, 20))
"""The orders of large nodes: two kernels are enough, because they take longer to compile than most runs take."""

LINEAR = 1e-5
"""Tolerance from which linear equations take the highest order: their steps have no convolutions."""


def order_for(rtol: float, atol: float, linear: bool = False, large: bool = False) -> int:
    """Return the order of the Taylor step for these tolerances."""
    tolerance = max(rtol, atol)
    if linear and tolerance <= LINEAR:
        return HIGHEST
    return next((order for limit, order in (ORDERS_OF_LARGE if large else ORDERS) if tolerance >= limit), HIGHEST)
