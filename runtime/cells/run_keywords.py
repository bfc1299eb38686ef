"""Parameters of a scene that a public function takes beside keywords of its own: as keywords,
run(scene, workers=2, omega=1.2), or as a mapping, run(scene, parameters={"omega": 1.2}).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from synchain.models.inputs.checks import check_number, check_table, check_text, is_row, listed, suggestion
from synchain.models.inputs.names import NodeName
from synchain.models.inputs.unsupported import unsupported
from synchain.models.scenes.scene import KEYWORDS, Scene, check_scene
from synchain.models.sweeps.parameters import without

ORBITS = {"executor": "its orbits advance on threads of this process, as many as `workers` says"}
"""What functions that advance several orbits at once do not take, and why."""

ONE_ORBIT = {name: "it advances one orbit, step after step, on one thread" for name in ("workers", "executor")}
"""What functions that advance a single orbit do not take, and why."""


SHOWN = 12
"""Most initial states that an error lists."""

ONE_CELL: Mapping[str, Any] = {
    "axes": (),
    "zipped": False,
    "continuation": "none",
    "record": (),
    "observe": None,
    "sections": None,
    "stop": None,
}
"""Settings of a scene that sweeps and records nothing, for functions that say themselves what they run."""


@dataclass(frozen=True, slots=True)
class Given:
    """Parameters of a scene as the caller of a public function gave them."""

    function: Callable[..., object]  # the function; errors name it and know its keywords
    table: Mapping[str, object] | None = None  # what was given as `parameters`
    keywords: Mapping[str, object] = field(default_factory=dict)  # what was given as further keywords
    # keywords of other functions that this one does not take, and why
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, object]:
        """All names with their values; ValueError for a name that is given twice."""
        table = {} if self.table is None else check_table("parameters", self.table)
        twice = next((name for name in table if name in self.keywords), None)
        if twice is not None:
            raise ValueError(
                f"{self.function.__name__}: found {twice!r} in `parameters` and as a keyword; expected it once"
            )
        return {check_text("parameters", name): value for name, value in (*table.items(), *self.keywords.items())}

    def scene(self, scene: Scene, free: Collection[str] = (), /, **settings: object) -> Scene:
        """Return the single cell of a scene that has these parameters, with settings that the function needs.

        The function does not depend on parameters that are `free`.
        """
        self.expect_one_cell(scene, free, stops="stop" in settings)
        numbers = self.checked(scene)
        listed = next((name for name, value in numbers.items() if is_row(value)), None)
        if listed is not None:
            raise ValueError(
                f"{self.function.__name__}: found a list for {listed!r}; expected one number, since only functions that sweep "
                f"take lists, as axes; give each node or link its own number in the scene: scene.replace({listed}=[…])"
            )
        return with_numbers(scene, numbers, **{**ONE_CELL, **settings})

    def expect_one_cell(self, scene: Scene, free: Collection[str] = (), *, stops: bool = False) -> None:
        """Raise ValueError for a scene with draws, or with axes that no parameter fixes: one cell would stand for all.

        Axes of what is `free`, on which the function does not depend, are no choice between answers.  A stop ends the
        motion; it is refused too, unless the function `stops` there.
        """
        swept = [axis.name for axis in check_scene(scene).axes if axis.name not in {*self.values, *free}]
        for what, names, remedy in (("axes", swept, "axes=()"), ("draws", scene.draws, "realisations=0, draws=None")):
            if names:
                raise ValueError(
                    f"{self.function.__name__}: found {what} of {', '.join(names)}; expected a scene without them; "
                    f"write scene.replace({remedy})"
                )
        if scene.stop is not None and not stops:
            raise ValueError(
                f"{self.function.__name__}: found stop = {scene.stop!r}; expected a scene whose motion goes on; "
                "write scene.replace(stop=None)"
            )

    def sweep(self, scene: Scene, **settings: object) -> Scene:
        """Return a scene with parameters and initial states fixed, by a number, or swept, by a
        sequence, which makes an axis after those of the scene, and with those settings that are
        not None.
        """
        fixed: dict[str, object] = {}
        swept: dict[str, object] = {axis.name: axis.values for axis in check_scene(scene).axes}
        start: dict[str, list[float]] = {}
        given = self.checked(scene, states=True)
        for name, value in given.items():
            if is_row(value):
                swept[name] = value
                continue
            if state := _state(scene, name):
                states = start.setdefault(state.base, list(scene.initial[state.base]))
                states[scene.equations.holders(state.base).index(state.index)] = check_number(name, value)
            else:
                fixed[name] = value
            swept.pop(name, None)
        settings = {name: value for name, value in settings.items() if value is not None}
        if given:
            settings["axes"] = swept
        if start:  # a scene remembers as given only what is
            settings["initial"] = {**(scene.given["initial"] or {}), **start}
        return with_numbers(scene, fixed, **settings)

    def parted(self) -> tuple[dict[str, Any], Given]:
        """Return the rows of values by name, and the same call with the numbers alone."""
        rows = {name: value for name, value in self.values.items() if is_row(value)}
        numbers = {name: value for name, value in self.values.items() if name not in rows}
        return rows, replace(self, table=numbers, keywords={})

    def checked(self, scene: Scene, states: bool = False) -> dict[str, object]:
        """Return the values; ValueError for an unknown name; with `states`, initial states are known too."""
        values = self.values
        for name in values:
            if not (scene.takes(name) or (states and _state(scene, name))):
                raise ValueError(self._refusal(scene, name, states))
        return values

    def _refusal(self, scene: Scene, name: str, states: bool) -> str:
        """Why a name is refused."""
        of, own = self.function.__name__, _own(self.function)
        if name in own:
            return f"{of}: found its keyword {name!r} in `parameters`; expected parameters of the scene"
        if name in self.refused:
            return f"{of} takes no {name!r}: {self.refused[name]}"
        if name in KEYWORDS:
            return f"{of}: {name!r} is a field of the scene; expected parameters; write scene.replace({name}=…)"
        reason = scene.model.no_link(name) or unsupported(name)
        if reason:
            return f"{of}: unknown parameter {name!r}; {reason}"
        initial = scene.equations.state if states else ()
        words = suggestion(name, (*scene.parameters, *initial, *own)) or suggestion(name, KEYWORDS)
        shown = initial if len(initial) <= SHOWN else (f"{initial[0]} … {initial[-1]}",)
        known = dict.fromkeys((*scene.parameters, *shown, *own))
        return f"unknown parameter or keyword {name!r} of {of}; known: {listed(known)}{words}"


def with_numbers(scene: Scene, values: Mapping[str, object], **settings: object) -> Scene:
    """Return a scene with some parameters changed, whatever they are called, and some settings."""
    if values:
        known: Mapping[object, object] = scene.given["parameters"] or {}
        numbers = without(scene.model, known, values)
        numbers.update(values.items())
        settings["parameters"] = numbers
    return scene.replace(**settings) if settings else scene


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
