"""Map observables and sections of a scene to the values that a kernel computes, and to the arrays of a result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import SumColumn, Tally
from synchain.codegen.kernels.observable_functions import Recording, with_rows
from synchain.models.dynamics.observable import ENERGY, ObservedWindow
from synchain.models.dynamics.observable_text import as_value
from synchain.models.dynamics.record import Record
from synchain.models.mechanics.rows import Law, Row
from synchain.models.scenes.energy import energy_terms as exact_energy
from synchain.models.scenes.observables import has_own_energy
from synchain.models.scenes.scene import Scene, Section


def watched(scene: Scene) -> Recording:
    """Return the observables, sections and stop of a scene's kernel."""
    # The energy is replaced by sums over nodes and links.
    sections = Sections(scene)
    recording = Recording(
        records=(),
        own_times=bool(scene.t_eval),
        observed=ObservableArrays(scene).values,
        sections=sections.values,
        stop=sections.stop,
    )
    if has_own_energy(scene.model) or not any(e.has(ENERGY) for e in (*recording.observed, *recording.events)):
        return recording
    value, sums = exact_energy(scene).rows()
    swap = {ENERGY: value}
    return replace(
        recording,
        observed=tuple(e.xreplace(swap) for e in recording.observed),
        sections=tuple(tuple(e.xreplace(swap) for e in parts) for parts in recording.sections),
        stop=None if recording.stop is None else recording.stop.xreplace(swap),
        sums=sums,
    )


@dataclass(frozen=True)
class ObservableArrays:
    """The observables of a scene, in the arrays of its kernel and of its result."""

    scene: Scene

    @cached_property
    def values(self) -> tuple[sp.Expr, ...]:
        """The values that the kernel tallies; observables of the same value share it."""
        return tuple(dict.fromkeys(observable.value for observable in self.scene.observe.values()))

    @cached_property
    def _rows(self) -> dict[sp.Expr, int]:
        """The number of components of each value: n for a value of each node, else 1."""
        equations = self.scene.equations
        return {value: equations.n if with_rows(equations, value) else 1 for value in self.values}

    @cached_property
    def _tallies_of(self) -> dict[sp.Expr, slice]:
        slices, first = {}, 0
        for value, rows in self._rows.items():
            slices[value] = slice(first, first + rows)
            first += rows
        return slices

    @property
    def numbers(self) -> int:
        """Number of values of all observables of a cell."""
        return sum(self._rows[observable.value] for observable in self.scene.observe.values())

    @property
    def tallies(self) -> int:
        """Number of tallies of a cell in the kernel: the length of time, and all tallies of each value."""
        return 1 + len(Tally) * sum(self._rows.values()) if self.values else 0

    def columns(self) -> Iterator[tuple[str, bool, slice]]:
        """Yield the name of each observable, whether each node has a value, and the columns in `Buffers.sums`."""
        first = len(SumColumn)
        for name, observable in self.scene.observe.items():
            rows = self._rows[observable.value]
            yield name, with_rows(self.scene.equations, observable.value), slice(first, first + rows)
            first += rows

    def summary(self, sums: np.ndarray) -> np.ndarray:
        """Convert the `sums` of a kernel to those of a result; NaN in cells that ended before their window."""
        if not self.values:
            return sums
        # The columns of the kernel are the length of the window so far, then the tallies of each value.
        length = sums[:, len(SumColumn), None]
        length = np.where(length > 0.0, length, np.nan)
        tallies = sums[:, len(SumColumn) + 1 :].reshape(len(sums), -1, len(Tally))
        parts = [sums[:, : len(SumColumn)]]
        for observable in self.scene.observe.values():
            parts.append(over_window(observable.window, tallies[:, self._tallies_of[observable.value]], length))
        return np.concatenate(parts, axis=1)


