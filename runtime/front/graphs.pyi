# What the module loads on first use; tests/test_front.py writes this file with --update.
from collections.abc import Iterable
from typing import Literal, overload

from synchain.models.graphs.graph_products import cartesian as cartesian
from synchain.models.graphs.graph_products import complement as complement
from synchain.models.graphs.graph_products import kronecker as kronecker
from synchain.models.graphs.graph_products import union as union
from synchain.models.graphs.graph_products import weighted as weighted
from synchain.models.graphs.hypergraph import Hypergraph as Hypergraph
from synchain.models.graphs.hypergraph import triangles as triangles
from synchain.models.graphs.readers import from_edges as from_edges
from synchain.models.graphs.readers import from_graph as from_graph
from synchain.models.graphs.readers import from_sparse as from_sparse
from synchain.models.graphs.readers import read_edges as read_edges
from synchain.models.graphs.readers import read_graphml as read_graphml
from synchain.models.graphs.symbolic import from_symbols as from_symbols
from synchain.models.graphs.topology import Topology as Topology
from synchain.models.graphs.topology import from_matrix as from_matrix
from synchain.models.graphs.topology import read_matrix as read_matrix
from synchain.models.spectra.joint import joint_spectrum as joint_spectrum
from synchain.models.spectra.spectrum import Spectrum as Spectrum
from synchain.models.symmetries.clusters import Clusters as Clusters
from synchain.models.symmetries.clusters import clusters as clusters
from synchain.models.symmetries.clusters import orbital_partitions as orbital_partitions

@overload
def topology(
    name: Literal["cayley_abelian"],
    n: int,
    *,
    shape: Iterable[int] | None = None,
    generators: Iterable[int] | None = None,
) -> Topology: ...
@overload
def topology(
    name: Literal["cayley_dihedral"],
    n: int,
    *,
    rotations: Iterable[int] = (1,),
    reflections: Iterable[int] = (0,),
) -> Topology: ...
@overload
def topology(
    name: Literal[
        "chain",
        "circular_ladder",
        "complete",
        "cycle",
        "feed_forward",
        "hypercube",
        "ladder",
        "one_way_ring",
        "paley",
        "path",
        "prism",
        "random_cubic",
        "ring",
        "star",
        "tree",
        "wheel",
    ],
    n: int,
) -> Topology: ...
@overload
def topology(name: Literal["circulant"], n: int, *, offsets: Iterable[int] = (1, 2)) -> Topology: ...
@overload
def topology(name: Literal["complete_bipartite"], n: int, *, left: int | None = None) -> Topology: ...
@overload
def topology(name: Literal["complete_multipartite"], n: int, *, parts: Iterable[int] | None = None) -> Topology: ...
@overload
def topology(
    name: Literal["erdos_renyi", "gnp_random"],
    n: int,
    *,
    p: float | str = "1/2",
    seed: int = 0,
) -> Topology: ...
@overload
def topology(name: Literal["generalized_petersen", "petersen"], n: int, *, step: int = 2) -> Topology: ...
@overload
def topology(name: Literal["grid", "torus"], n: int, *, shape: Iterable[int] | None = None) -> Topology: ...
@overload
def topology(name: Literal["hamming"], n: int, *, d: int = 2) -> Topology: ...
@overload
def topology(name: Literal["johnson", "kneser"], n: int, *, k: int = 2) -> Topology: ...
@overload
def topology(name: Literal["random_regular"], n: int, *, degree: int = 4, seed: int = 0) -> Topology: ...
@overload
def topology(
    name: Literal["small_world", "watts_strogatz"],
    n: int,
    *,
    neighbours: int = 4,
    p: float | str = "1/10",
    seed: int = 0,
) -> Topology: ...
@overload
def topology(name: str, n: int, **options: object) -> Topology: ...
def cayley_abelian(
    n: int,
    *,
    shape: Iterable[int] | None = None,
    generators: Iterable[int] | None = None,
) -> Topology:
    """Cayley graph of a product of cyclic groups (shape: their orders; one of order n); generators: their numbers one after another (the unit of each group)."""

def cayley_dihedral(n: int, *, rotations: Iterable[int] = (1,), reflections: Iterable[int] = (0,)) -> Topology:
    """Cayley graph of the dihedral group of a polygon with n/2 corners; generators: rotations (1) and reflections (0), each by its number of corners."""

def chain(n: int) -> Topology:
    """open chain (path graph)."""

