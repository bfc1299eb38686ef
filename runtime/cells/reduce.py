"""Exact reduction of a scene: terms that are zero in every cell, and oscillators that move as one,
are left out.

`synchain.models.dynamics.reduction` proves each reduction; it is undone before the result, which is
that of the whole network.  docs/skips.md lists all reductions, also those of the emitted text and
of the kernel's driver.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import PointColumn, SumColumn
from synchain.codegen.kernels.observable_text import Recording
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import NoQuotient, quotient, substitute_constants
from synchain.models.inputs.checks import check_flag
from synchain.models.inputs.names import NodeName
from synchain.models.scenes.scene import Scene, check_scene

from ..support.status import Status
from .buffers import IN_MEMORY, Buffers, numbers_of_a_cell
from .observable_arrays import ObservableArrays, Sections, watched
from .plan import CellRows, Planner

__all__ = ["NodeMerge", "ReducedScene", "as_reduction", "explain", "reduce_scene"]

DIVERGED = "diverged: the cell ends as soon as its state is out of bounds"
PERIODIC = (
    "periodic: a cell that repeats itself bit for bit from one period of the drive to a later one jumps over whole cycles, "
    "before the window always, inside it where neither section nor trajectory is recorded"
)


@dataclass(frozen=True, slots=True, eq=False)
class NodeMerge:
    """Which oscillators are stepped as one, and the way back to the whole network."""

    states: np.ndarray  # columns of the whole network's state that start the reduced one
    places: np.ndarray  # column of the reduced state in which each state of the whole network is found
    # True if all oscillators are stepped as one and their synchronisation error, which is 0, is a record
    together: bool

    @property
    def merges(self) -> bool:
        """True if any oscillators are stepped as one."""
        return len(self.states) < len(self.places)

    def expand(self, buffers: Buffers) -> Buffers:
        """Return the results of the whole network; the same arrays if nothing was merged."""
        whole = self._take(buffers, self.places)
        if self.together:
            whole = replace(whole, sums=whole.sums.copy())
            whole.sums[whole.status != Status.NOT_RUN, : SumColumn.STOPPED_AT] = (
                0.0  # one oscillator has no distance to itself
            )
        return whole

    def contract(self, buffers: Buffers) -> Buffers:
        """Return the part of the whole network's results that the reduced network has."""
        return self._take(buffers, self.states)

    def _take(self, buffers: Buffers, columns: np.ndarray) -> Buffers:
        """The buffers of a network whose states are these columns of another one's."""
        if not self.merges:
            return buffers
        points = np.concatenate([[PointColumn.TIME], columns + PointColumn.STATE])
        return replace(
            buffers,
            end=np.take(buffers.end, columns, axis=1),
            points=np.take(buffers.points, points, axis=2),
            samples=np.take(buffers.samples, columns, axis=2),
        )


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class ReducedScene:
    """What is left of a scene to integrate, and the way back."""

    scene: Scene
    planner: Planner = field(repr=False)  # lays out its cells
    equations: Equations = field(repr=False)  # the equations that the kernel steps
    recording: Recording = field(repr=False)  # records, observables, sections and stop of the kernel
    merge: NodeMerge = field(repr=False)  # which oscillators are stepped as one
    numbers: np.ndarray = field(repr=False)  # columns of the whole network's parameters that are left
    skipped: tuple[str, ...]  # sentences: what was left out, and what was not and why
    kept: tuple[str, ...]
    jumps: bool  # whether a cell that repeats itself leaves out whole cycles

    @property
    def dimension(self) -> int:
        """Number of states of the reduced network."""
        return len(self.merge.states)

    @property
    def samples(self) -> int:
        """Points of a trajectory; 0 if none is recorded."""
        return self.scene.samples if "trajectory" in self.scene.record else 0

    @property
    def observed(self) -> ObservableArrays:
        """What the scene observes."""
        return ObservableArrays(self.scene)

    @property
    def point_size(self) -> int:
        """Numbers of a section point beside its time."""
        return Sections(self.scene).width(self.dimension)

    def empty(self, cells: int, room: int, observed: int | None = None) -> Buffers:
        """Return buffers of cells of the reduced network, of its result or of what a kernel tallies."""
        observed = self.observed.numbers if observed is None else observed
        return Buffers.empty(cells, self.dimension, room, self.samples, observed, self.point_size)

    def check_memory(self) -> None:
        """Raise ValueError if the results of all cells do not fit into memory."""
        cells = self.scene.cells
        numbers = cells * numbers_of_a_cell(len(self.merge.places), 0, self.samples, self.observed.numbers)
        if numbers > IN_MEMORY:
            raise ValueError(
                f"sweep: found {cells} cells, {numbers * 8 / 1e9:.0f} GB in memory; expected at most "
                f"{IN_MEMORY * 8 / 1e9:.0f} GB; write it to a file with stream, whose memory does not grow with the sweep, "
                "or take fewer cells"
            )

    def rows(self, whole: CellRows) -> CellRows:
        """Return the rows of the reduced network out of those of the whole one."""
        start, numbers = whole.start, whole.numbers
        if self.merge.merges:
            start = np.take(start, self.merge.states, axis=1)
        if len(self.numbers) < numbers.shape[1]:
            numbers = np.take(numbers, self.numbers, axis=1)
        return replace(whole, start=start, numbers=numbers)

    def expand(self, buffers: Buffers) -> Buffers:
        """Return the results of the whole network; the same arrays if nothing was merged."""
        return self.merge.expand(buffers)


