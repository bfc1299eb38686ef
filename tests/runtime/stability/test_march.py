"""Deviations of many strengths, moved by a kernel, against products of propagators that are all integrated."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from synchain import Scene
from synchain.graphs import topology
from synchain.runtime.stability.averages import BATCHES, FIRST, Batches
from synchain.runtime.stability.interpolation import Interpolation, exact_interpolation, strength_interpolation
from synchain.runtime.stability.march import MODE_TOLERANCE_RATIO, BlockInterpolation, March, interpolation_for
from synchain.runtime.stability.orbits import OrbitProblem

LINE = np.linspace(0.0, 1.2, 149)
SQUARE = (np.linspace(0.0, 1.2, 12)[:, None] + 1j * np.linspace(0.0, 0.6, 11)).reshape(-1)


def settled(
    strengths: np.ndarray, starts: int = 1, rtol: float = 1e-11, workers: int = 1, **keywords: object
) -> tuple[OrbitProblem, np.ndarray]:
    scene = Scene(topology=topology("chain", 2), rtol=rtol, record=(), **keywords)  # type: ignore[arg-type]
    first = np.array([values[0] for values in scene.initial.values()])
    state = np.tile(first, (starts, 1))
    state[:, 0] += 0.1 * np.arange(starts)
    problem = OrbitProblem.of_modes(scene, strengths, state, workers)
    return problem.settled(problem.with_slip_states(state), 10)


def march_of(
    problem: OrbitProblem,
    states: np.ndarray,
    interpolation: Interpolation,
    block: float,
    ratio: float = MODE_TOLERANCE_RATIO,
    intervals: Interpolation | None = None,
) -> March:
    return March.begin(problem, states, BlockInterpolation(block, interpolation, intervals), ratio)


def chosen_march(problem: OrbitProblem, states: np.ndarray) -> March:
    return March.begin(problem, states, interpolation_for(problem, states, 1000))


def expected(problem: OrbitProblem, states: np.ndarray, block: float, blocks: int) -> np.ndarray:
    """Growth (starts, m) of deviations that begin along (1, 1, …), by products of NumPy."""
    integrator, p, growth = problem.integrator(states), problem.components, 0.0
    vectors = np.full((len(states), len(problem.strengths), p, 1), 1.0 / np.sqrt(p))
    for _ in range(blocks):
        vectors = problem.propagators(integrator, block)[0] @ vectors
        length = np.linalg.norm(vectors, axis=2, keepdims=True)
        growth, vectors = growth + np.log(length[:, :, 0, 0]), vectors / length
    return np.asarray(growth)


CASES = {
    "that sticks": (LINE, 4.0, {"contact": "set-valued", "parameters": {"omega": 1.4}}),
    "that begins at rest": (LINE, 0.5, {"contact": "set-valued", "parameters": {"omega": 1.15}}),
    "that sticks, in the plane": (SQUARE, 2.0, {"contact": "set-valued", "parameters": {"omega": 1.4}}),
    "with a kink": (LINE, 1.0, {"rtol": 1e-9, "parameters": {"omega": 1.4}}),
    "smooth": (LINE, 2.0, {"oscillator": "duffing"}),
    "of three states": (5.0 * LINE, 0.5, {"oscillator": "lorenz", "coupling": "x->x"}),
    "of three states, in the plane": (5.0 * SQUARE, 0.5, {"oscillator": "rossler", "coupling": "x->x"}),
    "whose modes shrink at different rates": (0.4 + LINE, 3.0, {"oscillator": "harmonic", "coupling": "damper"}),
}


TWICE = ("of three states, in the plane",)
"""What two other cases have, each a part of it."""


@pytest.mark.parametrize("case", [pytest.param(case, marks=[pytest.mark.long] * (case in TWICE)) for case in CASES])
def test_growth_is_that_of_products_of_propagators(case: str) -> None:
    strengths, block, keywords = CASES[case]
    orbit = settled(strengths, starts=2, **keywords)  # type: ignore[arg-type]
    wanted = expected(*orbit, block, 3)
    few = strength_interpolation(strengths, *((26, 1) if np.iscomplexobj(strengths) else (29, 2)))
    assert not few.is_exact
    for interpolation in (few, exact_interpolation(strengths)):
        march = march_of(*orbit, interpolation, block, 1.0)
        growth = march.growths(np.array([2, 1])).sum(axis=0)
        close = np.abs(growth - wanted)
        assert np.median(close) < 1e-7, interpolation.is_exact
        assert close.max() < 1e-4  # where a multiplier passes zero
        assert march.deviations.error < 1e-6


def test_growth_beyond_the_range_of_numbers_is_counted() -> None:
    """x'' = -x - alpha v over 3000 turns: a deviation shrinks like exp(-alpha t/2), to 1e-4000 and below."""
    alpha = np.linspace(0.5, 1.5, 9)
    orbit = settled(alpha, rtol=1e-6, oscillator="harmonic", coupling="damper")
    march = march_of(*orbit, exact_interpolation(alpha), 3000.0)
    growth = march.growths(np.array([1]))[0, 0]
    np.testing.assert_allclose(growth, -0.5 * alpha * 3000.0 * orbit[0].unit, rtol=0, atol=2.0)


def test_coarse_nodes_are_seen_by_the_strengths_for_comparison() -> None:
    orbit = settled(LINE, contact="set-valued", parameters={"omega": 1.4})
    collected = {}
    for nodes in (8, 13):
        march = march_of(*orbit, strength_interpolation(LINE, nodes), 4.0)
        march.growths(np.array([8]))
        collected[nodes] = march.deviations.error
    assert collected[8] > 1e-3
    assert 1e-9 < collected[13] < 1e-5


STICKS = {
    "landings in every period": (1.15, 4.0, 2),
    "intervals longer than a block": (1.4, 0.5, 2),
    "intervals of up to four periods": (1.55, 4.0, 2),
    "no landings": (3.0, 4.0, 16),
}
"""Frequencies of the drive, blocks in periods, and blocks of the last batch."""


@pytest.mark.parametrize("case", STICKS)
def test_growth_from_landing_to_landing_is_that_of_products_of_propagators(case: str) -> None:
    omega, block, last = STICKS[case]
    sliding = {"oscillator": "friction", "contact": "set-valued", "parameters": {"omega": omega}}
    if case == "no landings":  # a belt so fast that the body never sticks
        sliding["parameters"] = {"omega": omega, "theta_b": 20.0}
    orbit = settled(LINE, starts=2, **sliding)
    wanted = expected(*orbit, block, 4 + last)
    nodes = strength_interpolation(LINE, 29)
    intervals = strength_interpolation(nodes.nodes, 21)
    assert len(intervals.nodes) < len(nodes.nodes) < len(LINE)
    march = march_of(*orbit, nodes, block, 1.0, intervals)
    close = np.abs(march.growths(np.array([1, 3, last])).sum(axis=0) - wanted)
    assert np.median(close) < 1e-9
    assert close.max() < 1e-5  # where a multiplier passes zero
    assert march.deviations.error < 1e-9


def test_stick_intervals_multiply_modes_of_very_different_growth() -> None:
    """Beside one that grows by e^1000 in each block, products of others stay in the range of numbers."""
    strengths = np.array([-4000.0, -1.0, 0.0, 0.5])
    orbit = settled(strengths, rtol=1e-9, contact="set-valued", parameters={"omega": 1.15})
    wanted = expected(*orbit, 1.0, 16)
    march = march_of(*orbit, exact_interpolation(strengths), 8.0, 1.0)
    growth = march.growths(np.array([2]))[0]
    assert growth[0, 0] > 2000.0
    np.testing.assert_allclose(growth, wanted, rtol=1e-6, atol=1e-6)


def test_a_stick_interval_on_too_few_nodes_is_seen_by_the_strengths_for_comparison() -> None:
    orbit = settled(LINE, contact="set-valued", parameters={"omega": 1.4})
    nodes = strength_interpolation(LINE, 29)
    collected = {}
    for few in (5, 13):
        march = march_of(*orbit, nodes, 4.0, 1.0, strength_interpolation(nodes.nodes, few))
        march.growths(np.array([4]))
        collected[few] = march.deviations.error
    assert collected[5] > 1e-3
    assert collected[13] < 1e-9


def test_bodies_that_stick_have_few_nodes_integrated() -> None:
    """The two columns of a dozen and a half propagators, where 24 are multiplied over a block."""
    orbit = settled(np.linspace(0.0, 1.2, 1000), rtol=1e-6, contact="set-valued", parameters={"omega": 1.4})
    assert len(interpolation_for(*orbit, 1000).strengths.nodes) == 24
    assert len(chosen_march(*orbit).integrator.order) == 2 * 16


@pytest.mark.parametrize("index", [-1, -13, -26, -39])
def test_a_number_that_is_none_is_seen_in_the_error(index: int) -> None:
    """The last of the weights are those of the strengths for comparison, 13 for each."""
    orbit = settled(LINE, oscillator="duffing")
    march = march_of(*orbit, strength_interpolation(LINE, 13), 1.0)
    march.deviations.registers.weights[index] = np.nan
    march.growths(np.array([1, 1]))
    assert np.isnan(march.deviations.error)


def test_growth_does_not_depend_on_the_number_of_workers_or_on_batches() -> None:
    alone, shared = (settled(LINE, 3, 1e-6, w, contact="set-valued", parameters={"omega": 1.4}) for w in (1, 2))
    collected = []
    for orbit in (alone, shared):
        collected.append(chosen_march(*orbit).growths(np.array([1, 3, 2])))
    np.testing.assert_array_equal(*collected)
    assert collected[0].shape == (3, 3, len(LINE))
    np.testing.assert_allclose(
        chosen_march(*alone).growths(np.array([6]))[0], collected[0].sum(axis=0), rtol=0, atol=1e-11
    )


def test_strengths_in_other_company_grow_as_much() -> None:
    """Their places in registers and their number change nothing but rounding, as long as the nodes are the same."""
    orbit = settled(LINE, contact="set-valued", parameters={"omega": 1.4})
    march = march_of(*orbit, strength_interpolation(LINE, 21), 4.0)
    many = march.growths(np.array([4]))[0, 0]
    for chosen in (np.r_[0:37, 148], np.r_[0, 60:149]):
        few = replace(orbit[0], strengths=LINE[chosen])
        march = march_of(few, orbit[1], strength_interpolation(LINE[chosen], 21), 4.0)
        np.testing.assert_array_equal(march.growths(np.array([4]))[0, 0], many[chosen])


def test_a_deviation_that_has_vanished_stays_so() -> None:
    orbit = settled(LINE, oscillator="duffing")
    march = march_of(*orbit, strength_interpolation(LINE, 13), 1.0)
    march.deviations.vectors[:] = 0.0
    for _ in range(2):
        assert np.all(march.growths(np.array([1])) == -np.inf)
    assert np.all(march.deviations.vectors == 0.0)


@pytest.mark.parametrize("ratio", [1.0, 2.5, math.inf])
def test_batches_ahead_are_those_of_single_blocks(ratio: float) -> None:
    growth = np.random.default_rng(0).normal(size=(8 * BATCHES + 3, 2, 3))
    one, many, looks, position = Batches(1.0), Batches(1.0), [], 0
    while position < len(growth):
        parts = many.ahead(len(growth) - position)
        ends = position + np.cumsum(parts)
        many.extend(np.array([growth[a:b].sum(axis=0) for a, b in itertools.pairwise([position, *ends])]), parts)
        for row in growth[position : ends[-1]]:
            assert not (one.due and one.blocks > position)
            one.add(row)
        position = int(ends[-1])
        assert (one.blocks, one.count, one.per_batch, one.due) == (many.blocks, many.count, many.per_batch, many.due)
        np.testing.assert_allclose(one.error(), many.error(), rtol=1e-12)
        if many.due:
            looks.append(position)
            one.plan(ratio, final=False)
            many.plan(ratio, final=False)
    assert looks[0] == FIRST
    if ratio > 1.0:
        assert looks == {2.5: [FIRST, int(2.5 * FIRST)], math.inf: [FIRST]}[ratio]
