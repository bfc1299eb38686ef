"""What a master stability function costs: many strengths along one orbit, and the same exponents by
JiTCODE.

"one orbit" is the friction oscillator's, with set-valued and with smoothed friction, or that of an
impact oscillator: CPU time of one drive period of an average over PERIODS of them, with all
strengths along it and their standard errors, one start, one thread, beside the same stretch of the
orbit by itself (the kernel of one oscillator, the same method and tolerance). `integrated`
strengths are carried along, the others interpolated; differences are those of the mean growth with
interpolation from that with every strength integrated, along a periodic orbit and by the same
steps. The largest one lies where a multiplier passes through zero and the exponent dips towards
-inf: there any relative accuracy of the propagators is lost in the logarithm.

"to an error bar" is the CPU time from the start of the transient until the standard error of every
exponent is below PRECISION, by the same estimate from batches; medians over several starts (of the
standard error: the largest), compilation apart.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from statistics import median
from unittest import mock

import numpy as np

from synchain import Lagrangian, Stop
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.plan import plan
from synchain.runtime.cells.run_keywords import Given
from synchain.runtime.engines.scene_kernels import kernel
from synchain.runtime.engines.step_control import control_array, tolerances
from synchain.runtime.stability.averages import Averaging, Batches
from synchain.runtime.stability.exponents import average, coupled_cell, exponents
from synchain.runtime.stability.interpolation import exact_interpolation
from synchain.runtime.stability.march import BlockInterpolation, March, interpolation_for
from synchain.runtime.stability.orbits import OrbitProblem, unit_of_time
from synchain.runtime.support.execution import Execution

from . import peers
from .kit.tables import markdown
from .peers import jitcode_transversal

COLUMNS = (
    "what",
    "system",
    "program",
    "alpha",
    "strengths",
    "integrated",
    "steps per period",
    "microseconds per period",
    "times the orbit alone",
    "largest difference",
    "median difference",
    "periods",
    "seconds",
    "exponent",
    "standard error",
)
LAWS = {
    "set-valued": "set-valued friction, omega = 1.4",
    "atan": "friction, omega = 1.4",
    "impact": "impact oscillators, omega = 0.8",
}
"""Contacts of the orbits, and what the table calls them."""
OMEGAS = {"set-valued": (1.4, 1.15), "atan": (1.4, 1.15), "impact": (0.8, 0.8)}
"""Frequencies of the orbit that is timed, and of the periodic one along which differences are taken."""
COUNTS = (1, 8, 100, 1_000, 10_000)
PERIODS, REVIEWED = 1_000, 128
"""Periods that are timed, and those over which differences are taken."""
SIDE = 60
"""Strengths a side of the plane, alpha from 0 to 1.2 and beta from 0 to 0.6; negative beta would
say the same again.
"""
PEER = "jitcode_lsoda"  # needs the same packages as JiTCODE's transversal exponents
RTOL = 1e-6
SETTLED, LONGEST = 300, 1e6
PRECISION = 5e-3
LOOSE = 5e-2
BY_ORBIT = 1e12
"""Tolerance ratio so large that modes never limit the step."""
BLAS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables of the environment that BLAS libraries take their number of threads from."""

ORBIT, TO_ERROR = "one orbit", "to an error bar"
nan = math.nan
Row = tuple[object, ...]


@dataclass(frozen=True, slots=True)
class Case:
    """A pair of oscillators, three strengths, the range of a thousand, and the peer's method: the
    fastest that it has.

    `block` is the time between two renormalisations in units of `unit`, as long as this program's
    own.
    """

    name: str
    given: dict[str, object]
    alphas: tuple[float, ...]
    highest: float
    method: str
    block: int

    @property
    def scene(self) -> Scene:
        """Two oscillators."""
        return Scene(topology=topology("chain", 2), record=(), **self.given)  # type: ignore[arg-type]


CASES = (
    Case("friction, omega = 1.4", {"parameters": {"omega": 1.4}}, (0.2, 0.5, 1.0), 1.2, "lsoda", 4),
    Case("rossler, x->x", {"oscillator": "rossler", "coupling": "x->x"}, (0.2, 1.0, 4.4), 6.0, "dopri5", 1),
)


