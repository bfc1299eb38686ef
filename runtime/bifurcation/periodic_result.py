"""`PeriodicOrbit`: a motion of a network that repeats itself, with its stability."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.scenes.scene import Scene

from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States
from ..stability.attractor import cycle_propagators
from ..stability.exponents import with_partner
from ..stability.motion import Turns, whole_turns
from ..stability.orbits import OrbitProblem, unit_of_time
from .flow import TOLERANCE, flow_of
from .phases import Phases, phases_of
from .transversal import WHOLE

SAME = 1e-7  # largest distance of two orbits that count as one, relative to the extent of each component (a choice)
ROUNDING = 10.0 * TOLERANCE  # largest error of the integration, relative to a state (a choice)
# Largest distance of the modulus of a neutral multiplier from 1: errors of the integration decide no stability (a
# choice).
NEUTRAL = 1e-9
LARGEST_LISTED = 6  # most multipliers in a summary


@dataclass(frozen=True, slots=True, repr=False)
class PeriodicOrbit(Labelled):
    """A motion of a network that repeats itself: after some periods of a drive, or after a period of its own.

    Parameters
    ----------
    scene : Scene
        The network with its parameters.
    periods : int
        Number of drive periods; 1 without a drive.
    state : ndarray, shape (states,)
        The state in the order of the equations, x_1 … x_n, v_1 … v_n, without slip states: at the beginning of a period
        of the drive, or anywhere on the orbit of an undriven network.
    multipliers : ndarray of complex, shape (k,)
        Floquet multipliers along the orbit, the largest first: of the whole network, of one node if all nodes move alike, of
        the clusters if nodes move in clusters. Without a drive one of them is 1, that of a shift along the orbit.
    residual : float
        Largest distance of the state from its image.
    steps : int
        Steps of Newton's method.
    free : float
        The period of an undriven motion; 0 with a drive.
    extent : ndarray, shape (states,)
        Extent of each state, the unit of distances between states; a state at rest has a share of the largest extent.
    classes : tuple of int
        The cluster of each node. Nodes of a cluster move alike.
    across : ndarray of complex, shape (l,)
        Multipliers of the differences within clusters, block by block.
    blocks : ndarray of int, shape (l,)
        The block of each, an index of `modes`.
    modes : tuple of str
        The blocks: the modes of the graph by their eigenvalues if all nodes move alike.
    pattern : str
        How the nodes move: "synchronous", "travelling wave …", "antiphase …", "clusters …"; empty if none of these.
    shifts : tuple of str
        Coordinates that can be shifted at all nodes together, so that the orbit closes in a moving frame.  Each makes one
        multiplier 1.
    speeds : ndarray, shape (shifts,)
        Mean speeds of the frame, those of the first node.

    See Also
    --------
    periodic_orbit : Find the orbit.
    """

    scene: Scene = field(repr=False)
    periods: int
    state: np.ndarray
    multipliers: np.ndarray
    residual: float
    steps: int
    free: float = 0.0
    extent: np.ndarray = field(default_factory=lambda: np.ones(1), repr=False)
    classes: tuple[int, ...] = (0,)
    across: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    blocks: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    modes: tuple[str, ...] = ()
    pattern: str = ""
    shifts: tuple[str, ...] = ()
    speeds: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def period(self) -> float:
        """The time after which the motion repeats itself, in units of non-dimensional time."""
        return self.free or self.periods * unit_of_time(self.scene)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the states of a node, without slip states."""
        return tuple(name for name in self.scene.components if name not in self.scene.equations.modes)

    @property
    def data(self) -> xr.Dataset:
        """State over components and nodes, and Floquet multipliers.

        `run(scene, start=orbit.data.state)` starts on the orbit.
        """
        if self.scene.equations.sticks:
            table = self.state.reshape(len(self.components), self.scene.n)
        else:
            table = States.of(self.scene).table(self.state)
        return dataset(
            {
                "state": (STATE, table, "state at the beginning of a period"),
                "multipliers": (
                    ("number",),
                    self.multipliers,
                    "Floquet multipliers along the orbit, the largest first",
                ),
                "across": (("difference",), self.across, "Floquet multipliers of differences within clusters"),
                "block": (("difference",), self.blocks, "block of each difference"),
            },
            {
                "component": list(self.components),
                "node": list(self.scene.topology.labels),
                "number": np.arange(1, len(self.multipliers) + 1),
            },
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Period, state, multipliers, stability and residual."""
        names = self.scene.equations.state  # slip states stand at the end
        shown = [f"{name} = {x:.10g}" for name, x in zip(names[:8], self.state[:8], strict=False)]
        return (
            ("scene", scene_text(self.scene)),
            ("period", f"{self.period:.12g} units of time") if self.free else ("drive periods", str(self.periods)),
            ("state", ", ".join([*shown, *(["…"] if len(self.state) > len(shown) else [])])),
            ("multipliers", _listed(self.multipliers)),
            *((("across", _listed(self.across[np.argsort(-np.abs(self.across))])),) if len(self.across) else ()),
            ("verdict", self.verdict),
            *(
                (
                    (
                        "frame",
                        ", ".join(
                            f"{s} of all nodes at the mean speed {v:.10g}"
                            for s, v in zip(self.shifts, self.speeds, strict=True)
                        ),
                    ),
                )
                if self.shifts
                else ()
            ),
            ("residual", f"{self.residual:.1e} after {self.steps} steps"),
        )

    @property
    def stable(self) -> bool:
        """True if all multipliers lie inside the unit circle, but for the 1 of the motion and those of the shifts."""
        return self.stable_along and bool(np.all(np.abs(self.across) < 1.0 - NEUTRAL))

    @property
    def stable_along(self) -> bool:
        """True if the orbit is stable as long as clusters stay together."""
        return bool(np.all(np.abs(self._others) < 1.0 - NEUTRAL))

    @property
    def growing(self) -> int:
        """Number of multipliers outside the unit circle, of differences within clusters too."""
        return int((np.abs(np.append(self._others, self.across)) > 1.0 + NEUTRAL).sum())

    @property
    def _others(self) -> np.ndarray:
        """The multipliers along the orbit without those that are always 1: of the motion itself, and of the shifts."""
        neutral = len(self.shifts) + (self.free > 0.0)
        return np.delete(self.multipliers, np.argsort(np.abs(self.multipliers - 1.0), kind="stable")[:neutral])

    @property
    def verdict(self) -> str:
        """How the nodes move, and the stability of what.

        A network is called stable only if all its multipliers are known.
        """
        head, along = f"{self.pattern}; " if self.pattern else "", _stability(self._others)
        if self.scene.n == 1:
            return f"one oscillator: {along}"
        if not len(self.across):
            return f"{head}{along}, by the multipliers of all {self.scene.n} nodes"
        word = _stability(self.across)
        marked = np.abs(self.across) > (1.0 - NEUTRAL if word == "neutral" else 1.0 + NEUTRAL)
        size, number = f"{len(marked)} multipliers", int(marked.sum())
        if self.modes != (WHOLE,):
            # A block has a multiplier for each component and each of its modes.
            blocks = [marked[self.blocks == k] for k in range(len(self.modes))]
            copies = [len(block) // len(self.components) for block in blocks]
            size = f"{sum(copies)} modes"
            number = sum(count for count, block in zip(copies, blocks, strict=True) if block.any())
        across = f"{word} in {number} of {size}" if number else f"stable in all {size}"
        return f"{head}along itself {along}; across it {across}, largest {_largest(self.across)}"

    @property
    def phases(self) -> Phases | None:
        """Phases of stick and slip, or events, of one cycle of nodes that move alike; None without events."""
        if len(set(self.classes)) > 1 or not self.scene.equations.sticks:
            return None
        lone = self.scene.lone
        return phases_of(lone, lone.parameters, self.state[:: self.scene.n], self.period)

    @property
    def points(self) -> np.ndarray:
        """The states (periods, states) at the beginning of each period of the drive."""
        flow = flow_of(self.scene, self.scene.equations, (), self.state)
        points, unit = [self.state], np.full(1, self.period / self.periods)
        for _ in range(self.periods - 1):
            points.append(flow.advance(self.scene.parameters, points[-1][None], unit)[0])
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
        """Return whether a state is that of the orbit, to within SAME and whole turns of angles."""
        gap = state - self.state
        return closed(gap - whole_turns(periods_of_states(self.scene.equations), gap), SAME * self.extent, self.state)

    def transversal_multipliers(self, alpha: float) -> np.ndarray:
        """Compute the multipliers of a transversal mode along the orbit of nodes that move alike.

        Parameters
        ----------
        alpha : float
            Strength of the mode.

        Returns
        -------
        ndarray, shape (components,)
            The largest first.

        Raises
        ------
        ValueError
            If the nodes do not move alike.
        """
        if len(set(self.classes)) > 1:
            raise ValueError(
                f"transversal modes: found {len(set(self.classes))} clusters; expected nodes that all move alike"
            )
        first = np.zeros(len(self.scene.components))
        first[: len(self.components)] = self.state[:: self.scene.n]
        extent = np.pad(self.extent[:: self.scene.n], (0, len(first) - len(self.components)))
        turns = Turns(self.free or unit_of_time(self.scene), extent, "period")
        problem = OrbitProblem.of_modes(
            with_partner(self.scene).replace(rtol=TOLERANCE, atol=None), np.array([alpha]), first[None], 1, turns
        )
        propagators, logarithms, _ = cycle_propagators(problem, problem.with_slip_states(first[None])[0], self.periods)
        if (size := float(logarithms[0, 0])) > 700.0:  # double precision ends at exp(709.8)
            raise FloatingPointError(
                f"multipliers: found a deviation that grows by exp({size:.3g}); expected exp(700) at most"
            )
        return sorted_by_size(np.linalg.eigvals(propagators[0, 0] * np.exp(size)))


def _stability(multipliers: np.ndarray) -> str:
    """Return "stable", "unstable" or "neutral" by the multipliers without those that are always 1."""
    largest = float(np.abs(multipliers).max(initial=0.0))
    return "stable" if largest < 1.0 - NEUTRAL else "unstable" if largest > 1.0 + NEUTRAL else "neutral"


def sorted_by_size(multipliers: np.ndarray) -> np.ndarray:
    """Return multipliers with the largest modulus first."""
    return np.asarray(multipliers[np.argsort(-np.abs(multipliers), kind="stable")])


def closed(gap: np.ndarray, allowed: np.ndarray, state: np.ndarray) -> bool:
    """Return whether every component of a gap at a state is as small as allowed, but for errors of the integration."""
    return bool(np.all(np.abs(gap) <= allowed + ROUNDING * np.abs(state)))


def _listed(multipliers: np.ndarray) -> str:
    """Write the largest multipliers."""
    shown = [f"{value.real:.6g}" if value.imag == 0.0 else f"{value:.6g}" for value in map(complex, multipliers)]
    return ", ".join([*shown[:LARGEST_LISTED], *(["…"] if len(shown) > LARGEST_LISTED else [])])


def _largest(multipliers: np.ndarray) -> str:
    """Write the largest multiplier; of a complex one its modulus."""
    value = complex(multipliers[int(np.abs(multipliers).argmax())])
    return f"{value.real:.6g}" if value.imag == 0.0 else f"|{value:.6g}| = {abs(value):.6g}"
