"""The unit of time of undriven motion: its mean return time, whatever its form, its unit and the start."""

from __future__ import annotations

import numpy as np
import pytest

from synchain import Field, Rates, Scene, equilibrium, exponents, lyapunov_spectrum
from synchain.graphs import chain, from_edges
from synchain.runtime.stability.orbits import OrbitProblem

ROSSLER = Field(
    {"x": "k*(-y - z)", "y": "k*(x + a*y)", "z": "k*(b + z*(x - c))"},
    parameters={"a": 0.2, "b": 0.2, "c": 5.7, "k": 1.0},
)
LORENZ = Field({"x": "k*10*(y - x)", "y": "k*(x*(28 - z) - y)", "z": "k*(x*y - 8*z/3)"}, parameters={"k": 1.0})
NEURON = Field(
    {"x": "k*(y - s**-2*x**3 + 3*x**2/s - z + i*s)", "y": "k*(s - 5*x**2/s - y)", "z": "k*0.006*(4*(x + 1.6*s) - z)"},
    parameters={"i": 3.2, "s": 1.0, "k": 1.0},
)
"""Hindmarsh & Rose, Proc. R. Soc. Lond. B 221, 87 (1984), in units of s."""


def unit(node: Field, start: tuple[float, ...], **parameters: float) -> float:
    initial = dict(zip("xyz" if len(start) == 3 else "xv", start, strict=True))
    scene = Scene(node, None, initial=initial, parameters=parameters)
    return OrbitProblem.of_modes(scene, np.zeros(1), np.array([start]), 1).unit


@pytest.mark.parametrize("start", [(1.0, 1.0, 0.1), (3.0, -2.0, 0.5), (0.1, 0.0, 0.0)])
@pytest.mark.parametrize(("c", "mean"), [(5.7, 5.856), (9.0, 5.790)])
def test_small_loops_beside_large_ones_are_turns(c: float, mean: float, start: tuple[float, ...]) -> None:
    """Means over 3000 units by SciPy; loops at c = 9 are as small as 2 % of the extent, and steps from one to the next miss some."""
    assert unit(ROSSLER, start, c=c) == pytest.approx(mean, rel=0.06)


@pytest.mark.parametrize("k", [1e-6, 1.0, 1e6])
def test_loops_around_two_points_are_turns(k: float) -> None:
    assert k * unit(LORENZ, (1.0, 1.0, 20.0), k=k) == pytest.approx(0.755, rel=0.05)


@pytest.mark.parametrize(("i", "mean"), [(1.5, 73.7), (3.2, 33.7)])
def test_bursts_of_a_neuron_are_turns_in_any_unit(i: float, mean: float) -> None:
    """Mean times between spikes over 5000 units by SciPy; a dozen spikes fluctuate."""
    plain = unit(NEURON, (-1.0, 0.1, 3.0), i=i)
    assert plain == pytest.approx(mean, rel=0.25)
    for s, k in ((1.0, 1e-6), (1e-3, 1e6), (1e4, 1.0)):
        assert k * unit(NEURON, (-s, 0.1 * s, 3.0 * s), i=i, s=s, k=k) == pytest.approx(plain, rel=1e-3)


@pytest.mark.filterwarnings("ignore:coupling")
@pytest.mark.parametrize("k", [1e-6, 1.0, 1e6])
def test_locked_phases_that_turn_evenly_are_at_rest(k: float) -> None:
    """Their phases never return, and their rates are constant: the slowest one of the deviations is the unit."""
    graph = from_edges(
        [("a", "b", 0.5), ("b", "c", 1.25), ("c", "a", 2), ("a", "d", 0.3), ("d", "c", 0.7)], directed=True
    )
    phase = Field({"th": "om"}, parameters={"om": 0.0})
    link = Rates({"th": "K*W*sin(th_j - th_i - lag)"}, {"K": 2, "lag": 0.3})
    scene = Scene(
        phase, link, graph, initial={"th": [0.0, 1.0, 2.0, -1.0]}, record=(),
        parameters={"om": [0.0, 0.1 * k, -0.2 * k, 0.3 * k], "K": 2.0 * k},
    )  # fmt: skip
    expected = equilibrium(scene).eigenvalues.real
    result = lyapunov_spectrum(scene, periods=50)
    np.testing.assert_allclose(result.exponent / k, expected / k, atol=2e-3)
    assert "turn of the slowest rate" in str(result)


