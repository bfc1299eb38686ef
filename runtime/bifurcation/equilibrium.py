"""Find equilibria of undriven networks: states at rest, and rigid rotations, which are at rest in a moving frame.

The equations are M(x) dx/dt = r(x), and r(x) = 0 is solved by Newton's method with the exact sparse Jacobian J = dr/dx.
The eigenvalues of M^-1 J decide stability: at rest the derivative of M is multiplied by rates that are zero.

1. Shifts.  If a coordinate of all nodes can be shifted together (phases of oscillators, rotor angles of a power grid),
   equilibria are not isolated.  With e = (1 … 1) along the coordinate, the common speed s is unknown too, and the step
   is normal to the shift: J dx - e ds = -(r - e s), e' dx = 0.  A speed other than zero is a rigid rotation.
2. Singular Jacobians.  A conserved momentum makes a line of equilibria as well, free masses at any common speed: the
   step of least squares and least norm leads to one of them near the start.
3. Damping.  A step is halved until the weighted norm of the rates falls (Deuflhard, section 3.3).
4. Pseudo-transient continuation.  Where Newton's method fails, implicit Euler steps (M/h - J) dx = r follow the motion
   from the start; h grows as the rates fall, and Newton's method goes on from there (Kelley & Keyes).
5. Rounding.  A rate counts as zero relative to the sizes of its terms, and a tail of rates that has no root is refused.

Sources: Kelley & Keyes, SIAM J. Numer. Anal. 35, 508 (1998); Seydel, Practical Bifurcation and Stability Analysis, 3rd
ed. (Springer, 2010), section 1.2; Deuflhard, Newton Methods for Nonlinear Problems (Springer, 2004), section 3.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from scipy import linalg, sparse
from scipy.sparse.linalg import splu

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import expect_continuous
from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import Given
from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States
from ..sweeps.continued_start import StartValue, started
from .eigenvalues import SMALL, ModeBlocks, eigenvalues
from .linearised import Linearised

# Most steps of Newton's method, and most halvings of one until the residual falls: 2^-40 of a step is rounding
# (choices).
MOST_STEPS, HALVINGS = 100, 40
CLOSED = 1e-11  # largest rate at an equilibrium, relative to the sizes of its terms: 45 000 rounding errors (a choice)
# At a double or higher root each step of Newton's method leaves 1/4 of the rates or more: a root is multiple if each
# of the last REPEATED steps leaves MULTIPLE (choices).
MULTIPLE, REPEATED = 0.2, 3
# Largest factor by which the last step of Newton's method may lower the rates at a root. At a root of multiplicity m
# a step leaves (1 - 1/m)^m of the rates: 0 of a simple root, 1/4 at a fold. Along a tail x^-p, which has no root, it
# leaves (1 + 1/p)^-p, more than 1/e = 0.37. 0.34 admits roots of a multiplicity up to 7.
TAIL = 0.34
# Most implicit Euler steps, and 1/h of the first in units of the largest slope of a rate (choices).
MOST_RELAXED, FIRST_RATE = 500, 10.0
# An Euler step by which the rates grow more than WORSE times is repeated with h/4; Newton's method takes over where
# they have fallen to NEWTON of the sizes of their terms (choices).
WORSE, NEWTON = 1.5, 1e-6
# A scaled matrix counts as singular if its least pivot is below SINGULAR, some hundred rounding errors, of the
# largest. It is solved with the damping DAMPED. Regular directions change by DAMPED squared only, which is near
# rounding (choices).
SINGULAR, DAMPED = 1e-13, 1e-7
EVEN = 1e-15  # speed of a shift that is rounding, relative to the largest size of a rate's terms
# Size of an eigenvalue that counts as zero, relative to the largest: at a fold two solutions merge, and a rounding
# error of 1e-16 moves the eigenvalue by its square root.
ZERO = 1e-7
# Size of an eigenvalue that is a rounding error, relative to the fastest rate at the equilibrium (a choice).
LEAST = 1e-12
# Relative distance at which slopes are measured beside a state: at a fold those at the state itself may vanish (a
# choice).
BESIDE = 0.1
# Distances by which a shift is tried: for any unit of the state, some of them are neither tiny nor huge.
SHIFTS = (7e-13, 7e-9, 7e-5, 0.7, 7e3, 7e7, 7e11)

REFUSED = {
    "rtol": "Newton's method ends at rounding",
    "transient": "it starts from the scene's start, or from `start`, and integrates nothing",
    **{name: "each step of Newton's method needs the one before" for name in ("workers", "executor")},
    **{name: "a few steps of Newton's method are soon done" for name in ("show_progress", "progress")},
}
"""Keywords that `equilibrium` refuses, with the reason."""


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
        Eigenvalues of the linearised network per unit of non-dimensional time, the largest real part first: all, or
        those nearest to zero.
    shifts : tuple of str
        Coordinates that can be shifted at all nodes together without any change of the rates. Each makes one eigenvalue
        zero.
    speeds : ndarray, shape (shifts,)
        Common rates of these coordinates; 0 at rest.
    residual : float
        Largest rate but for the speeds.
    steps : int
        Steps of Newton's method.
    multiple : bool
        Whether the state is a double or higher root of the rates, as at a fold; one eigenvalue is zero there, and does not
        decide stability.

    See Also
    --------
    synchain.equilibrium
    """

    scene: Scene = field(repr=False)
    state: np.ndarray
    eigenvalues: np.ndarray
    shifts: tuple[str, ...]
    speeds: np.ndarray
    residual: float
    steps: int
    multiple: bool = False

    @property
    def data(self) -> xr.Dataset:
        """State over components and nodes, eigenvalues over their number.

        `run(scene, start=rest.data.state)` starts from the equilibrium `rest`.
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
        """Rows of state, eigenvalues, stability, shifts and residual."""
        largest = [f"{value:.6g}" for value in self.eigenvalues[:6]]
        moves = [f"{name} of all nodes, at the speed {v:.6g}" for name, v in zip(self.shifts, self.speeds, strict=True)]
        return (
            ("scene", scene_text(self.scene)),
            ("state", self._shown),
            ("eigenvalues", ", ".join([*largest, *(["…"] if len(self.eigenvalues) > len(largest) else [])])),
            ("verdict", self.verdict),
            *((("shifts", "; ".join(moves)),) if moves else ()),
            ("residual", f"{self.residual:.1e} after {self.steps} steps"),
        )

    @property
    def text(self) -> str:
        """State and stability in one line."""
        return f"{self._shown}: {self.verdict}"

    @property
    def _shown(self) -> str:
        """The first states."""
        names = self.scene.equations.state
        shown = [f"{name} = {x:.10g}" for name, x in zip(names[:8], self.state[:8], strict=True)]
        return ", ".join([*shown, *(["…"] if len(names) > len(shown) else [])])

    @property
    def complete(self) -> bool:
        """True if all eigenvalues were computed."""
        return len(self.eigenvalues) == len(self.state)

    @property
    def growing(self) -> int:
        """Number of eigenvalues with a positive real part, among those that were computed."""
        return int((self._others.real > self._zero).sum())

    @property
    def neutral(self) -> int:
        """Number of eigenvalues on the imaginary axis, to rounding, but those of the shifts."""
        return int((np.abs(self._others.real) <= self._zero).sum())

    @property
    def stable(self) -> bool:
        """True if all eigenvalues were computed and have negative real parts, but for those of the shifts."""
        return self.complete and not self.growing and not self.neutral

    @property
    def verdict(self) -> str:
        """Stability as text: stable, unstable with the number of growing eigenvalues, neutral, degenerate, or not decided."""
        if self.growing:
            return f"unstable, {'' if self.complete else 'at least '}{self.growing} growing"
        if not self.complete:
            return f"not decided: none of the {len(self.eigenvalues)} eigenvalues nearest to zero grows"
        if self.multiple:
            return "degenerate: a double or higher root of the rates, whose zero eigenvalue does not decide stability"
        return f"neutral, {self.neutral} on the imaginary axis" if self.neutral else "stable"

    @property
    def _others(self) -> np.ndarray:
        """The eigenvalues without those of the shifts, the nearest to zero."""
        return np.delete(self.eigenvalues, np.argsort(np.abs(self.eigenvalues), kind="stable")[: len(self.shifts)])

    @property
    def _zero(self) -> float:
        """Largest real part that counts as zero."""
        return ZERO * float(np.abs(self.eigenvalues).max(initial=0.0))


def equilibrium(
    scene: Scene,
    start: StartValue | None = None,
    *,
    count: int | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Equilibrium:
    """Find an equilibrium of a network without a drive by Newton's method, and its stability.

    If Newton's method fails, steps along the motion lead closer to a state of rest, if the motion comes to rest.

    Parameters
    ----------
    scene : Scene
        Network, of any size.
    start : Result, DataArray, mapping, or sequence of numbers, optional
        A result of one cell, whose end is where the search begins, or states with the dimensions
        component and node, as ``result.end`` and ``rest.data.state``; a table as `initial` of `Scene` takes; or
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
        If time enters the equations (except in a drive of strength 0), if friction is set-valued, if rates jump, if a
        parameter is unknown, or if `start` contains no states of this network.
    ArithmeticError
        If Newton's method does not converge, or the eigenvalues of a large network do not.

    See Also
    --------
    periodic_orbit : Find a motion that repeats itself.

    Examples
    --------
    Two machines of a power grid: sin(delta) = P/K.

    >>> from synchain import Field, Rates, Scene, equilibrium
    >>> from synchain.graphs import chain
    >>> machine = Field({"delta": "w", "w": "P - w/2"}, parameters={"P": 0})
    >>> line = Rates({"w": "K*W*sin(delta_j - delta_i)"}, {"K": 1})
    >>> rest = equilibrium(Scene(machine, line, chain(2), parameters={"P": [0.5, -0.5]}))
    >>> rest.stable, rest.shifts
    (True, ('delta',))
    """
    scene = Given(equilibrium, parameters, more, REFUSED).scene(scene)
    scene = scene if start is None else started(scene, start)[0]
    network, first = Linearised.of(resting_equations("equilibrium", scene), scene.parameters), np.array(scene.y0)
    count = None if count is None else check_integer("count", count, 1)
    if count is not None and count > len(first):
        raise ValueError(f"count = {count}; expected at most {len(first)}, the states of the network")
    return near(scene, network, first, shifted_components(scene.equations, network, first), count)


def near(
    scene: Scene,
    network: Linearised,
    first: np.ndarray,
    shifted: tuple[tuple[str, ...], np.ndarray],
    count: int | None = None,
) -> Equilibrium:
    """Find the equilibrium near a state with `count` eigenvalues; `shifted`: what `shifted_components` returns."""
    names, shifts = shifted
    search = Search.begin(network, first, shifts)
    if not search.newton():
        failed, search = search, Search.begin(network, first, shifts)
        search.relax()
        if not search.newton():
            by_newton, by_motion = (np.abs(each.left(each.state, each.speeds)).max() for each in (failed, search))
            raise ArithmeticError(
                f"no equilibrium near the start: Newton's method left rates of {by_newton:.2g}, and steps "
                f"along the motion {by_motion:.2g}; start elsewhere, or there is none"
            )
    state, terms = search.state, network.term_sizes(search.state) + np.abs(shifts @ search.speeds)
    speeds = np.where(np.abs(search.speeds) > EVEN * terms.max(), search.speeds, 0.0)
    residual = float(np.abs(search.left(state, search.speeds)).max())
    jacobian, blocks = network.jacobian(state), None if count else ModeBlocks.of(scene.equations)
    by_modes = None if blocks is None else blocks.values(jacobian)
    values = eigenvalues(jacobian, network.mass(state), count) if by_modes is None else by_modes[0]
    sizes, limit = np.abs(values), LEAST * fastest(network, state)
    if np.any((sizes > limit) & (sizes <= LEAST * fastest(network, first))):
        # the terms of a slope may be larger than the slope, as those of x - sin x at 0
        limit = LEAST * fastest(network.sized(scene.parameters), state)
    values[sizes <= limit] = 0.0
    if search.multiple:  # the eigenvalue is the square root of a rounding error
        values[np.argsort(np.abs(values), kind="stable")[len(names)]] = 0.0
    values = values[np.lexsort((-values.imag, -values.real))]
    return Equilibrium(scene, state, values, names, speeds, residual, search.steps, search.multiple)


def resting_equations(function: str, scene: Scene) -> Equations:
    """Return the equations without drives of strength zero; ValueError for a drive, set-valued friction or jumps."""
    equations = without_drive(scene.equations, scene.parameters)
    if equations.forced:
        raise ValueError(
            f"{function}: found a drive, time enters the equations of {scene!r}; expected none; `periodic_orbit` finds "
            "motions that repeat themselves with the drive"
        )
    if equations.sticks:
        raise ValueError(
            f"{function}: found set-valued friction, stops or resets, under which whole ranges of states may rest; "
            "expected smooth rates; use contact 'atan', or a model without events"
        )
    expect_continuous(equations)
    return equations


def _jacobian(network: Linearised, state: np.ndarray) -> sparse.csc_array:
    """Return the Jacobian; ArithmeticError where an entry is no number."""
    jacobian = network.jacobian(state)
    if not np.isfinite(jacobian.data).all():
        if not np.isfinite(network.rates(state)).all():
            raise ArithmeticError("equilibrium: met a rate that overflows, or has no value; start elsewhere")
        raise ArithmeticError(
            "equilibrium: met a rate whose slope is infinite, or has no value, as that of sqrt(x) at 0; Newton's method and "
            "eigenvalues need slopes; start elsewhere"
        )
    return jacobian


def fastest(network: Linearised, *states: np.ndarray) -> float:
    """Return a size of the eigenvalues of M^-1 J near some states, in units of a rate: |a| and sqrt|b c| of [[a, b], [c, 0]].

    Products of opposite entries do not depend on the units of the states, as the entries themselves do.
    """
    sizes = [0.0]
    for state in (*states, *((1.0 + BESIDE) * state for state in states)):
        jacobian, mass = network.jacobian(state), network.mass(state)
        pairs = np.sqrt(abs(jacobian.multiply(jacobian.T)).data)
        heaviest = 1.0 if mass is None else float(abs(mass).max())
        sizes.append(float(np.max(pairs[np.isfinite(pairs)], initial=0.0)) / heaviest)
    return max(sizes)


def shifted_components(
    equations: Equations, network: Linearised, state: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray]:
    """Find components that can be shifted at all nodes together, and the vectors of ones (states, shifts) along them."""
    jacobian, rates = network.jacobian(state), network.rates(state)
    # Row sums of |J|, the larger of those at the state and beside it.
    here, beside = abs(_jacobian(network, state)), abs(network.jacobian((1.0 + BESIDE) * state))
    here, beside = here.sum(axis=1), beside.sum(axis=1)
    slopes = np.fmax(here, np.where(np.isfinite(beside), beside, 0.0))

    def keeps_rates(distance: float) -> bool:
        """Return whether a shift along `ones` by a distance changes no rate by more than rounding."""
        shifted = state + distance * ones
        sizes = network.term_sizes(shifted) + network.term_sizes(state)
        return bool(np.all(np.abs(network.rates(shifted) - rates) <= CLOSED * sizes))

    names, vectors = [], []
    first = 0
    for name in equations.components:
        last = first + len(equations.holders(name))
        ones = np.zeros(len(state))
        ones[first:last] = 1.0
        first = last
        # J e = 0 holds where rates are flat, too: try finite shifts as well.
        if np.all(np.abs(jacobian @ ones) <= 1e-12 * slopes) and all(map(keeps_rates, SHIFTS)):
            names.append(name)
            vectors.append(ones)
    return tuple(names), np.array(vectors).reshape(-1, len(state)).T


def bordered(matrix: sparse.csc_array, shifts: np.ndarray) -> sparse.csc_array:
    """Return [[J, -e], [p, 0]] for shifts e (states, k); p pins the first node, as a full row e' would fill the factors."""
    count = shifts.shape[1]
    if not count:
        return matrix
    pins = sparse.csc_array((np.ones(count), (np.arange(count), shifts.argmax(axis=0))), (count, len(shifts)))
    return sparse.csc_array(sparse.block_array([[matrix, -sparse.csc_array(shifts)], [pins, None]], format="csc"))


