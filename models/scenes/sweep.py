"""The axes of a scene, checked against its model."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import sympy as sp

from ..dynamics.periodicity import as_function, names_in
from ..inputs.checks import choice, shown
from .axis import LIMIT, Axis, known_length
from .model import bare, check_state, components, in_range, model_parameters, unknown
from .parameters import drive, known_name

__all__ = ["check_sweep", "read_axes", "rest_in_sweep"]

CONTINUATIONS = ("none", "up", "down")

CELL_LIMIT = 10**9
"""Most cells of a sweep; results of as many go to a file, block by block (`synchain.runtime.stream`)."""

SAMPLE_LIMIT = 10**9
"""Most numbers in the trajectories of all cells, 8 GB."""


def check_sweep(made: dict[str, Any]) -> None:
    """Check `axes` (a tuple), `zipped` and `continuation`."""
    if not isinstance(made["zipped"], bool):
        raise TypeError(f"zipped: found {shown(made['zipped'])}; expected true or false")
    axes = made["axes"]
    names = [axis.name for axis in axes]
    for i, axis in enumerate(axes):
        _axis(made, axis)
        if axis.name in names[:i]:
            raise ValueError(f"axis {axis.name!r} occurs twice; expected each axis once; merge their values")
    if made["zipped"] and len({len(axis) for axis in axes}) > 1:
        lengths = ", ".join(f"{axis.name}: {len(axis)}" for axis in axes)
        raise ValueError(f"zipped axes have different lengths ({lengths}); expected one length for all")
    cells = _cells([len(axis) for axis in axes], made["zipped"])
    _period(made)
    _samples(made, cells)
    _continuation(made)


def _cells(lengths: Sequence[int], zipped: object) -> int:
    """Return the number of cells of axes of these lengths; ValueError where they or the values are too many."""
    cells = max(lengths, default=1) if zipped is True else math.prod(lengths)
    if cells > CELL_LIMIT:
        raise ValueError(
            f"sweep: found {cells} cells; expected at most {CELL_LIMIT}; use fewer values or split the sweep"
        )
    if sum(lengths) > LIMIT:
        raise ValueError(
            f"sweep: found {sum(lengths)} values on {len(lengths)} axes together; expected at most {LIMIT}; "
            "use fewer values or split the sweep"
        )
    return cells


def _period(made: Mapping[str, Any]) -> None:
    """Refuse a drive that stands still in a cell whose times count its periods."""

    if not made["axes"] or made["time_unit"] != "period":
        return
    found = rest_in_sweep(drive(made).frequency, made["parameters"], made["axes"], made["zipped"])
    if found is not None:
        raise ValueError(
            f"axis {found[0]}: found {found[1]:g}, at which the drive has no period; "
            'expected other values or time_unit = "time"'
        )


def _samples(made: Mapping[str, Any], cells: int) -> None:
    """Refuse trajectories that fit into no memory."""
    if "trajectory" not in made["record"]:
        return
    numbers = cells * made["samples"] * bare(made).dimension
    if numbers > SAMPLE_LIMIT:
        raise ValueError(
            f"trajectory: found {numbers} numbers in {cells} cells of {made['samples']} samples; expected at most "
            f"{SAMPLE_LIMIT}, the results must fit into memory; take fewer samples or cells"
        )


def read_axes(given: object, zipped: object) -> tuple[Axis, ...]:
    """Return the axes of a list of Axis objects or of a table of names and values, whose cells are counted first."""
    if isinstance(given, Mapping):
        _cells([known_length(values) for values in given.values()], zipped)
        return tuple(Axis.from_table(name, values) for name, values in given.items())
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise TypeError(f"axes: found {shown(given)}; expected Axis objects, e.g. [Axis('sigma', [0.1, 0.2])]")
    axes = []
    for axis in given:
        if not isinstance(axis, Axis):
            raise TypeError(f"axes: found {shown(axis)}; expected an Axis, e.g. Axis('sigma', [0.1, 0.2])")
        axes.append(axis)
    return tuple(axes)


def _axis(made: Mapping[str, Any], axis: Axis) -> None:
    known, parameter = model_parameters(made), known_name(made, axis.name)
    if parameter is not None:
        for value in (min(axis.values), max(axis.values)):
            in_range(f"axis {axis.name}", value, parameter)
        if axis.name not in made["parameters"]:
            raise ValueError(
                f"axis {axis.name!r}: the nodes have different values of it; expected the parameter of one node, e.g. "
                f"{axis.name}_1"
            )
    else:
        own = components(made)
        if axis.name.rpartition("_")[0] not in own:
            states = tuple(f"{c}_1" for c in own)
            raise ValueError(unknown(made, axis.name, "axis", (*known, *states)))
        check_state(made, axis.name, "axis")


def _continuation(made: dict[str, Any]) -> None:
    made["continuation"] = choice("continuation", made["continuation"], CONTINUATIONS)
    if made["continuation"] == "none":
        return
    axes = made["axes"]
    if not axes:
        raise ValueError(f"continuation: found {made['continuation']!r} without axes; expected a sweep; add an axis")
    for axis in axes if made["zipped"] else axes[-1:]:
        if known_name(made, axis.name) is None:
            raise ValueError(
                f"continuation along the initial state {axis.name!r}: a continued cell starts where its "
                "neighbour ended; expected a parameter as the last axis; reorder the axes"
            )
    values = axes[-1].values
    if any(b <= a for a, b in pairwise(values)):
        raise ValueError(
            f"continuation along axis {axes[-1].name!r}: its values do not rise; expected rising values; sort them"
        )


def rest_in_sweep(
    frequency: sp.Expr, parameters: Mapping[str, float], axes: Sequence[Axis], zipped: bool
) -> tuple[str, float] | None:
    """The name of an axis and a value of it at which a frequency is 0, None if there is none.

    Grids in which several axes move the frequency are not searched.
    """
    names = names_in(frequency)
    moving = {axis.name: axis.values for axis in axes if axis.name in names}
    if not moving or (len(moving) > 1 and not zipped):
        return None
    columns = [moving.get(name, itertools.repeat(parameters.get(name, math.nan))) for name in names]
    at = next((k for k, found in enumerate(map(as_function(frequency), *columns)) if found == 0.0), None)
    first = next(iter(moving))
    return None if at is None else (first, moving[first][at])
