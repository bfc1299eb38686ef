"""Basin stability against shares that are known in closed form, and every cell accounted for."""

from __future__ import annotations

import math
import pickle
from concurrent.futures import Executor, Future

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import binomtest

from synchain import Criterion, Field, Scene, basin, universal_probe
from synchain.graphs import chain
from synchain.results import Basin, Probe, Status
from synchain.runtime.synchronisation import ensemble
from synchain.runtime.synchronisation.starts import Starts

FREE = Scene(oscillator="harmonic", topology=chain(2), parameters={"sigma": 0.0})
DAMPED = Scene(oscillator="harmonic", topology=chain(3), coupling="damper", parameters={"sigma": 0.5})
PENDULA = Scene(oscillator="pendulum", topology=chain(2), parameters={"sigma": 0.0}, rtol=1e-12)
SHORT = {"transient": 8.0 * math.pi, "window": 2.0 * math.pi}  # whole turns


def share(found: Basin, label: str = "synchronous") -> float:
    return float(found.shares.sel(attractor=label).item())


def interval(found: Basin, label: str = "synchronous") -> tuple[float, float]:
    low, high = found.intervals.sel(attractor=label).values
    return float(low), float(high)


def of(found: Basin, label: str, cell: int = 0) -> np.ndarray:
    """Whether each start of a cell has this fate."""
    return np.asarray(found.fate[cell] == found.labels.index(label))


@pytest.fixture(scope="module")
def free() -> Basin:
    return basin(FREE, samples=1000, tolerance=1.0, **SHORT)


def test_undamped_pairs_keep_their_distance(free):
    """Free oscillators of frequency 1 turn about the origin of the phase plane: their distance there is constant."""
    x_1, x_2, v_1, v_2 = free.start[0].T
    np.testing.assert_allclose(free.error[0], np.hypot(x_1 - x_2, v_1 - v_2), rtol=1e-5)


def test_share_of_free_pairs_is_that_of_two_points_in_a_square(free):
    """Two points of a unit square are closer than s <= 1 with the probability pi s^2 - 8 s^3/3 + s^4/2.

    Source: Solomon, Geometric Probability (SIAM, 1978), ch. 2.  The square has the side 2 here, so that s = 1/2.
    """
    s = 0.5
    volume = math.pi * s**2 - 8 * s**3 / 3 + s**4 / 2
    assert share(free) == pytest.approx(volume, abs=4 * math.sqrt(volume * (1 - volume) / free.samples))
    low, high = interval(free)
    assert low < volume < high
    assert of(free, "synchronous").sum() == round(share(free) * 1000)
    exact = binomtest(round(share(free) * 1000), 1000).proportion_ci(0.95, method="exact")
    assert (low, high) == pytest.approx((exact.low, exact.high))


def test_uncoupled_oscillators_never_synchronise_and_damped_ones_always():
    """Where none or all do, the interval ends at (1 - confidence)/2 to the power 1/samples (Clopper & Pearson)."""
    never = basin(FREE, samples=200, tolerance=1e-3, **SHORT)
    always = basin(DAMPED, samples=200, transient=300.0, window=10.0, confidence=0.9)
    assert (share(never), share(always)) == (0.0, 1.0)
    assert interval(never) == pytest.approx((0.0, 1.0 - 0.025 ** (1 / 200)))
    assert interval(always) == pytest.approx((0.05 ** (1 / 200), 1.0))
    assert always.statuses == {Status.FINISHED: 200}


def test_parameters_override_those_of_the_scene():
    assert share(basin(DAMPED, samples=20, transient=300.0, window=10.0, sigma=0.0)) == 0.0


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
    assert share(result) == (200 - lost) / 200
    assert share(result, "escaped") == lost / 200
    assert f"{lost} starts: the state grew without bound" in str(result)
    assert f"share {share(result):.4g} ({200 - lost} of 200 starts)" in str(result)
    assert "confidence 0.95" in str(result)


def test_a_spent_budget_is_no_synchronisation():
    result = basin(DAMPED.replace(max_steps=3), samples=10, **SHORT)
    assert share(result) == 0.0
    assert interval(result) == (0.0, 1.0)
    assert result.statuses == {Status.STEP_BUDGET: 10}


