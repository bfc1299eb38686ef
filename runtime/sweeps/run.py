"""Run a scene in memory.

The stages of `run`; the output of each is the input of the next.

1. *Scene*: ``Given.sweep`` (cells/run_keywords), Scene → Scene.  Fix or sweep parameters and initial states, add draws,
take the
   states of an earlier run as the start.
2. *Reduction*: ``as_reduction`` (cells/reduce), Scene → ReducedScene.  Leave out terms that vanish in every cell and
merge
   oscillators that move as one, exactly.  Its planner lays out cells as rows of numbers.
3. *Kernel*: ``prepare`` (sweeps/prepare), ReducedScene → PreparedRun.  Choose the integrator by the rates of some cells
   (engines/choice), write the text of the kernel (codegen/kernels), compile it or load it (codegen/machine_code).
4. *Certificate*, optional: ``certified`` (sweeps/certify), PreparedRun → PreparedRun with transversal exponents.
5. *Blocks*: ``Memory.run`` (sweeps/memory), PreparedRun → Buffers.  The scheduler gives blocks of cells to workers; the
planner
   makes rows of each block, and an `Engine` (engines/engine) integrates the rows into buffers.
6. *Result*: ``Memory.result``, Buffers → Result.  Expand to the whole network and label (results/labels).

`stream` has the same stages, with a file in place of the memory.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Executor

import numpy as np

from synchain.models.inputs.checks import check_flag, check_instance
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.reduce import ReducedScene, as_reduction
from ..cells.run_keywords import Given
from ..results.result import Result
from ..support.execution import Execution
from ..support.progress import Hook
from .certify import certified as with_certificate
from .continued_start import StartValue, several, started, starts_of_cells, with_start_times
from .memory import Memory
from .prepare import prepare


def run(
    scene: Scene,
    *,
    resume: Result | None = None,
    start: StartValue | None = None,
    width: int | None = None,
    reduce: bool | ReducedScene = True,
    certified: bool = False,
    t_eval: Iterable[float] | None = None,
    realisations: int | None = None,
    draws: Mapping[str, object] | None = None,
    rng: int | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, object] | None = None,
    **axes: object,
) -> Result:
    """Run every cell of a scene.

    Parameters
    ----------
    scene : Scene
    resume : Result, optional
        An earlier, unfinished result of the same scene, whose finished cells are kept.
    start : Result, DataArray, mapping, or sequence of numbers, optional
        Start from the states at the end of one cell: a result of one cell, or
        `result.end.isel(sigma=-1)`; or from a table as `initial` of `Scene` takes, or all states in
        the order of the equations.  If the result has several cells, each cell starts from the cell
        with the same values of the axes; if the result lacks an axis, all values of this axis start
        from one cell.  Components and nodes must be those of the scene.  Time starts from 0 again, so
        that the earlier run must end with a period of the drive.  The attribute `start_time` of the
        data, a coordinate for several cells, is the time at which the earlier run ended.
    width : int, optional
        Number of lanes: 1, 2, 4, 8 or 16 (default: what the processor has, one for a single cell).
    reduce : bool or ReducedScene
        Whether to leave out, exactly, what the scene does not need (docs/skips.md).  False
        integrates all of it; a ReducedScene of this scene is used unchanged.
    certified : bool
        Add the transversal exponent of every cell and a verdict on its synchronisation, and end
        cells early that are certain to stay synchronous (see `synchain.runtime.sweeps.certify`).
    t_eval : iterable of float, optional
        Times of a trajectory, as for `Scene`; they replace the sample times of the scene.
    realisations, draws, rng : optional
        As for `Scene`; they add a dimension to the sweep (docs/observing.md).
    workers : int, optional
        Number of threads (default: all cores).
    executor : concurrent.futures.Executor, optional
        Executor that runs the blocks, instead of threads (docs/scale.md).
    show_progress : bool, optional
        Whether to show a bar; by default a bar on terminals and in notebooks, a line a minute elsewhere.
    progress : callable, optional
        Is called with a `Progress` after each block.
    parameters : mapping of str to number or sequence, optional
        The same as `axes`, for names that are keywords already.
    **axes : number or sequence
        Parameters and initial states of the scene.  A number fixes one; a sequence makes it an axis
        of the sweep, after those of the scene, and replaces an axis of the same name.

    Returns
    -------
    Result
        Labelled arrays of all cells.  `workers`, `width` and `executor` do not change them; the attributes `lanes` and
        `kernel` of the data name the kernel, which depends on `width`.

    Raises
    ------
    ValueError
        If a name is unknown, given twice, or that of a field of the scene (see `Scene.replace`), if
        `resume` or `reduce` belongs to another scene, if `start` has other labels, cells of other
        values of the axes or a drive amid a period, or if the sweep does not fit into memory.
    SweepInterrupted
        On Ctrl-C; its `result` has the cells that had finished.
    SweepFailed
        If the workers are lost; its `result` has the cells that had finished.

    See Also
    --------
    stream : The same, with the result in a file.

    Examples
    --------
    >>> from synchain import Field, Scene, run
    >>> decay = Scene(Field({"x": "-a*x"}, parameters={"a": 1}), initial={"x": 2}, transient=0, window=1)
    >>> result = run(decay, a=[1, 2], show_progress=False)
    >>> print(result.end.values.ravel().round(6))
    [0.735759 0.270671]
    """
    # 1. Scene: a start of one cell becomes the initial state of the scene; axes of initial states replace it.
    start_times: float | np.ndarray | None = None
    starts = None
    if start is not None and not several(start):
        scene, start_times = started(check_scene(scene), start)
    scene = Given(run, parameters, axes).sweep(scene, t_eval=t_eval, realisations=realisations, draws=draws, rng=rng)
    if start is not None and several(start):
        starts, start_times = starts_of_cells(scene, start)
        if check_flag("certified", certified):
            raise ValueError("certified: found a start of several cells; expected that of one; leave one of them out")
    if resume is not None:
        check_instance("resume", resume, Result, "an earlier Result, e.g. from open_result")
    execution = Execution(workers, executor, show_progress, progress)
    reporter = execution.reporter(scene.cells)
    # 2. Reduction
    reduction = as_reduction(scene, reduce, starts)
    reduction.check_memory()
    # 3. Kernel
    prepared = prepare(reduction, execution, width=width)
    # 4. Certificate
    if check_flag("certified", certified):
        prepared = with_certificate(prepared)
    # 5. Blocks
    memory = Memory.of(prepared, resume)
    memory.run(reporter)
    # 6. Result
    result = memory.result()
    return result if start_times is None else with_start_times(result, start_times)
