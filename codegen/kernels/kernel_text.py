"""Write the parts of a kernel's text that kernels of sweeps and kernels of modes share."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from synchain.models.dynamics.equations import Equations

from ..driver.dimensions import Dimensions, ModeDimensions
from ..integrators import Integrator
from ..program.passes import Names
from ..program.printers import LANES
from ..program.statements import Function
from ..steps.safe_names import tidy
from .driver import Driver, Recorder, imports


@dataclass(frozen=True, slots=True)
class NamedEquations:
    """Equations with the user's names, and the same equations with names that are free in generated code."""

    original: Equations
    plain: Equations

    @classmethod
    def of(cls, equations: Equations) -> NamedEquations:
        return cls(equations, tidy(equations))

    @property
    def renamed(self) -> tuple[tuple[str, str], ...]:
        """Pairs (name of the user, name in the kernel) of the states and parameters whose names differ."""
        pairs = ((*equations.state, *equations.parameters) for equations in (self.original, self.plain))
        return tuple((a, b) for a, b in zip(*pairs, strict=True) if a != b)

    def free(self) -> Names:
        """Return a supply of names that differ from all symbols of the equations."""
        plain = self.plain
        weights = [edge.weight.name for edge in plain.edges]
        states = [s.name for node in plain.nodes for s in node.state]
        return Names([*plain.state, *plain.parameters, *states, *plain.varied, *weights])


@dataclass(frozen=True, slots=True)
class KernelSource(ABC):
    """The functions of a scene as the text of a module, the driver that runs them, and the sizes of its arrays."""

    head: str = field(repr=False)
    code: str = field(repr=False)
    equations: Equations = field(repr=False)
    method: Integrator = field(repr=False)
    driver: Driver
    dimensions: Dimensions | ModeDimensions = field(repr=False)

    @property
    @abstractmethod
    def functions(self) -> tuple[str, ...]:
        """Functions of the module that the driver calls."""

    @property
    @abstractmethod
    def arguments(self) -> tuple[Any, ...]:
        """Arguments of the driver that belong to the scene, after its functions."""

    @property
    def shared(self) -> tuple[Driver | Recorder, ...]:
        """Modules that other kernels use too."""
        return (self.driver,)

    @property
    def text(self) -> str:
        """The module with its docstring `head`."""
        return f"{self.head}\n\n\n{self.code}"

    @property
    def integrator(self) -> str:
        return self.method.name

    @property
    def width(self) -> int:
        """Cells, or modes, in one register."""
        return self.driver.width

    @property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the texts of the module, its driver and its recorders."""
        return _digest(self.text, *(module.text for module in self.shared))


@lru_cache(maxsize=64)
def _digest(*texts: str) -> str:
    """Return the SHA-256 of texts; cached because each run needs the digest of its kernel again."""
    return hashlib.sha256("".join(texts).encode()).hexdigest()


def module(constants: Mapping[str, object], steps: Sequence[str], events: Sequence[Function]) -> str:
    """Join imports, constants, functions of steps and functions of events to the code of a kernel."""
    named = "\n".join(f"{name} = {value}" for name, value in constants.items())
    text = "\n\n\n".join([*steps, *map(LANES.function, events)]) + "\n"
    return "\n\n\n".join([imports(f"{named}\n{text}"), named, text])


def describe(
    named: NamedEquations, method: Integrator, records: Sequence[str], operations: int, modes: str = ""
) -> str:
    equations, renamed = named.original, [f"{a} as {b}" for a, b in named.renamed]
    rows = [
        f"Generated kernel: {equations.n} oscillator{'s' * (equations.n > 1)}, {equations.link_count} links, {method.name}.",
        "",
        f"Equations   {equations.digest[:16]}",
        f"Integrator  {method.name}, order {method.order}: {method.source}",
        f"State       {_listed(equations.state)}",
        f"Parameters  {_listed(equations.parameters) or 'none'}",
        f"Records     {', '.join(('final state', *records))}",
        *([f"Modes       {modes}"] if modes else []),
        f"Step        {operations} operations outside the node functions",
    ]
    if renamed:
        rows.append(f"Renamed     {_listed(renamed)}")
    return '"""' + "\n".join(rows) + '\n"""'


def _listed(names: Sequence[str]) -> str:
    """Join names by commas; shorten a list of more than 40 to the first six and the last three."""
    if len(names) <= 40:
        return ", ".join(names)
    return f"{', '.join(names[:6])}, … {', '.join(names[-3:])} ({len(names)} variables)"