def test_a_seed_gives_one_result_whatever_the_workers(free):
    again = basin(FREE, samples=1000, tolerance=1.0, workers=1, **SHORT)
    for name in ("start", "error", "status"):
        assert np.array_equal(getattr(again, name), getattr(free, name))
    other = basin(FREE, samples=1000, tolerance=1.0, rng=1, **SHORT)
    assert not np.isin(other.start, free.start).any()
    generators = [basin(FREE, samples=5, tolerance=1.0, rng=np.random.default_rng(3), **SHORT).start for _ in range(2)]
    assert np.array_equal(*generators)


def test_a_smaller_sample_is_the_beginning_of_a_larger_one(free):
    few = basin(FREE, samples=37, tolerance=1.0, **SHORT)
    assert np.array_equal(few.start[0], free.start[0, :37])
    assert np.array_equal(few.error[0], free.error[0, :37])


def test_starts_fill_their_ranges_and_the_rest_stays():
    result = basin(
        DAMPED.replace(initial={"x": [0.7, 0.8, 0.9]}), samples=300, ranges={"v": (2.0, 5.0)}, transient=0.0, window=0.1
    )
    assert (result.start[0, :, :3] == [0.7, 0.8, 0.9]).all()
    v = result.start[0, :, 3:]
    assert len(np.unique(v)) == v.size
    assert v.min() >= 2.0
    assert v.max() < 5.0
    np.testing.assert_allclose(v.mean(axis=0), 3.5, atol=4 * 3 / math.sqrt(12 * 300))
    np.testing.assert_allclose(np.corrcoef(v.T), np.eye(3), atol=4 / math.sqrt(300))


def test_the_order_of_the_ranges_does_not_matter():
    pair = [{"x": (0, 1), "v": (5, 6)}, {"v": (5, 6), "x": (0, 1)}]
    one, other = (basin(FREE, samples=5, ranges=ranges, **SHORT).start for ranges in pair)
    assert np.array_equal(one, other)
    assert one[0, :, :2].max() <= 1
    assert one[0, :, 2:].min() >= 5


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
        ({"rng": -1}, "rng = -1"),
        ({"nodes": [3]}, "nodes = 3; expected at most 2"),
        ({"nodes": "all"}, "nodes: found 'all'; expected 'each', or numbers"),
        ({"bound": {"q": 1.0}}, "bound: found 'q'; known: x, v"),
        ({"bound": -1.0}, "bound of x"),
        ({"x_1": [0.0, 1.0], "samples": 5}, "samples = 5 at each point of a grid; expected ranges"),
        ({"attractors": {"escaped": "rest"}}, "found the name 'escaped'; expected one that no other share has"),
        ({"attractors": {"a": "x_1 > 0"}}, "attractor 'a': found 'x_1 > 0'; expected a comparison of observables"),
        ({"attractors": {"a": "mean(x) > 0"}}, r"found mean\(x\), which each node has; expected one value"),
        ({"attractors": {"a": "mean(y_1) > 0"}}, "attractor 'a': unknown name 'y_1'"),
        ({"attractors": {"a": "mean(x_1) > omga"}}, "attractor 'a': unknown parameter 'omga'"),
        ({"attractors": {"a": "mean(x_1)"}}, "expected a comparison"),
        ({"attractors": {"a": "mean(x_1) == 0"}}, "found ==; expected < <= > or >="),
        ({"attractors": {"a": "rest"}, "tolerance": 1.0}, 'tolerance: found no attractor "synchronous"'),
    ],
)
def test_what_makes_no_sense_is_refused(keywords, message):
    with pytest.raises(ValueError, match=message):
        basin(FREE, **keywords)


def test_draws_and_mixed_zipped_axes_are_refused():
    with pytest.raises(ValueError, match=r"^basin: found draws; .*realisations=0"):
        basin(FREE.replace(draws={"x": "normal(0, 1)"}, realisations=2))
    with pytest.raises(ValueError, match=r"^basin: found zipped axes of parameters and initial states, sigma and x_1"):
        basin(FREE.replace(axes={"sigma": [0.1, 0.2], "x_1": [0.0, 0.1]}, zipped=True))


