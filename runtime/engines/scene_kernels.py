"""Write and compile the kernel of a scene."""

from __future__ import annotations

from functools import lru_cache
from weakref import WeakKeyDictionary

from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.sweep_kernel import SweepKernel, emit
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.codegen.simd.lane_types import WIDTHS
from synchain.models.inputs.checks import check_integer
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene

from ..cells.reduce import ReducedScene, as_reduction
from .choice import Ladder


def kernel(scene: Scene, width: int | None = None, reduce: bool | ReducedScene = True) -> Kernel:
    """Return the compiled kernel with which `run(scene)` integrates a scene.

    Scenes that differ only in numbers share a kernel.

    Parameters
    ----------
    scene : Scene
    width : int, optional
        Number of lanes: 1, 2, 4, 8 or 16 (default: what the processor has, one for a single cell).
    reduce : bool or ReducedScene
        Whether to leave out what the scene does not need (docs/skips.md); as for `run`.

    Raises
    ------
    ValueError
        If the width is none of these, or if the reduction is that of another scene.

    See Also
    --------
    synchain.run
    synchain.export.to_python

    Examples
    --------
    >>> import synchain as sc
    >>> "Generated kernel: 1 oscillator" in sc.kernel(sc.Scene("harmonic")).source
    True
    """
    return load(kernel_source(scene, width, reduce))


def kernel_source(scene: Scene, width: int | None = None, reduce: bool | ReducedScene = True) -> SweepKernel:
    """Return the text of a scene's kernel without compiling it; parameters and errors as for `kernel`."""
    return write_kernel(as_reduction(scene, reduce), width)


_ladders: WeakKeyDictionary[ReducedScene, Ladder] = WeakKeyDictionary()


def ladder_of(reduction: ReducedScene) -> Ladder:
    """Return the integrators of the cells of a reduced scene; the same object each time."""
    if reduction not in _ladders:
        _ladders[reduction] = Ladder(reduction.scene, reduction.equations)
    return _ladders[reduction]


def chosen_integrator(reduction: ReducedScene) -> Integrator:
    return ladder_of(reduction).main(reduction.rows(reduction.planner.sample()))


def write_kernel(reduction: ReducedScene, width: int | None = None, method: Integrator | None = None) -> SweepKernel:
    """Return the text of the kernel of a reduced scene; by default of the integrator with which most cells begin."""
    scene = reduction.scene
    width = 1 if width is None and scene.cells == 1 else width
    if width is not None and check_integer("width", width, 1) not in WIDTHS:
        raise ValueError(f"width = {width}; expected one of {', '.join(map(str, WIDTHS))}")
    method = chosen_integrator(reduction) if method is None else method
    return _emitted(reduction.equations, method, reduction.recording, width)


_emitted = lru_cache(maxsize=32)(emit)  # `emit` with a cache; scenes that differ only in numbers share the text


def warn_of_chords(source: SweepKernel) -> None:
    """Warn of recorded states between steps, if the integrator interpolates linearly between steps."""
    records = {"sample": "trajectory", "cut": "sections", "tally": "observables"}
    between = [records[r.entry] for r in reversed(source.recorders) if r.entry in records]
    if between and source.method.dense_order < 2:
        warn(
            f"{source.integrator} draws straight lines between its steps, so errors of {' and '.join(between)} are not bounded "
            "by rtol; take another integrator for these records, e.g. rodas5p"
        )
