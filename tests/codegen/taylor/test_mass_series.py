"""Taylor steps of equations M d(state)/dt = r: one factorisation at order 0 for the coefficients of all orders."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from march import compiled, step_of
from pendula import ByHand, of_energies, pendulum, real, telescope
from plain import march
from samples import clocks, inertial
from scipy.integrate import solve_ivp

from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import write_looped
from synchain.graphs import chain
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.network import node
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.mechanics.oscillator import Coordinate, LagrangianModel, Oscillator
from synchain.models.mechanics.parameter import Parameter
from synchain.models.scenes.scene import Scene

LINKS = 4
START = np.array([0.5, -0.3, 0.8, 0.1, 0.2, -0.4, 0.3, 0.6])


def alone(links: int) -> Equations:
    return Scene(oscillator=pendulum(links), coupling=None, record=()).equations


def rates_of(equations: Equations, values: list[float]):
    """The rates by SymPy's M and r, solved by NumPy."""
    symbols = [sp.Symbol(s, real=True) for s in (*equations.state, *equations.parameters)]
    size = equations.dimension
    mass = sp.lambdify(symbols, sp.Matrix(sp.SparseMatrix(size, size, equations.mass())))
    time = sp.Symbol("t", real=True)
    forces = sp.lambdify([time, *symbols], list(equations.rhs()))
    return lambda t, y: np.linalg.solve(mass(*y, *values), np.array(forces(t, *y, *values), float))


WAYS = pytest.mark.parametrize(
    ("looped", "python"),
    [pytest.param(looped, python, id=f"{'loops' if looped else 'lines'}{' by Python' * python}",
                  marks=[pytest.mark.long] * (not python))
     for looped in (False, True) for python in (False, True)],
)  # fmt: skip


def end_of(
    equations: Equations, order: int, start: np.ndarray, numbers: list[float], looped: bool, python: bool
) -> np.ndarray:
    """The state at 0.5, by machine code or by Python, which runs the same text."""
    if python:
        return march(equations, order, start, 0.5, 1e-13, numbers=numbers, looped=looped)[0]
    return compiled(equations, order, looped=looped).run(start, numbers, 0.5, 1e-13)[0][0]


@WAYS
def test_a_pendulum_of_many_links_moves_as_its_matrices_say(looped, python):
    end = end_of(alone(LINKS), 8, START, [1.3, 0.2], looped, python)
    expected = solve_ivp(ByHand(LINKS, 1.3, 0.2).rates, (0, 0.5), START, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert np.abs(end - expected).max() < 2e-13


@pytest.mark.parametrize(
    "python", [pytest.param(False, marks=pytest.mark.long, id="compiled"), pytest.param(True, id="by Python")]
)
@pytest.mark.parametrize("equations", [clocks(), inertial()], ids=["masses of the state", "constant masses"])
def test_links_with_inertia_take_series_too(equations, python):
    start = np.linspace(-0.4, 0.6, equations.dimension)
    values = list(np.linspace(0.3, 0.9, len(equations.parameters)))
    end = end_of(equations, 12, start, values, False, python)
    expected = solve_ivp(rates_of(equations, values), (0, 0.5), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert np.abs(end - expected).max() < 2e-13


def tubes(*forces: sp.Expr) -> Oscillator:
    """Tubes within each other, springs at all of them but the first, and some forces."""
    q, w, mass = real("q", LINKS), real("w", LINKS), sp.Symbol("mass", real=True)
    kinetic = mass * sp.Add(*(sp.Add(*w[:k]) ** 2 for k in range(1, LINKS + 1))) / 2
    coordinates = tuple(Coordinate(a.name, b.name, "1") for a, b in zip(q, w, strict=True))
    model = LagrangianModel(coordinates, kinetic, sp.Add(*(a**2 for a in q[1:])) / 2, forces, sp.S.Zero)
    return Oscillator("tubes", FrozenDict({"mass": Parameter(1.0, "1", "a number")}), model)


Q, W = real("q", LINKS), real("w", LINKS)
APART: dict[str, Equations] = {
    "a coordinate without force": Equations.of_equal_nodes(node(tubes(*[sp.S.Zero] * LINKS)), None, 1),
    "forces with kinks": Equations.of_equal_nodes(node(tubes(-abs(Q[0]), sp.S.Zero, -abs(W[1]), sp.S.Zero)), None, 1),
    "unequal masses": Equations.of_equal_nodes(node(telescope(LINKS)), None, 2, (), ("mass",)),
}


@WAYS
@pytest.mark.parametrize("equations", APART.values(), ids=APART)
def test_nodes_move_as_their_masses_and_forces_say(equations, looped, python):
    start = np.linspace(-0.4, 0.6, equations.dimension)
    values = list(np.linspace(0.3, 0.9, len(equations.parameters)))
    end = end_of(equations, 12, start, values, looped, python)
    expected = solve_ivp(rates_of(equations, values), (0, 0.5), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert np.abs(end - expected).max() < 2e-13


def test_inertia_of_links_alone_moves_no_node():
    """Free bodies with an inerter keep their velocities."""
    free = of_energies("free", 1, real("w", 1)[0] ** 2 / 2, sp.S.Zero, sp.S.Zero)
    equations = Scene(oscillator=free, coupling="inerter", topology=chain(2), record=()).equations
    end, _ = compiled(equations, 8).run([0.1, 0.2, 0.5, -0.3], [0.7], 0.5, 1e-13)
    assert end[0] == pytest.approx([0.35, 0.05, 0.5, -0.3], abs=1e-15)


def test_a_matrix_is_factorised_once_and_a_symmetric_one_by_half_the_operations():
    lines = step_of(alone(LINKS), 8).text.splitlines()
    divisions = [line for line in lines if " = 1.0/" in line and line.strip().startswith("i_row")]
    lower = [line for line in lines if line.strip().startswith("l_row")]
    assert (len(divisions), len(lower)) == (LINKS, LINKS * (LINKS - 1) // 2)
    assert all("u_row" in line or "product" in line or "linear" in line for line in lower)


def test_loops_over_links_of_a_mass_matrix_are_refused():
    network = Scene(oscillator=pendulum(4), coupling="spring on q1", topology=chain(9), record=()).equations
    with pytest.raises(
        ValueError, match="taylor: found links of nodes with a mass matrix in a network that is stepped in"
    ):
        write_looped(tidy(network), 8)
    inerters = Scene(oscillator="duffing", coupling="inerter", topology=chain(9), record=()).equations
    with pytest.raises(ValueError, match="taylor: found links with inertia in a network"):
        write_looped(tidy(inerters), 8)
