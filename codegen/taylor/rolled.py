"""Write a Taylor step of one large node as loops over series of the same kind; a table lists where each is stored.

A step that is written out has a statement for each coefficient of each series.  With a hundred series or more, such a
step takes some ten seconds to compile.  Here a series gets a rank: one more than the ranks of the series whose
coefficient of the same order it needs.  Series of one rank and kind (a `Run`) share one loop around one recurrence.
All coefficients are in memory, and the array `where` lists their groups, so that the text grows only with the number of
ranks.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from itertools import accumulate

import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.jumps import JUMPING, KINKED

from ..program.expressions import ZERO, Expression, Load, Name, Number, call, plus
from ..program.statements import Assign, Do, Loop, Statement, Store, let, mentioned, whole
from ..steps.places import NodeKindLayout, span
from ..steps.step import lane
from .looped_series import CONVOLUTION, START, Hoisted, LoopedSeries, Outer, SeriesLoop, Slot
from .passable import check_passable
from .series import Constant, Exponential, Kink, Linear, Product, Series, Square
from .series_graph import SeriesGraph
from .simplify import absolute
from .step_length import unseen
from .taylor_step import TaylorStep

LARGE = 200
"""Least number of operations in a node's rates for a rolled step; a choice between two values counts as CHOICE."""

CHOICE = 10

PLAIN, APART = "@njit(error_model='numpy')", "@njit(error_model='numpy', separate=True)"
"""Decorators of functions: PLAIN allows LLVM to inline the function into each loop that calls it; APART forbids it."""

SUMS = """
@njit(error_model='numpy', separate=True)
def products(dense, where, states, first, count, k):
    \"\"\"Coefficients k of products: each row of three entries has the places of the product and of its factors.\"\"\"
    for row in range(first, first + 3*count, 3):
        total = convolution(dense, states + where[row + 1], states + where[row + 2], k, 0, k + 1)
        store(dense, states + where[row] + k, total)


@njit(error_model='numpy', separate=True)
def sums(dense, where, states, places, ends, terms, count, k):
    \"\"\"Coefficients k of sums: terms ends[row] to ends[row + 1] are of a row, each the places of a factor and a series.\"\"\"
    for row in range(count):
        total = broadcast(0.0, WIDTH)
        begin, end = where[ends + row], where[ends + row + 1]
        for term in range(terms + 2*begin, terms + 2*end, 2):
            factor = load(dense, states + where[term], WIDTH)
            total = total + factor*load(dense, states + where[term + 1] + k, WIDTH)
        store(dense, states + where[places + row] + k, total)
""".strip()

SIZES = """
@njit(error_model='numpy', separate=True)
def sizes(dense, where, states, places, ends, terms, count):
    \"\"\"How large the terms are with which sums begin; rows and terms are those of `sums`.\"\"\"
    for row in range(count):
        total = broadcast(0.0, WIDTH)
        begin, end = where[ends + row], where[ends + row + 1]
        for term in range(terms + 2*begin, terms + 2*end, 2):
            factor = load(dense, states + where[term], WIDTH)
            total = total + absolute(factor*load(dense, states + where[term + 1], WIDTH))
        store(dense, states + where[places + row], total)
""".strip()

MEMORY = (Name("dense"), Name("where"), Name("at_states"))
"""The workspace, the table `where`, and the group to which the entries of the table are relative."""

ROW = "at_row"
"""The loop variable; no symbol of a model begins with this prefix."""

COMPUTED = ("name", "inverse", "beyond")
"""Fields of a series that are set while its recurrence is written; members of a run may differ in them."""

Entry = tuple[str, int]
"""A group of the workspace: the name of a part, and the offset of the group from the beginning of the part."""


@dataclass(eq=False)
class Run:
    """Series of one rank and kind, which one loop computes; the series `model` stands for each member in the loop.

    columns: by name, the groups of the members and of the series that they read. saved: names of the values that the
    model computes once in a step.
    """

    members: list[Series]
    model: Series
    columns: dict[str, list[Entry]]
    saved: dict[str, None] = field(default_factory=dict)


