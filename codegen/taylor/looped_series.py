"""A Taylor step for a large network: loops over orders, nodes and links around the same recurrences.

Behind the rows of the dense output stand the coefficients of the states, the rates of one order, and the coefficients of
every series that a convolution reads: coefficient k of node i at `at_… + i*TERMS + k`, of link e at `at_… + e*TERMS + k`, of
what depends on time alone at `at_… + k`.  A convolution reads neighbours in memory, whatever the size of the network.
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
from .event_location import Stored, further
from .mass_matrix import moving, solved
from .series import Constant, Series, State, magnitude
from .series_graph import SeriesGraph, Template, check_jumps
from .series_writer import Gaps, SeriesWriter
from .simplify import absolute, add, times, within
from .step_length import SEEN, last_orders
from .taylor_step import StepWriter, TaylorStep

CONVOLUTION = '''
@njit(error_model='numpy')
def convolution(dense, left, right, k, first, end):
    """Sum of left_j*right_(k-j) for j = first … end - 1."""
    total = broadcast(0.0, WIDTH)
    for j in range(first, end):
        total = total + load(dense, left + j, WIDTH)*load(dense, right + (k - j), WIDTH)
    return total
'''.strip()
"""Loops of its own in each sum would take most of the time of a compilation."""

GAPS = (Name("i"), Name("NODES") + "i")
"""Where the two gaps of the contact of a node stand among those of one order."""

START, ORDER = Number(0), Name("k")
"""The order of the coefficients that a step begins with, and that of a loop over orders."""

NOTHING = 0.0 * Name("scale")
"""Zeros in all lanes."""


@dataclass(frozen=True, slots=True)
class Hoisted:
    """Rates in names: of series for what depends on time alone, of constants for what depends on parameters alone."""

    rates: list[sp.Expr]
    waves: dict[sp.Symbol, Series] = field(default_factory=dict)
    constants: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)


class Track(NamedTuple):
    """Where the coefficients of a series stand in the workspace: in a part of it, by place and order."""

    name: str
    place: Expression | None

    def at(self, order: Expression) -> Expression:
        """Where that of some order stands."""
        if self.place is None:
            return Name(f"at_{self.name}") + order
        return plus(Name(f"at_{self.name}"), self.place * Name("TERMS"), order)

    def load(self, order: Expression) -> Expression:
        """The coefficient of some order."""
        return Load("dense", self.at(order))

    def store(self, order: Expression, value: Expression) -> Store:
        """The statement that stores it."""
        return Store("dense", self.at(order), value)


@dataclass(eq=False, slots=True)
class Outer(State):
    """A state, or a series of another section, and where its coefficients stand."""

    track: Track


@dataclass(eq=False)
class SeriesLoop(SeriesWriter):
    """What is done alike for all nodes of a kind, for all links of a joint, or once, its coefficients in memory.

    span, count: the loop and the number of its turns in the whole numbering; `setting` loads what the turn needs at any
    order, `moving` are the symbols that stand for series, `fixed` those for names, `outer` the series that it reads and does
    not make, `rates` what it stores of those of states, `lent` are series that other sections need too, `gaps` those of
    contacts, or what links add to them; k: the order that is written, 0 or that of a loop.
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

    # -- what a recurrence asks for -------------------------------------------------------------------------------

    @property
    def index(self) -> str:
        """The variable of the loop, empty if there is none."""
        return "" if self.span is None else self.span.index

    def of(self, series: Series) -> Expression:
        if isinstance(series, Constant):
            return series.value if self.k == START else ZERO
        return self.values[series]

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        if self.k == START:
            return ZERO if first else times(self.of(left), self.of(right))
        total = f"s{self.sums}"
        self.sums += 1
        ends = (self.track(s).at(START) for s in (left, right))
        end = ORDER + 1 if last == 0 else ORDER
        self.put(let(total, call("convolution", "dense", *ends, ORDER, first, end)))
        return Name(total)

    def square(self, base: Series, first: int) -> Expression:
        return self.sum(base, base, first, -first)

    def keep(self, what: str, value: Expression) -> Name:
        if what not in self.kept:
            self.kept[what] = None
            self.put(let(what, value), self.note(what, Name(what) + NOTHING))
        return Name(what)

    # -- where coefficients are -----------------------------------------------------------------------------------

    def reads(self, track: Track, name: str) -> Series:
        """A series that this section reads."""
        self.outer.append(Outer(track, name=name))
        return self.outer[-1]

    def own(self, name: str) -> Track:
        """Where something of this section stands."""
        return Track(name, Name(self.index) if self.index else None)

    def track(self, series: Series) -> Track:
        """Where the coefficients of a series stand."""
        return series.track if isinstance(series, Outer) else self.own(series.name)

    def at(self, series: Series, k: int | Expression) -> Expression:
        return self.track(series).load(k if isinstance(k, Expression) else Number(k))

    def hold(self, series: Series, value: Expression, inline: bool) -> None:
        kept = series in self.remembered
        self.values[series] = value if inline and not kept else self.named(series.name, value)
        if kept:
            self.put(self.track(series).store(self.k, lane(self.values[series])))

    @cached_property
    def remembered(self) -> set[Series]:
        """Series whose earlier coefficients are needed, or all that is made once for other sections."""
        used = {used for s in self.graph.series for used in s.convolved}
        return {*used, *self.graph.watched, *self.graph.positive, *self.lent} - {*self.outer}

    def room(self) -> dict[str, int]:
        """How many groups of memory stand under which name: coefficients, and what has one value for each turn."""
        kept = {s.name for s in self.remembered}
        found = {name: (self.order + 1) * self.count for name in sorted(kept - {"t", ""})}
        return found | {name: self.count for name in (*self.kept, *self.hints)}

    def recall(self, what: str) -> Expression:
        return Load("dense", self.single(what))

    def note(self, what: str, value: Expression) -> Statement:
        return Store("dense", self.single(what), value)

    def single(self, what: str) -> Expression:
        """Where something stands that has one value for each turn of the section, whatever the order."""
        return plus(Name(f"at_{what}"), *([Name(self.index)] if self.index else []))

    def signs(self, series: Series) -> list[Statement]:
        return [span("k", self.order + 1, 1).over([further(self.at(series, ORDER))])]

    def weight(self, what: str) -> Name:
        return Name("weight")

    def enlarge(self, k: int, size: Expression) -> list[Statement]:
        return [let(f"size_{k}", call("maximum", f"size_{k}", size))]

    def counted(self, series: Series) -> list[Statement]:
        return [let("largest", self.low(series)), *self.weighed(series, "", Name("rtol") * "largest")]

    def end_of(self, series: Series, what: str) -> tuple[list[Statement], Expression]:
        return polynomial("value", self.order - 1, partial(self.at, series)), Name("value")

    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        tracks = zip(sizes, map(self.track, series), strict=True)
        return [], [Stored(size, track.at(START), self.order) for size, track in tracks]

    # -- statements -----------------------------------------------------------------------------------------------

    def coefficients(self, order: Expression) -> list[Statement]:
        """The statements for coefficients `order`: 0, or k for any later one."""
        self.statements, self.k, first = list(self.setting), order, order == START
        if not first:
            self.put(*(let(name, self.recall(name)) for name in self.kept))
        self.put(*(let(s.name, self.at(s, order)) for s in self.outer))
        self.values = {s: Name(s.name) for s in self.outer}
        self.make(self.graph.series, first)
        self.finish()
        return self.turns(self.statements)

    def finish(self) -> None:
        """Append the statements that use coefficient 0, or k, of the rates."""
        for place, rate in self.rates:
            value, there = self.of(rate), plus(Name("at_rates"), place)
            if not self.adds:
                self.put(Store("dense", there, value + NOTHING if isinstance(rate, Constant) else value))
            elif value != ZERO:
                self.give(there, value)
        for place, gap in zip(GAPS, self.gaps, strict=False):
            self.give(of_gap(place).at(self.k), self.of(gap))
            if self.k == START:
                self.give(plus(Name("at_sizes"), place), magnitude(self, gap))

    def give(self, place: Expression, value: Expression) -> None:
        """Store a value, or add it to what other sections have stored."""
        if self.adds:
            self.put(let("value", add(Load("dense", place), value)), Store("dense", place, Name("value")))
        else:
            self.put(Store("dense", place, lane(value)))

    def lengths(self) -> list[Statement]:
        return self.run([*super().lengths(), *self.watches()])

    def run(self, statements: list[Statement]) -> list[Statement]:
        return self.turns([*self.setting, *statements]) if statements else []

    def turns(self, statements: list[Statement]) -> list[Statement]:
        """Statements that are run through in the section's loop."""
        return statements if self.span is None else [self.span.over(statements)]


