"""Equilibria against closed forms, their eigenvalues, shifts, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import synchain as sc
from synchain.runtime.bifurcation import eigenvalues as module
from synchain.runtime.bifurcation.linearised import Linearised

MACHINE = sc.Field({"delta": "w", "w": "P - w/2"}, parameters={"P": 0})
LINE = sc.Rates({"w": "K*W*sin(delta_j - delta_i)"}, {"K": 1})
PHASE = sc.Field({"theta": "w"}, parameters={"w": 0})
PULL = sc.Rates({"theta": "K*W*sin(theta_j - theta_i)"}, {"K": 1})


def grid(*powers: float, graph: sc.graphs.Topology | None = None) -> sc.Scene:
    return sc.Scene(MACHINE, LINE, graph or sc.graphs.chain(len(powers)), parameters={"P": list(powers)})


@pytest.mark.parametrize("power", [0.0, 0.3, 0.9, 0.9999])
def test_two_machines_are_apart_by_the_arc_sine_of_power_over_strength(power: float) -> None:
    result = sc.equilibrium(grid(power, -power))
    apart = np.arcsin(power)
    assert result.state[0] - result.state[1] == pytest.approx(apart, abs=1e-9)
    assert result.shifts == ("delta",)
    assert result.speeds.tolist() == [0.0]
    swings = np.roots([1.0, 0.5, 2.0 * np.cos(apart)])  # of the difference
    expected = np.sort_complex(np.array([0.0, -0.5, *swings], dtype=complex))
    np.testing.assert_allclose(np.sort_complex(result.eigenvalues), expected, atol=1e-7)
    assert result.stable


def test_the_other_equilibrium_of_two_machines_is_unstable() -> None:
    scene = grid(0.3, -0.3).replace(initial={"delta": [3.0, 0.0], "w": 0.0})
    result = sc.equilibrium(scene)
    assert result.state[0] - result.state[1] == pytest.approx(np.pi - np.arcsin(0.3), abs=1e-12)
    assert (result.growing, result.verdict) == (1, "unstable, 1 growing")


def test_at_the_fold_nothing_is_called_stable_and_beyond_it_nothing_is_found() -> None:
    fold = sc.equilibrium(grid(1.0, -1.0))
    assert (fold.growing, fold.neutral, fold.stable) == (0, 1, False)
    with pytest.raises(ArithmeticError, match="no equilibrium near the start: Newton's method left rates of"):
        sc.equilibrium(grid(1.001, -1.001))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("start", [{"x": 0.0, "y": 1.0}, {"x": 1.0, "y": 1.0}])
def test_an_infinite_slope_is_met_in_words(start: dict[str, float]) -> None:
    """Newton's method begins at x = 0, or its first step leads there."""
    scene = sc.Scene(sc.Field({"x": "-x", "y": "1 - y + sqrt(abs(x))"}), initial=start)
    with pytest.raises(ArithmeticError, match=r"whose slope is infinite, or has no value.*; start elsewhere"):
        sc.equilibrium(scene)


def test_a_rate_that_overflows_is_refused_as_such() -> None:
    with pytest.raises(ArithmeticError, match="met a rate that overflows, or has no value; start elsewhere"):
        sc.equilibrium(sc.Scene("van_der_pol"), [1e300, 0.0])


def test_machines_whose_powers_do_not_add_up_to_zero_turn_together() -> None:
    """The sum of the powers balances the damping: w = 2 mean(P)."""
    result = sc.equilibrium(grid(0.7, -0.3))
    assert result.speeds == pytest.approx([0.4], abs=1e-14)
    np.testing.assert_allclose(result.state[2:], 0.4, atol=1e-14)
    assert result.state[0] - result.state[1] == pytest.approx(np.arcsin(0.5), abs=1e-13)
    assert result.stable


def test_phases_of_kuramoto_lock_at_the_mean_frequency() -> None:
    """On a complete graph K r sin(theta_i - psi) = w_i - mean(w), r exp(i psi) the sum of exp(i theta)."""
    w = np.linspace(-1.0, 2.0, 7)
    result = sc.equilibrium(sc.Scene(PHASE, PULL, sc.graphs.complete(7), parameters={"w": w.tolist(), "K": 0.5}))
    field = np.exp(1j * result.state).sum()
    np.testing.assert_allclose(np.sin(result.state - np.angle(field)) * 0.5 * abs(field), w - w.mean(), atol=1e-12)
    assert result.speeds == pytest.approx([w.mean()], abs=1e-13)
    assert result.stable


