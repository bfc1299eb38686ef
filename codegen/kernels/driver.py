"""The text of a driver: one module for a width, a set of records and a kind of step, whatever the scene."""

from __future__ import annotations

import ast
import hashlib
from dataclasses import dataclass
from enum import StrEnum

from synchain.models.dynamics.record import Record

from .. import driver, simd
from ..simd.lanes import native_width

__all__ = ["Driver", "KernelKind", "common_drivers"]


class KernelKind(StrEnum):
    """What a kernel runs: the cells of a sweep, or orbits and the modes carried along each."""

    SWEEP = "sweep"
    MODES = "modes"


@dataclass(frozen=True, slots=True)
class Driver:
    """What the text of a driver depends on; scenes that agree in it share its machine code.

    `width` is the number of cells in a register, or of modes in one; `series` is True for Taylor steps, which choose
    their length, and `kinks` for those among them that end at kinks.
    """

    kind: KernelKind
    width: int
    records: tuple[Record, ...] = ()
    looped: bool = False
    switching: bool = False
    contacts: bool = False
    series: bool = False
    kinks: bool = False

    def __str__(self) -> str:
        traits = [name for name in ("looped", "switching", "contacts", "kinks") if getattr(self, name)]
        subject = "orbits and their modes" if self.kind is KernelKind.MODES else "sweeps"
        records = ", ".join(("final state", *self.records))
        lanes = f"{self.width} lane{'s' * (self.width != 1)}"
        return f"driver of {', '.join((subject, lanes, *traits))} ({records})"

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions of a scene, in the order in which the driver takes them; `step` stands for those not called."""
        wanted: tuple[tuple[str, bool], ...] = (
            ("step_smooth", self.switching), ("section", Record.SECTION in self.records), ("pushes", self.contacts),
        )  # fmt: skip
        if self.kind is KernelKind.MODES:
            wanted = (("carry", True), ("pushes", self.contacts), ("release", self.contacts))
        return ("step", *(name if called else "step" for name, called in wanted))

    @property
    def entry(self) -> str:
        """The name of the function that runs cells."""
        return "march" if self.kind is KernelKind.MODES else "drive"

    @property
    def constants(self) -> dict[str, int | bool]:
        """The names by which the text is specialised."""
        modes = self.kind is KernelKind.MODES
        return {
            "WIDTH": 1 if modes else self.width,
            **({"LANES": self.width} if modes else {}),
            **{name.upper(): name in self.records for name in Record},
            "CONTACTS": self.contacts,
            "SWITCHING": self.switching,
            "LOOPED": self.looped,
            "SERIES": self.series,
            "KINKS": self.kinks,
        }

    @property
    def text(self) -> str:
        """The module."""
        last = "modes" if self.kind is KernelKind.MODES else "sweep"
        pieces = ("dense", "recording", "cells", "control", *(("contacts",) if self.contacts else ()), last)
        lines = [
            f'"""Driver of {"orbits and their modes" if last == "modes" else "sweeps"}, {self.width} lanes.',
            "",
            f"Records     {', '.join(('final state', *self.records))}",
            '"""',
        ]
        constants = "\n".join(f"{name} = {value!r}" for name, value in self.constants.items())
        body = "\n\n\n".join(map(driver.text, pieces)) + "\n"
        return "\n\n\n".join(["\n".join(lines), imports(body), constants, body])

    @property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the text."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def common_drivers() -> list[Driver]:
    """Return the drivers that most scenes need: of written-out steps at the processor's width."""
    width = native_width()
    sync_error, section, trajectory = Record.SYNC_ERROR, Record.SECTION, Record.TRAJECTORY
    records = ((), (sync_error,), (section,), (trajectory,), (sync_error, section))
    ways = ((False, False), (False, True), (True, True))  # contacts, series
    return [
        *(Driver(KernelKind.SWEEP, width, r, contacts=c, series=s) for c, s in ways for r in records),
        *(Driver(KernelKind.MODES, width, contacts=c, series=s) for c, s in ways),
    ]


def imports(text: str) -> str:
    """Return the import statements of a module: what its text names."""
    named = {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
    modules = [line for name, line in (("math", "import math"), ("np", "import numpy as np")) if name in named]
    used = ", ".join(sorted(named.intersection(simd.__all__)))
    return "\n\n".join([*modules, f"from synchain.codegen.simd import {used}"])
