"""Parts of a sweep, run by separate processes, merge into the file of one run; wrong parts are refused."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from streams import MAP, UP, warm

from synchain import load_scene, merge, open_result, stream
from synchain.results import Status
from synchain.runtime.cells.layout import Layout
from synchain.runtime.cli import main
from synchain.runtime.results.block_log import BlockLog

SLOW = """
transient = 200
window = 20
record = ["sync_error", "section", "trajectory"]
samples = 5
[topology]
name = "chain"
n = 2
[sweep]
sigma = { from = 0.0, to = 0.3, count = 300 }
"""
"""A scene with the records of MAP, whose kernel is compiled already."""


@pytest.fixture(autouse=True, scope="module")
def _kernel():
    warm()


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> list[Path]:
    """The three parts of MAP."""
    folder = tmp_path_factory.mktemp("parts")
    return [stream(MAP, folder / "map.nc", part=(k, 3), workers=k, show_progress=False).path for k in (1, 2, 3)]


def copied(parts: list[Path], folder: Path) -> list[Path]:
    return [Path(shutil.copy(path, folder)) for path in parts]


@pytest.mark.parametrize(
    "layout", [Layout(103, 8), Layout(120, 3, columns=12), Layout(120, 3, columns=12, falling=True)]
)
@pytest.mark.parametrize("parts", [1, 3, 50])
def test_parts_hold_each_block_once_and_chains_as_a_whole(layout, parts):
    masks = np.array([layout.part((k, parts)) for k in range(1, parts + 1)])
    assert masks.sum(axis=0).tolist() == [1] * layout.blocks
    assert layout.lengths.tolist() == [len(layout.rows(block)) for block in range(layout.blocks)]
    before = [(block, layout.before(block)) for block in range(layout.blocks)]
    assert all((masks[:, one] == masks[:, two]).all() for one, two in before if two is not None)


@pytest.mark.parametrize(("scene", "count"), [(MAP, 3), (UP, 2), (UP, 5)], ids=["map", "up", "more parts than rows"])
def test_merged_parts_are_the_file_of_one_run(scene, count, tmp_path):
    stream(scene, tmp_path / "whole.nc", workers=1, show_progress=False)
    done = [
        stream(scene, tmp_path / "a.nc", part=(k, count), workers=k, show_progress=False) for k in range(count, 0, -1)
    ]
    assert sum(part.progress.total for part in done) == scene.cells
    merged = merge([part.path for part in done], tmp_path / "a.nc")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()
    assert merged.success
    assert all(part.path.exists() for part in done)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:exponents")  # one start of four is on another motion
def test_certified_parts_merge_with_their_verdicts(tmp_path):
    whole = stream(MAP, tmp_path / "whole.nc", certified=True, show_progress=False)
    paths = [stream(MAP, tmp_path / "a.nc", certified=True, part=(k, 2), show_progress=False).path for k in (1, 2)]
    assert merge(paths, tmp_path / "a.nc").verdicts == whole.verdicts
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()


@pytest.mark.parametrize("ending", [".nc4", ".zarr"])
def test_parts_merge_into_every_form(ending, parts, tmp_path):
    pytest.importorskip("h5netcdf" if ending == ".nc4" else "zarr")
    merge(parts, tmp_path / f"a{ending}")
    stream(MAP, tmp_path / f"b{ending}", show_progress=False)
    one, other = (open_result(tmp_path / f"{name}{ending}") for name in "ab")
    assert one.data.identical(other.data)


def test_a_part_opens_alone_and_is_resumed(parts, tmp_path):
    (path, *_) = copied(parts, tmp_path)
    done = stream(MAP, tmp_path / "map.nc", part=(1, 3), resume=True, show_progress=False)
    assert done.path == path
    assert done.progress.kept == done.progress.total < MAP.cells
    assert "part 1 of 3" in str(done)
    assert int((done.result.status != Status.NOT_RUN).sum()) == done.progress.total
    assert open_result(path).status.equals(done.result.status)
    with pytest.raises(FileExistsError, match="keeps this part"):
        stream(MAP, tmp_path / "map.nc", part=(1, 3), show_progress=False)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_jobs_that_are_killed_go_on_and_merge(tmp_path):
    """Three real jobs run at a time; one is killed, one gets the SIGTERM of a batch system."""
    scene = tmp_path / "slow.toml"
    scene.write_text(SLOW)
    program = [sys.executable, "-m", "synchain.runtime"]
    lines = [
        [*program, "run", str(scene), "--out", str(tmp_path), "--workers", "1", "--part", f"{k}/3", "--resume"]
        for k in (1, 2, 3)
    ]
    jobs = [subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for line in lines]
    logs = [tmp_path / f"slow.{k}of3.partial" for k in (1, 2, 3)]
    give_up = time.monotonic() + 120
    for job, log, sign in zip(jobs, logs, (signal.SIGKILL, signal.SIGTERM), strict=False):
        while job.poll() is None and not (log.exists() and BlockLog.open(log).done.any()):
            assert time.monotonic() < give_up
            time.sleep(0.02)
        os.kill(job.pid, sign)
    texts = [job.communicate(timeout=120) for job in jobs]
    assert [job.returncode for job in jobs] == [-9, 1, 0], texts
    assert f"kept in {logs[1]}\ncontinue with: synchain run" in texts[1][1]
    again = [*program, "merge", *map(str, logs), "--out", str(tmp_path / "slow.nc")]
    refused = subprocess.run(again, capture_output=True, text=True)
    assert refused.returncode == 2
    assert "blocks; continue it with run and resume (--resume)" in refused.stderr
    for line in lines[:2]:
        assert subprocess.run(line, capture_output=True).returncode == 0
    done = subprocess.run(again, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "300 cells: reached the end" in done.stdout
    assert (tmp_path / "slow.png").exists()
    stream(load_scene(str(scene)), tmp_path / "whole.nc", show_progress=False)
    assert (tmp_path / "slow.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()


# -- wrong parts ---------------------------------------------------------------------------------------------


def test_missing_and_repeated_parts_are_refused(parts, tmp_path):
    with pytest.raises(ValueError, match="found 2 of 3 parts; expected all; run those that are missing: 2"):
        merge([parts[0], parts[2]], tmp_path / "a.nc")
    with pytest.raises(ValueError, match="found part 1 of 3 twice"):
        merge([parts[0], *parts], tmp_path / "a.nc")
    with pytest.raises(ValueError, match="parts: found none"):
        merge([], tmp_path / "a.nc")
    assert list(tmp_path.iterdir()) == []


def test_parts_of_other_sweeps_are_refused(parts, tmp_path):
    other = stream(MAP.replace(rtol=1e-7), tmp_path / "a.nc", part=(2, 3), show_progress=False).path
    with pytest.raises(ValueError, match=r"is no part of the sweep of .*: its scene is another"):
        merge([parts[0], other, parts[2]], tmp_path / "b.nc")
    other = stream(MAP, tmp_path / "c.nc", part=(2, 4), show_progress=False).path
    with pytest.raises(ValueError, match="found a sweep in 4 parts; expected 3"):
        merge([parts[0], other, parts[2]], tmp_path / "b.nc")


@pytest.mark.parametrize("name", ["versions", "processor"])
def test_parts_of_other_machines_are_refused(name, parts, tmp_path):
    about = BlockLog.describe(parts[1])
    other = {**about, "attributes": {**about["attributes"], name: "another"}}
    BlockLog.create(tmp_path / "map.2of3.partial", other)
    with pytest.raises(ValueError, match=f"found {name} another; expected"):
        merge([parts[0], tmp_path / "map.2of3.partial", parts[2]], tmp_path / "b.nc")


def test_damaged_parts_and_other_files_are_refused(parts, tmp_path):
    mine = copied(parts, tmp_path)
    size = mine[1].stat().st_size
    os.truncate(mine[1], size - 100)
    with pytest.raises(ValueError, match=r"part 2 has .* of its .* blocks; continue it"):
        merge(mine, tmp_path / "a.nc")
    stream(MAP, tmp_path / "map.nc", part=(2, 3), resume=True, show_progress=False)
    assert merge(mine, tmp_path / "a.nc").success
    with pytest.raises(ValueError, match="is no unfinished run"):
        merge([mine[0], tmp_path / "a.nc"], tmp_path / "b.nc")
    with pytest.raises(FileExistsError, match="is there already"):
        merge(mine, tmp_path / "a.nc")
    assert merge(mine, tmp_path / "a.nc", overwrite=True).success
    BlockLog.create(tmp_path / "whole.partial", {**BlockLog.describe(mine[0]), "part": None})
    with pytest.raises(ValueError, match="holds a whole sweep"):
        merge([tmp_path / "whole.partial"], tmp_path / "b.nc")
    shutil.copy(mine[0], mine[1])  # a part under the name of another
    with pytest.raises(ValueError, match="does not hold what its name says"):
        stream(MAP, tmp_path / "map.nc", part=(2, 3), resume=True, show_progress=False)


@pytest.mark.parametrize("part", [(0, 3), (4, 3), (1, 2, 3), "1/3", (1.0, 3)], ids=str)
def test_numbers_that_are_no_part_are_refused(part, tmp_path):
    with pytest.raises((TypeError, ValueError), match="part"):
        stream(MAP, tmp_path / "a.nc", part=part)


@pytest.mark.parametrize("text", ["3", "0/3", "4/3", "1/0", "a/b", "1/3/5"])
def test_the_command_refuses_what_is_no_part(text, tmp_path, capsys):
    assert main(["run", "figure_4a", "--out", str(tmp_path), "--part", text]) == 2
    assert "--part" in capsys.readouterr().err
