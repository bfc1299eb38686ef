"""`synchain spectrum`: the exact eigenvalues of a connectivity matrix."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from ._arguments import whole
from ._outcome import FINE, WrongUse, print_json, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.topology import Topology

SUMMARY = "print the exact eigenvalues of a graph's connectivity matrix"
EXAMPLES = (
    "synchain spectrum chain 4",
    "synchain spectrum star 6 --json",
    "synchain spectrum --matrix G.txt",
)

PROVED = 500
"""Up to so many nodes closed forms are multiplied out here; this takes about two seconds."""


def configure(parser: ArgumentParser) -> None:
    """Add topology and size, or a file."""
    parser.add_argument("topology", metavar="TOPOLOGY", nargs="?", help="a family of graphs (see: synchain topologies)")
    parser.add_argument("n", metavar="N", nargs="?", type=whole, help="number of nodes")
    parser.add_argument(
        "--matrix",
        metavar="FILE",
        help="a text file of rows such as '-1 1/2 0.5' that sum to zero; '#' starts a comment",
    )
    parser.add_argument("--json", action="store_true", help="print JSON: n, eigenvalues, verified")


def execute(arguments: Namespace) -> int:
    """Print the spectrum as a table or as JSON."""
    from synchain.models.spectrum import spectrum, table

    with wrong_use():
        chosen = graph(arguments)
        found = spectrum(chosen, prove=chosen.n <= PROVED)
    zero = found.eigenvalues[0]
    if zero.multiplicity > 1 and zero.exact == 0:
        warn([f"zero is an eigenvalue of multiplicity {zero.multiplicity}: {_reason(chosen)}"])
    if arguments.json:
        print_json(found.as_dict())
    else:
        print(table(found))
    return FINE


def graph(arguments: Namespace) -> Topology:
    """The graph that the arguments `topology`, `n` and `matrix` ask for."""
    from synchain.models.topology import read_matrix, topology

    if arguments.matrix is not None:
        if arguments.topology is not None or arguments.n is not None:
            raise WrongUse("found both a topology and --matrix; expected one of them")
        return read_matrix(arguments.matrix)
    if arguments.topology is None or arguments.n is None:
        raise WrongUse("expected TOPOLOGY and N, e.g. synchain spectrum chain 4, or --matrix FILE")
    return topology(arguments.topology, arguments.n)


def _reason(graph: Topology) -> str:
    parts = graph.components
    why = f"the graph falls into {parts} parts" if parts > 1 else "some nodes cannot reach one another"
    return f"{why}, so its coupling alone never synchronises it completely"
