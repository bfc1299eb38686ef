"""`synchain spectrum`: the exact eigenvalues of a connectivity matrix."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from ..console.arguments import add_allow_code, whole
from ..console.network_arguments import FILES, named_graph, named_values
from ..console.outcome import FINE, WrongUse, print_json, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.graphs.topology import Topology

SUMMARY = "print the exact eigenvalues of a graph's connectivity matrix"
EXAMPLES = (
    "synchain spectrum chain 4",
    "synchain spectrum star 6 --json",
    "synchain spectrum circulant 10 --option offsets=1,3",
    "synchain spectrum petersen 10 --of adjacency",
    "synchain spectrum 'cartesian(chain(4), ring(5))'",
    "synchain spectrum torus --symbolic --option shape=pxqxr",
    "synchain spectrum 'cartesian(chain, star)' --symbolic",
    "synchain spectrum --matrix G.txt",
    "synchain spectrum --edges friends.txt",
    "synchain spectrum --graphml network.graphml",
)

PROVED = 500  # most nodes for which closed forms are multiplied out; this takes about two seconds
SHOWN = 200  # distinct eigenvalues in a table without --all
# The matrices of `--of`: attributes of a graph.
OTHERS = ("adjacency", "laplacian", "signless_laplacian", "random_walk_laplacian")
CHECKED = 1000  # most nodes for which they are multiplied out modulo primes; this takes some seconds


def configure(parser: ArgumentParser) -> None:
    parser.add_argument(
        "topology", metavar="TOPOLOGY", nargs="?", help="a family of graphs (see: synchain list graphs), or a product"
    )
    parser.add_argument("n", metavar="N", nargs="?", type=whole, help="number of nodes")
    parser.add_argument(
        "--option",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="an option of the family, e.g. offsets=1,3 or p=1/10 (see: synchain list graphs); may be repeated",
    )
    parser.add_argument(
        "--matrix",
        metavar="FILE",
        help="a text file of rows such as '-1 1/2 0.5' that sum to zero; '#' starts a comment",
    )
    parser.add_argument("--edges", metavar="FILE", help="a text file of edges, one a line: two nodes, perhaps a weight")
    parser.add_argument("--directed", action="store_true", help="edges of the file act on their second node only")
    parser.add_argument("--graphml", metavar="FILE", help="a GraphML file; weights as 'weight' of its edges")
    parser.add_argument(
        "--of",
        metavar="MATRIX",
        choices=OTHERS,
        help=f"another matrix than the connectivity matrix G: {', '.join(OTHERS)}",
    )
    add_allow_code(parser)
    parser.add_argument(
        "--symbolic", action="store_true", help="the closed form of a family, or of a --matrix of letters"
    )
    parser.add_argument(
        "--value",
        metavar="NAME=NUMBER",
        action="append",
        default=[],
        help="with --symbolic --matrix: a number for a letter",
    )
    parser.add_argument("--all", action="store_true", help=f"print more than {SHOWN} distinct eigenvalues as well")
    parser.add_argument(
        "--json", action="store_true", help="print JSON: n, polynomials, all eigenvalues, verified, chance"
    )


def execute(arguments: Namespace) -> int:
    if arguments.value and not (arguments.symbolic and arguments.matrix):
        raise WrongUse("found --value without --symbolic --matrix FILE; expected all of them")
    from synchain.models.spectra.solve import Proof, spectrum
    from synchain.models.spectra.spectrum import table

    if arguments.symbolic:
        if arguments.of is not None:
            raise WrongUse("found --of with --symbolic; closed forms with symbols are those of G: give a size instead")
        # Print the closed form of a family with symbols for its size, or the spectrum of a matrix of letters.
        from synchain.models.graphs.closed_forms import closed_form
        from synchain.models.graphs.graph_text import is_composed, read_form

        if arguments.matrix is not None and arguments.topology is None:
            return _letters(arguments)
        files = [key for key in FILES if getattr(arguments, key) is not None]
        if arguments.topology is None or arguments.n is not None or files:
            raise WrongUse("--symbolic: expected a family without its size, e.g. synchain spectrum chain --symbolic")
        name, options = arguments.topology, named_values(arguments.option)
        if is_composed(name) and options:
            raise WrongUse("--option: expected in the text of a product, e.g. 'cartesian(chain, torus(shape=(p, q)))'")
        with wrong_use():
            form = read_form(name) if is_composed(name) else closed_form(name, **options)
        if arguments.json:
            print_json({"topology": form.name, **form.as_dict()})
        else:
            print(form.text)
        return FINE
    with wrong_use():
        graph = named_graph(arguments)
        matrix = graph if arguments.of is None else getattr(graph, arguments.of)
        eigenvalues = spectrum(matrix, Proof.of_size(graph.n, PROVED, CHECKED))
    if arguments.of is None and eigenvalues.zeros > 1:
        warn([f"zero is an eigenvalue of multiplicity {eigenvalues.zeros}: {_reason(graph)}"])
    if arguments.json:
        print_json(eigenvalues.as_dict())
    else:
        print(table(eigenvalues, None if arguments.all else SHOWN))
    return FINE


def _letters(arguments: Namespace) -> int:
    from synchain.models.graphs.symbolic import read_symbols
    from synchain.models.spectra.spectrum import table

    with wrong_use():
        matrix = read_symbols(arguments.matrix)
        if arguments.value:
            values = named_values(arguments.value, "--value", "NAME=NUMBER, e.g. a=1/2")
            exact = matrix.at(**values).spectrum
            text, as_dict = table(exact), exact.as_dict()
        else:
            symbolic = matrix.spectrum
            text, as_dict = symbolic.text, symbolic.as_dict()
    if arguments.json:
        print_json(as_dict)
    else:
        print(text)
    return FINE


def _reason(graph: Topology) -> str:
    parts = graph.components
    why = f"the graph falls into {parts} parts" if parts > 1 else "some nodes cannot reach one another"
    return f"{why}, so its coupling alone never synchronises it completely"
