"""Sweeps on disk: whatever stops them costs the blocks in flight, and the file is that of a run that nothing stopped."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import Executor, Future
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from streams import MAP, PAIR, UP, kill_again_and_again, partial, warm
from test_skip import MIRRORED

from synchain import Scene, open_result, run, stream
from synchain.plugins import allow_code
from synchain.results import Status, SweepFailed, SweepInterrupted
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.commands.run import stopped_by_signals
from synchain.runtime.plots.result_plot import draw_result
from synchain.runtime.results.block_log import HEAD, BlockLog
from synchain.runtime.support.netcdf import Sheet

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of Unix")


@pytest.fixture(autouse=True, scope="module")
def _kernel():
    warm()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Bytes of the finished file of each scene."""
    folder = tmp_path_factory.mktemp("whole")
    collected = {}
    for name, scene in (("map", MAP), ("up", UP)):
        run(scene, workers=1, show_progress=False).save(folder / f"{name}.nc")
        collected[scene] = (folder / f"{name}.nc").read_bytes()
    return collected


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt even where the test run was started with that signal ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt_at(cells: int):
    """A hook that presses Ctrl-C once when so many cells are done."""
    pressed = []

    def press(progress):
        if progress.done >= cells and not pressed:
            pressed.append(progress)
            os.kill(os.getpid(), signal.SIGINT)

    return press


# -- the file ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("workers", [1, 3])
@pytest.mark.parametrize("scene", [MAP, UP], ids=["map", "up"])
def test_the_file_is_that_of_a_run_in_memory(scene, workers, files, tmp_path):
    done = stream(scene, tmp_path / "a.nc", workers=workers, show_progress=False)
    assert (tmp_path / "a.nc").read_bytes() == files[scene]
    assert done.success
    assert done.progress.statuses == {Status.FINISHED: scene.cells}
    assert [p.name for p in tmp_path.iterdir()] == ["a.nc"]


@pytest.mark.parametrize(
    "axes", [{}, {"sigma": [0.05, 0.1, 0.2, 0.4]}, {"sigma": [0.05, 0.1], "x_1": [0.1, 0.2], "zipped": True}], ids=str
)
def test_every_shape_of_a_sweep_streams_as_it_saves(axes, tmp_path):
    zipped = {"zipped": axes.pop("zipped")} if "zipped" in axes else {}
    scene = PAIR.replace(axes=axes, title="Größe σ", **zipped)
    run(scene, width=8, show_progress=False).save(tmp_path / "a.nc")
    stream(scene, tmp_path / "b.nc", width=8, show_progress=False)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


@pytest.mark.long
def test_a_merged_network_streams_as_it_saves(tmp_path):
    """Oscillators that are stepped as one are kept as one and come back as all of them."""
    scene = MIRRORED.replace(axes={"sigma": [0.1, 0.2]})
    assert reduce_scene(scene).dimension < len(scene.y0)
    run(scene, width=1, show_progress=False).save(tmp_path / "a.nc")
    stream(scene, tmp_path / "b.nc", width=1, show_progress=False)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_a_large_variable_is_laid_out_past_four_gigabytes(tmp_path):
    """Only the header and one row are written: the file is as large as its holes."""
    import xarray as xr

    template = xr.Dataset({"a": (("x", "y"), np.zeros((1, 3))), "b": ("x", np.zeros(1))})
    with open(tmp_path / "large.nc", "wb") as file:
        sheet = Sheet(file, template, {"x": 250_000_000})
        sheet.put("a", np.array([249_999_999]), np.array([[1.0, 2.0, 3.0]]))
        sheet.put("b", np.array([7]), np.array([5.0]))
    with xr.open_dataset(tmp_path / "large.nc", engine="scipy") as data:
        assert data.a[-1].values.tolist() == [1.0, 2.0, 3.0]
        assert float(data.b[7]) == 5.0


# -- the store -----------------------------------------------------------------------------------------------


