"""`synchain bench`: the benchmarks that come with the package."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from ..console.arguments import folder
from ..console.outcome import FINE, wrong_use

SUMMARY = "run benchmarks and print their tables"
EXAMPLES = ("synchain bench precision --quick", "synchain bench precision --out out", "synchain bench")


def configure(parser: ArgumentParser) -> None:
    """Add names, folder and effort."""
    parser.add_argument(
        "names", metavar="BENCHMARK", nargs="*", help="benchmarks to run, e.g. precision (default: all)"
    )
    effort = parser.add_mutually_exclusive_group()
    effort.add_argument("--quick", action="store_true", help="fewer repetitions and shorter runs")
    effort.add_argument(
        "--long", action="store_true", help="runs of hours, of benchmarks that have them (energy, scale)"
    )
    parser.add_argument(
        "--out", metavar="DIR", type=folder, help="folder for each table as CSV and Markdown, and for its figure"
    )


def execute(arguments: Namespace) -> int:
    """Run the benchmarks one after the other and print a Markdown table of each; with a folder,
    write files as well.
    """
    from ..bench import load, machine, text, write
    from ..bench import names as known
    from ..support.files import output_folder

    with wrong_use():
        benchmarks = [(name, load(name)) for name in arguments.names or known()]
        short = [name for name, module in benchmarks if arguments.long and not hasattr(module, "measure_long")]
        if short:
            raise ValueError(f"benchmark {short[0]!r} has no long form; leave out --long or name others")
        target = None if arguments.out is None else output_folder(arguments.out)
    print(machine())
    for name, module in benchmarks:
        for line in module.notes() if hasattr(module, "notes") else ():
            print(line, file=sys.stderr)
        rows = module.measure_long() if arguments.long else module.measure(arguments.quick)
        print(f"\n{name}\n\n{text(module, rows)}", flush=True)
        for path in () if target is None else write(name, module, rows, target):
            print(path)
    return FINE
