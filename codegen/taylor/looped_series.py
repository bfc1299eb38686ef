"""Write a Taylor step for a large network: loops over orders, nodes and links around the recurrences of `series`.

The workspace follows the rows of the dense output.  The workspace holds the coefficients of the states, the rates of
one order, and the coefficients of every series that a convolution reads.  Coefficient k of a series is stored at
`at_… + i*TERMS + k` for node i, at `at_… + e*TERMS + k` for link e, and at `at_… + k` for a function of time alone.
A convolution thus reads consecutive entries of memory for networks of any size.

A section (`SeriesLoop`) becomes one loop in each order.  `LoopedSeries.parts` lists the sections: functions of time
alone, nodes of each kind, links of each joint, then mean fields and sums over links.  A section reads series of earlier
sections from memory.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Block, Edge, Node

from ..program.expressions import ONE, ZERO, Expression, Load, Name, Number, call, plus
from ..program.lowering import lower
from ..program.passes import Hoist, Names, real
from ..program.statements import Assign, Comment, Loop, Statement, Store, let, whole
from ..steps.fields import LinkSums, MeanField, compensated, link_sums, mean_fields
from ..steps.places import Joint, NodeKindLayout, Span, StateLayout, link_ends, span, theirs
from ..steps.safe_names import NAMES
from ..steps.step import lane
from .event_location import Stored, side_by
from .mass_matrix import moving, solved
from .passable import check_passable
from .series import MINUS, Constant, Series, State, magnitude
from .series_graph import SeriesGraph, Template
from .series_writer import Gaps, SeriesWriter
from .simplify import absolute, add, times, within
from .step_length import SEEN, last_orders
from .taylor_step import TaylorStep, TaylorStepWriter

CONVOLUTION = '''
@njit(error_model='numpy')
def convolution(dense, left, right, k, first, end):
    """Sum of left_j*right_(k-j) for j = first … end - 1."""
    total = broadcast(0.0, WIDTH)
    for j in range(first, end):
        total = total + load(dense, left + j, WIDTH)*load(dense, right + (k - j), WIDTH)
    return total
'''.strip()
"""Text of the function that computes convolutions; a loop in each sum would take most of the compilation time."""

GAPS = (Name("i"), *(k * Name("NODES") + "i" if k > 1 else Name("NODES") + "i" for k in range(1, 16)))
"""Indices of the gaps of node i's contact or rows, among the gaps of one order."""

START, ORDER = Number(0), Name("k")
"""Order 0, with which a step begins, and the variable of the loop over all later orders."""

NOTHING = 0.0 * Name("scale")
"""Zeros in all lanes."""


@dataclass(frozen=True, slots=True)
class Hoisted:
    """Rates in which names replace functions of time alone (series) and functions of parameters alone (constants)."""

    rates: list[sp.Expr]
    waves: dict[sp.Symbol, Series] = field(default_factory=dict)
    constants: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)


class Slot(NamedTuple):
    """Position of a series in memory: a part of the workspace, and the number of a node, link or state."""

    name: str
    number: Expression | None

    def at(self, order: Expression) -> Expression:
        """Return the index of the group that stores the coefficient of this order."""
        if self.number is None:
            return Name(f"at_{self.name}") + order
        return plus(Name(f"at_{self.name}"), self.number * Name("TERMS"), order)

    def load(self, order: Expression) -> Expression:
        return Load("dense", self.at(order))

    def store(self, order: Expression, value: Expression) -> Store:
        return Store("dense", self.at(order), value)


@dataclass(eq=False, slots=True)
class Outer(State):
    """A state or a series of another section, with the memory that stores its coefficients."""

    slot: Slot


