"""A peer: another program that solves the benchmark's problems."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .problem import Problem, Solve

Tolerances = tuple[tuple[float, float], ...]


def ladder(first: int, last: int, step: int = 1) -> Tolerances:
    """Return the tolerances 10^-first … 10^-last as pairs (rtol, atol), atol a tenth of rtol."""
    return tuple((float(f"1e-{k}"), float(f"1e-{k + 1}")) for k in range(first, last + 1, step))


def absence(package: str, modules: Sequence[str], programs: Sequence[str] = (), fault: Callable[[], str] = str) -> str:
    """Return why a package cannot run here and what to install, in one line; empty where it can run."""
    for program in programs:
        if shutil.which(program) is None:
            return f"no program {program!r} on the path; install {package}"
    for module in modules:
        try:
            importlib.import_module(module)
        except (ImportError, OSError) as problem:  # OSError: a shared library that does not load
            return f"{' '.join(str(problem).split())}; install {package}"
    found = fault()
    return f"{found}; install {package}" if found else ""


@dataclass(frozen=True, slots=True)
class Peer:
    """A solver of another package.

    `prepare(problem)` may compile and is timed apart.  It returns solve(rtol, atol, times), which
    integrates from the start of the problem to ascending times (m,), returns states (m, dimension)
    and raises an error where the solver gives up.
    """

    name: str
    package: str  # what to install
    prepare: Callable[[Problem], Solve]
    tolerances: Tolerances  # pairs (rtol, atol) to try, loose first
    modules: tuple[str, ...] = ()  # Python modules that it imports
    programs: tuple[str, ...] = ()  # programs that it starts
    cells: int = 1  # copies of the problem that one call solves together
    fault: Callable[[], str] = str  # why it cannot run beyond modules and programs; empty where it can

    def absence(self) -> str:
        """Return why the peer cannot run here and what to install, in one line; empty where it can run."""
        return absence(self.package, self.modules, self.programs, self.fault)
