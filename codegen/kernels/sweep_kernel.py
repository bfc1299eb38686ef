"""Write the text of a sweep kernel.

`emit` passes its arguments through six stages; the output of each stage is an input of the next ones:

1. Check: raise ValueError for records that are unknown, lack an argument or exclude each other.
2. Plan (`_planned`): Equations, integrator -> Equations, SparsePlan or None. A plan means that a step runs in loops
   over nodes and links; None means that the step is written out.
3. Rename (`tidy`, `free_names`): Equations -> equations with short names that are valid in Python, and unused names.
4. Write the step (`_stages`, or `codegen/taylor`): equations, plan -> functions as text, the groups of scratch memory
   that they use, and the number of operations of a step.
5. Choose the driver: the operations give the number of lanes; the lanes and the kind of step give the fixed text
   (`Driver`) that calls the functions.
6. Assemble: functions of steps, pushes, sections and observed values -> a module (`module`), its docstring
   (`describe`) and the sizes of its arrays (`Dimensions`): one KernelSource, which `machine_code/compile.py` compiles.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import angular_frequency
from synchain.models.dynamics.record import Record
from synchain.models.graphs.links import LINK_LIMIT

from .. import driver
from ..driver.dimensions import Dimensions, ModeDimensions
from ..integrators import Integrator, integrator
from ..program.passes import Names, real
from ..program.printers import LANES
from ..program.statements import Function, Role, operations
from ..simd import lanes
from ..steps.blocks import NodeBlocks, analyse
from ..steps.contact_step import push_functions
from ..steps.looped_step import LoopedStep
from ..steps.safe_names import tidy
from ..steps.sparse_plan import FILL_LIMIT, SparsePlan, program, workspace
from ..steps.step import StepWriter, function_name, node_function, scaling
from ..steps.unrolled_step import UnrolledStep
from ..taylor import is_large, write_looped, write_rolled, write_step
from .driver import RECORDERS, Driver, KernelKind, Recorder, imports
from .observable_text import UNWATCHED, Recording, count_of, rule_of

AUTO = "rodas5p"
"""The integrator for "auto"."""

LARGEST_UNROLLED = 8
"""Largest number of nodes whose steps are written out by default; steps of larger networks run in loops."""

MOST_OF_LINKS = 1000
"""Largest number of operations of all links in a written-out step; more take minutes to compile."""


@dataclass(frozen=True, slots=True)
class KernelSource:
    """The functions of a scene as the text of a module, the driver that runs them, and the sizes of its arrays."""

    head: str = field(repr=False)
    code: str = field(repr=False)
    equations: Equations = field(repr=False)
    method: Integrator = field(repr=False)
    driver: Driver
    dimensions: Dimensions | ModeDimensions = field(repr=False)
    # sweep: number of oscillators that each node represents; modes: contact whose velocity a component is, or -1
    marks: tuple[int, ...] = field(repr=False)
    # integer arrays that the loops of a step read; None if the step is written out
    elimination: SparsePlan | None = field(default=None, repr=False, compare=False)
    # points inside a step at which functions of the state are evaluated, with their weights (`rule_of`)
    rule: tuple[tuple[float, ...], ...] = field(default=((),), repr=False)

    @property
    def text(self) -> str:
        """The module with its docstring `head`."""
        return f"{self.head}\n\n\n{self.code}"

    @property
    def integrator(self) -> str:
        """The name of the integrator."""
        return self.method.name

    @property
    def functions(self) -> tuple[str, ...]:
        """Functions of the module that the driver calls."""
        driver, sizes = self.driver, self.dimensions
        if isinstance(sizes, ModeDimensions):
            return ("step", "carry", *(("pushes", "release") if driver.contacts else ()))
        wanted = (
            ("pushes", driver.contacts),
            ("section", sizes.sections or sizes.stops),
            ("values", sizes.observed),
        )
        return ("step", *(name for name, called in wanted if called))

    @property
    def recorders(self) -> tuple[Recorder, ...]:
        """Recorders that the records of the scene need."""
        sizes = self.dimensions
        if isinstance(sizes, ModeDimensions):
            return ()
        wanted = sizes.stops, sizes.components, sizes.sections, sizes.observed, sizes.sampled
        return tuple(self.driver.recorder(name) for name, asked in zip(RECORDERS, wanted, strict=True) if asked)

    @property
    def shared(self) -> tuple[Driver | Recorder, ...]:
        """Modules that it shares with other kernels."""
        return (self.driver, *self.recorders)

    @property
    def width(self) -> int:
        """Cells, or modes, in one register."""
        return self.driver.width

    @property
    def kind(self) -> KernelKind:
        """Task of the kernel."""
        return self.driver.kind

    @property
    def looped(self) -> bool:
        """True if the steps run in loops over nodes and links, False if they are written out."""
        return self.elimination is not None

    @property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the text and of those of its driver and recorders."""
        return _digest(self.text, *(module.text for module in self.shared))


