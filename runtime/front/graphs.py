"""Graphs with exact weights and exact spectra, and the classes of nodes that can move alike.

Every file of the folder `models/topologies` is a function of the number of nodes and of its options:
``circulant(10, offsets=(1, 3))`` equals ``topology("circulant", 10, offsets=(1, 3))``.  Families with another name in
networkx have that one too: ``path(4) == chain(4)``, ``cycle(5) == ring(5)``.
"""

from __future__ import annotations

from typing import Any

from .offers import offer

HOMES = {
    "Clusters": "models.symmetries.clusters",
    "Hypergraph": "models.graphs.hypergraph",
    "Spectrum": "models.spectra.spectrum",
    "Topology": "models.graphs.topology",
    "cartesian": "models.graphs.graph_products",
    "clusters": "models.symmetries.clusters",
    "complement": "models.graphs.graph_products",
    "from_edges": "models.graphs.readers",
    "from_graph": "models.graphs.readers",
    "from_matrix": "models.graphs.topology",
    "from_sparse": "models.graphs.readers",
    "from_symbols": "models.graphs.symbolic",
    "joint_spectrum": "models.spectra.joint",
    "kronecker": "models.graphs.graph_products",
    "orbital_partitions": "models.symmetries.clusters",
    "read_edges": "models.graphs.readers",
    "read_graphml": "models.graphs.readers",
    "read_matrix": "models.graphs.topology",
    "topology": "models.graphs.families",
    "triangles": "models.graphs.hypergraph",
    "union": "models.graphs.graph_products",
    "weighted": "models.graphs.graph_products",
}

_load, _names = offer(__name__, HOMES)


def __getattr__(name: str) -> Any:
    if name == "__all__":
        value: Any = [each for each in __dir__() if not each.startswith("__")]
    elif name in HOMES or name.startswith("_") or name not in _families():
        value = _load(name)
    else:
        from synchain.models.graphs.families import family

        value = family(name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*_names(), *_families()})


def _families() -> set[str]:
    from pkgutil import iter_modules

    from synchain.models import topologies
    from synchain.models.graphs.families import TOPOLOGY

    files = iter_modules(topologies.__path__)
    return {file.name for file in files if not file.name.startswith("_")}.union(TOPOLOGY.also)
