"""One step of an integrator as a program: its stages, whatever holds the state, registers or memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

from ..integrators import Integrator
from ..program.expressions import ZERO, Expression, Load, Name, Negation, Number, Product, Value, call, linear
from ..program.lowering import lower
from ..program.passes import StraightLine, real
from ..program.statements import Assign, Comment, Function, Return, Role, Statement, let, operations
from .blocks import NodeBlocks

LARGEST_INLINED = 400
"""Operations of a function up to which its body stands in each stage; copies of longer ones take long to compile."""

NOW = {TIME: real("now")}
"""What the time of a stage is called in the expressions of links."""

SCALED = '''
@njit(error_model="numpy", forceinline=True)
def scaled(error, old, new, rtol, atol):
    """The error estimate of one state variable in units of its tolerance."""
    return absolute(error)/(atol + rtol*maximum(absolute(old), absolute(new)))
'''.strip()

PAIR = '''
@njit(error_model="numpy", forceinline=True)
def pair(e5, e3, h, old, new, rtol, atol):
    """One error estimate out of two embedded ones, in units of the tolerance, so that no square of tiny errors is lost."""
    unit = 1.0/(atol + rtol*maximum(absolute(old), absolute(new)))
    a, b = e5*unit, e3*unit
    return h*(a*a)/sqrt(a*a + 0.01*(b*b) + 2.2250738585072014e-308)
'''.strip()


def scaling(method: Integrator) -> str:
    """The text of the function that measures errors of a method by the tolerance."""
    return SCALED if len(method.e) == 1 else PAIR


def function_name(name: str, kind: int) -> str:
    """The name of a node function for nodes of some kind: node, node2, node2_linear."""
    return name if kind == 0 else name.replace("node", f"node{kind + 1}", 1)


def node_function(
    name: str, about: str, body: StraightLine, arguments: Sequence[str], results: Sequence[sp.Expr]
) -> Function:
    """A small inlined function of lanes: statements first, results last."""
    statements = [let(s.name, lower(e)) for s, e in body.statements]
    return function_of(name, arguments, about, [*statements, Return(tuple(map(lower, results)))])


def function_of(name: str, arguments: Sequence[str], about: str, body: Sequence[Statement]) -> Function:
    """A function of lanes that the stages of a step call; each of them takes over the body of a small one."""
    role = Role.INLINED if operations(body) <= LARGEST_INLINED else Role.CALLED
    return Function(name, tuple(arguments), about, tuple(body), role)


def lane(e: Expression, width: str = "WIDTH") -> Expression:
    """The same value as a register: numbers are spread over its lanes."""
    return call("broadcast", e, width) if isinstance(e, Number) else e


def prefix(vector: str) -> str:
    """What stands before the name of a state in a vector; nothing at the start of the step."""
    return "" if vector == "y" else f"{vector}_"


def entry(r: sp.Symbol, c: sp.Symbol) -> str:
    """The name of d(rhs of r)/dc: j_vx, and j_speed_by_place where letters run together."""
    return f"j_{r.name}{c.name}" if len(r.name) == len(c.name) == 1 else f"j_{r.name}_by_{c.name}"


def linearised(state: Sequence[sp.Symbol]) -> list[str]:
    """The names of rates, of the entries of their Jacobian row by row, and of their time derivatives."""
    entries = (entry(r, c) for r in state for c in state)
    return [*(f"f_{r.name}" for r in state), *entries, *(f"ft_{r.name}" for r in state)]


class StepWriter(ABC):
    """Writes one step of `method` for `equations`, whose kinds of nodes were analysed into `kinds`.

    The stages are the same for every network.  `Unrolled` keeps each state in a register and writes every node out,
    `Looped` keeps them in memory and runs over nodes and links.
    """

    def __init__(self, equations: Equations, kinds: Sequence[NodeBlocks], method: Integrator) -> None:
        self.equations, self.kinds, self.method = equations, tuple(kinds), method
        self.state = equations.state
        self.statements: list[Statement] = []
        self.functions: list[Function] = []

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def let(self, name: str, value: Value) -> None:
        """Append the statement that gives a variable its value."""
        self.statements.append(let(name, value))

    def note(self, text: str) -> None:
        """Append a comment."""
        self.statements.append(Comment(text))

    @contextmanager
    def apart(self) -> Iterator[list[Statement]]:
        """Collect what is appended meanwhile, for a block or a function of its own."""
        outside, self.statements = self.statements, []
        try:
            yield self.statements
        finally:
            self.statements = outside

    @property
    def solves(self) -> bool:
        """True if the step solves linear equations."""
        return self.method.implicit or self.equations.inertial

    # -- the method -------------------------------------------------------------------------------------------

    def write(self, after: Callable[[int], None] | None = None) -> None:
        """Write the step; `after` may write more after each stage."""
        self.opening()
        if self.method.implicit:
            gamma = self.method.gamma  # (shift - J) k = …; reach = 1/shift, rate = 1/h
            self.let("reach", Name("h") * gamma)
            self.let("shift", 1.0 / Name("reach"))
            self.let("rate", Name("shift") * gamma)
            self.linearise()
        for i in range(self.method.stages):
            self.stage(i)
            if after is not None:
                after(i)
        self.finish()

    def stage(self, i: int) -> None:
        """Write one stage: state, right-hand side, and what the method makes of it."""
        self.note(f"stage {i + 1}")
        if i > 0:
            self.advance(i)
        if i > 0 or not self.method.implicit:
            self.stage_time(i)
            out = "f" if self.method.implicit else f"k{i + 1}"
            self.slopes("u" if i > 0 else "y", out)
        self.solve(i)

    @abstractmethod
    def opening(self) -> None:
        """Load what the step needs."""

    @abstractmethod
    def linearise(self) -> None:
        """Compute slopes and Jacobian at the start, and factorise."""

    @abstractmethod
    def advance(self, i: int) -> None:
        """Compute the state of stage i > 0."""

    @abstractmethod
    def slopes(self, base: str, out: str) -> None:
        """Compute the right-hand side at one vector of states into another."""

    @abstractmethod
    def solve(self, i: int) -> None:
        """Turn the slopes of stage i into its rates."""

    @abstractmethod
    def finish(self) -> None:
        """Compute the new state, the error and the dense output."""

    # -- nodes and time ---------------------------------------------------------------------------------------

    def increment(self, row: Sequence[float], values: Sequence[str]) -> Expression:
        """What a row of coefficients adds to the state at the start: stages of explicit methods are rates."""
        total = linear(row, values)
        return total if self.method.implicit else Product((Name("h"), total))

    def embedded(self, values: Sequence[str]) -> list[Statement]:
        """The two estimates of the error of a state, if there are two."""
        rows = self.method.e if len(self.method.e) > 1 else ()
        return [let(name, linear(row, values)) for name, row in zip(("e5", "e3"), rows, strict=False)]

    def scaled_error(self, error: Value, old: Value, new: Value, period: float | None) -> Expression:
        """The error of a state in units of its tolerance: the one estimate, or the two of `embedded` as one.

        An angle with a `period` is as large as itself or the period, whichever is smaller.
        """
        own = ("scaled", error) if len(self.method.e) == 1 else ("pair", "e5", "e3", "h")
        if period is not None:
            old, new = (call("minimum", call("absolute", state), period) for state in (old, new))
        return call(*own, old, new, "rtol", "atol")

    def dense_value(self, row: Sequence[float], values: Sequence[str]) -> Expression:
        """What a row of the dense output holds of a state: stages of explicit methods are rates."""
        value = lane(linear(row, values))
        return value if self.method.implicit else Product((Name("h"), value))

    def time_slope(self, i: int, slope: Expression) -> list[Expression]:
        """What a time slope adds to stage i of an implicit method."""
        weight = self.method.d[i]
        if weight == 0.0 or slope == ZERO:
            return []
        if isinstance(slope, Negation):
            weight, slope = -weight, slope.value
        term = Product((Number(abs(weight)), Name("h"), slope))
        return [Negation(term) if weight < 0 else term]

    def stiff_error(self, error: Value, last: Expression, share: Expression) -> Expression:
        """The error of a state, at least that of its dense output times 1 - 2 share: the share that is not stiff.

        `last` is the last row of the dense output, `share` the shift over the pivot: one where the state is not stiff.
        """
        stiff = self.method.dense_error * (Number(1.0) - 2.0 * share) * call("absolute", last)
        return call("maximum", call("absolute", error), stiff)

    def first_of(self, blocks: NodeBlocks) -> StraightLine:
        """What is evaluated of a node of some kind at the start of a step."""
        return blocks.linear if self.method.implicit else blocks.rhs

    def is_plain(self, e: sp.Expr) -> bool:
        """True where a result needs no function: a number, a parameter term, or one bare state symbol."""
        own = {s for node in self.equations.nodes for s in node.state}
        inner = own | self.inner | self.varied
        return (e.is_Symbol and e not in self.inner) or not e.free_symbols & inner

    @property
    def inner(self) -> set[sp.Symbol]:
        """Symbols defined inside the node functions."""
        bodies = (body for blocks in self.kinds for body in (blocks.rhs, blocks.linear))
        return {s for body in bodies for s, _ in body.statements}

    @property
    def varied(self) -> set[sp.Symbol]:
        """The parameters of the template that have a value for each node."""
        return {real(name) for name in self.equations.varied}

    def arguments(self, body: StraightLine, results: Sequence[sp.Expr]) -> list[sp.Symbol]:
        """What a node function must be given: state first, then the rest by name."""
        used = StraightLine(body.statements, tuple(results)).symbols
        states = dict.fromkeys(s for node in self.equations.nodes for s in node.state)
        own = [s for s in states if s in used]
        return own + sorted((s for s in used if s not in own), key=lambda s: s.name)

    def timed(self, time: str, wanted: set[sp.Symbol]) -> None:
        """Statements for the time terms in use, at the time of that name."""
        for symbol, e in (pair for blocks in self.kinds for pair in blocks.timed):
            if symbol in wanted:
                self.let(symbol.name, lower(e.xreplace({TIME: sp.Symbol(time)})))

    def stage_time(self, i: int) -> None:
        """The time of stage i and the time terms of the right-hand side, unless the stage before had the same time."""
        c, first = self.method.c, int(self.method.implicit)
        if i == first or c[i] != c[i - 1]:
            self.let("now", linear((c[i],), ["h"], "t"))
            self.timed("now", self.wanted([blocks.rhs for blocks in self.kinds]))

    def wanted(self, bodies: Sequence[StraightLine]) -> set[sp.Symbol]:
        """Time terms that some bodies use."""
        return {s for blocks in self.kinds for s, _ in blocks.timed} & {s for body in bodies for s in body.symbols}

    def parameters(self, but: Container[str] = ()) -> None:
        """Load the parameters, `but` some, and compute what depends on them alone."""
        for slot, name in enumerate(self.equations.parameters):
            if name not in but:
                self.let(name, Load("p", Number(len(self.state) + slot)))
        for blocks in self.kinds:
            used = self.first_of(blocks).symbols
            wanted = used.union(*(e.free_symbols for s, e in blocks.timed if s in used))
            self.put(*(let(symbol.name, lower(e)) for symbol, e in blocks.constants if symbol in wanted))

    def node_call(
        self, function: str, kind: int, body: StraightLine, found: Sequence[str], at: Mapping[sp.Symbol, sp.Symbol]
    ) -> list[Statement]:
        """The call of a node function at some names of its arguments; plain results among those `found` need none."""
        pairs = [(name, e) for name, e in zip(found, body.results, strict=True) if not self.is_plain(e)]
        given = (at.get(s, s).name for s in self.arguments(body, [e for _, e in pairs]))
        value = call(function_name(function, kind), *given)
        return [Assign(tuple(name for name, _ in pairs), value)] if pairs else []
