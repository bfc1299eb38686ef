"""A small sweep that streams to disk, and processes that are killed while it does."""

from __future__ import annotations

import multiprocessing
import multiprocessing.context
import os
import random
import shutil
import signal
import time
from multiprocessing.connection import Connection
from pathlib import Path

from synchain.graphs import chain
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.axis import Axis
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.scene_kernels import kernel
from synchain.runtime.results import store
from synchain.runtime.results.open import open_result
from synchain.runtime.support.progress import Progress
from synchain.runtime.sweeps.stream import stream

RECORDS = ("sync_error", "section", "trajectory")
PAIR = Scene(topology=chain(2), transient=2, window=4, parameters={"sigma": 0.1}, record=RECORDS, samples=5)
MAP = PAIR.replace(axes=[Axis.between("sigma", 0.0, 0.3, 20), Axis.between("omega", 1.1, 1.9, 20)])
UP = PAIR.replace(axes={"omega": [1.1, 1.3, 1.5], "sigma": [0.01 * k for k in range(40)]}, continuation="up")


def warm() -> None:
    """Have the kernel ready before anybody's time is taken."""
    kernel(MAP, reduce=reduce_scene(MAP))


def partial(path: Path) -> Path:
    return path.with_suffix(".partial")


def contents(path: Path) -> dict[str, bytes]:
    """The bytes of a file, or of all files of a folder."""
    return {str(part.relative_to(path)): part.read_bytes() for part in (path, *path.rglob("*")) if part.is_file()}


def sit(scene: Scene, path: Path, said: Connection) -> None:
    """One sitting, which says how many cells are done; made to be killed."""

    def say(progress: Progress) -> None:
        said.send(progress.done)

    stream(scene, path, resume=partial(path).exists(), workers=2, show_progress=False, progress=say)


def last(said: Connection) -> int:
    """The last number that a process has sent before its end."""
    cells = 0
    try:
        while True:
            cells = said.recv()
    except (EOFError, OSError):
        return cells


def forking() -> multiprocessing.context.ForkServerContext:
    """Processes that start with everything imported and compiled."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["streams_warm"])
    here, search_path = str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")
    if here not in search_path.split(os.pathsep):
        os.environ["PYTHONPATH"] = os.pathsep.join([here, search_path])
    return context


def die_at_the_copy(scene: Scene, path: Path) -> None:
    """A run that is killed when it begins to write the result."""
    store.copy_in_pieces = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
    stream(scene, path, overwrite=True, workers=1, show_progress=False)


def kill_again_and_again(scene: Scene, folder: Path, times: int, seed: int, ending: str = ".nc") -> tuple[int, int]:
    """Kill sittings at random moments so many times; returns how often blocks were kept and how often the sweep got done.

    What a sitting has said to be done must be on the disk, and every finished file must be that of a run without kills.
    """
    warm()
    stream(scene, folder / f"whole{ending}", workers=2, show_progress=False)
    expected = contents(folder / f"whole{ending}")
    context = forking()
    dice, path = random.Random(seed), folder / f"cut{ending}"
    span, killed, resumed, done = float("inf"), -2, 0, 0  # the first two are left alone, to see how long it takes
    while killed < times:
        hears, says = context.Pipe(duplex=False)
        process = context.Process(target=sit, args=(scene, path, says))
        process.start()
        says.close()
        began = time.monotonic()
        process.join(None if killed < 0 else dice.uniform(0.0, span))
        killed += process.is_alive() or killed < 0
        process.kill()
        process.join()
        said = last(hears)
        span = 1.1 * (time.monotonic() - began) if killed <= 0 and process.exitcode == 0 else span
        assert process.exitcode in (0, -9), f"ended with {process.exitcode}"
        if partial(path).exists():
            stored = int((open_result(partial(path)).status != 0).sum())
            assert stored >= said, f"{said} cells were done, {stored} are on the disk"
            resumed += stored > 0
        if path.exists():
            assert contents(path) == expected
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            partial(path).unlink(missing_ok=True)
            done += 1
    stream(scene, path, resume=partial(path).exists(), workers=1, show_progress=False)
    assert contents(path) == expected
    assert sorted(p.name for p in folder.iterdir()) == [f"cut{ending}", f"whole{ending}"]
    return resumed, done