@dataclass(eq=False)
class Totals(SeriesLoop):
    """The sums over all nodes of some series, by their names."""

    totals: list[tuple[str, Series]] = field(default_factory=list)

    def coefficients(self, order: Expression) -> list[Statement]:
        """The statements for coefficients `order`, with the sums before and behind the loop."""
        names = [name for name, _ in self.totals]
        before = [let(f"{name}{rest}", NOTHING) for name in names for rest in ("", "_rest")]
        behind = [Store("dense", Name(f"at_{name}") + order, Name(name)) for name in names]
        return [*before, *super().coefficients(order), *behind]

    def finish(self) -> None:
        """Add the coefficients to the sums; those of a constant beyond the first are zero."""
        for name, rate in self.totals:
            value = self.of(rate)
            if value != ZERO:
                self.put(let(f"{name}_value", value), *compensated(name, f"{name}_value"))


@dataclass(eq=False)
class Gathered(SeriesLoop):
    """The sums over the links of each node of some series, by their names."""

    totals: list[tuple[str, Series]] = field(default_factory=list)

    def coefficients(self, order: Expression) -> list[Statement]:
        """The statements for coefficients `order`, behind those that begin with zero."""
        zeros = [self.sum_of(name).store(order, NOTHING) for name, _ in self.totals]
        return [span("i", "NODES").over(zeros), *super().coefficients(order)]

    def finish(self) -> None:
        """Add the coefficients to the sums; those of a constant beyond the first are zero."""
        for name, rate in self.totals:
            value, track = self.of(rate), self.sum_of(name)
            if value != ZERO:
                self.put(let("value", add(track.load(self.k), value)), track.store(self.k, Name("value")))

    @staticmethod
    def sum_of(name: str) -> Track:
        """Where a sum of the target stands."""
        return Track(name, Name("i"))


