"""Drift of the energy: every case runs, conserves what it says it conserves, and a leak is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import benchmarks
from benchmarks.energy import CASES, COLUMNS, INTEGRATORS, Case, drift, measure_long
from benchmarks.energy import measure as measure_energy
from synchain.models.scenes.energy import energy_terms


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_case_is_conservative_and_moves(case: Case) -> None:
    exact = energy_terms(case.scene)
    (node,) = exact.nodes
    zero = {s: 0 for s in node.power.free_symbols if case.scene.parameters.get(s.name) == 0.0}
    assert node.power.xreplace(zero) == 0
    assert all(link.power == 0 for link in exact.links)
    equilibrium = np.abs(np.linalg.eigvals(jacobian(case)).imag)
    slowest = min(equilibrium[equilibrium > 1e-6])
    assert case.period == pytest.approx(2 * np.pi / slowest, rel=1e-9), "the period is that of the slowest mode"
    assert max(map(abs, case.scene.y0)) >= 0.5


def jacobian(case: Case) -> np.ndarray:
    """Of the whole network at its equilibrium 0."""
    scene = case.scene
    found = np.zeros((scene.equations.dimension,) * 2)
    for entry_at, entry in scene.equations.jacobian().items():
        values = {s: scene.parameters.get(s.name, 0.0) for s in entry.free_symbols}
        found[entry_at] = float(entry.xreplace(values))
    return found


@pytest.mark.long
def test_the_drift_shrinks_with_the_tolerance() -> None:
    case = CASES[1]
    largest, last, early, steps = drift(case, "dop853", 1e-9, 5)
    assert 0 < early <= largest < 1e-8
    assert last <= largest
    assert 5 < steps < 200
    tight = drift(case, "dop853", 1e-12, 5)
    assert tight[0] < largest / 100
    assert tight[3] > 2 * steps


def test_the_table_has_one_row_for_each_case_and_integrator(monkeypatch: pytest.MonkeyPatch) -> None:
    module = benchmarks.load("energy")
    asked = []
    monkeypatch.setattr(module, "drift", lambda case, method, rtol, n: asked.append(n) or (1.0, 2.0, 3.0, 4.0))
    for measure in (measure_energy, lambda: measure_energy(True), measure_long):
        rows = measure()
        assert [row[:2] for row in rows] == [(case.name, method) for case in CASES for method in INTEGRATORS]
        assert all(len(row) == len(COLUMNS) for row in rows)
    count = len(CASES) * len(INTEGRATORS)
    assert asked[0] == 10_000
    assert asked[count] == 20
    assert asked[2 * count] == 1_000_000


def test_a_failed_run_is_an_error() -> None:
    case = replace(CASES[1], scene=CASES[1].scene.replace(initial={"x": 1e300}))
    with pytest.raises(RuntimeError, match="harmonic chain, n = 4, dop853"):
        drift(case, "dop853", 1e-9, 5)
