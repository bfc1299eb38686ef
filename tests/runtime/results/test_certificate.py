"""Verdicts on synchronisation, and cells that end early because they are certain to stay synchronous."""

from __future__ import annotations

import importlib
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from synchain import Field, Scene, exponents, open_result, run, stream
from synchain.graphs import topology
from synchain.results import Status, SweepFailed, SweepInterrupted
from synchain.runtime.results.certificate import NEAR, VERDICTS, Certificate
from synchain.runtime.sweeps import certify as certification
from synchain.runtime.sweeps.certify import certify
from synchain.runtime.sweeps.prepare import PreparedRun

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
    verdicts = [VERDICTS[k] for k in certified.data.verdict.values]
    assert verdicts == ["synchronous, certified by the exponent"] * 2 + ["not synchronous, the state is unstable"]
    expected = exponents(scene(), 2 * SIGMA).exponent
    np.testing.assert_allclose(certified.data.transversal_exponent.values, expected, atol=1e-5)
    assert "certified" in certified.data.verdict.attrs["long_name"]


def test_equal_starts_on_an_unstable_state_are_called_what_they_are() -> None:
    result = run(scene(initial={"x": [0.3, 0.3]}), sigma=[0.4], certified=True, show_progress=False)
    assert result.sync_error.item() == 0.0
    assert VERDICTS[result.data.verdict.item()] == "synchronous by round-off only: the state is unstable"


@pytest.mark.long
def test_a_record_of_sections_is_not_cut_short() -> None:
    s = scene(record=("sync_error", "section"))
    result = run(s, sigma=[0.12], certified=True, show_progress=False)
    full = run(s, sigma=[0.12], show_progress=False)
    assert result.data.section_count.item() == full.data.section_count.item() > 20
    assert result.data.end_time.item() == full.data.end_time.item()


def test_every_mode_and_every_attractor_must_be_stable() -> None:
    """Three oscillators: the mode gamma = -3 is lost first; a grid of two parameters has an orbit for each frequency."""
    s = scene(topology=topology("chain", 3), axes={"omega": [1.15, 1.4], "sigma": [0.1, 0.2]})
    certificate = certify(s, periods=200)
    one = s.replace(axes=())
    lines = [exponents(one, [0.1, 0.2, 0.3, 0.6], omega=w, precision=2e-3, periods=200).exponent for w in (1.15, 1.4)]
    expected = [max(line[0], line[2]) for line in lines], [max(line[1], line[3]) for line in lines]
    np.testing.assert_allclose(certificate.exponent.reshape(2, 2), np.transpose(expected), atol=0.03)
    np.testing.assert_allclose(certificate.exponent[:2], np.transpose(expected)[0], atol=1e-5)


def test_when_an_early_end_is_safe() -> None:
    one = np.ones(5)
    exponent = np.array([-0.1, -0.1, -0.1, -0.001, 0.1])
    stderr = np.array([1e-3, 0.015, 1e-3, 1e-3, 1e-3])
    finished, mean = np.array([True, True, True, True, False]), np.array([0.0, 1.0, 1e-9, 1.0, 0.0])
    for size in (1e-9, 1.0):
        certificate = Certificate(exponent, stderr, 1e-2 * one * [1, 1, 100, 1, 1], 5 * stderr, size * one)
        assert list(certificate.near) == [NEAR * size, NEAR * size, 0.0, 0.0, 0.0]
        assert list(certificate.verdicts(finished, size * mean, 10 * size * mean)) == [1, 6, 1, 5, 0]
        assert list(certificate.verdicts(finished, 1e-4 * size * mean, 100 * size * mean)) == [1, 7, 1, 2, 0]
    short = replace(certificate, margin=10 * stderr)  # of an average so short that its errors have long tails
    assert list(short.near) == [NEAR, 0.0, 0.0, 0.0, 0.0]
    assert list(short.verdicts(finished, mean, 10 * mean)) == [1, 5, 1, 5, 0]


