"""Results of following: bifurcations, branches, curves of bifurcations, diagrams."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States
from ..support.error_text import range_text
from .equilibrium import Equilibrium
from .kinds import BifurcationKind
from .periodic import PeriodicOrbit
from .phases import Phases

Solution = Equilibrium | PeriodicOrbit

NAMES = frozenset(
    [
        "arclength",
        "bifurcation",
        "bifurcation_kind",
        "branch",
        "component",
        "eigenvalues",
        "growing",
        "multipliers",
        "node",
        "number",
        "orbit",
        "period",
        "periods",
        "point",
        "stable",
        "state",
        "turn",
        "vectors",
    ]
)
"""Names in the data of branches and diagrams, which no parameter may have, beside those of all results."""


def digits_of(values: tuple[float, ...] | list[float]) -> str:
    """Write numbers with eight digits, separated by commas."""
    return ", ".join(f"{value:.8g}" for value in values)


@dataclass(frozen=True, slots=True, repr=False)
class Bifurcation(Labelled):
    """A bifurcation on a branch of equilibria or periodic orbits.

    Parameters
    ----------
    value : float
        Value of the parameter.
    kind : BifurcationKind
        Its kind.
    residual : float
        Distance from the bifurcation: of the real part of the eigenvalue from 0, relative to the largest eigenvalue; of
        the multiplier from -1, 1 or the unit circle; for grazing the gap; for stick loss the excess of the load.
    solution : Equilibrium or PeriodicOrbit
        The solution at the bifurcation, or the nearest to it.
    name : str
        Name of the parameter.
    length : float
        Arclength from the first solution of the branch.
    critical : complex
        Eigenvalue or multiplier that passes; of a pair the one with positive imaginary part.
    multiplicity : int
        Number of eigenvalues, or pairs, that pass together.
    vectors : ndarray of complex, shape (k, states)
        Directions in which other branches leave.  At a branch point of multiplicity one the null vector; of higher
        multiplicity one vector for each class of symmetry.  At a Hopf point the eigenvector, its phase such that real and
        imaginary part are orthogonal.
    mode : str
        The mode of the graph that grows, if the eigenvalues belong to modes.
    lyapunov : float
        First Lyapunov coefficient of a Hopf point: negative if a stable cycle is born (supercritical).  NaN elsewhere.

    See Also
    --------
    follow : Follow the branch that is born at a bifurcation.
    """

    value: float
    kind: BifurcationKind
    residual: float
    solution: Equilibrium | PeriodicOrbit = field(repr=False)
    name: str = ""
    length: float = float("nan")
    critical: complex = complex("nan")
    multiplicity: int = 1
    vectors: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    mode: str = ""
    lyapunov: float = float("nan")

    @property
    def orbit(self) -> PeriodicOrbit:
        """The solution, if it is a periodic orbit; TypeError else."""
        if not isinstance(self.solution, PeriodicOrbit):
            raise TypeError("orbit: found a bifurcation of equilibria; expected one of periodic orbits; see `solution`")
        return self.solution

    @property
    def frequency(self) -> float:
        """Angular frequency of the oscillation that is born at a Hopf point, per unit of non-dimensional time."""
        return self.critical.imag if self.kind is BifurcationKind.HOPF else float("nan")

    @property
    def data(self) -> xr.Dataset:
        """The solution, and the vectors over their number, components and nodes."""
        data = self.solution.data
        return data.assign({self.name or "value": self.value, "vectors": (("vector", "entry"), self.vectors)})

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Rows of kind, value, critical value, mode and residual."""
        times = f", {self.multiplicity} together" if self.multiplicity > 1 else ""
        rows = [(str(self.kind), f"at {self.name or 'value'} = {self.value:.12g}{times}")]
        if not np.isnan(self.critical):
            rows.append(("critical", f"{self.critical:.8g}"))
        if self.kind is BifurcationKind.HOPF:
            side = "supercritical" if self.lyapunov < 0.0 else "subcritical"
            rows.append(("frequency", f"{self.frequency:.12g}"))
            rows.append(("Lyapunov coefficient", f"{self.lyapunov:.6g}, {side}"))
        if self.mode:
            rows.append(("mode", self.mode))
        return (*rows, ("residual", f"{self.residual:.1e}"))

    @property
    def text(self) -> str:
        """Kind and value, with eight digits."""
        return f"{self.kind} at {self.value:.8g}"


