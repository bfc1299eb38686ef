"""The shipped vector fields and van der Pol's oscillator: equations, divergence, rest states, published numbers, starts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from parts import is_lagrangian, node, oscillator_of
from scipy.integrate import solve_ivp

from synchain import Scene, Section, exponents, run
from synchain.graphs import chain, from_matrix, ring, star
from synchain.models.definitions.definition import OSCILLATOR
from synchain.models.dynamics.network import oriented_links
from synchain.models.dynamics.variational import source_slopes
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.inputs.plugin_files import names
from synchain.models.mechanics.components import TIME
from synchain.models.scenes.energy import energy_terms
from synchain.models.sweeps.initial_values import default_start

X, Y, Z, V = sp.symbols("x y z v", real=True)
A, B, C, P, Q, MU, U = sp.symbols("a b c p q mu u", real=True)
PRANDTL, RAYLEIGH, OMEGA = sp.symbols("prandtl rayleigh omega", real=True)
FIELDS = [name for name in names(OSCILLATOR) if not is_lagrangian(name)]
RESERVED = {"alpha", "beta2", "sigma", "t", "weight"}


def divergence(name: str) -> sp.Expr:
    return sp.expand(sp.Add(*(row[k] for k, row in enumerate(node(name).jacobian()))))


# -- equations -----------------------------------------------------------------------------------------------


def test_roessler() -> None:
    assert node("rossler").rhs == (-Y - Z, X + A * Y, B + Z * (X - C))
    assert divergence("rossler") == A + X - C
    remaining = {Z: X / A, Y: -X / A}
    assert sp.expand(node("rossler").rhs[2].xreplace(remaining) * A - (X**2 - C * X + A * B)) == 0


def test_lorenz() -> None:
    written = (PRANDTL * Y - PRANDTL * X, RAYLEIGH * X - X * Z - Y, X * Y - B * Z)
    assert [sp.expand(e) for e in node("lorenz").rhs] == list(written)
    assert divergence("lorenz") == -PRANDTL - 1 - B


def test_lorenz_convection_loses_its_stability_at_470_19() -> None:
    """Lorenz, J. Atmos. Sci. 20, 130 (1963), eq. 33: steady convection is unstable above r = 470/19 = 24.74."""
    at = {PRANDTL: sp.Integer(10), B: sp.Rational(8, 3), RAYLEIGH: sp.Rational(470, 19)}
    corner = sp.sqrt((at[RAYLEIGH] - 1) * at[B])
    remaining = {**at, X: corner, Y: corner, Z: at[RAYLEIGH] - 1}
    assert [sp.simplify(e.subs(remaining)) for e in node("lorenz").rhs] == [0, 0, 0]
    matrix = sp.Matrix(node("lorenz").jacobian()).subs(remaining)
    real = [root for root in sp.Poly(matrix.charpoly().as_expr()).all_roots() if root.is_real]
    assert real == [-sp.Rational(41, 3)]  # the trace: the other two are imaginary


def test_chua() -> None:
    inner = {X: sp.Rational(1, 3), Y: sp.Integer(2), Z: sp.Integer(5)}
    assert sp.expand(node("chua").rhs[0].subs(inner) - P * (2 - (1 + A) / 3)) == 0
    for side in (1, -1):
        outer = {**inner, X: sp.Integer(3 * side)}
        assert sp.expand(node("chua").rhs[0].subs(outer) - P * (2 - side * (3 + A + 2 * B))) == 0
    assert node("chua").rhs[1:] == (X - Y + Z, -Q * Y)
    (slope,) = {divergence("chua").subs(X, x) for x in (-sp.Rational(1, 2), sp.Rational(1, 4))}
    assert sp.expand(slope + P * (1 + A) + 1) == 0
    assert sp.expand(divergence("chua").subs(X, -2) + P * (1 + B) + 1) == 0


def test_chua_is_the_circuit_of_its_paper() -> None:
    """Matsumoto's circuit has 1/C_1 = 9, 1/C_2 = 1, 1/L = 7, G = 0.7, slopes -0.5 and -0.8 and the kink at 1 volt."""
    c_1, c_2, coil, g, inner, outer = map(sp.Rational, ("1/9", "1", "1/7", "7/10", "-4/5", "-1/2"))
    unit = c_2 / g  # of time; current in units of g
    resistor = outer * X + (inner - outer) * (sp.Abs(X + 1) - sp.Abs(X - 1)) / 2
    circuit = ((g * (Y - X) - resistor) / c_1, (g * (X - Y) + g * Z) / c_2, -Y / coil / g)
    values = {s: sp.nsimplify(oscillator_of("chua").parameters[s.name].default, rational=True).limit_denominator(99)
              for s in (P, Q, A, B)}  # fmt: skip
    for ours, theirs in zip(node("chua").rhs, circuit, strict=True):
        assert sp.expand(ours.subs(values) - unit * theirs) == 0
    assert [e.subs({**values, X: sp.Rational(3, 2), Y: 0, Z: -sp.Rational(3, 2)}) for e in node("chua").rhs] == [0] * 3


