"""The text of a Taylor step, written out for a small network.

The step length is that of A. Jorba & M. Zou, Experimental Mathematics 14, 99 (2005), section 3.2, from the last three
coefficients, so that no series that has zeros at every second or third place is taken for an exact one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

from ..program.expressions import ONE, ZERO, Call, Expression, Name, Number
from ..program.passes import Names
from .graph import STARTS, Graph, Template
from .masses import moved, solved
from .passage import CLOSING, PASSAGE
from .series import Constant, Series, State, Time, magnitude
from .terms import add, show, statement, times

__all__ = [
    "FARTHEST",
    "NEXT",
    "SOONEST",
    "StepWriter",
    "TaylorStep",
    "Written",
    "broken",
    "called",
    "check_order",
    "closed",
    "ended",
    "ending",
    "extreme",
    "falling",
    "finished",
    "jumps",
    "lane",
    "largest",
    "loose",
    "polynomial",
    "returned",
    "unseen",
    "write_step",
]

FARTHEST = 16.0
"""How many times longer than `scale` a step may be."""

NEXT = 2.0
"""The same where series are watched, so that what is zero in double precision now is seen when it has begun.

Contacts end their slips by events: the first steps behind one would be a third of all steps.
"""

LOW = (1, 2, 3)
"""The low orders with which high ones are compared, beside the last one below half the highest.

The series of x' = v, v' = -x**n from x = 0 has its coefficients n + 1 orders apart: of those of x**n, n or 2 n + 1 is high.
"""

HIDDEN, LOST = 1e-9, 1e-110
"""Least that the low coefficients of a series are taken for: shares of the high ones, and of the absolute tolerance.

The first is for zeros of the low ones alone, the second for zeros of high order, which no step would reach otherwise.
"""

WORDS = frozenset(
    {"unseen", "high", "low", "largest", "scale", "ratio", "reach", "length", "total", "raised", "square", "power", "weight", "number", "inverse", "LINKS", "j_there",
     "slope_scale", "convolution", "passed", "until", "passage", "side_of", "PASSED", "ROUNDING", "NEAREST", "nearest", "loose", "closing", *STARTS.values()}
)  # fmt: skip
PREFIXES = ("positive_", "i_", "e_", "half_", "w_", "n_", "size_", "odd_", "stuck_")
"""Names of the step; a user's symbol of that name is called otherwise within the step."""

COUNTED = re.compile(r"[rs]\d+$")


@dataclass(frozen=True, slots=True)
class TaylorStep:
    """The text of the function `step` and what a kernel must know of it.

    order: that of the series, and the number of rows of the dense output; workspace: the groups of memory that it needs
    behind the dense output.
    """

    text: str
    order: int
    workspace: int = 0

    @property
    def operations(self) -> int:
        """The number of additions, multiplications and divisions in the text."""
        body = self.text.split('"""')[-1]
        return sum(body.count(sign) for sign in (" + ", " - ", "*", "/"))

    @classmethod
    def of(
        cls,
        lines: Sequence[str],
        order: int,
        workspace: int = 0,
        more: str = "",
        before: Sequence[str] = (),
    ) -> TaylorStep:
        """The step of some statements, behind functions that they call."""
        head = [
            *(line for text in before for line in (text, "", "")),
            "@njit(error_model='numpy', cache=True)",
            f"def step(t, h, scale, y, p, y_new, dense, rtol, atol{more}):",
            '    """One step from (t, y): writes y_new and the dense output, returns its length and how far its series reach."""',
        ]
        return cls("\n".join([*head, *(f"    {line}" for line in lines)]), order, workspace)


