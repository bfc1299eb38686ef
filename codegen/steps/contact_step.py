"""Write the functions that decide between stick and slip, for the events of codegen/driver/contacts.py.

`pushes(t, y, p, out)` stores six groups of NODES numbers, one number for the contact of each node:

    0  level: sliding velocity          2, 3  limits: acceleration under static friction, either way
    1  target: velocity of the ground   4, 5  departures: acceleration at the start of slip, either way

The driver stores three more groups behind these six. If a function of time has jumps or kinks, two numbers follow. Both
change value when time passes a jump or kink: the first is evaluated at the time t, the second a shortest step later.
"""

from __future__ import annotations

from collections.abc import Iterable

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import gaps
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.models.mechanics.events import Event

from ..program.expressions import Expression, Load, Name, Number
from ..program.lowering import lower
from ..program.passes import Hoist, Names, real, share
from ..program.statements import Assign, Function, Role, Statement, accumulate, let, store
from .blocks import assigned
from .places import StateLayout, link_ends, named, span
from .safe_names import NAMES
from .step import lane

ACCELERATIONS = (2, 3, 4, 5)  # the groups of `pushes` to which each link adds its force
SIDES = 9  # number of groups of NODES numbers in front of the two numbers on jumps and kinks in time
# The second of the two numbers is evaluated at t + SOON max(1, t), a step of SHORTEST (codegen/driver/contacts.py).
SOON = sp.Rational(1, 10**13)


def push_functions(equations: Equations, names: Names, looped: bool = False) -> list[Function]:
    """Return the function `pushes`, written out or `looped` over nodes and links; an empty list without contacts."""
    if not equations.sticks:
        return []
    body = (_looped if looped else _written_out)(equations, names)
    about = (
        "For each contact: sliding velocity, ground's velocity, accelerations under static friction both ways, in slip."
    )
    network = ("graph", "weights") if looped else ()
    return [Function("pushes", ("t", "y", "p", "out", *network), about, tuple(body), role=Role.ENTRY)]


def _columns(event: Event) -> tuple[sp.Expr, ...]:
    return event.level, event.target, *event.limits, *event.departures


def time_gaps(template: Node | Edge) -> list[sp.Expr]:
    """Return the functions of time whose zeros are jumps or kinks of the right-hand side, sorted."""
    return sorted(gaps(template), key=sp.default_sort_key)


def jump_sides(zeros: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return two numbers, at t and soon after, that change if any of `zeros` changes sign; () if there are no zeros."""
    # the signs are digits in base 3; a double holds 30 digits exactly
    signs = [3 ** (k % 30) * sp.sign(gap) for k, gap in enumerate(dict.fromkeys(zeros))]
    now = sp.Add(*signs)
    return (now, now.xreplace({TIME: TIME + SOON * sp.Max(1, TIME)})) if signs else ()


def written_sides(equations: Equations) -> tuple[sp.Expr, ...]:
    """Return the numbers of `jump_sides` for all nodes and links."""
    n = equations.n
    zeros = [e.xreplace(equations.at_node(i)) for i in range(n) for e in time_gaps(equations.node_at(i))]
    zeros += [e.xreplace(equations.at_link(link, edge)) for link, edge in equations.linked() for e in time_gaps(edge)]
    return jump_sides(zeros)


def looped_sides(equations: Equations, names: Names, rows: Expression | int) -> tuple[set[sp.Symbol], list[Statement]]:
    """Return the symbols of the numbers of `jump_sides`, and the statements that store them behind the groups of rows."""
    # skip jumps in time whose parameters differ from node to node or link to link: step control handles them
    differing = set(map(real, (*equations.varied, *equations.numbered)))
    zeros = [e for part in equations.templates for e in time_gaps(part) if not e.free_symbols & differing]
    sides = share(jump_sides(zeros), names.fresh("side"))
    stores = [store("out", SIDES * rows + k, lane(lower(e))) for k, e in enumerate(sides.results)]
    return sides.symbols, [*assigned(sides), *stores]


def _written_out(equations: Equations, names: Names) -> list[Statement]:
    n = equations.n
    events = [event for i in range(n) for event in equations.events_at(i)]
    columns = [e for column in zip(*map(_columns, events), strict=True) for e in column]
    body = share([*columns, *written_sides(equations)], names.fresh("z"))
    states = [let(name, Load("y", Number(k))) for k, name in enumerate(equations.state) if real(name) in body.symbols]
    places = [*range(len(columns)), *(SIDES * n + k for k in range(2))]
    stores = [store("out", k, lane(lower(e))) for k, e in zip(places, body.results, strict=False)]
    return [*states, *parameter_loads(equations, body.symbols), *assigned(body), *stores]


def _looped(equations: Equations, names: Names) -> list[Statement]:
    """Write the terms that all nodes share, a loop over the nodes, and a loop over the links."""
    node, places = equations.node, StateLayout(equations)
    (event,) = node.events
    # compute terms once if they contain neither states nor parameters that differ from node to node
    varied = (real(name) for name in equations.varied)
    fixed = Hoist(frozenset((*node.state, *varied)), names.fresh("fixed"), frozenset({TIME}))
    body = share([fixed.apply(e) for e in _columns(event)], names.fresh("z"))
    forces, force = _force(equations, places, event)
    of_sides, sides = looped_sides(equations, names, Name("NODES"))
    used = body.symbols.union(of_sides, *(e.free_symbols for e in (*fixed.table, *force)))
    statements = [*parameter_loads(equations, used), *(let(s.name, lane(lower(e))) for e, s in fixed.table.items())]
    statements += sides
    loop: list[Statement] = [let(s.name, Load("y", places.place(k))) for k, s in enumerate(node.state) if s in used]
    loop += [*places.own(body.symbols), *assigned(body)]
    loop += [store("out", places.place(k), lane(lower(e))) for k, e in enumerate(body.results)]
    statements.append(span("i", "NODES").over(loop))
    if forces:
        statements += [Assign(NAMES, Name("graph"), whole=True), span("e", "target.size").over(forces)]
    return statements


def _force(equations: Equations, places: StateLayout, event: Event) -> tuple[list[Statement], tuple[sp.Expr, ...]]:
    """Return the statements that load and add the force of one link on a sticking body, and the force itself."""
    if not equations.edges:
        return [], ()
    (joint,) = places.joints
    edge, swap = joint.edge, named(joint)
    # in stick (mode 1) the body has the velocity of the ground
    velocity, mode = edge.here[1], edge.here[2]
    force = edge.rhs[1].xreplace({mode: sp.S.One, velocity: event.target})
    loop = [*link_ends(edge, edge.weight.name), *places.of_link(edge, force.free_symbols)]
    for index, states in (("i", edge.here), ("j", edge.there)):
        loop += [let(swap[s].name, Load("y", places.place(k, index))) for k, s in enumerate(states) if force.has(s)]
    loop.append(let("f_link", lower(force.xreplace(swap))))
    return [*loop, *(accumulate("out", places.place(k), "f_link") for k in ACCELERATIONS)], (force,)


def parameter_loads(equations: Equations, used: set[sp.Symbol]) -> list[Statement]:
    first = equations.dimension
    return [let(p, Load("p", Number(first + k))) for k, p in enumerate(equations.parameters) if real(p) in used]
