"""Branches of periodic orbits along a parameter, and the bifurcations on them.

A smooth bifurcation is a multiplier that passes the unit circle: at -1, at 1, or in a complex pair. A bifurcation of friction is a change
of the phases of stick and slip. In grazing, a phase begins in the middle of another one, as its
distance from it becomes zero. In stick loss, a body that landed in stick turns at once, as the load
at the landing passes the limit of static friction.
`synchain.runtime.bifurcation.bifurcations` locates them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_instance, short_repr
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import Given
from ..results.labelled import Labelled, dataset
from ..support.error_text import range_text
from ..support.execution import Execution
from ..support.progress import Hook
from .bifurcations import Bifurcation, bifurcations_at_end, bifurcations_between
from .continuation import Arc
from .periodic import NEWTON, PeriodicOrbit, periodic_orbit, relative
from .phases import Phases

LONGEST = 1.0 / 4.0
"""Longest step, relative to the range of the parameter."""

SHORT = 1.0 / 32.0
"""Length of a refused step, relative to the range or to the last such step, at which the end of the branch is sought."""

SHORTEST = 2.0**-20
"""Shortest step, relative to the range; if it is refused too, the branch is lost."""

APART = 1.0 / 64.0
"""Length of the steps, relative to the range, in which a change of phases is located; two changes in one count as one."""

FAR = 0.3
"""Largest distance from the expected state, relative to the step, of an orbit of other phases on the same branch."""

KINK = 1e-2
"""Distance from the expected state that such an orbit may always have, relative to its extent: changes of phases are kinks."""

NAMES = frozenset(
    {
        "bifurcation",
        "bifurcation_kind",
        "branch",
        "multipliers",
        "number",
        "orbit",
        "periods",
        "stable",
        "state",
        "turn",
    }
)
"""What branches and skeletons have under these names beside those of all results."""


@dataclass(frozen=True, slots=True, repr=False)
class Branch(Labelled):
    """Periodic orbits along a parameter.

    The branch ends if no further orbit can be found, usually at a fold or a graze. It is lost if neither an
    orbit nor a bifurcation at which it ends is found.

    Parameters
    ----------
    name : str
        Name of the parameter.
    values : ndarray, shape (k,)
        Values of the parameter.
    orbits : tuple of PeriodicOrbit
        Orbit at each value.
    bifurcations : tuple of Bifurcation
        Bifurcations between the orbits and at the end.
    phases : tuple of Phases
        Phases of each orbit; empty for friction that is not set-valued.
    lost : tuple of float
        Values of the parameter at the ends where the branch is lost.
    """

    name: str
    values: np.ndarray
    orbits: tuple[PeriodicOrbit, ...]
    bifurcations: tuple[Bifurcation, ...]
    phases: tuple[Phases, ...] = ()
    lost: tuple[float, ...] = ()

    @property
    def data(self) -> xr.Dataset:
        """States and multipliers along the parameter, and the bifurcations."""
        turns = self.bifurcations
        return dataset(
            {
                "state": ((self.name, "component"), [o.state for o in self.orbits], "state at the start of a period"),
                "multipliers": ((self.name, "number"), [o.multipliers for o in self.orbits], "Floquet multipliers"),
                "stable": ((self.name,), [o.stable for o in self.orbits], "whether all multipliers lie in the circle"),
                "bifurcation": (("turn",), np.array([t.value for t in turns], dtype=float), f"values of {self.name}"),
                "bifurcation_kind": (("turn",), np.array([str(t.kind) for t in turns], dtype=str), "their kinds"),
            },
            {self.name: self.values, "component": list(self.orbits[0].components)},
            self.orbits[0].scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Orbits, their stability, the bifurcations, and where the branch is lost."""
        stable = sum(orbit.stable for orbit in self.orbits)
        turns = "; ".join(f"{turn.kind} at {turn.value:.8g}" for turn in self.bifurcations)
        return (
            (
                "orbits",
                f"{len(self.orbits)} of {self.orbits[0].periods} drive periods, {stable} stable for one oscillator",
            ),
            (self.name, range_text(self.values)),
            ("bifurcations", turns or "none"),
            *((("lost", f"at {numbers(self.lost)}"),) if self.lost else ()),
        )


