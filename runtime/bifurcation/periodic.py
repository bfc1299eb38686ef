"""Find periodic orbits by Newton's method.

A drive of period T makes the stroboscopic map P: x(0) -> x(kT) over k of its periods.  An orbit of k periods is a fixed
point, found by x <- x + (I - M)^-1 (P(x) - x).  The derivative M of P is the monodromy matrix: the propagator of a
deviation along the orbit (`synchain.runtime.stability.orbits`), through stick and slip if friction is set-valued, so
that the method converges quadratically for both forms of the law.  The eigenvalues of M are the Floquet multipliers.

The cycle of an undriven oscillator is followed to its attractor first; `synchain.runtime.stability.limit_cycle` then
solves for a state and the period together.

Sources: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapter 7;
for orbits with stick, Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems
(Springer, 2004), chapters 7-8.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral, Real

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from synchain.models.dynamics.angles import periods_of_kinds
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import without_drive
from synchain.models.inputs.checks import short_repr
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import Given
from ..results.labelled import Labelled, dataset, scene_text
from ..stability.attractor import RETURN, cycle_propagators
from ..stability.exponents import coupled_cell
from ..stability.limit_cycle import limit_cycle
from ..stability.motion import Turns, rests
from ..stability.orbits import OrbitProblem, unit_of_time, within
from .phases import Phases, phases_of

TOLERANCE = 1e-12
"""Relative tolerance of the integration: five digits below SAME (a choice)."""

NEWTON = {
    "rtol": f"orbits are integrated with rtol = {TOLERANCE:g}, on which the comparison of orbits rests",
    "workers": "each step of Newton's method needs the one before",
    "executor": "each step of Newton's method needs the one before",
}
"""Keywords that functions of periodic orbits refuse, with the reason."""

SAME = 1e-7
"""Largest distance of two orbits that count as one, relative to the extent of each component (a choice)."""

CLOSED = 1e-9
"""Largest distance of the state of an orbit from its image, relative to the extent of each component (a choice)."""

ROUNDING = 10.0 * TOLERANCE
"""Largest error of the integration, relative to a state (a choice); a smaller sliding speed, relative to its extent, is
an
error too."""

TRAVELLED = 1e-3
"""The extent of an orbit is at least this part of the distance that Newton's method went from its start (a choice)."""

ASTRAY = 1e6
"""Newton's method ends if it goes farther than this many extents of the motion from its start (a choice)."""

MOST_STEPS = 30
"""Most steps of Newton's method: it doubles the digits in a step near an orbit (a choice)."""

LONGEST = 10_000
"""Most drive periods of an orbit; unstable ones far shorter already lose all their digits."""