@lru_cache(maxsize=64)
def _digest(*texts: str) -> str:
    """Return the SHA-256 of texts; cached because each run needs the digest of its kernel again."""
    return hashlib.sha256("".join(texts).encode()).hexdigest()


def emit(
    equations: Equations,
    method: str | Integrator = "auto",
    records: Sequence[str] = ("sync_error",),
    section: sp.Expr | None = None,
    width: int | None = None,
    multiplicity: Sequence[int] | None = None,
    *,
    watched: Recording = UNWATCHED,
    unroll: int = LARGEST_UNROLLED,
    fill: float = FILL_LIMIT,
) -> KernelSource:
    """Write the kernel of these equations for one integrator, one set of records and one lane width."""
    method = AUTO if method == "auto" else method
    method = integrator(method) if isinstance(method, str) else method
    _check_records(equations, records, section, watched, multiplicity)  # stage 1
    ordered = tuple(r for r in Record if r in records)
    # stages 2 and 3: the plan and the names of the kernel
    equations, elimination = _planned(equations, method, unroll, fill)
    plain, looped = tidy(equations), elimination is not None
    names = free_names(plain)
    # stage 4: the step
    if method.series:
        write = write_step if elimination is None else write_rolled if is_large(plain) else write_looped
        series = write(plain, method.order)
        functions, scratch, count = [series.text], series.workspace, series.operations
        if elimination is not None and series.table:
            elimination = replace(elimination, arrays=(*elimination.arrays[:-1], np.array(series.table)))
    else:
        functions, scratch, count = _stages(plain, method, names, elimination)
    # stage 5: the driver
    width = _suited(equations, method, count) if width is None else width
    chosen = Driver(KernelKind.SWEEP, width, looped, plain.sticks, method.series)
    # stage 6: events and observed values, constants, sizes
    cut = _cut(equations, section) if section is not None and "section" in ordered else UNWATCHED
    events = [
        *push_functions(plain, names, looped),
        *cut.functions(equations, plain),
        *watched.functions(equations, plain),
    ]
    functions += [driver.text("driver.dense")] if cut or watched else []
    functions += [driver.text("driver.slope")] if watched.has_rates else []
    constants = {
        "WIDTH": width,
        "DENSE": bool(ordered or watched) or (plain.sticks and not method.series),
        "SERIES": method.series,
    }
    if looped:
        constants |= {"NODES": plain.n, "DIMENSION": plain.dimension, "DENSE_ROWS": method.dense_rows}
    return KernelSource(
        describe(equations, plain, method, (*ordered, *watched.words(equations)), count),
        module({**constants, **watched.tables(equations)}, functions, events),
        equations,
        method,
        chosen,
        Dimensions(
            nodes=plain.n,
            dimension=plain.dimension,
            parameters=len(plain.parameters),
            dense_rows=method.dense_rows,
            workspace=scratch,
            error_order=method.error_order,
            repeats=int(angular_frequency(plain) is not None),
            components=len(plain.compared) if "sync_error" in ordered else 0,
            observed=count_of(equations, watched.observed),
            gaps=count_of(equations, watched.gaps),
            depths=count_of(equations, watched.depths),
            sections=len(cut.sections or watched.sections),
            kept=-1 if cut else watched.kept,
            sampled=int("trajectory" in ordered),
            stops=int(watched.stop is not None),
        ),
        (1,) * equations.n if multiplicity is None or "sync_error" not in ordered else tuple(multiplicity),
        elimination,
        rule_of(method),
    )