def test_a_pendulum_has_two_equilibria() -> None:
    down = sc.equilibrium(sc.Scene("pendulum"))
    up = sc.equilibrium(sc.Scene("pendulum", initial={"x": 3.0, "v": 0.0}))
    np.testing.assert_allclose(down.state, 0.0, atol=1e-12)
    np.testing.assert_allclose(down.eigenvalues, [1j, -1j], atol=1e-12)
    assert down.verdict == "neutral, 2 on the imaginary axis"
    assert not down.stable
    np.testing.assert_allclose(up.state, [np.pi, 0.0], atol=1e-12)
    np.testing.assert_allclose(up.eigenvalues, [1.0, -1.0], atol=1e-12)
    assert (down.shifts, up.shifts) == ((), ())


def test_masses_that_depend_on_angles() -> None:
    """A double pendulum of equal masses and lengths: squares of the frequencies 2 -+ sqrt(2)."""
    result = sc.equilibrium(sc.Scene("double_pendulum"))
    frequencies = np.sort(np.abs(result.eigenvalues.imag))[::2]
    np.testing.assert_allclose(frequencies**2, [2 - np.sqrt(2), 2 + np.sqrt(2)], rtol=1e-12)


def test_a_drive_of_strength_zero_is_none() -> None:
    """Duffing's oscillator with a soft spring, x + beta x^3 = 0: a saddle at 1/2 if beta = -4."""
    scene = sc.Scene("duffing", topology=sc.graphs.chain(2), parameters={"beta": -4.0}, initial={"x": 0.45, "v": 0.0})
    result = sc.equilibrium(scene, u=0)
    np.testing.assert_allclose(result.state, [0.5, 0.5, 0.0, 0.0], atol=1e-12)
    assert result.growing == 2
    with pytest.raises(ValueError, match="found a drive"):
        sc.equilibrium(scene, u=0.1)


def test_links_with_inertia() -> None:
    """Modes of a chain of three, whose Laplacian has the eigenvalues 0, 1, 3: squares of frequencies 1/(1 + sigma gamma)."""
    result = sc.equilibrium(sc.Scene("harmonic", "inerter", sc.graphs.chain(3), parameters={"sigma": 0.5}))
    frequencies = np.sort(result.eigenvalues.imag)[3:]
    np.testing.assert_allclose(frequencies**2, [0.4, 1 / 1.5, 1.0], rtol=1e-12)


def test_newton_steps_are_shortened_where_they_would_diverge() -> None:
    result = sc.equilibrium(sc.Scene(sc.Field({"x": "-atan(x)"}, initial={"x": 3})))
    assert result.state == pytest.approx([0.0], abs=1e-11)


@pytest.mark.parametrize("start", [0, 0.3])
def test_a_flat_place_is_no_shift(start: float) -> None:
    result = sc.equilibrium(sc.Scene(sc.Field({"x": "-x**3"}, initial={"x": start})))
    assert result.shifts == ()
    assert result.verdict == "neutral, 1 on the imaginary axis"


@pytest.mark.parametrize(
    "scene",
    [
        sc.Scene("fitzhugh_nagumo", "x->x, y->x", sc.graphs.star(4)),
        sc.Scene("double_pendulum", topology=sc.graphs.chain(3)),
        sc.Scene("harmonic", "inerter", sc.graphs.chain(3)),
        grid(0.1, 0.2, -0.3, graph=sc.graphs.ring(3)),
    ],
    ids=["field", "masses", "inerters", "numbers of nodes"],
)
def test_rates_jacobian_and_masses_are_those_of_the_equations(scene: sc.Scene) -> None:
    equations, network = scene.equations, Linearised.of(scene.equations, scene.parameters)
    state = np.random.default_rng(0).normal(size=equations.dimension)
    values = dict(zip(equations.state, state, strict=True)) | dict(scene.parameters)

    def value(e) -> float:
        return float(e.xreplace({s: values[s.name] for s in e.free_symbols}))

    np.testing.assert_allclose(network.rates(state), [value(e) for e in equations.rhs()], atol=1e-13)
    for matrix, entries in ((network.jacobian(state), equations.jacobian()), (network.mass(state), equations.mass())):
        expected = np.zeros((len(state), len(state)))
        for entry, e in entries.items():
            expected[entry] = value(e)
        np.testing.assert_allclose(0.0 * expected if matrix is None else matrix.toarray(), expected, atol=1e-13)


