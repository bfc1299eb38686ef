"""Oscillators of four and more coupled coordinates: M q'' = r stays in the equations, and the kernel solves it."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
import sympy as sp
from pendula import ByHand, of_energies, pendulum, real, telescope
from scipy.integrate import solve_ivp

import synchain.runtime
from synchain import Scene, run
from synchain.codegen.export import to_c
from synchain.export import latex, text
from synchain.graphs import chain
from synchain.models.dynamics.network import node
from synchain.models.dynamics.variational import mode, network_variation
from synchain.runtime.cells.paces import Templates
from synchain.runtime.engines.scene_kernels import kernel_source


def hanging(links: int, **more: Any) -> Scene:
    """A pendulum that starts from unequal angles and speeds."""
    start = {f"q{k + 1}": 0.5 + 0.1 * k for k in range(links)} | {f"w{k + 1}": 0.1 * k for k in range(links)}
    symbols: dict[str, Any] = {
        "coupling": None,
        "record": (),
        "transient": 0.0,
        "window": 2.0,
        "rtol": 1e-13,
        "atol": 1e-13,
    }
    return Scene(oscillator=pendulum(links), initial=start, **(symbols | {"parameters": {"delta": 0.1}} | more))


def end_of(scene: Scene) -> np.ndarray:
    """The end state; without reduction, so that scenes with damping and without have one kernel."""
    result = run(scene, workers=1, width=1, reduce=False, show_progress=False)
    assert result.status.item() == 1
    return np.asarray(result.end).ravel()


def by_hand(links: int, end: float, delta: float = 0.1) -> np.ndarray:
    start = np.array(hanging(links).y0)
    solution = solve_ivp(ByHand(links, 1.0, delta).rates, (0.0, end), start, "DOP853", rtol=3e-14, atol=1e-15)
    return solution.y[:, -1]


@pytest.mark.parametrize(
    ("links", "integrator"),
    [
        (4, "auto"),
        pytest.param(4, "cash_karp", marks=pytest.mark.long),
        pytest.param(4, "taylor", marks=pytest.mark.long),
    ],
)  # single steps: tests/codegen/steps/test_emit.py, tests/codegen/taylor/test_mass_series.py
def test_a_pendulum_of_many_links_moves_as_its_matrices_say(links, integrator):
    end = end_of(hanging(links, integrator=integrator))
    assert np.abs(end - by_hand(links, 2.0)).max() < 1e-12


def test_implicit_steps_of_a_mass_matrix_are_right_to_their_tolerance():
    end = end_of(hanging(4, integrator="rodas5p", rtol=1e-10, atol=1e-10))
    assert np.abs(end - by_hand(4, 2.0)).max() < 1e-9


def test_the_energy_of_a_pendulum_of_four_links_stays():
    scene = hanging(4, parameters={"delta": 0.0}, window=20.0)
    energy = ByHand(4, 1.0).energy
    assert abs(energy(end_of(scene)) - energy(np.array(scene.y0))) < 1e-11


@pytest.mark.long
@pytest.mark.parametrize(("links", "seconds"), [(6, 10.0), (20, 60.0)])
def test_long_pendula_are_derived_written_and_compiled_in_seconds(links, seconds, tmp_path, monkeypatch):
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path))
    started = time.process_time()
    end = end_of(hanging(links, window=0.5))
    assert time.process_time() - started < seconds
    assert np.abs(end - by_hand(links, 0.5)).max() < 1e-12


def test_the_equations_keep_the_mass_matrix_and_print_it():
    equations = hanging(4).equations
    q, w = real("q", 4), real("w", 4)
    assert equations.node.inertia[:4] == tuple(tuple(map(sp.Integer, row)) for row in np.eye(8, dtype=int)[:4].tolist())
    for a in range(4):
        for b in range(4):
            expected = (4 - max(a, b)) * sp.cos(q[a] - q[b])
            assert sp.simplify(equations.node.inertia[4 + a][4 + b] - sp.expand_trig(expected)) == 0
    assert w[0] in equations.node.rhs
    first, *_, last = text(equations).splitlines()
    assert first.startswith("4 q1'' cos(q1)² + 4 q1'' sin(q1)²") or first.startswith("q1'' (4 ")
    assert "q4''" in last.partition(" = ")[0]
    assert "gravity sin(q4)" in last.partition(" = ")[2]
    assert latex(equations).count("q_4''") == 4


def test_three_coordinates_are_still_solved_in_the_equations():
    assert node(pendulum(3)).inertia == ()
    assert node(telescope(4)).inertia != ()


def test_the_stiffness_of_a_node_is_that_of_its_rates():
    """The block of the Jacobian that "auto" looks at, against differences of the rates by hand."""
    equations, y = hanging(4).equations, np.array([0.3, 0.2, -0.1, 0.5, 0.1, 0.7, -0.2, 0.3])
    values = {"gravity": 1.0, "delta": 0.4}
    parameter_values = np.array([[values[name] for name in equations.parameters]])
    rates, steps = ByHand(4, 1.0, 0.4).rates, 1e-6 * np.eye(8)
    expected = np.array([(rates(0, y + e) - rates(0, y - e)) / 2e-6 for e in steps]).T
    blocks = Templates(equations).blocks(y[None], parameter_values, np.zeros(1))
    assert np.abs(blocks[0, 0] - expected).max() < 1e-8
    assert ", 0 links, dop853." in kernel_source(hanging(4)).text


def test_an_entry_of_a_matrix_coupling_is_a_rate_and_not_a_force():
    (edge,) = Scene(oscillator=telescope(4), coupling="q1->w2", topology=chain(2), record=()).equations.edges
    masses = sp.Matrix(node(telescope(4)).inertia)
    rates = masses.LUsolve(sp.Matrix(edge.rhs)).applyfunc(sp.simplify)
    push = sp.Symbol("sigma", real=True) * edge.weight * (edge.there[0] - edge.here[0])
    assert [sp.expand(e) for e in rates] == [0] * 5 + [sp.expand(push)] + [0] * 2


@pytest.mark.parametrize("derived", [mode, network_variation])
def test_variational_equations_of_a_mass_matrix_are_refused(derived):
    equations = Scene(oscillator=pendulum(4), coupling="spring on q1", topology=chain(2), record=()).equations
    with pytest.raises(ValueError, match=r"found nodes with a mass matrix \(more than three coupled coordinates\)"):
        derived(equations)


def test_exponents_of_a_mass_matrix_are_refused():
    scene = Scene(oscillator=pendulum(4), coupling="spring on q1", topology=chain(2), record=())
    with pytest.raises(ValueError, match="found nodes with a mass matrix"):
        synchain.thresholds(scene)
    with pytest.raises(ValueError, match="found nodes with a mass matrix"):
        synchain.msf(scene, [0.0, 1.0])


def test_large_networks_of_a_mass_matrix_are_not_exported():
    equations = Scene(oscillator=pendulum(4), coupling="spring on q1", topology=chain(9), record=()).equations
    with pytest.raises(ValueError, match="nodes with a mass matrix in c: expected at most 8 nodes, found 9"):
        to_c(equations)


def test_masses_that_depend_on_time_or_vanish_are_refused():
    (a, b, c, d), t = real("w", 4), sp.Symbol("t", real=True)
    square = (a + b + c + d) ** 2 / 2
    with pytest.raises(ValueError, match="mass matrix of w1, w2, w3, w4 is singular"):
        node(of_energies("rigid", 4, square, sp.S.Zero, sp.S.Zero))
    swelling = square + (2 + sp.cos(t)) * (a**2 + b**2 + c**2 + d**2) / 2
    with pytest.raises(ValueError, match="depend on time; expected a mass matrix of states and parameters"):
        node(of_energies("swelling", 4, swelling, sp.S.Zero, sp.S.Zero))


def test_a_network_of_pendula_says_nothing_of_its_synchrony() -> None:
    """Whether equal motion is a solution is not known of nodes with a mass matrix; a warning must not stop a run."""
    pair = hanging(4).replace(coupling="spring on q1", topology=chain(2), initial={"q1": [0.5, 0.6]})
    assert not any("does not vanish" in sentence for sentence in pair.warnings)