def test_one_oscillator_has_no_synchrony_and_half_a_sample_is_refused():
    with pytest.raises(ValueError, match="found 'synchronous' for 1 nodes with"):
        basin(Scene(oscillator="harmonic", topology=chain(1)), attractors={"together": "synchronous"})
    with pytest.raises(TypeError, match=r"samples = 2\.5; expected a whole number"):
        basin(FREE, samples=2.5)


ROSSLER = Scene(
    Field({"x": "-y - z", "y": "x + a*y", "z": "b + z*(x - c)"}, parameters={"a": 0.2, "b": 0.2, "c": 9.0}),
    "x->x", chain(2), parameters={"sigma": 2.28},
)  # fmt: skip
BOX = {"x": (-2.0, 2.0), "y": (-2.0, 2.0), "z": (0.0, 2.0)}


def test_starts_that_need_more_time_are_undecided():
    """At alpha = 4.56 the exponent is about -0.003: an error of 1 falls to 1e-3 in 2300 units of time, not in 200."""
    short, longer = (
        basin(ROSSLER, samples=16, ranges=BOX, show_progress=False, **kw) for kw in ({"transient": 200.0}, {})
    )
    assert share(short, "approaching") + share(short) == 1.0
    assert share(short) < 0.2
    assert interval(short)[1] == interval(short, "other")[1] == 1.0
    assert -0.006 < short.exponent[0] < 0.0
    assert share(longer) + share(longer, "approaching") == 1.0
    assert share(longer) > 0.7
    assert "approaching" in str(short)


def test_cells_of_a_sweep_have_the_same_starts_and_their_own_exponents():
    """Strengths 2 sigma on both sides of the window 0.19 … 4.6 of Roessler oscillators coupled by x."""
    found = basin(ROSSLER, samples=16, ranges=BOX, sigma=[0.05, 0.5, 1.5], transient=600.0, show_progress=False)
    assert found.shares.sel(attractor="synchronous").values.tolist() == [0.0, 1.0, 1.0]
    assert found.shares.sizes == {"sigma": 3, "attractor": len(found.labels)}
    assert found.exponent[0] > 0.0 > found.exponent[1:].max()
    assert "the synchronous state is unstable" in str(found)
    alone = basin(ROSSLER, samples=16, ranges=BOX, sigma=0.5, transient=600.0, show_progress=False)
    assert np.array_equal(alone.start, found.start)
    assert np.array_equal(alone.fate[0], found.fate[1])


WELLS = Scene(Field({"x": "x - x**3"}), "x->x", chain(2), parameters={"sigma": 0.01})
CORNERS = {
    "left": "mean(x_1) < 0 and mean(x_2) < 0",
    "right": "mean(x_1) > 0 and mean(x_2) > 0",
    "apart": "mean(x_1*x_2) < -0.5",
}


def test_another_attractor_is_no_approach():
    """Starts in two wells stay apart, those in one come together: each well has a probability of one half."""
    result = basin(WELLS, samples=64, show_progress=False)
    low, high = interval(result)
    assert low < 0.5 < high
    assert share(result, "other") == pytest.approx(1.0 - share(result))
    assert result.exponent[0] == pytest.approx(-2.02, abs=1e-3)
    clear = np.abs(result.start[0]).min(axis=1) > 0.1
    assert np.array_equal(of(result, "synchronous")[clear], np.prod(result.start[0][clear], axis=1) > 0.0)


def test_named_attractors_have_the_shares_of_their_quadrants():
    """Weakly coupled wells keep the signs of their starts: each quadrant has the probability 1/4."""
    found = basin(WELLS, samples=64, attractors=CORNERS, transient=40.0, window=5.0, show_progress=False)
    x, y = found.start[0].T
    clear = np.abs(found.start[0]).min(axis=1) > 0.1
    for name, quadrant in (("left", (x < 0) & (y < 0)), ("right", (x > 0) & (y > 0)), ("apart", x * y < 0)):
        assert np.array_equal(of(found, name)[clear], quadrant[clear])
        low, high = interval(found, name)
        assert low < (0.5 if name == "apart" else 0.25) < high
    assert found.criterion is None
    assert found.attractors == CORNERS


