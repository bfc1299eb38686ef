"""Networks from one node and one edge: the template derivation that holds for any number of oscillators.

The Lagrangian of a network is a sum over nodes and edges, T = sum T_i and V = sum V_i + sum V_edge, so the Euler-Lagrange
equations of a node are those of the single oscillator plus one force for each edge that meets it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from types import ModuleType

import sympy as sp

from . import coupling_matrix
from .calculus import derivative
from .contact import SLIP, set_valued
from .coupling_name import coordinates_of, split
from .equations import TIME, Edge, Equations, Node
from .frictions import CONTACTS, KAPPA
from .lagrangian import Mechanics, mass_matrix
from .mass_solve import solve_masses
from .nondimensional import FRICTION, friction_coefficient, nondimensional, scale, static_coefficient
from .orientation import drawn, is_oriented, link_energy
from .parameter import Parameter
from .plugins import call, load, names
from .topology import Topology

__all__ = ["check_coupling", "connectivity", "edge", "network", "node", "pair_energy", "parameters"]


def parameters(
    oscillator: str, friction: str | None = None, contact: str = "atan", coupling: str | None = None
) -> dict[str, Parameter]:
    """Return every parameter with default, unit, meaning and range, in the order of Equations.parameters.

    Raises ValueError for an unknown oscillator, law, contact or coupling, where the oscillator takes no friction law but
    is given one, or takes one but is given none, and where two of them have a parameter of the same name.
    """
    model, law = _model(oscillator, friction, contact)
    table: dict[str, Parameter] = dict(model.PARAMETERS)
    if law is not None:
        _join(table, law.PARAMETERS, f"friction law {friction!r}")
        if contact == "atan" and friction_coefficient(law, "sign")(sp.Symbol("w", real=True)).has(sp.sign):
            _join(table, {"kappa": KAPPA}, f"contact {contact!r}")
    if coupling is not None:
        own = coupling_matrix if coupling_matrix.is_matrix(coupling) else load("coupling", split(coupling)[0])
        _join(table, own.PARAMETERS, f"coupling {coupling!r}")
    return {name: replace(p, scale=str(scale(model, p.unit))) for name, p in table.items()}


@lru_cache(maxsize=64)
def node(oscillator: str, friction: str | None = None, contact: str = "atan") -> Node:
    """Derive the equations of one oscillator: for a Lagrangian x' = v and v' from the Euler-Lagrange equations.

    Raises ValueError as `parameters` does.
    """
    model, law = _model(oscillator, friction, contact)
    symbols = {name: sp.Symbol(name, real=True) for name in parameters(oscillator, friction, contact)}
    if hasattr(model, "field"):
        state = {name: sp.Symbol(name, real=True) for name in model.STATE}
        rates = call(model.field, {**symbols, **state, "t": TIME})
        return Node(tuple(state.values()), tuple(map(sp.sympify, rates)), tuple(symbols.values()))
    system = nondimensional(model)
    found = system.accelerations()
    if law is not None and contact == "set-valued" and _jumps(law):
        return _sticking(system, found, law, tuple(symbols.values()))
    if law is not None:
        coefficient = friction_coefficient(law, contact)
        found = tuple(e.replace(FRICTION, coefficient) for e in found)
    return Node((*system.coordinates, *system.velocities), (*system.velocities, *found), tuple(symbols.values()))


def _jumps(law: ModuleType) -> bool:
    """True where friction has a jump at rest; without one nothing sticks and the equations are smooth as they are."""
    return hasattr(law, "static") or friction_coefficient(law, "sign")(sp.Symbol("w", real=True)).has(sp.sign)


def _sticking(
    system: Mechanics, found: tuple[sp.Expr, ...], law: ModuleType, parameters: tuple[sp.Symbol, ...]
) -> Node:
    """The node that sticks and slips: states x, v and the mode."""
    if len(found) != 1:
        raise ValueError(f"set-valued contact: the oscillator has {len(found)} coordinates; expected one")
    w = sp.Dummy("w", real=True)
    coefficient = friction_coefficient(law, "set-valued")(w)
    (velocity,) = system.velocities
    rate, contact = set_valued(found[0], FRICTION, coefficient, w, static_coefficient(law), velocity)
    return Node((*system.coordinates, velocity, SLIP), (velocity, SLIP**2 * rate, sp.S.Zero), parameters, contact)


def _join(table: dict[str, Parameter], more: Mapping[str, Parameter], what: str) -> None:
    """Add the parameters of another part; the same name in two parts would silently be one number."""
    for name, parameter in more.items():
        if name in table:
            raise ValueError(f"{what}: its parameter {name!r} has the name of one of another part; rename it")
        table[name] = parameter


def _model(oscillator: str, friction: str | None, contact: str) -> tuple[ModuleType, ModuleType | None]:
    """The modules of an oscillator and its friction law, None where it takes none."""
    model = load("oscillator", oscillator)
    if contact not in CONTACTS:
        raise ValueError(f"unknown contact {contact!r}; known: {', '.join(CONTACTS)}")
    if friction is None:
        if model.FRICTION:
            raise ValueError(
                f"oscillator {oscillator!r} has no friction law; known: {', '.join(names('friction'))}; name one"
            )
        return model, None
    law = load("friction", friction)
    if not model.FRICTION:
        raise ValueError(f"oscillator {oscillator!r} takes no friction law, found {friction!r}; leave it out")
    return model, law


def check_coupling(coupling: str, single: Node) -> None:
    """Raise ValueError where a coupling cannot join nodes: an unknown name or component, a spring without velocities."""
    if coupling_matrix.is_matrix(coupling):
        coupling_matrix.entries(coupling, tuple(s.name for s in single.state))
        return
    load("coupling", split(coupling)[0])
    if single.contact is not None:
        coordinates_of(coupling, (single.state[0].name,))
        return
    half = len(single.state) // 2
    if single.rhs[:half] != single.state[half:]:
        name = single.state[0].name
        raise ValueError(
            f"coupling {coupling!r} joins coordinates with velocities; found a node of {single.state} without them; "
            f"name the components that a link joins, e.g. coupling = '{name}->{name}'"
        )
    coordinates_of(coupling, tuple(s.name for s in single.state[:half]))


@lru_cache(maxsize=64)
def edge(coupling: str, single: Node, oscillator: str | None = None) -> Edge:
    """Derive what one link adds to the rates of its target.

    A text of entries such as "x->x, 1/2 y->z" adds sigma w factor (a_j - a_i) to the rate of its second component, whatever
    the node is.  A spring or damper acts on coordinates followed by their velocities, on all of them or, as in "spring on
    x", on those it names.  `oscillator` names the model whose mass matrix, at the target, turns forces into accelerations;
    without it the masses are 1, as they are in the units of every oscillator with one mass.
    The force is kept as a function of differences, sigma w (x_j - x_i), so that equal states feel exactly nothing.

    An undirected edge is two links, and the template is symmetric, so the two forces are those of the potential.  A one-way
    link has no potential: the force that the template gives its target acts there, and nothing acts back on the source.

    Set-valued friction takes up the force of a link while its target sticks.
    Raises ValueError as `check_coupling` does.
    """
    if single.contact is not None:
        plain = Node(single.state[:2], (single.state[1], sp.S.Zero), single.parameters)
        return _on_sliding(edge(coupling, plain, oscillator))
    check_coupling(coupling, single)
    here = tuple(sp.Symbol(f"{s.name}_i", real=True) for s in single.state)
    there = tuple(sp.Symbol(f"{s.name}_j", real=True) for s in single.state)
    weight = sp.Symbol("weight", real=True)
    if coupling_matrix.is_matrix(coupling):
        sigma = sp.Symbol("sigma", real=True)
        rates = _entry_rates(coupling, [s.name for s in single.state], sigma * weight, here, there)
        return Edge(here, there, weight, rates, (sigma,))
    model, half = load("coupling", split(coupling)[0]), len(single.state) // 2
    strengths = {name: sp.Symbol(name, real=True) for name in model.PARAMETERS}
    chosen = coordinates_of(coupling, tuple(s.name for s in single.state[:half]))
    potential, dissipation = pair_energy(model, here, there, weight, strengths, chosen)
    forces = []
    for q, v in zip(here[:half], here[half:], strict=True):
        force = -derivative(potential, q) - derivative(dissipation, v)
        forces.append(_in_differences(force, here, there))
    masses = _masses(oscillator, here)
    rates = solve_masses(masses, forces, here[half:])
    taken = (*strengths.values(), *(s for s in single.parameters if any(e.has(s) for e in rates)))
    return Edge(here, there, weight, (*[sp.S.Zero] * half, *rates), taken)


def _on_sliding(plain: Edge) -> Edge:
    """A link between nodes with a mode: it acts on the velocity of a target that slips."""
    if plain.rhs[0] != 0:
        raise ValueError("set-valued contact: a link acts on the rate of the position; expected forces alone")
    modes = (sp.Symbol(f"{SLIP.name}_i", real=True), sp.Symbol(f"{SLIP.name}_j", real=True))
    here, there = (*plain.here, modes[0]), (*plain.there, modes[1])
    return Edge(here, there, plain.weight, (sp.S.Zero, modes[0] ** 2 * plain.rhs[1], sp.S.Zero), plain.parameters)


def _entry_rates(
    coupling: str, names: list[str], strength: sp.Expr, here: tuple[sp.Symbol, ...], there: tuple[sp.Symbol, ...]
) -> tuple[sp.Expr, ...]:
    """strength H (there - here), each difference a factor of its own: a sum over all of them would feel round-off."""
    rates = [sp.S.Zero] * len(names)
    for (source, target), factor in coupling_matrix.entries(coupling).items():
        k = names.index(source)
        share = sp.Rational(factor.numerator, factor.denominator)
        rates[names.index(target)] += sp.Mul(share, *strength.args, there[k] - here[k])
    return tuple(rates)


def pair_energy(
    model: ModuleType,
    here: tuple[sp.Symbol, ...],
    there: tuple[sp.Symbol, ...],
    weight: sp.Symbol,
    given: Mapping[str, sp.Symbol],
    chosen: tuple[int, ...],
) -> tuple[sp.Expr, sp.Expr]:
    """Return the potential and the Rayleigh function of a link, summed over the coordinates of number `chosen`.

    `here` and `there` are the states at the target and the source, coordinates followed by their velocities.
    """
    half = len(here) // 2
    potential = dissipation = sp.S.Zero
    for k in chosen:
        if hasattr(model, "potential"):
            potential += link_energy(model.potential, {"q_i": here[k], "q_j": there[k]}, weight, given)
        if hasattr(model, "dissipation"):
            speeds = {"v_i": here[half + k], "v_j": there[half + k]}
            dissipation += link_energy(model.dissipation, speeds, weight, given)
    return potential, dissipation


def _in_differences(e: sp.Expr, here: tuple[sp.Symbol, ...], there: tuple[sp.Symbol, ...]) -> sp.Expr:
    """The expression in terms of `there` - `here` where it depends on nothing else of both, unchanged otherwise."""
    gaps = [sp.Dummy(f"d{k}", real=True) for k in range(len(here))]
    shifted = sp.expand(e.xreplace({q: p + d for p, q, d in zip(here, there, gaps, strict=True)}))
    if shifted.free_symbols & set(here):
        return e
    return sp.factor_terms(shifted).xreplace({d: q - p for p, q, d in zip(here, there, gaps, strict=True)})


def _masses(oscillator: str | None, here: tuple[sp.Symbol, ...]) -> sp.Matrix:
    """The mass matrix of a node at the target of a link."""
    half = len(here) // 2
    if oscillator is None or hasattr(load("oscillator", oscillator), "field"):
        return sp.eye(half)
    system = nondimensional(load("oscillator", oscillator))
    masses = mass_matrix(system.kinetic, system.velocities)
    if masses.has(TIME):
        raise ValueError(
            f"oscillator {oscillator!r}: a coupling needs masses that do not depend on time, found {masses}"
        )
    return masses.xreplace(dict(zip((*system.coordinates, *system.velocities), here, strict=True)))


def network(single: Node, link: Edge | None, graph: Topology) -> Equations:
    """Join copies of a node by the links of a graph; without an edge the nodes stay uncoupled.

    Where a link tells its ends apart, its weight becomes the sign of its direction (`synchain.models.orientation`).
    """
    if link is None:
        return Equations(single, None, graph.n)
    return Equations(single, link, graph.n, drawn(graph) if graph.links and is_oriented(link) else graph.links)


def connectivity(coupling: str, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    """Read G off the coupling: minus the Hessian of its whole potential over sigma, n rows of n fractions.

    The Hessian of one edge is derived once and added up over the links, so that a thousand nodes take no algebra.  For a
    damper the Rayleigh function takes the potential's place; for a one-way link the row is read off the force on its target.
    Of entries such as "1/2 x->y" the factor belongs to H, so that G holds the weights alone.
    Raises ValueError for a coupling whose Hessian between equal states is not sigma times weight times a number: it has no
    matrix G.
    """
    if coupling_matrix.is_matrix(coupling):
        coupling_matrix.entries(coupling)
        diagonal, aside = Fraction(-1), Fraction(1)
    else:
        diagonal, aside = _hessian(coupling)
    rows = [[Fraction(0)] * graph.n for _ in range(graph.n)]
    for target, source, factor in graph.links:
        rows[target][target] += factor * diagonal
        rows[target][source] += factor * aside
    return tuple(map(tuple, rows))


def _hessian(coupling: str) -> tuple[Fraction, Fraction]:
    """Minus the second derivatives of one edge's energy over sigma and weight: twice by one end, and by both.

    Of a non-linear coupling they are taken between equal states, where its links are those of its linear part.
    """
    model = load("coupling", split(coupling)[0])
    q_i, q_j, weight = (sp.Symbol(name, real=True) for name in ("q_i", "q_j", "weight"))
    given = {name: sp.Symbol(name, real=True) for name in model.PARAMETERS}
    function = getattr(model, "potential", None) or model.dissipation
    energy = call(function, {"q_i": q_i, "q_j": q_j, "v_i": q_i, "v_j": q_j, "weight": weight, **given})
    slopes = (-energy.diff(q_i, q).xreplace({q_j: q_i}) for q in (q_i, q_j))
    own, other = (sp.simplify(slope / (given["sigma"] * weight)) for slope in slopes)
    if not (own.is_Rational and other.is_Rational) or own == 0:
        raise ValueError(
            f"coupling {coupling!r}: Hessian over sigma and weight is {own}, {other}; expected numbers other than 0"
        )
    return Fraction(int(own.p), int(own.q)), Fraction(int(other.p), int(other.q))
