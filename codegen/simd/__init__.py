"""Export all names that generated kernels import: SIMD lanes, elementary functions on lanes, the decorator `njit`.

Kernels import from this package only, so that moving a function between its modules changes no text of a kernel.
"""

from __future__ import annotations

from ..front_end.decorator import njit
from .addresses import address
from .elementary import *  # noqa: F403
from .elementary import __all__ as _elementary
from .lanes import *  # noqa: F403
from .lanes import __all__ as _lanes
from .special import *  # noqa: F403
from .special import __all__ as _special

__all__ = [*_elementary, *_lanes, *_special, "address", "njit"]
