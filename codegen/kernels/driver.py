"""The texts of drivers and of functions that record: modules for a width and a kind of step, whatever the scene."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

from .. import driver, simd
from ..simd.lanes import native_width


class KernelKind(StrEnum):
    """What a kernel runs: the cells of a sweep, or orbits and the modes carried along each."""

    SWEEP = "sweep"
    MODES = "modes"


RECORDERS = {
    "halt": ("driver.dense", "recorders.panels", "recorders.crossings", "recorders.halting"),
    "observe": ("driver.dense", "driver.spread", "recorders.comparing"),
    "cut": ("driver.dense", "recorders.panels", "recorders.crossings", "recorders.cutting"),
    "tally": ("recorders.panels", "recorders.observing"),
    "sample": ("driver.dense", "recorders.sampling"),
}
"""The functions that record, in the order in which a driver of sweeps takes them, and the parts of the text of each."""


@dataclass(frozen=True, slots=True)
class Recorder:
    """What the text of a function that records depends on; all drivers that agree in it call the same machine code.

    `entry` is its name; `series` is True if it looks into Taylor steps.
    """

    entry: str
    width: int
    series: bool

    def __str__(self) -> str:
        return f"recorder {_list(self.entry, self.width, *['series'] * self.series)}"

    @property
    def text(self) -> str:
        """The module."""
        return _module(str(self), (("WIDTH", self.width), ("SERIES", self.series)), tuple(RECORDERS[self.entry]))


@dataclass(frozen=True, slots=True)
class Driver:
    """What the text of a driver depends on; scenes that agree in it share its machine code.

    `width` is the number of cells in a register, or of modes in one; `series` is True for Taylor steps, which choose
    their length.
    """

    kind: KernelKind
    width: int
    looped: bool = False
    contacts: bool = False
    series: bool = False

    def __str__(self) -> str:
        traits = [name for name in ("looped", "contacts", "series") if getattr(self, name)]
        subject = "orbits and their modes" if self.kind is KernelKind.MODES else "sweeps"
        return f"driver of {_list(subject, self.width, *traits)}"

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions of a scene and those that record, in the order in which the driver takes them."""
        if self.kind is KernelKind.MODES:
            return "step", "carry", "pushes", "release"
        return "step", "pushes", "section", "values", *RECORDERS

    def recorder(self, entry: str) -> Recorder:
        """Return the function that records, by its name; `tally` leaves the inside of a step to the scene."""
        return Recorder(entry, self.width, self.series and entry != "tally")

    @property
    def entry(self) -> str:
        """The name of the function that runs cells."""
        return "march" if self.kind is KernelKind.MODES else "drive"

    @property
    def text(self) -> str:
        """The module."""
        modes = self.kind is KernelKind.MODES
        constants = {
            "WIDTH": 1 if modes else self.width,
            **({"LANES": self.width} if modes else {}),
            "CONTACTS": self.contacts,
            "LOOPED": self.looped,
            "SERIES": self.series,
        }
        contacts = ["contacts"] if self.contacts else []
        landings = ["landings"] if self.contacts else []
        last = ["propagators", *landings, "modes"] if modes else ["spread", "sweep"]
        pieces = (f"driver.{name}" for name in ("dense", "cells", "control", *contacts, *last))
        return _module(str(self), tuple(constants.items()), tuple(pieces))


def _list(subject: str, width: int, *traits: str) -> str:
    """A subject, its lanes and its traits as a text."""
    return ", ".join((subject, f"{width} lane{'s' * (width != 1)}", *traits))


@cache
def _module(title: str, constants: tuple[tuple[str, int | bool], ...], pieces: tuple[str, ...]) -> str:
    """The text of a module of some files, specialised by constants."""
    head = "\n".join(f"{name} = {value!r}" for name, value in constants)
    body = "\n\n\n".join(map(driver.text, ("driver.clock_slots", *pieces))) + "\n"
    return "\n\n\n".join([f'"""{title[0].upper()}{title[1:]}."""', imports(body), head, body])


def common_drivers() -> list[Driver | Recorder]:
    """Return the drivers and records that most scenes need: of written-out steps in one register and in two."""
    ways = ((False, False), (False, True), (True, True))  # contacts, series
    modes = [Driver(KernelKind.MODES, native_width(), contacts=c, series=s) for c, s in ways]
    sweeps = [
        Driver(KernelKind.SWEEP, native_width(registers), contacts=c, series=s) for registers in (2, 1) for c, s in ways
    ]
    plain = [driver for driver in sweeps if not driver.contacts]
    found: list[Driver | Recorder] = [
        *sweeps,
        *modes,
        *(driver.recorder(name) for name in ("observe", "cut", "sample") for driver in plain),
    ]
    return list(dict.fromkeys(found))


WORDS = re.compile(r'"""(?:.|\n)*?"""|"[^"\n]*"|\'[^\'\n]*\'|#[^\n]*|(?<![\w.])([A-Za-z_]\w*)')
"""A string, a comment, or a name that is no attribute, which is the group."""


def imports(text: str) -> str:
    """Return the import statements of a module: what its text names outside of strings and comments."""
    named = set(WORDS.findall(text))
    modules = [line for name, line in (("math", "import math"), ("np", "import numpy as np")) if name in named]
    used = ", ".join(sorted(named.intersection(simd.__all__)))
    return "\n\n".join([*modules, f"from synchain.codegen.simd import {used}"])
