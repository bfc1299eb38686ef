"""Every shipped Lagrangian oscillator and coupling against LagrangesMethod and KanesMethod of SymPy, found by their files.

Our accelerations, put into their equations M a = f, must leave exactly zero.  A new file is tested without an edit here.
"""

from __future__ import annotations

import pytest
import sympy as sp
from catalogue import FORCES, LAGRANGIAN, WEIGHTED
from mechanics_proof import PARTICLES, T, by_kane, by_lagrange, residual, vanishes, whole
from parts import edge, node, oscillator_of
from parts import law_of as friction_law

from synchain.graphs import Topology, topology
from synchain.models.definitions.definition import OSCILLATOR
from synchain.models.dynamics.network import network
from synchain.models.inputs.plugin_files import names
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.nondimensional import FRICTION, friction_coefficient, nondimensional

PLAIN = [name for name in LAGRANGIAN if len(nondimensional(oscillator_of(name)).coordinates) == 1]
METHODS = [by_lagrange, by_kane]


def law_of(oscillator: str) -> str | None:
    return "viscous" if oscillator_of(oscillator).takes_friction else None


def accelerations(oscillator: str, coupling: str | None, graph: Topology, oriented: str = "") -> dict[str, sp.Expr]:
    """Ours, keyed by coordinate; velocities are called rate_ and their coordinate."""
    single = node(oscillator, law_of(oscillator))
    half = len(single.state) // 2
    equations = network(single, edge(coupling + oriented, single, oscillator) if coupling else None, graph)
    names_of = [s.name for s in single.state]
    rates = {
        sp.Symbol(f"{v}_{i + 1}", real=True): sp.Symbol(f"rate_{q}_{i + 1}", real=True)
        for q, v in zip(names_of[:half], names_of[half:], strict=True)
        for i in range(graph.n)
    }
    accelerations_of_all = equations.rhs()[half * graph.n :]
    keys = [f"{q}_{i + 1}" for q in names_of[:half] for i in range(graph.n)]
    return {key: e.xreplace(rates) for key, e in zip(keys, accelerations_of_all, strict=True)}


def check(method: object, oscillator: str, coupling: str | None, graph: Topology, on: tuple[str, ...] = ()) -> None:
    system = whole(oscillator, coupling, graph, on or None)
    if law_of(oscillator):
        law = friction_coefficient(friction_law("viscous"), "sign")
        forces = tuple(e.replace(FRICTION, law) for e in system.forces)
        system = type(system)(system.q, system.rates, system.kinetic, system.potential, forces, system.particles)
    ours = accelerations(oscillator, coupling, graph, f" on {', '.join(on)}" if on else "")
    for e in residual(system, method(system), ours):  # type: ignore[operator]
        assert vanishes(e)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("oscillator", LAGRANGIAN)
def test_every_oscillator_alone(oscillator: str, method: object) -> None:
    check(method, oscillator, None, topology("chain", 1))


@pytest.mark.parametrize("coupling", FORCES)
@pytest.mark.parametrize("oscillator", PLAIN)
def test_every_coupling_between_two_of_every_oscillator(oscillator: str, coupling: str) -> None:
    """By one method each, in turn: every oscillator and every coupling meets both."""
    method = METHODS[(PLAIN.index(oscillator) + FORCES.index(coupling)) % 2]
    check(method, oscillator, coupling, topology("chain", 2))


@pytest.mark.parametrize("coupling", FORCES)
def test_every_coupling_among_three(coupling: str) -> None:
    """By one method each, in turn."""
    method = METHODS[FORCES.index(coupling) % 2]
    check(method, "duffing", coupling, topology("chain", 3))
    if coupling != "fput":
        check(method, "pendulum", coupling, WEIGHTED)


@pytest.mark.parametrize("oscillator", PLAIN)
def test_every_oscillator_in_a_weighted_triple(oscillator: str) -> None:
    check(by_lagrange, oscillator, "spring", WEIGHTED)


@pytest.mark.parametrize(("n", "coupling"), [(2, "torsion"), (2, "damper"), (3, "spring")])
def test_double_pendulums(coupling: str, n: int) -> None:
    """The coupling meets a mass matrix that depends on the state of its target."""
    check(by_lagrange, "double_pendulum", coupling, topology("chain", n))


def test_couplings_on_one_coordinate() -> None:
    check(by_lagrange, "double_pendulum", "spring", topology("chain", 2), ("psi",))
    check(by_kane, "double_pendulum", "torsion", topology("chain", 2), ("phi",))


@pytest.mark.long
def test_a_coupling_on_one_of_three_coordinates() -> None:
    check(by_lagrange, "belt_double_pendulum", "spring", topology("chain", 2), ("x",))


@pytest.mark.parametrize("oscillator", [name for name in LAGRANGIAN if name in PARTICLES])
def test_the_kinetic_energy_is_that_of_the_particles(oscillator: str) -> None:
    system = whole(oscillator, None, topology("chain", 1))
    moving = sum(mass * (x.diff(T) ** 2 + y.diff(T) ** 2) / 2 for mass, x, y in system.particles)
    assert len(system.particles) > 1
    assert vanishes(sp.expand(moving - system.kinetic))


@pytest.mark.parametrize("method", METHODS)
def test_a_wrong_term_is_seen(method: object) -> None:
    """Of the oscillator whose own terms leave nothing in a test above."""
    system = whole("double_pendulum", None, topology("chain", 1))
    ours = accelerations("double_pendulum", None, topology("chain", 1))
    wrong = {**ours, "psi_1": ours["psi_1"] + sp.sin(sp.Symbol("psi_1", real=True)) / 1000}
    assert not all(vanishes(e) for e in residual(system, method(system), wrong))  # type: ignore[operator]
    assert not vanishes(sp.sin(TIME) ** 2 + sp.cos(TIME) ** 2 - sp.Rational(999, 1000))


# -- vector fields: the published form, written out by hand ----------------------------------------------------

PUBLISHED = {
    "rossler": ("-y - z", "x + a*y", "b + x*z - c*z"),
    "lorenz": ("-prandtl*x + prandtl*y", "-x*z + rayleigh*x - y", "x*y - b*z"),
    "chua": ("p*(y - x - b*x - (a - b)*(Abs(x + 1) - Abs(x - 1))/2)", "x - y + z", "-q*y"),
    "fitzhugh_nagumo": ("c*(y + x - x**3/3 + current)", "-(x - a + b*y)/c"),
}


@pytest.mark.parametrize("oscillator", [name for name in names(OSCILLATOR) if name not in LAGRANGIAN])
def test_vector_fields_are_the_published_ones(oscillator: str) -> None:
    single = node(oscillator)
    assert oscillator in PUBLISHED, f"write the published equations of {oscillator} into PUBLISHED"
    symbols = {s.name: s for s in (*single.state, *single.parameters)}
    for ours, text in zip(single.rhs, PUBLISHED[oscillator], strict=True):
        assert sp.expand(ours - sp.sympify(text, locals=symbols)) == 0
