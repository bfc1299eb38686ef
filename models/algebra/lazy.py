"""Sequences whose items are made when they are asked for, for spectra of a million nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar, overload

T = TypeVar("T", covariant=True)


@dataclass(frozen=True, slots=True)
class LazyEigenvalues(Sequence[T]):
    """The distinct real eigenvalues of a graph, the largest first, each made when it is asked for.

    A slice is a list of its items.
    """

    length: int  # number of items
    n: int  # number of nodes of the graph
    make: Callable[[int], T]  # gives the item at a place, from 0

    def __len__(self) -> int:
        return self.length

    @overload
    def __getitem__(self, place: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> list[T]: ...
    def __getitem__(self, place: int | slice) -> T | list[T]:
        places = range(self.length)[place]
        return self.make(places) if isinstance(places, int) else [self.make(k) for k in places]

    def __repr__(self) -> str:
        return f"LazyEigenvalues({self.length} items)"