def test_a_start_in_two_attractors_is_reported():
    """Every start of the right well is in the upper half plane of its mean, too."""
    both = {"right": "mean(x_1) > 0 and mean(x_2) > 0", "sum": "mean(x_1 + x_2) > 0.5", "left": "mean(x_1) < 0"}
    with pytest.warns(
        RuntimeWarning, match=r"found \d+ of 64 starts that fulfil 'right' \(mean.*\) and 'sum' \(mean.*\)"
    ):
        found = basin(WELLS, samples=64, attractors=both, transient=40.0, window=5.0, show_progress=False)
    shared = round(64 * share(found, "right"))
    assert found.overlaps == (("right", "sum", shared),)
    assert shared > 0
    assert f"right, sum: {shared} starts, of right" in str(found)


def test_motions_without_a_name_are_grouped_and_keep_their_number_along_a_sweep():
    found = basin(
        WELLS, samples=64, attractors={}, sigma=[0.0, 0.02, 0.04], transient=40.0, window=5.0, show_progress=False
    )
    assert found.labels[:3] == ("other 1", "other 2", "other 3")
    x, y = found.start[0].T
    clear = np.abs(found.start[0]).min(axis=1) > 0.25
    signs = np.where(x * y < 0, 0, np.where(x > 0, 1, 2))
    for cell in range(3):
        groups = found.fate[cell][clear]
        assert len({*zip(groups, signs[clear], strict=True)}) == 3
    assert np.array_equal(found.fate[0][clear], found.fate[2][clear])
    assert found.counts.sum(axis=1).tolist() == [64, 64, 64]


def test_a_grid_of_starts_is_an_image_of_the_basins():
    x = np.linspace(-0.95, 0.95, 8)
    found = basin(WELLS, attractors=CORNERS, x_1=x, x_2=x, transient=40.0, window=5.0, show_progress=False)
    assert found.data.fate.dims == ("x_1", "x_2")
    right = (x[:, None] > 0) & (x > 0)
    assert np.array_equal(found.data.fate.values == found.labels.index("right"), right)
    assert share(found, "right") == 0.25
    some = basin(
        WELLS, attractors=CORNERS, x_1=x, ranges={"x": (-1, 1)}, samples=3, transient=40.0, show_progress=False
    )
    assert some.data.fate.sizes == {"x_1": 8, "sample": 3}
    np.testing.assert_array_equal(some.data.initial.sel(component="x", node=1).values, np.repeat(x, 3).reshape(8, 3))


PENDULUM = Scene(
    Field({"theta": "v", "v": "P - alpha*v - K*sin(theta)"}, parameters={"P": 0.5, "K": 1.0, "alpha": 0.1}),
    topology=chain(1), integrator="dop853",
)  # fmt: skip
ANGLE = math.asin(0.5)
REGION = {"theta": (ANGLE - math.pi, ANGLE + math.pi), "v": (-10.0, 10.0)}


def share_below_the_saddle() -> float:
    """The share of the region that the stable manifold of the saddle encloses: the basin of the fixed point.

    The manifold of one saddle is integrated backward on the unrolled cylinder, until it leaves the region at v = -10.
    """
    saddle, (p, k, a) = math.pi - ANGLE, (0.5, 1.0, 0.1)
    slope = 0.5 * (-a - math.sqrt(a**2 - 4.0 * k * math.cos(saddle)))

    def leaves(t: float, y: np.ndarray) -> float:
        return float(y[1] + 10.0)

    leaves.terminal = True  # type: ignore[attr-defined]
    branches = []
    for sign in (-1.0, 1.0):
        begin = np.array([saddle, 0.0]) + sign * 1e-7 * np.array([1.0, slope])
        path = solve_ivp(
            lambda t, y: [-y[1], -(p - a * y[1] - k * math.sin(y[0]))], (0.0, 400.0), begin,
            rtol=1e-9, atol=1e-11, max_step=0.05, events=[leaves],
        )  # fmt: skip
        branches.append(path.y)
    x, y = np.concatenate([branches[0][:, ::-1], branches[1]], axis=1)
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return float(area / (2.0 * math.pi * 20.0))


