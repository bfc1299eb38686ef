"""Master stability functions against closed forms, exact relations and published values."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synchain import Field, Rates, Scene, ends, exponents, lyapunov_spectrum, msf, plane
from synchain.graphs import topology
from synchain.results import Exponents
from synchain.runtime.stability.averages import Batches
from synchain.runtime.stability.interpolation import strength_interpolation
from synchain.runtime.stability.msf import classify

PAIR = topology("chain", 2)
DRIVEN = Field({"x": "v", "v": "-x - 0.1*v + 0.3*cos(t) - 0.2*x**3"}, initial={"x": 0.5, "v": 0.1})


def scene(name: str, coupling: str, **parameters: float) -> Scene:
    return Scene(oscillator=name, coupling=coupling, topology=PAIR, parameters=parameters)


def test_linear_nodes_in_closed_form() -> None:
    """x'' = -x - alpha v: exponent -alpha/2, above alpha = 2 the slower of two real roots."""
    alpha = np.linspace(0.0, 6.0, 61)
    result = exponents(scene("harmonic", "damper"), alpha)
    root = np.sqrt(np.maximum(alpha**2 / 4 - 1, 0.0))
    np.testing.assert_allclose(result.exponent, -alpha / 2 + root, atol=1e-8)
    assert {a.kind for a in result.attractors} == {"linear"}


def test_linear_nodes_may_grow_without_bound() -> None:
    """x'' = -x + v/2 + cos(6t/5), each state coupled to its rate: (1/4) - alpha, whatever the motion and its start."""
    node = Field({"x": "v", "v": "-x + v/2 + cos(6*t/5)"})
    alpha = np.array([0.0, 0.1, 1.0])
    result = exponents(Scene(node, "x->x, v->v", PAIR, initial={"x": 1e12}), alpha, show_progress=False)
    np.testing.assert_allclose(result.exponent, 0.25 - alpha, rtol=0, atol=1e-14)
    assert {a.kind for a in result.attractors} == {"linear"}


@pytest.mark.parametrize(("damping", "size"), [(0.05, 0.4), (0.4, 0.1)])
def test_linear_nodes_with_periodic_coefficients_have_their_multipliers(damping: float, size: float) -> None:
    """Mathieu's equation inside its first tongue and outside, against the monodromy matrix that SciPy integrates."""
    node = Field({"x": "v", "v": "-(1 + size*cos(2*t))*x - c*v + 3*sin(2*t)"}, parameters={"size": size, "c": damping})
    alpha = np.array([0.0, 0.02, 0.3])

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -(1 + size * math.cos(2 * t)) * y[0] - damping * y[1]]

    columns = [solve_ivp(rates, (0, math.pi), e, rtol=1e-12, atol=1e-14).y[:, -1] for e in np.eye(2)]
    largest = np.log(np.abs(np.linalg.eigvals(np.array(columns).T)).max()) / math.pi
    result = exponents(Scene(node, "x->x, v->v", PAIR), alpha, rtol=1e-10, show_progress=False)
    np.testing.assert_allclose(result.exponent, largest - alpha, rtol=0, atol=1e-10)
    assert (largest > 0) == (damping < 0.1)
    assert {a.kind for a in result.attractors} == {"linear"}


def test_a_motion_without_bound_is_refused_with_a_remedy() -> None:
    growing = Scene(Field({"x": "x/2"}), "x->x", PAIR)
    with pytest.raises(FloatingPointError, match=r"grew without bound, .*begin on a bounded motion, such as an equil"):
        lyapunov_spectrum(growing, show_progress=False)
    result = lyapunov_spectrum(growing.replace(initial={"x": 0.0}), periods=50, transient=0, show_progress=False)
    np.testing.assert_allclose(result.exponent, 0.5, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("strengths", "message"), [([0.0, 1e300], "1e+300"), ([-2e16 + 1e16j], "2.23607e+16")])