def test_links_and_nodes_with_numbers_of_their_own() -> None:
    strengths = {"K": [[0, 2.0, 0], [2.0, 0, 3.0], [0, 3.0, 0]]}
    scene = sc.Scene(MACHINE, LINE, sc.graphs.chain(3), parameters={"P": [0.5, 0.0, -0.5], **strengths})
    result = sc.equilibrium(scene)
    np.testing.assert_allclose(-np.diff(result.state[:3]), np.arcsin([0.25, 0.5 / 3.0]), atol=1e-12)


def test_a_large_network_is_not_called_stable_by_a_few_eigenvalues(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 60
    scene = grid(*(0.01 * np.cos(2.0 * np.pi * np.arange(n) / n)), graph=sc.graphs.ring(n))
    full = sc.equilibrium(scene)
    monkeypatch.setattr(module, "DENSE", 2 * n - 1)
    few = sc.equilibrium(scene)
    assert full.stable
    assert few.verdict == "not decided: none of the 12 eigenvalues nearest to zero grows"
    assert not few.stable
    nearest = np.sort(np.abs(full.eigenvalues))[:12]
    np.testing.assert_allclose(np.sort(np.abs(few.eigenvalues)), nearest, atol=1e-9)
    apart = scene.replace(initial={"delta": [np.pi * (i % 2) for i in range(n)], "w": 0.0})
    assert sc.equilibrium(apart).verdict == "unstable, at least 11 growing"


def test_starts_are_those_of_runs(tmp_path: Path) -> None:
    """A run settles; its end is where the search begins, and what is found stays where it is."""
    scene = grid(0.5, -0.5).replace(time_unit="time", transient=0, window=40)
    result = sc.equilibrium(scene, sc.run(scene))
    again = sc.equilibrium(scene.replace(P=[0.6, -0.6]), result.data.state)
    assert again.state[0] - again.state[1] == pytest.approx(np.arcsin(0.6), abs=1e-12)
    stays = sc.run(scene, start=result.data.state)
    np.testing.assert_allclose(stays.end.values.ravel(), result.state, atol=1e-9)
    result.save(tmp_path / "rest.nc")
    opened = sc.open_result(tmp_path / "rest.nc")
    assert isinstance(opened, sc.results.Equilibrium)
    assert opened.shifts == result.shifts
    np.testing.assert_array_equal(opened.eigenvalues, result.eigenvalues)


@pytest.mark.parametrize(
    ("scene", "options", "message"),
    [
        (sc.Scene("duffing"), {}, "found a drive.*`periodic_orbit` finds"),
        (sc.Scene(sc.Field({"x": "-x + sign(x - 1)"})), {}, "by which rates jump"),
        (grid(0.0, 0.0), {"count": 5}, "count = 5; expected at most 4"),
        (grid(0.0, 0.0), {"count": 0}, "count"),
    ],
)
def test_what_is_refused(scene: sc.Scene, options: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sc.equilibrium(scene, **options)


def test_set_valued_friction_rests_in_whole_ranges() -> None:
    with pytest.raises(
        ValueError, match="set-valued friction, stops or resets, under which whole ranges of states may rest"
    ):
        sc.equilibrium(sc.Scene("froude", contact="set-valued"))


def test_a_motion_that_comes_to_rest_is_no_periodic_orbit() -> None:
    scene = sc.Scene(sc.Field({"x": "v", "v": "-v - x + 1"}), "x->x")
    with pytest.raises(ArithmeticError, match=r"comes to rest at x_1 = 1, v_1 = .*`equilibrium` finds such states"):
        sc.periodic_orbit(scene)
    np.testing.assert_allclose(sc.equilibrium(scene).state, [1.0, 0.0], atol=1e-14)


@pytest.mark.parametrize("unit", [1e-14, 1e-9, 1.0, 1e9])
def test_units_of_time_and_state_change_nothing(unit: float) -> None:
    """x' = -unit (x^3 - size^3)/size^2; x' = unit (x^2 + size^2)/size has no equilibrium; at x = pi/2 is a fold."""
    for size in (1e-6, 1.0, 1e6):
        symbols = {"parameters": {"k": unit, "a": size}, "initial": {"x": 2.0 * size}}
        result = sc.equilibrium(sc.Scene(sc.Field({"x": "-k*(x**3 - a**3)/a**2"}, **symbols), None))
        assert result.state == pytest.approx([size], rel=1e-12)
        assert (result.shifts, result.verdict) == ((), "stable")
        with pytest.raises(ArithmeticError, match="no equilibrium near the start"):
            sc.equilibrium(sc.Scene(sc.Field({"x": "k*(x**2 + a**2)/a"}, **symbols), None))
    fold = sc.Field({"x": "k*(1 - sin(x))"}, parameters={"k": unit}, initial={"x": np.pi / 2})
    assert sc.equilibrium(sc.Scene(fold, None)).verdict == "neutral, 1 on the imaginary axis"


@pytest.mark.parametrize("unit", [1e-14, 1.0, 1e9])
def test_identical_phases_at_zero_lock_at_their_lagging_speed_in_any_unit_of_time(unit: float) -> None:
    """All rates are 0.3 unit + 2 unit sin(-0.1) but for rounding, and no state has a size."""
    lagging = sc.Rates({"theta": "K*W*sin(theta_j - theta_i - 1/10)"}, {"K": unit})
    result = sc.equilibrium(
        sc.Scene(PHASE, lagging, sc.graphs.cycle(5), parameters={"w": 0.3 * unit}, initial={"theta": 0.0})
    )
    assert result.speeds / unit == pytest.approx([0.3 - 2.0 * np.sin(0.1)], rel=1e-14)
    assert result.stable


@pytest.mark.parametrize("form", ["S/(K + S)", "tanh(S/K)", "1 - exp(-S/K)", "S**2/(K**2 + S**2)"])
def test_rates_that_level_off_above_zero_have_no_equilibrium(form: str) -> None:
    """k - V f(S) with k >= V, alone and in a linked pair, in any units; with k < V there is one."""
    pool = sc.Field({"S": f"k - V*({form})"}, parameters={"k": 1, "V": 1, "K": 1})
    lone, pair = sc.Scene(pool, None), sc.Scene(pool, sc.Rates({"S": "d*W*(S_j - S_i)"}, {"d": 1}), sc.graphs.chain(2))
    for size, unit in ((1.0, 1.0), (1e-6, 1e3), (1e9, 1e-5)):
        for k in (1.5, 1.0):
            for scene in (lone, pair.replace(parameters={"d": 0.3 * unit})):
                scene = scene.replace(initial={"S": size})
                with pytest.raises(ArithmeticError, match="no equilibrium near the start"):
                    sc.equilibrium(scene, k=k * size * unit, V=size * unit, K=size)
        result = sc.equilibrium(lone.replace(initial={"S": size}), k=0.5 * size * unit, V=size * unit, K=size)
        assert result.residual < 1e-14 * size * unit


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 1e6])
@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_an_equilibrium_does_not_depend_on_units_of_its_components(size: float, offset: float) -> None:
    """x = c + s X, v = r V with X' = V, V' = -X^3 - V/2 + X: three equilibria, all by their own starts."""
    rates = {"x": "k*v*s/r", "v": "k*r*(-((x - c)/s)**3 - v/r/2 + (x - c)/s)"}
    well = sc.Field(rates, parameters={"s": size, "r": 1e3 / size, "c": offset * size, "k": 1 / size})
    for start, resting in ((1.3, 1.0), (-0.8, -1.0), (0.2, 0.0)):
        result = sc.equilibrium(sc.Scene(well, None, initial={"x": size * (start + offset), "v": 0.0}))
        np.testing.assert_allclose(result.state / size, [resting + offset, 0.0], atol=1e-14)
        assert result.stable == (resting != 0.0)
        np.testing.assert_allclose(
            result.eigenvalues.real.max() * size, -0.25 if resting else (17**0.5 - 1) / 4, rtol=1e-9
        )


