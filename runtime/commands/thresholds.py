"""`synchain thresholds`: where a network synchronises."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from typing import TYPE_CHECKING

from ..console.arguments import above_zero, add_workers, positive, settings, spaced
from ..console.network_arguments import add_network, named_network, scene_on
from ..console.outcome import FINE, WrongUse, warn, wrong_use
from ..console.scene_arguments import add_changed_scene, print_value, with_settings

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

    from ..synchronisation.criterion import Criterion

SUMMARY = (
    "measure for which coupling a network synchronises, beside the exponents of its modes and the two-oscillator probe"
)
EXAMPLES = (
    "synchain thresholds --n 4 --omega 1.15",
    "synchain thresholds --n 6 --topology star --omega 1.4 --sigma 0:0.3:121 --json",
    "synchain thresholds --matrix G.txt --omega 1.55 --quick",
)

COARSE = 2e-3  # width in sigma to which a first look refines the ends of the ranges


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser, default="oscillators of table 1")
    add_network(parser)
    parser.add_argument(
        "--sigma",
        metavar="LO:HI:N",
        type=spaced,
        help="coupling to look at, e.g. --sigma=-0.1:0.3:81 (default: 0:1.2/max|gamma|); narrower ranges are not seen",
    )
    parser.add_argument("--starts", metavar="K", type=positive, help="initial states for each value (default: 8)")
    parser.add_argument(
        "--transient",
        metavar="P",
        type=above_zero,
        help="drive periods, or units of time, before the error is averaged (default: that of SCENE, or 1000 periods)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help=f"a first look: 5 starts, 400 periods, rtol 1e-6, half the grid; ends to {COARSE:g}",
    )
    parser.add_argument("--json", action="store_true", help="print JSON: intervals, probe, predicted, exponents ...")
    add_workers(parser)


def execute(arguments: Namespace) -> int:
    from ..engines.scene_kernels import kernel_source
    from ..synchronisation.hidden_modes import hidden_modes
    from ..synchronisation.threshold import check_probe, default_grid, thresholds

    with wrong_use():
        scene = _scene(arguments)
        check_probe(scene.topology, scene.spectrum)
        if not scene.model.linked:
            raise WrongUse("the scene has no coupling; expected a coupled network; choose another SCENE")
        kernel_source(scene)
        criterion = _criterion(arguments)
        sigma = arguments.sigma or default_grid(scene.topology.spectrum, 0.005 if arguments.quick else 0.0025)
        scene.replace(axes={scene.strength: sigma})
    warn((*scene.warnings, *hidden_modes(scene)))
    result = thresholds(
        scene,
        sigma=sigma,
        resolution=COARSE if arguments.quick else None,
        criterion=criterion,
        workers=arguments.workers,
    )
    print_value(result, arguments.json)
    return FINE


def _criterion(arguments: Namespace) -> Criterion:
    """Return the full criterion, or that of --quick, with --starts and --transient."""
    from ..synchronisation.criterion import QUICK, Criterion

    changes = {name: getattr(arguments, name) for name in ("starts", "transient") if getattr(arguments, name)}
    return replace(QUICK if arguments.quick else Criterion(), **changes)


def _scene(arguments: Namespace) -> Scene:
    """Return the network that the arguments describe; raise WrongUse if there is none."""
    from synchain.models.scenes.file import load_scene

    scene = None if arguments.scene is None else load_scene(arguments.scene)
    network = named_network(arguments, scene)
    if scene is not None:
        scene.equations.expect_alike("thresholds")
    if network is None:
        if scene is None:
            raise WrongUse("expected a network, e.g. --n 4, --matrix FILE or a SCENE")
        network = scene.topology
    return with_settings(scene_on(network, scene, arguments, settings(arguments)), arguments)
