"""The template derivation against the whole network's Lagrangian in one piece, and the matrix read off the coupling."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
import sympy as sp
from catalogue import FORCES, WEIGHTED
from effort import effort
from parts import connectivity, coupling_of, edge, is_lagrangian, law_of, node, oscillator_of, parameters
from sympy.physics import mechanics

from synchain.graphs import Topology, from_matrix, topology
from synchain.models.definitions.definition import FRICTION_LAW, OSCILLATOR
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.network import network
from synchain.models.graphs.families import names as families
from synchain.models.inputs.plugin_files import names
from synchain.models.interactions.coupling import Coupling
from synchain.models.mechanics.components import TIME, Node
from synchain.models.mechanics.contact import ContactModel
from synchain.models.mechanics.nondimensional import FRICTION, friction_coefficient, nondimensional, static_coefficient
from synchain.plugins import Oscillator

SPRING = coupling_of("spring")
HARMONIC = oscillator_of("harmonic")
Q_I, Q_J, V, V_I, V_J, WEIGHT, SIGMA = sp.symbols("q_i q_j v v_i v_j weight sigma", real=True)
CUT = from_matrix([[-1, 1, 0], [1, -1, 0], [0, 0, 0]], "cut")
ONE_WAY = from_matrix([[0, 0, 0], [3, -3, 0], [0, "1/2", "-1/2"]], "one-way")


def undirected() -> list[Topology]:
    """Every family at every size from 1 to 4 that it has, where links go both ways; and two other matrices."""
    collected = [WEIGHTED, CUT]
    for family in families():
        for n in range(1, 5):
            try:
                graph = topology(family, n)
            except ValueError:
                continue
            if graph.symmetric and graph.n <= 4:
                collected.append(graph)
    return collected


def unlike() -> list[Topology]:
    """The first of those with the same matrix, which is all that equations see of a graph."""
    return list({graph.rows: graph for graph in reversed(undirected())}.values())


def identity(graph: Topology) -> str:
    return f"{graph.name}-{graph.n}"


def pairs(graph: Topology) -> list[tuple[int, int, sp.Rational]]:
    """The undirected edges (i, j, weight), each once."""
    return [(i, j, sp.Rational(w.numerator, w.denominator)) for i, j, w in graph.links if i < j]


def in_one_piece(oscillator: str, coupling: str, graph: Topology) -> list[sp.Expr]:
    """The accelerations of a network from its whole Lagrangian by sympy.physics.mechanics, in plain symbols."""
    system, law = nondimensional(oscillator_of(oscillator)), coupling_of(coupling)
    x, v = system.coordinates[0], system.velocities[0]
    q = [mechanics.dynamicsymbols(f"x_{i + 1}") for i in range(graph.n)]
    rate = [mechanics.dynamicsymbols(f"x_{i + 1}", 1) for i in range(graph.n)]
    at = [{x: a, v: b, TIME: mechanics.dynamicsymbols._t} for a, b in zip(q, rate, strict=True)]
    lagrangian = sp.Add(*((system.kinetic - system.potential).xreplace(values) for values in at))
    forces = [system.forces[0].xreplace(values) for values in at]
    for i, j, weight in pairs(graph):
        lagrangian -= law.potential.xreplace({Q_I: q[i], Q_J: q[j], WEIGHT: weight})
        lost = law.dissipation.xreplace({V_I: rate[i], V_J: rate[j], WEIGHT: weight})
        forces = [force - lost.diff(rate[k]) for k, force in enumerate(forces)]
    frame = mechanics.ReferenceFrame("N")
    points = [mechanics.Point(f"P{i}") for i in range(graph.n)]
    for point, speed in zip(points, rate, strict=True):
        point.set_vel(frame, speed * frame.x)
    loads = [(point, force * frame.x) for point, force in zip(points, forces, strict=True)]
    method = mechanics.LagrangesMethod(lagrangian, q, forcelist=loads, frame=frame)
    method.form_lagranges_equations()
    accelerations = method.mass_matrix.LUsolve(method.forcing)
    plain = {b: sp.Symbol(f"v_{i + 1}", real=True) for i, b in enumerate(rate)}
    plain |= {a: sp.Symbol(f"x_{i + 1}", real=True) for i, a in enumerate(q)}
    return [e.xreplace(plain).xreplace({mechanics.dynamicsymbols._t: TIME}) for e in accelerations]


def assemble(oscillator: str, friction: str | None, coupling: str, graph: Topology) -> Equations:
    single = node(oscillator, friction)
    return network(single, edge(coupling, single, oscillator), graph)


LAWS = (("friction", "exponential", "spring"), ("duffing", None, "damper"))
"""All couplings of all oscillators: test_mechanics_proof.py."""


@pytest.mark.parametrize(
    ("oscillator", "friction", "coupling", "graph"),
    [
        pytest.param(*law, graph, id=f"{identity(graph)}-{law[2]}", marks=[pytest.mark.long] * ((turn + k) % 2))
        for k, law in enumerate(LAWS) for turn, graph in enumerate(unlike())
    ],
)  # fmt: skip
def test_template_equals_the_lagrangian_in_one_piece(
    oscillator: str, friction: str | None, coupling: str, graph: Topology
) -> None:
    expected = in_one_piece(oscillator, coupling, graph)
    if friction is not None:
        law = friction_coefficient(law_of(friction), "atan")
        expected = [e.replace(FRICTION, law) for e in expected]
    equations = assemble(oscillator, friction, coupling, graph)
    rates = equations.rhs()
    assert rates[: graph.n] == sp.symbols(f"v_1:{graph.n + 1}", real=True)
    for ours, theirs in zip(rates[graph.n :], expected, strict=True):
        assert sp.expand(ours - theirs) == 0


def test_every_required_family_is_among_the_proved_ones() -> None:
    proved = {graph.rows for graph in unlike()}
    least = {"chain": 1, "complete": 1, "star": 2, "ring": 3}
    graphs = [topology(family, n) for family, first in least.items() for n in range(first, 5)]
    missing = [identity(graph) for graph in graphs if graph.rows not in proved]
    assert missing == []


def test_the_proof_notices_a_wrong_weight() -> None:
    """The comparison above can fail: another weight of one edge is another network."""
    expected = in_one_piece("harmonic", "spring", from_matrix([[-2, 2], [2, -2]]))
    rates = assemble("harmonic", None, "spring", from_matrix([[-1, 1], [1, -1]])).rhs()
    sigma, x_1, x_2 = sp.symbols("sigma x_1 x_2", real=True)
    assert sp.expand(expected[0] - rates[2] - sigma * (x_2 - x_1)) == 0


@pytest.mark.parametrize("graph", undirected(), ids=identity)
def test_connectivity_is_the_hessian_of_the_whole_potential(graph: Topology) -> None:
    q = sp.symbols(f"q_1:{graph.n + 1}", real=True)
    sigma = sp.Symbol("sigma", real=True)
    q_i, q_j = sp.symbols("q_i q_j", real=True)
    total = sp.Add(*(SPRING.potential.xreplace({q_i: q[i], q_j: q[j], WEIGHT: w}) for i, j, w in pairs(graph)))
    expected = -sp.hessian(total, q) / sigma
    rows = connectivity("spring", graph)
    assert sp.Matrix(graph.n, graph.n, lambda i, j: sp.Rational(str(rows[i][j]))) == expected
    assert rows == graph.rows


def test_connectivity_of_the_papers_chain() -> None:
    assert connectivity("spring", topology("chain", 4)) == ((-1, 1, 0, 0), (1, -2, 1, 0), (0, 1, -2, 1), (0, 0, 1, -1))


@pytest.mark.parametrize("coupling", [name for name in FORCES if name != "fput"])
def test_connectivity_of_one_way_links_is_the_jacobian_of_the_forces(coupling: str) -> None:
    equations = assemble("harmonic", None, coupling, ONE_WAY)
    sigma = sp.Symbol("sigma", real=True)
    kind = "v" if coupling_of(coupling).dissipation else "x"
    felt = [rate + sp.Symbol(f"x_{i + 1}", real=True) for i, rate in enumerate(equations.rhs()[3:])]
    moving = sp.symbols(f"{kind}_1:4", real=True)
    matrix = sp.Matrix(felt).jacobian(moving) / sigma
    assert matrix.xreplace(dict.fromkeys(moving[1:], moving[0])).applyfunc(sp.simplify) == ONE_WAY.matrix
    assert connectivity(coupling, ONE_WAY) == ONE_WAY.rows
    assert sp.expand(felt[0]) == 0, "nothing acts back on the source"


def test_connectivity_of_a_thousand_nodes() -> None:
    ring = topology("ring", 1000)
    matrix, calls = effort(lambda: connectivity("spring", ring))
    assert calls < 400 * ring.n
    assert matrix == ring.rows


def sprung(potential: sp.Expr) -> Coupling:
    """The spring with another energy."""
    return replace(SPRING, potential=potential)


def heavy(mass: sp.Expr) -> Oscillator:
    """The harmonic oscillator with another mass."""
    return replace(HARMONIC, model=replace(HARMONIC.model, kinetic=mass * V**2 / 2))


def test_a_coupling_without_a_matrix_is_refused() -> None:
    quartic = sprung(SIGMA * WEIGHT * (Q_I - Q_J) ** 4)
    with pytest.raises(ValueError, match=r"coupling 'spring': Hessian over sigma and weight is 0, 0; expected numbers"):
        connectivity(quartic, topology("chain", 2))
    squared = sprung(SIGMA**2 * WEIGHT * (Q_I - Q_J) ** 2)
    with pytest.raises(ValueError, match=r"coupling 'spring': Hessian over sigma and weight is .*; expected numbers"):
        connectivity(squared, topology("chain", 2))


# -- edges ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("coupling", FORCES)
def test_couplings_are_symmetric_and_called_sigma(coupling: str) -> None:
    law = coupling_of(coupling)
    assert next(iter(law.parameters)) == "sigma"
    single = node("harmonic")
    assert edge(coupling, single, "harmonic").oriented == (coupling == "fput")
    if coupling == "fput":
        return
    assert law.potential or law.dissipation
    back = {Q_I: Q_J, Q_J: Q_I, V_I: V_J, V_J: V_I}
    for energy in (law.potential, law.dissipation):
        assert sp.expand(energy - energy.xreplace(back)) == 0


def test_the_link_keeps_the_difference() -> None:
    """sigma w (x_j - x_i) as one product: expanded, equal states would feel round-off."""
    x_i, x_j, v_i, v_j, weight, sigma = sp.symbols("x_i x_j v_i v_j weight sigma", real=True)
    single = node("friction", "exponential")
    spring, damper = edge("spring", single, "friction"), edge("damper", single, "friction")
    assert spring.rhs == (0, sp.Mul(sigma, weight, x_j - x_i))
    assert damper.rhs == (0, sp.Mul(sigma, weight, v_j - v_i))
    assert spring.diffusive
    assert damper.diffusive


def test_a_nonlinear_link_keeps_the_difference_too() -> None:
    quartic = sprung(SIGMA * WEIGHT * (Q_I - Q_J) ** 4 / 4)
    x_i, x_j, weight, sigma = sp.symbols("x_i x_j weight sigma", real=True)
    assert edge(quartic, node("harmonic")).rhs == (0, sigma * weight * (x_j - x_i) ** 3)


def test_a_link_that_is_no_difference_stays_as_it_is() -> None:
    x_j, weight, sigma = sp.symbols("x_j weight sigma", real=True)
    link = edge(sprung(-SIGMA * WEIGHT * Q_I * Q_J), node("harmonic"))
    assert link.rhs == (0, sigma * weight * x_j)
    assert not link.diffusive


def test_heavy_oscillators_feel_their_links_less() -> None:
    x = sp.Symbol("x", real=True)
    x_i, x_j, weight, sigma = sp.symbols("x_i x_j weight sigma", real=True)
    link = edge("spring", node("harmonic"), heavy(sp.Integer(3)))
    assert sp.expand(link.rhs[1] - sigma * weight * (x_j - x_i) / 3) == 0
    link = edge("spring", node("harmonic"), heavy(1 + x**2))
    assert sp.expand(link.rhs[1] - sigma * weight * (x_j - x_i) / (1 + x_i**2)) == 0, "the mass of the target"
    with pytest.raises(ValueError, match="'harmonic': a coupling needs masses that do not depend on time"):
        edge("spring", node("harmonic"), heavy(1 + TIME**2))


def test_without_an_edge_or_links_nodes_stay_alone() -> None:
    single = node("harmonic")
    assert network(single, None, topology("chain", 3)).links == ()
    alone = network(single, edge("spring", single), topology("chain", 1))
    assert alone.parameters == ()
    assert alone.rhs() == (sp.Symbol("v_1", real=True), -sp.Symbol("x_1", real=True))


# -- names ----------------------------------------------------------------------------------------------------


def models() -> list[tuple[str, str | None]]:
    """Every oscillator with every friction law that it takes."""
    collected: list[tuple[str, str | None]] = []
    for name in names(OSCILLATOR):
        node = oscillator_of(name)
        laws = names(FRICTION_LAW) if len(node.coordinates) == 1 else ("exponential",)
        collected += [(name, law) for law in laws] if node.takes_friction else [(name, None)]
    return collected


@pytest.mark.parametrize(
    ("oscillator", "friction", "contact"),
    [(oscillator, friction, contact) for oscillator, friction in models()
     for contact in (ContactModel if friction else ["atan"])],
)  # fmt: skip
def test_parameters_are_those_of_the_equations(oscillator: str, friction: str | None, contact: str) -> None:
    single = node(oscillator, friction, contact)
    table = parameters(oscillator, friction, contact)
    assert tuple(table) == tuple(s.name for s in single.parameters)
    conditions = tuple(e for event in single.events for e in event.expressions)
    if friction is not None and contact != "set-valued":  # only set-valued contacts know a static coefficient
        conditions = (static_coefficient(law_of(friction)) or sp.S.Zero,)
    used = set().union(*(e.free_symbols for e in (*single.rhs, *conditions)))
    assert {s.name for s in single.parameters} == {s.name for s in used} - {s.name for s in single.state} - {"t"}
    first, last = single.state[0].name, single.continuous[-1].name
    springs = FORCES if is_lagrangian(oscillator) else ()
    if friction and oscillator != "friction":  # each law and contact meets all couplings there, and one of them here
        springs = springs[len(friction) % len(springs) :][:1]
    for coupling in (*springs, f"{first}->{last}"):
        joined = network(single, edge(coupling, single, oscillator), topology("chain", 2))
        assert joined.parameters == tuple(parameters(oscillator, friction, contact, coupling))


def test_steepness_is_a_parameter_only_where_a_jump_is_smoothed() -> None:
    assert "kappa" in parameters("friction", "coulomb", "atan")
    assert "kappa" not in parameters("friction", "coulomb", "sign")
    assert "kappa" not in parameters("friction", "viscous", "atan")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pendulun", None, "atan"), "unknown oscillator 'pendulun'; known: .*duffing, .*friction, .*harmonic"),
        (("frictoin", None, "atan"), r"did you mean 'friction'\?"),
        (("friction", "exponental", "atan"), r"unknown friction 'exponental'; known: coulomb, .*'exponential'\?"),
        (("friction", "exponential", "arctan"), "unknown contact 'arctan'; known: atan, sign"),
        (("friction", None, "atan"), "oscillator 'friction' has no friction law; known: .*exponential"),
        (("duffing", "coulomb", "atan"), "oscillator 'duffing' takes no friction law, found 'coulomb'; leave it out"),
        (("../friction", None, "atan"), "unknown oscillator '../friction'"),
        (("__init__", None, "atan"), "unknown oscillator '__init__'"),
    ],
)
def test_unknown_names(arguments: tuple[str, str | None, str], message: str) -> None:
    for function in (node, parameters):
        with pytest.raises(ValueError, match=message):
            function(*arguments)


def test_unknown_coupling() -> None:
    with pytest.raises(
        ValueError, match=r"unknown coupling 'sprung'; known: cubic_spring, damper, .*did you mean 'spring'"
    ):
        edge("sprung", node("harmonic"))
    with pytest.raises(
        ValueError, match=r"unknown coupling 'sprung'; known: cubic_spring, damper, .*did you mean 'spring'"
    ):
        parameters("harmonic", None, "atan", "sprung")


def test_an_edge_wants_coordinates_and_velocities() -> None:
    x, y = sp.symbols("x y", real=True)
    message = r"'spring' joins coordinates with velocities; found a node of \(x, y\) .* e\.g\. coupling = 'x->x'"
    with pytest.raises(ValueError, match=message):
        edge("spring", Node((x, y), (-y, x), ()))


def test_the_weights_of_a_network_are_exact() -> None:
    third = Fraction(1, 3)
    equations = assemble("harmonic", None, "spring", Topology("pair", 2, ((0, 1, third), (1, 0, third))))
    sigma, x_1, x_2 = sp.symbols("sigma x_1 x_2", real=True)
    assert equations.rhs()[2] == -x_1 + sigma * (x_2 - x_1) / 3
