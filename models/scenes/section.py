"""The surface on which section points are taken: one state variable crosses a level in a stated direction."""

from __future__ import annotations

from dataclasses import dataclass

from ..inputs.checks import number, text
from ..inputs.words import Word

__all__ = ["Direction", "Section"]


class Direction(Word):
    """In which direction a state crosses a level."""

    FALLING = "falling"
    RISING = "rising"
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class Section:
    """State variable `variable` (such as "v_1") passes `level`: falling (from above), rising or both.

    Raises ValueError or TypeError on an unknown direction or a level that is no finite number.
    """

    variable: str
    direction: Direction = Direction.FALLING
    level: float = 0.0

    def __post_init__(self) -> None:
        text("section variable", self.variable)
        object.__setattr__(self, "direction", Direction.parse("section direction", self.direction))
        object.__setattr__(self, "level", number("section level", self.level))

    @classmethod
    def parse(cls, words: object) -> Section:
        """Return the section written as "v_1 falling" or "x_2 rising 0.1"; a Section passes unchanged."""
        if isinstance(words, Section):
            return words
        parts = text("section", words).split(maxsplit=2)
        if len(parts) < 2:
            raise ValueError(f"section {words!r}: expected 'state direction [level]', e.g. 'v_1 falling'")
        return cls(
            parts[0],
            Direction.parse("section direction", parts[1]),
            number("section level", parts[2]) if len(parts) > 2 else 0.0,
        )

    def __str__(self) -> str:
        return f"{self.variable} {self.direction}" + (f" {self.level!r}" if self.level else "")
