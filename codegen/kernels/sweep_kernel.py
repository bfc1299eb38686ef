"""Write the text of a sweep kernel.

`emit` passes its arguments through six stages; the output of each stage is an input of the next ones:

1. Check (`Recording.check`): raise ValueError for records that are unknown, lack an argument or exclude each other.
2. Plan (`_planned`): Equations, integrator -> Equations, SparsePlan or None. A plan means that a step runs in loops
   over nodes and links; None means that the step is written out.
3. Rename (`NamedEquations`): Equations -> the same with names that are valid in Python, and a supply of unused names.
4. Write the step (`_stages`, or `codegen/taylor`): equations, plan -> functions as text, the groups of scratch memory
   that they use, and the number of operations of a step.
5. Choose the driver: the operations give the number of lanes; the lanes and the kind of step give the fixed text
   (`Driver`) that calls the functions.
6. Assemble: functions of steps, pushes, sections and observed values -> a module (`module`), its docstring
   (`describe`) and the sizes of its arrays (`Dimensions`): one SweepKernel, which `machine_code/compile.py` compiles.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import angular_frequency
from synchain.models.graphs.links import LINK_LIMIT

from .. import driver
from ..driver.dimensions import Dimensions
from ..integrators import Integrator, integrator
from ..program.passes import Names
from ..program.printers import LANES
from ..program.statements import Function, Role, operations
from ..simd import lanes
from ..steps.blocks import NodeBlocks, analyse
from ..steps.contact_step import push_functions
from ..steps.looped_step import LoopedStep
from ..steps.row_step import contact_groups, most_rows, row_count, row_functions
from ..steps.sparse_plan import FILL_LIMIT, SparsePlan, sparse_plan
from ..steps.step import StepWriter, function_name, node_function, scaling
from ..steps.unrolled_step import UnrolledStep
from ..taylor import is_large, write_looped, write_rolled, write_step
from .driver import RECORDERS, Driver, KernelKind, Recorder
from .kernel_text import KernelSource, NamedEquations, describe, module
from .observable_functions import SYNC_ERROR, Recording, count_of, rule_of

AUTO = "rodas5p"  # the integrator for "auto"
# Largest number of nodes whose steps are written out by default; steps of larger networks run in loops.
LARGEST_UNROLLED = 8

# Largest number of nodes whose steps are written out if the nodes carry deviations (`lift.lifted`). Measured on rings
# of 5 to 8 Stuart-Landau oscillators: loops compile 2 to 6 times faster and run as fast within 10 %.
LARGEST_UNROLLED_LIFT = 4

MOST_OF_LINKS = 1000  # largest number of operations of all links in a written-out step; more take minutes to compile


@dataclass(frozen=True, slots=True)
class SweepKernel(KernelSource):
    dimensions: Dimensions = field(repr=False)
    multiplicity: tuple[int, ...] = field(repr=False)  # number of oscillators that each node represents
    # points inside a step at which functions of the state are evaluated, with their weights (`rule_of`)
    rule: tuple[tuple[float, ...], ...] = field(repr=False)
    # integer arrays that the loops of a step read; None if the step is written out
    elimination: SparsePlan | None = field(default=None, repr=False, compare=False)

    @property
    def functions(self) -> tuple[str, ...]:
        sizes = self.dimensions
        wanted = {
            "step": True,
            "pushes": self.driver.contacts,
            "strike": self.driver.rows,
            "section": sizes.sections or sizes.stops,
            "values": sizes.observed,
        }
        return tuple(name for name, called in wanted.items() if called)

    @property
    def arguments(self) -> tuple[Any, ...]:
        loops = self.elimination
        network = () if loops is None else (loops.arrays, loops.weights)
        return self.dimensions, np.array(self.multiplicity, np.float64), np.array(self.rule), network

    @property
    def recorders(self) -> tuple[Recorder, ...]:
        """Recorders that the records of the scene need."""
        sizes = self.dimensions
        wanted = sizes.stops, sizes.components, sizes.sections, sizes.observed, sizes.sampled
        return tuple(self.driver.recorder(name) for name, needed in zip(RECORDERS, wanted, strict=True) if needed)

    @property
    def shared(self) -> tuple[Driver | Recorder, ...]:
        return (self.driver, *self.recorders)

    @property
    def looped(self) -> bool:
        """True if the steps run in loops over nodes and links, False if they are written out."""
        return self.elimination is not None


def emit(
    equations: Equations,
    method: str | Integrator = "auto",
    recording: Recording = SYNC_ERROR,
    width: int | None = None,
    *,
    unroll: int = LARGEST_UNROLLED,
    fill: float = FILL_LIMIT,
) -> SweepKernel:
    """Write the kernel of these equations for one integrator, one recording and one lane width."""
    method = AUTO if method == "auto" else method
    method = integrator(method) if isinstance(method, str) else method
    # stage 1: the records
    recording.check(equations)
    # stages 2 and 3: the plan and the names of the kernel
    equations, elimination = _planned(equations, method, unroll, fill)
    named, looped = NamedEquations.of(equations), elimination is not None
    plain, names = named.plain, named.free()
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
    chosen = Driver(KernelKind.SWEEP, width, looped, plain.sticks, method.series, plain.has_rows)
    # stage 6: events and observed values, constants, sizes
    written = row_functions if plain.has_rows else push_functions
    events = [*written(plain, names, looped), *recording.functions(named)]
    rows, felt = row_count(plain), most_rows(plain) if plain.has_rows else 0
    functions += [driver.text("driver.dense")] if recording.has_functions else []
    functions += [driver.text("driver.slope")] if recording.has_rates else []
    constants = {
        "WIDTH": width,
        "DENSE": bool(recording.records) or recording.has_functions or (plain.sticks and not method.series),
        "SERIES": method.series,
    }
    if looped:
        constants |= {"NODES": plain.n, "DIMENSION": plain.dimension, "DENSE_ROWS": method.dense_rows}
    compares = "sync_error" in recording.records
    return SweepKernel(
        describe(named, method, recording.summary(equations), count),
        module({**constants, **recording.tables(equations)}, functions, events),
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
            components=len(plain.compared) if compares else 0,
            observed=count_of(equations, recording.observed),
            gaps=count_of(equations, recording.gaps),
            depths=count_of(equations, recording.depths),
            sections=len(recording.event_sections),
            kept=recording.kept,
            sampled=int("trajectory" in recording.records) << int(recording.own_times),
            stops=int(recording.stop is not None),
            rows=rows,
            felt=felt,
            contacts=contact_groups(plain),
            events=int("events" in recording.records),
        ),
        recording.multiplicity if compares and recording.multiplicity is not None else (1,) * equations.n,
        rule_of(method),
        elimination,
    )


# Largest number of operations of a step in two registers. Such a step has about 6000 instructions, as many as a
# processor keeps decoded. `python -m benchmarks methods` times both widths: a longer step is up to a seventh faster in
# one register.
MOST_DECODED = 2200


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
    if equations.joined and (equations.n > unroll or method.inexact):
        unroll = max(unroll, equations.n)
    looped = equations.n > unroll or alone or (not method.inexact and on_links > MOST_OF_LINKS)
    if not looped:
        return equations, None
    if method.inexact:
        raise ValueError(f"integrator {method.name}: steps at most {unroll} nodes, found {equations.n}; use rodas5p")
    if method.implicit and equations.triadic:
        raise ValueError(
            f"integrator {method.name}: found links of three ends between {equations.n} nodes; expected at most {unroll} nodes; "
            "use dop853 or taylor"
        )
    if method.implicit and any(len(pairs) > LINK_LIMIT for _, pairs in equations.fields):
        raise ValueError(
            f"integrator {method.name}: found a mean field of {equations.n} nodes, whose Jacobian has an entry for each pair; "
            f"expected at most {LINK_LIMIT} pairs; use dop853 or taylor"
        )
    equations = equations.without_fields() if method.implicit else equations
    return equations, sparse_plan(equations, fill, method.implicit or equations.inertial)


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
        loops = LoopedStep(plain, blocks, method, elimination)
        loops.write()
        writer, scratch = loops, loops.workspace
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
