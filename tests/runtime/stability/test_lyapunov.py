"""Lyapunov spectra of networks against published values, exact sums and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from synchain import Field, Scene, exponents, lyapunov_spectrum, periodic_orbit, run
from synchain.graphs import from_matrix, topology
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import PHASE, network_variation, phase_shifted, with_volume
from synchain.models.mechanics.components import Node
from synchain.results import Lyapunov
from synchain.runtime.stability.tangent_frame import TangentFrame

pytestmark = pytest.mark.long

PAIR = topology("chain", 2)
APART = from_matrix([[1, -1], [-1, 1]])
"""A link of weight -1, which drives two oscillators apart: gamma = 2."""


NO_PARTS = (np.zeros(0), np.zeros((0, 0)))
"""No running averages."""


def lone(name: str, **parameters: float) -> Scene:
    return Scene(oscillator=name, coupling=None, parameters=parameters)


@pytest.fixture(scope="module")
def lorenz() -> Lyapunov:
    return lyapunov_spectrum(lone("lorenz"), transient=20, periods=2100)


@pytest.fixture(scope="module")
def rossler() -> Lyapunov:
    return lyapunov_spectrum(lone("rossler", c=5.7), transient=20, periods=300)


def test_the_published_spectrum_of_lorenz(lorenz: Lyapunov) -> None:
    """0.9056, 0, -14.5723, dimension 2.062 (Sprott, Chaos and Time-Series Analysis (Oxford, 2003), app. A)."""
    np.testing.assert_array_less(np.abs(lorenz.exponent - [0.9056, 0.0, -14.5723]), 4 * lorenz.stderr + 1e-3)
    assert lorenz.stderr[0] < 0.01
    assert lorenz.dimension == pytest.approx(2.062, abs=2e-3)
    assert lorenz.resolved.all()


def test_running_averages_end_at_the_exponents(lorenz: Lyapunov) -> None:
    assert lorenz.lengths[-1] == lorenz.time
    assert 32 <= len(lorenz.lengths) <= 64
    np.testing.assert_allclose(lorenz.running[-1], lorenz.exponent, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(lorenz.running.sum(axis=1), -41 / 3, atol=1e-7)
    assert np.ptp(lorenz.running[:, 0]) > 1e-3
    lines = [line for line in lorenz.plot().get_lines() if len(line.get_xdata()) == len(lorenz.lengths)]
    np.testing.assert_array_equal([line.get_ydata() for line in lines], lorenz.running.T)


def test_the_published_spectrum_of_rossler(rossler: Lyapunov) -> None:
    """0.0714, 0, -5.3943 at a = b = 0.2, c = 5.7 (Sprott, same place)."""
    np.testing.assert_array_less(np.abs(rossler.exponent - [0.0714, 0.0, -5.3943]), 4 * rossler.stderr + 1e-3)
    assert rossler.stderr[0] < 0.01


def test_the_sum_is_the_mean_divergence(lorenz: Lyapunov, rossler: Lyapunov) -> None:
    """-10 - 1 - 8/3 at every state of Lorenz; of Rössler the mean along the same orbit."""
    assert lorenz.exponent.sum() == pytest.approx(-41 / 3, abs=1e-7)
    assert rossler.exponent.sum() == pytest.approx(rossler.divergence, abs=1e-7)
    assert abs(rossler.rest) < 1e-7


def test_the_divergence_is_that_of_a_separate_trajectory(rossler: Lyapunov) -> None:
    """a - c + mean of x, from the samples of an ordinary run; its error is at least that of the long average."""
    scene = lone("rossler", c=5.7).replace(
        record=("trajectory",), samples=40_000, transient=200.0, window=4000.0, time_unit="time"
    )
    x = run(scene, reduce=False).trajectory.sel(component="x", node=1).values
    assert 0.2 - 5.7 + x.mean() == pytest.approx(rossler.divergence, abs=6 * rossler.divergence_error)


def test_damping_is_the_sum_of_a_driven_oscillator() -> None:
    """Duffing: divergence -delta everywhere, both exponents -delta/2 on a small periodic motion."""
    result = lyapunov_spectrum(lone("duffing", delta=0.2), transient=60, periods=200)
    assert result.exponent.sum() == pytest.approx(-0.2, abs=1e-7)
    assert result.divergence == pytest.approx(-0.2, abs=1e-10)
    np.testing.assert_allclose(result.exponent, -0.1, atol=4e-3)


def test_blocks_of_a_part_of_a_period_see_the_drive_at_its_phase() -> None:
    """The same orbit in one block a period and in eight: end and divergence agree, and the growth of all directions."""
    spectra = []
    for parts in (1, 8):
        frame = TangentFrame.make(lone("duffing", u=4.0), 2, seed=0)
        frame.parts = parts
        growths, _, _ = frame.advance(np.full(5, parts))
        spectra.append((frame.integrator.state[0], growths, frame.integrator.vectors[0, :, :2]))
    for whole_block, eighths in zip(*spectra, strict=True):
        np.testing.assert_allclose(eighths, whole_block, atol=1e-6)


def test_hamiltonian_exponents_come_in_pairs() -> None:
    """x'' = -x and, at sigma = 1, y'' = -y + 2 y for the difference: 1, 0, 0, -1, sum 0."""
    scene = Scene(oscillator="harmonic", topology=APART, initial={"x": 0.0}, parameters={"sigma": 1.0})
    result = lyapunov_spectrum(scene, transient=20, periods=64)
    np.testing.assert_allclose(result.exponent, [1.0, 0.0, 0.0, -1.0], atol=1e-9)
    np.testing.assert_allclose(result.exponent + result.exponent[::-1], 0.0, atol=1e-9)
    assert result.divergence == 0.0


def test_modes_of_the_synchronous_state_make_up_the_whole_spectrum() -> None:
    """Two Lorenz systems coupled by H = I: every exponent once as it is and once lowered by 2 sigma."""
    scene = Scene(oscillator="lorenz", coupling="x->x, y->y, z->z", topology=PAIR, parameters={"sigma": 1.5})
    result = lyapunov_spectrum(scene, transient=20, periods=64)
    np.testing.assert_allclose(result.exponent[[2, 3, 5]], result.exponent[[0, 1, 4]] - 3.0, atol=0.02)
    assert result.exponent.sum() == pytest.approx(-2 * 41 / 3 - 9, abs=1e-6)
    assert result.exponent[0] == pytest.approx(0.9056, abs=4 * result.stderr[0])


def test_friction_leaves_as_many_exponents_as_oscillators_and_says_what_the_rest_sums_to() -> None:
    """omega = 1.15, sigma = 0.2: the modes alpha = 0 and 0.4 of a periodic motion; velocities die in stick."""
    scene = Scene(topology=PAIR, parameters={"omega": 1.15, "sigma": 0.2})
    result = lyapunov_spectrum(scene, transient=2000, periods=64)  # 0.002 apart: the two part slowly
    expected = exponents(scene, [0.0, 0.4], starts=1).exponent
    np.testing.assert_allclose(result.exponent[:2], np.sort(expected)[::-1], atol=1e-5)
    assert result.resolved.tolist() == [True, True, False, False]
    assert result.exponent[2:].tolist() == [-np.inf, -np.inf]
    assert np.isfinite(result.rest)
    assert -4e4 < result.rest / 2 < -1e3  # part of the time in stick, at -epsilon mu_s (2/pi) kappa = -3.8e4 there
    first = lyapunov_spectrum(scene, periods=64, count=1, precision=1.0)
    assert first.exponent.shape == (1,)
    assert first.exponent[0] == pytest.approx(expected.max(), abs=2e-3)


def test_set_valued_friction_of_ten_oscillators_has_the_exponents_of_its_modes() -> None:
    """All to all, synchronous, in stick once a period: one exponent of the mode alpha = 0, nine of alpha = 10 sigma."""
    scene = Scene(topology=topology("complete", 10), contact="set-valued", parameters={"omega": 1.15, "sigma": 0.02})
    found = lyapunov_spectrum(scene, count=10, transient=100, periods=64, show_progress=False)
    expected = exponents(scene, [0.0, 0.2], starts=1).exponent
    assert expected.max() < 0.0
    np.testing.assert_allclose(found.exponent, np.sort(expected[[0] + [1] * 9])[::-1], atol=2e-3)


def test_the_log_of_a_volume_grows_by_the_divergence_of_the_network() -> None:
    equations = Scene(oscillator="lorenz", coupling="y->y, x->z", topology=topology("star", 4)).equations
    extended = with_volume(equations)
    rates = sp.Add(*extended.rhs()[equations.dimension :])
    trace = sp.Add(*(e for (r, c), e in equations.jacobian().items() if r == c))
    assert sp.simplify(rates - trace) == 0
    assert extended.rhs()[: equations.dimension] == equations.rhs()


def test_a_clock_set_later_shifts_equations_and_matrix() -> None:
    variation = phase_shifted(network_variation(lone("duffing").equations))
    t, omega, u = sp.Symbol("t", real=True), sp.Symbol("omega", real=True), sp.Symbol("u", real=True)
    assert variation.orbit.node.rhs[1].coeff(u) == sp.cos(omega * (t + PHASE))
    assert variation.orbit.parameters[-1] == "phase"
    x, d = sp.symbols("x d", real=True)
    wave = Equations.of_equal_nodes(Node((x,), (sp.cos(omega * t) * x - d * x,), (omega, d)), None, 1)
    assert dict(phase_shifted(network_variation(wave)).matrix) == {(0, 0): sp.cos(omega * (t + PHASE)) - d}


def test_dimension_by_hand() -> None:
    def of(*values: float, components: int = 3) -> float:
        expected = np.array(values)
        zeros = np.zeros(len(expected))
        return Lyapunov(expected, zeros, expected > -np.inf, *NO_PARTS, 0.0, 0.0, 1.0, 1.0, components).dimension

    assert of(1.0, 0.0, -2.0) == 2.5
    assert of(-1.0, -2.0, -3.0) == 0.0
    assert of(1.0, -np.inf, -np.inf) == 1.0
    assert of(1.0, 0.0, -1.0) == 3.0
    assert np.isnan(of(1.0, 0.0))
    few = Lyapunov(np.array([1.0, 0.0]), np.zeros(2), np.ones(2, dtype=bool), *NO_PARTS, 0.0, 0.0, 1.0, 1.0, 3)
    assert dict(few.summary)["Kaplan-Yorke dimension"] == "above 2"


@pytest.mark.parametrize(
    ("exponents", "errors", "dimension", "span"),
    [
        ((-6e-6, -0.5), (4e-4, 1e-3), 1.0, (0.0, 1.0 + 7.94e-4 / 0.498)),
        ((1e-6, -2e-6, -0.5), (1e-4, 1e-4, 1e-3), 2.0 + 1e-6 / 0.5, (0.0, 2.0 + 3.99e-4 / 0.498)),
        ((-2e-3, -0.5), (4e-4, 1e-3), 0.0, (0.0, 0.0)),
        ((0.09, 2e-5, -9.0), (2e-3, 1e-4, 0.1), 2.0 + 0.09002 / 9.0, (2.0 + 0.08582 / 9.2, 2.0 + 0.09422 / 8.8)),
        ((0.2, -0.5), (np.inf, np.inf), 1.4, (0.0, 2.0)),
    ],
)
def test_the_errors_of_exponents_are_those_of_the_dimension(
    exponents: tuple[float, ...], errors: tuple[float, ...], dimension: float, span: tuple[float, float]
) -> None:
    values = np.array(exponents), np.array(errors), np.ones(len(errors), dtype=bool)
    result = Lyapunov(*values, *NO_PARTS, 0.0, 0.0, 1.0, 1.0, len(errors))
    assert result.dimension == pytest.approx(dimension, rel=1e-12)
    assert result.dimension_range == pytest.approx(span, rel=1e-12)
    assert dict(result.summary)["Kaplan-Yorke dimension"].startswith(f"{dimension:.4g}, from {span[0]:.4g} to ")


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="count = 3; expected 1 … 2"):
        lyapunov_spectrum(lone("duffing"), count=3)
    with pytest.raises(ValueError, match="count = 3; expected 1 … 2"):
        lyapunov_spectrum(Scene(contact="set-valued"), count=3)
    with pytest.raises(ValueError, match="found set-valued friction, whose stick makes them zero"):
        with_volume(Scene(contact="set-valued").equations)


UNITS = Field(
    {"x": "10*k*s*(y - (x - c)/s)", "y": "k*((x - c)/s*(28 - z) - y)", "z": "k*((x - c)/s*y - 8*z/3)"},
    parameters={"k": 1.0, "s": 1.0, "c": 0.0},
)
"""Lorenz's system in units of time 1/k and of x, which is s X + c."""


