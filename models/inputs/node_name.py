"""Names of states and parameters of single nodes: "x_2" is the state x of the second node."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["NodeName"]

_DIGITS = 9
"""Most digits of the number of a node."""


@dataclass(frozen=True, slots=True)
class NodeName:
    """The name of a state or a parameter of one node.

    Parameters
    ----------
    base : str
        The state or parameter: "x" of "x_2".
    index : int
        The node, counted from 0: 1 of "x_2".
    """

    base: str
    index: int

    @classmethod
    def parse(cls, name: str) -> NodeName | None:
        """Return the parts of a name such as "x_2"; None if the text is no such name."""
        base, _, number = name.rpartition("_")
        counts = number.isascii() and number.isdecimal() and number[0] != "0" and len(number) <= _DIGITS
        return cls(base, int(number) - 1) if base and counts else None

    def __str__(self) -> str:
        return f"{self.base}_{self.index + 1}"
