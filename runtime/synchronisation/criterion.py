"""When a coupling counts as synchronous: the starts, their times, and the largest error."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import check_instance, check_integer, check_number, check_positive
from synchain.models.scenes.defaults import TimeUnit
from synchain.models.scenes.scene import Scene

from ..engines.step_control import scale_of_atol
from .synchronous_motion import SynchronousMotion, columns_of
from .trials import Outcome

__all__ = [
    "IN_CRITERION",
    "PAPER",
    "QUICK",
    "AppliedCriterion",
    "Criterion",
    "applied",
    "checked",
    "errors",
    "offsets",
    "preset",
    "resolved",
]

TOLERANCE, REACH = 1e-3, 0.5
"""Largest error, and reach of the starts, relative to the extent of the synchronous motion (a choice)."""

TIMES = {"transient": 1000.0, "window": 100.0}
"""Transient and window: in periods of the drive, without one in times in which the motion turns by a radian."""

PASSES = 4
"""Most repeated measurements of a motion that the steps did not resolve."""

EFFORT = 100.0
"""Most steps of a cell, relative to those of the synchronous motion in the same time (a choice)."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """When a value of sigma counts as synchronous.

    From `starts` different initial states (the scene's own, and copies of it moved as a whole by a
    random amount of up to `reach` in the position), at least half must end with a mean
    synchronisation error below `tolerance`, averaged over `window` after a transient of `transient`.
    Near the ends of a range of chaotic motion single starts synchronise or burst by chance; their
    majority does not depend on one of them.

    Distances between oscillators are those of the scene's own start in all of them.  Where oscillators and links are
    linear, a mode that is absent from these distances grows from rounding alone: `thresholds` warns of it.

    Fields that are None follow the motion and the scene; results hold the numbers that were used (`AppliedCriterion`).

    Parameters
    ----------
    tolerance : float, optional
        In units of the state.  By default a thousandth of the extent of the synchronous motion, for the mean error and for
        the error of each component at the end of the window.
    starts : int
        Number of initial states.
    reach : float, optional
        In units of the position, by default half of the extent of the synchronous motion in it.
    transient, window : float, optional
        In the scene's unit of time.  By default those of the scene if they are not the default of `Scene`, else 1000 and
        100 periods of the drive; without a drive, 1000 and 100 times in which the motion turns by a radian.
    rtol, seed : float, int, optional
        Those of the scene by default.

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
    seed: int | None = None

    def __post_init__(self) -> None:
        for name in ("tolerance", "window", "rtol"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check_positive(f"criterion: {name}", getattr(self, name)))
        for name in ("reach", "transient"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check_number(f"criterion: {name}", getattr(self, name), 0.0))
        check_integer("criterion: starts", self.starts, 1)
        if self.seed is not None:
            check_integer("criterion: seed", self.seed, 0)


@dataclass(frozen=True, slots=True)
class AppliedCriterion(Criterion):
    """A criterion whose fields are the numbers that were used."""

    tolerance: float
    starts: int
    reach: float
    transient: float
    window: float
    rtol: float
    seed: int
    extent: tuple[float, ...]  # of the synchronous motion in each compared component
    relative: bool = (
        False  # whether the tolerance follows from it and each component is judged, not the mean error alone
    )
    max_steps: int = 10_000_000  # most steps of a cell: EFFORT times those of the synchronous motion
    atol: float | None = None  # absolute tolerance of the steps; None for that of the scene

    @property
    def size(self) -> float:
        """Extent of the synchronous motion in all components, measured as a synchronisation error is."""
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
"""A criterion for a first look, at a ninth of the effort.

Chains of two, three and four oscillators of the paper at omega = 1.15 and 1.40: ends of ranges at rtol = 1e-6 and 1e-8
differ by as much as with two seeds of the starts, and steps are 2.3 times fewer.
"""


IN_CRITERION = {
    each.name: f"it is one of the criterion; write criterion=Criterion({each.name}=…)" for each in fields(Criterion)
}
"""Keywords that functions with a criterion refuse, and the reason."""


def checked(criterion: Criterion | None) -> Criterion:
    """Return the criterion, or the default one for None; TypeError for anything else."""
    if criterion is None:
        return Criterion()
    return check_instance("criterion", criterion, Criterion, "a Criterion, e.g. Criterion(starts=4)")


def preset(criterion: Criterion, scene: Scene) -> Criterion:
    """Return the criterion with times, rtol and seed of the scene where it has none."""
    of_scene: dict[str, Any] = {"rtol": scene.rtol, "seed": scene.seed}
    for name, periods in TIMES.items():
        value = getattr(scene, name)
        if value != inspect.signature(Scene).parameters[name].default:
            of_scene[name] = value
        elif scene.time_unit == TimeUnit.PERIOD:
            of_scene[name] = periods
    return replace(criterion, **{name: value for name, value in of_scene.items() if getattr(criterion, name) is None})


def applied(criterion: Criterion, motion: SynchronousMotion, scene: Scene) -> AppliedCriterion:
    """Return a criterion (`preset`) with the numbers that follow from the synchronous motion."""
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
    """Return a criterion (`preset`) with the numbers of the motion, measured again until the absolute tolerance resolves it."""
    used = applied(criterion, measure(None), scene)
    for _ in range(PASSES):
        if used.atol is None:
            break
        before, used = used.atol, applied(criterion, measure(used.atol), scene)
        if used.atol is None or used.atol >= before:
            break
    return used


def errors(outcome: Outcome, criterion: AppliedCriterion, equations: Equations) -> np.ndarray:
    """Return the errors (cells,) to compare with the tolerance.

    They are the mean errors; if the tolerance follows from the motion, the error of a small component at the end, in units
    of its extent, counts too.
    """
    if not criterion.relative:
        return outcome.error
    states = outcome.end[:, columns_of(equations)]
    apart = np.abs(states - states[..., :1]).sum(axis=-1)
    moves = np.array(criterion.extent) > 0.0
    shares = apart[:, moves] / np.array(criterion.extent)[moves]
    return np.fmax(outcome.error, criterion.size * shares.max(axis=-1, initial=0.0))


def offsets(criterion: AppliedCriterion) -> np.ndarray:
    """Return the displacements (starts,): 0, then random ones."""
    random = np.random.default_rng(criterion.seed)
    return np.concatenate([[0.0], random.uniform(-criterion.reach, criterion.reach, criterion.starts - 1)])