@pytest.mark.parametrize("z", [1e-6, 1e-9, -1e-9, 1e-12])
def test_a_start_just_beside_a_switch_has_the_turns_of_the_motion(z: float) -> None:
    """Relay feedback of 1/(s + 1)**3: half a period is 1.839875335432399, by matrix exponentials in 40 digits."""
    relay = Field({"x": "-sign(z) - x", "y": "x - y", "z": "y - z"}, contact="set-valued")
    start = np.array([[0.7258679257978837, 0.2906309222293034, z, 1.0]])
    assert OrbitProblem.of_modes(Scene(relay, None), np.zeros(1), start, 1).unit == pytest.approx(
        2 * 1.839875335432399, rel=2e-3
    )


@pytest.mark.parametrize("y", [1e-9, 1e-12])
def test_a_small_component_is_no_drift(y: float) -> None:
    """Rates hardly change in the first steps, which are short compared with the time in which the small component grows."""
    assert unit(LORENZ, (10.0, y, 20.0)) == pytest.approx(0.755, rel=0.1)


@pytest.mark.parametrize("far", [1e3, 1e4, 1e6])
def test_turns_of_a_fast_approach_are_not_the_unit_of_time(far: float) -> None:
    """From x = 1e4 Lorenz's system turns 1000 times faster than on its attractor, while x decays."""
    lorenz = Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 8*z/3"})
    scene = Scene(lorenz, "x->x", chain(2), initial={"x": far, "y": 0, "z": 0}, time_unit="time")
    result = exponents(scene, [0.0], starts=1, periods=300, show_progress=False)
    assert float(result.unit.split()[3]) == pytest.approx(0.7, abs=0.15)
    assert result.exponent.item() == pytest.approx(0.906, abs=0.1)


def test_a_slow_manifold_is_no_even_drift() -> None:
    """From x = 100 van der Pol's oscillator creeps for 5000 units, while v follows x; its period is 6.66328685932313."""
    oscillator = Field({"x": "v", "v": "(1 - x**2)*v - x"})
    assert unit(oscillator, (100.0, 0.0)) == pytest.approx(6.66328685932313, rel=2e-3)


def test_a_free_spring_that_drifts_has_the_turns_of_its_spring() -> None:
    """Both ends of the spring move one way for ever, and no rate depends on where they are."""
    pair = Field({"x": "u", "u": "y - x", "y": "w", "w": "x - y"})
    scene = Scene(pair, None, initial={"x": 0.0, "u": 1.2, "y": 0.5, "w": 1.0})
    found = lyapunov_spectrum(scene, periods=20, transient=10)
    assert float(found.unit.split()[3]) == pytest.approx(2**0.5 * np.pi, rel=1e-2)


@pytest.mark.filterwarnings("error")
def test_the_turns_of_an_amplitude_that_decays_slowly_are_those_of_its_end() -> None:
    """From x = 1000 a hard spring turns a thousand times faster than where its damping takes it."""
    spring = Field({"x": "v", "v": "-x**3 - x - 0.01*v"}, initial={"x": 1e3, "v": 0.0})
    found = exponents(Scene(spring, "x->x", chain(2)), [0.0], starts=1, show_progress=False)
    assert float(found.unit.split()[3]) == pytest.approx(2.0 * np.pi, rel=0.1)
    assert abs(found.exponent[0] + 0.005) < 3.0 * found.stderr[0] < 2e-3
