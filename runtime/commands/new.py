"""`synchain new`: a commented file to start a part of one's own from."""

from __future__ import annotations

import keyword
import re
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..console.arguments import folder
from ..console.outcome import FINE, WrongUse, wrong_use

SUMMARY = "write a commented file to start a friction law, oscillator, coupling or topology from"
EXAMPLES = ("synchain new friction my_law", "synchain new topology caterpillar --dir models/topologies")

HOMES = {"topology": "topologies", "friction": "frictions", "oscillator": "oscillators", "coupling": "couplings"}
LENGTH = 40  # most characters of a name, a choice


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("kind", metavar="KIND", choices=tuple(HOMES), help=", ".join(HOMES))
    parser.add_argument("name", metavar="NAME", help="small letters, digits and underscores, e.g. my_law")
    add_directory(parser)


def execute(arguments: Namespace) -> int:
    """Write the file; one that exists is left as it is."""
    kind, name = arguments.kind, arguments.name
    _check(kind, name)
    path = write_template(kind, name, arguments.dir, ".py")
    # Say how the file is used.
    shown = path.as_posix() if path.is_absolute() else f"./{path.as_posix()}"
    use = f"topology({shown!r}, 6)" if kind == "topology" else f"Scene({kind}={shown!r}, …)"
    print(path)
    print(
        f"  in models/{HOMES[kind]} of an editable installation it is found by its name, {name!r}, and tested; ", end=""
    )
    print("anywhere else:")
    print(f"  plugins.allow_code({shown!r}); {use}")
    return FINE


def write_template(kind: str, name: str, directory: str, ending: str) -> Path:
    """Write the template of a kind under a name; raise WrongUse if the file exists or cannot be written."""
    from importlib import resources

    from ..support.files import output_folder

    template = resources.files("synchain.models").joinpath("templates", f"{kind}.txt")
    text = template.read_text(encoding="utf-8").replace("NAME", name)
    with wrong_use():
        path = output_folder(directory) / f"{name}{ending}"
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise WrongUse(f"{path} exists; expected a new file: choose another name, or remove it") from None
    except OSError as problem:
        raise WrongUse(f"cannot write {path}: {problem.strerror}; choose another --dir") from problem
    return path


def add_directory(parser: ArgumentParser) -> None:
    parser.add_argument("--dir", metavar="DIR", type=folder, default=".", help="where to write (default: this folder)")


def _check(kind: str, name: str) -> None:
    """Refuse a name that is no module's, or that a part has already."""
    plain = re.fullmatch(r"[a-z][a-z0-9_]*", name) is not None and len(name) <= LENGTH
    if not plain or keyword.iskeyword(name) or name in ("default", "none"):
        raise WrongUse(
            f"name {name!r}; expected small letters, digits and underscores, a letter first, at most {LENGTH}, no word "
            "of Python, and neither 'default' nor 'none': e.g. my_law"
        )
    from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
    from synchain.models.graphs.families import TOPOLOGY
    from synchain.models.inputs import plugin_files

    plugin_kind = {each.name: each for each in (TOPOLOGY, OSCILLATOR, FRICTION_LAW, COUPLING)}[kind]
    names = plugin_files.names(plugin_kind)
    if name in {*names, *plugin_kind.also}:
        raise WrongUse(f"{kind} {name!r} exists already; choose another name; known: {', '.join(names)}")
