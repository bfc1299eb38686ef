"""`synchain msf`: exponents of the modes of a network against their strength or over two axes, and
what they say about the network.
"""

from __future__ import annotations

import math
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ..console.arguments import (
    add_scene,
    add_set,
    add_workers,
    at_least_zero,
    folder,
    periods,
    positive,
    settings,
    spaced,
)
from ..console.network import add_network, named_network, scene_on
from ..console.outcome import FINE, Failed, WrongUse, print_json, sentence, warn, wrong_use

if TYPE_CHECKING:
    import numpy as np

    from synchain.models.scenes.scene import Scene

    from ..console.line_report import LineReport
    from ..console.plane_report import PlaneReport

Rows: TypeAlias = "dict[str, tuple[float, ...]]"
"""The values of parameters that are axes."""

SUMMARY = "compute the exponents of a network's modes from tangent equations, and where the network synchronises"
EXAMPLES = (
    "synchain msf figure_8",
    "synchain msf --omega 1.4 --topology star --n 5 --json",
    "synchain msf --omega 1.4 --matrix G.txt --alpha 0:1.2:81 --beta 0:0.6:41 --out results",
    "synchain msf figure_8 --alpha 0:1.2:121 --set omega=1.1:1.9:41 --out results",
    "synchain msf figure_8 --set sigma=0:0.4:81 omega=1.1:1.9:41 --out results",
)

POINTS = 1_000_000
"""Most points of one plane."""

LINE = (0.0, 1.2, 241)
"""Ends and number of the strengths unless --alpha gives others."""


