"""LSODA through JiTCODE, with compiled C code."""

from __future__ import annotations

from . import _jitcode
from ._problem import Problem, Solve, ladder

NAME = "JiTCODE LSODA"
PACKAGE = "jitcode and a C compiler"
REQUIRES = {"module": ("jitcode", "symengine")}
TOLERANCES = ladder(5, 13)


def prepare(problem: Problem) -> Solve:
    """Return a solver by LSODA."""
    return _jitcode.prepare(problem, "lsoda", jacobian=True)
