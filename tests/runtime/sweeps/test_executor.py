"""Any executor: threads, processes, Dask, MPI give the bits of a run in this process; lost workers cost no block."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from streams import MAP, UP, partial, warm

from synchain import Scene, open_result, run, stream
from synchain.codegen.machine_code.installation import InstallationError
from synchain.graphs import cartesian, chain
from synchain.results import Result, SweepFailed
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.job import JobSpec, SweepSpec
from synchain.runtime.engines.scene_kernels import write_kernel
from synchain.runtime.sweeps.worker import JobCache, forget


@pytest.fixture(autouse=True, scope="module")
def _kernel():
    warm()


@pytest.fixture(scope="module")
def alone() -> dict[Scene, Result]:
    """What one thread of this process makes of each scene."""
    return {scene: run(scene, workers=1, show_progress=False) for scene in (MAP, UP)}


def spec(scene: Scene) -> JobSpec:
    reduction = reduce_scene(scene)
    return JobSpec.of(SweepSpec(reduction), write_kernel(reduction))


# -- specifications -------------------------------------------------------------------------------------------------


def test_a_specification_is_small_and_comes_back():
    for scene in (MAP, Scene(topology=cartesian(chain(2), chain(3)), contact="atan")):
        packed = spec(scene).packed()
        again = JobSpec.unpacked(packed)
        assert len(packed) < 20_000
        assert again.problem.reduction.scene == scene
        assert again.digest == spec(scene).digest


def test_a_worker_with_other_versions_or_another_kernel_refuses(monkeypatch):
    packed = spec(MAP).packed()
    with pytest.raises(RuntimeError, match="makes the kernel"):
        replace(spec(MAP), digest="0" * 64).rebuilt()
    monkeypatch.setattr("synchain.runtime.engines.job.versions", lambda: "synchain 0.0.1, numba 0.0.1")
    with pytest.raises(RuntimeError, match=r"this worker has synchain 0\.0\.1, .*; expected .*, synchain "):
        JobSpec.unpacked(packed)


class Elsewhere(Executor):
    """A worker with another installation."""

    def submit(self, function, /, *arguments, **more):
        future: Future = Future()
        future.set_exception(InstallationError("this worker has synchain 0.0.1; expected 1.0"))
        return future


def test_a_stream_on_a_worker_with_another_installation_fails_in_words(tmp_path):
    with pytest.raises(SweepFailed, match=r"^this worker has synchain 0\.0\.1; expected 1\.0; 0 of \d+ cells"):
        stream(MAP, tmp_path / "a.nc", executor=Elsewhere(), show_progress=False)


def test_a_worker_with_another_processor_says_so(monkeypatch):
    packed = spec(MAP).packed()
    monkeypatch.setattr("synchain.codegen.simd.lane_types.HOST_NAME", "abacus")
    with pytest.raises(
        InstallationError, match="this worker has the processor abacus; expected that of the main program"
    ):
        JobSpec.unpacked(packed)


def test_a_worker_that_does_not_know_the_sweep_asks_for_it():
    cells, jobs = np.arange(3), JobCache(size=1)
    assert jobs.run("first", None, cells) is None
    buffers = jobs.run("first", spec(MAP).packed(), cells)
    assert (buffers.counts[:, 0] == 1).all()
    again = jobs.run("first", None, cells)
    np.testing.assert_array_equal(buffers.end, again.end)
    assert jobs.run("second", spec(MAP).packed(), cells) is not None
    assert jobs.run("first", None, cells) is None
    jobs.forget("second")


class Foreign(Executor):
    """Runs at once, in this process, what it is given, and forgets the job again and again."""

    def __init__(self) -> None:
        self.asked: list[bool] = []

    def submit(self, function, /, key, packed, *block):
        self.asked.append(packed is not None)
        if len(self.asked) % 5 == 0:
            forget(key)
        future: Future = Future()
        future.set_result(function(key, packed, *block))
        return future


def test_workers_that_forget_are_told_again(alone):
    executor = Foreign()
    result = run(MAP, executor=executor, workers=2, show_progress=False)
    assert result.data.identical(alone[MAP].data)
    assert executor.asked[:4] == [True] * 4
    assert not all(executor.asked)


# -- executors -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [MAP, UP], ids=["map", "up"])
def test_threads_that_are_given(scene, alone):
    with ThreadPoolExecutor(3) as executor:
        assert run(scene, executor=executor, show_progress=False).data.identical(alone[scene].data)
        assert executor.submit(int, "7").result() == 7, "it is left open"


def test_spawned_processes_and_one_that_crashes(alone, tmp_path):
    """Both in one test: a process takes seconds to start."""
    path = tmp_path / "a.nc"
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        for scene in (MAP, UP):
            assert run(scene, executor=executor, show_progress=False).data.identical(alone[scene].data)

        def crash(progress):
            if progress.done >= 100:
                with suppress(ProcessLookupError):  # the hook may be called again after it has died
                    os.kill(next(iter(executor._processes)), signal.SIGKILL)

        with pytest.raises(SweepFailed, match="the workers are lost") as caught:
            stream(MAP, path, executor=executor, show_progress=False, progress=crash)
    assert "\n" not in str(caught.value)
    assert 100 <= caught.value.finished < MAP.cells
    assert int((open_result(partial(path)).status == 1).sum()) == caught.value.finished
    stream(MAP, path, resume=True, show_progress=False)
    alone[MAP].save(tmp_path / "b.nc")
    assert path.read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_lost_workers_leave_what_had_finished_in_memory(alone):
    class Breaks(Foreign):
        def submit(self, function, /, *arguments):
            if len(self.asked) == 6:
                from concurrent.futures.process import BrokenProcessPool

                raise BrokenProcessPool("a process ended abruptly")
            return super().submit(function, *arguments)

    with pytest.raises(SweepFailed, match="the workers are lost") as caught:
        run(MAP, executor=Breaks(), workers=2, show_progress=False)
    part = caught.value.result
    assert 0 < caught.value.finished == int((part.status == 1).sum()) < MAP.cells
    assert run(MAP, resume=part, show_progress=False).data.identical(alone[MAP].data)


def test_errors_of_ours_are_not_taken_for_lost_workers():
    class Wrong(Executor):
        def submit(self, function, /, *arguments):
            raise ZeroDivisionError("planted")

    with pytest.raises(ZeroDivisionError):
        run(MAP, executor=Wrong(), show_progress=False)


# -- Dask and MPI --------------------------------------------------------------------------------------------


TOML = """
transient = 2
window = 4
samples = 5
record = ["sync_error", "section", "trajectory"]
topology = { name = "chain", n = 2 }
sweep = { sigma = { from = 0.0, to = 0.3, count = 40 } }
"""
"""A sweep with the kernel of the others: to compile one would stop the scheduler, which lives in this process."""


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed", reason="the extra dask is not installed")
    with distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as caught:
        yield caught


@pytest.mark.long
def test_dask_survives_a_killed_worker(cluster, alone, tmp_path):
    from distributed import Client

    killed = []
    with Client(cluster) as client:
        executor = client.get_executor()
        assert run(UP, executor=executor, show_progress=False).data.identical(alone[UP].data)
        pids = client.run(os.getpid)

        def kill(progress):
            if progress.done >= 60 and not killed:
                killed.append(progress.done)
                os.kill(next(iter(pids.values())), signal.SIGKILL)

        done = stream(MAP, tmp_path / "a.nc", executor=executor, workers=3, show_progress=False, progress=kill)
    assert done.success
    assert 60 <= killed[0] < MAP.cells
    alone[MAP].save(tmp_path / "b.nc")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


@pytest.mark.long
def test_the_command_runs_on_dask(cluster, tmp_path, capsys):
    from synchain.runtime.cli import main

    scene = tmp_path / "map.toml"
    scene.write_text(TOML)
    assert main(["run", str(scene), "--out", str(tmp_path / "a"), "--dask", cluster.scheduler_address]) == 0
    assert main(["run", str(scene), "--out", str(tmp_path / "b")]) == 0
    capsys.readouterr()
    a, b = (Path(tmp_path, name, "map.nc").read_bytes() for name in "ab")
    assert a == b


def test_a_scheduler_that_does_not_answer_is_one_line(tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed", reason="the extra dask is not installed")
    from synchain.runtime.cli import main

    monkeypatch.setattr("synchain.runtime.commands.run.PATIENCE", 0.5)
    command = ["run", "two_oscillators", "--out", str(tmp_path / "out"), "--set", "sigma=0.1,0.2", "transient=1"]
    assert main([*command, "--dask", "tcp://127.0.0.1:9"]) == 1
    err = capsys.readouterr().err
    assert err.startswith("synchain run: no Dask scheduler answers at tcp://127.0.0.1:9")
    assert err.count("\n") == 1


MPI = """
import sys
from mpi4py.futures import MPIPoolExecutor
from streams import MAP
from synchain import run
if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        run(MAP, executor=executor, workers=2, show_progress=False).save(sys.argv[1])
"""


@pytest.mark.long
def test_mpi(alone, tmp_path):
    beside = Path(sys.executable).with_name("mpiexec")
    launcher = str(beside) if beside.exists() else shutil.which("mpiexec")
    if importlib.util.find_spec("mpi4py") is None or launcher is None:
        pytest.skip("mpi4py or mpiexec is not installed")
    script = tmp_path / "sweep.py"
    script.write_text(MPI)
    command = [launcher, "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script), str(tmp_path / "a.nc")]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert done.returncode == 0, done.stderr
    alone[MAP].save(tmp_path / "b.nc")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
