"""Compiled kernels on disk: loaded again, repaired, refused, and shared between processes."""

from __future__ import annotations

import dataclasses
import errno
import gc
import hashlib
import importlib.util
import inspect
import json
import math
import mmap
import os
import pickle
import py_compile
import shutil
import stat
import subprocess
import sys
import threading
import warnings
import weakref
from collections.abc import Iterator
from pathlib import Path

import numba
import pytest
import sympy as sp
from samples import drive, friction_chain, harmonic_chain, real

from synchain.codegen.front_end import compiler, decorator, syntax_reader
from synchain.codegen.kernels import driver
from synchain.codegen.kernels.driver import Driver, KernelKind
from synchain.codegen.kernels.mode_kernel import emit_modes
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.machine_code import code_cache
from synchain.codegen.machine_code import compile as loading
from synchain.codegen.simd import lane_types, lanes
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import network_variation
from synchain.models.mechanics.components import Node
from synchain.runtime.cli import main

x, v = real("x", "v")
SWING = Equations.of_equal_nodes(Node((x, v), (v, -x), ()), None, 1)
REAL = emit(SWING, "cash_karp", Recording(()), width=1)
TINY = """
from synchain.codegen.simd import broadcast, njit


@njit(error_model="numpy", cache=True)
def step(t, h, y, p, y_new, dense, rtol, atol):
    y_new[0] = 2.0 * y[0]
    y_new[1] = 3.0 * y[1]
    return broadcast(0.0, 1)
"""
TINY_DRIVER = """
from synchain.codegen.simd import address, broadcast, njit


@njit(error_model="numpy", nogil=True, cache=True)
def drive(functions, dims, multiplicity, rule, network, first, last, inputs, outputs):
    start, _, _, _ = inputs
    end, _, _, _, _, _ = outputs
    zero = broadcast(0.0, 1)
    for i in range(first, last):
        y, y_new = address(start[i], 0), address(end[i], 0)
        functions.step(zero, zero, y, y, y_new, y_new, 0.0, 0.0)
        for c in range(dims.dimension):
            end[i, c] *= 1.0
"""


@dataclasses.dataclass(frozen=True, slots=True)
class TinyDriver(Driver):
    """A driver that takes one step of each cell."""

    scale: float = 1.0

    @property
    def text(self) -> str:
        return TINY_DRIVER.replace("1.0", repr(self.scale))


SOURCE = dataclasses.replace(REAL, code=TINY, driver=TinyDriver(KernelKind.SWEEP, 1))
"""A module and a driver with the functions of a kernel that compile ten times faster than one."""
MODULES = ("kernel", "driver")
"""What a kernel is made of, by the beginnings of the names of its files."""

HERE = Path(__file__).parent

OTHER = """
import json, os, sys
sys.path[:0] = sys.argv[1].split(os.pathsep)
from test_load import REAL, SOURCE, filled, many, reported
tasks = {"small": lambda: reported(SOURCE), "real": lambda: reported(REAL), "fill": filled, "many": many}
print("ready", flush=True)
for line in sys.stdin:
    task, os.environ["SYNCHAIN_CACHE"] = json.loads(line)
    print(json.dumps(tasks[task]()), flush=True)
"""
HOLDER = """
import sys, time
from pathlib import Path
from synchain.codegen.machine_code.code_cache import open_folder
with open_folder(Path(sys.argv[1])) as folder, folder.locked(sys.argv[2]):
    print("held", flush=True)
    time.sleep(600)
"""


def reported(source) -> dict:
    """Load a kernel, run it, and say how it was loaded."""
    loading.forget()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        k = loading.load(source)
    end = drive(k, [[1.0, 2.0]], [[]], [(0.0, 1.0)], 1e-9).end[0]
    stats = [f.stats for module in (k.compiled, k.driver) for f in module.functions.values()]
    return {
        "end": list(end), "hits": sum(sum(s.cache_hits.values()) for s in stats),
        "misses": sum(sum(s.cache_misses.values()) for s in stats), "path": k.path, "digest": k.digest,
        "from_cache": k.from_cache, "driver_from_cache": k.driver.from_cache,
        "warnings": [str(w.message) for w in caught],
    }  # fmt: skip


def filled() -> int:
    """Fill a cache with three small drivers, whose lines are printed."""
    loading.forget()
    with pytest.MonkeyPatch.context() as m:
        drivers = [TinyDriver(KernelKind.SWEEP, 1, scale=float(k)) for k in range(1, 4)]
        m.setattr(driver, "common_drivers", lambda: drivers)
        return main(["cache", "warm"])