def configure(parser: ArgumentParser) -> None:
    """Add oscillator, network, strengths and effort."""
    add_scene(parser, default="the oscillator of table 1")
    parser.add_argument(
        "--alpha", metavar="LO:HI:N", type=spaced, help="strengths, -sigma times an eigenvalue (default: 0:1.2:241)"
    )
    parser.add_argument("--beta", metavar="LO:HI:N", type=spaced, help="imaginary parts: look at complex strengths")
    add_set(
        parser,
        "set a parameter; a,b,c or LO:HI:N makes it an axis of a map: over alpha and a parameter, or over two "
        "parameters of the network",
    )
    parser.add_argument(
        "--precision", metavar="P", type=at_least_zero, help="standard error to be reached (default: 0.001)"
    )
    parser.add_argument(
        "--periods", metavar="T", type=periods, help="drive periods (else units of 2 pi) at most (default: 5000)"
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
    from ..support.files import output_folder

    with wrong_use():
        numbers, rows = _parted(arguments)
        scene, network = _scene(arguments, numbers, rows)
        _check(scene, network, arguments, rows)
        target = None if arguments.out is None else output_folder(arguments.out)
    warn(scene.warnings)
    options: dict[str, Any] = {"workers": arguments.workers, "show_progress": None}
    effort = {name: getattr(arguments, name) for name in ("precision", "periods", "starts")}
    options.update({name: value for name, value in effort.items() if value is not None})
    try:
        report = _report(scene, network, arguments, rows, options)
    except FloatingPointError as problem:
        raise Failed(sentence(problem)) from problem
    _tell(report, arguments.json, [] if target is None else report.write(target))
    return FINE


def _report(
    scene: Scene, network: bool, arguments: Namespace, rows: Rows, options: dict[str, Any]
) -> LineReport | PlaneReport:
    """The exponents on a line, over complex strengths, or over the axes of --set."""
    import numpy as np

    from ..console.line_report import LineReport, complex_modes
    from ..console.plane_report import PlaneReport
    from ..stability.msf import msf, plane

    alpha = _alpha(arguments)
    if rows:
        with wrong_use():  # what cannot be an axis is known when the orbits and the modes of the network are
            return PlaneReport(plane(scene, None if len(rows) == 2 else alpha, parameters=rows, **options), False)
    if arguments.beta is not None:
        return PlaneReport(plane(scene, alpha, np.array(arguments.beta), **options), network)
    if network:
        warn(complex_modes(scene.topology, float(alpha[-1])))
    return LineReport(msf(scene, alpha, **options), network)


def _alpha(arguments: Namespace) -> np.ndarray:
    """The strengths of --alpha, or those that it has by default."""
    import numpy as np

    return np.linspace(*LINE) if arguments.alpha is None else np.array(arguments.alpha)


def _parted(arguments: Namespace) -> tuple[dict[str, float], Rows]:
    """The numbers and the rows of --set; WrongUse if these are no axes of a map."""
    from synchain.models.sweeps.axis import Axis

    found = settings(arguments)
    numbers = {name: value for name, value in found.items() if isinstance(value, float)}
    rows = {
        name: Axis.from_table(name, value).values if isinstance(value, dict) else value
        for name, value in found.items()
        if not isinstance(value, float)
    }
    if len(rows) > 2:
        raise WrongUse(f"--set: found the axes {', '.join(rows)}; expected at most two")
    for option, given, least in (("--beta", arguments.beta, 1), ("--alpha", arguments.alpha, 2)):
        if given is not None and len(rows) >= least:
            raise WrongUse(f"found {option} beside the axes {', '.join(rows)} of --set; expected two axes")
    return numbers, rows


def _tell(report: LineReport | PlaneReport, json: bool, files: list[Path]) -> None:
    """Print the report and the files' names, as text or as one JSON value."""
    if json:
        print_json({**report.as_dict(), **({"files": [str(file) for file in files]} if files else {})})
        return
    print(report.text())
    for file in files:
        print(f"  {file}")


def _scene(arguments: Namespace, numbers: dict[str, float], rows: Rows) -> tuple[Scene, bool]:
    """The oscillator with its network and its parameters, and whether it has a network; without
    one, two oscillators stand for it.
    """
    from synchain.models.graphs.families import topology
    from synchain.models.scenes.file import load_scene

    from ..cells.keywords import with_numbers

    scene = None if arguments.scene is None else load_scene(arguments.scene)
    network = named_network(arguments, scene)
    if network is not None and not network.link_count:
        raise WrongUse(
            f"{network.name}({network.n}) has no links; expected a network of at least two coupled oscillators"
        )
    given = {**numbers, **{name: values[0] for name, values in rows.items()}}
    if scene is not None and scene.links is not None and network is None and len(rows) == 2:
        return with_numbers(scene_on(None, scene, arguments, given), _known(scene, given)), True
    if network is None and scene is not None and scene.topology.link_count:
        network = scene.topology
    stand_in = scene.topology if scene is not None else topology("chain", 2)
    placed = scene_on(network or stand_in, scene, arguments, given)
    return with_numbers(placed, _known(placed, given)), network is not None


def _known(scene: Scene, given: dict[str, float]) -> dict[str, float]:
    """The values of --set; ValueError for a name that is no parameter of the scene."""
    for name in given:
        if not scene.takes(name):
            raise WrongUse(f"--set: {scene.model.unknown(name, 'parameter', tuple(scene.parameters))}")
    return given


def _check(scene: Scene, network: bool, arguments: Namespace, rows: Rows) -> None:
    """Raise ValueError for what cannot be computed, before anything is."""
    import numpy as np

    from ..console.line_report import complex_modes
    from ..prediction.synchronisability import windows
    from ..stability.orbits import Orbits, pair_of

    axes = (*rows.values(), *(() if len(rows) == 2 else (_alpha(arguments), arguments.beta or (0.0,))))
    if math.prod(map(len, axes)) > POINTS:
        raise WrongUse(f"the axes make more than {POINTS} points; expected fewer: take coarser grids")
    if scene.coupling is None and not scene.model.linked:
        raise WrongUse("the scene has no coupling, by which modes differ; expected one, e.g. coupling = 'spring'")
    if rows:
        return
    one = scene if scene.topology.link_count else pair_of(scene)
    strength = np.zeros(1, dtype=float if arguments.beta is None else complex)
    Orbits.make(one, strength, np.zeros((1, len(one.components))), None)
    if network and not complex_modes(scene.topology, 1.0):
        windows((), scene.topology)
