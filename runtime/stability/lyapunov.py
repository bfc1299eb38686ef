"""Compute the Lyapunov exponents of a whole network, along the motion from its own start.

Deviations are integrated over short blocks of time and made orthogonal after each block. A block is short
enough if every direction remains longer than the error of the integration. Under a smoothed friction law,
the velocity deviations of oscillators that stick decay so fast that no block is short enough. The
exponents of such lost directions are not reported as numbers. Only the sum of the lost exponents can be
computed: the sum of all exponents is the mean divergence of the equations, which is integrated along the
orbit of up to eight oscillators. If a single exponent is lost, the difference gives it.

`TangentFrame` holds the orbit and the orthogonal deviations (an integrator, the length of blocks).
`lyapunov_spectrum` makes a frame, runs the transient, lets the frame choose its blocks, and averages the growth.

Under set-valued friction, stick makes the velocity of a deviation zero, so that directions vanish
within finite time. The exponent of a vanished direction is -inf by definition, and so is the sum. At the end
of a block, a vanished direction has the length of a rounding error.

Source: Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15, 9 (1980).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import ONE_ORBIT, Given
from ..results.labelled import Labelled, dataset
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, Batches, document_keywords, with_growth_by_powers
from .slow_motion import warn_of_slow_motion
from .tangent_frame import TangentFrame

CALL = 8
"""Number of periods of the transient in one call; growth without bound is seen from call to call (a choice)."""

LARGEST_RTOL = 1e-5
"""Largest rtol that is accepted: with a larger one no direction is resolved."""


@dataclass(frozen=True, slots=True, repr=False)
class Lyapunov(Labelled):
    """Lyapunov exponents of a network.

    Exponents that differ by less than about 1/time are not separated: only their sum is right. The
    standard errors do not include this effect. An exponent within 3 over the time since the start is not told from
    0, as deviations may grow by a power of time: its error is at least its size.

    Parameters
    ----------
    exponent : ndarray, shape (count,)
        Exponents per unit of non-dimensional time in descending order.
    stderr : ndarray, shape (count,)
        Standard errors.
    resolved : ndarray of bool, shape (count,)
        False for a direction that decays too fast to be followed, if there are several; its exponent is -inf. Its
        standard error is 0 under set-valued friction, where stick makes directions vanish, and nan otherwise.
    lengths : ndarray, shape (k,)
        Lengths of up to 64 parts of the average, from its beginning, in units of time; the last is `time`.
    running : ndarray, shape (k, count)
        Exponents of these parts, which show whether the average has converged.
    divergence : float
        Mean divergence along the orbit, which is the sum of all exponents of the network. Under
        set-valued friction, above eight oscillators, for several kinds of oscillators and with mass matrices,
        the computed exponents are added instead: the sum is -inf if a direction vanishes, and nan if not all
        exponents are computed.
    divergence_error : float
        Standard error of `divergence`.
    time : float
        Length of the average.
    block : float
        Time between two orthogonalisations.
    components : int
        Number of exponents of the network.
    unit : str
        Unit in which transient and average are counted.

    See Also
    --------
    synchain.lyapunov_spectrum
    """

    exponent: np.ndarray
    stderr: np.ndarray
    resolved: np.ndarray
    lengths: np.ndarray
    running: np.ndarray
    divergence: float
    divergence_error: float
    time: float
    block: float
    components: int
    unit: str = ""

    @property
    def data(self) -> xr.Dataset:
        """Exponents over their index, also of parts of the average, and the divergence."""
        return dataset(
            {
                "exponent": (("number",), self.exponent, "Lyapunov exponents per unit of time"),
                "stderr": (("number",), self.stderr, "standard errors"),
                "resolved": (("number",), self.resolved, "whether the direction could be followed"),
                "running": (("length", "number"), self.running, "exponents of the first part of the average"),
                "divergence": ((), self.divergence, "mean divergence along the orbit"),
            },
            {"number": np.arange(1, len(self.exponent) + 1), "length": self.lengths},
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """The exponents with errors, their sum, the dimension and the length of the average."""
        shown = [with_error(x, e) for x, e in zip(self.exponent[:8], self.stderr[:8], strict=True)]
        low, high = self.dimension_range
        dimension = f"{self.dimension:.4g}, from {low:.4g} to {high:.4g} within two errors"
        lost = int((~self.resolved).sum())
        fast = f"{lost} direction{'s' * (lost > 1)}, which decay too fast; their exponents sum to {self.rest:.8g}"
        divergence = with_error(self.divergence, self.divergence_error)
        return (
            ("exponents", ", ".join([*shown, *(["…"] if len(self.exponent) > len(shown) else [])])),
            *((("not followed", fast),) if lost and len(self.exponent) == self.components else ()),
            *((("divergence", divergence),) if not math.isnan(self.divergence) else ()),
            ("Kaplan-Yorke dimension", f"above {len(self.exponent)}" if math.isnan(self.dimension) else dimension),
            ("average", f"{self.time:.6g} units of time"),
            *((("unit", self.unit),) if self.unit else ()),
        )

    @property
    def rest(self) -> float:
        """Sum of the exponents that are not resolved: the divergence minus the resolved exponents."""
        return self.divergence - float(self.exponent[self.resolved].sum())

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension; nan if it exceeds the number of computed exponents.

        A negative exponent within its standard error of 0 counts as 0. The exponent along a periodic orbit, for
        example, is 0, and the dimension is 1. `dimension_range` is the range within the errors.

        References
        ----------
        Kaplan & Yorke, Springer Lecture Notes in Mathematics 730, 204 (1979).
        """
        zero = (self.exponent < 0.0) & (-self.exponent <= self.stderr) & np.isfinite(self.stderr)
        return self._dimension(np.where(zero, 0.0, self.exponent))

    @property
    def dimension_range(self) -> tuple[float, float]:
        """Kaplan-Yorke dimensions of the exponents minus, and plus, two standard errors.

        The dimension rises with each exponent, so that all exponents within their errors give dimensions in this range.
        """
        errors = np.nan_to_num(2.0 * self.stderr, nan=0.0, posinf=math.inf)
        return self._dimension(self.exponent - errors), self._dimension(self.exponent + errors)

    def _dimension(self, exponent: np.ndarray) -> float:
        """Return the Kaplan-Yorke dimension of exponents in any order."""
        exponent = -np.sort(-exponent)
        sums = np.cumsum(exponent)
        below = np.flatnonzero(sums < 0.0)
        if len(below) == 0:
            return float(self.components) if len(sums) == self.components else math.nan
        k = int(below[0])
        return k + (float(sums[k - 1] / -exponent[k]) if k else 0.0)


