"""Solve M rates = r for the series of the rates, if nodes or links have inertia.

`MassRow` is the forward substitution and `Unknown` the back substitution of one unknown.  The pattern of M is known when
the step is written, and determines the order of elimination.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import ONE, ZERO
from ..steps.elimination import Entry, plan
from ..steps.mass_solve import added_masses
from .series import Constant, MassRow, Series, Unknown
from .series_graph import SeriesGraph, split

UNIT = Constant(ONE)


def moving(node: Node, edges: Iterable[Edge]) -> list[bool]:
    """Return, for each state of a node, True if the node or a link can change the state; False for a contact's mode."""
    return [any(moved) for moved in zip(_moved(node), *map(_moved, edges), strict=True)]


def _moved(part: Node | Edge) -> list[bool]:
    """Return, for each state, True if a node or link changes it by a right-hand side or by coupling masses."""
    blocks = [added_masses(part)] if isinstance(part, Node) else part.inertia
    coupled = [[any(e != 0 for e in row) for row in block] for block in blocks if block]
    return [e != 0 or any(block[c] for block in coupled) for c, e in enumerate(part.rhs)]


def solved(graph: SeriesGraph, masses: Mapping[Entry, Series], right: Mapping[int, Series]) -> dict[int, Series]:
    """Return the series of the rates by state, from the entries of M and the right-hand sides."""
    # split each nonzero entry into factor and series; a constant has the series 1
    entries = {key: (s.value, UNIT) if isinstance(s, Constant) else split(s) for key, s in masses.items()}
    entries = {key: e for key, e in entries.items() if e[0] != ZERO}
    # renumber the rows and columns that differ from those of the identity; all other rates are their right-hand sides
    coupled = sorted({k for key, e in entries.items() if not (key[0] == key[1] and e == (ONE, UNIT)) for k in key})
    number = {slot: k for k, slot in enumerate(coupled)}
    inner = {(number[r], number[c]): e for (r, c), e in entries.items() if r in number and c in number}
    symmetric = all(inner.get((c, r)) == e for (r, c), e in inner.items())
    # substitute forward in the order of elimination, and back in the reverse order
    order = plan(len(coupled), set(inner)).order
    rows: list[MassRow] = []
    for r in order:
        row = {k: inner[r, c] for k, c in enumerate(order) if (r, c) in inner}
        rows.append(MassRow(right[coupled[r]], row, tuple(rows), symmetric, name=graph.fresh("row")))
    unknowns: dict[int, Unknown] = {}
    for k in reversed(range(len(rows))):
        unknowns[k] = Unknown(rows[k], dict(unknowns))
    for row_series in rows:
        row_series.unknowns = tuple(unknowns[k] for k in range(len(rows)))
    graph.series += [*rows, *unknowns.values()]
    return {**right, **{coupled[r]: unknowns[k] for k, r in enumerate(order)}}
