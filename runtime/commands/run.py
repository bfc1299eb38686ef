"""`synchain run`: every cell of a scene, a result file and a figure."""

from __future__ import annotations

import shlex
import sys
import time
from argparse import ArgumentParser, Namespace
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._arguments import add_scene, add_workers, folder, setting, tolerance
from ._outcome import FAILED, FINE, Failed, WrongUse, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.scene import Scene

    from ..result import Result
    from ..skip import Skip

SUMMARY = "run a scene; write its results (netCDF) and a figure"
EXAMPLES = (
    "synchain run figure_4a --out results",
    "synchain run two_oscillators --out results --set sigma=0:0.6:61 omega=1.4 --rtol 1e-9",
    "synchain run figure_4a --out results --resume",
    "synchain run figure_4a --explain",
)

SETTINGS = ("transient", "window", "samples", "atol", "max_steps")
"""Numbers of a scene besides parameters and initial states that --set can change."""


def configure(parser: ArgumentParser) -> None:
    """Add scene, folder and changes to the scene."""
    parser.usage = (
        "synchain run SCENE --out DIR [--rtol X] [--workers N] [--set NAME=VALUE ...] [--resume]\n"
        "                    [--certify] [--no-skip] [--explain]\n"
        "       synchain run SCENE --explain [--rtol X] [--set NAME=VALUE ...] [--no-skip]"
    )
    add_scene(parser)
    parser.add_argument("--out", metavar="DIR", type=folder, help="folder for the files, made where it is missing")
    parser.add_argument(
        "--rtol", metavar="X", type=tolerance, help="relative tolerance of one step, above 0, at most 0.1"
    )
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        nargs="+",
        action="extend",
        type=setting,
        default=[],
        help="set a parameter, an initial state (x_1) or one of "
        + ", ".join(SETTINGS)
        + "; a,b,c or LO:HI:N sweeps a parameter or an initial state",
    )
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run; finished cells are kept")
    parser.add_argument(
        "--explain", action="store_true", help="print what is left out of the scene and why; runs only with --out"
    )
    parser.add_argument("--no-skip", action="store_true", help="leave nothing out: integrate the scene as it stands")
    parser.add_argument(
        "--certify",
        action="store_true",
        help="add each cell's transversal exponent and a verdict; cells sure to stay synchronous end early",
    )
    add_workers(parser)


def execute(arguments: Namespace) -> int:
    """Explain the scene where asked to; run it, save, draw, and say how the cells ended."""
    from synchain.codegen.integrators import integrator

    from ..certificate import check_certifiable
    from ..skip import decide, explain
    from ..sweep import SweepInterrupted, run

    if arguments.out is None and (arguments.resume or not arguments.explain):
        raise WrongUse("the following arguments are required: --out\nsee: synchain run --help")
    with wrong_use():
        scene = changed_scene(arguments)
        skip = decide(scene, not arguments.no_skip)
        name = Path(arguments.scene).stem if arguments.scene.endswith(".toml") else arguments.scene
        if arguments.explain:
            print(f"{name}: {_count(scene.cells, 'cell')} of {_count(scene.n, 'oscillator')}\n{explain(skip)}")
        if scene.integrator != "auto":
            integrator(scene.integrator)
        if arguments.out is None:
            return FINE
        target = Path(arguments.out, f"{name}.nc")
        earlier = _earlier(skip, target) if arguments.resume else None
        _prepare(skip, target)
        if arguments.certify:
            check_certifiable(scene)
    warn(scene.warnings)
    began = time.perf_counter()
    try:
        result = run(scene, workers=arguments.workers, resume=earlier, skip=skip, certified=arguments.certify)
    except SweepInterrupted as stop:
        raise _partial(stop.result, target, arguments) from None
    result.save(target)
    _drop_unfinished(scene, target)
    files = (target, _draw(result, target.with_suffix(".png")))
    _summary(name, result, time.perf_counter() - began, files)
    return FINE if result.success else FAILED


def changed_scene(arguments: Namespace) -> Scene:
    """The scene with the changes of --set and --rtol; ValueError where they do not fit."""
    from synchain.models.scene_file import load_scene

    from ..sweep import with_axes

    scene = load_scene(arguments.scene)
    changes: dict[str, Any] = {}
    for name, value in arguments.set:
        if name in changes:
            raise WrongUse(f"--set gives {name} twice; expected it once")
        changes[name] = _fitting(scene, name, value)
    scene = with_axes(scene, changes)
    if changes:
        scene = scene.replace(title=f"{scene.title or arguments.scene}, changed: {', '.join(changes)}")
    return scene if arguments.rtol is None else scene.replace(rtol=arguments.rtol)


