"""Write a Taylor step for a small network order by order, with each coefficient in a named variable.

`Lines` writes the coefficients: x_3 is coefficient 3 of a state x, product0_3 that of a product.  Each variable is
assigned once, so that the compiler can hold coefficients in registers and schedule the convolutions of one order in
parallel.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, compress

import sympy as sp

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.parts import Part
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.models.mechanics.events import Event
from synchain.models.mechanics.rows import Row

from ..program.expressions import ONE, ZERO, Compare, Expression, Load, Name, Negation, Number, call, plus
from ..program.passes import Names, real
from ..program.statements import Comment, If, Statement, Store, let, store
from ..steps.step import lane
from .event_location import Stored, side_by
from .mass_matrix import moving, solved
from .passable import check_passable
from .series import Constant, Exponential, Series, State, Time, magnitude
from .series_graph import SeriesGraph, Template
from .series_writer import Gaps, SeriesWriter
from .simplify import absolute, add, largest, times
from .step_length import SEEN, bounded, last_orders, reach
from .taylor_step import TaylorStep, TaylorStepWriter, check_order

SQUARE = let("square", Name("ratio") * "ratio")

Symbols = tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]
"""Two maps for a template: from moving symbols to series, and from constant symbols to expressions."""


@dataclass(eq=False)
class Lines(SeriesWriter):
    """Write the coefficients of series one after another, each in a named variable.

    k: the order that is being written. room: the group of memory from which a passage reads coefficients. rates: the
    rate of each state that moves. values: the coefficients so far, as names or numbers, by series and order. sizes: the
    sizes of the last coefficients by order, in units of the allowed error.
    """

    k: int = 0
    room: int = 0
    rates: dict[State, Series] = field(default_factory=dict)
    values: dict[tuple[Series, int], Expression] = field(default_factory=dict)
    sizes: defaultdict[int, list[Expression]] = field(default_factory=lambda: defaultdict(list))
    zeros = 0.0 * Name("t")

    # -- what a recurrence uses -----------------------------------------------------------------------------------

    @property
    def inverse(self) -> Expression:
        return Number(1.0 / self.k)

    @property
    def number(self) -> Expression:
        return Number(float(self.k))

    def of(self, series: Series) -> Expression:
        return self.at(series, self.k)

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        # put products with the latest coefficients last: the processor adds all others while these are computed
        k = self.k
        order = sorted(range(first, k + last + 1), key=lambda j: max(j, k - j))
        return add(*(times(self.at(left, j), self.at(right, k - j)) for j in order))

    def square(self, base: Series, first: int) -> Expression:
        # compute each pair of equal products once, times 2, and add the middle product
        k = self.k
        half = add(*(times(self.at(base, j), self.at(base, k - j)) for j in reversed(range(first, (k + 1) // 2))))
        middle = self.at(base, k // 2) if k % 2 == 0 and k // 2 >= first else ZERO
        return add(times(middle, middle), times(Number(2.0), half))

    def save(self, name: str, value: Expression) -> Name:
        if name not in self.saved:
            self.saved[name] = None
            self.put(let(name, value))
        return Name(name)

    # -- where coefficients are -----------------------------------------------------------------------------------

    def at(self, series: Series, k: int) -> Expression:
        match series:
            case Constant(value):
                return ZERO if k else value
            case Time():
                return Name("scale" if k else "t") if k < 2 else ZERO
        return self.values[series, k]

    def all_of(self, series: Series) -> list[Expression]:
        """Return all coefficients of a series."""
        return [self.at(series, k) for k in range(self.order + 1)]

    def define(self, series: Series, value: Expression, inline: bool) -> None:
        self.values[series, self.k] = value if inline else self.named(f"{series.name}_{self.k}", value)

    def recall(self, name: str) -> Expression:
        return Name(name)

    def assign(self, name: str, value: Expression) -> Statement:
        return let(name, value)

    def signs(self, series: Series) -> list[Statement]:
        return [side_by(e) for e in self.all_of(series)[1:] if e != ZERO]

    def weight(self, name: str) -> Name:
        return Name(f"w_{name}")

    def add_size(self, k: int, size: Expression) -> list[Statement]:
        self.sizes[k].append(size)
        return []

    def end_value(self, series: Series, name: str) -> tuple[list[Statement], Expression]:
        return polynomial(name, [self.at(series, k) for k in range(self.order)]), Name(f"n_{name}")

    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        coefficients = [lane(e) for s in series for e in self.all_of(s)]
        slots = [Number(self.room + k) for k in range(len(coefficients))]
        stores: list[Statement] = [Store("dense", slot, e) for slot, e in zip(slots, coefficients, strict=True)]
        firsts = slots[:: self.order + 1]
        return stores, [Stored(size, first, self.order) for size, first in zip(sizes, firsts, strict=True)]

    def of_exponent(self, series: Exponential, k: int) -> Expression:
        return self.at(series.argument, k)

    def near(self, series: Series, passages: Sequence[Statement]) -> list[Statement]:
        # most steps are far from kinks: skip the search if in no lane the series can change by as much as its value
        start, *coefficients = self.all_of(series)
        start = absolute(start) if start != ZERO else ZERO
        near = Compare("<=", start, 1.0001 * Name("way") * Name("ratio"))
        return [*bounded(coefficients), If(call("any_lane", near), tuple(passages))]

    # -- statements -----------------------------------------------------------------------------------------------

    def coefficients(self, k: int) -> None:
        """Write coefficients k of the states and all series; at the last order, only of series that may end a step."""
        self.k = k
        self.put(Comment(f"order {k}"), *([let(f"r{k}", times(Number(1.0 / k), Name("scale")))] if k else []))
        for state, rate in self.rates.items() if k else ():
            self.define(state, times(Name(f"r{k}"), self.at(rate, k - 1)), False)
        gaps = [s for gaps in self.contacts for s in gaps.series]
        self.make(self.graph.behind([*self.graph.kinks, *gaps]) if k == self.order else self.graph.series, k == 0)


class UnrolledSeries(TaylorStepWriter):
    """Write a step without loops; all series form one part."""

    def __init__(self, equations: Equations, order: int) -> None:
        super().__init__(equations, order, {*equations.state, *equations.parameters})
        # rename states so that no coefficient has the name of a symbol
        taken = {*self.called, *self.called.values()}
        self.names = []
        for state in equations.state:
            name = self.called[state]
            while any(f"{name}_{k}" in taken for k in range(order + 1)):
                name += "_"
            self.names.append(name)
        symbols = {s.name for node in equations.nodes for s in (*node.state, *node.parameters)}
        symbols |= {s.name for edge in equations.edges for s in edge.parameters}
        self.supply = Names([*taken, *self.names, *symbols])
        self.lines = Lines(SeriesGraph(self.supply), order, room=order * equations.dimension)
        self.graph, self.parts = self.lines.graph, [self.lines]
        # states that move are series; all other states, such as modes of contacts, are constants
        edges = [[edge for link, edge in equations.linked() if link[0] == i] for i in range(equations.n)]
        moves = [compress(slots, moving(equations.node_at(i), edges[i])) for i, slots in enumerate(equations.places)]
        moves += [compress(part.places, (e != 0 for e in part.template.added)) for part in equations.parts]
        periods = periods_of_states(equations)
        self.moving = {
            slot: State(name=self.names[slot], period=periods[slot]) for slot in sorted(set(chain.from_iterable(moves)))
        }
        still = {slot: Constant(Name(self.called[name])) for slot, name in enumerate(equations.state)}
        self.states: list[Series] = list((still | self.moving).values())
        # make the series of the rates, of the gaps of contacts, and of expressions that a subclass adds (`noted`)
        self.noted: list[Series] = []
        self.lines.rates, self.lines.contacts = self.read(), list(self.contacts())
        gaps = [s for gaps in self.lines.contacts for s in gaps.series]
        self.graph.finish([*self.lines.rates.values(), *self.noted, *gaps])

    # -- series -----------------------------------------------------------------------------------------------

    def read(self) -> dict[State, Series]:
        """Return the rates of the states that move: add up terms of nodes and links, then solve with the masses M."""
        places = self.equations.places
        terms = defaultdict[int, list[tuple[Expression, Series]]](list)
        for (target, *_), rates in self.contributions(lambda node: node.rhs, lambda edge: edge.rhs, {TIME: self.time}):
            for slot, rate in zip(places[target], rates, strict=True):
                terms[slot].append((ONE, rate))
        rates_of = {slot: self.graph.sum(terms[slot]) for slot in self.moving}
        self.plain = dict(rates_of)
        for part in self.equations.parts:
            moving, constant = self.of_part(part)
            added = Template.of(part.template.added, moving, self.supply.fresh("shared_"))
            for slot, series in zip(part.places, self.graph.read(added, moving, constant), strict=True):
                if slot in rates_of:
                    rates_of[slot] = self.graph.sum([(ONE, self.plain[slot]), (ONE, series)])
        if self.equations.inertial:
            entries = defaultdict[tuple[int, int], list[tuple[Expression, Series]]](list)
            for ends, masses in self.contributions(_masses_of_node, _masses_of_link, {}):
                keys = [(r, c) for end in ends for r in places[ends[0]] for c in places[end]] if masses else []
                for key, e in zip(keys, masses, strict=True):
                    entries[key].append((ONE, e))
            rates_of = solved(self.graph, {key: self.graph.sum(e) for key, e in entries.items()}, rates_of)
        return {self.moving[slot]: rate for slot, rate in rates_of.items()}

    def contributions(
        self,
        of_node: Callable[[Node], Sequence[sp.Expr]],
        of_edge: Callable[[Edge], Sequence[sp.Expr]],
        time: dict[sp.Symbol, Series],
    ) -> Iterator[tuple[tuple[int, ...], list[Series]]]:
        """Yield the series that each node and each link contributes, with (node,) or (target, source)."""
        eq, shared = self.equations, self.supply.fresh("shared_")
        nodes = [Template.of(of_node(node), (*time, *node.state), shared) for node in eq.nodes]
        edges = {
            edge: Template.of(of_edge(edge), (*time, *(s for end in edge.end_states for s in end)), shared)
            for edge in eq.edges
        }
        for i, kind in enumerate(eq.kind_of):
            yield (i,), self.graph.read(nodes[kind], *self.symbols(time, eq.at_node(i)))
        for link, edge in eq.linked():
            yield link[:2], self.graph.read(edges[edge], *self.symbols(time, eq.at_link(link, edge)))

    def contacts(self) -> Iterator[Gaps]:
        """Yield the gaps of the contact of each node that has one."""
        eq, network = self.equations, self.of_network()
        for i in range(eq.n):
            conditions: tuple[Event | Row, ...] = (*eq.events_at(i), *eq.rows_at(i))
            for k, condition in enumerate(conditions):
                yield self.gaps_of(condition, condition.mode.name, f"guard_{i}_{k}", network)
        for number, part in enumerate(eq.parts):
            symbols = self.of_part(part)
            for k, row in enumerate(part.template.rows):
                mode = part.at.get(row.mode, row.mode).name
                yield self.gaps_of(row, mode, f"guard_{number}_{k}", symbols)

    def gaps_of(self, condition: Event | Row, mode: str, guard: str, symbols: Symbols) -> Gaps:
        """Return the gaps of a contact or row; a reset has no mode and is called `guard`."""
        moving, constant = symbols
        template = Template.of(condition.gaps, moving, self.supply.fresh("shared_"))
        series = tuple(self.graph.read(template, moving, constant))
        name = self.called.get(mode, guard)
        sizes = tuple(f"size_{name}_{way}" for way in ("rise", "fall")[: len(series)])
        room = Number(self.lines.room + 2 * (self.order + 1))
        rounds = 1 + self.equations.has_rows
        return Gaps(name, f"stuck_{name}", series, sizes, tuple(map(Name, sizes)), room, rounds)

    def of_part(self, part: Part) -> Symbols:
        """Return the series, or the constants, for the symbols of the template of a part."""
        moving, constant = self.symbols({TIME: self.time}, part.at)
        rates = zip(part.template.rates, part.places, strict=True)
        still = Constant(ZERO)
        return moving | {s: self.plain.get(slot, still) for s, slot in rates if s is not None}, constant

    def of_network(self) -> Symbols:
        """Return the series, or the constants, for the symbols of the whole network."""
        return self.symbols({TIME: self.time}, {s: s for s in map(real, self.equations.state)})

    def symbols(self, time: dict[sp.Symbol, Series], values: Mapping[sp.Symbol, sp.Expr]) -> Symbols:
        """Return the series, or the constants, for the symbols of a template; `values` maps them to the network's."""
        slots = {s: slot for slot, s in enumerate(map(real, self.equations.state))}
        moving, constant = dict(time), dict(self.substitutes)
        for s, e in values.items():
            if slots.get(e) in self.moving:
                moving[s] = self.moving[slots[e]]
            else:
                constant[s] = self.substitutes.get(e, e)
        return moving, constant

    # -- statements -----------------------------------------------------------------------------------------------

    @property
    def workspace(self) -> int:
        # memory for the coefficients of one kink; or of both gaps of a contact, and a copy of one gap
        return (self.order + 1) * (3 if self.equations.sticks else 1 if self.graph.kinks else 0)

    def coefficients(self) -> list[Statement]:
        eq, lines = self.equations, self.lines
        lines.put(*(let(self.called[name], Load("y", Number(slot))) for slot, name in enumerate(eq.state)))
        for slot, name in enumerate(eq.parameters, start=eq.dimension):
            lines.put(let(self.called[name], Load("p", Number(slot))))
        lines.put(*self.graph.constants)
        for slot, state in self.moving.items():
            lines.values[state, 0] = Name(self.called[eq.state[slot]])
        for k in range(self.order + 1):
            self.make(k)
        return lines.statements

    def make(self, k: int) -> None:
        """Write coefficients k of all series, and after order 0 the sizes of the terms of gaps."""
        self.lines.coefficients(k)
        for gaps in self.lines.contacts if k == 0 else ():
            for name, series in zip(gaps.names, gaps.series, strict=True):
                self.lines.save(name, magnitude(self.lines, series))

    def sizes(self) -> list[Statement]:
        return [statement for s in self.moving.values() for statement in self.lines.counted(s)]

    def reach(self) -> list[Statement]:
        orders = [k for k in last_orders(self.order) if self.lines.sizes[k]]
        statements = [let(f"size_{k}", largest(self.lines.sizes[k])) for k in orders]
        # if no coefficient limits the step, the logarithm is infinite: -log(0)
        statements.append(let("reach", reach(orders) if orders else Negation(call("log", 0.0 * Name("scale")))))
        return [*statements, *([SEEN] if self.watching else []), *self.lines.watches()]

    def new_state(self) -> list[Statement]:
        statements: list[Statement] = [SQUARE]
        for slot, (name, series) in enumerate(zip(self.names, self.states, strict=True)):
            statements += [*polynomial(name, self.lines.all_of(series)), store("y_new", slot, f"n_{name}")]
        return [*statements, let("total", plus(*(Name(f"n_{name}") for name in self.names)))]

    def rows(self) -> list[Statement]:
        # row k - 1 of the dense output is coefficient k in units of the step
        statements = list[Statement]()
        for k in range(1, self.order + 1):
            statements.append(let("raised", "ratio" if k == 1 else Name("raised") * "ratio"))
            for slot, series in enumerate(self.states):
                e = self.lines.at(series, k)
                value = e * Name("raised") if e == ZERO else times(e, Name("raised"))
                statements.append(store("dense", (k - 1) * self.equations.dimension + slot, value))
        return statements


