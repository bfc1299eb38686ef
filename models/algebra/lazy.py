"""A sequence that computes an item on access, for spectra of graphs with a million nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar, overload

T = TypeVar("T", covariant=True)


@dataclass(frozen=True, slots=True)
class LazyEigenvalues(Sequence[T]):
    """The distinct real eigenvalues of a graph in descending order, each computed on access. A slice returns a list."""

    length: int  # number of items
    n: int  # number of nodes of the graph
    make: Callable[[int], T]  # computes the item at an index from 0

    def __len__(self) -> int:
        return self.length

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> list[T]: ...
    def __getitem__(self, index: int | slice) -> T | list[T]:
        indices = range(self.length)[index]
        return self.make(indices) if isinstance(indices, int) else [self.make(k) for k in indices]

    def __repr__(self) -> str:
        return f"LazyEigenvalues({self.length} items)"
