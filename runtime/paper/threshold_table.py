"""The table of synchronous ranges: simulated, predicted from the probe, of negative exponents, and published."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import as_csv
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
# Kinds of ranges, with the colour and the height of their bars.
KINDS = {"measured": (BLUE, 0.3), "predicted": (GREEN, 0.1), "exponents": (PURPLE, -0.1), "published": (ORANGE, -0.3)}
COMPUTED = ("measured", "predicted", "exponents")
# Largest gap in sigma between two ranges that count as one, since ends of chaotic ranges are ragged (a choice).
GAP = 0.001
Ends = tuple[float | None, float | None]  # ends of a range; None where there is no range, or no published number


@dataclass(frozen=True, slots=True)
class ThresholdRow:
    n: int  # number of oscillators
    omega: float  # drive frequency
    measured: tuple[Interval, ...]  # ranges of sigma
    predicted: tuple[Interval, ...]
    windows: ExponentWindows  # ranges of sigma with negative exponents
    row: Published | None  # row of the paper
    failed: int  # number of values of sigma without a measured error
    cells: int  # number of all values of sigma

    def ranges(self, kind: str) -> tuple[Interval, ...]:
        return {
            "measured": self.measured,
            "predicted": self.predicted,
            "exponents": self.windows.intervals,
            "published": self.row.intervals if self.row else (),
        }[kind]

    def ends(self, kind: str) -> Ends:
        """Return the ends of the range with the largest overlap with the published one."""
        intervals, printed = self.ranges(kind), self.ranges("published")
        if kind == "published":
            return intervals[0] if intervals else (None, None)
        # Keep gaps between ranges of negative exponents, which are smooth functions of sigma.
        return nearest(intervals if kind == "exponents" else joined(intervals), printed) or (None, None)

    def differences(self, kind: str) -> Ends:
        """Return the differences between the ends of a kind and the published ends."""
        low, high = (
            None if end is None or printed is None else end - printed
            for end, printed in zip(self.ends(kind), self.ends("published"), strict=True)
        )
        return low, high

    @property
    def errors(self) -> Ends:
        """Standard errors of the ends of the nearest range with negative exponents."""
        intervals = self.ranges("exponents")
        interval = nearest(intervals, self.ranges("published"))
        return (None, None) if interval is None else self.windows.errors[intervals.index(interval)]

    @property
    def remark(self) -> str:
        remarks = [self.row.remark] if self.row else []
        if self.n == 2:
            remarks.append("the probe itself")
        bridged = joined(self.measured)
        gaps, more = len(self.measured) - len(bridged), len(bridged) - 1
        if gaps > 0:
            remarks.append(f"{gaps} narrow gap{'s' * (gaps > 1)} bridged")
        if more > 0:
            remarks.append(f"{more} more range{'s' * (more > 1)} measured")
        if not self.measured and not self.predicted:
            remarks.append("none predicted, none measured")
        if self.windows.absent:
            remarks.append(f"exponents {self.windows.text()}")
        if self.failed:
            remarks.append(failures(self.failed, self.cells))
        return "; ".join(remarks)


@dataclass(frozen=True, slots=True)
class Comparison:
    rows: tuple[ThresholdRow, ...]
    quality: Quality


def compute(name: str, runs: FigureRuns) -> Comparison:
    """Compute the published rows, and rows of longer chains at frequencies without periodic motion."""
    cases = [(row.n, row.omega) for row in PUBLISHED]
    cases += [(n, omega) for n in runs.quality.networks for omega in NOT_PERIODIC]
    rows = []
    for n, omega in cases:
        scene = scene_of(n, omega, runs)
        sweep, predicted, windows = runs.network(scene), tuple(runs.predicted(scene)), windows_of(scene, runs)
        failed = int((~np.isfinite(sweep.error)).sum())
        row = published(n, omega)
        rows.append(ThresholdRow(n, omega, sweep.intervals, predicted, windows, row, failed, len(sweep.x)))
    return Comparison(tuple(rows), runs.quality)


def windows_of(scene: Scene, runs: FigureRuns) -> ExponentWindows:
    """Return the windows of a network from the exponents of its oscillator, computed once for all networks."""
    return ExponentWindows.of(replace(curve(scene, runs), scene=scene))


def scene_of(n: int, omega: float, runs: FigureRuns) -> Scene:
    """Return the scene of the figure with this chain, whose runs are shared, else a new scene."""
    for scene in map(load_scene, projection.NAMES):
        if (scene.n, scene.parameters["omega"]) == (n, omega):
            return scene
    return runs.chain(n, omega)


def joined(intervals: tuple[Interval, ...], gap: float = GAP) -> tuple[Interval, ...]:
    """Bridge gaps of up to `gap` between neighbouring ranges."""
    bridged: list[Interval] = []
    for low, high in intervals:
        start = bridged.pop()[0] if bridged and low - bridged[-1][1] <= gap else low
        bridged.append((start, high))
    return tuple(bridged)


def nearest(intervals: tuple[Interval, ...], printed: tuple[Interval, ...]) -> Interval | None:
    """Return the range with the largest overlap with published ones, else the widest."""

    def merit(interval: Interval) -> tuple[float, float]:
        overlap = sum(b - a for a, b in intersect([interval], printed))
        return overlap, interval[1] - interval[0]

    return max(intervals, key=merit, default=None)


def texts(data: Comparison) -> dict[str, str]:
    """Return one row for each chain, as CSV with all ranges and the criterion, and as Markdown."""
    records = [_record(row, data.quality) for row in data.rows]
    return {".csv": as_csv(tuple(records[0]), [tuple(record.values()) for record in records]), ".md": document(data)}


def _record(row: ThresholdRow, quality: Quality) -> dict[str, object]:
    record: dict[str, object] = {"n": row.n, "omega": row.omega}
    for kind in KINDS:
        record[f"{kind}_low"], record[f"{kind}_high"] = row.ends(kind)
    record["exponents_low_error"], record["exponents_high_error"] = row.errors
    for kind in COMPUTED:
        record[f"{kind}_minus_published_low"], record[f"{kind}_minus_published_high"] = row.differences(kind)
    for kind in COMPUTED:
        record[f"all_{kind}"] = "; ".join(f"[{a:z.6f}, {b:z.6f}]" for a, b in row.ranges(kind))
    record["status"] = f"{row.failed} of {row.cells} failed" if row.failed else "finished"
    criterion = {field.name: getattr(quality.criterion, field.name) for field in fields(Criterion)}
    return record | {"remark": row.remark, "resolution": quality.resolution} | criterion


def document(data: Comparison) -> str:
    lines = [
        "# Synchronous ranges of the coupling sigma in chains of n friction oscillators",
        "",
        "| n | omega | measured | predicted | exponents | published | measured - published | predicted - published "
        "| exponents - published | remark |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in data.rows:
        measured, predicted, printed = (_range_text(row.ends(kind)) for kind in ("measured", "predicted", "published"))
        cells = [str(row.n), f"{row.omega:.2f}", measured, predicted, _exponents_text(row), printed]
        for kind in COMPUTED:
            cells.append(", ".join(f"{d:+z.4f}" for d in row.differences(kind) if d is not None) or "-")
        lines.append("| " + " | ".join([*cells, row.remark]) + " |")
    c = data.quality.criterion
    criterion = (
        f"Criterion: sigma counts as synchronous where at least half of {c.starts} starts (the stated one and copies "
        f"moved by up to {c.reach:g} in position, seed {c.rng}) end with an average synchronisation error below "
        f"{c.tolerance:g}, over {c.window:g} drive periods after a transient of {c.transient:g}, with rtol = {c.rtol:g}. "
        f"Ends are refined to {data.quality.resolution:g} in sigma."
    )
    kinds = (
        "Measured: direct simulation of the chain. Predicted: the two-oscillator probe's ranges of alpha, projected "
        "through every non-zero eigenvalue of the chain. Exponents: the ranges of alpha with a negative transversal "
        "exponent, projected in the same way, with the errors of their ends, those of averages and of the interpolation "
        "between strengths (0 at sigma = 0); they know neither "
        f"transient nor tolerance. Gaps of up to {GAP:g} within a measured or predicted range are bridged; where there are "
        "several ranges, the one nearest to the published is shown. `thresholds.csv` lists all ranges as found."
    )
    return "\n".join([*lines, "", criterion, "", kinds, ""])


def _range_text(ends: Ends) -> str:
    return "none" if None in ends else f"[{ends[0]:z.4f}, {ends[1]:z.4f}]"


def _exponents_text(row: ThresholdRow) -> str:
    if row.windows.absent:
        return "not computed"
    pairs = zip(row.ends("exponents"), row.errors, strict=True)
    ends = [with_error(end, error or 0.0) for end, error in pairs if end is not None]
    return f"[{', '.join(ends)}]" if ends else "none"


def draw(figure: Figure, data: Comparison) -> Axes:
    """Draw bars over sigma, one of each kind for each chain, with two standard errors of exponents."""
    axes, rows = figure.add_subplot(), data.rows
    for k, row in enumerate(rows):
        for kind, (color, shift) in KINDS.items():
            for ends in row.ranges(kind):
                axes.plot(
                    ends,
                    [len(rows) - k + shift] * 2,
                    color=color,
                    linewidth=3.0,
                    solid_capstyle="butt",
                    marker="|",
                    markersize=3.6,
                    markeredgewidth=0.8,
                )
        heights = [len(rows) - k + KINDS["exponents"][1]] * 2
        for ends, errors in zip(row.ranges("exponents"), row.windows.errors, strict=True):
            spread = 2 * finite(np.array(errors))
            axes.errorbar(ends, heights, xerr=spread, fmt="none", ecolor=BLACK, elinewidth=0.6)
        if not any(row.ranges(kind) for kind in KINDS):
            axes.annotate("none of any kind", (0.004, len(rows) - k), fontsize=6.5, va="center")
    for kind, (color, _) in KINDS.items():
        axes.plot([], [], color=color, linewidth=3.0, label=kind)
    for k in range(len(rows) - 1):
        axes.axhline(len(rows) - k - 0.5, color="0.85", linewidth=0.5)
    highest = max((high for row in rows for kind in KINDS for _, high in row.ranges(kind)), default=1.0)
    axes.set(xlim=(0.0, 1.08 * highest), ylim=(0.4, len(rows) + 0.6), xlabel=r"coupling $\sigma$")
    axes.set_yticks([len(rows) - k for k in range(len(rows))], [rf"$n={r.n}$, $\omega={r.omega:.2f}$" for r in rows])
    axes.tick_params(axis="y", length=0)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, handlelength=1.2, columnspacing=1.0)
    return axes
