"""Reduce a scene exactly: leave out terms that are zero in every cell, and merge oscillators with identical motion.

`synchain.models.dynamics.reduction` proves each reduction. Results are expanded to the unreduced network. docs/skips.md
lists all reductions, including those in the text of a kernel and in the kernel's driver.
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
from synchain.codegen.kernels.observable_functions import Recording
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.record import Record
from synchain.models.dynamics.reduction import NoQuotient, quotient, substitute_constants
from synchain.models.inputs.checks import check_flag
from synchain.models.inputs.names import NodeName
from synchain.models.scenes.scene import Scene, check_scene

from ..support.status import Status
from .buffers import IN_MEMORY, Buffers, numbers_of_a_cell
from .observable_arrays import ObservableArrays, Sections, watched
from .plan import CellRows, Planner

DIVERGED = "diverged: the cell ends as soon as its state is out of bounds"
PERIODIC = (
    "periodic: a cell that repeats itself bit for bit from one period of the drive to a later one jumps over whole cycles, "
    "before the window always, inside it where neither section nor trajectory is recorded"
)


@dataclass(frozen=True, slots=True, eq=False)
class NodeMerge:
    """Columns that convert states between an unreduced network and one with merged oscillators."""

    states: np.ndarray  # columns of the unreduced state that are the start of the reduced network
    places: np.ndarray  # for each state of the unreduced network, its column in the reduced state
    # True if all oscillators are stepped as one and their synchronisation error, which is 0, is a record
    together: bool

    @classmethod
    def of(cls, network: Equations, reduced: Equations, classes: tuple[int, ...], together: bool) -> NodeMerge:
        """Return the merge that follows from the class of each oscillator."""
        if reduced.n == network.n:
            same = np.arange(network.dimension)
            return cls(same, same, together)
        states, places = np.empty(reduced.dimension, dtype=int), np.empty(network.dimension, dtype=int)
        for node, k in reversed([*enumerate(classes)]):  # the first node of a class is its representative
            states[list(reduced.places[k])] = network.places[node]
            places[list(network.places[node])] = reduced.places[k]
        return cls(states, places, together)

    @property
    def merges(self) -> bool:
        """True if any oscillators are stepped as one."""
        return len(self.states) < len(self.places)

    def expand(self, buffers: Buffers) -> Buffers:
        """Return the results of the whole network; the same arrays if nothing was merged."""
        expanded = self._take(buffers, self.places)
        if self.together:  # one oscillator has no distance to itself
            expanded = replace(expanded, sums=expanded.sums.copy())
            expanded.sums[expanded.status != Status.NOT_RUN, : SumColumn.STOPPED_AT] = 0.0
        return expanded

    def contract(self, buffers: Buffers) -> Buffers:
        """Return the part of the unreduced network's results that belongs to the reduced network."""
        return self._take(buffers, self.states)

    def _take(self, buffers: Buffers, columns: np.ndarray) -> Buffers:
        """Return buffers that contain these columns of the states."""
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
    """The part of a scene that is integrated, with all data to expand its results to the unreduced scene."""

    scene: Scene
    planner: Planner = field(repr=False)  # lays out the cells of the scene
    equations: Equations = field(repr=False)  # the equations that the kernel steps
    recording: Recording = field(repr=False)  # records, observables, sections and stop of the kernel
    merge: NodeMerge = field(repr=False)  # which oscillators are stepped as one
    numbers: np.ndarray = field(repr=False)  # columns of the unreduced network's parameters that remain
    skipped: tuple[str, ...]  # sentences about parts that are left out
    kept: tuple[str, ...]  # sentences about parts that remain, with the reason
    jumps: bool  # True if a cell with periodic motion skips whole cycles
    observed: ObservableArrays = field(init=False, repr=False)  # the observables of the scene

    def __post_init__(self) -> None:
        object.__setattr__(self, "observed", ObservableArrays(self.scene))

    @property
    def dimension(self) -> int:
        return len(self.merge.states)

    @property
    def samples(self) -> int:
        """Points of a trajectory; 0 if none is recorded."""
        return self.scene.samples if "trajectory" in self.scene.record else 0

    @property
    def point_size(self) -> int:
        """Numbers of a section point beside its time."""
        return Sections(self.scene).width(self.dimension)

    def empty(self, cells: int, room: int, observed: int | None = None) -> Buffers:
        # `observed`: number of tallies, by default of observables.
        observed = self.observed.numbers if observed is None else observed
        return Buffers.empty(cells, self.dimension, room, self.samples, observed, self.point_size)

    def check_memory(self) -> None:
        """Raise ValueError if the results of all cells do not fit into memory."""
        cells = self.scene.cells
        size = cells * numbers_of_a_cell(len(self.merge.places), 0, self.samples, self.observed.numbers)
        if size > IN_MEMORY:
            raise ValueError(
                f"sweep: found {cells} cells, {size * 8 / 1e9:.0f} GB in memory; expected at most "
                f"{IN_MEMORY * 8 / 1e9:.0f} GB; write it to a file with stream, whose memory does not grow with the sweep, "
                "or take fewer cells"
            )

    def rows(self, rows: CellRows) -> CellRows:
        start, parameters = rows.start, rows.numbers
        if not self.merge.merges and len(self.numbers) == parameters.shape[1]:
            return rows
        if self.merge.merges:
            start = np.take(start, self.merge.states, axis=1)
        if len(self.numbers) < parameters.shape[1]:
            parameters = np.take(parameters, self.numbers, axis=1)
        return replace(rows, start=start, numbers=parameters)

    def expand(self, buffers: Buffers) -> Buffers:
        """Return the results of the whole network; the same arrays if nothing was merged."""
        return self.merge.expand(buffers)


