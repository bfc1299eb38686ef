"""Other programs that solve the benchmark's problems, one file each; a new peer is a new file.

A file holds `NAME`; `PACKAGE`, what to install; `REQUIRES`, the modules it imports and the programs
it starts, as {"module": (…), "program": (…)}; `TOLERANCES`, the pairs (rtol, atol) tried, loose
first; and `prepare(problem) -> solve`, which may compile and is timed apart.
`solve(rtol, atol, times) -> states` integrates from the start of the problem to ascending times
(m,) and returns states (m, dimension); it raises an error where the solver gives up. Optional:
`CELLS`, how many copies of the problem one call solves together (default 1), and
`missing() -> str`, why the peer cannot run beyond the modules and programs, empty where it can.
"""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Iterable
from types import ModuleType

from synchain.runtime.support import folder

__all__ = ["absent", "load", "names", "present", "skipped"]


def names() -> tuple[str, ...]:
    """Names of all peers: the files of this folder."""
    return folder.names(__path__)


def load(name: str) -> ModuleType:
    """Return the peer of that name; ValueError for an unknown one."""
    return folder.load("peer", name, __name__, __path__)


def absent(peer: ModuleType) -> str:
    """Why a peer cannot run here and what to install, in one line; empty where it can run."""
    for program in peer.REQUIRES.get("program", ()):
        if shutil.which(program) is None:
            return f"no program {program!r} on the path; install {peer.PACKAGE}"
    for module in peer.REQUIRES.get("module", ()):
        try:
            importlib.import_module(module)
        except (ImportError, OSError) as problem:  # OSError: a shared library that does not load
            return f"{' '.join(str(problem).split())}; install {peer.PACKAGE}"
    return str(peer.missing()) if hasattr(peer, "missing") else ""


def present(chosen: Iterable[str]) -> list[ModuleType]:
    """The peers of these names that can run here."""
    return [peer for peer in map(load, chosen) if not absent(peer)]


def skipped(chosen: Iterable[str]) -> list[str]:
    """A line for each of these peers that cannot run here, with the reason and the remedy."""
    found = [(peer.NAME, absent(peer)) for peer in map(load, chosen)]
    return [f"skipped: {name} ({why})" for name, why in found if why]