def test_strengths_that_no_step_resolves_are_named(strengths: list[complex], message: str) -> None:
    """Modes of Duffing's oscillator with frequencies of 1e8 and more: the mode, and not the orbit, is what fails."""
    stiff = scene("duffing", "spring").replace(max_steps=1000)
    with pytest.raises(FloatingPointError, match=re.escape(f"deviations of strengths up to {message} cannot be")):
        exponents(stiff, strengths, starts=1, transient=1, show_progress=False)


def test_a_fixed_point_has_the_eigenvalues_of_its_jacobian() -> None:
    """Lorenz at rest, Rayleigh number below one: z decays by itself, x and y by a 2 x 2 matrix."""
    s = scene("lorenz", "x->x", rayleigh=0.5)
    alpha = np.array([0.0, 0.5, 20.0])
    result = exponents(s, alpha, transient=100, starts=2)
    p, b = s.parameters["prandtl"], s.parameters["b"]
    expected = [max(*np.linalg.eigvals([[-p - a, p], [0.5, -1.0]]).real, -b) for a in alpha]
    np.testing.assert_allclose(result.exponent, expected, atol=1e-8)
    assert {a.kind for a in result.attractors} == {"fixed point"}


def test_a_driven_linear_oscillator_through_its_floquet_multipliers() -> None:
    """Duffing without cubic term: the variational equation of a linear damped oscillator, integrated over a cycle."""
    s = scene("duffing", "spring", beta=1e-9, delta=0.2)
    alpha = np.array([0.0, 0.4, 3.0])
    result = exponents(s, alpha, rtol=1e-9, starts=1, transient=200)
    np.testing.assert_allclose(result.exponent, -0.1, atol=1e-8)
    assert [a.kind for a in result.attractors] == ["periodic"]


def test_coupling_by_the_identity_lowers_every_exponent_by_alpha() -> None:
    alpha = np.linspace(0.0, 4.0, 41)
    result = exponents(scene("lorenz", "x->x, y->y, z->z"), alpha, periods=64, precision=1.0, starts=2)
    np.testing.assert_allclose(result.exponent, result.exponent[0] - alpha, atol=1e-6)
    assert result.exponent[0] > 0.8


def test_interpolated_strengths_agree_with_integrated_ones() -> None:
    s = scene("friction", "spring", omega=1.4)
    many = exponents(s, np.linspace(0.0, 1.2, 301), periods=64, starts=1, transient=20)
    few = exponents(s, many.alpha[::50], periods=64, starts=1, transient=20)
    # the orbits are two realisations of one chaotic motion: equal within their errors, not bit by bit
    assert np.all(np.abs(many.exponent[::50] - few.exponent) < 5 * np.hypot(many.stderr[::50], few.stderr))


def test_an_interpolation_is_as_good_as_its_check_says() -> None:
    def propagators(strengths: np.ndarray) -> np.ndarray:
        root = np.sqrt(1.0 + strengths + 0j)
        found = np.empty((1, len(strengths), 2, 2), dtype=complex)
        found[0, :, 0, 0] = found[0, :, 1, 1] = np.cos(5.5 * root)
        found[0, :, 0, 1], found[0, :, 1, 0] = np.sin(5.5 * root) / root, -root * np.sin(5.5 * root)
        return found if np.iscomplexobj(strengths) else found.real

    square = (np.linspace(0.0, 4.0, 40)[:, None] + 1j * np.linspace(0.0, 3.0, 40)).reshape(-1)
    for strengths in (np.linspace(0.0, 30.0, 500), square):
        errors = []
        for nodes, parts in ((6, 1), (10, 1), (20, 1), (40, 1)):
            interpolation = strength_interpolation(strengths, nodes, parts)
            assert not interpolation.is_exact
            worst, seen = 0.0, 0.0
            for panel in interpolation.panels:
                of = propagators(panel.points)[0]
                for x, weights in ((strengths[panel.rows], panel.weights), (panel.extras, panel.checks)):
                    exact = propagators(x)[0]
                    gaps = np.abs(np.einsum("mk,kpq->mpq", weights, of) - exact).max(axis=(1, 2))
                    error = (gaps / np.abs(exact).max(axis=(1, 2))).max()
                    worst, seen = (max(worst, error), seen) if weights is panel.weights else (worst, max(seen, error))
            errors.append(worst)
            assert worst < 30 * seen + 1e-12
        assert errors[0] > 1e-3
        assert errors[-1] < 1e-6


