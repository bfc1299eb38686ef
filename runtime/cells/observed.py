"""What a scene observes: the values that its kernel tallies, and the numbers of its result."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Sum, Tally
from synchain.codegen.kernels.observed import with_rows
from synchain.models.dynamics.observable import Window
from synchain.models.scenes.scene import Scene

__all__ = ["Observed"]


@dataclass(frozen=True)
class Observed:
    """The observables of a scene, in the arrays of its kernel and of its result."""

    scene: Scene

    @cached_property
    def values(self) -> tuple[sp.Expr, ...]:
        """The values that the kernel tallies; observables of one value share it."""
        return tuple(dict.fromkeys(observable.value for observable in self.scene.observe.values()))

    @cached_property
    def _rows(self) -> dict[sp.Expr, int]:
        """How many numbers each value is."""
        equations = self.scene.equations
        return {value: equations.n if with_rows(equations, value) else 1 for value in self.values}

    @property
    def numbers(self) -> int:
        """How many numbers a cell has of all observables."""
        return sum(self._rows[observable.value] for observable in self.scene.observe.values())

    @property
    def tallies(self) -> int:
        """How many numbers the kernel keeps of a cell."""
        return 1 + len(Tally) * sum(self._rows.values()) if self.values else 0

    def columns(self) -> Iterator[tuple[str, bool, slice]]:
        """Yield the name of each observable, whether it has a value for each node, and its columns in `Buffers.sums`."""
        first = len(Sum)
        for name, observable in self.scene.observe.items():
            rows = self._rows[observable.value]
            yield name, with_rows(self.scene.equations, observable.value), slice(first, first + rows)
            first += rows

    def summary(self, sums: np.ndarray) -> np.ndarray:
        """Return the `sums` of buffers out of those of a kernel; NaN in cells that ended before their window."""
        if not self.values:
            return sums
        length = sums[:, len(Sum), None]
        length = np.where(length > 0.0, length, np.nan)
        tallies = sums[:, len(Sum) + 1 :].reshape(len(sums), -1, len(Tally))
        begins, first = {}, 0
        for value, rows in self._rows.items():
            begins[value] = slice(first, first + rows)
            first += rows
        parts = [sums[:, : len(Sum)]]
        for observable in self.scene.observe.values():
            parts.append(_over_window(observable.window, tallies[:, begins[observable.value]], length))
        return np.concatenate(parts, axis=1)


def _over_window(window: Window, tallies: np.ndarray, length: np.ndarray) -> np.ndarray:
    """What a window keeps (cells, rows) of tallies (cells, rows, len(Tally)); NaN where a value was undefined."""
    gap = tallies[:, :, Tally.SUM] / length
    defined = np.where(np.isfinite(gap), 0.0, np.nan)
    match window:
        case Window.MEAN:
            return np.asarray(tallies[:, :, Tally.FIRST] + gap)
        case Window.VARIANCE:
            return np.asarray(np.maximum(tallies[:, :, Tally.SQUARES] / length - gap * gap, 0.0))
    kept = {Window.MAXIMUM: Tally.LARGEST, Window.MINIMUM: Tally.LEAST, Window.END: Tally.LATEST}[window]
    return np.asarray(tallies[:, :, kept] + defined)
