"""`python -m benchmarks`: run benchmarks and print their tables."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence

import benchmarks
from synchain.runtime.console.arguments import folder
from synchain.runtime.console.outcome import sentence
from synchain.runtime.support.files import output_folder


def parser() -> ArgumentParser:
    """Return the parser of the command line."""
    reader = ArgumentParser(
        "python -m benchmarks", description="Run benchmarks and print their tables.", allow_abbrev=False
    )
    reader.add_argument(
        "names", metavar="BENCHMARK", nargs="*", help="benchmarks to run, e.g. precision (default: all)"
    )
    effort = reader.add_mutually_exclusive_group()
    effort.add_argument("--quick", action="store_true", help="fewer repetitions and shorter runs")
    effort.add_argument(
        "--long", action="store_true", help="runs of hours, of benchmarks that have them (energy, scale)"
    )
    reader.add_argument(
        "--out", metavar="DIR", type=folder, help="folder for each table as CSV and Markdown, and for its figure"
    )
    return reader


def main(words: Sequence[str] | None = None) -> int:
    """Run benchmarks and print a Markdown table of each; with a folder, write files as well."""
    reader = parser()
    arguments = reader.parse_intermixed_args(words)
    try:
        chosen = [(name, benchmarks.load(name)) for name in arguments.names or benchmarks.names()]
        short = [name for name, module in chosen if arguments.long and not hasattr(module, "measure_long")]
        if short:
            raise ValueError(f"benchmark {short[0]!r} has no long form; leave out --long or name others")
        target = None if arguments.out is None else output_folder(arguments.out)
    except (ValueError, OSError) as problem:
        reader.error(sentence(problem))
    print(benchmarks.machine())
    for name, module in chosen:
        for line in module.notes() if hasattr(module, "notes") else ():
            print(line, file=sys.stderr)
        rows = module.measure_long() if arguments.long else module.measure(arguments.quick)
        print(f"\n{name}\n\n{benchmarks.text(module, rows)}", flush=True)
        for path in () if target is None else benchmarks.write(name, module, rows, target):
            print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
