"""Growth without bound is told from motion that grows and is sound."""

from __future__ import annotations

import numpy as np
import pytest

import synchain as sc
from synchain.codegen.driver import clock_slots
from synchain.codegen.driver.cells import unbounded
from synchain.runtime.support.status import Status

FREE = {"time_unit": "time", "transient": 0}
TAYLOR = FREE | {"integrator": "taylor"}


@pytest.mark.parametrize(
    ("n", "sigma", "most"),
    [(2, -1.0, 300_000), pytest.param(3, -2.0, 140_000, marks=pytest.mark.long), (4, -10.0, 300_000)],
)
def test_networks_that_drive_each_other_apart_end_long_before_their_budget(n: int, sigma: float, most: int) -> None:
    scene = sc.Scene("rossler", "x->x", sc.graphs.chain(n), window=1000, **TAYLOR)
    result = sc.run(scene, sigma=sigma)
    assert result.status == Status.DIVERGED
    assert result.steps < most
    assert abs(result.end).max() < 2**53 / 1000
    assert np.isfinite(result.end).all()


def test_a_window_that_the_budget_reaches_is_integrated_to_its_end() -> None:
    scene = sc.Scene("rossler", "x->x", sc.graphs.chain(2), window=40, **TAYLOR)
    result = sc.run(scene, sigma=-1.0)
    assert result.status == Status.FINISHED
    assert abs(result.end).max() > 1e4


PHASE = {"x": "v", "v": "1 + sin(x)/10"}
SOUND = {
    "a phase that turns ever faster": sc.Field(PHASE),
    "a phase with an even torque, from afar": sc.Field(PHASE, initial={"x": 1e9}),
    "a phase whose speed grows as the square of time": sc.Field({"x": "v", "v": "s + sin(x)/10", "s": "1"}),
    "a growing wave in linear equations": sc.Field({"x": "v", "v": "x/50 - 10000*x + v/50"}, initial={"x": 1}),
    "amplitudes that are bounded far away": sc.Field(
        {"x": "v", "v": "-x**3 + v*(1 - x**2/10**4)/5"}, initial={"x": "1/1000"}
    ),
}


@pytest.mark.parametrize("what", SOUND)
def test_sound_motions_that_run_out_of_steps_are_not_called_diverged(what: str) -> None:
    """Each has a window that 20 000 steps cannot reach, so that the growth alone is judged."""
    scene = sc.Scene(SOUND[what], window=1e6, max_steps=20_000, **TAYLOR)
    result = sc.run(scene)
    assert result.steps + result.rejected == 20_000
    assert result.status == Status.STEP_BUDGET


def test_linear_growth_has_its_exponent() -> None:
    scene = sc.Scene(sc.Field({"x": "x/2 - y", "y": "x + y/2"}, initial={"x": 1}), "x->x")
    result = sc.exponents(scene, [0.0, 0.25], periods=50)
    np.testing.assert_allclose(result.exponent, [0.5, 0.375], atol=1e-8)


def clock(**values: float) -> np.ndarray:
    """The clock of one lane."""
    found = np.zeros(clock_slots.CLOCK)
    for name, value in values.items():
        found[getattr(clock_slots, name)] = value
    return found


def control(steps: float) -> np.ndarray:
    """A budget."""
    clock = np.zeros(clock_slots.FURTHER)
    clock[clock_slots.MAX_STEPS] = steps
    return clock


# The doubling that ends at step 4096 took 1 unit of time, the one before 0.95; the state has grown 600-fold.
GROWING = {"ACCEPTED": 4096, "MARK": 4096, "TIME": 5, "MARKED_AT": 4, "LAPSE": 0.95, "END": 100}
GROWN = {"HIGH": 600, "RECORD": 300, "ORIGIN": 1}


@pytest.mark.parametrize(
    ("change", "budget", "expected"),
    [
        ({}, 1e5, True),
        ({}, 3e5, False),  # 2048 steps a unit of time, 95 units
        ({"END": 30}, 1e5, False),
        ({"LAPSE": 0.9}, 1e5, False),
        ({"LAPSE": 1.2}, 1e5, False),  # a jump between slow motions
        ({"RECORD": 430}, 1e5, False),
        ({"ORIGIN": 3}, 1e5, False),
        ({"MARK": 4097}, 1e5, False),
    ],
)
def test_every_condition_of_unbounded_growth_counts(change: dict[str, float], budget: float, expected: bool) -> None:
    assert bool(unbounded.py_func(0, clock(**GROWING | GROWN | change), control(budget))) is expected
