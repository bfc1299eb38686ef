"""Every scene of the photograph is what it was when the golden file was written, to the last bit on the same machine."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import pytest
from photograph import COUPLING, FRICTION_LAW, OSCILLATOR, SCENES, TOPOLOGY, Picture, camera, compare, names, take

from synchain.codegen.integrators import names as integrators

GOLDEN = Path(__file__).parent / "golden" / "photograph.json"
EMPTY: dict[str, Any] = {"camera": {}, "scenes": {}}


@dataclass(slots=True)
class Album:
    """The golden pictures and the camera they were taken with; new ones where the file is written anew."""

    camera: dict[str, str]
    scenes: dict[str, dict[str, Any]]
    taken: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def same_camera(self) -> bool:
        return self.camera == camera()

    def write(self) -> None:
        """Replace the pictures that were taken; of another camera, and of scenes that are no more, none is kept."""
        kept = self.scenes if self.same_camera else {}
        pictures = {name: picture for name, picture in (kept | self.taken).items() if name in SCENES}
        made = {"camera": camera(), "scenes": {name: pictures[name] for name in SCENES if name in pictures}}
        temporary = GOLDEN.with_suffix(".tmp")
        temporary.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        os.replace(temporary, GOLDEN)


@pytest.fixture(scope="module")
def album(request: pytest.FixtureRequest) -> Iterator[Album]:
    found = Album(**(json.loads(GOLDEN.read_text(encoding="utf-8")) if GOLDEN.is_file() else EMPTY))
    update = request.config.getoption("--update")
    if not update and not found.same_camera:
        here = {key: value for key, value in camera().items() if found.camera.get(key) != value}
        warnings.warn(
            f"the photograph was taken elsewhere: numbers are compared to 1e-12, not to the bit ({here})", stacklevel=1
        )
    yield found
    if update and found.taken:
        found.write()


def _marked(picture: Picture) -> Any:
    return pytest.param(picture.name, marks=pytest.mark.long if picture.long else ())


@pytest.mark.parametrize("name", [_marked(picture) for picture in SCENES.values()])
def test_a_scene_is_what_it_was(name: str, album: Album, request: pytest.FixtureRequest) -> None:
    found = take(name)
    if request.config.getoption("--update"):
        album.taken[name] = found
        return
    if name not in album.scenes:
        pytest.fail(
            f"photograph: no golden picture of {name!r}; write it with: pytest tests/test_photograph.py --update"
        )
    differences = compare(album.scenes[name], found, album.same_camera)
    if differences:
        lines = "\n".join(f"  {line}" for line in differences)
        pytest.fail(
            f"scene {name!r} changed:\n{lines}\nwhole texts, to be compared: python tests/photograph.py {name!r}",
            pytrace=False,
        )


def test_the_golden_file_has_the_scenes_of_the_catalogue_and_no_others(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--update"):
        pytest.skip("the golden file is being written")
    assert list(json.loads(GOLDEN.read_text(encoding="utf-8"))["scenes"]) == list(SCENES)


def test_every_part_runs_in_a_scene_and_every_integrator_in_two(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--update"):
        pytest.skip("the golden file is being written")
    pictures = json.loads(GOLDEN.read_text(encoding="utf-8"))["scenes"].values()
    run = Counter(part for picture in pictures if "parts" in picture for part in picture["parts"].split(", "))
    parts = {f"{kind.name} {name}" for kind in (OSCILLATOR, FRICTION_LAW, COUPLING) for name in names(kind)}
    assert parts - set(run) == set()
    assert {name for name in integrators() if run[f"integrator {name}"] < 2} == set()
    exact = {quantity.split()[0] for quantity in json.loads(GOLDEN.read_text())["scenes"]["spectra of all families"]}
    assert set(names(TOPOLOGY)) - exact == set()


@pytest.mark.long
@pytest.mark.skipif("fma" not in llvm.get_host_cpu_features(), reason="the test compiles for Haswell")
def test_machine_code_for_another_processor_gives_the_same_bits() -> None:
    chosen = ("friction pair, zipped axes", "pendulum pair, taylor", "set-valued pair, taylor", "exponents of Lorenz")
    command = [sys.executable, str(GOLDEN.parents[1] / "photograph.py"), *chosen]
    own, other = (
        subprocess.run(command, env=os.environ | more, capture_output=True, text=True, check=True).stdout
        for more in ({}, {"NUMBA_CPU_NAME": "haswell"})
    )
    assert "0x1." in own
    assert own == other


def _numbers(*values: float) -> dict[str, dict[str, str]]:
    return {"end": {"shape": str(len(values)), "numbers": " ".join(float(x).hex() for x in values)}}


def test_one_unit_of_the_last_place_is_seen_on_the_same_machine() -> None:
    found = compare(_numbers(0.5, 2.0), _numbers(0.5, math.nextafter(2.0, 3.0)), same_camera=True)
    assert found == [
        "end: 1 of 2 numbers differ; at [1] was 2.0 (0x1.0000000000000p+1); is 2.0000000000000004 "
        "(0x1.0000000000001p+1); apart by 4.4e-16"
    ]
    assert compare(_numbers(0.0), _numbers(-0.0), same_camera=True) != []


@pytest.mark.parametrize(("old", "new"), [(100.0, 100.0 + 9e-11), (1e-9, 1e-9 + 9e-13), (math.nan, math.nan)])
def test_rounding_elsewhere_is_no_change(old: float, new: float) -> None:
    assert compare(_numbers(old), _numbers(new), same_camera=False) == []


@pytest.mark.parametrize(("old", "new"), [(100.0, 100.0 + 2e-10), (0.0, 2e-12), (math.nan, 0.0), (math.inf, -math.inf)])
def test_more_than_rounding_is_a_change_elsewhere_too(old: float, new: float) -> None:
    (words,) = compare(_numbers(1.0, old), _numbers(1.0, new), same_camera=False)
    assert words.startswith("end: 1 of 2 numbers differ; at [1] was ")


def test_texts_and_quantities_are_compared_on_every_machine() -> None:
    old = {
        "kind": "half-line",
        "gone": "a",
        "file": {"bits": "0"},
        "steps": {"counts": "7"},
        "long": {"sha256": "0", "lines": 2},
    }
    new = {
        "kind": "never stable",
        "come": "a",
        "file": {"bits": "1"},
        "steps": {"counts": "8"},
        "long": {"sha256": "1", "lines": 2},
    }
    assert compare(old, new, same_camera=False) == [
        "come: found a new quantity",
        "gone: found none",
        "kind: was 'half-line'; is 'never stable'",
        "long: was sha256 0 lines 2; is sha256 1 lines 2",
    ]
    exact = compare(old, new, same_camera=True)
    assert {"file: was bits 0; is bits 1", "steps: was counts 7; is counts 8"} <= set(exact)


def test_pictures_of_other_shapes_differ() -> None:
    assert compare(_numbers(1.0), _numbers(1.0, 2.0), same_camera=False) != []
    assert compare(_numbers(1.0), {"end": "1"}, same_camera=False) != []
