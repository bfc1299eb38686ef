"""`synchain show`: the summary of a file with a result of any kind."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, Failed, sentence, wrong_use
from ..console.scene_arguments import print_value

SUMMARY = "print the summary of a saved result of any kind"
EXAMPLES = (
    "synchain show results/figure_4a.nc",
    "synchain show results/figure_4a.partial",
    "synchain show msf.nc --json",
)


def configure(parser: ArgumentParser) -> None:
    parser.add_argument(
        "file", metavar="FILE", help="a .nc, .nc4 or .zarr file, or the .partial file of a run that is not finished"
    )
    parser.add_argument("--json", action="store_true", help="print JSON: all variables of a result")


def execute(arguments: Namespace) -> int:
    from ..results.open import open_result

    with wrong_use():
        try:
            value = open_result(arguments.file)
        except ModuleNotFoundError as problem:
            raise Failed(sentence(problem)) from problem
    print_value(value, arguments.json)
    return FINE
