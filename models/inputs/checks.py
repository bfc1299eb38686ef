"""Checks of arguments, options and entries of files.

Every check takes `what`, the subject of its error, and the user's `value`, and returns the value in its
final type.  Errors have one grammar: "thing: found X; expected Y; do Z".
"""

from __future__ import annotations

import difflib
import math
import numbers
import operator
import os
import re
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sized
from itertools import groupby, islice
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

from .arithmetic import constant
from .unsupported import unsupported

# Control characters, line separators, changes of writing direction, and surrogates.
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def short_repr(value: object) -> str:
    """Return `repr` of any value on one line of at most 120 characters, for an error message."""
    # If `repr` fails (a broken `__repr__`, an integer beyond Python's limit of digits), return the type of the value,
    # so that the error message still appears.
    short = reprlib.Repr()
    short.maxstring = short.maxother = 60
    short.maxlevel = 2
    try:
        text = " ".join(short.repr(value).split())
    except Exception:
        text = f"<{type(value).__name__}>"
    return text if len(text) <= 120 else text[:117] + "..."


T = TypeVar("T")


def suggestion(name: object, names: Iterable[str], other: Mapping[str, str] | None = None) -> str:
    """Return "; did you mean …?" if a name is close to one of `names` or to a synonym in `other`, else ""."""
    if not isinstance(name, str):
        return ""
    targets = {candidate: candidate for candidate in names}
    targets = {candidate: target for candidate, target in (other or {}).items() if target in targets} | targets
    longer = sorted(candidate for candidate in targets if name and candidate.startswith(name))
    close = longer[:1] or difflib.get_close_matches(name, sorted(targets), 1)
    return f"; did you mean {targets[close[0]]!r}?" if close else ""


_NUMBERED = re.compile(r"(.+?)((?:_\d+)+)")  # names of variables of one node or link, such as a_2 or k_1_2


def listed(names: Iterable[str]) -> str:
    """Join names by commas; abbreviate three or more successive names that differ only in numbers, as a_1 … a_9."""
    parts: list[str] = []
    for base, same in groupby(names, lambda name: match[1] if (match := _NUMBERED.fullmatch(name)) else name):
        row = list(same)
        parts += row if len(row) < 3 or row[0] == base else [f"{row[0]} … {row[-1]}"]
    return ", ".join(parts)


def first_of(values: Iterable[T], n: int) -> tuple[tuple[T, ...], str]:
    """Return up to n + 1 of the values, and their number as text; for a longer iterator the text is "more than n"."""
    first = tuple(islice(values, n + 1))
    endless = len(first) > n and not isinstance(values, Sized)
    return first, f"more than {n}" if endless else str(len(values) if isinstance(values, Sized) else len(first))


def is_row(value: object) -> TypeGuard[Iterable[Any]]:
    """Return True for a sequence of values, False for a single value."""
    return isinstance(value, Iterable) and not isinstance(value, str | bytes) and getattr(value, "ndim", 1) > 0


def check_keys(what: str, table: Mapping[object, object], names: Iterable[str]) -> None:
    """Raise an error unless every key of a mapping is one of `names`."""
    names = tuple(names)
    for key in table:
        if not isinstance(key, str):
            raise TypeError(f"{what}: key {short_repr(key)} is a {type(key).__name__}; expected text")
        if key not in names:
            if reason := unsupported(key):
                raise ValueError(f"{what}: unknown key {short_repr(key)}: {reason}")
            close = suggestion(key, names)
            raise ValueError(f"{what}: unknown key {short_repr(key)}; known: {', '.join(names) or 'none'}{close}")


def check_table(what: str, value: object) -> Mapping[object, object]:
    """Return the value if it is a mapping; TypeError for any other."""
    return check_instance(what, value, Mapping, "a table of names and values")


def check_text(what: str, value: object, limit: int = 200) -> str:
    """Return the value if it is a text of at most `limit` characters without control characters."""
    if not isinstance(value, str):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected text in quotation marks")
    if len(value) > limit:
        raise ValueError(f"{what}: found {len(value)} characters; expected at most {limit}; shorten it")
    return check_printable(what, str(value))


