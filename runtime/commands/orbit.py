"""`synchain orbit`: a periodic orbit, or its branch over a parameter."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from typing import TYPE_CHECKING

from ..console.arguments import positive, spaced
from ..console.outcome import WrongUse, wrong_use
from ..console.scene_arguments import add_changed_scene, add_output, changed_scene, compute

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

    from ..bifurcation.results import Branch

SUMMARY = "find a periodic orbit of an oscillator, or follow it along a parameter to its bifurcations"
EXAMPLES = (
    "synchain orbit figure_4a --periods 2",
    "synchain orbit duffing_chain --follow omega=1:1.3:31 -o branch.nc",
)


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser)
    parser.add_argument("--periods", metavar="K", type=positive, help="drive periods of the orbit (default: 1)")
    parser.add_argument("--follow", metavar="NAME=LO:HI:N", help="follow the orbit along this parameter, from LO to HI")
    add_output(parser)


def execute(arguments: Namespace) -> int:
    from ..bifurcation.branches import follow
    from ..bifurcation.periodic import periodic_orbit

    with wrong_use():
        scene = changed_scene(arguments)
        if arguments.follow is None:
            return compute(periodic_orbit, scene, arguments, ("periods",))
        name, equals, text = arguments.follow.partition("=")
        if not equals or not scene.takes(name):
            raise WrongUse(
                f"--follow: found {arguments.follow!r}; expected a parameter and its values, e.g. omega=1:1.3:31"
            )
        try:
            values = spaced(text)
        except ArgumentTypeError as error:
            raise WrongUse(f"--follow: {error}") from None

    def branch(scene: Scene, periods: int = 1) -> Branch:
        """Follow the orbit that is found at the first value."""
        first = periodic_orbit(scene, periods, parameters={name: values[0]})
        return follow(first, name, values=values)

    return compute(branch, scene, arguments, ("periods",))