def as_reduction(scene: Scene, reduce: bool | ReducedScene, starts: np.ndarray | None = None) -> ReducedScene:
    check_scene(scene)
    if not isinstance(reduce, ReducedScene):
        return reduce_scene(scene, check_flag("reduce", reduce), starts=starts)
    if starts is not None:
        raise ValueError("reduce: found a ReducedScene beside a start of several cells; expected True or False")
    if reduce.scene != scene:
        raise ValueError("reduce: found the reductions of another scene; make them with reduce_scene(scene)")
    return reduce


def reduce_scene(
    scene: Scene, reduce: bool = True, fold_all: bool = False, starts: np.ndarray | None = None
) -> ReducedScene:
    """Return the part of a scene that must be integrated. Shapes: starts (cells, dimension)."""
    network, recording = scene.equations, watched(scene)
    skipped: list[str] = []
    kept: list[str] = []
    equations, classes = network, tuple(range(scene.n))
    if reduce:
        equations = _fold(scene, _observed_parameters(scene, recording), fold_all, skipped, kept)
        if starts is None:
            equations, classes = _merge(scene, equations, skipped, kept)
        else:
            kept.append("quotient: each cell starts from other states")
        kept += _present(scene, equations)
    else:
        kept.append("everything is integrated as it stands, as asked for")
    together = max(classes) == 0 and scene.n > 1 and "sync_error" in scene.record
    merge, section = NodeMerge.of(network, equations, classes, together), None
    if "section" in scene.record:
        # the section variable of the class of its node
        variable = equations.state[int(merge.places[network.state.index(scene.section.variable)])]
        section = sp.Symbol(variable, real=True) - sp.Rational(repr(scene.section.level))
    records = tuple(r for r in scene.record if not (together and r == "sync_error"))
    # The synchronisation error, a sum of distances from the first oscillator, counts the oscillators of each other
    # class.
    sizes, multiplicity = Counter(classes), None
    if "sync_error" in scene.record and any(size > 1 for k, size in sizes.items() if k != 0):
        multiplicity = tuple(sizes[k] for k in range(len(sizes)))
    # Columns of the network's parameters that are left; a reduced node has those of the first oscillator of its class.
    first = {k: node for node, k in reversed([*enumerate(classes)])}
    column, columns = {name: k for k, name in enumerate(network.parameters)}, []
    for name in equations.parameters:
        parts = NodeName.parse(name)
        if parts and parts.base in equations.varied:
            name = str(NodeName(parts.base, first[parts.index]))
        columns.append(column[name])
    return ReducedScene(
        scene,
        Planner(scene, starts),
        equations,
        replace(recording, records=records, section=section, multiplicity=multiplicity),
        merge,
        np.array(columns, dtype=int),
        tuple(skipped),
        tuple(kept),
        reduce,
    )


