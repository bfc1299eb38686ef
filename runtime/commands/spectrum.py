"""`synchain spectrum`: the exact eigenvalues of a connectivity matrix."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from ..console.arguments import add_allow_code, whole
from ..console.outcome import FINE, WrongUse, print_json, warn, wrong_use

if TYPE_CHECKING:
    from synchain.models.graphs.topology import Topology

SUMMARY = "print the exact eigenvalues of a graph's connectivity matrix"
EXAMPLES = (
    "synchain spectrum chain 4",
    "synchain spectrum star 6 --json",
    "synchain spectrum circulant 10 --option offsets=1,3",
    "synchain spectrum 'cartesian(chain(4), ring(5))'",
    "synchain spectrum torus --symbolic --option shape=pxqxr",
    "synchain spectrum 'cartesian(chain, star)' --symbolic",
    "synchain spectrum --matrix G.txt",
    "synchain spectrum --edges friends.txt",
    "synchain spectrum --graphml network.graphml",
)

FILES = ("matrix", "edges", "graphml")

PROVED = 500
"""Up to so many nodes closed forms are multiplied out here; this takes about two seconds."""

SHOWN = 200
"""Distinct eigenvalues in a table without --all."""

CHECKED = 1000
"""Up to so many nodes they are multiplied out modulo primes; this takes some seconds."""


def configure(parser: ArgumentParser) -> None:
    """Add topology, size and options, or a file."""
    parser.add_argument(
        "topology", metavar="TOPOLOGY", nargs="?", help="a family of graphs (see: synchain topologies), or a product"
    )
    parser.add_argument("n", metavar="N", nargs="?", type=whole, help="number of nodes")
    parser.add_argument(
        "--option", metavar="NAME=VALUE", action="append", default=[],
        help="an option of the family, e.g. offsets=1,3 or p=1/10 (see: synchain topologies); may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--matrix",
        metavar="FILE",
        help="a text file of rows such as '-1 1/2 0.5' that sum to zero; '#' starts a comment",
    )
    parser.add_argument("--edges", metavar="FILE", help="a text file of edges, one a line: two nodes, perhaps a weight")
    parser.add_argument("--directed", action="store_true", help="edges of the file act on their second node only")
    parser.add_argument("--graphml", metavar="FILE", help="a GraphML file; weights as 'weight' of its edges")
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
    """Print the spectrum as a table or as JSON."""
    if arguments.value and not (arguments.symbolic and arguments.matrix):
        raise WrongUse("found --value without --symbolic --matrix FILE; expected all of them")
    from synchain.models.spectra.solve import Proof, spectrum
    from synchain.models.spectra.spectrum import table

    if arguments.symbolic:
        return _symbolic(arguments)
    with wrong_use():
        chosen = graph(arguments)
        found = spectrum(chosen, Proof.of_size(chosen.n, PROVED, CHECKED))
    if found.zeros > 1:
        warn([f"zero is an eigenvalue of multiplicity {found.zeros}: {_reason(chosen)}"])
    if arguments.json:
        print_json(found.as_dict())
    else:
        print(table(found, None if arguments.all else SHOWN))
    return FINE


def _symbolic(arguments: Namespace) -> int:
    """Print the closed form of a family with symbols for its size, or the spectrum of a matrix of letters."""
    from synchain.models.graphs.closed_forms import closed_form
    from synchain.models.graphs.graph_text import is_composed, read_form

    if arguments.matrix is not None and arguments.topology is None:
        return _letters(arguments)
    given = [key for key in FILES if getattr(arguments, key) is not None]
    if arguments.topology is None or arguments.n is not None or given:
        raise WrongUse("--symbolic: expected a family without its size, e.g. synchain spectrum chain --symbolic")
    name, options = arguments.topology, _options(arguments.option)
    if is_composed(name) and options:
        raise WrongUse("--option: expected in the text of a product, e.g. 'cartesian(chain, torus(shape=(p, q)))'")
    with wrong_use():
        found = read_form(name) if is_composed(name) else closed_form(name, **options)
    if arguments.json:
        print_json({"topology": found.name, **found.as_dict()})
    else:
        print(found.text)
    return FINE


def _letters(arguments: Namespace) -> int:
    """Print the spectrum of a matrix of letters, or for numbers in their place."""
    from synchain.models.graphs.symbolic import read_symbols
    from synchain.models.spectra.spectrum import table

    with wrong_use():
        found = read_symbols(arguments.matrix)
        if arguments.value:
            exact = found.at(**_options(arguments.value, "--value")).spectrum
            text, listed = table(exact), exact.as_dict()
        else:
            spectrum = found.spectrum
            text, listed = spectrum.text, spectrum.as_dict()
    if arguments.json:
        print_json(listed)
    else:
        print(text)
    return FINE


def graph(arguments: Namespace) -> Topology:
    """The graph that the arguments ask for: of a family or of one of the files."""
    from synchain.models.graphs.families import topology
    from synchain.models.graphs.graph_text import is_composed, read_graph
    from synchain.models.graphs.readers import read_edges, read_graphml
    from synchain.models.graphs.topology import read_matrix

    files = [key for key in FILES if getattr(arguments, key) is not None]
    if arguments.directed and files != ["edges"]:
        raise WrongUse("found --directed without --edges; GraphML files and matrices say themselves what is one-way")
    if len(files) > 1:
        raise WrongUse(f"found {' and '.join(f'--{key}' for key in files)}; expected one of them")
    if files and (arguments.topology is not None or arguments.option):
        raise WrongUse(f"found both a topology and --{files[0]}; expected one of them")
    if arguments.matrix is not None:
        return read_matrix(arguments.matrix)
    if arguments.edges is not None:
        return read_edges(arguments.edges, directed=arguments.directed)
    if arguments.graphml is not None:
        return read_graphml(arguments.graphml)
    if arguments.topology is not None and is_composed(arguments.topology):
        if arguments.n is not None or arguments.option:
            raise WrongUse(
                "found a product with N or --option; expected both in its text: 'cartesian(chain(4), ring(5))'"
            )
        return read_graph(arguments.topology)
    if arguments.topology is None or arguments.n is None:
        files_text = ", ".join(f"--{key} FILE" for key in FILES)
        raise WrongUse(f"expected TOPOLOGY and N, e.g. synchain spectrum chain 4, or one of {files_text}")
    return topology(arguments.topology, arguments.n, **_options(arguments.option))


def _options(given: list[str], flag: str = "--option") -> dict[str, str]:
    found: dict[str, str] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not name.isidentifier():
            example = "NAME=NUMBER, e.g. a=1/2" if flag == "--value" else "NAME=VALUE, e.g. offsets=1,3"
            raise WrongUse(f"{flag}: found {text!r}; expected {example}")
        if name in found:
            raise WrongUse(f"{flag} {name} is given twice; expected it once")
        found[name] = value
    return found


def _reason(graph: Topology) -> str:
    parts = graph.components
    why = f"the graph falls into {parts} parts" if parts > 1 else "some nodes cannot reach one another"
    return f"{why}, so its coupling alone never synchronises it completely"
