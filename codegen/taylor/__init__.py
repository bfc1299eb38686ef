"""Steps of Taylor methods: recurrences of power series straight from expressions; neither the driver nor the disk."""

from __future__ import annotations

from .graph import is_analytic, is_linear, jump, outlives_series
from .leaps import unpassed
from .looped import write_looped
from .order import order_for
from .rolled import is_large, write_rolled
from .step import TaylorStep
from .tangent import TangentStep, write_tangent
from .unrolled import write_step

__all__ = [
    "TangentStep",
    "TaylorStep",
    "is_analytic",
    "is_large",
    "is_linear",
    "jump",
    "order_for",
    "outlives_series",
    "unpassed",
    "write_looped",
    "write_rolled",
    "write_step",
    "write_tangent",
]
