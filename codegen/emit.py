"""From equations, an integrator and a list of records to the text of one self-contained kernel module."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import sympy as sp

from synchain.models.equations import Equations

from . import elementary, lanes, skeletons
from .blocks import Names, NodeBlocks, analyse
from .explicit import write_explicit
from .integrators import Integrator, integrator
from .looped import LoopWriter, workspace
from .naming import tidy
from .printer import FUNCTIONS, show
from .rosenbrock import write_rosenbrock
from .sparse import program
from .step import StepWriter, write_function

__all__ = ["RECORDS", "KernelSource", "emit"]

RECORDS = ("sync_error", "section", "trajectory")
"""What a kernel can record besides the final state."""

LARGEST_UNROLLED = 8
"""Nodes up to which a step is written out; larger networks are stepped through in loops, whose text stays small."""


@dataclass(frozen=True, slots=True)
class KernelSource:
    """The text of a kernel module and what its arrays mean."""

    text: str = field(repr=False)
    equations: Equations = field(repr=False)
    integrator: str
    records: tuple[str, ...]
    width: int

    @property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the text."""
        return hashlib.sha256(self.text.encode()).hexdigest()


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


def emit(
    equations: Equations,
    method: str | Integrator = "rodas5p",
    records: Sequence[str] = ("sync_error",),
    section: sp.Expr | None = None,
    width: int | None = None,
) -> KernelSource:
    """Write the kernel of these equations for one integrator, one set of records and one lane width.

    `section` is an expression in the state symbols (x_1 …), the parameters and t whose zeros are recorded; it is needed
    with the record "section".  Raises ValueError for an unknown record or integrator, a section function that uses other
    symbols, and UnprintableError where the equations cannot be printed.
    """
    method = integrator(method) if isinstance(method, str) else method
    unknown = [r for r in records if r not in RECORDS]
    if unknown:
        raise ValueError(f"unknown record {unknown[0]!r}; known: {', '.join(RECORDS)}")
    if "section" in records and section is None:
        raise ValueError("the record 'section' needs a section function, for example v_1")
    width = lanes.native_width() if width is None else width
    ordered = tuple(r for r in RECORDS if r in records)
    text = _module(equations, method, ordered, section if "section" in ordered else None, width)
    return KernelSource(text, equations, method.name, ordered, width)


def _module(
    equations: Equations, method: Integrator, records: tuple[str, ...], section: sp.Expr | None, width: int
) -> str:
    plain = tidy(equations)
    weight = [plain.edge.weight.name] if plain.edge is not None else []
    names = Names([*plain.state, *plain.parameters, *(s.name for s in plain.node.state), *weight])
    blocks = analyse(plain.node, names)
    writer = StepWriter(plain, blocks, method)
    looped = equations.n > LARGEST_UNROLLED
    entries = 0
    if looped:
        entries = program(equations).entries if method.kind == "rosenbrock" else 0
        lines = LoopWriter(writer).lines()
    else:
        lines = write_rosenbrock(writer) if method.kind == "rosenbrock" else write_explicit(writer)
    functions = _node_functions(writer, blocks, method)
    parts = [
        _header(equations, plain, method, records, lines),
        _imports(functions, lines, section),
        _constants(plain, method, records, width)
        + (
            f"\nLOOPED = True\nENTRIES = {entries}\nWORKSPACE = {workspace(writer, entries)}"
            if looped
            else "\nLOOPED = False\nWORKSPACE = 0"
        ),
        *("\n".join(f) for f in functions),
        SCALED,
        *([PAIR, skeletons.text("sparse")] if looped else []),
        _step(lines, looped),
        _section(equations, plain, section),
        skeletons.text("sweep"),
    ]
    return "\n\n\n".join(part for part in parts if part) + "\n"


def _node_functions(writer: StepWriter, blocks: NodeBlocks, method: Integrator) -> list[list[str]]:
    """The right-hand side of one node, and its linearisation where the method wants one."""
    made = []
    for name, doc, body in (
        ("node", "Right-hand side of one oscillator.", blocks.rhs),
        ("node_linear", "Right-hand side of one oscillator and the parts of its Jacobian that move.", blocks.linear),
    ):
        results = [e for e in body.results if not writer.is_plain(e)]
        if results and (name == "node" or method.kind == "rosenbrock"):
            arguments = [s.name for s in writer.arguments(body, results)]
            made.append(write_function(name, doc, body, arguments, results))
    return made


