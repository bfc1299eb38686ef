"""The rates of M rates = r as series, where nodes or links have inertia: the elimination is planned from the pattern of M."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from synchain.models.mechanics.components import Edge, Node

from ..program.expressions import ONE, ZERO, Expression
from ..steps.elimination import Entry, plan
from ..steps.mass_solve import added_masses
from .series import Constant, Row, Series, Unknown
from .series_graph import SeriesGraph, split

Factor = tuple[Expression, Series]


def moving(node: Node, edges: Iterable[Edge]) -> list[bool]:
    """Which states of a node move, by its own rates or by links to it; one at rest, such as the mode of a contact, does not."""
    return [any(found) for found in zip(_moved(node), *map(_moved, edges), strict=True)]


def _moved(part: Node | Edge) -> list[bool]:
    """Which states a node or a link can move: by a right-hand side, or by masses that couple them to others."""
    blocks = [added_masses(part)] if isinstance(part, Node) else part.inertia
    coupled = [[any(e != 0 for e in row) for row in block] for block in blocks if block]
    return [e != 0 or any(block[c] for block in coupled) for c, e in enumerate(part.rhs)]


def solved(graph: SeriesGraph, masses: Mapping[Entry, Series], right: Mapping[int, Series]) -> dict[int, Series]:
    """Return the series of the rates."""
    entries = {key: found for key, s in masses.items() if (found := _factor(s))[0] != ZERO}
    coupled = sorted({k for key, e in entries.items() if not (key[0] == key[1] and e == (ONE, _UNIT)) for k in key})
    place = {slot: number for number, slot in enumerate(coupled)}
    inner = {(place[r], place[c]): e for (r, c), e in entries.items() if r in place and c in place}
    symmetric = all(inner.get((c, r)) == e for (r, c), e in inner.items())
    order = plan(len(coupled), set(inner)).order
    rows: list[Row] = []
    for r in order:
        own = {c: inner[r, slot] for c, slot in enumerate(order) if (r, slot) in inner}
        rows.append(Row(right[coupled[r]], own, tuple(rows), symmetric))
    unknowns: dict[int, Unknown] = {}
    for number in reversed(range(len(rows))):
        unknowns[number] = Unknown(rows[number], dict(unknowns))
    for row in rows:
        row.unknowns = tuple(unknowns[number] for number in range(len(rows)))
    graph.series += [*rows, *unknowns.values()]
    return {**right, **{coupled[r]: unknowns[number] for number, r in enumerate(order)}}


def _factor(series: Series) -> Factor:
    """Constant factor and rest of an entry; a constant entry is all factor."""
    return (series.value, _UNIT) if isinstance(series, Constant) else split(series)


_UNIT = Constant(ONE)
