"""Saltation: jumps of small deviations from an orbit at the events of set-valued friction.

At an event h = 0 a deviation d is multiplied by the saltation matrix S = I + (F+ - F-) n / (n F- + dh/dt).  F- and F+
are the rates before and after the event, and n = grad h.  Landing in stick makes the velocity of d zero.  A turn
without stick multiplies the velocity of d by the ratio of the accelerations.  At the start of slip F+ = F- and S = I,
unless static friction exceeds the friction of slow slip.  In that case the velocity of d becomes the jump of the
acceleration times the time by which slip begins earlier.  These matrices add multiples of positions to velocities, so
the matrices of contacts that change at the same instant commute.

References
----------
Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapter 7.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Edge, Node
from ..mechanics.contact import SLIP
from ..mechanics.rows import Law, Row, forces
from .equations import Equations

Entry = tuple[tuple[int, int], sp.Expr]
"""((row, column), expression) of a matrix."""


@dataclass(frozen=True, slots=True)
class Events:
    """The rows of a deviation that are velocities of contacts, and the saltation matrices at the start of slip."""

    owners: tuple[int, ...]  # for each row the contact whose velocity the row is, -1 for a position
    # For each contact the rows of S at the start of slip with w > 0, and with w < 0; empty if S = I.
    exits: tuple[tuple[tuple[Entry, ...], tuple[Entry, ...]], ...] = ()
    # Of rows: the deviation after an event of each row, and last after a start with held rows, in the symbols of the state
    # before, of the state `after` the event and of the `deviations`.
    jumps: tuple[tuple[sp.Expr, ...], ...] = ()
    after: tuple[sp.Symbol, ...] = ()
    deviations: tuple[sp.Symbol, ...] = ()

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Events:
        """Return the events with every expression changed."""
        both = ((tuple((key, change(e)) for key, e in side) for side in pair) for pair in self.exits)
        jumps = tuple(tuple(map(change, jump)) for jump in self.jumps)
        return replace(self, exits=tuple((up, down) for up, down in both), jumps=jumps)

    def in_units(self, units: Sequence[sp.Expr]) -> Events:
        """Return the events of deviations in these units of their components."""
        both = (
            (tuple(((r, c), e * units[c] / units[r]) for (r, c), e in side) for side in pair) for pair in self.exits
        )
        inside = {d: unit * d for d, unit in zip(self.deviations, units, strict=False)}
        jumps = (tuple(e.xreplace(inside) / unit for e, unit in zip(jump, units, strict=True)) for jump in self.jumps)
        return replace(self, exits=tuple((up, down) for up, down in both), jumps=tuple(jumps))

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        of_exits = (e for pair in self.exits for side in pair for _, e in side)
        return (*of_exits, *(e for jump in self.jumps for e in jump))


@dataclass(frozen=True, slots=True)
class _Release:
    """The start of slip of one contact in one direction, in the symbols of a network."""

    gradient: tuple[sp.Expr, ...]  # derivatives by the positions of the limit h of the load, at which slip begins
    alone: sp.Expr  # derivative by the position of the contact of the limit h without links
    lead: sp.Expr  # change of the velocity of a deviation divided by the change of h
    limit: sp.Expr  # h


def _releases(orbit: Equations) -> tuple[tuple[_Release, _Release], ...]:
    """Return the starts of slip with w > 0 and with w < 0 of each contact; empty if slip begins without a jump.

    Raises ValueError for links that act on velocities.
    """
    if not any(event.jumps for event in orbit.node.events):
        return ()
    _check_springs(orbit.edges)
    (single,) = orbit.node.events
    states = [orbit.symbols(j) for j in range(orbit.n)]
    positions = [state[0] for state in states]
    releases = []
    for i in range(orbit.n):
        (event,) = orbit.events_at(i)
        rates = [event.target if j == i else state[1] for j, state in enumerate(states)]
        sides = []
        for limit, departure, limit_alone in zip(event.limits, event.departures, single.limits, strict=True):
            # n = grad h of h = limit; lead = (a+ - a-)/(n x' + dh/dt), with a- = 0 in stick.
            gradient = tuple(derivative(limit, x) for x in positions)
            moved = sp.Add(derivative(limit, TIME), *(g * v for g, v in zip(gradient, rates, strict=True)))
            alone = derivative(limit_alone, orbit.node.state[0]).xreplace(orbit.at_node(i))
            sides.append(_Release(gradient, alone, departure / moved, limit))
        releases.append((sides[0], sides[1]))
    return tuple(releases)


def of_rows(
    orbit: Equations,
    owners: Sequence[int],
    slots: Sequence[Sequence[int]],
    pushes: Mapping[tuple[int, int], sp.Matrix],
    names: Sequence[str] = (),
) -> Events:
    """Return the events of rows, for deviations in blocks: block k deviates from the nodes of group `owners[k]`.

    A group is a node, or a part of a network with rows in links; the rates and forces of a part contain its links.
    `slots`: the rows of each block; `pushes`: what block j adds to the rates of block k while its node holds no row.
    Deviations of the parameters `names` follow the blocks.  At an event of a gap h with the reset R a deviation becomes
    R_z d + (F+ - R_z F- - R_t) delta, with delta = n d/(n F- + dh/dt) and n the gradient of h (Leine & Nijmeijer,
    chapter 7).
    """
    size = sum(map(len, slots))
    deviations = sp.symbols(f"deviation_:{size + len(names)}", real=True)
    blocks = [sp.Matrix([deviations[c] for c in slot]) for slot in slots]
    by_names = list(zip((sp.Symbol(name, real=True) for name in names), deviations[size:], strict=True))
    added = [sp.zeros(len(block), 1) for block in blocks]
    for (k, j), push in pushes.items():
        added[k] += push * blocks[j]
    rates = dict(zip((sp.Symbol(name, real=True) for name in orbit.state), orbit.rhs(), strict=True))
    after = [sp.Symbol(f"{name}_then", real=True) for name in orbit.state]

    def change(e: sp.Expr, along: Iterable[tuple[sp.Symbol, sp.Expr]]) -> sp.Expr:
        return sp.Add(*(derivative(e, s) * moved for s, moved in along))

    jumps, start = [], list(deviations)
    states = [sp.Symbol(name, real=True) for name in orbit.state]
    for group, nodes, rows, places in _groups(orbit):
        z = [states[k] for k in places]
        then = {states[k]: after[k] for i in nodes for k in orbit.places[i]}
        held = [row for row in rows if row.law is not Law.RESET]
        own = [k for k, owner in enumerate(owners) if owner == group]
        # the forces of a part hold the states of nodes that links join to it
        others = [(states[k], deviations[k]) for at in slots for k in at] if orbit.joined else []
        along = {k: [*(others or zip(z, blocks[k], strict=True)), *by_names] for k in own}
        for row in rows:
            # the gap that closes: off the surface the level, on it the distance of the force x from its limit
            mode, gap, turned, reset = row.mode, row.level, sp.S.Zero, list(z)
            if row.law is Law.RESET:
                reset = [dict(row.sets).get(s, s) for s in z]
            else:
                limit = row.ratio if row.law is Law.SIGN else sp.S.Zero
                side, off = (then[mode], mode**2) if row.law is Law.SIGN else (-sp.S.One, mode)
                gap, turned = off * row.level + (1 - off) * (limit - side * row.x), -(1 - off) * side
            if row.law is Law.STOP:
                # a stop that is closed after the impact has not rebounded
                kick = mode * (1 + row.ratio * then[mode]) * row.speed / row.stiffness[held.index(row)]
                reset = [s + push * kick for s, push in zip(z, row.push, strict=True)]
            motion = [(s, rates[s]) for s in rates if s in gap.free_symbols and rates[s] != 0]
            passing = change(gap, motion) + derivative(gap, TIME)
            jump = list(deviations)
            for k in own:
                # no answer in parts of more than MOST_ROWS rows, in which links add nothing
                by_links = sp.Add(*(a * e for a, e in zip(row.answer, added[k], strict=False)))
                lead = (change(gap, along[k]) + turned * by_links) / passing
                for c, s, e in zip(slots[k], z, reset, strict=True):
                    gained = rates[s].xreplace(then) - change(e, [(s, rates[s]) for s in z]) - derivative(e, TIME)
                    jump[c] = change(e, along[k]) + gained * lead
            jumps.append(tuple(jump))

        # a start with held rows: deviations along the surfaces alone
        for k in own if held else ():
            kicks = forces(
                [Law.STOP] * len(held),
                [row.mode for row in held],
                [row.stiffness for row in held],
                [change(row.speed, along[k]) for row in held],
            )
            moved = list(blocks[k])
            for a, (row, kick) in enumerate(zip(held, kicks, strict=True)):
                moved = [e + push * kick for e, push in zip(moved, row.push, strict=True)]
                if row.law is Law.STOP:
                    depth = (1 - row.mode) * change(row.level, along[k]) / row.stiffness[a]
                    moved = [e - lift * depth for e, lift in zip(moved, row.lift, strict=True)]
            for c, e in zip(slots[k], moved, strict=True):
                start[c] = e
    return Events((-1,) * len(deviations), (), (*jumps, tuple(start)), tuple(after), deviations)


def _groups(equations: Equations) -> Iterator[tuple[int, Sequence[int], Sequence[Row], Sequence[int]]]:
    """Yield number, nodes, rows and places of continuous states of each part, or of each node, in the order of a kernel."""
    for number, part in enumerate(equations.parts):
        yield number, part.nodes, part.rows, part.places
    for i in () if equations.joined else sorted(range(equations.n), key=equations.kind_of.__getitem__):
        size = len(equations.node_at(i).continuous)
        yield i, (i,), equations.rows_at(i), equations.places[i][:size]


def check_links_of_events(equations: Equations) -> None:
    """Raise ValueError for links with the states that a row changes at once: the order of equal events then matters."""
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


def _force_slope(slope: sp.Matrix) -> sp.Expr:
    """Return the derivative by a position of the force of a link in slip, read from H of `source_slopes`."""
    return slope[1, 0].xreplace({SLIP: sp.S.One})


def of_mode(
    equations: Equations,
    orbit: Equations,
    slopes: Sequence[sp.Matrix],
    strengths: Sequence[sp.Matrix],
    links: Sequence[Sequence[sp.Matrix]],
) -> Events | None:
    """Return the events of a mode of the synchronous orbit, on which the forces of links vanish.

    slopes, strengths: H and the matrix of strengths of each layer (`variational.mode`).
    links: what the links add to the rates of the mode while no row is held (`of_rows`).
    """
    if not orbit.sticks:
        return None
    if orbit.has_rows:
        blocks, size = range(len(links)), len(orbit.node.continuous)
        pushes = {(k, j): -link for k, row in enumerate(links) for j, link in enumerate(row)}
        return of_rows(orbit, [0 for _ in blocks], [range(b * size, (b + 1) * size) for b in blocks], pushes)
    releases = _releases(orbit)
    if releases:
        _check_springs(equations.edges)
    turned = [_force_slope(slope).xreplace(orbit.at_node(0)) for slope in slopes]
    coordinates = range(len(links))

    def entries(side: _Release) -> tuple[Entry, ...]:
        # The gradient of a mode is the gradient of one node minus strength times the slope of the link force.
        table = {}
        for k, j in itertools.product(coordinates, repeat=2):
            pulled = sum((s[k, j] * force for s, force in zip(strengths, turned, strict=True)), sp.S.Zero)
            table[2 * k + 1, 2 * j] = side.lead * (side.alone * int(k == j) - pulled)
        return tuple(table.items())

    return Events((-1, 0) * len(links), tuple((entries(up), entries(down)) for up, down in releases))


def of_network(equations: Equations, names: Sequence[str] = ()) -> Events | None:
    """Return the events of all contacts of a network: row n + i is the velocity of node i relative to its ground.

    Row 2 n + k is the deviation of the k-th parameter of `names`, which moves the limits of the load.
    """
    n = equations.n
    if not equations.sticks:
        return None
    if equations.has_rows:
        check_links_of_events(equations)
        groups = list(_groups(equations))
        joined = {i for _, nodes, _, _ in groups for i in nodes}
        apart = [
            (-1, places[: len(equations.node_at(i).continuous)])
            for i, places in enumerate(equations.places)
            if i not in joined
        ]
        owners, slots = zip(*((group, places) for group, _, _, places in groups), *apart, strict=True)
        return of_rows(equations, owners, slots, {} if equations.joined else _pushes(equations), names)

    def entries(i: int, side: _Release) -> tuple[Entry, ...]:
        slopes = (*((j, g) for j, g in enumerate(side.gradient)), *((2 * n + k, g) for k, g in by_names(side.limit)))
        return tuple(((n + i, column), side.lead * g) for column, g in slopes if g != 0)

    def by_names(limit: sp.Expr) -> Iterable[tuple[int, sp.Expr]]:
        return enumerate(derivative(limit, sp.Symbol(name, real=True)) for name in names)

    exits = tuple((entries(i, up), entries(i, down)) for i, (up, down) in enumerate(_releases(equations)))
    return Events((*[-1] * n, *range(n), *[-1] * len(names)), exits)


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
    """Return the events of the contacts of clusters, for deviations in slots (`variational.ClusterVariation`).

    `pushes`: for each pair of slots the derivative of the links by the state at their sources.
    """
    if not orbit.sticks:
        return None
    if orbit.has_rows:
        check_links_of_events(equations)
        held = {mode: sp.S.One for c in range(orbit.n) for mode in orbit.symbols(c)[len(orbit.node_at(c).continuous) :]}
        return of_rows(orbit, slot_clusters, rows, {key: push.xreplace(held) for key, push in pushes.items()})
    releases = _releases(orbit)
    if releases:
        _check_springs(equations.edges)
    owners = [-1] * sum(map(len, rows))
    exits = [[list[Entry](), list[Entry]()] for _ in releases]
    for k, c in enumerate(slot_clusters):
        velocity = rows[k][1]
        owners[velocity] = c
        slip = {orbit.symbols(c)[2]: sp.S.One}
        for entries, side in zip(exits[c], releases[c], strict=True) if releases else ():
            # The load changes with the position of the slot itself, and with those of the slots that it is linked to.
            gradients = {k: side.gradient[c]}
            for (target, j), push in pushes.items():
                if target == k:
                    gradients[j] = gradients.get(j, sp.S.Zero) + push[1, 0].xreplace(slip)
            entries += [((velocity, rows[j][0]), side.lead * g) for j, g in gradients.items() if g != 0]
    return Events(tuple(owners), tuple((tuple(up), tuple(down)) for up, down in exits))