@dataclass(frozen=True)
class Sections:
    """The sections on functions of a scene, in the arrays of its kernel and of its result."""

    scene: Scene

    @cached_property
    def values(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """Each section function less its level, followed by the expressions that its points keep."""
        values = []
        for name, section in self.scene.sections.items():
            level = sp.Rational(repr(section.level))
            values.append((as_value(name, section.variable) - level, *(as_value(name, e) for e in _kept(section))))
        return tuple(values)

    @property
    def stop(self) -> sp.Expr | None:
        """The function that ends a cell."""
        return None if self.scene.stop is None else as_value("stop", self.scene.stop)

    def width(self, dimension: int) -> int:
        """Return the size of a section point without its time; `dimension` if sections are on states."""
        if Record.EVENTS in self.scene.record:
            return 3  # row, its mode before and after
        if not self.values:
            return dimension
        return 1 + max(len(parts) - 1 for parts in self.values)

    def variables(self, points: np.ndarray, most: int) -> Iterator[tuple[str, tuple[str, ...], np.ndarray]]:
        """Yield names, dimensions and values of the variables out of points (cells, room, 1 + width)."""
        room = max(most, 1)
        if Record.EVENTS in self.scene.record:
            yield from self._events(points, room)
        for k, (name, section) in enumerate(self.scene.sections.items()):
            # Move the points of this section to the front, in order, without the column of the section's number.
            belongs = points[:, :, 1] == k
            order = np.argsort(~belongs, axis=1, kind="stable")[:, :room]
            rows = np.full((len(points), room, 1 + len(_kept(section))), np.nan)
            sorted_points = np.delete(np.take_along_axis(points, order[:, :, None], axis=1), 1, axis=2)
            valid = np.take_along_axis(belongs, order, axis=1)[:, :, None]
            rows[:, : order.shape[1]] = np.where(valid, sorted_points[:, :, : rows.shape[2]], np.nan)
            yield f"{name}_count", (), belongs.sum(axis=1).astype(np.int32)
            yield f"{name}_time", ("point",), rows[:, :, 0]
            if _kept(section):
                yield name, ("point", f"{name}_kept"), rows[:, :, 1:]

    def _events(self, points: np.ndarray, room: int) -> Iterator[tuple[str, tuple[str, ...], np.ndarray]]:
        """Yield the variables of the record of events, cell by cell in the order of time."""
        known = np.isfinite(points[:, :, 1])
        place = np.where(known, points[:, :, 1], 0).astype(int)
        laws = np.array([law.value for law in self._laws])[place]
        node, row = np.moveaxis(np.array(self.owners).reshape(-1, 2)[place], -1, 0)
        before, after = points[:, :, 2], points[:, :, 3]

        # a contact that touches the limit of its mode and stays in it has no event
        known &= (laws != Law.SIGN) | (before != after)
        order = np.argsort(~known, axis=1, kind="stable")[:, :room]
        columns = {"time": points[:, :, 0], "node": node + 1.0, "row": row + 1.0, "before": before, "after": after}
        yield "event_count", (), known.sum(axis=1).astype(np.int32)
        for name, column in columns.items():
            values = np.full((len(points), room), np.nan)
            values[:, : order.shape[1]] = np.take_along_axis(np.where(known, column, np.nan), order, axis=1)
            yield f"event_{name}", ("event",), values

        # numbers of each node: impacts on open stops, starts of slip, resets
        happened = {
            "impacts": (Law.STOP, before == 1.0),
            "slips": (Law.SIGN, (before == 0.0) & (after != 0.0)),
            "resets": (Law.RESET, known),
        }
        for name, (law, holds) in happened.items():
            if law in self._laws:
                counted = [(known & holds & (laws == law) & (node == i)).sum(axis=1) for i in range(self.scene.n)]
                yield f"event_{name}", ("node",), np.stack(counted, axis=1).astype(np.int32)

    @cached_property
    def _laws(self) -> list[Law]:
        """The law of each contact or row in the order of `owners`."""
        equations = self.scene.equations
        if equations.joined:
            return [row.law for part in equations.parts for row in part.template.rows]
        conditions = (equations.node_at(i).conditions[a] for i, a in self.owners)
        return [condition.law if isinstance(condition, Row) else Law.SIGN for condition in conditions]

    @cached_property
    def owners(self) -> list[tuple[int, int]]:
        """The node, and the number in the node, of each contact or row in the order of the kernel: kind after kind."""
        equations = self.scene.equations
        if equations.joined:
            return [owner for part in equations.parts for owner in part.owners]
        nodes = sorted(range(equations.n), key=equations.kind_of.__getitem__)
        return [(i, a) for i in nodes for a in range(len(equations.node_at(i).conditions))]

    def points(self, cells: int, data: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the points (cells, room, 1 + width) from variables by name; the inverse of `variables`."""
        parts = []
        if Record.EVENTS in self.scene.record:
            places = {owner: row for row, owner in enumerate(self.owners)}
            ends = np.stack([data["event_node"], data["event_row"]], axis=-1).reshape(cells, -1, 2)
            rows = [[places[int(i) - 1, int(a) - 1] if i == i else np.nan for i, a in cell] for cell in ends]
            columns = (data[f"event_{name}"].reshape(cells, -1) for name in ("time", "before", "after"))
            time, before, after = columns
            return np.stack([time, np.array(rows, dtype=float).reshape(time.shape), before, after], axis=-1)
        for k, (name, section) in enumerate(self.scene.sections.items()):
            times = np.reshape(data[f"{name}_time"], (cells, -1))
            part = np.full((*times.shape, 1 + self.width(0)), np.nan)
            part[:, :, 0], part[:, :, 1] = times, np.where(np.isnan(times), np.nan, k)
            if size := len(_kept(section)):
                part[:, :, 2 : 2 + size] = np.reshape(data[name], (*times.shape, size))
            parts.append(part)
        points = np.concatenate(parts, axis=1)
        order = np.argsort(np.isnan(points[:, :, 0]), axis=1, kind="stable")
        return np.take_along_axis(points, order[:, :, None], axis=1)

    def meanings(self) -> dict[str, str]:
        """Return descriptions of the variables of the sections."""
        texts: dict[str, str] = {}
        for name, section in self.scene.sections.items():
            texts[f"{name}_count"] = f"number of points in the window where {section}"
            texts[f"{name}_time"] = f"times of the points where {section}"
            texts[name] = f"what is kept of the points where {section}, NaN where there are fewer"
        return texts


def _kept(section: Section) -> tuple[str, ...]:
    return section.keep or ()


def over_window(window: ObservedWindow, tallies: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return a reduction (cells, rows) over a window from tallies (cells, rows, len(Tally))."""
    # NaN for undefined values.
    gap = tallies[:, :, Tally.SUM] / length
    defined = np.where(np.isfinite(gap), 0.0, np.nan)
    match window:
        case ObservedWindow.MEAN:
            return np.asarray(tallies[:, :, Tally.FIRST] + gap)
        case ObservedWindow.VARIANCE:
            return np.asarray(np.maximum(tallies[:, :, Tally.SQUARES] / length - gap * gap, 0.0))
    column = {
        ObservedWindow.MAXIMUM: Tally.LARGEST,
        ObservedWindow.MINIMUM: Tally.LEAST,
        ObservedWindow.END: Tally.LATEST,
    }[window]
    return np.asarray(tallies[:, :, column] + defined)