@dataclass(slots=True)
class Gaps:
    """The two gaps of a contact (`Contact.gaps`), the name of its mode, and those of the sizes that the gaps begin with."""

    mode: str
    series: tuple[Series, Series]
    sizes: tuple[str, ...] = ()

    def begin(self, at: Written) -> None:
        """Compute the sizes of the terms that they begin with."""
        names = [f"size_{self.mode}_{word}" for word in ("rise", "fall")]
        self.sizes = tuple(at.keep(name, magnitude(at, s)) for name, s in zip(names, self.series, strict=True))

    def closings(self, at: Written, order: int, first: int, exact: bool) -> list[str]:
        """End the step where one of them closes."""
        stuck, rows, size = f"stuck_{self.mode}", range(order + 1), order + 1
        stored = [lane(at.at(series, k)) for series in self.series for k in rows]
        places = [str(first), str(first + size)]
        return [
            f"{stuck} = 1.0 - {self.mode}*{self.mode}",
            *(f"store(dense, {first + k}, {value})" for k, value in enumerate(stored)),
            *closed(stuck, exact, self.sizes, places, "1", str(first + 2 * size), order),
        ]


@dataclass(slots=True)
class Written:
    """Coefficients that were made so far, as names and numbers; it is the `Order` and the `Start` of straight lines."""

    values: dict[tuple[Series, int], Expression]
    kept: dict[str, Expression]
    lines: list[tuple[str, Expression]]
    k: int = 0

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
        if isinstance(series, Constant):
            return ZERO if j else series.value
        return self.values[series, j]

    def of(self, series: Series) -> Expression:
        """Coefficient k of a series."""
        return self.at(series, self.k)

    def start(self, series: Series) -> Expression:
        """Coefficient 0 of a series."""
        return self.at(series, 0)

    def before(self, series: Series) -> Expression:
        """Coefficient k - 1 of a series."""
        return self.at(series, self.k - 1)

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

    def keep(self, what: str, value: Expression) -> str:
        """Compute something once; returns its name."""
        if what not in self.kept:
            self.kept[what] = value
            self.lines.append((what, value))
        return what

    # -- statements -----------------------------------------------------------------------------------------------

    def put(self, series: Series, value: Expression, inline: bool = False) -> None:
        """Name a coefficient, unless it is a name or a number or is written where it is used."""
        if not inline and not isinstance(value, Name | Number):
            name = f"{series.name}_{self.k}"
            self.lines.append((name, value))
            value = Name(name)
        self.values[series, self.k] = value


