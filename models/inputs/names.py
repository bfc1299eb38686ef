"""Names of states and parameters of one node, "x_2", or one link, "k_1_2", and names reserved by results."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

_DIGITS = 9  # most digits of the number of a node in a name

# Variables and coordinates of results.
TAKEN = frozenset(
    {"atol_used", "cell", "component", "drive_phase", "end", "end_time", "ended_early", "event", "event_after", "event_before", "event_count",
     "event_impacts", "event_node", "event_resets", "event_row", "event_slips", "event_time", "integrator", "method_steps", "methods",
     "node", "part", "periods_skipped", "point", "realisation", "rejected", "rtol_used", "sample", "section", "section_count",
     "section_time", "start_state", "start_time", "status", "steps", "sync_error", "sync_error_end", "sync_error_max", "time",
     "trajectory",
     "transversal_exponent", "transversal_stderr", "verdict"}
)  # fmt: skip

# Attributes of results and of their data; a variable with such a name would be hidden.
ATTRIBUTES = frozenset(
    {"animate", "as_dict", "belongs_to", "data", "events", "integrators", "isel", "kind", "link", "message", "name", "names", "plot", "restore", "save", "scene",
     "sel", "state", "states", "stepped", "success", "summary", "to_dataframe", "to_xarray"}
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class NodeName:
    """The name of a state or a parameter of one node."""

    base: str  # the state or parameter: "x" of "x_2"
    index: int  # the node, counted from 0: 1 of "x_2"

    @classmethod
    def parse(cls, name: str) -> NodeName | None:
        """Parse a name such as "x_2"; None if the text is no such name."""
        base, _, number = name.rpartition("_")
        counts = number.isascii() and number.isdecimal() and number[0] != "0" and len(number) <= _DIGITS
        return cls(base, int(number) - 1) if base and counts else None

    def __str__(self) -> str:
        return f"{self.base}_{self.index + 1}"


@dataclass(frozen=True, slots=True)
class LinkName:
    """The name of a parameter of one link: "k_1_2" is k where node 1 feels node 2."""

    base: str  # the parameter: "k" of "k_1_2"
    target: int  # the node that feels `source`; counted from 0: 0 and 1 of "k_1_2"
    source: int

    @classmethod
    def parse(cls, name: str) -> LinkName | None:
        """Parse a name such as "k_1_2"; None if the text is no such name."""
        outer = NodeName.parse(name)
        inner = None if outer is None else NodeName.parse(outer.base)
        return None if outer is None or inner is None else cls(inner.base, inner.index, outer.index)

    def __str__(self) -> str:
        return f"{self.base}_{self.target + 1}_{self.source + 1}"


def expect_free(what: str, names: Iterable[str], more: Collection[str] = ()) -> None:
    """Raise ValueError if one of `names` is reserved by results: in `TAKEN` or `more`."""
    for name in names:
        if name in TAKEN or name in more:
            raise ValueError(f"{what}: found the name {name!r}, which results have for something else; rename it")
