"""`synchain reproduce`: numbers that papers print, computed again."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FAILED, FINE, WrongUse, print_json, wrong_use
from ..console.scene_arguments import print_value

SUMMARY = "compute the numbers of a paper again, and print both"
EXAMPLES = ("synchain reproduce --list", "synchain reproduce bayani_2024", "synchain reproduce pecora_2014 --json")


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("name", metavar="PAPER", nargs="?", help="a name that --list prints")
    parser.add_argument("--list", action="store_true", help="list the papers, with titles and citations")
    parser.add_argument("--json", action="store_true", help="print JSON: published, found and difference by quantity")


def execute(arguments: Namespace) -> int:
    """Print the table of a paper; exit code 1 where a number does not agree."""
    from .. import papers

    if arguments.list:
        listing = {name: papers.title(name) for name in papers.names()}
        if arguments.json:
            print_json(listing)
        else:
            width = max(map(len, listing))
            print("\n".join(f"{name:<{width}}  {title}" for name, title in listing.items()))
        return FINE
    if arguments.name is None:
        raise WrongUse("found no paper; expected a name; synchain reproduce --list prints the names")
    with wrong_use():
        papers.script(arguments.name)
    import matplotlib

    matplotlib.use("Agg")
    table = papers.reproduce(arguments.name)
    print_value(table, arguments.json)
    return FINE if table.reproduced else FAILED