@dataclass(eq=False)
class RolledSection(SeriesLoop):
    """The series of one node, grouped into runs.

    components: the index of each state's series. table: the content of `where`. entered: the position in `table` of
    each sequence of entries. factors: the number of each factor in sums.
    """

    components: dict[Series, int] = field(default_factory=dict)
    table: list[int | Entry] = field(default_factory=list)
    entered: dict[tuple[int | Entry, ...], int] = field(default_factory=dict)
    factors: dict[Expression, int] = field(default_factory=dict)
    current: Run | None = None

    @cached_property
    def in_memory(self) -> set[Series]:
        return set(self.graph.series)  # loops read all operands from memory

    @cached_property
    def runs(self) -> list[Run]:
        """Return the runs, sorted by rank, so that each run follows the runs whose coefficients it needs."""
        rank: dict[Series, int] = {}
        groups = defaultdict[tuple[object, ...], list[Series]](list)
        for s in self.graph.series:
            rank[s] = 1 + max((rank.get(other, 0) for other in _operands(s)), default=0)
            groups[rank[s], *_common(s)].append(s)
        return [self.run_of(groups[key]) for key in sorted(groups, key=lambda key: int(str(key[0])))]

    def run_of(self, members: list[Series]) -> Run:
        """Return the run of these members; in `model`, each operand is a column of the table."""
        model = copy(members[0])
        model.name = self.graph.fresh(type(model).__name__.lower())
        columns = {"out": [(s.name, 0) for s in members]}
        for part in () if isinstance(model, Linear | Product | Square) else fields(model):
            if _moves(getattr(model, part.name)):
                name = f"{model.name}_{part.name}"
                columns[part.name] = [self.entry_of(getattr(s, part.name)) for s in members]
                setattr(model, part.name, Outer(Slot(name, None), name=f"value_{name}"))
        if isinstance(model, Kink):
            # the size of the terms of coefficient 0; a single term has the size of the value itself
            bases = [kink.base for kink in members if isinstance(kink, Kink)]
            columns["size"] = [(f"size_{s.name}", 0) if isinstance(s, Linear) else self.entry_of(s) for s in bases]
        return Run(members, model, columns)

    # -- memory ---------------------------------------------------------------------------------------------------

    def entry_of(self, series: Series) -> Entry:
        """Return the group that stores coefficient 0 of a series."""
        if series in self.components:
            return "states", self.components[series] * (self.order + 1)
        return (series.slot.name if isinstance(series, Outer) else series.name), 0

    def factor(self, e: Expression) -> Entry:
        """Return the group that stores a factor of terms in sums."""
        return "factors", self.factors.setdefault(e, len(self.factors))

    def slot(self, series: Series) -> Slot:
        if self.current is not None and series is self.current.model:
            return Slot(f"{series.name}_out", None)
        return super().slot(series)

    def single(self, name: str) -> Expression:
        return plus(Name(f"at_{name}"), Name(ROW))

    def save(self, name: str, value: Expression) -> Name:
        if self.current is not None:
            self.current.saved[name] = None
        return super().save(name, value)

    def room(self) -> dict[str, int]:
        rooms = {s.name: self.order + 1 for s in self.graph.series}
        for run in self.runs:
            hints = [f"hint_{run.model.base.name}"] if isinstance(run.model, Kink) else []
            rooms |= dict.fromkeys([*run.saved, *hints], len(run.members))
        rooms |= {f"size_{s.name}": 1 for s in self.graph.series if isinstance(s, Linear)} if self.graph.kinks else {}
        return rooms | {"factors": len(self.factors), "one": 1}

    # -- loops ----------------------------------------------------------------------------------------------------

    def rows(self, name: str, columns: dict[str, list[Entry]], body: Iterable[Statement]) -> list[Statement]:
        """Return a loop over the rows of columns; each turn loads the group of a column as at_<name>_<column>."""
        table, width = list(zip(*columns.values(), strict=True)), len(columns)
        first = self.enter([entry for row in table for entry in row])
        groups = [
            whole(f"at_{name}_{column}", Name("at_states") + Load("where", first + k + width * Name(ROW), None))
            for k, column in enumerate(columns)
        ]
        return [Loop(ROW, START, Number(len(table)), (*groups, *body))] if table else []

    def enter(self, entries: Sequence[int | Entry]) -> int:
        """Append entries to the table, unless it contains the same sequence; return where the sequence begins."""
        if (key := tuple(entries)) not in self.entered:
            self.entered[key] = len(self.table)
            self.table += entries
        return self.entered[key]

    def over_run(self, run: Run, body: Iterable[Statement]) -> list[Statement]:
        """Return a loop over the members of a run."""
        return self.rows(run.model.name, run.columns, body)

    def over(self, series: Sequence[Series], name: str, body: Callable[[Series], list[Statement]]) -> list[Statement]:
        """Return a loop over some series; each turn reads one of them."""
        statements = body(Outer(Slot(f"{name}_read", None), name=f"value_{name}")) if series else []
        return self.rows(name, {"read": [self.entry_of(s) for s in series]}, statements) if statements else []

    def over_kinks(self, body: Callable[[Kink], Iterable[Statement]]) -> list[Statement]:
        """Return loops over all kinks."""
        kinks = [(run, run.model) for run in self.runs if isinstance(run.model, Kink)]
        return [statement for run, kink in kinks for statement in self.over_run(run, body(kink))]

    def in_loop(self, statements: list[Statement]) -> list[Statement]:
        return statements

    # -- coefficients ---------------------------------------------------------------------------------------------

    def coefficients(self, order: Expression) -> list[Statement]:
        self.k, statements = order, list[Statement]()
        for run in self.runs:
            self.current = run
            match run.model:
                case Linear():
                    statements += self.sums_of(run)
                case Product() | Square():
                    # each row: a product and its two factors; for a square, the base twice
                    rows = [
                        (out, *([self.entry_of(e) for e in s.convolved] * (2 // len(s.convolved))))
                        for s, out in zip(run.members, run.columns["out"], strict=True)
                    ]
                    first = self.enter([entry for row in rows for entry in row])
                    products = call("products", *MEMORY, Number(first), Number(len(run.members)), self.k)
                    statements.append(Do(products))
                case _:
                    statements += self.recurrence(run)
        self.current = None
        # the rates: copy series, and store constants
        moving = {k: e for k, (_, e) in enumerate(self.rates) if not isinstance(e, Constant)}
        columns = {"from": [self.entry_of(e) for e in moving.values()], "to": [("rates", k) for k in moving]}
        rate = Slot("rate_from", None).load(self.k)
        statements += self.rows("rate", columns, [Store("dense", Name("at_rate_to"), rate)])
        for state, e in self.rates:
            if isinstance(e, Constant):
                statements.append(Store("dense", plus(Name("at_rates"), state), lane(self.of(e))))
        if order != START:
            return statements
        # store the factors of sums first, and the factor 1 of the constants of sums
        factors = [Store("dense", plus(Name("at_factors"), Number(k)), lane(e)) for e, k in self.factors.items()]
        return [*factors, Store("dense", Name("at_one"), lane(Number(1.0))), *statements]

    def recurrence(self, run: Run) -> list[Statement]:
        """Return the loop that computes the coefficients of a run."""
        model, first = run.model, self.k == START
        self.statements = []
        operands = dict.fromkeys(s for s in (_operands(model) if first else model.linear) if isinstance(s, Outer))
        self.put(*(let(name, self.recall(name)) for name in (() if first else run.saved)))
        self.put(*(let(s.name, s.slot.load(self.k)) for s in operands))
        self.values = {s: Name(s.name) for s in operands}
        if first and isinstance(model, Kink):
            value = model.side(self, absolute(Load("dense", Name(f"at_{model.name}_size"))))
        else:
            value = model.begin(self) if first else model.coefficient(self)
        self.put(self.slot(model).store(self.k, lane(value)))
        return self.over_run(run, self.statements)

    def sums_of(self, run: Run) -> list[Statement]:
        """Return the call that computes sums of terms; the constant of a sum is its last term, at order 0 only."""
        first, terms, ends = self.k == START, list[tuple[Entry, Entry]](), [0]
        for s in run.members:
            assert isinstance(s, Linear)
            terms += [(self.factor(e), self.entry_of(inner)) for e, inner in s.terms]
            terms += [(self.factor(s.constant), ("one", 0))] if first and s.constant != ZERO else []
            ends.append(len(terms))
        rows = [self.enter(run.columns["out"]), self.enter(ends), self.enter([e for pair in terms for e in pair])]
        calls: list[Statement] = [Do(call("sums", *MEMORY, *map(Number, rows), Number(len(run.members)), self.k))]
        if first and not {kink.base for kink in self.graph.kinks}.isdisjoint(run.members):
            sizes = self.enter([(f"size_{s.name}", 0) for s in run.members])
            calls.append(Do(call("sizes", *MEMORY, Number(sizes), *map(Number, rows[1:]), Number(len(run.members)))))
        return calls

    # -- end of the step ------------------------------------------------------------------------------------------

    def forget_sides(self) -> list[Statement]:
        return self.over_kinks(lambda kink: [self.assign(f"hint_{kink.base.name}", self.zeros)])

    def find_sides(self) -> list[Statement]:
        return self.over_kinks(lambda kink: [self.find_side(kink)])

    def passages(self, exact: bool) -> list[Statement]:
        return self.over_kinks(self.passage)

    def lengths(self) -> list[Statement]:
        gaps = self.over(self.graph.gaps, "gap", self.counted)
        watch = self.over(self.graph.watched, "watched", lambda s: unseen([self.at(s, k) for k in range(self.order)]))
        return [*gaps, *watch]

    def distances(self) -> list[Statement]:
        models = [(run, run.model) for run in self.runs]
        return [s for run, e in models if isinstance(e, Exponential) for s in self.over_run(run, self.distance(e))]

    def broken(self) -> list[Statement]:
        return self.over(self.graph.positive, "positive", lambda s: self.breaks(s, ""))


class Rolled(LoopedSeries):
    """Write the rolled step of one node without links."""

    functions = (CONVOLUTION.replace(PLAIN, APART), SUMS)
    rolled: RolledSection

    def node(self, kind: NodeKindLayout, hoisted: Hoisted) -> SeriesLoop:
        node = kind.node
        self.rolled = section = RolledSection(SeriesGraph(self.names), self.order)
        self.read_states(section, node.state, node, ("", "0"), node.state)
        section.components = {section.moving[s]: c for c, s in enumerate(node.state) if s in section.moving}
        series = self.read(section, hoisted, node.inertia)
        section.rates = [(Number(c), rate) for c, rate in enumerate(series)]
        self.node_part, self.lent = section, []
        return section

    def opening(self) -> list[Statement]:
        return [*super().opening(), *self.rolled.setting]

    def over_states(self, body: Callable[[Expression], Iterable[Statement]]) -> list[Statement]:
        return [span("i", "DIMENSION").over(body(Name("i")))]

    def sizes_of_states(self) -> list[Statement]:
        members = defaultdict[float | None, list[Entry]](list)
        for c, period in enumerate(self.layout.periods[0]):
            members[period].append(("states", c * (self.order + 1)))
        if len(members) == 1:
            return self.over_states(lambda index: self.size(index, *members))
        # write one loop for angles of each period, and one for all other states
        loops, section = list[Statement](), self.rolled
        for number, (period, entries) in enumerate(members.items()):
            name = f"state{number}"
            series = Outer(Slot(f"{name}_read", None), name=f"value_{name}", period=period)
            loops += section.rows(name, {"read": entries}, section.counted(series))
        return loops

    def statements(self) -> list[Statement]:
        # drop the names of those parts of the workspace that only the table refers to
        statements = super().statements()
        used = mentioned(s for s in statements if not _part_named_by(s))
        return [s for s in statements if not _part_named_by(s) or _part_named_by(s) in used]

    def step(self, *more: str) -> TaylorStep:
        written = super().step(*more)
        # forbid inlining: LLVM takes a minute to compile dozens of inlined copies of `passage`
        called = [text.replace(f"{PLAIN}\ndef passage", f"{APART}\ndef passage") for text in written.called]
        called += [SIZES] if self.rolled.graph.kinks else []
        begin = dict(zip(self.room(), accumulate(self.room().values(), initial=0), strict=False))
        table = tuple(e if isinstance(e, int) else begin[e[0]] + e[1] for e in self.rolled.table)
        return replace(written, called=tuple(called), table=table)


def _part_named_by(s: Statement) -> str:
    """Return the name that a statement gives to a part of the workspace; "" for any other statement."""
    return s.targets[0] if isinstance(s, Assign) and s.whole and s.targets[0].startswith("at_") else ""


def _moves(part: object) -> bool:
    """Return True if a field of a series is itself a series with stored coefficients, not a constant."""
    return isinstance(part, Series) and not isinstance(part, Constant)


def _operands(series: Series) -> list[Series]:
    """Return the series whose coefficients the recurrence of `series` reads."""
    if isinstance(series, Linear):
        return [inner for _, inner in series.terms]
    return [getattr(series, part.name) for part in fields(series) if _moves(getattr(series, part.name))]


def _common(series: Series) -> tuple[object, ...]:
    """Return the key of a run: the kind of the series, and all fields that are no series with coefficients."""
    if isinstance(series, Linear):
        return (Linear,)
    if isinstance(series, Product | Square):
        return (Product,)
    parts = [getattr(series, part.name) for part in fields(series) if part.name not in COMPUTED]
    return (type(series), *(e.value if isinstance(e, Constant) else e for e in parts if not _moves(e)))


@lru_cache(maxsize=64)
def is_large(equations: Equations) -> bool:
    """Return True for a single node without links whose written-out step would take long to compile."""
    if equations.n > 1 or equations.link_count or equations.sticks or equations.varied:
        return False
    rates = equations.nodes[0].rhs
    choices = (part for e in rates for part in e.atoms(*KINKED, Piecewise))
    size = sum(int(sp.count_ops(e)) for e in rates) + CHOICE * sum(max(len(part.args) - 1, 1) for part in choices)
    return size > LARGE and not any(e.has(*JUMPING) for e in rates)


def write_rolled(equations: Equations, order: int) -> TaylorStep:
    """Return the Taylor step of this order for equations for which `is_large` is True; see `write_step`."""
    check_passable(equations)
    return Rolled(equations, order).step("graph", "weights")
