"""Networks from one node and one edge: the template derivation that holds for any number of oscillators.

The Lagrangian of a network is a sum over nodes and edges, T = sum T_i and V = sum V_i + sum V_edge, so the Euler-Lagrange
equations of a node are those of the single oscillator plus one force for each edge that meets it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from types import ModuleType

import sympy as sp

from ..graphs.links import Link
from ..graphs.topology import Topology
from ..inputs.plugins import call, load, named, names, remembered
from ..mechanics import coupling_text
from ..mechanics.calculus import cancelled
from ..mechanics.components import SLIDING, TIME, Edge, Node
from ..mechanics.coupling_text import split
from ..mechanics.friction import CONTACTS, KAPPA
from ..mechanics.lagrangian import Mechanics
from ..mechanics.link import check_coupling, edge
from ..mechanics.nondimensional import FRICTION, friction_coefficient, nondimensional, scale, static_coefficient
from ..mechanics.orientation import is_oriented
from ..mechanics.parameter import Parameter
from ..mechanics.stick_slip import SLIP, set_valued
from .equations import Equations

__all__ = ["check_coupling", "edge", "mixed_network", "network", "node", "oriented_links", "parameters"]


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
        own = coupling_text if coupling_text.is_matrix(coupling) else load("coupling", split(coupling)[0])
        _join(table, own.PARAMETERS, f"coupling {coupling!r}")
    return {name: replace(p, scale=str(scale(model, p.unit))) for name, p in table.items()}


@remembered(oscillator=partial(named, "oscillator"), friction=partial(named, "friction"))
def node(oscillator: str, friction: str | None = None, contact: str = "atan") -> Node:
    """Derive the equations of one oscillator: for a Lagrangian x' = v and v' from the Euler-Lagrange equations.

    Raises ValueError as `parameters` does.
    """
    model, law = _model(oscillator, friction, contact)
    symbols = {name: sp.Symbol(name, real=True) for name in parameters(oscillator, friction, contact)}
    if hasattr(model, "field"):
        own = {name: sp.Symbol(name, real=True) for name in model.STATE}
        rates = call(model.field, {**symbols, **own, "t": TIME})
        return Node(tuple(own.values()), tuple(map(sp.sympify, rates)), tuple(symbols.values()))
    system = nondimensional(model)
    found = cancelled(system.accelerations())
    state = (*system.coordinates, *system.velocities)
    if law is None:
        return Node(state, (*system.velocities, *found), tuple(symbols.values()))
    if contact == "set-valued" and _jumps(law):
        return _sticking(system, found, law, tuple(symbols.values()))
    coefficient = friction_coefficient(law, contact)
    rates = (e.replace(FRICTION, coefficient) for e in found)
    return Node(state, (*system.velocities, *rates), tuple(symbols.values()), law=coefficient(SLIDING))


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
    coefficient = friction_coefficient(law, "set-valued")
    (velocity,) = system.velocities
    rate, contact = set_valued(found[0], FRICTION, coefficient(w), w, static_coefficient(law), velocity)
    rates = (velocity, SLIP**2 * rate, sp.S.Zero)
    return Node((*system.coordinates, velocity, SLIP), rates, parameters, contact, coefficient(SLIDING))


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


def network(single: Node, link: Edge | None, graph: Topology, varied: tuple[str, ...] = ()) -> Equations:
    """Join copies of a node by the links of a graph; without an edge the nodes stay uncoupled.

    The node's parameters named in `varied` get a value for each node.
    Where a link tells its ends apart, its weight becomes the sign of its direction (`synchain.models.mechanics.orientation`).
    """
    if link is None:
        return Equations.of_equal_nodes(single, None, graph.n, (), varied)
    oriented = graph.links and is_oriented(link)
    links = oriented_links(graph) if oriented else graph.links
    return Equations.of_equal_nodes(single, link, graph.n, links, varied)


def mixed_network(
    oscillators: Sequence[str],
    singles: Sequence[Node],
    kinds: Sequence[int],
    coupling: str | None,
    graph: Topology,
    varied: tuple[str, ...] = (),
) -> Equations:
    """Join nodes of several kinds by the links of a graph: `kinds` says of which oscillator each node is.

    Every pair of kinds that a link joins gets its own edge.  Raises ValueError where a coupling does not fit a pair.
    """
    apart = Equations(tuple(singles), tuple(kinds), (), (), varied)
    if coupling is None:
        return apart
    pairs = sorted({apart.ends(link) for link in graph.links})
    edges = tuple(((a, b), edge(coupling, singles[a], oscillators[a], singles[b], oscillators[b])) for a, b in pairs)
    if any(a == b and is_oriented(link) for (a, b), link in edges):
        raise ValueError(f"coupling {coupling!r} tells the ends of a link apart; expected nodes of one kind")
    return replace(apart, links=graph.links, edge_of=edges)


def oriented_links(graph: Topology) -> tuple[Link, ...]:
    """Return the links of a graph with the sign of their direction as weight.

    A link runs from the smaller to the larger number; on a graph that looks alike from every node (a ring) it runs the
    shorter way round, so that the last link runs from the last node to the first.
    Raises ValueError for one-way links and for weights other than 1: strength and direction share one number.
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