def test_basin_of_a_swing_machine_ends_at_the_stable_manifold_of_its_saddle():
    """bSTAB prints 0.152 for the fixed point: Stender & Hoffmann, Nonlinear Dyn. 107, 1451 (2022), case of the pendulum."""
    exact = share_below_the_saddle()
    assert exact == pytest.approx(0.152, abs=1e-3)
    named = {"at rest": "rest", "rotating": "mean(v) > P/alpha/2"}
    found = basin(
        PENDULUM, samples=1000, ranges=REGION, attractors=named, transient=200.0, window=20.0, show_progress=False
    )
    assert share(found, "at rest") + share(found, "rotating") == 1.0
    low, high = interval(found, "at rest")
    assert low < exact < high
    # not yet is not no: at every time the intervals contain the truth, and no start is decided wrongly
    groups = basin(PENDULUM, samples=1000, ranges=REGION, transient=200.0, window=20.0, show_progress=False)
    assert np.array_equal(of(groups, "other 1"), of(found, "rotating"))
    for transient in (20.0, 50.0, 100.0):
        early = basin(
            PENDULUM,
            samples=1000,
            ranges=REGION,
            attractors=named,
            transient=transient,
            window=10.0,
            show_progress=False,
        )
        low, high = interval(early, "at rest")
        assert low < exact < high
        for name in named:
            assert not (of(early, name) & ~of(found, name)).any()
    # without names too, a motion that changes from window to window is no attractor
    early = basin(PENDULUM, samples=1000, ranges=REGION, transient=20.0, window=10.0, show_progress=False)
    assert share(early, "approaching") > 0.5
    assert share(groups, "approaching") == 0.0


def test_exponents_of_stiff_cells_take_the_steps_of_the_cells(monkeypatch):
    """A variable that decays at the rate 2000 beside slow motion: no warning of short Taylor steps, which nobody chose."""
    asked, certify = [], ensemble.certify
    monkeypatch.setattr(
        ensemble, "certify", lambda scene, **more: asked.append(scene.integrator) or certify(scene, **more)
    )
    fast = Field({"x": "y", "y": "z - x - 0.1*y", "z": "2000*(sin(y) - z)"})
    stiff = Scene(fast, "x->y", chain(2), parameters={"sigma": 0.2}, transient=20.0, window=5.0)
    assert basin(stiff, samples=4, show_progress=False).exponent[0] < 0.0
    assert basin(stiff.replace(integrator="dop853"), samples=4, show_progress=False).exponent[0] < 0.0
    assert asked == ["rodas5p", "dop853"]


def test_nodes_are_perturbed_one_after_another():
    """A machine with half of the coupling has another basin stability than its twin, at the same perturbations."""
    alone = Scene(
        Field({"theta": "v", "v": "P - alpha*v - K*sin(theta)"}, parameters={"P": 0.5, "K": 1.0, "alpha": 0.1}),
        "v->v", chain(2), parameters={"sigma": 0.0, "K": [1.0, 0.8]}, integrator="dop853",
        initial={"theta": [math.asin(0.5), math.asin(0.625)], "v": 0.0},
    )  # fmt: skip
    times = {"transient": 200.0, "window": 20.0, "show_progress": False}
    named = {"at rest": "rest"}
    found = basin(alone, samples=300, ranges=REGION, attractors=named, nodes="each", **times)
    assert found.shares.dims == ("perturbed", "attractor")
    assert np.array_equal(found.start[0, :, [0, 2]], found.start[1, :, [1, 3]])
    assert (found.start[0, :, 1] == math.asin(0.625)).all()
    single = basin(PENDULUM, samples=300, ranges=REGION, attractors=named, **times)
    assert np.array_equal(of(found, "at rest", 0), of(single, "at rest"))
    assert share(basin(alone, samples=300, ranges=REGION, attractors=named, nodes=[2], **times), "at rest") == float(
        found.shares.sel(perturbed=2, attractor="at rest")
    )
    assert found.shares.sel(perturbed=2, attractor="at rest") < found.shares.sel(perturbed=1, attractor="at rest")


