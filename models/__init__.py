"""From a Lagrangian and a graph to exact equations and exact spectra.

    Lagrangian, Field, friction_law          one node
    link_energy, Rates                       one link
    chain, from_edges, cartesian …           a graph;   topology.spectrum: its exact eigenvalues
    Scene                                    a network with its numbers, starts and records, which `run` takes

Names are loaded on first use, so that importing this package costs next to nothing; editors read them in
`__init__.pyi`.

Every file of the folder `topologies` is offered as a function of the number of nodes and of its options:
``circulant(10, offsets=(1, 3))`` is ``topology("circulant", 10, offsets=(1, 3))``.  Families with another name in
networkx have that one too: ``path(4) == chain(4)``, ``cycle(5) == ring(5)``.

Glossary
--------
node, link    An oscillator of a network; the influence of node j on node i, with an exact weight.
kind          Nodes of one kind have the same oscillator, friction law and contact, and equations.
topology      Nodes and weighted links; adjacency minus degree is the connectivity matrix G.
family        A rule that makes the topology of any number of nodes: chain, ring, star.
spectrum      The exact eigenvalues γ of G with their multiplicities; largest first, the first is 0.
coupling      The terms of a link: an energy, a matrix between states, or any rates of its target.
layer         The links of one coupling on one graph; a network may have several.
contact       The jump of friction at rest: smoothed ("atan", steepness κ), or "set-valued".
slip state    Of a node with set-valued contact: +1 or -1 while it slips, 0 while it sticks.
quotient      The network of classes of nodes that move alike, which has fewer equations.
observable    A value of the states, reduced over the nodes and then over the window of a cell.
record        Output of a run: "sync_error", "section" or "trajectory".
scene         Model, parameter values, start, records and axes: everything that a run needs.
cell          One point of the axes of a scene: one initial-value problem.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "Axis": "sweeps.axis",
    "Clusters": "symmetries.clusters",
    "Family": "graphs.families",
    "Field": "definitions.inline",
    "FrictionLaw": "mechanics.contact",
    "Lagrangian": "definitions.inline",
    "Observable": "dynamics.observable",
    "Oscillator": "mechanics.oscillator",
    "Parameter": "mechanics.parameter",
    "Potential": "interactions.interaction",
    "Rates": "interactions.interaction",
    "Scene": "scenes.scene",
    "Section": "scenes.section",
    "Spectrum": "spectra.spectrum",
    "Topology": "graphs.topology",
    "allow_code": "inputs.plugins",
    "cartesian": "graphs.products",
    "clusters": "symmetries.clusters",
    "complement": "graphs.products",
    "end": "dynamics.observable",
    "ends": "interactions.ends",
    "energy": "dynamics.observable",
    "exprel": "inputs.expression_text",
    "friction": "mechanics.oscillator",
    "friction_law": "definitions.inline",
    "from_edges": "graphs.readers",
    "from_graph": "graphs.readers",
    "from_matrix": "graphs.topology",
    "from_sparse": "graphs.readers",
    "from_symbols": "graphs.symbolic",
    "integer_option": "inputs.options",
    "integers_option": "inputs.options",
    "joint_spectrum": "spectra.joint",
    "kronecker": "graphs.products",
    "latex": "presentation.equations_text",
    "link_energy": "definitions.inline",
    "load_scene": "scenes.file",
    "lorentzian": "sweeps.distribution",
    "maximum": "dynamics.observable",
    "mean": "dynamics.observable",
    "minimum": "dynamics.observable",
    "nodes": "dynamics.observable",
    "normal": "sweeps.distribution",
    "orbital_partitions": "symmetries.clusters",
    "probability_option": "inputs.options",
    "rate": "dynamics.observable",
    "read_edges": "graphs.readers",
    "read_graphml": "graphs.readers",
    "read_matrix": "graphs.topology",
    "scene_names": "scenes.file",
    "text": "presentation.equations_text",
    "topology": "graphs.families",
    "uniform": "sweeps.distribution",
    "union": "graphs.products",
    "variance": "dynamics.observable",
    "weighted": "graphs.products",
}
"""The file of each public name; families of graphs have their own files."""

__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        from .inputs.keywords import public

        value = public(getattr(import_module(f".{_HOMES[name]}", __name__), name), __name__)
    elif name.startswith("_") or name not in _families():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    else:
        from .graphs.families import family

        value = family(name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__, *_families()})


def _families() -> set[str]:
    from pkgutil import iter_modules

    from .graphs.families import TOPOLOGY

    files = iter_modules(import_module(".topologies", __name__).__path__)
    return {file.name for file in files if not file.name.startswith("_")}.union(TOPOLOGY.also)
