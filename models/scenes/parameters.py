"""The parameters of a scene: one number each, or a list with one number for each node (a_1 … a_n)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from ..inputs.checks import shown, table
from ..inputs.frozen import Frozen
from ..mechanics.parameter import Parameter
from .model import bare, by_kind, in_range, known_parameters, model_parameters, unknown

if TYPE_CHECKING:
    from ..dynamics.periodicity import Drive

__all__ = ["at_nodes", "collected", "drive", "known_name", "node_parameter", "parameters", "varied", "without"]

T = TypeVar("T")


def node_parameter(made: Mapping[str, Any], name: str) -> tuple[str, int] | None:
    """Return ("a", 1) for the name "a_2" of a parameter of the second node, None for any other name."""
    base, _, index = name.rpartition("_")
    if name in model_parameters(made) or not (index.isascii() and index.isdecimal() and index[0] != "0"):
        return None
    holders = _holders(made, base)
    if len(index) > 9 or int(index) - 1 not in holders:
        return None
    return base, int(index) - 1


def _holders(made: Mapping[str, Any], name: str) -> tuple[int, ...]:
    """The nodes (0-based) that have a parameter, none for one of the links."""
    nodes = bare(made)
    return nodes.holders(name) if any(s.name == name for one in nodes.nodes for s in one.parameters) else ()


def _defaults(made: Mapping[str, Any], name: str) -> list[float]:
    """What a parameter is at each node that has it: its default in that node's kind."""
    templates, kinds = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    tables = [known_parameters(oscillator, friction, made["contact"], None) for oscillator, friction in templates]
    return [float(tables[kinds[i] if kinds else 0][name].default) for i in _holders(made, name)]


def known_name(made: Mapping[str, Any], name: str) -> Parameter | None:
    """Return the parameter that a name such as "a" or "a_2" means, None where it means none."""
    known, found = model_parameters(made), node_parameter(made, name)
    return known.get(name) if found is None else known[found[0]]


def parameters(made: Mapping[str, Any]) -> Frozen[float]:
    """Return every parameter with its value; those that differ from node to node, or are swept at one, as a_1 … a_n."""
    known = model_parameters(made)
    given = table("parameters", {} if made["parameters"] is None else made["parameters"])
    shared = {name: float(known[name].default) for name in known}
    lists: dict[str, list[float]] = {name: _defaults(made, name) for name in known} if made["nodes"] else {}
    single: dict[str, dict[int, float]] = {}
    for name, value in given.items():
        if not isinstance(name, str):
            raise TypeError(f"parameters: key {shown(name)} is a {type(name).__name__}; expected text")
        found = node_parameter(made, name)
        if found is not None:
            single.setdefault(found[0], {})[found[1]] = in_range(name, value, known[found[0]])
        elif name not in known:
            raise ValueError(unknown(made, name, "parameter", known))
        elif _listed(value):
            lists[name] = _for_each_node(made, name, value)
        else:
            shared[name] = in_range(name, value, known[name])
            lists.pop(name, None)
    for base in {found[0] for axis in made["axes"] if (found := node_parameter(made, axis.name)) is not None}:
        single.setdefault(base, {})
    return Frozen(_flat(made, shared, lists, single))


def _flat(
    made: Mapping[str, Any],
    shared: dict[str, float],
    lists: dict[str, list[float]],
    single: dict[str, dict[int, float]],
) -> dict[str, float]:
    swept = {found[0] for axis in made["axes"] if (found := node_parameter(made, axis.name)) is not None}
    made_of: dict[str, float] = {}
    for name, value in shared.items():
        holders = _holders(made, name)
        values = dict(zip(holders, lists.get(name) or [value] * len(holders), strict=True)) | single.get(name, {})
        if name in swept or len(set(values.values())) > 1:
            made_of |= {f"{name}_{i + 1}": own for i, own in values.items()}
        else:
            made_of[name] = next(iter(values.values()), value)
    return made_of


def _listed(value: object) -> bool:
    return (
        not isinstance(value, str | bytes | Mapping) and isinstance(value, Iterable) and getattr(value, "ndim", 1) > 0
    )


def _for_each_node(made: Mapping[str, Any], name: str, value: Any) -> list[float]:
    """The values of a list, one for each node that has the parameter; ValueError for another number or for links."""
    parameter, holders = model_parameters(made)[name], _holders(made, name)
    n = len(holders)
    if not holders:
        raise ValueError(
            f"parameter {name!r} belongs to the links, which share it; expected one number: give links weights instead"
        )
    if isinstance(value, set | frozenset):
        raise TypeError(f"parameter {name!r}: found a set, which has no order; expected a number or {n} numbers")
    listed = list(islice(value.tolist() if hasattr(value, "tolist") else value, n + 1))
    if len(listed) != n:
        count = f"more than {n}" if len(listed) > n else str(len(listed))
        raise ValueError(
            f"parameter {name!r}: found {count} values for {n} oscillators; expected {n} values or one number for all"
        )
    return [in_range(f"{name}_{i + 1}", entry, parameter) for i, entry in zip(holders, listed, strict=True)]


def varied(values: Mapping[str, float], known: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the parameters that have a value for each node."""
    return tuple(name for name in known if name not in values)


def at_nodes(made: Mapping[str, Any], values: Mapping[str, T]) -> Iterator[tuple[str, str | None, dict[str, T]]]:
    """Yield (oscillator, friction law, parameters) of every node that differs from those before.

    The keys of `values` are the parameters of the scene (a, or a_1 … a_n), those of what is yielded the node's own (a).
    """
    templates, kinds = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
    known = model_parameters(made)
    own = {name: dict.fromkeys(_holders(made, name)) for name in known if name not in values}
    seen = set()
    for i in range(made["topology"].n if kinds or own else 1):
        mine = {name: values[f"{name}_{i + 1}" if name in own else name] for name in known if i in own.get(name, (i,))}
        pair = templates[kinds[i] if kinds else 0]
        key = (pair, *mine.items())
        if key not in seen:
            seen.add(key)
            yield *pair, mine


def drive(made: Mapping[str, Any]) -> Drive:
    """Return at which frequencies time enters the equations of a scene whose parameters are complete."""
    from ..dynamics.periodicity import drive_of

    return drive_of(bare(made).nodes, varied(made["parameters"], model_parameters(made)))


def without(values: Mapping[str, Any], names: Iterable[str], varied: Iterable[str]) -> dict[str, Any]:
    """Return the values without those that nodes have of some `names` in `varied`."""
    gone = set(names) & set(varied)
    return {name: value for name, value in values.items() if name in varied or name.rpartition("_")[0] not in gone}


def collected(values: Mapping[str, float], varied: Iterable[str]) -> dict[str, float | list[float]]:
    """Return the parameters as a scene file has them: those of `varied` as lists."""
    found: dict[str, float | list[float]] = {}
    for name, value in values.items():
        base = name.rpartition("_")[0]
        if base in varied:
            found.setdefault(base, []).append(value)  # type: ignore[union-attr]
        else:
            found[name] = value
    return found
