"""The table of synchronous ranges: measured by simulation, predicted from the probe, published."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from matplotlib.axes import Axes

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene

from ..prediction.intervals import Interval, intersect
from . import projection
from .figure_runs import FigureRuns, Quality
from .published import NOT_PERIODIC, PUBLISHED, Published, published
from .style import BLUE, COLUMN, GREEN, ORANGE, failures
from .tables import Table

__all__ = ["NAMES", "SIZE", "Row", "compute", "document", "draw", "joined", "nearest", "scene_of", "table"]

NAMES = ("thresholds",)
SIZE = (COLUMN, 4.1)
KINDS = (("measured", BLUE, 0.26), ("predicted", GREEN, 0.0), ("published", ORANGE, -0.26))
GAP = 0.001
"""Largest gap in sigma that is bridged, since the ends of chaotic ranges are ragged."""


@dataclass(frozen=True, slots=True)
class Row:
    """Synchronous ranges of one chain at one frequency.

    Parameters
    ----------
    n : int
        Number of oscillators.
    omega : float
        Drive frequency.
    measured, predicted : tuple of Interval
        Ranges of sigma.
    published : Published or None
        Published ranges.
    failed, cells : int
        Number of values of sigma without an error measure, and of all.
    """

    n: int
    omega: float
    measured: tuple[Interval, ...]
    predicted: tuple[Interval, ...]
    published: Published | None
    failed: int
    cells: int

    @property
    def printed(self) -> tuple[Interval, ...]:
        """The published ranges."""
        return self.published.intervals if self.published else ()

    @property
    def remark(self) -> str:
        """Remark of the paper, and remarks on the ranges."""
        words = [self.published.remark] if self.published else []
        if self.n == 2:
            words.append("the probe itself")
        bridged = joined(self.measured)
        gaps, more = len(self.measured) - len(bridged), len(bridged) - 1
        if gaps > 0:
            words.append(f"{gaps} narrow gap{'s' * (gaps > 1)} bridged")
        if more > 0:
            words.append(f"{more} more range{'s' * (more > 1)} measured")
        if not self.measured and not self.predicted:
            words.append("none predicted, none measured")
        if self.failed:
            words.append(failures(self.failed, self.cells))
        return "; ".join(words)


@dataclass(frozen=True, slots=True)
class Comparison:
    """All rows and the quality of their runs."""

    rows: tuple[Row, ...]
    quality: Quality


def compute(name: str, runs: FigureRuns) -> Comparison:
    """Measure the published rows, and longer chains at frequencies without periodic motion."""
    cases = [(row.n, row.omega) for row in PUBLISHED]
    cases += [(n, omega) for n in runs.quality.networks for omega in NOT_PERIODIC]
    return Comparison(tuple(_row(n, omega, runs) for n, omega in cases), runs.quality)


def _row(n: int, omega: float, runs: FigureRuns) -> Row:
    scene = scene_of(n, omega, runs)
    found = runs.network(scene)
    predicted = tuple(runs.predicted(scene))
    failed = int((~np.isfinite(found.error)).sum())
    return Row(n, omega, found.intervals, predicted, published(n, omega), failed, len(found.x))


def scene_of(n: int, omega: float, runs: FigureRuns) -> Scene:
    """Return the scene of the figure that shows this chain to share its runs, or a new one."""
    for scene in map(load_scene, projection.NAMES):
        if (scene.n, scene.parameters["omega"]) == (n, omega):
            return scene
    return runs.chain(n, omega)


def joined(found: tuple[Interval, ...], gap: float = GAP) -> tuple[Interval, ...]:
    """Bridge gaps of up to `gap` between neighbouring ranges."""
    kept: list[Interval] = []
    for low, high in found:
        start = kept.pop()[0] if kept and low - kept[-1][1] <= gap else low
        kept.append((start, high))
    return tuple(kept)


def nearest(found: tuple[Interval, ...], printed: tuple[Interval, ...]) -> Interval | None:
    """Return the range with the largest overlap with published ones, else the widest."""

    def merit(interval: Interval) -> tuple[float, float]:
        shared = sum(b - a for a, b in intersect([interval], printed))
        return shared, interval[1] - interval[0]

    return max(found, key=merit, default=None)


def table(data: Comparison) -> Table:
    """Return one row for each chain: nearest ranges, differences, all ranges, the criterion."""
    columns = ["n", "omega"]
    columns += [f"{kind}_{end}" for kind, _, _ in KINDS for end in ("low", "high")]
    columns += [f"{kind}_minus_published_{end}" for kind in ("measured", "predicted") for end in ("low", "high")]
    columns += ["all_measured", "all_predicted", "status", "remark", "resolution"]
    columns += [field.name for field in fields(data.quality.criterion)]
    criterion = [getattr(data.quality.criterion, field.name) for field in fields(data.quality.criterion)]
    rows = []
    for row in data.rows:
        measured, predicted, printed = _ends(row)
        differences = [
            _difference(a, b) for found in (measured, predicted) for a, b in zip(found, printed, strict=True)
        ]
        status = f"{row.failed} of {row.cells} failed" if row.failed else "finished"
        rows.append(
            (
                row.n,
                row.omega,
                *measured,
                *predicted,
                *printed,
                *differences,
                _listed(row.measured, 6),
                _listed(row.predicted, 6),
                status,
                row.remark,
                data.quality.resolution,
                *criterion,
            )
        )
    return Table(tuple(columns), tuple(rows))


def _ends(row: Row) -> tuple[tuple[float | None, float | None], ...]:
    none = (None, None)
    printed = row.printed[0] if row.printed else none
    measured, predicted = (nearest(joined(found), row.printed) for found in (row.measured, row.predicted))
    return measured or none, predicted or none, printed


def _difference(found: float | None, printed: float | None) -> float | None:
    return None if found is None or printed is None else found - printed


def _listed(intervals: tuple[Interval, ...], digits: int) -> str:
    return "; ".join(f"[{a:.{digits}f}, {b:.{digits}f}]" for a, b in intervals)


def document(data: Comparison) -> str:
    """Return the table in Markdown, with the criterion."""
    lines = [
        "# Synchronous ranges of the coupling sigma in chains of n friction oscillators",
        "",
        "| n | omega | measured | predicted | published | measured - published | predicted - published | remark |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in data.rows:
        measured, predicted, printed = _ends(row)
        cells = [str(row.n), f"{row.omega:.2f}", _shown(measured), _shown(predicted), _shown(printed)]
        for found in (measured, predicted):
            pairs = [_difference(a, b) for a, b in zip(found, printed, strict=True)]
            cells.append(", ".join(f"{d:+.4f}" for d in pairs if d is not None) or "-")
        lines.append("| " + " | ".join([*cells, row.remark]) + " |")
    return "\n".join([*lines, "", _how(data.quality), ""])


def _shown(ends: tuple[float | None, float | None]) -> str:
    return "none" if None in ends else f"[{ends[0]:.4f}, {ends[1]:.4f}]"


def _how(quality: Quality) -> str:
    c = quality.criterion
    return (
        f"Criterion: sigma counts as synchronous where at least half of {c.starts} starts (the stated one and copies "
        f"moved by up to {c.reach:g} in position, seed {c.seed}) end with an average synchronisation error below "
        f"{c.tolerance:g}, over {c.window:g} drive periods after a transient of {c.transient:g}, with rtol = {c.rtol:g}. "
        f"Ends are refined to {quality.resolution:g} in sigma.\n\n"
        "Measured: direct simulation of the chain. Predicted: the two-oscillator probe's ranges of alpha, projected "
        f"through every non-zero eigenvalue of the chain. Gaps of up to {GAP:g} within a range are bridged; where there "
        "are several ranges, the one nearest to the published is shown. `thresholds.csv` lists all ranges as found."
    )


def draw(axes: Axes, data: Comparison) -> Axes:
    """Draw bars over sigma, three for each chain: measured, predicted, published."""
    rows = data.rows
    for k, row in enumerate(rows):
        for kind, color, shift in KINDS:
            height = len(rows) - k + shift
            found = row.printed if kind == "published" else getattr(row, kind)
            for low, high in found:
                axes.plot(
                    [low, high],
                    [height, height],
                    color=color,
                    linewidth=3.0,
                    solid_capstyle="butt",
                    marker="|",
                    markersize=3.6,
                    markeredgewidth=0.8,
                )
        if not (row.measured or row.predicted or row.printed):
            axes.annotate("none measured, predicted or published", (0.004, len(rows) - k), fontsize=6.5, va="center")
    for kind, color, _ in KINDS:
        axes.plot([], [], color=color, linewidth=3.0, label=kind)
    for k in range(len(rows) - 1):
        axes.axhline(len(rows) - k - 0.5, color="0.85", linewidth=0.5)
    ends = [b for row in rows for _, b in (*row.measured, *row.predicted, *row.printed)]
    axes.set(xlim=(0.0, 1.08 * max(ends, default=1.0)), ylim=(0.4, len(rows) + 0.6), xlabel=r"coupling $\sigma$")
    axes.set_yticks([len(rows) - k for k in range(len(rows))], [rf"$n={r.n}$, $\omega={r.omega:.2f}$" for r in rows])
    axes.tick_params(axis="y", length=0)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, handlelength=1.2, columnspacing=1.0)
    return axes