@pytest.mark.parametrize("shift", [0.0, 0.0003, 0.0007])
@pytest.mark.parametrize(
    ("function", "zero", "power"),
    [
        (lambda x: np.sqrt(2.0 - x) - 1.0, 1.0, 2),
        (lambda x: np.exp(x) - 3.0, math.log(3.0), 2),
        (lambda x: np.where(x < 0.9995, 0.1 * (x - 0.9996), 3.0 * (x - 0.9995) - 1e-5), 0.9995 + 1e-5 / 3, 1),
    ],
    ids=["root", "exp", "kink"],
)
def test_the_error_of_a_zero_covers_what_lies_between_two_strengths(function, zero, power, shift) -> None:
    for gap, uneven in ((0.002, False), (0.01, False), (0.01, True)):
        alpha = np.arange(0.5 + shift, 1.5, gap)
        if uneven:  # as msf joins the strengths that were asked for and those of its fine grid
            alpha = np.union1d(alpha, np.nextafter(alpha[::3], 9.0))
        still = np.zeros(len(alpha))
        line = Exponents(alpha, function(alpha), still, 1.0, 1, function(alpha)[None])
        ((end, error),) = [end for pair in line.ranges for end in pair if end[0] not in (alpha[0], alpha[-1])]
        assert abs(end - zero) <= error + 1e-15
        assert error <= gap**power


def test_a_zero_without_neighbours_lies_anywhere_between_two_strengths() -> None:
    alpha, exponent = np.array([0.0, 1.0]), np.array([-1.0, 3.0])
    (((_, none), (end, error)),) = Exponents(alpha, exponent, np.zeros(2), 1.0, 1, exponent[None]).ranges
    assert (none, end, error) == (0.0, 0.25, 0.75)
    exponent = np.array([0.0, -1.0])
    assert Exponents(alpha, exponent, np.zeros(2), 1.0, 1, exponent[None]).ranges == (((0.0, 0.0), (1.0, 0.0)),)


@pytest.mark.parametrize(("error", "begins"), [(1e-7, []), (1e-9, [0.0])])
def test_an_exponent_that_is_zero_to_its_error_begins_no_interval(error: float, begins: list[float]) -> None:
    """That of a limit cycle at strength 0."""
    alpha, exponent = np.linspace(0, 3, 4), np.array([-6e-9, 0.2, -0.1, -0.3])
    intervals = Exponents(alpha, exponent, np.full(4, error), 1.0, 1, exponent[None]).intervals
    assert [low for low, _ in intervals] == [*begins, pytest.approx(1 + 2 / 3)]
    rounded = np.array([-2e-12, 0.2, -0.1, -0.3])
    assert len(Exponents(alpha, rounded, np.full(4, 1e-13), 1.0, 1, rounded[None]).intervals) == 1
    stable = np.array([-6e-9, -0.2, -0.1, -0.3])
    assert Exponents(alpha, stable, np.full(4, error), 1.0, 1, stable[None]).intervals == ((0.0, 3.0),)


@pytest.mark.long
def test_zeros_of_the_rossler_function() -> None:
    """a = b = 0.2, c = 9, x -> x: 0.1863(6) and 4.6131(7) by classical Runge-Kutta steps of 0.004, averages over 2e5."""
    result = msf(scene("rossler", "x->x"), np.linspace(0.0, 6.0, 61), periods=400, precision=5e-3, starts=4)
    ((low, high),) = result.intervals
    ((low_error, high_error),) = result.uncertainties
    assert abs(low - 0.1863) < 4 * low_error < 0.06
    assert abs(high - 4.6131) < 4 * high_error < 0.08
    assert result.kind == "bounded interval"


