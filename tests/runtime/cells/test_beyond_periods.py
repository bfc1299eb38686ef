"""Taylor steps go on beyond the ends of the drive's periods; a motion that comes to repeat itself is found all the same."""

from __future__ import annotations

import numpy as np
import pytest

from synchain import Field, Scene, run
from synchain.graphs import chain

PERIOD = 2.0 * np.pi / 1.3
DRIVEN = Field({"x": "v", "v": "-x - delta*v + u*cos(omega*t)"}, parameters={"delta": 0.0, "u": 0.5, "omega": 1.3})
FREE = Scene(DRIVEN, topology=chain(1), initial={"x": 0.2, "v": 0.0}, record=(), rtol=1e-12)


def undamped(t: np.ndarray) -> np.ndarray:
    """The exact motion from x = 0.2 at rest."""
    share = 0.5 / (1.0 - 1.3**2)
    return np.stack(
        [
            share * np.cos(1.3 * t) + (0.2 - share) * np.cos(t),
            -1.3 * share * np.sin(1.3 * t) - (0.2 - share) * np.sin(t),
        ]
    )


def test_steps_do_not_end_at_the_ends_of_periods():
    result = run(FREE.replace(transient=0.0, window=400.0))
    assert result.steps.item() < 2.6 * 400  # of the lengths that the series allow, every period had three


def test_the_clock_keeps_its_digits():
    result = run(FREE.replace(transient=20_000.0, window=0.25))
    error = np.abs(np.ravel(result.end) - undamped(np.array(20_000.25 * PERIOD))).max()
    assert error < 3e-10  # 1e5 units of time; an error of 1e-14 a period would show


@pytest.mark.parametrize("transient", [2.0, 3.37, 0.9999])
def test_samples_and_windows_amid_periods(transient):
    result = run(FREE.replace(transient=transient, window=61.3, record=("trajectory",), samples=77))
    times = np.linspace(transient, transient + 61.3, 77) * PERIOD
    np.testing.assert_allclose(np.squeeze(result.trajectory).T, undamped(times), atol=3e-11)


def test_the_window_of_a_mean_begins_and_ends_amid_periods():
    result = run(FREE.replace(transient=3.37, window=2.21, observe={"mean": "mean(x)"}))
    share, ends = 0.5 / (1.0 - 1.3**2), np.array([3.37, 5.58]) * PERIOD
    area = np.diff(share * np.sin(1.3 * ends) / 1.3 + (0.2 - share) * np.sin(ends)).item()
    assert result.mean.item() == pytest.approx(area / (2.21 * PERIOD), abs=1e-10)


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-12])
def test_a_motion_that_repeats_itself_is_jumped_over_with_the_same_bits(rtol):
    scene = FREE.replace(parameters={"delta": 0.2}, rtol=rtol, transient=2000.0, window=10.5)
    jumped, full = run(scene), run(scene, reduce=False)
    assert jumped.periods_skipped.item() > 1000
    assert full.periods_skipped.item() == 0
    np.testing.assert_array_equal(jumped.end, full.end)
    assert jumped.steps.item() < 0.5 * full.steps.item()


def test_a_motion_of_three_periods_is_found():
    """A hardening spring without a linear part, driven 2.5 times as fast as it swings, has motions of three periods."""
    spring = Field({"x": "v", "v": "-x**3 - v/10 + cos(omega*t)"}, parameters={"omega": 2.5})
    scene = Scene(spring, topology=chain(1), initial={"x": -2.5, "v": -2.0}, record=("trajectory",), samples=4)
    result = run(scene.replace(transient=3000.0, window=3.0))
    first, *between, last = np.squeeze(result.trajectory)
    np.testing.assert_allclose(first, last, atol=1e-12)  # times of samples have so many digits
    assert min(np.abs(first - other).max() for other in between) > 0.1
    assert result.periods_skipped.item() > 2000
    assert result.periods_skipped.item() % 3 == 0
