"""Files of claims about spectra, and what is said of them."""

from __future__ import annotations

from pathlib import Path

from synchain.models.claims.language import read_claims
from synchain.models.claims.verdict import ClaimVerdict, verify

__all__ = ["verdicts"]

MATRIX = "-1 0 1\n1/2 -1/2 0\n0 1/2 -1/2\n"
"""G.txt, three nodes joined one way."""

WEIGHTS = "-3 1 2\n1 -6 5\n2 5 -7\n"
"""W.txt, three nodes with weights."""


def verdicts(folder: Path, *lines: str) -> list[ClaimVerdict]:
    """What is said of the lines of a file; two matrices lie beside it."""
    (folder / "G.txt").write_text(MATRIX)
    (folder / "W.txt").write_text(WEIGHTS)
    path = folder / "claims.txt"
    path.write_text("\n".join(lines), encoding="utf-8")
    return [verify(claim) for line in read_claims(path) for claim in line]
