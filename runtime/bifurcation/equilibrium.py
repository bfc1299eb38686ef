"""Equilibria of undriven networks, and motions that an even shift of a coordinate makes them.

Newton's method on the rates with the exact Jacobian, M d(state)/dt = r(state).  At rest M may depend on the state: what its
derivative adds to the linearised equations is multiplied by rates that are zero.

If a coordinate of all nodes can be shifted together (the phases of oscillators, the rotor angles of a power grid),
equilibria are not isolated.  Unknown is then also the common speed of the shift, r(state) = speed * shift, and the correction is
normal to the shift.  A speed other than zero makes a rigid rotation: an equilibrium in the frame that moves with it.

Sources: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), section 1.2; Deuflhard, Newton Methods
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

from ..cells.keywords import Given
from ..results.labelled import Labelled, dataset
from ..results.labels import STATE, States
from ..sweeps.start import Start, started
from .linearised import Linearised

__all__ = ["Equilibrium", "equilibrium"]

MOST_STEPS, HALVINGS = 100, 40
"""Most steps of Newton's method, and how often one is halved until the residual falls."""

CLOSED = 1e-11
"""Largest rate at an equilibrium, relative to its scale."""

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
"""Size of an eigenvalue that is rounding, relative to the slopes of the rates."""

BESIDE = 0.1
"""How far aside, relative to the state, the slopes of rates are looked at: at a fold those at the state itself may be zero."""

SHIFT = 0.7
"""Distance of a shift that must not change the rates."""

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
            ("scene", repr(self.scene)),
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
    slopes = _slopes(network, state)
    names, shifts = _shifts(scene, network, state, slopes)
    state, speeds, residual, steps = _newton(network, state, shifts, slopes)
    found = _eigenvalues(network, state, wanted)
    found[np.abs(found) <= LEAST * _fastest(network, state, slopes)] = 0.0
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


def _fastest(network: Linearised, state: np.ndarray, slopes: np.ndarray) -> float:
    """The size of eigenvalues of M^-1 J, from the slopes at the start of the search and at its end."""
    mass = network.mass(state)
    heavy = 1.0 if mass is None else float(abs(mass).max())
    return float(max(slopes.max(), _slopes(network, state).max())) / heavy


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
        still = np.all(np.abs(jacobian @ along) <= 1e-12 * slopes)
        change = np.abs(network.rates(state + SHIFT * along) - rates)
        if still and np.all(change <= 1e-10 * (slopes + np.abs(rates))):
            names.append(name)
            rows.append(along)
    return tuple(names), np.array(rows).reshape(-1, len(state)).T


def _newton(
    network: Linearised, state: np.ndarray, shifts: np.ndarray, slopes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, int]:
    """State, speeds along the shifts, residual and number of steps."""
    border, start, first = sparse.csc_array(shifts), state, network.rates(state)
    speeds, steps = _speeds(first, shifts), 0
    gap = first - shifts @ speeds
    while steps < MOST_STEPS and np.abs(gap).max() > 0.0:
        try:
            jacobian = _jacobian(network, state)
            matrix = sparse.block_array([[jacobian, -border], [border.T, None]], format="csc")
            change = splu(matrix if shifts.shape[1] else jacobian).solve(np.append(-gap, np.zeros(shifts.shape[1])))
        except RuntimeError:
            break  # singular: the residual says whether this is a solution
        part = 1.0
        for _ in range(HALVINGS):
            tried = state + part * change[: len(state)]
            rates = network.rates(tried)
            moved = speeds + part * change[len(state) :]
            left = rates - shifts @ moved
            if np.linalg.norm(left) < np.linalg.norm(gap):
                break
            part *= 0.5
        else:
            break
        state, speeds, gap, steps = tried, moved, left, steps + 1
    size = max(np.abs(start).max(), np.abs(state).max())
    scales = np.fmax(np.fmax(slopes, _slopes(network, state)) * size, np.fmax(np.abs(first), np.abs(shifts @ speeds)))
    residual = float(np.abs(gap).max())
    if not np.all(np.abs(gap) <= CLOSED * scales):
        raise ArithmeticError(
            f"no equilibrium near the start: Newton's method left rates of {residual:.2g}; start elsewhere, "
            "or there is none"
        )
    return state, np.where(np.abs(speeds) > EVEN * scales.max(), speeds, 0.0), residual, steps


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
