"""A cell computes the same bits whatever stands beside it: lanes, chunks, order and threads change nothing."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import sympy as sp
from samples import TABLE, Outcome, blank, drive, friction_scene, kernel, numbers

EQ = friction_scene(2)
ALL = ("sync_error", "section", "trajectory")
PERIOD = 2 * np.pi / TABLE["omega"]
CELLS, ROOM, SAMPLES = 29, 24, 9


def compiled(width: int, method: str = "rodas5p"):
    return kernel(EQ, method, ALL, sp.Symbol("v_1", real=True), width)


def cells() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells of very different lengths, stiffness and fates."""
    dice = np.random.default_rng(7)
    start = dice.uniform(-0.4, 0.4, (CELLS, 4))
    values = np.array([numbers(EQ, sigma=s, omega=w) for s, w in dice.uniform([0.0, 1.1], [0.6, 1.9], (CELLS, 2))])
    begin = dice.uniform(0.0, 4.0, CELLS) * PERIOD
    period = 2 * np.pi / values[:, EQ.parameters.index("omega")]
    period[::7] = 0.0  # not known to be periodic
    spans = np.stack([begin, begin + dice.uniform(0.0, 6.0, CELLS) * PERIOD, period], axis=1)
    spans[3, :2] = 0.0  # ends before it begins
    spans[5, 0] = 0.0
    spans[8, 0] = spans[8, 1]  # an empty window
    start[11] = [np.nan, 0.0, 0.0, 0.0]
    start[17] = [1e200, 0.0, 0.0, 0.0]
    values[20, EQ.parameters.index("sigma")] = -400.0  # grows without bound
    return start, values, spans


def run(
    width: int,
    pieces: list[tuple[int, int]],
    workers: int = 1,
    order: np.ndarray | None = None,
    method: str = "rodas5p",
) -> Outcome:
    start, values, spans = (array if order is None else array[order] for array in cells())
    outcome = blank(CELLS, 4, ROOM, SAMPLES)

    def work(part: tuple[int, int]) -> None:
        drive(compiled(width, method), start, values, spans, 1e-7, max_steps=1500, into=outcome, part=part)

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, pieces))
    return outcome


def chunks(size: int) -> list[tuple[int, int]]:
    return [(i, min(i + size, CELLS)) for i in range(0, CELLS, size)]


def same(outcome: Outcome, expected: Outcome, order: np.ndarray | None = None) -> None:
    rows = slice(None) if order is None else order
    for name, a, b in zip(
        ("end", "sums", "counts", "points", "samples"), outcome.arrays[:5], expected.arrays[:5], strict=True
    ):
        np.testing.assert_array_equal(a.view(np.int64), np.ascontiguousarray(b[rows]).view(np.int64), err_msg=name)


@pytest.fixture(scope="module")
def alone() -> Outcome:
    """Every cell by itself in the scalar kernel."""
    return run(1, chunks(1))


def test_the_cells_are_a_fair_choice(alone):
    counts = alone.counts
    assert set(counts[:, 0]) >= {1, 2, 4}, "finished, out of steps, diverged"
    assert (counts[:, 0] == 1).sum() > 20
    assert counts[counts[:, 0] == 1, 1].max() > 20 * max(counts[counts[:, 0] == 1, 1].min(), 1)
    assert counts[:, 2].max() > 50, "rejected steps"
    assert counts[:, 3].max() >= 4, "section points"
    assert np.isfinite(alone.samples[counts[:, 0] == 1]).any()


def test_cells_with_nothing_to_integrate_say_so(alone):
    others = [0] * (alone.counts.shape[1] - 1)
    assert alone.counts[11].tolist() == [4, *others], "an undefined start has diverged"
    assert alone.counts[17].tolist() == [4, *others], "so has one out of bounds"
    assert alone.counts[3].tolist() == [1, *others]
    assert alone.counts[8, 0] == 1
    np.testing.assert_allclose(alone.samples[8], np.tile(alone.end[8], (SAMPLES, 1)), rtol=1e-14)


@pytest.mark.parametrize("width", [1, pytest.param(4, marks=pytest.mark.long), 8])
@pytest.mark.parametrize("size", [29, 11, 3])
def test_widths_and_chunks_change_nothing(alone, width, size):
    same(run(width, chunks(size)), alone)


@pytest.mark.parametrize("width", [pytest.param(4, marks=pytest.mark.long), 8])
def test_threads_change_nothing(alone, width):
    same(run(width, chunks(4), workers=2), alone)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_order_of_cells_changes_nothing(alone, seed):
    order = np.random.default_rng(seed).permutation(CELLS)
    same(run(8, chunks(29), order=order), alone, order)


def test_a_second_run_changes_nothing(alone):
    same(run(1, chunks(29)), alone)
    same(run(8, chunks(29)), run(8, chunks(29)))


def test_rows_of_other_chunks_are_left_alone():
    outcome = run(8, [(5, 12)])
    others = np.r_[0:5, 12:CELLS]
    assert (outcome.counts[others] == 0).all()
    assert np.isnan(outcome.end[others]).all()
    assert (outcome.counts[5:12, 0] > 0).all()