def _header(
    equations: Equations, plain: Equations, method: Integrator, records: tuple[str, ...], lines: list[str]
) -> str:
    swapped = [f"{a} as {b}" for a, b in zip(equations.parameters, plain.parameters, strict=True) if a != b]
    rows = [
        f"Generated kernel: {equations.n} oscillator{'s' * (equations.n > 1)}, {len(equations.links)} links, {method.name}.",
        "",
        f"Equations   {equations.digest[:16]}",
        f"Integrator  {method.name}, order {method.order}: {method.source}",
        f"State       {', '.join(equations.state)}",
        f"Parameters  {', '.join(equations.parameters) or 'none'}",
        f"Records     {', '.join(('final state', *records))}",
        f"Step        {_operations(lines)} operations outside the node functions",
    ]
    if swapped:
        rows.append(f"Renamed     {', '.join(swapped)}")
    return '"""' + "\n".join(rows) + '\n"""'


def _operations(lines: list[str]) -> int:
    return sum(line.count(f" {sign} ") for line in lines for sign in "+-") + sum(
        line.count(sign) for line in lines for sign in "*/"
    )


def _imports(functions: list[list[str]], lines: list[str], section: sp.Expr | None) -> str:
    text = "\n".join([*(line for f in functions for line in f), *lines, show(section) if section is not None else ""])
    used = sorted(
        n for n in {*FUNCTIONS.values(), "sqrt", "exp", "log"} if f"{n}(" in text or n in ("sqrt", "exp", "log")
    )
    smooth = [n for n in used if n in elementary.__all__ and n not in lanes.__all__]
    primitive = {
        "absolute",
        "any_lane",
        "broadcast",
        "lane_bits",
        "load",
        "maximum",
        "minimum",
        "select",
        "store",
        "sqrt",
    }
    primitive |= {n for n in used if n in lanes.__all__}
    return "\n".join([
        "import math",
        "",
        "import numpy as np",
        "from numba import njit",
        "",
        f"from synchain.codegen.elementary import {', '.join(smooth)}",
        f"from synchain.codegen.lanes import {', '.join(sorted(primitive))}",
    ])  # fmt: skip


def _constants(equations: Equations, method: Integrator, records: tuple[str, ...], width: int) -> str:
    flags = {name.upper(): name in records for name in RECORDS}
    rows = {
        "WIDTH": width,
        "NODES": equations.n,
        "COMPONENTS": len(equations.node.state),
        "DIMENSION": equations.dimension,
        "PARAMETERS": len(equations.parameters),
        "DENSE_ROWS": len(method.dense),
        "ERROR_ORDER": method.error_order,
        **flags,
        "DENSE": any(flags.values()),
    }
    return "\n".join(f"{name} = {value!r}" for name, value in rows.items())


def _step(lines: list[str], looped: bool) -> str:
    more = ", graph, weights" if looped else ""
    head = [
        "@njit(error_model='numpy')",
        f"def step(t, h, y, p, y_new, dense, rtol, atol{more}):",
        '    """One step from (t, y): writes y_new and the dense output, returns the error in units of the tolerance."""',
    ]
    return "\n".join([*head, *(f"    {line}" for line in lines)])


def _section(equations: Equations, plain: Equations, section: sp.Expr | None) -> str:
    """The section function at a fraction of the step; a kernel without sections has none."""
    if section is None:
        return ""
    swap = dict(zip(map(_real, (*equations.state, *equations.parameters)), map(_real, (*plain.state, *plain.parameters)),
                    strict=True))  # fmt: skip
    section = section.xreplace({s: _real(s.name) for s in section.free_symbols})
    used = {s.name for s in section.free_symbols}
    unknown = sorted(used - set(equations.state) - set(equations.parameters) - {"t"})
    if unknown:
        raise ValueError(f"section function {section}: unknown symbol {unknown[0]!r}; use the state, parameters and t")
    lines = ["@njit(error_model='numpy', forceinline=True)", "def section(theta, t, h, y, p, y_new, dense):",
             '    """The section function at the fraction theta of the step."""']  # fmt: skip
    for slot, (name, shown) in enumerate(zip(equations.state, plain.state, strict=True)):
        if name in used:
            lines.append(f"    {shown} = inside(theta, {slot}, y, y_new, dense)")
    for slot, (name, shown) in enumerate(zip(equations.parameters, plain.parameters, strict=True)):
        if name in used:
            lines.append(f"    {shown} = load(p, {slot}, WIDTH)")
    text = show(section.xreplace({_real("t"): sp.Symbol("(t + theta*h)")}).xreplace(swap))
    return "\n".join([*lines, f"    return {text}"])


def _real(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)
