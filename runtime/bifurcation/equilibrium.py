"""Equilibria of undriven networks, and motions that an even shift of a coordinate makes them.

Newton's method on the rates with the exact Jacobian, M d(state)/dt = r(state).  At rest M may depend on the state: what its
derivative adds to the linearised equations is multiplied by rates that are zero.

If a coordinate of all nodes can be shifted together (the phases of oscillators, the rotor angles of a power grid),
equilibria are not isolated.  Unknown is then also the common speed of the shift, r(state) = speed * shift, and the correction is
normal to the shift.  A speed other than zero makes a rigid rotation: an equilibrium in the frame that moves with it.

A conserved momentum makes a line of equilibria too, free masses at any common speed: steps of least norm lead to one of
them near the start.

Where Newton's method fails, implicit Euler steps follow the motion from the same start, the longer the smaller the rates
have become (pseudo-transient continuation), and Newton's method goes on from there.

Sources: Kelley & Keyes, SIAM J. Numer. Anal. 35, 508 (1998); Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), section 1.2; Deuflhard, Newton Methods
for Nonlinear Problems (Springer, 2004), section 3.3 (the monotonicity of the residual).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from scipy import linalg, sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs, splu

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import expect_continuous
from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import Given
from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States
from ..sweeps.continued_start import Start, started
from .linearised import Linearised

MOST_STEPS, HALVINGS = 100, 40
"""Most steps of Newton's method, and how often one is halved until the residual falls."""

CLOSED = 1e-11
"""Largest rate at an equilibrium, relative to the sizes of its terms."""

TAIL = 0.34
"""Largest part of the rates that the closing step of Newton's method leaves.

A root of multiplicity m leaves (1 - 1/m)^m, 1/4 of a fold; a tail x^-p of rates without a root leaves (1 + 1/p)^-p,
more than 1/e.
"""

MOST_RELAXED, FIRST_RATE = 500, 10.0
"""Most steps along the motion, and the inverse length of the first, by the largest slope."""

WORSE, NEWTON = 1.5, 1e-6
"""Growth of the rates over a step along the motion that is repeated with a shorter one, and rates that are small enough
for Newton's method."""

SINGULAR, DAMPED = 1e-13, 1e-7
"""Least pivot, relative to the largest, of equations that are not singular, and the damping of those that are, relative to
their entries."""

DENSE = 2000
"""Most states of which all eigenvalues are computed."""

FEW = 12
"""Eigenvalues of larger networks, unless more are asked for."""

ASIDE = 1e-6
"""Distance from zero, relative to the largest entry of the Jacobian, of the place around which few eigenvalues are computed."""

EVEN = 1e-15
"""Speed that is rounding, relative to the largest scale of a rate."""

ZERO = 1e-7
"""Size of an eigenvalue that counts as zero, relative to the largest: at a fold two solutions merge, and rounding of
1e-16 moves the eigenvalue by its root."""

LEAST = 1e-12
"""Size of an eigenvalue that is rounding, relative to the fastest."""

BESIDE = 0.1
"""How far aside, relative to the state, the slopes of rates are looked at: at a fold those at the state itself may be zero."""

SHIFTS = (7e-13, 7e-9, 7e-5, 0.7, 7e3, 7e7, 7e11)
"""Distances of shifts that must not change the rates, whatever the unit of the state."""

REFUSED = {
    "rtol": "Newton's method ends at rounding",
    "transient": "it starts from the scene's start, or from `start`, and integrates nothing",
    **{name: "each step of Newton's method needs the one before" for name in ("workers", "executor")},
    **{name: "a few steps of Newton's method are soon done" for name in ("show_progress", "progress")},
}
"""What the function does not take, and why."""


