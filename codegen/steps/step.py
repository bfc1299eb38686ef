"""The text of one integration step, unrolled over the nodes of a small network."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

from ..integrators import Integrator
from ..program.expressions import Expression, Load, Name, Number, Product, Value, call, linear, plus
from ..program.lowering import lower
from ..program.passes import Body
from ..program.statements import Assign, Comment, Function, If, Return, Statement, let, store
from .blocks import NodeBlocks
from .mass import Mass

__all__ = ["PAIR", "SCALED", "StepWriter", "function_name", "lane", "node_function"]

PAIR = '''
@njit(error_model="numpy", forceinline=True)
def pair(e5, e3, h):
    """One error estimate out of two embedded ones."""
    return h*e5*absolute(e5)/sqrt(e5*e5 + 0.01*(e3*e3) + 2.2250738585072014e-308)
'''.strip()

SCALED = '''
@njit(error_model="numpy", forceinline=True)
def scaled(error, old, new, rtol, atol):
    """The error estimate of one state variable in units of its tolerance."""
    return absolute(error)/(atol + rtol*maximum(absolute(old), absolute(new)))
'''.strip()


def function_name(name: str, kind: int) -> str:
    """The name of a node function for nodes of some kind: node, node2, node2_linear."""
    return name if kind == 0 else name.replace("node", f"node{kind + 1}", 1)


def node_function(name: str, about: str, body: Body, arguments: Sequence[str], results: Sequence[sp.Expr]) -> Function:
    """A small inlined function of lanes: statements first, results last."""
    statements = [let(s.name, lower(e)) for s, e in body.statements]
    return Function(name, tuple(arguments), about, (*statements, Return(tuple(map(lower, results)))))


def lane(e: Expression, width: str = "WIDTH") -> Expression:
    """The same value as a register: numbers are spread over its lanes."""
    return call("broadcast", e, width) if isinstance(e, Number) else e


class StepWriter:
    """Writes the statements of one step of `method` for `equations`, whose node was analysed into `blocks`.

    Nodes of further kinds were analysed into `more`.  A `bounded` step returns a bound of the eigenvalues at its start
    beside the error.
    """

    def __init__(
        self,
        equations: Equations,
        blocks: NodeBlocks,
        method: Integrator,
        bounded: bool = False,
        more: Sequence[NodeBlocks] = (),
    ) -> None:
        self.equations, self.blocks, self.method, self.bounded = equations, blocks, method, bounded
        self.kinds = (blocks, *more)
        self.state = equations.state
        self.statements: list[Statement] = []
        self.mass = Mass(equations)

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def let(self, name: str, value: Value) -> None:
        """Append the statement that gives a variable its value."""
        self.statements.append(let(name, value))

    def note(self, text: str) -> None:
        """Append a comment."""
        self.statements.append(Comment(text))

    def stages(self, name: str, count: int) -> list[str]:
        """Names of the first `count` stage values of one state variable."""
        return [f"k{j + 1}_{name}" for j in range(count)]

    def first_of(self, blocks: NodeBlocks) -> Body:
        """What is evaluated of a node of some kind at the start of a step."""
        if self.method.implicit:
            return blocks.linear
        return blocks.local if self.bounded else blocks.rhs

    def of(self, i: int) -> NodeBlocks:
        """The blocks of node i."""
        return self.kinds[self.equations.kind_of[i]]

    # -- pieces of the right-hand side ------------------------------------------------------------------------

    def is_plain(self, e: sp.Expr) -> bool:
        """True where a result needs no function: a number, a parameter term, or one bare state symbol."""
        own = {s for node in self.equations.nodes for s in node.state}
        inner = own | self.inner | self.varied
        return (e.is_Symbol and e not in self.inner) or not e.free_symbols & inner

    @property
    def inner(self) -> set[sp.Symbol]:
        """Symbols defined inside the node functions."""
        bodies = (body for blocks in self.kinds for body in (blocks.rhs, blocks.linear, blocks.local))
        return {s for body in bodies for s, _ in body.statements}

    @property
    def varied(self) -> set[sp.Symbol]:
        """The parameters of the template that have a value for each node."""
        return {sp.Symbol(name, real=True) for name in self.equations.varied}

    def arguments(self, body: Body, results: Sequence[sp.Expr]) -> list[sp.Symbol]:
        """What a node function must be given: state first, then the rest by name."""
        used = Body(body.statements, tuple(results)).symbols
        states = dict.fromkeys(s for node in self.equations.nodes for s in node.state)
        own = [s for s in states if s in used]
        return own + sorted((s for s in used if s not in own), key=lambda s: s.name)

    def at(self, i: int, prefix: str) -> dict[sp.Symbol, sp.Symbol]:
        """The names of the states of node i in a stage, and of the parameters that it has for itself."""
        states = self.equations.node_at(i).state
        found = {s: sp.Symbol(f"{prefix}{s.name}_{i + 1}", real=True) for s in states}
        return {**self.equations.at_node(i), **found}

    def call(self, function: str, body: Body, results: Sequence[sp.Expr], i: int, prefix: str) -> Expression:
        """The call of a node function for node i with the state names of a stage."""
        at, kind = self.at(i, prefix), self.equations.kind_of[i]
        return call(function_name(function, kind), *(at.get(s, s).name for s in self.arguments(body, results)))

    def timed(self, time: str, wanted: set[sp.Symbol]) -> None:
        """Statements for the time terms in use, at the time of that name."""
        for symbol, e in (pair for blocks in self.kinds for pair in blocks.timed):
            if symbol in wanted:
                self.let(symbol.name, lower(e.xreplace({TIME: sp.Symbol(time)})))

    def stage_time(self, i: int, first: int) -> None:
        """The time of stage i and the time terms of the right-hand side, unless the stage before had the same time.

        `first` is the first stage that is evaluated at all.
        """
        c = self.method.c
        if i == first or c[i] != c[i - 1]:
            self.let("now", linear((c[i],), ["h"], "t"))
            self.timed("now", self.wanted([blocks.rhs for blocks in self.kinds]))

    def wanted(self, bodies: Sequence[Body]) -> set[sp.Symbol]:
        """Time terms that some bodies use."""
        return {s for blocks in self.kinds for s, _ in blocks.timed} & {s for body in bodies for s in body.symbols}

    def slopes(self, prefix: str, out: str) -> None:
        """Statements that give the right-hand side at the state `prefix`x_1 … under the names `out`x_1 …"""
        for i in range(self.equations.n):
            body, names = self.of(i).rhs, self.at(i, prefix)
            coded = [e for e in body.results if not self.is_plain(e)]
            targets = [f"{out}{s.name}_{i + 1}" for s in self.equations.node_at(i).state]
            if coded:
                left = [t for t, e in zip(targets, body.results, strict=True) if not self.is_plain(e)]
                self.put(Assign(tuple(left), self.call("node", body, coded, i, prefix)))
            for target, e in zip(targets, body.results, strict=True):
                if self.is_plain(e):
                    self.let(target, lane(lower(e.xreplace(names))))
        self.links(prefix, out)

    def links(self, prefix: str, out: str) -> None:
        """Add what the links contribute to the right-hand side."""
        eq = self.equations
        terms: dict[str, list[sp.Expr]] = {}
        stage = self.staged(prefix)
        for link in eq.links:
            for s, e in zip(eq.node_at(link[0]).state, eq.edge_at(link).rhs, strict=True):
                term = e.xreplace(eq.at_link(link)).xreplace(stage)
                if term != 0:
                    terms.setdefault(f"{out}{s.name}_{link[0] + 1}", []).append(term)
        for target, parts in terms.items():
            self.let(target, plus(Name(target), *map(lower, parts)))

    def staged(self, prefix: str) -> dict[sp.Symbol, sp.Symbol]:
        """The names of all states in a stage."""
        return {sp.Symbol(n, real=True): sp.Symbol(prefix + n, real=True) for n in self.state}

    # -- beginning and end ------------------------------------------------------------------------------------

    def opening(self) -> None:
        """Load the state and the parameters."""
        for slot, name in enumerate(self.state):
            self.let(name, Load("y", Number(slot)))
        self.parameters()

    def parameters(self, but: Container[str] = ()) -> None:
        """Load the parameters, `but` some, and compute what depends on them alone."""
        for slot, name in enumerate(self.equations.parameters):
            if name not in but:
                self.let(name, Load("p", Number(len(self.state) + slot)))
        for blocks in self.kinds:
            used = self.first_of(blocks).symbols
            wanted = used.union(*(e.free_symbols for s, e in blocks.timed if s in used))
            self.put(*(let(symbol.name, lower(e)) for symbol, e in blocks.constants if symbol in wanted))

    def closing(self, errors: Sequence[Expression]) -> None:
        """Store the new state and reduce the error to one number a lane."""
        for slot, (name, e) in enumerate(zip(self.state, errors, strict=True)):
            self.put(store("y_new", slot, f"n_{name}"))
            self.let(f"e_{name}", call("scaled", e, name, f"n_{name}", "rtol", "atol"))
        first, *others = terms = [Name(f"e_{name}") for name in self.state]
        self.let("total", plus(*terms))
        self.let("error", first)
        self.put(*(let("error", call("maximum", "error", term)) for term in others))
        results = (Name("error") + 0.0 * Name("total"), *([Name("bound")] * self.bounded))
        self.put(Return(results, "NaN or infinite where any estimate is"))

    def dense(self, scale: Expression | None = None) -> None:
        """Store the coefficients of the dense output."""
        for j, row in enumerate(self.method.dense):
            for slot, name in enumerate(self.state):
                value = lane(linear(row, self.stages(name, len(row))))
                place = j * len(self.state) + slot
                self.put(store("dense", place, value if scale is None else Product((scale, value))))

    @contextmanager
    def only_if(self, condition: str) -> Iterator[None]:
        """Whatever is written inside the with block runs if a condition holds."""
        before, self.statements = self.statements, []
        yield
        self.statements = [*before, If(Name(condition), tuple(self.statements))]
