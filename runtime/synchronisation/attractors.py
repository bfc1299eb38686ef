"""Attractors of a basin: conditions on the motion over a window, and groups of motions that no condition names.

Sources: grouping by features of the motion, Stender & Hoffmann, Nonlinear Dyn. 107, 1451 (2022); matching of groups
along a parameter, Datseris, Luiz Rossi & Wagemakers, Chaos 33, 073151 (2023).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import sympy as sp

from synchain.models.dynamics.angles import periods_of_kinds
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.observable import Observable, mean, nodes, rate, variance
from synchain.models.dynamics.observable_text import Condition, as_condition
from synchain.models.inputs.checks import check_table, check_text
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.scene import Scene

from ..cells.observable_arrays import ObservableArrays

ALIKE, CLOSE = 0.25, 1e-3
"""Two motions count as one if their features differ by less than ALIKE times the size of the motion, plus CLOSE times
the range of the feature over all starts (choices, those of `sweeps.certify`)."""

SETTLED = 0.02
"""A motion still changes if its features differ between windows by more than ALIKE times its size, plus SETTLED times
the range of the feature (a choice)."""

STILL = 1e-3
"""A network is at rest if each component moves less than this part of its scale within the window (a choice)."""

FOLLOWED = 0.2
"""Groups of two neighbouring cells are one attractor if their features differ by less than this part of their range (a
choice)."""

RARE, MOST = 0.01, 12
"""Groups with fewer than this part of the starts of every cell, and groups beyond the MOST largest, have no number
(choices)."""

STATES = 16
"""Nodes without a common component are compared by at most this number of states (a choice)."""


SYNCHRONOUS, REST = "synchronous", "rest"
"""Attractors that need no condition: all nodes move alike; nothing moves."""

PREFIX = "basin_"
"""Beginning of the names of the observables that a basin adds to a scene."""


@dataclass(frozen=True, slots=True)
class Features:
    """Features of the motions in a window; arrays (cells, coordinates)."""

    level: np.ndarray  # mean over nodes and time
    swing: np.ndarray  # standard deviation over time of the mean over nodes
    apart: np.ndarray  # mean over time of the standard deviation over nodes

    @property
    def table(self) -> np.ndarray:
        """All features (cells, 3 coordinates)."""
        return np.concatenate([self.level, self.swing, self.apart], axis=1)

    def take(self, cells: np.ndarray) -> Features:
        """Return the features of some cells."""
        return Features(self.level[cells], self.swing[cells], self.apart[cells])

    def alike(self, other: Features, ranges: np.ndarray, near: float = CLOSE) -> np.ndarray:
        """Return whether motions count as one (cells,), at a distance of `near` ranges. Shapes: ranges (coordinates,)."""
        size = np.maximum(np.hypot(self.swing, self.apart), np.hypot(other.swing, other.apart))
        allowed = np.tile(ALIKE * size + near * ranges, 3)
        return np.asarray(np.all(np.abs(self.table - other.table) <= allowed, axis=1))


@dataclass(frozen=True)
class Attractors:
    """Named attractors, and the observables of a window by which motions are told apart.

    `coordinates`: components that all nodes have, cosine and sine of those that are angles; if nodes have none in
    common, the first states of the network.
    """

    table: FrozenDict[str]  # the condition of each attractor, by name
    conditions: FrozenDict[Condition]  # of the attractors other than SYNCHRONOUS and REST
    coordinates: tuple[sp.Expr, ...]
    common: bool  # True if coordinates are those of all nodes
    still: tuple[tuple[sp.Expr, float | None], ...]  # components, and their periods, that are at rest; for REST

    @classmethod
    def of(cls, scene: Scene, table: Mapping[str, str] | None, reserved: tuple[str, ...]) -> Attractors:
        """Check the argument `attractors` of `basin`; by default the synchronous state, if there are nodes to compare."""
        equations = scene.equations
        comparable = equations.n > 1 and bool(equations.compared)
        if table is None:
            table = {SYNCHRONOUS: SYNCHRONOUS} if comparable else {}
        texts: dict[str, str] = {}
        conditions: dict[str, Condition] = {}
        for key, value in check_table("basin: attractors", table).items():
            name = check_text("basin: attractors", key)
            if not name.strip() or name in reserved or name.startswith("other "):
                raise ValueError(f"basin: attractors: found the name {name!r}; expected one that no other share has")
            text = texts[name] = check_text(f"basin: attractor {name!r}", value)
            if text == SYNCHRONOUS and not comparable:
                raise ValueError(
                    f"basin: attractor {name!r}: found {SYNCHRONOUS!r} for {equations.n} nodes with "
                    f"{len(equations.compared)} components in common; expected nodes that can be compared"
                )
            if text not in (SYNCHRONOUS, REST):
                conditions[name] = as_condition(f"basin: attractor {name!r}", text)
        coordinates, common = _coordinates(equations)
        still: tuple[tuple[sp.Expr, float | None], ...] = ()
        if REST in texts.values():
            still = tuple(_components(equations)) if common else tuple((z, None) for z in coordinates)
        return cls(FrozenDict(texts), FrozenDict(conditions), coordinates, common, still)

    def name_of(self, text: str) -> str | None:
        """Return the first name of an attractor without a condition, or None."""
        return next((name for name, value in self.table.items() if value == text), None)

    def watched(self, scene: Scene) -> Scene:
        """Return the scene with the observables of a window; ValueError for a condition that does not fit."""
        over = nodes.mean if self.common else (lambda z: z)
        observe: dict[str, Observable] = {}
        for k, z in enumerate(self.coordinates):
            observe[f"{PREFIX}level_{k}"], observe[f"{PREFIX}swing_{k}"] = mean(over(z)), variance(over(z))
            if self.common and scene.n > 1:
                observe[f"{PREFIX}apart_{k}"] = mean(nodes.std(z))
        for k, (z, _) in enumerate(self.still):
            observe[f"{PREFIX}speed_{k}"] = mean(over(rate(z) ** 2))
        scene = scene.replace(observe=observe)
        for name, condition in self.conditions.items():
            for symbol, observable in condition.observed:
                key = f"{PREFIX}{list(self.conditions).index(name)}_{symbol}"
                try:
                    scene = scene.replace(observe={**scene.observe, key: observable})
                except ValueError as error:
                    reason = str(error).removeprefix(f"observe {key}: ")
                    raise ValueError(f"basin: attractor {name!r}: {reason}") from None
            symbols = condition.truth.free_symbols - {symbol for symbol, _ in condition.observed}
            if unknown := {str(symbol) for symbol in symbols} - {*scene.equations.parameters}:
                known = ", ".join(scene.equations.parameters)
                raise ValueError(f"basin: attractor {name!r}: unknown parameter {min(unknown)!r}; known: {known}")
        for key, each, columns in ObservableArrays(scene).columns():
            if each and columns.stop - columns.start > 1:
                value = scene.observe[key]
                raise ValueError(
                    f"basin: attractors: found {value}, which each node has; expected one value, of x_1 or nodes.mean(x)"
                )
        return scene

    def features(self, observed: Mapping[str, np.ndarray]) -> Features:
        """Return the features of windows from their observables (cells,)."""

        def columns(kind: str) -> np.ndarray:
            names = [f"{PREFIX}{kind}_{k}" for k in range(len(self.coordinates))]
            return np.stack([observed.get(name, 0.0 * observed[f"{PREFIX}level_0"]) for name in names], axis=1)

        return Features(columns("level"), np.sqrt(columns("swing")), columns("apart"))

    def ranges(self, features: Sequence[Features], box: Mapping[str, float]) -> np.ndarray:
        """Return the range of each coordinate (coordinates,) over motions and starts in `box`; 2 for angles."""
        level = np.concatenate([each.level for each in features])
        level = level[np.isfinite(level).all(axis=1)]
        extent = np.ptp(level, axis=0) if len(level) else np.zeros(len(self.coordinates))
        starts = np.array([box.get(str(z), 2.0 if z.args else 0.0) for z in self.coordinates])
        return np.asarray(np.maximum(extent, starts))

    def speeds(self, observed: Mapping[str, np.ndarray], windows: np.ndarray, ranges: np.ndarray) -> np.ndarray:
        """Return the largest part of its range, or period, that a component moves in windows (cells,)."""
        range_of = dict(zip(self.coordinates, ranges, strict=True))
        speed = np.sqrt(np.stack([observed[f"{PREFIX}speed_{k}"] for k in range(len(self.still))], axis=1))
        size = np.array([period or range_of[z] for z, period in self.still])
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.where(speed > 0.0, speed * windows[:, None] / size, 0.0)
        return np.asarray(shares.max(axis=1))

    def holds(self, name: str, observed: Mapping[str, np.ndarray], parameters: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return whether the condition of an attractor holds in windows (cells,)."""
        condition = self.conditions[name]
        prefix = f"{PREFIX}{list(self.conditions).index(name)}_"
        values = {symbol: observed[f"{prefix}{symbol}"] for symbol, _ in condition.observed}
        values |= {s: parameters[s.name] for s in condition.truth.free_symbols - set(values)}
        truth = sp.lambdify(list(values), condition.truth, "numpy")(*values.values())
        return np.broadcast_to(np.asarray(truth, dtype=bool), next(iter(observed.values())).shape)


