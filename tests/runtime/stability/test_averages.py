"""Averages along chaotic orbits: how far they lie from the truth in units of their errors, and how long they are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from synchain import Field, Scene, cluster_exponents, exponents, lyapunov_spectrum, thresholds
from synchain.graphs import chain
from synchain.runtime.stability.averages import FEWEST, FIRST, MOST, Averaging, Batches
from synchain.runtime.stability.exponents import average, initial_states
from synchain.runtime.stability.march import March, interpolation_for
from synchain.runtime.stability.orbits import OrbitProblem
from synchain.runtime.support.execution import Execution

STARTS, WINDOWS = 256, 4
"""Orbits, and averages one after another along each."""

FRICTION = Scene("friction", topology=chain(2), parameters={"omega": 1.4}, rtol=1e-6)
ROSSLER = Scene("rossler", "x->x", chain(2), rtol=1e-6)
LORENZ = Scene("lorenz", "x->x", chain(2), rtol=1e-6)


def distances(scene: Scene, alpha: list[float], periods: int) -> np.ndarray:
    """Distances (averages, m) of averages from the mean of them all, in units of their errors."""
    starts = initial_states(scene, STARTS, seed=1)
    problem = OrbitProblem.of_modes(scene, np.array(alpha), starts, workers=1)
    problem, states = problem.settled(problem.with_slip_states(starts), 100)
    march = March.begin(problem, states, interpolation_for(problem, states, periods))
    averaging = Averaging(0.0, periods, 0.0, 0, Execution(1, show_progress=False))
    with averaging.reporter() as reporter:
        averages = [average(march, averaging, reporter)[:2] for _ in range(WINDOWS)]
    mean, error = (np.concatenate(part) for part in zip(*averages, strict=True))
    return np.abs(mean - mean.mean(axis=0)) / error


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "alpha"),
    [(FRICTION, [0.0, 0.1, 0.3, 0.5]), (ROSSLER, [0.0, 0.1, 0.5, 2.0, 5.0]), (LORENZ, [0.0, 2.0, 8.0])],
    ids=["friction", "Rössler", "Lorenz"],
)
def test_averages_in_chaos_lie_within_two_errors(scene, alpha):
    """A normal variable is beyond two standard deviations in 4.6 of 100 cases, growth in Lorenz's system in 1 to 3 (docs/accuracy.md)."""
    for periods in (100, 300):
        beyond = (distances(scene, alpha, periods) > 2.0).mean(axis=0)
        assert np.all((beyond > 0.005) & (beyond < 0.10)), (periods, beyond)


@pytest.mark.parametrize(("blocks", "block"), [(59, 1.0), (25, 4.0), (640, 1 / 8), (1280, 1.0)])
def test_averages_of_white_noise_lie_within_two_errors_in_95_of_100_cases(blocks, block):
    """Few or many batches, joined or not: Student's distribution is exact. 20 000 cases tell it to 0.15 of 100."""
    random, batches = np.random.default_rng(0), Batches(2.0, block)
    for _ in range(blocks):
        batches.add(random.normal(size=(20_000, 1)))
    beyond = np.abs(batches.mean()) > 2.0 * batches.error_by_start()
    assert 100 * beyond.mean() == pytest.approx(4.55, abs=0.45)


def test_the_error_follows_from_what_remains_of_the_noise_after_long_times():
    """Differences of white noise add up to almost nothing; an error from their scatter would be thirty times too large."""
    random, batches, last = np.random.default_rng(0), Batches(1.0), np.zeros((1000, 1))
    for _ in range(2048):
        noise = random.normal(size=last.shape)
        batches.add(noise - last)
        last = noise
    scatter = math.sqrt(2.0 / 2048)
    assert np.median(batches.error_by_start()) < 0.15 * scatter
    assert batches.frequencies == MOST


def test_a_sum_that_stays_bounded_has_the_error_of_its_ends():
    """Differences of cosines at incommensurate frequencies: their sum over any time is that of both ends."""
    random, batches = np.random.default_rng(0), Batches(1.0)
    frequency, phase = random.uniform(0.02, 0.5, 4000), random.uniform(0.0, 1.0, 4000)
    last = np.cos(2.0 * np.pi * phase)
    for k in range(1, 1500):
        now = np.cos(2.0 * np.pi * (phase + frequency * k))
        batches.add((now - last)[:, None])
        last = now
    assert np.mean(np.abs(batches.mean()) > 2.0 * batches.error_by_start()) < 0.06


NEUTRAL = {
    "cycle": Scene(Field({"x": "v", "v": "(1 - x**2)*v - x"}, initial={"x": 2.0}), "x->v", chain(2), transient=20),
    "pendulum": Scene(Field({"x": "v", "v": "-sin(x)"}, initial={"x": 1.0}), "x->v", chain(2)),
}
"""Uncoupled nodes: deviations along a limit cycle stay bounded, those of a pendulum grow with time."""


@pytest.mark.parametrize("motion", NEUTRAL)
def test_neutral_directions_are_undecided(motion):
    scene = NEUTRAL[motion]
    clusters = cluster_exponents(scene, (0, 0), periods=128, show_progress=False)
    assert clusters.verdicts == ("undecided within the error",)
    spectrum = lyapunov_spectrum(scene.lone, periods=128, show_progress=False)
    zero = slice(0, 1 if motion == "cycle" else 2)
    assert np.all(np.abs(spectrum.exponent[zero]) < 1e-3)
    assert np.all(np.abs(spectrum.exponent[zero]) <= spectrum.stderr[zero])
    # the other one has the error of the unfinished turn, not of a neutral direction; -1.059377 by the orbit's multiplier
    if motion == "cycle":
        assert spectrum.stderr[1] < 1e-3
        assert abs(spectrum.exponent[1] + 1.059377) < 2 * spectrum.stderr[1]


