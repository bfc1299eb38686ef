"""A Taylor step, written out for a small network."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import compress

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Edge, Node

from ..program.expressions import ONE, ZERO, Expression, Load, Name, Negation, Number, call, plus
from ..program.passes import Names, real
from ..program.printers import LANES
from ..program.statements import Comment, Function, If, Return, Role, Statement, let, operations, store
from .graph import STARTS, Graph, Template, check_jumps
from .length import finished, last_orders, reach, unseen
from .masses import moving, solved
from .passage import Stored, approached, closed, first_passage, functions, further, jumps, loose, settled, told
from .series import Constant, Series, State, Time, magnitude
from .terms import absolute, add, lane, largest, over, times

__all__ = [
    "LineWriter",
    "StepWriter",
    "TaylorStep",
    "broken",
    "called",
    "check_order",
    "polynomial",
    "returned",
    "write_step",
]

WORDS = frozenset(
    {"unseen", "high", "low", "largest", "scale", "ratio", "reach", "length", "total", "raised", "square", "power", "weight", "number", "inverse", "LINKS", "j_there",
     "slope_scale", "convolution", "passed", "until", "passage", "side_of", "PASSED", "ROUNDING", "NEAREST", "nearest", "loose", "closing", "side_or", "found_side", "news", "new", "floor", "value", "stuck", "side", "way", *STARTS.values()}
)  # fmt: skip
PREFIXES = ("positive_", "i_", "e_", "half_", "w_", "n_", "size_", "odd_", "stuck_", "hint_")
"""Names of the step; a user's symbol of that name is called otherwise within the step."""

COUNTED = re.compile(r"[rs]\d+$")

SQUARE = let("square", Name("ratio") * "ratio")

ARGUMENTS = ("t", "h", "scale", "y", "p", "y_new", "dense", "rtol", "atol")


@dataclass(frozen=True, slots=True)
class TaylorStep:
    """The function `step` and what a kernel must know of it.

    order: that of the series, and the number of rows of the dense output; workspace: the groups of memory that it needs
    behind the dense output; called: the text of functions that it calls.
    """

    function: Function
    order: int
    workspace: int
    called: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        body: Sequence[Statement],
        order: int,
        workspace: int,
        more: Sequence[str] = (),
        called: Sequence[str] = (),
    ) -> TaylorStep:
        """The step of some statements, which takes `more` arguments."""
        about = (
            "One step from (t, y): writes y_new and the dense output, returns its length and how far its series reach."
        )
        return cls(
            Function("step", (*ARGUMENTS, *more), about, tuple(body), Role.ENTRY),
            order,
            workspace,
            (*functions(body), *called),
        )

    @property
    def text(self) -> str:
        """The step and what it calls, as a kernel has them."""
        return "\n\n\n".join([*self.called, LANES.function(self.function)])

    @property
    def operations(self) -> int:
        """The number of additions, multiplications and divisions of the step."""
        return operations(self.function.body)


class LineWriter:
    """Writes the coefficients of series one after another; it is the `Order` and the `Start` of their recurrences.

    Attributes
    ----------
    rates : dict
        The states that move, and their rates.
    gaps : list of Series
        What is looked at for a zero, beside kinks.
    values : dict
        The coefficients so far, as names and numbers, by series and order.
    statements : list of Statement
        Those so far.
    """

    def __init__(self, graph: Graph, order: int) -> None:
        self.graph, self.order, self.k = graph, order, 0
        self.rates: dict[State, Series] = {}
        self.gaps: list[Series] = []
        self.values: dict[tuple[Series, int], Expression] = {}
        self.kept: set[str] = set()
        self.statements: list[Statement] = []

    # -- what a recurrence asks for -------------------------------------------------------------------------------

    @property
    def inverse(self) -> Expression:
        """1/k."""
        return Number(1.0 / self.k)

    @property
    def number(self) -> Expression:
        """k."""
        return Number(float(self.k))

    def at(self, series: Series, j: int) -> Expression:
        """Coefficient j of a series."""
        match series:
            case Constant(value):
                return ZERO if j else value
            case Time():
                return Name("scale" if j else "t") if j < 2 else ZERO
        return self.values[series, j]

    def of(self, series: Series) -> Expression:
        """Coefficient k of a series."""
        return self.at(series, self.k)

    def start(self, series: Series) -> Expression:
        """Coefficient 0 of a series."""
        return self.at(series, 0)

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
        """Compute something once; returns its name."""
        if what not in self.kept:
            self.kept.add(what)
            self.put(let(what, value))
        return Name(what)

    def hint(self, series: Series) -> Name:
        """The side of zero on which a series that begins at zero lies just after."""
        return Name(f"hint_{series.name}")

    # -- statements -----------------------------------------------------------------------------------------------

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def name(self, series: Series, value: Expression, inlined: Collection[Series] = ()) -> None:
        """Name coefficient k of a series, unless it is a name or a number or is written where it is used."""
        if series not in inlined and not isinstance(value, Name | Number):
            name = f"{series.name}_{self.k}"
            self.put(let(name, value))
            value = Name(name)
        self.values[series, self.k] = value

    def opening(self) -> None:
        """Compute the first coefficients of all series from those of the states."""
        self.put(Comment("order 0"))
        for s in self.graph.series:
            self.name(s, s.begin(self), self.graph.inline_start)

    def coefficients(self, k: int) -> None:
        """Compute coefficients k of the states and of all series; in the last order of those alone that end steps."""
        self.put(Comment(f"order {k}"), let(f"r{k}", times(Number(1.0 / k), Name("scale"))))
        slopes = [self.at(rate, k - 1) for rate in self.rates.values()]
        self.k = k
        for state, slope in zip(self.rates, slopes, strict=True):
            self.name(state, times(Name(f"r{k}"), slope))
        ends = self.graph.behind([*self.graph.kinks, *self.gaps]) if k == self.order else self.graph.series
        for s in ends:
            self.name(s, s.coefficient(self), self.graph.inline)


