"""The text of a driver: one module for a width, a set of records and a kind of step, whatever the scene."""

from __future__ import annotations

import hashlib
import re
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
    their length; `observes` is True if values of the scene are observed, `sections` if it has sections on functions,
    `halts` if a function of the state, the last of these, ends a cell.
    """

    kind: KernelKind
    width: int
    records: tuple[Record, ...] = ()
    looped: bool = False
    switching: bool = False
    contacts: bool = False
    series: bool = False
    observes: bool = False
    sections: bool = False
    halts: bool = False

    def __str__(self) -> str:
        names = ("looped", "switching", "contacts", "observes", "sections", "halts")
        traits = [name for name in names if getattr(self, name)]
        subject = "orbits and their modes" if self.kind is KernelKind.MODES else "sweeps"
        records = ", ".join(("final state", *self.records))
        lanes = f"{self.width} lane{'s' * (self.width != 1)}"
        return f"driver of {', '.join((subject, lanes, *traits))} ({records})"

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions of a scene, in the order in which the driver takes them; `step` stands for those not called."""
        wanted: tuple[tuple[str, bool], ...] = (
            ("step_smooth", self.switching), ("section", self.cuts or self.halts),
            ("values", self.observes), ("pushes", self.contacts),
        )  # fmt: skip
        if self.kind is KernelKind.MODES:
            wanted = (("carry", True), ("pushes", self.contacts), ("release", self.contacts))
        return ("step", *(name if called else "step" for name, called in wanted))

    @property
    def cuts(self) -> bool:
        """True if section points are taken."""
        return self.sections or Record.SECTION in self.records

    @property
    def functional(self) -> bool:
        """True if functions of the state are looked at, for sections or for the end of a cell."""
        return self.sections or self.halts

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
            "SECTION": self.cuts,
            "OBSERVED": self.observes,
            "HALTS": self.halts,
            "CONTACTS": self.contacts,
            "SWITCHING": self.switching,
            "LOOPED": self.looped,
            "SERIES": self.series,
        }

    @property
    def text(self) -> str:
        """The module."""
        last = "modes" if self.kind is KernelKind.MODES else "sweep"
        chosen = [
            name
            for name, called in (("contacts", self.contacts), ("observing", self.observes), ("halting", self.halts))
            if called
        ]
        surfaces = "sections" if self.functional else "one_section"
        pieces = (
            "dense",
            *([surfaces] if self.cuts or self.halts else []),
            "recording",
            "cells",
            "control",
            *chosen,
            *(["propagators"] if last == "modes" else []),
            last,
        )
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


WORDS = re.compile(r'"""(?:.|\n)*?"""|"[^"\n]*"|\'[^\'\n]*\'|#[^\n]*|(?<![\w.])([A-Za-z_]\w*)')
"""A string, a comment, or a name that is no attribute, which is the group."""


def imports(text: str) -> str:
    """Return the import statements of a module: what its text names outside of strings and comments."""
    named = set(WORDS.findall(text))
    modules = [line for name, line in (("math", "import math"), ("np", "import numpy as np")) if name in named]
    used = ", ".join(sorted(named.intersection(simd.__all__)))
    return "\n\n".join([*modules, f"from synchain.codegen.simd import {used}"])