def test_an_average_of_few_periods_has_no_error():
    short, enough = Batches(1.0, 1 / 8), Batches(1.0, 1 / 8)
    for blocks, batches in ((58, short), (59, enough)):
        for growth in np.random.default_rng(0).normal(size=8 * blocks):
            batches.add(np.array([[growth]]))
    assert short.frequencies == FEWEST - 1
    assert short.error().tolist() == [math.inf]
    assert enough.frequencies == FEWEST
    assert np.isfinite(enough.error()).all()


def stopped(series: np.ndarray, precision: float) -> Batches:
    """The average over a series (blocks,), of one period each, that ends by its precision."""
    batches = Batches(1.0)
    averaging = Averaging(precision, float(len(series)), 0.0, 0, Execution(1, show_progress=False))
    with averaging.reporter() as reporter:
        for left in averaging.rounds(batches, batches.error, reporter):
            parts = batches.ahead(left)
            begin, starts = batches.blocks, np.cumsum([0, *parts[:-1]])
            batches.extend(np.add.reduceat(series[begin : begin + parts.sum()], starts)[:, None, None], parts)
    return batches


def noise(random: np.random.Generator, shape: tuple[int, int], memory: float) -> np.ndarray:
    """An autoregressive process of mean 0 whose values remember a part of the last one."""
    return np.asarray(lfilter([1.0], [1.0, -memory], random.normal(size=shape), axis=1))


def steps_of_noise(random: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Growth that the next block takes back, as in Lorenz's system."""
    return np.diff(random.normal(size=(shape[0], shape[1] + 1)), axis=1)


def of_map(random: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """The growth of deviations along x -> 3.8 x (1 - x), less its mean."""
    x, growth = random.uniform(0.2, 0.9, shape[0]), np.empty(shape)
    for column in growth.T:
        x = 3.8 * x * (1.0 - x)
        column[:] = np.log(np.abs(3.8 * (1.0 - 2.0 * x)))
    return growth - growth.mean()


@pytest.mark.parametrize(
    ("of", "least"),
    [
        (lambda random, shape: noise(random, shape, 0.0), 0.93),
        (lambda random, shape: noise(random, shape, 0.7), 0.92),
        (lambda random, shape: noise(random, shape, 0.0) + 2.0 * steps_of_noise(random, shape), 0.93),
        (of_map, 0.90),
    ],
    ids=["white", "slow", "alternating", "logistic map"],
)
def test_averages_that_end_by_their_precision_lie_within_two_errors(of, least):
    """Looks at the errors after every quarter of the length would end where an error is small by chance: 0.89 of white noise."""
    series = of(np.random.default_rng(0), (800, 2048))
    deviation = series.mean(axis=1).std() * math.sqrt(2048)
    averages = [stopped(row, deviation / math.sqrt(250)) for row in series]
    within = np.mean([abs(b.mean()[0, 0]) <= 2.0 * b.error()[0] for b in averages])
    assert least <= within <= 0.99
    assert all(b.error()[0] <= deviation / math.sqrt(250) for b in averages if b.blocks < 2048)
    assert min(b.blocks for b in averages) == FIRST


def test_an_average_of_equal_terms_has_the_error_of_rounding():
    batches = stopped(np.full(300, -41.0 / 3.0), 0.0)
    assert batches.blocks == 300
    assert abs(batches.mean()[0, 0] + 41.0 / 3.0) <= 2.0 * batches.error()[0]
    assert 0.0 < batches.error()[0] < 1e-12


@pytest.mark.parametrize("periods", [1, 3, 6, 50.0])
@pytest.mark.parametrize(
    ("scene", "unit"), [(FRICTION, 2 * math.pi / 1.4), (ROSSLER, None)], ids=["friction", "Rössler"]
)
def test_averages_are_as_long_as_asked(scene, unit, periods):
    def time(count):
        keywords = {"periods": count, "transient": 10, "precision": 0.0, "show_progress": False}
        return exponents(scene, [0.0, 0.2], starts=1, workers=1, **keywords).time

    assert time(periods) == pytest.approx(periods * (time(1) if unit is None else unit), rel=1e-12)


def test_spectra_and_clusters_are_averaged_as_long_as_asked():
    settings = {"periods": 3, "transient": 10, "precision": 0.0, "show_progress": False}
    pair = ROSSLER.replace(initial={"x": [1.0, 1.1]}, parameters={**ROSSLER.parameters, "sigma": 0.1})
    for average_of in (
        lambda **more: cluster_exponents(pair, [0, 0], **more),
        lambda **more: lyapunov_spectrum(ROSSLER, **more),
    ):
        one, three = (average_of(**{**settings, "periods": periods}).time for periods in (1, 3))
        assert three == pytest.approx(3 * one, rel=1e-12)


@pytest.mark.parametrize(
    "average_of",
    [
        lambda **given: exponents(ROSSLER, [0.1], **given),
        lambda **given: lyapunov_spectrum(ROSSLER, **given),
        lambda **given: cluster_exponents(ROSSLER, [0, 0], **given),
        lambda **given: thresholds(FRICTION, **given),
    ],
    ids=["exponents", "lyapunov_spectrum", "cluster_exponents", "thresholds"],
)
def test_parts_of_a_period_are_refused(average_of):
    with pytest.raises(ValueError, match=r"^periods: found 2\.5; expected a whole number of periods$"):
        average_of(periods=2.5)


def test_a_transient_of_parts_of_a_period_is_refused():
    with pytest.raises(ValueError, match=r"^transient: found 0\.5; expected a whole number of periods$"):
        exponents(ROSSLER, [0.1], transient=0.5)