def test_published_zero_of_the_lorenz_function() -> None:
    """10, 28, 2, x -> x: one zero, at 7.3 (same source), a half-line above it."""
    result = msf(scene("lorenz", "x->x", b=2.0), np.linspace(0.0, 20.0, 41), periods=1000, precision=5e-3, starts=4)
    ((low, high),) = result.intervals
    assert abs(low - 7.3) < 4 * result.uncertainties[0][0] < 0.5
    assert high == 20.0
    assert result.kind == "half-line"


def test_the_friction_oscillator_at_the_published_end() -> None:
    """omega = 1.15: two oscillators synchronise up to sigma = 0.233, alpha = 0.466 (Marszal et al. (2016), fig. 4)."""
    result = msf(scene("friction", "spring", omega=1.15), np.linspace(0.0, 1.0, 11), starts=2)
    ((low, high),) = result.intervals
    assert low == 0.0
    assert abs(high - 0.466) < 0.002
    assert result.attractors == ("periodic, 2 drive periods",) * 2
    assert result.kind == "bounded interval"


def test_the_plane_agrees_with_the_line_and_is_symmetric() -> None:
    s = scene("friction", "spring", omega=1.15)
    alpha = np.array([0.1, 0.3, 0.6])
    table = plane(s, alpha, [-0.2, 0.0, 0.2], starts=1)
    np.testing.assert_array_equal(table.exponent[:, 0], table.exponent[:, 2])
    np.testing.assert_allclose(table.exponent[:, 1], exponents(s, alpha, starts=1).exponent, atol=2e-6)


def test_complex_strengths_of_linear_nodes() -> None:
    """z^2 = -1 - alpha - i beta: the exponent is the larger real part of z."""
    table = plane(scene("harmonic", "spring"), [0.0, 0.5], [0.0, 0.4, 2.0])
    expected = np.abs(np.sqrt(-1.0 - np.array([0.0, 0.5])[:, None] - 1j * np.array([0.0, 0.4, 2.0])).real)
    np.testing.assert_allclose(table.exponent, expected, atol=1e-12)
    assert table.contours == ()


def test_the_error_bar_covers_correlated_noise() -> None:
    """Blocks of a slow autoregressive process, whose mean is 0: the error must not be that of white noise."""
    random = np.random.default_rng(1)
    hits, ratio = 0, []
    for _ in range(60):
        batches, value = Batches(1.0), 0.0
        for _ in range(4096):
            value = 0.9 * value + random.normal()
            batches.add(np.array([[value]]))
        hits += abs(batches.mean()[0, 0]) < 2 * batches.error()[0]
        ratio.append(batches.error()[0] / (10.0 / 64.0))  # exact: 1/(1 - 0.9)/sqrt(4096)
    assert hits >= 54
    assert 0.9 < np.mean(ratio) < 1.3


def test_the_average_stops_when_it_is_precise_and_not_before() -> None:
    s = scene("friction", "spring", omega=1.4)
    quick = exponents(s, [0.2, 0.3], precision=0.05, starts=2, transient=50)
    slow = exponents(s, [0.2, 0.3], precision=0.004, starts=2, transient=50)
    assert quick.stderr.max() <= 0.05
    assert slow.stderr.max() <= 0.004
    assert slow.time > 2 * quick.time


def test_threads_do_not_change_a_bit() -> None:
    s = scene("friction", "spring", omega=1.55)
    one, two = (exponents(s, [0.1, 0.4], periods=64, transient=10, starts=3, workers=w) for w in (1, 2))
    np.testing.assert_array_equal(one.by_start, two.by_start)


@pytest.mark.parametrize(
    ("intervals", "kind"),
    [
        ([], "never stable"),
        ([(0.0, 1.0)], "stable everywhere"),
        ([(0.3, 1.0)], "half-line"),
        ([(0.0, 0.5)], "bounded interval"),
        ([(0.1, 0.5)], "bounded interval"),
        ([(0.1, 0.2), (0.4, 1.0)], "several intervals"),
    ],
)
def test_classes(intervals: list[tuple[float, float]], kind: str) -> None:
    assert classify(intervals, 1.0) == kind