def test_van_der_pol() -> None:
    assert node("van_der_pol").state == (X, V)
    assert node("van_der_pol").rhs[0] == V
    assert sp.expand(node("van_der_pol").rhs[1] - (MU * (1 - X**2) * V - X + U * sp.cos(OMEGA * TIME))) == 0


@pytest.mark.long
def test_van_der_pol_has_its_limit_cycle() -> None:
    """mu = 1: amplitude 2.008619860874843, period 6.663286859323130, Amore, Physica D 435, 133279 (2022)."""
    scene = Scene(oscillator="van_der_pol", transient=60, window=40, time_unit="time", record=("section",), rtol=1e-11)
    result = run(scene, workers=1, show_progress=False)
    count = int(result.section_count)
    assert result.success
    assert count >= 5
    assert np.abs(result.section.values[:count, 0] - 2.008619860874843).max() < 1e-9
    assert np.abs(np.diff(result.section_time.values[:count]) - 6.663286859323130).max() < 1e-9


def pair(name: str, sigma: list[float], **changes: object) -> np.ndarray:
    """The synchronisation error of two oscillators that are joined in x."""
    scene = Scene(oscillator=name, topology=chain(2), coupling="x->x", axes={"sigma": sigma}, transient=1500, window=200,
                  **changes)  # fmt: skip
    result = run(scene, workers=1, show_progress=False)
    assert result.success, result.message
    synchronous = result.sync_error.values < 1e-3
    assert np.abs(result.states("end")[synchronous]).max() < 100, "the default start leads to the attractor"
    return result.sync_error.values


@pytest.mark.long
def test_two_roessler_oscillators_synchronise_where_the_master_stability_function_is_negative() -> None:
    """alpha = 2 sigma from 0.1863 to 4.6131, the zeros of `test_zeros_of_the_rossler_function`."""
    below, low, high, above = pair("rossler", [0.08, 0.11, 2.2, 2.36])
    assert max(low, high) < 1e-4
    assert min(below, above) > 1e-2


@pytest.mark.long
def test_two_lorenz_oscillators_synchronise_above_one_threshold() -> None:
    """b = 2, x -> x: alpha = 2 sigma above 7.3, Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009)."""
    below, above = pair("lorenz", [3.4, 3.9], parameters={"b": 2.0})
    assert above < 1e-9
    assert below > 1e-2


@pytest.mark.long
def test_chua_visits_both_scrolls() -> None:
    scene = Scene(oscillator="chua", transient=50, window=400, record=("trajectory",), samples=4001)
    x = run(scene, workers=1, show_progress=False).states("trajectory")[:, 0]
    assert -3 < x.min() < -1.5
    assert 1.5 < x.max() < 3


# -- names and starts ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", names(OSCILLATOR))
def test_names_leave_room_for_modes_and_couplings(name: str) -> None:
    states = node(name, "exponential" if oscillator_of(name).takes_friction else None).state
    taken = {s.name for s in states} | set(oscillator_of(name).parameters)
    assert not taken & RESERVED
    assert not [word for word in taken if word.startswith("d_")]


@pytest.mark.parametrize("name", names(OSCILLATOR))
def test_initial_names_states(name: str) -> None:
    initial = oscillator_of(name).initial or {}
    scene = Scene(oscillator=name)
    assert set(initial) <= set(scene.components)
    if name in FIELDS:
        assert scene.y0 == tuple(initial.get(c, 0.0) for c in scene.components), "one oscillator starts at the centre"


@pytest.mark.parametrize(("n", "x"), [(1, (2.0,)), (2, (2.02, 1.98)), (4, (2.06, 2.02, 1.98, 1.94)), (7, None)])
def test_starts_lie_around_the_centre(n: int, x: tuple[float, ...] | None) -> None:
    start = default_start(("x", "y"), n, {"x": 2.0, "y": 5.0})
    assert start["y"] == (5.0,) * n
    distances = np.diff(start["x"])
    without = np.diff(default_start(("x", "y"), n)["x"])
    assert np.allclose(distances, 2.0 * without, rtol=0, atol=1e-15)
    assert math.isclose(sum(start["x"]), 2.0 * n)
    assert x is None or start["x"] == x


