"""The JSON Schema of scene files: it takes what scenes take, and refuses what it can see is wrong."""

from __future__ import annotations

import json
import re
import tomllib
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft4Validator, Draft7Validator

from synchain import Axis, Scene, load_scene, scene_names
from synchain.graphs import Topology
from synchain.models.graphs.families import family, names
from synchain.models.networks.model import Group
from synchain.models.scenes.scene import KEYWORDS
from synchain.models.scenes.schema import _of_type, schema

SCHEMA = schema()
DRAFTS = [Draft4Validator(SCHEMA), Draft7Validator(SCHEMA)]
LIBRARY = resources.files("synchain.models.scenes.library")
DOCS = sorted((Path(__file__).parents[3] / "docs").glob("*.md"))


def problems(values: object) -> list[str]:
    """What either draft finds wrong."""
    return [f"{'/'.join(map(str, e.path))}: {e.message[:200]}" for draft in DRAFTS for e in draft.iter_errors(values)]


def test_it_is_a_schema_of_both_drafts_and_plain_json() -> None:
    for draft in DRAFTS:
        draft.check_schema(SCHEMA)
    assert json.loads(json.dumps(SCHEMA)) == SCHEMA


def test_it_has_the_keys_of_a_scene_file_and_says_what_each_means() -> None:
    properties = SCHEMA["properties"]
    assert set(properties) == set(KEYWORDS) - {"axes"} | {"sweep"}
    assert [name for name, row in properties.items() if len(row["description"]) < 10] == []


@pytest.mark.parametrize("name", scene_names())
def test_library_scenes_are_valid_as_they_stand_and_written_in_full(name: str) -> None:
    assert problems(tomllib.loads((LIBRARY / f"{name}.toml").read_text("utf-8"))) == []
    assert problems(load_scene(name).as_dict()) == []