def as_reduction(scene: Scene, reduce: bool | ReducedScene, starts: np.ndarray | None = None) -> ReducedScene:
    """Return the reduction of a scene that the argument `reduce` of `run` asks for."""
    check_scene(scene)
    if not isinstance(reduce, ReducedScene):
        return reduce_scene(scene, check_flag("reduce", reduce), starts=starts)
    if starts is not None:
        raise ValueError("reduce: found a Reduction beside a start of several cells; expected True or False")
    if reduce.scene != scene:
        raise ValueError("reduce: found the reductions of another scene; make them with reduce_scene(scene)")
    return reduce


def reduce_scene(
    scene: Scene, reduce: bool = True, fold_all: bool = False, starts: np.ndarray | None = None
) -> ReducedScene:
    """Return what is left of a scene to integrate. Shapes: starts (cells, dimension)."""
    whole, found = scene.equations, watched(scene)
    skipped: list[str] = []
    kept: list[str] = []
    equations, classes = whole, tuple(range(scene.n))
    if reduce:
        equations = _fold(scene, _observed_parameters(scene, found), fold_all, skipped, kept)
        if starts is None:
            equations, classes = _merge(scene, equations, skipped, kept)
        else:
            kept.append("quotient: each cell starts from other states")
        kept += _present(scene, equations)
    else:
        kept.append("everything is integrated as it stands, as asked for")
    together = max(classes) == 0 and scene.n > 1 and "sync_error" in scene.record
    seen: dict[int, int] = {}
    for node, k in enumerate(classes):
        seen.setdefault(k, node)
    first = [seen[k] for k in range(equations.n)]
    merge, section = _node_merge(whole, equations, classes, together), None
    if "section" in scene.record:
        # the section variable of the class of its node
        variable = equations.state[int(merge.places[whole.state.index(scene.section.variable)])]
        section = sp.Symbol(variable, real=True) - sp.Rational(repr(scene.section.level))
    records = tuple(r for r in scene.record if not (together and r == "sync_error"))
    return ReducedScene(
        scene,
        Planner(scene, starts),
        equations,
        replace(found, records=records, section=section, multiplicity=_multiplicity(scene, classes)),
        merge,
        _columns(whole, equations, first),
        tuple(skipped),
        tuple(kept),
        reduce,
    )


def _node_merge(whole: Equations, reduced: Equations, classes: tuple[int, ...], together: bool) -> NodeMerge:
    """The columns of both states, from the class of each oscillator of the whole network."""
    if reduced.n == whole.n:
        same = np.arange(whole.dimension)
        return NodeMerge(same, same, together)
    first: dict[int, int] = {}
    states, places = np.empty(reduced.dimension, dtype=int), np.empty(whole.dimension, dtype=int)
    for node, k in enumerate(classes):
        if first.setdefault(k, node) == node:
            states[list(reduced.places[k])] = whole.places[node]
        places[list(whole.places[node])] = reduced.places[k]
    return NodeMerge(states, places, together)


