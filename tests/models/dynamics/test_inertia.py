"""Links with inertia: against sympy.physics.mechanics, exact normal modes, and the conservation of energy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
from catalogue import real
from mechanics_proof import vanishes
from parts import connectivity, node
from samples import clocks
from scipy.integrate import solve_ivp
from sympy.physics import mechanics

from synchain import Scene, load_scene, run
from synchain.codegen.export.python import to_python
from synchain.graphs import chain, from_matrix, topology
from synchain.models.dynamics.equations import Equations

T = mechanics.dynamicsymbols._t


def accelerations(equations: Equations) -> dict[str, sp.Expr]:
    """d(state)/dt by name, solved by SymPy in one piece."""
    mass = sp.Matrix(sp.SparseMatrix(equations.dimension, equations.dimension, equations.mass()))
    return dict(zip(equations.state, mass.LUsolve(sp.Matrix(equations.rhs())), strict=True))


def moving(names: dict[str, str]) -> tuple[list, dict]:
    """Coordinates and the functions of time that stand for the states `names` (coordinate -> velocity)."""
    q = {name: mechanics.dynamicsymbols(name) for name in names}
    swap = {real(v): q[name].diff(T) for name, v in names.items()} | {real(name): q[name] for name in names}
    return list(q.values()), swap


def the_whole_at_once(lagrangian: sp.Expr, forces: dict[str, sp.Expr], names: dict[str, str]) -> dict[str, sp.Expr]:
    """The accelerations that LagrangesMethod finds for the whole network."""
    q, swap = moving(names)
    frame = mechanics.ReferenceFrame("N")
    points = {name: mechanics.Point(f"P_{name}") for name in names}
    for k, name in enumerate(names):  # a point whose velocity is q' takes the generalised force of q
        points[name].set_vel(frame, q[k].diff(T) * frame.x)
    loads = [(points[name], forces[name].subs(swap) * frame.x) for name in names]
    method = mechanics.LagrangesMethod(lagrangian.subs(swap), q, forcelist=loads, frame=frame)
    method.form_lagranges_equations()
    accelerations_of_all = method.mass_matrix.LUsolve(method.forcing)
    back = {value: key for key, value in swap.items()}
    return {v: e.subs(back) for v, e in zip(names.values(), accelerations_of_all, strict=True)}


def pendulums(n: int) -> tuple[Equations, dict[str, str], list[sp.Symbol], list[sp.Symbol]]:
    thetas = [real(f"theta_{i + 2}") for i in range(n)]
    rates = [real(f"theta_rate_{i + 2}") for i in range(n)]
    names = {"x_1": "v_1", **{a.name: b.name for a, b in zip(thetas, rates, strict=True)}}
    return clocks(n), names, thetas, rates


def escapement(theta: sp.Symbol, rate: sp.Symbol) -> sp.Expr:
    return -real("escapement") * ((theta / real("swing")) ** 2 - 1) * rate


def test_clocks_on_a_beam_by_lagranges_method() -> None:
    equations, names, thetas, rates = pendulums(1)
    v, x, mass, sigma = (real(name) for name in ("v_1", "x_1", "mass", "sigma"))
    kinetic = mass * v**2 / 2
    for theta, rate in zip(thetas, rates, strict=True):  # a bob at (x + sin theta, -cos theta), all of it on the beam
        horizontal, vertical = v + sp.cos(theta) * rate, sp.sin(theta) * rate
        kinetic += (horizontal**2 + vertical**2) / 2
    potential = real("stiffness") * x**2 / 2 - sum(map(sp.cos, thetas))
    forces = {"x_1": -real("drag") * v} | {a.name: escapement(a, b) for a, b in zip(thetas, rates, strict=True)}
    expected = the_whole_at_once(kinetic - potential, forces, names)
    computed = accelerations(equations)
    for name, e in expected.items():
        assert vanishes((computed[name] - e).subs(sigma, 1))


@pytest.mark.long
def test_clocks_on_a_beam_by_kanes_method() -> None:
    """Kane's equations from the positions of the bobs: no Lagrangian and no kinetic energy."""
    equations, names, thetas, rates = pendulums(1)
    q, swap = moving(names)
    u = mechanics.dynamicsymbols("u:2")
    frame, origin = mechanics.ReferenceFrame("N"), mechanics.Point("O")
    origin.set_vel(frame, 0)
    beam = origin.locatenew("B", q[0] * frame.x)
    beam.set_vel(frame, u[0] * frame.x)
    bob = beam.locatenew("P", sp.sin(q[1]) * frame.x - sp.cos(q[1]) * frame.y)
    bob.set_vel(frame, (u[0] + sp.cos(q[1]) * u[1]) * frame.x + sp.sin(q[1]) * u[1] * frame.y)
    arm = frame.orientnew("A", "Axis", [q[1], frame.z])
    arm.set_ang_vel(frame, u[1] * frame.z)
    turning = escapement(thetas[0], rates[0]).subs({thetas[0]: q[1], rates[0]: u[1]})
    loads = [(beam, (-real("drag") * u[0] - real("stiffness") * q[0]) * frame.x), (bob, -frame.y),
             (arm, turning * frame.z)]  # fmt: skip
    method = mechanics.KanesMethod(frame, q, u, kd_eqs=[a.diff(T) - b for a, b in zip(q, u, strict=True)])
    method.kanes_equations([mechanics.Particle("beam", beam, real("mass")), mechanics.Particle("bob", bob, 1)], loads)
    theirs = method.mass_matrix.LUsolve(method.forcing)
    back = dict(zip([*q, *u], [real(name) for name in (*names, *names.values())], strict=True))
    computed = accelerations(equations)
    for name, e in zip(names.values(), theirs, strict=True):
        assert vanishes(computed[name].subs(real("sigma"), 1) - e.subs(back))
    assert swap


