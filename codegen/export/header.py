"""The comment at the head of exported text: what the equations are, and the order of states and parameters."""

from __future__ import annotations

from collections.abc import Mapping

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import check_number, short_repr, suggestion

__all__ = ["given_values", "header"]

SHOWN = 12
"""Of more states only the first and last are listed."""


def header(
    equations: Equations, model: Equations, changed: Mapping[str, str], values: Mapping[str, float]
) -> list[str]:
    """Return lines without comment marks; `model` has the names of the text, `changed` lists those that differ."""
    states = list(model.state)
    if len(states) > SHOWN:
        states = [*states[:3], "…", *states[-3:]]
    names = [f"{name} = {values[name]!r}" if name in values else name for name in model.parameters]
    lines = [
        f"{equations.n} oscillator{'s' * (equations.n != 1)}, {equations.link_count} links, written by synchain",
        "",
        *_equations(equations),
        "",
        f"State ({equations.dimension}): {', '.join(states)}",
        f"Parameters ({len(names)}): {', '.join(names) or 'none'}",
        f"Equations: {equations.digest[:16]}",
    ]
    lines += [f"Renamed: {old} is called {new}" for old, new in changed.items()]
    return [" ".join(line.splitlines()) for line in lines]


def _equations(equations: Equations) -> list[str]:
    from synchain.models.presentation.equations import text

    try:
        return text(equations).splitlines()
    except ValueError:  # a function that has no letter; the code below has it
        return ["(equations with functions that have no short form: see below)"]


def given_values(equations: Equations, values: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of all parameters, or none; ValueError where one is unknown, missing or not finite."""
    if values is None:
        return {}
    for name in values:
        if name not in equations.parameters:
            known = ", ".join(equations.parameters) or "none"
            raise ValueError(
                f"unknown parameter {short_repr(name)}; known: {known}{suggestion(name, equations.parameters)}"
            )
    for name in equations.parameters:
        if name not in values:
            raise ValueError(
                f"parameter {name!r} has no value; expected all of {', '.join(equations.parameters)} or none"
            )
    return {name: check_number(name, values[name]) for name in equations.parameters}