@pytest.mark.parametrize(
    ("k", "s", "c"), [(100.0, 1.0, 0.0), (1e-6, 1.0, 0.0), (1e6, 1.0, 0.0), (1.0, 1e-6, 1e-5), (1.0, 1e6, 0.0)]
)
def test_units_of_time_and_of_a_component_change_nothing(k: float, s: float, c: float) -> None:
    scene = Scene(UNITS, None, initial={"x": s + c, "y": 1.0, "z": 20.0}, parameters={"k": k, "s": s, "c": c})
    result = lyapunov_spectrum(scene, periods=128, transient=20, precision=0.0)
    assert result.resolved.all()
    assert np.all(np.abs(result.exponent / k - [0.9056, 0.0, -14.5723]) < 4 * result.stderr / k + 1e-3)
    assert result.stderr.max() < 0.3 * k
    assert result.exponent.sum() / k == pytest.approx(-41 / 3, abs=1e-6)
    assert result.unit.startswith("mean return time")
    assert result.time * k == pytest.approx(128 * 0.75, rel=0.05)


@pytest.mark.parametrize("rate", ["-x**3 + v/2", "-k*x**3 + v/3"])
def test_an_orbit_without_bound_whose_steps_shrink_ends_in_words(rate: str) -> None:
    node = Field({"x": "v", "v": rate}, parameters={"k": 5.0} if "k" in rate else None, initial={"x": 1.0})
    with pytest.raises(FloatingPointError, match="the state grew without bound"):
        lyapunov_spectrum(Scene(node, None))


