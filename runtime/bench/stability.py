"""Hard cases: is every end state right to a hundred tolerances, or does its status or a warning say why not?

The error is the largest over all components; allowed are 100 (atol + rtol size) and what the reference itself may be off,
size the largest component of the end state.  The energy residual is E(end) - E(0) - W, with the work W of all
forces but the springs' integrated as one more state.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from synchain.codegen.emit import emit
from synchain.codegen.load import load
from synchain.models.equations import Equations, Node
from synchain.models.scene import Scene

from ..plan import control_array, plan, tolerances
from ..result import Buffers
from ..status import Status
from ..sweep import run
from ._stability_cases import BUDGET, Case, cases
from ._stability_reference import FLOOR, end_state

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COLUMNS", "SAFETY", "draw", "energy_residual", "measure", "row", "summary"]

COLUMNS = (
    "group", "case", "rtol", "status", "steps", "rejected", "error", "allowed", "energy residual", "verdict",
)  # fmt: skip
SAFETY = 100.0
"""How many tolerances an end state may be off."""
Row = tuple[Any, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes a third of the cases."""
    return [row(case) for case in cases(quick)]


def row(case: Case) -> Row:
    """Run one case and compare it with its reference."""
    found = run(case.scene, skip=case.group == "long", show_progress=False)
    status = Status(int(found.status))
    end = found.end.values
    expected = (
        end_state(case.scene, case.reference) if status == Status.FINISHED else np.full(2 * case.scene.n, math.nan)
    )
    error = float(np.abs(end[: len(expected)] - expected).max())
    size = float(np.abs(expected).max())
    rtol, atol = found.data.attrs["rtol_used"], found.data.attrs["atol_used"]
    allowed = SAFETY * (atol + rtol * size) + FLOOR[case.reference] * max(size, 1.0)
    residual = energy_residual(case.scene) if case.group in ("steepness", "law", "start") else math.nan
    return (
        case.group, case.name, case.scene.rtol, status.name, int(found.steps), int(found.rejected), error, allowed,
        residual, _verdict(status, error, allowed, any("add up" in words for words in case.scene.warnings)),
    )  # fmt: skip


def _verdict(status: Status, error: float, allowed: float, warned: bool = False) -> str:
    if status != Status.FINISHED:
        return "says so"
    if error <= allowed:
        return "right"
    return "warned" if warned else "WRONG"


def energy_residual(scene: Scene) -> float:
    """E(end) - E(0) - W of one oscillator, E = (x^2 + v^2)/2, at the scene's tolerance; NaN where it did not finish."""
    node = scene.equations.node
    position, velocity = node.state
    work = sp.Symbol("work", real=True)
    rates = (*node.rhs, velocity * (node.rhs[1] + position))
    whole = Equations(Node((*node.state, work), rates, node.parameters), None, 1)
    cells = plan(scene)
    limits = tolerances(scene, cells.numbers)
    start = np.hstack([cells.start, np.zeros((1, 1))])
    control = control_array(*limits, math.inf, BUDGET)
    buffers = Buffers.empty(1, 3, 0, 0)
    load(emit(whole, "rodas5p", ())).drive(0, 1, start, cells.numbers, cells.spans, control, *buffers.arrays())
    if buffers.counts[0, 0] != Status.FINISHED:
        return math.nan
    energies = [0.5 * (state[0] ** 2 + state[1] ** 2) for state in (start[0], buffers.end[0])]
    return float(energies[1] - energies[0] - buffers.end[0, 2])


def summary(rows: list[Row]) -> str:
    """How many cases are right, say that they are not, and are wrong; and the largest error in units of what is allowed."""
    verdicts = [r[-1] for r in rows]
    worst = max((r for r in rows if r[-1] == "right"), key=lambda r: r[6] / r[7], default=None)
    words = ", ".join(f"{verdicts.count(word)} {word}" for word in ("right", "says so", "warned", "WRONG"))
    if worst is None:
        return words
    return (
        f"{words}; nearest to its limit: {worst[0]}, {worst[1]}, rtol = {worst[2]:g}: {worst[6] / worst[7]:.2g} of it"
    )


def draw(rows: list[Row]) -> Figure:
    """Error and, for one group, energy residual against what is allowed, one mark a case."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    error, energy = figure.subplots(1, 2)
    for k, group in enumerate(dict.fromkeys(r[0] for r in rows)):
        own = [r for r in rows if r[0] == group and r[3] == "FINISHED"]
        marks = {"marker": "osvD^<>pX"[k % 9], "linestyle": "", "markersize": 4, "label": group}
        error.loglog([r[7] for r in own], [max(r[6], 1e-18) for r in own], **marks)
        if group == "steepness":  # elsewhere energies are of all sizes
            energy.loglog([r[7] for r in own], [max(abs(r[8]), 1e-18) for r in own], **marks)
    ends = np.array([1e-13, 1e9])
    for axes, name in ((error, "error"), (energy, "energy residual")):
        axes.loglog(ends, ends, color="black", linewidth=0.8)
        axes.set(xlabel="allowed", ylabel=name)
    error.legend(fontsize=7)
    return figure
