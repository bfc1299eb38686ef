"""`synchain doctor`: is this installation sound?"""

from __future__ import annotations

import sys
import warnings
from argparse import ArgumentParser, Namespace

from ..console.outcome import FAILED, FINE, print_json

SUMMARY = "check the installation, the cache, the processor and known answers"
EXAMPLES = ("synchain doctor", "synchain doctor --json")


def configure(parser: ArgumentParser) -> None:
    """Add the form of the report."""
    parser.add_argument("--json", action="store_true", help="one JSON value on stdout")


def execute(arguments: Namespace) -> int:
    """Print one line for each check; exit code 1 where something is wrong."""
    from ..console.doctor import examine

    checks = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # that kernels are not kept on disk is a line of its own
        for check in examine():
            checks.append(check)
            if not arguments.json:
                remedy = f"\n{'':32}{check.remedy}" if check.remedy else ""
                print(f"{check.outcome:<9} {check.name:<21} {check.found}{remedy}", flush=True)
    wrong = [check.name for check in checks if check.outcome == "wrong"]
    if arguments.json:
        print_json({"sound": not wrong, "checks": [check.as_dict() for check in checks]})
    if wrong:
        print(f"synchain doctor: wrong: {', '.join(wrong)}", file=sys.stderr)
    return FAILED if wrong else FINE
