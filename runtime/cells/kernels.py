"""Which kernel a scene needs: its text, or the text compiled."""

from __future__ import annotations

from functools import lru_cache

import sympy as sp

from synchain.codegen.kernels import sweep as emitting
from synchain.codegen.kernels.compile import Kernel, load
from synchain.codegen.kernels.sweep import AUTO, KernelSource, emit
from synchain.codegen.simd.lane_types import WIDTHS, native_width
from synchain.codegen.steps import program
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import flag, whole
from synchain.models.scenes.scene import Scene, a_scene

from .reduce import Skip, decide

__all__ = ["best_integrator", "chosen_skip", "kernel", "kernel_source"]


def kernel(scene: Scene, width: int | None = None, skip: bool | Skip = True) -> Kernel:
    """Return the compiled kernel of a scene, the one that `run(scene)` runs; scenes that differ only in numbers share it.

    `width` and `skip` mean what they mean for `run`: by default the kernel leaves out what the scene does not need (see
    `synchain.runtime.cells.reduce`), and has a single lane where the scene has a single cell; with `skip` False it integrates
    the scene as it stands.
    """
    return load(kernel_source(scene, width, skip))


def kernel_source(scene: Scene, width: int | None = None, skip: bool | Skip = True) -> KernelSource:
    """Return the text of a scene's kernel without compiling it."""
    chosen = chosen_skip(scene, skip)
    width = 1 if width is None and scene.cells == 1 else width
    if width is not None and whole("width", width, 1) not in WIDTHS:
        raise ValueError(f"width = {width}; expected one of {', '.join(map(str, WIDTHS))}")
    section = None
    if "section" in scene.record:
        section = sp.Symbol(chosen.section_variable(), real=True) - sp.Rational(repr(scene.section.level))
    method = best_integrator(scene.equations, scene.rtol) if scene.integrator == "auto" else scene.integrator
    limits = (emitting.LARGEST_UNROLLED, program.FILL_LIMIT, native_width(1))
    return _written(chosen.equations, method, tuple(chosen.records), section, width, chosen.multiplicity, limits)


@lru_cache(maxsize=32)
def _written(
    equations: Equations, method: str, records: tuple[str, ...], section: sp.Expr | None, width: int | None,
    multiplicity: tuple[int, ...] | None, limits: tuple[float, ...],
) -> KernelSource:  # fmt: skip
    """The text of a kernel, kept for runs that differ in numbers alone; `limits` are what else decides its form."""
    return emit(equations, method, records, section, width, multiplicity)


def best_integrator(equations: Equations, rtol: float) -> str:
    """What "auto" stands for: the fastest at equal error (docs/performance.md).

    Two oscillators at a tight tolerance gain from DOP853 while none of them sticks; of more, some nearly always stick.
    """
    pair = equations.n == 2 and not (equations.mixed or equations.inertial) and rtol <= 1e-9
    return "dop853" if equations.sticks else "switching" if pair else AUTO


def chosen_skip(scene: Scene, skip: bool | Skip) -> Skip:
    """What is left out of a scene: as decided, or as given; ValueError where that is of another scene."""
    a_scene(scene)
    chosen = skip if isinstance(skip, Skip) else decide(scene, flag("skip", skip))
    if chosen.scene != scene:
        raise ValueError("skip: found the reductions of another scene; make them with decide(scene)")
    return chosen
