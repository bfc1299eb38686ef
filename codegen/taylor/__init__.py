"""Steps of Taylor methods: recurrences of power series straight from expressions; neither the driver nor the disk."""

from __future__ import annotations

from .graph import is_linear, jump
from .looped import write_looped
from .order import order_for
from .step import TaylorStep, write_step

__all__ = ["TaylorStep", "is_linear", "jump", "order_for", "write_looped", "write_step"]
