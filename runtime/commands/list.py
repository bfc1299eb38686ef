"""`synchain list`: the parts and the scenes that there are to choose from."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any, TypeAlias

from ..console.outcome import FINE, print_json

SUMMARY = "list oscillators, couplings, friction laws, graphs or scenes by name"
EXAMPLES = ("synchain list oscillators", "synchain list graphs", "synchain list scenes --json")

Row: TypeAlias = "dict[str, Any]"  # name and summary of a part, and what else JSON has of it


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("kind", metavar="KIND", choices=tuple(LISTS), help=", ".join(LISTS))
    parser.add_argument("--json", action="store_true", help="print JSON: a list of names, summaries and more")


def execute(arguments: Namespace) -> int:
    rows = LISTS[arguments.kind]()
    if arguments.json:
        print_json(rows)
        return FINE
    width = max(len(str(row["name"])) for row in rows)
    for row in rows:
        options = ", ".join(row.get("options", ()))
        more = f", {row['minimum']} or more nodes" if "minimum" in row else ""
        print(f"{row['name']:<{width}}  {row['summary']}{more}{f'; options: {options}' if options else ''}".rstrip())
    return FINE


def _parts(kind: str) -> list[Row]:
    """Return the plug-ins of a kind: those of the package and of installed ones."""
    from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
    from synchain.models.inputs import plugin_files

    of_kind = {"oscillators": OSCILLATOR, "couplings": COUPLING, "frictions": FRICTION_LAW}[kind]
    rows: list[Row] = []
    for name in plugin_files.names(of_kind):
        part = plugin_files.load(of_kind, name)
        # Rates and potentials of links that other packages offer have no summary.
        parameters = {key: each.default for key, each in getattr(part, "parameters", {}).items()}
        rows.append({"name": name, "summary": getattr(part, "summary", ""), "parameters": parameters})
    return rows


def _graphs() -> list[Row]:
    from synchain.models.graphs.families import family, names

    return [
        {"name": each.name, "summary": each.summary, "minimum": each.minimum, "options": [*each.options]}
        for each in map(family, names())
    ]


def _scenes() -> list[Row]:
    import tomllib
    from importlib import resources

    from synchain.models.scenes.file import scene_names

    folder = resources.files("synchain.models.scenes.library")
    texts = {name: folder.joinpath(f"{name}.toml").read_text(encoding="utf-8") for name in scene_names()}
    return [{"name": name, "summary": tomllib.loads(text).get("title", "")} for name, text in texts.items()]


LISTS = {
    "oscillators": lambda: _parts("oscillators"),
    "couplings": lambda: _parts("couplings"),
    "frictions": lambda: _parts("frictions"),
    "graphs": _graphs,
    "scenes": _scenes,
}
