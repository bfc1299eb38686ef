"""Hard cases: is every end state right to a hundred tolerances, or does its status or a warning say
why not?

The error is the largest over all components; allowed are 100 (atol + rtol size) and what the
reference itself may be off, size the largest component of the end state, times the growth of a small
change where a case states one. The energy residual is
E(end) - E(0) - W over the larger of |E(0)|, |E(end)| and 1, with the work W of drives and friction
integrated as one more state of every oscillator.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from tqdm import tqdm

from synchain.runtime.support.status import Status
from synchain.runtime.sweeps.run import run

from .kit.stability_cases import Case, cases
from .kit.stability_energy import energy_residual
from .kit.stability_reference import FLOOR, end_state

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    "group",
    "case",
    "rtol",
    "rtol used",
    "status",
    "steps",
    "rejected",
    "error",
    "allowed",
    "energy residual",
    "verdict",
)
SAFETY = 100.0
"""How many tolerances an end state may be off."""
TWICE = 1000
"""Most oscillators of a case that is integrated a second time, for its energy; nor are cases of a
million periods.
"""
UNBALANCED = ("long", "said", "singular", "links", "masses", "units", "events")
"""Groups without an energy, or of a million periods."""
Row = tuple[Any, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes a third of the cases."""
    chosen = list(cases(quick))
    pause = 0.1 if sys.stderr.isatty() else 30.0
    return [row(case) for case in tqdm(chosen, "stability", unit="case", mininterval=pause, disable=quick)]


def row(case: Case) -> Row:
    """Run one case and compare it with its reference."""
    found = run(case.scene, reduce=case.skip, show_progress=False)
    status = Status(int(found.status))
    end = found.states("end")
    expected = end_state(case.scene, case.reference) if status == Status.FINISHED else np.full(len(end), math.nan)
    error = float(np.abs(end[: len(expected)] - expected).max())
    size = float(np.abs(expected).max())
    rtol, atol = float(found.data["rtol_used"]), float(found.data["atol_used"])
    allowed = case.growth * (SAFETY * (atol + rtol * size) + FLOOR[case.reference] * max(size, 1.0))
    twice = case.group not in UNBALANCED and case.scene.n <= TWICE
    balanced = status == Status.FINISHED and twice
    residual = energy_residual(case.scene, end) if balanced else math.nan
    return (
        case.group,
        case.name,
        case.scene.rtol,
        rtol,
        status.name,
        int(found.steps),
        int(found.rejected),
        error,
        allowed,
        residual,
        _verdict(status, error, allowed, any("add up" in words for words in case.scene.warnings)),
    )


def _verdict(status: Status, error: float, allowed: float, warned: bool = False) -> str:
    if status != Status.FINISHED:
        return "says so"
    if error <= allowed:
        return "right"
    return "warned" if warned else "WRONG"


def summary(rows: list[Row]) -> str:
    """How many cases are right, say that they are not, and are wrong; and the largest error in
    units of what is allowed.
    """
    table = [dict(zip(COLUMNS, r, strict=True)) for r in rows]
    verdicts = [r["verdict"] for r in table]
    right = [r for r in table if r["verdict"] == "right"]
    words = ", ".join(f"{verdicts.count(word)} {word}" for word in ("right", "says so", "warned", "WRONG"))
    if not right:
        return words
    worst = max(right, key=lambda r: r["error"] / r["allowed"])
    share, energy = worst["error"] / worst["allowed"], max(right, key=_imbalance)
    return (
        f"{words}; nearest to its limit: {worst['group']}, {worst['case']}, "
        f"rtol = {worst['rtol']:g}: {share:.2g} of it; "
        f"largest energy residual: {energy['group']}, {energy['case']}: {_imbalance(energy):.2g} of {SAFETY:g} rtol"
    )


def _imbalance(r: dict[str, Any]) -> float:
    """The energy residual of a case over what its tolerance lets expect; 0 where there is none."""
    residual = abs(r["energy residual"])
    return 0.0 if math.isnan(residual) else float(residual / (SAFETY * r["rtol used"]))


def draw(rows: list[Row]) -> Figure:
    """Error and energy residual against what is allowed, one mark a case."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.9), layout="constrained")
    error, energy = figure.subplots(1, 2)
    table = [dict(zip(COLUMNS, r, strict=True)) for r in rows]
    for k, group in enumerate(dict.fromkeys(r["group"] for r in table)):
        own = [r for r in table if r["group"] == group and r["status"] == "FINISHED"]
        marks = {"marker": "osvD^<>pXh"[k % 10], "linestyle": "", "markersize": 4}
        error.loglog([r["allowed"] for r in own], [max(r["error"], 1e-18) for r in own], label=group, **marks)
        known = [r for r in own if not math.isnan(r["energy residual"])]
        sizes = [max(abs(r["energy residual"]), 1e-18) for r in known]
        energy.loglog([SAFETY * r["rtol used"] for r in known], sizes, **marks)
    for axes, name, ends in ((error, "error", [1e-13, 1e9]), (energy, "energy residual", [1e-12, 1e2])):
        axes.loglog(ends, ends, color="black", linewidth=0.8)
        axes.set(xlabel="allowed", ylabel=name)
    error.legend(fontsize=7)
    return figure
