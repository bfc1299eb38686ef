"""`synchain kernel`: the generated source."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.arguments import add_scene
from ..console.outcome import FINE, wrong_use

SUMMARY = "print the Python source that is generated and compiled for a scene"
EXAMPLES = ("synchain kernel figure_4a",)


def configure(parser: ArgumentParser) -> None:
    """Add the scene."""
    add_scene(parser)


def execute(arguments: Namespace) -> int:
    """Print the source; nothing is compiled."""
    from synchain.models.scenes.file import load_scene

    from ..cells.kernels import kernel_source

    with wrong_use():
        source = kernel_source(load_scene(arguments.scene))
    print(source.text, end="" if source.text.endswith("\n") else "\n")
    return FINE
