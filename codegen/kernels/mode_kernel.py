"""Write the text of a kernel for a variational equation: one orbit, and deviations of many modes along it.

The orbit takes a step first, in scalar arithmetic, and stores the Jacobian at its stages, or as a series, in a short
shared array. Then every mode takes the same step of the same method with these Jacobians; a register holds the
deviations of LANES modes. The result equals the method applied to orbit and deviation together, because the Jacobian
of both is block lower triangular.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import sympy as sp

from synchain.models.dynamics.variational import Variation
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import TIME

from ..driver.dimensions import ModeDimensions
from ..integrators import Integrator, integrator
from ..program.expressions import ZERO, Expression, Load, Name, Number, ProductExpr, Value, call, linear, plus
from ..program.lowering import lower
from ..program.passes import Names, real, share
from ..program.printers import LANES
from ..program.statements import Assign, Comment, Function, Return, Role, Statement, let, operations, store
from ..simd import lanes
from ..steps.blocks import analyse
from ..steps.elimination import plan, write_factors, write_solve
from ..steps.row_step import contact_groups, event_functions, most_rows, register, row_count
from ..steps.step import StepWriter, node_function, scaling
from ..steps.unrolled_step import UnrolledStep, stage_state
from ..taylor import write_tangent
from .driver import Driver, KernelKind
from .kernel_text import KernelSource, NamedEquations, describe, module
from .sweep_kernel import AUTO, node_functions

LARGEST_ORBIT = 32  # most nodes of an orbit; compilation takes about a second of CPU time for each (a choice)
HEAD = 3  # number of entries at the beginning of the shared array: rate = 1/h, shift = 1/(gamma h), reach = gamma h

CARRY = '''
@njit(error_model='numpy', cache=True)
def carry(shared, strengths, old, new, first, last, tolerance):
    """The same step of the modes in registers first … last-1; returns the largest of their errors, in units of the tolerance."""
    worst, broken, ratios = broadcast(0.0, LANES), broadcast(0.0, LANES), np.empty(LANES)
    for which in range(first, last):
        error, size = mode_step(shared, strengths, old, new, which)
        ratio = error/(tolerance*size + 2.2250738585072014e-308)
        worst, broken = maximum(worst, ratio), broken + 0.0*ratio
    store(ratios, 0, worst + broken)
    largest = 0.0
    for lane in range(LANES):
        if ratios[lane] > largest or ratios[lane] != ratios[lane]:  # NaN stays
            largest = ratios[lane]
    return largest
'''.strip()

Place = tuple[int, int]  # row and column of an entry of the Jacobian A


@dataclass(frozen=True, slots=True)
class ModeKernel(KernelSource):
    """A kernel that carries the deviations of modes along orbits."""

    dimensions: ModeDimensions = field(repr=False)

    @property
    def functions(self) -> tuple[str, ...]:
        return self.driver.functions if self.driver.contacts else ("step", "carry")

    @property
    def arguments(self) -> tuple[Any, ...]:
        return (self.dimensions,)


def emit_modes(variation: Variation, method: str | Integrator = AUTO, width: int | None = None) -> ModeKernel:
    """Write the kernel that integrates deviations along an orbit."""
    equations = variation.orbit
    if equations.n > LARGEST_ORBIT:
        raise ValueError(
            f"tangent dynamics: found {equations.n} oscillators or clusters; expected at most {LARGEST_ORBIT}, as steps are written out"
        )
    method = integrator(method) if isinstance(method, str) else method
    if not (method.series or method.implicit):
        raise ValueError(f"tangent dynamics: found integrator {method.name}; expected a Rosenbrock or a Taylor method")
    width = lanes.native_width() if width is None else width
    named = NamedEquations.of(equations)
    plain, names = named.plain, named.free()
    # the matrix and the events take the names that the kernel uses
    swap = {real(a): real(b) for a, b in named.renamed}
    matrix = tuple((key, e.xreplace(swap)) for key, e in variation.matrix)
    events = None if variation.events is None else variation.events.map(lambda e: e.xreplace(swap))
    variation = replace(variation, orbit=plain, matrix=matrix, events=events)
    # lengths of the shared array and of the workspace, and operations of the orbit's step
    if method.series:
        tangent = write_tangent(variation, method.order)
        functions = [tangent.orbit.text, *tangent.modes]
        shared, workspace, count = tangent.shared, tangent.orbit.workspace, tangent.orbit.operations
    else:
        workspace = 0
        functions, shared, count = _stages(variation, method, names)
    deviations = f"{variation.size} deviations, {width} modes a register"
    constants = {"WIDTH": 1, "LANES": width, "DENSE": plain.sticks or method.series}
    return ModeKernel(
        describe(named, method, (), count, deviations),
        module(constants, functions, event_functions(variation, names)),
        equations,
        method,
        Driver(KernelKind.MODES, width, contacts=plain.sticks, series=method.series, rows=plain.has_rows),
        ModeDimensions(
            nodes=plain.n,
            dimension=plain.dimension,
            parameters=len(plain.parameters),
            dense_rows=method.dense_rows,
            workspace=workspace,
            error_order=method.error_order,
            repeats=0,
            strengths=len(variation.parameters),
            shared=shared,
            rows=row_count(plain),
            felt=most_rows(plain) if plain.has_rows else 0,
            contacts=contact_groups(plain),
        ),
    )


def _stages(variation: Variation, method: Integrator, names: Names) -> tuple[list[str], int, int]:
    """Return the functions of a step in stages, the length of the shared array, the operations of the orbit's step."""
    # the orbit: after each stage, store the coefficients of A at the state of the stage
    plain = variation.orbit
    blocks = [analyse(node, names, plain.varied) for node in plain.nodes]
    parts = Parts.of(variation, method.stages)
    writer = UnrolledStep(plain, blocks, method)
    functions = _functions(parts, plain.state, names)
    writer.write(after=lambda i: _note(writer, parts, functions, method, i))
    orbit = Function(
        "step",
        ("t", "h", "y", "p", "y_new", "dense", "rtol", "atol", "shared"),
        "One step of the orbit from (t, y): writes y_new and what the modes need, returns the error.",
        tuple(writer.statements),
        role=Role.ENTRY,
    )
    # the modes: the same method for d' = A d, with the stored coefficients
    modes = Function(
        "mode_step",
        ("shared", "strengths", "old", "new", "which"),
        "The same step of the modes in one register: writes them, returns their error and their size.",
        tuple(_mode_step(variation, parts, method)),
    )
    of_nodes = [f for k, kind in enumerate(blocks) for f in node_functions(writer, kind, k)]
    texts = [LANES.function(f) for f in (*of_nodes, *functions.values())]
    texts += [scaling(method), LANES.function(orbit), LANES.function(modes), CARRY]
    return texts, parts.size, operations(orbit.body)