@dataclass(eq=False)
class SeriesLoop(SeriesWriter):
    """A section: the series of all nodes of a kind, of all links of a joint, or of the network, with memory for each.

    span, count: the loop, and the number of nodes or links in the whole network. adds: True if rates are added to those
    of earlier sections. setting: statements that load the values a loop turn needs at any order. moving: series by
    symbol. fixed: names by symbol. outer: series that the section reads but does not compute. rates: series of the
    rates by state. lent: series that other sections read. gaps: the gaps of contacts, or the terms that links add to
    gaps. k: the order to be written: 0, or the variable of the loop over orders.
    """

    span: Span | None = None
    count: int = 1
    adds: bool = False
    setting: list[Statement] = field(default_factory=list)
    moving: dict[sp.Symbol, Series] = field(default_factory=dict)
    fixed: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    outer: list[Series] = field(default_factory=list)
    rates: list[tuple[Expression, Series]] = field(default_factory=list)
    lent: list[Series] = field(default_factory=list)
    gaps: list[Series] = field(default_factory=list)
    values: dict[Series, Expression] = field(default_factory=dict)
    k: Expression = START
    sums: int = 0
    zeros, inverse, number = NOTHING, Name("inverse"), Name("number")

    # -- what a recurrence uses -----------------------------------------------------------------------------------

    def of(self, series: Series) -> Expression:
        if isinstance(series, Constant):
            return series.value if self.k == START else ZERO
        return self.values[series]

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        if self.k == START:
            return ZERO if first else times(self.of(left), self.of(right))
        total = f"s{self.sums}"
        self.sums += 1
        begins = (self.slot(s).at(START) for s in (left, right))
        end = ORDER + 1 if last == 0 else ORDER
        self.put(let(total, call("convolution", "dense", *begins, ORDER, first, end)))
        return Name(total)

    def square(self, base: Series, first: int) -> Expression:
        return self.sum(base, base, first, -first)

    def save(self, name: str, value: Expression) -> Name:
        if name not in self.saved:
            self.saved[name] = None
            self.put(let(name, value), self.assign(name, Name(name) + NOTHING))
        return Name(name)

    # -- where coefficients are -----------------------------------------------------------------------------------

    @property
    def index(self) -> Name | None:
        """Return the loop variable of the section; None for a section without a loop."""
        return None if self.span is None else Name(self.span.index)

    def reads(self, slot: Slot, name: str) -> Series:
        """Return the series that stands for a slot, from which this section reads its coefficients."""
        self.outer.append(Outer(slot, name=name))
        return self.outer[-1]

    def slot(self, series: Series) -> Slot:
        """Return the slot that stores the coefficients of a series."""
        return series.slot if isinstance(series, Outer) else Slot(series.name, self.index)

    def at(self, series: Series, k: int | Expression) -> Expression:
        return self.slot(series).load(k if isinstance(k, Expression) else Number(k))

    def define(self, series: Series, value: Expression, inline: bool) -> None:
        stored = series in self.in_memory
        self.values[series] = value if inline and not stored else self.named(series.name, value)
        if stored:
            self.put(self.slot(series).store(self.k, lane(self.values[series])))

    @cached_property
    def in_memory(self) -> set[Series]:
        """Return the series whose earlier coefficients this section or other sections read."""
        convolved = {used for s in self.graph.series for used in s.convolved}
        return {*convolved, *self.graph.watched, *self.graph.positive, *self.lent} - {*self.outer}

    def room(self) -> dict[str, int]:
        """Return the number of groups of memory for each name: coefficients, and values saved once for each turn."""
        names = sorted({s.name for s in self.in_memory} - {"t", ""})
        rooms = {name: (self.order + 1) * self.count for name in names}
        return rooms | {name: self.count for name in (*self.saved, *self.hints)}

    def single(self, name: str) -> Expression:
        """Return the index of the group of a value that each turn of the section saves once for all orders."""
        return Name(f"at_{name}") if self.index is None else plus(Name(f"at_{name}"), self.index)

    def recall(self, name: str) -> Expression:
        return Load("dense", self.single(name))

    def assign(self, name: str, value: Expression) -> Statement:
        return Store("dense", self.single(name), value)

    def signs(self, series: Series) -> list[Statement]:
        return [span("k", self.order + 1, 1).over([side_by(self.at(series, ORDER))])]

    def weight(self, name: str) -> Name:
        return Name("weight")

    def add_size(self, k: int, size: Expression) -> list[Statement]:
        return [let(f"size_{k}", call("maximum", f"size_{k}", size))]

    def counted(self, series: Series) -> list[Statement]:
        return [let("largest", self.low(series)), *self.weighed(series, "", Name("rtol") * "largest")]

    def end_value(self, series: Series, name: str) -> tuple[list[Statement], Expression]:
        return polynomial("value", self.order - 1, partial(self.at, series)), Name("value")

    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        slots = zip(sizes, map(self.slot, series), strict=True)
        return [], [Stored(size, slot.at(START), self.order) for size, slot in slots]

    # -- statements -----------------------------------------------------------------------------------------------

    def coefficients(self, order: Expression) -> list[Statement]:
        """Return the statements for the coefficients of an order: 0, or the loop variable k for any later order."""
        self.statements, self.k, first = list(self.setting), order, order == START
        if not first:
            self.put(*(let(name, self.recall(name)) for name in self.saved))
        self.put(*(let(s.name, self.at(s, order)) for s in self.outer))
        self.values = {s: Name(s.name) for s in self.outer}
        self.make(self.graph.series, first)
        self.use_rates()
        return self.over_turns(self.statements)

    def use_rates(self) -> None:
        """Store coefficient 0, or k, of the rates and of the gaps of contacts."""
        for state, rate in self.rates:
            value, group = self.of(rate), plus(Name("at_rates"), state)
            if not self.adds:
                self.put(Store("dense", group, value + NOTHING if isinstance(rate, Constant) else value))
            elif value != ZERO:
                self.store_rate(group, value)
        for index, gap in zip(GAPS, self.gaps, strict=False):
            self.store_rate(Slot("gaps", index).at(self.k), self.of(gap))
            if self.k == START:
                self.store_rate(plus(Name("at_sizes"), index), magnitude(self, gap))

    def store_rate(self, group: Expression, value: Expression) -> None:
        """Store a value, or add the value to the one that earlier sections have stored."""
        if self.adds:
            self.put(let("value", add(Load("dense", group), value)), Store("dense", group, Name("value")))
        else:
            self.put(Store("dense", group, lane(value)))

    def lengths(self) -> list[Statement]:
        return self.in_loop([*super().lengths(), *self.watches()])

    def in_loop(self, statements: list[Statement]) -> list[Statement]:
        return self.over_turns([*self.setting, *statements]) if statements else []

    def over_turns(self, statements: list[Statement]) -> list[Statement]:
        return statements if self.span is None else [self.span.over(statements)]


