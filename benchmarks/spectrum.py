"""What exact spectra cost beside SymPy, python-flint alone and NumPy, and how many digits NumPy's
eigenvalues have.

Graphs with random whole weights have no structure to use: their characteristic polynomial is 0 once
and one irreducible factor. The families have closed forms, proved up to 200 nodes. `digits` are
those of the worst eigenvalue other than 0, relative to itself, counted against 40 exact ones; NaN
where a method gives no numbers or fails. Times are CPU seconds.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology
from synchain.models.spectra.characteristic import characteristic
from synchain.models.spectra.solve import spectrum
from synchain.models.spectra.spectrum import Spectrum

from .kit.clock import best_time

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = ("graph", "n", "method", "seconds", "digits", "eigenvalues", "state")
SIZES = (4, 6, 10, 20, 50, 100, 200)
FAMILIES = (
    "chain",
    "circulant",
    "complete",
    "complete_bipartite",
    "grid",
    "hypercube",
    "ladder",
    "one_way_ring",
    "ring",
    "star",
    "torus",
    "wheel",
)
LARGE = 1000
SYMPY_LIMIT = 50
"""SymPy is timed up to so many nodes."""

Row = tuple[object, ...]
nan = float("nan")


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes small graphs and few
    families.
    """
    sizes, families, large = ((4, 10), ("complete", "grid"), 30) if quick else (SIZES, FAMILIES, LARGE)
    rows = [row for n in sizes for row in _compared("random integers", random_integers(n), quick)]
    for name in families:
        rows += _compared(name, topology(name, 1024 if name == "hypercube" and not quick else large), quick)
    return rows


def random_integers(n: int, share: float = 0.5, seed: int = 1) -> Topology:
    """A chain, so that it is connected, and each other pair with a chance of `share`; weights 1 …
    9.
    """
    stream, weights = random.Random(seed), dict[tuple[int, int], Fraction]()
    for i in range(n):
        for j in range(i):
            if j == i - 1 or stream.random() < share:
                weights[i, j] = weights[j, i] = Fraction(1 + int(9 * stream.random()))
    return Topology("random integers", n, tuple((i, j, weights[i, j]) for i, j in sorted(weights)))


def _compared(name: str, graph: Topology, quick: bool) -> Iterator[Row]:
    """A row for each method that can take the graph."""
    fresh: Callable[[Topology], Spectrum] = spectrum.__wrapped__
    found = fresh(graph)
    state = (
        "proved"
        if found.verified
        else "closed form, not proved"
        if found.error_probability is None
        else "modulo primes"
    )
    own = best_time(lambda: fresh(graph).values, quick)  # all of them: a lazy spectrum costs nothing by itself
    yield (name, graph.n, "synchain", own, digits(found, found.values), len(found), state)
    rows = np.array([[float(x) for x in row] for row in graph.rows])
    if graph.symmetric:
        seconds = best_time(lambda: np.linalg.eigvalsh(rows), quick)
        listed = np.linalg.eigvalsh(rows)[::-1]
        counts = np.cumsum([0, *found.multiplicities[:-1]])
        yield (name, graph.n, "numpy eigvalsh", seconds, digits(found, listed[counts]), graph.n, "floats")
    if name == "random integers":
        seconds = best_time(lambda: characteristic(graph).factor(), quick)
        factors = characteristic(graph).factor()[1]
        yield (name, graph.n, "python-flint factors", seconds, nan, len(factors), "factors only")
    if name == "random integers" and graph.n <= SYMPY_LIMIT:
        yield (name, graph.n, "sympy eigenvals", *_sympy(graph))


def _sympy(graph: Topology) -> tuple[float, float, int, str]:
    found: dict[object, int] = {}

    def run() -> None:
        found.update(graph.matrix.eigenvals())

    try:
        seconds = best_time(run, True)
    except Exception as problem:  # SymPy may fail in any way; the table says how
        return nan, nan, 0, f"failed: {' '.join(str(problem).split())[:60]}"
    return seconds, nan, len(found), "exact"


def digits(exact: Spectrum, values: Iterable[complex]) -> float:
    """The decimal digits of the worst of the values, in the order of the distinct eigenvalues other
    than 0.
    """
    worst = 0.0
    for eigenvalue, value in zip(exact.eigenvalues, values, strict=True):
        if eigenvalue.value != 0:
            here = complex(value)
            known = eigenvalue.enclosure(140)
            gap = abs(known - _ball(here))
            worst = max(worst, float((gap / abs(known)).upper()))
    return -math.log10(max(worst, 2.0**-53))


def _ball(value: complex) -> Any:
    """The float exactly, real or complex, as a ball."""
    from flint import acb, arb

    return arb(value.real) if value.imag == 0 else acb(value.real, value.imag)


def draw(rows: list[Row]) -> Figure:
    """Seconds and digits against the number of nodes, for graphs of random weights."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axes = figure.subplots(1, 2)
    chosen = [row for row in rows if row[0] == "random integers"]
    for method in dict.fromkeys(row[2] for row in chosen):
        here = [row for row in chosen if row[2] == method]
        axes[0].plot([r[1] for r in here], [r[3] for r in here], marker="o", label=method)
        if not all(math.isnan(float(str(r[4]))) for r in here):
            axes[1].plot([r[1] for r in here], [r[4] for r in here], marker="o", label=method)
    axes[0].set(xscale="log", yscale="log", xlabel="nodes", ylabel="CPU seconds")
    axes[1].set(xscale="log", xlabel="nodes", ylabel="correct digits of the worst eigenvalue")
    for ax in axes:
        ax.legend()
    return figure
