"""Report on a master stability function over real strengths: text, JSON, files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from synchain.models.graphs.topology import Topology

from ..prediction.modes import transversal_modes
from ..prediction.synchronisability import Verdict, verdict
from ..stability.msf import MSF
from .drive import drive_period
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
    """Return warnings if a network has complex eigenvalues: a line of alpha does not serve them.

    Parameters
    ----------
    graph : Topology
        The network.
    highest : float
        Largest alpha of the line, from which a range of beta is proposed.

    Returns
    -------
    list of str
        One sentence; none if all eigenvalues are real.
    """
    gammas = [complex(mode.eigenvalue.value) for mode in transversal_modes(graph)]
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
    """A master stability function over real strengths and what it says about a network.

    Attributes
    ----------
    function : MSF
        The exponents on a line of alpha.
    network : bool
        Whether the scene has a network to be judged.
    """

    function: MSF
    network: bool

    @property
    def judged(self) -> bool:
        """True if there is a network with real eigenvalues."""
        return self.network and not complex_modes(self.function.scene.topology, 1.0)

    @property
    def verdict(self) -> tuple[str, Verdict]:
        """The answer in words that consider the ends of the grid, and the verdict."""
        graph, ranges = self.function.scene.topology, list(self.function.intervals)
        judgement = verdict(ranges, graph, self.function.errors)
        line = self.function.fine.alpha
        open_ranges = [(0.0 if a == line[0] else a, math.inf if b == line[-1] else b) for a, b in ranges]
        further = verdict(open_ranges, graph, self.function.errors)
        return (judgement.answer if further.answer == judgement.answer else GRID_ENDS), judgement

    def as_dict(self) -> dict[str, object]:
        """Return MSF.as_dict, "windows" and "verdict" in JSON types.

        A number that is not finite is null; so are windows and verdict without a network.
        """
        report: dict[str, object] = {**self.function.as_dict(), "windows": None, "verdict": None}
        if self.judged:
            answer, judgement = self.verdict
            report["windows"] = [window_dict(window) for window in self.function.windows]
            report["verdict"] = {
                "answer": answer,
                "ratio": None if judgement.ratio is None else str(judgement.ratio),
                "ratio_value": judgement.ratio_value,
                "allowed": judgement.allowed,
                "slowest": exact(judgement.slowest),
                "fastest": exact(judgement.fastest),
            }
        return {name: finite(value) for name, value in report.items()}

    def text(self) -> str:
        """Return the report as lines of text."""
        function, line = self.function, self.function.fine.alpha
        ranges = [
            f"{measured(low, a, low == line[0])} … {measured(high, b, high == line[-1])}"
            for (low, high), (a, b) in zip(function.intervals, function.errors or function.uncertainties, strict=True)
        ]
        rows = [
            ("class", f"{function.kind}, for alpha from {line[0]:g} to {line[-1]:g}"),
            ("negative for alpha", "; ".join(ranges) or "none"),
            ("smallest, largest", f"{np.min(function.exponent):z.4f}, {np.max(function.exponent):z.4f}"),
            *how(drive_period(function.scene), function.attractors, function.fine.time, function.stderr),
        ]
        lines = [f"{headline(function.scene)}, alpha = -sigma gamma", *rows_of(rows)]
        if self.judged:
            lines += self._network_text()
        if any("..." in words for words in lines):
            lines.append("...: the grid of alpha ends here, the range may go on")
        return "\n".join(lines)

    def _network_text(self) -> list[str]:
        graph, (answer, judgement) = self.function.scene.topology, self.verdict
        if judgement.ratio_value == judgement.ratio_value:
            exact = f"{judgement.ratio} = " if judgement.ratio is not None and not judgement.ratio.is_Rational else ""
            allowed = (
                "any"
                if judgement.allowed == math.inf
                else f"{judgement.allowed:.6g}"
                if judgement.allowed > 0
                else "none"
            )
            answer += f" (largest over smallest |gamma|: {exact}{judgement.ratio_value:.6g}; allowed: {allowed})"
        rows = [("sigma", words) for words in map(window_text, self.function.windows)] or [("sigma", "none")]
        title = f"{graph.name}({graph.n}): every mode dies out for"
        return [title, *rows_of([*rows, ("possible", answer), *defective_rows(graph)])]

    def write(self, folder: Path) -> list[Path]:
        """Write msf.csv and msf.png to a folder and return their paths."""
        from ..figures.exponent import draw_exponent
        from ..figures.tables import Table

        function = self.function
        numbers = Table.of(alpha=function.alpha, exponent=function.exponent, stderr=function.stderr)
        return write_files(folder, "msf", numbers, lambda axes: draw_exponent(axes, function))
