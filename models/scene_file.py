"""Scenes as text: TOML files and JSON-ready dictionaries with the names of `Scene`'s keywords."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

from .coupling_name import split
from .family_options import defaults
from .plugins import part
from .scene import Scene
from .scene_checks import integer, known_keys, shown, suggestion, table, text
from .scene_parameters import collected
from .topology import Topology, family, from_matrix, names, read_matrix, topology

__all__ = ["as_dict", "from_dict", "load_scene", "scene_names"]

BYTES = 1_000_000
"""Largest scene file that is read."""
NODES = 100_000
"""Largest number of oscillators that a scene file may ask for."""
KEY_PARTS = 8
"""Most parts of a dotted key in a scene file."""

_STRINGS = (
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)',
    r"'''.*?(?:'''|\Z)",
    r'"(?:\\.|[^"\\\n])*"?',
    r"'[^'\n]*'?",
)
_TOKEN = re.compile(rf"(?P<word>{'|'.join(_STRINGS)}|[\w+-]+|[ \t]+)|(?P<dot>\.)|(?P<end>#[^\n]*|.)", re.DOTALL)
"""What stands in a TOML text: strings, bare words and blanks, which go on with a key, dots, and whatever ends one."""


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that come with the package: the files of the folder `scenes`."""
    folder = resources.files(__package__).joinpath("scenes")
    return tuple(sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml")))


def load_scene(name_or_path: str | os.PathLike[str]) -> Scene:
    """Return the scene of a shipped name ("figure_4a") or of a file whose path ends in ".toml".

    Raises ValueError or TypeError, with the file's name in front, on a missing or unreadable file and on
    whatever `Scene` refuses.  Nothing in the file is run.
    """
    if not isinstance(name_or_path, (str, os.PathLike)):
        raise TypeError(f"scene: found {shown(name_or_path)}; expected the name of a scene or a path to a .toml file")
    name = os.fspath(name_or_path)
    if not isinstance(name, str):
        raise TypeError(f"scene: found {shown(name)}; expected text, not bytes")
    if name.endswith(".toml"):
        path = Path(name)
        return _scene(path.name, _read(path), path.parent)
    known = scene_names()
    if name not in known:
        raise ValueError(
            f"unknown scene {shown(name)}; known: {', '.join(known)}, or a path to a .toml file"
            + suggestion(name, known)
        )
    source = resources.files(__package__).joinpath("scenes", f"{name}.toml")
    return _scene(f"{name}.toml", source.read_bytes(), None)


def _read(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise ValueError(f"scene {shown(str(path))}: found a folder; expected a TOML file; name a file in it")
        if not path.is_file():
            close = f"; {path.stem!r} without .toml names a shipped scene" if path.stem in scene_names() else ""
            raise ValueError(f"scene {shown(str(path))}: no such file; expected a TOML file; check the path{close}")
        with path.open("rb") as file:
            content = file.read(BYTES + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise ValueError(
            f"scene {shown(str(path))}: cannot be read ({reason}); check the path and its rights"
        ) from None
    if len(content) > BYTES:
        raise ValueError(
            f"scene {shown(str(path))}: found more than {BYTES} bytes; expected a short text; check the path"
        )
    return content


def _scene(name: str, content: bytes, folder: Path | None) -> Scene:
    try:
        words = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{name}: byte {error.start} is not UTF-8; expected UTF-8 text; save the file in that encoding"
        ) from None
    _check_keys(name, words)
    try:
        values = tomllib.loads(words)
    except (ValueError, RecursionError) as error:
        reason = str(error) if isinstance(error, tomllib.TOMLDecodeError) else "too deep or too long a value"
        raise ValueError(f"{name}: not TOML: {' '.join(reason.split())[:300]}; correct the file there") from None
    try:
        return from_dict(values, folder)
    except (ValueError, TypeError) as error:
        raise type(error)(f"{name}: {error}") from None


def _check_keys(name: str, words: str) -> None:
    """Refuse a dotted key of more than KEY_PARTS parts: the parser's time and memory rise with their square."""
    dots = 0
    for found in _TOKEN.finditer(words):
        if found.lastgroup == "dot":
            dots += 1
        elif found.lastgroup == "end":
            dots = 0
        if dots >= KEY_PARTS:
            line = words.count("\n", 0, found.start()) + 1
            raise ValueError(
                f"{name}: line {line} has a key of more than {KEY_PARTS} parts with dots between them; expected at most "
                "3, as in sweep.sigma.from; correct the file there"
            )


def from_dict(values: Mapping[str, Any], folder: Path | None = None) -> Scene:
    """Return the scene of names and values as in a scene file; paths in it start in `folder`."""
    found = table("scene", values)
    keys = ["sweep" if field.name == "axes" else field.name for field in fields(Scene)]
    known_keys("scene", found, keys)
    given: dict[str, Any] = {str(key): value for key, value in found.items()}
    if "topology" in given:
        given["topology"] = _topology(table("topology", given["topology"]), folder)
    if "sweep" in given:
        sweep = dict(table("sweep", given.pop("sweep")))
        if "zipped" in sweep and "zipped" in given:
            raise ValueError("zipped is given twice, in [sweep] and above; expected it once; remove one")
        given["zipped"] = sweep.pop("zipped", given.get("zipped", False))
        given["axes"] = sweep
    for name in ("parameters", "initial"):
        if name in given:
            table(name, given[name])
    for name in ("oscillator", "friction", "coupling"):
        if name in given:
            given[name] = _placed(given[name], folder)
    if isinstance(given.get("nodes"), list):
        given["nodes"] = [_placed_group(group, folder) for group in given["nodes"]]
    return Scene(**given)


def _placed(name: object, folder: Path | None) -> object:
    """The name of a part; a path to a file of code starts in the folder of the scene file."""
    if not isinstance(name, str) or folder is None or not split(name)[0].endswith(".py"):
        return name
    return str(folder / name)


def _placed_group(group: object, folder: Path | None) -> object:
    """A group of nodes, its paths to files of code too."""
    if not isinstance(group, Mapping):
        return group
    return {key: _placed(value, folder) if key in ("oscillator", "friction") else value for key, value in group.items()}


def _topology(given: Mapping[object, Any], folder: Path | None) -> Topology:
    name = _placed(given.get("name"), folder)
    known = isinstance(name, str) and "matrix" not in given and (name in names() or name.endswith(".py"))
    options = defaults(family(str(name))) if known else {}
    known_keys("topology", given, ("name", "n", *options, "matrix", "file"))
    if "file" in given:
        if len(given) > 1:
            raise ValueError(f"topology: found {shown(dict(given))}; expected 'file' alone; remove the other keys")
        path = Path(folder or ".", text("topology file", given["file"], 4096))
        try:
            return read_matrix(path)
        except OSError as error:
            raise ValueError(f"topology: {' '.join(str(error).split())}") from None
    if "matrix" in given:
        graph = from_matrix(given["matrix"], name=text("topology name", given.get("name", "matrix")))
        if "n" in given and integer("topology n", given["n"], 1, NODES) != graph.n:
            raise ValueError(f"topology: n = {given['n']} but the matrix has {graph.n} rows; remove n")
        return graph
    for key in ("name", "n"):
        if key not in given:
            found = shown(dict(given))
            raise ValueError(f"topology: {key!r} is missing in {found}; expected name and n, or matrix, or file")
    chosen = {key: given[key] for key in options if key in given}
    return topology(part("topology name", name), integer("topology n", given["n"], 0, NODES), **chosen)


def as_dict(scene: Scene) -> dict[str, Any]:
    """Return the whole scene in JSON types, in the names of a scene file."""
    made = {field.name: getattr(scene, field.name) for field in fields(scene)}
    made["oscillator"] = str(scene.oscillator)
    made["friction"] = "none" if scene.friction is None else str(scene.friction)
    made["coupling"] = "none" if scene.coupling is None else str(scene.coupling)
    made["topology"] = _graph(scene.topology)
    made["nodes"] = [group.as_dict() for group in scene.nodes]
    made["parameters"] = collected(scene.parameters, scene.varied)
    made["initial"] = {name: list(values) for name, values in scene.initial.items()}
    made["record"] = list(scene.record)
    made["section"] = str(scene.section)
    made["sweep"] = {axis.name: list(axis.values) for axis in made.pop("axes")}
    return made


def _graph(graph: Topology) -> dict[str, Any]:
    try:
        same = topology(graph.name, graph.n, **dict(graph.options)) == graph
    except (ValueError, TypeError):
        same = False
    if same:
        options = {key: list(value) if isinstance(value, tuple) else value for key, value in graph.options}
        return {"name": str(graph.name), "n": graph.n, **options}
    return {"name": str(graph.name), "matrix": [[str(entry) for entry in row] for row in graph.rows]}
