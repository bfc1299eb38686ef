"""Find several equilibria of a network by deflation.

The rates are multiplied by the product of 1 + 1/|x - x_i|^2 over the equilibria x_i that are known, so that Newton's
method, which starts from one place again and again, cannot come to them twice.  Its step is the step dx of the undeflated
equations, divided by 1 - s, where s is the derivative of the logarithm of the product along dx: no further linear
equations.  The images of known equilibria by automorphisms of the graph are deflated too.  Differences of angles are
taken modulo their periods, and coordinates that can be shifted together are compared after the shift.

Source: Farrell, Birkisson & Funke, SIAM J. Sci. Comput. 37, A2026 (2015), equations (2.9) and (3.8).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.inputs.checks import check_integer, check_keys, check_seed, check_table, short_repr
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import Given
from ..results.labels import States
from ..support.arrays import row
from .equilibrium import REFUSED, Equilibrium, Search, near, resting_equations, shifted_components
from .linearised import Linearised
from .switching import permutations_of

STARTS, ROUNDS = 40, 3  # number of starts, and of searches from each after one that found a new equilibrium (choices)
# Most steps of a search, and the longest step in units of the region of the starts (choices).
MOST_STEPS, LONGEST = 50, 4.0
# Newton's method of `equilibrium` takes over where a step is shorter than this part of the region (a choice).
NEAR = 1e-3
SAME = 1e-6  # largest distance of two equilibria that count as one, relative to the region (a choice)
# Sizes of the region of the starts, relative to the largest initial state of each component (choices).
SCALES = (1.0, 2.0, 4.0, 8.0)


class Known:
    """Equilibria that were found, with their images, and distances from all of them."""

    def __init__(self, scene: Scene, shifts: np.ndarray, scales: np.ndarray) -> None:
        equations = scene.equations
        self.permutations = permutations_of(scene)
        self.shifts, self.scales = shifts, scales  # (states, shifts), (states,)
        self.states = np.zeros((0, equations.dimension))
        # The period of each state, infinite if it is no angle.
        self.periods = np.array([period or np.inf for period in periods_of_states(equations)])

    def add(self, state: np.ndarray) -> None:
        """Add an equilibrium and its images."""
        images = np.array([state[p] for p in self.permutations])
        self.states = np.concatenate([self.states, images])

    def differences(self, state: np.ndarray) -> np.ndarray:
        """Return the differences (equilibria, states) of a state from all known ones, in units of the scales."""
        gaps = state - self.states
        for ones in self.shifts.T:
            gaps -= gaps[:, [int(ones.argmax())]] * ones
        turns = np.isfinite(self.periods)
        gaps[:, turns] -= self.periods[turns] * np.round(gaps[:, turns] / self.periods[turns])
        return np.asarray(gaps / self.scales)

    def meets(self, state: np.ndarray) -> bool:
        """Return whether an equilibrium, or an image of it, is known."""
        return bool((np.abs(self.differences(state)).max(axis=1) < SAME).any())

    def factor(self, state: np.ndarray, step: np.ndarray) -> float:
        """Return 1/(1 - s), by which deflation multiplies a step of Newton's method."""
        gaps = self.differences(state)
        for ones in self.shifts.T:
            step = step - step[int(ones.argmax())] * ones
        squares = (gaps**2).sum(axis=1)
        # d log(1 + 1/q) = -dq/(q (q + 1)) with q = |x - x_i|^2.
        slope = float((-2.0 * (gaps @ (step / self.scales)) / (squares * (squares + 1.0))).sum())
        return 1.0 / (1.0 - slope) if slope != 1.0 else 1.0


class EquilibriumList(tuple[Equilibrium, ...]):
    """Equilibria that a search found; `stopped` if it ended at the largest number of them, so that more may exist."""

    stopped: bool

    def __new__(cls, equilibria: Iterable[Equilibrium], stopped: bool) -> EquilibriumList:
        """Make the list."""
        made = super().__new__(cls, equilibria)
        made.stopped = stopped
        return made

    def __reduce__(self) -> tuple[type[EquilibriumList], tuple[tuple[Equilibrium, ...], bool]]:
        return EquilibriumList, (tuple(self), self.stopped)

    def __repr__(self) -> str:
        stable = sum(each.stable for each in self)
        end = (
            f"the search ended at count = {len(self)}: more may exist"
            if self.stopped
            else f"{STARTS} random starts led to no others"
        )
        return "\n".join([f"{len(self)} equilibria, {stable} stable; {end}", *(f"  {each.text}" for each in self)])


