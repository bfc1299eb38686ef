"""Write steps of Taylor methods: recurrences of power series, derived from expressions.

This package imports no driver code and reads no files.
"""

from __future__ import annotations

from .looped_series import write_looped
from .passable import is_analytic, is_linear, may_cross_singularity, taylor_obstacle, unpassed
from .rolled import is_large, write_rolled
from .series_order import order_for
from .tangent import TangentStep, write_tangent
from .taylor_step import TaylorStep
from .unrolled_series import write_step

__all__ = [
    "TangentStep",
    "TaylorStep",
    "is_analytic",
    "is_large",
    "is_linear",
    "may_cross_singularity",
    "order_for",
    "taylor_obstacle",
    "unpassed",
    "write_looped",
    "write_rolled",
    "write_step",
    "write_tangent",
]
