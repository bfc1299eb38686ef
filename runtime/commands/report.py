"""`synchain report`: one page on a scene, to be read in a browser or on paper."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.arguments import add_workers
from ..console.outcome import FINE, WrongUse, warn, wrong_use
from ..console.scene_arguments import add_changed_scene, changed_scene

SUMMARY = "write one page on a scene: equations, graph, spectrum, stability, a sweep (HTML)"
EXAMPLES = (
    "synchain report figure_4a --out figure_4a.html",
    "synchain report huygens --out huygens.html --quick",
)


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser, more="a,b,c or LO:HI:N sweeps a parameter or an initial state")
    parser.add_argument("--out", metavar="FILE", required=True, help="the page, which ends in .html")
    parser.add_argument("--quick", action="store_true", help="coarse grids: at most 25 values of each axis")
    add_workers(parser)


def execute(arguments: Namespace) -> int:
    from pathlib import Path

    from ..reports.scene_report import QUICK, Effort, report
    from ..support.files import check_replaceable, output_folder, write_text

    with wrong_use():
        scene = changed_scene(arguments)
        target = Path(arguments.out)
        check_replaceable(target)
        if target.suffix.lower() not in (".html", ".htm"):
            raise WrongUse(f"--out {target}: found the ending {target.suffix!r} of a page of HTML; expected .html")
        output_folder(target.parent)
    warn(scene.warnings)
    write_text(target, report(scene, QUICK if arguments.quick else Effort(), workers=arguments.workers))
    print(f"  {target}")
    return FINE