@dataclass(slots=True)
class Parts:
    """The entries of the Jacobian A of a mode, linear in its strengths, and where their coefficients are stored."""

    stages: int
    # entry -> [(coefficient, strength or 1)]; a coefficient is a number or the symbol of a slot
    rows: dict[Place, list[tuple[sp.Expr, sp.Expr]]] = field(default_factory=dict)
    steady: dict[sp.Expr, str] = field(default_factory=dict)  # coefficients that are constant along the orbit
    moving: dict[sp.Expr, int] = field(default_factory=dict)  # coefficients that depend on its state or on time

    @classmethod
    def of(cls, variation: Variation, stages: int) -> Parts:
        """Sort the coefficients of a variation."""
        parts = cls(stages)
        states = {real(name) for name in variation.orbit.state} | {TIME}
        for key, e in variation.matrix:
            parts.rows[key] = [(parts.slot(c, states), s) for c, s in variation.parts(e)]
        return parts

    def slot(self, coefficient: sp.Expr, states: set[sp.Symbol]) -> sp.Expr:
        """Return a number unchanged, else the symbol of its slot: steady_0 … if it is constant, a0 … if it moves."""
        if coefficient.is_number:
            return coefficient
        if not coefficient.free_symbols & states:
            self.steady.setdefault(coefficient, f"steady_{len(self.steady)}")
            return sp.Symbol(self.steady[coefficient])
        self.moving.setdefault(coefficient, len(self.moving))
        return sp.Symbol(f"a{self.moving[coefficient]}")

    @property
    def fixed(self) -> dict[Place, str]:
        """Names of the constant entries that a mode computes once; a single constant coefficient needs none."""
        return {
            (r, c): f"g{r}_{c}"
            for (r, c), terms in self.rows.items()
            if not any(_moves(e) for e, _ in terms) and not (len(terms) == 1 and terms[0][1] == 1)
        }

    def at_stage(self, i: int) -> dict[Place, sp.Expr]:
        """Return the entries of A at stage i: numbers, names of fixed entries, and sums with moving coefficients."""
        swap = {sp.Symbol(f"a{k}"): sp.Symbol(f"a{i + 1}_{k}") for k in self.moving.values()}
        entries = {key: self.total(key).xreplace(swap) for key in self.rows}
        return entries | {key: sp.Symbol(name) for key, name in self.fixed.items()}

    def total(self, place: Place) -> sp.Expr:
        """Add up an entry of A."""
        return sp.Add(*(coefficient * strength for coefficient, strength in self.rows[place]))

    def loads(self, i: int, bent: bool = False) -> list[Statement]:
        """Load the moving coefficients at stage i, or with `bent` their derivatives along the stage."""
        word = "b" if bent else "a"
        return [let(f"{word}{i + 1}_{k}", _shared(self.value(i, k) + bent)) for k in self.moving.values()]

    @property
    def size(self) -> int:
        """Length of the shared array."""
        return HEAD + len(self.steady) + 2 * self.stages * len(self.moving)

    def value(self, stage: int, k: int) -> int:
        """Return the index of moving coefficient k at a stage; its derivative along the stage is stored behind it."""
        return HEAD + len(self.steady) + 2 * (stage * len(self.moving) + k)


