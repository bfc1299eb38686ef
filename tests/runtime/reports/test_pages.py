"""HTML, LaTeX and text of values: what stands there, escaped, short, the same through IPython's own machinery."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from fractions import Fraction
from typing import Any

import matplotlib.pyplot as plt
import pytest
from kept_values import every_kind
from matplotlib.axes import Axes

from synchain import Scene, load_scene, run
from synchain.graphs import Topology, topology
from synchain.runtime.reports.html import ROWS

NAME = '<b onclick="x">&'
KINDS = every_kind()


def words(html: str) -> str:
    """The text of a fragment, which is well formed; without annotations and rules."""
    root = ET.fromstring(f"<div>{html.replace('&#x27;', chr(39))}</div>")
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in ("style", "annotation"):
                parent.remove(child)
    return " ".join("".join(root.itertext()).split())


def test_a_scene_shows_equations_graph_spectrum_and_records() -> None:
    scene = load_scene("figure_5").replace(record=("sync_error", "section"))
    html = scene._repr_html_()
    shown = words(html)
    assert html.count("<math display") == 4
    assert "<svg" in html
    assert "2 distinct" in shown or "3 distinct" in shown
    for part in ("friction with exponential friction, spring coupling", "omega = ", "sync_error, section (v_1"):
        assert part in shown
    assert "sweep" in shown
    assert f"{scene.axes[0].name}: {len(scene.axes[0])} values" in shown


def test_spectra_are_exact_and_cut_in_the_middle() -> None:
    small = topology("chain", 4).spectrum
    assert words(small._repr_html_()).count("√") == 0, "a root is an element, not a letter"
    assert small._repr_html_().count("<msqrt>") == 2
    large = topology("ring", 1000).spectrum._repr_html_()
    assert large.count("<tr>") == ROWS + 1
    assert "… 490 more" in words(large)
    assert "1000 eigenvalues, 501 distinct" in words(large)
    assert len(topology("ring", 1000).spectrum._repr_latex_()) < 2000


def test_large_networks_are_short_in_a_terminal() -> None:
    graph = topology("chain", 1000)
    scene = Scene(topology=graph)
    for value in (graph, scene, scene.equations):
        assert len(repr(value)) < 200
    assert len(repr(graph.spectrum)) < 2000
    assert repr(scene.equations) == "Equations(1000 nodes, 1998 links, states x, v, 9 parameters)"


def test_latex() -> None:
    assert topology("star", 6).spectrum._repr_latex_().splitlines()[3:6] == [r"0 & 1 \\", r"-1 & 4 \\", "-6 & 1"]
    scene = load_scene("figure_4a")
    assert scene._repr_latex_() == scene.equations._repr_latex_()
    assert scene._repr_latex_().startswith("\\begin{align*}")


def test_equations_of_many_unequal_nodes_are_cut() -> None:
    scene = Scene(
        oscillator="duffing", nodes=[{"at": [2], "oscillator": "van_der_pol"}], topology=topology("chain", 60)
    )
    assert "and so on for the other nodes" in words(scene.equations._repr_html_())
    assert len(scene._repr_html_()) < 60_000
    assert scene._repr_latex_().endswith("\\dots\n\\end{gather*}")


def test_whatever_a_user_names_is_escaped() -> None:
    graph = Topology(NAME, 2, ((0, 1, Fraction(1)), (1, 0, Fraction(1))))
    scene = Scene(title=NAME, topology=graph)
    for html in (graph._repr_html_(), scene._repr_html_(), run(scene.replace(transient=1, window=1))._repr_html_()):
        assert NAME not in html
        assert NAME in words(html)


@pytest.mark.parametrize("name", [name for name in KINDS if name != "PeriodicOrbit"])
def test_a_result_shows_its_summary_and_its_plot(name: str) -> None:
    value = KINDS[name]
    html = value._repr_html_()
    for key, text in value.summary:
        assert " ".join(f"{key}{text}".split()) in words(html).replace("  ", " ")
    assert html.count("<img ") == 1
    assert 'src="data:image/png;base64,' in html
    assert len(html) < 200_000


@pytest.mark.parametrize("name", [*KINDS, "Result"])
def test_text_in_a_terminal_is_a_few_lines(name: str) -> None:
    value = run(Scene(transient=1, window=1)) if name == "Result" else KINDS[name]
    lines = repr(value).splitlines()
    assert lines[0] == name
    assert 2 <= len(lines) <= 10
    assert "array(" not in repr(value)
    assert max(map(len, lines)) < 200


@pytest.mark.parametrize("name", [name for name in KINDS if name != "PeriodicOrbit"])
def test_every_kind_is_drawn_into_given_axes(name: str) -> None:
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert KINDS[name].plot(ax=ax) is ax
    assert ax.has_data()
    assert isinstance(KINDS[name].plot(), Axes)
    with pytest.raises(TypeError, match="ax: found int; expected matplotlib axes"):
        KINDS[name].plot(ax=3)


def test_an_orbit_is_drawn_as_a_closed_curve() -> None:
    from synchain.runtime.bifurcation.periodic import periodic_orbit

    scene = Scene(oscillator="duffing", parameters={"delta": 0.2, "omega": 1.3})
    orbit = periodic_orbit(scene)
    ax = orbit.plot(plt.figure().add_subplot())
    x, v = ax.lines[0].get_data()
    assert (x[0], v[0]) == pytest.approx(tuple(orbit.state), abs=1e-6)
    assert (x[-1], v[-1]) == pytest.approx((x[0], v[0]), abs=1e-6)
    assert float(abs(x).max()) > 0.0


def test_the_display_of_a_notebook_opens_no_figure_of_pyplot() -> None:
    """A notebook would show the picture twice."""
    before = plt.get_fignums()
    scene = Scene(oscillator="duffing", topology=topology("chain", 2), record=(), transient=0, window=1)
    assert "data:image/png" in run(scene, show_progress=False, width=1)._repr_html_()
    assert plt.get_fignums() == before


@pytest.mark.skipif(importlib.util.find_spec("IPython") is None, reason="IPython is not installed")
@pytest.mark.parametrize("name", ["scene", "topology", "spectrum", "equations", "MSF", "Thresholds"])
def test_ipython_shows_it(name: str) -> None:
    from IPython.core.formatters import DisplayFormatter

    scene = load_scene("figure_4a")
    values: dict[str, Any] = {
        "scene": scene,
        "topology": scene.topology,
        "spectrum": scene.spectrum,
        "equations": scene.equations,
        **KINDS,
    }
    shown, _ = DisplayFormatter().format(values[name])
    assert shown["text/html"].startswith("<style>")
    assert shown["text/plain"].count("\n") < 12
    assert ("text/latex" in shown) == (name in ("scene", "spectrum", "equations"))
