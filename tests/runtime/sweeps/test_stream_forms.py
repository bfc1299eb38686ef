"""Sweeps to files of every form: the guarantees of netCDF-3 hold for netCDF-4 and Zarr too."""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
import tracemalloc
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from streams import MAP, PAIR, UP, contents, die_at_the_copy, forking, kill_again_and_again, partial, warm

from synchain import Scene, open_result, run, stream
from synchain.results import Status, SweepFailed, SweepInterrupted
from synchain.runtime.cli import main
from synchain.runtime.commands.run import FORMATS
from synchain.runtime.results import store
from synchain.runtime.results.store import FORMS, chunk, opened, pieces
from synchain.runtime.support.netcdf import DIGEST

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")


def form(ending: str) -> Any:
    """An ending; skipped if the package of its form is not installed."""
    package = FORMS[ending].package
    absent = package is not None and importlib.util.find_spec(package) is None
    return pytest.param(ending, marks=pytest.mark.skipif(absent, reason=f"{package} is not installed"))


EVERY = [form(ending) for ending in FORMS]
FURTHER = [form(ending) for ending in FORMS if FORMS[ending].package]


CHUNKS = PAIR.replace(
    samples=500, axes={"sigma": [0.01 * k for k in range(3)], "omega": [1.1 + 0.03 * k for k in range(15)]}
)
"""A trajectory of 90 000 numbers, three chunks of which the last is not full."""


@pytest.fixture(autouse=True, scope="module")
def _kernel() -> None:
    warm()


def digest(path: Path) -> str:
    """What a file says of its contents, which fit it."""
    with opened(path) as data:
        return str(data.attrs[DIGEST])


def ctrl_c(progress: Any) -> None:
    """Press Ctrl-C once some blocks are done."""
    if 20 <= progress.done < progress.total:
        raise KeyboardInterrupt


@pytest.mark.parametrize("ending", EVERY)
@pytest.mark.parametrize(
    "scene",
    [pytest.param(MAP, marks=pytest.mark.long), UP, pytest.param(PAIR, marks=pytest.mark.long), CHUNKS],
    ids=["map", "up", "one cell", "chunks"],
)
def test_a_file_that_is_filled_holds_what_one_that_is_saved_holds(scene: Scene, ending: str, tmp_path: Path) -> None:
    full = run(scene, workers=1, show_progress=False)
    full.save(tmp_path / f"saved{ending}")
    done = stream(scene, tmp_path / f"a{ending}", workers=2, show_progress=False)
    assert done.success
    assert done.data.identical(full.data)
    assert digest(tmp_path / f"a{ending}") == digest(tmp_path / f"saved{ending}")
    if ending == ".zarr":
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # xarray's of metadata in many files
            assert xr.open_zarr(tmp_path / "a.zarr").attrs == xr.open_zarr(tmp_path / "saved.zarr").attrs
    assert sorted(part.name for part in tmp_path.iterdir()) == [f"a{ending}", f"saved{ending}"]


