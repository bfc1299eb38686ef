"""Drawn graphs: nodes apart, every link once, widths, arrows and colours that say what they should."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from fractions import Fraction

import numpy as np
import pytest
from family_sizes import cases
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from synchain import Scene, load_scene
from synchain.graphs import Topology, from_matrix, topology, union
from synchain.runtime.plots.graph_layout import positions
from synchain.runtime.plots.graph_picture import NEGATIVE, Picture, svg

UNEVEN = from_matrix([[-3, 2, 1], [2, -2, 0], [Fraction(-1, 2), 0, Fraction(1, 2)]])
TWO_KINDS = Scene(
    oscillator="duffing",
    nodes=[{"at": [2], "oscillator": "van_der_pol"}],
    topology=topology("chain", 3),
    coupling="spring",
)


def closest(points: np.ndarray) -> float:
    """Distance of the two closest nodes, in units of the radius of a node."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + np.eye(len(points)) * 9
    return float(apart.min())


@pytest.mark.parametrize(("name", "n"), cases(6, 12))
def test_no_two_nodes_of_a_family_meet(name: str, n: int) -> None:
    points = positions(topology(name, n))
    assert points.shape == (n, 2)
    assert np.abs(points).max() <= 1.0 + 1e-12
    assert closest(points) > 0.1


@pytest.mark.parametrize(
    "graph", [union(topology("ring", 5), topology("star", 6)), topology("random_cubic", 40), UNEVEN]
)
def test_no_two_nodes_of_a_graph_without_a_layout_meet(graph: Topology) -> None:
    assert closest(positions(graph)) > 0.03


def test_layouts_of_families() -> None:
    ring = positions(topology("ring", 8))
    np.testing.assert_allclose(np.linalg.norm(ring, axis=1), 1.0, rtol=1e-12)
    assert np.ptp(positions(topology("chain", 5))[:, 1]) == 0.0
    star = positions(topology("star", 7))
    np.testing.assert_allclose(np.linalg.norm(star - star[0], axis=1)[1:], np.linalg.norm(star[1] - star[0]), rtol=1e-9)
    rows = positions(topology("grid", 12))
    assert (len(np.unique(rows[:, 0].round(9))), len(np.unique(rows[:, 1].round(9)))) == (4, 3)
    tree = positions(topology("tree", 7))
    assert tree[0, 1] > tree[1, 1] == tree[2, 1] > tree[3, 1]
    left = positions(topology("complete_bipartite", 7))[:, 0]
    assert len(np.unique(left)) == 2


def test_joined_nodes_are_nearer_than_others() -> None:
    graph = union(topology("ring", 6), topology("ring", 6))
    points = positions(graph)
    first, second = points[:6], points[6:]
    assert first[:, 0].max() < second[:, 0].min(), "the parts stand side by side"


def test_a_layout_is_the_same_every_time() -> None:
    graph = topology("random_regular", 500, degree=3)
    np.testing.assert_array_equal(positions(graph), positions(topology("random_regular", 500, degree=3)))


def test_lines_say_weight_direction_and_sign() -> None:
    lines = {(line.source, line.target): line for line in Picture.of(UNEVEN).lines}
    assert set(lines) == {(1, 0), (2, 0), (0, 2)}
    assert not lines[1, 0].arrow
    assert lines[2, 0].arrow
    assert lines[2, 0].bent
    assert lines[1, 0].width > lines[2, 0].width > lines[0, 2].width
    assert lines[0, 2].negative
    assert not lines[2, 0].negative


def test_a_link_behind_a_node_is_bent() -> None:
    lines = Picture.of(topology("torus", 12)).lines
    assert sum(line.bent for line in lines) == 3 + 4
    assert not any(
        line.bent for line in Picture.of(topology("complete", 6)).lines if abs(line.source - line.target) != 3
    )


def test_matplotlib_draws_into_given_axes_what_the_picture_says() -> None:
    figure = Figure()
    ax = figure.add_subplot()
    assert topology("ring", 5).draw(ax=ax) is ax
    (links,) = (c for c in ax.collections if isinstance(c, LineCollection))
    assert len(links.get_segments()) == 5
    (nodes,) = (c for c in ax.collections if isinstance(c, PathCollection))
    assert len(nodes.get_offsets()) == 5
    assert [text.get_text() for text in ax.texts] == list("12345")
    one_way = topology("feed_forward", 4).draw()
    arrows = [patch for patch in one_way.patches if isinstance(patch, FancyArrowPatch)]
    assert len(arrows) == 3
    one_way.figure.figure.savefig(io.BytesIO())
    first, *_, last = arrows[0].get_transform().transform_path(arrows[0].get_path()).vertices[:3]
    assert first[0] < last[0], "an arrow points from the source to the target, which feels it"
    assert np.ptp(one_way.get_ylim()) > 0.1


def test_kinds_of_nodes_have_colours_and_names() -> None:
    ax = TWO_KINDS.draw()
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["duffing", "van_der_pol"]
    colours = re.findall(r'<circle [^>]*fill="(#\w+)"', svg(TWO_KINDS))
    assert colours[0] == colours[2] != colours[1]


def test_wrong_axes_are_refused() -> None:
    with pytest.raises(TypeError, match=r"ax: found str; expected matplotlib axes"):
        topology("ring", 5).draw(ax="here")


def test_svg_has_each_node_and_line_once() -> None:
    for graph, lines in ((topology("wheel", 8), 14), (UNEVEN, 3), (topology("one_way_ring", 5), 5)):
        root = ET.fromstring(svg(graph))
        assert len(root.findall("{*}circle")) == graph.n
        assert len(root.findall("{*}path")) == lines
    assert svg(topology("one_way_ring", 5)).count("<polygon") == 5
    assert NEGATIVE in svg(UNEVEN)
    assert "currentColor" in svg(UNEVEN)


def test_names_in_an_svg_are_escaped() -> None:
    named = Topology('a"><script>', 2, ((0, 1, Fraction(1)), (1, 0, Fraction(1))))
    assert "<script>" not in svg(named)
    ET.fromstring(svg(named))


@pytest.mark.parametrize("graph", [topology("chain", 1000), topology("complete", 1000)])
def test_a_large_graph_is_words_in_html_and_quick(graph: Topology) -> None:
    began = time.process_time()
    text = graph._repr_html_()
    assert time.process_time() - began < 5.0
    assert "too many to be drawn here" in text
    assert len(text) < 10_000


def test_matplotlib_is_loaded_by_drawing_alone() -> None:
    code = (
        "import sys\nfrom synchain import load_scene; from synchain.graphs import chain\n"
        "chain(4)._repr_html_(), load_scene('figure_4a')._repr_html_()\nassert 'numba' not in sys.modules\n"
        "assert 'matplotlib' not in sys.modules\nchain(4).draw()\nassert 'matplotlib' in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_shipped_scenes_are_drawn() -> None:
    for name in ("figure_4a", "huygens"):
        assert len(Picture.of(load_scene(name)).positions) == load_scene(name).n