class StepWriter:
    """Writes the step of some order for tidy equations."""

    def __init__(self, equations: Equations, order: int) -> None:
        self.equations, self.order = equations, order
        self.lines: list[str] = []
        taken = {*equations.state, *equations.parameters}
        self.called = {name: called(name, taken) for name in (*equations.state, *equations.parameters)}
        taken |= set(self.called.values())
        self.names = [_unlike(self.called[name], taken, order) for name in equations.state]
        own = {s.name for node in equations.nodes for s in (*node.state, *node.parameters)}
        self.supply = Names([*taken, *self.names, *own, *(s.name for edge in equations.edges for s in edge.parameters)])
        self.time = Time(name="t")
        self.states = {
            slot: State(name=self.names[slot])
            for i, places in enumerate(equations.places)
            for slot, moves in zip(places, moving_states(equations, i), strict=True)
            if moves
        }
        self.states = dict(sorted(self.states.items()))
        self.graph = Graph(self.supply)
        self.noted: list[Series] = []
        self.rates = self.read()
        self.contacts, self.exact = self.read_contacts(), jumps(equations)
        self.graph.settle([*self.rates, *self.noted, *self.gaps])
        self.at = Written({}, {}, [])

    def read(self) -> list[Series]:
        """The rates of the states that move: those of the node, and what each link adds."""
        eq, terms = self.equations, dict[int, list[tuple[Expression, Series]]]()
        shared = self.supply.fresh("shared_")
        nodes = [Template.of(node.rhs, (TIME, *node.state), shared) for node in eq.nodes]
        edges = {edge: Template.of(edge.rhs, (TIME, *edge.here, *edge.there), shared) for edge in eq.edges}
        for i, places in enumerate(eq.places):
            found = self.graph.read(nodes[eq.kind_of[i]], *self.parted({TIME: self.time}, eq.at_node(i)))
            terms |= {slot: [(ONE, rate)] for slot, rate in zip(places, found, strict=True)}
        for link, edge in eq.linked():
            found = self.graph.read(edges[edge], *self.parted({TIME: self.time}, eq.at_link(link, edge)))
            for slot, rate in zip(eq.places[link[0]], found, strict=True):
                terms[slot].append((ONE, rate))
        right = {slot: self.graph.sum(terms[slot]) for slot in self.states}
        return list((solved(self.graph, self.masses(), right) if eq.inertial else right).values())

    @property
    def gaps(self) -> list[Series]:
        """The gaps of all contacts."""
        return [s for gaps in self.contacts for s in gaps.series]

    def read_contacts(self) -> list[Gaps]:
        """What closes when a contact sticks, lets go or turns."""
        eq, found = self.equations, list[Gaps]()
        moving, swap = self.parted({TIME: self.time}, {s: s for s in (sp.Symbol(x, real=True) for x in eq.state)})
        shared = self.supply.fresh("shared_")
        for i in range(eq.n):
            contact = eq.contact_at(i)
            if contact is not None:
                mode = eq.symbols(i)[2]
                rise, fall = self.graph.read(Template.of(contact.gaps(mode), moving, shared), moving, swap)
                found.append(Gaps(self.called[mode.name], (rise, fall)))
        return found

    def masses(self) -> dict[tuple[int, int], Series]:
        """The entries of M."""
        eq, terms = self.equations, dict[tuple[int, int], list[tuple[Expression, Series]]]()
        shared = self.supply.fresh("shared_")
        nodes = [Template.of([e for row in node.inertia for e in row], node.state, shared) for node in eq.nodes]
        ends = {edge: (*edge.here, *edge.there) for edge in eq.edges}
        edges = {e: Template.of([x for b in e.inertia for r in b for x in r], ends[e], shared) for e in eq.edges}
        for i, own in enumerate(eq.places):
            keys = [(r, c) for r in own for c in own] if eq.node_at(i).inertia else []
            found = self.graph.read(nodes[eq.kind_of[i]], *self.parted({}, eq.at_node(i)))
            terms |= {key: [(ONE, e)] for key, e in zip(keys, found, strict=True)} or {
                (k, k): [(ONE, Constant(ONE))] for k in own
            }
        for link, edge in eq.linked():
            rows, columns = eq.places[link[0]], [eq.places[end] for end in link[:2]]
            keys = [(r, c) for own in columns for r in rows for c in own] if edge.inertia else []
            found = self.graph.read(edges[edge], *self.parted({}, eq.at_link(link, edge)))
            for key, e in zip(keys, found, strict=True):
                terms.setdefault(key, []).append((ONE, e))
        return {key: self.graph.sum(parts) for key, parts in terms.items()}

    def parted(
        self, known: dict[sp.Symbol, Series], values: Mapping[sp.Symbol, sp.Expr]
    ) -> tuple[dict[sp.Symbol, Series], dict[sp.Symbol, sp.Expr]]:
        """Symbols of a template that stand for series, and those that stand for constants."""
        slots = {sp.Symbol(name, real=True): slot for slot, name in enumerate(self.equations.state)}
        called = {sp.Symbol(old, real=True): sp.Symbol(new, real=True) for old, new in self.called.items()}
        moving, swap = dict(known), dict[sp.Symbol, sp.Expr](called)
        for s, e in values.items():
            if slots.get(e) in self.states:
                moving[s] = self.states[slots[e]]
            else:
                swap[s] = called.get(e, e)
        return moving, swap

    def put(self, *lines: str) -> None:
        """Append lines of text."""
        self.lines += lines

    def flush(self) -> None:
        """Turn statements into text."""
        for target, value in self.at.lines:
            self.put(*statement(target, value))
        self.at.lines.clear()

    def write(self) -> list[str]:
        """All statements of the step."""
        self.opening()
        for k in range(1, self.order + 1):
            self.coefficients(k)
        self.length()
        self.passages()
        self.closing()
        return self.lines

    def step(self, more: str = "") -> TaylorStep:
        """The step, which takes `more` arguments."""
        lines = self.write()
        room = 3 * (self.order + 1) if self.gaps else self.order + 1 if self.ends else 0
        return TaylorStep.of(lines, self.order, room, more, ending(self.ends, bool(self.gaps)))

    def opening(self) -> None:
        """Load states and parameters, compute constants and first coefficients."""
        eq, at = self.equations, self.at
        self.put(*(f"{self.called[name]} = load(y, {slot}, WIDTH)" for slot, name in enumerate(eq.state)))
        for slot, name in enumerate(eq.parameters, start=eq.dimension):
            self.put(f"{self.called[name]} = load(p, {slot}, WIDTH)")
        self.put(*(f"{name} = {text}" for name, text in self.graph.constants.items()))
        for slot, state in self.states.items():
            at.values[state, 0] = Name(self.called[eq.state[slot]])
        at.values[self.time, 0] = Name("t")
        self.put("# order 0")
        for s in self.graph.series:
            at.put(s, s.begin(at), s in self.graph.inline_start)
        for gaps in self.contacts:
            gaps.begin(at)
        self.flush()

    def coefficients(self, k: int) -> None:
        """Coefficients k of the states, and of all series; in the last order of those alone that kinks need."""
        at = self.at
        self.put(f"# order {k}", f"r{k} = scale" if k == 1 else f"r{k} = {1.0 / k!r}*scale")
        slopes = [at.at(rate, k - 1) for rate in self.rates]
        at.k = k
        for state, slope in zip(self.states.values(), slopes, strict=True):
            at.put(state, times(Name(f"r{k}"), slope))
        at.values[self.time, k] = Name("scale") if k == 1 else ZERO
        for s in self.graph.series if k < self.order else self.graph.behind([*self.graph.kinks, *self.gaps]):
            at.put(s, s.coefficient(at), s in self.graph.inline)
        self.flush()

    def state_at(self, slot: int, k: int) -> Expression:
        """Coefficient k of a state."""
        if slot not in self.states:
            return ZERO if k else Name(self.called[self.equations.state[slot]])
        return self.at.values[self.states[slot], k]

    def length(self) -> None:
        """The length of the step."""
        p = self.order
        self.put("# step length")
        sizes: dict[int, list[Expression]] = {p: [], p - 1: [], p - 2: []}
        for series in (*self.states.values(), *self.graph.gaps):
            last = {k: e for k in sizes if (e := self.at.at(series, k)) != ZERO}
            if not last:
                continue
            size = largest(Call("absolute", (e,)) for k in range(3) if (e := self.at.at(series, k)) != ZERO)
            self.put(f"w_{series.name} = 1.0/(atol + rtol*{show(size)})")
            for k, e in last.items():
                sizes[k].append(times(Call("absolute", (e,)), Name(f"w_{series.name}")))
        reaches: list[Expression] = []
        self.loads(sizes)
        for k, found in sizes.items():
            if found:
                self.put(*statement(f"size_{k}", largest(found)))
                reaches.append(times(Number(-1.0 / k), Call("log", (Name(f"size_{k}"),))))
        if not reaches:
            reaches = [Name("-log(0.0*scale)")]
        self.put(*statement("reach", extreme("minimum", reaches)))
        if self.graph.watched:
            self.put("unseen = 0.0*scale")
            for s in self.graph.watched:
                self.put(*unseen([self.at.at(s, k) for k in range(p)]))
            self.put(falling(p))
        self.put(*finished(p, NEXT if self.graph.watched and not self.equations.sticks else FARTHEST))

    def loads(self, sizes: Mapping[int, list[Expression]]) -> None:
        """Append how large the last coefficients of the gaps of contacts are."""
        self.put(*([loose(self.exact)] if self.contacts else []))
        for series, size in zip(self.gaps, (size for gaps in self.contacts for size in gaps.sizes), strict=True):
            self.put(f"w_{size} = 1.0/(atol + loose*{size})")
            for k, found in sizes.items():
                if (e := self.at.at(series, k)) != ZERO:
                    found.append(times(Call("absolute", (e,)), Name(f"w_{size}")))

    def passages(self) -> None:
        """End the step where a series passes a kink."""
        if not self.ends:
            return
        first = self.order * self.equations.dimension
        self.put("# first passage", "passed = ratio")
        self.put(*([SOONEST] if self.gaps else []))
        p, at = self.order, self.at
        for kink in self.graph.kinks:
            self.put(*(f"store(dense, {first + k}, {lane(at.at(kink.base, k))})" for k in range(p + 1)))
            side = show(at.at(kink, p))
            self.put(f"passed = passage({side}, {kink.size}, PASSED, NEAREST*passed, dense, {first}, 1, {p}, passed)")
        for gaps in self.contacts:
            self.put(*gaps.closings(at, p, first, self.exact))
        self.put(*ended())

    @property
    def ends(self) -> bool:
        """True if steps end where a series passes zero."""
        return bool(self.graph.kinks or self.gaps)

    def closing(self) -> None:
        """The new state, the dense output, and the length of the step."""
        p, eq = self.order, self.equations
        self.put("# new state", "square = ratio*ratio")
        for slot, name in enumerate(self.names):
            self.put(
                *polynomial(name, [self.state_at(slot, k) for k in range(p + 1)]), f"store(y_new, {slot}, n_{name})"
            )
        self.put(f"total = {' + '.join(f'n_{name}' for name in self.names)}")
        for which, s in enumerate(self.graph.positive):
            self.put(*polynomial(f"positive_{which}", [self.at.at(s, k) for k in range(p)]))
            self.put(broken(f"n_positive_{which}", show(times(ONE, self.at.at(s, 0)))))
        self.put("if DENSE:")
        for k in range(1, p + 1):
            self.put(f"    raised = {'ratio' if k == 1 else 'raised*ratio'}")
            for slot in range(eq.dimension):
                e = self.state_at(slot, k)
                value = "0.0*raised" if e == ZERO else show(times(e, Name("raised")))
                self.put(f"    store(dense, {(k - 1) * eq.dimension + slot}, {value})")
        self.put(returned(self.ends))


