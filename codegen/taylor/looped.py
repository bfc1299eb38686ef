"""The text of a Taylor step for a large network: loops over orders, nodes and links around the same recurrences.

Behind the rows of the dense output stand the coefficients of the states, the rates of one order, and the coefficients of
every series that a convolution reads: coefficient k of node i at `at_… + k*NODES + i`, of link e at `at_… + k*LINKS + e`, of
what depends on time alone at `at_… + k`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Block, Edge, Node

from ..program.expressions import ONE, ZERO, Expression, Name, Number
from ..program.passes import Hoist, Names, real
from ..program.printers import LANES
from ..program.statements import Assign
from ..steps.fields import MeanField, compensated, mean_fields
from ..steps.names import NAMES
from ..steps.places import Joint, Kind, Span, places
from .graph import Graph, Template, check_jumps
from .length import finished, last_orders, reach, unseen
from .masses import moving, solved
from .passage import Stored, closed, first_passage, functions, jumps, loose, settled, told
from .series import Constant, Series, State, Time, magnitude
from .step import TaylorStep, broken, called, returned
from .terms import absolute, add, lane, largest, show, statement

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

GAPS = ("i", "NODES + i")
"""Where the two gaps of the contact of a node stand among those of one order."""


@dataclass(frozen=True, slots=True)
class Hoisted:
    """Rates in names: of series for what depends on time alone, of constants for what depends on parameters alone."""

    rates: list[sp.Expr]
    waves: dict[sp.Symbol, Series] = field(default_factory=dict)
    constants: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)


@dataclass(slots=True)
class Section:
    """What is done alike for all nodes of a kind, for all links of a joint, or once.

    head, index, count: the loop, its variable and the number of its turns in the whole numbering; `setting` loads what the
    turn needs at any order, `places` are the states that it reads, and where they stand, `lent` are series that other
    sections need too, `gaps` those of contacts, or what links add to them, `mode` says whether these slip.
    """

    graph: Graph
    head: str = ""
    index: str = ""
    count: int = 1
    setting: list[str] = field(default_factory=list)
    places: dict[Series, str] = field(default_factory=dict)
    rates: list[tuple[str, Series]] = field(default_factory=list)
    lent: set[Series] = field(default_factory=set)
    gaps: list[Series] = field(default_factory=list)
    mode: str = ""
    adds: bool = False
    waves: dict[Series, Section] = field(default_factory=dict)
    kept: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    values: dict[Series, Expression] = field(default_factory=dict)
    sums: int = 0

    # -- what a recurrence asks for -------------------------------------------------------------------------------

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

    def before(self, series: Series) -> Expression:
        """Coefficient k - 1 of a series."""
        return Name(self.load(series, "(k - 1)"))

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        """Sum of left_j * right_(k-j) for j = first … k + last."""
        total = f"s{self.sums}"
        self.sums += 1
        end = {0: "k + 1", -1: "k"}[last]
        ends = ", ".join(f"{self.where(s, '0')}, {self.stride(s)}" for s in (left, right))
        self.lines.append(f"{total} = convolution(dense, {ends}, k, {first}, {end})")
        return Name(total)

    def square(self, base: Series, first: int) -> Expression:
        """Sum of base_j * base_(k-j) for j = first … k - first."""
        return self.sum(base, base, first, -first)

    def keep(self, what: str, value: Expression) -> str:
        """Compute something once; returns its name."""
        if what not in self.kept:
            self.kept.append(what)
            self.lines += [*statement(what, value), f"store(dense, {self.slot(what, '0')}, {what} + 0.0*scale)"]
        return what

    def hint(self, series: Series) -> Expression:
        """The side of zero on which a series that begins at zero lies just after."""
        return Name(f"load(dense, {self.slot(f'hint_{series.name}', '0')}, WIDTH)")

    # -- places ---------------------------------------------------------------------------------------------------

    def slot(self, name: str, order: str) -> str:
        """Where a coefficient of a series of this section stands."""
        if not self.index:
            return f"at_{name} + {order}"
        size = "NODES" if self.index == "i" else "LINKS"
        return f"at_{name} + {self.index}" if order == "0" else f"at_{name} + {order}*{size} + {self.index}"

    def load(self, series: Series, order: str) -> str:
        """A coefficient of a series from memory."""
        return f"load(dense, {self.where(series, order)}, WIDTH)"

    def where(self, series: Series, order: str) -> str:
        """Where a coefficient of a series stands."""
        if series in self.places:
            behind = "" if order == "0" else f"{order}*DIMENSION + "
            return f"at_states + {behind}{self.places[series]}"
        return self.waves.get(series, self).slot(series.name, order)

    def stride(self, series: Series) -> str:
        """How far one coefficient of a series stands behind the last."""
        if series in self.places:
            return "DIMENSION"
        return {"": "1", "i": "NODES", "e": "LINKS"}[self.waves.get(series, self).index]

    @property
    def remembered(self) -> set[Series]:
        """Series whose earlier coefficients are needed, or all that is made once for other sections."""
        used = {used for s in self.graph.series for used in s.convolved}
        used |= {*self.graph.watched, *self.graph.positive, *self.lent}
        return (used - {*self.places, *self.waves}) | (set() if self.index else {s for _, s in self.rates})

    # -- text -----------------------------------------------------------------------------------------------------

    def text(self, order: str) -> list[str]:
        """The statements for coefficients `order`: 0, or k for any later one."""
        self.lines, first = list(self.setting), order == "0"
        outer = [*self.places, *self.waves]
        if not first:
            self.lines += [f"{name} = load(dense, {self.slot(name, '0')}, WIDTH)" for name in self.kept]
        self.lines += [f"{s.name} = {self.load(s, order)}" for s in outer]
        self.values = {s: Name(s.name) for s in outer}
        remembered = self.remembered
        for s in self.graph.series:
            value = s.begin(self) if first else s.coefficient(self)
            inline = s in (self.graph.inline_start if first else self.graph.inline) and s not in remembered
            if not inline and not isinstance(value, Name | Number):
                self.lines += statement(s.name, value)
                value = Name(s.name)
            self.values[s] = value
            if s in remembered:
                self.lines.append(f"store(dense, {self.slot(s.name, order)}, {lane(value)})")
        self.finish(first)
        return self.turns(self.lines)

    def finish(self, first: bool) -> None:
        """Append the statements that use coefficient 0, or k, of the rates."""
        for place, rate in self.rates if self.index else ():
            value = self.now(rate, first)
            if not self.adds:
                text = f"{show(value)} + 0.0*scale" if isinstance(rate, Constant) else show(value)
                self.lines.append(f"store(dense, at_rates + {place}, {text})")
            elif value != ZERO:
                self.put(f"at_rates + {place}", value)
        for place, gap in zip(GAPS, self.gaps, strict=False):
            self.put(f"at_gaps + {place if first else f'k*2*NODES + {place}'}", self.now(gap, first))
            if first:
                self.put(f"at_sizes + {place}", magnitude(self, gap))

    def put(self, place: str, value: Expression) -> None:
        """Store a value, or add it to what other sections have stored."""
        if self.adds:
            self.lines += statement("value", add(Name(f"load(dense, {place}, WIDTH)"), value))
        self.lines.append(f"store(dense, {place}, {'value' if self.adds else lane(value)})")

    def ends(self, order: int) -> list[str]:
        """The statements that make the step NaN where a series of this section has passed a zero that it cannot pass."""
        found = []
        for s in self.graph.positive:
            found += [f"value = {self.load(s, str(order - 1))}", f"for k in range({order - 2}, -1, -1):"]
            found += [f"    value = value*ratio + {self.load(s, 'k')}", broken("value", self.load(s, "0"))]
        return self.run(found)

    def passages(self, degree: int, exact: bool) -> list[str]:
        """The statements that end the step at the kinks and contacts of this section."""
        found = []
        for kink in self.graph.kinks:
            size = f"load(dense, {self.slot(kink.size, '0')}, WIDTH)"
            stored = Stored(size, self.where(kink.base, "0"), self.stride(kink.base), degree)
            found += kink.passages(self.load(kink, str(degree)), stored)
        if self.mode:
            sizes = [f"load(dense, at_sizes + {place}, WIDTH)" for place in GAPS]
            places = [f"at_gaps + {place}" for place in GAPS]
            found.append(f"stuck = 1.0 - {self.mode}*{self.mode}")
            found += closed("stuck", exact, sizes, places, "2*NODES", "at_closing", degree)
        return self.run(found)

    @property
    def hints(self) -> list[str]:
        """What the sides of series that begin on a jump are called."""
        return [f"hint_{brink.base.name}" for brink in self.graph.brinks]

    def unknown(self) -> list[str]:
        """The statements that forget these sides."""
        return self.run([f"store(dense, {self.slot(hint, '0')}, 0.0*scale)" for hint in self.hints])

    def sides(self, degree: int) -> list[str]:
        """The statements that take note of those that the coefficients tell."""
        found = []
        for brink, hint in zip(self.graph.brinks, self.hints, strict=True):
            begun, side = (self.load(brink, k) for k in ("0", str(degree)))
            found += told(show(self.hint(brink.base)), begun, side, f"store(dense, {self.slot(hint, '0')}, {{1}})")
        return self.run(found)

    def lengths(self, order: int) -> list[str]:
        """The statements that make the step no longer than the series of this section let it be."""
        found = []
        for s in self.graph.gaps:
            found += statement("largest", largest(absolute(Name(self.load(s, str(k)))) for k in range(3)))
            found += weighed("rtol*largest", {k: self.load(s, str(k)) for k in last_orders(order)})
        for place in GAPS if self.mode else ():
            last = {k: f"load(dense, at_gaps + {k}*2*NODES + {place}, WIDTH)" for k in last_orders(order)}
            found += weighed(f"loose*load(dense, at_sizes + {place}, WIDTH)", last)
        for s in self.graph.watched:
            found += unseen([Name(self.load(s, str(k))) for k in range(order)])
        return self.run(found)

    def run(self, lines: list[str]) -> list[str]:
        """Statements, if there are any, that are run through behind what a turn needs."""
        return self.turns([*self.setting, *lines]) if lines else []

    def turns(self, lines: list[str]) -> list[str]:
        """Statements that are run through in the section's loop."""
        return [self.head, *(f"    {line}" for line in lines)] if self.index else lines


