"""The problem that a peer solves: start, parameters, right-hand side and Jacobian, as text or compiled by Numba.

All of it is printed from the derived equations, after the elimination of common subexpressions; no
peer has equations typed in by hand. The parameters are constants in the text, so that a compiler
can fold them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.scene import Scene

Solve = Callable[[float, float, np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class Problem:
    """An initial value problem y' = rhs(t, y), y(0) = y0, of a scene."""

    scene: Scene

    @property
    def equations(self) -> Equations:
        """The derived equations."""
        return self.scene.equations

    @property
    def y0(self) -> np.ndarray:
        """The start (dimension,), a new array at every call."""
        return np.array(self.scene.y0)

    @property
    def numbers(self) -> dict[str, float]:
        """The parameters of the equations by name."""
        return {name: float(self.scene.parameters[name]) for name in self.equations.parameters}

    def rhs(self) -> tuple[sp.Expr, ...]:
        """The right-hand side, in state order."""
        return self.equations.rhs()

    def jacobian(self) -> list[list[sp.Expr]]:
        """The Jacobian, dense."""
        entries, size = self.equations.jacobian(), self.equations.dimension
        return [[entries.get((row, column), sp.S.Zero) for column in range(size)] for row in range(size)]

    def statements(
        self, expressions: Sequence[sp.Expr], target: str, show: Callable[[sp.Expr], str], declare: str = ""
    ) -> list[str]:
        """Assignments of the expressions to `target.format(i)`; state in y[i], time in t, end of
        line not included.
        """
        parts, results = sp.cse(expressions, symbols=sp.numbered_symbols("part"), order="canonical")
        lines = [f"{declare}{name} = {value!r}" for name, value in self.numbers.items()]
        lines += [f"{declare}{name} = y[{i}]" for i, name in enumerate(self.equations.state)]
        lines += [f"{declare}{symbol} = {show(value)}" for symbol, value in parts]
        return lines + [f"{target.format(i)} = {show(value)}" for i, value in enumerate(results)]

    def python_rhs(self, header: str = "def rhs(t, y, out):") -> str:
        """Text of a Python function that writes the right-hand side into `out`."""
        return _function(header, self.statements(self.rhs(), "out[{}]", sp.pycode))

    def python_jacobian(self, header: str = "def jacobian(t, y, out):") -> str:
        """Text of a Python function that writes the dense Jacobian into `out[row, column]`."""
        entries = self.equations.jacobian()
        lines = self.statements(tuple(entries.values()), "entry{}", sp.pycode)
        lines += [f"out[{row}, {column}] = entry{i}" for i, (row, column) in enumerate(entries)]
        return _function(header, ["out[:] = 0.0", *lines])

    def compiled(self) -> tuple[Any, Any]:
        """Right-hand side f(t, y, out) and Jacobian j(t, y, out), out (dimension, dimension),
        compiled by Numba.
        """
        import numba

        number, vector, matrix = numba.float64, numba.float64[::1], numba.float64[:, ::1]
        given = numba.types.Array(number, 1, "C", readonly=True)  # takes arrays that can be written to as well
        rhs, jacobian = load(self.python_rhs(), "rhs"), load(self.python_jacobian(), "jacobian")
        return (
            numba.njit(numba.void(number, given, vector), error_model="numpy")(rhs),
            numba.njit(numba.void(number, given, matrix), error_model="numpy")(jacobian),
        )

    def callbacks(self) -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
        """f(t, y) and j(t, y) that return new arrays, compiled by Numba."""
        import numba

        rhs, jacobian = self.compiled()
        size, given = self.equations.dimension, numba.types.Array(numba.float64, 1, "C", readonly=True)

        @numba.njit(numba.float64[::1](numba.float64, given))  # type: ignore[untyped-decorator]
        def f(t: float, y: np.ndarray) -> np.ndarray:
            out = np.empty(size)
            rhs(t, y, out)
            return out

        @numba.njit(numba.float64[:, ::1](numba.float64, given))  # type: ignore[untyped-decorator]
        def j(t: float, y: np.ndarray) -> np.ndarray:
            out = np.empty((size, size))
            jacobian(t, y, out)
            return out

        return f, j


def load(text: str, name: str) -> Any:
    """Execute the text of a function, printed from equations by this module, and return the
    function.
    """
    space: dict[str, Any] = {"math": math}
    exec(compile(text, f"<{name} of a benchmark problem>", "exec"), space)
    return space[name]


def _function(header: str, lines: Sequence[str]) -> str:
    return "\n    ".join([header, *lines]) + "\n"