def many() -> dict[str, object]:
    """Load and drop seventeen small kernels in turn; say which of them are alive, and how much memory more rounds take."""

    def kernels() -> list:
        written = []
        for k in range(10, 27):
            kernel = loading.load(dataclasses.replace(SOURCE, code=TINY.replace("2.0", f"{k}.0")))
            step = kernel.compiled.functions["step"]
            written.append([weakref.ref(o) for o in (kernel, step, step.overloads[step.signatures[0]].library)])
        return written

    def resident() -> float:
        gc.collect()
        return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE / 2**20

    loading.forget()
    held, compiled, loaded = loading.load(SOURCE), kernels(), kernels()
    before = resident()
    for _ in range(9):
        kernels()
    last = kernels()
    grown = resident() - before
    alive = [
        [sum(ref() is not None for ref in column) for column in zip(*written, strict=True)]
        for written in (compiled, loaded, last)
    ]
    return {"alive": alive, "grown": grown, "held": loading.load(SOURCE) is held}


class Other:
    """Another process, which has loaded all modules and waits for tasks; it starts with the first, and anew after an end."""

    process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", OTHER, os.pathsep.join(map(str, (HERE, HERE.parents[1])))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.line() == "ready"

    def begin(self, task: str, folder: Path) -> None:
        if self.process is None:
            self.start()
        assert self.process is not None
        assert self.process.stdin is not None
        print(json.dumps((task, str(folder))), file=self.process.stdin, flush=True)

    def line(self) -> str:
        assert self.process is not None
        assert self.process.stdout is not None
        return self.process.stdout.readline().rstrip("\n")

    def end(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
        self.process = None


@pytest.fixture(scope="module")
def other() -> Iterator[Other]:
    """The process that the tests share; each gives it a folder of its own."""
    instance = Other()
    yield instance
    instance.end()


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An empty cache folder for this process."""
    path = tmp_path / "kernels"
    monkeypatch.setenv("SYNCHAIN_CACHE", str(path))
    return path


def fresh(source=SOURCE):
    """Load without what this process remembers."""
    loading.forget()
    code_cache._warned_folders.clear()
    return loading.load(source)


def works(compiled) -> bool:
    return drive(compiled, [[1.0, 2.0]], [[]], [(0.0, 1.0)], 1e-9).end[0].tolist() == [2.0, 6.0]


def machine_code(folder: Path, module: str = "*") -> list[Path]:
    return sorted(folder.glob(f"{module}_*.code"))


def from_cache(kernel: loading.Kernel) -> dict[str, bool]:
    """Which modules were loaded from the cache."""
    return {"kernel": kernel.from_cache, "driver": kernel.driver.from_cache}


ALL_FROM_CACHE = dict.fromkeys(MODULES, True)
every_module = pytest.mark.parametrize("module", MODULES)


def both(name: str, values: list[str]) -> pytest.MarkDecorator:
    """Modules and the values of another name: one way of reading and writing serves all modules, so they take turns."""
    pairs = [(module, value, (i + k) % 2) for k, module in enumerate(MODULES) for i, value in enumerate(values)]
    return pytest.mark.parametrize(
        ("module", name), [pytest.param(*pair, marks=[pytest.mark.long] * turn) for *pair, turn in pairs]
    )


@pytest.fixture(scope="module")
def reports(other, tmp_path_factory) -> dict[str, dict]:
    """What another process has told that loaded the small kernel and the real one into empty folders."""
    collected = {}
    for name in ("small", "real"):
        other.begin(name, tmp_path_factory.mktemp("shared") / "kernels")
        collected[name] = json.loads(other.line())
    return collected


@pytest.fixture(scope="module")
def compiled_folder(reports) -> Path:
    """A folder that another process has filled."""
    return Path(reports["small"]["path"]).parent


def copied(source: Path, target: Path) -> None:
    """Copy a cache with its times: Numba compares those of the module file."""
    shutil.copytree(source, target)


# -- the good cases ------------------------------------------------------------------------------------------


EXACT = {"small": (2.0, 6.0), "real": (math.cos(1.0) + 2 * math.sin(1.0), 2 * math.cos(1.0) - math.sin(1.0))}


@pytest.mark.parametrize(("name", "source"), [("small", SOURCE), ("real", REAL)])
def test_a_second_process_loads_without_compiling(reports, folder, name, source):
    first = reports[name]
    copied(Path(first["path"]).parent, folder)
    second = reported(source)
    assert (first["hits"], first["misses"], first["from_cache"], first["driver_from_cache"]) == (0, 2, False, False)
    assert (second["hits"], second["misses"], second["from_cache"], second["driver_from_cache"]) == (2, 0, True, True)
    assert first["warnings"] == second["warnings"] == []
    assert first["digest"] == second["digest"] == source.digest
    assert first["end"] == second["end"] == pytest.approx(EXACT[name], abs=1e-8)


def test_of_two_processes_that_miss_a_kernel_one_compiles_it(other, folder):
    other.begin("small", folder)
    both = [reported(SOURCE), json.loads(other.line())]
    for report in both:
        assert report["warnings"] == []
        assert report["end"] == [2.0, 6.0]
    for module in ("from_cache", "driver_from_cache"):
        assert sorted(r[module] for r in both) == [False, True]
    assert not [*folder.glob("*.tmp"), *folder.glob("*.lock")]
    for module in MODULES:
        assert len(list(folder.glob(f"{module}_*.py"))) == 1
    assert works(fresh())


@every_module
def test_the_lock_of_a_process_that_was_killed_keeps_nobody_waiting(folder, module):
    text = SOURCE.code if module == "kernel" else SOURCE.driver.text
    name = f"{module}_{loading._fingerprint(text)[:32]}"
    holder = subprocess.Popen([sys.executable, "-c", HOLDER, str(folder), name], stdout=subprocess.PIPE, text=True)
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    collected: list[dict] = []
    waiting = threading.Thread(target=lambda: collected.append(reported(SOURCE)), daemon=True)
    waiting.start()
    waiting.join(3.0)
    assert waiting.is_alive()
    holder.kill()
    holder.communicate()
    waiting.join(120.0)
    (report,) = collected
    assert (report["from_cache"], report["driver_from_cache"]) == (False, False)
    assert not list(folder.glob("*.lock"))


def test_the_kernel_keeps_its_text(compiled_folder, folder):
    copied(compiled_folder, folder)
    compiled = fresh()
    assert compiled.source == f"{SOURCE.head}\n\n\n{Path(compiled.path).read_text(encoding='utf-8')}"
    assert compiled.digest == SOURCE.digest
    assert compiled.equations is SWING
    assert loading.load(SOURCE) is compiled, "the same kernel is loaded once"
    assert Path(compiled.driver.path).read_text(encoding="utf-8") == SOURCE.driver.text
    for path in (compiled.path, compiled.driver.path):
        assert stat.S_IMODE(Path(path).stat().st_mode) & 0o077 == 0


def test_digests_are_stable_and_tell_kernels_apart():
    assert emit(SWING, "cash_karp", Recording(()), width=1).digest == REAL.digest
    others = [
        emit(SWING, "dop853", Recording(()), width=1),
        emit(SWING, "cash_karp", Recording(()), width=2),
        emit(SWING, "cash_karp", Recording(("trajectory",)), width=1),
        emit(SWING, "cash_karp", Recording(("section",), sp.Symbol("v_1")), width=1),
        emit(friction_chain(1), "cash_karp", Recording(()), width=1),
        emit(harmonic_chain(2), "cash_karp", Recording(()), width=1),
    ]
    assert len({REAL.digest, *(o.digest for o in others)}) == len(others) + 1


def test_the_file_name_follows_everything_that_shapes_machine_code(monkeypatch):
    names = {loading._fingerprint(SOURCE.code)}

    def changed(*change) -> None:
        with monkeypatch.context() as m:
            m.setattr(*change)
            loading._sources.cache_clear()
            names.add(loading._fingerprint(SOURCE.code))
        loading._sources.cache_clear()

    changed(numba, "__version__", "9.9")
    changed(sys, "version", "4.0")
    changed(lane_types, "HOST_NAME", "abacus")
    changed(lane_types, "HOST_FEATURES", {"beads": True})
    changed(loading.importlib.metadata, "version", lambda name: "9.9")
    changed(loading.platform, "machine", lambda: "sun dial")
    for name in loading.FLAGS:
        changed(numba.config, name, "another")
    for k in range(len(loading.SOURCES)):
        changed(loading, "SOURCES", [*loading.SOURCES[:k], Path(__file__), *loading.SOURCES[k + 1 :]])
    monkeypatch.setenv("SYNCHAIN_FRONT_END", "numba")
    names.add(loading._fingerprint(SOURCE.code))
    monkeypatch.delenv("SYNCHAIN_FRONT_END")
    names.add(loading._fingerprint(SOURCE.code + "\n"))
    assert len(names) == 9 + len(loading.FLAGS) + len(loading.SOURCES)
    assert loading._fingerprint(SOURCE.code) in names
    sources = {path.name for path in loading.SOURCES}
    assert {
        "compiler.py",
        "syntax_reader.py",
        "emitter.py",
        "lanes.py",
        "dimensions.py",
        "function_table.py",
    } <= sources


# -- kernels that nobody holds, and drivers ahead of time ------------------------------------------------------


@pytest.mark.skipif(not Path("/proc/self/statm").is_file(), reason="needs the memory of a process in /proc")
def test_kernels_that_nobody_holds_are_freed(other, folder):
    """Of seventeen kernels in turn the last sixteen are kept, so each is loaded anew every time."""
    other.begin("many", folder)
    report = json.loads(other.line())
    assert report["alive"] == [[0, 0, 0], [0, 0, 0], [16, 16, 16]], "kernels, functions, machine code"
    assert report["held"], "a kernel that somebody holds is not loaded again"
    assert report["grown"] < 10, report["grown"]  # MiB


def told(lines: list[str]) -> list[str]:
    """The first words of the lines of a process that fills a cache."""
    assert all(line.endswith("driver of sweeps, 1 lane") for line in lines)
    return [line.partition("  ")[0] for line in lines]


def test_of_two_processes_that_fill_a_cache_one_compiles_each_driver(other, folder, capsys):
    other.begin("fill", folder)
    assert filled() == 0
    lines = [told(capsys.readouterr().out.splitlines()), told([other.line() for _ in range(3)])]
    assert other.line() == "0"
    assert [sorted(pair) for pair in zip(*lines, strict=True)] == [["compiled", "was there"]] * 3
    assert not [*folder.glob("*.tmp"), *folder.glob("*.lock")]
    assert len(machine_code(folder, "driver")) == 3


def test_a_process_that_is_killed_while_it_fills_a_cache_leaves_whole_drivers(other, folder, capsys):
    other.begin("fill", folder)
    assert other.line().startswith("compiled")
    other.end()
    assert filled() == 0
    lines = told(capsys.readouterr().out.splitlines())
    assert lines[0] == "was there"
    assert lines[-1] == "compiled", "the process was killed too late"
    assert filled() == 0
    assert told(capsys.readouterr().out.splitlines()) == ["was there"] * 3


@pytest.mark.usefixtures("folder")
def test_a_cache_that_cannot_be_filled_is_an_error(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(driver, "common_drivers", lambda: [TinyDriver(KernelKind.SWEEP, 1)])
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "file"))
    (tmp_path / "file").write_text("no folder")
    loading.forget()
    assert main(["cache", "warm"]) == 1
    assert "drivers are not kept on disk" in capsys.readouterr().err


def test_the_common_drivers_are_those_of_common_scenes():
    """Of small networks, which take two registers, and of larger ones."""
    common, speed = driver.common_drivers(), real("v_1")[0]
    assert len({made.text for made in common}) == len(common) == 21
    used = set()
    for records in ((), ("sync_error",), ("section",), ("trajectory",), ("sync_error", "section")):
        for method, network in (("rodas5p", friction_chain), ("taylor", harmonic_chain)):
            for n in (1, 4):
                used |= {*emit(network(n), method, Recording(records if n > 1 else (), speed)).shared}
    assert used <= {*common}
    assert {made.width for made in used} == {lanes.native_width(), lanes.native_width(2)}
    assert emit_modes(network_variation(friction_chain(2))).driver in common
    assert emit_modes(network_variation(harmonic_chain(2)), "taylor").driver in common


@pytest.mark.long
def test_the_common_drivers_compile(folder, capsys):
    for word in ("compiled", "was there"):
        loading.forget()
        assert main(["cache", "warm"]) == 0
        assert [line.startswith(word) for line in capsys.readouterr().out.splitlines()] == [True] * 21
    assert code_cache.describe()["drivers"] == 21


# -- the front end and forks ----------------------------------------------------------------------------------


def test_a_fault_of_the_front_end_is_one_warning(folder, monkeypatch):
    def fail(*arguments):
        raise AttributeError("renamed in the next version")

    monkeypatch.setattr(decorator, "front_end_problems", [])
    monkeypatch.setattr(syntax_reader, "read", fail)
    loading._warn_once.cache_clear()
    kernels = [SOURCE, dataclasses.replace(SOURCE, code=TINY.replace("2.0", "1.0 + 1.0"))]
    with pytest.warns(RuntimeWarning) as caught:
        loaded = [fresh(one) for one in kernels]
    assert [works(one) for one in loaded] == [True, True]
    assert ["Numba's own pipeline" in str(one.message) for one in caught] == [True]
    assert "AttributeError: renamed" in str(caught[0].message)


FORKED = """
import os, sys, threading
sys.path[:0] = sys.argv[1].split(os.pathsep)
from test_load import SOURCE, TINY, dataclasses, fresh, loading, works
kernel = fresh()
second, third = (dataclasses.replace(SOURCE, code=TINY.replace("2.0", number)) for number in ("5.0", "7.0"))
thread = threading.Thread(target=loading.load, args=(second,))
inside, compiled = threading.Event(), loading._compile
loading._compile = lambda *given: (inside.set(), compiled(*given))[1]
thread.start()
inside.wait(60)
child = os.fork()
if not child:
    again = loading.load(SOURCE) is kernel and works(kernel)
    loading.load(third)
    os._exit(0 if again else 1)
thread.join()
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
def test_a_process_that_forks_while_a_kernel_compiles_has_a_child_that_runs(folder):
    way = os.pathsep.join(map(str, (HERE, HERE.parents[1])))
    done = subprocess.run([sys.executable, "-c", FORKED, way], text=True, capture_output=True, timeout=300, check=False)
    assert done.stdout == "0\n", done.stderr


def test_a_loaded_kernel_waits_for_no_compilation(folder):
    kernel, collected = fresh(), []
    with loading._lock:
        thread = threading.Thread(target=lambda: collected.append(loading.load(SOURCE)), daemon=True)
        thread.start()
        thread.join(60)
    assert collected == [kernel]


# -- damage --------------------------------------------------------------------------------------------------


@both("damage", ["empty", "half", "noise"])
def test_damaged_files_are_compiled_anew(compiled_folder, folder, damage, module):
    copied(compiled_folder, folder)
    (path,) = machine_code(folder, module)
    contents = path.read_bytes()
    path.write_bytes({"empty": b"", "half": contents[: len(contents) // 2], "noise": b"\x93noise" * 40}[damage])
    compiled = fresh()
    assert works(compiled)
    assert from_cache(compiled) == {**ALL_FROM_CACHE, module: False}
    assert from_cache(fresh()) == ALL_FROM_CACHE, "the repaired cache is used"


@every_module
def test_a_changed_module_file_is_written_anew(compiled_folder, folder, module):
    copied(compiled_folder, folder)
    path = next(folder.glob(f"{module}_*.py"))
    before = path.read_text()
    path.write_text(before.replace("0", "5") + "\nraise SystemExit('not ours')\n")
    assert works(fresh())
    assert path.read_text() == before == (SOURCE.code if module == "kernel" else SOURCE.driver.text)


def test_missing_machine_code_is_no_problem(compiled_folder, folder):
    copied(compiled_folder, folder)
    for path in machine_code(folder):
        path.unlink()
    assert works(fresh())


@every_module
def test_one_wrong_bit_in_machine_code_is_not_run(compiled_folder, folder, module):
    copied(compiled_folder, folder)
    (path,) = machine_code(folder, module)
    content = bytearray(path.read_bytes())
    content[2 * len(content) // 3] ^= 4
    path.write_bytes(content)
    compiled = fresh()
    assert from_cache(compiled) == {**ALL_FROM_CACHE, module: False}
    assert works(compiled)
    assert from_cache(fresh()) == ALL_FROM_CACHE


def test_machine_code_of_another_kernel_is_not_run(compiled_folder, folder):
    copied(compiled_folder, folder)
    other = dataclasses.replace(SOURCE, code=TINY.replace("2.0", "5.0"))
    (theirs,) = machine_code(folder, "kernel")
    mine = Path(fresh(other).path).with_suffix(".code")
    shutil.copyfile(theirs, mine)
    again = fresh(other)
    assert drive(again, [[1.0, 2.0]], [[]], [(0.0, 1.0)], 1e-9).end[0].tolist() == [5.0, 6.0]


def test_machine_code_of_another_driver_is_not_run(compiled_folder, folder):
    copied(compiled_folder, folder)
    other = dataclasses.replace(SOURCE, driver=TinyDriver(KernelKind.SWEEP, 1, scale=10.0))
    (theirs,) = machine_code(folder, "driver")
    mine = Path(fresh(other).driver.path).with_suffix(".code")
    shutil.copyfile(theirs, mine)
    again = fresh(other)
    assert drive(again, [[1.0, 2.0]], [[]], [(0.0, 1.0)], 1e-9).end[0].tolist() == [20.0, 60.0]


def test_an_index_of_numba_is_not_read(compiled_folder, folder, tmp_path):
    """Numba's index is a pickle, which may run anything when it is read."""
    copied(compiled_folder, folder)
    (folder / "__pycache__").mkdir(exist_ok=True)
    touch = f"import pathlib; pathlib.Path({str(tmp_path / 'ran')!r}).touch()"
    evil = pickle.dumps(numba.__version__) + pickle.dumps(Runs(touch))
    version = f"py{sys.version_info.major}{sys.version_info.minor}"
    for module, function, text in (("kernel", "step", TINY), ("driver", "drive", TINY_DRIVER)):
        (name,) = (path.stem for path in folder.glob(f"{module}_*.py"))
        line = text[: text.index("@njit")].count("\n") + 1
        (folder / "__pycache__" / f"{name}.{function}-{line}.{version}.nbi").write_bytes(evil)
    for path in machine_code(folder):
        path.unlink()
    assert works(fresh())
    assert not (tmp_path / "ran").exists()


class Runs:
    """An object whose pickle runs a line of Python when it is read."""

    def __init__(self, line: str) -> None:
        self.line = line

    def __reduce__(self):
        return exec, (self.line,)


@every_module
def test_what_python_keeps_beside_a_module_is_not_run(compiled_folder, folder, module):
    copied(compiled_folder, folder)
    path = next(folder.glob(f"{module}_*.py"))
    status = path.stat()
    evil = folder / "evil.py"
    evil.write_text("raise SystemExit('not ours')")
    py_compile.compile(str(evil), importlib.util.cache_from_source(path))
    stale = Path(importlib.util.cache_from_source(path))
    head = stale.read_bytes()
    stamp = (int(status.st_mtime) & 0xFFFFFFFF).to_bytes(4, "little") + status.st_size.to_bytes(4, "little")
    stale.write_bytes(head[:8] + stamp + head[16:])
    assert works(fresh())


def shared_state() -> dict[tuple[str, ...], object]:
    """What all threads share: the configuration of Numba, functions of its modules and classes, and if garbage is collected."""
    modules = [m for name, m in sys.modules.items() if name.partition(".")[0] in ("numba", "llvmlite")]
    owners = {
        (m.__name__, *inner): owner
        for m in modules
        for inner, owner in [((), m), *(((k,), c) for k, c in vars(m).items() if isinstance(c, type))]
    }
    fields_found = {
        (*path, k): f for path, owner in owners.items() for k, f in list(vars(owner).items()) if inspect.isfunction(f)
    }
    settings = {("config", k): value for k, value in vars(numba.config).items() if k.isupper()}
    return {**fields_found, **settings, ("gc",): gc.isenabled()}


def test_what_threads_share_is_left_alone_while_kernels_compile(folder, tmp_path, monkeypatch):
    elsewhere = tmp_path / "elsewhere"
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(elsewhere))
    compile_extra, during = compiler.FrontEnd.compile_extra, []
    monkeypatch.setattr(
        compiler.FrontEnd,
        "compile_extra",
        lambda *arguments: (during.append(shared_state()), compile_extra(*arguments))[1],
    )
    assert works(fresh())
    before = shared_state()
    assert works(fresh(dataclasses.replace(SOURCE, code=TINY.replace("3.0", "6.0 * 0.5"))))
    assert {path for path, value in before.items() if during[-1].get(path, value) != value} == set()
    assert len(during) == 3
    assert not elsewhere.exists()
    assert machine_code(folder)


def test_another_processor_compiles_its_own(compiled_folder, folder, monkeypatch):
    copied(compiled_folder, folder)
    monkeypatch.setattr(lane_types, "HOST_NAME", "abacus")
    loading._sources.cache_clear()
    try:
        compiled = fresh()
        assert from_cache(compiled) == dict.fromkeys(MODULES, False)
        assert works(compiled)
    finally:
        monkeypatch.undo()
        loading._sources.cache_clear()
    for module in MODULES:
        assert len(list(folder.glob(f"{module}_*.py"))) == 2


def test_a_full_disk_is_no_problem(folder, monkeypatch):
    def full(opened: code_cache.Folder, name: str, data: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", name)

    monkeypatch.setattr(code_cache.Folder, "write", full)
    warned("No space left on device")


def test_a_kernel_that_cannot_be_compiled_is_an_error(folder):
    broken = dataclasses.replace(SOURCE, code=TINY.replace("2.0", "undefined_name"))
    with pytest.raises(Exception, match="undefined_name"):
        fresh(broken)


def test_a_step_of_other_types_than_the_driver_calls_is_an_error(folder):
    broken = dataclasses.replace(SOURCE, code=TINY.replace("broadcast(0.0, 1)", "0.0"))
    with pytest.raises(Exception, match="float64"):
        fresh(broken)


# -- places that cannot be used ------------------------------------------------------------------------------

posix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs POSIX permissions")


def warned(match: str):
    with pytest.warns(RuntimeWarning, match=match) as caught:
        compiled = fresh()
    assert len(caught) == 1
    assert "kernels are not kept on disk" in str(caught[0].message)
    assert works(compiled)
    return compiled


def repaired(match: str):
    """A file of the cache is refused, with one warning, and written anew."""
    with pytest.warns(RuntimeWarning, match=match) as caught:
        compiled = fresh()
    assert len(caught) == 1
    assert "refused a file, whose kernel is compiled anew" in str(caught[0].message)
    assert works(compiled)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert from_cache(fresh()) == ALL_FROM_CACHE
    return compiled


def refused(match: str) -> None:
    """The cache folder cannot be opened; `warned` is what a kernel makes of it."""
    with pytest.raises(OSError, match=match), code_cache.open_folder(code_cache.cache_folder()):
        pass


@posix
def test_a_folder_that_others_can_write_is_refused(compiled_folder, folder):
    copied(compiled_folder, folder)
    folder.chmod(0o702)
    refused("can be written by others; run: chmod go-w")
    folder.chmod(0o720)
    compiled = warned(r"can be written by others; run: chmod go-w")
    assert folder not in (Path(compiled.path).parent, Path(compiled.driver.path).parent)
    assert from_cache(compiled) == dict.fromkeys(MODULES, False)


@posix
@both("suffix", ["code", "py"])
def test_a_file_that_others_can_write_is_refused(compiled_folder, folder, suffix, module):
    copied(compiled_folder, folder)
    next(folder.glob(f"{module}_*.{suffix}")).chmod(0o666)
    compiled = repaired("can be written by others; run: chmod go-w")
    assert from_cache(compiled) == {**ALL_FROM_CACHE, module: suffix == "py"}


@posix
@pytest.mark.parametrize("mode", [0o777, 0o775])
def test_a_folder_that_others_can_replace_is_refused(mode, tmp_path, monkeypatch):
    (tmp_path / "open" / "inner").mkdir(parents=True)
    (tmp_path / "open").chmod(mode)
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "open" / "inner" / "kernels"))
    refused("which others can write; run: chmod go-w")
    (tmp_path / "open").chmod(0o1777)
    with code_cache.open_folder(code_cache.cache_folder()):
        pass


@posix
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives folders away")
def test_a_folder_in_the_folder_of_another_user_is_refused(tmp_path, monkeypatch):
    """The owner of a folder can put another one in the place of any that lies in it."""
    (tmp_path / "theirs" / "inner").mkdir(parents=True)
    os.chown(tmp_path / "theirs", 4711, 4711)
    (tmp_path / "link").symlink_to(tmp_path / "theirs" / "inner")
    for way in ("theirs/inner", "link"):
        monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / way / "kernels"))
        refused(f"lies in {tmp_path / 'theirs'}, which belongs to another user; set SYNCHAIN_CACHE")


@posix
def test_another_folder_in_the_place_of_an_open_one_is_not_read(tmp_path):
    """A swap between the check of a folder and the reading of its files changes nothing."""
    with code_cache.open_folder(tmp_path / "kernels") as opened:
        opened.store_code("kernel_a", b"mine")
        (tmp_path / "kernels").rename(tmp_path / "aside")
        with code_cache.open_folder(tmp_path / "kernels") as evil:
            evil.store_code("kernel_a", b"theirs")
        assert opened.load_code("kernel_a") == b"mine"
        opened.write("kernel_b.py", b"b")
    assert (tmp_path / "aside" / "kernel_b.py").exists()


@posix
def test_missing_parents_are_made_for_the_user_alone(tmp_path, monkeypatch):
    before = os.umask(0o002)
    try:
        with code_cache.open_folder(tmp_path / "a" / "b" / "kernels"):
            assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o700
    finally:
        os.umask(before)


@posix
@both("suffix", ["py", "code"])
def test_a_pipe_in_the_place_of_a_file_does_not_keep_anybody_waiting(compiled_folder, folder, suffix, module):
    copied(compiled_folder, folder)
    path = next(folder.glob(f"{module}_*.{suffix}"))
    path.unlink()
    os.mkfifo(path, 0o600)
    assert from_cache(repaired("is a pipe or device; expected a file")) == {**ALL_FROM_CACHE, module: suffix == "py"}


@posix
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives files away")
def test_a_file_of_somebody_else_is_replaced(compiled_folder, folder):
    copied(compiled_folder, folder)
    os.chown(machine_code(folder, "kernel")[0], 4711, 4711)
    assert from_cache(repaired("belongs to another user")) == {**ALL_FROM_CACHE, "kernel": False}


@pytest.fixture
def read_only(monkeypatch) -> None:
    """A file system that can only be read, for the superuser too."""
    opening, making = os.open, os.mkdir

    def only_read(path, flags, *mode, **options):
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            raise OSError(errno.EROFS, "Read-only file system", path)
        return opening(path, flags, *mode, **options)

    def make_nothing(path, *mode, **options):
        if os.path.isdir(path):
            return making(path, *mode, **options)
        raise OSError(errno.EROFS, "Read-only file system", path)

    monkeypatch.setattr(os, "open", only_read)
    monkeypatch.setattr(os, "mkdir", make_nothing)


def test_a_warm_cache_that_can_only_be_read_is_used(compiled_folder, folder, request):
    copied(compiled_folder, folder)
    request.getfixturevalue("read_only")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert from_cache(fresh()) == ALL_FROM_CACHE


@pytest.mark.usefixtures("folder", "read_only")
def test_without_a_place_to_write_kernels_are_compiled_in_memory(monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", "/nowhere")
    warned("Read-only file system")


@pytest.fixture
def settings(tmp_path, monkeypatch) -> Path:
    """The folder of the key, which does not exist yet."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    monkeypatch.setattr(sys, "platform", "linux")
    return tmp_path / "settings" / "synchain"


def test_machine_code_that_another_key_signed_is_not_run(compiled_folder, folder, settings):
    """A cache that is carried here is code, of which a checksum says nothing."""
    copied(compiled_folder, folder)
    (code,) = machine_code(folder, "kernel")
    evil = pickle.dumps(Runs("raise SystemExit('not ours')"))
    code.write_bytes(hashlib.sha256(f"{code.stem}\n".encode() + evil).digest() + evil)
    with pytest.warns(RuntimeWarning, match="was signed by another user or machine") as caught:
        compiled = fresh()
    assert len(caught) == 1
    assert from_cache(compiled) == dict.fromkeys(MODULES, False)
    assert from_cache(fresh()) == ALL_FROM_CACHE
    key = settings / code_cache.KEY
    assert (len(key.read_bytes()), stat.S_IMODE(key.stat().st_mode)) == (32, 0o600)
    assert [path.name for path in settings.iterdir()] == [code_cache.KEY]


def test_processes_that_make_a_key_at_once_agree(folder, settings, monkeypatch):
    """The second writes its own after the first has looked for one."""
    with code_cache.open_folder(settings) as one, code_cache.open_folder(settings) as two:
        write, first = code_cache.Folder.write, []

        def slow(opened, name, data):
            if not first:
                first.append(None)
                first[0] = two.key_here()
            write(opened, name, data)

        monkeypatch.setattr(code_cache.Folder, "write", slow)
        assert one.key_here() == first[0] == two.key_here()


def test_without_settings_the_key_lies_in_the_cache(folder, settings):
    settings.parent.write_text("no folder")
    with code_cache.open_folder(folder) as opened:
        opened.store_code("kernel_a", b"code")
        assert opened.load_code("kernel_a") == b"code"
        assert (folder / code_cache.KEY).read_bytes() == opened.key()


def test_a_folder_of_somebody_else_is_refused(folder, monkeypatch):
    monkeypatch.setattr(code_cache.os, "getuid", lambda: 4711, raising=False)
    refused("belongs to another user; set SYNCHAIN_CACHE to a folder of yours")


def test_a_file_in_the_place_of_the_folder_is_no_problem(folder):
    folder.write_text("no folder")
    warned("exists")
    assert folder.read_text() == "no folder"


def test_a_missing_home_is_no_problem(monkeypatch):
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("SYNCHAIN_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    warned("Could not determine home directory")


def test_a_good_folder_gives_no_warning(compiled_folder, folder):
    copied(compiled_folder, folder)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert from_cache(fresh()) == ALL_FROM_CACHE


def test_scenes_of_one_code_share_what_is_compiled(compiled_folder, folder) -> None:
    copied(compiled_folder, folder)
    first, second = fresh(), loading.load(dataclasses.replace(SOURCE, head='"""Another scene."""'))
    assert first.digest != second.digest
    assert first.source != second.source
    assert first.compiled is second.compiled
    assert fresh(second.origin).from_cache
