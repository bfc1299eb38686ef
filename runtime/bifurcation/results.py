"""Results of following: bifurcations, branches, curves of bifurcations, diagrams."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import listed, suggestion, typed_repr
from synchain.models.inputs.display import HasPlot
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.scene import Scene

from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States
from ..support.error_text import range_text
from .equilibrium import Equilibrium
from .kinds import BifurcationKind
from .periodic_result import PeriodicOrbit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Solution = Equilibrium | PeriodicOrbit

NAMES = frozenset([
    "arclength", "bifurcation", "bifurcation_kind", "branch", "component", "eigenvalues", "growing", "multipliers",
    "node", "number", "orbit", "period", "periods", "point", "stable", "state", "turn", "vectors",
])  # fmt: skip
"""Names in the data of branches and diagrams, which no parameter may have, beside those of all results."""


P = TypeVar("P")


class PointsByKind(dict[str, tuple[P, ...]], Generic[P]):
    """Points by kind; another kind raises KeyError with those that there are."""

    def __missing__(self, kind: str) -> tuple[P, ...]:
        raise KeyError(f"points: found {kind!r}; expected {listed(self) or 'none: no point'}{suggestion(kind, self)}")


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
    tangent : ndarray, shape (states + 1,)
        Direction of the branch at a branch point: change of the states, then of the parameter.  Empty elsewhere.

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
    tangent: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def orbit(self) -> PeriodicOrbit:
        """The solution, if it is a periodic orbit; raise TypeError for an equilibrium."""
        if not isinstance(self.solution, PeriodicOrbit):
            raise TypeError("orbit: found a bifurcation of equilibria; expected one of periodic orbits; see `solution`")
        return self.solution

    @property
    def frequency(self) -> float:
        """Angular frequency of the oscillation that is born at a Hopf point, per unit of non-dimensional time."""
        return self.critical.imag if self.kind is BifurcationKind.HOPF else float("nan")

    @property
    def data(self) -> xr.Dataset:
        """The solution, the value of the parameter and the vectors, if there are any."""
        data = self.solution.data.assign({self.name or "value": ((), self.value, {"long_name": "bifurcation value"})})
        if self.vectors.size:
            words = {"long_name": "directions of the branches that leave"}
            data["vectors"] = (("vector", "entry"), self.vectors, words)
        return data

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Rows of kind, value, critical value, mode and residual."""
        times = f", {self.multiplicity} together" if self.multiplicity > 1 else ""
        rows = [(str(self.kind), f"at {self.name or 'value'} = {self.value:.12g}{times}")]
        if not np.isnan(self.critical):
            rows.append(("critical", f"{self.critical:.8g}"))
        if self.kind is BifurcationKind.HOPF:
            rows.append(("frequency", f"{self.frequency:.12g}"))
            if not np.isnan(self.lyapunov):
                side = "supercritical" if self.lyapunov < 0.0 else "subcritical"
                rows.append(("Lyapunov coefficient", f"{self.lyapunov:.6g}, {side}"))
        if len(self.vectors) > 1:
            classes = f"{len(self.vectors)} that no symmetry maps to each other"
            rows.append(("branches", f"{classes}: follow(…, vector=k), k = 0 to {len(self.vectors) - 1}"))
        if self.mode:
            rows.append(("mode", self.mode))
        return (*rows, ("residual", f"{self.residual:.1e}"))

    @property
    def text(self) -> str:
        """Kind and value, with eight digits."""
        return f"{self.kind} at {self.value:.8g}"


class Drawable(Labelled):
    """Branches, which are drawn over their parameter."""

    __slots__ = ()

    def plot(self, ax: Axes | None = None, y: str | None = None, **style: Any) -> Axes:
        """Draw a state or an observable over the parameter.

        Full lines are stable, dashed ones unstable, marks are bifurcations.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default pyplot's current ones, or those of a new figure.
        y : str, optional
            The name of a state, such as "x_1", at rest or at the start of a period; or an observable over one period,
            such as "maximum(x_1)", as `Scene.observe` takes.  By default the first state.
        **style
            Keywords of the lines, such as `color` and `linewidth`.

        Returns
        -------
        matplotlib axes
        """
        axes: Axes = HasPlot.plot(self, ax, y=y, **style)
        return axes