@dataclass(frozen=True, slots=True, repr=False)
class Branch(Labelled):
    """Equilibria or periodic orbits along a parameter, in the order of the branch; reads like a tuple of them.

    Parameters
    ----------
    name : str
        Name of the parameter.
    values : ndarray, shape (k,)
        Its value at each solution; not monotonic if the branch has folds.
    solutions : tuple of Equilibrium or of PeriodicOrbit
        The solutions.
    bifurcations : tuple of Bifurcation
        Bifurcations between the solutions and at the ends, in the order of the branch.
    growing : ndarray of int, shape (k,)
        Number of growing eigenvalues, or of multipliers outside the unit circle.
    lengths : ndarray, shape (k,)
        Arclength from the first solution.
    phases : tuple of Phases
        Phases of stick and slip of each orbit; empty for friction that is not set-valued.
    lost : tuple of float
        Values of the parameter at ends at which neither a further solution nor a bifurcation was found.
    ends : tuple of str
        Why the branch ends on both sides.

    See Also
    --------
    follow : Follow a branch.
    skeleton : Search orbits and follow all of them.
    """

    name: str
    values: np.ndarray
    solutions: tuple[Equilibrium | PeriodicOrbit, ...]
    bifurcations: tuple[Bifurcation, ...]
    growing: np.ndarray
    lengths: np.ndarray
    phases: tuple[Phases, ...] = ()
    lost: tuple[float, ...] = ()
    ends: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.solutions)

    def __iter__(self) -> Iterator[Solution]:
        return iter(self.solutions)

    def __getitem__(self, index: int) -> Solution:
        return self.solutions[index]

    @property
    def points(self) -> Mapping[str, tuple[Bifurcation, ...]]:
        """The bifurcations by kind: `points["fold"]`, `points["Hopf"]`; empty for a kind that did not occur."""
        return {str(k): tuple(each for each in self.bifurcations if each.kind is k) for k in BifurcationKind}

    @property
    def orbits(self) -> tuple[PeriodicOrbit, ...]:
        """The solutions of a branch of periodic orbits."""
        return tuple(each for each in self.solutions if isinstance(each, PeriodicOrbit))

    @property
    def stable(self) -> np.ndarray:
        """Whether each solution is stable, shape (k,)."""
        return np.array([each.stable for each in self.solutions], dtype=bool)

    @property
    def data(self) -> xr.Dataset:
        """States, eigenvalues or multipliers along the branch, and the bifurcations."""
        found: dict[str, tuple[tuple[str, ...], Any, str]] = {
            "growing": (("point",), self.growing, "number of growing eigenvalues or multipliers"),
            "stable": (("point",), self.stable, "whether the solution is stable"),
            "bifurcation": (("turn",), np.array([t.value for t in self.bifurcations]), f"values of {self.name}"),
            "bifurcation_kind": (
                ("turn",),
                np.array([str(t.kind) for t in self.bifurcations], dtype=str),
                "their kinds",
            ),
        }
        coordinates = {self.name: (("point",), self.values), "arclength": (("point",), self.lengths)}
        states = np.array([each.state for each in self.solutions])
        first = self.solutions[0]
        if isinstance(first, Equilibrium):
            columns = States.of(first.scene)
            found["state"] = (("point", *STATE), columns.table(states), "state at rest")
            numbers = [each.eigenvalues for each in self.solutions if isinstance(each, Equilibrium)]
            found["eigenvalues"] = (("point", "number"), numbers, "eigenvalues, the largest real part first")
            labels = {"component": list(columns.components), "node": list(first.scene.topology.labels)}
            return dataset(found, {**coordinates, **labels}, first.scene)
        multipliers = [each.multipliers for each in self.orbits]
        found["state"] = (("point", "component"), states, "state at the start of a period")
        found["multipliers"] = (("point", "number"), multipliers, "Floquet multipliers")
        coordinates["period"] = (("point",), np.array([each.period for each in self.orbits]))
        return dataset(found, {**coordinates, "component": list(first.components)}, first.scene)

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Rows of solutions with their stability, of the bifurcations, and of the ends."""
        first = self.solutions[0]
        stable = f"{int(self.stable.sum())} stable"
        if isinstance(first, Equilibrium):
            rows = [("scene", scene_text(first.scene)), ("equilibria", f"{len(self.solutions)}, {stable}")]
        else:
            rows = [("orbits", f"{len(self)} of {first.periods} drive periods, {stable} for one oscillator")]
        rows.append((self.name, range_text(self.values)))
        rows.append(("bifurcations", "; ".join(each.text for each in self.bifurcations) or "none"))
        if self.ends:
            rows.append(("ends", "; ".join(self.ends)))
        return (*rows, *((("lost", f"at {digits_of(self.lost)}"),) if self.lost else ()))
