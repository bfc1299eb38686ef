"""Are the narrow synchronous windows of chains made by the smoothing of the friction law?

For each drive frequency the range of alpha with a negative transversal exponent is measured under
the smoothed law, at several steepnesses kappa, and under the exact set-valued law. A chain
synchronises where all its sigma |gamma_k| lie in the range, so a window of sigma exists where the
ratio of the range's ends exceeds that of the chain's eigenvalues.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.stability.exponents import Exponents, exponents
from synchain.runtime.synchronisation.threshold import critical_ratio

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    "omega",
    "n",
    "kappa",
    "alpha from",
    "+-",
    "alpha to",
    "+-",
    "ratio",
    "+-",
    "needed",
    "sigma from",
    "sigma to",
    "time per start",
    "starts",
)
CASES = ((1.40, 4), (1.55, 3))
"""Frequency of the drive, and the chain whose window the paper shows there."""

KAPPAS = (1e4, 1e5, 1e6, 1e7, 1e9, math.inf)
"""Steepness of the smoothed law; infinite: the set-valued law."""

STARTS, PERIODS = 8, 25_000
Row = tuple[object, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` averages over a hundredth of
    the time.
    """
    rows = []
    for omega, n in CASES:
        for kappa in (1e5, math.inf) if quick else KAPPAS:
            rows.append(row(omega, n, kappa, PERIODS / 100 if quick else PERIODS, 2 if quick else STARTS))
    return rows


def row(omega: float, n: int, kappa: float, periods: float, starts: int) -> Row:
    """Measure one range; of several the widest."""
    exact = math.isinf(kappa)
    parameters = {"omega": omega} if exact else {"omega": omega, "kappa": kappa}
    scene = Scene(topology=topology("chain", 2), contact="set-valued" if exact else "atan", parameters=parameters)
    found = exponents(scene, np.linspace(0.0, 0.8, 801), periods=periods, starts=starts, precision=1e-5)
    gamma = topology("chain", n).spectrum
    sizes = [abs(value) for value in gamma.values if value != 0.0]
    head: Row = (omega, n, kappa)
    tail: Row = (found.time, found.averaged)
    nothing = (math.nan,) * 6 + (critical_ratio(gamma), math.nan, math.nan)
    if not found.ranges:
        return (*head, *nothing, *tail)
    (low, low_error), (high, high_error) = _widest(found)
    ratio = high / low if low > 0.0 else math.inf
    error = ratio * math.hypot(low_error / low, high_error / high) if low > 0.0 else math.nan
    first, last = low / min(sizes), high / max(sizes)
    window = (first, last) if first < last else (math.nan, math.nan)
    return (*head, low, low_error, high, high_error, ratio, error, critical_ratio(gamma), *window, *tail)


def _widest(found: Exponents) -> tuple[tuple[float, float], tuple[float, float]]:
    return max(found.ranges, key=lambda ends: ends[1][0] - ends[0][0])


def draw(rows: list[Row]) -> Figure:
    """The ratio of the range's ends against kappa, with what the chain needs; the exact law at the
    right.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    cases = list(dict.fromkeys((r[0], r[1]) for r in rows))
    for axes, (omega, n) in zip(figure.subplots(1, len(cases), squeeze=False)[0], cases, strict=True):
        own = [r for r in rows if (r[0], r[1]) == (omega, n)]
        smooth = [r for r in own if not math.isinf(float(str(r[2])))]
        exact = [r for r in own if r not in smooth]
        axes.errorbar(
            [r[2] for r in smooth],
            [r[7] for r in smooth],
            [r[8] for r in smooth],
            fmt="o-",
            capsize=3,
            label="smoothed law",
        )
        for r in exact:
            value, error = float(str(r[7])), float(str(r[8]))
            axes.axhspan(value - error, value + error, color="C1", alpha=0.3, label="set-valued law")
        axes.axhline(float(str(own[0][9])), color="black", linestyle="--", label=f"needed by {n} in a chain")
        axes.set(xscale="log", xlabel="kappa", title=f"omega = {omega:.2f}")
        axes.legend()
    figure.axes[0].set_ylabel("alpha, upper end over lower end")
    return figure
