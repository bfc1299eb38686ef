"""From a variational equation to the text of a kernel: one orbit, and any number of modes carried along it in lanes.

The orbit is stepped by itself.  Each accepted step leaves what its stages know about the Jacobian in a short shared
array, and from that every mode takes the same step of the same method: the result is that of the method applied to orbit
and deviation together, whose Jacobian is lower triangular by blocks.  The orbit is scalar; a register holds one deviation
for each of LANES modes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import TIME

from .. import driver
from ..integrators import Integrator, integrator
from ..program.passes import Body, Names
from ..program.printers import show
from ..simd import lanes
from ..steps.blocks import analyse
from ..steps.contacts import event_constants, write_events
from ..steps.elimination import plan, write_factors, write_solve
from ..steps.names import tidy
from ..steps.rosenbrock import stage_state, write_rosenbrock
from ..steps.step import SCALED, StepWriter, combine, write_function
from .sweep import LARGEST_UNROLLED, KernelKind, KernelSource, describe, imports, node_functions

__all__ = ["emit_modes"]

METHOD = "rodas5p"
HEAD = 3
"""First entries of the shared array: rate = 1/h, shift = 1/(gamma h), reach = gamma h."""

Place = tuple[int, int]


def emit_modes(variation: Variation, width: int | None = None) -> KernelSource:
    """Write the kernel that carries deviations along an orbit.

    Parameters
    ----------
    variation
        The orbit, and the equations of a mode along it.
    width
        Modes that step together; by default those of one register.

    Returns
    -------
    KernelSource
        The text, and what is needed to compile and to call it.

    Raises
    ------
    ValueError
        If the orbit has more than eight oscillators.
    UnprintableError
        If the equations cannot be printed.
    """
    equations = variation.orbit
    if equations.n > LARGEST_UNROLLED:
        raise ValueError(
            f"tangent dynamics of {equations.n} oscillators; expected at most {LARGEST_UNROLLED} (steps are written out)"
        )
    method = integrator(METHOD)
    width = lanes.native_width() if width is None else width
    plain = tidy(equations)
    names = Names([*plain.state, *plain.parameters, *(s.name for s in plain.node.state)])
    blocks = analyse(plain.node, names, plain.varied)
    variation = _renamed(variation, plain)
    parts = Parts.of(variation, method.stages)
    writer = StepWriter(plain, blocks, method)
    functions = _functions(parts, plain.state, names)
    write_rosenbrock(writer, lambda i: _note(writer, parts, functions, method, i))
    carry = _mode_step(variation, parts, method)
    bodies = [*node_functions([writer], blocks), *(f.lines for f in functions if f.lines)]
    text = _module(writer, variation, width, parts, bodies, carry, names)
    return KernelSource(text, equations, method.name, (), width, KernelKind.MODES)


def _renamed(variation: Variation, plain: Equations) -> Variation:
    """The matrix and the events in the names that the kernel uses."""
    old = (*variation.orbit.state, *variation.orbit.parameters)
    new = (*plain.state, *plain.parameters)
    swap = {sp.Symbol(a, real=True): sp.Symbol(b, real=True) for a, b in zip(old, new, strict=True)}
    matrix = tuple((key, e.xreplace(swap)) for key, e in variation.matrix)
    events = None if variation.events is None else variation.events.map(lambda e: e.xreplace(swap))
    return replace(variation, orbit=plain, matrix=matrix, events=events)


@dataclass(slots=True)
class Parts:
    """The entries of A, linear in the strengths of a mode, whose coefficients are parted into steady and moving ones.

    rows: entry -> [(coefficient, strength or 1)], where a coefficient is a number or a slot symbol.
    """

    stages: int
    rows: dict[Place, list[tuple[sp.Expr, sp.Expr]]] = field(default_factory=dict)
    steady: dict[sp.Expr, str] = field(default_factory=dict)
    moving: dict[sp.Expr, int] = field(default_factory=dict)

    @classmethod
    def of(cls, variation: Variation, stages: int) -> Parts:
        """The parts of a variation."""
        made = cls(stages)
        states = {sp.Symbol(name, real=True) for name in variation.orbit.state} | {TIME}
        for key, e in variation.matrix:
            rest = e.xreplace(dict.fromkeys(variation.parameters, sp.S.Zero))
            terms = [(rest, sp.S.One), *((e.diff(s), s) for s in variation.parameters)]
            made.rows[key] = [(made.slot(c, states), s) for c, s in terms if c != 0]
        return made

    def slot(self, coefficient: sp.Expr, states: set[sp.Symbol]) -> sp.Expr:
        """A number as it is; else the symbol of a slot: steady_0 … or, for moving ones, a0 …"""
        if coefficient.is_number:
            return coefficient
        if not coefficient.free_symbols & states:
            self.steady.setdefault(coefficient, f"steady_{len(self.steady)}")
            return sp.Symbol(self.steady[coefficient])
        self.moving.setdefault(coefficient, len(self.moving))
        return sp.Symbol(f"a{self.moving[coefficient]}")

    @property
    def size(self) -> int:
        """Length of the shared array."""
        return HEAD + len(self.steady) + 2 * self.stages * len(self.moving)

    def value(self, stage: int, k: int) -> int:
        """Where the value of moving coefficient k at a stage lies; its derivative along the stage follows."""
        return HEAD + len(self.steady) + 2 * (stage * len(self.moving) + k)


@dataclass(frozen=True, slots=True)
class Function:
    """A small function of the kernel, and the names of its arguments."""

    name: str
    lines: list[str]
    arguments: tuple[str, ...]


def _functions(parts: Parts, state: tuple[str, ...], names: Names) -> tuple[Function, Function, Function]:
    """The functions `steady`, `moving` and `bent`: coefficients, and derivatives of the moving ones along a stage."""
    along = {sp.Symbol(s, real=True): sp.Symbol(f"along_{s}", real=True) for s in state}
    lag = sp.Symbol("lag", real=True)
    bent = [sp.Add(*(derivative(e, s) * k for s, k in along.items()), derivative(e, TIME) * lag) for e in parts.moving]
    return (
        _function("steady", "Coefficients of the modes that do not move.", parts.steady, state, names),
        _function("moving", "Coefficients of the modes that move along the orbit.", parts.moving, state, names),
        _function("bent", "Their derivatives along a stage, `lag` the part of it in time.", bent, state, names),
    )


def _function(name: str, doc: str, results: Iterable[sp.Expr], state: tuple[str, ...], names: Names) -> Function:
    found = list(results)
    if not found:
        return Function(name, [], ())
    statements, reduced = sp.cse(found, symbols=names.fresh("z"), order="canonical")
    body = Body(tuple(statements), tuple(reduced))
    used = {s.name for s in body.symbols}
    arguments = tuple([s for s in state if s in used] + sorted(used - set(state)))
    return Function(name, write_function(name, doc, body, arguments, body.results), arguments)


def _note(w: StepWriter, parts: Parts, functions: tuple[Function, ...], method: Integrator, i: int) -> None:
    """Write what stage i leaves in the shared array."""
    steady, moving, bent = functions
    if i == 0:
        w.put("# what the modes need of this step")
        w.put("store(shared, 0, rate)", "store(shared, 1, shift)", "store(shared, 2, reach)")
        if parts.steady:
            w.put(f"{', '.join(parts.steady.values())} = {steady.name}({', '.join(steady.arguments)})")
            w.put(*(f"store(shared, {HEAD + k}, {name} + 0.0*h)" for k, name in enumerate(parts.steady.values())))
    if not parts.moving:
        return
    at: dict[str, str] = {s: f"u_{s}" for s in w.state} if i > 0 else {}
    at[TIME.name] = "now" if i > 0 else "t"
    values = [f"value_{i + 1}_{k}" for k in range(len(parts.moving))]
    w.put(f"{', '.join(values)} = moving({', '.join(at.get(a, a) for a in moving.arguments)})")
    slopes = [f"bend_{i + 1}_{k}" for k in range(len(parts.moving))]
    at = {f"along_{s}": f"k{i + 1}_{s}" for s in w.state} | {TIME.name: "t", "lag": f"{method.d[i]!r}*h"}
    w.put(f"{', '.join(slopes)} = bent({', '.join(at.get(a, a) for a in bent.arguments)})")
    for k, (value, slope) in enumerate(zip(values, slopes, strict=True)):
        w.put(
            f"store(shared, {parts.value(i, k)}, {value})", f"store(shared, {parts.value(i, k) + 1}, {slope} + 0.0*h)"
        )


def _mode_step(variation: Variation, parts: Parts, method: Integrator) -> list[str]:
    """The statements of the step that one register of modes takes."""
    size, strengths = variation.size, [s.name for s in variation.parameters]
    lines = ["rate, shift, reach = shared[0], shared[1], shared[2]"]
    lines += [f"{s} = load(strengths, {len(strengths)}*which + {k}, LANES)" for k, s in enumerate(strengths)]
    lines += [f"d{c} = load(old, {size}*which + {c}, LANES)" for c in range(size)]
    lines += [f"{name} = shared[{HEAD + k}]" for k, name in enumerate(parts.steady.values())]
    fixed = {}
    for (r, c), terms in parts.rows.items():
        if all(not _moves(a) for a, _ in terms) and not (len(terms) == 1 and terms[0][1] == 1):
            fixed[r, c] = f"g{r}_{c}"
            lines.append(f"g{r}_{c} = {show(sp.Add(*(a * s for a, s in terms)))}")
    stages = [_at_stage(parts, fixed, i) for i in range(method.stages)]
    lines += [f"a1_{k} = shared[{parts.value(0, k)}]" for k in range(len(parts.moving))]
    steps = plan(size, set(parts.rows))
    factors = write_factors(steps, stages[0], tuple(f"d{c}" for c in range(size)))
    lines += ["# factors of shift - A", *factors.lines]
    for i in range(method.stages):
        lines += _mode_stage(parts, stages[i], method, i, size)
        right = {c: f"r{c}" for c in range(size)}
        lines += write_solve(steps, factors, right, {c: f"k{i + 1}_d{c}" for c in range(size)})
    lines.append("# new deviation, its error and its size")
    for c in range(size):
        lines += [f"n{c} = {stage_state(method.b, method.a[-1], f'd{c}')}", f"store(new, {size}*which + {c}, n{c})"]
    error = [f"absolute({combine(method.e[0], [f'k{j + 1}_d{c}' for j in range(method.stages)])})" for c in range(size)]
    lines.append(f"error = {_largest(error)}")
    lines.append(f"return error, {_largest([f'absolute({x}{c})' for c in range(size) for x in 'dn'])}")
    return lines


def _moves(coefficient: sp.Expr) -> bool:
    return coefficient.is_Symbol and coefficient.name.startswith("a")


def _at_stage(parts: Parts, fixed: Mapping[Place, str], i: int) -> dict[Place, sp.Expr]:
    """The entries of A at a stage: numbers, names of steady entries, and sums with the stage's moving coefficients."""
    swap = {sp.Symbol(f"a{k}"): sp.Symbol(f"a{i + 1}_{k}") for k in parts.moving.values()}
    made = {}
    for key, terms in parts.rows.items():
        e = sp.Symbol(fixed[key]) if key in fixed else sp.Add(*(a * s for a, s in terms)).xreplace(swap)
        made[key] = e
    return made