@pytest.mark.parametrize("s", [1e-6, 1.0])
def test_a_cell_is_certified_along_the_motion_that_it_ends_on(s: float) -> None:
    """Wells at -0.975 s and 1.025 s: all nodes end in the upper one, wherever the first begins; slope 1 - 3 x² + x/10 there."""
    well = Field({"x": "s*(x/s - (x/s)**3 + (x/s)**2/20)"}, parameters={"s": 1.0})
    collected = []
    for start in ([-0.5, 0.9, 0.9, 0.9], [0.9, 0.9, 0.9, -0.5]):
        begun = Scene(well, "x->x", topology("chain", 4), initial={"x": [s * x for x in start]}, parameters={"s": s})
        ended = run(begun, sigma=[0.5, 1.0], certified=True, show_progress=False)
        assert set(ended.data.verdict.values) == {1}
        collected.append(ended.data.transversal_exponent.values)
    x = (0.05 + np.sqrt(0.05**2 + 4.0)) / 2.0
    expected = 1.0 - 3.0 * x**2 + x / 10.0 - (2.0 - np.sqrt(2.0)) * np.array([0.5, 1.0])
    np.testing.assert_allclose(collected, [expected, expected], atol=1e-7)


def test_cells_of_one_sweep_that_end_apart_have_exponents_of_their_own() -> None:
    well = Field({"x": "x - x**3 + x**2/20"})
    pair = Scene(
        well, "x->x", topology("chain", 2), axes={"x_1": [-0.9, 0.9], "x_2": [-0.8, 0.8]}, parameters={"sigma": 1.0}
    )
    ended = run(pair, certified=True, show_progress=False)
    exponent, x = ended.data.transversal_exponent.values, ended.end.values.reshape(2, 2, 2)[..., 0]
    np.testing.assert_allclose(exponent, 1.0 - 3.0 * x**2 + x / 10.0 - 2.0, atol=1e-7)


def test_an_interrupted_run_is_resumed_with_its_certificate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from synchain.runtime.engines.job import SweepJob

    module = importlib.import_module("synchain.runtime.sweeps.run")
    work, certified, calls = SweepJob.run, module.with_certificate, []

    def certificate(prepared: PreparedRun) -> PreparedRun:
        found = certified(prepared)
        monkeypatch.setattr(SweepJob, "run", stop)
        return found

    def stop(shop: SweepJob, cells: np.ndarray, *more: np.ndarray) -> object:
        calls.append(cells)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return work(shop, cells, *more)

    grid = np.linspace(0.02, 0.2, 40)
    monkeypatch.setattr(module, "with_certificate", certificate)
    with pytest.raises(SweepInterrupted) as caught:
        run(scene(transient=60.0, window=5.0), sigma=grid, certified=True, workers=1, show_progress=False)
    monkeypatch.undo()
    caught.value.result.save(tmp_path / "part.nc")
    part = open_result(tmp_path / "part.nc")
    assert 0 < (part.status.values == 1).sum() < 40
    done = run(part.scene, resume=part, certified=True, show_progress=False)
    full = run(scene(transient=60.0, window=5.0), sigma=grid, certified=True, show_progress=False)
    assert done.data.identical(full.data)


def test_what_has_no_certificate() -> None:
    with pytest.raises(ValueError, match="needs coupled oscillators; found a scene without links"):
        certify(Scene(topology=topology("chain", 1)))
    with pytest.raises(ValueError, match="found omega = 0 in the sweep"):
        certify(scene(axes={"omega": [0.0, 1.0]}, time_unit="time"))


@pytest.mark.parametrize(
    ("problem", "error", "message"),
    [
        (KeyboardInterrupt(), SweepInterrupted, "interrupted with 0 of 2 cells finished"),
        (BrokenProcessPool("gone"), SweepFailed, r"the workers are lost \(gone\); 0 of 2 cells had finished"),
    ],
)
@pytest.mark.parametrize("step", ["BlockScheduler", "certify"])
def test_an_interrupted_certification_says_what_is_done(monkeypatch, tmp_path, step, problem, error, message):
    def fail(*_, **__):
        raise problem

    monkeypatch.setattr(certification, step, fail)
    asked = {"sigma": [0.1, 0.2], "certified": True, "show_progress": False}
    for call in (lambda: run(scene(), **asked), lambda: stream(scene(), tmp_path / "a.nc", **asked)):
        with pytest.raises(error, match=f"^{message}$") as caught:
            call()
        assert set(caught.value.result.status.values.tolist()) == {Status.NOT_RUN}
        assert list(tmp_path.iterdir()) == []
