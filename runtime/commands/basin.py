"""`synchain basin`: the probability that a network synchronises from random starts."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.arguments import above_zero, add_workers, positive, whole
from ..console.outcome import wrong_use
from ..console.scene_arguments import add_changed_scene, add_output, changed_scene, compute

SUMMARY = "compute the share of random starts from which a network synchronises"
EXAMPLES = (
    "synchain basin figure_4a --set sigma=0.1 --samples 200",
    "synchain basin huygens --samples 100 --json",
)

OPTIONS = ("samples", "tolerance", "transient", "window", "seed", "workers")
"""Keywords of `synchain.basin` that are options."""


def configure(parser: ArgumentParser) -> None:
    """Add the scene, the starts and the criterion."""
    add_changed_scene(parser)
    parser.add_argument("--samples", metavar="K", type=positive, help="number of starts (default: 1000)")
    parser.add_argument("--tolerance", metavar="E", type=above_zero, help="largest synchronisation error")
    parser.add_argument("--transient", metavar="T", type=above_zero, help="time before the error is averaged")
    parser.add_argument("--window", metavar="T", type=above_zero, help="time over which it is averaged")
    parser.add_argument("--seed", metavar="N", type=whole, help="seed of the starts (default: that of SCENE)")
    add_workers(parser)
    add_output(parser)


def execute(arguments: Namespace) -> int:
    """Print the probability with its interval, and how the starts ended."""
    from ..synchronisation.basin import basin

    with wrong_use():
        scene = changed_scene(arguments)
    return compute(basin, scene, arguments, OPTIONS)
