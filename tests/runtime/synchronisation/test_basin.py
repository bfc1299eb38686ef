"""Basin stability against shares that are known in closed form, and every cell accounted for."""

from __future__ import annotations

import dataclasses
import math
import pickle
from concurrent.futures import Executor, Future

import numpy as np
import pytest
from kept_values import basin as kept_basin

from synchain import Criterion, Field, Scene, basin, universal_probe
from synchain.graphs import chain
from synchain.results import Basin, Probe, Status
from synchain.runtime.synchronisation.basin import Fate, random_starts

FREE = Scene(oscillator="harmonic", topology=chain(2), parameters={"sigma": 0.0})
DAMPED = Scene(oscillator="harmonic", topology=chain(3), coupling="damper", parameters={"sigma": 0.5})
PENDULA = Scene(oscillator="pendulum", topology=chain(2), parameters={"sigma": 0.0}, rtol=1e-12)
SHORT = {"transient": 5.0, "window": 5.0}


@pytest.fixture(scope="module")
def free() -> Basin:
    return basin(FREE, samples=1000, tolerance=1.0, **SHORT)


def test_undamped_pairs_keep_their_distance(free):
    """Free oscillators of frequency 1 turn about the origin of the phase plane: their distance there is constant."""
    x_1, x_2, v_1, v_2 = free.start.T
    np.testing.assert_allclose(free.error, np.hypot(x_1 - x_2, v_1 - v_2), rtol=1e-5)


def test_share_of_free_pairs_is_that_of_two_points_in_a_square(free):
    """Two points of a unit square are closer than s <= 1 with the probability pi s^2 - 8 s^3/3 + s^4/2.

    Source: Solomon, Geometric Probability (SIAM, 1978), ch. 2.  The square has the side 2 here, so that s = 1/2.
    """
    s = 0.5
    volume = math.pi * s**2 - 8 * s**3 / 3 + s**4 / 2
    assert free.share == pytest.approx(volume, abs=4 * math.sqrt(volume * (1 - volume) / free.samples))
    low, high = free.interval
    assert low < volume < high
    assert free.count == np.count_nonzero(free.synchronous) == round(free.share * 1000)


def test_uncoupled_oscillators_never_synchronise_and_damped_ones_always():
    """Where none or all do, the interval ends at (1 - confidence)/2 to the power 1/samples (Clopper & Pearson)."""
    never = basin(FREE, samples=200, tolerance=1e-3, **SHORT)
    always = basin(DAMPED, samples=200, transient=300.0, window=10.0, confidence=0.9)
    assert (never.share, always.share) == (0.0, 1.0)
    assert never.interval == pytest.approx((0.0, 1.0 - 0.025 ** (1 / 200)))
    assert always.interval == pytest.approx((0.05 ** (1 / 200), 1.0))
    assert always.statuses == {Status.FINISHED: 200}


def test_parameters_override_those_of_the_scene():
    assert basin(DAMPED, samples=20, transient=300.0, window=10.0, sigma=0.0).share == 0.0


def test_cells_that_do_not_finish_are_counted_and_reported():
    """x'' = -x + x^3 - delta x' escapes to infinity from beyond its saddles at x = ±1."""
    settings = {"beta": -1.0, "delta": 0.2, "u": 0.0, "sigma": 0.2}
    result = basin(
        Scene(oscillator="duffing", topology=chain(2), parameters=settings), samples=200, ranges={"x": (-2.0, 2.0)},
        transient=30.0, window=1.0,
    )  # fmt: skip
    lost = result.statuses[Status.DIVERGED]
    assert 0 < lost < 200
    assert result.statuses == {Status.FINISHED: 200 - lost, Status.DIVERGED: lost}
    assert np.array_equal(np.isinf(result.error), result.status == Status.DIVERGED)
    assert result.count == 200 - lost
    assert result.share == (200 - lost) / 200
    assert f"{lost} cells: the state grew without bound" in result.message
    assert "confidence 0.95" in result.message


def test_a_spent_budget_is_no_synchronisation():
    result = basin(DAMPED.replace(max_steps=3), samples=10, **SHORT)
    assert result.share == 0.0
    assert result.statuses == {Status.STEP_BUDGET: 10}


