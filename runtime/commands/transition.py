"""`synchain transition`: the clusters that form on the way to synchrony."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.arguments import add_workers, at_least_zero, periods, positive, spaced
from ..console.outcome import wrong_use
from ..console.scene_arguments import add_changed_scene, add_output, changed_scene, compute

SUMMARY = "predict which clusters of nodes form on the way to synchrony, and at which coupling strengths"
EXAMPLES = (
    "synchain transition figure_8",
    "synchain transition duffing_chain --alpha 0:2:401 --json",
)

OPTIONS = ("alpha", "precision", "periods", "starts", "workers")  # keywords of `synchain.transition` that are options


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser)
    parser.add_argument(
        "--alpha",
        metavar="LO:HI:N",
        type=spaced,
        help="strengths, -sigma times an eigenvalue (default: 241 that reach all modes at the strengths of SCENE)",
    )
    parser.add_argument(
        "--precision",
        metavar="P",
        type=at_least_zero,
        help="standard error to be reached (default: 0.001 for a period of 2 pi)",
    )
    parser.add_argument(
        "--periods", metavar="T", type=periods, help="drive periods (else mean return times) at most (default: 5000)"
    )
    parser.add_argument("--starts", metavar="K", type=positive, help="initial states (default: 4)")
    add_workers(parser)
    add_output(parser)


def execute(arguments: Namespace) -> int:
    from ..synchronisation.transition import transition

    with wrong_use():
        scene = changed_scene(arguments)
    return compute(transition, scene, arguments, OPTIONS)
