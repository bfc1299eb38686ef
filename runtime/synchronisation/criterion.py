"""Define the criterion of synchronisation: starts, transient and window, and the largest error."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import check_instance, check_integer, check_number, check_positive, check_seed
from synchain.models.scenes.defaults import TimeUnit
from synchain.models.scenes.scene import Scene

from ..engines.step_control import scale_of_atol
from .synchronous_motion import SynchronousMotion, columns_of
from .trials import Outcome

TOLERANCE, REACH = 1e-3, 0.5
"""Default tolerance and reach, relative to the extent of the synchronous motion (a choice)."""

TIMES = {"transient": 1000.0, "window": 100.0}
"""Default transient and window, in periods of the drive; without a drive, in times in which the motion turns by a
radian."""

PASSES = 4
"""A motion that the steps do not resolve is measured at most this often, with smaller and smaller tolerances."""

EFFORT = 100.0
"""Largest number of steps of a cell, relative to that of the synchronous motion in the same time (a choice)."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """Conditions under which a value of sigma counts as synchronous.

    The network runs from `starts` initial states: the scene's own, and copies in which the positions of all
    oscillators are moved by the same random amount, at most `reach`. A value counts as synchronous if at least
    half of the starts end with an error below `tolerance`. The error is the mean synchronisation error over
    `window` after the transient. Near the ends of a range of chaotic motion single starts synchronise or burst
    by chance, so that several starts decide.

    All starts have the same distances between oscillators. If oscillators and links are linear, a mode that is absent
    from these distances grows from rounding errors alone; `thresholds` warns of such a mode.

    A field that is None follows from the motion and the scene. Results store the numbers that were used
    (`AppliedCriterion`).

    Parameters
    ----------
    tolerance : float, optional
        Largest error, in units of the state. By default a thousandth of the extent of the synchronous motion, both for
        the mean error and for the error of each component at the end of the window.
    starts : int
        Number of initial states.
    reach : float, optional
        Largest displacement of a start, in units of the position. By default half of the position's extent in the
        synchronous motion.
    transient, window : float, optional
        Transient and window in the scene's unit of time. By default those of the scene, if they differ from the
        defaults of `Scene`; otherwise 1000 and 100 periods of the drive or, without a drive, 1000 and 100 times the
        time in which the motion turns by a radian.
    rtol : float, optional
        Relative tolerance; by default that of the scene.
    rng : int or Generator, optional
        Seed of the starts, or a NumPy Generator that gives it; by default that of the scene.

    See Also
    --------
    thresholds, universal_probe

    Examples
    --------
    >>> import synchain as sc
    >>> sc.Criterion(starts=4, transient=200.0).starts
    4
    """

    tolerance: float | None = None
    starts: int = 8
    reach: float | None = None
    transient: float | None = None
    window: float | None = None
    rtol: float | None = None
    rng: int | np.random.Generator | None = None

    def __post_init__(self) -> None:
        for name in ("tolerance", "window", "rtol"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check_positive(f"criterion: {name}", getattr(self, name)))
        for name in ("reach", "transient"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check_number(f"criterion: {name}", getattr(self, name), 0.0))
        check_integer("criterion: starts", self.starts, 1)
        if self.rng is not None:
            object.__setattr__(self, "rng", check_seed("criterion: rng", self.rng))


@dataclass(frozen=True, slots=True)
class AppliedCriterion(Criterion):
    """A criterion whose fields are the numbers that were used."""

    tolerance: float
    starts: int
    reach: float
    transient: float
    window: float
    rtol: float
    rng: int
    extent: tuple[float, ...]  # extent of the synchronous motion in each compared component
    relative: bool = (
        False  # True if the tolerance follows from the extent; the error of each component is then tested too
    )
    max_steps: int = 10_000_000  # most steps of a cell: EFFORT times those of the synchronous motion
    atol: float | None = None  # absolute tolerance of the steps; None: that of the scene

    @property
    def size(self) -> float:
        """Extent of the synchronous motion in all components together, measured like a synchronisation error."""
        return math.hypot(*self.extent)

    def text(self, scene: Scene) -> str:
        """Return the numbers as text, with the unit of time of a scene."""
        relative = " (a thousandth of what the motion moves)" if self.relative else ""
        unit = "drive periods" if scene.time_unit == TimeUnit.PERIOD else "units of time"
        return (
            f"mean error below {self.tolerance:.3g}{relative} over {self.window:.6g} {unit} after "
            f"{self.transient:.6g}, rtol {self.rtol:g}, at most {self.max_steps:.3g} steps"
        )


PAPER = AppliedCriterion(1e-3, 8, 0.4, 1000.0, 100.0, 1e-8, 0, (0.8, 0.5))
"""The criterion of docs/thresholds.md, in the units of the friction oscillator."""

QUICK = Criterion(starts=5, transient=400.0, window=50.0, rtol=1e-6)
"""A criterion for a first result, at a ninth of the effort.