def broken(end: str, start: str) -> str:
    """The text that makes a step NaN if a series that cannot pass zero has done so: a root of a polynomial may be one."""
    return f"total = total + 0.0*log({end}/({start}))"


def polynomial(name: str, coefficients: Sequence[Expression]) -> list[str]:
    """The lines for n_<name>, a polynomial in `ratio`: two in ratio**2 of half the degree are ready sooner than one."""
    start, *known = coefficients
    lines: list[str] = []
    odd, even = _horner(lines, f"odd_{name}", known[::2]), _horner(lines, f"n_{name}", known[1::2])
    slope = add(times(even, Name("ratio")), odd)
    return [*lines, f"n_{name} = {show(add(times(slope, Name('ratio')), start))}"]


def _horner(lines: list[str], name: str, coefficients: Sequence[Expression]) -> Expression:
    """A polynomial in ratio**2, its lines appended."""
    known = list(coefficients)
    while known and known[-1] == ZERO:
        known.pop()
    if not known:
        return ZERO
    lines.append(f"{name} = {show(known.pop())}")
    lines += [f"{name} = {show(add(times(Name(name), Name('square')), e))}" for e in reversed(known)]
    return Name(name)


def moving_states(equations: Equations, i: int) -> tuple[bool, ...]:
    """Which states of node i move; one at rest, such as the mode of a contact, is a constant of the step."""
    found = [moved(equations.node_at(i))] + [moved(edge) for link, edge in equations.linked() if link[0] == i]
    return tuple(map(any, zip(*found, strict=True)))


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
    writer = StepWriter(equations, order)
    return writer.step()


