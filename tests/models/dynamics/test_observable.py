"""Observables as values and as text: what is read is what was written, and nothing else is read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

from synchain import Scene, load_scene
from synchain.graphs import ring
from synchain.models.dynamics.observable_text import as_observable
from synchain.models.inputs.names import TAKEN
from synchain.observe import end, maximum, mean, minimum, nodes, rate, variance
from synchain.runtime.results.labels import MEANINGS

x, v, x_1, theta, t = sp.symbols("x v x_1 theta t")


@pytest.mark.parametrize(
    ("observable", "text"),
    [
        (mean(nodes.mean(v**2 / 2)), "mean(nodes.mean(v**2/2))"),
        (
            mean(abs(nodes.mean(sp.exp(sp.I * theta)))),
            "mean(sqrt(nodes.mean(sin(theta))**2 + nodes.mean(cos(theta))**2))",
        ),
        (mean(theta.diff(theta) * rate(theta)), "mean(rate(theta))"),
        (mean(dynamicsymbols("theta").diff()), "mean(rate(theta))"),
        (maximum(nodes.std(x)), "maximum(sqrt(nodes.mean((x - nodes.mean(x))**2)))"),
        (end(nodes[3](0.1 * x)), "end(nodes[3](x/10))"),
        (variance(nodes.maximum(x) - nodes.minimum(x - x_1)), "variance(nodes.maximum(x) - nodes.minimum(x - x_1))"),
        (minimum(nodes.sum(x) * sp.Max(v, t)), "minimum(max(t, v)*nodes.sum(x))"),
    ],
)
def test_observables_and_their_texts(observable: object, text: str) -> None:
    found = as_observable("observe r", text)
    assert as_observable("observe r", observable) == found
    assert as_observable("observe r", str(found)) == found


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x", "expected one of mean, maximum, minimum, end, variance of an expression outermost"),
        ("mean(x", "unreadable expression 'mean(x' with a ( that is not closed; expected such as 'mean(x_1 - x_2)'"),
        ("mean(nodes[2)(x))", "with a ) that nothing opens"),
        ("mean x", "unreadable expression 'mean x'; expected"),
        ("2*mean(x)", "expected one of mean"),
        ("mean(x, y)", "expected one of mean"),
        ("mean(maximum(x))", "reduced once, outermost"),
        ("mean(nodes.avg(x))", "unknown function 'nodes.avg'"),
        ("mean(nodes[0](x))", "observe r: nodes: found the number 0; expected a whole number from 1"),
        ("mean(arcsin(x))", "did you mean 'asin'"),
        ("mean(x**17)", "exponent 17"),
        ("mean((-2)**x)", "positive"),
        ("mean(rate(2*x))", "expected one state"),
        ("mean(9**9**9)", "found the exponent"),
        ("mean(x**16*x)", "found the power x**17; expected exponents up to 16"),
        ("mean(floor(exp(10**16)))", "expected finite numbers"),
        ("mean(x/0)", "division by zero"),
        ("mean(log(-1)*x)", "expected a real value"),
        ("mean(x.y)", "expected numbers, names"),
        ("mean(__import__('os'))", "unknown function '__import__'"),
        ("mean(x if x > 0 else v)", "found the condition x > 0; expected a value"),
        ("mean((lambda: x)())", "expected numbers, names"),
        ("mean(nodes.sum(x, v))", "has 2 arguments"),
        ("mean(" * 70 + "x" + ")" * 70, ""),
        ("mean(" + "x+" * 2500 + "x)", "characters"),
    ],
)
def test_other_texts_are_refused_in_one_line(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=r"observe r: ") as error:
        as_observable("observe r", text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_complex_values_are_refused() -> None:
    with pytest.raises(ValueError, match="expected a real value"):
        mean(nodes.mean(sp.exp(sp.I * theta)))


@pytest.mark.parametrize(
    ("observables", "message"),
    [
        ({"r": "mean(y)"}, "observe r: unknown name 'y'; known: x, v, x_1"),
        ({"r": "mean(nodes[5](x))"}, "observe r: found node 5; expected 1 to 4"),
        ({"r": "mean(rate(sigma))"}, "expected the rate of a state: x, v"),
        ({"r": "mean(2)"}, "observe r: found the constant 2"),
        ({"status": "mean(x)"}, "found the name 'status', which results have for something else"),
        ({"sigma": "mean(x)"}, "found the name 'sigma'"),
        ({"x_1": "mean(x)"}, "found the name 'x_1'"),
        ({"a b": "mean(x)"}, "expected letters"),
    ],
)
def test_scenes_refuse_what_their_model_does_not_know(observables: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=r"observe") as error:
        Scene(topology=ring(4), observe=observables)
    assert message in str(error.value)


def test_values_that_are_no_observables() -> None:
    with pytest.raises(TypeError, match="observe r: found 3"):
        Scene(observe={"r": 3})
    with pytest.raises(TypeError, match="expected an expression"):
        mean("x")
    with pytest.raises(ValueError, match="window: found 0"):
        Scene(record=(), window=0.0, observe={"r": mean(x)})


def test_states_that_some_nodes_lack() -> None:
    groups = [{"oscillator": "lorenz", "at": [1]}]
    network = {"oscillator": "chua", "nodes": groups, "topology": ring(3), "coupling": "x->x"}
    assert Scene(**network, observe={"r": "mean(nodes.mean(x))"}).observe
    scene = Scene(
        oscillator="harmonic", nodes=[{"oscillator": "rossler", "at": [2]}], topology=ring(3), coupling="x->x"
    )
    with pytest.raises(ValueError, match=r"observe r: some nodes have no 'v'; expected .*, or v_1 of one"):
        scene.replace(observe={"r": "mean(v)"})
    assert scene.replace(observe={"r": "mean(v_1)"}).observe
    with pytest.raises(ValueError, match=r"observe r: some nodes have no 'z'; expected .*, or z_2 of one"):
        scene.replace(observe={"r": "mean(z)"})
    assert scene.replace(observe={"r": "mean(z_2)"}).observe


@pytest.mark.parametrize(("oscillator", "message"), [("rossler", "z_1, a, b, c, t$"), ("duffing", "omega, t, energy$")])
def test_the_energy_is_known_where_there_is_one(oscillator: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"unknown name 'q'; known: .*{message}"):
        Scene(oscillator, window=1, observe={"r": "mean(q)"})


def test_scene_files_hold_observables() -> None:
    scene = Scene(topology=ring(4), observe={"r": mean(nodes.std(x)), "top": "maximum(abs(v))"})
    assert scene.as_dict()["observe"] == {
        "r": "mean(sqrt(nodes.mean((x - nodes.mean(x))**2)))",
        "top": "maximum(Abs(v))",
    }
    assert Scene.from_dict(scene.as_dict()) == scene
    assert hash(Scene.from_dict(scene.as_dict())) == hash(scene)
    assert "observe" not in Scene(topology=ring(4)).as_dict()


def test_no_observable_takes_the_name_of_a_variable() -> None:
    assert set(MEANINGS) <= TAKEN


MANUAL = (Path(__file__).parents[3] / "docs" / "observing.md").read_text("utf-8")


@pytest.mark.parametrize("text", re.findall(r"```toml\n(.*?)```", MANUAL, re.DOTALL))
def test_the_manuals_files_are_scenes(tmp_path: Path, text: str) -> None:
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    scene = load_scene(tmp_path / "mine.toml")
    assert scene.n > 1
    assert scene.observe or scene.sections or scene.draws


@pytest.mark.parametrize("program", re.findall(r"```python\n(.*?)```", MANUAL, re.DOTALL))
def test_the_manuals_programs_run(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synchain.codegen.simd.lanes.native_width", lambda *_: 1)  # the drivers of other tests
    names: dict[str, object] = {}
    exec(program, names)
    assert isinstance(names["scene"], Scene)