Test: chains of two, three and four oscillators of the paper at omega = 1.15 and 1.40. The ends of ranges at rtol = 1e-6
and 1e-8 differ by no more than those of two seeds, and rtol = 1e-6 needs 2.3 times fewer steps.
"""


IN_CRITERION = {
    each.name: f"it is one of the criterion; write criterion=Criterion({each.name}=…)" for each in fields(Criterion)
}
"""Keywords that functions with a criterion do not accept, each with the reason for the error message."""


def checked(criterion: Criterion | None) -> Criterion:
    """Return the criterion, or the default criterion for None; raise TypeError for anything else."""
    if criterion is None:
        return Criterion()
    return check_instance("criterion", criterion, Criterion, "a Criterion, e.g. Criterion(starts=4)")


def preset(criterion: Criterion, scene: Scene) -> Criterion:
    """Return the criterion with the scene's times, rtol and rng in place of fields that are None."""
    of_scene: dict[str, Any] = {"rtol": scene.rtol, "rng": scene.rng}
    for name, periods in TIMES.items():
        value = getattr(scene, name)
        if value != inspect.signature(Scene).parameters[name].default:
            of_scene[name] = value
        elif scene.time_unit == TimeUnit.PERIOD:
            of_scene[name] = periods
    return replace(criterion, **{name: value for name, value in of_scene.items() if getattr(criterion, name) is None})


def applied(criterion: Criterion, motion: SynchronousMotion, scene: Scene) -> AppliedCriterion:
    """Return a criterion from `preset`, with the numbers that follow from the synchronous motion."""
    values: dict[str, Any] = {each.name: getattr(criterion, each.name) for each in fields(Criterion)}
    for name, radians in TIMES.items():
        if values[name] is None:
            values[name] = radians * motion.radian
    if values["tolerance"] is None:
        values["tolerance"] = max(TOLERANCE * motion.size, float(np.finfo(float).tiny))
    if values["reach"] is None:
        values["reach"] = REACH * float(motion.extent[0])
    unit = motion.unit if scene.time_unit == TimeUnit.PERIOD else 1.0
    most = EFFORT * motion.pace * unit * (values["transient"] + values["window"])
    # a small motion needs a smaller absolute tolerance than the default one
    scale = float(scale_of_atol(motion.extent[motion.extent > 0.0].min(initial=1.0)))
    return AppliedCriterion(
        **values,
        extent=tuple(map(float, motion.extent)),
        relative=criterion.tolerance is None,
        max_steps=max(min(scene.max_steps, int(most)), 1),
        atol=0.1 * values["rtol"] * scale if scene.given["atol"] is None and scale < 1.0 else None,
    )


def resolved(
    criterion: Criterion, scene: Scene, measure: Callable[[float | None], SynchronousMotion]
) -> AppliedCriterion:
    """Return a `preset` criterion with numbers of the motion, measured until atol resolves the motion."""
    used = applied(criterion, measure(None), scene)
    for _ in range(PASSES):
        if used.atol is None:
            break
        before, used = used.atol, applied(criterion, measure(used.atol), scene)
        if used.atol is None or used.atol >= before:
            break
    return used


def errors(outcome: Outcome, criterion: AppliedCriterion, equations: Equations) -> np.ndarray:
    """Return the errors (cells,) for the comparison with the tolerance.

    The errors are the mean errors. If the tolerance follows from the motion, the final error of each component, in
    units of its extent, counts too: a component of small extent hardly changes the mean error.
    """
    if not criterion.relative:
        return outcome.error
    return np.fmax(outcome.error, final_errors(outcome.end, criterion, equations))


def final_errors(end: np.ndarray, criterion: AppliedCriterion, equations: Equations) -> np.ndarray:
    """Return the errors (cells,) of states (cells, dimension): the largest of a component, in units of its extent."""
    states = end[:, columns_of(equations)]
    apart = np.abs(states - states[..., :1]).sum(axis=-1)
    moves = np.array(criterion.extent) > 0.0
    shares = apart[:, moves] / np.array(criterion.extent)[moves]
    return np.asarray(criterion.size * shares.max(axis=-1, initial=0.0))


def offsets(criterion: AppliedCriterion) -> np.ndarray:
    """Return the displacements (starts,): 0, followed by random numbers."""
    random = np.random.default_rng(criterion.rng)
    return np.concatenate([[0.0], random.uniform(-criterion.reach, criterion.reach, criterion.starts - 1)])
