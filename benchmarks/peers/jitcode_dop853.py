"""DOP853 through JiTCODE, with compiled C code."""

from __future__ import annotations

from . import _jitcode
from ._problem import Problem, Solve, ladder

NAME = "JiTCODE DOP853"
PACKAGE = "jitcode and a C compiler"
REQUIRES = {"module": ("jitcode", "symengine")}
TOLERANCES = ladder(5, 12)


def prepare(problem: Problem) -> Solve:
    """Return a solver by DOP853."""
    return _jitcode.prepare(problem, "dop853", jacobian=False)