def test_a_seed_gives_one_result_whatever_the_workers(free):
    again = basin(FREE, samples=1000, tolerance=1.0, workers=1, **SHORT)
    for name in ("start", "error", "status"):
        assert np.array_equal(getattr(again, name), getattr(free, name))
    other = basin(FREE, samples=1000, tolerance=1.0, seed=1, **SHORT)
    assert not np.isin(other.start, free.start).any()


def test_a_smaller_sample_is_the_beginning_of_a_larger_one(free):
    few = basin(FREE, samples=37, tolerance=1.0, **SHORT)
    assert np.array_equal(few.start, free.start[:37])
    assert np.array_equal(few.error, free.error[:37])


def test_starts_fill_their_ranges_and_the_rest_stays():
    result = basin(
        DAMPED.replace(initial={"x": [0.7, 0.8, 0.9]}), samples=300, ranges={"v": (2.0, 5.0)}, transient=0.0, window=0.1
    )
    assert (result.start[:, :3] == [0.7, 0.8, 0.9]).all()
    v = result.start[:, 3:]
    assert len(np.unique(v)) == v.size
    assert v.min() >= 2.0
    assert v.max() < 5.0
    np.testing.assert_allclose(v.mean(axis=0), 3.5, atol=4 * 3 / math.sqrt(12 * 300))
    np.testing.assert_allclose(np.corrcoef(v.T), np.eye(3), atol=4 / math.sqrt(300))


def test_the_order_of_the_ranges_does_not_matter():
    pair = [{"x": (0, 1), "v": (5, 6)}, {"v": (5, 6), "x": (0, 1)}]
    one, other = (basin(FREE, samples=5, ranges=ranges, **SHORT).start for ranges in pair)
    assert np.array_equal(one, other)
    assert one[:, :2].max() <= 1
    assert one[:, 2:].min() >= 5


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"ranges": {"y": (0, 1)}}, "unknown component 'y'; known: x, v"),
        ({"ranges": {"x": (1, 1)}}, r"range of x is 1 … 1; expected two numbers, the lower one first"),
        ({"ranges": {"x": (2, 1)}}, "range of x"),
        ({"ranges": {"x": (0, math.inf)}}, "range of x"),
        ({"ranges": {}}, "no ranges"),
        ({"samples": 0}, "samples = 0; expected at least 1"),
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"confidence": 1.0}, r"confidence = 1\.0"),
        ({"window": 0.0}, "window: found 0"),
    ],
)
def test_what_makes_no_sense_is_refused(keywords, message):
    with pytest.raises(ValueError, match=message):
        basin(FREE, **keywords)


def test_one_oscillator_and_half_a_sample_are_refused():
    with pytest.raises(ValueError, match="found 1 oscillator; expected at least two"):
        basin(Scene(oscillator="harmonic", topology=chain(1)))
    with pytest.raises(TypeError, match=r"samples = 2\.5; expected a whole number"):
        basin(FREE, samples=2.5)


ROSSLER = Scene(
    Field({"x": "-y - z", "y": "x + a*y", "z": "b + z*(x - c)"}, parameters={"a": 0.2, "b": 0.2, "c": 9.0}),
    "x->x", chain(2), parameters={"sigma": 2.28},
)  # fmt: skip
BOX = {"x": (-2.0, 2.0), "y": (-2.0, 2.0), "z": (0.0, 2.0)}


def test_starts_that_need_more_time_are_undecided():
    """At alpha = 4.56 the exponent is about -0.003: an error of 1 falls to 1e-3 in 2300 units of time, not in 200."""
    short, long = (basin(ROSSLER, samples=16, ranges=BOX, transient=t, show_progress=False) for t in (200.0, 6000.0))
    assert short.shares[Fate.APPROACHING] + short.share == 1.0
    assert short.share < 0.2
    assert short.interval[1] == 1.0
    assert -0.006 < short.exponent < 0.0
    assert long.share > 0.9
    assert "still approaching" in short.message


def test_another_attractor_is_no_approach():
    """Starts in two wells stay apart, those in one come together: each well has a probability of one half."""
    wells = Scene(Field({"x": "x - x**3"}), "x->x", chain(2), parameters={"sigma": 0.01})
    result = basin(wells, samples=64, show_progress=False)
    low, high = result.interval
    assert low < 0.5 < high
    assert result.shares[Fate.OTHER] == pytest.approx(1.0 - result.share)
    assert result.exponent == pytest.approx(-2.02, abs=1e-3)
    clear = np.abs(result.start).min(axis=1) > 0.1
    assert np.array_equal(result.synchronous[clear], np.prod(result.start[clear], axis=1) > 0.0)


