"""`synchain bench`: the benchmarks that come with the package."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ._outcome import FINE, wrong_use

SUMMARY = "run benchmarks and print their tables"
EXAMPLES = ("synchain bench precision --quick", "synchain bench")


def configure(parser: ArgumentParser) -> None:
    """Add names and effort."""
    parser.add_argument("names", metavar="NAME", nargs="*", help="benchmarks to run, e.g. precision (default: all)")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions and shorter runs")


def execute(arguments: Namespace) -> int:
    """Run the benchmarks one after the other and print a Markdown table of each."""
    from ..bench import load, machine, markdown, names

    with wrong_use():
        chosen = [(name, load(name)) for name in arguments.names or names()]
    print(machine())
    for name, module in chosen:
        print(f"\n{name}\n\n{markdown(module.COLUMNS, module.measure(arguments.quick))}", flush=True)
    return FINE