def test_scenes_of_the_documentation_are_valid() -> None:
    pages = "".join(page.read_text("utf-8") for page in DOCS)
    blocks = re.findall(r"^```toml\n(.*?)^```", pages, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 4
    for block in blocks:
        if "project" not in (table := tomllib.loads(block)):  # that of a package with plug-ins
            assert problems(table) == []


def a_graph(name: str) -> Topology:
    """The first graph of a family with 12 nodes or more."""
    for n in range(12, 40):
        with suppress(ValueError):
            return family(name)(n)
    raise AssertionError(f"no graph of {name} with 12 to 39 nodes")


@pytest.mark.parametrize("name", names())
def test_graphs_of_every_family_are_valid_and_unknown_options_are_not(name: str) -> None:
    table: dict[str, Any] = Scene(topology=a_graph(name)).as_dict()["topology"]  # type: ignore[assignment]
    assert table["name"] == name
    assert problems({"topology": table}) == []
    assert problems({"topology": {**table, "sides": 3}}) != []
    assert problems({"topology": {"name": name, "n": family(name).minimum - 1}}) != []


def test_a_keyword_of_an_unknown_type_needs_a_row() -> None:
    with pytest.raises(TypeError, match=r"keyword 'nodes': its type .* expected a row in _rows"):
        _of_type("nodes", tuple[Group] | None)


@pytest.mark.parametrize(
    "text",
    [
        "",
        'friction = "default"',
        'oscillator = "lorenz"\ncoupling = "x->x, -1/2 y->z"',
        'coupling = "spring on x"',
        'section = "x_2 rising 0.1"\n[topology]\nname = "chain"\nn = 2',
        'rtol = "1/1000"\nmax_steps = 7',
        '[topology]\nmatrix = [["-1/2", 0.5], [1, "-1"]]\nn = 2\nname = "mine"',
        '[topology]\nname = "circulant"\nn = 10\noffsets = [1, 3]',
        '[topology]\nname = "erdos_renyi"\nn = 10\np = 0.5',
        '[topology]\nname = "chain"\nn = 2\n[parameters]\nmu_k = [0.1, "1/8"]\nomega = "2*pi/5"\nmu_s_2 = 0.3',
        '[topology]\nname = "chain"\nn = 2\n[initial]\nx = {low = -1, high = 1, rng = 3}\nv = [0, 1]',
        '[topology]\nname = "chain"\nn = 2\n[sweep]\nzipped = true\nsigma = [0, 1]\nx_1 = {from = 0, to = 1, count = 2}',
    ],
)
def test_what_a_scene_takes_is_valid(text: str) -> None:
    values = tomllib.loads(text)
    Scene.from_dict(values)
    assert problems(values) == []


WRONG = {
    "an unknown key": {"oscilator": "duffing"},
    "an unknown oscillator": {"oscillator": "dufing"},
    "an unknown law": {"friction": "exponentiel"},
    "an unknown coupling": {"coupling": "sprung"},
    "an unknown contact": {"contact": "smooth"},
    "an unknown record": {"record": ["error"]},
    "a record twice": {"record": ["section", "section"]},
    "one record alone": {"record": "section"},
    "an unknown direction": {"section": "v_1 downwards"},
    "a section without direction": {"section": "v_1"},
    "a negative time": {"transient": -1},
    "an endless time": {"window": float("inf")},
    "a truth value for a number": {"window": True},
    "a tolerance of 1": {"rtol": 1},
    "a tolerance of nothing": {"rtol": 0},
    "a fraction of a step": {"max_steps": 1.5},
    "no steps": {"max_steps": 0},
    "a negative seed": {"rng": -1},
    "an unknown integrator": {"integrator": "rk4"},
    "an unknown unit": {"time_unit": "seconds"},
    "an unknown continuation": {"continuation": "upwards"},
    "text for a truth value": {"zipped": "yes"},
    "too long a title": {"title": "x" * 201},
    "a number for a title": {"title": 3},
    "an unknown family": {"topology": {"name": "rnig", "n": 4}},
    "a family without a size": {"topology": {"name": "ring"}},
    "a size in text": {"topology": {"name": "ring", "n": "4"}},
    "an option of another family": {"topology": {"name": "ring", "n": 4, "offsets": [1]}},
    "a matrix and a file": {"topology": {"matrix": [[0]], "file": "G.txt"}},
    "a matrix in one row": {"topology": {"matrix": [0, 0]}},
    "a graph as text": {"topology": "ring"},
    "a table as a parameter": {"parameters": {"omega": {"from": 0}}},
    "parameters as a list": {"parameters": [1.15]},
    "a range without an end": {"initial": {"x": {"low": 0}}},
    "an unknown key of a range": {"initial": {"x": {"low": 0, "high": 1, "sed": 1}}},
    "an axis without values": {"sweep": {"omega": []}},
    "an axis of one number": {"sweep": {"omega": 1.15}},
    "an axis without a count": {"sweep": {"omega": {"from": 0, "to": 1}}},
    "an axis of nothing": {"sweep": {"omega": {"from": 0, "to": 1, "count": 0}}},
    "the axes by their Python name": {"axes": {"omega": [1.15]}},
    "a group without nodes": {"nodes": [{"oscillator": "duffing"}]},
    "a group of node 0": {"nodes": [{"oscillator": "duffing", "at": [0]}]},
    "a group with a topology": {"nodes": [{"oscillator": "duffing", "at": [1], "n": 1}]},
}


@pytest.mark.parametrize("values", WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_refused_by_the_schema_and_by_the_scene(values: dict[str, Any]) -> None:
    with pytest.raises((ValueError, TypeError)):
        Scene.from_dict(values)
    assert problems(values) != []


def test_ranges_are_those_of_the_scene() -> None:
    rows = SCHEMA["properties"]
    Scene(transient=rows["transient"]["anyOf"][0]["maximum"], max_steps=rows["max_steps"]["maximum"])
    with pytest.raises(ValueError, match="max_steps"):
        Scene(max_steps=rows["max_steps"]["maximum"] + 1)
    count = rows["sweep"]["additionalProperties"]["anyOf"][1]["properties"]["count"]["maximum"]
    with pytest.raises(ValueError, match="count"):
        Axis.between("omega", 0, 1, count + 1)


def test_parameters_are_named_with_the_parts_that_have_them() -> None:
    allowed = SCHEMA["properties"]["parameters"]["properties"]
    scene = load_scene("figure_4a")
    assert set(scene.parameters) <= set(allowed)
    assert allowed["theta_b"]["description"].startswith("belt_double_pendulum: belt speed; friction: belt speed")
