"""The kind of plug-in that a topology is: what its file must hold, and the options that its `edges` has."""

from __future__ import annotations

import inspect
from types import ModuleType
from typing import Any

from ..inputs.plugin_file import PluginFile
from ..inputs.plugins import Kind

__all__ = ["KNOWN", "TOPOLOGY", "check_topology", "defaults"]

KNOWN = (
    *("SUMMARY", "SOURCE", "MINIMUM", "TOO_SMALL", "DIRECTED", "CONNECTED"),
    *("edges", "settle", "count", "expected", "spectrum", "formula", "sides"),
)
"""The public names that the file of a topology may define."""


def defaults(module: ModuleType) -> dict[str, Any]:
    """The options of a family with their defaults: the keyword-only parameters of its `edges`."""
    found = inspect.signature(module.edges).parameters.values()
    return {p.name: p.default for p in found if p.kind is inspect.Parameter.KEYWORD_ONLY}


def check_topology(module: ModuleType, where: str, text: bytes) -> None:
    """Raise ValueError if a module is no topology.

    Parameters
    ----------
    module : module
        What the file defines.
    where : str
        The name of the file in messages.
    text : bytes
        What stands in the file.
    """
    file = PluginFile.of("topology", KNOWN, module, where, text)
    file.check_names(("SUMMARY", "MINIMUM", "edges"))
    file.check_values()
    least = file.get("MINIMUM")
    if isinstance(least, bool) or not isinstance(least, int):
        raise file.wrong("MINIMUM", f"MINIMUM is {least!r}; expected the smallest number of nodes, a whole number")
    options = defaults(file.module)
    for name, value in options.items():
        if value is inspect.Parameter.empty:
            raise file.wrong("edges", f"the option {name!r} of edges has no default; expected one, such as {name}=1")
    if not options:
        file.idle(("settle",), "without options, which are keyword-only parameters of edges")
        return
    file.need("settle")
    for function in file.defined(("settle", "count", "expected", "spectrum")):
        missing = [name for name in options if name not in inspect.signature(file.get(function)).parameters]
        if missing:
            raise file.wrong(function, f"{function} lacks the option {missing[0]!r} of edges; expected the same ones")


TOPOLOGY = Kind(
    "topology",
    "topologies",
    check_topology,
    also={
        "all_to_all": "complete",
        "biclique": "complete_bipartite",
        "clique": "complete",
        "cubic": "random_cubic",
        "cycle": "ring",
        "gilbert": "erdos_renyi",
        "gnp": "erdos_renyi",
        "hamming": "hypercube",
        "lattice": "grid",
        "line": "chain",
        "newman_watts": "small_world",
        "open_chain": "chain",
        "path": "chain",
        "watts_strogatz": "small_world",
    },
)
"""Graph families: the files of the folder `topologies`."""