def test_a_grid_that_begins_inside_a_stable_range_shows_no_zero() -> None:
    assert classify([(0.3, 1.0)], 1.0, 0.3) == "stable everywhere"


@pytest.mark.parametrize(("force", "kind"), [("x**3 - x", "aperiodic"), ("x**3 + x", "periodic")])
def test_a_large_constant_beside_a_motion_does_not_hide_it(force: str, kind: str) -> None:
    node = Field({"x": "v", "v": f"-({force}) - 0.15*v + 0.3*cos(t)", "z": "Z - z"}, parameters={"Z": 1.0})
    scenes = (Scene(node, "x->v", PAIR, initial={"x": 0.5, "z": z}, parameters={"Z": z}) for z in (1.0, 1e8))
    results = [exponents(each, [0.0], starts=1, transient=50, periods=50) for each in scenes]
    assert [a.kind for each in results for a in each.attractors] == [kind] * 2
    assert results[0].exponent == pytest.approx(results[1].exponent, abs=1e-6)


def test_two_fixed_points_with_small_exponents_are_not_averaged() -> None:
    """x = 1 has the exponent -6e-5, x = -1 has 2e-5."""
    node = Field({"x": "x - x**3", "z": "-2e-5*z*(1 + 2*x)"}, initial={"x": 0.05, "z": 0.0})
    result = exponents(Scene(node, "x->x", PAIR), [0.0, 0.5], transient=20, rng=3)
    assert {a.kind for a in result.attractors} == {"fixed point"}
    assert sorted(set(result.by_start[:, 0].round(9))) == [-6e-5, 2e-5]
    assert len(result.groups) == 2
    assert abs(result.exponent[0]) == pytest.approx(6e-5 if result.exponent[0] < 0 else 2e-5)


def test_two_periodic_attractors_are_not_averaged() -> None:
    """omega = 1.07: two motions of period two, one transversally stable at alpha = 0.1, the other not."""
    result = exponents(scene("friction", "spring", omega=1.07), [0.1], starts=8)
    assert len(result.groups) > 1
    for rows in result.groups:
        assert np.ptp(result.by_start[list(rows)]) < 1e-3
    first = next(rows for rows in result.groups if 0 in rows)
    assert result.exponent[0] == result.by_start[list(first)].mean()
    assert np.ptp(result.by_start) > 0.3


def test_what_is_refused() -> None:
    s = scene("friction", "spring")
    with pytest.raises(ValueError, match="alpha: found nan; expected finite numbers"):
        exponents(s, [0.1, np.nan])
    with pytest.raises(ValueError, match="alpha: found numbers that do not increase"):
        msf(s, [0.3, 0.1])
    with pytest.raises(ValueError, match="beta: found numbers that do not increase"):
        plane(s, [0.0, 0.1], [0.2, 0.1])
    with pytest.raises(ValueError, match="starts = 0; expected at least 1"):
        exponents(s, [0.1], starts=0)
    with pytest.raises(ValueError, match="coupling: found none"):
        exponents(Scene(coupling=None), [0.1])


@pytest.mark.parametrize(
    ("strengths", "message"),
    [
        ([0.0, np.nan, 1.0], "found nan; expected finite numbers"),
        ([[0.0, 1.0]], r"found an array of shape \(1, 2\); expected a row"),
        ("a", "found 'a'; expected real numbers"),
        (0.5, "at least 2 numbers"),
    ],
)
def test_a_line_of_strengths_that_is_none_is_named(strengths: object, message: str) -> None:
    with pytest.raises(ValueError, match=f"alpha: .*{message}"):
        msf(scene("harmonic", "spring"), strengths)  # type: ignore[arg-type]


@pytest.mark.parametrize("function", [msf, plane])
def test_functions_of_strength_take_the_keywords_of_exponents(function: Callable[..., object]) -> None:
    def keywords(of: Callable[..., object]) -> list[tuple[str, object]]:
        parameters = inspect.signature(of).parameters.values()
        return [(p.name, p.default) for p in parameters if p.kind in (p.KEYWORD_ONLY, p.VAR_KEYWORD)]

    assert keywords(function) == keywords(exponents)