@dataclass(frozen=True, slots=True, repr=False)
class Equilibrium(Labelled):
    """A state of a network at rest, or one that moves as a whole along its shifts.

    Parameters
    ----------
    scene : Scene
        Network with its parameters.
    state : ndarray, shape (states,)
        The state in the order of the equations: x_1 … x_n, v_1 … v_n.
    eigenvalues : ndarray of complex, shape (k,)
        Eigenvalues of the linearised network per unit of non-dimensional time, the largest real part first: all, or those
        nearest to zero.
    shifts : tuple of str
        Coordinates that can be shifted at all nodes together without any change of the rates. Each makes one eigenvalue zero.
    speeds : ndarray, shape (shifts,)
        Common rates of these coordinates; 0 at rest.
    residual : float
        Largest rate but for the speeds.
    steps : int
        Steps of Newton's method.
    """

    scene: Scene = field(repr=False)
    state: np.ndarray
    eigenvalues: np.ndarray
    shifts: tuple[str, ...]
    speeds: np.ndarray
    residual: float
    steps: int

    @property
    def data(self) -> xr.Dataset:
        """State over components and nodes, eigenvalues over their number.

        `run(scene, start=found.data.state)` starts from it.
        """
        states = States.of(self.scene)
        values = {
            "state": (STATE, states.table(self.state), "state at rest"),
            "eigenvalues": (("number",), self.eigenvalues, "eigenvalues, the largest real part first"),
            "speeds": (("shift",), self.speeds, "common rates of what can be shifted"),
        }
        labels = {
            "component": list(states.components),
            "node": list(self.scene.topology.labels),
            "number": np.arange(1, len(self.eigenvalues) + 1),
            "shift": list(self.shifts),
        }
        return dataset(values, labels, self.scene)

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """State, eigenvalues, what can be shifted, residual."""
        names = self.scene.equations.state
        shown = [f"{name} = {x:.10g}" for name, x in zip(names[:8], self.state[:8], strict=True)]
        largest = [f"{value:.6g}" for value in self.eigenvalues[:6]]
        moves = [f"{name} of all nodes, at the speed {v:.6g}" for name, v in zip(self.shifts, self.speeds, strict=True)]
        return (
            ("scene", scene_text(self.scene)),
            ("state", ", ".join([*shown, *(["…"] if len(names) > len(shown) else [])])),
            ("eigenvalues", ", ".join([*largest, *(["…"] if len(self.eigenvalues) > len(largest) else [])])),
            ("verdict", self.verdict),
            *((("shifts", "; ".join(moves)),) if moves else ()),
            ("residual", f"{self.residual:.1e} after {self.steps} steps"),
        )

    @property
    def complete(self) -> bool:
        """True if all eigenvalues are known."""
        return len(self.eigenvalues) == len(self.state)

    @property
    def growing(self) -> int:
        """Number of eigenvalues with a positive real part, among those that are known."""
        return int((self._others.real > self._zero).sum())

    @property
    def neutral(self) -> int:
        """Number of eigenvalues on the imaginary axis, to rounding, but those of the shifts."""
        return int((np.abs(self._others.real) <= self._zero).sum())

    @property
    def stable(self) -> bool:
        """True if small deviations are known to decay, but for a shift of the whole: if all eigenvalues are known."""
        return self.complete and not self.growing and not self.neutral

    @property
    def verdict(self) -> str:
        """The stability in words."""
        if self.growing:
            return f"unstable, {'' if self.complete else 'at least '}{self.growing} growing"
        if not self.complete:
            return f"not decided: none of the {len(self.eigenvalues)} eigenvalues nearest to zero grows"
        return f"neutral, {self.neutral} on the imaginary axis" if self.neutral else "stable"

    @property
    def _others(self) -> np.ndarray:
        """The eigenvalues but those of the shifts."""
        return np.delete(self.eigenvalues, np.argsort(np.abs(self.eigenvalues), kind="stable")[: len(self.shifts)])

    @property
    def _zero(self) -> float:
        """Largest real part that counts as zero."""
        return ZERO * float(np.abs(self.eigenvalues).max(initial=0.0))


