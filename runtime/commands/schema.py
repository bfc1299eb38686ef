"""`synchain schema`: the JSON Schema of scene files."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, print_json

SUMMARY = "print the JSON Schema of scene files, for editors"
EXAMPLES = ("synchain schema > scene.schema.json",)


def configure(parser: ArgumentParser) -> None:
    """No arguments."""


def execute(arguments: Namespace) -> int:
    from synchain.models.scenes.schema import schema

    print_json(schema())
    return FINE
