"""Read scene files: TOML text whose keys are the keywords of `Scene`."""

from __future__ import annotations

import os
import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from ..inputs.checks import short_repr, suggestion
from .toml import BYTES

if TYPE_CHECKING:
    from .scene import Scene

KEY_PARTS = 8
"""Most parts of a dotted key in a scene file (a choice): enough for every key, and few enough for the parser."""

_STRINGS = (
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)',
    r"'''.*?(?:'''|\Z)",
    r'"(?:\\.|[^"\\\n])*"?',
    r"'[^'\n]*'?",
)

_TOKEN = re.compile(rf"(?P<word>{'|'.join(_STRINGS)}|[\w+-]+|[ \t]+)|(?P<dot>\.)|(?P<end>#[^\n]*|.)", re.DOTALL)
"""Tokens of TOML: `word` (strings, bare words, blanks) continues a key, `dot` adds a part, `end` ends the key."""


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that are shipped with the package.

    See Also
    --------
    synchain.load_scene

    Examples
    --------
    >>> import synchain as sc
    >>> "figure_4a" in sc.scene_names()
    True
    """
    folder = resources.files(f"{__package__}.library")
    return tuple(sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml")))


def load_scene(name_or_path: str | os.PathLike[str]) -> Scene:
    """Return the scene of a shipped name ("figure_4a") or of a file whose path ends in ".toml".

    Raises ValueError or TypeError for a missing or unreadable file, and for values that `Scene` refuses; the message
    begins with the name of the file.  No code in the file is executed.

    See Also
    --------
    synchain.scene_names
    synchain.Scene

    Examples
    --------
    >>> from synchain import load_scene
    >>> load_scene("figure_4a").n
    2
    """
    if not isinstance(name_or_path, (str, os.PathLike)):
        raise TypeError(
            f"scene: found {short_repr(name_or_path)}; expected the name of a scene or a path to a .toml file"
        )
    name = os.fspath(name_or_path)
    if not isinstance(name, str):
        raise TypeError(f"scene: found {short_repr(name)}; expected text, not bytes")
    if name.endswith(".toml"):
        path = Path(name)
        return _scene(path.name, _read(path), path.parent)
    names = scene_names()
    if name not in names and os.path.exists(name):
        raise ValueError(
            f"scene {short_repr(name)}: found a file of another kind; expected a scene, whose name ends in .toml; "
            "the scene of a result is open_result(...).scene, which save('scene.toml') writes"
        )
    if name not in names:
        raise ValueError(
            f"unknown scene {short_repr(name)}; known: {', '.join(names)}, or a path to a .toml file"
            + suggestion(name, names)
        )
    source = resources.files(f"{__package__}.library").joinpath(f"{name}.toml")
    return _scene(f"{name}.toml", source.read_bytes(), None)


def _read(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise ValueError(f"scene {short_repr(str(path))}: found a folder; expected a TOML file; name a file in it")
        if not path.is_file():
            close = f"; {path.stem!r} without .toml names a shipped scene" if path.stem in scene_names() else ""
            raise ValueError(
                f"scene {short_repr(str(path))}: no such file; expected a TOML file; check the path{close}"
            )
        with path.open("rb") as file:
            content = file.read(BYTES + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise ValueError(
            f"scene {short_repr(str(path))}: cannot be read ({reason}); check the path and its rights"
        ) from None
    if len(content) > BYTES:
        raise ValueError(
            f"scene {short_repr(str(path))}: found more than {BYTES} bytes; expected a short text; check the path"
        )
    return content


def _scene(name: str, content: bytes, folder: Path | None) -> Scene:
    """Return the scene of the content of a file; relative paths start at `folder`."""
    from .scene import Scene  # imported here, so that listing scenes does not load SymPy

    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{name}: byte {error.start} is not UTF-8; expected UTF-8 text; save the file in that encoding"
        ) from None
    # Limit the parts of dotted keys: time and memory of the parser grow with the square of their number.
    dots = 0
    for token in _TOKEN.finditer(text):
        dots = 0 if token.lastgroup == "end" else dots + (token.lastgroup == "dot")
        if dots >= KEY_PARTS:
            line = text.count("\n", 0, token.start()) + 1
            raise ValueError(
                f"{name}: line {line} has a key of more than {KEY_PARTS} parts with dots between them; expected at most "
                "3, as in sweep.sigma.from; correct the file there"
            )
    try:
        values = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        reason = str(error) if isinstance(error, tomllib.TOMLDecodeError) else "too deep or too long a value"
        raise ValueError(f"{name}: not TOML: {' '.join(reason.split())[:300]}; correct the file there") from None
    try:
        return Scene.from_dict(values, folder)
    except (ValueError, TypeError) as error:
        raise type(error)(f"{name}: {error}") from None