def test_inerters_by_lagranges_method() -> None:
    graph = from_matrix([["-1/2", "1/2", 0], ["1/2", "-7/2", 3], [0, 3, -3]])
    equations = Scene(oscillator="duffing", coupling="inerter", topology=graph).equations
    names = {f"x_{i}": f"v_{i}" for i in (1, 2, 3)}
    x, v = ([real(f"{c}_{i}") for i in (1, 2, 3)] for c in "xv")
    sigma, beta, delta = real("sigma"), real("beta"), real("delta")
    gaps = (v[0] - v[1]) ** 2 / 2 + 3 * (v[1] - v[2]) ** 2
    kinetic = sum(a**2 for a in v) / 2 + sigma * gaps / 2
    potential = sum(a**2 / 2 + beta * a**4 / 4 for a in x)
    drive = real("u") * sp.cos(real("omega") * real("t"))
    forces = {f"x_{i + 1}": -delta * v[i] + drive for i in range(3)}
    expected = the_whole_at_once(kinetic - potential, forces, names)
    rates = accelerations(equations)
    for name, e in expected.items():
        assert vanishes(rates[name] - e)


def test_the_matrix_of_inerters_is_that_of_springs() -> None:
    graph = chain(4)
    assert connectivity("inerter", graph) == connectivity("spring", graph)
    assert node("clock").state[0].name == "theta"


@pytest.mark.parametrize("integrator", ["rodas5p", pytest.param("dop853", marks=pytest.mark.long)])
def test_unequal_masses_move_in_the_modes_of_the_generalised_eigenproblem(integrator: str) -> None:
    """K a = lambda M a with springs to the ground and inerters between: every start is a sum of such modes."""
    weights, sigma, end = np.array([0.5, 2.0]), 0.4, 20.0
    graph = from_matrix([["-1/2", "1/2", 0], ["1/2", "-5/2", 2], [0, 2, -2]])
    laplacian = np.diag([0.5, 2.5, 2.0]) - np.diag(weights, 1) - np.diag(weights, -1)
    squares, shapes = scipy.linalg.eigh(np.eye(3), np.eye(3) + sigma * laplacian)
    start = np.array([0.3, -0.2, 0.5])
    share = shapes.T @ (np.eye(3) + sigma * laplacian) @ start
    scene = Scene(oscillator="harmonic", coupling="inerter", topology=graph, parameters={"sigma": sigma},
                  initial={"x": start, "v": 0}, transient=0, window=end, record=(), integrator=integrator,
                  rtol=1e-11)  # fmt: skip
    result = run(scene)
    assert result.success
    np.testing.assert_allclose(result.states()[:3], shapes @ (share * np.cos(np.sqrt(squares) * end)), atol=1e-11)