@dataclass(slots=True)
class Search:
    """A state during the search; the remaining rates are r(x) - shifts @ speeds."""

    network: Linearised
    shifts: np.ndarray  # (states, shifts): vectors of ones
    state: np.ndarray
    speeds: np.ndarray  # (shifts,)
    scales: np.ndarray  # (states,): sizes of the rates, by which their squares are weighted
    steps: int = 0
    multiple: bool = False  # whether Newton's method ended at a multiple root

    @classmethod
    def begin(cls, network: Linearised, state: np.ndarray, shifts: np.ndarray) -> Search:
        """Return the search that begins at a state."""
        scales, slopes = network.term_sizes(state), abs(_jacobian(network, state)).tocoo()
        # The scale of a rate is the size of its terms.  Where all terms vanish, it is the change of the rate when each
        # state moves by the least distance that changes another rate by its scale.
        with np.errstate(divide="ignore", invalid="ignore"):
            noticed = np.zeros(len(state))
            np.maximum.at(noticed, slopes.col, np.nan_to_num(scales[slopes.row] / slopes.data, posinf=0.0))
        scales = np.where(scales > 0.0, scales, slopes @ noticed)
        scales[scales == 0.0] = scales.max(initial=0.0) or 1.0
        # The speeds that leave the least rates: means over the nodes.
        speeds = np.asarray(shifts.T @ network.rates(state) / np.maximum(shifts.sum(axis=0), 1.0))
        return cls(network, shifts, state, speeds, scales)

    def left(self, state: np.ndarray, speeds: np.ndarray) -> np.ndarray:
        """Return the remaining rates at a state with these speeds."""
        return np.asarray(self.network.rates(state) - self.shifts @ speeds)

    def size(self, gap: np.ndarray) -> float:
        """Return the weighted norm of remaining rates."""
        return float(np.linalg.norm(gap / self.scales))

    def limits(self, state: np.ndarray) -> np.ndarray:
        """Return the largest remaining rates (states,) at an equilibrium."""
        return np.asarray(CLOSED * (self.network.term_sizes(state) + np.abs(self.shifts @ self.speeds)))

    def correction(self, gap: np.ndarray, rate: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Return a step (states,), (shifts,) of Newton's method, or of the implicit Euler method of length 1/rate."""
        matrix, count = _jacobian(self.network, self.state), self.shifts.shape[1]
        if rate:
            mass = self.network.mass(self.state)
            matrix = matrix - rate * (sparse.eye_array(len(gap), format="csc") if mass is None else mass)
        change = _solve_linear(bordered(matrix, self.shifts), np.append(-gap, np.zeros(count)))
        step, speeds = change[: len(gap)], change[len(gap) :]
        # Of all steps that differ by shifts, take the one normal to them; their vectors have no states in common. J is
        # zero along a shift, but the implicit Euler step has -rate there, which the speeds take over.
        means = self.shifts.T @ step / self.shifts.sum(axis=0)
        return step - self.shifts @ means, speeds + rate * means

    def newton(self) -> bool:
        """Advance by Newton's method, and return whether it reached an equilibrium."""
        gap = self.left(self.state, self.speeds)
        gaps, limits = [np.abs(gap)], [self.limits(self.state)]
        for _ in range(MOST_STEPS):
            if not gap.any():
                break
            change, speed_change = self.correction(gap)
            # Halve the step until the residual falls; a residual that no part of a step lowers has reached rounding.
            for part in 0.5 ** np.arange(HALVINGS):
                state, speeds = self.state + part * change, self.speeds + part * speed_change
                left = self.left(state, speeds)
                if self.size(left) < self.size(gap):
                    break
            else:
                break
            self.state, self.speeds, gap, self.steps = state, speeds, left, self.steps + 1
            gaps.append(np.abs(gap))
            limits.append(self.limits(state))
        return self._is_at_root(np.array(gaps), np.array(limits))

    def _is_at_root(self, gaps: np.ndarray, limits: np.ndarray) -> bool:
        """Return whether Newton's method ended at a root; states that vanish to rounding become zero.

        gaps, limits (steps, states): the remaining rates after each step, and the largest remaining rates allowed.
        """
        limit = limits[-1]
        closed = gaps[-1] <= limit
        if not closed.all():
            # The terms of a rate such as x' = v all vanish with v, so that it is never small beside them.  A state whose
            # size changes no closed rate by more than its limit is rounding: set it to zero and look again.
            change = abs(_jacobian(self.network, self.state)) @ sparse.diags_array(np.abs(self.state)).tocsc()
            unnoticed = np.asarray((change[closed] > limit[closed][:, None]).sum(axis=0)).ravel() == 0
            rounded = np.where(unnoticed, 0.0, self.state)
            if not np.all(np.abs(self.left(rounded, self.speeds)) <= self.limits(rounded)):
                return False
            self.state = rounded
        # Refuse a tail of the rates that has no root: the step that closes them lowers them by less than e (TAIL).
        last = int(np.argmax(np.all((gaps <= limits)[:, closed], axis=1)))
        levels = (gaps / np.where(limit > 0.0, limit, np.inf))[:, closed].max(axis=1, initial=0.0)
        end = levels[max(0, last - REPEATED) : last + 1]
        self.multiple = len(end) > REPEATED and bool(np.all(end[1:] > MULTIPLE * end[:-1]))
        return last == 0 or bool(levels[last] <= TAIL * levels[last - 1])

    def relax(self) -> None:
        """Follow the motion towards rest by implicit Euler steps, whose length grows as the rates fall."""
        gap = self.left(self.state, self.speeds)
        rate = FIRST_RATE * float(abs(_jacobian(self.network, self.state)).sum(axis=1).max())
        for _ in range(MOST_RELAXED):
            if self.size(gap) <= NEWTON:
                return
            change, speed_change = self.correction(gap, rate)
            state, speeds = self.state + change, self.speeds + speed_change
            left = self.left(state, speeds)
            ratio = self.size(left) / self.size(gap)
            if not ratio < WORSE:  # NaN too
                rate *= 4.0
                continue
            self.state, self.speeds, gap, self.steps = state, speeds, left, self.steps + 1
            rate *= ratio  # switched evolution relaxation: h grows as 1/|r| (Kelley & Keyes)


def _solve_linear(matrix: sparse.csc_array, right: np.ndarray) -> np.ndarray:
    """Return the solution (k,) of linear equations, that of least squares and least norm if they are singular."""
    # Scale rows, then columns, to a largest entry of 1, so that pivots do not depend on the units of states and rates.
    dense = len(right) <= SMALL  # sparse factors of small matrices spend their time in Python
    array = matrix.toarray() if dense else abs(matrix)
    with np.errstate(divide="ignore"):
        rows = 1.0 / (np.abs(array).max(axis=1) if dense else array.max(axis=1).toarray().ravel())
        rows = np.where(np.isfinite(rows), rows, 1.0)
        array = rows[:, None] * array if dense else sparse.diags_array(rows) @ array
        columns = 1.0 / (np.abs(array).max(axis=0) if dense else array.max(axis=0).toarray().ravel())
        columns = np.where(np.isfinite(columns), columns, 1.0)
    if dense:
        factors, places, _ = linalg.lapack.dgetrf(array * columns)
        pivots = np.abs(factors.diagonal())
        if pivots.min() > SINGULAR * pivots.max():
            return np.asarray(columns * linalg.lapack.dgetrs(factors, places, rows * right)[0])
    scaled = sparse.csc_array(sparse.diags_array(rows) @ matrix @ sparse.diags_array(columns))
    try:
        solver = splu(scaled)
        pivots = np.abs(solver.U.diagonal())
        if not dense and pivots.min(initial=1.0) > SINGULAR * pivots.max(initial=0.0):
            return np.asarray(columns * solver.solve(rows * right))
    except RuntimeError:  # a pivot is 0
        pass
    # Minimise |A y - b|^2 + d^2 |y|^2: d s = b - A y and A' s = d y, sparse equations in (s, y).
    damping = DAMPED * sparse.eye_array(len(right), format="csc")
    augmented = sparse.block_array([[damping, scaled], [scaled.T, -damping]], format="csc")
    both = splu(augmented).solve(np.append(rows * right, np.zeros(len(right))))
    return np.asarray(columns * both[len(right) :])
