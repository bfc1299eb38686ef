"""Write the functions of rows (models/mechanics/rows.py), for the events of codegen/driver/rows.py.

`pushes(t, y, p, out)` stores six groups of ROWS numbers, one number for each row, node after node:

    0  level            2  mode                          4  rate of the speed if all x were 0
    1  gap              3  speed, held at zero           5  ratio: static over kinetic friction, or restitution

The driver stores three more groups behind these six, and two numbers on jumps and kinks in time follow (contact_step.py).
Behind them are groups of numbers that decide on modes: the law of the row, its number among the rows of its node, the
size of the terms of its gap, and its entries of K in the columns of these rows.  `strike(t, y, p, out)` adds impulses to
the states of the nodes, corrects gaps, resets states, and stores the modes of group 2.  It reads three groups that the
driver stores behind those of K: the impulse of each row, the correction of its gap, and 1 where a guard fires.  In a
further group the driver stores the largest size of each gap in a step.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation
from synchain.models.mechanics.components import Node
from synchain.models.mechanics.rows import Law, Row, forces, struck, term_size

from ..program.expressions import Compare, Expression, Load, Name, Number, call, plus
from ..program.lowering import lower
from ..program.passes import Names, StraightLine, real, share
from ..program.statements import Assign, Function, If, Role, Statement, accumulate, let, store
from .blocks import assigned
from .contact_step import SIDES, looped_sides, parameter_loads, push_functions, written_sides
from .places import Joint, Span, StateLayout, by_kind, link_ends, named
from .safe_names import NAMES
from .step import lane

LAWS = {Law.SIGN: 0, Law.STOP: 1, Law.RESET: 2}  # the numbers of laws in the driver
STOP_IN_ORDER, REDUNDANT_SIGN = 3, 4
MOST_EVENTS = 52  # rows that are decided together: GROUPS - K (codegen/driver/rows.py)
LEVEL, GAP, MODE, SPEED, RATE, RATIO = range(6)  # the groups of numbers in front of the looks


def law_number(row: Row) -> sp.Integer:
    """Return the number of the law of a row in the driver."""
    return sp.Integer(STOP_IN_ORDER if row.in_order else REDUNDANT_SIGN if row.redundant else LAWS[row.law])


def most_rows(equations: Equations) -> int:
    """Return the largest number of rows of a node, or of a part that links join."""
    most = max(len(rows) for rows in all_rows(equations))
    if most > MOST_EVENTS:
        raise ValueError(f"events: found {most} of a node, or of nodes that they join; expected at most {MOST_EVENTS}")
    return most


def all_rows(equations: Equations) -> list[tuple[Row, ...]]:
    """Return the rows of each node, or of each part that links join."""
    if equations.joined:
        return [part.template.rows for part in equations.parts] or [()]
    return [equations.nodes[kind].rows for kind in equations.kind_of]


def contact_groups(equations: Equations) -> int:
    """Return the number of groups of the output of `pushes`, with those that the driver stores behind it."""
    if not equations.has_rows:
        return (SIDES * equations.n + 2) * equations.sticks
    rows = row_count(equations)
    return SIDES * rows + 2 + (7 + most_rows(equations)) * rows


def row_count(equations: Equations) -> int:
    """Return the number of contacts, or of rows of all nodes and links."""
    if not equations.has_rows:
        return equations.n * equations.sticks
    return sum(map(len, all_rows(equations)))


def row_functions(equations: Equations, names: Names, looped: bool = False) -> list[Function]:
    """Return the functions `pushes` and `strike`, written out or `looped` over nodes and links."""
    network = ("graph", "weights") if looped else ()
    written = _Looped(equations, names) if looped else _WrittenOut(equations, names)
    about = "For each row: level, gap, mode, speed, its rate and its ratio; law, number in its node, K."
    strike = "Add impulses to the states, correct gaps, reset states where guards fire, and store the modes."
    arguments = ("t", "y", "p", "out", *network)
    return [
        Function("pushes", arguments, about, tuple(written.pushes()), role=Role.ENTRY),
        Function("strike", arguments, strike, tuple(written.strike()), role=Role.ENTRY),
    ]


def event_functions(variation: Variation, names: Names) -> list[Function]:
    """Return the functions of the events of the orbit, and `saltate`, which changes the deviations in one register."""
    events = variation.events
    if events is None:
        return []
    orbit, size, strengths = variation.orbit, variation.size, [s.name for s in variation.parameters]
    used = set().union(*(e.free_symbols for e in events.expressions))
    loads = [(name, "before", k) for k, name in enumerate(orbit.state)]
    loads += [(s.name, "after", k) for k, s in enumerate(events.after)]
    loads += [(name, "after", k) for k, name in enumerate(orbit.parameters, start=orbit.dimension)]
    body: list[Statement] = [let("t", call("broadcast", "now", "LANES"))]
    body += [
        let(name, call("broadcast", Load(array, Number(k), None), "LANES"))
        for name, array, k in loads
        if real(name) in used
    ]
    body += [let(s, register("strengths", len(strengths), k)) for k, s in enumerate(strengths) if real(s) in used]
    body += [let(s.name, register("modes", size, k)) for k, s in enumerate(events.deviations)]
    for number, jump in enumerate(events.jumps):
        if jump == events.deviations:
            continue
        moved = [c for c, (e, d) in enumerate(zip(jump, events.deviations, strict=True)) if e != d]
        line = share([jump[c] for c in moved], names.fresh("z"))
        stores = [store("modes", size * Name("which") + c, lower(e)) for c, e in zip(moved, line.results, strict=True)]
        body.append(If(Compare("==", Name("row"), Number(number)), (*assigned(line), *stores)))
    about = "Change deviations by an event of a contact or row; behind the last one: by a start with held ones."
    arguments = ("row", "now", "before", "after", "strengths", "modes", "which")
    saltate = Function("saltate", arguments, about, tuple(body), role=Role.ENTRY)
    return [*(row_functions if orbit.has_rows else push_functions)(orbit, names), saltate]


def register(array: str, size: int, k: int) -> Load:
    """Load register k of a group of modes; each group fills `size` registers of the array."""
    return Load(array, size * Name("which") + k, "LANES")


def _full(rows: Sequence[Row], row: Row) -> list[sp.Expr]:
    """Return K of a row with an entry for each row of the node, 0 for guards."""
    entries = iter(row.stiffness)
    return [sp.S.Zero if each.law is Law.RESET else next(entries) for each in rows]


class _Writer:
    def __init__(self, equations: Equations, names: Names) -> None:
        self.equations, self.names = equations, names
        self.rows, self.most = row_count(equations), most_rows(equations)
        self.supply = names.fresh("row_")

    def place(self, group: int, row: Expression | int) -> Expression:
        """Return the place of a number of one of the first six groups."""
        return plus(Number(group * self.rows), row if isinstance(row, Expression) else Number(row))

    def stored(
        self, array: str, columns: Sequence[sp.Expr], places: Sequence[Expression]
    ) -> tuple[set[sp.Symbol], list[Statement]]:
        """Return the symbols of some expressions, and the statements that compute and store them."""
        # numbers such as cosh(1) are stored as they are: in a register no other value tells their width
        moving = [(k, e) for k, e in zip(places, columns, strict=True) if not e.is_number]
        body = share([e for _, e in moving], self.names.fresh("z"))
        stores = [store(array, k, lane(lower(e))) for (k, _), e in zip(moving, body.results, strict=True)]
        stores += [store(array, k, lane(Number(float(e)))) for k, e in zip(places, columns, strict=True) if e.is_number]
        return body.symbols, [*assigned(body), *stores]

    def behind(self, group: int, row: Expression | int) -> Expression:
        """Return the place of a number behind those on jumps in time: law, first row, K, impulse, correction, firing."""
        return self.place(SIDES + group, plus(row if isinstance(row, Expression) else Number(row), Number(2)))


@dataclass(frozen=True, slots=True)
class _Group:
    """Rows that are solved together, of a node or of a part, with the states that they push and their modes."""

    first: int  # number of the first row
    rows: tuple[Row, ...]
    values: Mapping[sp.Symbol, sp.Expr]  # what the symbols of the rows are in the network; empty if the same
    rates: Mapping[sp.Symbol, sp.Expr]  # symbols of rates in the rows, with their expressions in the network
    state: tuple[sp.Symbol, ...]  # the continuous states, in the symbols of the rows
    places: tuple[int, ...]  # their places in the state of the network

    def numbers(self) -> Iterator[tuple[int, Row]]:
        """Yield each row with its number among the rows of the network."""
        return enumerate(self.rows, start=self.first)


class _WrittenOut(_Writer):
    def pushes(self) -> list[Statement]:
        equations = self.equations
        sides = written_sides(equations)
        ends = [Number(SIDES * self.rows + k) for k in range(len(sides))]
        if equations.joined:
            used, stores = self.of_parts(sides, ends)
        else:
            columns, places = self.columns(self.groups())
            used, stores = self.stored("out", [*columns, *sides], [*places, *ends])
        return [*self.loads(used, "p"), *parameter_loads(equations, used), *stores]

    def columns(self, groups: Iterable[_Group]) -> tuple[list[sp.Expr], list[Expression]]:
        """Return the numbers of the rows and their places in `out`."""
        columns: list[sp.Expr] = []
        places: list[Expression] = []
        for group in groups:
            for a, (number, row) in enumerate(group.numbers()):
                mode = sp.S.One if row.law is Law.RESET else row.mode
                columns += (row.level, row.gap, mode, row.speed, row.rate, row.ratio)
                places += [self.place(k, number) for k in range(6)]
                columns += (law_number(row), sp.Integer(a), row.size, *_full(group.rows, row))
                places += [self.behind(k, number) for k in range(3 + len(group.rows))]
        return columns, places

    def of_parts(self, sides: Sequence[sp.Expr], ends: Sequence[Expression]) -> tuple[set[sp.Symbol], list[Statement]]:
        """Return the numbers of the rows of parts; parts of one shape have equal statements."""
        used, statements = self.stored("out", sides, ends)
        bodies: dict[tuple[Row, ...], StraightLine] = {}
        supply = self.names.fresh("z")
        for group in self.groups():
            columns, places = self.columns([group])
            moving = [k for k, e in enumerate(columns) if not e.is_number]
            if group.rows not in bodies:
                bodies[group.rows] = share([columns[k] for k in moving], supply)
            named = {s: next(self.supply) for s in group.rates if s in bodies[group.rows].symbols}
            body = bodies[group.rows].at({**group.values, **named})
            rates = [group.rates[s] for s in named]
            used |= (body.symbols - set(named.values())).union(*(e.free_symbols for e in rates))
            statements += [let(s.name, lane(lower(e))) for s, e in zip(named.values(), rates, strict=True)]
            statements += assigned(body)
            results = dict(zip(moving, map(lower, body.results), strict=True))
            statements += [
                store("out", place, lane(results[k] if k in results else Number(float(e))))
                for k, (place, e) in enumerate(zip(places, columns, strict=True))
            ]
        return used, statements

    def strike(self) -> list[Statement]:
        equations, columns, places, loads, modes = self.equations, [], [], [], []
        slots = {name: k for k, name in enumerate(equations.state)}
        for group in self.groups():
            numbers = []
            for number, _ in group.numbers():
                triple = tuple(islice(self.supply, 3))
                numbers.append(triple)
                loads += [
                    let(s.name, Load("out", self.behind(3 + self.most + k, number))) for k, s in enumerate(triple)
                ]
            after = struck(group.rows, group.state, numbers)
            columns += [e.xreplace(dict(group.values)) for e, s in zip(after, group.state, strict=True) if e != s]
            places += [Number(k) for k, e, s in zip(group.places, after, group.state, strict=True) if e != s]
            held = {number: row.mode for number, row in group.numbers() if row.law is not Law.RESET}
            modes += [
                store("y", slots[group.values.get(mode, mode).name], Load("out", self.place(MODE, number)))
                for number, mode in held.items()
            ]
        used, stores = self.stored("y", columns, places)
        return [*self.loads(used, "y"), *parameter_loads(equations, used), *loads, *stores, *modes]

    def groups(self) -> list[_Group]:
        """Return the rows that are solved together: of each node, or of each part that links join."""
        equations, groups, first = self.equations, list[_Group](), 0
        for part in equations.parts:
            template = part.template
            groups.append(_Group(first, template.rows, part.at, part.rates, template.state, part.places))
            first += len(template.rows)
        for i in () if equations.joined else by_kind(equations):
            rows, size = equations.rows_at(i), len(equations.node_at(i).continuous)
            groups.append(_Group(first, rows, {}, {}, equations.symbols(i)[:size], equations.places[i][:size]))
            first += len(rows)
        return groups

    def loads(self, used: set[sp.Symbol], of_modes: str) -> list[Statement]:
        """Load states from `y`; modes, which last for a whole step, from `of_modes`."""
        equations = self.equations
        modes = {k for i, at in enumerate(equations.places) for k in at[len(equations.node_at(i).continuous) :]}
        named_states = enumerate(equations.state)
        return [let(s, Load(of_modes if k in modes else "y", Number(k))) for k, s in named_states if real(s) in used]


class _Looped(_Writer):
    """Loops over the nodes of each kind, over the links of each template, and over the nodes again for the gaps."""

    def __init__(self, equations: Equations, names: Names) -> None:
        super().__init__(equations, names)
        self.layout = StateLayout(equations)
        counts = [equations.kind_of.count(k) * len(node.rows) for k, node in enumerate(equations.nodes)]
        starts = [sum(equations.kind_of.count(j) for j in range(k)) for k in range(len(counts))]
        self.offsets = [sum(counts[:k]) - starts[k] * len(node.rows) for k, node in enumerate(equations.nodes)]

    def row(self, kind: int, a: int, index: str = "i") -> Expression:
        """Return the number of row `a` of a node in a loop."""
        return plus(len(self.equations.nodes[kind].rows) * Name(index), Number(self.offsets[kind] + a))

    def pushes(self) -> list[Statement]:
        equations, loops = self.equations, list[Statement]()
        used, sides = looped_sides(equations, self.names, self.rows)
        for kind in self.layout.kinds:
            loops += self.of_node(kind.node, kind.number, used)
        for joint in self.layout.joints:
            loops += self.of_link(joint, used)
        for kind in self.layout.kinds:
            loops += self.gaps(kind.node, kind.number)
        head = [Assign(NAMES, Name("graph"), whole=True)]
        return [*head, *parameter_loads(equations, used), *sides, *loops]

    def of_node(self, node: Node, number: int, used: set[sp.Symbol]) -> list[Statement]:
        if not node.rows:
            return []
        columns, places = [], []
        for a, row in enumerate(node.rows):
            columns += [row.level, sp.S.One if row.law is Law.RESET else row.mode, row.speed, row.rate, row.ratio]
            places += [self.place(group, self.row(number, a)) for group in (LEVEL, MODE, SPEED, RATE, RATIO)]
            columns += [law_number(row), sp.Integer(a), term_size(row.level), *_full(node.rows, row)]
            places += [self.behind(group, self.row(number, a)) for group in range(3 + len(node.rows))]
        symbols, stores = self.stored("out", columns, places)
        used |= symbols
        loop = [*self.states(node, symbols, "p"), *self.layout.own(symbols), *stores]
        return [self.span_of(number).over(loop)]

    def of_link(self, joint: Joint, used: set[sp.Symbol]) -> list[Statement]:
        """Add what a link does to the rates of the speeds of its target."""
        edge, node = joint.edge, joint.target
        if not node.rows:
            return []
        number, size, swap = self.equations.nodes.index(node), len(node.continuous), named(joint)
        here = dict(zip(node.state, edge.here, strict=True))
        off = dict.fromkeys(edge.here[size:], sp.S.One)
        plain = [e.xreplace(off) for e in edge.rhs[:size]]
        added, places = [], []
        for a, row in enumerate(node.rows):
            gained = sp.Add(*(g.xreplace(here) * f for g, f in zip(row.gradient, plain, strict=True)))
            if gained != 0:
                added.append(gained)
                places.append(self.place(RATE, self.row(number, a)))
        if not added:
            return []
        symbols = {s for e in added for s in e.free_symbols}
        used |= symbols
        loop = [*link_ends(edge, edge.weight.name), *self.layout.of_link(edge, symbols)]
        ends = (("i", node, edge.here), ("j", joint.source, edge.there))
        for index, end, states in ends:
            modes = len(end.continuous)
            loop += [
                let(swap[s].name, Load("y" if k < modes else "p", self.layout.place(k, index)))
                for k, s in enumerate(states)
                if s in symbols
            ]
        body = share([e.xreplace(swap) for e in added], self.names.fresh("z"))
        loop += assigned(body)
        loop += [accumulate("out", k, lower(e)) for k, e in zip(places, body.results, strict=True)]
        return [joint.span.over(loop)]

    def gaps(self, node: Node, number: int) -> list[Statement]:
        """Compute gaps from the stored numbers, after the links have added theirs."""
        if not node.rows:
            return []
        stored: dict[sp.Symbol, Expression] = {}

        def number_of(place: Expression) -> sp.Symbol:
            symbol = next(self.supply)
            stored[symbol] = Load("out", place)
            return symbol

        held = [a for a, row in enumerate(node.rows) if row.law is not Law.RESET]
        modes = [number_of(self.place(MODE, self.row(number, a))) for a in held]
        rates = [number_of(self.place(RATE, self.row(number, a))) for a in held]
        stiffness = [
            tuple(
                e if e.is_number else number_of(self.behind(3 + b, self.row(number, a)))
                for b, e in zip(held, node.rows[a].stiffness, strict=True)
            )
            for a in held
        ]
        sides = [node.rows[a].side(mode) for a, mode in zip(held, modes, strict=True)]
        x = dict(zip(held, forces(sides, modes, stiffness, rates), strict=True))
        columns, places = [], []
        for a, row in enumerate(node.rows):
            at, zeros = self.row(number, a), (sp.S.Zero,)
            level, ratio, size = map(number_of, (self.place(LEVEL, at), self.place(RATIO, at), self.behind(2, at)))
            mode = modes[held.index(a)] if a in x else row.mode
            at_numbers = Row(
                row.law, mode, level, level, level, zeros, zeros, zeros, ratio, x.get(a, sp.S.Zero), zeros, zeros
            )
            columns += [at_numbers.gap, at_numbers.size.xreplace({abs(level): size})]
            places += [self.place(GAP, at), self.behind(2, at)]
        body = share(columns, self.names.fresh("z"))
        loop: list[Statement] = [let(s.name, e) for s, e in stored.items() if s in body.symbols]
        loop += assigned(body)
        loop += [store("out", place, lower(e)) for place, e in zip(places, body.results, strict=True)]
        return [self.span_of(number).over(loop)]

    def strike(self) -> list[Statement]:
        loops, used = list[Statement](), set[sp.Symbol]()
        for kind in self.layout.kinds:
            node, number = kind.node, kind.number
            if not node.rows:
                continue
            numbers = [tuple(islice(self.supply, 3)) for _ in node.rows]
            after = struck(node.rows, node.continuous, numbers)
            changed = [c for c, e in enumerate(after) if e != node.state[c]]
            body = share([after[c] for c in changed], self.names.fresh("z"))
            used |= body.symbols
            loop = [*self.states(node, body.symbols, "y"), *self.layout.own(body.symbols)]
            loop += [
                let(s.name, Load("out", self.behind(3 + self.most + k, self.row(number, a))))
                for a, triple in enumerate(numbers)
                for k, s in enumerate(triple)
                if s in body.symbols
            ]
            loop += assigned(body)
            loop += [
                store("y", self.layout.place(c), lane(lower(e))) for c, e in zip(changed, body.results, strict=True)
            ]
            held = [a for a, row in enumerate(node.rows) if row.law is not Law.RESET]
            loop += [
                store("y", self.layout.place(c), Load("out", self.place(MODE, self.row(number, a))))
                for c, a in enumerate(held, start=len(node.continuous))
            ]
            loops.append(kind.span.over(loop))
        return [Assign(NAMES, Name("graph"), whole=True), *parameter_loads(self.equations, used), *loops]

    def span_of(self, number: int) -> Span:
        return self.layout.kinds[number].span

    def states(self, node: Node, used: set[sp.Symbol], of_modes: str) -> list[Statement]:
        size = len(node.continuous)
        return [
            let(s.name, Load("y" if c < size else of_modes, self.layout.place(c)))
            for c, s in enumerate(node.state)
            if s in used
        ]