def check_order(order: int) -> None:
    """Raise ValueError for an order that is too small."""
    if order < 6:
        raise ValueError(f"taylor: found order {order}; expected at least 6")


def unseen(coefficients: Sequence[Expression]) -> list[str]:
    """How much larger the high coefficients of a series are than its low ones, the largest so far."""
    half = len(coefficients) // 2
    low, high = (
        [Call("absolute", (e,)) for k in places if (e := coefficients[k]) != ZERO]
        for places in ((*LOW, half - 1), range(half, len(coefficients)))
    )
    if not (low and high):
        return []
    return [
        *statement("high", largest(high)),
        *statement("low", largest(low)),
        f"unseen = maximum(unseen, high/(low + ({HIDDEN!r}*high + {LOST!r}*atol)))",
    ]


def falling(order: int) -> str:
    """No step goes on behind the place where the terms of a watched series stop falling."""
    reaches = (f"{-1.0 / k!r}*log(unseen)" for k in (order - 2, order // 2))
    return f"reach = minimum(reach, minimum({', '.join(reaches)}))"


def finished(order: int, farthest: float = FARTHEST) -> list[str]:
    """The length of the step from the logarithm of its share of `scale`."""
    return [
        # weights are those of a step as long as `scale`; a shorter one changes the states less
        f"reach = minimum(reach, {(order - 2) / (order - 4)!r}*reach)",
        f"length = minimum(truncated(scale*exp(reach)), {farthest!r}*scale)",
        "length = minimum(length, h)",
        "ratio = length/scale",
    ]


def ended() -> list[str]:
    """The end of a step at the place `passed`, where a series has passed a kink."""
    return ["until = select(passed < ratio, passed*scale, length)", "ratio = passed"]


LATE = 1e-10
"""How late a body may be set free, as a part of the way that its load goes in a step, if slip begins without a jump."""

SOONEST = "nearest = 1e-13*maximum(t, 1.0)/scale"
"""How soon a step may end at a contact."""


def jumps(equations: Equations) -> bool:
    """True if slip of some contact begins with a jump of acceleration."""
    return any(node.contact is not None and node.contact.jumps for node in equations.nodes)


def loose(exact: bool) -> str:
    """The tolerance of loads.

    One that is wrong by some part sets a body free too early or late, with less than the power 3/2 of it as velocity, unless
    friction falls at once.
    """
    return "loose = rtol" if exact else "loose = math.sqrt(rtol*math.sqrt(rtol))"


def closed(
    stuck: str, exact: bool, sizes: Sequence[str], places: Sequence[str], stride: str, room: str, order: int
) -> list[str]:
    """The statements that end a step where one of the two gaps of a contact closes, whose coefficients stand in memory."""
    late = "0.0*t" if exact else f"{LATE!r}*{stuck}"
    return [
        f"passed = closing({side}, {late}, {size}, nearest, dense, {first}, {stride}, {room}, {order}, passed)"
        for side, size, first in zip(("1.0 + 0.0*t", stuck), sizes, places, strict=True)
    ]


def ending(ends: bool, contacts: bool) -> list[str]:
    """The functions that find the ends of steps."""
    return [text for text, needed in ((PASSAGE, ends), (CLOSING, contacts)) if needed]


def returned(ends: bool) -> str:
    """What a step returns; one that ends where a series passes zero goes `until` there."""
    return f"return {'until' if ends else 'length'}, length + 0.0*total  # NaN where any coefficient is infinite or NaN"


def lane(value: Expression) -> str:
    """The text of a value that is stored: numbers become lanes."""
    if isinstance(value, Number):
        return f"broadcast({show(value)}, WIDTH)"
    return show(value)


def largest(values: Iterable[Expression]) -> Expression:
    """The largest of some values."""
    return extreme("maximum", list(values))


def extreme(function: str, values: Sequence[Expression]) -> Expression:
    """Nested calls of a function of two values."""
    if len(values) == 1:
        return values[0]
    half = len(values) // 2
    return Call(function, (extreme(function, values[:half]), extreme(function, values[half:])))


def called(name: str, taken: set[str]) -> str:
    """What a symbol is called within the step: as it is, unless the step needs that name itself."""
    if name not in WORDS and not name.startswith(PREFIXES) and not COUNTED.match(name):
        return name
    name = f"user_{name}"
    while name in taken:
        name += "_"
    return name


def _unlike(name: str, taken: set[str], order: int) -> str:
    """The name of a series of which no coefficient is called like a symbol."""
    while any(f"{name}_{k}" in taken for k in range(order + 1)):
        name += "_"
    return name
