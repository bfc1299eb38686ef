"""Parameters of a scene among the keywords of a public function: run(scene, workers=2, omega=1.2), or as a mapping,
run(scene, parameters={"omega": 1.2}).
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

# Keywords that a function of several orbits does not accept, with the reason for the error message.
ORBITS = {"executor": "its orbits advance on threads of this process, as many as `workers` says"}
# Keywords that a function of a single orbit does not accept, with the reason for the error message.
ONE_ORBIT = {name: "it advances one orbit, step after step, on one thread" for name in ("workers", "executor")}
SHOWN = 12  # largest number of initial states in an error message: a choice

# Settings of a scene without sweep and records, for functions that choose their own cells and records.
ONE_CELL: Mapping[str, Any] = {
    "axes": (),
    "zipped": False,
    "continuation": "none",
    "record": (),
    "t_eval": None,
    "observe": None,
    "sections": None,
    "stop": None,
}


@dataclass(frozen=True, slots=True)
class Given:
    """Values of parameters in the call of a public function."""

    function: Callable[..., object]  # the public function, for the names in error messages
    table: Mapping[str, object] | None = None  # the argument `parameters`
    keywords: Mapping[str, object] = field(default_factory=dict)  # further keywords
    # keywords of other functions that this function does not accept, with the reason
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
        """Return a scene of a single cell with these parameters, and with the settings that the function needs."""
        # `free`: names of parameters on which the function does not depend.
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
        """Raise ValueError for a scene with draws, or with axes that no parameter of the call fixes."""
        # Axes of parameters that are `free`, on which the function does not depend, are accepted. A stop raises
        # ValueError too, unless the function `stops` there.
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
        """Return a scene with the values of the call: numbers fix parameters or initial states, sequences sweep them.

        A sequence makes an axis after the axes of the scene. A setting that is None keeps the scene's.
        """
        fixed: dict[str, object] = {}
        swept: dict[str, object] = {axis.name: axis.values for axis in check_scene(scene).axes}
        start: dict[str, list[float]] = {}
        values = self.checked(scene, states=True)
        for name, value in values.items():
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
        if values:
            settings["axes"] = swept
        if start:  # other components keep their defaults, which may depend on other keywords
            settings["initial"] = {**(scene.given["initial"] or {}), **start}
        return with_numbers(scene, fixed, **settings)

    def parted(self) -> tuple[dict[str, Any], Given]:
        """Return the sequences of values by name, and the same call with the single numbers only."""
        rows = {name: value for name, value in self.values.items() if is_row(value)}
        numbers = {name: value for name, value in self.values.items() if name not in rows}
        return rows, replace(self, table=numbers, keywords={})

    def checked(self, scene: Scene, states: bool = False) -> dict[str, object]:
        """Return the values; ValueError for a name that is no parameter (with `states`: and no initial state)."""
        values = self.values
        for name in values:
            if not (scene.takes(name) or (states and _state(scene, name))):
                raise ValueError(self._refusal(scene, name, states))
        return values

    def _refusal(self, scene: Scene, name: str, states: bool) -> str:
        arguments = inspect.signature(self.function).parameters.values()
        keywords = [a.name for a in arguments if a.kind is not a.VAR_KEYWORD and a.name != "scene"]
        of = self.function.__name__
        if name in keywords:
            return f"{of}: found its keyword {name!r} in `parameters`; expected parameters of the scene"
        if name in self.refused:
            return f"{of} takes no {name!r}: {self.refused[name]}"
        if name in KEYWORDS:
            return f"{of}: {name!r} is a field of the scene; expected parameters; write scene.replace({name}=…)"
        reason = scene.model.no_link(name) or unsupported(name)
        if reason:
            return f"{of}: unknown parameter {name!r}; {reason}"
        initial = scene.equations.state if states else ()
        hint = suggestion(name, (*scene.parameters, *initial, *keywords)) or suggestion(name, KEYWORDS)
        shown = initial if len(initial) <= SHOWN else (f"{initial[0]} … {initial[-1]}",)
        valid_names = dict.fromkeys((*scene.parameters, *shown, *keywords))
        return f"unknown parameter or keyword {name!r} of {of}; known: {listed(valid_names)}{hint}"


def chosen(scene: Scene, name: str, keyword: Any, default: Any) -> Any:
    """Return a keyword; if None, the scene's value if it differs from the default of `Scene`."""
    # Else the function's default.
    if keyword is not None:
        return keyword
    value = getattr(check_scene(scene), name)
    return default if value == inspect.signature(Scene).parameters[name].default else value


def with_numbers(scene: Scene, values: Mapping[str, object], **settings: object) -> Scene:
    """Return a scene with changed parameters and settings; a parameter may have the name of a keyword."""
    if values:
        parameters: Mapping[object, object] = scene.given["parameters"] or {}
        changed = without(scene.model, parameters, values)
        changed.update(values.items())
        settings["parameters"] = changed
    return scene.replace(**settings) if settings else scene


def _state(scene: Scene, name: str) -> NodeName | None:
    """Return the parts of the name of an initial state, or None; derive equations only for names of that form."""
    state = NodeName.parse(name)
    return state if state and state.base in scene.components and name in scene.equations.state else None
