"""`synchain init`: a commented scene file to start from."""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, WrongUse
from .new import add_directory, write_template

SUMMARY = "write a commented scene file that runs, to start a scene of one's own from"
EXAMPLES = ("synchain init my_scene", "synchain init ring --dir scenes")


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="letters, digits, - and _, e.g. my_scene; the file is NAME.toml")
    add_directory(parser)


def execute(arguments: Namespace) -> int:
    """Write the file and print what to do with it; one that exists is left as it is."""
    name = arguments.name.removesuffix(".toml")
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,79}", name) is None:
        raise WrongUse(f"found the name {arguments.name!r}; expected letters, digits, - and _, e.g. my_scene")
    path = write_template("scene", name, arguments.dir, ".toml")
    print(path)
    print(f"  synchain run {path} --out results")
    return FINE
