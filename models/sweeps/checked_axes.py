"""Check the axes of a scene against its model."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import sympy as sp

from ..dynamics.periodicity import as_function, names_in
from ..inputs.checks import short_repr
from ..inputs.names import NodeName, expect_free
from ..inputs.words import Word
from ..networks.model import WEIGHTS, Model, in_range
from .axis import LIMIT, Axis, known_length
from .parameters import drive


class Continuation(Word):
    """Direction along the last axis in which each cell starts from the final state of its neighbour."""

    NONE = "none"
    UP = "up"
    DOWN = "down"


CELL_LIMIT = 10**9  # most cells of a sweep, a choice; large results go to a file, block by block (`synchain.stream`)
SAMPLE_LIMIT = 10**9  # most numbers in the trajectories of all cells, 8 GB


def check_sweep(model: Model, values: Mapping[str, Any]) -> Continuation:
    """Check the axes of a scene and return its continuation."""
    zipped, axes, parameters = values["zipped"], values["axes"], values["parameters"]
    if not isinstance(zipped, bool):
        raise TypeError(f"zipped: found {short_repr(zipped)}; expected true or false")
    # Names: each a parameter or a state, and used once.
    names = [axis.name for axis in axes]
    for i, axis in enumerate(axes):
        _check_axis(model, parameters, axis)
        expect_free(f"axis {axis.name}", [axis.name])
        if axis.name in names[:i]:
            raise ValueError(f"axis {axis.name!r} occurs twice; expected each axis once; merge their values")
    # Numbers of cells and samples.
    if zipped and len({len(axis) for axis in axes}) > 1:
        lengths = ", ".join(f"{axis.name}: {len(axis)}" for axis in axes)
        raise ValueError(f"zipped axes have different lengths ({lengths}); expected one length for all")
    cells = _cells([len(axis) for axis in axes], zipped)
    if "trajectory" in values["record"]:
        numbers = cells * values["samples"] * model.unlinked.dimension
        if numbers > SAMPLE_LIMIT:
            raise ValueError(
                f"trajectory: found {numbers} numbers in {cells} cells of {values['samples']} samples; expected at most "
                f"{SAMPLE_LIMIT}, the results must fit into memory; take fewer samples or cells"
            )
    # The drive must have a period in every cell if times count its periods.
    if values["time_unit"] == "period" and axes:
        rest = rest_in_sweep(drive(model, parameters).frequency, parameters, axes, zipped)
        if rest is not None:
            raise ValueError(
                f"axis {rest[0]}: found {rest[1]:g}, at which the drive has no period; "
                'expected other values or time_unit = "time"'
            )
    # A continued cell starts from the final state of its neighbour along the last axis.
    continuation = Continuation.parse("continuation", values["continuation"])
    if continuation == Continuation.NONE or not axes:  # a run may sweep a scene without axes
        return continuation
    for axis in axes if zipped else axes[-1:]:
        if model.parameter(axis.name) is None:
            raise ValueError(
                f"continuation along the initial state {axis.name!r}: a continued cell starts where its "
                "neighbour ended; expected a parameter as the last axis; reorder the axes"
            )
    if any(b <= a for a, b in pairwise(axes[-1].values)):
        raise ValueError(
            f"continuation along axis {axes[-1].name!r}: its values do not rise; expected rising values; sort them"
        )
    return continuation


def check_draws(model: Model, values: Mapping[str, Any], drawn: Sequence[Axis]) -> None:
    """Raise ValueError for draws that are unknown, out of range or also swept, and for continued realisations."""
    swept = {axis.name for axis in values["axes"]}
    for axis in drawn:
        if axis.name in swept:
            raise ValueError(f"draw {axis.name!r}: it is an axis as well; expected one of them")
        _check_axis(model, values["parameters"], axis)
    for name in values["draws"]:
        expect_free(f"draw {name}", [name, f"{name}_link"], swept)
    if drawn and values["continuation"] != Continuation.NONE:
        raise ValueError(
            f"continuation: found {str(values['continuation'])!r} with realisations; expected none of either"
        )


def check_cells(axes: Sequence[Axis], zipped: object, realisations: int) -> None:
    """Raise ValueError for too many cells; called before numbers are drawn for the realisations."""
    lengths = [len(axis) for axis in axes]
    _cells([*(lengths[:1] if zipped is True else lengths), realisations or 1], False)


def _cells(lengths: Sequence[int], zipped: object) -> int:
    """Return the number of cells of axes of these lengths; ValueError for too many cells or values."""
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


def read_axes(value: object, zipped: object) -> tuple[Axis, ...]:
    """Return the axes from a list of Axis objects or a table; check the number of cells before making any values."""
    if isinstance(value, Mapping):
        _cells([known_length(values) for values in value.values()], zipped)
        return tuple(Axis.from_table(name, values) for name, values in value.items())
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        raise TypeError(f"axes: found {short_repr(value)}; expected Axis objects, e.g. [Axis('sigma', [0.1, 0.2])]")
    axes = []
    for axis in value:
        if not isinstance(axis, Axis):
            raise TypeError(f"axes: found {short_repr(axis)}; expected an Axis, e.g. Axis('sigma', [0.1, 0.2])")
        axes.append(axis)
    return tuple(axes)


def _check_axis(model: Model, parameters: Mapping[str, float], axis: Axis) -> None:
    """Raise ValueError for an axis that is neither a parameter in its range nor an initial state."""
    parameter = model.parameter(axis.name)
    if parameter is not None:
        for value in (min(axis.values), max(axis.values)):
            in_range(f"axis {axis.name}", value, parameter)
        if axis.name not in parameters:
            one = next(map(str, model.link_names(axis.name).values()), str(NodeName(axis.name, 0)))
            raise ValueError(
                f"axis {axis.name!r}: nodes or links have different values of it; expected the parameter of one, e.g. {one}"
            )
        return
    if axis.name == WEIGHTS and model.link_names(WEIGHTS):
        one = next(map(str, model.link_names(WEIGHTS).values()))
        raise ValueError(
            f"axis {axis.name!r}: each link has a weight; expected that of one link, e.g. {one}, or it in draws"
        )
    parts = NodeName.parse(axis.name)
    if parts is None or parts.base not in model.components:
        states = tuple(str(NodeName(c, 0)) for c in model.components)
        raise ValueError(model.unknown(axis.name, "axis", (*model.parameters, *states)))
    model.check_state(axis.name, "axis")


def rest_in_sweep(
    frequency: sp.Expr, parameters: Mapping[str, float], axes: Sequence[Axis], zipped: bool
) -> tuple[str, float] | None:
    """Return the name of an axis and the first value at which the frequency is 0; None if there is no such value."""
    # A grid in which several axes change the frequency is not searched.
    names = names_in(frequency)
    moving = {axis.name: axis.values for axis in axes if axis.name in names}
    if not moving or (len(moving) > 1 and not zipped):
        return None
    columns = [moving.get(name, itertools.repeat(parameters.get(name, math.nan))) for name in names]
    at = next((k for k, value in enumerate(map(as_function(frequency), *columns)) if value == 0.0), None)
    first = next(iter(moving))
    return None if at is None else (first, moving[first][at])