def equilibria(
    scene: Scene,
    count: int = 20,
    *,
    rng: int | np.random.Generator | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> EquilibriumList:
    """Find several equilibria of a network without a drive, stable or not.

    Newton's method starts from the scene's start and from random states, with the equilibria that are known deflated.
    There may be more than are found.

    Parameters
    ----------
    scene : Scene
        Network.
    count : int
        Most equilibria.
    rng : int or Generator, optional
        Seed of the random starts, or a NumPy Generator that gives it; by default that of the scene.
    ranges : mapping of str to (float, float), optional
        Components and the ends of their random starts.  By default angles start anywhere, other components within 1, 2, 4
        and 8 times their largest initial state; of components that start at 0, times the least distance that changes a
        rate by the size of its terms.
    parameters : mapping of str to float, optional
        Parameters of the scene to set, for names that are keywords already.
    **more : float
        Parameters of the scene to set.

    Returns
    -------
    EquilibriumList
        A tuple of Equilibrium, in the order in which they were found.  Its field `stopped` is True if the search ended at
        `count`, so that more may exist.  Of equilibria that automorphisms of the graph map to each other there is
        one; equilibria that differ by whole turns of angles are one.

    Raises
    ------
    ValueError
        As `equilibrium`; for a range that is empty or of an unknown component.

    See Also
    --------
    equilibrium : Find one equilibrium.
    follow : Follow an equilibrium along a parameter.

    Examples
    --------
    Two bistable cells: (0, 0), (1, 1), (-1, -1), (a, -a), (b, c) and (-b, -c).

    >>> from synchain import Field, Rates, Scene, equilibria
    >>> from synchain.graphs import chain
    >>> pull = Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.2})
    >>> found = equilibria(Scene(Field({"x": "x - x**3"}), pull, chain(2), initial={"x": 1}))
    >>> len(found), sum(each.stable for each in found)
    (6, 3)
    """
    count, seed = check_integer("count", count, 1), check_seed("rng", scene.rng if rng is None else rng)
    scene = Given(equilibria, parameters, more, REFUSED).scene(scene)
    network, first = Linearised.of(resting_equations("equilibria", scene), scene.parameters), np.array(scene.y0)
    names, shifts = shifted_components(scene.equations, network, first)
    starts, scales = _starts(scene, network, seed, ranges)
    known = Known(scene, shifts, scales)
    found: list[Equilibrium] = []
    for start in (first, *starts):
        for _ in range(ROUNDS):
            state = _deflated(network, start, known, shifts)
            if state is None:
                break
            try:
                each = near(scene, network, state, (names, shifts))
            except ArithmeticError:
                break
            if known.meets(each.state):
                break
            known.add(each.state)
            found.append(each)
            if len(found) == count:
                return EquilibriumList(found, stopped=True)
    return EquilibriumList(found, stopped=False)


def _starts(
    scene: Scene, network: Linearised, seed: int, ranges: Mapping[str, tuple[float, float]] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return random starts (STARTS, states), and the scale (states,) of each state."""
    states, first = States.of(scene), np.array(scene.y0)
    size = len(first)
    angles = np.isfinite(Known(scene, np.zeros((size, 0)), np.ones(size)).periods)
    members = [states.rows == row for row in range(len(states.components))]
    sizes = np.where(angles, 1.0, np.abs(first))
    scales = np.array([sizes[each].max() for each in members])[states.rows]
    # A component that starts at 0 has the size that changes a rate by the size of its terms, where others are away from 0.
    for _ in members:
        beside = first + scales * np.cos(1.0 + np.arange(size))
        terms, slopes = network.term_sizes(beside), abs(network.jacobian(beside)).tocoo()
        noticed = np.full(size, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = terms[slopes.row] / slopes.data
        np.minimum.at(noticed, slopes.col, np.where(distances > 0.0, distances, np.inf))
        least = np.array([noticed[each].min() for each in members])[states.rows]
        scales = np.where((scales == 0.0) & np.isfinite(least), least, scales)
    scales[scales == 0.0] = scales.max() or 1.0
    spread = np.resize(SCALES, STARTS)[:, None] * scales
    spread[:, angles] = np.pi
    low, high = first - spread, first + spread
    for component, pair in checked_ranges("equilibria", {} if ranges is None else ranges, states.components):
        chosen = states.rows == component
        low[:, chosen], high[:, chosen] = pair
        scales[chosen] = 0.5 * (pair[1] - pair[0])
    share = np.random.default_rng(seed).uniform(size=(STARTS, size))
    return low + (high - low) * share, scales


def checked_ranges(
    function: str, ranges: Mapping[str, tuple[float, float]], components: Sequence[str]
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the number of each component with a range of initial values, and its ends."""
    check_keys(f"{function}: ranges", check_table(f"{function}: ranges", ranges), list(components))
    for name, interval in ranges.items():
        ends = row(f"{function}: the range of {name}", interval, 2)
        if len(ends) != 2 or not ends[0] < ends[1]:
            raise ValueError(
                f"{function}: the range of {name} is {short_repr(interval)}; expected two numbers, the lower one first"
            )
        yield components.index(name), ends


def _deflated(network: Linearised, start: np.ndarray, known: Known, shifts: np.ndarray) -> np.ndarray | None:
    """Return a state near an equilibrium that is not known, by Newton's method with deflation; None if it fails."""
    # A start on a known equilibrium has no direction to leave it.
    offset = 0.01 * known.scales * np.cos(1.0 + np.arange(len(start))) if known.meets(start) else 0.0
    try:
        search = Search.begin(network, start + offset, shifts)
        for _ in range(MOST_STEPS):
            gap = search.left(search.state, search.speeds)
            if not gap.any():
                return search.state
            step, speed = search.correction(gap)
            size = float(np.abs(step / known.scales).max())
            if not np.isfinite(size):
                return None
            if size < NEAR and not (np.abs(known.differences(search.state)).max(axis=1) < 10.0 * NEAR).any():
                return search.state
            factor = known.factor(search.state, step)
            factor = np.sign(factor) * min(abs(factor), LONGEST / max(size, 1e-300))
            search.state, search.speeds = search.state + factor * step, search.speeds + factor * speed
    except ArithmeticError:
        pass
    return None