def _fitting(scene: Scene, name: str, value: float | tuple[float, ...]) -> Any:
    """The value of a setting as the scene wants it."""
    from synchain.models.scene_model import check_state, unknown

    if name in scene.parameters or name in scene.equations.state:
        return value
    if name == "rtol":
        raise WrongUse("--set cannot change rtol; use --rtol")
    if name.rpartition("_")[0] in scene.components:
        check_state(name, scene.components, scene.n, "initial state")
    if name not in SETTINGS:
        made = {key: getattr(scene, key) for key in ("oscillator", "friction", "contact", "coupling", "topology")}
        states = (f"{component}_1" for component in scene.components)
        raise WrongUse(f"--set: {unknown(made, name, 'parameter', (*scene.parameters, *states, *SETTINGS))}")
    if isinstance(value, tuple):
        raise WrongUse(f"--set {name}: found {len(value)} values; only parameters and initial states can be swept")
    return int(value) if name in ("samples", "max_steps") and value.is_integer() else value


def _prepare(skip: Skip, target: Path) -> None:
    """Find out whatever can go wrong before the first cell runs, then make the folder."""
    from ..files import output_folder
    from ..plan import plan
    from ..sweep import kernel_source

    plan(skip.scene)
    kernel_source(skip.scene, skip=skip)
    output_folder(target.parent)
    if target.is_dir():
        raise WrongUse(f"{target} is a folder; expected a file or nothing there; choose another --out")


def _unfinished(target: Path) -> Path:
    """Where an interrupted run is kept: beside the result, which may be an earlier, complete one."""
    return target.with_suffix(".partial.nc")


def _drop_unfinished(scene: Scene, target: Path) -> None:
    """Delete the interrupted run that this one has replaced; one of another scene stays."""
    from ..result import open_result

    kept = _unfinished(target)
    if kept.exists():
        with suppress(OSError, ValueError):
            if open_result(kept).belongs_to(scene):
                kept.unlink()


def _earlier(skip: Skip, target: Path) -> Result:
    """The result to resume; ValueError where it belongs to another scene or left out other parts of it."""
    from ..result import open_result

    found = next((path for path in (_unfinished(target), target) if path.exists()), None)
    if found is None:
        raise WrongUse(f"nothing to resume: {target} does not exist; run without --resume")
    earlier = open_result(found)
    if not earlier.belongs_to(skip.scene):
        raise WrongUse(f"{found} belongs to another scene; repeat the options of that run, or run without --resume")
    if not earlier.stepped(skip.equations):
        raise WrongUse(
            f"{found} left out other parts of its scene: {earlier.data.attrs.get('skipped', 'nothing')}; "
            "repeat that run's --no-skip (or its absence), or run without --resume"
        )
    return earlier


def _partial(result: Result, target: Path, arguments: Namespace) -> Failed:
    """Save what an interrupted run has done; what to say about it."""
    from ..status import Status

    done = int((result.status == Status.FINISHED).sum())
    if done == 0:
        return Failed("interrupted before any cell had finished; nothing was written")
    kept = _unfinished(target)
    result.save(kept)
    again = shlex.join([*arguments.command_line, *(() if arguments.resume else ("--resume",))])
    return Failed(
        f"interrupted with {done} of {result.scene.cells} cells finished, kept in {kept}\ncontinue with: {again}"
    )


def _draw(result: Result, path: Path) -> Path:
    """Write the figure of a result."""
    import matplotlib

    matplotlib.use("Agg")
    from ..figures.result_plot import draw_result
    from ..files import whole_file

    axes = draw_result(result)
    with whole_file(path) as temporary:
        axes.figure.savefig(temporary, dpi=150)
    return path


def _summary(name: str, result: Result, seconds: float, files: tuple[Path, ...]) -> None:
    """Say how many cells ended how, failures on stderr, and where the files are."""
    import numpy as np

    from ..certificate import VERDICTS
    from ..status import Status

    scene = result.scene
    print(f"{name}: {_count(scene.cells, 'cell')} of {_count(scene.n, 'oscillator')} in {seconds:.1f} s")
    codes, counts = np.unique(result.status.values, return_counts=True)
    for code, count in zip(codes, counts.tolist(), strict=True):
        status = Status(int(code))
        words = f"{_count(count, 'cell')}: {status.message}"
        if status == Status.FINISHED:
            print(f"  {words}")
        else:
            print(f"synchain run: {words}", file=sys.stderr)
    if "verdict" in result.data:
        early = int((result.data.ended_early.values != 0).sum())
        print(f"  {_count(early, 'cell')} of these ended early, certain to stay synchronous")
        for code, count in zip(*np.unique(result.data.verdict.values, return_counts=True), strict=True):
            print(f"  {_count(int(count), 'cell')} {VERDICTS[code]}")
    for file in files:
        print(f"  {file}")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
