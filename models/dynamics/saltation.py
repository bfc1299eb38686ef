"""Saltation: jumps of small deviations from an orbit at the events of contacts and rows.

At an event of a gap h with the reset R a deviation d becomes R_z d + (F+ - R_z F- - R_t) delta, with
delta = n d/(n F- + dh/dt).  F- and F+ are the rates before and after the event, and n = grad h.  For one contact of one
coordinate R is the identity.  Landing in stick then makes the velocity of d zero.  A turn without stick multiplies the
velocity of d by the ratio of the accelerations.  At the start of slip F+ = F- and d does not change, unless static
friction exceeds the friction of slow slip: the velocity of d becomes the jump of the acceleration times the time by which
slip begins earlier.  The matrices of contacts that change at the same instant commute, as they add multiples of positions
to velocities.

References
----------
Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapter 7.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import sympy as sp

from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Edge, Node
from ..mechanics.rows import Law, Row, forces
from .equations import Equations

HALF = sp.S.Half  # between two modes


@dataclass(frozen=True, slots=True)
class Events:
    """The deviation after each event, in the symbols of the state before and after it and of the deviation before it."""

    jumps: tuple[tuple[sp.Expr, ...], ...]  # for each contact or row; last after a start with held ones
    after: tuple[sp.Symbol, ...]
    deviations: tuple[sp.Symbol, ...]

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Events:
        """Return the events with every expression changed."""
        return replace(self, jumps=tuple(tuple(map(change, jump)) for jump in self.jumps))

    def in_units(self, units: Sequence[sp.Expr]) -> Events:
        """Return the events of deviations in these units of their components."""
        inside = {d: unit * d for d, unit in zip(self.deviations, units, strict=False)}
        jumps = (tuple(e.xreplace(inside) / unit for e, unit in zip(jump, units, strict=True)) for jump in self.jumps)
        return replace(self, jumps=tuple(jumps))

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        return tuple(e for jump in self.jumps for e in jump)


Moves = Sequence[tuple[sp.Symbol, sp.Expr]]
"""Symbols and what they change by."""


def _change(e: sp.Expr, moves: Iterable[tuple[sp.Symbol, sp.Expr]]) -> sp.Expr:
    """Return the derivative of an expression along changes of its symbols."""
    return sp.Add(*(derivative(e, s) * moved for s, moved in moves))


class _Bodies(NamedTuple):
    """A node, or a part of a network with rows in links; the rates and forces of a part contain its links."""

    number: int
    nodes: Sequence[int]
    rows: Sequence[Row]
    places: Sequence[int]  # of its continuous states

    @property
    def held(self) -> list[Row]:
        return [row for row in self.rows if row.law is not Law.RESET]


@dataclass(frozen=True, slots=True)
class _Deviations:
    """Deviations from an orbit in blocks, see `events_of`."""

    orbit: Equations
    owners: Sequence[int]
    slots: Sequence[Sequence[int]]
    symbols: tuple[sp.Symbol, ...]
    by_names: Moves  # deviations of parameters
    added: Sequence[sp.Matrix]  # what links add to the rates of each block while its node holds no row
    states: tuple[sp.Symbol, ...]
    then: Mapping[sp.Symbol, sp.Symbol]  # states after an event
    rates: Mapping[sp.Symbol, sp.Expr]

    def blocks(self, group: int) -> list[int]:
        return [k for k, owner in enumerate(self.owners) if owner == group]

    def along(self, k: int, group: _Bodies) -> Moves:
        """Return what block `k` and the parameters change in the forces of a group."""
        # the forces of a part hold the states of nodes that links join to it
        if self.orbit.joined:
            own = [(self.states[c], self.symbols[c]) for slot in self.slots for c in slot]
        else:
            own = [(self.states[p], self.symbols[c]) for p, c in zip(group.places, self.slots[k], strict=True)]
        return [*own, *self.by_names]

    def all(self, changed: Mapping[int, sp.Expr]) -> tuple[sp.Expr, ...]:
        return tuple(changed.get(c, d) for c, d in enumerate(self.symbols))

    # -- one contact of one coordinate for each node -----------------------------------------------------------

    def contact_jumps(self) -> Iterator[tuple[sp.Expr, ...]]:
        """Yield the deviation after an event of each contact, and after a start with contacts that stick."""
        begun = {}
        for i in range(self.orbit.n):
            (event,), mode = self.orbit.events_at(i), self.orbit.symbols(i)[2]
            # slip to slip: ratio of the accelerations after and before; a landing takes the velocity
            after, (up, down) = self.then[mode], event.departures
            turn = sp.Piecewise((up / down, after > HALF), (down / up, after < -HALF), (sp.S.Zero, True))
            jump = {}
            for k in self.blocks(i):
                velocity = self.slots[k][1]
                d = self.symbols[velocity]
                released = d
                if event.jumps:
                    released = sp.Piecewise((self.release(k, i, 0), after > 0), (self.release(k, i, 1), True))
                jump[velocity] = sp.Piecewise((released, mode**2 < HALF), (turn * d, True))
                begun[velocity] = mode**2 * d
            yield self.all(jump)
        yield self.all(begun)

    def release(self, k: int, i: int, side: int) -> sp.Expr:
        """Return the velocity of block `k` after contact `i` begins to slip up (side 0) or down (1) with a jump."""
        (event,) = self.orbit.events_at(i)
        limit, departure = event.limits[side], event.departures[side]
        # (a+ - a-)/(n x' + dh/dt) with a- = 0 in stick and n = grad h of h = limit
        places = [(self.orbit.symbols(j)[0], self.orbit.symbols(j)[1]) for j in range(self.orbit.n)]
        rates = [(x, event.target if j == i else v) for j, (x, v) in enumerate(places)]
        lead = departure / (derivative(limit, TIME) + _change(limit, rates))
        moved = _change(limit, [(places[i][0], self.symbols[self.slots[k][0]]), *self.by_names])
        return (lead * (moved + self.added[k][1])).xreplace(self.then)

    # -- rows --------------------------------------------------------------------------------------------------

    def row_jumps(self) -> Iterator[tuple[sp.Expr, ...]]:
        """Yield the deviation after an event of each row, and after a start with rows that are held."""
        begun: dict[int, sp.Expr] = {}
        for group in _groups(self.orbit):
            for row in group.rows:
                yield self.all(self.after_event(group, row))
            if group.held:
                begun |= self.after_start(group)
        yield self.all(begun)

    def after_event(self, group: _Bodies, row: Row) -> dict[int, sp.Expr]:
        """Return what the components of a deviation become at an event of a row."""
        rates, z = self.rates, [self.states[c] for c in group.places]
        then = {self.states[c]: self.then[self.states[c]] for i in group.nodes for c in self.orbit.places[i]}
        gap, by_force = _closing_gap(row, then)
        reset = _reset(row, z, then, group)
        motion = [(s, rates[s]) for s in rates if s in gap.free_symbols and rates[s] != 0]
        passing = _change(gap, motion) + derivative(gap, TIME)
        jump = {}
        for k in self.blocks(group.number):
            along = self.along(k, group)
            # no answer in parts of more than MOST_ROWS rows, in which links add nothing
            by_links = sp.Add(*(a * e for a, e in zip(row.answer, self.added[k], strict=False)))
            lead = (_change(gap, along) + by_force * by_links) / passing
            for c, s, e in zip(self.slots[k], z, reset, strict=True):
                gained = rates[s].xreplace(then) - _change(e, [(s, rates[s]) for s in z]) - derivative(e, TIME)
                jump[c] = _change(e, along) + gained * lead
        return jump

    def after_start(self, group: _Bodies) -> dict[int, sp.Expr]:
        """Return the components of a deviation along the surfaces of the rows that are held at the start."""
        begun: dict[int, sp.Expr] = {}
        held = group.held
        for k in self.blocks(group.number):
            along = self.along(k, group)
            kicks = forces(
                [sp.S.Zero] * len(held),
                [row.mode for row in held],
                [row.stiffness for row in held],
                [_change(row.speed, along) for row in held],
            )
            moved: list[sp.Expr] = [self.symbols[c] for c in self.slots[k]]
            for a, (row, kick) in enumerate(zip(held, kicks, strict=True)):
                moved = [e + push * kick for e, push in zip(moved, row.push, strict=True)]
                if row.law is Law.STOP:
                    depth = (1 - row.mode) * _change(row.level, along) / row.stiffness[a]
                    moved = [e - lift * depth for e, lift in zip(moved, row.lift, strict=True)]
            begun |= dict(zip(self.slots[k], moved, strict=True))
        return begun


def _closing_gap(row: Row, then: Mapping[sp.Symbol, sp.Symbol]) -> tuple[sp.Expr, sp.Expr]:
    """Return the gap that closes, and its derivative by the force x of the row.

    Off the surface the gap is the level, on it the distance of x from its limit.
    """
    if row.law is Law.RESET:
        return row.level, sp.S.Zero
    limit, side, off = sp.S.Zero, sp.S.NegativeOne, row.mode
    if row.law is Law.SIGN:
        limit, side, off = row.ratio, then[row.mode], row.mode**2
    return off * row.level + (1 - off) * (limit - side * row.x), -(1 - off) * side


def _reset(row: Row, states: Sequence[sp.Symbol], then: Mapping[sp.Symbol, sp.Symbol], group: _Bodies) -> list[sp.Expr]:
    """Return the continuous states of a group after an event of a row, by those before it."""
    if row.law is Law.RESET:
        return [dict(row.sets).get(s, s) for s in states]
    if row.law is Law.SIGN:
        return list(states)
    # a stop that is closed after the impact has not rebounded
    kick = row.mode * (1 + row.ratio * then[row.mode]) * row.speed / row.stiffness[group.held.index(row)]
    return [s + push * kick for s, push in zip(states, row.push, strict=True)]


def _groups(equations: Equations) -> Iterator[_Bodies]:
    """Yield each part, or each node, in the order of a kernel."""
    for number, part in enumerate(equations.parts):
        yield _Bodies(number, part.nodes, part.rows, part.places)
    for i in () if equations.joined else sorted(range(equations.n), key=equations.kind_of.__getitem__):
        size = len(equations.node_at(i).continuous)
        yield _Bodies(i, (i,), equations.rows_at(i), equations.places[i][:size])


def events_of(
    orbit: Equations,
    owners: Sequence[int],
    slots: Sequence[Sequence[int]],
    pushes: Mapping[tuple[int, int], sp.Matrix],
    names: Sequence[str] = (),
) -> Events:
    """Return the events of an orbit, for deviations in blocks: block k deviates from the nodes of group `owners[k]`.

    `slots`: the components of each block; `pushes`: what block j adds to the rates of block k while its node holds no
    row or slips.  Deviations of the parameters `names` follow the blocks.
    """
    if orbit.has_rows and any(row.redundant for group in _groups(orbit) for row in group.rows):
        raise ValueError(
            "tangent dynamics: found contacts that depend on each other, as of two bodies and the ground; expected "
            "independent ones, since their forces at rest are not unique"
        )
    size = sum(map(len, slots))
    symbols = sp.symbols(f"deviation_:{size + len(names)}", real=True)
    by_names = list(zip((sp.Symbol(name, real=True) for name in names), symbols[size:], strict=True))
    added = [sp.zeros(len(slot), 1) for slot in slots]
    for (k, j), push in pushes.items():
        added[k] += push * sp.Matrix([symbols[c] for c in slots[j]])
    states = tuple(sp.Symbol(name, real=True) for name in orbit.state)
    then = {s: sp.Symbol(f"{s.name}_then", real=True) for s in states}
    rates = dict(zip(states, orbit.rhs(), strict=True))
    deviations = _Deviations(orbit, owners, slots, symbols, by_names, added, states, then, rates)
    jumps = deviations.row_jumps() if orbit.has_rows else deviations.contact_jumps()
    return Events(tuple(jumps), tuple(then.values()), symbols)


def check_links_of_events(equations: Equations) -> None:
    """Raise ValueError for links with the states that an event changes at once: the order of equal events then matters."""
    if not equations.has_rows and any(event.jumps for node in equations.nodes for event in node.events):
        _check_springs(equations.edges)
    for (target, source), edge in () if equations.joined else equations.edge_of:
        node = equations.nodes[source]
        _check_link(edge, equations.nodes[target], node, range(len(node.continuous)), node.rows)
    part_of = {i: part for part in equations.parts for i in part.nodes}
    for (target, source, *_), edge in equations.linked() if equations.joined else ():
        part, node = part_of.get(source), equations.node_at(source)
        if part is not None and part is not part_of.get(target):
            places = [part.places.index(k) for k in equations.places[source][: len(node.continuous)]]
            _check_link(edge, equations.node_at(target), node, places, part.template.rows)


def _check_link(edge: Edge, target: Node, source: Node, places: Sequence[int], rows: Sequence[Row]) -> None:
    """Raise ValueError for a link with a state of its source that `rows` change at once; `places`: its columns there."""
    changed = [
        k
        for k, c in enumerate(places)
        for row in rows
        if (row.law is not Law.SIGN or row.ratio != 1) and (row.push[c] != 0 or source.state[k] in dict(row.sets))
    ]
    off = dict.fromkeys(edge.here[len(target.continuous) :], sp.S.One)
    if any(e.xreplace(off).has(edge.there[k]) for e in edge.rhs for k in changed):
        raise ValueError(
            f"tangent dynamics: found links of {', '.join(dict.fromkeys(str(source.state[k]) for k in changed))}, which "
            "events change at once, so the order of simultaneous events matters; expected links of states that no event "
            "changes"
        )


def _check_springs(edges: Iterable[Edge]) -> None:
    """Raise ValueError for links that act on velocities.

    With such links, bodies that begin to slip at the same instant accelerate each other.  A deviation after the event
    then depends on the order in which the bodies begin to slip.
    """
    if any(edge.rhs[1].has(ends[1]) for edge in edges for ends in (edge.here, edge.there)):
        raise ValueError(
            "tangent dynamics: slip begins with a jump of acceleration and links act on velocities, so the order of "
            "simultaneous releases matters; expected springs, or f(0+) = mu_s"
        )


def of_mode(equations: Equations, orbit: Equations, links: Sequence[Sequence[sp.Matrix]]) -> Events | None:
    """Return the events of a mode of the synchronous orbit, on which the forces of links vanish.

    links: what the links take from the rates of each block of the mode while no row is held.
    """
    if not orbit.sticks:
        return None
    if not orbit.has_rows:
        check_links_of_events(equations)
    blocks, size = range(len(links)), len(orbit.node.continuous)
    pushes = {(k, j): -link for k, row in enumerate(links) for j, link in enumerate(row)}
    return events_of(orbit, [0 for _ in blocks], [range(b * size, (b + 1) * size) for b in blocks], pushes)


def of_network(equations: Equations, names: Sequence[str] = ()) -> Events | None:
    """Return the events of a network, for deviations of its continuous states and, behind them, of the parameters `names`.

    The deviation of a velocity under set-valued friction is relative to its ground.
    """
    if not equations.sticks:
        return None
    check_links_of_events(equations)
    groups = list(_groups(equations))
    joined = {i for group in groups for i in group.nodes}
    apart = [
        (-1, places[: len(equations.node_at(i).continuous)])
        for i, places in enumerate(equations.places)
        if i not in joined
    ]
    owners, slots = zip(*((group.number, group.places) for group in groups), *apart, strict=True)
    return events_of(equations, owners, slots, {} if equations.joined else _pushes(equations), names)


def _pushes(equations: Equations) -> dict[tuple[int, int], sp.Matrix]:
    """Return for each pair of linked nodes what a deviation of the second adds to the rates of the first, if no row holds."""
    pushes: dict[tuple[int, int], sp.Matrix] = {}
    for link, edge in equations.linked():
        (i, j), values = link[:2], equations.at_link(link, edge)
        rows, columns = (len(equations.node_at(end).continuous) for end in (i, j))
        off = dict.fromkeys(edge.here[rows:], sp.S.One)
        slope = sp.Matrix(edge.jacobian_there())[:rows, :columns].xreplace(off).xreplace(values)
        pushes[i, j] = pushes.get((i, j), sp.zeros(rows, columns)) + slope
    return pushes


def of_slots(
    equations: Equations,
    orbit: Equations,
    slot_clusters: Sequence[int],
    rows: Sequence[tuple[int, ...]],
    pushes: Mapping[tuple[int, int], sp.Matrix],
) -> Events | None:
    """Return the events of clusters, for deviations in slots (`variational.ClusterVariation`).

    `pushes`: for each pair of slots the derivative of the links by the state at their sources.
    """
    if not orbit.sticks:
        return None
    check_links_of_events(equations)
    slips = {mode: sp.S.One for c in range(orbit.n) for mode in orbit.symbols(c)[len(orbit.node_at(c).continuous) :]}
    return events_of(orbit, slot_clusters, rows, {key: push.xreplace(slips) for key, push in pushes.items()})