def _fixed(scene: Scene) -> dict[str, float]:
    swept = {axis.name: axis.values for axis in (*scene.axes, *scene.drawn)}
    values = {name: swept.get(name, (scene.parameters[name],)) for name in scene.equations.parameters}
    return {name: row[0] for name, row in values.items() if min(row) == max(row)}


def _observed_parameters(scene: Scene, recording: Recording) -> set[str]:
    names = {s.name for value in (*recording.observed, *recording.events) for s in value.free_symbols}
    names = names.union(*(rows.names for rows in recording.sums))
    of_nodes = {str(NodeName(name, i)) for name in scene.equations.varied if name in names for i in range(scene.n)}
    return (names | of_nodes) & set(scene.parameters)


def _fold(scene: Scene, observed: set[str], fold_all: bool, skipped: list[str], kept: list[str]) -> Equations:
    """Replace parameters by their values if they are 0 in every cell; with `fold_all`, if they are equal in every cell.

    Parameters that are `observed` remain.
    """
    equations = scene.equations
    for name, value in _fixed(scene).items():
        if (value != 0.0 and not fold_all) or name not in equations.parameters:
            continue
        try:
            folded = _without(equations, name, Fraction(repr(value)))
        except ValueError as problem:
            kept.append(str(problem))
            continue
        seen = sorted(observed & (set(equations.parameters) - set(folded.parameters)))
        if seen:
            kept.append(f"parameter: {name} = {value:g} in every cell, but {', '.join(seen)} is observed")
            continue
        # Other parameters may disappear together with this one, or all terms with time, or all links.
        gone = [p for p in equations.parameters if p not in folded.parameters and p != name]
        too = f" together with {', '.join(gone)}" if gone else ""
        if equations.forced and not folded.forced:
            skipped.append(f"forcing: {name} = {value:g} in every cell, left out{too}; no time terms")
        elif equations.link_count and not folded.link_count:
            skipped.append(f"coupling: {name} = {value:g} in every cell, left out{too}; no links")
        else:
            also = too and f"; left out{too}"
            skipped.append(f"parameter: {name} = {value:g} in every cell, now a number of the equations{also}")
        equations = folded
    return equations


@lru_cache(maxsize=64)
def _without(equations: Equations, name: str, value: Fraction) -> Equations:
    """Return the equations at one value of a parameter; cached for all runs of one model."""
    return substitute_constants(equations, {name: value})


def _present(scene: Scene, equations: Equations) -> list[str]:
    sentences = ["forcing: time occurs in the equations"] if equations.forced else []
    if equations.link_count:
        fixed = _fixed(scene)
        names = [*dict.fromkeys(symbol.name for edge in equations.edges for symbol in edge.parameters)]
        differ = dict.fromkeys(equations.numbered, "differs")
        strengths = [
            f"{name} = {fixed[name]:g}" if name in fixed else f"{name} {differ.get(name, 'is swept')}" for name in names
        ]
        sentences.append(f"coupling: {', '.join([f'{equations.link_count} links', *strengths])}")
    return sentences