def block(cells: int, value: float) -> Buffers:
    buffers = Buffers.empty(cells, 2, 3, 1)
    buffers.end[:], buffers.sums[:], buffers.samples[:] = value, value, value
    buffers.counts[:, 0], buffers.counts[:, 3] = 1, np.arange(cells) % 4
    buffers.points[np.arange(3) < buffers.counts[:, 3:4]] = value
    return buffers


ABOUT = {"blocks": 4, "dimension": 2, "samples": 1, "observed": 0, "kept": 2}


@pytest.fixture
def store(tmp_path):
    path = tmp_path / "x.partial"
    BlockLog.create(path, ABOUT)
    log = BlockLog.open(path, writing=True)
    for number in range(3):
        log.append(number, block(5, number + 0.5))
    log.close()
    return path


def test_blocks_come_back_as_they_went(store):
    log = BlockLog.open(store)
    assert log.done.tolist() == [True, True, True, False]
    assert (log.counts[1], log.most) == (15, 3)
    for number in range(3):
        for a, b in zip(log.read(number).arrays(), block(5, number + 0.5).arrays(), strict=True):
            np.testing.assert_array_equal(a, b)


def test_a_torn_end_loses_the_last_block_wherever_it_is_torn(store):
    contents = store.read_bytes()
    size = (len(contents) - store.read_bytes().index(b"blk\0")) // 3
    for missing in (1, 7, size - 20, size - 1):
        store.write_bytes(contents[:-missing])
        log = BlockLog.open(store, writing=True)
        assert log.done.tolist() == [True, True, False, False]
        log.append(2, block(5, 2.5))
        log.close()
        assert store.read_bytes() == contents


def test_a_damaged_block_is_none(store):
    contents = bytearray(store.read_bytes())
    contents[contents.index(b"blk\0") + 400] ^= 1
    store.write_bytes(contents)
    log = BlockLog.open(store, writing=True)
    assert log.done.tolist() == [False, True, True, False]
    assert log.counts[1] == 10
    log.append(0, block(5, 0.5))
    log.close()
    assert BlockLog.open(store).done.tolist() == [True, True, True, False]


def test_each_copy_of_the_first_line_stands_in_for_the_other(store):
    contents = store.read_bytes()
    for offset in (0, 4096):
        for damage in (lambda old: b"\0" * len(old), lambda old: bytes([old[0] ^ 1]) + old[1:]):
            for begin in (offset, offset + 17, offset + 40):
                store.write_bytes(contents[:begin] + damage(contents[begin : begin + 20]) + contents[begin + 20 :])
                assert open_result_or_refusal(store) != "no store"
                assert BlockLog.open(store).done.tolist() == [True, True, True, False]
                assert BlockLog.describe(store) == ABOUT


def open_result_or_refusal(path: Path) -> str:
    """What `open_result` says of a store that no scene belongs to."""
    try:
        open_result(path)
    except OSError:
        return "no store"
    except ValueError as refusal:
        return str(refusal)
    return ""


def test_a_damaged_first_line_is_an_error_that_says_so(store):
    contents = bytearray(store.read_bytes())
    for offset in (40, 4096 + 40):
        contents[offset] ^= 1
    for content, message in (
        (bytes(contents), "both copies of its first line are damaged"),
        (b"something else", "no unfinished run"),
        (b"", "is empty"),
        (b"synchain blocks 1\n" + bytes(200), "another version"),
    ):
        store.write_bytes(content)
        with pytest.raises(ValueError, match=message) as caught:
            BlockLog.open(store)
        assert "(--overwrite)" in str(caught.value)


