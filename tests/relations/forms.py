"""Other scenes of the same motion: other texts, names, numbers of nodes, signs and files, and what makes answers comparable."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from questions import CYCLE, DRIVEN, PULL, REST, Answer, Change

import synchain as sc

SETTINGS = ("transient", "window", "time_unit", "rtol", "atol")


def rebuilt(scene: sc.Scene, node: sc.Field, coupling: sc.Rates | None = None, **changes: object) -> sc.Scene:
    """A scene with another text of its node, made anew; parameters that the text does not have are left out."""
    linked = scene.coupling is not None and scene.n > 1
    names = {*map(str, node.parameters), "g"} if linked else set(map(str, node.parameters))
    replacements = {
        "parameters": {name: value for name, value in scene.parameters.items() if name in names},
        "initial": dict(zip(node.states, scene.initial.values(), strict=True)),
        **{name: getattr(scene, name) for name in SETTINGS},
    }
    return sc.Scene(
        node, (coupling or PULL) if linked else None, scene.topology if linked else None, **(replacements | changes)
    )


def _texts(cycle: str, driven: str, rest: str, **parameters: float) -> dict[sc.Field, sc.Field]:
    """Texts of x'' for each of the three nodes, in units of 1."""

    def node(text: str, more: dict[str, float]) -> sc.Field:
        values = {name: value for name, value in (parameters | more).items() if name in text}
        return sc.Field({"x": "v", "v": text}, parameters=values)

    return {
        CYCLE: node(cycle, {}),
        DRIVEN: node(driven, {"u": 0.3, "w": 1.2}),
        REST: node(rest, {"h": 0.7}),
    }


FORMS = {
    "numbers": _texts("(1 - x**2)*v - x", "-x - x**3 - v/5 + 0.3*cos(w*t)", "0.7 - x - x**3 - v"),
    "expanded": _texts("v - x**2*v - x", "u*cos(w*t) - x**3 - x - 2*v/10", "-v - x**3 - x + h"),
    "factored": _texts("-(x - 1)*(x + 1)*v - x", "-x*(1 + x**2) - v/5 + u*cos(w*t)", "h - x*(x**2 + 1) - v"),
    "trigonometric": _texts(
        "(cos(v)**2 + sin(v)**2 - x**2)*v - x",
        "-x - x**3 - v/5 + u*(2*cos(w*t/2)**2 - 1)",
        "h*(1 - 2*sin(x)**2) + 2*h*sin(x)**2 - x - x**3 - v",
    ),
    "letters": _texts(
        "(alpha - beta*x**2)*v - gamma*x",
        "-alpha*x - beta*x**3 - v/delta + u*cos(w*t)",
        "h - alpha*x - beta*x**3 - gamma*v",
        alpha=1,
        beta=1,
        gamma=1,
        delta=5,
    ),
}
"""Equal functions written differently, parameters as numbers and as letters."""


def written(form: str) -> Change:
    """The same equations by another text."""
    return lambda scene: rebuilt(scene, FORMS[form][scene.oscillator])


def renamed(scene: sc.Scene) -> sc.Scene:
    """Other names, in another order of the alphabet."""
    texts = {
        CYCLE: ("(1 - z**2)*a - z", {}),
        DRIVEN: ("-z - z**3 - a/5 + b*cos(w*t)", {"b": 0.3, "w": 1.2}),
        REST: ("h - z - z**3 - a", {"h": 0.7}),
    }
    text, parameters = texts[scene.oscillator]
    node = sc.Field({"z": "a", "a": text}, parameters=parameters)
    pull = sc.Rates({"a": "Q*W*(a_j - a_i)"}, {"Q": 0.2})
    strength = {"Q": scene.parameters["g"]} if scene.n > 1 else {}
    return rebuilt(scene, node, pull, parameters=strength)


def pendula(scene: sc.Scene) -> sc.Scene:
    """Pendula in place of the nodes: x is an angle."""
    texts = {
        CYCLE: ("-sin(x) + v*(1 - 2*v**2)/3", {}),
        DRIVEN: ("-sin(x) - v/5 + u*cos(w*t)", {"u": 0.1, "w": 1.2}),
        REST: ("h - sin(x) - v", {"h": 0.7}),
    }
    text, parameters = texts[scene.oscillator]
    return rebuilt(scene, sc.Field({"x": "v", "v": text}, parameters=parameters), parameters=_strength(scene))


def _strength(scene: sc.Scene) -> dict[str, float]:
    return {"g": scene.parameters["g"]} if scene.n > 1 else {}


def laplacian(weights: Sequence[Sequence[float]] | np.ndarray) -> sc.graphs.Topology:
    """The graph of whole weights: off the diagonal, row by row."""
    matrix = np.asarray(weights).astype(int)
    return sc.graphs.from_matrix((matrix - np.diag(matrix.sum(axis=1))).tolist())


def of_order(scene: sc.Scene, order: Sequence[int]) -> sc.Scene:
    """The nodes in another order."""
    if scene.n == 1:
        return scene
    weights = np.zeros((scene.n, scene.n))
    for i, j, weight in scene.topology.links:
        weights[i, j] = weight
    graph = laplacian(weights[np.ix_(order, order)])
    start = {name: [values[k] for k in order] for name, values in scene.initial.items()}
    return scene.replace(topology=graph, initial=start)


def mirrored(scene: sc.Scene) -> sc.Scene:
    """Links of the opposite weight, and a strength of the opposite sign."""
    if scene.n == 1:
        return scene
    graph = laplacian([[0, -1], [-1, 0]])
    return scene.replace(topology=graph, parameters={**scene.parameters, "g": -scene.parameters["g"]})


def twice(scene: sc.Scene) -> sc.Scene:
    """Two copies of the pair without a link between them."""
    if scene.n == 1:
        return scene
    start = {name: [*values, *values] for name, values in scene.initial.items()}
    return scene.replace(topology=laplacian(np.kron(np.eye(2), [[0, 1], [1, 0]])), initial=start)


def through_file(path: Path) -> Change:
    """The scene that its file holds."""

    def change(scene: sc.Scene) -> sc.Scene:
        scene.save(path / "scene.toml")
        return sc.load_scene(path / "scene.toml")

    return change


def pickled(scene: sc.Scene) -> sc.Scene:
    return pickle.loads(pickle.dumps(scene))


def replaced(scene: sc.Scene) -> sc.Scene:
    """Every field changed and changed back, one after the other."""
    other = {"transient": 3.0, "window": 7.0, "rtol": 1e-5, "rng": 3, "integrator": "dop853", "title": "other"}
    changed = scene
    for name, value in other.items():
        changed = changed.replace(**{name: value})
    for name in other:
        changed = changed.replace(**{name: getattr(scene, name)})
    return changed


@dataclass(frozen=True)
class Relation:
    """A change of the scene, and what makes the changed answer the plain one."""

    change: Change
    back: Callable[[Answer], Answer] = lambda answer: answer


def swap(answer: Answer) -> Answer:
    """States of the pair in the first order."""
    return {name: value[:, ::-1] if name in ("end", "state") else value for name, value in answer.items()}