@dataclass(frozen=True, slots=True, repr=False)
class PeriodicOrbit(Labelled):
    """A motion that repeats itself: after some periods of the drive, or after the period of an undriven oscillator.

    Parameters
    ----------
    scene : Scene
        Oscillator with its parameters.
    periods : int
        Number of drive periods; 1 without a drive.
    state : ndarray, shape (components,)
        State at the beginning of a period of the drive, or anywhere on the orbit of an undriven oscillator.
    multipliers : ndarray, shape (components,)
        Floquet multipliers of the oscillator alone, the largest first; without a drive one of them is 1, that of a
        shift along the orbit.
    residual : float
        Largest distance of the state from its image.
    steps : int
        Steps of Newton's method.
    free : float
        The time after which the motion of an undriven oscillator repeats itself; 0 with a drive.
    extent : ndarray, shape (components,)
        Extent of each component, the unit of distances between states. For a component at rest, the unit follows from
        the distance that Newton's method went from its start.

    See Also
    --------
    synchain.periodic_orbit
    """

    scene: Scene = field(repr=False)
    periods: int
    state: np.ndarray
    multipliers: np.ndarray
    residual: float
    steps: int
    free: float = 0.0
    extent: np.ndarray = field(default_factory=lambda: np.ones(1), repr=False)

    @property
    def period(self) -> float:
        """The time after which the motion repeats itself, in units of non-dimensional time."""
        return self.free or self.periods * unit_of_time(self.scene)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of `state`."""
        return tuple(name for name in self.scene.components if name not in self.scene.equations.modes)

    @property
    def data(self) -> xr.Dataset:
        """State and Floquet multipliers."""
        return dataset(
            {
                "state": (("component",), self.state, "state at the beginning of a period"),
                "multipliers": (("number",), self.multipliers, "Floquet multipliers, the largest first"),
            },
            {"component": list(self.components), "number": np.arange(1, len(self.multipliers) + 1)},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Periods, state, multipliers and residual."""
        state = ", ".join(f"{name} = {x:.10g}" for name, x in zip(self.components, self.state, strict=True))
        sizes = ", ".join(f"{value:.6g}" for value in self.multipliers)
        return (
            ("scene", scene_text(self.scene)),
            ("orbit", "of one oscillator, alone or in step with the others"),
            ("period", f"{self.period:.12g} units of time") if self.free else ("drive periods", str(self.periods)),
            ("state", state),
            ("multipliers", f"{sizes}: {'stable' if self.stable else 'unstable'} for one oscillator"),
            ("residual", f"{self.residual:.1e} after {self.steps} steps"),
        )

    @property
    def stable(self) -> bool:
        """True if all multipliers, except the multiplier 1 of a shift along the orbit, lie inside the unit circle."""
        shift = [int(np.abs(self.multipliers - 1.0).argmin())] if self.free else []
        return bool(np.all(np.abs(np.delete(self.multipliers, shift)) < 1.0))

    @property
    def phases(self) -> Phases | None:
        """Phases of stick and slip of one cycle; None without set-valued friction."""
        return phases_of(self.scene, self.state, self.periods)

    @property
    def points(self) -> np.ndarray:
        """The states (periods, components) at the beginning of each period of the drive."""
        points = [self.state]
        for _ in range(self.periods - 1):
            points.append(_strobe(self.scene, points[-1], 1, 0.0, extent=self.extent)[0][: len(self.state)])
        return np.array(points)

    @property
    def least(self) -> int:
        """Least number of drive periods after which the motion repeats itself, to within SAME."""
        if self.periods == 1:
            return 1
        points = self.points
        divisors = (k for k in range(1, self.periods) if self.periods % k == 0)
        return next((k for k in divisors if self.meets(points[k])), self.periods)

    def meets(self, state: np.ndarray) -> bool:
        """Return whether a state is one of the orbit's `points`, to within SAME and whole turns of angles."""
        gap = state - self.state
        return closed(gap - whole_turns(self.scene, gap), SAME * self.extent, self.state)

    def transversal_multipliers(self, alpha: float) -> np.ndarray:
        """Compute the multipliers of a transversal mode along the orbit.

        Parameters
        ----------
        alpha : float
            Strength of the mode.

        Returns
        -------
        ndarray, shape (components,)
            The largest first.
        """
        return _multipliers(_strobe(self.scene, self.state, self.periods, alpha, self.free, self.extent)[1])


