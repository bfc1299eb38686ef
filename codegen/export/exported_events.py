"""Events in exported texts: the numbers of the rows of all nodes, and the functions that locate and apply events."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.events import Event
from synchain.models.mechanics.rows import NO_MODE, Law, Row, struck

from .. import driver
from ..integrators import dop853
from ..program.expressions import Expression, Load, Number
from ..program.passes import real
from ..program.statements import Statement, Store, Titled
from . import event_text
from .body import ExportBody, is_unrolled, wrapped

LAWS = {Law.SIGN: 0, Law.STOP: 1, Law.RESET: 2}  # the numbers of laws in the text

MARK = "# --- exported text below ---\n"

Part = tuple[int, tuple[Row, ...]]  # a node and its rows, in the symbols of the network


def has_events(model: Equations) -> bool:
    """Return True if an exported text runs through the events of a network."""
    return model.sticks and is_unrolled(model)


def without_events(model: Equations, language: str) -> list[str]:
    """Return a line for the head of a text that has no events, though the network has."""
    if not model.sticks or (language != "numba" and is_unrolled(model)):
        return []
    way = "export Python or C" if is_unrolled(model) else "export at most 8 nodes"
    return [f"No events: the caller finds where modes change or states are reset; for a text with events {way}"]


def parts(model: Equations) -> list[Part]:
    """Return the rows of each node."""
    rows = [
        (i, model.rows_at(i) or tuple(_as_row(event, model.symbols(i)[1]) for event in model.events_at(i)))
        for i in range(model.n)
    ]
    return [(i, each) for i, each in rows if each]


def _as_row(event: Event, velocity: sp.Symbol) -> Row:
    """Return a contact of one coordinate on a steady ground as a row with the states x and v."""
    zero, fall = sp.S.Zero, event.level.diff(velocity)
    above, below = (sp.expand(fall * e) for e in event.departures)
    rate, stiff = (below + above) / 2, sp.factor_terms((below - above) / 2)
    top, low = (sp.expand(a - b) for a, b in (event.limits, event.departures))
    ratio = sp.cancel(top / low) if low != 0 else sp.oo
    if ratio == sp.oo:
        raise ValueError(
            "events in exports: found a friction law that is 0 in slow slip; expected f(0+) > 0, as in 'coulomb'"
        )
    held = 1 - event.mode**2
    x = event.mode + held * rate / (held * stiff + event.mode**2)
    return Row(Law.SIGN, event.mode, event.level, event.level, rate, (zero, fall), (zero, -stiff / fall), (stiff,),
               ratio, x, (zero, zero), (zero, 1 / fall))  # fmt: skip


class EventText:
    """The functions `pushes` and `strike` of a network, and the constants of its text."""

    def __init__(self, model: Equations) -> None:
        self.model, self.parts = model, parts(model)
        self.count = sum(len(rows) for _, rows in self.parts)
        self.groups = event_text.K + max(len(rows) for _, rows in self.parts)

    def loads(self) -> dict[sp.Symbol, Expression]:
        """Return where each symbol of the network is read."""
        model = self.model
        states = {real(name): Load("state", Number(k), None) for k, name in enumerate(model.state)}
        return states | {real(name): Load("numbers", Number(k), None) for k, name in enumerate(model.parameters)}

    def pushes(self) -> list[Statement]:
        """Return the statements that write the numbers of all rows."""
        statements: list[Statement] = []
        first = 0
        for i, rows in self.parts:
            table: dict[int, sp.Expr] = {}
            held = [row for row in rows if row.law is not Law.RESET]
            for a, row in enumerate(rows):
                mode = sp.S.One if row.mode == NO_MODE else row.mode
                numbers = (
                    row.level,
                    row.gap,
                    mode,
                    row.speed,
                    row.rate,
                    row.ratio,
                    sp.Integer(LAWS[row.law]),
                    sp.Integer(a),
                )
                at = (first + a) * self.groups
                table |= {at + group: e for group, e in enumerate(numbers)} | {at + event_text.SIZE: row.size}
                stiffness = dict(zip(map(id, held), row.stiffness, strict=True))
                table |= {at + event_text.K + b: stiffness.get(id(other), sp.S.Zero) for b, other in enumerate(rows)}
            statements.append(self.block(f"rows of oscillator {i + 1}", table, "rows_"))
            first += len(rows)
        return statements

    def strike(self) -> list[Statement]:
        """Return the statements that change the states of nodes at an event."""
        statements: list[Statement] = []
        first, model = 0, self.model
        for i, rows in self.parts:
            symbols, places = model.symbols(i), model.places[i]
            size = len(model.node_at(i).continuous)
            names = (real(f"rate_i{k}") for k in range(1_000_000))
            numbers = [tuple(islice(names, 3)) for _ in rows]
            after = struck(rows, symbols[:size], numbers)
            table = {places[c]: e for c, e in enumerate(after) if e != symbols[c]}
            places_of = {
                s: Load("rows_", Number((first + a) * self.groups + group), None)
                for a, triple in enumerate(numbers)
                for s, group in zip(triple, (event_text.IMPULSE, event_text.LIFT, event_text.FIRES), strict=True)
            }
            block = self.block(f"states of oscillator {i + 1}", table, "state", places_of)
            held = [a for a, row in enumerate(rows) if row.law is not Law.RESET]
            modes = [
                Store("state", Number(k), Load("rows_", Number((first + a) * self.groups + event_text.MODE), None))
                for k, a in zip(places[size:], held, strict=True)
            ]
            statements.append(Titled(block.title, (*block.body, *modes)))
            first += len(rows)
        return statements

    def block(
        self, title: str, table: dict[int, sp.Expr], array: str, more: dict[sp.Symbol, Load] | None = None
    ) -> Titled:
        """Return the statements that store a table of expressions by index."""
        loads = self.loads() | (more or {})
        return Titled(title, tuple(ExportBody.of(table).statements(loads, lambda k, e: Store(array, Number(k), e))))

    def sizes(self) -> dict[str, int]:
        """Return the integers of the text."""
        return {"EVENT_ROWS": self.count, "GROUPS": self.groups}

    def use(self) -> list[str]:
        """Return lines for the head: how to run through events, and the rows."""
        names = []
        for i, rows in self.parts:
            names += [f"a guard of oscillator {i + 1}" if row.mode == NO_MODE else str(row.mode) for row in rows]
        return [
            "begin sets the modes in a state at the start: 1 and -1 beside a surface, 0 held on it, 1 at an open stop.",
            "run moves a state through all events, with DOP853; `seen` gets time, row, mode before and after of each.",
            "Both return 0, or 1: no single motion agrees with the laws, 2: events without end, 3: no step is short enough.",
            f"Rows (from 0): {', '.join(names)}",
        ]


def tables() -> dict[str, list[str]]:
    """Return the coefficients of the method: A row by row, C, the two errors, and the continuous extension."""
    fifth, third = dop853.E
    flat = {"A": sum(dop853.A, ()), "C": dop853.C, "E5": fifth[:12], "E3": third[:12], "DENSE": sum(dop853.DENSE, ())}
    return {name: wrapped(map(repr, numbers)) for name, numbers in flat.items()}


def algorithm() -> str:
    """Return the functions of a run, in Python."""
    decisions = driver.text("driver.decisions", annotated=True).replace('@njit(error_model="numpy")\n', "")
    whole = Path(event_text.__file__).read_text(encoding="utf-8").partition(MARK)[2]
    return whole.replace("# --- decisions ---", decisions)


def algorithm_in_lists() -> str:
    """Return the functions of a run in Python without annotations, with lists in place of arrays."""
    return re.sub(r"np\.empty\((.+)\)", r"[0.0] * (\1)", driver.without_annotations(algorithm()))
