"""Words of scene files that have a fixed meaning."""

from __future__ import annotations

from enum import StrEnum
from typing import Self

from .checks import check_choice


class Word(StrEnum):
    """One of a few words: it equals its text and is written as its text."""

    def __repr__(self) -> str:
        return str.__repr__(self)

    @classmethod
    def parse(cls, what: str, value: object) -> Self:
        """Return the word of a text."""
        return cls(check_choice(what, value, tuple(cls)))
