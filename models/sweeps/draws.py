"""Realisations: parameters, initial states and graphs, drawn or listed along a further axis of the sweep."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import TypeGuard

from ..graphs.graph_text import checked_name, read_graph
from ..graphs.readers import as_topology, is_graph
from ..graphs.topology import Topology
from ..inputs.checks import check_integer, check_number, check_table, check_text, first_of, short_repr
from ..inputs.frozen import FrozenDict
from ..inputs.names import LinkName, NodeName
from ..networks.model import MOST_NUMBERED, WEIGHTS, Model, union_of
from .axis import LIMIT, Axis
from .distribution import KNOWN, Draw, read_draw
from .parameters import by_name, in_order


@dataclass(frozen=True, slots=True)
class Graphs:
    """One graph for each realisation; ValueError unless all graphs have the same number of nodes."""

    graphs: tuple[Topology, ...]

    def __post_init__(self) -> None:
        sizes = sorted({graph.n for graph in self.graphs})
        if len(sizes) != 1:
            counts = ", ".join(map(str, sizes)) or "no"
            raise ValueError(f"draw {GRAPH}: found graphs of {counts} nodes; expected one number of nodes")

    @property
    def union(self) -> Topology:
        """The union of the graphs."""
        # A run integrates all links of the union. Each cell sets the weights; a weight 0 means no link.
        return union_of(self.graphs, f"union of {len(self.graphs)} graphs")


@dataclass(frozen=True, slots=True)
class RandomGraph:
    """A random graph that is drawn anew for each realisation, as text such as "erdos_renyi(20, p=0.3)"."""

    # `read_graph` defines the grammar of the text; seeds are left out.

    text: str

    def graphs(self, count: int, rng: int) -> Graphs:
        """Return the graphs of `count` realisations with seeds drawn from `rng`; a larger `count` appends graphs."""
        return _random_graphs(self.text, count, rng)

    def __str__(self) -> str:
        return self.text


# A distribution, a listed row for each realisation (one number, or one a node or link), graphs, or a random graph.
Draws = Draw | tuple[tuple[float, ...], ...] | Graphs | RandomGraph
GRAPH = "topology"  # the key of the graph in the draws


def draws(value: object, realisations: object) -> FrozenDict[Draws]:
    """Return the draws from the keyword of a scene, by the names of parameters and initial states."""
    count = check_integer("realisations", realisations, 0, LIMIT)
    table = {} if value is None else check_table("draws", value)
    if bool(table) != bool(count):
        found = f"{count} realisations and {len(table)} names to draw"
        raise ValueError(f"draws: found {found}; expected both, e.g. realisations=50, draws={{'x': normal(0, 1)}}")
    return FrozenDict(
        {
            check_text("draw", name): (_graphs if name == GRAPH else _drawn)(f"draw {name}", entry, count)
            for name, entry in table.items()
        }
    )


def drawn_graph(drawn: Mapping[str, Draws], count: int, rng: int) -> Topology:
    """Return the union of the graphs of all realisations, drawn or listed."""
    return _realised(_graphs_of(drawn), count, rng).union


def drawn_nodes(drawn: Mapping[str, Draws], rng: int) -> int:
    """Return the number of nodes of the drawn or listed graphs, without drawing links."""
    graphs = _graphs_of(drawn)
    return graphs.graphs[0].n if isinstance(graphs, Graphs) else next(_random_graph(graphs.text, rng)).n


def _graphs_of(drawn: Mapping[str, Draws]) -> Graphs | RandomGraph:
    graphs = drawn[GRAPH]
    assert isinstance(graphs, Graphs | RandomGraph)
    return graphs


def _realised(graphs: Graphs | RandomGraph, count: int, rng: int) -> Graphs:
    return graphs.graphs(count, rng) if isinstance(graphs, RandomGraph) else graphs


def _graphs(what: str, value: object, count: int) -> Graphs | RandomGraph:
    """Return the graphs of a list, or a random graph from a text."""
    if isinstance(value, str):
        return RandomGraph(check_text(what, value))
    if isinstance(value, RandomGraph):
        return value
    listed = value.graphs if isinstance(value, Graphs) else value
    if isinstance(listed, bytes | Mapping) or not isinstance(listed, Iterable):
        raise TypeError(
            f"{what}: found {short_repr(value)}; expected a list of {count} graphs, or a random one as text, such as "
            "'erdos_renyi(20, p=0.3)'"
        )
    graphs, number = first_of(listed, count)
    if len(graphs) != count:
        raise ValueError(f"{what}: found {number} graphs; expected {count}, one for each realisation")
    return Graphs(_bounded((checked_name(what, as_topology(what, graph)) for graph in graphs), count))


@lru_cache(maxsize=8)
def _random_graphs(text: str, count: int, rng: int) -> Graphs:
    """Return random graphs of a text; the stream of their seeds depends only on `rng`."""
    return Graphs(_bounded(islice(_random_graph(text, rng), count), count))


def _random_graph(text: str, rng: int) -> Iterator[Topology]:
    """Yield endlessly random graphs of a text; a graph draws its links at their first use."""
    stream = random.Random(f"{rng} {GRAPH}")
    seeds, begin = iter(lambda: stream.getrandbits(52), None), stream.getstate()
    while True:
        try:
            graph = read_graph(text, MOST_NUMBERED, seeds)
        except ValueError as error:
            raise ValueError(f"draw {GRAPH}: {error}") from None
        if stream.getstate() == begin:
            raise ValueError(
                f"draw {GRAPH}: found {short_repr(text)}, the same graph in every realisation; expected a random family, such as "
                "erdos_renyi(20, p=0.3)"
            )
        yield graph


def _bounded(graphs: Iterable[Topology], count: int) -> tuple[Topology, ...]:
    """Return the graphs; ValueError as soon as the union needs more than LIMIT weights in `count` realisations."""
    bounded, union = [], set[tuple[int, int]]()
    for graph in graphs:
        bounded.append(graph)
        if graph.link_count * count <= LIMIT:
            union.update(link[:2] for link in graph.links)
        links = max(len(union), graph.link_count)
        if links * count > LIMIT:
            raise ValueError(
                f"draw {GRAPH}: found {links} links in the union of the first {len(bounded)} graphs, each with a weight in each of "
                f"{count} realisations; expected at most {LIMIT} weights; take fewer realisations, or run the graphs one by one"
            )
    return tuple(bounded)


def _drawn(what: str, value: object, count: int) -> Draws:
    """Return a distribution, or a row of numbers for each realisation."""
    if isinstance(value, Draw):
        return value
    if isinstance(value, str):
        return read_draw(what, value)
    listed = _plain(value)
    if not isinstance(listed, Sequence) or len(listed) != count:
        entries = f"{len(listed)} entries" if isinstance(listed, Sequence) else short_repr(listed)
        raise ValueError(f"{what}: found {entries}; expected {KNOWN} or {count} entries")
    rows = [row if _is_row(row) else (row,) for row in map(_plain, listed)]
    if any(is_graph(entry) or _is_row(entry) for row in rows for entry in row):
        raise ValueError(
            f"{what}: found graphs or matrices; expected one number, or one for each node or link, in each realisation; "
            f"draws of {GRAPH!r} take a graph, or its matrix, for each"
        )
    if len({len(row) for row in rows}) != 1:
        raise ValueError(
            f"{what}: found rows of different lengths; expected one number, or one for each node or link, in each"
        )
    return tuple(tuple(check_number(what, number) for number in row) for row in rows)


def _plain(value: object) -> object:
    """Return an array as lists."""
    return value.tolist() if hasattr(value, "tolist") else value


def _is_row(value: object) -> TypeGuard[Sequence[object]]:
    return isinstance(value, Sequence) and not isinstance(value, str)


@lru_cache(maxsize=64)
def drawn_axes(model: Model, drawn: FrozenDict[Draws], count: int, rng: int) -> tuple[Axis, ...]:
    """Return the drawn values of each parameter and initial state, one for each realisation."""
    # A parameter or state of nodes is drawn for each node separately. A parameter of links, and the weights "W", are
    # drawn for each edge separately: the links i -> j and j -> i have one number. The random stream of a name depends
    # only on `rng` and the name, not on the number of workers or on other draws.
    axes: dict[str, Axis] = {}
    for name, how in drawn.items():
        for single, values in _columns(model, name, how, count, rng):
            if single in axes:
                raise ValueError(f"draw {name}: {single} is drawn twice; expected it once")
            axes[single] = Axis(single, values)
    return tuple(axes.values())


def _columns(model: Model, name: str, how: Draws, count: int, rng: int) -> Iterable[tuple[str, Sequence[float]]]:
    """Return the parameters and states of single nodes and links of one draw, with a value for each realisation."""
    if isinstance(how, Graphs | RandomGraph):
        # Weights of all links of the union of the graphs; 0 where a graph has no link.
        of_union = model.link_names(WEIGHTS)
        try:
            rows = [{at[:2]: float(at[2]) for at in graph.links} for graph in _realised(how, count, rng).graphs]
        except OverflowError:
            raise ValueError(
                f"draw {GRAPH}: found a weight beyond the range of numbers; expected at most 1.8e308"
            ) from None
        named = [by_name("draw topology", of_union, {at: row.get(at, 0.0) for at in of_union}) for row in rows]
        return [(str(link), [row[link] for row in named]) for link in named[0]]
    holders = model.unlinked.holders(name)
    links = {} if holders else model.link_names(name)
    if links:
        return _link_columns(f"draw {name}{model.on_graph(name)}", name, links, how, count, rng)
    if name == WEIGHTS:
        raise ValueError(
            f"draw {name}: found {len(model.linked)} layers of links; expected one whose weights are drawn"
        )
    if name not in (*model.parameters, *model.components) and NodeName.parse(name) is None:
        raise ValueError(model.unknown(name, "draw", (*model.parameters, *model.components)))
    alone = not holders or (model.n == 1 and name in model.parameters)
    names = [name] if alone else [str(NodeName(name, i)) for i in holders]
    if isinstance(how, Draw):
        return [(single, _numbers(how, f"{rng} {single}", count)) for single in names]
    width = len(how[0])
    if width == 1 and len(names) > 1 and name in model.parameters:
        names = [name]
    if width not in (1, len(names)):
        raise ValueError(f"draw {name}: found rows of {width} numbers; expected 1 or {len(names)}, one for each node")
    return [(single, [row[min(k, width - 1)] for row in how]) for k, single in enumerate(names)]


def _link_columns(
    what: str,
    name: str,
    links: Mapping[tuple[int, int], LinkName],
    how: Draw | tuple[tuple[float, ...], ...],
    count: int,
    rng: int,
) -> Iterable[tuple[str, Sequence[float]]]:
    """Return the values of one draw of a parameter of links, or of the weights, by name."""
    if isinstance(how, Draw):
        # Both directions of a link share one number, under the name of the link with the smaller target.
        edges = {at: links[at[::-1]] if at[0] > at[1] and at[::-1] in links else link for at, link in links.items()}
        drawn = {edge: _numbers(how, f"{rng} {edge}", count) for edge in dict.fromkeys(edges.values())}
        return [(str(link), drawn[edges[link.target, link.source]]) for link in dict.fromkeys(links.values())]
    if len(how[0]) == 1 and name != WEIGHTS:
        return [(name, [row[0] for row in how])]
    full = [row if len(row) > 1 else row * len(links) for row in how]
    rows = [by_name(what, links, in_order(what, links, row, str(len(row)))) for row in full]
    return [(str(link), [row[link] for row in rows]) for link in rows[0]]


def _numbers(how: Draw, stream: str, count: int) -> list[float]:
    """Return the numbers of one stream: a Mersenne twister that Python seeds by the SHA-512 of its name."""
    source = random.Random(stream)
    return [how.value((source.getrandbits(52) + 0.5) / 2.0**52) for _ in range(count)]
