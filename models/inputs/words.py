"""Words of scene files with a fixed meaning, as enumerations."""

from __future__ import annotations

from enum import StrEnum
from typing import Self

from .checks import check_choice


class Word(StrEnum):
    """A member of an enumeration that equals its text and prints as its text."""

    def __repr__(self) -> str:
        return str.__repr__(self)

    @classmethod
    def parse(cls, what: str, value: object) -> Self:
        """Return the word of a text."""
        return cls(check_choice(what, value, tuple(cls)))
