"""Tree: every node but the first hangs on another, two on each."""

from __future__ import annotations

from collections.abc import Iterator

SUMMARY = "balanced binary tree, filled level by level"
MINIMUM = 1
SOURCE = "D. E. Knuth, The Art of Computer Programming 1 (Addison-Wesley, 1997), section 2.3.4.5 (complete binary tree)"


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Each node and the one that it hangs on: of nodes 1 … n, node i on node i/2 rounded down."""
    return (((i - 1) // 2, i, 1) for i in range(1, n))


def count(n: int) -> int:
    """Number of edges."""
    return n - 1
