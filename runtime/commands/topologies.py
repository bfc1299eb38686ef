"""`synchain topologies`: the families of graphs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE

SUMMARY = "list the families of graphs"
EXAMPLES = ("synchain topologies",)


def configure(parser: ArgumentParser) -> None:
    """No arguments."""


def execute(arguments: Namespace) -> int:
    """Print name, summary, smallest size and options of every family."""
    from synchain.models.graphs.families import defaults, family, names

    rows = [(name, family(name)) for name in names()]
    wide = max(len(name) for name, _ in rows)
    for name, module in rows:
        options = ", ".join(defaults(module))
        more = f"; options: {options}" if options else ""
        print(f"{name:<{wide}}  {module.SUMMARY}, {module.MINIMUM} or more nodes{more}")
    return FINE