def circulant(n: int, *, offsets: Iterable[int] = (1, 2)) -> Topology:
    """circulant graph: every node joined to those at given distances round a ring (offsets, 1 and 2)."""

def circular_ladder(n: int) -> Topology:
    """circular ladder, or prism: two rings joined node by node (n is even)."""

def complete(n: int) -> Topology:
    """complete graph: all to all."""

def complete_bipartite(n: int, *, left: int | None = None) -> Topology:
    """complete bipartite graph: all nodes of one group with all of another (left: size of the first, half of n)."""

def complete_multipartite(n: int, *, parts: Iterable[int] | None = None) -> Topology:
    """complete multipartite graph: all nodes of each group with all of the others (parts: sizes; three, as equal as n allows)."""

def cycle(n: int) -> Topology:
    """closed ring (cycle graph)."""

def erdos_renyi(n: int, *, p: float | str = "1/2", seed: int = 0) -> Topology:
    """random graph: each pair joined with probability p (1/2), fixed by seed (0); it may fall into parts."""

def feed_forward(n: int) -> Topology:
    """feed-forward (one-way) chain: every node but the first feels the one before it."""

def generalized_petersen(n: int, *, step: int = 2) -> Topology:
    """generalised Petersen graph: a ring joined node by node to a star polygon (step, 2); n = 10: the Petersen graph."""

def gnp_random(n: int, *, p: float | str = "1/2", seed: int = 0) -> Topology:
    """random graph: each pair joined with probability p (1/2), fixed by seed (0); it may fall into parts."""

def grid(n: int, *, shape: Iterable[int] | None = None) -> Topology:
    """grid with open ends, as square as n allows (a prime n: a chain); shape: nodes in each of any number of directions."""

def hamming(n: int, *, d: int = 2) -> Topology:
    """Hamming graph: the words of d (2) letters, joined if they differ in one (d = 2: the moves of a rook)."""

def hypercube(n: int) -> Topology:
    """hypercube where n is a power of two; for other n one digit for each prime factor (a prime n: all to all)."""

def johnson(n: int, *, k: int = 2) -> Topology:
    """Johnson graph: the subsets of k (2) elements of a set, joined if they differ in one (k = 2: triangular graph)."""

def kneser(n: int, *, k: int = 2) -> Topology:
    """Kneser graph: the subsets of k (2) elements of a set, joined if they are disjoint (n = 10: the Petersen graph)."""

def ladder(n: int) -> Topology:
    """ladder: two chains joined node by node (odd n: the first chain is one node longer)."""

def one_way_ring(n: int) -> Topology:
    """one-way ring: every node feels the next one only."""

def paley(n: int) -> Topology:
    """Paley graph: the elements of a finite field (n a prime power 5, 9, 13 …), joined if they differ by a square."""

def path(n: int) -> Topology:
    """open chain (path graph)."""

def petersen(n: int, *, step: int = 2) -> Topology:
    """generalised Petersen graph: a ring joined node by node to a star polygon (step, 2); n = 10: the Petersen graph."""

def prism(n: int) -> Topology:
    """circular ladder, or prism: two rings joined node by node (n is even)."""

def random_cubic(n: int) -> Topology:
    """random graph: three neighbours each (where n is odd, one node has two), always the same for one n."""

def random_regular(n: int, *, degree: int = 4, seed: int = 0) -> Topology:
    """random graph with the same number of neighbours at each node (degree, 4), fixed by seed (0)."""

def ring(n: int) -> Topology:
    """closed ring (cycle graph)."""

def small_world(n: int, *, neighbours: int = 4, p: float | str = "1/10", seed: int = 0) -> Topology:
    """ring with several neighbours (4), each edge led elsewhere with probability p (1/10), fixed by seed (0)."""

def star(n: int) -> Topology:
    """star: a hub (the first node) and n - 1 leaves."""

def torus(n: int, *, shape: Iterable[int] | None = None) -> Topology:
    """grid with joined ends, as square as n allows (a prime n: a ring); shape: nodes in each of any number of directions."""

def tree(n: int) -> Topology:
    """balanced binary tree, filled level by level."""

def watts_strogatz(n: int, *, neighbours: int = 4, p: float | str = "1/10", seed: int = 0) -> Topology:
    """ring with several neighbours (4), each edge led elsewhere with probability p (1/10), fixed by seed (0)."""

def wheel(n: int) -> Topology:
    """wheel: a hub (the first node) joined to every node of a ring."""