def test_an_average_takes_no_more_steps_than_max_steps() -> None:
    with pytest.raises(FloatingPointError, match="used up max_steps before the end"):
        lyapunov_spectrum(lone("duffing").replace(max_steps=2000), periods=5000)


def test_the_absolute_tolerance_of_a_scene_counts() -> None:
    spectra = [
        lyapunov_spectrum(lone("duffing").replace(atol=atol), periods=4, transient=0, rtol=1e-6).exponent[0]
        for atol in (1e-9, 1e-14)
    ]
    assert spectra[0] != spectra[1]


def test_directions_are_those_of_householder_after_each_block() -> None:
    """The same blocks with NumPy's `qr` between them."""
    for scene, count in (
        (lone("lorenz"), 3),
        (lone("lorenz"), 2),
        (Scene("duffing", topology=PAIR, parameters={"sigma": 0.2}), 4),
    ):
        frame, other = (TangentFrame.make(scene, count, seed=0) for _ in range(2))
        growths, _, lost = frame.advance(np.ones(4, dtype=np.int64))
        assert not lost.any()
        for growth in growths:
            before = other.integrator.state[0, -scene.n :].sum()
            rates = other.integrator.advance(other.unit)[0, :count]
            basis, triangle = np.linalg.qr(other.integrator.vectors[0, :, :count])
            other.integrator.vectors[0, :, :count] = basis
            np.testing.assert_allclose(growth[:-1], rates + np.log(np.abs(np.diagonal(triangle))), atol=1e-6)
            assert growth[-1] == pytest.approx(other.integrator.state[0, -scene.n :].sum() - before, abs=1e-6)
        np.testing.assert_allclose(np.abs(frame.integrator.vectors[0, :, :count]), np.abs(basis), atol=1e-5)


