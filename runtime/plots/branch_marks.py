"""Lines and marks of branches and of their bifurcations."""

from __future__ import annotations

from typing import Any

from ..bifurcation.kinds import BifurcationKind

# Marker of each kind of bifurcation.
MARKERS = {
    BifurcationKind.PERIOD_DOUBLING: "o",
    BifurcationKind.FOLD: "s",
    BifurcationKind.BRANCH_POINT: "D",
    BifurcationKind.HOPF: "*",
    BifurcationKind.TORUS: "p",
    BifurcationKind.GRAZING: "^",
    BifurcationKind.STICK_LOSS: "v",
}
STABLE: dict[str, Any] = {"linestyle": "-", "linewidth": 1.2}
UNSTABLE: dict[str, Any] = {"linestyle": "--", "dashes": (2.5, 1.2), "linewidth": 0.8}
MARK: dict[str, Any] = {
    "linestyle": "none",
    "markersize": 3.6,
    "markerfacecolor": "white",
    "markeredgewidth": 0.9,
    "zorder": 5,
}