def _columns(whole: Equations, reduced: Equations, first: list[int]) -> np.ndarray:
    """The columns of the whole network's parameters that a reduced one has; its node k stands for first[k]."""
    column = {name: k for k, name in enumerate(whole.parameters)}
    return np.array([column[_column(name, reduced, first)] for name in reduced.parameters], dtype=int)


def _column(name: str, equations: Equations, first: list[int]) -> str:
    """The name in the whole network of a parameter of a reduced one; node k stands for first[k]."""
    parts = NodeName.parse(name)
    return str(NodeName(parts.base, first[parts.index])) if parts and parts.base in equations.varied else name


def _fixed(scene: Scene) -> dict[str, float]:
    """The parameters with one value in every cell."""
    swept = {axis.name: axis.values for axis in (*scene.axes, *scene.drawn)}
    values = {name: swept.get(name, (scene.parameters[name],)) for name in scene.equations.parameters}
    return {name: found[0] for name, found in values.items() if min(found) == max(found)}


def _fold(scene: Scene, observed: set[str], fold_all: bool, skipped: list[str], kept: list[str]) -> Equations:
    """Fold parameters one after the other, and say what each of them took along; not those that are `observed`."""
    equations, fixed = scene.equations, _fixed(scene)
    for name, value in fixed.items():
        if (value != 0.0 and not fold_all) or name not in equations.parameters:
            continue
        try:
            made = _without(equations, name, Fraction(repr(value)))
        except ValueError as problem:
            kept.append(str(problem))
            continue
        seen = sorted(observed & (set(equations.parameters) - set(made.parameters)))
        if seen:
            kept.append(f"parameter: {name} = {value:g} in every cell, but {', '.join(seen)} is observed")
            continue
        skipped.append(_consequence(equations, made, name, value))
        equations = made
    return equations


@lru_cache(maxsize=64)
def _without(equations: Equations, name: str, value: Fraction) -> Equations:
    """The equations at one value of a parameter; runs of one model ask for it again and again."""
    return substitute_constants(equations, {name: value})


def _observed_parameters(scene: Scene, found: Recording) -> set[str]:
    """The parameters that occur in observables and in sections on functions."""
    names = {s.name for value in (*found.observed, *found.events) for s in value.free_symbols}
    names = names.union(*(rows.names for rows in found.sums))
    of_nodes = {str(NodeName(name, i)) for name in scene.equations.varied if name in names for i in range(scene.n)}
    return (names | of_nodes) & set(scene.parameters)


def _present(scene: Scene, equations: Equations) -> list[str]:
    """What has to be integrated, in words."""
    found = ["forcing: time occurs in the equations"] if equations.forced else []
    if equations.link_count:
        fixed = _fixed(scene)
        names = [*dict.fromkeys(symbol.name for edge in equations.edges for symbol in edge.parameters)]
        differ = dict.fromkeys(equations.numbered, "differs")
        strengths = [
            f"{name} = {fixed[name]:g}" if name in fixed else f"{name} {differ.get(name, 'is swept')}" for name in names
        ]
        found.append(f"coupling: {', '.join([f'{equations.link_count} links', *strengths])}")
    return found


def _consequence(before: Equations, after: Equations, name: str, value: float) -> str:
    """What a folded parameter has taken along, in words."""
    gone = [p for p in before.parameters if p not in after.parameters and p != name]
    too = f" together with {', '.join(gone)}" if gone else ""
    if before.forced and not after.forced:
        return f"forcing: {name} = {value:g} in every cell, left out{too}; no time terms"
    if before.link_count and not after.link_count:
        return f"coupling: {name} = {value:g} in every cell, left out{too}; no links"
    return f"parameter: {name} = {value:g} in every cell, now a number of the equations{too and f'; left out{too}'}"


