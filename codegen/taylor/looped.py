"""A Taylor step for a large network: loops over orders, nodes and links around the same recurrences.

Behind the rows of the dense output stand the coefficients of the states, the rates of one order, and the coefficients of
every series that a convolution reads: coefficient k of node i at `at_… + k*NODES + i`, of link e at `at_… + k*LINKS + e`, of
what depends on time alone at `at_… + k`.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Block, Edge, Node

from ..program.expressions import ONE, ZERO, Expression, Load, Name, Number, Product, call, factors_of, plus
from ..program.passes import Hoist, Names, real
from ..program.statements import Assign, Comment, If, Loop, Statement, Store, let, whole
from ..steps.fields import MeanField, compensated, mean_fields
from ..steps.names import NAMES
from ..steps.places import Joint, Kind, Span, places, span
from .graph import Graph, Template, check_jumps
from .length import finished, last_orders, reach, unseen
from .masses import moving, solved
from .passage import Stored, closed, first_passage, further, jumps, loose, settled, told
from .series import Constant, Series, State, Time, magnitude
from .step import TaylorStep, broken, called, returned
from .terms import absolute, add, lane, largest

__all__ = ["write_looped"]

CONVOLUTION = '''
@njit(error_model='numpy')
def convolution(dense, left, left_step, right, right_step, k, first, end):
    """Sum of left_j*right_(k-j) for j = first … end - 1; the coefficients of a series stand a step apart."""
    total = broadcast(0.0, WIDTH)
    for j in range(first, end):
        total = total + load(dense, left + j*left_step, WIDTH)*load(dense, right + (k - j)*right_step, WIDTH)
    return total
'''.strip()
"""Loops of its own in each sum would take most of the time of a compilation."""

GAPS = (Name("i"), Name("NODES") + "i")
"""Where the two gaps of the contact of a node stand among those of one order."""

START, ORDER = Number(0), Name("k")
"""The order of the coefficients that a step begins with, and that of a loop over orders."""

COUNTS = {"": Number(1), "i": Name("NODES"), "e": Name("LINKS")}
"""How far the coefficients of a series of one order stand behind those of the last, by the loop that makes them."""


@dataclass(frozen=True, slots=True)
class Hoisted:
    """Rates in names: of series for what depends on time alone, of constants for what depends on parameters alone."""

    rates: list[sp.Expr]
    waves: dict[sp.Symbol, Series] = field(default_factory=dict)
    constants: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)


@dataclass(slots=True)
class Section:
    """What is done alike for all nodes of a kind, for all links of a joint, or once.

    span, count: the loop and the number of its turns in the whole numbering; `setting` loads what the turn needs at any
    order, `places` are the states that it reads, and where they stand, `rates` what it stores of those, `lent` are series
    that other sections need too, `gaps` those of contacts, or what links add to them, `mode` says whether these slip.
    """

    graph: Graph
    span: Span | None = None
    count: int = 1
    setting: list[Statement] = field(default_factory=list)
    places: dict[Series, Expression] = field(default_factory=dict)
    rates: list[tuple[Expression, Series]] = field(default_factory=list)
    lent: list[Series] = field(default_factory=list)
    gaps: list[Series] = field(default_factory=list)
    mode: str = ""
    adds: bool = False
    waves: dict[Series, Section] = field(default_factory=dict)
    kept: list[str] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    values: dict[Series, Expression] = field(default_factory=dict)
    sums: int = 0

    # -- what a recurrence asks for -------------------------------------------------------------------------------

    @property
    def index(self) -> str:
        """The variable of the loop, empty if there is none."""
        return "" if self.span is None else self.span.index

    @property
    def inverse(self) -> Expression:
        """1/k."""
        return Name("inverse")

    @property
    def number(self) -> Expression:
        """k."""
        return Name("number")

    def of(self, series: Series) -> Expression:
        """Coefficient k of a series."""
        if isinstance(series, Constant):
            return ZERO
        return self.values[series]

    def start(self, series: Series) -> Expression:
        """Coefficient 0 of a series."""
        return series.value if isinstance(series, Constant) else self.values[series]

    def now(self, series: Series, first: bool) -> Expression:
        """Coefficient 0 of a series, or k."""
        return self.start(series) if first else self.of(series)

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        """Sum of left_j * right_(k-j) for j = first … k + last."""
        total = f"s{self.sums}"
        self.sums += 1
        ends = (part for s in (left, right) for part in (self.where(s, START), self.stride(s)))
        end = ORDER + 1 if last == 0 else ORDER
        self.put(let(total, call("convolution", "dense", *ends, ORDER, first, end)))
        return Name(total)

    def square(self, base: Series, first: int) -> Expression:
        """Sum of base_j * base_(k-j) for j = first … k - first."""
        return self.sum(base, base, first, -first)

    def keep(self, what: str, value: Expression) -> Name:
        """Compute something once; returns its name."""
        if what not in self.kept:
            self.kept.append(what)
            self.put(let(what, value), Store("dense", self.slot(what, START), Name(what) + NOTHING))
        return Name(what)

    def hint(self, series: Series) -> Expression:
        """The side of zero on which a series that begins at zero lies just after."""
        return Load("dense", self.slot(f"hint_{series.name}", START))

    # -- places ---------------------------------------------------------------------------------------------------

    def slot(self, name: str, order: Expression) -> Expression:
        """Where a coefficient of a series of this section stands."""
        if self.span is None:
            return Name(f"at_{name}") + order
        return at(name, order, COUNTS[self.index], Name(self.index))

    def load(self, series: Series, order: Expression) -> Expression:
        """A coefficient of a series from memory."""
        return Load("dense", self.where(series, order))

    def where(self, series: Series, order: Expression) -> Expression:
        """Where a coefficient of a series stands."""
        if series in self.places:
            return at("states", order, Name("DIMENSION"), self.places[series])
        return self.waves.get(series, self).slot(series.name, order)

    def stride(self, series: Series) -> Expression:
        """How far one coefficient of a series stands behind the last."""
        return Name("DIMENSION") if series in self.places else COUNTS[self.waves.get(series, self).index]

    @property
    def remembered(self) -> set[Series]:
        """Series whose earlier coefficients are needed, or all that is made once for other sections."""
        used = {used for s in self.graph.series for used in s.convolved}
        used |= {*self.graph.watched, *self.graph.positive, *self.lent}
        return used - {*self.places, *self.waves}

    # -- statements -----------------------------------------------------------------------------------------------

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def coefficients(self, order: Expression) -> list[Statement]:
        """The statements for coefficients `order`: 0, or k for any later one."""
        self.statements, first = list(self.setting), order == START
        outer = [*self.places, *self.waves]
        if not first:
            self.put(*(let(name, Load("dense", self.slot(name, START))) for name in self.kept))
        self.put(*(let(s.name, self.load(s, order)) for s in outer))
        self.values = {s: Name(s.name) for s in outer}
        remembered = self.remembered
        for s in self.graph.series:
            value = s.begin(self) if first else s.coefficient(self)
            inline = s in (self.graph.inline_start if first else self.graph.inline) and s not in remembered
            if not inline and not isinstance(value, Name | Number):
                self.put(let(s.name, value))
                value = Name(s.name)
            self.values[s] = value
            if s in remembered:
                self.put(Store("dense", self.slot(s.name, order), lane(value)))
        self.finish(first)
        return self.turns(self.statements)

    def finish(self, first: bool) -> None:
        """Append the statements that use coefficient 0, or k, of the rates."""
        for place, rate in self.rates:
            value, there = self.now(rate, first), plus(Name("at_rates"), place)
            if not self.adds:
                self.put(Store("dense", there, value + NOTHING if isinstance(rate, Constant) else value))
            elif value != ZERO:
                self.give(there, value)
        for place, gap in zip(GAPS, self.gaps, strict=False):
            self.give(of_gap(START if first else ORDER, place), self.now(gap, first))
            if first:
                self.give(plus(Name("at_sizes"), place), magnitude(self, gap))

    def give(self, place: Expression, value: Expression) -> None:
        """Store a value, or add it to what other sections have stored."""
        if self.adds:
            self.put(let("value", add(Load("dense", place), value)), Store("dense", place, Name("value")))
        else:
            self.put(Store("dense", place, lane(value)))

    def ends(self, order: int) -> list[Statement]:
        """The statements that make the step NaN where a series of this section has passed a zero that it cannot pass."""
        found = list[Statement]()
        for s in self.graph.positive:
            found += polynomial("value", order - 1, partial(self.load, s))
            found.append(broken(Name("value"), self.load(s, START)))
        return self.run(found)

    def passages(self, degree: int, exact: bool) -> list[Statement]:
        """The statements that end the step at the kinks and contacts of this section."""
        found = list[Statement]()
        for kink in self.graph.kinks:
            size = Load("dense", self.slot(kink.size.text, START))
            stored = Stored(size, self.where(kink.base, START), self.stride(kink.base), degree)
            found += kink.passages(Load("dense", self.slot(kink.name, START)), stored)
        if self.mode:
            gaps = [Stored(size_of_gap(place), of_gap(START, place), 2 * Name("NODES"), degree) for place in GAPS]
            found += closed(self.mode, exact, gaps, "stuck", Name("at_closing"))
        return self.run(found)

    @property
    def hints(self) -> list[str]:
        """What the sides of series that begin at zero are called."""
        return list(dict.fromkeys(f"hint_{kink.base.name}" for kink in self.graph.kinks))

    def unknown(self) -> list[Statement]:
        """The statements that forget these sides."""
        return self.run([Store("dense", self.slot(hint, START), NOTHING) for hint in self.hints])

    def sides(self, degree: int) -> list[Statement]:
        """The statements that take note of those that the coefficients tell."""
        found = list[Statement]()
        for kink in self.graph.kinks:
            begun, hint = (self.slot(name, START) for name in (kink.name, f"hint_{kink.base.name}"))
            known = span("k", degree + 1, 1).over([further(self.load(kink.base, ORDER))])
            found.append(told(Load("dense", begun), [known], partial(noted, hint)))
        return self.run(found)

    def lengths(self, order: int) -> list[Statement]:
        """The statements that make the step no longer than the series of this section let it be."""
        found = list[Statement]()
        for s in self.graph.gaps:
            found.append(let("largest", largest(absolute(self.load(s, Number(k))) for k in range(3))))
            found += weighed(Name("rtol") * "largest", order, partial(self.load, s))
        for place in GAPS if self.mode else ():
            found += weighed(Name("loose") * size_of_gap(place), order, partial(gap_at, place))
        for s in self.graph.watched:
            found += unseen([self.load(s, Number(k)) for k in range(order)])
        return self.run(found)

    def run(self, statements: list[Statement]) -> list[Statement]:
        """Statements, if there are any, that are run through behind what a turn needs."""
        return self.turns([*self.setting, *statements]) if statements else []

    def turns(self, statements: list[Statement]) -> list[Statement]:
        """Statements that are run through in the section's loop."""
        return statements if self.span is None else [self.span.over(statements)]