@pytest.mark.parametrize("centre", [{"x": -0.7, "y": 5.0}, {"y": 5.0}])
@pytest.mark.parametrize("unit", [2.0**-20, 2.0**20])
def test_starts_around_a_centre_change_with_the_unit_of_the_states(unit: float, centre: dict[str, float]) -> None:
    start = default_start(("x", "y"), 3, centre)
    other = default_start(("x", "y"), 3, {name: unit * value for name, value in centre.items()})
    assert other == {name: tuple(unit * value for value in values) for name, values in start.items()}
    assert len(set(start["x"])) == 3


def test_an_unknown_state_in_initial_is_refused() -> None:
    rossler = oscillator_of("rossler")
    with pytest.raises(ValueError, match="INITIAL of the oscillator: unknown key 'w'; known: x, y, z"):
        Scene(oscillator=replace(rossler, initial=FrozenDict({"w": 1.0})))
    with pytest.raises(ValueError, match="INITIAL of the oscillator: x: found nan; expected a finite number"):
        Scene(oscillator=replace(rossler, initial=FrozenDict({"x": math.nan})))


@pytest.mark.parametrize("name", FIELDS)
def test_the_default_section_is_crossed_by_the_first_state(name: str) -> None:
    assert Scene(oscillator=name).section == Section("x_1", "falling")
    assert Scene(oscillator=name, topology=chain(2), coupling="x->x").time_unit == "time"


# -- several coordinates, links with a direction ---------------------------------------------------------------


def test_the_fermi_pasta_ulam_ring_is_that_of_the_report() -> None:
    """x_i'' = (x_{i+1} - 2 x_i + x_{i-1}) + alpha [(x_{i+1} - x_i)^2 - (x_i - x_{i-1})^2] + beta [cubes], sigma = 1."""
    n, alpha, beta = 5, *sp.symbols("fput_alpha fput_beta", real=True)
    equations = Scene(oscillator="mass", coupling="fput", topology=ring(n)).equations
    x = sp.symbols(f"x_1:{n + 1}", real=True)
    for i, rate in enumerate(equations.rhs()[n:]):
        right, left = x[(i + 1) % n] - x[i], x[i] - x[i - 1]
        written = right - left + alpha * (right**2 - left**2) + beta * (right**3 - left**3)
        assert sp.expand(rate.subs(sp.Symbol("sigma", real=True), 1) - written) == 0


def test_a_chain_is_drawn_from_its_first_node_and_a_star_from_its_hub() -> None:
    assert [(i, j, int(w)) for i, j, w in oriented_links(chain(3))] == [(0, 1, 1), (1, 0, -1), (1, 2, 1), (2, 1, -1)]
    assert {(i, j): int(w) for i, j, w in oriented_links(star(4))} == {(0, 1): 1, (0, 2): 1, (0, 3): 1,
                                                              (1, 0): -1, (2, 0): -1, (3, 0): -1}  # fmt: skip
    assert {(i, j) for i, j, w in oriented_links(ring(4)) if w > 0} == {(0, 1), (1, 2), (2, 3), (3, 0)}
    for graph in (from_matrix([[-2, 2], [2, -2]]), from_matrix([[0, 0], [1, -1]])):
        with pytest.raises(ValueError, match="found one-way links or weights other than 1; expected neither"):
            Scene(oscillator="mass", coupling="fput", topology=graph).equations  # noqa: B018


def test_a_coupling_on_one_coordinate_leaves_the_others_alone() -> None:
    scene = Scene(oscillator="double_pendulum", coupling="spring on  psi ", topology=chain(2))
    assert str(scene.coupling) == "spring on psi"
    slopes = scene.equations.jacobian()
    names_of = scene.equations.state
    felt = {names_of[column] for (row, column) in slopes if names_of[row] == "w_psi_1"}
    assert "psi_2" in felt
    assert "phi_2" not in felt
    both = scene.replace(coupling="spring on psi, phi")
    assert str(both.coupling) == "spring"
    with pytest.raises(ValueError, match="coupling 'spring on fi': unknown coordinate 'fi'; known: phi, psi"):
        scene.replace(coupling="spring on fi")
    with pytest.raises(ValueError, match="found a coordinate twice"):
        scene.replace(coupling="spring on phi, phi")
    with pytest.raises(ValueError, match="unknown coordinate 'v'; known: x; name coordinates"):
        Scene(topology=chain(2), coupling="spring on v", contact="set-valued")
    with pytest.raises(ValueError, match=r"found oscillators without coordinates, .* by components, e\.g\. 'x->x'"):
        Scene(oscillator="lorenz", topology=chain(2), coupling="torsion on theta")