def _merge(
    scene: Scene, equations: Equations, skipped: list[str], kept: list[str]
) -> tuple[Equations, tuple[int, ...]]:
    """Make one node of oscillators that move as one in every cell; returns the class of each
    oscillator.
    """
    n, alone = scene.n, tuple(range(scene.n))
    if equations.mixed:
        kept.append("quotient: nodes of several kinds are stepped one by one")
        return equations, alone
    if scene.observe or scene.sections or scene.stop:
        kept.append(f"quotient: the {n} oscillators are observed one by one")
        return equations, alone
    colours = [] if _all_apart(scene) else _colours(scene)
    different = len(set(colours)) or n
    words = f"quotient: {n} oscillators with {different} different starts"
    if different == n:
        if n > 1:
            kept.append(f"quotient: the {n} oscillators start from different states")
        return equations, alone
    try:
        made, classes = quotient(equations, colours)
    except NoQuotient as problem:
        kept.append(str(problem))
        return equations, alone
    if made.n == n:
        kept.append(f"{words} are stepped one by one: the links do not treat equal starts alike")
        return equations, alone
    if made.n == 1:
        words = f"quotient: {n} oscillators that all start equal"
    skipped.append(f"{words} are stepped as {made.n}; the links treat equal starts alike, so they stay equal")
    return made, classes


def _all_apart(scene: Scene) -> bool:
    """True if the starts of a component differ at all nodes in every cell, which a large network shows soon."""
    moved = {parts.base for axis in (*scene.axes, *scene.drawn) if (parts := NodeName.parse(axis.name))}
    return any(len(set(x)) == scene.n for name, x in scene.initial.items() if name not in moved)


def _colours(scene: Scene) -> list[Hashable]:
    """For each oscillator its start and its own parameters in all cells; equal if these are equal
    in every cell.
    """
    drawn = {axis.name for axis in scene.drawn}
    swept = {axis.name: axis.values for axis in (*scene.axes, *scene.drawn)}
    colours: list[Hashable] = []
    for i in range(scene.n):
        own: list[Hashable] = []
        starts = {f"{component}_{i + 1}": values[i] for component, values in scene.initial.items()}
        numbers = {f"{name}_{i + 1}": scene.parameters[f"{name}_{i + 1}"] for name in scene.equations.varied}
        for name, value in (starts | numbers).items():
            found = swept.get(name, (value,))
            if min(found) == max(found):
                own.append(found[0])
            else:
                together = scene.zipped or name in drawn
                own.append(found if together else name)  # on a grid two axes differ in some cell
        colours.append(tuple(own))
    return colours


def _multiplicity(scene: Scene, classes: tuple[int, ...]) -> tuple[int, ...] | None:
    """Oscillators in each class if the synchronisation error must count them, else None.

    It is the sum of the distances from the first oscillator, whose own class does not contribute.
    """
    sizes = Counter(classes)
    if "sync_error" not in scene.record or all(size == 1 for k, size in sizes.items() if k != 0):
        return None
    return tuple(sizes[k] for k in range(len(sizes)))


def explain(reduction: ReducedScene) -> str:
    """Return in words what is left out of a scene and why, what is not, and what a cell may leave
    out at run time.
    """
    parts = (
        ("left out", (*reduction.skipped, *_unwritten(reduction))),
        ("not left out", reduction.kept),
        (
            "in a cell, while it runs",
            (DIVERGED, PERIODIC) if reduction.jumps and reduction.scene.drive.frequency is not None else (DIVERGED,),
        ),
    )
    return "\n".join(
        "\n".join([title, *(f"  {sentence}" for sentence in sentences or ("nothing",))]) for title, sentences in parts
    )


def _unwritten(reduction: ReducedScene) -> list[str]:
    """What the text of the kernel does not have, because the scene never had it."""
    scene, found = reduction.scene, []
    if not scene.forced:
        found.append("forcing: time does not occur in the equations; no time terms")
    if not scene.equations.link_count:
        found.append("coupling: no links")
    if "sync_error" not in scene.record:
        found.append("synchronisation error: not recorded")
    elif "sync_error" not in reduction.recording.records:
        found.append("synchronisation error: 0 between oscillators that are stepped as one")
    if "section" not in scene.record:
        found.append("section: not recorded; no search for crossings")
    if "trajectory" not in scene.record:
        found.append("trajectory: not recorded; no samples")
    if not reduction.recording.records:
        found.append("dense output: no record needs states inside a step")
    return found
