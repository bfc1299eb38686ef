"""Which integrator "auto" stands for, by what was measured (docs/performance.md)."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from synchain.codegen.driver.columns import Count, Sum
from synchain.codegen.integrators import Integrator, integrator
from synchain.codegen.kernels.sweep import AUTO, KernelSource
from synchain.codegen.taylor import is_analytic, is_linear, jump, order_for, outlives_series
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation
from synchain.models.graphs.links import LINK_LIMIT
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene

from ..support.status import Status
from .buffers import Buffers
from .plan import Plan, Planner
from .rates import Rates, bends, mode_rates, rates
from .reduce import Reduction

__all__ = [
    "STIFF",
    "chosen_for_modes",
    "chosen_for_rows",
    "chosen_integrator",
    "mode_stiffness",
    "stiffness",
    "warn_of_stiff_modes",
    "warn_of_stiffness",
]

STIFF = 30.0
"""Stiffness from which Rosenbrock steps are faster than Taylor steps at equal error."""

LAYER = 0.1
"""Part of its stiffness with which the layer of a smoothed jump counts: motion is not always inside."""


def chosen_integrator(reduction: Reduction) -> Integrator:
    """Return the integrator of a scene, the fastest at equal error where the scene says "auto".

    Where the equations are not stiff in the extreme cells of the sweep and in a sample of the others, and between the
    events of set-valued friction: power series if all functions are analytic between kinks, and between jumps along which
    no motion slides, unless motion may pass another place without a series; explicit steps otherwise. Nodes or links with
    a mass matrix take explicit steps too: the recurrences of a dense matrix take longer to compile than most runs.
    Elsewhere Rosenbrock steps, or a switching pair of methods for two oscillators at a tight tolerance. A mean field of
    more nodes than Rosenbrock steps can take, whose Jacobian has an entry for each pair, takes explicit steps however
    stiff it is, and so does a start where a slope of the rates is infinite.

    Parameters
    ----------
    reduction : Reduction
        What is left of the scene to integrate.
    """
    return _chosen(reduction.scene, reduction.equations, lambda: stiffness(reduction.planner))


def chosen_for_rows(scene: Scene, equations: Equations, rows: Plan) -> Integrator:
    """Return the integrator of equations whose cells come as rows; otherwise as `chosen_integrator`.

    Parameters
    ----------
    scene : Scene
        Its integrator and its tolerances.
    equations : Equations
        What is integrated.
    rows : Plan
        The extreme cells.
    """
    return _chosen(scene, equations, lambda: _stiffness(_each(rates, equations, rows), equations, rows))


def _chosen(scene: Scene, equations: Equations, stiffness_of: Callable[[], float]) -> Integrator:
    if scene.integrator == "taylor":
        return _taylor(scene, equations)
    if scene.integrator != "auto":
        return integrator(scene.integrator)
    found = 0.0 if equations.sticks else stiffness_of()
    calm = found < STIFF
    if calm and not equations.inertial and jump(equations) is None and not outlives_series(equations):
        return _taylor(scene, equations)
    if calm or math.isinf(found) or any(len(pairs) > LINK_LIMIT for _, pairs in equations.fields):
        return integrator("dop853")
    pair = equations.n == 2 and not (equations.mixed or equations.inertial) and scene.rtol <= 1e-9
    return integrator("switching" if pair else AUTO)


def chosen_for_modes(
    scene: Scene,
    variation: Variation,
    state: np.ndarray,
    numbers: np.ndarray,
    strengths: np.ndarray,
    slow: float = 1.0,
) -> Integrator:
    """Return the integrator of orbits with deviations along them, Taylor or Rosenbrock steps: modes have no others.

    Power series where all functions are analytic, and neither the orbit nor the strongest mode is stiff at the start.

    Parameters
    ----------
    scene : Scene
        Its integrator, and the tolerances that the order follows.
    variation : Variation
        Orbit with its variational equation.
    state : ndarray, shape (cells, dimension)
        Initial states.
    numbers : ndarray, shape (cells, parameters)
        Values of the parameters of the orbit.
    strengths : ndarray, shape (number of strengths, modes)
        Strengths of the modes.
    slow : float
        Rate of the motion that steps must follow anyway, 2 pi over the time of a turn.
    """
    if scene.integrator == "taylor":
        return _taylor(scene, variation.orbit)
    smooth = scene.integrator == "auto" and is_analytic(variation.orbit)
    if smooth and mode_stiffness(variation, state, numbers, strengths, slow) < STIFF:
        return _taylor(scene, variation.orbit)
    return integrator(AUTO)


def _taylor(scene: Scene, equations: Equations) -> Integrator:
    return integrator("taylor", order_for(scene.rtol, scene.atol, is_linear(equations)))


def stiffness(planner: Planner) -> float:
    """Return how much faster motions decay or grow at the start than they turn, the largest of the cells looked at.

    The rate is the real part of an eigenvalue of a node's own block of the Jacobian, with twice what
    its links add, which bounds that of a network of springs; it is compared with the imaginary
    parts and one.  In the extreme cells the layers of smoothed jumps are looked at too, although the start lies
    outside.  It is infinite where a rate is finite and a slope of it is not, which no method that takes slopes leaves.
    """
    return _stiffness(planner.rates, planner.equations, planner.extremes())


def _stiffness(starts: Iterable[Rates], equations: Equations, extremes: Plan) -> float:
    found = [(at.fastest, at.turning) for at in starts]
    return _stiffest(found + [(LAYER * at.fastest, LAYER * at.turning) for at in _each(bends, equations, extremes)])


def _each(function: Callable[..., Rates], equations: Equations, rows: Plan) -> Iterator[Rates]:
    return (function(equations, *cell) for cell in zip(rows.start, rows.numbers, strict=True))


def mode_stiffness(
    variation: Variation, state: np.ndarray, numbers: np.ndarray, strengths: np.ndarray, slow: float = 1.0
) -> float:
    """Return how much faster deviations decay or grow at some states than they or the motion turn: the largest of the first orbits.

    Of the strengths none and the largest are looked at; parameters as for `chosen_for_modes`.
    """
    return _stiffest(((at.fastest, at.turning) for at in mode_rates(variation, state, numbers, strengths)), slow)


def warn_of_stiff_modes(
    variation: Variation,
    state: np.ndarray,
    numbers: np.ndarray,
    strengths: np.ndarray,
    step: float,
    slow: float = 1.0,
) -> bool:
    """Warn if Taylor steps with deviations were short, `step` in the mean, because they are stiff where they ended.

    The other parameters are those of `chosen_for_modes`.  Return whether they were.
    """
    if step * STIFF * slow >= 1.0:
        return False
    for fastest, turning, _ in mode_rates(variation, state, numbers, strengths):
        if fastest * step > 1.0 and fastest > STIFF * max(slow, turning):
            warn(
                f"stiff modes: found a rate of {fastest:.3g} beside slow motion, and Taylor steps of {step:.2g}; "
                "expected longer ones; integrator = 'rodas5p' takes them"
            )
            return True
    return False


def _stiffest(rates: Iterable[tuple[float, float]], slow: float = 1.0) -> float:
    return max((fastest / max(slow, turning) for fastest, turning in rates), default=0.0)


FEW = 100
"""Steps of a cell that are no crawling, however short."""

CRAWLING, LIMITED = 10_000, 4.0
"""Steps of a cell that are too many for a motion that has come to rest, and their lengths by its fastest rate, which limits
explicit steps then."""

BLOWN = 1e6
"""Growth of a state from which on what grows as fast as anything is a solution without bound."""


def warn_of_stiffness(source: KernelSource, buffers: Buffers, rows_of: Callable[[np.ndarray], Plan]) -> None:
    """Warn if explicit steps of some cells were short because the equations are stiff or the motion has no bound.

    The three cells with the shortest steps are looked at, where they ended, unless they ended at a singularity.

    Parameters
    ----------
    source : KernelSource
    buffers : Buffers
        What the kernel filled.
    rows_of : callable
        Gives the rows of some cells, as the kernel took them.
    """
    steps = buffers.counts[:, Count.ACCEPTED] + buffers.counts[:, Count.REJECTED]
    times = buffers.sums[:, Sum.STOPPED_AT]
    broken = np.isin(buffers.counts[:, Count.STATUS], (Status.STEP_UNDERFLOW, Status.DIVERGED))
    lengths = np.where((steps > 0) & (times > 0.0) & ~broken, times / np.maximum(steps, 1), math.inf)
    cells = np.argsort(lengths)[:3]
    rows, kind = rows_of(cells), "Taylor" if source.method.series else source.method.name
    for cell, start, numbers in zip(cells, rows.start, rows.numbers, strict=True):
        if not math.isfinite(lengths[cell]) or not np.isfinite(buffers.end[cell]).all():
            continue
        size = np.abs(buffers.end[cell]).max()
        grown = size > BLOWN * max(1.0, np.abs(start).max())
        if steps[cell] < FEW and not grown:
            continue
        fastest, turning, growth = rates(source.equations, buffers.end[cell], numbers, times[cell])
        resting = steps[cell] > CRAWLING and fastest * lengths[cell] > LIMITED and not source.equations.forced
        slow = max(turning, 0.0 if resting else 1.0)
        bound = math.inf if grown else sys.float_info.max  # an infinite slope, as of sqrt(x) at 0, is no stiffness
        if fastest * lengths[cell] > 1.0 and STIFF * slow < fastest <= bound:
            if grown and growth >= 0.5 * fastest:
                warn(
                    f"a state grew to {size:.3g} in {steps[cell]} {kind} steps of a cell; expected a bounded motion; "
                    "check the signs and the size of the parameters"
                )
                return
            warn(
                f"stiff equations: found a rate of {fastest:.3g} beside slow motion, and {steps[cell]} {kind} steps in a cell; "
                "expected few; the result may be worse than rtol says; integrator = 'rodas5p' takes longer steps"
            )
            return
