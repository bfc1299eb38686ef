"""Export equations as source text that runs without this package.

`to_python` writes text for SciPy, `to_c` for C99, `to_numba` for NumbaLSODA; `synchain equations` prints these texts.
"""

from __future__ import annotations

from .c import to_c
from .numba import to_numba
from .python import to_python

__all__ = ["to_c", "to_numba", "to_python"]
