"""From a Lagrangian and a graph to exact equations and exact spectra.

Names are loaded on first use, so that importing this package costs next to nothing.  Every file of the folder
`topologies` is offered as a function of the number of nodes and of its options: ``circulant(10, offsets=(1, 3))`` is
``topology("circulant", 10, offsets=(1, 3))``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .axis import Axis
    from .family_options import probability, whole, whole_numbers
    from .graph_readers import from_edges, from_graph, from_sparse, read_edges, read_graphml
    from .parameter import Parameter
    from .plugins import allow_code
    from .present import latex, text
    from .products import cartesian, complement, kronecker, union, weighted
    from .scene import Scene
    from .scene_file import load_scene, scene_names
    from .scene_section import Section
    from .spectrum import Spectrum
    from .symbolic_weights import from_symbols
    from .topology import Topology, from_matrix, read_matrix

_HOMES = {
    "Axis": "axis",
    "Parameter": "parameter",
    "Scene": "scene",
    "Section": "scene_section",
    "Spectrum": "spectrum",
    "Topology": "topology",
    "allow_code": "plugins",
    "cartesian": "products",
    "complement": "products",
    "from_edges": "graph_readers",
    "from_graph": "graph_readers",
    "from_matrix": "topology",
    "from_sparse": "graph_readers",
    "from_symbols": "symbolic_weights",
    "kronecker": "products",
    "latex": "present",
    "load_scene": "scene_file",
    "probability": "family_options",
    "read_edges": "graph_readers",
    "read_graphml": "graph_readers",
    "read_matrix": "topology",
    "scene_names": "scene_file",
    "text": "present",
    "union": "products",
    "weighted": "products",
    "whole": "family_options",
    "whole_numbers": "family_options",
}

__all__ = [
    "Axis",
    "Parameter",
    "Scene",
    "Section",
    "Spectrum",
    "Topology",
    "allow_code",
    "cartesian",
    "complement",
    "from_edges",
    "from_graph",
    "from_matrix",
    "from_sparse",
    "from_symbols",
    "kronecker",
    "latex",
    "load_scene",
    "probability",
    "read_edges",
    "read_graphml",
    "read_matrix",
    "scene_names",
    "text",
    "union",
    "weighted",
    "whole",
    "whole_numbers",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    elif name.startswith("_") or name not in _families():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    else:
        value = _family(name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__, *_families()})


def _families() -> set[str]:
    from pkgutil import iter_modules

    found = iter_modules(import_module(".topologies", __name__).__path__)
    return {module.name for module in found if not module.name.startswith("_")}


def _family(name: str) -> Any:
    from .topology import topology

    def family(n: int, **options: Any) -> Topology:
        return topology(name, n, **options)

    family.__name__ = family.__qualname__ = name
    family.__module__ = __name__
    family.__doc__ = f"Return the {name} of `n` nodes, with the options of its file; ValueError where n is too small."
    return family