def test_a_rate_that_is_flat_at_the_start_is_no_shift_in_large_units() -> None:
    """x' = k (1 - (x/s)^3): at x = 0, s = 10^9 a shift by one changes the rate by 10^-27."""
    result = sc.equilibrium(sc.Scene(sc.Field({"x": "1 - (x/s)**3"}, parameters={"s": 1e9}, initial={"x": 1e3}), None))
    assert result.shifts == ()
    assert result.state == pytest.approx([1e9], rel=1e-12)


RELAXING = sc.Field({"x": "p - 1.2*x - x**3 + 1.41*y", "y": "-0.88*y + tanh(x)"}, parameters={"p": 0})


TODA = sc.Potential("W*D*(exp(-(x_j-x_i)/a)+(x_j-x_i)/a)", {"a": 2, "D": 3})


@pytest.mark.parametrize(("link", "parameters"), [("spring", {"sigma": 2.0}), ("fput", {}), (TODA, {})])
@pytest.mark.parametrize("size", [1e-9, 1.0])
def test_free_masses_keep_their_mean_velocity(
    link: str | sc.Potential, parameters: dict[str, float], size: float
) -> None:
    """Any common velocity is an equilibrium up to a shift: the one of the start's momentum and centre is nearest to the start."""
    mass = sc.Lagrangian("m*v**2/2", "0", coordinates={"x": "v"}, parameters={"m": 5})
    x, v = np.array([0.0, 0.1, 0.3]), size * np.array([1e-3, 0.0, -0.4])
    result = sc.equilibrium(sc.Scene(mass, link, sc.graphs.chain(3), initial={"x": x, "v": v}, parameters=parameters))
    np.testing.assert_allclose(result.speeds, [v.mean()], rtol=1e-9)
    np.testing.assert_allclose(result.state, [x.mean()] * 3 + [v.mean()] * 3, rtol=1e-9)