@document_keywords
def lyapunov_spectrum(
    scene: Scene,
    *,
    count: int | None = None,
    precision: float | None = None,
    periods: float = 5000,
    transient: float | None = None,
    rtol: float | None = None,
    rng: int | np.random.Generator | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Lyapunov:
    """Compute the Lyapunov exponents of a scene's network along the motion from its own start.

    Parameters
    ----------
    scene : Scene
        Network of any size; of at most 32 oscillators with set-valued friction.
    count : int, optional
        Number of largest exponents; all by default.
    {average}
    rtol : float, optional
        Relative tolerance of the integration, at most 1e-5; by default that of the scene. The friction law may require
        a smaller one.
    rng : int or Generator, optional
        Seed of the initial directions; by default that of the scene.
    {progress}
    {parameters}

    Returns
    -------
    Lyapunov

    Raises
    ------
    ValueError
        If there are more than 32 oscillators with set-valued friction, if `count` exceeds the number of
        exponents, if `rtol` is too large, or if time enters the equations without a known period.
    FloatingPointError
        If the integration fails.

    References
    ----------
    Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15, 9 and 21 (1980).

    See Also
    --------
    exponents : transversal exponents of the synchronous motion of a network of any size.
    cluster_exponents : exponents within and across clusters.

    Examples
    --------
    >>> import synchain as sc
    >>> lorenz = sc.Field({"x": "10*(y - x)", "y": "28*x - y - x*z", "z": "x*y - 8*z/3"}, initial={"x": 1, "z": 20})
    >>> found = sc.lyapunov_spectrum(sc.Scene(lorenz, None), transient=50, precision=0.05, show_progress=False)
    >>> round(float(found.exponent.sum()), 6), bool(abs(found.exponent[0] - 0.906) < 3 * found.stderr[0])
    (-13.666667, True)
    """
    execution = Execution(1, None, show_progress, progress)
    averaging = Averaging.for_scene(scene, precision, periods, transient, rng, execution)
    given = Given(lyapunov_spectrum, parameters, more, ONE_ORBIT)
    scene = given.scene(scene, rtol=scene.rtol if rtol is None else rtol)
    reporter = averaging.reporter()
    equations = scene.equations
    dimension = equations.continuous_dimension
    if count is not None and not 1 <= check_integer("count", count, -dimension) <= dimension:
        raise ValueError(f"count = {count}; expected 1 … {dimension}, the components of the network's state")
    frame = TangentFrame.make(scene, dimension if count is None else count, averaging.seed)
    if frame.rtol > LARGEST_RTOL:
        raise ValueError(
            f"rtol: found {frame.rtol:g}; expected at most {LARGEST_RTOL:g} for a whole spectrum, whose directions must "
            "stand out of the error of a block"
        )
    averaging = averaging.in_units(scene, frame.unit)
    reporter.total = averaging.length
    with reporter:
        for done in range(0, round(averaging.transient), CALL):
            length = min(CALL, round(averaging.transient) - done)
            frame.advance(np.array([length]))
            reporter.advance(length)
        frame.choose_block()
        batches, lost = Batches(frame.unit, 1.0 / frame.parts), np.zeros(frame.count, dtype=bool)
        for left in averaging.rounds(batches, lambda: batches.error()[:-1][~lost], reporter):
            parts = batches.ahead(left)
            growths, _, gone = frame.advance(parts)
            np.logical_or(lost, gone, out=lost)
            batches.extend(growths[:, None], parts)
        ends = frame.uneven_growth(batches.mean()[0]) / batches.time
        steps = np.hypot(frame.error_of_steps(), ends)
    orbit = frame.integrator
    whole = averaging.transient * frame.unit + batches.time
    result = _report(frame, batches, lost, steps, whole)
    contraction = -result.divergence / frame.size
    warn_of_slow_motion(
        equations, orbit.state[:, : equations.dimension], _values(scene), batches.time, contraction, whole
    )
    return result


def _values(scene: Scene) -> np.ndarray:
    return np.array([scene.parameters[name] for name in scene.equations.parameters])


def _report(frame: TangentFrame, batches: Batches, lost: np.ndarray, steps: np.ndarray, whole: float) -> Lyapunov:
    """Return the result of an average of directions that have grown over the `whole` time.

    All exponents after a lost direction count as lost too.
    """
    resolved = ~np.logical_or.accumulate(lost)
    mean, error = batches.mean()[0], np.hypot(batches.error_by_start()[0], steps)
    unknown = 0.0 if frame.orbit.sticks else np.nan
    spread = np.where(resolved, with_growth_by_powers(mean[:-1], error[:-1], whole), unknown)
    exponent = np.where(resolved, mean[:-1], -np.inf)
    order = np.argsort(-exponent, kind="stable")
    lengths, running = batches.running()
    time, volume = batches.time, (float(mean[-1]), float(error[-1]))
    if not frame.volumes:  # of set-valued friction, whose stick makes volumes zero, and of lifted networks
        complete = len(exponent) == frame.size
        volume = (float(exponent.sum()), float(np.hypot.reduce(spread))) if complete else (math.nan, math.nan)
    return Lyapunov(
        exponent[order],
        spread[order],
        resolved[order],
        lengths,
        np.where(resolved, running[:, 0, :-1], -np.inf)[:, order],
        *volume,
        time=time,
        block=frame.unit / frame.parts,
        components=frame.size,
        unit=str(frame.turns),
    )
