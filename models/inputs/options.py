"""Options of families: their types, ranges and canonical form."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any, TypeAlias

from .rationals import rational

__all__ = ["Option", "Options", "as_options", "probability", "whole", "whole_numbers"]

Option: TypeAlias = int | str | tuple[int, ...]

Options: TypeAlias = tuple[tuple[str, Option], ...]
"""Names and values, sorted by name."""

_LIST = re.compile(r"[\s\d]+([,x][\s\d]+)+", re.ASCII)

_WHOLE = re.compile(r"[+-]?\d{1,18}", re.ASCII)


def as_options(given: Mapping[str, Any]) -> Options:
    """Names and values as they are stored: sorted, lists as tuples."""
    return tuple((key, tuple(v) if isinstance(v, list) else v) for key, v in sorted(given.items()))


def whole(what: str, value: Any, least: int) -> int:
    """A whole number (text allowed) of at least `least`; ValueError or TypeError in the words of the caller."""
    if isinstance(value, str) and _WHOLE.fullmatch(value.strip()):
        value = int(value)
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise TypeError(f"{what} = {value!r}; expected a whole number")
    number = int(value.__index__())
    if number < least:
        raise ValueError(f"{what} = {number}; expected at least {least}")
    return number


def whole_numbers(what: str, value: Any, least: int) -> tuple[int, ...]:
    """Whole numbers of at least `least`: a list, one number, or a text such as "1,3" or "3x4"."""
    if isinstance(value, str):
        value = re.split("[,x]", value) if _LIST.fullmatch(value) else [value]
    elif hasattr(value, "__index__"):
        value = [value]
    if not isinstance(value, Iterable):
        raise TypeError(f"{what} = {value!r}; expected a list of whole numbers, e.g. [1, 3]")
    found = tuple(whole(what, entry, least) for entry in value)
    if not found:
        raise ValueError(f"{what} is empty; expected at least one whole number")
    return found


def probability(what: str, value: Any) -> str:
    """A rational from 0 to 1 as text such as "1/10"; a float means its shortest decimal."""
    found: Fraction = rational(value, what)
    if not 0 <= found <= 1:
        raise ValueError(f"{what} = {found}; expected a probability from 0 to 1")
    return str(found)