def test_escape_is_a_share_of_its_own_and_bounded_in_work():
    """What takes a hundred times the steps of the synchronous motion is ended."""
    result = basin(
        ROSSLER,
        samples=8,
        ranges={"x": (-100.0, 100.0), "z": (-50.0, 50.0)},
        transient=100.0,
        window=50.0,
        show_progress=False,
    )
    assert result.shares[Fate.ESCAPED] >= 0.25
    assert result.shares[Fate.OTHER] == 0.0
    assert result.criterion.max_steps < 10**6
    assert set(result.statuses) <= {Status.DIVERGED, Status.FINISHED}


def test_a_stop_ends_starts():
    """x'' = -x from a circle of radius above 1/2 meets x = 1/2 within a turn."""
    result = basin(FREE.replace(stop="x_1 - 1/2"), samples=50, tolerance=1e-3, show_progress=False, **SHORT)
    x, v = result.start[:, 0], result.start[:, 2]
    assert np.array_equal(result.fate == list(Fate).index(Fate.STOPPED), np.hypot(x, v) > 0.5)
    assert result.shares[Fate.STOPPED] == (result.status == Status.STOPPED).mean()
    assert result.scene.stop == "x_1 - 1/2"


class Elsewhere(Executor):
    """An executor that is no kind of threads, so that a worker gets the packed recipe; it counts what it is given."""

    def __init__(self) -> None:
        self.given = 0

    def submit(self, function, /, *arguments):
        self.given += 1
        future: Future = Future()
        future.set_result(function(*pickle.loads(pickle.dumps(arguments))))
        return future


def starts(**more) -> Basin:
    return basin(FREE, samples=40, tolerance=1.0, **SHORT, **more)


def plane(**more) -> Probe:
    short = Criterion(starts=5, transient=1.0, window=1.0)
    return universal_probe(DAMPED, np.linspace(0.1, 1.0, 8), 0.1, criterion=short, **more)


def tight(**more) -> Basin:
    return basin(PENDULA, samples=40, tolerance=1.0, **SHORT, **more)


@pytest.mark.parametrize("found", [starts, plane, tight])
def test_starts_run_on_any_executor_and_tell_how_far_they_are(found):
    here, elsewhere, seen = found(workers=1), Elsewhere(), []
    there = found(workers=2, executor=elsewhere, progress=seen.append, show_progress=False)
    assert elsewhere.given > 1
    assert np.array_equal(here.error, there.error)
    assert len(np.unique(here.error)) > 5
    assert np.array_equal(here.status, there.status)
    assert {(at.done, at.total) for at in seen} >= {
        (0, 40),
        (40, 40),
    }  # the motion and second looks have bars of their own


@pytest.mark.parametrize("found", [starts, plane])
def test_ctrl_c_ends_the_sweep(found):
    def stop(progress):
        if progress.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        found(workers=1, progress=stop, show_progress=False)


def test_the_mode_of_a_contact_is_no_random_number():
    """It follows from the velocities; what is not named starts as in the scene."""
    stick = Scene(topology=chain(2), contact="set-valued", parameters={"theta_b": 0.1})
    assert [axis.name for axis in random_starts(stick, 5).axes] == ["x_1", "x_2", "v_1", "v_2"]
    with pytest.raises(ValueError, match="unknown component 'slip'; known: x, v"):
        basin(stick, ranges={"slip": (0, 1)})


@pytest.mark.parametrize("synchronous", [True, False])
def test_starts_have_not_left_an_unstable_state_only_if_they_came_to_it(synchronous: bool) -> None:
    fate = np.full(3, tuple(Fate).index(Fate.SYNCHRONOUS if synchronous else Fate.OTHER))
    basin_with_fate = dataclasses.replace(kept_basin(), exponent=0.1, fate=fate)
    assert "the synchronous state is unstable" in basin_with_fate.message
    assert ("have not left it yet" in basin_with_fate.message) == synchronous
