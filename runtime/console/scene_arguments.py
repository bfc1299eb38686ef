"""The scene of a command line, with the changes of --set, and what a command prints of a value that it computed."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .arguments import add_scene, add_set, settings
from .outcome import FINE, Failed, WrongUse, print_json, sentence, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

    from ..results.labelled import Labelled

# Numbers of a scene besides parameters and initial states that --set can change.
SETTINGS = ("transient", "window", "samples", "rtol", "atol", "max_steps", "rng")
COUNTS = ("samples", "max_steps", "rng")  # those of them that are whole numbers


def add_changed_scene(parser: ArgumentParser, default: str = "", *, more: str = "") -> None:
    """Add SCENE and --set; `more` says what lists and ranges do."""
    add_scene(parser, default)
    text = f"set a parameter, an initial state (x_1) or one of {', '.join(SETTINGS)}"
    add_set(parser, f"{text}; {more}" if more else text)


def changed_scene(arguments: Namespace) -> Scene:
    """Return the scene of SCENE with the changes of --set; raise ValueError or WrongUse if they do not fit."""
    from synchain.models.scenes.file import load_scene

    return with_settings(load_scene(arguments.scene), arguments)


def with_settings(scene: Scene, arguments: Namespace) -> Scene:
    """Return a scene with the changes of --set: numbers fix, lists and ranges sweep parameters and initial states."""
    changes = {name: _fitting(scene, name, value) for name, value in settings(arguments).items()}
    if not changes:
        return scene
    from ..cells.run_keywords import Given
    from ..sweeps.run import run

    fields = {name: changes[name] for name in SETTINGS if name in changes and not scene.takes(name)}
    keywords = {name: value for name, value in changes.items() if name not in fields}
    scene = Given(run, keywords).sweep(scene.replace(**fields))
    title = scene.title or arguments.scene or repr(scene)
    return scene.replace(title=f"{title}, changed: {', '.join(changes)}")


def _fitting(scene: Scene, name: str, value: float | tuple[float, ...] | dict[str, object]) -> object:
    """Return the value of a setting in the type of the scene's field; raise WrongUse if it does not fit."""
    from synchain.models.inputs.names import NodeName

    if scene.takes(name) or name in scene.equations.state:
        return value
    if (parts := NodeName.parse(name)) is not None and parts.base in scene.components:
        scene.model.check_state(name, "initial state")
    if name not in SETTINGS:
        equations = scene.model.unlinked
        states = [str(NodeName(c, equations.holders(c)[0])) for c in equations.components]
        raise WrongUse(f"--set: {scene.model.unknown(name, 'parameter', (*scene.parameters, *states, *SETTINGS))}")
    if isinstance(value, tuple | dict):
        count = value["count"] if isinstance(value, dict) else len(value)
        raise WrongUse(f"--set {name}: found {count} values; only parameters and initial states can be swept")
    return int(value) if name in COUNTS and value.is_integer() else value


def add_output(parser: ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON: what as_dict() of the value returns")
    parser.add_argument(
        "-o", "--out", metavar="FILE", help="write the value to a .nc, .nc4 or .zarr file, for synchain show and plot"
    )


def compute(function: Callable[..., Labelled], scene: Scene, arguments: Namespace, names: Sequence[str]) -> int:
    """Call a public function with those options of these names that were given; print and write its value."""
    warn(scene.warnings)
    options: dict[str, Any] = {name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None}
    with wrong_use():
        target = None if arguments.out is None else Path(arguments.out)
        if target is not None and target.exists():
            raise WrongUse(f"{target} exists; expected a new file: choose another name, or remove it")
        try:
            value = function(scene, **options)
        except FloatingPointError as problem:
            raise Failed(sentence(problem)) from problem
        if target is not None:
            value.save(target)
    print_value(value, arguments.json)
    if target is not None and not arguments.json:
        print(f"  {target}")
    return FINE


def print_value(value: Labelled, json: bool) -> None:
    """Print the summary of a value, or JSON."""
    if json:
        print_json(value.as_dict())
    else:
        print(value)
