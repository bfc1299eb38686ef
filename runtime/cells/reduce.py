"""What a scene does not need is not integrated: terms that are zero in every cell, oscillators that move as another does.

Every reduction is exact (see `synchain.models.dynamics.reduction`) and undone before anyone sees the result, which is that of the
whole network.  docs/skips.md lists them all, also those of the emitted text and of the kernel's driver.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import NoQuotient, fold, quotient
from synchain.models.mechanics.node_name import NodeName
from synchain.models.scenes.scene import Scene

from .buffers import Buffers
from .plan import Plan

__all__ = ["Merged", "Skip", "decide", "explain"]

DIVERGED = "diverged: the cell ends as soon as its state is out of bounds"
PERIODIC = (
    "periodic: a cell that repeats itself bit for bit from one period of the drive to a later one jumps over whole cycles, "
    "before the window always, inside it where neither section nor trajectory is recorded"
)


@dataclass(frozen=True, slots=True, eq=False)
class Merged:
    """Which oscillators were stepped as one: `states` and `places` of a Skip; `together` where all of them were."""

    states: np.ndarray
    places: np.ndarray
    together: bool

    def expand(self, buffers: Buffers) -> Buffers:
        """What the kernel wrote, for the whole network; the same arrays where nothing was merged."""
        made = self.take(buffers, self.places)
        if self.together:
            made = replace(made, sums=made.sums.copy())
            made.sums[made.counts[:, 0] != 0, :3] = 0.0  # oscillators that are one have no distance
        return made

    def take(self, buffers: Buffers, columns: np.ndarray) -> Buffers:
        """The buffers of a network whose states are these columns of another one's."""
        if len(self.states) == len(self.places):
            return buffers
        points = np.concatenate([[0], columns + 1])  # the time of the point comes first
        return replace(
            buffers,
            end=np.take(buffers.end, columns, axis=1),
            points=np.take(buffers.points, points, axis=2),
            samples=np.take(buffers.samples, columns, axis=2),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Skip:
    """What is left of a scene to integrate, and the way back.

    The kernel steps `equations` and writes `records`.  `states` are the columns of the whole network's state that start
    the reduced one, `places` the column of the reduced state in which each state of the whole network is found, `numbers`
    the columns of the whole network's parameters that are left.  `multiplicity` counts the oscillators behind each node
    where the synchronisation error needs it, else None.  `skipped` and `kept` say in sentences what was left out, and what
    not and why; `jumps` whether a cell that repeats itself may leave out whole cycles.
    """

    scene: Scene
    equations: Equations = field(repr=False)
    records: tuple[str, ...]
    states: np.ndarray = field(repr=False)
    places: np.ndarray = field(repr=False)
    numbers: np.ndarray = field(repr=False)
    multiplicity: tuple[int, ...] | None
    skipped: tuple[str, ...]
    kept: tuple[str, ...]
    jumps: bool

    def section_variable(self) -> str:
        """The state variable of the reduced network that stands for the scene's section variable."""
        whole = self.scene.equations.state.index(self.scene.section.variable)
        return self.equations.state[int(self.places[whole])]

    def cells(self, whole: Plan) -> Plan:
        """The rows of the reduced network out of those of the whole one."""
        start, numbers = whole.start, whole.numbers
        if len(self.states) < len(self.places):
            start = np.take(start, self.states, axis=1)
        if len(self.numbers) < numbers.shape[1]:
            numbers = np.take(numbers, self.numbers, axis=1)
        return replace(whole, start=start, numbers=numbers)

    @property
    def merged(self) -> Merged:
        """How the reduced network's results become those of the whole one."""
        together = "sync_error" in self.scene.record and "sync_error" not in self.records
        return Merged(self.states, self.places, together)

    def expand(self, buffers: Buffers) -> Buffers:
        """What the kernel wrote, for the whole network; the same arrays where nothing was merged."""
        return self.merged.expand(buffers)

    def contract(self, buffers: Buffers) -> Buffers:
        """The way back: the part of the whole network's results that the reduced network has."""
        return self.merged.take(buffers, self.states)


def decide(scene: Scene, skip: bool = True, fold_all: bool = False) -> Skip:
    """Find out what can be left out of a scene.

    Parameters that are 0 in every cell are folded, so that scenes that differ only in numbers share a kernel; `fold_all`
    folds all that are fixed, to their shortest decimals.  With `skip` false everything is integrated as it stands.
    """
    whole = scene.equations
    skipped: list[str] = []
    kept: list[str] = []
    equations, classes = whole, tuple(range(scene.n))
    if skip:
        equations = _fold(scene, fold_all, skipped, kept)
        equations, classes = _merge(scene, equations, skipped, kept)
        kept += _present(scene, equations)
    else:
        kept.append("everything is integrated as it stands, as asked for")
    together = max(classes) == 0 and scene.n > 1
    seen: dict[int, int] = {}
    for node, k in enumerate(classes):
        seen.setdefault(k, node)
    first = [seen[k] for k in range(equations.n)]
    components = range(whole.dimension // scene.n)
    alone = np.arange(whole.dimension)
    return Skip(
        scene,
        equations,
        tuple(r for r in scene.record if not (together and r == "sync_error")),
        alone if whole.mixed else np.array([c * scene.n + i for c in components for i in first]),
        alone if whole.mixed else np.array([c * equations.n + k for c in components for k in classes]),
        np.array([whole.parameters.index(_column(name, equations, first)) for name in equations.parameters], dtype=int),
        _multiplicity(scene, classes),
        tuple(skipped),
        tuple(kept),
        skip,
    )


def _column(name: str, equations: Equations, first: list[int]) -> str:
    """The name in the whole network of a parameter of the reduced one, whose node k stands for node first[k]."""
    parts = NodeName.parse(name)
    return str(NodeName(parts.base, first[parts.index])) if parts and parts.base in equations.varied else name


def _fixed(scene: Scene) -> dict[str, float]:
    """The parameters with one value in every cell."""
    swept = {axis.name: axis.values for axis in scene.axes}
    values = {name: swept.get(name, (scene.parameters[name],)) for name in scene.equations.parameters}
    return {name: found[0] for name, found in values.items() if min(found) == max(found)}


def _fold(scene: Scene, fold_all: bool, skipped: list[str], kept: list[str]) -> Equations:
    """Fold parameters one after the other, and say what each of them took along."""
    equations, fixed = scene.equations, _fixed(scene)
    for name, value in fixed.items():
        if name not in equations.parameters or (value != 0.0 and not fold_all):
            continue
        try:
            made = fold(equations, {name: Fraction(repr(value))})
        except ValueError as problem:
            kept.append(str(problem))
            continue
        skipped.append(_consequence(equations, made, name, value))
        equations = made
    return equations


def _present(scene: Scene, equations: Equations) -> list[str]:
    """What has to be integrated, in words."""
    found = ["forcing: time occurs in the equations"] if any(node.forced for node in equations.nodes) else []
    if equations.links:
        fixed = _fixed(scene)
        names = [*dict.fromkeys(symbol.name for edge in equations.edges for symbol in edge.parameters)]
        strengths = [f"{name} = {fixed[name]:g}" if name in fixed else f"{name} is swept" for name in names]
        found.append(f"coupling: {', '.join([f'{len(equations.links)} links', *strengths])}")
    return found


def _consequence(before: Equations, after: Equations, name: str, value: float) -> str:
    """What a folded parameter has taken along, in words."""
    gone = [p for p in before.parameters if p not in after.parameters and p != name]
    too = f" together with {', '.join(gone)}" if gone else ""
    if before.node.forced and not after.node.forced:
        return f"forcing: {name} = {value:g} in every cell, left out{too}; no time terms"
    if before.links and not after.links:
        return f"coupling: {name} = {value:g} in every cell, left out{too}; no links"
    return f"parameter: {name} = {value:g} in every cell, now a number of the equations{too and f'; left out{too}'}"


def _merge(
    scene: Scene, equations: Equations, skipped: list[str], kept: list[str]
) -> tuple[Equations, tuple[int, ...]]:
    """Make one node of oscillators that move as one in every cell; returns the class of each oscillator."""
    n, alone = scene.n, tuple(range(scene.n))
    if equations.mixed:
        kept.append("quotient: nodes of several kinds are stepped one by one")
        return equations, alone
    colours = _colours(scene)
    different = len(set(colours))
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


def _colours(scene: Scene) -> list[Hashable]:
    """For each oscillator its start and its own parameters in all cells; equal where these are equal in every cell."""
    swept = {axis.name: axis.values for axis in scene.axes}
    colours: list[Hashable] = []
    for i in range(scene.n):
        own: list[Hashable] = []
        starts = {f"{component}_{i + 1}": values[i] for component, values in scene.initial.items()}
        numbers = {f"{name}_{i + 1}": scene.parameters[f"{name}_{i + 1}"] for name in scene.varied}
        for name, value in (starts | numbers).items():
            found = swept.get(name, (value,))
            if min(found) == max(found):
                own.append(found[0])
            else:
                own.append(found if scene.zipped else name)  # on a grid two axes differ in some cell
        colours.append(tuple(own))
    return colours


def _multiplicity(scene: Scene, classes: tuple[int, ...]) -> tuple[int, ...] | None:
    """Oscillators in each class where the synchronisation error must count them, else None.

    It is the sum of the distances from the first oscillator, whose own class does not contribute.
    """
    sizes = Counter(classes)
    if "sync_error" not in scene.record or all(size == 1 for k, size in sizes.items() if k != 0):
        return None
    return tuple(sizes[k] for k in range(len(sizes)))


def explain(chosen: Skip) -> str:
    """What is left out of a scene and why, what is not, and what may be left out of a cell at run time."""
    parts = (
        ("left out", (*chosen.skipped, *_unwritten(chosen))),
        ("not left out", chosen.kept),
        (
            "in a cell, while it runs",
            (DIVERGED, PERIODIC) if chosen.jumps and chosen.scene.drive.frequency is not None else (DIVERGED,),
        ),
    )
    return "\n".join(
        "\n".join([title, *(f"  {sentence}" for sentence in sentences or ("nothing",))]) for title, sentences in parts
    )


def _unwritten(chosen: Skip) -> list[str]:
    """What the text of the kernel does not have, because the scene never had it."""
    scene, found = chosen.scene, []
    if not scene.forced:
        found.append("forcing: time does not occur in the equations; no time terms")
    if not scene.equations.links:
        found.append("coupling: no links")
    if "sync_error" not in scene.record:
        found.append("synchronisation error: not recorded")
    elif "sync_error" not in chosen.records:
        found.append("synchronisation error: 0 between oscillators that are stepped as one")
    if "section" not in scene.record:
        found.append("section: not recorded; no search for crossings")
    if "trajectory" not in scene.record:
        found.append("trajectory: not recorded; no samples")
    if not chosen.records:
        found.append("dense output: no record needs states inside a step")
    return found