def module(constants: Mapping[str, object], steps: Sequence[str], events: Sequence[Function]) -> str:
    """Join imports, constants, functions of steps and functions of events to the code of a kernel."""
    named = "\n".join(f"{name} = {value}" for name, value in constants.items())
    text = "\n\n\n".join([*steps, *map(LANES.function, events)]) + "\n"
    return "\n\n\n".join([imports(f"{named}\n{text}"), named, text])


def _check_records(
    equations: Equations,
    records: Sequence[str],
    section: sp.Expr | None,
    watched: Recording,
    multiplicity: Sequence[int] | None,
) -> None:
    """Raise ValueError for records that are unknown, lack an argument or exclude each other."""
    unknown = [r for r in records if r not in list(Record)]
    if unknown:
        raise ValueError(f"unknown record {unknown[0]!r}; known: {', '.join(Record)}")
    if "section" in records and watched.events:
        raise ValueError("the record 'section' beside functions of the state: found both; expected one of them")
    if "section" in records and section is None:
        raise ValueError("the record 'section' needs a section function, for example v_1")
    if "sync_error" not in records:
        return
    if not equations.common:
        raise ValueError("the record 'sync_error' compares states of one name, and these nodes have none in common")
    if multiplicity is not None and len(multiplicity) != equations.n:
        raise ValueError(f"multiplicity has {len(multiplicity)} entries; expected one for each of {equations.n} nodes")


MOST_DECODED = 2200
"""Largest number of operations of a step in two registers.

Such a step has about 6000 instructions, as many as a processor keeps decoded. `python -m benchmarks methods` times
both widths: a longer step is up to a seventh faster in one register.
"""


def _suited(equations: Equations, method: Integrator, count: int) -> int:
    """Return the number of lanes that is fastest on this processor."""
    # One register leaves the pipelines idle in a small system, so it gets two. The steps of implicit methods are long
    # chains that fill all registers: two are slower beyond two states.
    most = 2 if method.implicit else 6
    moving = sum(len(equations.nodes[kind].continuous) for kind in equations.kind_of[: most + 1])
    return lanes.native_width(2 if moving <= most and count <= MOST_DECODED else 1)


def _planned(equations: Equations, method: Integrator, unroll: int, fill: float) -> tuple[Equations, SparsePlan | None]:
    """Return the equations of the step, and the elimination program of a step in loops."""
    # a Taylor step writes out neither large networks nor inertia without links; other steps not too many operations
    size = {edge: sum(int(sp.count_ops(e)) for e in edge.rhs) for edge in equations.edges}
    on_links = sum(size[edge] for _, edge in equations.linked()) if equations.n <= LARGEST_UNROLLED else 0
    alone = method.series and (is_large(equations) or (equations.inertial and not equations.link_count))
    looped = equations.n > unroll or alone or (not method.inexact and on_links > MOST_OF_LINKS)
    if not looped:
        return equations, None
    if method.inexact:
        raise ValueError(f"integrator {method.name}: steps at most {unroll} nodes, found {equations.n}; use rodas5p")
    if method.implicit and any(len(pairs) > LINK_LIMIT for _, pairs in equations.fields):
        raise ValueError(
            f"integrator {method.name}: found a mean field of {equations.n} nodes, whose Jacobian has an entry for each pair; "
            f"expected at most {LINK_LIMIT} pairs; use dop853 or taylor"
        )
    equations = equations.without_fields() if method.implicit else equations
    return equations, program(equations, fill, method.implicit or equations.inertial)


def free_names(plain: Equations) -> Names:
    """Return a supply of names that differ from all symbols of the equations."""
    weights = [edge.weight.name for edge in plain.edges]
    states = [s.name for node in plain.nodes for s in node.state]
    return Names([*plain.state, *plain.parameters, *states, *plain.varied, *weights])