@dataclass(eq=False)
class Totals(SeriesLoop):
    """A section that adds up series over all nodes; each sum has a name."""

    totals: list[tuple[str, Series]] = field(default_factory=list)

    def coefficients(self, order: Expression) -> list[Statement]:
        names = [name for name, _ in self.totals]
        before = [let(f"{name}{suffix}", NOTHING) for name in names for suffix in ("", "_rest")]
        behind = [Store("dense", Name(f"at_{name}") + order, Name(name)) for name in names]
        return [*before, *super().coefficients(order), *behind]

    def use_rates(self) -> None:
        # coefficients of a constant beyond the first are zero
        for name, rate in self.totals:
            value = self.of(rate)
            if value != ZERO:
                self.put(let(f"{name}_value", value), *compensated(name, f"{name}_value"))

    def room(self) -> dict[str, int]:
        return super().room() | {name: self.order + 1 for name, _ in self.totals}


@dataclass(eq=False)
class Gathered(SeriesLoop):
    """A section that adds up series over the links of each node; each sum has a name."""

    nodes: int = 0
    totals: list[tuple[str, Series]] = field(default_factory=list)

    def coefficients(self, order: Expression) -> list[Statement]:
        zeros = [Slot(name, Name("i")).store(order, NOTHING) for name, _ in self.totals]
        return [span("i", "NODES").over(zeros), *super().coefficients(order)]

    def use_rates(self) -> None:
        # coefficients of a constant beyond the first are zero
        for name, rate in self.totals:
            value, slot = self.of(rate), Slot(name, Name("i"))
            if value != ZERO:
                self.put(let("value", add(slot.load(self.k), value)), slot.store(self.k, Name("value")))

    def room(self) -> dict[str, int]:
        return super().room() | {name: (self.order + 1) * self.nodes for name, _ in self.totals}


def of_state(index: Expression) -> Slot:
    """Return the slot of the state with this index."""
    return Slot("states", index)