def _merge(
    scene: Scene, equations: Equations, skipped: list[str], kept: list[str]
) -> tuple[Equations, tuple[int, ...]]:
    """Merge oscillators with identical motion in every cell; return the equations and the class of each oscillator."""
    n, unmerged = scene.n, (equations, tuple(range(scene.n)))
    if equations.mixed:
        kept.append("quotient: nodes of several kinds are stepped one by one")
        return unmerged
    if scene.observe or scene.sections or scene.stop or Record.EVENTS in scene.record:
        kept.append(f"quotient: the {n} oscillators are observed one by one")
        return unmerged
    # If all starts of a component differ in every cell, nothing merges: decide at once, without the search for classes.
    moved = {parts.base for axis in (*scene.axes, *scene.drawn) if (parts := NodeName.parse(axis.name))}
    all_apart = any(len(set(states)) == n for name, states in scene.initial.items() if name not in moved)
    colours = [] if all_apart else _colours(scene)
    different = len(set(colours)) or n
    if different == n:
        if n > 1:
            kept.append(f"quotient: the {n} oscillators start from different states")
        return unmerged
    try:
        reduced, classes = quotient(equations, colours)
    except NoQuotient as problem:
        kept.append(str(problem))
        return unmerged
    starts = f"quotient: {n} oscillators with {different} different starts"
    if reduced.n == n:
        kept.append(f"{starts} are stepped one by one: the links do not treat equal starts alike")
        return unmerged
    if reduced.n == 1:
        starts = f"quotient: {n} oscillators that all start equal"
    skipped.append(f"{starts} are stepped as {reduced.n}; the links treat equal starts alike, so they stay equal")
    return reduced, classes


def _colours(scene: Scene) -> list[Hashable]:
    """Return a colour for each oscillator; two colours are equal if start and parameters are equal in every cell."""
    drawn = {axis.name for axis in scene.drawn}
    swept = {axis.name: axis.values for axis in (*scene.axes, *scene.drawn)}
    colours: list[Hashable] = []
    for i in range(scene.n):
        colour: list[Hashable] = []
        starts = {f"{component}_{i + 1}": values[i] for component, values in scene.initial.items()}
        parameters = {f"{name}_{i + 1}": scene.parameters[f"{name}_{i + 1}"] for name in scene.equations.varied}
        for name, value in (starts | parameters).items():
            row = swept.get(name, (value,))
            if min(row) == max(row):
                colour.append(row[0])
            else:  # on a grid two axes differ in some cell
                colour.append(row if scene.zipped or name in drawn else name)
        colours.append(tuple(colour))
    return colours


def explain(reduction: ReducedScene) -> str:
    """Return a text that lists the parts of a scene that are left out and the reasons, and the parts that remain."""
    # The text also lists the parts of a run that a cell may skip.
    scene, records = reduction.scene, reduction.recording.records
    # List terms and records that the scene does not have.
    absent = []
    if not scene.forced:
        absent.append("forcing: time does not occur in the equations; no time terms")
    if not scene.equations.link_count:
        absent.append("coupling: no links")
    if "sync_error" not in scene.record:
        absent.append("synchronisation error: not recorded")
    elif "sync_error" not in records:
        absent.append("synchronisation error: 0 between oscillators that are stepped as one")
    if "section" not in scene.record:
        absent.append("section: not recorded; no search for crossings")
    if "trajectory" not in scene.record:
        absent.append("trajectory: not recorded; no samples")
    if not records:
        absent.append("dense output: no record needs states inside a step")
    periodic = reduction.jumps and scene.drive.frequency is not None
    parts = {
        "left out": (*reduction.skipped, *absent),
        "not left out": reduction.kept,
        "in a cell, while it runs": (DIVERGED, PERIODIC) if periodic else (DIVERGED,),
    }
    lines = []
    for title, sentences in parts.items():
        lines += [title, *(f"  {sentence}" for sentence in sentences or ("nothing",))]
    return "\n".join(lines)
