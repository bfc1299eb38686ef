"""`synchain merge`: the result of a sweep whose parts were run by the jobs of a job array."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import wrong_use

SUMMARY = "merge the parts of a sweep, run with --part, into its result"
EXAMPLES = (
    "synchain merge results/figure_4a.*of8.partial --out results/figure_4a.nc",
    "synchain merge results/figure_4a.*of8.partial --out results/figure_4a.zarr --overwrite",
)


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("parts", metavar="PART", nargs="+", help="the files .KofN.partial of all N parts, in any order")
    parser.add_argument(
        "--out", metavar="FILE", required=True, help="the result, which ends in .nc, .nc4 or .zarr; the parts are kept"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace a result that is there already")


def execute(arguments: Namespace) -> int:
    from pathlib import Path

    from ..support.files import output_folder
    from ..sweeps.merge_parts import merge
    from .run import print_run

    with wrong_use():
        output_folder(Path(arguments.out).parent)
        done = merge(arguments.parts, arguments.out, overwrite=arguments.overwrite)
    return print_run(done, "merge")
