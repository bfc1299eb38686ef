"""Write the stages of one step: the part that writers of written-out steps and of looped steps share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

from ..integrators import Integrator
from ..program.expressions import ZERO, Expression, Load, Name, Negation, Number, ProductExpr, Value, call, linear
from ..program.lowering import lower
from ..program.passes import StraightLine, real
from ..program.statements import Assign, Comment, Function, Return, Role, Statement, let, operations
from .blocks import NodeBlocks, assigned

# Largest number of operations of a function that is inlined into each stage; copies of longer ones compile slowly.
LARGEST_INLINED = 400
NOW = {TIME: real("now")}  # replaces the time in expressions of links by `now`, the time of a stage

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
    """Return the text of the function that divides the errors of a method by the tolerance."""
    return SCALED if len(method.e) == 1 else PAIR


def function_name(name: str, kind: int) -> str:
    """Return the name of a function for one kind of node, such as node, node2, node2_linear."""
    return name if kind == 0 else name.replace("node", f"node{kind + 1}", 1)


def node_function(
    name: str, about: str, body: StraightLine, arguments: Sequence[str], results: Sequence[sp.Expr]
) -> Function:
    """Write a function on lanes that computes a straight line and returns the results."""
    return function_of(name, arguments, about, [*assigned(body), Return(tuple(map(lower, results)))])


def function_of(name: str, arguments: Sequence[str], about: str, body: Sequence[Statement]) -> Function:
    """Write a function on lanes that stages call; inline the function if it is short."""
    role = Role.INLINED if operations(body) <= LARGEST_INLINED else Role.CALLED
    return Function(name, tuple(arguments), about, tuple(body), role)


def lane(e: Expression, width: str = "WIDTH") -> Expression:
    """Broadcast a number to a register; return any other expression unchanged, as it is a register."""
    return call("broadcast", e, width) if isinstance(e, Number) else e


def prefix(vector: str) -> str:
    """Return the prefix of the names of states in a vector; "" for `y`, the state at the start of the step."""
    return "" if vector == "y" else f"{vector}_"


def entry(r: sp.Symbol, c: sp.Symbol) -> str:
    """Return the name of d(rhs of r)/dc: j_vx for one-letter names, j_speed_by_place for longer ones."""
    return f"j_{r.name}{c.name}" if len(r.name) == len(c.name) == 1 else f"j_{r.name}_by_{c.name}"


def linearised(state: Sequence[sp.Symbol]) -> list[str]:
    """Return the names of a node's rates, Jacobian entries row by row, and time derivatives."""
    entries = (entry(r, c) for r in state for c in state)
    return [*(f"f_{r.name}" for r in state), *entries, *(f"ft_{r.name}" for r in state)]