def of_state(place: Expression) -> Track:
    """Where the coefficients of a state stand."""
    return Track("states", place)


def of_gap(place: Expression) -> Track:
    """Where the coefficients of the gap of a contact stand."""
    return Track("gaps", place)


def gaps_of(mode: str) -> Gaps:
    """The gaps of the contact of a node with some mode."""
    rise, fall = (Outer(of_gap(place)) for place in GAPS)
    up, down = (Load("dense", plus(Name("at_sizes"), place)) for place in GAPS)
    return Gaps(mode, "stuck", (rise, fall), ("rise", "fall"), (up, down), Name("at_closing"))


def polynomial(name: str, degree: int, coefficient: Callable[[Expression], Expression]) -> list[Statement]:
    """The statements for the value of a polynomial in `ratio`."""
    further = let(name, Name(name) * "ratio" + coefficient(ORDER))
    return [
        let(name, coefficient(Number(degree))),
        Loop(ORDER.text, Number(degree - 1), Number(-1), (further,), step=-1),
    ]


def with_gaps(node: Node) -> list[sp.Expr]:
    """The rates of a node, and the two gaps of each event."""
    return [*node.rhs, *(gap for event in node.events for gap in event.gaps)]


def with_pushes(joint: Joint) -> list[sp.Expr]:
    """What a link adds to the rates of a node, and to the gaps of its contact if it has one: forces on a body that sticks."""
    edge = joint.edge
    if not joint.target.events:
        return list(edge.rhs)
    mode = edge.here[2]
    push = (1 - mode**2) * edge.rhs[1].xreplace({mode: sp.S.One})
    return [*edge.rhs, push, -push]


