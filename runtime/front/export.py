"""Equations as text: LaTeX, plain, Python, C and Numba."""

from __future__ import annotations

from .offers import offer

HOMES = {
    "latex": "models.presentation.equations_text",
    "text": "models.presentation.equations_text",
    "to_c": "codegen.export",
    "to_numba": "codegen.export",
    "to_python": "codegen.export",
}

__all__ = list(HOMES)
__getattr__, __dir__ = offer(__name__, HOMES)
