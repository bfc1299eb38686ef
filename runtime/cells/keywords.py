"""Keywords of functions that take parameters of a scene beside keywords of their own: run(scene, workers=2, omega=1.2)."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from synchain.models.inputs.checks import suggestion
from synchain.models.scenes.scene import KEYWORDS, Scene, a_scene

__all__ = ["check_keywords", "with_parameters"]


def with_parameters(
    function: Callable[..., Any], scene: Scene, parameters: Mapping[str, Any], **settings: Any
) -> Scene:
    """The scene with the settings that a function needs and the parameters that it was given.

    Raises ValueError as `check_keywords` does; what the function sets itself cannot be given.
    """
    check_keywords(function, a_scene(scene), parameters, taken=settings)
    return scene.replace(**settings, **parameters)


def check_keywords(
    function: Callable[..., Any],
    scene: Scene,
    given: Iterable[str],
    states: Iterable[str] = (),
    taken: Iterable[str] = (),
) -> None:
    """Raise ValueError for a name that is no parameter or setting of the scene, nor one of the `states`.

    The function's own keywords are among the known names, since one of them may be what was meant; settings that are
    `taken` are not.
    """
    states = tuple(states)
    settings = [name for name in KEYWORDS if name not in taken]
    strange = next((name for name in given if not (scene.takes(name) or name in states or name in settings)), None)
    if strange is not None:
        known = dict.fromkeys((*scene.parameters, *states, *_own(function), *settings))
        raise ValueError(
            f"unknown parameter or keyword {strange!r} of {function.__name__}; known: {', '.join(known)}"
            f"{suggestion(strange, known)}"
        )


def _own(function: Callable[..., Any]) -> list[str]:
    """The names of a function's keywords, without the scene and the collection of parameters."""
    arguments = inspect.signature(function).parameters.values()
    return [a.name for a in arguments if a.kind is not a.VAR_KEYWORD and a.name != "scene"]