def one_way(name: str) -> Scene:
    """Networks in which somebody feels a node that feels nobody."""
    common = {"coupling": "inerter", "transient": 0, "window": 6, "time_unit": "time", "record": (), "rtol": 1e-10}
    if name == "pair":
        start = {"x": [0.4, -0.3], "v": [0.1, 0.2]}
        return Scene(oscillator="duffing", topology=from_matrix([[0, 0], [1, -1]]), initial=start, **common)
    if name == "feed forward":
        start = {"x": [0.4, -0.3, 0.2], "v": [0.1, 0.2, 0.0]}
        return Scene(oscillator="duffing", topology=topology("feed_forward", 3), initial=start, **common)
    if name == "static friction":
        graph = from_matrix([[0, 0, 0, 0], [1, -1, 0, 0], ["1/2", 0, "-1/2", 0], [0, 1, 2, -3]])
        start = {"x": [0.4, -0.3, 0.2, 0.1], "v": [0.3, 0.5, 0.2, 0.4]}
        law = {"friction": "coulomb_static", "contact": "atan", "parameters": {"kappa": 20.0}}
        return Scene(topology=graph, initial=start, **law, **common)
    hanging = {"coupling": "hanging", "initial": {"x": 0.1, "theta": [0.9, -0.4], "theta_rate": [0.2, 0.5]}}
    graph = from_matrix([[-2, 1, 1], [0, 0, 0], [1, 0, -1]])  # the beam feels both clocks, the first feels nothing
    beam = [{"oscillator": "beam", "at": [1]}]
    return Scene(oscillator="clock", nodes=beam, topology=graph, **{**common, **hanging})


SHORT = (("static friction", "rodas5p"), ("clocks", "dop853"))


@pytest.mark.parametrize(
    ("name", "integrator"),
    [pytest.param(name, method, marks=[pytest.mark.long] * ((name, method) not in SHORT))
     for name in ("pair", "feed forward", "static friction", "clocks") for method in ("rodas5p", "dop853")],
)  # fmt: skip
def test_nodes_may_feel_the_inertia_of_one_that_feels_nobody(name: str, integrator: str) -> None:
    scene = one_way(name).replace(integrator=integrator)
    result = run(scene, reduce=False)
    assert result.success
    space: dict = {}
    exec(to_python(scene.equations, {s: scene.parameters[s] for s in scene.equations.parameters}), space)
    solution = solve_ivp(space["rhs"], (0, 6), scene.y0, "Radau", jac=space["jac"], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(result.states(), solution.y[:, -1], atol=1e-7)


@pytest.mark.long
def test_frictionless_clocks_keep_their_energy_and_their_momentum() -> None:
    """Without escapement, drag and spring energy and the momentum along the beam are constant; swings are large here."""
    free = {"escapement": 0, "drag": 0, "mass": 3}
    scene = load_scene("huygens").replace(
        parameters=free, window=50, samples=51, rtol=1e-11, initial={"theta": [1.5, -0.7], "x": 0, "v": 0.1}
    )
    x, v, a, b, p, q = run(scene).states("trajectory").T
    energy = 1.5 * v**2 + ((v + np.cos(a) * p) ** 2 + (np.sin(a) * p) ** 2) / 2 - np.cos(a) - np.cos(b)
    energy += ((v + np.cos(b) * q) ** 2 + (np.sin(b) * q) ** 2) / 2
    momentum = 5 * v + np.cos(a) * p + np.cos(b) * q
    assert np.ptp(energy) < 2e-9
    assert np.ptp(momentum) < 2e-9
    assert np.ptp(v) > 0.3
    assert np.isfinite(x).all()


def test_huygens_clocks_end_in_antiphase() -> None:
    """Bennett et al., Proc. R. Soc. Lond. A 458, 563 (2002): started nearly in phase the clocks end in antiphase."""
    x, _, first, second, _, _ = run(load_scene("huygens")).states("trajectory").T
    early, late = slice(0, 100), slice(5000, 6001)
    assert np.corrcoef(first[early], second[early])[0, 1] > 0.9
    assert np.corrcoef(first[late], second[late])[0, 1] < -0.99
    assert np.ptp(x[late]) < 0.02 * np.ptp(x[early])


def test_what_an_inerter_refuses() -> None:
    with pytest.raises(ValueError, match="a link has inertia; expected forces alone"):
        Scene(topology=chain(2), coupling="inerter", contact="set-valued").equations  # noqa: B018
