"""Phases that have turned far move as near zero, and a rounding that exceeds the tolerance is told."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.special import ellipk

import synchain as sc

FREE = {"transient": 0, "time_unit": "time", "record": ()}
SPEED = math.sqrt(0.75)
"""Mean speed of th' = 1 + sin(th)/2."""

METHODS = ["taylor", "dop853", "rodas5p", "cash_karp"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [0, 1e4, 1e6])
def test_a_phase_keeps_its_mean_speed_wherever_it_starts(start: float, method: str) -> None:
    field = sc.Field({"th": "1 + sin(th)/2"})
    scene = sc.Scene(field, None, initial={"th": start}, window=100 * math.pi / SPEED, integrator=method, **FREE)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = sc.run(scene)
    assert abs((result.end.item() - start) / (100 * math.pi) - 1) < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_phases_at_high_frequency_move_as_in_the_frame_that_turns_along(method: str) -> None:
    """Kuramoto's equations hold differences alone; one step turns by millions of radians."""
    phases = sc.Field({"th": "omega"}, parameters={"omega": 0.0})
    push = sc.Rates({"th": "k*W*sin(th_j - th_i)"}, {"k": 0.5})
    common = FREE | {"initial": {"th": [0.0, 1.0, 2.5, 4.0]}, "window": 2, "integrator": method, "rtol": 1e-6}
    frequencies = np.array([-0.5, 0.25, 0.125, 0.75])
    ends = [
        sc.run(
            sc.Scene(phases, push, sc.graphs.ring(4), parameters={"omega": list(frequencies + shift)}, **common)
        ).end.values.reshape(-1)
        for shift in (0.0, 1e7)
    ]
    assert abs(ends[0] - ends[0][0]).max() > 0.3
    np.testing.assert_allclose(ends[1] - ends[1][0], ends[0] - ends[0][0], atol=2e-5)


@pytest.mark.parametrize("method", METHODS)
def test_a_pendulum_that_turned_over_many_times_keeps_its_period(method: str) -> None:
    """Over the top with energy v**2/2 - cos(q) = 3: a turn takes k K(k**2) 2/omega with k**2 = 2/(1 + 3), omega = 1."""
    pendulum, turns = sc.Field({"q": "v", "v": "-sin(q)"}), 20
    turn = 2 * math.sqrt(0.5) * ellipk(0.5)
    start = 2 * math.pi * 10**5
    scene = sc.Scene(
        pendulum,
        None,
        initial={"q": start, "v": math.sqrt(8)},
        window=turns * turn,
        integrator=method,
        rtol=1e-9,
        **FREE,
    )
    q, v = sc.run(scene).end.values.reshape(-1)
    assert abs(q - start - 2 * math.pi * turns) < 1e-5
    assert abs(v - math.sqrt(8)) < 1e-6


def test_an_angle_whose_rounding_exceeds_its_tolerance_is_told() -> None:
    field = sc.Field({"th": "1 + sin(th)/2"})
    scene = sc.Scene(field, None, initial={"th": 1e10}, window=1, **FREE)
    with pytest.warns(RuntimeWarning, match=r"the angle th.* grew to 1e\+10, where its rounding is 2.2e-06; expected"):
        sc.run(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sc.run(scene, th_1=1e7)
