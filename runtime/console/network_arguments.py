"""The network of a command line: by file, by family and size, or by a scene."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from .arguments import above_zero, whole
from .outcome import WrongUse, warn

if TYPE_CHECKING:
    from synchain.models.graphs.topology import Topology
    from synchain.models.scenes.scene import Scene

FILES = ("matrix", "edges", "graphml")  # options that name a file with a graph


def add_network(parser: ArgumentParser) -> None:
    """Add --n, --topology, --matrix for `named_network` and --omega for `scene_on`."""
    parser.add_argument("--n", metavar="N", type=whole, help="number of oscillators (default: the scene's)")
    parser.add_argument(
        "--topology",
        metavar="TOPOLOGY",
        help="family of graphs (see: synchain list graphs; default: the scene's, else chain)",
    )
    parser.add_argument(
        "--matrix", metavar="FILE", help="connectivity matrix in a text file, in place of --n and --topology"
    )
    parser.add_argument("--omega", metavar="W", type=above_zero, help="frequency of the drive (default: the scene's)")


def named_network(arguments: Namespace, scene: Scene | None) -> Topology | None:
    from synchain.models.graphs.families import names, topology
    from synchain.models.graphs.topology import read_matrix

    if arguments.matrix is not None:
        if arguments.n is not None or arguments.topology is not None:
            raise WrongUse("found --matrix beside --n or --topology; expected the matrix alone")
        return read_matrix(arguments.matrix)
    if arguments.n is None and arguments.topology is None:
        return None
    name, n = arguments.topology, arguments.n
    if scene is not None:
        name = name or (scene.topology.name if scene.topology.name in names() else None)
        n = scene.n if n is None else n
    if n is None:
        raise WrongUse(f"--topology {name}: expected its number of oscillators too, e.g. --n 5")
    return topology(name or "chain", n)


def scene_on(network: Topology | None, scene: Scene | None, arguments: Namespace, given: Collection[str] = ()) -> Scene:
    """Return one cell at the frequency of --omega, on a network or on the scene's own links."""
    from synchain.models.scenes.scene import Scene

    if scene is None:
        scene = Scene(topology=network)
    if scene.draws:
        raise WrongUse(f"found draws of {', '.join(scene.draws)} in the scene; expected none; only run takes them")
    if scene.links is not None and network is not None:
        raise WrongUse(
            f"found {len(scene.links)} layers of links in the scene; expected one; their strengths can be the axes "
            "of a map: synchain msf SCENE --set NAME=LO:HI:N NAME=LO:HI:N"
        )
    frequency = _at_frequency(scene, arguments.omega, arguments.scene, given)
    chosen = {*frequency, *scene.strengths, *given} if network is not None else {*frequency, *given}
    moved = [axis.name for axis in scene.axes if axis.name not in chosen]
    if moved:
        raise WrongUse(f"{arguments.scene} sweeps {', '.join(moved)}; expected a scene without these axes")
    settings: dict[str, object] = {} if network is None else {"topology": network}
    start = scene.given["initial"] or {}
    lists = [name for name, at in start.items() if isinstance(at, tuple)]
    if network is not None and network.n != scene.n and lists:  # no option of a command gives other ones
        names = ", ".join(lists)
        warn([f"{arguments.scene} lists initial {names} of {scene.n} oscillators; {network.n} start by default"])
        settings["initial"] = {name: at for name, at in start.items() if name not in lists}
    # the title may name another frequency or network
    return scene.replace(**settings, title="", axes=(), zipped=False, continuation="none", record=None, **frequency)


def _at_frequency(scene: Scene, omega: float | None, where: str | None, given: Collection[str]) -> dict[str, float]:
    """Return the parameter that --omega sets, with its value; empty without --omega."""
    frequency = scene.drive.frequency
    names = set() if frequency is None else {s.name for s in frequency.free_symbols}
    if names & set(given):
        if omega is not None:
            raise WrongUse(f"found --omega beside --set {' '.join(sorted(names & set(given)))}; expected one of them")
        return {}
    if omega is not None:
        if frequency is None:
            raise WrongUse(f"--omega: the oscillator of {where} {scene.drive.problem}; leave it out")
        if not frequency.is_Symbol:
            raise WrongUse(
                f"--omega: the drive of {where} has the frequency {frequency}; expected one that is a parameter; "
                "leave it out"
            )
        return {frequency.name: omega}
    if where is None:
        raise WrongUse("expected a frequency of the drive, e.g. --omega 1.4, or a SCENE")
    swept = next((axis.name for axis in scene.axes if axis.name in names), None)
    if swept is not None:
        raise WrongUse(f"{where} sweeps {swept}; expected one frequency of the drive, e.g. --omega 1.4")
    return {}


def named_graph(arguments: Namespace) -> Topology:
    """Return the graph of a family and a size, of a product, or of one of the files."""
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
    # No file: a family and a size, or the text of a product.
    name, n = arguments.topology, arguments.n
    if name is not None and is_composed(name):
        if n is not None or arguments.option:
            raise WrongUse(
                "found a product with N or --option; expected both in its text: 'cartesian(chain(4), ring(5))'"
            )
        return read_graph(name)
    if name is None or n is None:
        options = ", ".join(f"--{key} FILE" for key in FILES)
        raise WrongUse(f"expected TOPOLOGY and N, e.g. synchain spectrum chain 4, or one of {options}")
    return topology(name, n, **named_values(arguments.option))


def named_values(
    texts: Sequence[str], flag: str = "--option", example: str = "NAME=VALUE, e.g. offsets=1,3"
) -> dict[str, str]:
    """Return names and values of texts NAME=VALUE; raise WrongUse if one is wrong or occurs twice."""
    values: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.isidentifier():
            raise WrongUse(f"{flag}: found {text!r}; expected {example}")
        if name in values:
            raise WrongUse(f"{flag} {name} is given twice; expected it once")
        values[name] = value
    return values
