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
    from synchain.models.graphs.families import family, names

    families = [family(name) for name in names()]
    width = max(len(each.name) for each in families)
    for each in families:
        options = f"; options: {', '.join(each.options)}" if each.options else ""
        print(f"{each.name:<{width}}  {each.summary}, {each.minimum} or more nodes{options}")
    return FINE