def _components(equations: Equations) -> list[tuple[sp.Expr, float | None]]:
    """Return the components that all nodes have, each with its period if it is an angle."""
    periods: dict[str, set[float | None]] = {}
    for node, row in zip(equations.nodes, periods_of_kinds(equations), strict=True):
        for symbol, period in zip(node.state, row, strict=True):
            periods.setdefault(symbol.name, set()).add(period)
    names = [name for name in equations.components if name in equations.common and name not in equations.modes]
    return [(sp.Symbol(n, real=True), next(iter(periods[n])) if len(periods[n]) == 1 else None) for n in names]


def _coordinates(equations: Equations) -> tuple[tuple[sp.Expr, ...], bool]:
    """Return the coordinates of `Attractors`, and whether they are those of all nodes."""
    coordinates: list[sp.Expr] = []
    for z, period in _components(equations):
        if period is None:
            coordinates.append(z)
        else:
            factor = Fraction(2.0 * math.pi / period).limit_denominator(1000)
            coordinates += [sp.cos(sp.Rational(factor) * z), sp.sin(sp.Rational(factor) * z)]
    if coordinates:
        return tuple(coordinates), True
    names = [name for name in equations.state if name.rpartition("_")[0] not in equations.modes]
    return tuple(sp.Symbol(name, real=True) for name in names[:STATES]), False


