"""Find by direct simulation the complex strengths of a mode that synchronise: the three-oscillator universal probe.

Three oscillators in a ring, with the weights a and b of links in the two directions, have the transversal
eigenvalues gamma = -(3/2)(a + b) ± i (sqrt(3)/2)(a - b). With alpha + i beta = -sigma gamma and sigma = 1, the
weights are a, b = alpha/3 ± beta/sqrt(3), so that the ring reaches every point of the complex plane. Another
network should synchronise if the ring synchronises at all its points -sigma gamma_k, even with one-way links
(Fink, Johnson, Carroll, Mar & Pecora, Phys. Rev. E 61, 5080 (2000)). The weights a and b are parameters of the
kernel, so that one kernel serves the whole plane.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
import sympy as sp
import xarray as xr
from numpy.typing import ArrayLike

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.families import topology
from synchain.models.interactions.link import strength
from synchain.models.mechanics.components import Edge
from synchain.models.scenes.scene import Scene

from ..cells.plan import CellRows, Planner
from ..cells.run_keywords import Given
from ..engines.choice import chosen_for_rows
from ..engines.job import RowsSpec
from ..engines.step_control import control_of
from ..results.labelled import Labelled, dataset, scene_text
from ..stability.transversal_modes import unused_axes
from ..support.arrays import numbers
from ..support.error_text import range_text
from ..support.execution import Execution
from ..support.progress import Hook
from .criterion import IN_CRITERION, AppliedCriterion, Criterion, checked, errors, offsets, preset, resolved
from .synchronous_motion import SynchronousMotion, alike, first_starts, measure_motion, spread_of
from .trials import Trials

MODE_ALPHA = sp.Symbol("mode_alpha", real=True)
MODE_BETA = sp.Symbol("mode_beta", real=True)
"""Symbols of the real and imaginary part of a mode's strength alpha + i beta = -sigma gamma."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Probe(Labelled):
    """Verdicts of the probe over complex strengths alpha + i beta; alpha, beta, error and share have one shape.

    See Also
    --------
    synchain.universal_probe
    """

    scene: Scene
    criterion: AppliedCriterion
    alpha: np.ndarray = field(repr=False)
    beta: np.ndarray = field(repr=False)
    error: np.ndarray = field(
        repr=False
    )  # median over the starts of the mean synchronisation error; infinite for cells that did not finish
    share: np.ndarray = field(repr=False)  # part of the starts that synchronised
    status: np.ndarray = field(repr=False)  # (…, starts): status of each cell

    @property
    def data(self) -> xr.Dataset:
        """Verdicts on the grid of alpha and beta, its coordinates."""
        dims = tuple(f"dim_{k}" for k in range(self.alpha.ndim))
        return dataset(
            {
                "error": (dims, self.error, "median of the mean synchronisation errors"),
                "share": (dims, self.share, "part of the starts that synchronised"),
                "status": ((*dims, "start"), self.status, "how the cell ended"),
            },
            {"alpha": (dims, self.alpha), "beta": (dims, self.beta)},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, strengths, number of strengths that synchronise, and criterion."""
        return (
            ("scene", scene_text(self.scene)),
            ("strengths", f"{self.alpha.size}: alpha {range_text(self.alpha)}, beta {range_text(self.beta)}"),
            ("synchronous", f"{int(self.synchronous.sum())} of {self.synchronous.size}"),
            ("criterion", self.criterion.text(self.scene)),
        )

    @property
    def synchronous(self) -> np.ndarray:
        """True for each strength at which at least half of the starts synchronised."""
        return self.share >= 0.5


def universal_probe(
    scene: Scene,
    alpha: ArrayLike,
    beta: ArrayLike,
    *,
    criterion: Criterion | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Probe:
    """Simulate three oscillators at the mode strengths alpha + i beta.

    Parameters
    ----------
    scene : Scene
        Oscillator, coupling and parameters; the network and sigma of the scene are not used. The three oscillators
        start on the line through the starts of the scene's first two oscillators.
    alpha, beta : array_like
        Real and imaginary parts of the strengths, positive or negative, which are broadcast against each
        other.
    criterion : Criterion, optional
        Starts, tolerance and times, as for `thresholds`.
    workers, executor, show_progress, progress
        As for `run`.
    parameters, **more
        Override the parameters of the scene, as for `exponents`.

    Returns
    -------
    Probe
        Verdicts in the common shape of `alpha` and `beta`.

    Raises
    ------
    ValueError
        If strengths are missing or not finite, if the scene has no coupling, if it has a stop, draws, or
        axes other than sigma, or if its coupling is not proportional to sigma and to the weight of a link.

    See Also
    --------
    synchain.thresholds
    synchain.msf

    Examples
    --------
    >>> import synchain as sc
    >>> node = sc.Field({"x": "v", "v": "x - x**3 - 0.25*v + 0.4*cos(t)"}, initial={"x": 0.5})
    >>> scene = sc.Scene(node, "v->v", sc.graphs.ring(4), time_unit="time")
    >>> found = sc.universal_probe(scene, [0.1, 1.0], 0, show_progress=False)
    >>> found.data.sizes["start"]
    8
    """
    criterion, execution = checked(criterion), Execution(workers, executor, show_progress, progress)
    real, imaginary = _broadcast(alpha, beta)
    scene = Given(universal_probe, parameters, more, IN_CRITERION).scene(scene, unused_axes(scene))
    scene.equations.expect_pairs("the three-oscillator probe")
    if scene.varied:
        scene.equations.expect_alike("the three-oscillator probe")
    partial = preset(criterion, scene)
    # build the ring; the real and imaginary part of the strength are parameters of its kernel
    ring = scene.replace(
        record=("sync_error",),
        topology=topology("ring", 3),
        initial=first_starts(scene, 3),
        transient=1.0,
        window=1.0,
        rtol=partial.rtol,
    )
    equations, planner = ring_of_three(ring.equations), Planner(ring)
    plain = _rows(planner, equations.parameters, real.reshape(-1), imaginary.reshape(-1), np.zeros(partial.starts))
    strongest = partial.starts * np.atleast_1d(np.hypot(real, imaginary).argmax())
    method = chosen_for_rows(ring, equations, plain.take(strongest))
    source = RowsSpec(equations, method, control_of(planner, True)).source()

    def trials(scene: Scene) -> Trials:
        problem = RowsSpec(equations, method, control_of(Planner(scene), True))
        return Trials(scene, problem, source, execution)

    def measure(atol: float | None) -> SynchronousMotion:
        one = alike(equations, _rows(planner, equations.parameters, np.zeros(1), np.zeros(1), np.zeros(1)))
        with trials(ring if atol is None else ring.replace(atol=atol)) as few:
            times, apart = (partial.transient, partial.window), spread_of(equations, plain.start[:1])
            return measure_motion(few, lambda rows: rows, equations, one, times, apart)

    # complete the criterion from the motion, then run all strengths and starts as cells of one round
    used = resolved(partial, ring, measure)
    atol = ring.given["atol"] if used.atol is None else used.atol
    ring = ring.replace(transient=used.transient, window=used.window, max_steps=used.max_steps, atol=atol)
    planner = Planner(ring)
    rows = _rows(planner, equations.parameters, real.reshape(-1), imaginary.reshape(-1), offsets(used))
    with trials(ring) as many:
        outcome = many.run(len(rows), rows.take)
    shape = (*real.shape, used.starts)
    error, status = errors(outcome, used, equations).reshape(shape), outcome.status.reshape(shape)
    share = np.asarray((error < used.tolerance).mean(axis=-1))
    return Probe(scene, used, real, imaginary, np.asarray(np.median(error, axis=-1)), share, status)


def ring_of_three(equations: Equations) -> Equations:
    """Return a ring of three nodes; links have the weight alpha/3 + beta/sqrt(3) one way, alpha/3 - beta/sqrt(3) back.

    The parameters `mode_alpha` and `mode_beta` replace sigma; the topology's weights, 1 and -1, give the direction.
    """
    equations.expect_alike("the three-oscillator probe")
    edge = equations.edge
    if edge is None:
        raise ValueError("these equations have no coupling; the probe needs links")
    sigma = strength(edge, equations.node.parameters)
    # check that the rates of a link are sigma times the weight times a function that is zero between equal states
    if not edge.diffusive:
        raise ValueError("a link acts between equal states, so complete synchronisation is no solution of this network")
    unit = {edge.weight: sp.S.One, sigma: sp.S.One}
    for e in edge.rhs:
        if sp.simplify(e - sigma * edge.weight * e.xreplace(unit)) != 0:
            raise ValueError(f"the coupling {e} is not proportional to {sigma} and the weight; a mode has no strength")
    taken = {s.name for s in (*equations.node.state, *equations.node.parameters, *edge.parameters)}
    for symbol in (MODE_ALPHA, MODE_BETA):
        if symbol.name in taken:
            raise ValueError(f"the name {symbol.name!r} is needed for the probe; rename it in the model")
    factor = MODE_ALPHA / 3 + edge.weight * MODE_BETA / sp.sqrt(3)
    others = tuple(s for s in edge.parameters if s != sigma)
    rates = tuple(factor * e.xreplace(unit) for e in edge.rhs)
    turned = Edge(edge.here, edge.there, edge.weight, rates, (*others, MODE_ALPHA, MODE_BETA))
    there = [(i, (i + 1) % 3, Fraction(1)) for i in range(3)]
    back = [(i, (i + 2) % 3, Fraction(-1)) for i in range(3)]
    return Equations.of_equal_nodes(equations.node, turned, 3, (*there, *back))


def _broadcast(alpha: ArrayLike, beta: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return alpha and beta in one shape; ValueError if they are empty, not finite, or cannot be broadcast."""
    parts = numbers("alpha", alpha), numbers("beta", beta)
    for part in parts:
        if part.size == 0:
            raise ValueError("alpha and beta: found no values; expected at least one of each")
        if not np.isfinite(part).all():
            raise ValueError("alpha and beta: found a value that is not finite; expected numbers")
    try:
        real, imaginary = np.broadcast_arrays(*parts)
    except ValueError:
        shapes = " and ".join(str(part.shape) for part in parts)
        raise ValueError(f"alpha and beta: found the shapes {shapes}; expected shapes that fit together") from None
    return np.array(real), np.array(imaginary)


def _rows(planner: Planner, names: tuple[str, ...], alpha: np.ndarray, beta: np.ndarray, moves: np.ndarray) -> CellRows:
    """Return a row for every strength and start, starts fastest; `moves` (starts,) displace all nodes together."""
    one, scene, starts = planner.rows(np.arange(1)), planner.scene, len(moves)
    count = len(alpha) * starts
    values = {**scene.parameters, MODE_ALPHA.name: 0.0, MODE_BETA.name: 0.0}
    parameter_values = np.tile([values[name] for name in names], (count, 1))
    parameter_values[:, names.index(MODE_ALPHA.name)] = np.repeat(alpha, starts)
    parameter_values[:, names.index(MODE_BETA.name)] = np.repeat(beta, starts)
    start = np.tile(one.start, (count, 1))
    start[:, : scene.n] += np.tile(moves, len(alpha))[:, None]
    return CellRows(start, parameter_values, np.tile(one.spans, (count, 1)))
