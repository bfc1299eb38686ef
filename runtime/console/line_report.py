"""What the exponents on a line of real strengths say about a scene's network: as text, as JSON, and
as files.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from synchain.models.graphs.topology import Topology

from ..prediction.modes import transversal
from ..prediction.synchronisability import Verdict, verdict
from ..stability.msf import MSF
from .words import (
    defective_rows,
    exact,
    finite,
    headline,
    how,
    measured,
    rows_of,
    window_dict,
    window_text,
    write_files,
)

__all__ = ["LineReport", "complex_modes"]

GRID_ENDS = "undecided: the function is negative where the grid of alpha ends"


def complex_modes(graph: Topology, highest: float) -> list[str]:
    """A sentence where a network has complex eigenvalues, so that a line of real strengths says
    nothing about it.
    """
    gammas = [complex(mode.eigenvalue.value) for mode in transversal(graph)]
    slopes = [abs(g.imag / g.real) for g in gammas if g.imag and g.real]
    if not any(g.imag for g in gammas):
        return []
    top = max(slopes, default=1.0) * highest
    return [
        f"{graph.name}({graph.n}) has complex eigenvalues, for which a line of alpha says nothing; "
        f"no windows of sigma are given: add --beta, e.g. --beta 0:{top:.2g}:61"
    ]


@dataclass(frozen=True, slots=True)
class LineReport:
    """The function on a line; `network` where the scene has one to be judged."""

    found: MSF
    network: bool

    @property
    def judged(self) -> bool:
        """True where there is a network with real eigenvalues."""
        return self.network and not complex_modes(self.found.scene.topology, 1.0)

    @property
    def verdict(self) -> tuple[str, Verdict]:
        """Whether the network can synchronise, in words that mind the ends of the grid, and what
        that rests on.
        """
        graph, ranges = self.found.scene.topology, list(self.found.intervals)
        given = verdict(ranges, graph, self.found.errors)
        line = self.found.fine.alpha
        open_ranges = [(0.0 if a == line[0] else a, math.inf if b == line[-1] else b) for a, b in ranges]
        further = verdict(open_ranges, graph, self.found.errors)
        return (given.answer if further.answer == given.answer else GRID_ENDS), given

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready: MSF.as_dict, "windows" and "verdict"; null where a number is not finite or
        there is no network.
        """
        seen: dict[str, Any] = {**self.found.as_dict(), "windows": None, "verdict": None}
        if self.judged:
            answer, given = self.verdict
            seen["windows"] = [window_dict(window) for window in self.found.windows]
            seen["verdict"] = {
                "answer": answer,
                "ratio": None if given.ratio is None else str(given.ratio),
                "ratio_value": given.ratio_value,
                "allowed": given.allowed,
                "slowest": exact(given.slowest),
                "fastest": exact(given.fastest),
            }
        return dict(finite(seen))

    def text(self) -> str:
        """The report as lines."""
        found, line = self.found, self.found.fine.alpha
        ranges = [
            f"{measured(low, a, low == line[0])} … {measured(high, b, high == line[-1])}"
            for (low, high), (a, b) in zip(found.intervals, found.errors or found.uncertainties, strict=True)
        ]
        rows = [
            ("class", f"{found.kind}, for alpha from {line[0]:g} to {line[-1]:g}"),
            ("negative for alpha", "; ".join(ranges) or "none"),
            ("smallest, largest", f"{np.min(found.exponent):.4f}, {np.max(found.exponent):.4f}"),
            *how(found.scene, found.attractors, found.fine.time, found.stderr),
        ]
        lines = [f"{headline(found.scene)}, alpha = -sigma gamma", *rows_of(rows)]
        if self.judged:
            lines += self._network_text()
        if any("..." in words for words in lines):
            lines.append("...: the grid of alpha ends here, the range may go on")
        return "\n".join(lines)

    def _network_text(self) -> list[str]:
        graph, (answer, given) = self.found.scene.topology, self.verdict
        if given.ratio_value == given.ratio_value:
            exact = f"{given.ratio} = " if given.ratio is not None and not given.ratio.is_Rational else ""
            allowed = "any" if given.allowed == math.inf else f"{given.allowed:.6g}" if given.allowed > 0 else "none"
            answer += f" (largest over smallest |gamma|: {exact}{given.ratio_value:.6g}; allowed: {allowed})"
        rows = [("sigma", words) for words in map(window_text, self.found.windows)] or [("sigma", "none")]
        title = f"{graph.name}({graph.n}): every mode dies out for"
        return [title, *rows_of([*rows, ("possible", answer), *defective_rows(graph)])]

    def write(self, folder: Path) -> list[Path]:
        """Write msf.csv and msf.png."""
        from ..figures.exponent import draw_exponent
        from ..figures.tables import Table

        found = self.found
        numbers = Table.of(alpha=found.alpha, exponent=found.exponent, stderr=found.stderr)
        return write_files(folder, "msf", numbers, lambda axes: draw_exponent(axes, found))
