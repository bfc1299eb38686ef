"""A Taylor step for a small network, written out order by order, its coefficients in names."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, compress

import sympy as sp

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Edge, Node

from ..program.expressions import ONE, ZERO, Expression, Load, Name, Negation, Number, call, plus
from ..program.passes import Names, real
from ..program.statements import Comment, Statement, Store, let, store
from ..steps.step import lane
from .event_location import Stored, approached, further
from .mass_matrix import moving, solved
from .series import Constant, Exponential, Series, State, Time, magnitude
from .series_graph import SeriesGraph, Template, check_jumps
from .series_writer import Gaps, SeriesWriter
from .simplify import add, largest, times
from .step_length import SEEN, last_orders, reach
from .taylor_step import StepWriter, TaylorStep, check_order

SQUARE = let("square", Name("ratio") * "ratio")


@dataclass(eq=False)
class Lines(SeriesWriter):
    """Writes the coefficients of series one after another, each under a name.

    k: the order that is written; room: the group of memory behind which a passage finds coefficients; rates: the states that
    move, and their rates; values: the coefficients so far, as names and numbers, by series and order; sizes: how large the
    last ones of each order are in units of their errors.
    """

    k: int = 0
    room: int = 0
    rates: dict[State, Series] = field(default_factory=dict)
    values: dict[tuple[Series, int], Expression] = field(default_factory=dict)
    sizes: defaultdict[int, list[Expression]] = field(default_factory=lambda: defaultdict(list))
    zeros = 0.0 * Name("t")

    # -- what a recurrence asks for -------------------------------------------------------------------------------

    @property
    def inverse(self) -> Expression:
        return Number(1.0 / self.k)

    @property
    def number(self) -> Expression:
        return Number(float(self.k))

    def of(self, series: Series) -> Expression:
        return self.at(series, self.k)

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        """Sum of left_j * right_(k-j) for j = first … k + last.

        The latest coefficients come last, so that the processor can add up all others before they are known.
        """
        k = self.k
        order = sorted(range(first, k + last + 1), key=lambda j: max(j, k - j))
        return add(*(times(self.at(left, j), self.at(right, k - j)) for j in order))

    def square(self, base: Series, first: int) -> Expression:
        """Sum of base_j * base_(k-j) for j = first … k - first, pairs of equal products once."""
        k = self.k
        half = add(*(times(self.at(base, j), self.at(base, k - j)) for j in reversed(range(first, (k + 1) // 2))))
        middle = self.at(base, k // 2) if k % 2 == 0 and k // 2 >= first else ZERO
        return add(times(middle, middle), times(Number(2.0), half))

    def keep(self, what: str, value: Expression) -> Name:
        if what not in self.kept:
            self.kept[what] = None
            self.put(let(what, value))
        return Name(what)

    # -- where coefficients are -----------------------------------------------------------------------------------

    def at(self, series: Series, k: int) -> Expression:
        match series:
            case Constant(value):
                return ZERO if k else value
            case Time():
                return Name("scale" if k else "t") if k < 2 else ZERO
        return self.values[series, k]

    def known(self, series: Series) -> list[Expression]:
        """All coefficients of a series."""
        return [self.at(series, k) for k in range(self.order + 1)]

    def hold(self, series: Series, value: Expression, inline: bool) -> None:
        self.values[series, self.k] = value if inline else self.named(f"{series.name}_{self.k}", value)

    def recall(self, what: str) -> Expression:
        return Name(what)

    def note(self, what: str, value: Expression) -> Statement:
        return let(what, value)

    def signs(self, series: Series) -> list[Statement]:
        return [further(e) for e in self.known(series)[1:] if e != ZERO]

    def weight(self, what: str) -> Name:
        return Name(f"w_{what}")

    def enlarge(self, k: int, size: Expression) -> list[Statement]:
        self.sizes[k].append(size)
        return []

    def end_of(self, series: Series, what: str) -> tuple[list[Statement], Expression]:
        return polynomial(what, [self.at(series, k) for k in range(self.order)]), Name(f"n_{what}")

    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        known = [lane(e) for s in series for e in self.known(s)]
        places = [Number(self.room + k) for k in range(len(known))]
        stores: list[Statement] = [Store("dense", place, e) for place, e in zip(places, known, strict=True)]
        firsts = places[:: self.order + 1]
        return stores, [Stored(size, first, self.order) for size, first in zip(sizes, firsts, strict=True)]

    def of_exponent(self, series: Exponential, k: int) -> Expression:
        return self.at(series.argument, k)

    def near(self, series: Series, ends: Sequence[Statement]) -> list[Statement]:
        return approached(self.known(series), ends)

    # -- statements -----------------------------------------------------------------------------------------------

    def coefficients(self, k: int) -> None:
        """Compute coefficients k of the states and of all series; in the last order of those alone that end steps."""
        self.k = k
        self.put(Comment(f"order {k}"), *([let(f"r{k}", times(Number(1.0 / k), Name("scale")))] if k else []))
        for state, rate in self.rates.items() if k else ():
            self.hold(state, times(Name(f"r{k}"), self.at(rate, k - 1)), False)
        gaps = [s for gaps in self.contacts for s in gaps.series]
        self.make(self.graph.behind([*self.graph.kinks, *gaps]) if k == self.order else self.graph.series, k == 0)


class UnrolledSeries(StepWriter):
    """Writes everything out, with one part of all series."""

    def __init__(self, equations: Equations, order: int) -> None:
        super().__init__(equations, order, {*equations.state, *equations.parameters})
        taken = {*self.called, *self.called.values()}
        self.names = [_unlike(self.called[name], taken, order) for name in equations.state]
        own = {s.name for node in equations.nodes for s in (*node.state, *node.parameters)}
        self.supply = Names([*taken, *self.names, *own, *(s.name for edge in equations.edges for s in edge.parameters)])
        self.lines = Lines(SeriesGraph(self.supply), order, room=order * equations.dimension)
        self.graph, self.parts = self.lines.graph, [self.lines]
        edges = [[edge for link, edge in equations.linked() if link[0] == i] for i in range(equations.n)]
        moves = (compress(places, moving(equations.node_at(i), edges[i])) for i, places in enumerate(equations.places))
        periods = periods_of_states(equations)
        slots = sorted(chain.from_iterable(moves))
        self.moving = {slot: State(name=self.names[slot], period=periods[slot]) for slot in slots}
        still = {slot: Constant(Name(self.called[name])) for slot, name in enumerate(equations.state)}
        self.states: list[Series] = list((still | self.moving).values())
        self.noted: list[Series] = []
        self.lines.rates, self.lines.contacts = self.read(), list(self.contacts())
        gaps = [s for gaps in self.lines.contacts for s in gaps.series]
        self.graph.settle([*self.lines.rates.values(), *self.noted, *gaps])

    # -- what is written ------------------------------------------------------------------------------------------

    def read(self) -> dict[State, Series]:
        """The rates of the states that move: those of the node, and what each link adds."""
        terms = defaultdict[int, list[tuple[Expression, Series]]](list)
        for (target, *_), rates in self.contributions(lambda node: node.rhs, lambda edge: edge.rhs, {TIME: self.time}):
            for slot, rate in zip(self.equations.places[target], rates, strict=True):
                terms[slot].append((ONE, rate))
        right = {slot: self.graph.sum(terms[slot]) for slot in self.moving}
        found = solved(self.graph, self.masses(), right) if self.equations.inertial else right
        return {self.moving[slot]: rate for slot, rate in found.items()}

    def masses(self) -> dict[tuple[int, int], Series]:
        """The entries of M."""
        places, terms = self.equations.places, defaultdict[tuple[int, int], list[tuple[Expression, Series]]](list)
        for ends, masses in self.contributions(
            _masses, lambda edge: [e for m in edge.inertia for r in m for e in r], {}
        ):
            keys = [(r, c) for end in ends for r in places[ends[0]] for c in places[end]] if masses else []
            for key, e in zip(keys, masses, strict=True):
                terms[key].append((ONE, e))
        return {key: self.graph.sum(found) for key, found in terms.items()}

    def contributions(
        self,
        of_node: Callable[[Node], Sequence[sp.Expr]],
        of_edge: Callable[[Edge], Sequence[sp.Expr]],
        known: dict[sp.Symbol, Series],
    ) -> Iterator[tuple[tuple[int, ...], list[Series]]]:
        """Yield what each node and each link contributes as series, with the node, or the target and the source."""
        eq, shared = self.equations, self.supply.fresh("shared_")
        nodes = [Template.of(of_node(node), (*known, *node.state), shared) for node in eq.nodes]
        edges = {edge: Template.of(of_edge(edge), (*known, *edge.here, *edge.there), shared) for edge in eq.edges}
        for i, kind in enumerate(eq.kind_of):
            yield (i,), self.graph.read(nodes[kind], *self.meanings(known, eq.at_node(i)))
        for link, edge in eq.linked():
            yield link[:2], self.graph.read(edges[edge], *self.meanings(known, eq.at_link(link, edge)))

    def contacts(self) -> Iterator[Gaps]:
        """What closes when a contact sticks, lets go or turns."""
        eq, shared = self.equations, self.supply.fresh("shared_")
        moving, swap = self.of_network()
        for i in range(eq.n):
            for event in eq.events_at(i):
                rise, fall = self.graph.read(Template.of(event.gaps, moving, shared), moving, swap)
                word, room = self.called[event.mode.name], Number(self.lines.room + 2 * (self.order + 1))
                names = (f"size_{word}_rise", f"size_{word}_fall")
                yield Gaps(word, f"stuck_{word}", (rise, fall), names, (Name(names[0]), Name(names[1])), room)

    def of_network(self) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """What the symbols of the whole network stand for."""
        return self.meanings({TIME: self.time}, {s: s for s in map(real, self.equations.state)})

    def meanings(
        self, known: dict[sp.Symbol, Series], values: Mapping[sp.Symbol, sp.Expr]
    ) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """Symbols of a template that stand for series, and those that stand for constants."""
        slots = {s: slot for slot, s in enumerate(map(real, self.equations.state))}
        moving, swap = dict(known), dict(self.swap)
        for s, e in values.items():
            if slots.get(e) in self.moving:
                moving[s] = self.moving[slots[e]]
            else:
                swap[s] = self.swap.get(e, e)
        return moving, swap

    # -- statements -----------------------------------------------------------------------------------------------

    @property
    def workspace(self) -> int:
        return (self.order + 1) * (3 if self.equations.sticks else 1 if self.graph.kinks else 0)

    def coefficients(self) -> list[Statement]:
        """Load states and parameters, compute constants and the coefficients of all series."""
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
        """Write coefficients k of all series, behind the first the sizes of what contacts close with."""
        self.lines.coefficients(k)
        for gaps in self.lines.contacts if k == 0 else ():
            for name, series in zip(gaps.names, gaps.series, strict=True):
                self.lines.keep(name, magnitude(self.lines, series))

    def sizes(self) -> list[Statement]:
        return [statement for s in self.moving.values() for statement in self.lines.counted(s)]

    def reach(self) -> list[Statement]:
        """How far the step may go by all that counts, infinitely far if nothing does."""
        known = [k for k in last_orders(self.order) if self.lines.sizes[k]]
        found = [let(f"size_{k}", largest(self.lines.sizes[k])) for k in known]
        found.append(let("reach", reach(known) if known else Negation(call("log", 0.0 * Name("scale")))))
        return [*found, *([SEEN] if self.watching else []), *self.lines.watches()]

    def new_state(self) -> list[Statement]:
        found: list[Statement] = [SQUARE]
        for slot, (name, series) in enumerate(zip(self.names, self.states, strict=True)):
            found += [*polynomial(name, self.lines.known(series)), store("y_new", slot, f"n_{name}")]
        return [*found, let("total", plus(*(Name(f"n_{name}") for name in self.names)))]

    def rows(self) -> list[Statement]:
        found = list[Statement]()
        for k in range(1, self.order + 1):
            found.append(let("raised", "ratio" if k == 1 else Name("raised") * "ratio"))
            for slot, series in enumerate(self.states):
                e, place = self.lines.at(series, k), (k - 1) * self.equations.dimension + slot
                value = e * Name("raised") if e == ZERO else times(e, Name("raised"))
                found.append(store("dense", place, value))
        return found


def polynomial(name: str, coefficients: Sequence[Expression]) -> list[Statement]:
    """The statements for n_<name>, a polynomial in `ratio`: two in ratio**2 of half the degree are ready sooner than one."""
    start, *known = coefficients
    found = list[Statement]()
    odd, even = _horner(found, f"odd_{name}", known[::2]), _horner(found, f"n_{name}", known[1::2])
    slope = add(times(even, Name("ratio")), odd)
    return [*found, let(f"n_{name}", add(times(slope, Name("ratio")), start))]


def _horner(found: list[Statement], name: str, coefficients: Sequence[Expression]) -> Expression:
    """A polynomial in ratio**2, its statements appended."""
    known = list(coefficients)
    while known and known[-1] == ZERO:
        known.pop()
    if not known:
        return ZERO
    found.append(let(name, known.pop()))
    found += [let(name, add(times(Name(name), Name("square")), e)) for e in reversed(known)]
    return Name(name)


def write_step(equations: Equations, order: int) -> TaylorStep:
    """Return the Taylor step of some order for equations with names that a kernel can use (`tidy`)."""
    check_order(order)
    check_jumps(equations)
    return UnrolledSeries(equations, order).step()


def _unlike(name: str, taken: set[str], order: int) -> str:
    """The name of a series of which no coefficient is called like a symbol."""
    while any(f"{name}_{k}" in taken for k in range(order + 1)):
        name += "_"
    return name


def _masses(node: Node) -> list[sp.Expr]:
    """The entries of M of one node."""
    return [e for row in node.inertia or sp.eye(len(node.state)).tolist() for e in row]
