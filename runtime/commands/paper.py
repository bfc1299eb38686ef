"""`synchain paper`: every figure and threshold of the paper, and the master stability function
beside them.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..console.arguments import add_workers, folder
from ..console.outcome import FINE, wrong_use

SUMMARY = "make the paper's figures, those of the exponents, and the table of thresholds"
EXAMPLES = ("synchain paper --out figures", "synchain paper 4b 5 --quick", "synchain paper msf msf_plane --quick")


def configure(parser: ArgumentParser) -> None:
    parser.add_argument(
        "names",
        metavar="FIGURE",
        nargs="*",
        help="what to make, e.g. figure_4b, in short 4b, msf or thresholds (default: all)",
    )
    parser.add_argument(
        "--out", metavar="DIR", type=folder, default="figures", help="folder for the files (default: figures)"
    )
    parser.add_argument("--quick", action="store_true", help="coarse grids: the same code in minutes")
    add_workers(parser)


def execute(arguments: Namespace) -> int:
    import matplotlib

    matplotlib.use("Agg")

    from ..paper import load, names
    from ..paper.make import written
    from ..support.files import output_folder

    with wrong_use():
        known = names(extra=True)
        wanted = [f"figure_{name}" if f"figure_{name}" in known else name for name in arguments.names]
        for name in wanted:
            load(name)
        target = output_folder(arguments.out)
    files: list[Path] = []
    try:
        for file in written(wanted, target, arguments.quick, arguments.workers, None):
            files.append(file)
    finally:  # at Ctrl-C too, and after the progress bar
        for file in files:
            print(file)
    return FINE