@pytest.mark.parametrize(
    ("keywords", "strengths"),
    [
        (
            {"oscillator": Field({"x": "x - x**3 + 0.2*cos(w*t)"}, parameters={"w": 0.01}), "coupling": "x->x"},
            [0.0, 2.0, -4.0],
        ),
        ({"oscillator": "duffing", "coupling": "x->x, v->v"}, [0.0, 120.0, -120.0]),
    ],
    ids=["slow drive", "large strengths"],
)
def test_deviations_may_grow_and_decay_beyond_the_range_of_numbers(
    keywords: dict[str, object], strengths: list[float]
) -> None:
    """All components are coupled alike, so that a mode's exponent is that of the orbit less the strength."""
    result = exponents(
        Scene(**keywords, topology=topology("chain", 2), initial={"x": 1.0}, transient=5), strengths, starts=1
    )
    assert [a.kind for a in result.attractors] == ["periodic"]
    np.testing.assert_allclose(result.exponent - result.exponent[0], np.negative(strengths), rtol=0, atol=2e-5)


def test_draws_of_a_scene_are_refused() -> None:
    drawn = scene("harmonic", "damper").replace(realisations=3, draws={"x": "uniform(0, 1)"})
    with pytest.raises(ValueError, match="msf: found draws of x; expected a scene without them"):
        msf(drawn, [0.0, 1.0])


def test_windows_of_complex_eigenvalues_are_said_to_be_unknown() -> None:
    """Not "none": a line of real strengths says nothing about them."""
    result = msf(scene("harmonic", "damper").replace(topology=topology("one_way_ring", 3)), [0.0, 1.0])
    assert dict(result.summary)["sigma"] == "not known: one_way_ring(3) has complex eigenvalues, which need `plane`"
    assert result.data.sizes["window_number"] == 0


def test_ranges_that_end_with_the_grid_are_marked() -> None:
    result = msf(scene("harmonic", "damper"), [0.0, 1.0])
    said = dict(result.summary)
    assert (said["negative for alpha"], said["sigma"]) == ("0.0000 … 1.0000...", "0.0000 … 0.5000...")
    assert said["..."] == "the grid of alpha ends here, the range may go on"
    assert dict(result.fine.summary)["negative for alpha"] == "0.0000 … 1.0000..."
    alpha = np.linspace(0.0, 1.0, 5)
    inside = replace(
        result, alpha=alpha, fine=replace(result.fine, alpha=alpha, exponent=alpha - 0.6, stderr=0 * alpha)
    )
    assert "..." not in "".join(dict(inside.summary).values())


def test_steps_follow_the_errors_of_all_modes() -> None:
    """One that grows between one that does not and many that shrink fast: the largest and the smallest strengths are no measure."""
    alpha = [0.0] * 8 + [-200.0] + [5000.0] * 15
    result = exponents(scene("duffing", "x->x"), alpha, rtol=1e-3, periods=64, transient=20, starts=1)
    assert result.exponent[8] == pytest.approx(200.0, abs=0.1)


def test_deviations_that_are_no_numbers_are_refused() -> None:
    """exp(1500 x) overflows where x is 0.48: the strength times its slope is infinite, and NaN beside others."""
    i, j, weight = ends(DRIVEN)
    k = sp.Symbol("k")
    link = Rates({i.v: weight * k * (sp.exp(1500 * j.x) - sp.exp(1500 * i.x))}, {k: 1e-300})
    pair = Scene(DRIVEN, link, PAIR, integrator="rodas5p", record=())
    with pytest.raises(FloatingPointError, match="cannot be integrated"):
        exponents(pair, [0.0, 1.0], periods=16, transient=0, starts=1)


def test_a_mode_that_grows_too_fast_for_its_steps_is_no_slow_one() -> None:
    """Its growth was damped in the first step, and the exponent was that of the other directions, 0.2."""
    with pytest.raises(FloatingPointError, match="cannot be integrated"):
        exponents(scene("rossler", "x->x").replace(max_steps=2000), [-1e12], transient=20, periods=16, starts=1)
