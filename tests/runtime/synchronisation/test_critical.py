"""Zeros of the largest exponent: against closed forms, an independent solution, simulation, and published numbers."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

from synchain import Field, Rates, Scene, critical, run
from synchain.graphs import chain, ring
from synchain.runtime.stability.averages import Averaging
from synchain.runtime.stability.largest_exponents import largest_exponents
from synchain.runtime.stability.motion import Spread
from synchain.runtime.stability.transversal_modes import shared_orbits
from synchain.runtime.support.execution import Execution
from synchain.runtime.synchronisation.critical import Evaluation, _zero

WINDOW = Field({"x": "x + y", "y": "-1.5*x + 0.5*y"})
"""With links x -> x a mode has the matrix [[1 - alpha, 1], [-1.5, 0.5]]: it decays between alpha = 1.5 and 4."""

BRUSSELATOR = Scene(
    Field(
        {"x": "A + x**2*y - (B + 1)*x", "y": "B*x - x**2*y"},
        parameters={"A": 2, "B": 2.5},
        initial={"x": 2.1, "y": 1.2},
    ),
    Rates({"x": "sigma*d*W*(x_j - x_i)", "y": "sigma*W*(y_j - y_i)"}, {"sigma": 1, "d": 0.1}),
    ring(6),
    time_unit="time",
)


def turing(lam, sigma):
    """Return B at which the determinant of a mode of the Brusselators vanishes at the fixed point x = A, y = B/A."""
    return (1 + 0.1 * sigma * lam) * (4 + lam * sigma) / (lam * sigma)


def test_both_ends_of_a_linear_window_are_exact():
    pair = Scene(WINDOW, "x->x", chain(2))
    low, high = critical(pair, "sigma", (0.1, 1)), critical(pair, "sigma", (1, 4))
    np.testing.assert_allclose([low.value, high.value], [0.75, 2.0], rtol=1e-14)
    assert (low.slope < 0.0, high.slope > 0.0) == (True, True)
    assert low.error < 1e-14
    assert low.modes == ("-2",)
    assert "sigma = 0.7500, stable above; lost by gamma = -2; motion linear" in str(low)


def test_a_fixed_point_loses_stability_at_the_turing_point():
    """Six Brusselators: the mode of eigenvalue -4 first, at B = 14/5."""
    result = critical(BRUSSELATOR, "B", (2.2, 3.2))
    assert float(result.value) == pytest.approx(2.8, abs=1e-13)
    assert (result.modes, result.motions, result.remarks) == (("-4",), ("fixed point",), ("",))


def test_simulation_on_both_sides_of_the_turing_point():
    scene = BRUSSELATOR.replace(initial={"x": [2.1, 2.0, 2.05, 2.0, 2.1, 2.0], "y": 1.4}, transient=0, window=300)
    states = run(scene, B=[2.75, 2.85], show_progress=False).end.sel(component="x")
    assert (np.ptp(states.values, axis=1) > 0.1).tolist() == [False, True]


def test_a_curve_changes_to_the_mode_that_is_lost_first():
    sigma = [0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 4.0]
    result = critical(BRUSSELATOR, "B", (1.5, 4.5), sigma=sigma)
    expected = np.array([[turing(lam, s) for s in sigma] for lam in (1, 3, 4)])
    np.testing.assert_allclose(result.value, expected.min(axis=0), rtol=1e-12)
    assert result.modes == tuple(f"-{(1, 3, 4)[k]}" for k in expected.argmin(axis=0))
    assert result.data["value"].dims == ("sigma",)
    assert "sigma = 0.6" in str(result)
    # the secant needs fewer evaluations than a search of the whole range for each value
    assert len(result.evaluations) < 10 * len(sigma)


def test_a_periodic_orbit_has_an_exact_multiplier():
    """Branch point of two Duffing oscillators, from a Fourier series of their orbit and a bordered Newton iteration."""
    node = Field({"x": "v", "v": "-0.1*v - x - x**3 + 0.3*cos(w*t)"}, parameters={"w": 1.326})
    start = {"x": -0.54435631, "v": 0.19189277}  # on the branch of small motion
    scene = Scene(node, "x->v", chain(2), parameters={"sigma": 0.05}, initial=start)
    for rtol in (1e-6, 1e-10):
        result = critical(scene, "w", (1.3248, 1.327), starts=1, rtol=rtol)
        assert abs(result.value - 1.3252959488) < max(3 * result.error, 1e-10)
        assert result.error < 0.1 * rtol
    assert result.motions == ("periodic",)


def test_the_friction_pair_agrees_with_the_windows_of_the_function():
    result = critical(Scene(topology=chain(2)), "sigma", (0.1, 0.4), omega=1.15, starts=1)
    assert float(result.value) == pytest.approx(0.23264, abs=2e-5)  # docs/thresholds.md, from `msf`
    assert float(result.error) < 1e-6


def test_chaotic_motion_has_an_error_that_holds_the_published_zero():
    """Lorenz x -> x: alpha = 7.3 (Huang et al., Phys. Rev. E 80, 036204 (2009))."""
    node = Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 2*z"}, initial={"x": 1})
    scene = Scene(node, "x->x", chain(2), time_unit="time")
    result = critical(scene, "sigma", (2, 6), precision=1e-2, periods=1000)
    assert abs(result.value - 3.65) < 3 * result.error < 0.3
    assert result.error > 5e-3


@pytest.mark.parametrize("seed", range(20))
def test_averages_that_scatter_give_errors_that_hold(seed):
    """Exponents 0.3 - x + noise of known size: the zero lies within four errors, and errors are no larger than needed."""
    random = np.random.default_rng(seed)

    def measure(x):
        return Evaluation(x, 0.3 - x + 0.2 * (x - 0.3) ** 2 + random.normal(0.0, 1e-3), 1e-3, 0, "aperiodic")

    zero = _zero(measure, measure(0.0), measure(1.0))
    assert abs(zero.value - 0.3) < 4 * zero.error
    assert zero.error < 4e-3
    assert zero.slope == pytest.approx(-1.0, abs=0.3)


def test_a_jump_of_the_exponent_is_no_zero():
    def measure(x):
        return Evaluation(x, -0.2 if x < np.pi / 10 else 0.1, 1e-6, 0, "periodic")

    zero = _zero(measure, measure(0.0), measure(1.0))
    assert abs(zero.value - np.pi / 10) <= zero.error + 1e-15 < 1e-12
    assert zero.remark.startswith("the exponent jumps from -0.2000000 ± 1.0e-06 to 0.1000000")


ONE, OTHER = Spread(np.array([0.0]), np.array([1.0])), Spread(np.array([2.0]), np.array([1.0]))
"""Two motions with the same extent about other means."""


@pytest.mark.parametrize("seed", range(20))
def test_a_zero_where_the_motion_changes_may_lie_anywhere_in_the_change(seed):
    """Exponents 0.1 and -0.1 of two motions, and averages over both within 1e-3 of pi/10."""
    random = np.random.default_rng(seed)

    def measure(x):
        mixed = 1e-3 * random.uniform(-1.0, 1.0)
        return Evaluation(
            x,
            100.0 * np.clip(np.pi / 10 + mixed - x, -1e-3, 1e-3),
            2e-3,
            0,
            "aperiodic",
            ONE if x < np.pi / 10 else OTHER,
        )

    zero = _zero(measure, measure(0.0), measure(1.0))
    assert abs(zero.value - np.pi / 10) <= 2e-3 <= zero.error <= 0.02
    assert zero.remark.startswith(("the synchronous motion changes between 0.31", "the exponent jumps from "))


def test_another_motion_at_an_end_of_the_range_is_said():
    def measure(x):
        return Evaluation(x, 0.3 - x, 1e-9, 0, "periodic", ONE if x < 0.6 else OTHER)

    zero = _zero(measure, measure(0.0), measure(1.0))
    assert zero.error < 1e-8
    assert zero.remark == "the synchronous motion differs at 1: if it jumps, other starts may pass zero elsewhere"


def test_motions_in_the_two_wells_of_a_spring_differ():
    """x'' = x - x**3 - v/4 + 0.1 cos t about -1 and 1; sigma changes no motion, the drive's strength hardly."""
    node = Field({"x": "v", "v": "x - x**3 - 0.25*v + f*cos(t)"}, parameters={"f": 0.1})
    spreads = []
    for x, f in ((-1.0, 0.1), (1.0, 0.1), (1.0, 0.11)):
        scene = Scene(node, "v->v", chain(2), initial={"x": x, "v": 0.0}, parameters={"f": f, "sigma": 0.1}, rtol=1e-6)
        (orbit,) = shared_orbits(scene, {"sigma": np.array([0.1])})
        averaging = Averaging(1e-3, 128, 100, 0, Execution(1, show_progress=False))
        spreads.append(largest_exponents(scene, [orbit], 1, averaging).spreads[0])
    left, right, stronger = spreads
    assert left.mean[0] < 0.0 < right.mean[0]
    assert (bool(left.like(right)), bool(right.like(stronger))) == (False, True)