def _stages(
    plain: Equations, method: Integrator, names: Names, elimination: SparsePlan | None
) -> tuple[list[str], int, int]:
    """Write a step in stages; return its functions, its groups of scratch memory and its number of operations."""
    blocks = [analyse(node, names, plain.varied) for node in plain.nodes]
    arguments = ["t", "h", "y", "p", "y_new", "dense", "rtol", "atol"]
    scratch = 0
    writer: StepWriter
    if elimination is None:
        writer = UnrolledStep(plain, blocks, method)
        writer.write()
    else:
        writer = LoopedStep(plain, blocks, method, elimination)
        writer.write()
        # `workspace` counts the arrays that `write` has used
        scratch = workspace(writer, elimination)
        arguments += ["graph", "weights"]
    # the step calls the functions of nodes, so they come before it
    about = "One step from (t, y): writes y_new and the dense output, returns the error in units of the tolerance."
    step = Function("step", tuple(arguments), about, tuple(writer.statements), role=Role.ENTRY)
    functions = [f for k in range(len(blocks)) for f in node_functions(writer, blocks[k], k)]
    functions += dict.fromkeys(writer.functions)
    texts = [*map(LANES.function, functions), scaling(method)]
    texts += [driver.text("driver.sparse")] if elimination is not None and writer.solves else []
    return [*texts, LANES.function(step)], scratch, operations(step.body)


def node_functions(step: StepWriter, blocks: NodeBlocks, kind: int = 0) -> list[Function]:
    """Write the right-hand side of a node of one kind and, for an implicit step, its linearisation."""
    functions = [("node", "Right-hand side of one oscillator.", blocks.rhs)]
    if step.method.implicit:
        about = "Right-hand side of one oscillator and the parts of its Jacobian that move."
        functions.append(("node_linear", about, blocks.linear))
    written = []
    for name, about, body in functions:
        results = [e for e in body.results if not step.is_plain(e)]
        if results:
            arguments = [s.name for s in step.arguments(body, results)]
            written.append(node_function(function_name(name, kind), about, body, arguments, results))
    return written


def describe(
    equations: Equations,
    plain: Equations,
    method: Integrator,
    records: tuple[str, ...],
    count: int,
    more: str = "",
) -> str:
    """Write the docstring of a kernel module."""
    names = ((*eq.state, *eq.parameters) for eq in (equations, plain))
    swapped = tuple(f"{a} as {b}" for a, b in zip(*names, strict=True) if a != b)
    rows = [
        f"Generated kernel: {equations.n} oscillator{'s' * (equations.n > 1)}, {equations.link_count} links, {method.name}.",
        "",
        f"Equations   {equations.digest[:16]}",
        f"Integrator  {method.name}, order {method.order}: {method.source}",
        f"State       {_listed(equations.state)}",
        f"Parameters  {_listed(equations.parameters) or 'none'}",
        f"Records     {', '.join(('final state', *records))}",
        *([f"Modes       {more}"] if more else []),
        f"Step        {count} operations outside the node functions",
    ]
    if swapped:
        rows.append(f"Renamed     {_listed(swapped)}")
    return '"""' + "\n".join(rows) + '\n"""'


def _listed(names: tuple[str, ...]) -> str:
    """Join names by commas; shorten a list of more than 40 to the first six and the last three."""
    if len(names) <= 40:
        return ", ".join(names)
    return f"{', '.join(names[:6])}, … {', '.join(names[-3:])} ({len(names)} variables)"


def _cut(equations: Equations, section: sp.Expr) -> Recording:
    """Make a recording of the section function of the record 'section'."""
    section = section.xreplace({s: real(s.name) for s in section.free_symbols})
    used = {s.name for s in section.free_symbols}
    unknown = sorted(used - set(equations.state) - set(equations.parameters) - {"t"})
    if unknown:
        raise ValueError(f"section function {section}: unknown symbol {unknown[0]!r}; use the state, parameters and t")
    return Recording(sections=((section,),))
