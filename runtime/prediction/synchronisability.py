"""Synchronisability of networks from the stable ranges of a master stability function.

A transversal mode with the eigenvalue gamma < 0 has the strength alpha = sigma |gamma|. The network is stable at sigma
if the strength of every mode lies in a stable range. With one range from a to b, a stable sigma exists if the
eigenratio (largest over smallest non-zero |gamma|) is at most b / a. Ranges are closed: if the eigenratio equals b / a,
a single sigma is stable. The ends of ranges are the exact binary values of floats, and eigenvalues are exact algebraic
numbers; only the reported sigma are rounded.

Complex eigenvalues give complex strengths alpha = -sigma gamma, which must lie in a stable region of the complex plane.
If eigenvectors are missing (a feed-forward chain), the equations of the modes do not decouple, but the condition on the
eigenvalues is the same.

Sources: Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998): real and complex alpha; Barahona &
Pecora, Phys. Rev. Lett. 89, 054101 (2002): the eigenratio; Stefański, Perlikowski & Kapitaniak,
Phys. Rev. E 75, 016210 (2007): several ranges; Nishikawa & Motter, Phys. Rev. E 73, 065106 (2006):
missing eigenvectors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction

import numpy as np
import sympy as sp

from synchain.models.graphs.topology import Topology
from synchain.models.spectra.eigenvalue_order import compare

from ..support.error_text import interval_text
from .intervals import find
from .mode_windows import NetworkMode, has_loose_parts, transversal_modes
from .stable_ranges import StableRange, exact_ranges, widen


class Answer(StrEnum):
    NO = "no"
    UNDECIDED = "undecided within the error"
    YES = "yes"
    GRID_ENDS = "undecided: the function is negative where the grid of alpha ends"


# Function that returns for complex alpha (m,), with imaginary part >= 0, True where the mode is stable (m,).
Region = Callable[[np.ndarray], np.ndarray]
LONGEST = 60  # most characters of an exact ratio in texts (a choice)

_EVERYTHING = StableRange(Fraction(0), None)


@dataclass(frozen=True, slots=True)
class Window:
    """An interval of sigma on which every transversal mode is stable."""

    low: float  # ends of the interval
    high: float
    # uncertainties of the ends in sigma: infinite at an end of the grid, where the window may continue; 0 at sigma = 0
    low_error: float
    high_error: float
    # first mode that becomes unstable beyond the end; None if the end is 0, infinite, or an end of the grid
    low_mode: NetworkMode | None
    high_mode: NetworkMode | None

    def __repr__(self) -> str:
        return f"Window(sigma {self.text()})"

    def text(self, errors: bool = True) -> str:
        """Return the ends with errors, and the modes that become unstable there; dots mark an end of the grid."""
        ends = ((self.low, self.low_mode, "below"), (self.high, self.high_mode, "above"))
        cut = [sigma for sigma, mode, _ in ends if mode is None and 0.0 < abs(sigma) < math.inf]
        lost = [f"lost {side}: gamma = {mode.eigenvalue}" for _, mode, side in ends if mode is not None]
        spread = [(self.low_error, self.high_error)] if errors else None
        return "; ".join([interval_text([(self.low, self.high)], spread, cut), *lost])

    def as_dict(self) -> dict[str, object]:
        """Return the window in JSON types; a mode is represented by its exact eigenvalue, or None."""
        names = ("low", "high", "low_error", "high_error")
        modes = {name: _exact(getattr(self, name)) for name in ("low_mode", "high_mode")}
        return {**{name: getattr(self, name) for name in names}, **modes}


@dataclass(frozen=True, slots=True)
class Verdict:
    """The answer whether a network can synchronise for some sigma > 0, with the reason."""

    answer: Answer  # the decision
    ratio: sp.Expr | None  # exact eigenratio; None if the expression is long
    ratio_value: float  # eigenratio; nan without coupled modes
    allowed: float  # largest ratio of the ends of a range
    slowest: NetworkMode | None  # modes of smallest and largest |gamma|
    fastest: NetworkMode | None
    windows: tuple[Window, ...]  # windows for the given ranges

    def __repr__(self) -> str:
        return f"Verdict({self.text})"

    @property
    def text(self) -> str:
        """The answer, with the eigenratio of the network and the largest ratio that the ranges allow."""
        if math.isnan(self.ratio_value):
            return str(self.answer)
        exact = "" if self.ratio is None or self.ratio.is_Rational else f"{self.ratio} = "
        allowed = "any" if self.allowed == math.inf else f"{self.allowed:.6g}" if self.allowed > 0 else "none"
        return f"{self.answer} (largest over smallest |gamma|: {exact}{self.ratio_value:.6g}; allowed: {allowed})"

    def as_dict(self) -> dict[str, object]:
        """Return the verdict without windows in JSON types; a mode is represented by its exact eigenvalue."""
        return {
            "answer": str(self.answer),
            "ratio": None if self.ratio is None else str(self.ratio),
            "ratio_value": self.ratio_value,
            "allowed": self.allowed,
            "slowest": _exact(self.slowest),
            "fastest": _exact(self.fastest),
        }


def _exact(mode: NetworkMode | None) -> str | None:
    """Return the eigenvalue of a mode as exact text."""
    return None if mode is None else mode.eigenvalue.text


@dataclass(frozen=True, slots=True)
class OneWay:
    """Windows of a network with complex eigenvalues."""

    windows: tuple[Window, ...]  # windows of sigma
    # modes that lack eigenvectors: deviations may grow at first, and decay in the end
    defective: tuple[NetworkMode, ...]


@dataclass(frozen=True, slots=True)
class _End:
    """An end of a window: sigma = alpha / |gamma| of a mode at an end of a range; without a mode 0 or infinity."""

    range: StableRange
    upper: bool
    mode: NetworkMode | None

    @property
    def alpha(self) -> Fraction | None:
        """The end of the range; None at infinity."""
        return self.range.high if self.upper else self.range.low

    @property
    def sigma(self) -> float:
        if self.alpha is None:
            return math.inf
        return float(self.alpha) / self.mode.size if self.mode else 0.0

    @property
    def error(self) -> float:
        return self.range.errors[self.upper] / self.mode.size if self.mode else 0.0


def windows(
    ranges: Sequence[tuple[float, float]], graph: Topology, errors: Sequence[tuple[float, float]] | None = None
) -> tuple[Window, ...]:
    """Find the intervals of sigma on which every transversal mode lies in a stable range."""
    # Ranges below alpha = 0 give intervals of negative sigma.
    above = [
        Window(low.sigma, high.sigma, low.error, high.error, low.mode, high.mode)
        for low, high in _intersection(exact_ranges(ranges, errors), graph)
    ]
    # Ranges below 0: mirror the ranges, find the windows of -sigma, and mirror the windows.
    pairs = zip(ranges, [(0.0, 0.0)] * len(ranges) if errors is None else errors, strict=True)
    mirrored = [((max(-high, 0.0), -low), error[::-1]) for (low, high), error in reversed(list(pairs)) if low < 0.0]
    if not mirrored:
        return tuple(above)
    exact = exact_ranges([r for r, _ in mirrored], [error for _, error in mirrored])
    below = [
        Window(0.0 - high.sigma, 0.0 - low.sigma, high.error, low.error, high.mode, low.mode)
        for low, high in reversed(_intersection(exact, graph))
    ]
    # Join windows that meet at sigma = 0.
    if below and above and below[-1].high == above[0].low:
        right = above.pop(0)
        if right.high > 0.0:
            below[-1] = replace(below[-1], high=right.high, high_error=right.high_error, high_mode=right.high_mode)
    return (*below, *above)


def windows_complex(
    stable: Region, graph: Topology, sigma_grid: Sequence[float] | np.ndarray, resolution: float
) -> OneWay:
    """Find the intervals of sigma on which every mode lies in a stable region of the complex plane."""
    # The intervals are found on a grid and refined by bisection. Shapes: sigma_grid (k,).
    #
    # Take one mode of each conjugate pair; unconnected parts add a mode with gamma = 0.
    modes = tuple(mode for mode in transversal_modes(graph) if complex(mode.eigenvalue.value).imag <= 0)
    values = np.array([mode.eigenvalue.value for mode in modes] + [0.0] * has_loose_parts(graph), dtype=complex)

    def verdicts(sigma: np.ndarray) -> np.ndarray:
        """Return True where a mode is stable at a sigma. Shapes: sigma (m,); returns (m, modes)."""
        alpha = -np.multiply.outer(sigma, values)
        answer = np.asarray(stable(alpha.ravel() + 0.0), dtype=bool)
        if answer.shape != (alpha.size,):
            raise ValueError(
                f"stable: found shape {answer.shape} for {alpha.size} points; expected one truth value for each"
            )
        return answer.reshape(alpha.shape)

    def lost(sigma: float) -> NetworkMode | None:
        """Return the first mode that is unstable at a sigma."""
        bad = np.flatnonzero(~verdicts(np.array([sigma]))[0, : len(modes)])
        return modes[bad[0]] if len(bad) else None

    grid = np.asarray(sigma_grid, dtype=float)
    intervals, _ = find(lambda sigma: np.atleast_1d(verdicts(sigma).all(axis=1)), grid, resolution)
    reach = 0.5 * resolution

    def error_and_mode(end: float, step: float) -> tuple[float, NetworkMode | None]:
        """Return the error of an end, and the mode that is unstable a step beyond the end."""
        if grid[0] < end < grid[-1]:
            return reach, lost(end + step)
        # No mode is lost: at an end of the grid the window may continue, except at 0, where couplings begin.
        return (0.0 if end == 0.0 else math.inf), None

    windows = []
    for low, high in intervals:
        (low_error, low_mode), (high_error, high_mode) = error_and_mode(low, -reach), error_and_mode(high, reach)
        windows.append(Window(low, high, low_error, high_error, low_mode, high_mode))
    return OneWay(tuple(windows), tuple(mode for mode in transversal_modes(graph) if mode.defective))


def verdict(
    ranges: Sequence[tuple[float, float]], graph: Topology, errors: Sequence[tuple[float, float]] | None = None
) -> Verdict:
    """Decide exactly whether a network can synchronise for some sigma > 0."""
    stated = exact_ranges(ranges, errors)
    modes = sorted(_real_modes(graph), key=lambda mode: mode.size)
    slowest, fastest = (modes[0], modes[-1]) if modes else (None, None)
    certain, maybe = (possible(widen(stated, sign), graph) for sign in (-1, 1))
    return Verdict(
        (Answer.NO, Answer.UNDECIDED, Answer.YES)[certain + maybe],
        _exact_ratio(slowest, fastest),
        fastest.size / slowest.size if slowest and fastest else math.nan,
        max((r.ratio for r in stated), default=math.nan),
        slowest,
        fastest,
        windows(ranges, graph, errors),
    )


def possible(ranges: Sequence[StableRange], graph: Topology) -> bool:
    """Return True if for some sigma > 0 every mode of a graph lies in one of the exact ranges."""
    ends = [high for _, high in _intersection(ranges, graph)]
    return any(high.alpha is None or (high.mode is not None and high.alpha > 0) for high in ends)


def _intersection(ranges: Sequence[StableRange], graph: Topology) -> list[tuple[_End, _End]]:
    """Return the windows of sigma as pairs of exact ends."""
    modes = _real_modes(graph)
    # Deviations between unconnected parts have alpha = 0, which must be stable.
    if has_loose_parts(graph) and not any(r.low == 0 for r in ranges):
        return []
    # Start with all sigma, and intersect with the ranges of each mode.
    allowed = [(_End(_EVERYTHING, False, None), _End(_EVERYTHING, True, None))]
    for mode in modes:
        ends = [(_End(r, False, mode), _End(r, True, mode)) for r in ranges]
        overlaps = [(c if _order(c, a) > 0 else a, d if _order(d, b) < 0 else b) for a, b in allowed for c, d in ends]
        allowed = [(low, high) for low, high in overlaps if _order(low, high) <= 0]
    return allowed


def _order(x: _End, y: _End) -> int:
    """Return the sign of the difference of the sigma of two ends, exactly."""
    if x.alpha is None or y.alpha is None:
        return (x.alpha is None) - (y.alpha is None)
    if x.mode is None or y.mode is None:  # an end at 0
        return (x.alpha > 0) - (y.alpha > 0)
    return compare(x.alpha, x.mode.eigenvalue, y.alpha, y.mode.eigenvalue)


def _real_modes(graph: Topology) -> tuple[NetworkMode, ...]:
    """Return the transversal modes; raise ValueError if an eigenvalue is complex or positive."""
    modes = transversal_modes(graph)
    for mode in modes:
        gamma = mode.eigenvalue.value
        if isinstance(gamma, complex):
            raise ValueError(
                f"{graph.name}({graph.n}) has the complex eigenvalue {gamma:.6g}; expected real ones: stable ranges of real "
                "alpha say nothing about it. Use synchain.runtime.prediction.synchronisability.windows_complex"
            )
        expect_no_repulsion(graph, gamma)
    return modes


def expect_no_repulsion(graph: Topology, gamma: float) -> None:
    """Raise ValueError if an eigenvalue of a graph is positive."""
    if gamma > 0:
        raise ValueError(
            f"{graph.name}({graph.n}) has the positive eigenvalue {gamma:g}, which drives oscillators apart; expected none. "
            "If the matrix is a Laplacian D - A, negate it: the connectivity matrix is A - D"
        )


def _exact_ratio(slowest: NetworkMode | None, fastest: NetworkMode | None) -> sp.Expr | None:
    """Return the eigenratio as a SymPy expression, or None if it is long."""
    if slowest is None or fastest is None:
        return None
    top, bottom = fastest.eigenvalue.number, slowest.eigenvalue.number
    if not (isinstance(top, sp.Expr) and isinstance(bottom, sp.Expr)):
        return None
    ratio = top / bottom
    if not ratio.has(sp.sin, sp.cos):
        ratio = sp.expand(sp.radsimp(ratio))
    return ratio if len(sp.sstr(ratio)) <= LONGEST else None