def _mode_stage(parts: Parts, entries: Mapping[Place, sp.Expr], method: Integrator, i: int, size: int) -> list[str]:
    """Stage state, A times it, and what the moving Jacobian adds."""
    lines = [f"# stage {i + 1}"]
    if i > 0:
        lines += [f"a{i + 1}_{k} = shared[{parts.value(i, k)}]" for k in range(len(parts.moving))]
        lines += [f"u_d{c} = {stage_state(method.a[i], method.a[i - 1], f'd{c}')}" for c in range(size)]
    lines += [f"b{i + 1}_{k} = shared[{parts.value(i, k) + 1}]" for k in range(len(parts.moving))]
    for r in range(size):
        terms: list[sp.Expr] = []
        for (row, c), e in entries.items():
            if row == r:
                terms.append(e * sp.Symbol(f"u_d{c}" if i > 0 else f"d{c}"))
                bends = [sp.Symbol(f"b{i + 1}_{str(a)[1:]}") * s for a, s in parts.rows[row, c] if _moves(a)]
                terms += [sp.Add(*bends) * sp.Symbol(f"d{c}")] if bends else []
        text = show(sp.Add(*terms, evaluate=False)) if len(terms) > 1 else show(terms[0]) if terms else ""
        if i > 0:
            carried = combine(method.big_c[i], [f"k{j + 1}_d{r}" for j in range(i)])
            text = f"{text} + rate*({carried})" if text else f"rate*({carried})"
        lines.append(f"r{r} = {text or 'broadcast(0.0, LANES)'}")
    return lines


