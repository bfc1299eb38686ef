"""The text of one integration step, unrolled over the nodes of a small network."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import sympy as sp

from synchain.models.equations import TIME, Equations

from .blocks import Body, NodeBlocks
from .integrators import Integrator
from .printer import show

__all__ = ["PAIR", "SCALED", "StepWriter", "combine", "indent_from", "write_function"]

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


def write_function(name: str, doc: str, body: Body, arguments: Sequence[str], results: Sequence[sp.Expr]) -> list[str]:
    """A small inlined function of lanes: statements first, results last."""
    lines = ["@njit(error_model='numpy', forceinline=True)", f"def {name}({', '.join(arguments)}):", f'    """{doc}"""']
    lines += [f"    {s} = {show(e)}" for s, e in body.statements]
    lines.append(f"    return {', '.join(show(e) for e in results)}")
    return lines


def combine(row: Sequence[float], names: Sequence[str], start: str = "") -> str:
    """start + sum row_j * names_j without zero terms and unit factors; '' where nothing is left."""
    text = start
    for weight, name in zip(row, names, strict=False):
        if weight == 0.0:
            continue
        term = name if abs(weight) == 1.0 else f"{abs(weight)!r}*{name}"
        if not text:
            text = term if weight > 0 else f"-{term}"
        else:
            text += f" + {term}" if weight > 0 else f" - {term}"
    return text


class StepWriter:
    """Writes the statements of one step of `method` for `equations`, whose node was analysed into `blocks`.

    A `bounded` step returns a bound of the eigenvalues at its start beside the error.
    """

    def __init__(self, equations: Equations, blocks: NodeBlocks, method: Integrator, bounded: bool = False) -> None:
        self.equations, self.blocks, self.method, self.bounded = equations, blocks, method, bounded
        self.state = equations.state
        self.lines: list[str] = []
        self.timed_names = {s for s, _ in blocks.timed}

    def put(self, *lines: str) -> None:
        """Append statements."""
        self.lines += lines

    def stages(self, name: str, count: int) -> list[str]:
        """Names of the first `count` stage values of one state variable."""
        return [f"k{j + 1}_{name}" for j in range(count)]

    @property
    def first_body(self) -> Body:
        """What is evaluated of a node at the start of a step."""
        if self.method.kind == "rosenbrock":
            return self.blocks.linear
        return self.blocks.local if self.bounded else self.blocks.rhs

    # -- pieces of the right-hand side ------------------------------------------------------------------------

    def is_plain(self, e: sp.Expr) -> bool:
        """True where a result needs no function: a number, a parameter term, or one bare state symbol."""
        inner = set(self.equations.node.state) | self.inner
        return (e.is_Symbol and e not in self.inner) or not e.free_symbols & inner

    @property
    def inner(self) -> set[sp.Symbol]:
        """Symbols defined inside the node functions."""
        return {s for body in (self.blocks.rhs, self.blocks.linear, self.blocks.local) for s, _ in body.statements}

    def arguments(self, body: Body, results: Sequence[sp.Expr]) -> list[sp.Symbol]:
        """What a node function must be given: state first, then the rest by name."""
        used = Body(body.statements, tuple(results)).symbols
        own = [s for s in self.equations.node.state if s in used]
        return own + sorted((s for s in used if s not in own), key=lambda s: s.name)

    def call(self, function: str, body: Body, results: Sequence[sp.Expr], i: int, prefix: str) -> str:
        """The call of a node function for node i with the state names of a stage."""
        at = {s: f"{prefix}{s.name}_{i + 1}" for s in self.equations.node.state}
        return f"{function}({', '.join(at.get(s, s.name) for s in self.arguments(body, results))})"

    def timed(self, time: str, wanted: set[sp.Symbol]) -> None:
        """Statements for the time terms in use, at the time of that name."""
        for symbol, e in self.blocks.timed:
            if symbol in wanted:
                self.put(f"{symbol} = {show(e.xreplace({TIME: sp.Symbol(time)}))}")

    def stage_time(self, i: int, first: int) -> None:
        """The time of stage i and the time terms of the right-hand side, unless the stage before had the same time.

        `first` is the first stage that is evaluated at all.
        """
        c = self.method.c
        if i == first or c[i] != c[i - 1]:
            self.put(f"now = {combine((c[i],), ['h'], 't')}")
            self.timed("now", self.wanted(self.blocks.rhs.results, self.blocks.rhs))

    def wanted(self, results: Sequence[sp.Expr], body: Body) -> set[sp.Symbol]:
        """Time terms that some results use."""
        return Body(body.statements, tuple(results)).symbols & self.timed_names

    def slopes(self, prefix: str, out: str) -> None:
        """Statements that give the right-hand side at the state `prefix`x_1 … under the names `out`x_1 …"""
        node, body = self.equations.node, self.blocks.rhs
        coded = [e for e in body.results if not self.is_plain(e)]
        for i in range(self.equations.n):
            names = {s: f"{prefix}{s.name}_{i + 1}" for s in node.state}
            targets = [f"{out}{s.name}_{i + 1}" for s in node.state]
            if coded:
                left = [t for t, e in zip(targets, body.results, strict=True) if not self.is_plain(e)]
                self.put(f"{', '.join(left)} = {self.call('node', body, coded, i, prefix)}")
            for target, e in zip(targets, body.results, strict=True):
                if self.is_plain(e):
                    text = show(e.xreplace({s: sp.Symbol(n) for s, n in names.items()}))
                    self.put(f"{target} = broadcast({text}, WIDTH)" if e.is_number else f"{target} = {text}")
        self.links(prefix, out)

    def links(self, prefix: str, out: str) -> None:
        """Add what the links contribute to the right-hand side."""
        edge = self.equations.edge
        if edge is None:
            return
        terms: dict[str, list[sp.Expr]] = {}
        stage = {sp.Symbol(n, real=True): sp.Symbol(prefix + n, real=True) for n in self.state}
        for link in self.equations.links:
            for s, e in zip(self.equations.node.state, edge.rhs, strict=True):
                term = e.xreplace(self.equations.at_link(link)).xreplace(stage)
                if term != 0:
                    terms.setdefault(f"{out}{s.name}_{link[0] + 1}", []).append(term)
        for target, parts in terms.items():
            self.put(f"{target} = {target} + " + " + ".join(show(p) for p in parts))

    # -- beginning and end ------------------------------------------------------------------------------------

    def opening(self) -> None:
        """Load the state and the parameters."""
        for slot, name in enumerate(self.state):
            self.put(f"{name} = load(y, {slot}, WIDTH)")
        self.parameters()

    def parameters(self) -> None:
        """Load the parameters and compute what depends on them alone."""
        for slot, name in enumerate(self.equations.parameters):
            self.put(f"{name} = load(p, {len(self.state) + slot}, WIDTH)")
        body = self.first_body
        wanted = body.symbols.union(*(e.free_symbols for s, e in self.blocks.timed if s in body.symbols))
        self.put(*(f"{symbol} = {show(e)}" for symbol, e in self.blocks.constants if symbol in wanted))

    def closing(self, errors: Sequence[str]) -> None:
        """Store the new state and reduce the error to one number a lane."""
        terms = []
        for slot, (name, e) in enumerate(zip(self.state, errors, strict=True)):
            self.put(f"store(y_new, {slot}, n_{name})", f"e_{name} = scaled({e}, {name}, n_{name}, rtol, atol)")
            terms.append(f"e_{name}")
        self.put(f"total = {' + '.join(terms)}", f"error = {terms[0]}")
        self.put(*(f"error = maximum(error, {term})" for term in terms[1:]))
        self.put(f"return error + 0.0*total{', bound' * self.bounded}  # NaN or infinite where any estimate is")

    def dense(self, scale: str = "") -> None:
        """Store the coefficients of the dense output."""
        for j, row in enumerate(self.method.dense):
            for slot, name in enumerate(self.state):
                text = combine(row, [f"k{i + 1}_{name}" for i in range(len(row))]) or "broadcast(0.0, WIDTH)"
                self.put(
                    f"store(dense, {j * len(self.state) + slot}, {scale}({text}))"
                    if scale
                    else f"store(dense, {j * len(self.state) + slot}, {text})"
                )


@contextmanager
def indent_from(writer: StepWriter) -> Iterator[None]:
    """Indent whatever is written inside the with block."""
    mark = len(writer.lines)
    yield
    writer.lines[mark:] = ["    " + line for line in writer.lines[mark:]] or ["    pass"]
