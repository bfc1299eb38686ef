"""`synchain topologies`: the families of graphs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ._outcome import FINE

SUMMARY = "list the families of graphs"
EXAMPLES = ("synchain topologies",)


def configure(parser: ArgumentParser) -> None:
    """No arguments."""


def execute(arguments: Namespace) -> int:
    """Print name, summary and smallest size of every family."""
    from synchain.models.topology import family, names

    rows = [(name, family(name)) for name in names()]
    wide = max(len(name) for name, _ in rows)
    for name, module in rows:
        print(f"{name:<{wide}}  {module.SUMMARY}, {module.MINIMUM} or more nodes")
    return FINE