@dataclass(frozen=True, slots=True)
class Gaps:
    """The two gaps of a contact (`Contact.gaps`), and the name of its mode."""

    mode: str
    series: tuple[Series, Series]

    @property
    def sizes(self) -> list[str]:
        """What the sizes of the terms that they begin with are called."""
        return [f"size_{self.mode}_{word}" for word in ("rise", "fall")]

    def closings(self, at: LineWriter, order: int, first: int, exact: bool) -> list[Statement]:
        """End the step where one of them closes."""
        stored = [lane(at.at(series, k)) for series in self.series for k in range(order + 1)]
        places = [Number(first + k * (order + 1)) for k in range(3)]
        gaps = [Stored(Name(size), at, Number(1), order) for size, at in zip(self.sizes, places, strict=False)]
        return [
            *(store("dense", first + k, value) for k, value in enumerate(stored)),
            *closed(self.mode, exact, gaps, f"stuck_{self.mode}", places[-1]),
        ]


class StepWriter(LineWriter):
    """Writes the step of some order for tidy equations."""

    def __init__(self, equations: Equations, order: int) -> None:
        self.equations = equations
        taken = {*equations.state, *equations.parameters}
        self.called = called(taken)
        taken |= set(self.called.values())
        self.names = [_unlike(self.called[name], taken, order) for name in equations.state]
        own = {s.name for node in equations.nodes for s in (*node.state, *node.parameters)}
        self.supply = Names([*taken, *self.names, *own, *(s.name for edge in equations.edges for s in edge.parameters)])
        super().__init__(Graph(self.supply), order)
        self.time = Time(name="t")
        found = list[int]()
        for i, places in enumerate(equations.places):
            moves = moving(equations.node_at(i), (edge for link, edge in equations.linked() if link[0] == i))
            found += compress(places, moves)
        self.states = {slot: State(name=self.names[slot]) for slot in sorted(found)}
        self.noted: list[Series] = []
        self.rates = self.read()
        self.contacts, self.exact = self.read_contacts(), jumps(equations)
        self.gaps = [s for gaps in self.contacts for s in gaps.series]
        self.graph.settle([*self.rates.values(), *self.noted, *self.gaps])

    # -- what is written ------------------------------------------------------------------------------------------

    def read(self) -> dict[State, Series]:
        """The rates of the states that move: those of the node, and what each link adds."""
        terms = defaultdict[int, list[tuple[Expression, Series]]](list)
        for (target, *_), rates in self.parts(lambda node: node.rhs, lambda edge: edge.rhs, {TIME: self.time}):
            for slot, rate in zip(self.equations.places[target], rates, strict=True):
                terms[slot].append((ONE, rate))
        right = {slot: self.graph.sum(terms[slot]) for slot in self.states}
        found = solved(self.graph, self.masses(), right) if self.equations.inertial else right
        return {self.states[slot]: rate for slot, rate in found.items()}

    def masses(self) -> dict[tuple[int, int], Series]:
        """The entries of M."""
        places, terms = self.equations.places, defaultdict[tuple[int, int], list[tuple[Expression, Series]]](list)
        for ends, masses in self.parts(
            _masses, lambda edge: [e for block in edge.inertia for e in _entries(block)], {}
        ):
            keys = [(r, c) for end in ends for r in places[ends[0]] for c in places[end]] if masses else []
            for key, e in zip(keys, masses, strict=True):
                terms[key].append((ONE, e))
        return {key: self.graph.sum(found) for key, found in terms.items()}

    def parts(
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

    def read_contacts(self) -> list[Gaps]:
        """What closes when a contact sticks, lets go or turns."""
        eq, found = self.equations, list[Gaps]()
        moving, swap = self.of_network()
        shared = self.supply.fresh("shared_")
        for i in range(eq.n):
            contact = eq.contact_at(i)
            if contact is not None:
                mode = eq.symbols(i)[2]
                rise, fall = self.graph.read(Template.of(contact.gaps(mode), moving, shared), moving, swap)
                found.append(Gaps(self.called[mode.name], (rise, fall)))
        return found

    def of_network(self) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """What the symbols of the whole network stand for."""
        return self.meanings({TIME: self.time}, {s: s for s in map(real, self.equations.state)})

    def meanings(
        self, known: dict[sp.Symbol, Series], values: Mapping[sp.Symbol, sp.Expr]
    ) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """Symbols of a template that stand for series, and those that stand for constants."""
        slots = {s: slot for slot, s in enumerate(map(real, self.equations.state))}
        called = {real(old): real(new) for old, new in self.called.items()}
        moving, swap = dict(known), dict[sp.Symbol, sp.Expr](called)
        for s, e in values.items():
            if slots.get(e) in self.states:
                moving[s] = self.states[slots[e]]
            else:
                swap[s] = called.get(e, e)
        return moving, swap

    # -- statements -----------------------------------------------------------------------------------------------

    def step(self, *more: str) -> TaylorStep:
        """The step, which takes `more` arguments."""
        self.opening()
        for k in range(1, self.order + 1):
            self.coefficients(k)
        self.settle()
        self.length()
        passages = first_passage(self.passages())
        self.put(*passages)
        self.closing(bool(passages))
        room = 3 * (self.order + 1) if self.gaps else self.order + 1 if passages else 0
        return TaylorStep.of(self.statements, self.order, room, more)

    def opening(self) -> None:
        """Load states and parameters, compute constants and first coefficients."""
        eq = self.equations
        self.put(*(let(self.called[name], Load("y", Number(slot))) for slot, name in enumerate(eq.state)))
        for slot, name in enumerate(eq.parameters, start=eq.dimension):
            self.put(let(self.called[name], Load("p", Number(slot))))
        self.put(*self.graph.constants)
        for slot, state in self.states.items():
            self.values[state, 0] = Name(self.called[eq.state[slot]])
        super().opening()
        for gaps in self.contacts:
            for name, series in zip(gaps.sizes, gaps.series, strict=True):
                self.keep(name, magnitude(self, series))

    def settle(self) -> None:
        """Let the coefficients tell on which sides series lie that begin at zero."""
        hints = {kink: self.hint(kink.base).text for kink in self.graph.kinks}
        zeros = [let(hint, 0.0 * Name("t")) for hint in dict.fromkeys(hints.values())]
        sides = list[Statement]()
        for kink, hint in hints.items():
            known = [further(e) for k in range(1, self.order + 1) if (e := self.at(kink.base, k)) != ZERO]
            sides.append(told(kink.side, known, partial(noted, hint)))
        self.statements = settled(zeros, self.statements, sides)

    def state_at(self, slot: int, k: int) -> Expression:
        """Coefficient k of a state."""
        if slot not in self.states:
            return ZERO if k else Name(self.called[self.equations.state[slot]])
        return self.at(self.states[slot], k)

    def length(self) -> None:
        """The length of the step."""
        sizes: dict[int, list[Expression]] = {k: [] for k in last_orders(self.order)}
        self.put(Comment("step length"))
        for series in (*self.states.values(), *self.graph.gaps):
            if any(self.at(series, k) != ZERO for k in sizes):
                low = largest(absolute(e) for k in range(3) if (e := self.at(series, k)) != ZERO)
                self.weigh(sizes, series, f"w_{series.name}", Name("rtol") * low)
        self.put(*([loose(self.exact)] if self.contacts else []))
        for gaps in self.contacts:
            for series, size in zip(gaps.series, gaps.sizes, strict=True):
                self.weigh(sizes, series, f"w_{size}", Name("loose") * size)
        for k, found in sizes.items():
            self.put(*([let(f"size_{k}", largest(found))] if found else []))
        known = [k for k, found in sizes.items() if found]
        self.put(let("reach", reach(known) if known else Negation(call("log", 0.0 * Name("scale")))))
        if self.graph.watched:
            self.put(let("unseen", 0.0 * Name("scale")))
            for s in self.graph.watched:
                self.put(*unseen([self.at(s, k) for k in range(self.order)]))
        self.put(*finished(self.order, bool(self.graph.watched), self.equations.sticks))

    def weigh(self, sizes: Mapping[int, list[Expression]], series: Series, weight: str, error: Expression) -> None:
        """Append how large the last coefficients of a series are, in units of the error that it may have."""
        self.put(let(weight, 1.0 / (Name("atol") + error)))
        for k, found in sizes.items():
            if (e := self.at(series, k)) != ZERO:
                found.append(times(absolute(e), Name(weight)))

    def passages(self) -> list[Statement]:
        """The statements that end the step where a series passes a kink or closes a contact."""
        first, p, found = self.order * self.equations.dimension, self.order, list[Statement]()
        for kink in self.graph.kinks:
            known = [self.at(kink.base, k) for k in range(p + 1)]
            stored = (store("dense", first + k, lane(e)) for k, e in enumerate(known))
            ends = (*stored, *kink.passages(kink.side, Stored(kink.size, Number(first), Number(1), p)))
            found += approached(known, ends)
        for gaps in self.contacts:
            found += gaps.closings(self, p, first, self.exact)
        return found

    def closing(self, ends: bool) -> None:
        """The new state, the dense output, and the length of a step that may have come to an end."""
        p, eq = self.order, self.equations
        self.put(Comment("new state"), SQUARE)
        for slot, name in enumerate(self.names):
            self.put(*polynomial(name, [self.state_at(slot, k) for k in range(p + 1)]))
            self.put(store("y_new", slot, f"n_{name}"))
        self.put(let("total", plus(*(Name(f"n_{name}") for name in self.names))))
        for which, s in enumerate(self.graph.positive):
            self.put(*polynomial(f"positive_{which}", [self.at(s, k) for k in range(p)]))
            self.put(broken(Name(f"n_positive_{which}"), times(ONE, self.at(s, 0))))
        rows = list[Statement]()
        for k in range(1, p + 1):
            rows.append(let("raised", "ratio" if k == 1 else Name("raised") * "ratio"))
            for slot in range(eq.dimension):
                e, place = self.state_at(slot, k), (k - 1) * eq.dimension + slot
                value = e * Name("raised") if e == ZERO else times(e, Name("raised"))
                rows.append(store("dense", place, value))
        self.put(If(Name("DENSE"), tuple(rows)), returned(ends))


def noted(hint: str, new: Expression) -> Statement:
    """Take note of the side of a series that begins at zero."""
    return let(hint, call("side_or", hint, new))


def broken(end: Expression, start: Expression) -> Statement:
    """The statement that makes a step NaN if a series that cannot pass zero has done so: a root of a polynomial may be one."""
    return let("total", Name("total") + 0.0 * call("log", over(end, start)))


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
    """Return the Taylor step of some order for equations with names that a kernel can use (`tidy`).

    Parameters
    ----------
    equations : Equations
        What the step integrates.
    order : int
        The order of the series, at least 6.

    Raises
    ------
    ValueError
        For an order that is too small, and for functions that jump.
    """
    check_order(order)
    check_jumps(equations)
    return StepWriter(equations, order).step()


def check_order(order: int) -> None:
    """Raise ValueError for an order that is too small."""
    if order < 6:
        raise ValueError(f"taylor: found order {order}; expected at least 6")


def returned(ends: bool) -> Statement:
    """What a step returns; one that ends where a series passes zero goes `until` there."""
    reach = Name("length") + 0.0 * Name("total")
    return Return((Name("until" if ends else "length"), reach), "NaN where any coefficient is infinite or NaN")


def called(words: Collection[str]) -> dict[str, str]:
    """What symbols are called within the step: as they are, unless the step needs that name itself."""
    found: dict[str, str] = {}
    for word in sorted(words):
        name = word
        if word in WORDS or word.startswith(PREFIXES) or COUNTED.match(word):
            name = f"user_{word}"
            while name in words or name in found.values():
                name += "_"
        found[word] = name
    return found


def _unlike(name: str, taken: set[str], order: int) -> str:
    """The name of a series of which no coefficient is called like a symbol."""
    while any(f"{name}_{k}" in taken for k in range(order + 1)):
        name += "_"
    return name


def _masses(node: Node) -> list[sp.Expr]:
    """The entries of M of one node."""
    return _entries(node.inertia or sp.eye(len(node.state)).tolist())


def _entries(block: Iterable[Iterable[sp.Expr]]) -> list[sp.Expr]:
    return [e for row in block for e in row]