def _functions(parts: Parts, state: tuple[str, ...], names: Names) -> dict[str, Function]:
    """Write the functions `steady`, `moving` and `bent`, by their names; leave out those without results."""
    # derivative of a moving coefficient along a stage: gradient times slope, and the explicit part in time
    along = {real(s): real(f"along_{s}") for s in state}
    lag = real("lag")
    bent = [sp.Add(*(derivative(e, s) * k for s, k in along.items()), derivative(e, TIME) * lag) for e in parts.moving]
    described = {
        "steady": ("Coefficients of the modes that do not move.", list(parts.steady)),
        "moving": ("Coefficients of the modes that move along the orbit.", list(parts.moving)),
        "bent": ("Their derivatives along a stage, `lag` the part of it in time.", bent),
    }
    functions = {}
    for name, (about, results) in described.items():
        if results:
            body = share(results, names.fresh("z"))
            used = {s.name for s in body.symbols}
            arguments = [s for s in state if s in used] + sorted(used - set(state))
            functions[name] = node_function(name, about, body, arguments, body.results)
    return functions


def _note(w: StepWriter, parts: Parts, functions: Mapping[str, Function], method: Integrator, i: int) -> None:
    """Write the statements that store the coefficients at stage i in the shared array."""

    def called(name: str, at: Mapping[str, Value]) -> Expression:
        return call(name, *(at.get(a, a) for a in functions[name].arguments))

    if i == 0:
        w.note("what the modes need of this step")
        w.put(*(store("shared", k, name) for k, name in enumerate(("rate", "shift", "reach"))))
        steady = tuple(parts.steady.values())
        if steady:
            w.put(Assign(steady, called("steady", {})))
            w.put(*(store("shared", HEAD + k, _on_lane(name)) for k, name in enumerate(steady)))
    if not parts.moving:
        return
    # moving coefficients at the state of the stage, and their derivatives along its slope
    at: dict[str, Value] = {s: f"u_{s}" for s in w.state} if i > 0 else {}
    values, slopes = (tuple(f"{word}_{i + 1}_{k}" for k in range(len(parts.moving))) for word in ("value", "bend"))
    w.put(Assign(values, called("moving", {**at, TIME.name: "now" if i > 0 else "t"})))
    along: dict[str, Value] = {f"along_{s}": f"k{i + 1}_{s}" for s in w.state}
    w.put(Assign(slopes, called("bent", {**along, TIME.name: "t", "lag": method.d[i] * Name("h")})))
    for k, (value, slope) in enumerate(zip(values, slopes, strict=True)):
        place = parts.value(i, k)
        w.put(store("shared", place, value), store("shared", place + 1, _on_lane(slope)))


