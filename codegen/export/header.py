"""Write the comment at the head of exported text: the equations, and the order of states and parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import check_number, short_repr, suggestion
from synchain.models.presentation.equations_text import text

from .body import check_inertia
from .exported_events import without_events
from .portable_names import portable

SHOWN = 12  # largest number of states that are all listed; of more, only the first and the last are listed


@dataclass(frozen=True, slots=True)
class Exported:
    """What an export contains: equations with the names of its text, parameter values (may be empty), lines of its header."""

    model: Equations
    numbers: dict[str, float]
    head: list[str]

    @classmethod
    def of(cls, equations: Equations, values: Mapping[str, float] | None, language: str) -> Exported:
        """Rename symbols; raise ValueError for unsuitable values, and for masses that the language cannot handle."""
        checked = _checked(equations, values)
        model, changed = portable(equations)
        model.expect_pairs(f"export to {language}")
        if model.joined:
            raise ValueError(f"export to {language}: found contacts or stops in links; expected links of forces alone")
        if any(row.in_order for node in model.nodes for row in node.rows):
            raise ValueError(f"export to {language}: found stops with in_order = True; expected False")
        if any(row.redundant for node in model.nodes for row in node.rows):
            raise ValueError(
                f"export to {language}: found contacts that depend on each other; expected independent ones"
            )
        check_inertia(model, language)
        numbers = dict(zip(model.parameters, checked.values(), strict=bool(checked)))

        # the head, without comment marks
        try:
            formulas = text(equations).splitlines()
        except ValueError:  # some function has no short form; the exported code contains the function
            formulas = ["(equations with functions that have no short form: see below)"]
        states = list(model.state)
        if len(states) > SHOWN:
            states = [*states[:3], "…", *states[-3:]]
        names = [f"{name} = {numbers[name]!r}" if name in numbers else name for name in model.parameters]
        lines = [
            f"{equations.n} oscillator{'s' * (equations.n != 1)}, {equations.link_count} links, written by synchain",
            "",
            *formulas,
            "",
            f"State ({equations.dimension}): {', '.join(states)}",
            f"Parameters ({len(names)}): {', '.join(names) or 'none'}",
            f"Equations: {equations.digest[:16]}",
            *without_events(model, language),
            *(f"Renamed: {old} is called {new}" for old, new in changed.items()),
        ]
        return cls(model, numbers, [" ".join(line.splitlines()) for line in lines])


def _checked(equations: Equations, values: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of all parameters, {} for None; raise ValueError if one is unknown, missing or not finite."""
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