def test_a_full_mass_matrix_reaches_the_master_stability_function() -> None:
    """H of a spring between double pendulums is the inverse mass matrix at the synchronous state."""
    equations = Scene(oscillator="double_pendulum", topology=chain(2)).equations
    (slope,) = source_slopes(equations)
    ratio, rod, phi, psi = sp.symbols("mass_ratio length_ratio phi psi", real=True)
    off = ratio * rod * sp.cos(phi - psi)
    masses = sp.Matrix([[1 + ratio, off], [off, ratio * rod**2]])
    assert (masses * slope[2:, :2] - sp.eye(2)).applyfunc(sp.simplify) == sp.zeros(2)


@pytest.mark.parametrize("coupling", ["cubic_spring", "fput", "torsion", "friction_damper"])
def test_non_linear_couplings_are_linear_between_equal_states(coupling: str) -> None:
    equations = Scene(oscillator="duffing", coupling=coupling, topology=chain(2)).equations
    plain = Scene(oscillator="duffing", coupling="damper" if "damper" in coupling else "spring", topology=chain(2))
    assert source_slopes(equations) == source_slopes(plain.equations)


@pytest.mark.long
def test_two_double_pendulums_in_a_kernel_follow_scipy() -> None:
    """Exported Python right-hand side under SciPy's DOP853 beside our kernel: full mass matrix and links on angles."""
    scene = Scene(oscillator="double_pendulum", topology=chain(2), coupling="spring on phi", parameters={"sigma": 0.3},
                  initial={"phi": [0.6, 0.2], "psi": [-0.3, 0.5]}, transient=0, window=12, record=("sync_error",),
                  rtol=1e-11, integrator="dop853")  # fmt: skip
    result = run(scene, workers=1, show_progress=False)
    assert result.success
    values = [scene.parameters[name] for name in scene.equations.parameters]
    rate = sp.lambdify([sp.symbols(scene.equations.state, real=True),
                        sp.symbols(scene.equations.parameters, real=True)], scene.equations.rhs())  # fmt: skip
    there = solve_ivp(lambda _, y: rate(y, values), (0, 12), scene.y0, method="DOP853", rtol=1e-12, atol=1e-13)
    assert np.abs(result.states("end") - there.y[:, -1]).max() < 1e-8
    phi = there.y[:2]
    assert np.abs(phi[0] - phi[1]).max() > 0.1


WRITTEN = {
    ("pendulum", None): "-sin(x) - delta*v + torque",
    ("rotor", None): "power - delta*v",
    ("mass", None): "0",
    ("froude", "coulomb"): "-sin(x) - damping*v + epsilon*mu*sign(shaft - v)",
    ("spring_block", "hyperbolic"): "-x + mu_s*sign(nu - v)/(1 + delta*Abs(nu - v))",
}


@pytest.mark.parametrize(("oscillator", "friction"), WRITTEN)
def test_equations_written_by_hand(oscillator: str, friction: str | None) -> None:
    single = node(oscillator, friction, "sign")
    symbols = {s.name: s for s in (*single.state, *single.parameters)}
    assert sp.expand(single.rhs[1] - sp.sympify(WRITTEN[oscillator, friction], locals=symbols)) == 0


def test_joints_of_double_pendulums_lose_energy() -> None:
    power = energy_terms(Scene(oscillator="double_pendulum")).nodes[0].power
    delta, one, two = sp.symbols("delta w_phi w_psi", real=True)
    assert sp.expand(power + delta * (one**2 + (two - one) ** 2)) == 0


@pytest.mark.long
def test_the_exponents_of_damped_double_pendulums_at_rest_are_eigenvalues() -> None:
    """Modes with a state-dependent mass matrix: M a = -(K + alpha e e^T) q - D v about the hanging position, e = (1, 0)."""
    scene = Scene(oscillator="double_pendulum", topology=chain(2), coupling="spring on phi",
                  initial={"phi": 0.3, "psi": 0.2}, parameters={"delta": 0.4})  # fmt: skip
    alpha = np.array([0.0, 0.5, 3.0])
    result = exponents(scene, alpha, starts=1, transient=100, periods=2000, workers=1)
    masses, damping = np.array([[2.0, 1.0], [1.0, 1.0]]), 0.4 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    for strength, exponent, error in zip(alpha, result.exponent, result.stderr, strict=True):
        stiffness = np.diag([2.0 + strength, 1.0])
        lower = -np.linalg.solve(masses, np.hstack([stiffness, damping]))
        largest = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), lower])).real.max()
        assert exponent == pytest.approx(largest, abs=max(3 * error, 1e-3))
