"""Tables of names and values as TOML text, the form of scene files."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping

from ..inputs.checks import check_path, short_repr, typed_repr

BYTES = 1_000_000
"""Most bytes of a scene file: a choice."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml(table: Mapping[str, object]) -> str:
    """Return a table as TOML text that `tomllib` reads as the same table."""
    return "\n".join(_lines(table, ())).strip() + "\n"


def write(table: Mapping[str, object], path: str | os.PathLike[str]) -> None:
    """Write a table to a scene file."""
    file = check_path("scene file", path)
    if file.suffix != ".toml":
        raise ValueError(f"scene file: found {short_repr(str(file))}; expected a name that ends in .toml")
    content = toml(table).encode()
    if len(content) > BYTES:
        raise ValueError(f"scene file: found {len(content)} bytes; expected at most {BYTES}; use fewer values")
    file.write_bytes(content)


def _lines(table: Mapping[str, object], path: tuple[str, ...]) -> Iterator[str]:
    """Yield the lines of a table: its values, then the tables in it, each below its title."""
    tables = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    if path[-1:] == ("parameters",):
        tables = {}  # write each table on one line, which keeps the order of all parameters
    if path and (len(tables) < len(table) or not table):
        yield f"\n[{'.'.join(map(_key, path))}]"
    for key, value in table.items():
        if key not in tables:
            yield f"{_key(key)} = {_value(value)}"
    for key, value in tables.items():
        yield from _lines(value, (*path, key))


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def _value(value: object) -> str:
    """Return a value on one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key(key)} = {_value(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, str):
        return json.dumps(str(value), ensure_ascii=False)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    raise TypeError(f"scene: found {typed_repr(value)}; expected text, numbers, lists and tables")