def test_where_newton_fails_the_motion_leads_to_rest() -> None:
    """A pair of which the run ends at x = (-.229, -.867); a chain in a double well, begun beside a ridge."""
    graph = sc.graphs.from_sparse(sparse.coo_array([[0.0, 0.71], [-0.46, 0.0]]), adjacency=True)
    link = sc.Rates({"x": "K*W*sin(x_j - x_i)"}, {"K": 0.7})
    start = {"x": [0.785, -0.311], "y": 0.0}
    result = sc.equilibrium(sc.Scene(RELAXING, link, graph, initial=start, parameters={"p": [0.37, -0.38]}))
    np.testing.assert_allclose(result.state[:2], [-0.22902549, -0.86742193], atol=1e-8)
    assert result.stable
    # Newton's method meets the flat top of the hump of x^3 - 3x + 3, whose root is at -2.1038
    hump = sc.Field({"x": "-k*(x**3/s**2 - 3*x + 3*s)"}, parameters={"k": 1, "s": 1})
    for unit, size in ((1.0, 1.0), (1e6, 1e-6), (1e-6, 1e6)):
        result = sc.equilibrium(sc.Scene(hump, None, initial={"x": 1.5 * size}), k=unit, s=size)
        assert result.state / size == pytest.approx([-2.103803402735536], rel=1e-12)


def test_eigenvalues_do_not_depend_on_the_slopes_at_the_start() -> None:
    """The slope of x - x^3 is -2 at 1, and -3e12 at a start of 1e6; that of x - sin x is zero to rounding at 0."""
    well = sc.equilibrium(sc.Scene(sc.Field({"x": "x - x**3"}), None, initial={"x": 1e6}))
    np.testing.assert_allclose(well.eigenvalues, [-2.0], rtol=1e-12)
    assert well.stable
    flat = sc.equilibrium(sc.Scene(sc.Field({"x": "x - sin(x)"}), None, initial={"x": 1.0}))
    assert flat.neutral == 1


@pytest.mark.parametrize(
    ("rates", "multiple"),
    [
        ({"x": "1 - exp(x - 1) + x - 1"}, True),
        ({"x": "(x - 1)**3"}, True),
        ({"x": "3*(x - 1)**2 - y", "y": "-y"}, True),
        ({"x": "(x - 1)**2 - y", "y": "x - 1 - 3*y"}, False),
        ({"x": "x - x**3"}, False),
    ],
)
def test_a_double_root_is_called_degenerate(rates: dict[str, str], multiple: bool) -> None:
    """Its eigenvalue is zero, of which Newton's method leaves the square root of a rounding error."""
    rest = sc.equilibrium(sc.Scene(sc.Field(rates), None, initial={name: 0.5 for name in rates}))
    assert rest.multiple == multiple
    assert ("degenerate: a double or higher root" in rest.verdict) == multiple
    assert np.any(rest.eigenvalues == 0.0) == multiple
    assert rest.stable != multiple
