"""How far the energy of conservative models drifts over many periods, for each integrator.

No method here is symplectic: all of them control their local error, which lets the energy drift or
wander. Each row is one trajectory; the drift is the largest |E - E_0| over |E_0| at samples spread
over the whole run. The period is that of the model's slowest small oscillation. The long form runs
for a hundred times as many periods.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.results.energy_of_states import energy_function
from synchain.runtime.sweeps.run import run

__all__ = ["CASES", "COLUMNS", "INTEGRATORS", "Case", "drift", "measure", "measure_long"]

COLUMNS = (
    "case",
    "integrator",
    "rtol",
    "periods",
    "largest drift",
    "drift at the end",
    "drift in the first tenth",
    "steps per period",
)
INTEGRATORS = ("cash_karp", "dop853", "taylor", "rodas5p", "rodas6p")
CHORDS = ("rodas6p",)
"""Methods that join the ends of their steps by chords: samples within a step say nothing about the
drift.
"""
RTOL = 1e-9
PERIODS, LONGER = 10_000, 100
SAMPLES = 401


@dataclass(frozen=True, slots=True)
class Case:
    """A conservative scene, the period of its slowest small oscillation, and the share of PERIODS
    that it is run for.
    """

    name: str
    scene: Scene
    period: float
    share: float = 1.0


def _scene(oscillator: str, **more: Any) -> Scene:
    return Scene(
        oscillator=oscillator, record=("trajectory",), samples=SAMPLES, transient=0.0, time_unit="time", **more
    )


def _bump(n: int, k: int) -> list[float]:
    return [math.sin(2 * math.pi * k * i / n) for i in range(n)]


CASES = (
    Case(
        "Duffing, undamped",
        _scene("duffing", parameters={"delta": 0.0, "u": 0.0}, initial={"x": 1.0, "v": 0.0}),
        2 * math.pi,
    ),
    Case(
        "harmonic chain, n = 4",
        _scene(
            "harmonic", topology=topology("chain", 4), parameters={"sigma": 0.5}, initial={"x": [1.0, 0.0, 0.0, 0.0]}
        ),
        2 * math.pi,
    ),
    Case(
        "double pendulum",
        _scene("double_pendulum", initial={"phi": 0.5, "psi": 0.3}),
        2 * math.pi / math.sqrt(2 - math.sqrt(2)),
    ),
    Case(
        "FPUT ring, n = 16, alpha = 1/4",
        _scene("mass", coupling="fput", topology=topology("ring", 16), initial={"x": _bump(16, 1)}),
        math.pi / math.sin(math.pi / 16),
        0.1,
    ),
)


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    return [row for case in CASES for row in _rows(case, 0.002 if quick else 1.0)]


def measure_long() -> list[tuple[object, ...]]:
    """Return the rows of runs a hundred times as long."""
    return [row for case in CASES for row in _rows(case, LONGER)]


def _rows(case: Case, factor: float) -> list[tuple[object, ...]]:
    periods = max(2, round(PERIODS * case.share * factor))
    return [(case.name, method, RTOL, periods, *drift(case, method, RTOL, periods)) for method in INTEGRATORS]


def drift(case: Case, integrator: str, rtol: float, periods: int) -> tuple[float, float, float, float]:
    """Return the largest drift, that at the end, the largest in the first tenth, and steps per
    period.

    Raises RuntimeError where the run fails.
    """
    scene = case.scene.replace(integrator=integrator, rtol=rtol, window=periods * case.period, max_steps=10**10)
    result = run(scene, workers=1, show_progress=False, reduce=False)
    if not result.success:
        raise RuntimeError(f"{case.name}, {integrator}: {result.message}")
    between = result.states("trajectory")[: -1 if integrator not in CHORDS else 1]
    states = np.vstack([between, result.states("end")])
    found = energy_function(scene)(states)
    relative = np.abs(found - found[0]) / abs(found[0])
    steps = float(result.steps.values + result.rejected.values) / periods
    early = relative[: 1 + (SAMPLES - 1) // 10].max() if integrator not in CHORDS else math.nan
    return float(relative.max()), float(relative[-1]), float(early), steps
