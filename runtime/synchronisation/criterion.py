"""When a coupling counts as synchronous: the starts, how long they run, and the error that is allowed."""

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

from ..engines.control import scale_of_atol
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
"""Error that is allowed, and reach of the starts, as parts of what the synchronous motion moves."""

TIMES = {"transient": 1000.0, "window": 100.0}
"""Transient and window: in periods of the drive, without one in times in which the motion turns by a radian."""

PASSES = 4
"""Most times that a motion is measured again because the steps did not resolve it."""

EFFORT = 100.0
"""Most steps of a cell, in steps that the synchronous motion takes in the same time."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """When a value of sigma counts as synchronous.

    From `starts` different initial states (the scene's own, and copies of it moved as a whole by a
    random amount of up to `reach` in the position), at least half must end with a mean
    synchronisation error below `tolerance`, averaged over `window` after a transient of `transient`.
    Near the ends of a range of chaotic motion single starts synchronise or burst by chance; their
    majority does not depend on one of them.

    Distances between oscillators are those of the scene's own start in all of them.  Where oscillators and links are
    linear, a mode in which these distances have no part grows from rounding alone: `thresholds` warns of it.

    What is None follows the motion and the scene; results hold the numbers that were used (`AppliedCriterion`).

    Parameters
    ----------
    tolerance : float, optional
        In units of the state.  By default a thousandth of what the synchronous motion moves, for the mean error and for
        the error of each component at the end of the window.
    starts : int
        Number of initial states.
    reach : float, optional
        In units of the position, by default half of what the synchronous motion moves in it.
    transient, window : float, optional
        In the scene's unit of time.  By default those of the scene if they are not the default of `Scene`, else 1000 and
        100 periods of the drive, and without a drive as many times in which the motion turns by a radian.
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
    """A criterion of which every field is the number that was used.

    `extent` is what the synchronous motion moves in each compared component.  `relative`: whether the tolerance follows
    from it, and each component is judged; else the mean error alone is.  `max_steps`: most steps of a cell, EFFORT times
    those that the synchronous motion takes.  `atol`: absolute tolerance of the steps, None for that of the scene.
    """

    tolerance: float
    starts: int
    reach: float
    transient: float
    window: float
    rtol: float
    seed: int
    extent: tuple[float, ...]
    relative: bool = False
    max_steps: int = 10_000_000
    atol: float | None = None

    @property
    def size(self) -> float:
        """What the synchronous motion moves in all components, as a synchronisation error."""
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
    own.name: f"it is one of the criterion; write criterion=Criterion({own.name}=…)" for own in fields(Criterion)
}
"""What functions with a criterion do not take themselves, and why."""


def checked(criterion: Criterion | None) -> Criterion:
    """Return the criterion, or the default one for None; TypeError for anything else."""
    if criterion is None:
        return Criterion()
    return check_instance("criterion", criterion, Criterion, "a Criterion, e.g. Criterion(starts=4)")


def preset(criterion: Criterion, scene: Scene) -> Criterion:
    """Return the criterion with what the scene says about times, rtol and seed."""
    said: dict[str, Any] = {"rtol": scene.rtol, "seed": scene.seed}
    for name, periods in TIMES.items():
        own = getattr(scene, name)
        if own != inspect.signature(Scene).parameters[name].default:
            said[name] = own
        elif scene.time_unit == TimeUnit.PERIOD:
            said[name] = periods
    return replace(criterion, **{name: value for name, value in said.items() if getattr(criterion, name) is None})


def applied(criterion: Criterion, motion: SynchronousMotion, scene: Scene) -> AppliedCriterion:
    """Return a criterion (`preset`) with the numbers that follow from the synchronous motion."""
    found: dict[str, Any] = {own.name: getattr(criterion, own.name) for own in fields(Criterion)}
    for name, radians in TIMES.items():
        if found[name] is None:
            found[name] = radians * motion.radian
    if found["tolerance"] is None:
        found["tolerance"] = max(TOLERANCE * motion.size, float(np.finfo(float).tiny))
    if found["reach"] is None:
        found["reach"] = REACH * float(motion.extent[0])
    unit = motion.unit if scene.time_unit == TimeUnit.PERIOD else 1.0
    most = EFFORT * motion.pace * unit * (found["transient"] + found["window"])
    return AppliedCriterion(
        **found,
        extent=tuple(map(float, motion.extent)),
        relative=criterion.tolerance is None,
        max_steps=max(min(scene.max_steps, int(most)), 1),
        atol=_atol(motion, scene, found["rtol"]),
    )


def _atol(motion: SynchronousMotion, scene: Scene, rtol: float) -> float | None:
    """The absolute tolerance for the smallest extent of a small motion, in place of a default one; else None."""
    moves = motion.extent[motion.extent > 0.0]
    scale = float(scale_of_atol(moves.min(initial=1.0)))
    return 0.1 * rtol * scale if scene.given["atol"] is None and scale < 1.0 else None


def resolved(
    criterion: Criterion, scene: Scene, measure: Callable[[float | None], SynchronousMotion]
) -> AppliedCriterion:
    """Return a criterion (`preset`) for the motion that is measured with an absolute tolerance which resolves it."""
    used = applied(criterion, measure(None), scene)
    for _ in range(PASSES):
        if used.atol is None:
            break
        before, used = used.atol, applied(criterion, measure(used.atol), scene)
        if used.atol is None or used.atol >= before:
            break
    return used


def errors(outcome: Outcome, criterion: AppliedCriterion, equations: Equations) -> np.ndarray:
    """Return the errors (cells,) that a tolerance is compared with: the mean ones, if it was given.

    If it follows from the motion, a component that is too small for the mean counts by its own error at the end, as large as
    its extent is in the extent of all.
    """
    if not criterion.relative:
        return outcome.error
    states = outcome.end[:, columns_of(equations)]
    apart = np.abs(states - states[..., :1]).sum(axis=-1)
    moves = np.array(criterion.extent) > 0.0
    shares = apart[:, moves] / np.array(criterion.extent)[moves]
    return np.fmax(outcome.error, criterion.size * shares.max(axis=-1, initial=0.0))


def offsets(criterion: AppliedCriterion) -> np.ndarray:
    """Return how far the starts are moved: not at all, then at random."""
    random = np.random.default_rng(criterion.seed)
    return np.concatenate([[0.0], random.uniform(-criterion.reach, criterion.reach, criterion.starts - 1)])