@dataclass(slots=True)
class Totals(Section):
    """The sums over all nodes of some series, by their names."""

    totals: list[tuple[str, Series]] = field(default_factory=list)

    def coefficients(self, order: Expression) -> list[Statement]:
        """The statements for coefficients `order`, with the sums before and behind the loop."""
        names = [name for name, _ in self.totals]
        before = [let(f"{name}{rest}", NOTHING) for name in names for rest in ("", "_rest")]
        behind = [Store("dense", Name(f"at_{name}") + order, Name(name)) for name in names]
        # a class with slots has no cell for super()
        return [*before, *Section.coefficients(self, order), *behind]

    def finish(self, first: bool) -> None:
        """Add the coefficients to the sums; those of a constant beyond the first are zero."""
        for name, rate in self.totals:
            value = self.now(rate, first)
            if value != ZERO:
                self.put(let(f"{name}_value", value), *compensated(name, f"{name}_value"))


NOTHING = 0.0 * Name("scale")
"""Zeros in all lanes."""


def noted(hint: Expression, new: Expression) -> Statement:
    """Take note of the side of a series that begins at zero."""
    return Store("dense", hint, call("side_or", Load("dense", hint), new))


def at(name: str, order: Expression, stride: Expression, place: Expression) -> Expression:
    """Where a coefficient of something stands in the workspace."""
    behind = [] if order == START else [Product((order, *factors_of(stride)))]
    return plus(Name(f"at_{name}"), *behind, place)