class LoopedSeries(StepWriter):
    """Writes loops around the recurrences, with a part for what each of them makes."""

    functions: Sequence[str] = (CONVOLUTION,)

    def __init__(self, equations: Equations, order: int) -> None:
        eq = equations
        named = {s for node in eq.nodes for s in (*node.state, *node.parameters)}
        named |= {s for edge in eq.edges for s in (edge.weight, *edge.parameters)}
        words = {*(s.name for s in named), *eq.parameters}
        super().__init__(equations, order, words)
        self.places, self.fields = StateLayout(equations), mean_fields(equations)
        self.names = Names([*words, *self.called.values(), *(s + end for s in words for end in ("_here", "_there"))])
        self.varied = [real(name) for name in eq.differing]
        self.waves = SeriesLoop(SeriesGraph(self.names), order)
        kinds, (self.sums, joints) = self.places.kinds, link_sums(equations, self.places.joints)
        rates = [[*with_gaps(kind.node), *(e for links in self.sums for e in links.of_node())] for kind in kinds]
        nodes = [self.hoisted(e, [*kind.node.state, *self.varied]) for kind, e in zip(kinds, rates, strict=True)]
        pushes = [self.of_links(joint.edge, with_pushes(joint)) for joint in joints]
        fields = [
            [self.of_links(f.edge, e, (*f.sums, *f.shared)) for e in (f.sums.values(), f.shared.values(), f.rates)]
            for f in self.fields
        ]
        self.waves.graph.settle(self.waves.lent)
        if self.waves.lent:
            self.waves.outer.append(self.time)
        self.parts: list[SeriesLoop] = [self.waves, *map(self.node, kinds, nodes), *map(self.link, joints, pushes)]
        for mean, parts in zip(self.fields, fields, strict=True):
            self.parts += self.field(mean, *parts)
        names = [name for links in self.sums for name in links.functions]
        functions = dict(zip(names, self.lent, strict=True))
        for links in self.sums:
            self.parts += self.summed(links, {name: functions[name] for name in links.functions})
        self.ends = eq.sticks or any(section.graph.kinks for section in self.parts)
        self.orders = order + 1 if self.ends else order

    # -- sections ---------------------------------------------------------------------------------------------

    def node(self, kind: NodeKindLayout, found: Hoisted) -> SeriesLoop:
        """The rates of the nodes of a kind."""
        node, section = (
            kind.node,
            SeriesLoop(SeriesGraph(self.names), self.order, span=kind.span, count=self.equations.n),
        )
        self.end(section, node.state, node, ("", "i"), node.state)
        used = {s for e in (*found.rates, *(e for row in node.inertia for e in row)) for s in e.free_symbols}
        section.setting += self.loaded(self.places.own(used))
        series, size = self.read(section, found, node.inertia), len(with_gaps(node))
        self.store(section, node, series[:size])
        # what the node is as a source of links that are summed stands in memory for them
        self.node_part, self.lent = section, series[size:]
        section.lent += [s for s in series[size:] if not isinstance(s, Constant)]
        section.contacts += [gaps_of(self.called[event.mode.name]) for event in node.events]
        return section

    def of_links(self, edge: Edge, rates: Iterable[sp.Expr], more: Iterable[sp.Symbol] = ()) -> Hoisted:
        """Rates by links, and of `more` symbols that move, parted like those of nodes if time enters them."""
        if not edge.forced:
            return Hoisted(list(rates))
        own = (edge.weight, *edge.here, *edge.there, *(s for s, _ in edge.theirs), *self.varied, *more)
        return self.hoisted(rates, own)

    def link(self, joint: Joint, found: Hoisted) -> SeriesLoop:
        """What the links of a joint add."""
        edge, used = joint.edge, {s for e in found.rates for s in e.free_symbols}
        section = SeriesLoop(SeriesGraph(self.names), self.order, span=joint.span, count=self.places.links, adds=True)
        section.setting += link_ends(edge, self.called[edge.weight.name], "j_there")
        self.end(section, edge.here, joint.target, ("_here", "i"), used)
        self.end(section, edge.there, joint.source, ("_there", "j_there"), used)
        section.setting += self.loaded(self.places.of_link(edge, used, "j_there"))
        section.fixed |= theirs(edge)
        self.store(section, joint.target, self.read(section, found))
        return section

    def store(self, section: SeriesLoop, node: Node, found: Sequence[Series]) -> None:
        """Let a section store what was read for a node: its rates at their places, and behind them its gaps."""
        size = len(node.state)
        section.rates, section.gaps = (
            [(self.places.place(c), rate) for c, rate in enumerate(found[:size])],
            list(found[size:]),
        )

    def end(
        self,
        section: SeriesLoop,
        symbols: Sequence[sp.Symbol],
        node: Node,
        at: tuple[str, str],
        used: Container[sp.Symbol],
    ) -> None:
        """Let a section read the states of a node, or of one end of a link, that are used.

        Those that move are series, those at rest names.  `at` is what stands behind their names, and the number of the node.
        """
        suffix, index = at
        for c, (s, own, moves) in enumerate(zip(symbols, node.state, self.moves(node), strict=True)):
            name, place = f"{self.called[own.name]}{suffix}", self.places.place(c, index)
            if s in used and moves:
                section.moving[s] = section.reads(of_state(place), name)
            elif s in used:
                section.fixed[s] = real(name)
                section.setting.append(let(name, Load("y", place)))

    def field(self, field: MeanField, sums: Hoisted, shared: Hoisted, rates: Hoisted) -> Iterator[SeriesLoop]:
        """The sums over the nodes, what all nodes make of them, and what is added to the rates.

        Source functions that are functions of the target too are series once.
        """
        nodes = self.places.kinds[0].span
        totals = Totals(SeriesGraph(self.names), self.order, span=nodes, count=self.equations.n)
        used = {s for e in sums.rates for s in e.free_symbols}
        self.field_end(totals, field, "_there", used)
        totals.setting += self.loaded(self.places.of_source(field.edge, used, "i"))
        totals.fixed |= theirs(field.edge)
        found = self.read(totals, sums)
        totals.totals = [(s.name, series) for s, series in zip(field.sums, found, strict=True)]
        yield totals
        combined = SeriesLoop(SeriesGraph(self.names), self.order)
        self.see(combined, self.waves, shared.waves)
        self.see(combined, combined, {s: State(name=s.name) for s in field.sums})
        common = dict(zip(field.shared, self.read(combined, replace(shared, waves={})), strict=True))
        combined.lent += [series for series in common.values() if not isinstance(series, Constant)]
        yield combined
        target = SeriesLoop(SeriesGraph(self.names), self.order, span=nodes, count=self.equations.n, adds=True)
        made = dict(zip(field.sums, found, strict=True))
        lent = {e: made[s] for s, e in field.alike.items() if made[s] in totals.graph.series}
        borrowed = {e: real(series.name) for e, series in lent.items()}
        wanted = [e.xreplace(borrowed) for e in rates.rates]
        used = {s for e in wanted for s in e.free_symbols}
        self.field_end(target, field, "_here", used)
        target.setting += self.loaded(self.places.own(used))
        lent = {e: series for e, series in lent.items() if borrowed[e] in used}
        totals.lent += lent.values()
        self.see(target, totals, {borrowed[e]: series for e, series in lent.items()})
        self.see(target, combined, common)
        self.store(target, field.node, self.read(target, replace(rates, rates=wanted)))
        yield target

    def summed(self, links: LinkSums, functions: Mapping[sp.Symbol, Series]) -> Iterator[SeriesLoop]:
        """The sums over links of functions of their sources, and what is added to the rates."""
        edge, nodes, n = links.joint.edge, self.places.kinds[0].span, self.equations.n
        sums = Gathered(SeriesGraph(self.names), self.order, span=links.joint.span, count=self.places.links)
        sums.setting += link_ends(edge, self.called[edge.weight.name], "j_there")
        used = {s for factor, _ in links.sums.values() for s in factor.free_symbols}
        sums.setting += self.loaded(self.places.of_link(edge, used, "j_there"))
        for symbol, s in functions.items():
            known = isinstance(s, Constant)
            sums.moving[symbol] = s if known else sums.reads(Track(s.name, Name("j_there")), s.name)
        found = self.read(sums, Hoisted([a * b for a, b in links.sums.values()]))
        sums.totals = [(s.name, series) for s, series in zip(links.sums, found, strict=True)]
        yield sums
        target = SeriesLoop(SeriesGraph(self.names), self.order, span=nodes, count=n, adds=True)
        rates = links.applied()
        used = {s for e in rates for s in e.free_symbols}
        self.end(target, edge.here, links.joint.target, ("_here", "i"), used)
        target.setting += self.loaded(self.places.own(used))
        self.see(target, self.node_part, {symbol: s for symbol, s in functions.items() if symbol in used})
        self.see(target, target, {s: State(name=s.name) for s in links.sums})
        self.store(target, links.joint.target, self.read(target, Hoisted(rates)))
        yield target

    def field_end(self, section: SeriesLoop, field: MeanField, suffix: str, used: Container[sp.Symbol]) -> None:
        """Let a section read a node of a mean field; states of which differences alone matter count from the first node's."""
        symbols = field.edge.there if suffix == "_there" else field.edge.here
        self.end(section, symbols, field.node, (suffix, "i"), used)
        for k in field.shifted:
            if (state := section.moving.get(symbols[k])) is not None:
                name = f"{self.called[field.node.state[k].name]}_first"
                first = section.reads(of_state(self.places.place(k, "0")), name)
                section.moving[symbols[k]] = section.graph.sum([(ONE, state), (Number(-1.0), first)])

    def see(self, section: SeriesLoop, other: SeriesLoop, series: Mapping[sp.Symbol, Series]) -> None:
        """Let a section read the series of another one; constants are no different."""
        for symbol, s in series.items():
            section.moving[symbol] = s if isinstance(s, Constant) else section.reads(other.own(s.name), s.name)

    def moves(self, node: Node) -> list[bool]:
        """Which states of a node move: one at rest, such as the mode of a contact, is a constant of the step."""
        edges = [
            joint.edge for joint in self.places.joints if joint.target == node
        ]  # those that are summed by nodes too
        return moving(node, [*edges, *(field.edge for field in self.fields)])

    def loaded(self, loads: Sequence[Assign]) -> list[Statement]:
        """Statements that load parameters."""
        return [let(self.called.get(name, name), s.value) for s in loads for name in s.targets]

    def hoisted(self, given: Iterable[sp.Expr], moving: Sequence[sp.Symbol]) -> Hoisted:
        """Some rates with names for what depends on time and parameters, series for what depends on time, and the rest,
        which depends on parameters alone.
        """
        hoist = Hoist(frozenset(moving), self.names.fresh("wave_"), frozenset({TIME}))
        rates = [hoist.apply(e) for e in given]
        waves: dict[sp.Symbol, Series] = {}
        constants: dict[sp.Symbol, sp.Expr] = {}
        for e, symbol in hoist.table.items():
            if not e.has(TIME):
                constants[symbol] = e.xreplace(self.swap)
                continue
            template = Template.of([e], [TIME], self.names.fresh("shared_"))
            (waves[symbol],) = self.waves.graph.read(template, {TIME: self.time}, self.swap)
            self.waves.lent.append(waves[symbol])
        return Hoisted(rates, waves, constants)

    def read(self, section: SeriesLoop, given: Hoisted, inertia: Block = ()) -> list[Series]:
        """The series of a section, and the constants that each of its turns computes."""
        self.see(section, self.waves, given.waves)
        graph, size, masses = section.graph, len(given.rates), (e for row in inertia for e in row)
        template = Template.of([*given.rates, *masses], section.moving, self.names.fresh("shared_"))
        found = graph.read(template, section.moving, {**self.swap, **given.constants, **section.fixed})
        entries, right = {divmod(k, size): e for k, e in enumerate(found[size:])}, dict(enumerate(found[:size]))
        found = list((solved(graph, entries, right) if entries else right).values())
        graph.settle(found)
        section.setting += graph.constants
        return found

    # -- statements -------------------------------------------------------------------------------------------

    @property
    def workspace(self) -> int:
        return self.bases()[1]

    def opening(self) -> list[Statement]:
        """Name the parts of the workspace, load the graph and what is a parameter of the whole network."""
        eq = self.equations
        numbers = [(slot, name) for slot, name in enumerate(eq.parameters, start=eq.dimension) if name not in eq.single]
        return [
            *self.bases()[0],
            Assign(NAMES, Name("graph"), whole=True),
            whole("LINKS", Name("target.size")),
            *(let(self.called[name], Load("p", Number(slot))) for slot, name in numbers),
            *(let(s.name, lower(e.xreplace(self.swap))) for links in self.sums for s, e in links.factors.items()),
            *self.waves.graph.constants,
        ]

    def coefficients(self) -> list[Statement]:
        begun = self.states(lambda p: [of_state(p).store(START, Load("y", p))])
        found: list[Statement] = [Comment("order 0"), *begun, *self.times()]
        found += [s for section in self.parts for s in section.coefficients(START)]
        turn: list[Statement] = [let("number", 1.0 * ORDER), let("inverse", 1.0 / ORDER)]
        turn += self.next_states(Name("inverse") * "scale", ORDER)
        turn += [s for section in self.parts for s in section.coefficients(ORDER)]
        found += [Comment("all further orders"), span("k", self.orders, 1).over(turn)]
        return found if self.ends else [*found, *self.next_states(1.0 / self.order * Name("scale"), Number(self.order))]

    def times(self) -> list[Statement]:
        """The coefficients of time, if any function of time has a series."""
        if not self.waves.lent:
            return []
        zeros = Store("dense", Name("at_t") + ORDER, NOTHING)
        known = [Store("dense", Name("at_t"), Name("t")), Store("dense", Name("at_t") + 1, Name("scale"))]
        return [*known, span("k", self.order + 1, 2).over([zeros])]

    def bases(self) -> tuple[list[Statement], int]:
        """Where everything stands in the workspace, and how much it takes."""
        found, size = list[Statement]([whole("TERMS", Number(self.order + 1))]), 0
        for name, groups in self.room().items():
            found.append(whole(f"at_{name}", Name("DENSE_ROWS") * "DIMENSION" + size))
            size += groups
        return found, size

    def room(self) -> dict[str, int]:
        """How many groups the parts of the workspace take, in their order."""
        eq, p = self.equations, self.order
        sizes = {"states": (p + 1) * eq.dimension, "rates": eq.dimension}
        if self.waves.lent:
            sizes["t"] = p + 1
        if eq.sticks:
            sizes |= {"gaps": (p + 1) * 2 * eq.n, "sizes": 2 * eq.n, "closing": p + 1}
        for section in self.parts:
            sizes |= section.room()
            if isinstance(section, Gathered):
                sizes |= {name: (p + 1) * eq.n for name, _ in section.totals}
            if isinstance(section, Totals):
                sizes |= {name: p + 1 for name, _ in section.totals}
        return sizes

    def states(self, body: Callable[[Expression], Iterable[Statement]]) -> list[Statement]:
        """Loops over all states: what is done with the place of one."""
        return [span.over(body(place)) for span, place in self.places.rows]

    def next_states(self, factor: Expression, order: Expression) -> list[Statement]:
        """Coefficients of the states from those of the rates."""
        slopes = self.states(
            lambda p: [of_state(p).store(order, Name("slope_scale") * Load("dense", plus(Name("at_rates"), p)))]
        )
        return [let("slope_scale", factor), *slopes]

    def sizes(self) -> list[Statement]:
        begun = [let(f"size_{k}", NOTHING) for k in last_orders(self.order)]
        return [*begun, *self.counted_states(), *([SEEN] if self.watching else [])]

    def counted_states(self) -> list[Statement]:
        """Loops that let the last coefficients of all states count."""
        return [span.over(self.size(place, period)) for span, place, period in self.places.measured]

    def size(self, place: Expression, period: float | None) -> list[Statement]:
        """Let the last coefficients of a state count, in units of its tolerance."""
        largest: Expression = absolute(Load("y", place))
        for k in (1, 2):
            largest = call("maximum", largest, absolute(of_state(place).load(Number(k))))
        return self.waves.weighed(Outer(of_state(place)), "", Name("rtol") * within(largest, period))

    def new_state(self) -> list[Statement]:
        return [let("total", NOTHING), *self.states(self.end_of)]

    def end_of(self, place: Expression) -> list[Statement]:
        """The new value of a state."""
        found = polynomial("new", self.order, of_state(place).load)
        return [*found, Store("y_new", place, Name("new")), let("total", Name("total") + "new")]

    def rows(self) -> list[Statement]:
        rows = self.states(
            lambda p: [
                Store("dense", plus((ORDER - 1) * Name("DIMENSION"), p), Name("raised") * of_state(p).load(ORDER))
            ]
        )
        turn = [*rows, let("raised", Name("raised") * "ratio")]
        return [let("raised", "ratio"), span("k", self.order + 1, 1).over(turn)]


def write_looped(equations: Equations, order: int) -> TaylorStep:
    """Return the looped Taylor step of some order; see `write_step`."""
    if equations.inertial and equations.link_count:
        found = "links with inertia" if equations.inertial_links else "links of nodes with a mass matrix"
        raise ValueError(f"taylor: found {found} in a network that is stepped in loops; use dop853 or rodas5p")
    check_jumps(equations)
    return LoopedSeries(equations, order).step("graph", "weights")
