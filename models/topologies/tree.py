"""balanced binary tree, filled level by level."""

from __future__ import annotations

from ..graphs.families import Family

TOPOLOGY = Family(
    # Join each node to its parent: counted from 1, node i has the parent floor(i/2).
    lambda n: (((i - 1) // 2, i, 1) for i in range(1, n)),
    minimum=1,
    count=lambda n: n - 1,
    source="D. E. Knuth, The Art of Computer Programming 1 (Addison-Wesley, 1997), section 2.3.4.5 (complete binary "
    "tree)",
)