def of_gap(order: Expression, place: Expression) -> Expression:
    """Where a coefficient of the gap of a contact stands."""
    return at("gaps", order, 2 * Name("NODES"), place)


def gap_at(place: Expression, order: Expression) -> Expression:
    """A coefficient of the gap of a contact."""
    return Load("dense", of_gap(order, place))


def size_of_gap(place: Expression) -> Expression:
    """The size of the terms that the gap of a contact begins with."""
    return Load("dense", plus(Name("at_sizes"), place))


def polynomial(name: str, degree: int, coefficient: Callable[[Expression], Expression]) -> list[Statement]:
    """The statements for the value of a polynomial in `ratio`."""
    further = let(name, Name(name) * "ratio" + coefficient(ORDER))
    return [
        let(name, coefficient(Number(degree))),
        Loop(ORDER.text, Number(degree - 1), Number(-1), (further,), step=-1),
    ]


def with_gaps(node: Node) -> list[sp.Expr]:
    """The rates of a node, and the two gaps of its contact if it has one."""
    if node.contact is None:
        return list(node.rhs)
    return [*node.rhs, *node.contact.gaps(node.state[2])]


def with_pushes(joint: Joint) -> list[sp.Expr]:
    """What a link adds to the rates of a node, and to the gaps of its contact if it has one: forces on a body that sticks."""
    edge = joint.edge
    if joint.target.contact is None:
        return list(edge.rhs)
    mode = edge.here[2]
    push = (1 - mode**2) * edge.rhs[1].xreplace({mode: sp.S.One})
    return [*edge.rhs, push, -push]