def check_printable(what: str, value: str) -> str:
    """Return the text; ValueError if it contains a control character."""
    # A terminal executes control characters, and a name may come from any file.
    control = _CONTROL.search(value)
    if control:
        raise ValueError(
            f"{what}: found the control character {control[0]!a}; expected letters, digits and signs on one line; "
            "remove it"
        )
    return value


def check_choice(what: str, value: object, names: tuple[str, ...]) -> str:
    """Return the value if it is one of `names`."""
    name = check_text(what, value)
    if name not in names:
        raise ValueError(f"unknown {what} {short_repr(name)}; known: {', '.join(names)}{suggestion(name, names)}")
    return name


def check_number(what: str, value: object, low: float | None = None, high: float | None = None) -> float:
    """Convert a number, or a constant expression such as "2*pi", to a finite float from `low` to `high`."""
    if getattr(value, "ndim", None) == 0:
        value = value.item()  # type: ignore[attr-defined]
    if isinstance(value, str):
        try:
            result = constant(value)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    elif isinstance(value, bool) or not (isinstance(value, numbers.Real) or _is_exact(value)):
        raise TypeError(f'{what}: found {typed_repr(value)}; expected a number, e.g. 0.1 or "2*pi/1.15"')
    else:
        try:
            result = float(value)  # type: ignore[arg-type]
        except OverflowError:
            result = math.inf
    if not math.isfinite(result):
        raise ValueError(f"{what}: found {short_repr(value)}; expected a finite number; correct the value")
    if (low is not None and result < low) or (high is not None and result > high):
        raise ValueError(f"{what}: found {result!r}; expected {_span(low, high)}; correct the value")
    return result


def _is_exact(value: object) -> bool:
    """Return whether a value is a real number of SymPy, without importing SymPy."""
    return bool(getattr(value, "is_number", False) and getattr(value, "is_real", False))


def _span(low: float | None, high: float | None) -> str:
    """Describe the range from `low` to `high` for a message; None means no bound."""
    if high is None:
        return "a number" if low is None else f"a number of at least {low:g}"
    return f"a number of at most {high:g}" if low is None else f"a number from {low:g} to {high:g}"


def typed_repr(value: object) -> str:
    """Return the short `repr` of any value and its type, for an error message."""
    name = type(value).__name__
    text = short_repr(value)
    return text if name in text or value is None else f"{text} ({name})"


def check_instance(what: str, value: object, kind: type[T] | tuple[type[T], ...], expected: str) -> T:
    """Return the value if it is an instance of `kind`; TypeError for any other."""
    if not isinstance(value, kind):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected {expected}")
    return value


def check_callable(what: str, value: object) -> Callable[..., object]:
    """Return the value if it is callable; TypeError for any other."""
    if not callable(value):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected a function")
    return value


def check_flag(what: str, value: object) -> bool:
    """Return the value if it is True or False; TypeError for any other."""
    return check_instance(what, value, bool, "True or False")


def check_integer(what: str, value: object, low: int, high: int | None = None) -> int:
    """Return an integer from `low` to `high` as an int; TypeError for a float, even a whole one."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise TypeError(f"{what} = {short_repr(value)}; expected a whole number, e.g. {max(low, 1)}")
    result = operator.index(value)
    if result < low or (high is not None and result > high):
        bound = f"at least {low}" if result < low else f"at most {high}"
        both = "" if high is None else f", a whole number from {low} to {high}"
        raise ValueError(f"{what} = {short_repr(result)}; expected {bound}{both}; correct it")
    return result


def check_positive(what: str, value: object) -> float:
    """Return a finite number above 0; TypeError and ValueError like `check_number`."""
    result = check_number(what, value)
    if result <= 0.0:
        raise ValueError(f"{what}: found {result:g}; expected a number above 0")
    return result


def check_path(what: str, value: object) -> Path:
    """Convert a text or a path to a Path."""
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected a path, e.g. 'data/G.txt'")
    if not os.fspath(value).strip() or "\0" in os.fspath(value):
        raise ValueError(f"{what}: found {short_repr(os.fspath(value))}; expected the name of a file")
    return Path(value)


def check_seed(what: str, rng: object, high: int = 2**63 - 1) -> int:
    """Return the seed of random numbers: a whole number, or one drawn from a NumPy Generator (SPEC 7)."""
    return int(rng.integers(high)) if hasattr(rng, "integers") else check_integer(what, rng, 0, high)
