"""Verdicts on synchronisation, and cells that end early because they are certain to stay synchronous."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.opening.open import open_result
from synchain.runtime.results.certificate import NEAR, VERDICTS, Certificate
from synchain.runtime.stability.exponents import exponents
from synchain.runtime.sweeps.certify import certify
from synchain.runtime.sweeps.errors import SweepInterrupted
from synchain.runtime.sweeps.run import run

SIGMA = np.array([0.05, 0.12, 0.3])


def scene(**more: object) -> Scene:
    settings = {"topology": topology("chain", 2), "transient": 150.0, "window": 50.0, "parameters": {"omega": 1.15}}
    return Scene(**{**settings, **more})  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def both() -> tuple:
    plain = run(scene(), sigma=SIGMA, show_progress=False)
    return plain, run(scene(), sigma=SIGMA, certified=True, show_progress=False)


def test_an_early_end_changes_nothing_but_the_time(both: tuple) -> None:
    """The third cell is chaotic: in windows of this length its error lies between 0.06 and 0.14."""
    plain, certified = both
    early = certified.data.end_time.values < plain.data.end_time.values
    assert list(early) == [True, True, False]
    assert np.all(np.abs(certified.sync_error.values - plain.sync_error.values) < NEAR)
    assert np.all(certified.data.sync_error_max.values[early] <= NEAR)
    assert certified.steps.values[:2].sum() < 0.9 * plain.steps.values[:2].sum()
    assert certified.sync_error.values[2] == plain.sync_error.values[2] > 0.05
    assert certified.success


def test_verdicts_and_exponents_of_cells(both: tuple) -> None:
    _, certified = both
    words = [VERDICTS[k] for k in certified.data.verdict.values]
    assert words == ["synchronous, certified by the exponent"] * 2 + ["not synchronous, the state is unstable"]
    expected = exponents(scene(), 2 * SIGMA).exponent
    np.testing.assert_allclose(certified.data.transversal_exponent.values, expected, atol=1e-5)
    assert "certified" in certified.data.verdict.attrs["long_name"]


def test_equal_starts_on_an_unstable_state_are_called_what_they_are() -> None:
    found = run(scene(initial={"x": [0.3, 0.3]}), sigma=[0.4], certified=True, show_progress=False)
    assert found.sync_error.item() == 0.0
    assert VERDICTS[found.data.verdict.item()] == "synchronous by round-off only: the state is unstable"


@pytest.mark.long
def test_a_record_of_sections_is_not_cut_short() -> None:
    s = scene(record=("sync_error", "section"))
    found = run(s, sigma=[0.12], certified=True, show_progress=False)
    whole = run(s, sigma=[0.12], show_progress=False)
    assert found.data.section_count.item() == whole.data.section_count.item() > 20
    assert found.data.end_time.item() == whole.data.end_time.item()


def test_every_mode_and_every_attractor_must_be_stable() -> None:
    """Three oscillators: the mode gamma = -3 is lost first; a grid of two parameters has an orbit for each frequency."""
    s = scene(topology=topology("chain", 3), axes={"omega": [1.15, 1.4], "sigma": [0.1, 0.2]})
    found = certify(s, periods=200)
    one = s.replace(axes=())
    lines = [exponents(one, [0.1, 0.2, 0.3, 0.6], omega=w, precision=2e-3, periods=200).exponent for w in (1.15, 1.4)]
    expected = [max(line[0], line[2]) for line in lines], [max(line[1], line[3]) for line in lines]
    np.testing.assert_allclose(found.exponent.reshape(2, 2), np.transpose(expected), atol=0.03)
    np.testing.assert_allclose(found.exponent[:2], np.transpose(expected)[0], atol=1e-5)


def test_when_an_early_end_is_safe() -> None:
    one = np.ones(5)
    exponent = np.array([-0.1, -0.1, -0.1, -0.001, 0.1])
    made = Certificate(exponent, np.array([1e-3, 0.03, 1e-3, 1e-3, 1e-3]), 1e-2 * one * [1, 1, 100, 1, 1])
    assert list(made.near > 0) == [True, False, False, False, False]
    finished, mean = np.array([True, True, True, True, False]), np.array([0.0, 1.0, 1e-9, 1.0, 0.0])
    assert list(made.verdicts(finished, mean, 10 * mean)) == [1, 6, 1, 5, 0]
    assert list(made.verdicts(finished, 1e-4 * mean, 100 * mean)) == [1, 7, 1, 2, 0]


def test_an_interrupted_run_is_resumed_with_its_certificate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from synchain.runtime.sweeps.job import SweepJob

    work, calls = SweepJob.run, []

    def stop(shop: SweepJob, cells: np.ndarray, *more: np.ndarray) -> object:
        calls.append(cells)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return work(shop, cells, *more)

    grid = np.linspace(0.02, 0.2, 40)
    monkeypatch.setattr(SweepJob, "run", stop)
    with pytest.raises(SweepInterrupted) as caught:
        run(scene(transient=60.0, window=5.0), sigma=grid, certified=True, workers=1, show_progress=False)
    monkeypatch.setattr(SweepJob, "run", work)
    caught.value.result.save(tmp_path / "part.nc")
    part = open_result(tmp_path / "part.nc")
    assert 0 < (part.status.values == 1).sum() < 40
    done = run(part.scene, resume=part, certified=True, show_progress=False)
    whole = run(scene(transient=60.0, window=5.0), sigma=grid, certified=True, show_progress=False)
    assert done.data.identical(whole.data)


def test_what_has_no_certificate() -> None:
    with pytest.raises(ValueError, match="needs coupled oscillators; found a scene without links"):
        certify(Scene(topology=topology("chain", 1)))
    with pytest.raises(ValueError, match="found omega = 0 in the sweep"):
        certify(scene(axes={"omega": [0.0, 1.0]}, time_unit="time"))