def _largest(texts: list[str]) -> str:
    made = texts[0]
    for other in texts[1:]:
        made = f"maximum({made}, {other})"
    return made


def _module(
    writer: StepWriter,
    variation: Variation,
    width: int,
    parts: Parts,
    functions: list[list[str]],
    carry: list[str],
    names: Names,
) -> str:
    plain, method, lines = writer.equations, writer.method, writer.lines
    sticking = ("contacts",) if plain.sticks else ()
    orbit = [
        "@njit(error_model='numpy')",
        "def step(t, h, y, p, y_new, dense, rtol, atol, shared):",
        '    """One step of the orbit from (t, y): writes y_new and what the modes need, returns the error."""',
        *(f"    {line}" for line in lines),
    ]
    modes = [
        "@njit(error_model='numpy', forceinline=True)",
        "def mode_step(shared, strengths, old, new, which):",
        '    """The same step of the modes in one register: writes them, returns their error and their size."""',
        *(f"    {line}" for line in carry),
    ]
    made = [
        describe(variation.orbit, plain, method, (), lines, f"{variation.size} deviations, {width} modes a register"),
        imports(functions, [*lines, *carry], None, ("scale_binary", "split_binary", "store")),
        _constants(variation, plain, method, width, parts.size),
        *("\n".join(f) for f in functions),
        SCALED,
        "\n".join(orbit),
        "\n".join(modes),
        *write_events(variation, names),
        *(driver.text(name) for name in ("recording", "cells", "control", *sticking, "modes")),
    ]
    return "\n\n\n".join(made) + "\n"


def _constants(variation: Variation, plain: Equations, method: Integrator, width: int, shared: int) -> str:
    sticking = plain.sticks
    constants = {
        "WIDTH": 1,
        "LANES": width,
        "NODES": plain.n,
        "COMPONENTS": len(plain.node.continuous),
        "DIMENSION": plain.dimension,
        "PARAMETERS": len(plain.parameters),
        "DENSE_ROWS": len(method.dense),
        "ERROR_ORDER": method.error_order,
        "SWITCHING": False,
        "WEIGHTED": False,
        "CONTACTS": sticking,
        "SYNC_ERROR": False,
        "SECTION": False,
        "TRAJECTORY": False,
        "DENSE": sticking,
        "LOOPED": False,
        "REPEATS": False,
        "MODE_SIZE": variation.size,
        "STRENGTHS": len(variation.parameters),
        "SHARED": shared,
    }
    return "\n".join([*(f"{name} = {value!r}" for name, value in constants.items()), *event_constants(variation)])