@pytest.mark.parametrize("ending", FURTHER)
@pytest.mark.parametrize("scene", [MAP, pytest.param(UP, marks=pytest.mark.long)], ids=["map", "up"])
def test_an_interrupted_run_says_what_is_finished_and_goes_on(scene: Scene, ending: str, tmp_path: Path) -> None:
    path, seen = tmp_path / f"a{ending}", []
    with pytest.raises(SweepInterrupted) as caught:
        stream(scene, path, workers=2, show_progress=False, progress=ctrl_c)
    assert [part.name for part in tmp_path.iterdir()] == ["a.partial"]
    part = open_result(partial(path))
    assert int((part.status == Status.FINISHED).sum()) == caught.value.finished >= 20
    with pytest.raises(FileExistsError, match="continue it with resume"):
        stream(scene, path, show_progress=False)
    stream(scene, path, resume=True, workers=1, show_progress=False, progress=seen.append)
    assert seen[0].kept == caught.value.finished
    assert open_result(path).data.identical(run(scene, workers=1, show_progress=False).data)
    assert [part.name for part in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("ending", FURTHER)
def test_a_finished_file_is_returned_and_another_is_refused(ending: str, tmp_path: Path, monkeypatch: Any) -> None:
    path, scene = tmp_path / f"a{ending}", PAIR.replace(axes={"sigma": [0.1, 0.5]})
    done = stream(scene, path, certified=True, width=8, show_progress=False)
    before = contents(path)
    with monkeypatch.context() as patch:
        patch.delattr("synchain.runtime.sweeps.stream.prepare")
        again = stream(scene, path, certified=True, resume=True, show_progress=False)
        assert (again.verdicts, again.progress.statuses) == (done.verdicts, done.progress.statuses)
        for other, options, message in (
            (scene.replace(omega=1.4), {"certified": True}, "belongs to another scene"),
            (scene, {}, "was run with a certificate"),
        ):
            with pytest.raises(ValueError, match=message) as caught:
                stream(other, path, resume=True, show_progress=False, **options)
            assert "\n" not in str(caught.value)
    assert contents(path) == before
    stream(scene, path, overwrite=True, width=8, show_progress=False)
    assert "verdict" not in open_result(path).data
    assert [part.name for part in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("ending", FURTHER)
def test_a_kill_while_the_result_is_written_loses_nothing(ending: str, tmp_path: Path) -> None:
    """Neither the cells, which the next run finds finished, nor the file that was there before."""
    path = tmp_path / f"a{ending}"
    stream(PAIR, path, width=8, show_progress=False)
    before = contents(path)
    process = forking().Process(target=die_at_the_copy, args=(MAP, path))
    process.start()
    process.join(120)
    assert process.exitcode == -signal.SIGKILL
    assert contents(path) == before
    assert len(list(tmp_path.iterdir())) > 2  # what it was writing
    assert open_result(partial(path)).success
    seen: list[Any] = []
    stream(MAP, path, resume=True, show_progress=False, progress=seen.append)
    assert seen[0].kept == MAP.cells
    assert open_result(path).data.identical(run(MAP, workers=1, show_progress=False).data)
    assert [part.name for part in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("ending", FURTHER)
def test_kills_between_blocks(ending: str, tmp_path: Path) -> None:
    resumed, done = kill_again_and_again(MAP, tmp_path, 3, seed=2, ending=ending)
    assert resumed + done > 0


@pytest.mark.parametrize("name", [".a-1x2y.nc", ".a-1x2y.partial"])
def test_what_a_killed_writer_left_is_deleted(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"half of it")
    stream(MAP, tmp_path / "a.nc", show_progress=False)
    assert [part.name for part in tmp_path.iterdir()] == ["a.nc"]


@pytest.mark.parametrize("ending", FURTHER)
def test_a_disk_that_is_full_when_the_result_is_written(ending: str, tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / f"a{ending}"

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(store, "copy_in_pieces", full)
        with pytest.raises(SweepFailed, match=rf"cannot write .*a\{ending}: No space left on device; 400 of 400 cells"):
            stream(MAP, path, show_progress=False)
    assert [part.name for part in tmp_path.iterdir()] == ["a.partial"]


@pytest.mark.parametrize("ending", EVERY)
def test_memory_does_not_grow_with_the_file(ending: str, tmp_path: Path) -> None:
    """A trajectory of 12 MB takes as much as one of 8 MB, to be written and to be found finished."""
    peaks = []
    for cells in (20, 1030, 1500):  # the first one imports and compiles, unwatched; blocks have 128 cells from 1024 on
        axes = {"sigma": [5e-5 * k for k in range(cells)]}
        scene = PAIR.replace(samples=250, window=0.5, transient=0, axes=axes)
        path = tmp_path / f"a{cells}{ending}"
        if cells > 20:
            tracemalloc.start()
        result = stream(scene, path, width=8, workers=1, show_progress=False)
        if cells > 20:
            result = stream(scene, path, width=8, workers=1, resume=True, show_progress=False)
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        assert result.data.trajectory.nbytes == 8000 * cells
    assert peaks[1] < peaks[0] + 1e6


@pytest.mark.parametrize("ending", FURTHER)
def test_an_unfinished_run_can_take_another_form(ending: str, tmp_path: Path) -> None:
    with pytest.raises(SweepInterrupted):
        stream(MAP, tmp_path / "a.nc", show_progress=False, progress=ctrl_c)
    stream(MAP, tmp_path / f"a{ending}", resume=True, show_progress=False)
    assert open_result(tmp_path / f"a{ending}").data.identical(run(MAP, workers=1, show_progress=False).data)


@pytest.mark.parametrize("ending", FURTHER)
def test_what_is_no_result_is_refused_before_anything_runs(ending: str, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.delattr("synchain.runtime.sweeps.stream.prepare")
    message = "is no Zarr folder" if ending == ".zarr" else "is a pipe or device"
    os.mkfifo(tmp_path / f"a{ending}")
    for options in ({}, {"resume": True}, {"overwrite": True}):
        with pytest.raises(OSError, match=message):
            stream(PAIR, tmp_path / f"a{ending}", show_progress=False, **options)
    with pytest.raises(OSError, match=r"is a pipe or device|the file is damaged"):
        open_result(tmp_path / f"a{ending}")
    (tmp_path / f"b{ending}").mkdir()
    with pytest.raises(OSError, match=r"is no Zarr folder|is a folder; expected a file"):
        stream(PAIR, tmp_path / f"b{ending}", overwrite=True, show_progress=False)
    assert sorted(part.name for part in tmp_path.iterdir()) == [f"a{ending}", f"b{ending}"]


@pytest.mark.parametrize(
    "shape", [(), (0,), (5,), (70_000,), (3, 40_000), (200, 300, 2), (7, 2, 5, 3), (3, 0, 2)], ids=str
)
def test_pieces_cover_an_array_once_and_in_order(shape: tuple[int, ...]) -> None:
    values = np.arange(np.prod(shape, dtype=int)).reshape(shape)
    parts = [values[piece].reshape(-1) for piece in pieces(shape)]
    np.testing.assert_array_equal(np.concatenate([*parts, np.zeros(0, int)]), values.reshape(-1))
    assert max(map(len, parts), default=0) <= 2**15
    assert len(chunk(shape)) == len(shape)


@pytest.mark.parametrize("ending", EVERY)
def test_the_command_writes_every_form_and_its_figure(ending: str, tmp_path: Path, capsys: Any) -> None:
    PAIR.save(tmp_path / "pair.toml")
    command = ["run", str(tmp_path / "pair.toml"), "--out", str(tmp_path), "--format", ending[1:]]
    command += ["--set", "sigma=0.1,0.2", "transient=1", "window=2"]
    assert main(command) == 0
    assert main(command) == 0
    assert "nothing was run (--overwrite runs it again)" in capsys.readouterr().out
    assert sorted(part.name for part in tmp_path.iterdir()) == sorted([f"pair{ending}", "pair.png", "pair.toml"])
    assert open_result(tmp_path / f"pair{ending}").success


def test_the_command_knows_the_forms() -> None:
    assert tuple(f".{ending}" for ending in FORMATS) == tuple(FORMS)


@pytest.mark.parametrize("ending", [ending for ending in FORMS if FORMS[ending].package])
def test_the_command_names_the_extra_of_an_absent_package(
    ending: str, tmp_path: Path, monkeypatch: Any, capsys: Any
) -> None:
    monkeypatch.setitem(sys.modules, str(FORMS[ending].package), None)
    assert main(["run", "two_oscillators", "--out", str(tmp_path), "--format", ending[1:]]) == 1
    assert capsys.readouterr().err.count('python -m pip install "synchain[files]"') == 1
    assert list(tmp_path.iterdir()) == []
