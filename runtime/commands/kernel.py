"""`synchain kernel`: the generated source."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, wrong_use
from ..console.scene_arguments import add_changed_scene, changed_scene

SUMMARY = "print the Python source that is generated and compiled for a scene"
EXAMPLES = ("synchain kernel figure_4a", "synchain kernel figure_4a --driver")


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser)
    parser.add_argument(
        "--driver",
        action="store_true",
        help="print the driver that runs them, which scenes share",
    )


def execute(arguments: Namespace) -> int:
    """Print the functions of the scene, or the driver that runs them; nothing is compiled."""
    from ..engines.scene_kernels import kernel_source

    with wrong_use():
        source = kernel_source(changed_scene(arguments))
    text = source.driver.text if arguments.driver else source.text
    print(text, end="" if text.endswith("\n") else "\n")
    return FINE