def test_escape_is_a_share_of_its_own_and_bounded_in_work():
    """What takes a hundred times the steps of the synchronous motion is ended."""
    wide = {"ranges": {"x": (-100.0, 100.0), "z": (-50.0, 50.0)}, "transient": 100.0, "window": 50.0}
    result = basin(ROSSLER, samples=8, show_progress=False, **wide)
    assert share(result, "escaped") >= 0.25
    assert share(result, "other") == 0.0
    assert result.criterion.max_steps < 10**6
    assert share(result, "not finished") == 0.0


def test_a_bound_ends_a_start_and_a_stop_beside_it_keeps_its_share():
    """x' = a x with a > 0 passes 8 after log(8/x)/a; the stop at x_1 = 4 comes first for starts below 4 of the first node."""
    grow = Scene(Field({"x": "x"}), "x->x", chain(2), parameters={"sigma": 0.0}, stop="x_1 - 4")
    settings = {"ranges": {"x": (1.0, 8.5)}, "attractors": {}, "bound": 8.0, "transient": 3.0, "window": 1.0}
    found = basin(grow, samples=50, show_progress=False, **settings)
    x, y = found.start[0].T
    beyond = (x >= 8.0) | (y >= 8.0)
    stops = (x < 4.0) & (y / x < 2.0) & ~beyond
    assert np.array_equal(of(found, "stopped"), stops)
    assert np.array_equal(of(found, "escaped"), ~stops)


def test_a_stop_ends_starts():
    """x'' = -x from a circle of radius above 1/2 meets x = 1/2 within a turn."""
    result = basin(FREE.replace(stop="x_1 - 1/2"), samples=50, tolerance=1e-3, show_progress=False, **SHORT)
    x, v = result.start[0, :, 0], result.start[0, :, 2]
    assert np.array_equal(of(result, "stopped"), np.hypot(x, v) > 0.5)
    assert share(result, "stopped") == (result.status == Status.STOPPED).mean()
    assert result.scene.stop == "x_1 - 1/2"


def test_starts_at_an_unstable_synchronous_state_are_about_to_leave():
    """Starts that are equal stay equal to rounding, although x' = x - x**3 with repulsion 2 sigma > 2 leaves 0 … 1."""
    repelled = WELLS.replace(sigma=-1.5, initial={"x": 0.5})
    found = basin(repelled, x_1=[0.5], x_2=[0.5], transient=5.0, window=1.0, show_progress=False)
    assert found.exponent[0] > 0.5
    assert share(found) == 0.0
    assert interval(found)[1] < 1.0
    assert share(found, "leaving") == 1.0
    assert interval(found, "other") == (0.0, 1.0)


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
    starts = Starts.of(stick, 5, None, None, 0).states[0]
    varied = [name for name, column in zip(stick.equations.state, starts.T, strict=True) if np.ptp(column) > 0.0]
    assert varied == ["x_1", "x_2", "v_1", "v_2"]
    with pytest.raises(ValueError, match="unknown component 'slip'; known: x, v"):
        basin(stick, ranges={"slip": (0, 1)})


def test_a_driven_motion_keeps_its_phase_when_the_transient_is_no_whole_number_of_periods() -> None:
    """Three cycles of Duffing's oscillator from starts on their way: the window at 600 begins within a period of 2π."""
    node = Field({"x": "v", "v": "-0.08*v - x**3 + 0.2*cos(t)"})
    scene = Scene(node, topology=chain(1), time_unit="time", transient=600.0, window=100.0)
    tops = {"small": "maximum(x) < 0.3", "large": "maximum(x) > 1", "double": "maximum(x) > 0.5 and maximum(x) < 0.63"}
    starts = {"x_1": [-0.21, 1.05, -0.67], "v_1": [0.02, 0.77, 0.02]}
    found = basin(scene.replace(zipped=True), attractors=tops, show_progress=False, **starts)
    assert [found.labels[k] for k in found.fate[0]] == ["small", "large", "double"]
