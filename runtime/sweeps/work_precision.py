"""Work against precision: the time and the error of a scene's own run, for several integrators and tolerances."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_integer, check_number
from synchain.models.scenes.defaults import LIMITS
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.reduce import as_reduction
from ..cells.run_keywords import Given
from ..engines.choice import Ladder
from ..results.labelled import Labelled, dataset
from ..results.result import Result
from ..support.execution import Execution
from ..support.progress import Hook, Reporter
from ..support.status import Status
from .memory import Memory
from .prepare import prepare

FINEST = 1e-13  # tolerance of the run that the others are compared with: a choice, above the rounding of long runs


@dataclass(frozen=True, slots=True, repr=False)
class WorkPrecision(Labelled):
    """Time and error of a scene's run for several integrators and tolerances.

    Parameters
    ----------
    scene : Scene
    integrator : tuple of str
    rtol : ndarray, shape (tolerances,)
        Relative tolerances, largest first; the absolute one is a tenth of it.
    seconds : ndarray, shape (integrators, tolerances)
        CPU time of all cells on one core, without compilation: the shortest of the runs.  It includes one or two
        milliseconds of preparation.
    error : ndarray, shape (integrators, tolerances)
        Largest error of a final state in any cell and node, in units of the largest magnitude of its component; NaN if
        a cell ended early.
    steps : ndarray, shape (integrators, tolerances)
        Mean number of accepted steps of a cell.
    reference_error : float
        Difference of two runs of tolerances 1e-13 and 1e-12 in the units of `error`; the others are compared with the
        first.

    See Also
    --------
    synchain.work_precision
    """

    scene: Scene
    integrator: tuple[str, ...]
    rtol: np.ndarray
    seconds: np.ndarray
    error: np.ndarray
    steps: np.ndarray
    reference_error: float

    @property
    def data(self) -> xr.Dataset:
        """Times, errors and steps over integrators and tolerances."""
        dims = ("integrator", "rtol")
        return dataset(
            {
                "seconds": (dims, self.seconds, "CPU time of all cells on one core"),
                "error": (dims, self.error, "largest relative error of a final state"),
                "steps": (dims, self.steps, "mean number of steps of a cell"),
                "reference_error": ((), self.reference_error, "difference of runs of tolerances 1e-13 and 1e-12"),
            },
            {"integrator": list(self.integrator), "rtol": self.rtol},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """A line for each integrator and tolerance, and the error of the reference."""
        rows = (
            (f"{name}, rtol {rtol:g}", f"error {self.error[i, k]:.1e}, {1e3 * self.seconds[i, k]:.3g} ms")
            for i, name in enumerate(self.integrator)
            for k, rtol in enumerate(self.rtol)
        )
        return ("scene", repr(self.scene)), *rows, ("reference", f"error {self.reference_error:.1e}")

    def fastest(self, error: float) -> tuple[str, float]:
        """Return the integrator and the tolerance of the fastest run with at most this error.

        Parameters
        ----------
        error : float
            Largest relative error of a final state.

        Returns
        -------
        integrator : str
        rtol : float

        Raises
        ------
        ValueError
            If no run is that exact, or if the reference is not.
        """
        error = check_number("error", error, 0.0)
        exact = self.error <= error
        if not (exact.any() and self.reference_error <= error):
            least = np.nanmin(self.error, initial=np.inf)
            raise ValueError(
                f"found no run with an error of at most {error:g}; the least is {least:.1e}, and the reference is exact to "
                f"{self.reference_error:.1e}; give a smaller rtol, or a shorter window"
            )
        i, k = np.unravel_index(np.argmin(np.where(exact, self.seconds, np.inf)), exact.shape)
        return self.integrator[i], float(self.rtol[k])


def work_precision(
    scene: Scene,
    rtol: float | Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
    *,
    integrators: str | Iterable[str] | None = None,
    repeats: int = 3,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, object] | None = None,
    **axes: object,
) -> WorkPrecision:
    """Measure the time of a scene's run against its error, for several integrators and tolerances.

    The error is that of the final states. Each run is compared with one of tolerance 1e-13, whose own error is estimated
    by a run of tolerance 1e-12. Trajectories of a chaotic motion separate: choose a window
    in which the reference is still exact.

    Parameters
    ----------
    scene : Scene
        Any scene that `run` takes, with its axes, transient and window; its records are left out.
    rtol : float or sequence of float
        Relative tolerances; `atol` is a tenth of each.
    integrators : str or iterable of str, optional
        Names of integrators (default: those among which `integrator="auto"` chooses for this model).
    repeats : int
        Runs of which the shortest time counts.
    show_progress, progress, parameters, **axes
        As for `run`.

    Returns
    -------
    WorkPrecision
        A table with `plot`, and `fastest(error)`.

    Raises
    ------
    ValueError
        For a tolerance or a name that no scene takes, or an integrator that does not suit the model.

    See Also
    --------
    run : Runs the scene with one integrator and tolerance.

    References
    ----------
    Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, section II.10 (Springer, 1993).

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("van_der_pol", transient=0, window=6.3, initial={"x": 2, "v": 0})
    >>> found = sc.work_precision(scene, [1e-4, 1e-8], integrators=["taylor", "dop853"], show_progress=False)
    >>> bool((found.error[:, 1] < 1e-6).all())
    True
    """
    scene = Given(work_precision, parameters, axes).sweep(check_scene(scene)).replace(record=(), sections=None)
    tolerances = np.sort([check_number("rtol", value, *LIMITS["rtol"]) for value in np.atleast_1d(rtol)])[::-1]
    check_integer("repeats", repeats, 1)
    execution = Execution(1, None, show_progress, progress)
    names = tuple(m.name for m in Ladder(scene.replace(integrator="auto"), scene.equations).methods)
    if integrators is not None:
        names = (integrators,) if isinstance(integrators, str) else tuple(integrators)
    reference, coarser = (_run(scene, "auto", rtol, 1, execution)[1] for rtol in (FINEST, 10 * FINEST))
    table = np.empty((3, len(names), len(tolerances)))
    with execution.reporter(table[0].size, "run") as reporter:
        for (i, k), _ in np.ndenumerate(table[0]):
            seconds, result = _run(scene, names[i], float(tolerances[k]), repeats, execution)
            table[:, i, k] = seconds, _error(result, reference), float(result.steps.mean())
            reporter.advance(1)
    return WorkPrecision(scene, names, tolerances, table[0], table[1], table[2], _error(coarser, reference))


def _run(scene: Scene, integrator: str, rtol: float, repeats: int, execution: Execution) -> tuple[float, Result]:
    """Return the shortest CPU time of some runs of all cells, and their result."""
    prepared = prepare(as_reduction(scene.replace(integrator=integrator, rtol=rtol, atol=None), True, None), execution)
    seconds = np.inf
    for _ in range(repeats):
        memory = Memory.of(prepared, None)
        began = time.process_time()
        memory.run(Reporter(scene.cells, show=False))
        seconds = min(seconds, time.process_time() - began)
    return seconds, memory.result()


def _error(result: Result, reference: Result) -> float:
    """Return the largest difference of final states, in units of the largest magnitude of their component."""
    # NaN if a cell ended early.
    if not all(run.status.isin([Status.FINISHED, Status.STOPPED]).all() for run in (result, reference)):
        return np.nan
    others = [dim for dim in reference.end.dims if dim != "component"]
    size = abs(reference.end).max(others)
    return float((abs(result.end - reference.end) / size.where(size > 0, 1.0)).max(skipna=False))
