"""Equations of networks from the oscillator, friction law and coupling that plug-ins define.

The Lagrangian of a network is a sum over nodes and edges, T = sum T_i and V = sum V_i + sum V_edge,
so the Euler-Lagrange equations of a node are those of the single oscillator plus one force for each
edge that meets it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import sympy as sp

from ..definitions.definition import FRICTION_LAW
from ..graphs.links import LINK_LIMIT, AllPairs, Link
from ..graphs.topology import Topology
from ..inputs.plugins import names
from ..interactions.coupling import WEIGHT, Coupling, LagrangianCoupling, MatrixCoupling, Potential
from ..interactions.link import edge
from ..interactions.separation import separated
from ..mechanics.calculus import cancelled, expanded
from ..mechanics.components import WEIGHT_NUMBER, Block, Edge, Node
from ..mechanics.contact import KAPPA, SLIDING, ContactModel, FrictionLaw, regularise
from ..mechanics.events import set_valued
from ..mechanics.lagrangian import LARGEST_BY_MINORS, Mechanics, check_masses_exist, coupled, solve_masses
from ..mechanics.nondimensional import FRICTION, friction_coefficient, nondimensional, scale, static_coefficient
from ..mechanics.oscillator import FieldModel, LagrangianModel, Oscillator
from ..mechanics.parameter import Parameter
from .equations import Equations, Layer

__all__ = ["Layers", "connectivity", "edge", "layered_network", "network", "node", "oriented_links", "parameters"]


def parameters(
    oscillator: Oscillator,
    friction: FrictionLaw | None = None,
    contact: str = ContactModel.ATAN,
    couplings: Sequence[Coupling] = (),
) -> dict[str, Parameter]:
    """Return every parameter with default, unit, meaning and range, in the order of Equations.parameters."""
    _check_parts(oscillator, friction, contact)
    table: dict[str, Parameter] = dict(oscillator.parameters)
    if friction is not None:
        _join(table, friction.parameters, f"friction law {friction.name!r}")
        if contact == ContactModel.ATAN and regularise(friction.force, SLIDING, sp.Symbol("kappa")) != friction.force:
            _join(table, {"kappa": KAPPA}, f"contact {str(contact)!r}")
    for coupling in couplings:
        _join(table, coupling.parameters, f"coupling {str(coupling)!r}", _free_spelling(coupling, oscillator))
    return {name: replace(p, scale=str(scale(oscillator, p.unit))) for name, p in table.items()}


@lru_cache(maxsize=64)
def node(oscillator: Oscillator, friction: FrictionLaw | None = None, contact: str = ContactModel.ATAN) -> Node:
    """Derive the equations of one oscillator: for a Lagrangian x' = v and v' from the Euler-Lagrange equations.

    Raises ValueError as `parameters` does.
    """
    symbols = tuple(sp.Symbol(name, real=True) for name in parameters(oscillator, friction, contact))
    if isinstance(oscillator.model, FieldModel):
        return Node(
            tuple(sp.Symbol(name, real=True) for name in oscillator.model.state), oscillator.model.rates, symbols
        )
    system = nondimensional(oscillator)
    found, inertia = _motion(system)
    state = (*system.coordinates, *system.velocities)
    if friction is None:
        return Node(state, (*system.velocities, *found), symbols, inertia=inertia)
    if contact == ContactModel.SET_VALUED and friction.jumps:
        return _sticking(system, found, friction, symbols)
    coefficient = friction_coefficient(friction, contact)
    rates = (e.replace(FRICTION, coefficient) for e in found)
    return Node(state, (*system.velocities, *rates), symbols, law=coefficient(SLIDING), inertia=inertia)


def _motion(system: Mechanics) -> tuple[tuple[sp.Expr, ...], Block]:
    """The accelerations; of many coupled coordinates r and the masses of M dv/dt = r, with rows for coordinates too."""
    forces, masses = system.balance()
    if len(coupled(masses)) <= LARGEST_BY_MINORS:
        return cancelled(solve_masses(masses, forces, system.velocities)), ()
    check_masses_exist(masses, system.velocities)
    whole = sp.diag(sp.eye(masses.rows), masses)
    return expanded(forces), tuple(map(expanded, whole.tolist()))


def _sticking(
    system: Mechanics, found: tuple[sp.Expr, ...], law: FrictionLaw, parameters: tuple[sp.Symbol, ...]
) -> Node:
    """The node that sticks and slips: states x, v and the mode."""
    if len(found) != 1:
        raise ValueError(f"set-valued contact: the oscillator has {len(found)} coordinates; expected one")
    w = sp.Dummy("w", real=True)
    coefficient = friction_coefficient(law, ContactModel.SET_VALUED)
    (place,), (velocity,) = system.coordinates, system.velocities
    rate, event = set_valued(found[0], FRICTION, coefficient(w), w, static_coefficient(law), place, velocity)
    rates = (velocity, event.mode**2 * rate, sp.S.Zero)
    return Node((place, velocity, event.mode), rates, parameters, (event,), coefficient(SLIDING))


def _join(table: dict[str, Parameter], more: Mapping[str, Parameter], what: str, remedy: str = "rename it") -> None:
    """Add the parameters of another part; the same name in two parts would silently be one number."""
    for name, parameter in more.items():
        if name in table:
            raise ValueError(f"{what}: its parameter {name!r} has the name of one of another part; {remedy}")
        table[name] = parameter


def _free_spelling(coupling: Coupling, oscillator: Oscillator) -> str:
    """What to write for a coupling whose parameter has the name of another one."""
    if isinstance(coupling, MatrixCoupling):
        rates: dict[str, str] = {}
        for source, target, factor in coupling.entries:
            front = "" if factor == 1 else f"{factor}*"
            rates[target] = f"{rates[target]} + " if target in rates else ""
            rates[target] += f"k*{front}W*({source}_j - {source}_i)"
        return f"write Rates({rates}, {{'k': 1}}), whose parameter may have any name"
    if not isinstance(coupling, LagrangianCoupling) or not isinstance(oscillator.model, LagrangianModel):
        return "rename it"
    # The energies of a link are those of the coordinates that it joins, each by itself.
    joined = [c for c in oscillator.model.coordinates if coupling.coordinates is None or c.name in coupling.coordinates]
    if coupling.name == "spring":
        energy = " + ".join(f"k*W*({c.name}_j - {c.name}_i)**2/2" for c in joined)
        return f"write Potential({energy!r}, {{'k': 1}}), whose parameter may have any name"
    if coupling.name == "damper" and len(oscillator.model.coordinates) == 1:
        speed = joined[0].velocity
        rate = f"k*W*({speed}_j - {speed}_i)"
        return f"write Rates({{{speed!r}: {rate!r}}}, {{'k': 1}}), a force per mass, whose parameter may have any name"
    return "write it in a file with another name of the parameter (docs/plugins.md)"


def _check_parts(oscillator: Oscillator, friction: FrictionLaw | None, contact: str) -> None:
    """Raise ValueError for an unknown contact, and if an oscillator lacks a friction law or takes none."""
    ContactModel.parse("contact", contact)
    if friction is None and oscillator.takes_friction:
        raise ValueError(
            f"oscillator {oscillator.name!r} has no friction law; known: {', '.join(names(FRICTION_LAW))}; name one"
        )
    if friction is not None and not oscillator.takes_friction:
        raise ValueError(f"oscillator {oscillator.name!r} takes no friction law, found {friction.name!r}; leave it out")


Layers = Sequence[tuple[Coupling, Topology]]
"""Couplings with their graphs."""


def network(single: Node, link: Edge | None, graph: Topology, varied: tuple[str, ...] = ()) -> Equations:
    """Return the equations of equal nodes that the links of a graph join.

    Notes
    -----
    If a link tells its ends apart, its weight becomes the sign of its direction
    (`synchain.models.interactions.link`).
    """
    apart = Equations.of_equal_nodes(single, None, graph.n, (), varied)
    return apart if link is None else replace(apart, layers=(_layer(apart, link, graph),))


FEW = 8
"""Most nodes of a complete graph whose links are always listed."""


def _layer(apart: Equations, link: Edge, graph: Topology, own: tuple[str, ...] = (), mutual: bool = False) -> Layer:
    """The links of a graph between equal nodes: all pairs, if these make a mean field, or a list.

    Of the parameters `own` each link has a number; links that act on both ends are `mutual`.
    """
    shared = link.with_shared(apart.varied)
    if own:
        return _listed_layer((((0, 0), shared),), graph, own, mutual)
    weight = None if graph.n <= FEW or apart.sticks else graph.all_to_all
    if weight is not None and separated(shared, apart.varied) is not None:
        return Layer((((0, 0), shared),), AllPairs(graph.n, weight))
    if weight is not None and graph.link_count > LINK_LIMIT:
        raise ValueError(
            f"mean field of {graph}: found the rates {', '.join(map(str, link.rhs))}; expected a finite sum of products, "
            f"functions of the target times functions of the source, or at most {LINK_LIMIT} links, which can be listed"
        )
    return Layer((((0, 0), shared),), oriented_links(graph) if graph.link_count and link.oriented else graph.links)


def _listed_layer(
    edges: tuple[tuple[tuple[int, int], Edge], ...], graph: Topology, own: tuple[str, ...], mutual: bool
) -> Layer:
    """The links of a graph, of which each has numbers of its own."""
    oriented = any(link.oriented for _, link in edges)
    if WEIGHT_NUMBER.name in own:
        if oriented:
            raise ValueError(
                "W: found weights as numbers of a coupling that tells the two ends of a link apart; strength and direction "
                "share one number there; expected a parameter of the link"
            )
        edges = tuple((ends, link.with_weight_number()) for ends, link in edges)
    return Layer(edges, oriented_links(graph) if oriented else graph.links, own, mutual and graph.symmetric)


def layered_network(
    oscillators: Sequence[Oscillator],
    singles: Sequence[Node],
    kinds: Sequence[int],
    layers: Layers,
    varied: tuple[str, ...] = (),
) -> Equations:
    """Return the equations of nodes of one or several kinds that layers of links join."""
    names = {s.name for single in singles for s in single.parameters}
    apart = Equations(tuple(singles), tuple(kinds), (), tuple(name for name in varied if name in names))
    of_links = [name for name in varied if name not in names]
    made = []
    for coupling, graph in layers:
        own = tuple(name for name in of_links if name in coupling.parameters or name == WEIGHT_NUMBER.name)
        mutual = isinstance(coupling, LagrangianCoupling | Potential)
        if apart.mixed:
            made.append(_mixed_layer(apart, oscillators, coupling, graph, own, mutual))
        else:
            made.append(_layer(apart, edge(coupling, singles[0], oscillators[0]), graph, own, mutual))
    return replace(apart, layers=tuple(made)) if made else apart


def _mixed_layer(
    apart: Equations,
    oscillators: Sequence[Oscillator],
    coupling: Coupling,
    graph: Topology,
    own: tuple[str, ...],
    mutual: bool,
) -> Layer:
    """The links of a graph between nodes of several kinds."""
    singles, pairs = apart.nodes, sorted({apart.ends(link) for link in graph.links})
    edges = tuple(((a, b), edge(coupling, singles[a], oscillators[a], singles[b], oscillators[b])) for a, b in pairs)
    if any(a == b and link.oriented for (a, b), link in edges):
        raise ValueError(f"coupling {str(coupling)!r} tells the ends of a link apart; expected nodes of one kind")
    shared = tuple((ends, link.with_shared(apart.varied)) for ends, link in edges)
    return _listed_layer(shared, graph, own, mutual) if own else Layer(shared, graph.links)


def connectivity(coupling: Coupling, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    """Read G off the coupling: minus the Hessian of its whole potential over sigma, n rows of n fractions.

    The Hessian of one edge is derived once and added up over the links, so that a thousand nodes take no algebra.  For a
    damper the Rayleigh function takes the potential's place; for a one-way link the row is read off the force on its target.
    Of entries such as "1/2 x->y" the factor belongs to H, so that G holds the weights alone.
    Raises ValueError for a coupling whose Hessian between equal states is not sigma times weight times a number: it has no
    matrix G.
    """
    if isinstance(coupling, MatrixCoupling):
        diagonal, aside = Fraction(-1), Fraction(1)
    elif isinstance(coupling, LagrangianCoupling):
        diagonal, aside = _hessian(coupling)
    else:
        raise ValueError(f"coupling {str(coupling)!r}: found any function of two ends; expected one linear difference")
    rows = [[Fraction(0)] * graph.n for _ in range(graph.n)]
    for target, source, factor in graph.links:
        rows[target][target] += factor * diagonal
        rows[target][source] += factor * aside
    return tuple(map(tuple, rows))


def _hessian(coupling: LagrangianCoupling) -> tuple[Fraction, Fraction]:
    """Minus the second derivatives of one edge's energy over sigma and weight: twice by one end, and by both.

    Of a non-linear coupling they are taken between equal states, where its links are those of its linear part.
    """
    q_i, q_j, v_i, v_j, sigma = sp.symbols("q_i q_j v_i v_j sigma", real=True)
    if coupling.between is not None:
        raise ValueError(
            f"coupling {str(coupling)!r} joins {' and '.join(coupling.between)}; it has no matrix of one coordinate"
        )
    functions = (coupling.potential, coupling.dissipation, coupling.kinetic)
    energy = next((e for e in functions if e != 0), sp.S.Zero).xreplace({v_i: q_i, v_j: q_j})
    slopes = (-energy.diff(q_i, q).xreplace({q_j: q_i}) for q in (q_i, q_j))
    own, other = (sp.simplify(slope / (sigma * WEIGHT)) for slope in slopes)
    if not (own.is_Rational and other.is_Rational) or own == 0:
        raise ValueError(
            f"coupling {str(coupling)!r}: Hessian over sigma and weight is {own}, {other}; expected numbers other than 0"
        )
    return Fraction(int(own.p), int(own.q)), Fraction(int(other.p), int(other.q))


def oriented_links(graph: Topology) -> tuple[Link, ...]:
    """Return the links of a graph with the sign of their direction as weight.

    A link runs from the smaller to the larger number.  On a graph that looks alike from every node,
    such as a ring, it runs the shorter way round, so the last link runs from the last node to the
    first.
    """
    if not graph.symmetric or any(weight != 1 for _, _, weight in graph.links):
        raise ValueError(
            f"topology {graph.name}({graph.n}): found one-way links or weights other than 1; expected neither, since this "
            "coupling tells the two ends of a link apart: choose another graph or coupling"
        )
    return tuple(_directed(graph))


def _directed(graph: Topology) -> Iterator[Link]:
    n = graph.n
    pairs = {(i, j) for i, j, _ in graph.links}
    alike = all(((i + 1) % n, (j + 1) % n) in pairs for i, j in pairs)
    for i, j, _ in graph.links:
        way, back = (j - i) % n, (i - j) % n
        forward = way < back if alike and way != back else i < j
        yield i, j, Fraction(1 if forward else -1)
