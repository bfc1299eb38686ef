"""`synchain thresholds`: where a network synchronises."""

from __future__ import annotations

import math
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..console.arguments import above_zero, add_scene, add_workers, positive, spaced
from ..console.drive import drive_words
from ..console.network import add_network, named_network, scene_on
from ..console.outcome import FINE, WrongUse, print_json, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

    from ..prediction.intervals import Interval
    from ..synchronisation.criterion import Criterion
    from ..synchronisation.threshold import Thresholds

SUMMARY = (
    "measure for which coupling a network synchronises, beside the exponents of its modes and the two-oscillator probe"
)
EXAMPLES = (
    "synchain thresholds --n 4 --omega 1.15",
    "synchain thresholds --n 6 --topology star --omega 1.4 --sigma 0:0.3:121 --json",
    "synchain thresholds --matrix G.txt --omega 1.55 --quick",
)

COARSE = 2e-3
"""How closely a first look locates the ends of the ranges in sigma."""


def configure(parser: ArgumentParser) -> None:
    """Add network, drive, grid and criterion."""
    add_scene(parser, default="oscillators of table 1")
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
    """Print the synchronous ranges as a table or as JSON."""
    from ..cells.kernels import kernel_source
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
    said = (*scene.warnings, *hidden_modes(scene))
    warn(said)
    result = thresholds(
        scene,
        sigma=sigma,
        resolution=COARSE if arguments.quick else None,
        criterion=criterion,
        workers=arguments.workers,
    )
    warn(result.warnings[len(said) :])
    if arguments.json:
        print_json(result.as_dict())
    else:
        print(report(result))
    return FINE


def _criterion(arguments: Namespace) -> Criterion:
    """The full criterion, or that of --quick, with what is given."""
    from ..synchronisation.criterion import QUICK, Criterion

    given = {name: getattr(arguments, name) for name in ("starts", "transient") if getattr(arguments, name)}
    return replace(QUICK if arguments.quick else Criterion(), **given)


def _scene(arguments: Namespace) -> Scene:
    """The network that the arguments describe; ValueError if there is none."""
    from synchain.models.scenes.file import load_scene

    scene = None if arguments.scene is None else load_scene(arguments.scene)
    network = named_network(arguments, scene)
    if scene is not None:
        scene.equations.expect_alike("thresholds")
    if network is None:
        if scene is None:
            raise WrongUse("expected a network, e.g. --n 4, --matrix FILE or a SCENE")
        network = scene.topology
    return scene_on(network, scene, arguments)


def report(result: Thresholds) -> str:
    """The ranges as a table."""
    scene = result.scene
    grid, alpha = ((float(x[0]), float(x[-1])) for x in (result.direct.x, result.probe.x))
    steepest = max(abs(value) for value in scene.topology.spectrum.values)
    reach = (*grid, *(end / steepest for end in alpha))
    unit, criterion = "drive periods" if scene.time_unit == "period" else "units of time", result.criterion
    rows = [
        (f"{scene.strength}, negative exponents", _with_errors(result, reach)),
        (f"{scene.strength}, simulated", _written(result.direct.intervals, grid)),
        (f"{scene.strength}, predicted by the probe", _written(result.predicted, reach)),
        *_wu_chua(result),
        (f"alpha = {scene.strength} |gamma|, probe", _written(result.probe.intervals, alpha)),
    ]
    wide = max(len(name) for name, _ in rows)
    return "\n".join(
        [
            f"{scene.topology.name}({scene.n}){drive_words(scene)}: where all oscillators synchronise",
            *(f"  {name:<{wide}}  {ranges}" for name, ranges in rows),
            f"synchronous, simulated and probe: mean error below {criterion.tolerance:.3g} over {criterion.window:.6g} "
            f"{unit} after {criterion.transient:.6g}, from at least half of {criterion.starts} starts",
            *(["...: the grid ends here, the range may go on"] if any("..." in ranges for _, ranges in rows) else []),
        ]
    )


def _wu_chua(result: Thresholds) -> list[tuple[str, str]]:
    """The conjecture's row, if a range of the probe holds no coupling and ends inside the grid."""
    from synchain.models.graphs.families import topology

    from ..synchronisation.threshold import wu_chua

    high = next((high for low, high in result.probe.intervals if low <= 0.0 < high), math.inf)
    if high >= result.probe.x[-1]:
        return []
    end = wu_chua(high / 2.0, topology("chain", 2).spectrum, result.scene.topology.spectrum)
    return [(f"{result.scene.strength}, Wu-Chua conjecture", _written([(0.0, end)], (0.0, math.inf)))]


def _with_errors(result: Thresholds, grid: Sequence[float]) -> str:
    """The windows of the exponents with the errors of their ends, or why there are none."""
    found = result.exponents
    if found.absent:
        return found.words
    words = [_interval(ends, grid, errors) for ends, errors in zip(found.intervals, found.errors, strict=True)]
    return ", ".join(words) or "none"


def _written(ranges: Sequence[Interval], grid: Sequence[float]) -> str:
    return ", ".join(_interval(ends, grid) for ends in ranges) or "none"


def _interval(ends: Interval, grid: Sequence[float], errors: Interval = (0.0, 0.0)) -> str:
    """A range with the errors of its ends, and dots where it ends with the grid, pairs of ends.

    A range from 0 up begins where couplings do.
    """
    words = []
    for end, error, lasts in zip(ends, errors, (grid[::2] if ends[0] else (), grid[1::2]), strict=True):
        onwards = any(math.isclose(end, last, rel_tol=1e-12) for last in lasts)
        words.append(f"{end:z.4f}{'...' if onwards else f' ± {error:.1g}' if error else ''}")
    return f"[{', '.join(words)}]"