def weighed(error: Expression, order: int, coefficient: Callable[[Expression], Expression]) -> list[Statement]:
    """Statements that let the last coefficients of something count, in units of the error that it may have."""
    found: list[Statement] = [let("weight", 1.0 / (Name("atol") + error))]
    for k in last_orders(order):
        found.append(let(f"size_{k}", call("maximum", f"size_{k}", absolute(coefficient(Number(k))) * "weight")))
    return found


def theirs(edge: Edge) -> dict[sp.Symbol, sp.Symbol]:
    """What the parameters are called that a link takes of its source."""
    return {s: real(f"{own.name}_there") for s, own in edge.theirs}


class LoopWriter:
    """Writes the looped step of some order for tidy equations."""

    def __init__(self, equations: Equations, order: int) -> None:
        self.equations, self.order, self.places = equations, order, places(equations)
        self.fields, self.exact = mean_fields(equations), jumps(equations)
        self.links = sum(len(layer.links) for layer in equations.listed)
        eq = equations
        named = {s for node in eq.nodes for s in (*node.state, *node.parameters)}
        named |= {s for edge in eq.edges for s in (edge.weight, *edge.parameters)}
        words = sorted({s.name for s in named} | set(eq.parameters))
        self.called = called(words)
        self.swap = {real(old): real(new) for old, new in self.called.items()}
        self.names = Names([*words, *self.called.values(), *(s + end for s in words for end in ("_here", "_there"))])
        self.time = Time(name="t")
        self.waves = Section(Graph(self.names))
        kinds, joints = self.places.kinds, self.places.joints
        nodes = [self.hoisted(with_gaps(kind.node), [*kind.node.state, *self.varied]) for kind in kinds]
        links = [self.of_links(joint.edge, with_pushes(joint)) for joint in joints]
        fields = [self.of_field(field) for field in self.fields]
        self.waves.graph.settle(self.waves.lent)
        if self.waves.lent:
            self.waves.waves[self.time] = self.waves
        self.sections = [self.waves, *map(self.node, kinds, nodes), *map(self.link, joints, links)]
        for mean, parts in zip(self.fields, fields, strict=True):
            self.sections += self.field(mean, *parts)
        self.ends = eq.sticks or any(section.graph.kinks for section in self.sections)
        self.orders = order + 1 if self.ends else order

    # -- sections ---------------------------------------------------------------------------------------------

    @property
    def varied(self) -> list[sp.Symbol]:
        """Parameters that have a value for each node or link."""
        return [real(name) for name in self.equations.differing]

    def node(self, kind: Kind, found: Hoisted) -> Section:
        """The rates of the nodes of a kind."""
        node, section = kind.node, Section(Graph(self.names), kind.span, self.equations.n)
        moving, fixed = self.end(section, node.state, node, ("", "i"), node.state)
        used = {s for e in (*found.rates, *(e for row in node.inertia for e in row)) for s in e.free_symbols}
        section.setting += self.loaded(self.places.own(used))
        moving |= self.seen(section, self.waves, found.waves)
        swap = {**found.constants, **fixed}
        self.store(section, node, self.read(section, found.rates, moving, swap, node.inertia))
        if node.contact is not None:
            section.mode = self.called[node.state[2].name]
        return section

    def of_links(self, edge: Edge, rates: Sequence[sp.Expr], more: Iterable[sp.Symbol] = ()) -> Hoisted:
        """Rates by links, and of `more` symbols that move, parted like those of nodes if time enters them."""
        if not edge.forced:
            return Hoisted(list(rates))
        own = (edge.weight, *edge.here, *edge.there, *(s for s, _ in edge.theirs), *self.varied, *more)
        return self.hoisted(rates, own)

    def of_field(self, field: MeanField) -> tuple[Hoisted, Hoisted, Hoisted]:
        """What a mean field sums, what all nodes make of that, and what it adds, parted like the rates of links."""
        sums, shared = list(field.sums.values()), list(field.shared.values())
        more = (*field.sums, *field.shared)
        first, second, third = (self.of_links(field.edge, e, more) for e in (sums, shared, field.rates))
        return first, second, third

    def link(self, joint: Joint, found: Hoisted) -> Section:
        """What the links of a joint add."""
        edge, used = joint.edge, {s for e in found.rates for s in e.free_symbols}
        section = Section(Graph(self.names), joint.span, self.links, adds=True)
        i, j, weight = (Load(array, Name("e"), None) for array in ("target", "source", "weights"))
        section.setting += [whole("i", i), whole("j_there", j), let(self.called[edge.weight.name], weight)]
        moving, fixed = self.end(section, edge.here, joint.target, ("_here", "i"), used)
        others, more = self.end(section, edge.there, joint.source, ("_there", "j_there"), used)
        section.setting += self.loaded(self.places.of_link(edge, used, "j_there"))
        moving |= others | self.seen(section, self.waves, found.waves)
        swap = {**found.constants, **fixed, **more, **theirs(edge)}
        self.store(section, joint.target, self.read(section, found.rates, moving, swap))
        return section

    def store(self, section: Section, node: Node, found: Sequence[Series]) -> None:
        """Let a section store what was read for a node: its rates at their places, and behind them its gaps."""
        size = len(node.state)
        section.rates, section.gaps = [(self.place(c), rate) for c, rate in enumerate(found[:size])], list(found[size:])

    def end(
        self,
        section: Section,
        symbols: Sequence[sp.Symbol],
        node: Node,
        at: tuple[str, str],
        used: Container[sp.Symbol],
    ) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """The states of a node, or of one end of a link, that are used: series of those that move, names of those at rest.

        `at` is what stands behind their names, and the number of the node there.
        """
        moving: dict[sp.Symbol, Series] = {}
        fixed: dict[sp.Symbol, sp.Expr] = {}
        suffix, index = at
        for c, (s, own, moves) in enumerate(zip(symbols, node.state, self.moves(node), strict=True)):
            name = f"{self.called[own.name]}{suffix}"
            if s not in used:
                continue
            if moves:
                moving[s] = State(name=name)
                section.places[moving[s]] = self.place(c, index)
            else:
                fixed[s] = real(name)
                section.setting.append(let(name, Load("y", self.place(c, index))))
        return moving, fixed

    def field(self, field: MeanField, sums: Hoisted, shared: Hoisted, rates: Hoisted) -> Iterator[Section]:
        """The sums over the nodes, what all nodes make of them, and what is added to the rates.

        Source functions that are functions of the target too are series once.
        """
        nodes = self.places.kinds[0].span
        totals = Totals(Graph(self.names), nodes, self.equations.n)
        used = {s for e in sums.rates for s in e.free_symbols}
        moving, fixed = self.field_end(totals, field, "_there", used)
        totals.setting += self.loaded(self.places.of_source(field.edge, used, "i"))
        moving |= self.seen(totals, self.waves, sums.waves)
        found = self.read(totals, sums.rates, moving, {**sums.constants, **fixed, **theirs(field.edge)})
        totals.totals = [(s.name, series) for s, series in zip(field.sums, found, strict=True)]
        yield totals
        combined = Section(Graph(self.names))
        moving = self.seen(combined, self.waves, shared.waves)
        moving |= self.seen(combined, combined, {s: State(name=s.name) for s in field.sums})
        common = dict(zip(field.shared, self.read(combined, shared.rates, moving, shared.constants), strict=True))
        combined.lent += [series for series in common.values() if not isinstance(series, Constant)]
        yield combined
        target = Section(Graph(self.names), nodes, self.equations.n, adds=True)
        made = dict(zip(field.sums, found, strict=True))
        lent = {e: made[s] for s, e in field.alike.items() if made[s] in totals.graph.series}
        borrowed = {e: real(series.name) for e, series in lent.items()}
        wanted = [e.xreplace(borrowed) for e in rates.rates]
        used = {s for e in wanted for s in e.free_symbols}
        moving, fixed = self.field_end(target, field, "_here", used)
        target.setting += self.loaded(self.places.own(used))
        lent = {e: series for e, series in lent.items() if borrowed[e] in used}
        totals.lent += lent.values()
        moving |= self.seen(target, totals, {borrowed[e]: series for e, series in lent.items()})
        moving |= self.seen(target, combined, common) | self.seen(target, self.waves, rates.waves)
        self.store(target, field.node, self.read(target, wanted, moving, {**rates.constants, **fixed}))
        yield target

    def field_end(
        self, section: Section, field: MeanField, suffix: str, used: Container[sp.Symbol]
    ) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """The states of a node in a mean field; those of which differences alone matter are counted from the first node's."""
        symbols = field.edge.there if suffix == "_there" else field.edge.here
        moving, fixed = self.end(section, symbols, field.node, (suffix, "i"), used)
        for k in field.shifted:
            if (state := moving.get(symbols[k])) is not None:
                first = State(name=f"{self.called[field.node.state[k].name]}_first")
                section.places[first] = self.place(k, "0")
                moving[symbols[k]] = section.graph.sum([(ONE, state), (Number(-1.0), first)])
        return moving, fixed

    def seen(self, section: Section, other: Section, series: Mapping[sp.Symbol, Series]) -> dict[sp.Symbol, Series]:
        """The series of another section as this one reads them; constants are no different."""
        fixed: dict[sp.Symbol, Series] = {symbol: s for symbol, s in series.items() if isinstance(s, Constant)}
        found: dict[sp.Symbol, Series] = {s: State(name=own.name) for s, own in series.items() if s not in fixed}
        section.waves |= dict.fromkeys(found.values(), other)
        return fixed | found

    def place(self, c: int, index: str = "i") -> Expression:
        """Where state c of a node stands."""
        return self.places.place(c, index)

    def moves(self, node: Node) -> list[bool]:
        """Which states of a node move: one at rest, such as the mode of a contact, is a constant of the step."""
        edges = [joint.edge for joint in self.places.joints if joint.target == node]
        return moving(node, [*edges, *(field.edge for field in self.fields)])

    def loaded(self, loads: Sequence[Assign]) -> list[Statement]:
        """Statements that load parameters."""
        return [let(self.called.get(name, name), s.value) for s in loads for name in s.targets]

    def hoisted(self, given: Sequence[sp.Expr], moving: Sequence[sp.Symbol]) -> Hoisted:
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

    def read(
        self,
        section: Section,
        rates: Sequence[sp.Expr],
        moving: Mapping[sp.Symbol, Series],
        swap: Mapping[sp.Symbol, sp.Expr],
        inertia: Block = (),
    ) -> list[Series]:
        """The series of a section, and the constants that each of its turns computes."""
        graph = section.graph
        template = Template.of([*rates, *(e for row in inertia for e in row)], moving, self.names.fresh("shared_"))
        found = graph.read(template, moving, {**self.swap, **swap})
        size = len(rates)
        found, masses = found[:size], {divmod(k, size): e for k, e in enumerate(found[size:])}
        found = list((solved(graph, masses, dict(enumerate(found))) if masses else dict(enumerate(found))).values())
        graph.settle(found)
        section.setting += graph.constants
        return found

    # -- statements -------------------------------------------------------------------------------------------

    def step(self) -> TaylorStep:
        """The step, which takes the graph and the weights of its links."""
        orders, later = ([s for section in self.sections for s in section.coefficients(k)] for k in (START, ORDER))
        bases, size = self.bases()
        found: list[Statement] = [Comment("order 0"), *self.states(begun), *self.times(), *orders]
        next_states = self.next_states(Name("inverse") * "scale", ORDER)
        turn = [let("number", 1.0 * ORDER), let("inverse", 1.0 / ORDER), *next_states, *later]
        found += [Comment("all further orders"), span("k", self.orders, 1).over(turn)]
        if not self.ends:
            found += self.next_states(1.0 / self.order * Name("scale"), Number(self.order))
        unknown = [s for section in self.sections for s in section.unknown()]
        sides = [s for section in self.sections for s in section.sides(self.order)]
        body = [*bases, *self.opening(), *settled(unknown, found, sides), *self.closing()]
        return TaylorStep.of(body, self.order, size, ("graph", "weights"), [CONVOLUTION])

    def opening(self) -> list[Statement]:
        """Load the graph and what is a parameter of the whole network."""
        eq = self.equations
        numbers = [(slot, name) for slot, name in enumerate(eq.parameters, start=eq.dimension) if name not in eq.single]
        return [
            Assign(NAMES, Name("graph"), whole=True),
            whole("LINKS", Name("target.size")),
            *(let(self.called[name], Load("p", Number(slot))) for slot, name in numbers),
            *self.waves.graph.constants,
        ]

    def times(self) -> list[Statement]:
        """The coefficients of time, if any function of time has a series."""
        if not self.waves.lent:
            return []
        zeros = Store("dense", Name("at_t") + ORDER, NOTHING)
        known = [Store("dense", Name("at_t"), Name("t")), Store("dense", Name("at_t") + 1, Name("scale"))]
        return [*known, span("k", self.order + 1, 2).over([zeros])]

    def bases(self) -> tuple[list[Statement], int]:
        """Where everything stands in the workspace, and how much it takes."""
        eq, p = self.equations, self.order
        sizes = {"states": (p + 1) * eq.dimension, "rates": eq.dimension}
        if self.waves.lent:
            sizes["t"] = p + 1
        if eq.sticks:
            sizes |= {"gaps": (p + 1) * 2 * eq.n, "sizes": 2 * eq.n, "closing": p + 1}
        for section in self.sections:
            kept = {s.name for s in section.remembered}
            sizes |= {name: self.orders * section.count for name in sorted(kept - {"t", ""})}
            sizes |= {name: section.count for name in (*section.kept, *section.hints)}
            if isinstance(section, Totals):
                sizes |= {name: self.orders for name, _ in section.totals}
        found, size = list[Statement](), 0
        for name, groups in sizes.items():
            found.append(whole(f"at_{name}", Name("DENSE_ROWS") * "DIMENSION" + size))
            size += groups
        return found, size

    def states(self, body: Callable[[Expression], Iterable[Statement]]) -> list[Statement]:
        """Loops over all states: what is done with the place of one."""
        return [span.over(body(place)) for span, place in self.places.rows]

    def next_states(self, factor: Expression, order: Expression) -> list[Statement]:
        """Coefficients of the states from those of the rates."""
        scale = Name("slope_scale")
        return [
            let(scale.text, factor),
            *self.states(
                lambda p: [Store("dense", of_state(order, p), scale * Load("dense", plus(Name("at_rates"), p)))]
            ),
        ]

    def closing(self) -> list[Statement]:
        """Step length, new state and dense output."""
        p, sections, contacts = self.order, self.sections, self.equations.sticks
        watching = any(section.graph.watched for section in sections)
        found: list[Statement] = [Comment("step length"), *(let(f"size_{k}", NOTHING) for k in last_orders(p))]
        found += self.states(self.size)
        found += [let("unseen", NOTHING)] if watching else []
        found += [loose(self.exact)] if contacts else []
        found += [s for section in sections for s in section.lengths(p)]
        found += [let("reach", reach(last_orders(p))), *finished(p, watching, contacts)]
        found += first_passage([s for section in sections for s in section.passages(p, self.exact)])
        found += [Comment("new state"), let("total", NOTHING), *self.states(self.end_of)]
        found += [s for section in sections for s in section.ends(p)]
        rows = self.states(
            lambda p: [Store("dense", plus((ORDER - 1) * Name("DIMENSION"), p), Name("raised") * state(ORDER, p))]
        )
        raised = span("k", p + 1, 1).over([*rows, let("raised", Name("raised") * "ratio")])
        return [*found, If(Name("DENSE"), (let("raised", "ratio"), raised)), returned(self.ends)]

    def size(self, place: Expression) -> list[Statement]:
        """Let the last coefficients of a state count, in units of its tolerance."""
        largest: Expression = absolute(Load("y", place))
        for k in (1, 2):
            largest = call("maximum", largest, absolute(state(Number(k), place)))
        return weighed(Name("rtol") * largest, self.order, lambda k: state(k, place))

    def end_of(self, place: Expression) -> list[Statement]:
        """The new value of a state."""
        found = polynomial("new", self.order, lambda k: state(k, place))
        return [*found, Store("y_new", place, Name("new")), let("total", Name("total") + "new")]


def begun(place: Expression) -> list[Statement]:
    """Coefficient 0 of a state."""
    return [Store("dense", of_state(START, place), Load("y", place))]


def of_state(order: Expression, place: Expression) -> Expression:
    """Where a coefficient of a state stands."""
    return at("states", order, Name("DIMENSION"), place)


def state(order: Expression, place: Expression) -> Expression:
    """A coefficient of a state."""
    return Load("dense", of_state(order, place))


def write_looped(equations: Equations, order: int) -> TaylorStep:
    """Return the looped Taylor step of some order; see `write_step`.

    Raises
    ------
    ValueError
        As `write_step`, and for a mass matrix beside links: the loop over nodes solves before links are added.
    """
    if equations.inertial and equations.link_count:
        found = "links with inertia" if equations.inertial_links else "links of nodes with a mass matrix"
        raise ValueError(f"taylor: found {found} in a network that is stepped in loops; use dop853 or rodas5p")
    check_jumps(equations)
    return LoopWriter(equations, order).step()
