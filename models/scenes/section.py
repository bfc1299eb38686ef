"""The surface on which section points are taken: one state variable crosses a level in a stated direction."""

from __future__ import annotations

from dataclasses import dataclass

from ..inputs.checks import choice, number, text

__all__ = ["DIRECTIONS", "Section"]

DIRECTIONS = ("falling", "rising", "both")


@dataclass(frozen=True, slots=True)
class Section:
    """State variable `variable` (such as "v_1") passes `level`: falling (from above), rising or both.

    Raises ValueError or TypeError on an unknown direction or a level that is no finite number.
    """

    variable: str
    direction: str = "falling"
    level: float = 0.0

    def __post_init__(self) -> None:
        text("section variable", self.variable)
        choice("section direction", self.direction, DIRECTIONS)
        object.__setattr__(self, "level", number("section level", self.level))

    @classmethod
    def parse(cls, words: object) -> Section:
        """Return the section written as "v_1 falling" or "x_2 rising 0.1"; a Section passes unchanged."""
        if isinstance(words, Section):
            return words
        parts = text("section", words).split(maxsplit=2)
        if len(parts) < 2:
            raise ValueError(f"section {words!r}: expected 'state direction [level]', e.g. 'v_1 falling'")
        return cls(parts[0], parts[1], number("section level", parts[2]) if len(parts) > 2 else 0.0)

    def __str__(self) -> str:
        return f"{self.variable} {self.direction}" + (f" {self.level!r}" if self.level else "")
