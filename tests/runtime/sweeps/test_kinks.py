"""Sweeps of equations with kinks on Taylor steps: records, lanes, loops and quotients beside another method."""

from __future__ import annotations

import numpy as np
import pytest

from synchain import Scene, run
from synchain.graphs import chain, ring

SLOW: dict[str, object] = {"kappa": 10.0, "sigma": 0.1, "theta_b": 0.02}
"""Over a slow belt every oscillator passes |w| = 0 twice a period."""


def pair(**more: object) -> Scene:
    settings: dict[str, object] = {
        "topology": chain(2), "parameters": SLOW, "initial": {"x": (0.3, 0.4), "v": (0.0, 0.05)}, "transient": 2, "window": 8,
        "rtol": 1e-12, "atol": 1e-13, "record": ("sync_error", "section", "trajectory"),
    }  # fmt: skip
    return Scene(**{**settings, **more})  # type: ignore[arg-type]


def test_records_are_those_of_another_method():
    series, stages = (run(pair(integrator=name, samples=41), show_progress=False).data for name in ("taylor", "dop853"))
    assert int(series.steps) < 0.5 * int(stages.steps)
    assert int(series.section_count) == int(stages.section_count) == 8
    for name in ("end", "trajectory", "section", "section_time", "sync_error", "sync_error_max"):
        assert np.abs(series[name].values - stages[name].values).max() < 3e-11


def test_a_cell_does_not_depend_on_its_neighbours():
    settings = {"topology": chain(1), "parameters": {"kappa": 10.0}, "initial": {"x": 0.3, "v": 0.0}, "record": ()}
    scene = pair(**settings, integrator="taylor")
    speeds = np.linspace(0.005, 0.08, 11)
    together = run(scene, theta_b=speeds, show_progress=False).data.end.values
    alone = [run(scene, theta_b=[speed], show_progress=False).data.end.values[0] for speed in speeds[[0, 5, 10]]]
    assert together[[0, 5, 10]].tolist() == [end.tolist() for end in alone]


@pytest.mark.long
def test_loops_and_lines_agree_in_a_large_network():
    settings = {"record": (), "transient": 0, "window": 2, "initial": {"x": 0.3, "v": 0.0}}
    starts = {"x": tuple(0.3 + 0.02 * i for i in range(12)), "v": 0.0}
    scene = pair(topology=ring(12), **{**settings, "initial": starts})
    series, stages = (run(scene.replace(integrator=name), show_progress=False).data for name in ("taylor", "dop853"))
    assert np.abs(series.end.values - stages.end.values).max() < 2e-11


def test_equal_oscillators_stay_equal_with_and_without_the_quotient():
    scene = pair(initial={"x": 0.3, "v": 0.0}, samples=41, integrator="taylor")  # the kernel of the records
    full = run(scene, show_progress=False, reduce=False).states()
    merged = run(scene.replace(record=()), show_progress=False).states()
    assert full[0] == full[1]
    assert full[2] == full[3]
    assert np.abs(full - merged).max() < 1e-12


def test_circuits_with_kinks_are_those_of_another_method():
    settings = {"oscillator": "chua", "coupling": "x->x", "parameters": {"sigma": 1.0}, "initial": {"x": (0.1, -0.2)}}
    scene = pair(**settings, window=20, transient=0, time_unit="time", record=())
    series, stages = (run(scene.replace(integrator=name), show_progress=False).data for name in ("taylor", "dop853"))
    assert np.abs(series.end.values - stages.end.values).max() < 1e-7 * np.abs(stages.end.values).max()