def periodic_orbit(
    scene: Scene,
    periods: int = 1,
    start: Sequence[float] | np.ndarray | None = None,
    *,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> PeriodicOrbit:
    """Find a periodic orbit of one oscillator of a scene, which is also the synchronous orbit of a network.

    `PeriodicOrbit.transversal_multipliers` decides whether a network stays synchronous.  The scene provides the model,
    parameters, initial state, transient with its unit, integrator and max_steps.  The tolerance is 1e-12, nothing is
    recorded, and axes, draws and `stop` are refused.

    Parameters
    ----------
    scene : Scene
        Source of the oscillator.
    periods : int
        Number of drive periods after which the orbit repeats itself; 1 without a drive.
    start : array_like, shape (components,), optional
        Start of Newton's method; by default the scene's initial state after its transient.  For an undriven oscillator,
        the motion from the start must reach the orbit, which must attract; the transient counts mean return times.
    parameters : mapping of str to float, optional
        Parameters of the scene to set, for names that are keywords already.
    **more : float
        Parameters of the scene to set.

    Returns
    -------
    PeriodicOrbit

    Warns
    -----
    RuntimeWarning
        If the nodes of a network were given different initial states, which one oscillator does not have.

    Raises
    ------
    ValueError
        If `periods` is out of range, a parameter is unknown, or `start` is no state.
    ArithmeticError
        If Newton's method does not converge.

    See Also
    --------
    follow : Follow an orbit along a parameter and locate its bifurcations.
    skeleton : Search all orbits of some periods, stable or not.
    equilibrium : Find a state at rest.

    Examples
    --------
    The limit cycle of van der Pol's oscillator:

    >>> from synchain import Scene, periodic_orbit
    >>> orbit = periodic_orbit(Scene("van_der_pol"))
    >>> round(orbit.period, 6), orbit.stable
    (6.663287, True)
    """
    if start is None:
        _warn_of_different_starts(scene)
    few = {name: "a few steps of Newton's method are soon done" for name in ("show_progress", "progress")}
    scene = coupled_cell(Given(periodic_orbit, parameters, more, {**NEWTON, **few}), scene, TOLERANCE)
    check_periods(periods)
    if not without_drive(scene.equations, scene.parameters).forced:
        return _limit_cycle(scene, periods, start)
    if start is not None:
        return _newton(scene, int(periods), _state(scene, start))
    # Newton's method starts from the state after the transient, in units of the drive's period.
    first = _initial(scene)[None]
    problem = OrbitProblem.of_modes(scene, np.zeros(1), first, 1)
    units = scene.transient if scene.time_unit == "period" else math.ceil(scene.transient / problem.unit)
    _, (settled,) = problem.settled(problem.with_slip_states(first), units)
    return _newton(scene, int(periods), np.asarray(settled[: problem.components]))


def _newton(scene: Scene, periods: int, start: np.ndarray) -> PeriodicOrbit:
    """Find the orbit of a driven oscillator near a start (components,)."""
    extent = _extent(scene, start, periods)
    best, steps, nearest, state = np.inf, 0, start, start
    while steps < MOST_STEPS:
        image, matrix = _strobe(scene, state, periods, 0.0, extent=extent)
        gap = image[: len(state)] - state
        # A state that slips at a rounding error, and whose image sticks: take the velocity of the ground.
        if _nearly_sticks(image, gap, extent):
            state = image[: len(state)] - np.array([gap[0], 0.0])
            continue
        # Stop where the gap no longer falls: it has come down to the errors of the integration, or diverges.
        residual = relative(gap, extent)
        if not residual < best:
            break
        best, nearest, monodromy, left = residual, state, matrix, gap
        if residual == 0.0:
            break
        if _sticks_throughout(image, matrix):
            # The ground carries the body along, so that I - M is singular: follow the motion until the body slips.
            best, state = np.inf, image[: len(state)]
        else:
            try:
                state = state + np.asarray(np.linalg.solve(np.eye(len(gap)) - matrix, gap))
            except np.linalg.LinAlgError:
                raise ArithmeticError(
                    "Newton's method: a multiplier is 1 to rounding, so the orbit is not isolated"
                ) from None
        steps += 1
        if not relative(state - start, extent) < ASTRAY:
            break
    # Accept by the extent of the orbit itself; a component at rest is measured by the way from the start.
    extent = np.maximum(_extent(scene, nearest, periods, extent), TRAVELLED * np.abs(nearest - start))
    size = float(np.abs(left).max())
    if not closed(left, CLOSED * extent, nearest):
        raise ArithmeticError(
            f"no orbit of {periods} drive period{'s' * (periods > 1)} near the start: the best residual was {size:.1e}"
        )
    return PeriodicOrbit(scene, periods, nearest, _multipliers(monodromy), size, steps, extent=extent)


def relative(distance: np.ndarray, extent: np.ndarray) -> float:
    """Return the largest component of a distance, in units of the extent; a component without extent is not scaled."""
    return float(np.abs(distance / np.where(extent > 0.0, extent, 1.0)).max())


def closed(gap: np.ndarray, allowed: np.ndarray, state: np.ndarray) -> bool:
    """Return whether every component of a gap at a state is as small as allowed, but for errors of the integration."""
    return bool(np.all(np.abs(gap) <= allowed + ROUNDING * np.abs(state)))


def whole_turns(scene: Scene, differences: np.ndarray) -> np.ndarray:
    """Return the whole turns in differences (..., components) of the states of one oscillator.

    0 where it has no angle.
    """
    # Links do not move an orbit of one oscillator, so its equations alone decide which components are angles.
    (periods,) = periods_of_kinds(Equations.of_equal_nodes(scene.equations.node, None, 1))
    turns = np.zeros_like(differences)
    for component, period in enumerate(periods[: differences.shape[-1]]):
        if period is not None:
            turns[..., component] = period * np.round(differences[..., component] / period)
    return turns


def _extent(scene: Scene, state: np.ndarray, periods: int, scales: np.ndarray | None = None) -> np.ndarray:
    """Measure how far each component (components,) moves within some drive periods; `scales` set the tolerances."""
    problem, first = _problem(scene, state, 0.0, scene.period, scales)
    return np.asarray(np.ptp([first, *within(problem, first[None], periods)], axis=0)[: len(state)])


def _limit_cycle(scene: Scene, periods: int, start: Sequence[float] | np.ndarray | None) -> PeriodicOrbit:
    """Find the cycle that attracts an undriven oscillator from its start."""
    if periods != 1:
        raise ValueError(f"periods = {periods}; expected 1 for an oscillator without a drive, whose period is found")
    if scene.equations.sticks:
        raise ValueError(
            "periodic orbits: found set-valued friction without a drive; expected a drive, or a smoothed law"
        )
    # Follow the motion through the transient; it must not come to rest.
    first = (_initial(scene) if start is None else _state(scene, start))[None]
    problem = OrbitProblem.of_modes(scene, np.zeros(1), first, 1)
    problem, (settled,) = problem.settled(problem.with_slip_states(first), scene.transient)
    if rests(problem.rates, settled, RETURN, problem.extent):
        at = ", ".join(f"{name} = {x:.6g}" for name, x in zip(scene.components, settled, strict=False))
        raise ArithmeticError(f"no cycle: the motion comes to rest at {at}; `equilibrium` finds such states")
    # Newton's method for state and period, then the multipliers along the cycle.
    cycle = limit_cycle(problem, settled, RETURN)
    if cycle is None:
        raise ArithmeticError(
            f"no attracting cycle near the motion after {scene.transient:g} mean return times; start elsewhere, or settle longer"
        )
    state, extent = cycle.state, problem.extent
    image, matrix = _strobe(scene, state, 1, 0.0, cycle.period, extent)
    residual = float(np.abs(image - state).max())
    return PeriodicOrbit(scene, 1, state, _multipliers(matrix), residual, cycle.steps, cycle.period, extent)


def _nearly_sticks(image: np.ndarray, gap: np.ndarray, extent: np.ndarray) -> bool:
    """Return whether a state slips at a speed of rounding errors and its image sticks."""
    return len(image) > len(gap) and image[-1] == 0.0 and 0.0 < abs(gap[1]) < ROUNDING * extent[1]


def _sticks_throughout(image: np.ndarray, matrix: np.ndarray) -> bool:
    """Return whether a body sticks in all periods: the map only shifts the position, so that M = diag(1, 0)."""
    return len(image) > len(matrix) and image[-1] == 0.0 and np.array_equal(matrix, np.diag([1.0, 0.0]))


def check_periods(periods: object) -> None:
    """Check a number of drive periods."""
    if not isinstance(periods, Integral) or not 1 <= int(periods) <= LONGEST:
        raise ValueError(f"periods = {short_repr(periods)}; expected a whole number, at least 1, at most {LONGEST}")


def orbit_through(scene: Scene, periods: int, state: np.ndarray, parameters: Mapping[str, float]) -> PeriodicOrbit:
    """Return the orbit through a state that returns to itself, without a search. Shapes: state (components,)."""
    scene = _driven(Given(orbit_through, parameters), scene)
    extent = _extent(scene, state, periods)
    image, matrix = _strobe(scene, state, periods, 0.0, extent=extent)
    residual = float(np.abs(image[: len(state)] - state).max())
    return PeriodicOrbit(scene, periods, state, _multipliers(matrix), residual, 0, extent=extent)


def strobe(
    scene: Scene,
    state: np.ndarray,
    periods: int,
    parameters: Mapping[str, float] | None = None,
    extent: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate the stroboscopic map and its derivative.

    Shapes: state (components,), extent (components,); returns image (components,), matrix (components, components).
    """
    image, matrix = _strobe(_driven(Given(strobe, parameters), scene), state, periods, 0.0, extent=extent)
    return image[: len(state)], matrix


def _driven(keywords: Given, scene: Scene) -> Scene:
    """Return the scene with its parameters and the tolerance of orbits; ValueError if it has no drive."""
    scene = keywords.scene(scene, rtol=TOLERANCE)
    unit_of_time(scene)
    if not scene.period:
        raise ValueError(
            "periodic orbits are looked for on the stroboscopic map of a drive; found an oscillator without one"
        )
    return coupled_cell(Given(keywords.function), scene, TOLERANCE)


def _warn_of_different_starts(scene: Scene) -> None:
    """Warn if the nodes of a network were given different initial states."""
    initial = check_scene(scene).given["initial"] or {}
    different = next((name for name in initial if name in scene.initial and len({*scene.initial[name]}) > 1), None)
    if different is not None:
        warn(
            f"periodic_orbit: found different initial {different} of {scene.n} nodes; expected equal ones, as the orbit is that "
            "of one oscillator; the start of the first is taken; run the scene to see how the network moves"
        )


def _initial(scene: Scene) -> np.ndarray:
    """Return the initial state of the first oscillator, with its slip state if it has one."""
    return np.array([values[0] for values in scene.initial.values()], dtype=float)


def _state(scene: Scene, start: Sequence[float] | np.ndarray) -> np.ndarray:
    """Check a start and return it as the state (components,) of one oscillator, without a slip state."""
    names = tuple(name for name in scene.components if name not in scene.equations.modes)
    try:
        state = np.array(start, dtype=float)
    except (TypeError, ValueError):
        state = np.empty(0)
    if state.ndim != 1 or len(state) not in (len(names), len(scene.components)) or not np.all(np.isfinite(state)):
        raise ValueError(f"start: found {short_repr(start)}; expected a number for each of {', '.join(names)}")
    return state[: len(names)]


def stability_end(orbit: PeriodicOrbit, low: float, high: float) -> float:
    """Find the strength at which the largest transversal multiplier has modulus 1, to rounding.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Orbit of one oscillator.
    low, high : float
        Strengths alpha of a mode that grows at one of them and decays at the other.

    Returns
    -------
    float
        The strength.

    Raises
    ------
    ValueError
        If a strength is not finite, or if the mode grows, or decays, at both.

    See Also
    --------
    periodic_orbit : Find the orbit.
    """
    for name, value in (("low", low), ("high", high)):
        if not isinstance(value, Real) or not math.isfinite(value):
            raise ValueError(f"{name} = {short_repr(value)}; expected a finite strength alpha")

    def growth(alpha: float) -> float:
        return float(np.log(abs(orbit.transversal_multipliers(alpha)[0])))

    if growth(low) * growth(high) > 0.0:
        raise ValueError(f"alpha: the mode grows, or decays, at {low} and at {high}; expected a change between them")
    return float(brentq(growth, low, high, xtol=1e-14, rtol=1e-14))


def _strobe(
    scene: Scene, state: np.ndarray, periods: int, alpha: float, free: float = 0.0, extent: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the state some periods later, and the propagator of a mode of strength alpha.

    A period is that of the drive, or has the length `free`.
    """
    problem, first = _problem(scene, state, alpha, free or scene.period, extent)
    propagators, logarithms, image = cycle_propagators(problem, first, periods)
    if (size := float(logarithms[0, 0])) > 700.0:  # double precision ends at exp(709.8)
        raise FloatingPointError(
            f"multipliers: found a deviation that grows by exp({size:.3g}); expected exp(700) at most"
        )
    return image, propagators[0, 0] * math.exp(size)


def _problem(
    scene: Scene, state: np.ndarray, alpha: float, period: float | None, extent: np.ndarray | None = None
) -> tuple[OrbitProblem, np.ndarray]:
    """Return orbits with a mode of strength alpha in units of a period, and the state with its slip state.

    Absolute tolerances follow the extent.
    """
    start, moves = np.zeros(len(scene.initial)), np.zeros(len(scene.initial))
    start[: len(state)] = state
    if extent is not None:
        moves[: len(state)] = extent
    turns = Turns(period or 2.0 * math.pi, moves, "period")
    problem = OrbitProblem.of_modes(scene, np.array([alpha]), start[None], 1, turns)
    return problem, problem.with_slip_states(start[None])[0]


def _multipliers(matrix: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of a monodromy matrix, the largest first."""
    multipliers = np.linalg.eigvals(matrix)
    return np.asarray(multipliers[np.argsort(-np.abs(multipliers), kind="stable")])
