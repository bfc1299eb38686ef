"""Advance the starts of a basin from window to window, and decide the end of each.

1. *Looks*: starts that are certain to synchronise end at parts of the transient.
2. *Windows*: observables over a window at half of the transient, and over the window at its end.
3. *Verdicts*: an attractor that both windows name; groups of other motions that do not change; else undecided.
4. *Doublings*: if no transient was given, undecided starts go on from where they are, each time twice as long.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from synchain.codegen.driver.columns import SpanColumn
from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from ..cells.plan import CellRows, Planner
from ..cells.reduce import reduce_scene
from ..cells.run_keywords import with_numbers
from ..results.certificate import Certificate
from ..support.execution import Execution
from ..support.status import Status
from ..sweeps.certify import certify
from .attractors import REST, SETTLED, STILL, SYNCHRONOUS, Attractors, groups_of
from .criterion import AppliedCriterion, errors, final_errors
from .starts import Starts
from .trials import Outcome, Trials

LONGEST = 5000.0
"""Longest average of the exponent, in units of time of the exponent (a choice)."""

LOOKS, FIRST, LATER = (1 / 16, 1 / 8, 1 / 4), 1 / 2, (5 / 8, 3 / 4)
"""Parts of the transient after which starts that are certain to synchronise end; FIRST: end of the first window (a
choice)."""

NEAR, CHANCE = 1e-3, 1e-6
"""A start ends early if its error is below NEAR times the tolerance, the exponent is certainly negative, and the error
grows to the tolerance again with at most the probability CHANCE (choices)."""

UNLUCKY = 4.0
"""Standard deviations by which an error may fall more slowly than the exponent says (a choice)."""

REPRESENTED = 1000
"""Number of starts for which the integrator is chosen (a choice)."""

FAR = 1e6
"""A start that used up its steps has escaped if it is at this many ranges of the starts (a choice)."""

BEYOND = 1.0 - 1e-6
"""A start that stopped at this part of the bound or beyond has escaped."""

OTHER, APPROACHING, LEAVING = "other", "approaching", "leaving"
ESCAPED, STOPPED, UNFINISHED = "escaped", "stopped", "not finished"
ENDS = (APPROACHING, LEAVING, ESCAPED, STOPPED, UNFINISHED)
"""Fates without an attractor, in the order of `Basin.labels`."""

UNDECIDED = (APPROACHING, LEAVING, UNFINISHED)
"""Fates that decide nothing."""


class Ensemble:
    """Starts (starts,) of all cells of a sweep, on their way; those of one cell, or perturbed node, are adjacent."""

    def __init__(
        self,
        scene: Scene,
        starts: Starts,
        criteria: tuple[AppliedCriterion, ...],
        attractors: Attractors,
        limits: Mapping[str, float],
        execution: Execution,
    ) -> None:
        """`scene`: its axes are those of the answer; `criteria`: one for each cell, or none without synchronous state."""
        self.scene, self.criteria, self.attractors, self.limits = scene, criteria, attractors, limits
        self.equations, self.execution = scene.equations, execution
        cells, each = scene.cells, starts.states.shape[0] * starts.count
        self.cell = np.repeat(np.arange(cells), each)  # cell of the sweep
        self.place = np.repeat(np.arange(cells * len(starts.states)), starts.count)  # cell of the answer
        self.samples, self.box = starts.count, starts.ranges(scene)
        planner = Planner(scene)
        self.columns = planner.columns(np.arange(cells))
        self.numbers = planner.rows(np.arange(cells)).numbers
        states = np.tile(starts.states.reshape(each, -1), (cells, 1))
        self.start = with_modes(self.equations, states, self.numbers[self.cell])
        self.state = self.start.copy()
        # times of each cell, in non-dimensional time: transient, window and period of the equations
        lengths = [(c.transient, c.window) for c in criteria] or [(scene.transient, scene.window)] * cells
        spans = [
            Planner(scene.replace(transient=t, window=w)).spans(np.arange(cells)) for t, w in dict.fromkeys(lengths)
        ]
        self.spans = np.array([spans[list(dict.fromkeys(lengths)).index(pair)][k] for k, pair in enumerate(lengths)])
        self.period = self.spans[:, SpanColumn.PERIOD]
        # a motion can go on from a state, at time 0, at the beginning of a period
        self.continues = not scene.forced or bool(np.all(self.period > 0.0))
        count = len(self.cell)
        self.passed, self.error = np.zeros(count), np.full(count, np.inf)
        self.status = np.full(count, int(Status.NOT_RUN))
        self.approach, self.watch = self._kernels()
        self.names = list(self.watch.scene.observe)
        self.certificate = self._certificate()
        self.windows = np.full((2, count, len(self.names)), np.nan)  # observables of the last two windows
        self.errors = np.full((2, count), np.nan)  # mean errors in these windows
        self.lengths = np.full((2, count), np.nan)  # lengths of these windows
        self.certain = np.zeros(count, dtype=bool)  # starts that are certain to synchronise
        self.labels: tuple[str, ...] = ()
        # pairs of attractors whose conditions both hold at the end of starts, with the number of these starts
        self.overlaps: tuple[tuple[str, str, int], ...] = ()
        self.fate = np.zeros(count, dtype=int)

    def __enter__(self) -> Ensemble:
        return self

    def __exit__(self, *problem: object) -> None:
        self.approach.pool.close()
        self.watch.pool.close()

    @property
    def exponent(self) -> np.ndarray:
        """The largest transversal exponent of each cell of the sweep; NaN if there is none."""
        return self.certificate.exponent

    @property
    def stderr(self) -> np.ndarray:
        """The standard error of `exponent`."""
        return self.certificate.stderr

    def _certificate(self) -> Certificate:
        """Return the exponents of the synchronous state of each cell; NaN where there are none."""
        nothing = Certificate(*(np.full(self.scene.cells, np.nan) for _ in range(5)))
        if not self.criteria:
            return nothing
        # exponents of stiff cells take Rosenbrock steps, as the cells do
        stiff = self.scene.integrator == "auto" and self.approach.method.implicit
        single = self.scene.replace(stop=None, integrator=self.approach.method.name if stiff else self.scene.integrator)
        # the precision is the least exponent that shows within the transient
        precision = 0.5 / float(self.spans[:, SpanColumn.END].max())
        workers = self.execution.workers
        try:
            return certify(single, precision=precision, periods=LONGEST, workers=workers)
        except (ValueError, FloatingPointError):
            if self.scene.cells == 1:
                return nothing
        # the synchronous motion of some cell has no exponents: compute each cell alone
        for cell in range(self.scene.cells):
            values = {name: float(column[cell]) for name, column in self.columns.items()}
            alone = with_numbers(single, values, axes=(), zipped=False)
            try:
                found = certify(alone, precision=precision, periods=LONGEST, workers=workers)
            except (ValueError, FloatingPointError):
                continue
            for name in ("exponent", "stderr", "diffusion", "margin", "size"):
                getattr(nothing, name)[cell] = getattr(found, name)[0]
        return nothing

    def _flat(self, starts: np.ndarray) -> Scene:
        """Return a scene with one cell for each of these starts; their other initial states are in `self.start`."""
        axes = {name: column[self.cell[starts]] for name, column in self.columns.items()}
        return self.scene.replace(axes={**axes, self.equations.state[0]: self.start[starts, 0]}, zipped=True)

    def _kernels(self) -> tuple[Trials, Trials]:
        """Return the kernels that advance starts, and that observe them over a window."""
        count = len(self.cell)
        some = np.unique(np.linspace(0, count - 1, min(count, REPRESENTED)).astype(int))
        flat = self._flat(some)
        if self.criteria:
            flat = flat.replace(max_steps=max(c.max_steps for c in self.criteria))
            tight = [c.atol for c in self.criteria if c.atol is not None]
            flat = flat.replace(atol=min(tight)) if tight else flat
        if self.limits:
            flat = flat.replace(stop=_stop(self.equations, self.scene.stop, self.limits))
        watched = self.attractors.watched(flat.replace(record=("sync_error",) if self.criteria else ()))

        def trials(scene: Scene) -> Trials:
            reduction = reduce_scene(scene, reduce=False, starts=self.start[some])
            return Trials.by_ladder(replace(reduction, jumps=True), self.execution)

        return trials(flat), trials(watched)

    def run(self, doublings: int) -> None:
        """Advance all starts to their ends, and decide their fates."""
        start, end = self.spans[self.cell, SpanColumn.START], self.spans[self.cell, SpanColumn.END]
        window = end - start
        beyond = self._size(self.start) >= 1.0
        self.status[beyond] = Status.STOPPED
        running = np.flatnonzero(~beyond)
        half = self._whole(FIRST * start)
        first = np.minimum(self._whole(window), half)
        first = np.where(first > 0.0, first, half)
        for part in LOOKS:
            running = self._look(running, np.minimum(self._whole(part * start), half - first))
        if half[running].any():
            self._advance(running, (half - first)[running], first[running])
            running = self._look(running[self.status[running] == Status.FINISHED], half)
        for part in LATER:
            running = self._look(running, np.maximum(self._whole(part * start), half))
        self._advance(running, (start - self.passed)[running], window[running])
        self._decide()
        whole = np.isclose(self._whole(end), end, rtol=1e-9)
        for _ in range(doublings if self.continues else 0):
            running = np.flatnonzero((self.fate == self.labels.index(APPROACHING)) & whole)
            if not len(running):
                break
            lead = self.passed - window
            self._advance(running, lead[running], window[running])
            self._decide()

    def _whole(self, time: np.ndarray, starts: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return times of some starts, reduced to whole periods of the equations."""
        period = self.period[self.cell[starts]]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(period > 0.0, np.floor(time / period * (1.0 + 1e-12)) * period, time))

    def _rows(self, starts: np.ndarray, begin: np.ndarray, end: np.ndarray) -> CellRows:
        cells = self.cell[starts]
        spans = self.spans[cells]
        spans[:, SpanColumn.START], spans[:, SpanColumn.END] = begin, end
        return CellRows((self.state if self.continues else self.start)[starts], self.numbers[cells], spans)

    def _look(self, starts: np.ndarray, until: np.ndarray) -> np.ndarray:
        """Advance starts until times (all starts,); return those that run on and are not certain to synchronise."""
        certificate = self.certificate
        # the probability that the logarithm of an error ever climbs by g is exp(-2 g |exponent|/diffusion): Redner, A
        # Guide to First-Passage Processes (Cambridge, 2001), section 3.2
        rare = 2.0 * math.log(NEAR) * certificate.exponent > -math.log(CHANCE) * certificate.diffusion
        stable = (certificate.exponent + certificate.margin < 0.0) & rare
        if not (stable.any() and self.continues and next(iter(self.attractors.table.values())) == SYNCHRONOUS):
            return starts
        left = starts[(until - self.passed)[starts] > 0.0]
        self._approach(left, (until - self.passed)[left])
        starts = starts[np.isin(self.status[starts], (Status.FINISHED, Status.NOT_RUN))]
        for some, criterion in self._by_criterion(starts):
            error = final_errors(self.state[some], criterion, self.equations)
            near = stable[self.cell[some]] & (error < NEAR * criterion.tolerance) & (criterion.size > 0.0)
            self.certain[some[near]], self.error[some[near]] = True, error[near]
        return np.asarray(starts[~self.certain[starts]])

    def _approach(self, starts: np.ndarray, time: np.ndarray) -> None:
        """Advance starts by some time without observing them."""
        if len(starts):
            rows = self._rows(starts, np.zeros(len(starts)), time)
            outcome = self.approach.run(len(starts), rows.take)
            self.state[starts], self.status[starts] = outcome.reached, outcome.status
            self.passed[starts] += time

    def _by_criterion(self, starts: np.ndarray) -> Iterator[tuple[np.ndarray, AppliedCriterion]]:
        """Yield the starts of each criterion."""
        distinct = list(dict.fromkeys(self.criteria))
        number = np.array([distinct.index(criterion) for criterion in self.criteria], dtype=int)
        for k, criterion in enumerate(distinct):
            yield starts[number[self.cell[starts]] == k], criterion

    def _advance(self, starts: np.ndarray, lead: np.ndarray, window: np.ndarray) -> None:
        """Advance starts by the time `lead`, and observe them over a window after it."""
        if self.continues and lead.any():
            # the next run begins at time 0, so that the drive has its phase only after whole periods
            whole = self._whole(lead, starts)
            self._approach(starts, whole)
            going = self.status[starts] == Status.FINISHED
            starts, lead, window = starts[going], (lead - whole)[going], window[going]
        if not len(starts):
            return
        begin = lead if self.continues else self.passed[starts] + lead
        rows = self._rows(starts, begin, begin + window)
        outcome = self.watch.run(len(starts), rows.take)
        self.state[starts], self.status[starts] = outcome.reached, outcome.status
        self.passed[starts] += lead + window
        for values, latest in ((self.windows, outcome.observed), (self.lengths, window)):
            values[0, starts], values[1, starts] = values[1, starts], latest
        self.errors[0, starts] = self.errors[1, starts]
        for rows_of, criterion in self._by_criterion(np.arange(len(starts))):
            part = Outcome(*(column[rows_of] for column in outcome))
            self.errors[1, starts[rows_of]] = errors(part, criterion, self.equations)

    def _size(self, state: np.ndarray) -> np.ndarray:
        """Return the largest component of states (cells, dimension), relative to its bound."""
        shares = [
            np.abs(state[:, k]) / self.limits[name.rpartition("_")[0]]
            for k, name in enumerate(self.equations.state)
            if name.rpartition("_")[0] in self.limits
        ]
        return np.max(shares, axis=0) if shares else np.zeros(len(state))

    def _distance(self) -> np.ndarray:
        """Return the largest state that is no angle, relative to the range of starts and synchronous motion."""
        size = max([*self.box.values(), *(criterion.size for criterion in self.criteria)])
        straight = [period is None for period in periods_of_states(self.equations)]
        return np.asarray(np.abs(self.state[:, straight]).max(axis=1, initial=0.0) / (size or 1.0))

    def _decide(self) -> None:
        """Decide the fate of every start from its status and its last two windows."""
        names, table = list(self.attractors.table), self.attractors.table
        observed = [{name: window[:, k] for k, name in enumerate(self.names)} for window in self.windows]
        finished = (self.status == Status.FINISHED) & ~self.certain
        earlier = ~np.isnan(self.lengths[0])
        features = [self.attractors.features(each) for each in observed]
        ranges = self.attractors.ranges([each.take(finished) for each in features], self.box)
        # 1. the attractor of each window: the first one whose condition holds; -1 for none
        verdicts, speeds = np.full((2, len(self.cell)), -1), np.full((2, len(self.cell)), np.nan)
        holding = np.zeros((len(names), len(self.cell)), dtype=bool)  # conditions that hold in the last window
        parameters = dict(zip(self.equations.parameters, self.numbers[self.cell].T, strict=True))
        tolerance = np.array([c.tolerance for c in self.criteria] or [np.nan])
        tolerance = tolerance[self.cell] if self.criteria else np.full(len(self.cell), np.nan)
        for k, each in enumerate(observed):
            if REST in table.values():
                speeds[k] = self.attractors.speeds(each, self.lengths[k], ranges)
            for number, (name, text) in reversed([*enumerate(table.items())]):
                if text == SYNCHRONOUS:
                    holds = self.errors[k] < tolerance
                else:
                    holds = speeds[k] < STILL if text == REST else self.attractors.holds(name, each, parameters)
                verdicts[k, holds & finished] = number
                holding[number] = holds & finished
        # 2. a verdict counts if both windows agree, or if the error or the speed falls
        named, agreed = verdicts[1] >= 0, ~earlier | (verdicts[0] == verdicts[1])
        texts = np.array([*table.values(), ""], dtype=object)[verdicts[1]]
        with np.errstate(invalid="ignore"):
            agreed |= (texts == SYNCHRONOUS) | ((texts == REST) & (speeds[1] < speeds[0]))
            changing = earlier & ~features[1].alike(features[0], ranges, SETTLED)
            changing |= (REST in table.values()) & (speeds[1] < speeds[0] / math.e)
        changing |= earlier & (verdicts[0] >= 0)
        changing |= self._approaching() if self.criteria else False
        other = finished & ~named & ~changing
        # 3. other motions in groups, and labels
        group = np.zeros(len(self.cell), dtype=int)
        group[other] = groups_of(features[1].take(other), ranges, self.place[other], self.samples)
        most = int(group.max(initial=0))
        numbered = [f"{OTHER} {k + 1}" for k in range(most)] if most > 1 else []
        rest = [OTHER] if not numbered or (other & (group == 0)).any() else []
        self.labels = (*names, *numbered, *rest, *ENDS)
        code = {label: k for k, label in enumerate(self.labels)}
        # 4. fates
        self.fate = np.full(len(self.cell), code[UNFINISHED])
        lost = (self.status == Status.STEP_BUDGET) & (self._distance() > FAR)
        self.fate[lost | (self.status == Status.DIVERGED)] = code[ESCAPED]
        stopped = self.status == Status.STOPPED
        self.fate[stopped] = code[STOPPED]
        self.fate[stopped & (self._size(self.state) >= BEYOND)] = code[ESCAPED]
        self.fate[finished] = code[APPROACHING]
        decided = finished & named & agreed
        self.fate[decided] = verdicts[1, decided]
        self.overlaps = tuple(
            (names[a], names[b], int(both))
            for a, b in itertools.combinations(range(len(names)), 2)
            if (both := np.sum(decided & (verdicts[1] == a) & holding[b]))
        )
        self.fate[other] = code.get(OTHER, 0)
        for k in range(len(numbered)):
            self.fate[other & (group == k + 1)] = code[numbered[k]]
        self.error = np.where(finished, self.errors[1], np.where(self.certain, self.error, np.inf))
        synchronous = self.attractors.name_of(SYNCHRONOUS)
        if synchronous is not None:
            self.fate[self.certain] = code[synchronous]
            unstable = (self.exponent - 2.0 * self.stderr > 0.0)[self.cell]
            self._leave(np.flatnonzero(unstable & (self.fate == code[synchronous])), code[LEAVING])

    def _approaching(self) -> np.ndarray:
        """Return whether starts that are not synchronous may synchronise later.

        After a long transient, the error of such a start must fall at half the rate of the exponent, or by a factor e.
        """
        earlier, error = self.errors
        exponent, stderr, length = self.exponent[self.cell], self.stderr[self.cell], self.passed
        size = np.array([c.size / c.tolerance for c in self.criteria])[self.cell]
        fastest, diffusion = 2.0 * stderr - exponent, self.certificate.diffusion[self.cell]
        with np.errstate(invalid="ignore", over="ignore"):
            falls = error < earlier * np.exp(np.maximum(0.25 * np.minimum(exponent, 0.0) * length, -1.0))
            # the logarithm of an error falls at the rate `fastest`, and diffuses: a short transient cannot decide
            unlucky = fastest * length - UNLUCKY * np.sqrt(diffusion * length)
            short = unlucky < np.log(np.maximum(size, 1.0))
            unknown = error < earlier / math.e
        return np.where(np.isnan(exponent), unknown, (fastest > 0.0) & (short | falls))

    def _leave(self, starts: np.ndarray, leaving: int) -> None:
        """Mark starts at an unstable synchronous state, after the exponents of their own synchronous motions."""
        unstable = np.ones(len(starts), dtype=bool)
        try:
            flat = self._flat(starts).replace(stop=None)
            own = certify(flat, self.state[starts], periods=LONGEST, workers=self.execution.workers)
            unstable = own.exponent - 2.0 * own.stderr > 0.0
        except (ValueError, FloatingPointError):
            pass  # without exponents of their own, that of the scene's start counts
        self.fate[starts[unstable]] = leaving


def _stop(equations: Equations, stop: str | None, limits: Mapping[str, float]) -> str:
    """Return a function that passes zero where a component passes its bound, or where a stop does."""
    sizes = []
    for name, limit in limits.items():
        holders = equations.holders(name)
        everywhere = len(holders) == equations.n
        parts = [f"nodes.maximum(abs({name}))"] if everywhere else [f"abs({name}_{i + 1})" for i in holders]
        sizes += [f"{part}/{limit!r}" for part in parts]
    size = f"max({', '.join(sizes)})" if len(sizes) > 1 else sizes[0]
    return f"1 - {size}" if stop is None else f"({stop})*(1 - {size})"