@dataclass(slots=True)
class Totals(Section):
    """The sums over all nodes of some series, by their names in `rates`."""

    def text(self, order: str) -> list[str]:
        """The statements for coefficients `order`, with the sums before and behind the loop."""
        names = [name for name, _ in self.rates]
        before = [f"{name}{rest} = 0.0*scale" for name in names for rest in ("", "_rest")]
        # a class with slots has no cell for super()
        return [*before, *Section.text(self, order), *(f"store(dense, at_{name} + {order}, {name})" for name in names)]

    def finish(self, first: bool) -> None:
        """Add the coefficients to the sums; those of a constant beyond the first are zero."""
        for name, rate in self.rates:
            value = self.now(rate, first)
            if value != ZERO:
                self.lines += [
                    *statement(f"{name}_value", value),
                    *LANES.lines(compensated(name, f"{name}_value")),
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


def weighed(error: str, last: Mapping[int, str]) -> list[str]:
    """Statements that let the last coefficients of something count, in units of the error that it may have."""
    sizes = (f"size_{k} = maximum(size_{k}, absolute({value})*weight)" for k, value in last.items())
    return [f"weight = 1.0/(atol + {error})", *sizes]


def theirs(edge: Edge) -> dict[sp.Symbol, sp.Symbol]:
    """What the parameters are called that a link takes of its source."""
    return {s: real(f"{own.name}_there") for s, own in edge.theirs}


def head_of(span: Span) -> str:
    """The head of the loop over a part of a numbering."""
    return LANES.loop(span.index, span.start, span.stop) + ":"


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
        self.waves.graph.settle([s for _, s in self.waves.rates])
        if self.waves.rates:
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
        node, section = kind.node, Section(Graph(self.names), head_of(kind.span), "i", self.equations.n)
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
        section = Section(Graph(self.names), head_of(joint.span), "e", self.links, adds=True)
        section.setting += ["i, j_there = target[e], source[e]", f"{self.called[edge.weight.name]} = weights[e]"]
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
                section.setting.append(f"{name} = load(y, {self.place(c, index)}, WIDTH)")
        return moving, fixed

    def field(self, field: MeanField, sums: Hoisted, shared: Hoisted, rates: Hoisted) -> Iterator[Section]:
        """The sums over the nodes, what all nodes make of them, and what is added to the rates.

        Source functions that are functions of the target too are series once.
        """
        nodes = head_of(self.places.kinds[0].span)
        totals = Totals(Graph(self.names), nodes, "i", self.equations.n)
        used = {s for e in sums.rates for s in e.free_symbols}
        moving, fixed = self.field_end(totals, field, "_there", used)
        totals.setting += self.loaded(self.places.of_source(field.edge, used, "i"))
        moving |= self.seen(totals, self.waves, sums.waves)
        found = self.read(totals, sums.rates, moving, {**sums.constants, **fixed, **theirs(field.edge)})
        totals.rates = [(s.name, series) for s, series in zip(field.sums, found, strict=True)]
        yield totals
        combined = Section(Graph(self.names))
        moving = self.seen(combined, self.waves, shared.waves)
        moving |= self.seen(combined, combined, {s: State(name=s.name) for s in field.sums})
        common = dict(zip(field.shared, self.read(combined, shared.rates, moving, shared.constants), strict=True))
        combined.rates = [("", series) for series in common.values() if not isinstance(series, Constant)]
        yield combined
        target = Section(Graph(self.names), nodes, "i", self.equations.n, adds=True)
        made = dict(zip(field.sums, found, strict=True))
        lent = {e: made[s] for s, e in field.alike.items() if made[s] in totals.graph.series}
        borrowed = {e: real(series.name) for e, series in lent.items()}
        wanted = [e.xreplace(borrowed) for e in rates.rates]
        used = {s for e in wanted for s in e.free_symbols}
        moving, fixed = self.field_end(target, field, "_here", used)
        target.setting += self.loaded(self.places.own(used))
        lent = {e: series for e, series in lent.items() if borrowed[e] in used}
        totals.lent |= set(lent.values())
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

    def place(self, c: int, index: str = "i") -> str:
        """Where state c of a node stands."""
        return LANES.text(self.places.place(c, index))

    def moves(self, node: Node) -> list[bool]:
        """Which states of a node move: one at rest, such as the mode of a contact, is a constant of the step."""
        edges = [joint.edge for joint in self.places.joints if joint.target == node]
        return moving(node, [*edges, *(field.edge for field in self.fields)])

    def loaded(self, loads: Sequence[Assign]) -> list[str]:
        """Lines that load parameters."""
        return [f"{self.called.get(s.targets[0], s.targets[0])} = {LANES.text(s.value)}" for s in loads]

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
            self.waves.rates.append(("", waves[symbol]))
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
        section.setting += [f"{name} = {text}" for name, text in graph.constants.items()]
        return found

    # -- text -------------------------------------------------------------------------------------------------

    def step(self) -> TaylorStep:
        """The step, which takes the graph and the weights of its links."""
        eq = self.equations
        orders, later = ([line for section in self.sections for line in section.text(k)] for k in "0k")
        bases, size = self.bases()
        lines = [*bases, f"{', '.join(NAMES)} = graph", "LINKS = target.size"]
        for slot, name in enumerate(eq.parameters, start=eq.dimension):
            if name not in eq.single:
                lines.append(f"{self.called[name]} = load(p, {slot}, WIDTH)")
        lines += [f"{name} = {text}" for name, text in self.waves.graph.constants.items()]
        head, lines = lines, ["# order 0", *self.states("store(dense, at_states + {0}, load(y, {0}, WIDTH))")]
        if self.waves.rates:
            lines += ["store(dense, at_t, t)", "store(dense, at_t + 1, scale)", f"for k in range(2, {self.order + 1}):"]
            lines += ["    store(dense, at_t + k, 0.0*scale)"]
        lines += [*orders, "# all further orders", f"for k in range(1, {self.orders}):"]
        turn = ("number = 1.0*k", "inverse = 1.0/k", *self.next_states("inverse*scale", "k"), *later)
        lines += [f"    {line}" for line in turn]
        if not self.ends:
            lines += self.next_states(f"{1.0 / self.order!r}*scale", str(self.order))
        unknown = [line for section in self.sections for line in section.unknown()]
        sides = [line for section in self.sections for line in section.sides(self.order)]
        lines = [*head, *settled(unknown, lines, sides), *self.closing()]
        before = [*functions(lines), CONVOLUTION]
        return TaylorStep.of(lines, self.order, size, ", graph, weights", before)

    def bases(self) -> tuple[list[str], int]:
        """Where everything stands in the workspace, and how much it takes."""
        eq, p = self.equations, self.order
        sizes = {"states": (p + 1) * eq.dimension, "rates": eq.dimension}
        if self.waves.rates:
            sizes["t"] = p + 1
        if eq.sticks:
            sizes |= {"gaps": (p + 1) * 2 * eq.n, "sizes": 2 * eq.n, "closing": p + 1}
        for section in self.sections:
            kept = {s.name for s in section.remembered}
            sizes |= {name: self.orders * section.count for name in sorted(kept - {"t", ""})}
            sizes |= {name: section.count for name in (*section.kept, *section.hints)}
            if isinstance(section, Totals):
                sizes |= {name: self.orders for name, _ in section.rates}
        lines, size = [], 0
        for name, groups in sizes.items():
            lines.append(f"at_{name} = DENSE_ROWS*DIMENSION + {size}")
            size += groups
        return lines, size

    def states(self, *lines: str) -> list[str]:
        """Loops over all states; {0} is the place of one."""
        return [
            text
            for span, place in self.places.rows
            for text in (head_of(span), *(f"    {line.format(LANES.text(place))}" for line in lines))
        ]

    def next_states(self, factor: str, order: str) -> list[str]:
        """Coefficients of the states from those of the rates."""
        return [
            f"slope_scale = {factor}",
            *self.states(
                f"store(dense, at_states + {order}*DIMENSION + {{0}}, slope_scale*load(dense, at_rates + {{0}}, WIDTH))"
            ),
        ]

    def closing(self) -> list[str]:
        """Step length, new state and dense output."""
        p = self.order
        at = "load(dense, at_states + {k}*DIMENSION + {{0}}, WIDTH)"
        sections, contacts = self.sections, self.equations.sticks
        watching, orders = any(section.graph.watched for section in sections), last_orders(p)
        lines = ["# step length", *(f"size_{k} = 0.0*scale" for k in orders)]
        largest = "absolute(load(y, {0}, WIDTH))"
        for k in (1, 2):
            largest = f"maximum({largest}, absolute({at.format(k=k)}))"
        lines += self.states(*weighed(f"rtol*{largest}", {k: at.format(k=k) for k in orders}))
        lines += ["unseen = 0.0*scale"] if watching else []
        lines += [loose(self.exact)] if contacts else []
        lines += [line for section in sections for line in section.lengths(p)]
        lines += [f"reach = {show(reach(orders))}", *finished(p, watching, contacts)]
        lines += first_passage([line for section in sections for line in section.passages(p, self.exact)])
        lines += ["# new state", "total = 0.0*scale"]
        lines += self.states(
            f"new = {at.format(k=p)}",
            f"for k in range({p - 1}, -1, -1):",
            f"    new = new*ratio + {at.format(k='k')}",
            "store(y_new, {0}, new)",
            "total = total + new",
        )
        lines += [line for section in sections for line in section.ends(p)]
        lines += ["if DENSE:", "    raised = ratio", f"    for k in range(1, {p + 1}):"]
        inner = self.states(f"store(dense, (k - 1)*DIMENSION + {{0}}, raised*{at.format(k='k')})")
        lines += [f"        {line}" for line in (*inner, "raised = raised*ratio")]
        return [*lines, returned(self.ends)]


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
