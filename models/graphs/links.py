"""The links of a graph: their type and their greatest number."""

from __future__ import annotations

from fractions import Fraction
from typing import TypeAlias

__all__ = ["LINK_LIMIT", "Link"]

LINK_LIMIT = 4_000_000
"""Greatest number of links of a graph: more take above 600 MB."""

Link: TypeAlias = tuple[int, int, Fraction]
"""(target, source, weight): node `target` feels node `source`; indices start at 0."""
