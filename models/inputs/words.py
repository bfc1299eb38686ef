"""Base class of enumerations of the fixed words in scene files."""

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
        """Return the member with this text; an error lists the valid words."""
        return cls(check_choice(what, value, tuple(cls)))