def _on_lane(name: str) -> Expression:
    """Add 0 h, which turns a value that is constant into a register."""
    return Name(name) + 0.0 * Name("h")


def _shared(k: int) -> Load:
    return Load("shared", Number(k), None)


def _mode_step(variation: Variation, parts: Parts, method: Integrator) -> list[Statement]:
    # load the step size, the strengths, the deviations and the constant coefficients
    size, strengths = variation.size, [s.name for s in variation.parameters]
    body: list[Statement] = [let(name, _shared(k)) for k, name in enumerate(("rate", "shift", "reach"))]
    body += [let(s, register("strengths", len(strengths), k)) for k, s in enumerate(strengths)]
    body += [let(f"d{c}", register("old", size, c)) for c in range(size)]
    body += [let(name, _shared(HEAD + k)) for k, name in enumerate(parts.steady.values())]
    body += [let(name, lower(parts.total(key))) for key, name in parts.fixed.items()]
    body += parts.loads(0)
    # all stages of a Rosenbrock method share the factors of shift - A at the beginning of the step
    steps = plan(size, set(parts.rows))
    factors = write_factors(steps, parts.at_stage(0), tuple(f"d{c}" for c in range(size)))
    body += [Comment("factors of shift - A"), *factors.statements]
    for i in range(method.stages):
        body += _mode_stage(parts, method, i, size)
        right = {c: f"r{c}" for c in range(size)}
        body += write_solve(steps, factors, right, {c: f"k{i + 1}_d{c}" for c in range(size)})
    body.append(Comment("new deviation, its error and its size"))
    for c in range(size):
        body.append(let(f"n{c}", stage_state(method.b, method.a[-1], f"d{c}")))
        body.append(store("new", size * Name("which") + c, f"n{c}"))
    errors = [linear(method.e[0], [f"k{j + 1}_d{c}" for j in range(method.stages)]) for c in range(size)]
    body.append(let("error", _largest(errors)))
    return [*body, Return((Name("error"), _largest([Name(f"{x}{c}") for c in range(size) for x in "dn"])))]


def _moves(coefficient: sp.Expr) -> bool:
    return coefficient.is_Symbol and coefficient.name.startswith("a")


def _mode_stage(parts: Parts, method: Integrator, i: int, size: int) -> list[Statement]:
    """Write the right-hand side r of stage i: A times the stage state, and the terms of the moving Jacobian."""
    body: list[Statement] = [Comment(f"stage {i + 1}")]
    if i > 0:
        body += parts.loads(i)
        body += [let(f"u_d{c}", stage_state(method.a[i], method.a[i - 1], f"d{c}")) for c in range(size)]
    body += parts.loads(i, bent=True)
    entries = parts.at_stage(i)
    # row r: sum of A u over c, with the derivative of A along the stage times the deviation d, and C k / h
    for r in range(size):
        terms: list[sp.Expr] = []
        for (row, c), e in entries.items():
            if row == r:
                terms.append(e * sp.Symbol(f"u_d{c}" if i > 0 else f"d{c}"))
                bends = [sp.Symbol(f"b{i + 1}_{str(a)[1:]}") * s for a, s in parts.rows[row, c] if _moves(a)]
                terms += [sp.Add(*bends) * sp.Symbol(f"d{c}")] if bends else []
        summands = [lower(sp.Add(*terms, evaluate=False) if len(terms) > 1 else terms[0])] if terms else []
        if i > 0:
            carried = linear(method.big_c[i], [f"k{j + 1}_d{r}" for j in range(i)])
            summands.append(ProductExpr((Name("rate"), carried)))
        body.append(let(f"r{r}", plus(*summands) if summands else call("broadcast", ZERO, "LANES")))
    return body


def _largest(values: Sequence[Expression]) -> Expression:
    first, *others = (call("absolute", e) for e in values)
    for other in others:
        first = call("maximum", first, other)
    return first
