"""How large a network of a family can be and still synchronise: predicted from one oscillator,
tried by direct simulation.

For each drive frequency and each form of the friction law the transversal exponent of one
oscillator gives the stable ranges of alpha. The exact eigenratio of a graph says whether some sigma
puts every mode into them; the network is then integrated with that sigma, in the middle of the
predicted window. Where no window is predicted, sigma is such that the slowest and the fastest mode
miss the widest range by the same factor, the best choice there is. Starts are those of `Criterion`;
near the end of a window chaotic motion can burst although every exponent is negative.

The second table has the largest size of each family, and in brackets that for all and for some
ranges within their errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.prediction.largest_networks import CLOSED, LargestNetwork, largest_network
from synchain.runtime.prediction.synchronisability import Verdict, verdict
from synchain.runtime.stability.msf import MSF, msf
from synchain.runtime.support.error_text import interval_text
from synchain.runtime.support.execution import Execution
from synchain.runtime.synchronisation.criterion import Criterion
from synchain.runtime.synchronisation.threshold import simulate

from .kit.tables import markdown

COLUMNS = (
    "omega",
    "contact",
    "ranges of alpha",
    "graph",
    "eigenratio",
    "allowed",
    "predicted",
    "window of sigma",
    "sigma",
    "share of starts synchronous",
    "median error",
)
CASES = tuple((omega, contact) for omega in (1.15, 1.40, 1.55) for contact in ("atan", "set-valued"))
ALPHA = (0.0, 1.2)
"""Strengths at which the exponent is known; what lies beyond counts as unstable."""
GRAPHS = (
    ("chain", 4),
    ("chain", 5),
    ("ring", 6),
    ("ring", 8),
    ("star", 6),
    ("star", 8),
    ("complete", 12),
    ("hypercube", 32),
    ("hypercube", 64),
)

Row = tuple[object, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes one frequency, two
    graphs and a short run.
    """
    rows = []
    for omega, contact in CASES[2:3] if quick else CASES:
        found = function_of(omega, contact)
        for name, n in GRAPHS[:2] if quick else GRAPHS:
            rows.append(_row(omega, contact, found, topology(name, n), quick))
    return rows


@lru_cache
def function_of(omega: float, contact: str) -> MSF:
    """The transversal exponents of the friction oscillator at one frequency, under one form of its
    law.
    """
    scene = Scene(topology=topology("chain", 2), contact=contact, parameters={"omega": omega}, record=())
    return msf(scene, np.linspace(*ALPHA, 121))


def _row(omega: float, contact: str, found: MSF, graph: Topology, quick: bool) -> Row:
    said = verdict(found.intervals, graph, found.uncertainties)
    sigma = sigma_of(found, said)
    window = "; ".join(f"{w.low:.4g} … {w.high:.4g}" for w in said.windows) or "none"
    told = (
        interval_text(found.intervals, found.uncertainties),
        f"{graph.name}({graph.n})",
        said.ratio_value,
        said.allowed,
        said.answer,
        window,
        sigma,
    )
    return (omega, contact, *told, *_simulated(found.scene, graph, sigma, quick))


def sigma_of(found: MSF, said: Verdict) -> float:
    """The middle of the widest window of sigma; without one, where the slowest and the fastest mode
    are equally far outside.

    NaN where nothing is stable or no mode is coupled.
    """
    if said.windows:
        widest = max(said.windows, key=lambda window: window.high - window.low)
        return 0.5 * (widest.low + widest.high)
    if not found.intervals or said.slowest is None or said.fastest is None:
        return math.nan
    low, high = max(found.intervals, key=lambda r: r[1] / r[0] if r[0] > 0.0 else math.inf)
    return math.sqrt(low * high / (said.slowest.size * said.fastest.size))


def _simulated(scene: Scene, graph: Topology, sigma: float, quick: bool) -> tuple[float, float]:
    """Share of the starts that end synchronous, and the median of their errors."""
    if math.isnan(sigma):
        return math.nan, math.nan
    criterion = Criterion(starts=2, transient=100.0, window=10.0) if quick else Criterion(starts=4)
    network = scene.replace(topology=graph, initial=None, record=("sync_error",))
    found = simulate(network, [sigma], criterion, execution=Execution(show_progress=False))
    return float(found.share[0]), float(found.error[0])


def summary(rows: Sequence[Sequence[object]]) -> str:
    """A second table in Markdown: the largest size of each family, from the same exponents."""
    made = []
    for omega, contact in dict.fromkeys((float(str(row[0])), str(row[1])) for row in rows):
        found = function_of(omega, contact)
        sizes = [_size(largest_network(name, found.intervals, found.uncertainties)) for name in sorted(CLOSED)]
        made.append((f"{omega:g}", contact, interval_text(found.intervals, found.uncertainties), *sizes))
    names = [f"{name} (dimension)" if name == "hypercube" else name for name in sorted(CLOSED)]
    return markdown(("omega", "contact", "ranges of alpha", *names), made)


def _size(found: LargestNetwork) -> str:
    """The size for the ranges as they are and, where that differs, for all and for some within the
    errors.
    """
    sizes = ["any" if n is None else str(n) for n in (found.n, found.certain, found.possible)]
    return sizes[0] if len(set(sizes)) == 1 else f"{sizes[0]} ({sizes[1]} … {sizes[2]})"
