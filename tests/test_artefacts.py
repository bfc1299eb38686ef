"""Artefacts of simulated synchronisation, each provoked, and what tells it apart from the real thing."""

from __future__ import annotations

import numpy as np
import pytest

from synchain.models.scene import Scene
from synchain.models.topology import topology
from synchain.runtime import run
from synchain.runtime.certificate import SYNCHRONOUS, VERDICTS

STABLE = "synchronous, certified by the exponent"
APART = VERDICTS[6]
"""The verdict on cells that are not synchronous although the synchronous state is stable."""


def pair(**more: object) -> Scene:
    settings = {"topology": topology("chain", 2), "transient": 60.0, "window": 40.0, "parameters": {"omega": 1.15}}
    return Scene(**{**settings, **more})  # type: ignore[arg-type]


def test_a_short_run_moves_a_threshold_that_the_exponent_does_not() -> None:
    """Just below sigma = 0.233 the error decays with 0.003 a unit of time: 100 periods are too few to see that."""
    found = run(pair(initial={"x": [0.3, 0.2]}), sigma=[0.1, 0.228], certified=True, show_progress=False)
    assert found.sync_error[0] < SYNCHRONOUS < found.sync_error[1]
    assert (found.transversal_exponent.values < 0.0).all()
    assert found.transversal_exponent.values[1] > -0.01
    assert [VERDICTS[k] for k in found.verdict.values] == [STABLE, APART]


@pytest.fixture(scope="module")
def copies() -> np.ndarray:
    """The states (2, 2) of one oscillator on its cycle of two periods of the drive, one period apart."""
    alone = Scene(parameters={"omega": 1.15}, window=0.0, record=())
    return np.array([run(alone.replace(transient=t), show_progress=False).end.values for t in (400.0, 401.0)])


def test_two_copies_of_one_cycle_are_not_synchronous_though_the_state_is_stable(copies: np.ndarray) -> None:
    assert np.abs(copies[0] - copies[1]).max() > 0.05
    near = [copies[0], copies[0] + [1e-3, 0.0]]
    verdicts = []
    for states in (copies, near):
        start = {"x": [s[0] for s in states], "v": [s[1] for s in states]}
        found = run(pair(initial=start), sigma=[0.02], certified=True, show_progress=False)
        assert float(found.transversal_exponent[0]) < 0.0
        verdicts.append(VERDICTS[int(found.verdict[0])])
    assert verdicts == [APART, STABLE]


def test_exchanged_oscillators_give_exchanged_ends() -> None:
    one = run(pair(initial={"x": [0.3, 0.1]}), sigma=[0.05], show_progress=False)
    two = run(pair(initial={"x": [0.1, 0.3]}), sigma=[0.05], show_progress=False)
    ends = [found.end.values.reshape(2, 2) for found in (one, two)]
    np.testing.assert_allclose(ends[0], ends[1][:, ::-1], rtol=0, atol=1e-10)
    assert one.sync_error.item() == pytest.approx(two.sync_error.item(), rel=1e-6)


def test_equal_oscillators_stay_equal_and_are_not_called_stable() -> None:
    """Coalescence: what is equal bit for bit stays so for ever; a distance of 1e-12 tells that the state is unstable."""
    found = [
        run(pair(initial={"x": [0.3, 0.3 + gap]}), sigma=[0.5], certified=True, show_progress=False)
        for gap in (0.0, 1e-12)
    ]
    assert found[0].sync_error.item() == 0.0
    assert VERDICTS[found[0].verdict.item()] == "synchronous by round-off only: the state is unstable"
    assert found[1].sync_error.item() > SYNCHRONOUS
    assert VERDICTS[found[1].verdict.item()] == "not synchronous, the state is unstable"
