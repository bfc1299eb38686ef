"""Keywords of functions that take parameters of a scene beside keywords of their own: run(scene,
workers=2, omega=1.2).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping

from synchain.models.inputs.checks import check_number, suggestion
from synchain.models.inputs.node_name import NodeName
from synchain.models.scenes.scene import KEYWORDS, Scene, a_scene

__all__ = ["check_keywords", "with_axes", "with_parameters"]


def with_axes(function: Callable[..., object], scene: Scene, axes: Mapping[str, object]) -> Scene:
    """Return a scene with parameters and initial states fixed or swept.

    Parameters
    ----------
    function : callable
        The function whose keywords they are; an error names it.
    scene : Scene
    axes : mapping of str to number or sequence
        A number fixes a parameter, a setting or an initial state; a sequence makes an axis of it,
        after those of the scene.

    Raises
    ------
    ValueError
        If a name is no parameter, setting or initial state.
    """
    fixed: dict[str, object] = {}
    swept: dict[str, object] = {axis.name: axis.values for axis in a_scene(scene).axes}
    start = {name: list(values) for name, values in scene.initial.items()}
    for name, value in axes.items():
        if (
            isinstance(value, Iterable)
            and not isinstance(value, str | bytes)
            and not (isinstance(value, Mapping) and name in KEYWORDS)
            and getattr(value, "ndim", 1) > 0
        ):
            swept[name] = value
        elif state := _state(scene, name):
            start[state.base][scene.equations.holders(state.base).index(state.index)] = check_number(name, value)
            swept.pop(name, None)
        else:
            fixed[name] = value
            swept.pop(name, None)
    check_keywords(function, scene, fixed, states=True)
    return scene.replace(axes=swept, initial=start, **fixed) if axes else scene


def with_parameters(
    function: Callable[..., object], scene: Scene, parameters: Mapping[str, object], **settings: object
) -> Scene:
    """Return the scene with the settings that a function needs and the parameters that its caller
    passed.

    Raises
    ------
    ValueError
        If a name is no parameter or setting of the scene, or a setting that the function sets
        itself.
    """
    check_keywords(function, a_scene(scene), parameters, taken=settings)
    return scene.replace(**settings, **parameters)


def check_keywords(
    function: Callable[..., object],
    scene: Scene,
    names: Iterable[str],
    *,
    states: bool = False,
    taken: Iterable[str] = (),
) -> None:
    """Raise ValueError for a name that is no parameter or setting of the scene nor, with `states`,
    an initial state.

    The function's own keywords are among the known names, since one of them may be what was meant;
    settings that are `taken` are not.
    """
    settings = [name for name in KEYWORDS if name not in taken]
    strange = next((n for n in names if not (scene.takes(n) or n in settings or (states and _state(scene, n)))), None)
    if strange is not None:
        initial = scene.equations.state if states else ()
        known = dict.fromkeys((*scene.parameters, *initial, *_own(function), *settings))
        raise ValueError(
            f"unknown parameter or keyword {strange!r} of {function.__name__}; known: {', '.join(known)}"
            f"{suggestion(strange, known)}"
        )


def _state(scene: Scene, name: str) -> NodeName | None:
    """The parts of the name of an initial state, None for another name; equations are derived only
    for a name that looks like one.
    """
    state = NodeName.parse(name)
    return state if state and state.base in scene.components and name in scene.equations.state else None


def _own(function: Callable[..., object]) -> list[str]:
    """The names of a function's keywords, without the scene and the collection of parameters."""
    arguments = inspect.signature(function).parameters.values()
    return [a.name for a in arguments if a.kind is not a.VAR_KEYWORD and a.name != "scene"]