def equilibrium(
    scene: Scene,
    start: Start | None = None,
    *,
    count: int | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Equilibrium:
    """Find an equilibrium of a network without a drive by Newton's method, and its stability.

    If that fails, steps along the motion lead closer to the rest that it comes to, if it does.

    Parameters
    ----------
    scene : Scene
        Network, of any size.
    start : Result, DataArray, mapping, or sequence of numbers, optional
        A result of one cell, whose end is where the search begins, or states with the dimensions
        component and node, as ``result.end`` and ``found.data.state``; a table as `initial` of `Scene` takes; or
        all states in the order of the equations.  The scene's start by default.
    count : int, optional
        Number of eigenvalues nearest to zero, where stability is lost without oscillation; by default all up to
        2000 states, 12 of more.
    parameters : mapping of str to float, optional
        Parameters of the scene to set, for names that are keywords already.
    **more : float
        Parameters of the scene to set.

    Returns
    -------
    Equilibrium

    Raises
    ------
    ValueError
        If time enters the equations, but for a drive of strength 0, for set-valued friction and rates that jump, if a parameter is
        unknown, or if `start` holds no states of this network.
    ArithmeticError
        If Newton's method does not converge, or the eigenvalues of a large network do not.

    Examples
    --------
    Two machines of a power grid: sin(delta) = P/K.

    >>> from synchain import Field, Rates, Scene, chain, equilibrium
    >>> machine = Field({"delta": "w", "w": "P - w/2"}, parameters={"P": 0})
    >>> line = Rates({"w": "K*W*sin(delta_j - delta_i)"}, {"K": 1})
    >>> found = equilibrium(Scene(machine, line, chain(2), parameters={"P": [0.5, -0.5]}))
    >>> found.stable, found.shifts
    (True, ('delta',))
    """
    given = Given(equilibrium, parameters, more, REFUSED)
    scene = given.scene(scene)
    scene = scene if start is None else started(scene, start)[0]
    network, state = Linearised.of(_at_rest(scene), scene.parameters), np.array(scene.y0)
    size = len(state)
    wanted = None if count is None else check_integer("count", count, 1)
    if wanted is not None and wanted > size:
        raise ValueError(f"count = {count}; expected at most {size}, the states of the network")
    start, slopes = state, _slopes(network, state)
    names, shifts = _shifts(scene, network, state, slopes)
    state, speeds, residual, steps = _at_equilibrium(network, state, shifts)
    found = _eigenvalues(network, state, wanted)
    found[np.abs(found) <= LEAST * _fastest(network, start, state)] = 0.0
    return Equilibrium(scene, state, _in_order(found), names, speeds, residual, steps)


def _at_rest(scene: Scene) -> Equations:
    """The equations without a drive whose strength is zero; ValueError if they have no equilibria, or none of Newton's."""
    equations = without_drive(scene.equations, scene.parameters)
    if equations.forced:
        raise ValueError(
            f"equilibrium: found a drive, time enters the equations of {scene!r}; expected none; `periodic_orbit` finds "
            "motions that repeat themselves with the drive"
        )
    if equations.sticks:
        raise ValueError(
            "equilibrium: found set-valued friction, under which whole ranges of states rest; expected a smoothed law"
        )
    expect_continuous(equations)
    return equations


def _jacobian(network: Linearised, state: np.ndarray) -> sparse.csc_array:
    """The Jacobian; ArithmeticError where it has an entry that is no number."""
    found = network.jacobian(state)
    if not np.isfinite(found.data).all():
        raise ArithmeticError(
            "equilibrium: met a rate whose slope is infinite, or has no value, as that of sqrt(x) at 0; Newton's method and "
            "eigenvalues need slopes; start elsewhere"
        )
    return found


def _slopes(network: Linearised, state: np.ndarray) -> np.ndarray:
    """The sums of the sizes of each row of the Jacobian, the larger of those at a state and beside it."""
    here, beside = (
        abs(found).sum(axis=1) for found in (_jacobian(network, state), network.jacobian((1.0 + BESIDE) * state))
    )
    return np.fmax(here, np.where(np.isfinite(beside), beside, 0.0))


def _fastest(network: Linearised, *states: np.ndarray) -> float:
    """The size of eigenvalues of M^-1 J at some states and beside them, in no unit but that of time: a, sqrt(b c) of [[a, b], [c, 0]]."""
    sizes = [0.0]
    for state in (*states, *((1.0 + BESIDE) * state for state in states)):
        jacobian, mass = network.jacobian(state), network.mass(state)
        pairs = np.sqrt(abs(jacobian.multiply(jacobian.T)).data)
        heavy = 1.0 if mass is None else float(abs(mass).max())
        sizes.append(float(np.max(pairs[np.isfinite(pairs)], initial=0.0)) / heavy)
    return max(sizes)


def _shifts(
    scene: Scene, network: Linearised, state: np.ndarray, slopes: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray]:
    """Components whose shift at all nodes changes no rate, and the vectors of ones (states, shifts) along them."""
    equations, jacobian, rates = scene.equations, network.jacobian(state), network.rates(state)
    names, rows = [], []
    first = 0
    for name in equations.components:
        nodes = len(equations.holders(name))
        along = np.zeros(len(state))
        along[first : first + nodes] = 1.0
        first += nodes
        moved = (state + distance * along for distance in SHIFTS)
        if np.all(np.abs(jacobian @ along) <= 1e-12 * slopes) and all(
            np.all(np.abs(network.rates(x) - rates) <= CLOSED * (network.term_sizes(x) + network.term_sizes(state)))
            for x in moved
        ):
            names.append(name)
            rows.append(along)
    return tuple(names), np.array(rows).reshape(-1, len(state)).T


@dataclass(slots=True)
class Search:
    """A state on its way to rest, with the rates that are left: r(state) - shifts @ speeds.

    shifts: vectors of ones (states, shifts); scales (states,): sizes of the rates, by which their squares are added.
    """

    network: Linearised
    shifts: np.ndarray
    state: np.ndarray
    speeds: np.ndarray
    scales: np.ndarray
    steps: int = 0

    @classmethod
    def begin(cls, network: Linearised, state: np.ndarray, shifts: np.ndarray) -> Search:
        """Return the search that begins at a state."""
        scales, slopes = network.term_sizes(state), abs(_jacobian(network, state)).tocoo()
        # where all terms vanish: the slopes times the changes of the states that the other rates would notice
        with np.errstate(divide="ignore", invalid="ignore"):
            noticed = np.zeros(len(state))
            np.maximum.at(noticed, slopes.col, np.nan_to_num(scales[slopes.row] / slopes.data, posinf=0.0))
        scales = np.where(scales > 0.0, scales, slopes @ noticed)
        scales[scales == 0.0] = scales.max(initial=0.0) or 1.0
        return cls(network, shifts, state, _speeds(network.rates(state), shifts), scales)

    @property
    def gap(self) -> np.ndarray:
        """The rates that are left."""
        return self.left(self.state, self.speeds)

    def left(self, state: np.ndarray, speeds: np.ndarray) -> np.ndarray:
        """Return the rates that are left at a state."""
        return np.asarray(self.network.rates(state) - self.shifts @ speeds)

    def size(self, gap: np.ndarray) -> float:
        """Return one number for rates that are left."""
        return float(np.linalg.norm(gap / self.scales))

    def correction(self, gap: np.ndarray, rate: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Return a step (states,), (shifts,) of Newton's method, or of the implicit Euler method of length 1/rate."""
        matrix, count = _jacobian(self.network, self.state), self.shifts.shape[1]
        if rate:
            mass = self.network.mass(self.state)
            matrix = matrix - rate * (sparse.eye_array(len(gap), format="csc") if mass is None else mass)
        if count:
            border = sparse.csc_array(self.shifts)
            matrix = sparse.block_array([[matrix, -border], [border.T, None]], format="csc")
        change = _solved(matrix, np.append(-gap, np.zeros(count)))
        return change[: len(gap)], change[len(gap) :]

    def newton(self) -> bool:
        """Advance by Newton's method to an equilibrium, and return whether there is one."""
        gap = self.gap
        gaps, limits = [np.abs(gap)], [self.closed(self.state)]
        for _ in range(MOST_STEPS):
            if not gap.any():
                break
            change, turn = self.correction(gap)
            for part in 0.5 ** np.arange(HALVINGS):
                tried = self.state + part * change, self.speeds + part * turn
                left = self.left(*tried)
                if self.size(left) < self.size(gap):
                    break
            else:
                break
            (self.state, self.speeds), gap, self.steps = tried, left, self.steps + 1
            gaps.append(np.abs(gap))
            limits.append(self.closed(self.state))
        return self._is_at_root(np.array(gaps), np.array(limits))

    def closed(self, state: np.ndarray) -> np.ndarray:
        """Return the rates that may be left at an equilibrium."""
        return np.asarray(CLOSED * (self.network.term_sizes(state) + np.abs(self.shifts @ self.speeds)))

    def _is_at_root(self, gaps: np.ndarray, limits: np.ndarray) -> bool:
        """Whether the search ended at a root; states that vanish to rounding become zero.

        gaps, limits (steps, states): the rates that were left after each step, and that may be.
        """
        closed = limits[-1]
        still = gaps[-1] <= closed
        if not still.all():
            # rates whose terms all vanish, such as v at rest: states of a size that no other rate notices are zero
            change = abs(_jacobian(self.network, self.state)) @ sparse.diags_array(np.abs(self.state)).tocsc()
            unnoticed = np.asarray((change[still] > closed[still][:, None]).sum(axis=0)).ravel() == 0
            rounded = np.where(unnoticed, 0.0, self.state)
            if not np.all(np.abs(self.left(rounded, self.speeds)) <= self.closed(rounded)):
                return False
            self.state = rounded
        # along a tail of the rates, which has no root, the step that closes them lowers them by less than e
        last = int(np.argmax(np.all((gaps <= limits)[:, still], axis=1)))
        levels = (gaps / np.where(closed > 0.0, closed, np.inf))[:, still].max(axis=1, initial=0.0)
        return last == 0 or bool(levels[last] <= TAIL * levels[last - 1])

    def relax(self) -> None:
        """Follow the motion towards rest: implicit Euler steps that grow as the rates fall."""
        gap = self.gap
        rate = FIRST_RATE * float(abs(_jacobian(self.network, self.state)).sum(axis=1).max())
        for _ in range(MOST_RELAXED):
            if self.size(gap) <= NEWTON:
                return
            change, turn = self.correction(gap, rate)
            tried = self.state + change, self.speeds + turn
            left = self.left(*tried)
            ratio = self.size(left) / self.size(gap)
            if not ratio < WORSE:  # NaN too
                rate *= 4.0
                continue
            (self.state, self.speeds), gap, self.steps = tried, left, self.steps + 1
            rate *= ratio


def _at_equilibrium(
    network: Linearised, state: np.ndarray, shifts: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, int]:
    """State, speeds along the shifts, residual and number of steps."""
    search = Search.begin(network, state, shifts)
    if not search.newton():
        failed, search = search, Search.begin(network, state, shifts)
        search.relax()
        if not search.newton():
            raise ArithmeticError(
                f"no equilibrium near the start: Newton's method left rates of {np.abs(failed.gap).max():.2g}, and steps "
                f"along the motion {np.abs(search.gap).max():.2g}; start elsewhere, or there is none"
            )
    terms = network.term_sizes(search.state) + np.abs(shifts @ search.speeds)
    speeds = np.where(np.abs(search.speeds) > EVEN * terms.max(), search.speeds, 0.0)
    return search.state, speeds, float(np.abs(search.gap).max()), search.steps


def _solved(matrix: sparse.csc_array, right: np.ndarray) -> np.ndarray:
    """The solution (k,) of linear equations; that of least squares and least norm if they are singular."""
    # rows and columns whose largest entries are 1, whatever the units of states and rates
    with np.errstate(divide="ignore"):
        rows = 1.0 / abs(matrix).max(axis=1).toarray().ravel()
        rows = np.where(np.isfinite(rows), rows, 1.0)
        columns = 1.0 / abs(sparse.diags_array(rows) @ matrix).max(axis=0).toarray().ravel()
        columns = np.where(np.isfinite(columns), columns, 1.0)
    scaled = sparse.csc_array(sparse.diags_array(rows) @ matrix @ sparse.diags_array(columns))
    try:
        solver = splu(scaled)
        pivots = np.abs(solver.U.diagonal())
        if pivots.min(initial=1.0) > SINGULAR * pivots.max(initial=0.0):
            return np.asarray(columns * solver.solve(rows * right))
    except RuntimeError:  # a pivot is 0
        pass
    # |A y - b|^2 + DAMPED^2 |y|^2 is least where DAMPED r = b - A y and A' r = DAMPED y
    damping = DAMPED * sparse.eye_array(len(right), format="csc")
    augmented = sparse.block_array([[damping, scaled], [scaled.T, -damping]], format="csc")
    found = splu(augmented).solve(np.append(rows * right, np.zeros(len(right))))
    return np.asarray(columns * found[len(right) :])


def _speeds(rates: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """The part of the rates along the shifts."""
    return np.asarray(shifts.T @ rates / np.maximum(shifts.sum(axis=0), 1.0))


def _eigenvalues(network: Linearised, state: np.ndarray, count: int | None) -> np.ndarray:
    """Eigenvalues of M^-1 J, in any order."""
    jacobian, mass, size = network.jacobian(state), network.mass(state), len(state)
    if count is None and size > DENSE:
        count = FEW
    if count is None or count >= size - 1:  # all that Arnoldi's method cannot give
        found = linalg.eigvals(jacobian.toarray(), None if mass is None else mass.toarray())
    else:
        mass = sparse.eye_array(size, format="csc") if mass is None else mass
        aside = ASIDE * float(abs(jacobian).max())  # where the matrix is singular only by chance
        solver = splu(jacobian - aside * mass)
        inverse = LinearOperator((size, size), matvec=lambda v: solver.solve(mass @ v), dtype=float)
        try:
            found = eigs(inverse, count, v0=1.0 + np.arange(size) % 7, return_eigenvectors=False)
        except ArpackNoConvergence:
            raise ArithmeticError(
                f"eigenvalues: the {count} nearest to zero of {size} did not converge; ask for another count"
            ) from None
        found = aside + 1.0 / found
    return np.asarray(found)


def _in_order(eigenvalues: np.ndarray) -> np.ndarray:
    """Eigenvalues, the largest real part first."""
    return np.asarray(eigenvalues[np.lexsort((-eigenvalues.imag, -eigenvalues.real))])
