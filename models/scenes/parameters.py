"""The parameters of a scene: one number each, or a list with one number for each node (a_1 … a_n)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from ..dynamics.periodicity import Drive, drive_of
from ..inputs.checks import check_table, first_of, short_repr
from ..inputs.frozen import Frozen
from ..inputs.node_name import NodeName
from .axis import Axis
from .model import Model, NodeKind, in_range

__all__ = ["at_nodes", "collected", "drive", "parameters", "varied", "without"]

T = TypeVar("T")


def parameters(model: Model, given: object, axes: Sequence[Axis]) -> Frozen[float]:
    """Return every parameter with its value; those that differ from node to node, or are swept at one, as a_1 … a_n.

    Parameters
    ----------
    model : Model
        The model that has the parameters.
    given : object
        A table of names and values: a number, one for each node, or the parameter of one node ("a_2"); None for none.
    axes : sequence of Axis
        The axes of the sweep.

    Raises
    ------
    ValueError, TypeError
        For unknown names, values out of range, and lists of another length.
    """
    known = model.parameters
    shared = {name: float(known[name].default) for name in known}
    lists = {name: model.defaults(name) for name in known} if len(model.kinds) > 1 else {}
    single: dict[str, dict[int, float]] = {}
    for name, value in check_table("parameters", {} if given is None else given).items():
        if not isinstance(name, str):
            raise TypeError(f"parameters: key {short_repr(name)} is a {type(name).__name__}; expected text")
        parts = model.node_parameter(name)
        if parts is not None:
            single.setdefault(parts.base, {})[parts.index] = in_range(name, value, known[parts.base])
        elif name not in known:
            raise ValueError(model.unknown(name, "parameter", known))
        elif _listed(value):
            lists[name] = _for_each_node(model, name, value)
        else:
            shared[name] = in_range(name, value, known[name])
            lists.pop(name, None)
    swept = {parts.base for axis in axes if (parts := model.node_parameter(axis.name)) is not None}
    values: dict[str, float] = {}
    for name, value in shared.items():
        holders = model.holders(name)
        own = dict(zip(holders, lists.get(name) or [value] * len(holders), strict=True)) | single.get(name, {})
        if name in swept or len(set(own.values())) > 1:
            values |= {str(NodeName(name, i)): number for i, number in own.items()}
        else:
            values[name] = next(iter(own.values()), value)
    return Frozen(values)


def _listed(value: object) -> bool:
    return (
        not isinstance(value, str | bytes | Mapping) and isinstance(value, Iterable) and getattr(value, "ndim", 1) > 0
    )


def _for_each_node(model: Model, name: str, value: Any) -> list[float]:
    """The values of a list, one for each node that has the parameter; ValueError for another number or for links."""
    parameter, holders = model.parameters[name], model.holders(name)
    n = len(holders)
    if not holders:
        raise ValueError(
            f"parameter {name!r} belongs to the links, which share it; expected one number: give links weights instead"
        )
    if isinstance(value, set | frozenset):
        raise TypeError(f"parameter {name!r}: found a set, which has no order; expected a number or {n} numbers")
    listed, count = first_of(value.tolist() if hasattr(value, "tolist") else value, n)
    if len(listed) != n:
        raise ValueError(
            f"parameter {name!r}: found {count} values for {n} oscillators; expected {n} values or one number for all"
        )
    return [in_range(str(NodeName(name, i)), entry, parameter) for i, entry in zip(holders, listed, strict=True)]


def varied(values: Mapping[str, float], known: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the parameters that have a value for each node."""
    return tuple(name for name in known if name not in values)


def at_nodes(model: Model, values: Mapping[str, T]) -> Iterator[tuple[NodeKind, dict[str, T]]]:
    """Yield the kind and the parameters of every node that differs from those before.

    Parameters
    ----------
    model : Model
        The model of the scene.
    values : mapping of str
        What each parameter of the scene is (a, or a_1 … a_n); what is yielded has the node's own names (a).
    """
    known = model.parameters
    own = {name: dict.fromkeys(model.holders(name)) for name in known if name not in values}
    seen = set()
    for i in range(model.n if len(model.kinds) > 1 or own else 1):
        mine = {
            name: values[str(NodeName(name, i)) if name in own else name] for name in known if i in own.get(name, (i,))
        }
        key = (model.kind_of[i], *mine.items())
        if key not in seen:
            seen.add(key)
            yield model.kinds[model.kind_of[i]], mine


def drive(model: Model, values: Mapping[str, float]) -> Drive:
    """Return at which frequencies time enters the equations of a model whose parameters have these values."""
    timed = any(coupling.forced for coupling, _ in model.linked)
    own = varied(values, model.parameters)
    return drive_of((*model.unlinked.nodes, *(model.equations(own).edges if timed else ())), own)


def without(model: Model, values: Mapping[object, object], names: Iterable[str]) -> dict[object, object]:
    """Return the values of parameters without those that single nodes have of some `names`."""
    gone = set(names)
    return {
        name: value
        for name, value in values.items()
        if not isinstance(name, str) or (parts := model.node_parameter(name)) is None or parts.base not in gone
    }


def collected(values: Mapping[str, float], varied: Iterable[str]) -> dict[str, float | list[float]]:
    """Return the parameters as a scene file has them: those of `varied` as lists."""
    lists: dict[str, list[float]] = {name: [] for name in varied}
    table: dict[str, float | list[float]] = {}
    for name, value in values.items():
        parts = NodeName.parse(name)
        if parts is not None and parts.base in lists:
            lists[parts.base].append(value)
            table.setdefault(parts.base, lists[parts.base])
        else:
            table[name] = value
    return table
