"""Exponents do not depend on units: states x -> s x + c of each component, and times t -> k t."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import sympy as sp

from synchain import (
    Field,
    Friction,
    Lagrangian,
    Scene,
    cluster_exponents,
    exponents,
    friction_law,
    lyapunov_spectrum,
    msf,
    plane,
)
from synchain.graphs import chain
from synchain.results import MSF, Exponents
from synchain.runtime.stability.attractor import Attractor, Motion
from synchain.runtime.stability.exponents import group_by_attractor

VAN_DER_POL = Field(
    {"x": "k*v/w", "v": "k*((1 - ((x - c)/s)**2)*v - w*(x - c))"}, parameters={"s": 1.0, "c": 0.0, "k": 1.0, "w": 1.0}
)
"""x in units of s about c, v in units of s w, time in units of 1/k."""

KNOWN = np.array([0.0, -0.137590, -0.591362])
"""Exponents of strengths 0, 0.3 and 1 by Floquet multipliers of s = k = 1, c = 0."""

BISTABLE = Field({"x": "v", "v": "s*(x/s - (x/s)**3 + 0.3*(x/s)**2) - 4*v"}, parameters={"s": 1.0})
"""Wells at -0.861 s and 1.161 s with other slopes, and so other exponents."""


def pair(s: float = 1.0, c: float = 0.0, k: float = 1.0, w: float = 1.0) -> Scene:
    start = {"x": [c + s, c - s], "v": 0.1 * s * w}
    return Scene(VAN_DER_POL, "v->v", chain(2), initial=start, parameters={"s": s, "c": c, "k": k, "w": w})


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("s", [1e-9, 1e-4, 1e9])
def test_exponents_in_any_unit_of_state(s: float) -> None:
    result = exponents(pair(s), [0.0, 0.3, 1.0])
    np.testing.assert_allclose(result.exponent, KNOWN, atol=2e-6)
    assert {attractor.kind for attractor in result.attractors} == {"periodic"}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("s", "c", "k", "w"), [(1e-4, 1.0, 1.0, 1.0), (1e-6, -1e-3, 1e3, 1e-6)])
def test_exponents_beside_an_offset_and_in_other_units_of_a_component(s: float, c: float, k: float, w: float) -> None:
    result = exponents(pair(s, c, k, w), k * np.array([0.0, 0.3, 1.0]))
    np.testing.assert_allclose(result.exponent / k, KNOWN, atol=1e-5)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("k", [1e-6, 1e6])
def test_exponents_in_any_unit_of_time(k: float) -> None:
    result = exponents(pair(k=k), k * np.array([0.0, 0.3, 1.0]))
    np.testing.assert_allclose(result.exponent / k, KNOWN, atol=2e-6)
    assert result.unit.startswith("mean return time, ")
    assert result.time * k == pytest.approx(6.66328686, rel=1e-7)


@pytest.mark.parametrize(("s", "k"), [(1e-6, 1.0), (1.0, 1e-4)])
def test_the_function_of_a_cycle_is_stable_above_zero(s: float, k: float) -> None:
    result = msf(pair(s, k=k), k * np.linspace(-1.0, 1.0, 3))
    ((low, high),) = result.intervals
    assert (abs(low) < 1e-5 * k, high) == (True, k)
    table = plane(pair(s, k=k), k * np.array([0.3, 1.0]), k * np.array([0.0, 0.5]), starts=1)
    np.testing.assert_allclose(table.exponent[:, 0] / k, KNOWN[1:], atol=2e-6)


X, V, Y, U, TIME = sp.symbols("x v y u t")


def rubbing(s: float, t: float) -> Scene:
    """Two driven masses on rough ground, which turn without stick, in units s of length and t of time."""
    force = s / t**2
    laws = [friction_law(f"mu{k}*sign(w)", {f"mu{k}": mu}) for k, mu in enumerate((0.3, 0.2))]
    masses = Lagrangian(
        V**2 / 2 + U**2,
        (X**2 / 2 + Y**2 / 2 + (X - Y) ** 2 / 4) / t**2,
        {X: force * sp.cos(0.7 * TIME / t), Y: 0.5 * force * sp.sin(0.7 * TIME / t)},
        coordinates={X: V, Y: U},
        events=[Friction(-v, load=force, law=law) for v, law in zip((V, U), laws, strict=True)],
        contact="set-valued",
        initial={X: 0.5 * s, V: 0.0, Y: -0.2 * s, U: 0.1 * s / t},
    )
    return Scene(masses, None, transient=50)


@pytest.mark.parametrize(("s", "t"), [(1.0, 1e-6), (1e-6, 1e6), (1e6, 1e-3)])
def test_spectra_with_dry_friction_in_any_unit(s: float, t: float) -> None:
    """Moduli 0.78187 and 0.4987 of the multipliers by `periodic_orbit`, each of a pair of complex ones."""
    result = lyapunov_spectrum(rubbing(s, t), periods=200)
    known = np.repeat(np.log([0.78187, 0.4987]), 2) * 0.7 / (2.0 * np.pi)
    assert np.all(result.stderr > 0.0)
    np.testing.assert_allclose(result.exponent * t, known, atol=3e-3)
    assert result.exponent.sum() * t == pytest.approx(known.sum(), abs=1e-4)


def belted(s: float, t: float, n: int) -> Scene:
    """Blocks on a belt under falling friction, joined by springs, in units s of length and t of time."""
    force = s / t**2
    law = friction_law("mu*sign(w)/(1 + abs(w)*fall)", {"mu": 0.5, "fall": 3.0 * t / s})
    block = Lagrangian(
        V**2 / 2,
        X**2 / 2 / t**2,
        {X: -0.02 * V / t},
        coordinates={X: V},
        events=[Friction(0.2 * s / t - V, load=force, law=law)],
        contact="set-valued",
        initial={X: 0.1 * s, V: 0.0},
    )
    if n == 1:
        return Scene(block, None, transient=30 * t)
    start = {"x": [0.1 * s, 0.13 * s], "v": 0.0}
    return Scene(block, "spring", chain(n), transient=100 * t, initial=start, parameters={"sigma": 0.1 / t**2})


@pytest.mark.parametrize(("s", "t"), [(1e6, 1.0), (1.0, 1e-6), (1.0, 1.0)])
def test_spectra_of_stick_slip_in_any_unit(s: float, t: float) -> None:
    """The blocks turn together: exponents 0 along the cycle, -0.0964 and -0.438 of their difference."""
    result = lyapunov_spectrum(belted(s, t, 2), periods=100)
    np.testing.assert_allclose(result.exponent[:3] * t, [0.0, -0.0964, -0.4380], atol=3e-3)
    assert result.exponent[3] == -np.inf
    assert float(result.unit.split(",")[1].split()[0]) == pytest.approx(7.387 * t, rel=1e-3)


def test_the_turn_of_a_block_on_a_belt_in_fast_units() -> None:
    """The period of the cycle by `periodic_orbit`."""
    result = lyapunov_spectrum(belted(1.0, 1e-6, 1), periods=60)
    assert result.unit == "mean return time, 8.30186e-06 units of time"
    assert abs(result.exponent[0]) * 1e-6 < 1e-3
    assert result.exponent[1] == -np.inf


@pytest.mark.parametrize("s", [1e-7, 1.0])
def test_the_scene_s_own_start_is_the_headline_and_others_warn(s: float) -> None:
    """A start at the top of the barrier: displaced ones reach both wells, and none outvotes its own."""
    scene = Scene(BISTABLE, "x->x", chain(2), initial={"x": -0.05 * s, "v": 0.0}, parameters={"s": s})
    alone = exponents(scene, [0.0, 0.5], starts=1)
    with pytest.warns(RuntimeWarning, match="on another motion than the scene's own start"):
        result = exponents(scene, [0.0, 0.5], starts=6)
    np.testing.assert_allclose(result.exponent, alone.exponent, rtol=1e-6)
    assert 0 in result.groups[0]
    assert len(result.groups) == 2


def line(exponent: list[float], error: float) -> Exponents:
    y = np.array(exponent)
    return Exponents(np.linspace(0.0, 1.0, len(y)), y, np.full(len(y), error), 1.0, 1, y[None])


@pytest.mark.parametrize(
    ("exponent", "kind", "gamma", "undecided"),
    [
        ([0.3, -0.2, 0.01, -0.2, 0.3], "bounded interval", "Γ2", 1),  # a gap within the error
        ([0.3, -0.2, 0.05, -0.2, 0.3], "several intervals", "Γ4", 0),
        ([0.3, 0.2, -0.01, 0.2, 0.3], "undecided within the errors", "", 1),  # an island within the error
        ([0.3, 0.2, -0.01, 0.01, -0.3], "half-line", "Γ1", 1),
        ([0.3, 0.2, 0.1, 0.2, 0.3], "never stable", "Γ0", 0),
        ([0.3, -0.2, -0.1, -0.2, -0.3], "half-line", "Γ1", 0),
    ],
)
def test_a_gap_or_an_island_counts_if_it_is_deeper_than_two_errors(
    exponent: list[float], kind: str, gamma: str, undecided: int
) -> None:
    fine = line(exponent, 0.01)
    function = MSF(Scene(topology=chain(2)), fine.alpha, fine)
    assert (function.kind, function.gamma, len(function.undecided)) == (kind, gamma, undecided)


def test_the_end_beside_an_undecided_stretch_may_lie_anywhere_within() -> None:
    (((low, error), _),) = line([0.3, 0.2, -0.01, 0.01, -0.3], 0.01).ranges
    assert low - error <= 0.25
    assert low + error >= 0.75


def test_an_average_that_ends_short_of_its_precision_says_so() -> None:
    alpha = np.linspace(0.0, 1.0, 3)
    function = Exponents(alpha, alpha - 0.5, np.full(3, 1.7e-3), 1.0, 1, (alpha - 0.5)[None], precision=1e-3)
    assert (
        dict(function.summary)["errors"]
        == "up to 0.0017 where the exponent passes zero; precision = 0.001 was not reached; raise periods"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "errors" not in dict(Exponents(alpha, alpha, alpha, 1.0, 1, alpha[None], precision=2.0).summary)


def test_a_large_error_far_below_zero_is_no_alarm() -> None:
    """The exponent passes zero between the first two strengths, and dips at the last, where its error is large."""
    value, error = np.array([0.1, -0.1, -2.0]), np.array([2e-4, 3e-4, 0.13])
    rows = dict(Exponents(np.arange(3.0), value, error, 1.0, 1, value[None], precision=1e-3).summary)
    assert "errors" not in rows
    assert rows["average"].endswith("standard error 0.0003 where the exponent passes zero, at most 0.13")
    rows = dict(Exponents(np.arange(3.0), value, error * 1e2, 1.0, 1, value[None], precision=1e-3).summary)
    assert rows["errors"].startswith("up to 0.03 where the exponent passes zero; precision = 0.001")


def test_two_motions_of_one_kind_are_told_apart_in_the_summary() -> None:
    cycle, other = Attractor(Motion.PERIODIC, 2.0), Attractor(Motion.PERIODIC, 3.0)
    value = np.array([-0.1])
    by_start = np.array([[-0.1], [-0.2], [-0.1]])
    result = Exponents(np.ones(1), value, value * 0, 1.0, 3, by_start, (cycle, other, cycle), ((0, 2), (1,)))
    assert dict(result.summary)["attractor"] == "periodic (2 of 3 starts); periodic (motion 2) (1 of 3 starts)"


def test_starts_on_one_cycle_are_one_motion_where_an_exponent_dips() -> None:
    """Propagators [[0, 1], [d, 0]] with d = 1e-9 and 4e-9 near a zero of the multiplier: the exponents differ by ln 2."""
    first, second = (
        Attractor(Motion.PERIODIC, 1.0, np.tile([[0.0, 1.0], [d, 0.0]], (3, 1, 1, 1))) for d in (1e-9, 4e-9)
    )
    by_start = np.array([each.exponents()[0] for each in (first, second)])
    assert by_start[1] - by_start[0] == pytest.approx(np.log(2))
    assert group_by_attractor((first, second), by_start, np.zeros((2, 1))) == ((0, 1),)
    far = Attractor(Motion.PERIODIC, 1.0, np.tile([[0.0, 1.0], [1e-2, 0.0]], (3, 1, 1, 1)))
    by_start[1] = far.exponents()[0]
    assert group_by_attractor((first, far), by_start, np.zeros((2, 1))) == ((0,), (1,))


LORENZ = Field(
    {"x": "k*10*(y - x)", "y": "k*(28*x - y - x*z)", "z": "k*(x*y - 8*z/3)"},
    parameters={"k": 1.0},
    initial={"x": 1.0, "z": 20.0},
)


def averages_of_lorenz(k: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Exponents over k, their errors over k, and the lengths of averages times k."""
    scene = Scene(LORENZ, "x->x", chain(2), parameters={"k": k, "sigma": 10.0 * k})
    modes = exponents(scene, k * np.array([0.0, 20.0]), starts=1, periods=20_000)
    cluster = cluster_exponents(scene, [0, 0], periods=20_000)
    spectrum = lyapunov_spectrum(Scene(LORENZ, None, parameters={"k": k}), periods=20_000)
    parts = (modes, cluster, spectrum)
    value, error = (np.concatenate([getattr(part, name) for part in parts]) for name in ("exponent", "stderr"))
    return value / k, error / k, k * np.array([part.time for part in parts])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("k", [1e-6, 1e6])
def test_averages_of_chaos_end_alike_in_any_unit_of_time(k: float) -> None:
    """Averages end by the default precision long before 20 000 turns of 0.75/k units."""
    (value, error, length), (scaled, error_scaled, length_scaled) = averages_of_lorenz(1.0), averages_of_lorenz(k)
    assert np.all(np.abs(scaled - value) <= 4.0 * np.hypot(error, error_scaled))
    assert np.all(np.abs(np.log(length_scaled / length)) < np.log(4.0))
    assert length.max() < 0.5 * 20_000 * 0.75


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("far", [1e4, 1e6])
def test_the_unit_of_time_is_that_of_the_attractor(far: float) -> None:
    """Far outside, Lorenz's system turns `far` times faster, and no component moves one way."""
    scene = Scene(LORENZ, "x->x", chain(2), initial={"x": far, "y": 0.5 * far, "z": 20.0})
    result = exponents(scene, [0.0, 20.0], starts=1)
    assert np.all(np.abs(result.exponent - [0.9056, -0.787]) <= 4.0 * result.stderr)
    assert np.all(result.stderr < 0.02)
    assert 0.5 < float(result.unit.split(", ")[1].split()[0]) < 1.0
