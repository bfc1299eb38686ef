"""The functions that decide between stick and slip: what a kernel must know of each contact at a state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import gaps
from synchain.models.dynamics.saltation import Entry, Events
from synchain.models.dynamics.variational import Variation
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.models.mechanics.events import Event

from ..program.expressions import ZERO, Compare, Expression, Load, Name, Number, Product, call, plus
from ..program.lowering import lower
from ..program.passes import Hoist, Names, real, share
from ..program.statements import Assign, Function, If, Role, Statement, accumulate, let, store
from .blocks import assigned
from .places import StateLayout, link_ends, named, span
from .safe_names import NAMES
from .step import lane

FORCES = (2, 3, 4, 5)
"""The groups of `pushes` that the force of a link adds to."""

SIDES = 9
"""The group of `pushes` behind which it tells on which sides of zero the jumps and kinks in time are, now and soon."""

SOON = sp.Rational(1, 10**13)
"""The shortest step, as a part of the time: what is zero now has a side then."""


def push_functions(equations: Equations, names: Names, looped: bool = False) -> list[Function]:
    """The function `pushes`, if there are contacts: it writes six groups of NODES numbers, in the order that it tells, and
    two numbers behind nine groups if anything jumps or has a kink in time.

    Written out, it grows with the network; `looped` it runs over nodes and links, which it takes from `graph`.
    """
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


def _sides(found: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """A number that changes if one of some expressions of time passes zero, at this time and soon after; none without any."""
    signs = [3 ** (k % 30) * sp.sign(gap) for k, gap in enumerate(dict.fromkeys(found))]
    now = sp.Add(*signs)
    return (now, now.xreplace({TIME: TIME + SOON * sp.Max(1, TIME)})) if signs else ()


def _ordered(template: Node | Edge) -> list[sp.Expr]:
    return sorted(gaps(template), key=sp.default_sort_key)


def _written_out(equations: Equations, names: Names) -> list[Statement]:
    events = [event for i in range(equations.n) for event in equations.events_at(i)]
    forces = [e for column in zip(*map(_columns, events), strict=True) for e in column]
    zeros = [e.xreplace(equations.at_node(i)) for i in range(equations.n) for e in _ordered(equations.node_at(i))]
    zeros += [e.xreplace(equations.at_link(link, edge)) for link, edge in equations.linked() for e in _ordered(edge)]
    body = share([*forces, *_sides(zeros)], names.fresh("z"))
    states = [let(name, Load("y", Number(k))) for k, name in enumerate(equations.state) if real(name) in body.symbols]
    places = [*range(len(forces)), *(SIDES * equations.n + k for k in range(2))]
    stores = [store("out", k, lane(lower(e))) for k, e in zip(places, body.results, strict=False)]
    return [*states, *_parameters(equations, body.symbols), *assigned(body), *stores]


def _looped(equations: Equations, names: Names) -> list[Statement]:
    """One loop over the nodes with what is fixed for all of them before it, and one over the links.

    Jumps in time with numbers that differ from node to node, or link to link, are left to step control.
    """
    node, nodes = equations.node, span("i", "NODES")
    (event,) = node.events
    varied = (real(name) for name in equations.varied)
    fixed = Hoist(frozenset((*node.state, *varied)), names.fresh("fixed"), frozenset({TIME}))
    body = share([fixed.apply(e) for e in _columns(event)], names.fresh("z"))
    force, link = _force(equations, event)
    differing = set(map(real, (*equations.varied, *equations.numbered)))
    parts: tuple[Node | Edge, ...] = (node, *equations.edges)
    zeros = [e for part in parts for e in _ordered(part) if not e.free_symbols & differing]
    sides = share(_sides(zeros), names.fresh("side"))
    used = body.symbols.union(sides.symbols, *(e.free_symbols for e in (*fixed.table, *link)))
    before = [*_parameters(equations, used), *(let(s.name, lane(lower(e))) for e, s in fixed.table.items())]
    before += assigned(sides)
    before += [store("out", SIDES * Name("NODES") + k, lane(lower(e))) for k, e in enumerate(sides.results)]
    at = StateLayout(equations)
    own: list[Statement] = [let(s.name, Load("y", at.place(k))) for k, s in enumerate(node.state) if s in used]
    own += [*at.own(body.symbols), *assigned(body)]
    own += [store("out", at.place(k), lane(lower(e))) for k, e in enumerate(body.results)]
    if not force:
        return [*before, nodes.over(own)]
    unpacked = Assign(NAMES, Name("graph"), whole=True)
    return [*before, nodes.over(own), unpacked, span("e", "target.size").over(force)]


def _force(equations: Equations, event: Event) -> tuple[list[Statement], tuple[sp.Expr, ...]]:
    """Statements that add the force of one link on a body that sticks, and the expressions they hold."""
    if not equations.edges:
        return [], ()
    at = StateLayout(equations)
    (joint,) = at.joints
    edge, swap = joint.edge, named(joint)
    velocity, mode = edge.here[1], edge.here[2]
    force = edge.rhs[1].xreplace({mode: sp.S.One, velocity: event.target})
    found = [*link_ends(edge, edge.weight.name), *at.of_link(edge, force.free_symbols)]
    for place, states in (("i", edge.here), ("j", edge.there)):
        found += [let(swap[s].name, Load("y", at.place(k, place))) for k, s in enumerate(states) if force.has(s)]
    found.append(let("f_link", lower(force.xreplace(swap))))
    return [*found, *(accumulate("out", at.place(k), "f_link") for k in FORCES)], (force,)


def event_functions(variation: Variation, names: Names) -> list[Function]:
    """The functions that the events of set-valued friction need in a kernel that carries deviations."""
    if variation.events is None:
        return []
    return [*push_functions(variation.orbit, names), *_release(variation.events, variation, names)]


def _release(events: Events, variation: Variation, names: Names) -> list[Function]:
    """The function `release`, which sets the velocities of the deviations in one register."""
    equations, size, strengths = variation.orbit, variation.size, [s.name for s in variation.parameters]
    used = set().union(*(e.free_symbols for e in events.expressions))
    known = enumerate((*equations.state, *equations.parameters))  # the orbit is one, its numbers fill a register
    body: list[Statement] = [
        let(name, call("broadcast", Load("y", Number(k), None), "LANES")) for k, name in known if real(name) in used
    ]
    loaded = enumerate(strengths)
    body += [let(s, register("strengths", len(strengths), k)) for k, s in loaded if real(s) in used]
    for i, sides in enumerate(events.exits):
        after = [
            If(Compare(sign, Name("after"), ZERO), tuple(_gained(entries, size, names)))
            for sign, entries in zip("><", sides, strict=True)
        ]
        body.append(If(Compare("==", Name("i"), Number(i)), tuple(after)))
    about = "Where a contact begins to slip and friction drops at once, deviations that let go early have gained a velocity."
    arguments = ("i", "after", "t", "y", "strengths", "modes", "which")
    return [Function("release", arguments, about, tuple(body), role=Role.ENTRY)]


def register(array: str, size: int, k: int) -> Load:
    """Number k of the registers of one group of modes, which fill `size` registers of an array."""
    return Load(array, size * Name("which") + k, "LANES")


def _gained(entries: Sequence[Entry], size: int, names: Names) -> list[Statement]:
    """Statements that put rows of a deviation together from others."""
    body = share([e for _, e in entries], names.fresh("z"))
    rows: dict[int, list[Expression]] = {}
    for ((row, column), _), e in zip(entries, body.results, strict=True):
        rows.setdefault(row, []).append(Product((lower(e), register("modes", size, column))))
    stores = [store("modes", size * Name("which") + row, plus(*terms)) for row, terms in rows.items()]
    return [*assigned(body), *stores]


def _parameters(equations: Equations, used: set[sp.Symbol]) -> list[Statement]:
    first = equations.dimension
    return [let(p, Load("p", Number(first + k))) for k, p in enumerate(equations.parameters) if real(p) in used]