def polynomial(name: str, coefficients: Sequence[Expression]) -> list[Statement]:
    """Return the statements that assign the polynomial with these coefficients in `ratio` to n_<name>.

    The odd and the even part are two Horner schemes in ratio**2.  Each has half the degree, so that the two together
    have a shorter latency than one scheme.
    """
    statements, values = list[Statement](), list[Expression]()
    start, *others = coefficients
    for part, numbers in ((f"odd_{name}", others[::2]), (f"n_{name}", others[1::2])):
        while numbers and numbers[-1] == ZERO:
            numbers.pop()
        if numbers:
            statements.append(let(part, numbers.pop()))
            statements += [let(part, add(times(Name(part), Name("square")), e)) for e in reversed(numbers)]
            values.append(Name(part))
        else:
            values.append(ZERO)
    odd, even = values
    slope = add(times(even, Name("ratio")), odd)
    return [*statements, let(f"n_{name}", add(times(slope, Name("ratio")), start))]


def _masses_of_node(node: Node) -> list[sp.Expr]:
    """Return the entries of M of one node; those of the identity if the node has no mass matrix."""
    return [e for row in node.inertia or sp.eye(len(node.state)).tolist() for e in row]


def _masses_of_link(edge: Edge) -> list[sp.Expr]:
    return [e for block in edge.inertia for row in block for e in row]


def write_step(equations: Equations, order: int) -> TaylorStep:
    """Return the Taylor step of this order for equations with names that a kernel can use (`tidy`)."""
    check_order(order)
    check_passable(equations)
    return UnrolledSeries(equations, order).step()