def groups_of(features: Features, ranges: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """Return the number of the motion of each start, from 1; 0 for a motion without a number.

    Shapes: ranges (coordinates,); place (cells,), index of the answer's cell of each start; count, number of starts in
    an answer's cell. Motions of one cell that count as one make a group. Groups of successive cells that are near each
    other have one number, so that numbers follow an attractor along a parameter.
    """
    table, scale = features.table, np.tile(np.where(ranges > 0.0, ranges, 1.0), 3)
    number = np.zeros(len(table), dtype=int)
    centres = np.empty((0, table.shape[1]))  # the latest features of each number
    for cell in np.unique(place):
        remaining = np.flatnonzero(place == cell)
        free = np.ones(len(centres), dtype=bool)
        while len(remaining):
            first = features.take(remaining[:1])
            alike = features.take(remaining).alike(first, ranges)
            alike[0] = True
            rows, remaining = remaining[alike], remaining[~alike]
            if len(rows) < RARE * count:
                continue
            centre = np.median(table[rows], axis=0)
            gaps = np.max(np.abs(centres - centre) / scale, axis=1, initial=0.0)
            gaps[~free] = np.inf
            if len(gaps) and gaps.min() <= FOLLOWED:
                chosen = int(gaps.argmin())
                centres[chosen], free[chosen] = centre, False
            else:
                chosen = len(centres)
                centres, free = np.vstack([centres, centre]), np.append(free, False)
            number[rows] = chosen + 1
    # number the groups by their sizes, the largest first
    sizes = np.bincount(number, minlength=len(centres) + 1)[1:]
    rank = np.zeros(len(sizes) + 1, dtype=int)
    rank[1 + np.argsort(-sizes, kind="stable")] = np.arange(1, len(sizes) + 1)
    rank[rank > MOST] = 0
    return rank[number]