def follow(
    scene: Scene,
    name: str,
    values: Sequence[float] | np.ndarray,
    first: PeriodicOrbit,
    *,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Branch:
    """Follow a periodic orbit along a parameter and locate its bifurcations.

    Steps are chosen by the branch; `values` say only where orbits are returned. A step is halved if the orbit does not
    fit the tangents of the branch, if a multiplier moves far, or if a bifurcation on it has a residual above 1e-6.

    Parameters
    ----------
    scene : Scene
        Scene of the orbit.
    name : str
        Name of the parameter.
    values : array_like, shape (k,)
        Monotonic values of the parameter.
    first : PeriodicOrbit
        Orbit at or near values[0].
    show_progress : bool, optional
        Whether to show a bar; by default a bar on terminals and in notebooks, a line a minute elsewhere.
    progress : callable, optional
        Is called with a `Progress`, which counts values of the parameter.
    parameters : mapping of str to float, optional
        Other parameters of the scene to set, for names that are keywords already.
    **more : float
        Other parameters of the scene to set.

    Returns
    -------
    Branch

    Warns
    -----
    RuntimeWarning
        If the branch is lost: the orbits end without a bifurcation.

    Raises
    ------
    ValueError
        If the parameter is unknown, if the values are not monotonic, and for the cycle of an undriven oscillator.
    TypeError
        If `first` is no PeriodicOrbit.
    ArithmeticError
        If there is no orbit near `first` at values[0].
    """
    check_instance("first", first, PeriodicOrbit, "a PeriodicOrbit, such as periodic_orbit(scene) returns")
    if first.free:
        raise ValueError(
            "first: found the limit cycle of an oscillator without a drive; expected an orbit of a driven one; "
            "periodic_orbit finds cycles value by value"
        )
    wanted = checked_values(first.scene, name, values)
    scene = others(Given(follow, parameters, more, NEWTON), scene, name)
    with Execution(1, None, show_progress, progress).reporter(len(wanted), "value") as reporter:
        branch = traced(scene, name, reporter.each(wanted), first, abs(wanted[-1] - wanted[0]))
    warn_of_lost("follow", [branch])
    return branch


def warn_of_lost(function: str, branches: Sequence[Branch]) -> None:
    """Warn the caller of a function in one line if branches are lost."""
    lost = [value for branch in branches for value in branch.lost]
    if lost:
        warn(
            f"{function}: found no orbit and no bifurcation beyond {branches[0].name} = {numbers(lost)}; expected the "
            "branch to go on, or to end at a bifurcation; try a shorter range there, or periodic_orbit beyond"
        )


def numbers(values: Sequence[float]) -> str:
    """Return numbers in words, with eight digits."""
    return ", ".join(f"{value:.8g}" for value in values)


def others(given: Given, scene: Scene, name: str) -> Scene:
    """Return a scene with parameters beside the one that is swept."""
    if name in given.values:
        raise ValueError(f"{given.function.__name__}: {name!r} takes its values one after the other; expected others")
    return given.scene(scene)


def traced(scene: Scene, name: str, values: Iterable[float], first: PeriodicOrbit, span: float) -> Branch:
    """Follow a periodic orbit along checked values of a parameter with a range of length `span`, as `follow` does."""
    tracer = BranchTracer(Arc(scene, name, first.periods, span))
    orbits: dict[float, PeriodicOrbit] = {}
    for value in values:
        if orbits:
            orbit = tracer.on(value)
        else:
            start = periodic_orbit(scene, first.periods, first.state, parameters={name: value})
            orbit = tracer.take(value, start, start.phases)
        if orbit is None:
            break
        orbits[value] = orbit
    phases = [tracer.phases[value] for value in orbits]
    return Branch(
        name,
        np.array(list(orbits)),
        tuple(orbits.values()),
        tuple(tracer.bifurcations),
        tuple(each for each in phases if each is not None),
        tracer.lost,
    )


def checked_values(scene: Scene, name: str, values: Sequence[float] | np.ndarray) -> list[float]:
    """Convert the values of a parameter to floats. Shapes: values (k,)."""
    if name not in scene.parameters:
        raise ValueError(f"unknown parameter {name!r}; known: {', '.join(scene.parameters)}")
    expect_free("branch", [name], NAMES)
    if not np.iterable(values) or not all(isinstance(value, Real) and math.isfinite(value) for value in values):
        raise ValueError(f"values: found {short_repr(values)}; expected finite numbers for {name}")
    wanted = [float(value) for value in values]
    steps = np.diff(wanted)
    if not wanted or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError(
            f"values: found {short_repr(wanted)}; expected at least one number, rising or falling all the way"
        )
    return wanted


class BranchTracer:
    """Traces a branch orbit by orbit.

    Parameters
    ----------
    arc : Arc
        Smooth arc of the branch up to its last orbit.
    """

    def __init__(self, arc: Arc) -> None:
        self.arc = arc
        self.bifurcations: list[Bifurcation] = []
        self.phases: dict[float, Phases | None] = {}
        self.least: int | None = None
        self.lost: tuple[float, ...] = ()
        self.size = LONGEST * arc.span

    def take(
        self, value: float, orbit: PeriodicOrbit, phases: Phases | None, way: Sequence[Bifurcation] = ()
    ) -> PeriodicOrbit:
        """Append an orbit, after the bifurcations on the way to it."""
        self.phases[value] = phases
        self.least = self.least or orbit.least
        if self.arc.values:
            self.bifurcations += sorted(way, key=lambda each: abs(each.value - self.arc.values[-1]))
            if self._changes(phases):
                self.arc = self.arc.empty()
        self.arc.take(value, orbit, phases)
        return orbit

    def on(self, value: float) -> PeriodicOrbit | None:
        """Find the orbit at the next value by steps whose length follows the branch alone, None if the branch ends."""
        span, longest, sought = self.arc.span, np.inf, SHORT * self.arc.span
        while (last := self.arc.values[-1]) != value:
            size = min(self.size, longest)
            piece = min(size, abs(value - last))
            at = value if size >= abs(value - last) else last + math.copysign(size, value - last)
            found = self._found(at)
            # An orbit of other phases: halve the step until the change is located.
            if found is not None and piece > APART * span and self._changes(found[1]):
                longest = 0.5 * piece
                continue
            way = None if found is None else bifurcations_between(self.arc, at, *found)
            if found is not None and way is not None and all(each.located for each in way):
                longest = np.inf if self._changes(found[1]) else longest
                self.take(at, *found, way)
                self.size = max(self.size, min(2.0 * piece, LONGEST * span))
                continue
            # A refused step: the branch ends within its double, or the step is too long.
            if piece <= max(sought, SHORTEST * span):
                sought = SHORT * piece
                beyond = value if 2.0 * piece > abs(value - last) else last + 2.0 * (at - last)
                final = piece <= SHORTEST * span
                end = bifurcations_at_end(self.arc, beyond, final)
                if end or final:
                    self.bifurcations += end
                    self.lost = () if end else (last,)
                    return None
            self.size = 0.5 * piece
        return self.arc.orbits[-1]

    def _changes(self, phases: Phases | None) -> bool:
        """True if phases differ from those of the last orbit."""
        last = self.arc.phases[-1]
        return phases is not None and last is not None and phases.slip_states != last.slip_states

    def _found(self, value: float) -> tuple[PeriodicOrbit, Phases | None] | None:
        """Orbit at a value and its phases if Newton's method finds one on the branch, else None."""
        try:
            orbit = self.arc.at(value)
        except ArithmeticError:
            return None
        if self.least not in (None, orbit.least):
            return None
        phases = orbit.phases
        joins = self._kinks if self._changes(phases) else self.arc.joins
        return (orbit, phases) if joins(value, orbit) else None

    def _kinks(self, value: float, orbit: PeriodicOrbit) -> bool:
        """True if an orbit of other phases is close to the expected state."""
        extent, last = self.arc.orbits[-1].extent, self.arc.orbits[-1].state
        change, miss = self.arc.guess(value) - last, orbit.state - self.arc.guess(value)
        near = FAR * relative(change, extent) + KINK
        return len(self.arc.values) == 1 or relative(miss, extent) < near
