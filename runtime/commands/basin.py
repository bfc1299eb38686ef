"""`synchain basin`: the shares of starts from which a network reaches each attractor."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace

from ..console.arguments import above_zero, add_workers, number, positive, whole
from ..console.outcome import wrong_use
from ..console.scene_arguments import add_changed_scene, add_output, changed_scene, compute

SUMMARY = "compute the shares of starts from which a network reaches its attractors"
EXAMPLES = (
    "synchain basin figure_4a --set sigma=0.1 --samples 200",
    "synchain basin huygens --samples 100 --range theta=-1:1 --attractor 'together=synchronous' 'still=rest' --json",
    "synchain basin two_oscillators --set sigma=0.05:0.3:6 --samples 100 -o basin.nc",
)

# Keywords of `synchain.basin` that are options.
OPTIONS = (
    "samples", "ranges", "attractors", "nodes", "bound", "tolerance", "transient", "window", "rng", "workers"
)  # fmt: skip


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(
        parser, more="lists and ranges of parameters are swept, those of initial states are a grid of starts"
    )
    parser.add_argument("--samples", metavar="K", type=positive, help="number of random starts (default: 1000)")
    parser.add_argument(
        "--range",
        dest="ranges",
        metavar="COMPONENT=LOW:HIGH",
        nargs="+",
        action="extend",
        type=_range,
        help="range of the initial values of a component (default: -1:1 for all)",
    )
    parser.add_argument(
        "--attractor",
        dest="attractors",
        metavar="NAME=CONDITION",
        nargs="+",
        action="extend",
        type=_attractor,
        help="synchronous, rest, or a comparison such as 'mean(x_1) > 0' (default: synchronous)",
    )
    parser.add_argument(
        "--nodes", metavar="N", nargs="+", type=_node, help="nodes that are perturbed, or each (default: all together)"
    )
    parser.add_argument("--bound", metavar="B", type=above_zero, help="size beyond which a start has escaped")
    parser.add_argument("--tolerance", metavar="E", type=above_zero, help="largest synchronisation error")
    parser.add_argument("--transient", metavar="T", type=above_zero, help="time before the last window")
    parser.add_argument("--window", metavar="T", type=above_zero, help="length of the last window")
    parser.add_argument("--rng", metavar="N", type=whole, help="seed of the starts (default: that of SCENE)")
    add_workers(parser)
    add_output(parser)


def _range(text: str) -> tuple[str, tuple[float, float]]:
    """Read COMPONENT=LOW:HIGH."""
    name, _, ends = text.partition("=")
    if not name.isidentifier() or ends.count(":") != 1:
        raise ArgumentTypeError(f"found {text!r}; expected COMPONENT=LOW:HIGH, e.g. x=-1:1")
    low, high = ends.split(":")
    return name, (number(low), number(high))


def _attractor(text: str) -> tuple[str, str]:
    """Read NAME=CONDITION."""
    name, _, condition = text.partition("=")
    if not (name.strip() and condition.strip()) or name.rstrip().endswith(("<", ">")):
        raise ArgumentTypeError(f"found {text!r}; expected NAME=CONDITION, e.g. 'still=rest'")
    return name.strip(), condition.strip()


def _node(text: str) -> int | str:
    """Read the number of a node, or "each"."""
    return text if text == "each" else positive(text)


def execute(arguments: Namespace) -> int:
    from ..synchronisation.basin import basin

    with wrong_use():
        scene = changed_scene(arguments)
    for name in ("ranges", "attractors"):
        if getattr(arguments, name) is not None:
            setattr(arguments, name, dict(getattr(arguments, name)))
    if arguments.nodes == ["each"]:
        arguments.nodes = "each"
    return compute(basin, scene, arguments, OPTIONS)