def test_a_bit_in_the_head_of_a_record_costs_that_record_alone(store):
    contents = store.read_bytes()
    first = contents.index(b"blk\0")
    for bit in range(8 * HEAD.size):
        damaged = bytearray(contents)
        damaged[first + bit // 8] ^= 1 << bit % 8
        store.write_bytes(damaged)
        log = BlockLog.open(store, writing=True)
        assert log.done.tolist() == [False, True, True, False], bit
        log.close()
        assert store.read_bytes() == damaged


def test_a_page_of_zeros_costs_the_records_that_lie_on_it(tmp_path):
    path = tmp_path / "x.partial"
    BlockLog.create(path, {**ABOUT, "blocks": 60})
    made = BlockLog.open(path, writing=True)
    for number in range(60):
        made.append(number, block(5, number + 0.5))
    places = made.places.copy()
    made.close()
    contents = path.read_bytes()
    ends = np.append(places[1:], len(contents))
    for page in range(0, len(contents), 4096):
        path.write_bytes(contents[:page] + bytes(len(contents[page : page + 4096])) + contents[page + 4096 :])
        log = BlockLog.open(path, writing=True)
        np.testing.assert_array_equal(log.done, (ends <= page) | (places >= page + 4096))
        for lost in np.flatnonzero(~log.done):
            log.append(int(lost), block(5, lost + 0.5))
        log.close()
        again = BlockLog.open(path)
        assert again.done.all()
        assert again.counts[1] == 300
        for number in range(60):
            np.testing.assert_array_equal(again.read(number).end, block(5, number + 0.5).end)


def test_two_processes_do_not_write_to_one_store(store):
    code = f"from synchain.runtime.results.block_log import BlockLog\nBlockLog.open({str(store)!r}, writing=True)"
    held = BlockLog.open(store, writing=True)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    held.close()
    assert "is being written by another run" in done.stderr


def test_a_second_writer_is_told_of_the_first(tmp_path):
    path = tmp_path / "a.nc"
    BlockLog.create(partial(path), ABOUT)
    held = BlockLog.open(partial(path), writing=True)
    code = "import sys\nfrom streams import MAP\nfrom synchain.runtime.sweeps.stream import stream\n"
    here = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    for more in ("", "resume=True", "overwrite=True"):
        command = [sys.executable, "-c", f"{code}stream(MAP, sys.argv[1], {more})", str(path)]
        done = subprocess.run(command, env=here, capture_output=True, text=True, timeout=120)
        last = done.stderr.splitlines()[-1]
        assert "is being written by another run; wait for it" in last
        assert "overwrite" not in last
    held.close()


# -- what stops a sweep --------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [MAP, UP], ids=["map", "up"])
def test_ctrl_c_keeps_blocks_and_resume_goes_on(scene, files, tmp_path, interruptible):
    path = tmp_path / "a.nc"
    with pytest.raises(SweepInterrupted) as caught:
        stream(scene, path, workers=2, show_progress=False, progress=interrupt_at(20))
    assert 20 <= caught.value.finished < scene.cells
    part = open_result(partial(path))
    assert int((part.status == Status.FINISHED).sum()) == caught.value.finished
    assert np.isnan(part.sync_error.values[part.status.values == Status.NOT_RUN]).all()
    assert draw_result(part) is not None
    seen = []
    stream(scene, path, resume=True, workers=1, show_progress=False, progress=seen.append)
    assert seen[0].kept == seen[0].done == caught.value.finished
    assert path.read_bytes() == files[scene]
    assert not partial(path).exists()


def test_ctrl_c_in_a_continued_sweep_in_memory_goes_on_where_it_was(files, tmp_path, interruptible):
    with pytest.raises(SweepInterrupted) as caught:
        run(UP, workers=2, show_progress=False, progress=interrupt_at(20))
    seen = []
    run(UP, resume=caught.value.result, show_progress=False, progress=seen.append).save(tmp_path / "a.nc")
    assert 0 < seen[0].kept < UP.cells
    assert (tmp_path / "a.nc").read_bytes() == files[UP]


FULL = """
import errno, resource, sys
from streams import MAP, partial
from pathlib import Path
from synchain.runtime.sweeps.errors import SweepFailed
from synchain.runtime.sweeps.stream import stream
path = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
try:
    stream(MAP, path, workers=1, show_progress=False)
except SweepFailed as problem:
    good = problem.__cause__.errno == errno.EFBIG and 0 < problem.finished < MAP.cells
    sys.exit(7 if good and str(partial(path)) in str(problem) else 1)
"""


def test_a_disk_that_fills_up(files, tmp_path):
    """A limit on the size of files in a process of its own stands for the disk."""
    path, here = tmp_path / "a.nc", {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run([sys.executable, "-c", FULL, str(path)], env=here, capture_output=True, text=True)
    assert done.returncode == 7, done.stderr
    assert 0 < int((open_result(partial(path)).status == Status.FINISHED).sum()) < MAP.cells
    stream(MAP, path, resume=True, show_progress=False)
    assert path.read_bytes() == files[MAP]


FULL_AT_ONCE = """
import resource, sys
from streams import MAP, PAIR
from synchain import run
from synchain.runtime.sweeps.errors import SweepFailed
from synchain.runtime.sweeps.stream import stream
result = run(PAIR, show_progress=False)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
for call in (lambda: result.save(sys.argv[1]), lambda: stream(MAP, sys.argv[1], workers=1, show_progress=False)):
    try:
        call()
    except (OSError, SweepFailed) as problem:
        print(type(problem).__name__, problem)
"""


def test_a_disk_that_is_full_at_once(tmp_path):
    path, here = tmp_path / "a.nc", {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run([sys.executable, "-c", FULL_AT_ONCE, str(path)], env=here, capture_output=True, text=True)
    saved, streamed = done.stdout.splitlines()
    assert saved.startswith("OSError")
    assert "cannot write: File too large; free space there, or choose another path" in saved
    assert streamed == f"SweepFailed cannot write {partial(path)}: File too large; 0 of {MAP.cells} cells had finished"
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_is_full_when_the_result_is_written(files, tmp_path, monkeypatch):
    path = tmp_path / "a.nc"

    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Sheet, "put", full)
        with pytest.raises(SweepFailed, match=r"cannot write .*a\.nc: No space left on device; 400 of 400 cells"):
            stream(MAP, path, show_progress=False)
    assert [p.name for p in tmp_path.iterdir()] == ["a.partial"]
    stream(MAP, path, resume=True, show_progress=False)
    assert path.read_bytes() == files[MAP]


class Stuck(Executor):
    """Starts everything and finishes nothing."""

    def submit(self, function, /, *arguments, **more):
        future: Future = Future()
        future.set_running_or_notify_cancel()
        return future


@pytest.mark.long
def test_a_second_ctrl_c_leaves_blocks_that_do_not_end(tmp_path, interruptible):
    def press():
        for _ in range(2):
            time.sleep(0.7)
            os.kill(os.getpid(), signal.SIGINT)

    presses = threading.Thread(target=press)
    presses.start()
    with pytest.raises(SweepInterrupted) as caught:
        stream(MAP, tmp_path / "a.nc", executor=Stuck(), workers=1, show_progress=False)
    presses.join()
    assert caught.value.finished == 0


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
"""It has the records of MAP, whose kernel is there."""


@pytest.mark.parametrize("sign", [signal.SIGTERM, signal.SIGHUP])
def test_signals_stop_like_ctrl_c_unless_they_are_ignored(sign):
    before = signal.getsignal(sign)
    try:
        for handler, error in ((lambda *_: None, pytest.raises(KeyboardInterrupt)), (signal.SIG_IGN, nullcontext())):
            signal.signal(sign, handler)
            with error, stopped_by_signals():
                signal.raise_signal(sign)
            assert signal.getsignal(sign) is handler
    finally:
        signal.signal(sign, before)


@pytest.mark.parametrize(
    "sign",
    [
        signal.SIGTERM,
        *(pytest.param(sign, marks=pytest.mark.long) for sign in (signal.SIGINT, signal.SIGHUP, signal.SIGKILL)),
    ],
    ids=lambda sign: sign.name,
)
def test_the_real_program_is_stopped_and_goes_on(sign, tmp_path):
    scene = tmp_path / "slow.toml"
    scene.write_text(SLOW)
    command = [sys.executable, "-m", "synchain.runtime", "run", str(scene), "--out", str(tmp_path), "--workers", "1"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=restore_interrupt)
    store = tmp_path / "slow.partial"
    give_up = time.monotonic() + 120
    while process.poll() is None and not (store.exists() and BlockLog.open(store).done.sum() >= 2):
        assert time.monotonic() < give_up
        time.sleep(0.05)
    process.send_signal(sign)
    _, err = process.communicate(timeout=60)
    stored = int(BlockLog.open(store).counts.sum())
    if sign == signal.SIGKILL:
        assert process.returncode == -9
    else:
        assert process.returncode == 1
        assert f"interrupted with {stored} of 300 cells finished, kept in {store}\ncontinue with: synchain run" in err
        assert len([line for line in err.splitlines() if ": compiling " not in line]) == 2
    from synchain.models.scenes.file import load_scene

    done = stream(load_scene(str(scene)), tmp_path / "slow.nc", resume=True, show_progress=False)
    assert done.progress.kept == stored > 0


def test_ctrl_c_pressed_again_and_again_ends_the_program_with_its_words(tmp_path):
    scene = tmp_path / "slow.toml"
    scene.write_text(SLOW)
    command = [sys.executable, "-m", "synchain.runtime", "run", str(scene), "--out", str(tmp_path), "--workers", "1"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=restore_interrupt)
    give_up = time.monotonic() + 120
    while process.poll() is None and not (tmp_path / "slow.partial").exists():
        assert time.monotonic() < give_up
        time.sleep(0.05)
    while process.poll() is None:
        process.send_signal(signal.SIGINT)
        time.sleep(0.003)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1, err
    assert "synchain run: interrupted" in err
    assert "Traceback" not in err


def restore_interrupt() -> None:
    """A shell may have started the tests with Ctrl-C ignored, nohup with SIGHUP ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.mark.long
def test_five_kills(tmp_path):
    resumed, _ = kill_again_and_again(MAP, tmp_path, 5, seed=1)
    assert resumed > 0


# -- files that are there already ----------------------------------------------------------------------------


def test_nothing_is_overwritten_silently(tmp_path):
    path = tmp_path / "a.nc"
    small = PAIR.replace(axes={"sigma": [0.05, 0.1]})
    stream(small, path, width=8, show_progress=False)
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match="holds the result of this scene already"):
        stream(small, path, width=8, show_progress=False)
    other = small.replace(omega=1.4)
    for options in ({}, {"resume": True}):
        with pytest.raises(ValueError, match="belongs to another scene"):
            stream(other, path, width=8, show_progress=False, **options)
    with pytest.raises(ValueError, match="was run without a certificate"):
        stream(small, path, certified=True, show_progress=False)
    assert path.read_bytes() == before
    stream(other, path, overwrite=True, width=8, show_progress=False)
    assert open_result(path).scene == other
    with pytest.raises(ValueError, match="both resume and overwrite"):
        stream(other, path, overwrite=True, resume=True)
    with pytest.raises(FileNotFoundError, match="nothing to resume"):
        stream(other, tmp_path / "b.nc", resume=True)


def test_a_finished_run_is_resumed_by_its_result(tmp_path, monkeypatch):
    path, seen = tmp_path / "a.nc", []
    small = PAIR.replace(axes={"sigma": [0.1, 0.5]})
    done = stream(small, path, certified=True, width=8, show_progress=False)
    before = path.stat()
    monkeypatch.delattr("synchain.runtime.sweeps.stream.prepare")
    again = stream(small, path, certified=True, resume=True, show_progress=False, progress=seen.append)
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert (again.verdicts, again.success, again.path) == (done.verdicts, done.success, done.path)
    assert again.progress.statuses == done.progress.statuses
    assert (again.progress.kept, again.progress.done, again.progress.total) == (2, 2, 2)
    assert again.data.identical(done.data)
    assert len(seen) == 1
    for other, message in ((PAIR, "belongs to another scene"), (small, "was run with a certificate")):
        with pytest.raises(ValueError, match=message):
            stream(other, path, resume=True, show_progress=False)


def test_an_unfinished_run_is_not_begun_again_silently(tmp_path, interruptible):
    path = tmp_path / "a.nc"
    with pytest.raises(SweepInterrupted):
        stream(MAP, path, show_progress=False, progress=interrupt_at(1))
    contents = partial(path).read_bytes()
    with pytest.raises(FileExistsError, match="continue it with resume"):
        stream(MAP, path, show_progress=False)
    with pytest.raises(ValueError, match="belongs to another scene"):
        stream(MAP.replace(rtol=1e-6), path, resume=True, show_progress=False)
    assert partial(path).read_bytes() == contents


def test_other_versions_do_not_go_on_with_a_run(tmp_path, monkeypatch, interruptible):
    path = tmp_path / "a.nc"
    with pytest.raises(SweepInterrupted):
        stream(MAP, path, show_progress=False, progress=interrupt_at(1))
    monkeypatch.setattr("synchain.runtime.engines.job.versions", lambda: "synchain 0.0.1, numba 0.0.1")
    with pytest.raises(ValueError, match=r"was begun with synchain .*; found synchain 0\.0\.1, numba"):
        stream(MAP, path, resume=True, show_progress=False)


FALLING = """from synchain import Field
OSCILLATOR = Field({"x": "-rate*x"}, parameters={"rate": 1.0})
"""


@pytest.fixture
def own(tmp_path) -> Path:
    path = tmp_path / "falling.py"
    path.write_text(FALLING)
    allow_code(path)
    return path


def falling(path: Path) -> Scene:
    axes = {"rate": [0.01 * k for k in range(400)]}
    return Scene(oscillator=str(path), axes=axes, transient=0, window=2, record=())


def test_a_result_says_that_its_model_has_changed(own, tmp_path):
    path, before = tmp_path / "a.nc", falling(own)
    stream(before, path, show_progress=False)
    result = run(before, show_progress=False)
    own.write_text("# another comment\n" + FALLING)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert open_result(path).data.end.identical(result.data.end)
        with pytest.raises(FileExistsError, match="holds the result of this scene already"):
            stream(falling(own), path, show_progress=False)
    own.write_text(FALLING.replace("-rate*x", "-rate*x**3"))
    with pytest.warns(UserWarning, match=r"a\.nc: the code of its model has changed since it was written"):
        opened = open_result(path)
    assert opened.data.end.identical(result.data.end)
    for options in ({}, {"resume": True}):
        with pytest.raises(ValueError, match=r"a\.nc comes of another model: the code of its scene has changed since"):
            stream(falling(own), path, show_progress=False, **options)
    with pytest.raises(ValueError, match="the result to resume comes of another model: its code has changed since"):
        run(falling(own), resume=result, show_progress=False)
    with pytest.raises(FileExistsError, match="holds the result of this scene already"):
        stream(before, path, show_progress=False)
    own.write_text(FALLING.replace("rate", "pace"))
    with pytest.raises(ValueError, match=r"its scene cannot be made with the models as they are now: .*'rate'"):
        open_result(path)


def test_an_unfinished_run_of_an_edited_model_does_not_go_on(own, tmp_path, interruptible):
    path = tmp_path / "a.nc"
    with pytest.raises(SweepInterrupted):
        stream(falling(own), path, show_progress=False, workers=1, progress=interrupt_at(1))
    contents = partial(path).read_bytes()
    own.write_text(FALLING.replace("-rate*x", "-rate*x**3"))
    with pytest.warns(UserWarning, match="the code of its model has changed"):
        open_result(partial(path))
    with pytest.raises(ValueError, match=r"a\.partial comes of another model: the code"):
        stream(falling(own), path, resume=True, show_progress=False)
    assert partial(path).read_bytes() == contents


def test_a_file_that_is_edited_during_a_run_leaves_the_run_as_it_is(own, tmp_path):
    scene = falling(own)
    stream(scene, tmp_path / "a.nc", show_progress=False)

    def edit(_) -> None:
        own.write_text(FALLING.replace('"x": "-rate*x"', '"y": "-rate*y"'))

    stream(scene, tmp_path / "b.nc", show_progress=False, progress=edit)
    assert Path(tmp_path, "b.nc").read_bytes() == Path(tmp_path, "a.nc").read_bytes()


def test_another_kind_of_processor_does_not_go_on_with_a_run(tmp_path, interruptible):
    path = tmp_path / "a.nc"
    with pytest.raises(SweepInterrupted):
        stream(MAP, path, show_progress=False, progress=interrupt_at(1))
    header = BlockLog.describe(partial(path))
    name, _, features = header["attributes"]["processor"].partition(": ")
    assert features
    kinds = {
        f"abacus: {features}": "processor abacus; found ",
        f"{name}: {features} beads": f"{name} with beads; found ",
    }
    for forged, message in kinds.items():
        header["attributes"]["processor"] = forged
        BlockLog.create(partial(path), header)
        with pytest.raises(ValueError, match=message) as caught:
            stream(MAP, path, resume=True, show_progress=False)
        assert "go on there, or replace it with overwrite (--overwrite)" in str(caught.value)


# -- files that were damaged or forged -----------------------------------------------------------------------


def test_every_flipped_byte_of_a_result_is_noticed(tmp_path):
    small, path = PAIR.replace(axes={"sigma": [0.05, 0.1]}), tmp_path / "a.nc"
    stream(small, path, width=8, show_progress=False)
    assert open_result(path).success
    contents = path.read_bytes()
    for offset in [*range(0, 400), *range(400, len(contents), 37)]:
        damaged = bytearray(contents)
        damaged[offset] ^= 1 << offset % 8
        path.write_bytes(damaged)
        noticed = 0
        for look in (lambda: open_result(path), lambda: stream(small, path, width=8, show_progress=False)):
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                try:
                    look()
                except FileExistsError:
                    pass
                except (OSError, ValueError, RuntimeWarning):
                    noticed += 1
        assert noticed == 2, offset
        assert path.read_bytes() == damaged


def test_a_result_without_a_digest_is_read_with_a_warning(tmp_path):
    result = run(PAIR, show_progress=False)
    result.data.to_netcdf(tmp_path / "old.nc", engine="scipy", format="NETCDF3_64BIT")
    with pytest.warns(RuntimeWarning, match="has no digest, so damage of its numbers cannot be seen"):
        again = open_result(tmp_path / "old.nc")
    assert again.data.identical(result.data)
    again.save(tmp_path / "new.nc")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert open_result(tmp_path / "new.nc").data.identical(result.data)


FORGERIES = [
    {"scene": "[" * 100_000}, {"scene": "3"}, {"scene": '{"topology": 3}'}, {"scene": '{"axes": null}'},
    {"scene": 3}, {"title": 3}, {"equations": None}, {"versions": None}, {"scene": '{"oscillator": [1]}'},
    {"scene": '{"sweep": {"sigma": {"from": 0, "to": 1, "count": 900000000}}, "topology": {"name": "chain", "n": 2}}'},
]  # fmt: skip


@pytest.mark.parametrize("forged", FORGERIES, ids=lambda forged: str(forged)[:60])
def test_a_forged_scene_is_one_sentence(forged, tmp_path, interruptible):
    result = run(PAIR, show_progress=False)
    result.data.attrs = {k: v for k, v in {**result.data.attrs, **forged}.items() if v is not None}
    result.save(tmp_path / "a.nc")
    path = tmp_path / "b.nc"
    with pytest.raises(SweepInterrupted):
        stream(MAP, path, show_progress=False, progress=interrupt_at(1))
    header = BlockLog.describe(partial(path))
    header["attributes"] = {k: v for k, v in {**header["attributes"], **forged}.items() if v is not None}
    BlockLog.create(partial(path), header)
    looks = (
        lambda: open_result(tmp_path / "a.nc"),
        lambda: stream(PAIR, tmp_path / "a.nc", show_progress=False),
        lambda: open_result(partial(path)),
        lambda: stream(MAP, path, resume=True, show_progress=False),
    )
    for look in looks:
        with pytest.raises((OSError, ValueError)) as caught:
            look()
        assert not isinstance(caught.value, FileExistsError)
        assert str(tmp_path) in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "forged",
    [{"blocks": 10**12}, {"blocks": 10**8}, {"blocks": "x"}, {"blocks": -1}, {"size": 0}, {"size": None}, {"samples": 10**9},
     {"dimension": 1}, {"dimension": 10**9}, {"merged": [[0], [10**9]]}, {"merged": 3}, {"certificate": [1, 2]},
     {"attributes": []}, {"attributes": {}}, {"attributes": None}],
    ids=str,
)  # fmt: skip
def test_a_forged_store_is_one_sentence(forged, tmp_path, interruptible):
    path = tmp_path / "b.nc"
    with pytest.raises(SweepInterrupted):
        stream(MAP, path, show_progress=False, progress=interrupt_at(20))
    records = partial(path).read_bytes()[BlockLog.open(partial(path)).places.max() :]
    BlockLog.create(partial(path), {**BlockLog.describe(partial(path)), **forged})
    with open(partial(path), "ab") as file:
        file.write(records)
    with pytest.raises((OSError, ValueError)) as caught:
        open_result(partial(path))
    assert str(partial(path)) in str(caught.value)


def test_a_file_with_a_scene_alone_is_no_result(tmp_path):
    path = tmp_path / "a.nc"
    run(PAIR, show_progress=False).data[[]].to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")
    with pytest.warns(RuntimeWarning, match="no digest"), pytest.raises(ValueError, match="variables are not those"):
        open_result(path)


# -- names and places that cannot be used --------------------------------------------------------------------


@pytest.mark.parametrize("name", ["x.partial", "x.PARTIAL"])
def test_the_name_of_an_unfinished_run_is_no_name_of_a_result(name, tmp_path):
    with pytest.raises(ValueError, match=r"found '.*'; expected a name that ends in \.nc"):
        stream(PAIR, tmp_path / name, show_progress=False)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["a.nc", "a.partial"])
def test_pipes_and_devices_are_refused_at_once(name, tmp_path):
    os.mkfifo(tmp_path / name)
    looks = [lambda: open_result(tmp_path / name), lambda: open_result("/dev/zero")]
    looks += [
        lambda options=options: stream(PAIR, tmp_path / "a.nc", show_progress=False, **options)
        for options in ({}, {"resume": True}, {"overwrite": True})
    ]
    for look in looks:
        with pytest.raises(OSError, match=r"is a pipe or device; expected a file"):
            look()
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_result_is_not_saved_over_a_device(tmp_path):
    os.mkfifo(tmp_path / "a.nc")
    with pytest.raises(OSError, match="is a pipe or device"):
        run(PAIR, show_progress=False).save(tmp_path / "a.nc")


@pytest.mark.long
def test_the_command_says_that_there_is_nothing_to_do(tmp_path, capsys):
    from synchain.runtime.cli import main

    command = ["run", "two_oscillators", "--out", str(tmp_path), "--set", "sigma=0.1,0.2", "transient=1", "window=2"]
    assert main(command) == 0
    first = (tmp_path / "two_oscillators.nc").stat()
    capsys.readouterr()
    assert main(command) == 0
    assert "nothing was run (--overwrite runs it again)" in capsys.readouterr().out
    assert (tmp_path / "two_oscillators.nc").stat().st_mtime_ns == first.st_mtime_ns
    assert main([*command, "omega=1.3"]) == 2
    assert "belongs to another scene" in capsys.readouterr().err
    assert main([*command, "omega=1.3", "--overwrite"]) == 0
    assert Path(tmp_path, "two_oscillators.nc").stat().st_mtime_ns > first.st_mtime_ns
