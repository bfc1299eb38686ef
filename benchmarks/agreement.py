"""How often exponents and direct simulation say the same about the synchronisation of small
networks, and why not.

One line of exponents for each frequency serves all graphs: each network asks for it at its own
strengths sigma |gamma_k|.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.stability.exponents import Exponents, exponents
from synchain.runtime.synchronisation.agreement import OUTCOMES, Agreement, agreement, strengths
from synchain.runtime.synchronisation.criterion import Criterion

COLUMNS = ("graph", "omega", "values of sigma", *OUTCOMES, "causes of disagreement")
GRAPHS = (
    ("chain", 3),
    ("chain", 4),
    ("chain", 5),
    ("chain", 6),
    ("ring", 4),
    ("ring", 6),
    ("star", 4),
    ("star", 6),
)
OMEGAS = (1.15, 1.40, 1.55)

POINTS, HIGHEST = 40, 1.2
"""Values of sigma for each network, up to where its largest sigma |gamma| is HIGHEST."""


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes two graphs, one
    frequency and short runs.
    """
    graphs = [topology(*case) for case in (GRAPHS[0], GRAPHS[6]) if quick] or [topology(*case) for case in GRAPHS]
    criterion = Criterion(transient=300.0, window=50.0, starts=4) if quick else Criterion()
    rows: list[tuple[object, ...]] = []
    for omega in OMEGAS[:1] if quick else OMEGAS:
        line = _line(graphs, omega, quick)
        for graph in graphs:
            found = agreement(_scene(graph, omega), _sigma(graph, quick), line=line, criterion=criterion)
            rows.append(_row(graph, omega, found))
    return rows


def summary(rows: Sequence[Sequence[Any]]) -> str:
    """The share of the decided values of sigma on which both agree."""
    total = Counter({name: sum(row[3 + k] for row in rows) for k, name in enumerate(OUTCOMES)})
    same = total[OUTCOMES[0]] + total[OUTCOMES[1]]
    decided = same + total[OUTCOMES[2]] + total[OUTCOMES[3]]
    return (
        f"Both say the same for {same} of {decided} values; {total[OUTCOMES[4]]} are within two standard errors of 0."
    )


def _scene(graph: Topology, omega: float) -> Scene:
    return Scene(topology=graph, parameters={"omega": omega})


def _sigma(graph: Topology, quick: bool) -> np.ndarray:
    points = POINTS // 5 if quick else POINTS
    highest = HIGHEST / max(abs(value) for value in graph.spectrum.values)
    return np.linspace(highest / points, highest, points)


def _line(graphs: Sequence[Topology], omega: float, quick: bool) -> Exponents:
    """Exponents at the strengths of all modes of all graphs."""
    alpha = np.unique(np.concatenate([strengths(graph, _sigma(graph, quick)).reshape(-1) for graph in graphs]))
    effort = {"periods": 300.0, "starts": 2} if quick else {"periods": 5000.0, "starts": 8, "precision": 3e-4}
    return exponents(_scene(topology("chain", 2), omega), alpha, **effort)  # type: ignore[arg-type]


def _row(graph: Topology, omega: float, found: Agreement) -> tuple[object, ...]:
    causes = "; ".join(f"{count} {cause}" for cause, count in found.causes.items())
    counts = found.counts
    return (f"{graph.name}({graph.n})", omega, len(found.cells), *(counts[name] for name in OUTCOMES), causes or "none")
