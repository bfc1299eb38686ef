"""Convert options of graph families, which may be text from a command line, to canonical form."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, SupportsIndex, TypeAlias

from .checks import check_integer, short_repr
from .rational_text import rational

Option: TypeAlias = int | str | tuple[int, ...]

Options: TypeAlias = tuple[tuple[str, Option], ...]  # names and values, sorted by name

_LIST = re.compile(r"[\s\d]+([,x][\s\d]+)+", re.ASCII)

_INTEGER = re.compile(r"[+-]?\d{1,18}", re.ASCII)


def as_options(options: Mapping[str, Any]) -> Options:
    """Convert options to the form that a topology stores: sorted by name, lists as tuples."""
    return tuple((key, tuple(v) if isinstance(v, list) else v) for key, v in sorted(options.items()))


def integer_option(what: str, value: object, low: int, high: int | None = None) -> int:
    """Convert a whole number or its text to an int.

    Parameters
    ----------
    what : str
        Name of the option in messages, such as ``"seed"``.
    value : object
        The value of the option; a command line gives text.
    low, high : int, optional
        The closed range of allowed numbers.

    Returns
    -------
    int
        The number.

    Raises
    ------
    TypeError
        If the value is no whole number.
    ValueError
        If the number is out of range.

    See Also
    --------
    synchain.plugins.Family
    synchain.plugins.integers_option

    Examples
    --------
    >>> from synchain.plugins import integer_option
    >>> integer_option("step", "2", 1)
    2
    """
    if isinstance(value, str) and _INTEGER.fullmatch(value.strip()):
        value = int(value)
    return check_integer(what, value, low, high)


def integers_option(what: str, value: object, low: int) -> tuple[int, ...]:
    """Return whole numbers from a list, one number, or a text such as "1,3" or "3x4".

    Parameters
    ----------
    what : str
        Name of the option in messages, such as ``"shape"``.
    value : object
        The value of the option.
    low : int
        The smallest allowed number.

    Returns
    -------
    tuple of int
        At least one number.

    Raises
    ------
    TypeError
        If the value is no list, or an entry no whole number.
    ValueError
        If the list is empty, or a number is below `low`.

    See Also
    --------
    synchain.plugins.Family
    synchain.plugins.integer_option

    Examples
    --------
    >>> from synchain.plugins import integers_option
    >>> integers_option("shape", "3x4", 1)
    (3, 4)
    """
    if isinstance(value, str):
        entries: Iterable[object] = re.split("[,x]", value) if _LIST.fullmatch(value) else [value]
    elif isinstance(value, SupportsIndex):
        entries = [value]
    elif isinstance(value, Iterable):
        entries = value
    else:
        raise TypeError(f"{what} = {short_repr(value)}; expected a list of whole numbers, e.g. [1, 3]")
    result = tuple(integer_option(what, entry, low) for entry in entries)
    if not result:
        raise ValueError(f"{what} is empty; expected at least one whole number")
    return result


def probability_option(what: str, value: object) -> str:
    """Return a rational number from 0 to 1 as text such as "1/10".

    Parameters
    ----------
    what : str
        Name of the option in messages, such as ``"p"``.
    value : object
        A number or a text; a float stands for its shortest decimal.

    Returns
    -------
    str
        The number in lowest terms.

    Raises
    ------
    TypeError
        If the value is no number.
    ValueError
        If the number is not rational, or not from 0 to 1.

    See Also
    --------
    synchain.plugins.Family

    Examples
    --------
    >>> from synchain.plugins import probability_option
    >>> probability_option("p", "1/2")
    '1/2'
    """
    chance = rational(value, what)
    if not 0 <= chance <= 1:
        raise ValueError(f"{what} = {chance}; expected a probability from 0 to 1")
    return str(chance)
