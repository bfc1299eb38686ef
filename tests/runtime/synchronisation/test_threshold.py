"""Probe, projection and direct simulation against each other and against what is known exactly."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from synchain import Criterion, Field, Scene, exponents, thresholds
from synchain.codegen.driver.columns import Count, SumColumn
from synchain.graphs import chain, complete, from_matrix, star
from synchain.results import MSF, Exponents, ExponentWindows, Status
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.plots.style import GREEN
from synchain.runtime.support.execution import Execution
from synchain.runtime.synchronisation import threshold
from synchain.runtime.synchronisation.criterion import PAPER, offsets
from synchain.runtime.synchronisation.threshold import (
    PROBES,
    Sweep,
    cells_of,
    check_probe,
    critical_ratio,
    default_grid,
    judge,
    probe,
    project,
    simulate,
    wu_chua,
)
from synchain.runtime.synchronisation.trials import mean_errors

PARTS = from_matrix([[-1, 1, 0, 0], [1, -1, 0, 0], [0, 0, -1, 1], [0, 0, 1, -1]])
SHORT = replace(PAPER, transient=100.0, window=20.0, starts=2)


def test_projection_is_the_intersection_over_all_modes():
    spectrum = chain(3).spectrum  # 0, -1, -3
    for ranges, expected in (
        ([(0.3, 1.2)], [(0.3, 0.4)]),
        ([(0.3, 0.8)], []),
        ([(0.0, 0.9)], [(0.0, 0.3)]),
        ([(0.0, 0.1), (0.33, 1.2)], [(0.0, 0.1 / 3), (0.33, 0.4)]),
    ):
        windows = project(ranges, spectrum)
        assert np.shape(windows) == np.shape(expected)
        np.testing.assert_allclose(np.ravel(windows), np.ravel(expected), rtol=1e-14)
    assert critical_ratio(spectrum) == pytest.approx(3)
    assert critical_ratio(star(6).spectrum) == 6
    assert critical_ratio(complete(7).spectrum) == 1.0


def test_parts_of_a_network_synchronise_only_where_uncoupled_oscillators_do():
    spectrum = PARTS.spectrum  # 0, 0, -2, -2
    assert project([(0.3, 1.2)], spectrum) == []
    assert project([(0.0, 0.9)], spectrum) == [(0.0, 0.45)]


def test_network_in_parts_is_allowed_and_said():
    parts = from_matrix([[-1, 1, 0], [1, -1, 0], [0, 0, 0]])
    result = thresholds(
        Scene(topology=parts), omega=1.15, sigma=np.linspace(0, 0.3, 7), criterion=SHORT, resolution=0.05
    )
    assert any("no complete synchronisation" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("ranges", "expected"), [([(0.0, 0.0)], [(0.0, 0.0)]), ([(0.1, 0.2)], []), ([(0.0, 9.0)], [(0.0, 2.0)])]
)
def test_parts_ask_for_stability_at_zero_ends_included(ranges, expected):
    assert project(ranges, PARTS.spectrum, 2.0) == expected


def test_the_default_grid_ends_where_the_largest_mode_is_at_1_2():
    grid = default_grid(chain(2).spectrum)
    assert (grid[0], grid[-1], len(grid)) == (0.0, 0.6, 241)
    assert np.diff(grid) == pytest.approx(np.full(240, 0.0025))
    grid = default_grid(complete(100).spectrum)
    assert (grid[0], grid[-1], len(grid)) == (0.0, pytest.approx(0.012), 61)


@pytest.fixture
def swept(monkeypatch):
    """The calls of `simulate` as (scene, sigma, options); it finds the range 0.1 … 0.2."""
    calls = []

    def fake(scene, sigma, *options):
        sigma = np.asarray(sigma, dtype=float)
        calls.append((scene, sigma, options))
        return Sweep(sigma, np.zeros(len(sigma)), np.ones(len(sigma)), ((0.1, 0.2),))

    monkeypatch.setattr(threshold, "simulate", fake)
    monkeypatch.setattr(threshold, "fitted", lambda _, __, criterion, ___: SHORT if criterion == SHORT else PAPER)
    monkeypatch.setattr(threshold, "exponent_windows", lambda *_: ExponentWindows())
    return calls


def test_the_probe_covers_every_mode_and_the_network_is_swept_as_asked(swept):
    result = thresholds(Scene(topology=chain(3)), sigma=[0.1, 0.2, 0.3], resolution=1e-3, criterion=SHORT, workers=1)
    (pair, half, options), (network, sigma, direct) = swept
    assert (pair.topology.n, network.topology.n) == (2, 3)
    assert (2 * half[0], 2 * half[-1]) == (pytest.approx(0.1), pytest.approx(0.9))
    assert 2 * PROBES / 3 < len(half) < 4 * PROBES / 3
    assert sigma.tolist() == [0.1, 0.2, 0.3]
    assert options == direct == (SHORT, 1e-3, Execution(workers=1))
    assert result.probe.intervals == ((0.2, 0.4),)
    np.testing.assert_array_equal(result.probe.x, 2 * half)
    assert result.predicted == ()  # 0.2 … 0.4 holds no number and its triple
    assert result.as_dict()["probe"] == [[0.2, 0.4]]


@pytest.mark.parametrize(
    ("graph", "sigma", "low"),
    [
        (chain(3), [0.0, 0.01], 0.0),
        (PARTS, [0.1, 0.11], 0.0),
        (chain(2), [0.1, 0.1 + 1e-9], 0.2),
        (chain(3), [-0.02, 0.01], -0.06),
        (chain(3), [-0.02, -0.01], -0.06),
        (PARTS, [-0.02, -0.01], -0.04),
    ],
)
def test_the_grid_of_the_probe_begins_at_zero_where_zero_is_asked_for(swept, graph, sigma, low):
    thresholds(Scene(topology=graph), sigma=sigma)
    probed = 2 * swept[0][1]
    assert probed[0] == pytest.approx(low)
    assert np.all(np.diff(probed) > 0.0)
    assert 2 * PROBES / 3 < len(probed) < 4 * PROBES / 3
    thresholds(Scene(topology=graph), sigma=np.linspace(sigma[0], sigma[1], 400))
    assert len(swept[2][1]) >= 400
    assert swept[0][2][0] == PAPER


@pytest.mark.parametrize("graph", [chain(2), chain(4), star(5)])
def test_the_grid_of_the_probe_has_the_spacing_of_that_of_sigma(swept, graph):
    """As long as the values of sigma reach it, no mode is probed more coarsely than the network, in ratios."""
    sigma = np.logspace(-4, 3, 50)
    thresholds(Scene(topology=graph), sigma=sigma)
    ratios = swept[0][1][1:] / swept[0][1][:-1]
    assert ratios.min() > 1.0
    assert ratios.max() <= sigma[1] / sigma[0] * (1 + 1e-12)
    sizes = [abs(value) for value in graph.spectrum.values if value]
    assert 2 * swept[0][1][[0, -1]] == pytest.approx([1e-4 * min(sizes), 1e3 * max(sizes)])


def test_ends_are_refined_as_far_as_the_grid_is_wide(swept):
    """By default 5e-4, a fifth of a shorter step, a thousandth of a larger sigma."""
    for x, resolution, widths in (
        ([0.0, 0.0025, 0.1], None, [5e-4, 5e-4]),
        ([0.0, 1e-6], None, [2e-7]),
        ([-9e6, -8e6, 0.0, 10.0, 20.0], None, [8e3, 5e-4, 5e-4, 1e-2]),
        ([0.0, 1e-6, 10.0], 0.1, [0.1, 0.1]),
    ):
        np.testing.assert_allclose(threshold._widths(np.array(x), resolution), widths, rtol=1e-12)


@pytest.mark.parametrize(
    ("sigma", "options", "message"),
    [
        ([0.0, 1e99], {}, r"a step of 1e\+99, from 0 to 1e\+99, and ends refined to 0\.0005; .*give more values"),
        ([0.0, 0.1, 0.2], {"resolution": 1e-12}, r"a step of 0\.1, from 0 to 0\.1, and ends refined to 1e-12"),
    ],
)
def test_steps_that_cannot_be_refined_are_refused_before_the_work(swept, sigma, options, message):
    with pytest.raises(ValueError, match=f"^sigma: found {message}") as caught:
        thresholds(Scene(topology=chain(2)), sigma=sigma, **options)
    assert swept == []
    assert "\n" not in str(caught.value)
    thresholds(Scene(topology=chain(2)), sigma=[0.0, 1e99], resolution=1e92)


def test_the_prediction_ends_with_the_grid_of_sigma(swept):
    assert thresholds(Scene(topology=chain(2)), sigma=[0.05, 0.15]).predicted == ((0.1, 0.15),)
    assert thresholds(Scene(topology=chain(2)), sigma=[0.05, 0.5]).predicted == ((0.1, 0.2),)


def test_what_a_scene_observes_is_not_used(swept):
    thresholds(Scene(topology=chain(3), observe={"e": "mean(nodes.mean(v))"}), sigma=[0.1, 0.2])
    assert [dict(scene.observe) for scene, *_ in swept] == [{}, {}]


def test_negative_sigma_is_predicted_as_it_is_simulated(swept, monkeypatch):
    sweep = Sweep(np.array([-0.3, 0.3]), np.zeros(2), np.ones(2), ((-0.15, 0.3),))
    monkeypatch.setattr(threshold, "simulate", lambda *_: sweep)
    assert thresholds(Scene(topology=chain(2)), sigma=[-0.3, 0.3]).predicted == ((-0.15, 0.3),)
    assert thresholds(Scene(topology=chain(3)), sigma=[-0.3, 0.3]).predicted == (
        (pytest.approx(-0.1), pytest.approx(0.2)),
    )


def test_the_criterion_is_that_of_the_published_table():
    """docs/thresholds.md rests on it: 8 starts, 1000 periods and 100 more, a mean error below 1e-3."""
    criterion = PAPER
    assert (criterion.tolerance, criterion.starts, criterion.reach) == (1e-3, 8, 0.4)
    assert (criterion.transient, criterion.window, criterion.rtol, criterion.rng) == (1000.0, 100.0, 1e-8, 0)


def test_at_least_half_of_the_starts_must_fall_below_the_tolerance():
    def errors(points):
        other = np.where(points < 0.5, 0.0, SHORT.tolerance)  # an error of the tolerance itself is not below it
        return np.stack([np.where(points < 0.25, 0.0, 1.0), other], axis=1)

    sweep = judge(errors, np.array([0.0, 0.3, 0.6]), 1e-3, SHORT)
    assert sweep.share.tolist() == [1.0, 0.5, 0.0]
    assert sweep.error.tolist() == [0.0, 0.5, 0.5 * (1 + SHORT.tolerance)]
    assert sweep.x.tolist() == [0.0, 0.3, 0.6]
    ((low, high),) = sweep.intervals
    assert (low, high) == (0.0, pytest.approx(0.5, abs=1e-3))


def test_cells_are_every_coupling_with_every_start():
    criterion = replace(PAPER, starts=2, transient=7, window=3, rtol=1e-5)
    move = offsets(criterion)[1]
    cells = cells_of(Scene(topology=chain(2)), np.array([0.1, 0.2]), criterion)
    assert {axis.name: axis.values for axis in cells.axes} == {
        "sigma": (0.1, 0.1, 0.2, 0.2),
        "x_1": (0.3, 0.3 + move, 0.3, 0.3 + move),
        "x_2": (0.28, 0.28 + move, 0.28, 0.28 + move),
    }
    assert (cells.zipped, cells.record) == (True, ("sync_error",))
    assert (cells.transient, cells.window, cells.rtol) == (7, 3, 1e-5)


def test_errors_of_cells_that_failed_are_infinite():
    buffers = Buffers.empty(4, 4, 0, 0)
    buffers.counts[:, Count.STATUS] = [Status.FINISHED, Status.FINISHED, Status.STEP_BUDGET, Status.FINISHED]
    buffers.sums[:, SumColumn.MEAN] = [0.0, 1.0, 2.0, 3.0]
    assert mean_errors(buffers).tolist() == [0.0, 1.0, np.inf, 3.0]


class Spy(ThreadPoolExecutor):
    """Notes the jobs whose blocks it runs."""

    def __init__(self) -> None:
        super().__init__(1)
        self.jobs = []

    def submit(self, function, /, *arguments):
        self.jobs.append(function.__self__)
        return super().submit(function, *arguments)


def test_the_grid_and_the_rounds_that_refine_its_ends_run_one_kernel():
    dampers = Scene(oscillator="harmonic", topology=chain(2), coupling="damper")
    with Spy() as executor:
        sweep = simulate(
            dampers,
            [0.0, 0.5],
            criterion=Criterion(transient=50, window=5, starts=1),
            resolution=1e-2,
            execution=Execution(executor=executor, show_progress=False),
        )
    assert sweep.share.tolist() == [0.0, 1.0]
    assert 0.0 < sweep.intervals[0][0] < 0.5
    jobs = list(dict.fromkeys(map(id, executor.jobs)))
    assert len(jobs) == 2  # that of the motion, and that of the grid and all rounds
    assert sum(job is executor.jobs[-1] for job in executor.jobs) > 2
    assert all(job.kernel is executor.jobs[0].kernel for job in executor.jobs)


def test_starts_are_moved_by_at_most_the_reach_and_the_first_not_at_all():
    moves = offsets(replace(PAPER, starts=2000, reach=0.5, rng=3))
    assert moves[0] == 0.0
    assert len(moves) == 2000
    assert (-0.5 <= moves.min() < -0.49, 0.49 < moves.max() <= 0.5) == (True, True)
    assert offsets(replace(PAPER, starts=2000, reach=0.5, rng=3)).tolist() == moves.tolist()
    assert offsets(replace(PAPER, starts=2000, reach=0.5, rng=4)).tolist() != moves.tolist()
    assert offsets(replace(PAPER, starts=1)).tolist() == [0.0]


def test_wu_chua_keeps_the_product_of_coupling_and_eigenvalue():
    assert wu_chua(0.233, chain(2).spectrum, chain(3).spectrum) == pytest.approx(0.233 * 2 / 3)


def test_probe_of_the_periodic_case_meets_the_published_range():
    sweep = probe(
        Scene(topology=chain(2)), np.linspace(0, 0.8, 9), criterion=Criterion(transient=400, window=20, starts=1)
    )
    ((low, high),) = sweep.intervals
    assert low == 0.0
    assert high == pytest.approx(2 * 0.233, abs=0.015)  # 400 periods leave about 0.01 in alpha undecided
    assert sweep.share.min() == 0.0
    assert sweep.error[0] < 1e-3 < sweep.error[-1]


def test_direct_range_of_a_star_lies_where_the_probe_says():
    result = thresholds(
        Scene(topology=star(4)), omega=1.15, sigma=np.linspace(0, 0.3, 13), criterion=SHORT, resolution=2e-3
    )
    assert result.predicted[0][1] == pytest.approx(result.probe.intervals[0][1] / 4, abs=1e-9)
    assert result.direct.intervals[0][1] == pytest.approx(result.predicted[0][1], abs=0.01)
    ((_, high),), ((low_error, high_error),) = result.exponents.intervals, result.exponents.errors
    assert high == pytest.approx(0.4653 / 4, abs=1e-4)
    assert 0.0 == low_error < high_error < 1e-6  # the motion is periodic
    assert result.direct.intervals[0][1] == pytest.approx(high, abs=0.01)
    answer = result.as_dict()
    kinds = {"intervals", "probe", "predicted", "exponents", "exponent_errors", "no_exponents", "warnings"}
    assert set(answer) == kinds
    assert answer["intervals"][0][1] == result.direct.intervals[0][1]


def test_failed_cells_never_count_as_synchronous():
    stopped = Scene(topology=chain(2), max_steps=50)
    assert simulate(stopped, [0.0, 0.1], criterion=SHORT).intervals == ()


@pytest.mark.parametrize(
    ("graph", "message"),
    [
        (chain(1), "at least two"),
        (from_matrix([[-1, 1, 0], [0, -1, 1], [1, 0, -1]]), "complex"),
        (from_matrix([[2, -1, -1], [-1, 2, -1], [-1, -1, 2]]), "negate it"),
    ],
)
def test_networks_that_the_probe_cannot_judge_are_refused(graph, message):
    with pytest.raises(ValueError, match=message):
        thresholds(Scene(topology=graph), omega=1.15)


def test_nodes_without_links_are_refused():
    graph = from_matrix([[0, 0], [0, 0]])
    with pytest.raises(ValueError, match="no links"):
        check_probe(graph, graph.spectrum)


@pytest.mark.parametrize(
    "bad", [{"tolerance": 0}, {"rtol": float("inf")}, {"starts": 0}, {"transient": float("nan")}, {"window": -1}]
)
def test_senseless_criteria_are_refused(bad):
    with pytest.raises(ValueError, match="criterion"):
        Criterion(**bad)


def test_exponent_changes_sign_where_the_probe_does():
    result = exponents(Scene(topology=chain(2)), np.linspace(0.40, 0.54, 8), starts=1)
    assert result.intervals[0][1] == pytest.approx(0.4653, abs=2e-3)
    assert np.all(np.diff(result.exponent) > 0)
    assert np.all(result.stderr < 2e-3)


INSTANT = Criterion(starts=1, transient=0.01, window=0.01)
ASKED = {"criterion": INSTANT, "resolution": 0.1, "workers": 1, "show_progress": False}


def test_windows_of_exponents_are_those_of_the_network():
    """Of x' = -x, y' = -y with links across, a mode grows at alpha - 1: chain(3) has the eigenvalues -1 and -3."""
    scene = Scene(Field({"x": "-x", "y": "-y"}), "x->y, y->x", chain(3), time_unit="time")
    result = thresholds(scene, sigma=[0.0, 1.0, 2.0], **ASKED)
    assert result.exponents.absent == ""
    np.testing.assert_allclose(result.exponents.intervals, [(0.0, 1 / 3)], rtol=1e-9)
    np.testing.assert_allclose(result.exponents.errors, [(0.0, 0.0)], atol=1e-9)
    np.testing.assert_allclose(result.data["window"], [(0.0, 1 / 3)], rtol=1e-9)
    assert result.data["window_error"].dims == result.data["window"].dims == ("window_number", "end")
    assert dict(result.summary)["sigma, negative exponents"] == "0.0000 … 0.3333"
    assert result.as_dict()["no_exponents"] is None
    axes = result.plot()
    assert "negative exponents" in [text.get_text() for text in axes.get_legend().get_texts()]
    ends = next(line.get_xdata(orig=False) for line in axes.lines if line.get_color() == GREEN)
    np.testing.assert_allclose(ends, [0.0, 1 / 3], rtol=1e-9)


def test_ranges_that_end_with_the_grid_may_go_on():
    """Of x' = -x, y' = -y with links across, a mode of strength alpha grows at alpha - 1: nothing grows below sigma = 1/3."""
    scene = Scene(Field({"x": "-x", "y": "-y"}), "x->y, y->x", chain(3), time_unit="time")
    rows = dict(thresholds(scene, sigma=[0.0, 0.1, 0.2], **ASKED).summary)
    assert rows["sigma, negative exponents"] == "0.0000 … 0.2000..."
    assert rows["..."] == "the grid ends here, the range may go on"
    sweep = Sweep(np.array([0.1, 0.2]), np.zeros(2), np.ones(2), ((0.1, 0.15), (0.18, 0.2)))
    full = thresholds(scene, sigma=[0.0, 0.1, 0.2], **ASKED)
    rows = dict(replace(full, direct=sweep, probe=sweep, predicted=sweep.intervals).summary)
    for name in ("sigma, simulated", "sigma, predicted by the probe", "alpha = sigma |gamma|, probe"):
        assert rows[name] == "0.1000... … 0.1500; 0.1800 … 0.2000..."


@pytest.mark.parametrize(("drive", "unit"), [("", 1.0), (" + cos(t/2)", 4 * math.pi)])
def test_ends_that_come_of_the_transient_are_named(drive, unit):
    """Errors grow at alpha - 1 = 2 sigma - 1: after 20 units of time they have fallen enough up to sigma = 0.39, not 1/2."""
    scene = Scene(
        Field({"x": f"-x{drive}", "y": "-y"}), "x->y, y->x", chain(2), time_unit="period" if drive else "time",
        initial={"x": [0.5, 0.4], "y": [0.5, 0.5]},
    )  # fmt: skip
    criterion = Criterion(starts=1, transient=20.0 / unit, window=0.1 / unit)
    asked = {"sigma": np.linspace(0.0, 0.6, 13), "show_progress": False}
    result = thresholds(scene, criterion=criterion, **asked)
    ((_, high),) = result.direct.intervals
    assert 0.3 < high < 0.45 < result.exponents.intervals[0][1] == pytest.approx(0.5)
    assert [warning[: warning.index(" come of")] for warning in result.warnings] == [
        f"the ends of what is {what} at sigma = {end:.4f} (exponent {2 * end - 1:.2g})"
        for what, end in (("simulated", high), ("predicted by the probe", result.predicted[0][1]))
    ]
    assert all("20 units of time are given; trust the exponents" in warning for warning in result.warnings)
    assert set(result.warnings) <= {warning for name, warning in result.summary if name == "warning"}
    # an end of the grid is none of the transient
    assert thresholds(scene, criterion=criterion, **{**asked, "sigma": [0.0, 0.1, 0.2]}).warnings == ()


def test_the_effort_of_the_exponents_can_be_chosen(monkeypatch):
    asked = []
    monkeypatch.setattr(threshold, "exponent_windows", lambda *all_: asked.append(all_[3:]) or ExponentWindows())
    monkeypatch.setattr(threshold, "simulate", lambda scene, sigma, *_: Sweep(sigma, 0 * sigma, 0 * sigma, ()))
    scene = Scene(topology=chain(2))
    thresholds(scene, sigma=[0.1, 0.2])
    thresholds(scene, sigma=[0.1, 0.2], precision=0.1, periods=50, criterion=Criterion(rng=3))
    assert asked == [(None, 5000, 0), (0.1, 50, 3)]
    for bad in ({"precision": "a"}, {"periods": 0}):
        with pytest.raises(ValueError, match=r"precision|periods"):
            thresholds(scene, sigma=[0.1, 0.2], **bad)
    assert len(asked) == 2


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        (
            Scene(
                Field({"x": "v", "v": "-x - v + cos(t) + cos(w*t)"}, parameters={"w": math.sqrt(2)}),
                "x->v",
                chain(2),
                time_unit="time",
            ),
            "which have no common period",
        ),
        (
            Scene(friction="coulomb_static", contact="set-valued", coupling="damper", topology=chain(2)),
            "links act on velocities",
        ),
        (Scene(Field({"x": "x**2"}), "x->x", chain(2), time_unit="time"), "the state grew without bound"),
    ],
)
def test_exponents_that_do_not_apply_say_why(scene, why, monkeypatch):
    monkeypatch.setattr("synchain.codegen.simd.lanes.native_width", lambda *_: 1)  # the drivers of other tests
    result = thresholds(scene, sigma=[0.0, 0.1], **ASKED)
    assert result.exponents.intervals == ()
    assert why in result.exponents.absent
    assert why in result.data["window"].attrs["long_name"]
    assert dict(result.summary)["sigma, negative exponents"] == f"not computed: {result.exponents.absent}"
    assert result.as_dict()["no_exponents"] == result.exponents.absent
    assert "exponents: not computed" in [text.get_text() for text in result.plot().texts]


def test_an_error_of_the_callers_hook_is_no_reason():
    def wrong(progress):
        if progress.unit == "period":
            raise ValueError("of the hook")

    scene = Scene(Field({"x": "-x"}), "x->x", chain(2), time_unit="time")
    with pytest.raises(ValueError, match="of the hook"):
        thresholds(scene, sigma=[0.0, 0.1], progress=wrong, **ASKED)


def test_windows_without_an_estimate_of_their_error_say_so():
    alpha = np.linspace(0.0, 1.0, 11)
    one = np.full(11, np.inf)
    function = MSF(Scene(topology=chain(2)), alpha, Exponents(alpha, 0.25 - alpha, one, 1.0, 1, (0.25 - alpha)[None]))
    windows = ExponentWindows.of(function)
    np.testing.assert_allclose(windows.intervals, [(0.125, 0.5)])
    assert windows.errors == ((np.inf, np.inf),)  # the upper end is that of the grid
    with pytest.raises(ValueError, match="0 pairs of errors; expected one for each of 1 windows"):
        ExponentWindows(((0.0, 1.0),), ())
    with pytest.raises(ValueError, match="expected one of the two"):
        ExponentWindows(((0.0, 1.0),), ((0.0, 0.0),), "no drive")


@pytest.mark.parametrize("changed", [{"coupling": "inerter"}, {"parameters": {"mu_k": [0.15, 0.16, 0.14]}}])
def test_networks_that_the_probe_says_nothing_about_are_refused_at_once(changed, swept):
    with pytest.raises(ValueError, match=r"^thresholds: found (links with inertia|nodes that differ in mu_k)"):
        thresholds(Scene(topology=chain(3), **changed), omega=1.15)
    assert swept == []
