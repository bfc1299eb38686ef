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
from ..console.network_arguments import add_network, named_network, scene_on
from ..console.outcome import FINE, Failed, WrongUse, print_json, sentence, warn, wrong_use

if TYPE_CHECKING:
    import numpy as np

    from synchain.models.scenes.scene import Scene

    from ..stability.exponent_plane import Plane
    from ..stability.msf import MSF

Rows: TypeAlias = "dict[str, tuple[float, ...]]"  # the values of parameters that are axes

SUMMARY = "compute the exponents of a network's modes from tangent equations, and where the network synchronises"
EXAMPLES = (
    "synchain msf figure_8",
    "synchain msf --omega 1.4 --topology star --n 5 --json",
    "synchain msf --omega 1.4 --matrix G.txt --alpha 0:1.2:81 --beta 0:0.6:41 --out results",
    "synchain msf figure_8 --alpha 0:1.2:121 --set omega=1.1:1.9:41 --out results",
    "synchain msf figure_8 --set sigma=0:0.4:81 omega=1.1:1.9:41 --out results",
)

POINTS = 1_000_000  # most points of one plane


def configure(parser: ArgumentParser) -> None:
    add_scene(parser, default="the oscillator of table 1")
    parser.add_argument(
        "--alpha",
        metavar="LO:HI:N",
        type=spaced,
        help="strengths, -sigma times an eigenvalue (default: 241 that reach all modes at the strengths of SCENE)",
    )
    parser.add_argument("--beta", metavar="LO:HI:N", type=spaced, help="imaginary parts: look at complex strengths")
    add_set(
        parser,
        "set a parameter; a,b,c or LO:HI:N makes it an axis of a map: over alpha and a parameter, or over two "
        "parameters of the network",
    )
    parser.add_argument(
        "--precision",
        metavar="P",
        type=at_least_zero,
        help="standard error to be reached (default: 0.001 for a period of 2 pi)",
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
    """Compute the function on a line or over a plane, print its summary, write its files."""
    import numpy as np

    from ..stability.exponent_plane import plane
    from ..stability.msf import default_strengths, msf
    from ..support.files import output_folder

    with wrong_use():
        constants, rows = _constants_and_rows(arguments)
        scene = _scene(arguments, constants, rows)
        alpha = default_strengths(scene) if arguments.alpha is None else np.array(arguments.alpha)
        scene = scene.replace(axes=())  # an axis of the strength has said how far the modes reach
        complex_modes = _check(scene, arguments, rows, alpha)
        target = None if arguments.out is None else output_folder(arguments.out)
    warn([*scene.warnings, *complex_modes])
    options: dict[str, Any] = {"workers": arguments.workers, "show_progress": None}
    effort = {name: getattr(arguments, name) for name in ("precision", "periods", "starts")}
    options.update({name: value for name, value in effort.items() if value is not None})
    function: MSF | Plane
    try:
        if rows:
            with wrong_use():  # a wrong axis shows only in the orbits and the modes of the network
                function = plane(scene, None if len(rows) == 2 else alpha, parameters=rows, **options)
        elif arguments.beta is not None:
            function = plane(scene, alpha, np.array(arguments.beta), **options)
        else:
            function = msf(scene, alpha, **options)
    except FloatingPointError as problem:
        raise Failed(sentence(problem)) from problem
    files = [] if target is None else _write(function, target)
    if arguments.json:
        print_json({**function.as_dict(), **({"files": list(map(str, files))} if files else {})})
    else:
        print(function, *(f"  {file}" for file in files), sep="\n")
    return FINE


def _write(function: MSF | Plane, folder: Path) -> list[Path]:
    """Write numbers and plot, over complex strengths with the rays of modes; return both paths."""
    from ..plots.canvas import off_screen
    from ..plots.csv_table import as_csv
    from ..plots.plane import draw_rays
    from ..stability.exponent_plane import Plane
    from ..support.files import whole_file, write_text

    paths = [folder / f"{type(function).__name__.lower()}{ending}" for ending in (".csv", ".png")]
    table = function.data[["exponent", "stderr"]].to_dataframe().reset_index()
    write_text(paths[0], as_csv(tuple(table.columns), table.itertuples(index=False, name=None)))
    with off_screen() as (figure, axes), whole_file(paths[1]) as temporary:
        scene = function.scene
        function.plot(axes)
        if isinstance(function, Plane) and function.has_windows:
            draw_rays(axes, function, scene.parameters[scene.strength] or None)
        figure.savefig(temporary, dpi=200)
    return paths


def _constants_and_rows(arguments: Namespace) -> tuple[dict[str, float], Rows]:
    """Return the numbers and the rows of --set; raise WrongUse if the rows are no axes of a map."""
    from synchain.models.sweeps.axis import Axis

    values = settings(arguments)
    constants = {name: value for name, value in values.items() if isinstance(value, float)}
    rows = {
        name: Axis.from_table(name, value).values if isinstance(value, dict) else value
        for name, value in values.items()
        if not isinstance(value, float)
    }
    if len(rows) > 2:
        raise WrongUse(f"--set: found the axes {', '.join(rows)}; expected at most two")
    for option, grid, most in (("--beta", arguments.beta, 1), ("--alpha", arguments.alpha, 2)):
        if grid is not None and len(rows) >= most:
            raise WrongUse(f"found {option} beside the axes {', '.join(rows)} of --set; expected two axes")
    return constants, rows


def _scene(arguments: Namespace, constants: dict[str, float], rows: Rows) -> Scene:
    """Return the oscillator with its network and its parameters; without a network a single oscillator."""
    from synchain.models.graphs.families import topology
    from synchain.models.scenes.file import load_scene

    from ..cells.run_keywords import with_numbers

    scene = None if arguments.scene is None else load_scene(arguments.scene)
    network = named_network(arguments, scene)
    if network is not None and not network.link_count:
        raise WrongUse(
            f"{network.name}({network.n}) has no links; expected a network of at least two coupled oscillators"
        )
    parameters = {**constants, **{name: values[0] for name, values in rows.items()}}
    layered = scene is not None and scene.links is not None and len(rows) == 2
    if network is None and not layered:
        network = topology("chain", 1) if scene is None else scene.topology
    cell = scene_on(network, scene, arguments, parameters)
    for name in parameters:
        if not cell.takes(name):
            raise WrongUse(f"--set: {cell.model.unknown(name, 'parameter', tuple(cell.parameters))}")
    # an axis of the strength stays, for the strengths of the modes
    axes = () if scene is None or layered else scene.axes
    return with_numbers(
        cell, parameters, axes=[a for a in axes if a.name in cell.strengths and a.name not in parameters]
    )


def _check(scene: Scene, arguments: Namespace, rows: Rows, alpha: np.ndarray) -> list[str]:
    """Raise ValueError for what cannot be computed; return warnings of complex eigenvalues."""
    import numpy as np

    from ..prediction.mode_windows import transversal_modes
    from ..prediction.synchronisability import windows
    from ..stability.orbits import OrbitProblem, pair_of

    axes = (*rows.values(), *(() if len(rows) == 2 else (alpha, arguments.beta or (0.0,))))
    if math.prod(map(len, axes)) > POINTS:
        raise WrongUse(f"the axes make more than {POINTS} points; expected fewer: take coarser grids")
    if scene.coupling is None and not scene.model.linked:
        raise WrongUse("the scene has no coupling, by which modes differ; expected one, e.g. coupling = 'spring'")
    if rows:
        return []
    graph = scene.topology
    one = scene if graph.link_count else pair_of(scene)
    strength = np.zeros(1, dtype=float if arguments.beta is None else complex)
    OrbitProblem.of_modes(one, strength, np.zeros((1, len(one.components))), None)
    if not graph.link_count:
        return []
    gammas = [complex(mode.eigenvalue.value) for mode in transversal_modes(graph)]
    if not any(gamma.imag for gamma in gammas):
        windows((), graph)
        return []
    top = max((abs(g.imag / g.real) for g in gammas if g.imag and g.real), default=1.0) * float(alpha[-1])
    return (
        []
        if arguments.beta is not None
        else [
            f"{graph.name}({graph.n}) has complex eigenvalues, for which a line of alpha says nothing; "
            f"no windows of sigma are given: add --beta, e.g. --beta 0:{top:.2g}:61"
        ]
    )