@pytest.mark.parametrize(("x", "v", "t"), [(1.0, 1.0, 1.0), (1e-9, 1e3, 1e6), (1e6, 1e-3, 1e-6)])
def test_errors_include_the_unfinished_turn_at_the_end_in_any_units(x: float, v: float, t: float) -> None:
    """The sum of the exponents of van der Pol's equation is the logarithm of the multiplier of its orbit over the period."""
    rates = {"x": f"v*{x / v!r}/{t!r}", "v": f"((1 - (x/{x!r})**2)*v - x*{v / x!r})/{t!r}"}
    scene = Scene(Field(rates), initial={"x": 2.0 * x, "v": 0.0}, transient=50.0 * t)
    result = lyapunov_spectrum(scene)
    orbit = periodic_orbit(
        Scene(Field({"x": "v", "v": "(1 - x**2)*v - x"}), initial={"x": 2.0, "v": 0.0}, transient=50.0)
    )
    exact = np.log(np.abs(np.prod(orbit.multipliers))) / orbit.period / t
    assert abs(result.divergence - exact) < 2.0 * result.divergence_error < 4e-3 / t
    assert np.all(np.abs(result.exponent - [0.0, exact]) < 2.0 * result.stderr)
    assert result.stderr[1] < 2e-3 / t
