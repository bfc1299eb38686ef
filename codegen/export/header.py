"""The comment at the head of exported text: what the equations are, and the order of states and parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import check_number, short_repr, suggestion

from .body import check_inertia
from .portable_names import portable

SHOWN = 12
"""Of more states only the first and last are listed."""


@dataclass(frozen=True, slots=True)
class Exported:
    """Equations in names of the exported text, the values of its parameters if they are given, and the lines of its head."""

    model: Equations
    numbers: dict[str, float]
    head: list[str]

    @classmethod
    def of(cls, equations: Equations, values: Mapping[str, float] | None, language: str) -> Exported:
        """Rename what needs it; ValueError for values that do not fit, and for masses that a language cannot solve for."""
        checked = _checked(equations, values)
        model, changed = portable(equations)
        check_inertia(model, language)
        numbers = dict(zip(model.parameters, checked.values(), strict=bool(checked)))

        # the head, without comment marks
        states = list(model.state)
        if len(states) > SHOWN:
            states = [*states[:3], "…", *states[-3:]]
        names = [f"{name} = {numbers[name]!r}" if name in numbers else name for name in model.parameters]
        lines = [
            f"{equations.n} oscillator{'s' * (equations.n != 1)}, {equations.link_count} links, written by synchain",
            "",
            *_formulas(equations),
            "",
            f"State ({equations.dimension}): {', '.join(states)}",
            f"Parameters ({len(names)}): {', '.join(names) or 'none'}",
            f"Equations: {equations.digest[:16]}",
            *(f"Renamed: {old} is called {new}" for old, new in changed.items()),
        ]
        return cls(model, numbers, [" ".join(line.splitlines()) for line in lines])


def _formulas(equations: Equations) -> list[str]:
    from synchain.models.presentation.equations_text import text

    try:
        return text(equations).splitlines()
    except ValueError:  # a function that has no letter; the code below has it
        return ["(equations with functions that have no short form: see below)"]


def _checked(equations: Equations, values: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of all parameters, or none; ValueError where one is unknown, missing or not finite."""
    if values is None:
        return {}
    for name in values:
        if name not in equations.parameters:
            valid = ", ".join(equations.parameters) or "none"
            raise ValueError(
                f"unknown parameter {short_repr(name)}; known: {valid}{suggestion(name, equations.parameters)}"
            )
    for name in equations.parameters:
        if name not in values:
            raise ValueError(
                f"parameter {name!r} has no value; expected all of {', '.join(equations.parameters)} or none"
            )
    return {name: check_number(name, values[name]) for name in equations.parameters}
