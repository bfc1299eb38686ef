"""`synchain msf`: exponents of the modes of a network against their strength, and what they say
about the network.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..console.arguments import above_zero, add_scene, add_workers, folder, positive, spaced
from ..console.network import add_network, named_network, scene_on
from ..console.outcome import FINE, Failed, WrongUse, print_json, sentence, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

    from ..console.line_report import LineReport
    from ..console.plane_report import PlaneReport

SUMMARY = "compute the exponents of a network's modes from tangent equations, and where the network synchronises"
EXAMPLES = (
    "synchain msf figure_8",
    "synchain msf --omega 1.4 --topology star --n 5 --json",
    "synchain msf --omega 1.4 --matrix G.txt --alpha 0:1.2:81 --beta 0:0.6:41 --out results",
)

POINTS = 1_000_000
"""Most strengths of one plane."""


def configure(parser: ArgumentParser) -> None:
    """Add oscillator, network, strengths and effort."""
    add_scene(parser, default="the oscillator of table 1")
    parser.add_argument(
        "--alpha", metavar="LO:HI:N", type=spaced, help="strengths, -sigma times an eigenvalue (default: 0:1.2:241)"
    )
    parser.add_argument("--beta", metavar="LO:HI:N", type=spaced, help="imaginary parts: look at complex strengths")
    parser.add_argument(
        "--precision", metavar="P", type=above_zero, help="standard error to be reached (default: 0.001)"
    )
    parser.add_argument(
        "--periods", metavar="T", type=above_zero, help="drive periods (else units of 2 pi) at most (default: 5000)"
    )
    parser.add_argument("--starts", metavar="K", type=positive, help="initial states (default: 4)")
    add_network(parser)
    parser.add_argument("--json", action="store_true", help="print JSON: alpha, exponent, stderr, intervals, class ...")
    parser.add_argument("--out", metavar="DIR", type=folder, help="write a figure (PNG) and the numbers (CSV) there")
    add_workers(parser)


def execute(arguments: Namespace) -> int:
    """Compute the function on a line or over a plane; print what it says, and write files where
    asked to.
    """
    import numpy as np

    from ..console.line_report import LineReport, complex_modes
    from ..console.plane_report import PlaneReport
    from ..stability.msf import msf, plane
    from ..support.files import output_folder

    with wrong_use():
        scene, network = _scene(arguments)
        _check(scene, network, arguments)
        target = None if arguments.out is None else output_folder(arguments.out)
    warn(scene.warnings)
    alpha = np.linspace(0.0, 1.2, 241) if arguments.alpha is None else np.array(arguments.alpha)
    options: dict[str, Any] = {"workers": arguments.workers, "show_progress": None}
    effort = {name: getattr(arguments, name) for name in ("precision", "periods", "starts")}
    options.update({name: value for name, value in effort.items() if value is not None})
    report: LineReport | PlaneReport
    try:
        if arguments.beta is None:
            if network:
                warn(complex_modes(scene.topology, float(alpha[-1])))
            report = LineReport(msf(scene, alpha, **options), network)
        else:
            report = PlaneReport(plane(scene, alpha, np.array(arguments.beta), **options), network)
    except FloatingPointError as problem:
        raise Failed(sentence(problem)) from problem
    _tell(report, arguments.json, [] if target is None else report.write(target))
    return FINE


def _tell(report: LineReport | PlaneReport, json: bool, files: list[Path]) -> None:
    """Print the report and the files' names, as text or as one JSON value."""
    if json:
        print_json({**report.as_dict(), **({"files": [str(file) for file in files]} if files else {})})
        return
    print(report.text())
    for file in files:
        print(f"  {file}")


def _scene(arguments: Namespace) -> tuple[Scene, bool]:
    """The oscillator with its network, and whether it has one; without one, two oscillators stand
    for it.
    """
    from synchain.models.graphs.families import topology
    from synchain.models.scenes.file import load_scene

    scene = None if arguments.scene is None else load_scene(arguments.scene)
    network = named_network(arguments, scene)
    if network is not None and not network.link_count:
        raise WrongUse(
            f"{network.name}({network.n}) has no links; expected a network of at least two coupled oscillators"
        )
    if network is None and scene is not None and scene.topology.link_count:
        network = scene.topology
    stand_in = scene.topology if scene is not None else topology("chain", 2)
    return scene_on(network or stand_in, scene, arguments), network is not None


def _check(scene: Scene, network: bool, arguments: Namespace) -> None:
    """Raise ValueError for what cannot be computed, before anything is."""
    import numpy as np

    from synchain.models.graphs.families import topology

    from ..console.line_report import complex_modes
    from ..prediction.synchronisability import windows
    from ..stability.orbits import Orbits

    if scene.coupling is None and not scene.model.linked:
        raise WrongUse("the scene has no coupling, by which modes differ; expected one, e.g. coupling = 'spring'")
    one = scene if scene.topology.link_count else scene.replace(topology=topology("chain", 2))
    strength = np.zeros(1, dtype=float if arguments.beta is None else complex)
    Orbits.make(one, strength, np.zeros((1, len(one.components))), None)
    if len(arguments.alpha or [0] * 241) * len(arguments.beta or [0]) > POINTS:
        raise WrongUse(f"--alpha and --beta make more than {POINTS} strengths; expected fewer: take coarser grids")
    if network and not complex_modes(scene.topology, 1.0):
        windows((), scene.topology)
