"""Work and precision: time per drive period and core against the error of the state, for this
program and its peers.

The cases are those of `kit/cases.py` and `kit/computed.py`; the unit of time is the drive's period,
or 2 pi without a drive.  The error is the largest over all components of the state at the case's
times; the exact law of friction is measured against its own solution.  Timed runs have one reading
time at their end and are long, so that calls and restarts are no part of the times; reading many
times is another table, `dense`.  "cash_karp" at 1e-12 and 1e-15 is the source paper's method and
tolerances through this program's own kernel; one lane is the scalar kernel. Peers are the files of
`peers/`; one that is not installed is named and left out, and none has events. Times are CPU times
of one core, per period and trajectory, compilation apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from synchain.codegen.simd.lane_types import native_width
from synchain.codegen.taylor import taylor_obstacle

from . import peers
from .kit.cases import CASES as STORED
from .kit.cases import Case, read_case
from .kit.clock import Point, curve
from .kit.computed import EXACT, SMOOTH, computed_case
from .kit.own_program import REFILLS, Own, prepare

__all__ = [
    "CASES",
    "COLUMNS",
    "METHODS",
    "Method",
    "case_of",
    "draw",
    "measure",
    "notes",
    "own_points",
    "prepare",
    "row",
    "summary",
]

CASES = (*STORED, *SMOOTH, *EXACT)
"""Names of the cases."""

COLUMNS = (
    "case",
    "method",
    "lanes",
    "rtol",
    "atol",
    "error",
    "microseconds per period",
    "steps per period",
    "periods",
    "compile seconds",
    "remark",
)
LADDER = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
PAPER = (1e-12, 1e-15)
"""The source paper's (rtol, atol) of Cash-Karp."""


@dataclass(frozen=True, slots=True)
class Method:
    """Rows of the benchmark: an integrator of this program with full lanes or one.

    `longest` are the periods beyond which its error is not compared.
    """

    integrator: str
    full: bool
    tolerances: tuple[tuple[float, float], ...]
    longest: int = 100

    def suits(self, case: Case) -> bool:
        """False where the method is not to the point.

        Stability holds explicit methods back on stiff cases; implicit ones and the paper's serve
        the smoothed law; power series need functions without jumps between events.
        """
        if self.integrator in EXPLICIT:
            return not case.stiff and (self.integrator != "taylor" or taylor_obstacle(case.scene.equations) is None)
        return case.smoothed


EXPLICIT = ("dop853", "taylor")
TOLERANCES = tuple((rtol, 0.1 * rtol) for rtol in LADDER)
METHODS = (
    Method("cash_karp", False, (PAPER,), longest=10),
    *(Method(name, full, TOLERANCES) for name in ("rodas5p", *EXPLICIT) for full in (False, True)),
)
"""This program's rows."""


def case_of(name: str) -> Case:
    """Return the case of that name; ValueError for an unknown one."""
    return computed_case(name) if name in (*SMOOTH, *EXACT) else read_case(name)


def notes() -> list[str]:
    """A line for each peer that cannot run here, with the reason and the remedy."""
    return peers.skipped()


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    present = peers.present()
    rows: list[tuple[object, ...]] = []
    with tqdm(total=len(CASES) * (1 + len(present)), unit="curve", disable=None) as bar:
        for name in CASES:
            case = case_of(name)
            bar.set_description_str(name)
            rows += [row(case, point) for point in own_points(case, quick)]
            bar.update()
            for peer in present:
                if name not in EXACT:
                    rows += [row(case, point) for point in curve(peer, case, quick)]
                bar.update()
    return rows


def own_points(case: Case, quick: bool) -> Iterator[Point]:
    """Yield this program's points of a case."""
    for method in METHODS:
        if not method.suits(case):
            continue
        lanes, cells = (None, REFILLS * native_width(2)) if method.full else (1, 1)
        own = Own.compiled(case, method.integrator, lanes, cells, min(case.periods, method.longest))
        for rtol, atol in method.tolerances[::3] if quick else method.tolerances:
            yield own.point(rtol, atol, quick)


def row(case: Case, point: Point) -> tuple[object, ...]:
    """A point of a case in the order of COLUMNS."""
    steps = "" if np.isnan(point.steps) else point.steps
    return (
        case.name,
        point.method,
        point.lanes,
        point.rtol,
        point.atol,
        point.error,
        1e6 * point.seconds,
        steps,
        point.periods,
        point.compile,
        point.remark,
    )


def summary(rows: list[tuple[object, ...]]) -> str:
    """A second table in Markdown: time of every method at the same error, and its ratio to the full
    lanes.
    """
    from .kit.compare import table

    return table([dict(zip(COLUMNS, row, strict=False)) for row in rows], own={method.integrator for method in METHODS})


def draw(rows: list[tuple[object, ...]]) -> object:
    """A figure with one panel a case: time against error, a curve for each method."""
    from .kit.figure import figure

    return figure(
        [dict(zip(COLUMNS, row, strict=False)) for row in rows], own={method.integrator for method in METHODS}
    )
