"""What the events of set-valued friction do to small deviations from an orbit.

At an event h = 0 a deviation d is multiplied by S = I + (F+ - F-) n / (n F- + dh/dt), n the gradient
of h.  Landing in stick makes the velocity zero, and a turn without stick multiplies it by the ratio
of the accelerations.  When slip begins, F+ = F- and S = I for laws without a jump at rest; if static
friction drops at once to a smaller value, the velocity begins with the jump of the acceleration
times the time by which slip begins earlier.  The maps change velocities only, by positions only, so
those of contacts that change at the same instant commute.

References
----------
Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004),
chapter 7.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Edge
from ..mechanics.contact import SLIP
from .equations import Equations

if TYPE_CHECKING:
    from ..symmetries.clusters import Block

Entry = tuple[tuple[int, int], sp.Expr]
"""((row, column), expression) of a matrix."""


@dataclass(frozen=True, slots=True)
class Events:
    """The rows of a deviation that are velocities, and what the start of slip makes of them."""

    owners: tuple[int, ...]  # the contact that the row is a velocity of, -1 for a position
    # for each contact the entries of the matrix that the start of slip with w > 0, and with w < 0, multiplies its
    # rows by; empty if friction sets in without a jump
    exits: tuple[tuple[tuple[Entry, ...], tuple[Entry, ...]], ...] = ()

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Events:
        """The same with every expression changed."""
        both = ((tuple((key, change(e)) for key, e in side) for side in pair) for pair in self.exits)
        return Events(self.owners, tuple((up, down) for up, down in both))

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions."""
        return tuple(e for pair in self.exits for side in pair for _, e in side)


@dataclass(frozen=True, slots=True)
class Release:
    """The start of slip of one contact in one direction, in the symbols of a network."""

    gradient: tuple[sp.Expr, ...]  # derivatives of the event function by the positions
    own: sp.Expr  # its derivative by the position of the contact without the links
    lead: sp.Expr  # change of the velocity for each unit that the event function is ahead


def _releases(orbit: Equations) -> tuple[tuple[Release, Release], ...]:
    """Return slip with w > 0 and with w < 0 for each contact; empty if slip begins without a jump.

    Raises ValueError for links that act on velocities.
    """
    if not any(event.jumps for event in orbit.node.events):
        return ()
    (alone,) = orbit.node.events
    _check_release(orbit.edges)
    releases = []
    for i in range(orbit.n):
        (event,) = orbit.events_at(i)
        sides = zip(event.limits, event.departures, alone.limits, strict=True)
        up, down = (_release(orbit, i, event.target, *side) for side in sides)
        releases.append((up, down))
    return tuple(releases)


def _release(orbit: Equations, i: int, speed: sp.Expr, event: sp.Expr, jump: sp.Expr, alone: sp.Expr) -> Release:
    positions = [orbit.symbols(j)[0] for j in range(orbit.n)]
    rates = [speed if j == i else orbit.symbols(j)[1] for j in range(orbit.n)]
    gradient = tuple(derivative(event, x) for x in positions)
    moved = sp.Add(derivative(event, TIME), *(g * v for g, v in zip(gradient, rates, strict=True)))
    own = derivative(alone, orbit.node.state[0]).xreplace(orbit.at_node(i))
    return Release(gradient, own, jump / moved)


def _check_release(edges: Iterable[Edge]) -> None:
    """Raise ValueError for links that act on velocities.

    Bodies that let go at the same instant then hasten each other, and the order of their releases
    decides what becomes of a deviation.
    """
    if any(edge.rhs[1].has(ends[1]) for edge in edges for ends in (edge.here, edge.there)):
        raise ValueError(
            "tangent dynamics: slip begins with a jump of acceleration and links act on velocities, so the order of "
            "simultaneous releases matters; expected springs, or f(0+) = mu_s"
        )


def _force_slope(slope: sp.Matrix) -> sp.Expr:
    """The derivative of the force of a link by a position in slip, of H of `source_slopes`."""
    return slope[1, 0].xreplace({SLIP: sp.S.One})


def of_mode(
    equations: Equations, orbit: Equations, slope: sp.Matrix, strength: tuple[sp.Symbol, sp.Symbol], plane: bool
) -> Events | None:
    """Return the events of a mode; on the synchronous orbit the forces of links vanish."""
    if not orbit.sticks:
        return None
    found = _releases(orbit)
    if found:
        _check_release(edge for _, edge in equations.edge_of)
    alpha, beta = strength
    turned = _force_slope(slope).xreplace(orbit.at_node(0))

    def entries(side: Release) -> tuple[Entry, ...]:
        real = side.lead * (side.own - alpha * turned)
        aside = side.lead * beta * turned
        return (((1, 0), real), ((1, 2), aside), ((3, 0), -aside), ((3, 2), real)) if plane else (((1, 0), real),)

    return Events((-1, 0, -1, 0) if plane else (-1, 0), tuple((entries(up), entries(down)) for up, down in found))


def of_network(equations: Equations) -> Events | None:
    """Return the events of all contacts of a network: row n + i is the velocity of node i."""
    n = equations.n
    if not equations.sticks:
        return None

    def entries(i: int, side: Release) -> tuple[Entry, ...]:
        return tuple(((n + i, j), side.lead * g) for j, g in enumerate(side.gradient) if g != 0)

    exits = tuple((entries(i, up), entries(i, down)) for i, (up, down) in enumerate(_releases(equations)))
    return Events((*[-1] * n, *range(n)), exits)


def of_blocks(
    equations: Equations, blocks: Sequence[Block], orbit: Equations, slope: sp.Matrix, strength: sp.Symbol
) -> Events | None:
    """Return the events of the clusters' contacts, which change differences within clusters too."""
    own = of_network(orbit)
    if own is None:
        return None
    sides = _releases(orbit)
    if sides:
        _check_release(edge for _, edge in equations.edge_of)
    owners, exits = list(own.owners), [[list(up), list(down)] for up, down in own.exits]
    for block in blocks:
        first, size = len(owners), len(block.nodes)
        owners += [*[-1] * size, *block.nodes]
        for k, cluster in enumerate(block.nodes if sides else ()):
            turned = strength * _force_slope(slope).xreplace(orbit.at_node(cluster))
            for made, side in zip(exits[cluster], sides[cluster], strict=True):
                for j, weight in enumerate(block.matrix[k]):
                    gradient = sp.Rational(weight.numerator, weight.denominator) * turned + (side.own if j == k else 0)
                    if gradient != 0:
                        made.append(((first + size + k, first + j), side.lead * gradient))
    return Events(tuple(owners), tuple((tuple(up), tuple(down)) for up, down in exits))
