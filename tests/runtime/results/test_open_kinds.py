"""Results of every kind: labelled data, files in every form, and the way back without a difference."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from kept_values import PAIR, every_kind

import synchain.runtime
from synchain import open_result, run, stream
from synchain.graphs import topology
from synchain.runtime.results.labelled import Labelled
from synchain.runtime.results.store import FORMS as KNOWN

KINDS = every_kind()


def form(ending: str) -> Any:
    """A form of files; skipped if its package is not installed."""
    import importlib.util

    package = KNOWN[ending].package
    absent = package is not None and importlib.util.find_spec(package) is None
    return pytest.param(ending, marks=pytest.mark.skipif(absent, reason=f"{package} is not installed"))


FORMS = [form(ending) for ending in KNOWN]


def differences(first: Any, second: Any, where: str = "") -> list[str]:
    """Where two frozen values differ, field by field, in types, shapes or bits."""
    if type(first) is not type(second):
        return [f"{where}: {type(first).__name__} and {type(second).__name__}"]
    if is_dataclass(first) and type(first).__name__ not in ("Scene", "Topology"):
        parts = [attribute.name for attribute in fields(first) if attribute.init]
        return [
            line
            for name in parts
            for line in differences(getattr(first, name), getattr(second, name), f"{where}.{name}")
        ]
    if isinstance(first, tuple):
        if len(first) != len(second):
            return [f"{where}: {len(first)} and {len(second)} items"]
        return [
            line
            for k, pair in enumerate(zip(first, second, strict=True))
            for line in differences(*pair, f"{where}[{k}]")
        ]
    if isinstance(first, np.ndarray):
        same = first.dtype == second.dtype and first.shape == second.shape
        return [] if same and first.tobytes() == second.tobytes() else [f"{where}: {first!r} and {second!r}"]
    both_nan = isinstance(first, float | complex) and repr(first) == repr(second)
    return [] if first == second or both_nan else [f"{where}: {first!r} and {second!r}"]


def test_every_kind_is_among_the_values() -> None:
    """A result that is new gets data, a plot and a file, or this fails."""
    offered = [getattr(synchain.results, name) for name in synchain.results.__all__]
    kinds = {kind.__name__ for kind in offered if isinstance(kind, type) and issubclass(kind, Labelled)}
    assert kinds == {*KINDS, "Result", "Streamed"}


@pytest.mark.parametrize("ending", FORMS)
@pytest.mark.parametrize("name", KINDS)
def test_a_value_comes_back_without_a_difference(name: str, ending: str, tmp_path: Path) -> None:
    path, value = tmp_path / f"value{ending}", KINDS[name]
    value.save(path)
    again = open_result(path)
    assert differences(value, again) == []
    assert again.data.identical(value.data)
    assert repr(again) == repr(value)


@pytest.mark.parametrize("name", KINDS)
def test_data_have_words_and_a_file_opens_in_xarray(name: str, tmp_path: Path) -> None:
    KINDS[name].save(tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="scipy") as data:
        assert set(map(str, KINDS[name].data.data_vars)) <= set(map(str, data.data_vars))
        assert all("long_name" in values.attrs for values in KINDS[name].data.data_vars.values())
        assert data.attrs["kind"] == name


def test_states_of_a_basin_have_labels() -> None:
    assert KINDS["Basin"].data.initial.sel(component="v", node=1).values.tolist() == [2.0, 6.0, 10.0]


EVERY = ("sync_error", "section", "trajectory")


@pytest.fixture(scope="module")
def result() -> Any:
    scene = PAIR.replace(topology=topology("chain", 3), transient=0.0, window=2.0, record=EVERY, samples=5)
    scene = scene.replace(initial={"x": [0.1, 0.2, 0.3], "v": [0.0, 0.05, 0.06]})
    return run(scene, sigma=[0.1, 0.2, 0.3], show_progress=False)


def test_states_have_the_dimensions_component_and_node(result: Any) -> None:
    assert result.end.dims == ("sigma", "component", "node")
    assert result.trajectory.dims == ("sigma", "sample", "component", "node")
    assert result.data.time.dims == ("sigma", "sample")
    first = result.trajectory.isel(sigma=0, sample=0)
    assert first.sel(component="x").values.tolist() == [0.1, 0.2, 0.3]
    assert first.sel(component="v").values.tolist() == [0.0, 0.05, 0.06]
    names = result.scene.equations.state
    for k, name in enumerate(names):
        component, node = name.split("_")
        np.testing.assert_array_equal(result.end.sel(component=component, node=int(node)), result.states("end")[:, k])
    for wrong in ("nd", "status"):
        with pytest.raises(ValueError, match=f"^unknown variable of states '{wrong}'; known: .*end"):
            result.states(wrong)


@pytest.mark.parametrize("ending", FORMS)
def test_a_result_comes_back_in_every_form(result: Any, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    result.save(path)
    before = path.stat().st_mtime_ns
    for wrong, message in ((False, r"is there already; give overwrite=True to replace it"), (1, "overwrite")):
        with pytest.raises((FileExistsError, TypeError), match=message):
            result.save(path, overwrite=wrong)
    assert path.stat().st_mtime_ns == before
    result.save(path, overwrite=True)
    again = open_result(path)
    assert again.data.identical(result.data)
    assert again.scene == result.scene
    assert run(result.scene, resume=again, show_progress=False).data.identical(result.data)


def test_a_streamed_result_has_data_and_is_saved_elsewhere(result: Any, tmp_path: Path) -> None:
    streamed = stream(result.scene, tmp_path / "a.nc", show_progress=False)
    assert streamed.data.identical(result.data)
    streamed.save(tmp_path / "b.nc")
    assert open_result(tmp_path / "b.nc").data.identical(result.data)
    assert "a.nc" in repr(streamed)
    with pytest.raises(
        ValueError, match=r"path: found '.*a\.csv'; expected a name that ends in \.nc or \.nc4 or \.zarr$"
    ):
        stream(result.scene, tmp_path / "a.csv")


@pytest.mark.parametrize("name", ["a.csv", "a.NetCDF", "a"])
def test_an_unknown_ending_is_refused(result: Any, name: str, tmp_path: Path) -> None:
    for value in (result, KINDS["Plane"]):
        with pytest.raises(
            ValueError, match=rf"path: found '.*{name}'; expected a name that ends in .nc or .nc4 or .zarr"
        ):
            value.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []
    result.save(tmp_path / "A.NC")
    assert open_result(tmp_path / "A.NC").data.identical(result.data)


@pytest.mark.parametrize("ending", FORMS)
def test_damage_is_seen(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    KINDS["Plane"].save(path)
    files = [path] if path.is_file() else sorted(p for p in path.rglob("exponent/*") if not p.name.startswith("."))
    text = bytearray(files[0].read_bytes())
    index = text.find(np.array(0.25, ">f8" if ending == ".nc" else "<f8").tobytes())
    index = index if index >= 0 else len(text) // 2  # compressed
    text[index] ^= 1
    files[0].write_bytes(text)
    with pytest.raises(OSError, match="damaged"):
        open_result(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tree: tree["root"].update(value="Popen"), "Popen"),
        (lambda tree: tree["root"]["fields"].pop("across"), "across"),
        (lambda tree: tree["root"]["fields"].update(across={"array": "nothing", "dtype": "<f8"}), "nothing"),
        (lambda tree: tree.update(root={"value": "Criterion", "fields": {}}), "expected a result"),
        (lambda tree: tree["root"]["fields"].update(scene={"scene": 7}), "index"),
    ],
)
def test_a_forged_file_is_refused_in_one_line(change: Callable[[Any], Any], message: str, tmp_path: Path) -> None:
    from synchain.runtime.results.store import read_data, write_data

    KINDS["Plane"].save(tmp_path / "a.nc")
    data = read_data(tmp_path / "a.nc")
    tree = json.loads(data.attrs["value"])
    change(tree)
    write_data(data.assign_attrs(value=json.dumps(tree)), tmp_path / "b.nc")
    with pytest.raises(ValueError, match=message) as caught:
        open_result(tmp_path / "b.nc")
    assert "\n" not in str(caught.value)


def test_a_result_of_the_former_layout_is_refused(result: Any, tmp_path: Path) -> None:
    from synchain.runtime.results.store import write_data

    old = result.data.drop_vars(("end", "trajectory", "section")).assign(end=(("sigma", "state"), result.states("end")))
    write_data(old, tmp_path / "old.nc")
    with pytest.raises(ValueError, match="an earlier version wrote it"):
        open_result(tmp_path / "old.nc")


def test_an_absent_package_is_named_in_one_line_before_anything_runs(tmp_path: Path) -> None:
    packages = {ending: form.package for ending, form in KNOWN.items() if form.package}
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({list(packages.values())!r}))\n"
        "from kept_values import PAIR, every_kind\n"
        "from synchain.runtime.results.open import open_result\n"
        "from synchain.runtime.sweeps.stream import stream\n"
        f"for ending in {list(packages)!r}:\n"
        f"    path, there = {str(tmp_path / 'a')!r} + ending, {str(tmp_path / 'there')!r} + ending\n"
        "    open(there, 'w').close()\n"
        "    calls = (lambda: every_kind()['Plane'].save(path), lambda: stream(PAIR, path), lambda: open_result(there))\n"
        "    for call in calls:\n"
        "        try:\n"
        "            call()\n"
        "        except ModuleNotFoundError as error:\n"
        "            print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[2])
    lines = done.stdout.splitlines()
    assert len(lines) == 3 * len(packages), done.stderr
    text = 'needs the package {}; install it: python -m pip install "synchain[files]", or end the name in .nc'
    expected = [text.format(package) for package in packages.values() for _ in range(3)]
    assert all(line.endswith(end) for line, end in zip(lines, expected, strict=True))
    assert sorted(part.name for part in tmp_path.iterdir()) == sorted(f"there{ending}" for ending in packages)


def test_a_damaged_file_leaves_no_traceback(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("h5netcdf")
    path, ignored = tmp_path / "a.nc4", []
    monkeypatch.setattr(sys, "unraisablehook", lambda problem: ignored.append(problem.exc_value))
    KINDS["Plane"].save(path)
    contents = path.read_bytes()
    index = contents.index(b"OHDR") + 20  # the object header of the root group, which has a checksum
    for damaged in (contents[:300], contents[:index] + bytes([contents[index] ^ 1]) + contents[index + 1 :]):
        path.write_bytes(damaged)
        with pytest.raises(OSError, match="the file is damaged"):
            open_result(path)
        gc.collect()
    assert not ignored


def test_a_truncated_file_is_called_that(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    KINDS["Plane"].save(path)
    contents = path.read_bytes()
    for length in (65, 130):
        path.write_bytes(contents[:length])
        with pytest.raises(
            OSError, match=r"a\.nc.* damaged.*(ends before its data|do not fit their digest).*restore it"
        ):
            open_result(path)


def test_another_folder_is_not_replaced(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    (tmp_path / "a.zarr").mkdir()
    (tmp_path / "a.zarr" / "mine.txt").write_text("x")
    with pytest.raises(FileExistsError, match="is no Zarr folder"):
        KINDS["Plane"].save(tmp_path / "a.zarr")
    assert (tmp_path / "a.zarr" / "mine.txt").read_text() == "x"