def polynomial(name: str, degree: int, coefficient: Callable[[Expression], Expression]) -> list[Statement]:
    """Return the statements that evaluate a polynomial in `ratio` by Horner's rule."""
    turn = let(name, Name(name) * "ratio" + coefficient(ORDER))
    return [let(name, coefficient(Number(degree))), Loop(ORDER.text, Number(degree - 1), Number(-1), (turn,), step=-1)]


def with_gaps(node: Node) -> list[sp.Expr]:
    """Return the rates of a node, followed by the gaps of each event and row."""
    return [*node.rhs, *(gap for condition in node.conditions for gap in condition.gaps)]


def symbols_in(expressions: Iterable[sp.Expr]) -> set[sp.Symbol]:
    return {s for e in expressions for s in e.free_symbols}


class LoopedSeries(TaylorStepWriter):
    """Write loops around the recurrences; each section becomes one loop in each order."""

    functions: Sequence[str] = (CONVOLUTION,)

    def __init__(self, equations: Equations, order: int) -> None:
        eq = equations
        symbols = {s for node in eq.nodes for s in (*node.state, *node.parameters)}
        symbols |= {s for edge in eq.edges for s in (edge.weight, *edge.parameters)}
        taken = {*(s.name for s in symbols), *eq.parameters}
        super().__init__(equations, order, taken)
        self.layout, self.fields = StateLayout(equations), mean_fields(equations)
        self.names = Names([*taken, *self.called.values(), *(s + end for s in taken for end in ("_here", "_there"))])
        self.varied = [real(name) for name in eq.differing]

        # take functions of time alone out of all rates: they form the first section
        self.waves = SeriesLoop(SeriesGraph(self.names), order)
        kinds, (self.sums, joints) = self.layout.kinds, link_sums(equations, self.layout.joints)
        rates = [[*with_gaps(kind.node), *(e for links in self.sums for e in links.of_node())] for kind in kinds]
        nodes = [self.hoisted(e, [*kind.node.state, *self.varied]) for kind, e in zip(kinds, rates, strict=True)]
        pushes = [self.of_links(joint.edge, self.pushes(joint)) for joint in joints]
        fields = [
            [self.of_links(f.edge, e, (*f.sums, *f.shared)) for e in (f.sums.values(), f.shared.values(), f.rates)]
            for f in self.fields
        ]
        self.waves.graph.finish(self.waves.lent)
        if self.waves.lent:
            self.waves.outer.append(self.time)

        # the other sections, in the order in which they are computed
        self.parts: list[SeriesLoop] = [self.waves, *map(self.node, kinds, nodes), *map(self.link, joints, pushes)]
        for mean, parts in zip(self.fields, fields, strict=True):
            self.parts += self.field(mean, *parts)
        names = [name for links in self.sums for name in links.functions]
        functions = dict(zip(names, self.lent, strict=True))
        for links in self.sums:
            self.parts += self.summed(links, {name: functions[name] for name in links.functions})

        # if kinks or contacts may end a step, the last order of all series is needed, not that of the states alone
        self.ends = eq.sticks or any(section.graph.kinks for section in self.parts)
        self.orders = order + 1 if self.ends else order

    # -- rates ------------------------------------------------------------------------------------------------

    def hoisted(self, rates: Iterable[sp.Expr], moving: Sequence[sp.Symbol]) -> Hoisted:
        """Return rates in which names replace functions of time (and parameters) and functions of parameters alone."""
        hoist = Hoist(frozenset(moving), self.names.fresh("wave_"), frozenset({TIME}))
        reduced = [hoist.apply(e) for e in rates]
        waves: dict[sp.Symbol, Series] = {}
        constants: dict[sp.Symbol, sp.Expr] = {}
        for e, symbol in hoist.table.items():
            if not e.has(TIME):
                constants[symbol] = e.xreplace(self.substitutes)
                continue
            template = Template.of([e], [TIME], self.names.fresh("shared_"))
            (waves[symbol],) = self.waves.graph.read(template, {TIME: self.time}, self.substitutes)
            self.waves.lent.append(waves[symbol])
        return Hoisted(reduced, waves, constants)

    def of_links(self, edge: Edge, rates: Iterable[sp.Expr], more: Iterable[sp.Symbol] = ()) -> Hoisted:
        """Return the rates of links, hoisted like those of nodes if they contain time; symbols in `more` move too."""
        if not edge.forced:
            return Hoisted(list(rates))
        states = (s for end in edge.end_states for s in end)
        moving = (edge.weight, *states, *(s for s, _ in edge.theirs), *self.varied, *more)
        return self.hoisted(rates, moving)

    @staticmethod
    def pushes(joint: Joint) -> list[sp.Expr]:
        """Return a link's contributions to the rates of its target, and to the contact's gaps (force in stick)."""
        edge = joint.edge
        if joint.target.rows:
            size = len(joint.target.continuous)
            here = dict(zip(joint.target.state, edge.here, strict=True))
            off = dict.fromkeys(edge.here[size:], sp.S.One)
            plain = [e.xreplace(off) for e in edge.rhs[:size]]
            rows = [row.map(lambda e: e.xreplace(here)) for row in joint.target.rows]
            return [*edge.rhs, *(e for row in rows for e in row.gained(plain))]
        if not joint.target.events:
            return list(edge.rhs)
        mode = edge.here[2]
        push = (1 - mode**2) * edge.rhs[1].xreplace({mode: sp.S.One})
        return [*edge.rhs, push, -push]

    # -- sections ---------------------------------------------------------------------------------------------

    def node(self, kind: NodeKindLayout, hoisted: Hoisted) -> SeriesLoop:
        """Return the section that computes the rates of all nodes of a kind."""
        node = kind.node
        section = SeriesLoop(SeriesGraph(self.names), self.order, span=kind.span, count=self.equations.n)
        self.read_states(section, node.state, node, ("", "i"), node.state)
        used = symbols_in([*hoisted.rates, *(e for row in node.inertia for e in row)])
        section.setting += self.loaded(self.layout.own(used))
        series, size = self.read(section, hoisted, node.inertia), len(with_gaps(node))
        self.store(section, node, series[:size])
        # sums over links read functions of the source nodes from memory
        self.node_part, self.lent = section, series[size:]
        section.lent += [s for s in series[size:] if not isinstance(s, Constant)]
        first = 0
        for condition in node.conditions:
            indices = GAPS[first : first + len(condition.gaps)]
            first += len(indices)
            gaps = tuple(Outer(Slot("gaps", index)) for index in indices)
            sizes = tuple(Load("dense", plus(Name("at_sizes"), index)) for index in indices)
            mode, names = self.called.get(condition.mode.name, "t"), ("rise", "fall")[: len(indices)]
            section.contacts.append(
                Gaps(mode, "stuck", gaps, names, sizes, Name("at_closing"), 1 + self.equations.has_rows)
            )
        return section

    def link(self, joint: Joint, hoisted: Hoisted) -> SeriesLoop:
        """Return the section that adds the contributions of a joint's links to the rates."""
        edge, used = joint.edge, symbols_in(hoisted.rates)
        section = SeriesLoop(SeriesGraph(self.names), self.order, span=joint.span, count=self.layout.links, adds=True)
        section.setting += self.layout.ends(edge, self.called[edge.weight.name], "j_there")
        self.read_states(section, edge.here, joint.target, ("_here", "i"), used)
        self.read_states(section, edge.there, joint.source, ("_there", "j_there"), used)
        if edge.beyond:
            self.read_states(section, edge.beyond, joint.source, ("_beyond", "k_beyond"), used)
        section.setting += self.loaded(self.layout.of_link(edge, used, "j_there"))
        section.fixed |= theirs(edge)
        self.store(section, joint.target, self.read(section, hoisted))
        return section

    def field(self, field: MeanField, sums: Hoisted, shared: Hoisted, rates: Hoisted) -> Iterator[SeriesLoop]:
        """Yield the sections of a mean field: sums over nodes, functions of the sums, contributions to the rates."""
        # 1. sums over the sources
        nodes, n = self.layout.kinds[0].span, self.equations.n
        totals = Totals(SeriesGraph(self.names), self.order, span=nodes, count=n)
        used = symbols_in(sums.rates)
        self.read_field_states(totals, field, "_there", used)
        totals.setting += self.loaded(self.layout.of_source(field.edge, used, "i"))
        totals.fixed |= theirs(field.edge)
        series = dict(zip(field.sums, self.read(totals, sums), strict=True))
        totals.totals = [(symbol.name, s) for symbol, s in series.items()]
        yield totals

        # 2. functions of the sums that all nodes share
        combined = SeriesLoop(SeriesGraph(self.names), self.order)
        self.see(combined, self.waves, shared.waves)
        self.see(combined, combined, {s: State(name=s.name) for s in field.sums})
        common = dict(zip(field.shared, self.read(combined, replace(shared, waves={})), strict=True))
        combined.lent += [s for s in common.values() if not isinstance(s, Constant)]
        yield combined

        # 3. the rates of the targets; a function that occurs at the source too is a series of section 1
        target = SeriesLoop(SeriesGraph(self.names), self.order, span=nodes, count=n, adds=True)
        lent = {e: series[s] for s, e in field.alike.items() if series[s] in totals.graph.series}
        borrowed = {e: real(s.name) for e, s in lent.items()}
        reduced = [e.xreplace(borrowed) for e in rates.rates]
        used = symbols_in(reduced)
        self.read_field_states(target, field, "_here", used)
        target.setting += self.loaded(self.layout.own(used))
        lent = {e: s for e, s in lent.items() if borrowed[e] in used}
        totals.lent += lent.values()
        self.see(target, totals, {borrowed[e]: s for e, s in lent.items()})
        self.see(target, combined, common)
        self.store(target, field.node, self.read(target, replace(rates, rates=reduced)))
        yield target

    def summed(self, links: LinkSums, functions: Mapping[sp.Symbol, Series]) -> Iterator[SeriesLoop]:
        """Yield the sections of sums over links: the sums of functions of the sources, contributions to the rates."""
        # 1. add up, over the links of each target, the functions of the source times the factors of the link
        edge, joint = links.joint.edge, links.joint
        sums = Gathered(
            SeriesGraph(self.names), self.order, span=joint.span, count=self.layout.links, nodes=self.equations.n
        )
        sums.setting += link_ends(edge, self.called[edge.weight.name], "j_there")
        used = symbols_in(factor for factor, _ in links.sums.values())
        sums.setting += self.loaded(self.layout.of_link(edge, used, "j_there"))
        for symbol, s in functions.items():
            constant = isinstance(s, Constant)
            sums.moving[symbol] = s if constant else sums.reads(Slot(s.name, Name("j_there")), s.name)
        series = self.read(sums, Hoisted([a * b for a, b in links.sums.values()]))
        sums.totals = [(symbol.name, s) for symbol, s in zip(links.sums, series, strict=True)]
        yield sums

        # 2. compute the rates of each target from its sums and its own functions
        nodes, rates = self.layout.kinds[0].span, links.applied()
        target = SeriesLoop(SeriesGraph(self.names), self.order, span=nodes, count=self.equations.n, adds=True)
        used = symbols_in(rates)
        self.read_states(target, edge.here, joint.target, ("_here", "i"), used)
        target.setting += self.loaded(self.layout.own(used))
        self.see(target, self.node_part, {symbol: s for symbol, s in functions.items() if symbol in used})
        self.see(target, target, {s: State(name=s.name) for s in links.sums})
        self.store(target, joint.target, self.read(target, Hoisted(rates)))
        yield target

    # -- what a section reads and stores ----------------------------------------------------------------------

    def read(self, section: SeriesLoop, hoisted: Hoisted, inertia: Block = ()) -> list[Series]:
        """Return the series of a section; append to its setting the constants that each turn computes."""
        self.see(section, self.waves, hoisted.waves)
        graph, size, masses = section.graph, len(hoisted.rates), (e for row in inertia for e in row)
        template = Template.of([*hoisted.rates, *masses], section.moving, self.names.fresh("shared_"))
        series = graph.read(template, section.moving, {**self.substitutes, **hoisted.constants, **section.fixed})
        if entries := {divmod(k, size): e for k, e in enumerate(series[size:])}:
            series = list(solved(graph, entries, dict(enumerate(series[:size]))).values())
        graph.finish(series)
        section.setting += graph.constants
        return series

    def store(self, section: SeriesLoop, node: Node, series: Sequence[Series]) -> None:
        """Let a section store the rates of a node, followed by the gaps of the node's contact."""
        size = len(node.state)
        section.rates = [(self.layout.place(c), rate) for c, rate in enumerate(series[:size])]
        section.gaps = list(series[size:])

    def read_states(
        self,
        section: SeriesLoop,
        symbols: Sequence[sp.Symbol],
        node: Node,
        end: tuple[str, str],
        used: Container[sp.Symbol],
    ) -> None:
        """Let a section read the used states of a node, or of one end of a link, under `symbols`.

        `end`: the suffix of the names of the states, and the variable with the node's number.
        """
        # a state that moves is a series; a state at rest, such as the mode of a contact, is a constant of the step.
        # links that are summed node by node can move a state too
        edges = [joint.edge for joint in self.layout.joints if joint.target == node]
        moves = moving(node, [*edges, *(field.edge for field in self.fields)])
        suffix, index = end
        for c, (s, state, moved) in enumerate(zip(symbols, node.state, moves, strict=True)):
            name, group = f"{self.called[state.name]}{suffix}", self.layout.place(c, index)
            if s in used and moved:
                section.moving[s] = section.reads(of_state(group), name)
            elif s in used:
                section.fixed[s] = real(name)
                section.setting.append(let(name, Load("y", group)))

    def read_field_states(self, section: SeriesLoop, field: MeanField, suffix: str, used: Container[sp.Symbol]) -> None:
        """Let a section read a node of a mean field; subtract the first node's states from `shifted` states."""
        symbols = field.edge.there if suffix == "_there" else field.edge.here
        self.read_states(section, symbols, field.node, (suffix, "i"), used)
        for k in field.shifted:
            if (state := section.moving.get(symbols[k])) is not None:
                name = f"{self.called[field.node.state[k].name]}_first"
                first = section.reads(of_state(self.layout.place(k, "0")), name)
                section.moving[symbols[k]] = section.graph.sum([(ONE, state), (MINUS, first)])

    def see(self, section: SeriesLoop, other: SeriesLoop, series: Mapping[sp.Symbol, Series]) -> None:
        """Let a section read series of another section from memory; copy constants."""
        for symbol, s in series.items():
            constant = isinstance(s, Constant)
            section.moving[symbol] = s if constant else section.reads(Slot(s.name, other.index), s.name)

    def loaded(self, loads: Sequence[Assign]) -> list[Statement]:
        """Return statements that load parameters into variables with the names that the step uses."""
        return [let(self.called.get(name, name), s.value) for s in loads for name in s.targets]

    # -- statements -------------------------------------------------------------------------------------------

    @property
    def workspace(self) -> int:
        return sum(self.room().values())

    def room(self) -> dict[str, int]:
        """Return the number of groups of each part of the workspace, in the order of the parts."""
        eq, terms = self.equations, self.order + 1
        rooms = {"states": terms * eq.dimension, "rates": eq.dimension}
        if self.waves.lent:
            rooms["t"] = terms
        if eq.sticks:
            gaps = max(len(with_gaps(node)) - len(node.rhs) for node in eq.nodes) * eq.n
            rooms |= {"gaps": terms * gaps, "sizes": gaps, "closing": terms}
        for section in self.parts:
            rooms |= section.room()
        return rooms

    def opening(self) -> list[Statement]:
        # name the parts of the workspace by their offsets
        statements, group = list[Statement]([whole("TERMS", Number(self.order + 1))]), 0
        for name, groups in self.room().items():
            statements.append(whole(f"at_{name}", Name("DENSE_ROWS") * "DIMENSION" + group))
            group += groups
        # load the arrays of links, and the parameters of the whole network
        eq = self.equations
        shared = [(slot, name) for slot, name in enumerate(eq.parameters, start=eq.dimension) if name not in eq.single]
        return [
            *statements,
            Assign(NAMES, Name("graph"), whole=True),
            whole("LINKS", Name("target.size")),
            *(let(self.called[name], Load("p", Number(slot))) for slot, name in shared),
            *(
                let(s.name, lower(e.xreplace(self.substitutes)))
                for links in self.sums
                for s, e in links.factors.items()
            ),
            *self.waves.graph.constants,
        ]

    def coefficients(self) -> list[Statement]:
        # order 0: the states, time if a function of time has a series (t, scale, 0, 0, …), and all series
        statements: list[Statement] = [Comment("order 0")]
        statements += self.over_states(lambda p: [of_state(p).store(START, Load("y", p))])
        if self.waves.lent:
            t = Name("at_t")
            statements += [Store("dense", t, Name("t")), Store("dense", t + 1, Name("scale"))]
            statements.append(span("k", self.order + 1, 2).over([Store("dense", t + ORDER, NOTHING)]))
        statements += [s for section in self.parts for s in section.coefficients(START)]
        # order k: x_k = scale/k * rate_(k-1), and all series
        turn: list[Statement] = [let("number", 1.0 * ORDER), let("inverse", 1.0 / ORDER)]
        turn += self.next_states(Name("inverse") * "scale", ORDER)
        turn += [s for section in self.parts for s in section.coefficients(ORDER)]
        statements += [Comment("all further orders"), span("k", self.orders, 1).over(turn)]
        # the last order: only the states need a coefficient, unless kinks or contacts may end the step
        last = [] if self.ends else self.next_states(1.0 / self.order * Name("scale"), Number(self.order))
        return [*statements, *last]

    def over_states(self, body: Callable[[Expression], Iterable[Statement]]) -> list[Statement]:
        """Return loops over all states; `body` returns the statements for the state with a given index."""
        return [rows.over(body(index)) for rows, index in self.layout.rows]

    def next_states(self, factor: Expression, order: Expression) -> list[Statement]:
        """Return the statements that compute coefficients of the states from coefficients of the rates."""

        def one(index: Expression) -> list[Statement]:
            rate = Load("dense", plus(Name("at_rates"), index))
            return [of_state(index).store(order, Name("slope_scale") * rate)]

        return [let("slope_scale", factor), *self.over_states(one)]

    def sizes(self) -> list[Statement]:
        begin = [let(f"size_{k}", NOTHING) for k in last_orders(self.order)]
        return [*begin, *self.sizes_of_states(), *([SEEN] if self.watching else [])]

    def sizes_of_states(self) -> list[Statement]:
        """Return loops in which the last coefficients of all states limit the step."""
        return [rows.over(self.size(index, period)) for rows, index, period in self.layout.measured]

    def size(self, index: Expression, period: float | None) -> list[Statement]:
        """Return the statements for the sizes of one state's last coefficients, in units of its tolerance."""
        largest: Expression = absolute(Load("y", index))
        for k in (1, 2):
            largest = call("maximum", largest, absolute(of_state(index).load(Number(k))))
        return self.waves.weighed(Outer(of_state(index)), "", Name("rtol") * within(largest, period))

    def new_state(self) -> list[Statement]:
        def one(index: Expression) -> list[Statement]:
            value = polynomial("new", self.order, of_state(index).load)
            return [*value, Store("y_new", index, Name("new")), let("total", Name("total") + "new")]

        return [let("total", NOTHING), *self.over_states(one)]

    def rows(self) -> list[Statement]:
        # row k - 1 of the dense output is coefficient k in units of the step
        def one(index: Expression) -> list[Statement]:
            row = plus((ORDER - 1) * Name("DIMENSION"), index)
            return [Store("dense", row, Name("raised") * of_state(index).load(ORDER))]

        turn = [*self.over_states(one), let("raised", Name("raised") * "ratio")]
        return [let("raised", "ratio"), span("k", self.order + 1, 1).over(turn)]


def write_looped(equations: Equations, order: int) -> TaylorStep:
    """Return the looped Taylor step of this order; see `write_step`."""
    if equations.inertial and equations.link_count:
        kind = "links with inertia" if equations.inertial_links else "links of nodes with a mass matrix"
        raise ValueError(f"taylor: found {kind} in a network that is stepped in loops; use dop853 or rodas5p")
    check_passable(equations)
    return LoopedSeries(equations, order).step("graph", "weights")
