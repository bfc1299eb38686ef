"""Families with options in scene files, in dictionaries and as functions of the package."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

import synchain.models
from synchain import Scene, load_scene
from synchain.graphs import cartesian, chain, circulant, erdos_renyi, topology, torus


def test_families_take_their_options_as_functions() -> None:
    assert circulant(10, offsets=(1, 3)) == topology("circulant", 10, offsets=(1, 3))
    assert torus(27, shape=(3, 3, 3)).options == (("shape", (3, 3, 3)),)
    with pytest.raises(ValueError, match="unknown option 'offsets'; this family has none"):
        chain(4, offsets=1)
    assert "options" in synchain.graphs.circulant.__doc__


def test_options_stand_in_scene_files(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('[topology]\nname = "circulant"\nn = 10\noffsets = [1, 3]\n')
    assert load_scene(path).topology == circulant(10, offsets=(1, 3))
    path.write_text('[topology]\nname = "erdos_renyi"\nn = 9\np = "1/3"\nseed = 4\n')
    assert load_scene(path).topology == erdos_renyi(9, p="1/3", seed=4)
    path.write_text('[topology]\nname = "circulant"\nn = 10\noffset = [1, 3]\n')
    with pytest.raises(ValueError, match=r"mine\.toml: .*unknown key 'offset'.* offsets"):
        load_scene(path)
    path.write_text("[topology]\nmatrix = [[-1, 1], [1, -1]]\noffsets = [1, 3]\n")
    with pytest.raises(ValueError, match="offsets"):
        load_scene(path)


@pytest.mark.parametrize(
    "graph",
    [circulant(8, offsets=(1, 4)), erdos_renyi(6, p="2/3", seed=3), torus(27, shape=(3, 3, 3)), torus(9), chain(3)],
    ids=str,
)
def test_scenes_with_options_come_back(graph: synchain.graphs.Topology) -> None:
    scene = Scene(topology=graph)
    written = scene.as_dict()
    assert written["topology"]["n"] == graph.n
    assert "matrix" not in written["topology"]
    assert Scene.from_dict(written) == scene
    assert Scene.from_dict(written).topology.options == graph.options
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_scenes_with_products_are_written_as_edges() -> None:
    scene = Scene(topology=cartesian(chain(2), chain(3)))
    written = scene.as_dict()
    assert written["topology"]["n"] == 6
    assert written["topology"]["edges"] == [[1, 2], [2, 3], [1, 4], [2, 5], [4, 5], [3, 6], [5, 6]]
    assert Scene.from_dict(written).topology.links == scene.topology.links
