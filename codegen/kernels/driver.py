"""Join the texts of drivers and recorders, which depend on the width and the kind of step, but not on the scene."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from itertools import pairwise
from typing import Any

from .. import driver, simd
from ..driver import records
from ..simd.lanes import native_width


class KernelKind(StrEnum):
    """Task of a kernel: the cells of a sweep, orbits and the modes carried along each, or the directions of a frame."""

    SWEEP = "sweep"
    MODES = "modes"
    FRAME = "frame"


# Name of the function that runs cells, orbits or directions.
ENTRIES = {KernelKind.SWEEP: "drive", KernelKind.MODES: "march", KernelKind.FRAME: "drive_frame"}

# Ends of the groups of arrays that an entry takes as tuples.
GROUPS = {
    KernelKind.SWEEP: (0, 4, 10),  # input, output
    KernelKind.MODES: (0, 4, 7, 10, 21, 23),  # input, deviations, output, propagation, framing
    KernelKind.FRAME: (0, 4, 10, 18),  # input, output, framing
}


# Recorders in the order of the arguments of a driver of sweeps, each with the files that its text consists of.
RECORDERS = {
    "halt": ("driver.dense", "recorders.panels", "recorders.crossings", "recorders.halting"),
    "observe": ("driver.dense", "driver.spread", "recorders.comparing"),
    "cut": ("driver.dense", "recorders.panels", "recorders.crossings", "recorders.cutting"),
    "tally": ("recorders.panels", "recorders.observing"),
    "sample": ("driver.dense", "recorders.sampling"),
}


@dataclass(frozen=True, slots=True)
class Recorder:
    """The values that determine the text of a recorder; equal recorders share machine code."""

    entry: str  # name of the function
    width: int
    series: bool  # True if it evaluates Taylor steps

    def __str__(self) -> str:
        return f"recorder {_list(self.entry, self.width, *['series'] * self.series)}"

    @property
    def text(self) -> str:
        return _module(str(self), (("WIDTH", self.width), ("SERIES", self.series)), tuple(RECORDERS[self.entry]))


@dataclass(frozen=True, slots=True)
class Driver:
    """The values that determine the text of a driver; scenes with equal drivers share machine code."""

    kind: KernelKind
    width: int  # cells, or modes, in a register
    looped: bool = False
    contacts: bool = False
    series: bool = False  # True for Taylor steps, which choose their own length
    rows: bool = False  # True if the contacts are rows

    def __str__(self) -> str:
        traits = [name for name in ("looped", "contacts", "series", "rows") if getattr(self, name)]
        subject = {"sweep": "sweeps", "modes": "orbits and their modes", "frame": "frames of lifted networks"}[
            self.kind
        ]
        return f"driver of {_list(subject, self.width, *traits)}"

    @property
    def functions(self) -> tuple[str, ...]:
        """Functions of the scene and recorders, in the order of the driver's arguments."""
        if self.kind is KernelKind.MODES:
            return "step", "carry", "pushes", *["strike"] * self.rows, "saltate"
        return "step", "pushes", *["strike"] * self.rows, "section", "values", *RECORDERS

    def recorder(self, entry: str) -> Recorder:
        # `tally` gets the values inside a step from a function of the scene, whatever the kind of step
        return Recorder(entry, self.width, self.series and entry != "tally")

    @property
    def entry(self) -> str:
        """Name of the function that runs cells, orbits or directions."""
        return ENTRIES[self.kind]

    def grouped(self, arrays: Sequence[Any]) -> Iterator[tuple[Any, ...]]:
        """Return the tuples of arrays that the entry takes."""
        return (tuple(arrays[first:last]) for first, last in pairwise(GROUPS[self.kind]))

    @property
    def text(self) -> str:
        modes = self.kind is KernelKind.MODES
        constants = {
            "WIDTH": 1 if modes else self.width,
            **({"LANES": self.width} if modes else {}),
            "CONTACTS": self.contacts,
            **({"ROWS": self.rows} if self.contacts else {}),
            "LOOPED": self.looped,
            "SERIES": self.series,
        }
        of_contacts = ["gaps", *(["decisions", "rows"] if self.rows else ["contacts"]), "passages"]
        contacts, landings = (of_contacts, ["stick_intervals", "event_modes"]) if self.contacts else ([], [])
        frames = ["frames", "lifted_frames"] if self.kind is KernelKind.FRAME else []
        last = ["propagators", *landings, "frames", "modes"] if modes else ["spread", "sweep", *frames]
        pieces = (f"driver.{name}" for name in ("dense", "cells", "control", *contacts, *last))
        return _module(str(self), tuple(constants.items()), tuple(pieces))


def _list(subject: str, width: int, *traits: str) -> str:
    return ", ".join((subject, f"{width} lane{'s' * (width != 1)}", *traits))


@cache
def _module(title: str, constants: tuple[tuple[str, int | bool], ...], pieces: tuple[str, ...]) -> str:
    """Join files to the text of a module that begins with constants."""
    head = "\n".join(f"{name} = {value!r}" for name, value in constants)
    body = "\n\n\n".join(map(driver.text, ("driver.clock_slots", *pieces))) + "\n"
    return "\n\n\n".join([f'"""{title[0].upper()}{title[1:]}."""', imports(body), head, body])


def common_drivers() -> list[Driver | Recorder]:
    """Return the drivers and recorders of most scenes: for written-out steps in one and in two registers."""
    traits = ((False, False), (False, True), (True, True))  # contacts, series
    modes = [Driver(KernelKind.MODES, native_width(), contacts=c, series=s) for c, s in traits]
    sweeps = [
        Driver(KernelKind.SWEEP, native_width(registers), contacts=c, series=s)
        for registers in (2, 1)
        for c, s in traits
    ]
    plain = [driver for driver in sweeps if not driver.contacts]
    recorders = [driver.recorder(name) for name in ("observe", "cut", "sample") for driver in plain]
    return list(dict.fromkeys([*sweeps, *modes, *recorders]))


# Names of the records that the text of a driver may construct.
RECORDS = {name for name, value in vars(records).items() if isinstance(value, type) and issubclass(value, tuple)}
# Matches a string, a comment or a name. The group holds a name that is not an attribute.
WORDS = re.compile(r'"""(?:.|\n)*?"""|"[^"\n]*"|\'[^\'\n]*\'|#[^\n]*|(?<![\w.])([A-Za-z_]\w*)')


def imports(text: str) -> str:
    """Return the import statements for the names in a text outside of strings and comments."""
    named = set(WORDS.findall(text))
    modules = [line for name, line in (("math", "import math"), ("np", "import numpy as np")) if name in named]
    used = ", ".join(sorted(named.intersection(simd.__all__)))
    lines = [*modules, f"from synchain.codegen.simd import {used}"]
    if taken := sorted(named & RECORDS):
        lines.append(f"from synchain.codegen.driver.records import {', '.join(taken)}")
    return "\n\n".join(lines)
