"""The table of synchronous ranges: measured by simulation, predicted from the probe, where exponents
are negative, published.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from matplotlib.axes import Axes

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import Table
from ..plots.exponent import finite
from ..plots.style import BLACK, BLUE, COLUMN, GREEN, ORANGE, PURPLE, failures
from ..prediction.intervals import Interval, intersect
from ..support.error_text import with_error
from ..synchronisation.criterion import Criterion
from ..synchronisation.exponent_windows import ExponentWindows
from . import projection
from .exponent_figure import curve
from .figure_runs import FigureRuns, Quality
from .published import NOT_PERIODIC, PUBLISHED, Published, published

NAMES = ("thresholds",)
SIZE = (COLUMN, 4.8)
KINDS = (
    ("measured", BLUE, 0.3),
    ("predicted", GREEN, 0.1),
    ("exponents", PURPLE, -0.1),
    ("published", ORANGE, -0.3),
)
FOUND = ("measured", "predicted", "exponents")
GAP = 0.001
"""Largest gap in sigma that is bridged, since the ends of chaotic ranges are ragged."""


@dataclass(frozen=True, slots=True)
class ThresholdRow:
    """Synchronous ranges of one chain at one frequency."""

    n: int  # number of oscillators
    omega: float  # drive frequency
    measured: tuple[Interval, ...]  # ranges of sigma
    predicted: tuple[Interval, ...]
    windows: ExponentWindows  # ranges of sigma with negative exponents
    published: Published | None  # published ranges
    failed: int  # number of values of sigma without an error measure, and of all
    cells: int

    @property
    def printed(self) -> tuple[Interval, ...]:
        """The published ranges."""
        return self.published.intervals if self.published else ()

    @property
    def exponents(self) -> tuple[Interval, ...]:
        """The ranges with negative exponents."""
        return self.windows.intervals

    @property
    def errors(self) -> tuple[float | None, float | None]:
        """Standard errors of the ends of the nearest range with negative exponents."""
        found = nearest(self.exponents, self.printed)
        return (None, None) if found is None else self.windows.errors[self.exponents.index(found)]

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
        if self.windows.absent:
            words.append(f"exponents {self.windows.text()}")
        if self.failed:
            words.append(failures(self.failed, self.cells))
        return "; ".join(words)


@dataclass(frozen=True, slots=True)
class Comparison:
    """All rows and the quality of their runs."""

    rows: tuple[ThresholdRow, ...]
    quality: Quality


def compute(name: str, runs: FigureRuns) -> Comparison:
    """Measure the published rows, and longer chains at frequencies without periodic motion."""
    cases = [(row.n, row.omega) for row in PUBLISHED]
    cases += [(n, omega) for n in runs.quality.networks for omega in NOT_PERIODIC]
    return Comparison(tuple(_row(n, omega, runs) for n, omega in cases), runs.quality)


def _row(n: int, omega: float, runs: FigureRuns) -> ThresholdRow:
    scene = scene_of(n, omega, runs)
    found = runs.network(scene)
    predicted = tuple(runs.predicted(scene))
    windows = windows_of(scene, runs)
    failed = int((~np.isfinite(found.error)).sum())
    return ThresholdRow(n, omega, found.intervals, predicted, windows, published(n, omega), failed, len(found.x))


def windows_of(scene: Scene, runs: FigureRuns) -> ExponentWindows:
    """Return the windows of a network from the exponents of its oscillator, which networks share."""
    return ExponentWindows.of(replace(curve(scene, runs), scene=scene))


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
    columns += ["exponents_low_error", "exponents_high_error"]
    columns += [f"{kind}_minus_published_{end}" for kind in FOUND for end in ("low", "high")]
    columns += [*(f"all_{kind}" for kind in FOUND), "status", "remark", "resolution"]
    columns += [field.name for field in fields(Criterion)]
    criterion = [getattr(data.quality.criterion, field.name) for field in fields(Criterion)]
    rows = []
    for row in data.rows:
        *found, printed = _ends(row)
        differences = [_difference(a, b) for ends in found for a, b in zip(ends, printed, strict=True)]
        status = f"{row.failed} of {row.cells} failed" if row.failed else "finished"
        rows.append(
            (
                row.n,
                row.omega,
                *(end for ends in found for end in ends),
                *printed,
                *row.errors,
                *differences,
                *(_listed(getattr(row, kind), 6) for kind in FOUND),
                status,
                row.remark,
                data.quality.resolution,
                *criterion,
            )
        )
    return Table(tuple(columns), tuple(rows))


def _ends(row: ThresholdRow) -> tuple[tuple[float | None, float | None], ...]:
    none = (None, None)
    printed = row.printed[0] if row.printed else none
    gaps = {"exponents": 0.0}
    found = (nearest(joined(getattr(row, kind), gaps.get(kind, GAP)), row.printed) for kind in FOUND)
    return *(ends or none for ends in found), printed


def _difference(found: float | None, printed: float | None) -> float | None:
    return None if found is None or printed is None else found - printed


def _listed(intervals: tuple[Interval, ...], digits: int) -> str:
    return "; ".join(f"[{a:z.{digits}f}, {b:z.{digits}f}]" for a, b in intervals)


def document(data: Comparison) -> str:
    """Return the table in Markdown, with the criterion."""
    lines = [
        "# Synchronous ranges of the coupling sigma in chains of n friction oscillators",
        "",
        "| n | omega | measured | predicted | exponents | published | measured - published | predicted - published "
        "| exponents - published | remark |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in data.rows:
        *found, printed = _ends(row)
        cells = [str(row.n), f"{row.omega:.2f}", *map(_shown, found[:2]), _with_errors(row, found[2]), _shown(printed)]
        for ends in found:
            pairs = [_difference(a, b) for a, b in zip(ends, printed, strict=True)]
            cells.append(", ".join(f"{d:+z.4f}" for d in pairs if d is not None) or "-")
        lines.append("| " + " | ".join([*cells, row.remark]) + " |")
    return "\n".join([*lines, "", _how(data.quality), ""])


def _shown(ends: tuple[float | None, float | None]) -> str:
    return "none" if None in ends else f"[{ends[0]:z.4f}, {ends[1]:z.4f}]"


def _with_errors(row: ThresholdRow, ends: tuple[float | None, float | None]) -> str:
    if row.windows.absent:
        return "not computed"
    pairs = zip(ends, row.errors, strict=True)
    words = [with_error(end, error or 0.0) for end, error in pairs if end is not None]
    return f"[{', '.join(words)}]" if words else "none"


def _how(quality: Quality) -> str:
    c = quality.criterion
    return (
        f"Criterion: sigma counts as synchronous where at least half of {c.starts} starts (the stated one and copies "
        f"moved by up to {c.reach:g} in position, seed {c.seed}) end with an average synchronisation error below "
        f"{c.tolerance:g}, over {c.window:g} drive periods after a transient of {c.transient:g}, with rtol = {c.rtol:g}. "
        f"Ends are refined to {quality.resolution:g} in sigma.\n\n"
        "Measured: direct simulation of the chain. Predicted: the two-oscillator probe's ranges of alpha, projected "
        "through every non-zero eigenvalue of the chain. Exponents: the ranges of alpha with a negative transversal "
        "exponent, projected in the same way, with the errors of their ends, those of averages and of the interpolation "
        "between strengths (0 at sigma = 0); they know neither "
        f"transient nor tolerance. Gaps of up to {GAP:g} within a measured or predicted range are bridged; where there are "
        "several ranges, the one nearest to the published is shown. `thresholds.csv` lists all ranges as found."
    )


def draw(axes: Axes, data: Comparison) -> Axes:
    """Draw bars over sigma, one of each kind for each chain, with two standard errors of exponents."""
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
        for window, errors in zip(row.exponents, row.windows.errors, strict=True):
            places, spread = [len(rows) - k - 0.1] * 2, 2 * finite(np.array(errors))
            axes.errorbar(window, places, xerr=spread, fmt="none", ecolor=BLACK, elinewidth=0.6)
        if not any(getattr(row, kind) for kind in (*FOUND, "printed")):
            axes.annotate("none of any kind", (0.004, len(rows) - k), fontsize=6.5, va="center")
    for kind, color, _ in KINDS:
        axes.plot([], [], color=color, linewidth=3.0, label=kind)
    for k in range(len(rows) - 1):
        axes.axhline(len(rows) - k - 0.5, color="0.85", linewidth=0.5)
    ends = [b for row in rows for _, b in (*row.measured, *row.predicted, *row.exponents, *row.printed)]
    axes.set(xlim=(0.0, 1.08 * max(ends, default=1.0)), ylim=(0.4, len(rows) + 0.6), xlabel=r"coupling $\sigma$")
    axes.set_yticks([len(rows) - k for k in range(len(rows))], [rf"$n={r.n}$, $\omega={r.omega:.2f}$" for r in rows])
    axes.tick_params(axis="y", length=0)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, handlelength=1.2, columnspacing=1.0)
    return axes
