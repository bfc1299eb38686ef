"""What generated kernels import: lanes of a SIMD register, elementary functions on them, the decorator `njit`.

Kernels name this package alone, so that no text of a kernel changes if a function moves behind it.
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
