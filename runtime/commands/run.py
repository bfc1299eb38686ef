"""`synchain run`: every cell of a scene, a result file and a figure."""

from __future__ import annotations

import shlex
import signal
import sys
import threading
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..console.arguments import add_workers, folder, part, settings, times, tolerance
from ..console.outcome import FAILED, FINE, Failed, WrongUse, print_json, sentence, warn, wrong_use
from ..console.scene_arguments import add_changed_scene, changed_scene
from ..support.error_text import counted

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..cells.reduce import ReducedScene
    from ..support.status import Status
    from ..sweeps.errors import SweepFailed, SweepInterrupted
    from ..sweeps.stream import Streamed

SUMMARY = "run a scene; write its results (netCDF or Zarr) and a figure"
EXAMPLES = (
    "synchain run figure_4a --out results",
    "synchain run two_oscillators --out results --set sigma=0:0.6:61 omega=1.4 --rtol 1e-9",
    "synchain run figure_4a --out results --resume",
    "synchain run figure_4a --out results --format zarr",
    "synchain run figure_4a --out results --part 3/8 --resume",
    "synchain run figure_4a --out results --dask tcp://192.168.0.1:8786",
    "synchain run figure_4a --explain",
)

# Endings of results (`synchain.runtime.results.store.FORMS`, which is not loaded for a help).
FORMATS = ("nc", "nc4", "zarr")
PATIENCE = 10  # seconds that a Dask scheduler has to answer


def configure(parser: ArgumentParser) -> None:
    parser.usage = (
        "synchain run SCENE --out DIR [--rtol X] [--t-eval TIMES] [--workers N]\n"
        "                    [--set NAME=VALUE ...] [--format FORMAT] [--resume | --overwrite] [--part K/N]\n"
        "                    [--dask ADDRESS] [--certify] [--no-skip] [--json] [--explain]\n"
        "       synchain run SCENE --explain [--rtol X] [--set NAME=VALUE ...] [--no-skip]"
    )
    add_changed_scene(parser, more="a,b,c or LO:HI:N sweeps a parameter or an initial state")
    parser.add_argument("--out", metavar="DIR", type=folder, help="folder for the files, made where it is missing")
    parser.add_argument(
        "--rtol", metavar="X", type=tolerance, help="relative tolerance of one step, above 0, at most 0.1"
    )
    parser.add_argument(
        "--t-eval",
        metavar="TIMES",
        type=times,
        help="times of a trajectory, in the unit of the scene: a,b,c or LO:HI:N",
    )
    parser.add_argument(
        "--format",
        metavar="FORMAT",
        choices=FORMATS,
        default=FORMATS[0],
        help="ending of the result: nc, netCDF-3 (default), nc4, netCDF-4 (needs h5netcdf), or zarr (needs zarr)",
    )
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run; finished cells are kept")
    parser.add_argument("--overwrite", action="store_true", help="replace a result that is there already")
    parser.add_argument(
        "--part",
        metavar="K/N",
        type=part,
        help="run part K of N alone, as one job of a job array; synchain merge makes the result of all parts",
    )
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="run on the workers of a Dask scheduler, e.g. tcp://192.168.0.1:8786"
    )
    parser.add_argument(
        "--explain", action="store_true", help="print what is left out of the scene and why; runs only with --out"
    )
    parser.add_argument("--json", action="store_true", help="print JSON: file, figure, number of cells by their status")
    parser.add_argument("--no-skip", action="store_true", help="leave nothing out: integrate the scene as it stands")
    parser.add_argument(
        "--certify",
        action="store_true",
        help="add each cell's transversal exponent and a verdict; cells sure to stay synchronous end early",
    )
    add_workers(parser)


def execute(arguments: Namespace) -> int:
    """Explain the scene with --explain; run it to a file, draw it, and print how the cells ended."""
    from ..cells.reduce import explain, reduce_scene
    from ..engines.scene_kernels import kernel
    from ..support.files import output_folder
    from ..sweeps.errors import SweepFailed, SweepInterrupted
    from ..sweeps.stream import claim, stream

    if arguments.out is None and (arguments.resume or arguments.overwrite or not arguments.explain):
        raise WrongUse("the following arguments are required: --out\nsee: synchain run --help")
    with wrong_use():
        if arguments.rtol is not None and "rtol" in settings(arguments):
            raise WrongUse("found --rtol beside --set rtol; expected one of them")
        scene = changed_scene(arguments)
        changes = {"rtol": arguments.rtol, "t_eval": arguments.t_eval}
        scene = scene.replace(**{name: value for name, value in changes.items() if value is not None})
        skip = reduce_scene(scene, not arguments.no_skip)
        name = Path(arguments.scene).stem if arguments.scene.endswith(".toml") else arguments.scene
        if arguments.json and arguments.explain:
            raise WrongUse("found --json with --explain, which prints sentences; expected one of them")
        if arguments.explain:
            print(f"{name}: {counted(scene.cells, 'cell')} of {counted(scene.n, 'oscillator')}\n{explain(skip)}")
        target = None if arguments.out is None else _target(Path(arguments.out, f"{name}.{arguments.format}"))
        _check(skip, arguments)
        if target is None:
            return FINE
        options: dict[str, Any] = {"resume": arguments.resume, "overwrite": arguments.overwrite}
        options |= {"certified": arguments.certify, "part": arguments.part}
        if claim(skip, target, **options) == "complete":
            return _nothing_to_do(target, arguments.json)
        output_folder(target.parent)
    warn(scene.warnings)
    if arguments.dask:
        kernel(scene, reduce=skip)  # before the connection is there, which would not be answered while it compiles
    with stopped_by_signals(), _executor(arguments.dask) as executor:
        try:
            done = stream(scene, target, reduce=skip, workers=arguments.workers, executor=executor, **options)
        except (SweepInterrupted, SweepFailed) as stop:
            raise _stopped(stop, target, arguments) from None
    return print_run(done, "run", arguments.json)