@dataclass(frozen=True, slots=True, repr=False)
class Branch(Drawable):
    """Equilibria or periodic orbits along a parameter, in the order of the branch; indexed and iterated like a tuple.

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
    lost : tuple of float
        Values of the parameter at ends at which neither a further solution nor a bifurcation was found.
    ends : tuple of str
        Why the branch ends on both sides.

    See Also
    --------
    follow : Follow a branch.
    diagram : Draw several branches together.
    """

    name: str
    values: np.ndarray
    solutions: tuple[Equilibrium | PeriodicOrbit, ...]
    bifurcations: tuple[Bifurcation, ...]
    growing: np.ndarray
    lengths: np.ndarray
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
        kinds = {str(k): tuple(each for each in self.bifurcations if each.kind is k) for k in BifurcationKind}
        return PointsByKind(kinds)

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
        first, states = self.solutions[0], np.array([each.state for each in self.solutions])
        numbers: list[np.ndarray]
        if isinstance(first, Equilibrium):
            kind, components = "eigenvalues", tuple(first.scene.equations.components)
            numbers = [each.eigenvalues for each in self.solutions if isinstance(each, Equilibrium)]
        else:
            kind, components = "multipliers", first.components
            numbers = [each.multipliers for each in self.orbits]
        shape = (len(self), len(components), first.scene.n)
        # Nodes of several kinds leave gaps in the table of components and nodes.
        table = states.reshape(shape) if states.size == np.prod(shape) else States.of(first.scene).table(states)
        found["state"] = (("point", *STATE), table, "state at rest, or at the start of a period")
        found[kind] = (("point", "number"), numbers, f"{kind}, the largest first")
        coordinates = {
            self.name: (("point",), self.values),
            "arclength": (("point",), self.lengths),
            "component": list(components),
            "node": list(first.scene.topology.labels),
            "number": np.arange(1, len(numbers[0]) + 1),
        }
        if self.orbits:
            coordinates["period"] = (("point",), np.array([each.period for each in self.orbits]))
        return dataset(found, coordinates, first.scene)

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Rows of solutions with their stability, of the bifurcations, and of the ends."""
        first = self.solutions[0]
        stable = f"{int(self.stable.sum())} stable"
        if isinstance(first, Equilibrium):
            rows = [("scene", scene_text(first.scene)), ("equilibria", f"{len(self.solutions)}, {stable}")]
        else:
            of = "" if first.free else f" of {first.periods} drive periods"
            rows = [("scene", scene_text(first.scene, (self.name,))), ("orbits", f"{len(self)}{of}, {stable}")]
        rows.append((self.name, range_text(self.values)))
        rows.append(("bifurcations", "; ".join(each.text for each in self.bifurcations) or "none"))
        if self.ends:
            rows.append(("ends", "; ".join(self.ends)))
        return (*rows, *((("lost", f"at {digits_of(self.lost)}"),) if self.lost else ()))


@dataclass(frozen=True, slots=True, repr=False)
class Diagram(Drawable):
    """Several branches over one parameter; indexed and iterated like a tuple.

    Parameters
    ----------
    branches : tuple of Branch
        The branches.
    searched : mapping of str to (float, float)
        Range of initial values of each component in the search of `skeleton`.

    See Also
    --------
    diagram : Put branches together.
    """

    branches: tuple[Branch, ...]
    searched: Mapping[str, tuple[float, float]] = FrozenDict()

    def __len__(self) -> int:
        return len(self.branches)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    def __getitem__(self, index: int) -> Branch:
        return self.branches[index]

    @property
    def data(self) -> xr.Dataset:
        """The data of all branches along one row of points, with the number of the branch as coordinate."""
        parts = []
        for number, branch in enumerate(self.branches):
            part = branch.data.drop_dims("turn")
            period = np.full(len(branch), np.nan) if "period" not in part.coords else part.coords["period"].values
            part = part.assign_coords(branch=("point", np.full(len(branch), number)), period=("point", period))
            parts.append(part)
        # Equilibria have eigenvalues and cycles multipliers: gaps are filled with NaN.
        return xr.concat(parts, "point", join="outer") if parts else xr.Dataset()

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """One row for each branch."""
        rows = []
        for k, branch in enumerate(self.branches, 1):
            kinds = Counter(str(each.kind) for each in branch.bifurcations)
            found = ", ".join(f"{n} {kind}" for kind, n in kinds.items()) or "no bifurcation"
            rows.append((f"branch {k}", f"{len(branch)} solutions, {branch.name} {range_text(branch.values)}, {found}"))
        box = ", ".join(f"{name} from {low:.4g} to {high:.4g}" for name, (low, high) in self.searched.items())
        return (*(rows or [("branches", "none")]), *((("starts", box),) if box else ()))


def diagram(*branches: Branch | Diagram) -> Diagram:
    """Put branches over one parameter together.

    Parameters
    ----------
    *branches : Branch or Diagram
        Branches of equilibria or of periodic orbits, or diagrams of them.

    Returns
    -------
    Diagram
        ``diagram(…).plot(y="maximum(x_1)")`` draws an observable of each solution over one period, full lines where the
        solution is stable, dashed ones where it is not, and a mark at each bifurcation.

    Raises
    ------
    ValueError
        For branches over different parameters, and without any branch.
    TypeError
        For other values.

    See Also
    --------
    follow : Follow a branch.

    Examples
    --------
    >>> from synchain import Field, Scene, diagram, equilibrium, follow
    >>> cell = Scene(Field({"x": "r*x - x**3"}, parameters={"r": -1}), initial={"x": 0})
    >>> rest = follow(equilibrium(cell), "r", to=1)
    >>> pitchfork = follow(rest.points["branch point"][0], "r", to=1)
    >>> len(diagram(rest, pitchfork))
    2
    """
    parts: list[Branch] = []
    for each in branches:
        if not isinstance(each, Branch | Diagram):
            raise TypeError(f"diagram: found {typed_repr(each)}; expected branches, such as follow(…) returns")
        parts += each.branches if isinstance(each, Diagram) else (each,)
    names = sorted({each.name for each in parts})
    if len(names) != 1:
        raise ValueError(f"diagram: found branches over {', '.join(names) or 'no parameter'}; expected one parameter")
    return Diagram(tuple(parts))


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """A point of codimension two on a curve, or one at which a parameter is extreme."""

    kind: str  # "cusp", "Bogdanov-Takens", "Bautin", "zero-Hopf", "double Hopf", "1:3 resonance"; "extreme p"
    values: tuple[float, float]  # of both parameters
    state: np.ndarray  # (states,)
    frequency: float = 0.0  # of a Hopf or torus point


@dataclass(frozen=True, slots=True, repr=False)
class Curve(Labelled):
    """A curve of bifurcations in two parameters.

    Parameters
    ----------
    scene : Scene
        Network with its other parameters.
    kind : BifurcationKind
        Kind of the bifurcations.
    names : (str, str)
        Names of the parameters.
    values : ndarray, shape (k, 2)
        Their values along the curve.
    states : ndarray, shape (k, states)
        Equilibria along the curve, or states of the cycles at the beginning of a period.
    frequencies : ndarray, shape (k,)
        Angular frequencies of Hopf points; of torus points those of the second oscillation; 0 on other curves.
    growing : ndarray of int, shape (k,)
        Number of growing eigenvalues beside the critical ones.
    special : tuple of CurvePoint
        Points of codimension two and extremes of a parameter, in the order of the curve.
    ends : tuple of str
        Why the curve ends on both sides.
    periods : ndarray, shape (k,)
        Periods of cycles; 0 of equilibria.

    See Also
    --------
    follow : Follow a bifurcation in two parameters.
    """

    scene: Scene = field(repr=False)
    kind: BifurcationKind
    names: tuple[str, str]
    values: np.ndarray
    states: np.ndarray
    frequencies: np.ndarray
    growing: np.ndarray
    special: tuple[CurvePoint, ...]
    ends: tuple[str, ...] = ()
    periods: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.values)

    @property
    def points(self) -> Mapping[str, tuple[CurvePoint, ...]]:
        """The special points by kind: `points["cusp"]`."""
        kinds = dict.fromkeys(each.kind for each in self.special)
        return PointsByKind({kind: tuple(each for each in self.special if each.kind == kind) for kind in kinds})

    @property
    def data(self) -> xr.Dataset:
        """Both parameters, states and frequencies along the curve."""
        columns = States.of(self.scene)
        return dataset(
            {
                "state": (("point", *STATE), columns.table(self.states), "state at rest, or at the start of a period"),
                "frequency": (("point",), self.frequencies, "angular frequency of Hopf or torus points"),
                "growing": (("point",), self.growing, "number of growing values beside the critical ones"),
            },
            {
                **{name: (("point",), self.values[:, k]) for k, name in enumerate(self.names)},
                "component": list(columns.components),
                "node": list(self.scene.topology.labels),
            },
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Rows of kind, ranges of both parameters, special points and ends."""
        special = "; ".join(f"{each.kind} at {digits_of(each.values)}" for each in self.special)
        return (
            ("scene", scene_text(self.scene)),
            ("curve", f"of {str(self.kind).removesuffix(' point')} points, {len(self)} solutions"),
            *((name, range_text(self.values[:, k])) for k, name in enumerate(self.names)),
            ("points", special or "none"),
            ("ends", "; ".join(self.ends)),
        )
