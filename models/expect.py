"""Checks of what public functions are given: a wrong type is refused at the door, in one line."""

from __future__ import annotations

import numbers
import operator
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from .scene_checks import number, shown, typed

if TYPE_CHECKING:
    from .scene import Scene
    from .topology import Topology

__all__ = ["a_callable", "a_graph", "a_path", "a_scene", "flag", "instance", "positive", "whole"]

T = TypeVar("T")


def instance(what: str, value: object, kind: type[T] | tuple[type[T], ...], expected: str) -> T:
    """Return the value where it is of a kind, else raise TypeError that says what was expected."""
    if not isinstance(value, kind):
        raise TypeError(f"{what}: found {typed(value)}; expected {expected}")
    return value


def a_scene(value: object) -> Scene:
    """Return the value where it is a Scene, else raise TypeError."""
    from .scene import Scene

    return instance("scene", value, Scene, "a Scene, e.g. load_scene('figure_4a')")


def a_graph(what: str, value: object) -> Topology:
    """Return the value where it is a Topology, else raise TypeError."""
    from .topology import Topology

    if all(hasattr(value, need) for need in ("nodes", "edges", "is_directed")):
        raise TypeError(f"{what}: found {typed(value)}; expected a graph such as chain(4); make it with from_graph")
    return instance(what, value, Topology, "a graph, e.g. chain(4)")


def a_callable(what: str, value: object) -> Callable[..., object]:
    """Return the value where it can be called, else raise TypeError."""
    if not callable(value):
        raise TypeError(f"{what}: found {typed(value)}; expected a function")
    return value


def flag(what: str, value: object) -> bool:
    """Return the value where it is True or False, else raise TypeError."""
    return instance(what, value, bool, "True or False")


def whole(what: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number in its range; TypeError for another type, also a float that happens to be whole."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise TypeError(f"{what} = {shown(value)}; expected a whole number, e.g. {max(least, 1)}")
    found = operator.index(value)
    if found < least:
        raise ValueError(f"{what} = {found}; expected at least {least}")
    if most is not None and found > most:
        raise ValueError(f"{what} = {shown(found)}; expected at most {most}")
    return found


def positive(what: str, value: object, zero: bool = False) -> float:
    """Return a finite number above 0, or with `zero` not below it."""
    found = number(what, value, 0.0)
    if found == 0.0 and not zero:
        raise ValueError(f"{what}: found 0; expected a number above 0")
    return found


def a_path(what: str, value: object) -> Path:
    """Return a path of text or a path object; TypeError for anything else, ValueError for an empty one."""
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        raise TypeError(f"{what}: found {typed(value)}; expected a path, e.g. 'data/G.txt'")
    if not os.fspath(value).strip() or "\0" in os.fspath(value):
        raise ValueError(f"{what}: found {shown(os.fspath(value))}; expected the name of a file")
    return Path(value)