class StepWriter(ABC):
    """Collect the statements of one step of `method`; `kinds` holds the NodeBlocks of each kind of node."""

    # `write` is the same for every network. Subclasses choose where states are stored: `UnrolledStep` in registers,
    # node by node; `LoopedStep` in memory, with loops over nodes and links. A Rosenbrock method solves (shift M - J)
    # k_i = M (f(y + sum a_ij k_j) + rate sum c_ij k_j) + d_i h f_t: Hairer & Wanner, Solving Ordinary Differential
    # Equations II (Springer, 1996), section IV.7.

    def __init__(self, equations: Equations, kinds: Sequence[NodeBlocks], method: Integrator) -> None:
        self.equations, self.kinds, self.method = equations, tuple(kinds), method
        self.state = equations.state
        self.statements: list[Statement] = []
        self.functions: list[Function] = []
        # symbols with a value for each node: states, parameters that differ between nodes, variables of node functions
        bodies = (body for blocks in kinds for body in (blocks.rhs, blocks.linear))
        self.inner = {s for body in bodies for s, _ in body.statements}
        self.states = list(dict.fromkeys(s for node in equations.nodes for s in node.state))
        self.of_nodes = {*self.states, *map(real, equations.varied), *self.inner}

    def put(self, *statements: Statement) -> None:
        self.statements += statements

    def let(self, name: str, value: Value) -> None:
        self.statements.append(let(name, value))

    def note(self, text: str) -> None:
        self.statements.append(Comment(text))

    @contextmanager
    def apart(self) -> Iterator[list[Statement]]:
        """Collect the statements written inside the `with` in a separate list, for an inner block or a function."""
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
        """Write the step; `after` may append statements after each stage."""
        self.opening()
        if self.method.implicit:
            gamma = self.method.gamma  # the stages solve (shift - J) k = …; reach = 1/shift, rate = 1/h
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
        """Write one stage: compute its state, its right-hand side and its rates."""
        c, first = self.method.c, int(self.method.implicit)
        self.note(f"stage {i + 1}")
        if i > 0:
            self.advance(i)
        # `linearise` has computed the right-hand side of the first stage of a Rosenbrock method
        if i >= first:
            # consecutive stages at the same time share the time terms
            if i == first or c[i] != c[i - 1]:
                self.let("now", linear((c[i],), ["h"], "t"))
                self.timed("now", self.wanted([blocks.rhs for blocks in self.kinds]))
            out = "f" if self.method.implicit else f"k{i + 1}"
            self.slopes("u" if i > 0 else "y", out)
        self.solve(i)

    @abstractmethod
    def opening(self) -> None:
        """Load the state and the parameters."""

    @abstractmethod
    def linearise(self) -> None:
        """Compute right-hand side and Jacobian at the start of the step, and factorise shift*M - J."""

    @abstractmethod
    def advance(self, i: int) -> None:
        """Compute the state of stage i > 0."""

    @abstractmethod
    def slopes(self, base: str, out: str) -> None:
        """Compute the right-hand side at the states in vector `base` into vector `out`."""

    @abstractmethod
    def solve(self, i: int) -> None:
        """Turn the right-hand side of stage i into its rates."""

    @abstractmethod
    def finish(self) -> None:
        """Compute the new state, the error and the dense output."""

    # -- one state variable -----------------------------------------------------------------------------------

    def increment(self, row: Sequence[float], values: Sequence[str]) -> Expression:
        """Return sum row_j k_j; times h for explicit methods, whose k_j are rates (those of Rosenbrock: increments)."""
        total = linear(row, values)
        return total if self.method.implicit else ProductExpr((Name("h"), total))

    def dense_value(self, row: Sequence[float], values: Sequence[str]) -> Expression:
        """Return a coefficient of the dense output, as a register even if the coefficient is the number zero."""
        value = lane(linear(row, values))
        return value if self.method.implicit else ProductExpr((Name("h"), value))

    def embedded(self, values: Sequence[str]) -> list[Statement]:
        """Compute the second error estimate too, if the method has two (DOP853)."""
        rows = self.method.e if len(self.method.e) > 1 else ()
        return [let(name, linear(row, values)) for name, row in zip(("e5", "e3"), rows, strict=False)]

    def scaled_error(self, error: Value, old: Value, new: Value, period: float | None) -> Expression:
        """Return the error divided by the tolerance; the size of an angle is at most its `period`."""
        estimates = ("scaled", error) if len(self.method.e) == 1 else ("pair", "e5", "e3", "h")
        if period is not None:
            old, new = (call("minimum", call("absolute", state), period) for state in (old, new))
        return call(*estimates, old, new, "rtol", "atol")

    def stiff_error(self, error: Value, last: Expression, share: Expression) -> Expression:
        """Return the larger of the error and of the estimated error of the dense output in stiff components."""
        # This estimate is dense_error (1 - 2 share) |last|; `last` is the last row of the dense output, and `share` is
        # shift/pivot: 1 if the state is not stiff (no estimate), near 0 if the state is stiff.
        stiff = self.method.dense_error * (Number(1.0) - 2.0 * share) * call("absolute", last)
        return call("maximum", call("absolute", error), stiff)

    def time_slope(self, i: int, slope: Expression) -> list[Expression]:
        """Return the term d_i h f_t of stage i of a Rosenbrock method, sign folded; an empty list for zero."""
        weight = self.method.d[i]
        if weight == 0.0 or slope == ZERO:
            return []
        if isinstance(slope, Negation):
            weight, slope = -weight, slope.value
        term = ProductExpr((Number(abs(weight)), Name("h"), slope))
        return [Negation(term) if weight < 0 else term]

    # -- nodes and time ---------------------------------------------------------------------------------------

    def is_plain(self, e: sp.Expr) -> bool:
        """Return True for a result that needs no function: a number, a parameter term, or a single state."""
        return (e.is_Symbol and e not in self.inner) or not e.free_symbols & self.of_nodes

    def arguments(self, body: StraightLine, results: Sequence[sp.Expr]) -> list[sp.Symbol]:
        """Return the arguments of a node function: states first, then all other symbols sorted by name."""
        used = StraightLine(body.statements, tuple(results)).symbols
        states = [s for s in self.states if s in used]
        return states + sorted(used.difference(states), key=lambda s: s.name)

    def node_call(
        self, function: str, kind: int, body: StraightLine, targets: Sequence[str], at: Mapping[sp.Symbol, sp.Symbol]
    ) -> list[Statement]:
        """Assign a node function's results to `targets`, with arguments renamed by `at`; skip plain results."""
        pairs = [(name, e) for name, e in zip(targets, body.results, strict=True) if not self.is_plain(e)]
        arguments = (at.get(s, s).name for s in self.arguments(body, [e for _, e in pairs]))
        value = call(function_name(function, kind), *arguments)
        return [Assign(tuple(name for name, _ in pairs), value)] if pairs else []

    def wanted(self, bodies: Sequence[StraightLine]) -> set[sp.Symbol]:
        """Return the time terms that occur in the bodies."""
        return {s for blocks in self.kinds for s, _ in blocks.timed} & {s for body in bodies for s in body.symbols}

    def timed(self, time: str, wanted: set[sp.Symbol]) -> None:
        """Compute the time terms `wanted` at the time that the variable `time` holds."""
        for symbol, e in (pair for blocks in self.kinds for pair in blocks.timed):
            if symbol in wanted:
                self.let(symbol.name, lower(e.xreplace({TIME: sp.Symbol(time)})))

    def parameters(self, skipped: Container[str] = ()) -> None:
        """Load the parameters, except those in `skipped`, and compute the terms that contain only parameters."""
        for slot, name in enumerate(self.equations.parameters, start=len(self.state)):
            if name not in skipped:
                self.let(name, Load("p", Number(slot)))
        for blocks in self.kinds:
            body = blocks.linear if self.method.implicit else blocks.rhs
            used = body.symbols.union(*(e.free_symbols for s, e in blocks.timed if s in body.symbols))
            self.put(*(let(symbol.name, lower(e)) for symbol, e in blocks.constants if symbol in used))