def print_run(done: Streamed, name: str, json: bool = False) -> int:
    """Print how the cells of a finished run ended, draw its figure if it has all cells, and return the exit code."""
    from ..support.status import Status

    if json:
        _print_json(done.path, done.progress.statuses, _drawn(done.path) if done.part is None else None)
        return FINE if done.success else FAILED
    print(done)
    for status, count in done.progress.statuses.items():
        if status != Status.FINISHED:
            print(f"synchain {name}: {counted(count, 'cell')}: {status.message}", file=sys.stderr)
    if done.part is None:
        print(f"  {_drawn(done.path)}")
    return FINE if done.success else FAILED


def _print_json(path: Path, statuses: Mapping[Status, int], figure: Path | None) -> None:
    """Print the files of a run and the number of cells that ended with each status, as JSON."""
    counts = {status.name.lower(): int(count) for status, count in statuses.items()}
    print_json({"file": str(path), "figure": None if figure is None else str(figure), "statuses": counts})


def _target(path: Path) -> Path:
    """Return the path of the result; raise Failed if the package of its form is not installed."""
    from ..results.store import form_of

    try:
        form_of(path)
    except ModuleNotFoundError as problem:
        raise Failed(sentence(problem)) from problem
    return path


def _check(skip: ReducedScene, arguments: Namespace) -> None:
    """Raise the errors of the run before it begins."""
    from ..cells.plan import Planner
    from ..engines.scene_kernels import kernel_source
    from ..sweeps.certify import check_certifiable

    if arguments.out is None:
        return
    Planner(skip.scene).extremes()
    kernel_source(skip.scene, reduce=skip)
    if arguments.certify:
        check_certifiable(skip.scene)


def _nothing_to_do(target: Path, json: bool) -> int:
    """Print that the result is complete already; return the exit code of its run."""
    from ..results.result import read_result
    from ..support.status import Status, tally

    result = read_result(target)
    if json:
        counts = tally(result.data.status.values.ravel())
        figure = target.with_suffix(".png")
        _print_json(target, {s: counts[s] for s in Status if counts[s]}, figure if figure.exists() else _drawn(target))
        return FINE if result.success else FAILED
    print(f"{target} holds the result of this scene already; nothing was run (--overwrite runs it again)")
    print(f"  made with {result.data.attrs['versions']}\n  {result.message}")
    if not target.with_suffix(".png").exists():
        print(f"  {_drawn(target)}")
    return FINE if result.success else FAILED


@contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Treat SIGTERM (of batch systems) and SIGHUP (of a closed terminal) like Ctrl-C; keep ignored signals ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    signals = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {sign: signal.getsignal(sign) for sign in signals}
    caught = [sign for sign, handler in before.items() if handler is not signal.SIG_IGN]  # nohup ignores SIGHUP
    for sign in caught:
        signal.signal(sign, signal.default_int_handler)
    try:
        yield
    finally:
        for sign in caught:
            signal.signal(sign, before[sign])


@contextmanager
def _executor(address: str | None) -> Iterator[Executor | None]:
    """Yield the workers of a Dask scheduler, or None without an address: threads."""
    if address is None:
        yield None
        return
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise Failed(
            '--dask needs the package distributed; install it: python -m pip install "synchain[dask]"'
        ) from None
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TypeError) as problem:
        raise Failed(f"no Dask scheduler answers at {address}: {problem}") from None
    try:
        if not client.nthreads():
            raise Failed(f"the Dask scheduler at {address} has no workers; start some: dask worker {address}")
        yield client.get_executor()
    finally:
        client.close()


def _stopped(stop: SweepInterrupted | SweepFailed, target: Path, arguments: Namespace) -> Failed:
    """Return the message about a run that did not finish, with the command line that continues it."""
    from ..results.partial import partial_path

    line = [text for text in arguments.command_line if text != "--overwrite"]
    again = shlex.join([*line, *(() if arguments.resume else ("--resume",))])
    partial = partial_path(target, arguments.part)
    state = f"{stop.finished} of {stop.cells} cells finished, kept in {partial}\ncontinue with: {again}"
    if stop.finished == 0:
        partial.unlink(missing_ok=True)
        state = "no cell finished; nothing was written"
    return Failed(f"interrupted with {state}" if isinstance(stop, KeyboardInterrupt) else f"{stop.reason}; {state}")


def _drawn(target: Path) -> Path:
    """Draw the figure of a result from its file; raise Failed with the reason if that fails."""
    path = target.with_suffix(".png")
    try:
        from ..plots.canvas import off_screen
        from ..plots.result_plot import draw_result
        from ..results.labels import scene_of
        from ..results.result import Result
        from ..results.store import opened
        from ..support.files import whole_file

        with opened(target) as data, off_screen() as (figure, axes):  # read as far as it is drawn
            draw_result(Result(data, scene_of(data.attrs)), axes)
            with whole_file(path) as temporary:
                figure.savefig(temporary, dpi=150)
        return path
    except (Exception, KeyboardInterrupt) as problem:
        why = "interrupted" if isinstance(problem, KeyboardInterrupt) else sentence(problem)
        raise Failed(
            f"the result is complete: {target}; its figure was not drawn: {why}; the same command again draws it"
        ) from problem