def test_an_infinite_exponent_is_bisected():
    def measure(x):
        return Evaluation(x, -np.inf if x < 0.2 else x - 0.4, 1e-9, 0, "periodic")

    assert _zero(measure, measure(0.0), measure(1.0)).value == pytest.approx(0.4, abs=1e-8)


def test_a_curve_that_leaves_the_range_has_no_value_there():
    node = Field({"x": "a*x"}, parameters={"a": 1.0})
    result = critical(Scene(node, "x->x", chain(3)), "sigma", (0.4, 2.2), a=[0.5, 1, 2, 2.5, 3])
    np.testing.assert_allclose(result.value, [0.5, 1, 2, np.nan, np.nan], rtol=1e-12)
    assert result.remarks[3] == "no zero in the range"
    assert "a = 2.5      no zero in the range" in str(result)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"name": "sigma", "between": (1.6, 1.9)}, r"largest exponents -0\.\d+ at 1\.6 and .*expected different signs"),
        ({"name": "sigma", "between": (1, 2, 3)}, "found 3 values of between"),
        ({"name": "sigma", "between": (0.1, 1), "sigma": 2.0}, "found a value of 'sigma' besides between"),
        ({"name": "nothing", "between": (0.1, 1)}, "nothing"),
    ],
)
def test_wrong_calls_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        critical(Scene(WINDOW, "x->x", chain(2)), **options)


def test_a_lone_oscillator_and_two_further_parameters_are_refused():
    with pytest.raises(ValueError, match="expected a network, whose modes have exponents"):
        critical(Scene(WINDOW), "sigma", (0.1, 1))
    with pytest.raises(ValueError, match="rows of values of A, d; expected at most one second parameter"):
        critical(BRUSSELATOR, "B", (2, 3), A=[1, 2], d=[0.1, 0.2])


def test_plots_show_evaluations_or_the_curve():
    node = Field({"x": "a*x"}, parameters={"a": 1.0})
    scene = Scene(node, "x->x", chain(3))
    _, axes = plt.subplots()
    assert critical(scene, "sigma", (0.4, 2.2)).plot(axes).get_xlabel() == r"$\sigma$"
    _, axes = plt.subplots()
    curve = critical(scene, "sigma", (0.4, 2.2), a=[0.5, 1])
    curve.plot(axes)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$a$", r"$\sigma$")
    plt.close("all")