def notes() -> list[str]:
    """A line for the peer where it cannot run, with the reason and the remedy."""
    return peers.skipped([PEER])


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes few strengths and a
    loose error bar.
    """
    rows = [row for contact in LAWS for row in _one_thread(orbit_rows, contact, quick)]
    for case in CASES[:1] if quick else CASES:
        rows += _one_thread(_own_rows, case, quick)
        if peers.present([PEER]):
            rows += _one_thread(_peer_rows, case, quick)
    return rows


def _one_thread(function: Callable[..., list[Row]], *arguments: object) -> list[Row]:
    """Call a function in a process whose linear algebra has one thread; waiting threads would count
    as CPU time.
    """
    with mock.patch.dict(os.environ, dict.fromkeys(BLAS, "1")), ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def strengths(count: int) -> np.ndarray:
    """Real strengths 0 … 1.2, so many; 0: the plane."""
    if count:
        return np.linspace(0.0, 1.2, count) if count > 1 else np.array([0.5])
    return (np.linspace(0.0, 1.2, SIDE)[:, None] + 1j * np.linspace(0.0, 0.6, SIDE)).reshape(-1)


def orbit_rows(contact: str, quick: bool) -> list[Row]:
    """The orbit by itself, then with more and more strengths; timed in turn, the best of several
    rounds.
    """
    periods, reviewed, rounds = (64, 16, 2) if quick else (PERIODS, REVIEWED, 12)
    chosen = [strengths(count) for count in ((1, 100) if quick else (*COUNTS, 0))]
    ready = [_ready(contact, OMEGAS[contact][0], values, periods) for values in chosen]
    alone = _alone(*ready[0], periods)
    best, steps = [math.inf] * (1 + len(ready)), [0.0] * (1 + len(ready))
    runs: list[Callable[[], int]] = [alone, *(partial(_along, *pair, periods) for pair in ready)]
    for _ in range(rounds):
        for k, run in enumerate(runs):
            begin = time.process_time()
            steps[k] = run() / periods
            best[k] = min(best[k], (time.process_time() - begin) / periods)
    what = (ORBIT, LAWS[contact], "synchain")
    rows: list[Row] = [(*what, "", 0, 0, steps[0], 1e6 * best[0], 1.0, nan, nan, periods, nan, nan, nan)]
    for k, ((march, _), values) in enumerate(zip(ready, chosen, strict=True), 1):
        plane = np.iscomplexobj(values)
        given = ("0 … 1.2, beta 0 … 0.6", f"{SIDE} x {SIDE}") if plane else (_span(values), len(values))
        integrated = len(march.integrator.order) // march.problem.components
        off = difference(contact, values, reviewed)
        cost = (steps[k], 1e6 * best[k], best[k] / best[0], *off, periods, nan, nan, nan)
        rows.append((*what, *given, integrated, *cost))
    return rows


def _span(values: Sequence[float] | np.ndarray) -> str:
    """The only strength, or the first and the last."""
    return f"{values[0]:g}" if len(values) == 1 else f"{values[0]:g} … {values[-1]:g}"


def _impact_pair() -> Scene:
    """Two oscillators with a stop at 0.6 and restitution 0.7; one impact a period at omega = 0.8."""
    oscillator = Lagrangian(
        "v**2/2",
        "x**2/2",
        {"x": "cos(omega*t)/2 - v/10"},
        coordinates={"x": "v"},
        parameters={"omega": 0.8},
        events=[Stop("3/5 - x", "7/10")],
        initial={"x": 0.4, "v": -0.5},
    )
    return Scene(oscillator, "spring", topology("chain", 2), record=())


def _settled(contact: str, omega: float, values: np.ndarray) -> tuple[OrbitProblem, np.ndarray]:
    """Modes along one orbit, and its state (1, components) after the transient."""
    pair = _impact_pair() if contact == "impact" else Scene(topology=topology("chain", 2), record=(), contact=contact)
    scene = coupled_cell(Given(exponents, {"omega": omega}), pair, RTOL)
    start = np.array([[numbers[0] for numbers in scene.initial.values()]])
    problem = OrbitProblem.of_modes(scene, values, start, workers=1)
    return problem.settled(problem.with_slip_states(start), SETTLED)


def _ready(contact: str, omega: float, values: np.ndarray, periods: int) -> tuple[March, np.ndarray]:
    """A march for an average over some periods, and the state (1, components) at its begin."""
    problem, state = _settled(contact, omega, values)
    return March.begin(problem, state, interpolation_for(problem, state, periods)), state


def _along(march: March, state: np.ndarray, periods: int) -> int:
    """Average from the settled state with all strengths; returns the steps of the orbit."""
    carrier = march.integrator
    carrier.state, before = state.copy(), carrier.steps
    averaging = Averaging(0.0, periods, 0.0, 0, Execution(1, show_progress=False))
    with averaging.reporter() as reporter:
        average(march, averaging, reporter)
    return carrier.steps - before


def _alone(march: March, state: np.ndarray, periods: int) -> Callable[[], int]:
    """A function that runs the same stretch of the orbit without modes and returns its steps."""
    problem = march.problem
    scene = problem.scene.lone.replace(
        record=(), integrator=problem.method.name, rtol=RTOL, transient=0.0, window=periods, time_unit="period"
    )
    cells, compiled = plan(scene), kernel(scene, 1, reduce=False)
    rtol, atol = (float(own.min()) for own in tolerances(scene, scene.equations, cells.numbers))
    control = control_array(rtol, atol, 0.5 * problem.unit, scene.max_steps, jumps=False)

    def run() -> int:
        buffers = Buffers.empty(1, state.shape[1], room=0, samples=0)
        compiled.drive(0, 1, state, cells.numbers, cells.spans, control, *buffers.arrays())
        return int(buffers.counts[0, 1:3].sum())

    run()
    return run


def difference(contact: str, values: np.ndarray, periods: int) -> tuple[float, float]:
    """The largest and the median difference of mean growth, with strengths interpolated and with
    all of them integrated.

    Along a periodic orbit, over so many periods.  The orbit alone chooses the
    steps of both, so that nothing but the interpolation tells them apart.
    """
    problem, state = _settled(contact, OMEGAS[contact][1], values)
    chosen, sums = interpolation_for(problem, state, periods), []
    for interpolation in (chosen.strengths, exact_interpolation(values)):
        march = March.begin(problem, state, BlockInterpolation(chosen.block, interpolation), BY_ORBIT)
        sums.append(march.growths(np.full(1, round(periods / march.block)))[0, 0])
    gaps = np.abs(sums[0] - sums[1]) / (periods * problem.unit)
    return float(gaps.max()), float(np.median(gaps))


def _own_rows(case: Case, quick: bool) -> list[Row]:
    """One strength after the other, then a thousand together."""
    many = np.linspace(0.0, case.highest, 1_000)
    return [_own_row(case, values, quick) for values in ([a] for a in case.alphas)] + [_own_row(case, many, quick)]


def _own_row(case: Case, values: Sequence[float] | np.ndarray, quick: bool) -> Row:
    options = {"transient": SETTLED, "starts": 1, "rtol": RTOL, "workers": 1, "show_progress": False}
    exponents(case.scene, values, precision=1.0, periods=64, **options)  # type: ignore[arg-type]  # compiles
    found = []
    for scene in _starts(case, quick):
        begin = time.process_time()
        one = exponents(scene, values, precision=_bar(quick), periods=LONGEST, **options)  # type: ignore[arg-type]
        unit = unit_of_time(scene)
        found.append((time.process_time() - begin, one.time / unit, float(one.exponent[0]), float(one.stderr.max())))
    return _timed(case, "synchain", values, found)


def _peer_rows(case: Case, quick: bool) -> list[Row]:
    growths = jitcode_transversal.prepare(case.scene, case.method, RTOL)
    rows = []
    for alpha in case.alphas:
        found = []
        for scene in _starts(case, quick):
            begin = time.process_time()
            batches = _averaged(growths, case, scene, alpha, _bar(quick))
            mean, error = float(batches.mean()[0, 0]), float(batches.error()[0])
            found.append((time.process_time() - begin, batches.periods, mean, error))
        rows.append(_timed(case, f"JiTCODE {case.method}", [alpha], found))
    return rows


def _averaged(growths: jitcode_transversal.Growths, case: Case, scene: Scene, alpha: float, bar: float) -> Batches:
    """Batches of growth up to the error bar, as `exponents` takes them."""
    unit = unit_of_time(scene)
    start = np.array([numbers[0] for numbers in scene.initial.values()])
    batches = Batches(unit, case.block)
    blocks = growths(alpha, start, case.block * unit, SETTLED // case.block)
    averaging = Averaging(bar, LONGEST, 0.0, 0, Execution(1, show_progress=False))
    with averaging.reporter() as reporter:
        for _ in averaging.rounds(batches, batches.error, reporter):
            batches.add(np.array([[next(blocks)]]))
    return batches


def _bar(quick: bool) -> float:
    return LOOSE if quick else PRECISION


def _starts(case: Case, quick: bool) -> list[Scene]:
    """The scene from starts that differ in the first component."""
    scene, moved = case.scene, (0.0,) if quick else (0.0, 0.1, 0.2, 0.3, 0.4)
    first, *_ = scene.components
    initial = {name: values[0] for name, values in scene.initial.items()}
    return [scene.replace(initial={**initial, first: initial[first] + shift}) for shift in moved]


def _timed(
    case: Case, program: str, values: Sequence[float] | np.ndarray, found: list[tuple[float, float, float, float]]
) -> Row:
    seconds, length, exponent = (median(one[k] for one in found) for k in range(3))
    cost = 1e6 * sum(one[0] for one in found) / sum(one[1] + SETTLED for one in found)
    shown = exponent if len(values) == 1 else nan
    rest = (nan, cost, nan, nan, nan, length, seconds, shown, max(one[3] for one in found))
    return (TO_ERROR, case.name, program, _span(values), len(values), "", *rest)


def summary(rows: Sequence[Sequence[object]]) -> str:
    """A second table in Markdown: the peer's time for one value of alpha over this program's, alone
    and among a thousand.
    """
    known = [dict(zip(COLUMNS, row, strict=True)) for row in rows if row[0] == TO_ERROR]
    made = []
    for other in [row for row in known if row["program"] != "synchain"]:
        own = [row for row in known if row["program"] == "synchain" and row["system"] == other["system"]]
        (alone,) = (_number(row["seconds"]) for row in own if row["alpha"] == other["alpha"])
        many = _number(own[-1]["seconds"]) / _number(own[-1]["strengths"])
        theirs = _number(other["seconds"])
        made.append((other["system"], other["alpha"], theirs, alone, theirs / alone, 1e3 * many, theirs / many))
    columns = (
        "system",
        "alpha",
        "JiTCODE, seconds",
        "synchain, seconds",
        "ratio",
        "synchain, one of a thousand, milliseconds",
        "ratio",
    )
    return markdown(columns, made) if made else "No peer to compare with."


def _number(value: object) -> float:
    return float(str(value))
