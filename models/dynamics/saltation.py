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

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Edge
from ..mechanics.contact import SLIP
from .equations import Equations

Entry = tuple[tuple[int, int], sp.Expr]
"""((row, column), expression) of a matrix."""


@dataclass(frozen=True, slots=True)
class Events:
    """The rows of a deviation that are velocities of contacts, and the saltation matrices at the start of slip."""

    owners: tuple[int, ...]  # for each row the contact whose velocity the row is, -1 for a position
    # For each contact the rows of S at the start of slip with w > 0, and with w < 0; empty if S = I.
    exits: tuple[tuple[tuple[Entry, ...], tuple[Entry, ...]], ...] = ()

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Events:
        """Return the events with every expression changed."""
        both = ((tuple((key, change(e)) for key, e in side) for side in pair) for pair in self.exits)
        return Events(self.owners, tuple((up, down) for up, down in both))

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        return tuple(e for pair in self.exits for side in pair for _, e in side)


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


def check_tangents(equations: Equations) -> None:
    """Raise ValueError for events whose saltation matrices are not supported."""
    if equations.has_rows:
        raise ValueError(
            "tangent dynamics: found contacts of several coordinates, moving grounds or kinds, stops, resets or surfaces; "
            "expected friction of one coordinate on a ground of constant velocity; run the network itself"
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
    equations: Equations, orbit: Equations, slope: sp.Matrix, strength: tuple[sp.Symbol, sp.Symbol], plane: bool
) -> Events | None:
    """Return the events of a mode of the synchronous orbit, on which the forces of links vanish."""
    if not orbit.sticks:
        return None
    check_tangents(equations)
    releases = _releases(orbit)
    if releases:
        _check_springs(equations.edges)
    alpha, beta = strength
    turned = _force_slope(slope).xreplace(orbit.at_node(0))

    def entries(side: _Release) -> tuple[Entry, ...]:
        # The gradient of a mode is the gradient of one node minus strength times the slope of the link force.
        real = side.lead * (side.alone - alpha * turned)
        aside = side.lead * beta * turned
        return (((1, 0), real), ((1, 2), aside), ((3, 0), -aside), ((3, 2), real)) if plane else (((1, 0), real),)

    return Events((-1, 0, -1, 0) if plane else (-1, 0), tuple((entries(up), entries(down)) for up, down in releases))


def of_network(equations: Equations, names: Sequence[str] = ()) -> Events | None:
    """Return the events of all contacts of a network: row n + i is the velocity of node i relative to its ground.

    Row 2 n + k is the deviation of the k-th parameter of `names`, which moves the limits of the load.
    """
    n = equations.n
    if not equations.sticks:
        return None
    check_tangents(equations)

    def entries(i: int, side: _Release) -> tuple[Entry, ...]:
        slopes = (*((j, g) for j, g in enumerate(side.gradient)), *((2 * n + k, g) for k, g in by_names(side.limit)))
        return tuple(((n + i, column), side.lead * g) for column, g in slopes if g != 0)

    def by_names(limit: sp.Expr) -> Iterable[tuple[int, sp.Expr]]:
        return enumerate(derivative(limit, sp.Symbol(name, real=True)) for name in names)

    exits = tuple((entries(i, up), entries(i, down)) for i, (up, down) in enumerate(_releases(equations)))
    return Events((*[-1] * n, *range(n), *[-1] * len(names)), exits)


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
