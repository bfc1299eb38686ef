"""Hard cases end right or say why not; phases and synchronous states keep their digits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from family_sizes import size

from benchmarks import stability
from benchmarks.kit.stability_cases import Case, cases
from benchmarks.kit.stability_reference import end_state
from synchain import Scene, exponents, run
from synchain.graphs import topology
from synchain.models.graphs.families import names
from synchain.results import Status

QUICK = list(cases(quick=True))
STATUS, ALLOWED, ENERGY, VERDICT = (
    stability.COLUMNS.index(name) for name in ("status", "allowed", "energy residual", "verdict")
)


DEAR = {
    "phases with pulses, taylor", "three bodies, taylor", "pendulum of four links, taylor", "roots and powers, taylor",
    "switched on, taylor", "at rest, taylor", "Lorenz, taylor", "spring of two slopes, taylor", "a = 0", "belt reversed",
    "omega = 1e-3", "start at above the belt", "start at 1e-300",
}  # fmt: skip
"""Cases with a kernel or a reference of their own, whose links, masses, functions and numbers are near those of others."""


def marked(case: Case) -> Any:
    twice = case.group == "steepness" and case.scene.rtol == 1e-8  # between two other tolerances
    name = f"{case.group} {case.name} {case.scene.rtol:g}"
    return pytest.param(case, id=name, marks=[pytest.mark.long] if twice or case.name in DEAR else [])


@pytest.mark.parametrize("case", [marked(case) for case in QUICK])
def test_hard_cases_are_right(case: Case) -> None:
    row = stability.row(case)
    assert row[STATUS] == "FINISHED"
    assert row[VERDICT] == "right", row
    assert math.isnan(row[ENERGY]) or abs(row[ENERGY]) <= max(row[ALLOWED], 1e-12), row


def test_verdicts() -> None:
    assert stability._verdict(Status.FINISHED, 1.0, 1.0) == "right"
    assert stability._verdict(Status.FINISHED, 1.1, 1.0) == "WRONG"
    assert stability._verdict(Status.FINISHED, math.nan, 1.0) == "WRONG"
    assert stability._verdict(Status.FINISHED, 1.1, 1.0, warned=True) == "warned"
    assert stability._verdict(Status.STEP_BUDGET, math.nan, 1.0) == "says so"


def test_stiff_springs_are_said() -> None:
    """sigma = 1e8: at rtol = 1e-4 the error is several hundred tolerances, measured by
    `python -m benchmarks stability`.
    """
    scene = next(c.scene for c in QUICK if c.name == "sigma = 1e+08")
    assert any("a mode of frequency 2e+04 swings 1.91e+04 times" in warning for warning in scene.warnings)
    assert Scene(topology=topology("chain", 4), parameters={"sigma": 0.6}).warnings == ()
    swept = scene.replace(sigma=0.0, axes={"sigma": [0.0, 1e8]}, window=60.0)
    assert any("1.91e+05 times" in warning for warning in swept.warnings)


def test_a_wrong_law_is_seen() -> None:
    """The reference of another steepness, 1 % away, is further off than what is allowed."""
    case = next(c for c in QUICK if c.name == "kappa = 1e5" and c.scene.rtol == 1e-8)
    states = run(case.scene, reduce=False, show_progress=False).states("end")
    right, wrong = (end_state(s, "radau") for s in (case.scene, case.scene.replace(kappa=1.01e5)))
    allowed = stability.row(case)[ALLOWED]
    assert np.abs(states - right).max() < 0.1 * allowed < allowed < np.abs(states - wrong).max()


def apart(sigma: float, length: float) -> Scene:
    """Two oscillators that a negative coupling drives apart."""
    return Scene(
        oscillator="harmonic",
        topology=topology("chain", 2),
        coupling="x->v",
        parameters={"sigma": sigma},
        record=(),
        integrator="rodas5p",
        transient=0.0,
        window=length,
        time_unit="time",
    )


def test_growth_is_right_until_it_has_left_double_precision_behind() -> None:
    """A difference of 1e-2 that grows as cosh(sqrt(39) t): 1e8 at t = 4, beyond 2^53 at t = 7."""
    scene = apart(-20.0, 4.0)
    result, expected = run(scene, reduce=False, show_progress=False), end_state(scene, "growth")
    assert int(result.status) == Status.FINISHED
    np.testing.assert_allclose(result.states("end"), expected, rtol=1e-6)
    far = run(apart(-20.0, 7.0), reduce=False, show_progress=False)
    assert int(far.status) == Status.DIVERGED
    assert 4.0 < float(far.end_time) < 7.0
    assert "beyond 2^53" in far.message


@pytest.mark.parametrize("periods", [100_000.0, 1_000_000.0])
def test_the_phase_of_the_drive_after_a_million_periods(periods: float) -> None:
    scene = next(c.scene for c in QUICK if c.group == "long").replace(transient=periods, rtol=1e-10)
    result = run(scene, show_progress=False)
    assert int(result.status) == Status.FINISHED
    assert np.abs(result.states("end") - end_state(scene, "steady")).max() < 1e-9


@pytest.mark.parametrize("name", names())
def test_equal_starts_stay_equal_to_the_last_bit(name: str) -> None:
    """At a coupling at which the synchronous state is unstable, on every graph, as `run` integrates
    it.
    """
    graph = topology(name, size(name, 8))
    scene = Scene(
        topology=graph,
        initial={"x": 0.3, "v": 0.0},
        transient=0.0,
        window=60.0,
        time_unit="time",
        parameters={"sigma": 2.0, "omega": 1.15},
    )
    for width in (1, 8):
        result = run(scene, width=width, show_progress=False)
        x, v = result.states("end").reshape(2, graph.n)
        assert (x == x[0]).all(), "positions"
        assert (v == v[0]).all(), "velocities"
        assert float(result.sync_error_max) == 0.0


@pytest.mark.parametrize(
    ("sigma", "gap", "least", "rel"), [(0.12, 1e-3, 1e-12, 5e-3), (0.12, 1e-12, 2e-14, 5e-2), (0.5, 1e-12, 1e-13, 2e-3)]
)
def test_a_small_difference_follows_the_transversal_exponent(
    sigma: float, gap: float, least: float, rel: float
) -> None:
    """The logarithm of the difference at every second period, on the attractor, against the
    exponent.

    Below `least` the difference is made of rounding.
    """
    settled = Scene(parameters={"omega": 1.15}, transient=400.0, window=0.0, record=())
    x, v = run(settled, show_progress=False).states("end")
    scene = Scene(
        topology=topology("chain", 2),
        parameters={"omega": 1.15, "sigma": sigma},
        transient=0.0,
        window=30.0,
        record=("trajectory",),
        samples=16,
        rtol=1e-11,
        atol=1e-15,
        integrator="rodas5p",
        initial={"x": [float(x), float(x) + gap], "v": [float(v), float(v)]},
    )
    result = run(scene, reduce=False, show_progress=False)
    assert int(result.status) == Status.FINISHED
    states, times = result.states("trajectory"), result.time.values
    distance = np.hypot(states[:, 0] - states[:, 1], states[:, 2] - states[:, 3])
    linear = (distance > least) & (distance < 2e-3)
    assert linear.sum() >= 3
    slope = np.polyfit(times[linear], np.log(distance[linear]), 1)[0]
    expected = float(exponents(scene.replace(record=("sync_error",)), [2.0 * sigma]).exponent[0])
    assert slope == pytest.approx(expected, rel=rel)
    assert (expected < 0.0) == (sigma < 0.233)


@pytest.mark.long
def test_many_equal_oscillators_move_as_one_alone() -> None:
    """A hundred in a chain, every one integrated by an explicit method: bit for bit the motion of
    one.
    """
    settings = {
        "integrator": "dop853",
        "initial": {"x": 0.3, "v": 0.0},
        "transient": 0.0,
        "window": 6.0,
        "time_unit": "time",
        "record": (),
    }
    values = {"kappa": 1e2}
    many = Scene(topology=topology("chain", 100), parameters={**values, "sigma": 1.0}, **settings)
    ends = [
        run(s, reduce=False, show_progress=False).states("end") for s in (many, Scene(parameters=values, **settings))
    ]
    for end, alone in zip(ends[0].reshape(2, 100), ends[1], strict=True):
        assert (end == end[0]).all()
        assert end[0] == pytest.approx(alone, abs=1e-6)
