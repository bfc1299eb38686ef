"""`synchain lyapunov`: the Lyapunov exponents of a network."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.arguments import at_least_zero, periods, positive
from ..console.outcome import wrong_use
from ..console.scene_arguments import add_changed_scene, add_output, changed_scene, compute

SUMMARY = "compute the Lyapunov exponents and the dimension of a network's motion"
EXAMPLES = (
    "synchain lyapunov two_oscillators --periods 500",
    "synchain lyapunov duffing_chain --set u=0.5 --count 2 --json",
)

OPTIONS = ("count", "precision", "periods", "transient")  # keywords of `synchain.lyapunov_spectrum` that are options


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser)
    parser.add_argument("--count", metavar="K", type=positive, help="number of largest exponents (default: all)")
    parser.add_argument(
        "--precision",
        metavar="P",
        type=at_least_zero,
        help="standard error to be reached (default: 0.001 for a period of 2 pi)",
    )
    parser.add_argument(
        "--periods", metavar="T", type=periods, help="drive periods (else mean return times) at most (default: 5000)"
    )
    parser.add_argument(
        "--transient", metavar="T", type=periods, help="periods before the average (default: those of SCENE, else 300)"
    )
    add_output(parser)


def execute(arguments: Namespace) -> int:
    from ..stability.lyapunov import lyapunov_spectrum

    with wrong_use():
        scene = changed_scene(arguments)
    return compute(lyapunov_spectrum, scene, arguments, OPTIONS)
