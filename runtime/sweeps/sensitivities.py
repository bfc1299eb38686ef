"""Exact derivatives of runs by parameters and initial states: the lifted network is run beside the network.

The lifted network (`models/dynamics/lift`) has nodes (x, d) with d' = r_x d + r_p.  A row of it is a cell and one name.
Every deviation is scaled by its parameter, or by the size of the start, so that step control weighs it like a state.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import PointColumn, SpanColumn, SumColumn, Tally
from synchain.codegen.kernels.observable_functions import Recording, count_of, with_rows
from synchain.codegen.kernels.sweep_kernel import SweepKernel, emit
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.lift import Lift, lifted
from synchain.models.dynamics.observable import (
    ENERGY,
    AtNode,
    NodeMean,
    NodeSum,
    Observable,
    ObservedWindow,
    Rate,
    Reduction,
)
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics import calculus
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.jumps import JUMPING, KINKED, discontinuity
from synchain.models.scenes.observables import has_own_energy
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.drive_times import drive_parameters, periods
from ..cells.observable_arrays import over_window
from ..cells.plan import CellRows, Planner
from ..engines.choice import Ladder, chosen_for_rows, first_steps
from ..engines.ladder_engine import run_rows
from ..engines.step_control import DIRECTIONS, control_array

# Largest change of a state, relative to its size, by a relative change rtol of a parameter: a choice. Beyond it the
# state itself has no three digits.
LOST = 1e-3

# Growth over the second half of a run that counts as exponential: a fifth power of time grows as much.
EXPONENTIAL = 32.0
ROOM = 64  # extremes of a cell that the buffers hold at first: a choice
# How the rate of a value passes zero at its extremes, and which of them is the observable.
EXTREMES = {ObservedWindow.MAXIMUM: ("falling", np.argmax), ObservedWindow.MINIMUM: ("rising", np.argmin)}


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """What the kernel of a lifted network records for the derivative of one observable."""

    window: ObservedWindow
    tallied: tuple[sp.Expr, ...]
    sections: tuple[tuple[sp.Expr, ...], ...]  # of an extreme: the rate of the value, the value and its deviation
    rows: int  # number of values, one for each node or a single one

    @classmethod
    def of(
        cls, name: str, observable: Observable, equations: Equations, deviations: Mapping[str, sp.Expr]
    ) -> Sensitivity:
        """Return the records of an observable; raise ValueError if it has no derivative."""
        window, value = observable.window, observable.value
        what = f"gradient: observable {name!r}"
        part = discontinuity([value], value.free_symbols)
        if part is not None:
            raise ValueError(f"{what}: found {part}, which jumps; expected a continuous value; leave it out")
        change, per_node = _change(what, value, deviations), with_rows(equations, value)
        rows = equations.n if per_node else 1
        if window not in EXTREMES:
            # The variance of f along df: twice the covariance of f and df, from the variances of f + df and f - df.
            both = (value + change, value - change)
            return cls(window, both if window == ObservedWindow.VARIANCE else (change,), (), rows)
        if value.has(*JUMPING, *KINKED, sp.Piecewise, Rate):
            raise ValueError(
                f"{what}: found the {window} of a value with kinks or rates; expected a smooth function of the states; "
                "leave it out, or observe its square"
            )
        # d/dt of the value passes zero at an extreme; the derivative by a parameter is that of the value there.
        states = {*equations.components, *equations.state}
        moving = {name: Rate(sp.Symbol(name, real=True)) for name in states} | {TIME.name: sp.S.One}
        parts = (_change(what, value, moving), value, change)
        sections = tuple(tuple(AtNode(e, k + 1) for e in parts) for k in range(rows)) if per_node else (parts,)
        return cls(window, (value, change), sections, rows)

    def derivative(self, length: np.ndarray, tallies: list[np.ndarray], points: list[np.ndarray]) -> np.ndarray:
        """Return the derivative (runs, rows) of the observable."""
        # Shapes: length (runs, 1), tallies (runs, rows, len(Tally)) each, points (runs, points, 2) of each section.
        if self.window == ObservedWindow.VARIANCE:
            more, less = (over_window(self.window, part, length) for part in tallies)
            return np.asarray(0.5 * (more - less))
        if self.window not in EXTREMES:
            return over_window(self.window, tallies[0], length)
        # The extreme is one of the section points, or an end of the window.
        _, choose = EXTREMES[self.window]
        value, change = tallies
        found = np.empty(value.shape[:2])
        for k, inside in enumerate(points):
            ends = np.stack([part[:, k, [Tally.FIRST, Tally.LATEST]] for part in (value, change)], axis=-1)
            candidates = np.concatenate([ends, inside], axis=1)
            worst = -math.inf if choose is np.argmax else math.inf
            best = choose(np.where(np.isnan(candidates[:, :, 0]), worst, candidates[:, :, 0]), axis=1)
            found[:, k] = candidates[np.arange(len(candidates)), best, 1]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivities:
    """The lifted network of a scene with its kernel."""

    scene: Scene
    planner: Planner  # lays out the rows of the network
    names: tuple[str, ...]
    lift: Lift
    ladder: Ladder  # tolerances and first steps of the lifted network
    observables: dict[str, Sensitivity]
    source: SweepKernel
    kernel: Kernel
    control: np.ndarray
    times: np.ndarray  # sample times in the unit of the scene; half the time of the run and its end are among them
    wanted: np.ndarray  # indices of the sample times of the scene

    @classmethod
    def of(cls, scene: Scene, planner: Planner, names: tuple[str, ...]) -> Sensitivities:
        """Lift the equations of a planner; raise ValueError for derivatives that do not exist."""
        equations = planner.equations
        parameters = tuple(name for name in names if name in planner.slots)
        _check(scene, equations, parameters)
        lift = lifted(equations, parameters)
        deviations = _deviations(equations, lift)
        observables = {
            name: Sensitivity.of(name, observable, equations, deviations) for name, observable in scene.observe.items()
        }
        if observables and any(o.value.has(ENERGY) for o in scene.observe.values()) and not has_own_energy(scene.model):
            raise ValueError("gradient: found the energy of the network among the observables; expected its expression")
        end = scene.transient + scene.window
        wanted = np.array([end])
        if scene.record:
            wanted = np.array(scene.t_eval or scene.transient + scene.window * np.linspace(0.0, 1.0, scene.samples))
        times = np.union1d(wanted, [0.5 * end, end])
        directions = [DIRECTIONS[EXTREMES[o.window][0]] for o in observables.values() for _ in o.sections]
        first = directions[0] if directions else 0.0
        control = control_array(scene.rtol, scene.atol, math.inf, scene.max_steps, first)
        recording = Recording(
            records=("trajectory",),
            own_times=True,
            observed=tuple(value for o in observables.values() for value in o.tallied),
            sections=tuple(section for o in observables.values() for section in o.sections),
        )
        # One integrator for all values of the parameters.
        rows, _ = _lifted_rows(planner, lift, names, planner.rows(np.zeros(1, dtype=int)))
        auto = scene.replace(integrator="auto")
        method, ladder = chosen_for_rows(auto, lift.equations, rows), Ladder(auto, lift.equations)
        source, control = emit(lift.equations, method, recording), np.concatenate([control, directions[1:], times])
        indices = np.searchsorted(times, wanted)
        return cls(scene, planner, names, lift, ladder, observables, source, load(source), control, times, indices)

    def of_rows(
        self, rows: CellRows, ran: np.ndarray
    ) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
        """Return the derivatives of states (cells, times, dimension) and of observables (cells, rows), by name."""
        # `ran` (cells,): whether the cell finished without deviations. Raises ValueError if a derivative grows so fast
        # that the states themselves have no digits.
        lift, shape = self.lift, (len(rows), len(self.names))
        lifted_rows, scales = _lifted_rows(self.planner, lift, self.names, rows)
        buffers = self._run(lifted_rows)
        samples = buffers.samples.reshape(*shape, len(self.times), -1)
        self._check_growth(buffers, samples, ran)
        of_states = samples[:, :, self.wanted][..., list(lift.deviations)] / scales[:, :, None, None]
        of_observables = {
            name: values.reshape(*shape, -1) / scales[:, :, None] for name, values in self._observed(buffers)
        }
        return (
            {name: of_states[:, k] for k, name in enumerate(self.names)},
            {o: {name: v[:, k] for k, name in enumerate(self.names)} for o, v in of_observables.items()},
        )

    def _run(self, rows: CellRows, room: int = ROOM) -> Buffers:
        """Run the lifted network; with larger buffers if there are more extremes."""
        sizes, control = self.source.dimensions, self.control.copy()
        tolerances = self.ladder.tolerances(rows)
        control[0], control[1] = (column.min() for column in tolerances)
        if self.source.method.implicit:
            spans = rows.spans.copy()
            spans[:, SpanColumn.FIRST_STEP] = first_steps(self.ladder.templates, rows)
            rows = replace(rows, spans=spans)
        tallies = 1 + len(Tally) * sizes.observed if sizes.observed else 0
        room = room if sizes.sections else 0
        buffers = Buffers.empty(len(rows), sizes.dimension, room, len(self.times), tallies, 1 + sizes.kept)
        run_rows(self.kernel, rows, control, buffers)
        return buffers if buffers.most_points <= room else self._run(rows, buffers.most_points)

    def _observed(self, buffers: Buffers) -> Iterator[tuple[str, np.ndarray]]:
        """Yield the derivative (runs, rows) of each observable, with the scale of the deviations."""
        equations, sums, points = self.lift.equations, buffers.sums, buffers.points
        length = np.where(buffers.finished, sums[:, -1 if not self.observables else len(SumColumn)], np.nan)[:, None]
        tallies = sums[:, len(SumColumn) + 1 :].reshape(len(sums), -1, len(Tally))
        first = section = 0
        for name, sensitivity in self.observables.items():
            parts, inside = [], []
            for value in sensitivity.tallied:
                count = count_of(equations, [value])
                part = tallies[:, first : first + count]
                parts.append(np.broadcast_to(part, (len(sums), sensitivity.rows, len(Tally))))
                first += count
            for _ in sensitivity.sections:
                belongs = points[:, :, PointColumn.STATE, None] == section
                inside.append(np.where(belongs, points[:, :, PointColumn.STATE + 1 :][:, :, :2], np.nan))
                section += 1
            values = sensitivity.derivative(length, parts, inside)
            yield name, np.where(buffers.finished[:, None], values, np.nan)

    def _check_growth(self, buffers: Buffers, samples: np.ndarray, ran: np.ndarray) -> None:
        """Raise ValueError if a small relative change of a parameter grows exponentially beyond all digits."""
        # Shapes: samples (cells, names, times, dimension), ran (cells,): whether the cell finished without deviations.
        shape, states, deviations = samples.shape[:2], list(self.lift.states), list(self.lift.deviations)
        end = buffers.end.reshape(*shape, -1)
        size = np.fmax(np.abs(end[:, :, states]).max(axis=-1), 1e-300)
        size = np.fmax(size, np.fmax.reduce(np.abs(samples[..., states]), axis=(2, 3)))
        half = np.searchsorted(self.times, 0.5 * self.times[-1])
        before = np.abs(samples[:, :, half, deviations]).max(axis=-1)
        # A deviation beyond 2^53 ends the run; it may be before half of the time.
        after = np.nan_to_num(np.abs(end[:, :, deviations]).max(axis=-1), nan=math.inf)
        lost = ran[:, None] & (self.scene.rtol * after > LOST * size) & ~(after <= EXPONENTIAL * before)
        if lost.any():
            cell, k = (int(place[0]) for place in np.nonzero(lost))
            time = float(buffers.sums[cell * shape[1] + k, SumColumn.STOPPED_AT])
            growth = after[cell, k] / size[cell, k]
            raise ValueError(
                f"gradient: found a derivative by {self.names[k]} that grows about as exp({math.log(growth) / time:.2g} t): "
                f"at t = {time:.4g} a relative change of the parameter is multiplied by {growth:.1e}; expected a motion "
                "that is not chaotic; shorten the run"
            )


def _check(scene: Scene, equations: Equations, parameters: tuple[str, ...]) -> None:
    """Raise ValueError for derivatives that do not exist."""
    if scene.stop is not None:
        raise ValueError("gradient: found a stop, whose time depends on the parameters; expected none; leave stop out")
    bases = {base_of(scene, name) for name in parameters}
    moves = sorted(bases & drive_parameters(equations))
    if moves and scene.time_unit == "period":
        raise ValueError(
            f"gradient: found {moves[0]!r}, which changes the period that counts the times; expected fixed times; "
            "set time_unit = 'time'"
        )
    symbols = {sp.Symbol(name, real=True) for name in bases}
    for rates in (*(node.rhs for node in equations.nodes), *(edge.rhs for edge in equations.edges)):
        part = discontinuity(rates, symbols)
        if part is not None:
            raise ValueError(
                f"gradient: found {part}, by which rates jump when a parameter changes; expected continuous rates; "
                "leave the parameter out, or smooth the jump"
            )


def base_of(scene: Scene, name: str) -> str:
    """Return the parameter that a name belongs to: a of a_2, k of k_1_2, or the name itself."""
    place = scene.model.single(name)
    return name if place is None else place.base


def _deviations(equations: Equations, lift: Lift) -> dict[str, sp.Expr]:
    """Return the deviation of each state and parameter by name, for the names of nodes and of the network."""
    prefix = lift.equations.state[lift.deviations[0]].removesuffix(equations.state[0])
    deviations: dict[str, sp.Expr] = {
        name: sp.Symbol(f"{prefix}{name}", real=True) for name in (*equations.components, *equations.state)
    }
    for name, seed in lift.seeds.items():
        deviations[name] = sp.Symbol(seed, real=True)
        parts = NodeName.parse(name)
        if parts is not None and parts.base in equations.varied:
            deviations[parts.base] = sp.Symbol(seed.removesuffix(name) + parts.base, real=True)
    return deviations


def _change(what: str, value: sp.Expr, changes: Mapping[str, sp.Expr]) -> sp.Expr:
    """Return the derivative of a value along changes of its symbols, which are given by name."""

    def outer(e: sp.Expr) -> Iterator[sp.Expr]:
        if e.is_Symbol or isinstance(e, Reduction | Rate):
            yield e
        else:
            for argument in e.args:
                yield from outer(argument)

    def change(part: sp.Expr) -> sp.Expr:
        if part.is_Symbol:
            return changes.get(part.name, sp.S.Zero)
        inside = _change(what, part.args[0], changes)
        if isinstance(part, AtNode):
            return AtNode(inside, part.args[1])
        if isinstance(part, NodeSum | NodeMean):
            return type(part)(inside)
        if isinstance(part, Rate):
            return Rate(inside)
        raise ValueError(f"{what}: found {part}, whose derivative jumps; expected sums and means over the nodes")

    parts = {part: sp.Dummy(real=True) for part in sorted({*outer(value)}, key=sp.default_sort_key)}
    plain = value.xreplace(parts)
    total = sp.Add(*(calculus.derivative(plain, symbol) * change(part) for part, symbol in parts.items()))
    return total.xreplace({symbol: part for part, symbol in parts.items()})


def _lifted_rows(planner: Planner, lift: Lift, names: tuple[str, ...], rows: CellRows) -> tuple[CellRows, np.ndarray]:
    """Return the rows of the lifted network, the names fastest, and the scale (cells, names) of the deviations."""
    cells, count, equations = len(rows), len(names), lift.equations
    columns = {name: k for k, name in enumerate(equations.parameters)}
    start = np.zeros((cells, count, equations.dimension))
    start[:, :, list(lift.states)] = rows.start[:, None]
    numbers = np.zeros((cells, count, len(columns)))
    for name, k in planner.slots.items():
        if name in columns:
            numbers[:, :, columns[name]] = rows.numbers[:, None, k]
    scales = np.empty((cells, count))
    sizes = np.abs(rows.start).max(axis=1)
    for k, name in enumerate(names):
        if name in planner.slots:
            scales[:, k] = np.abs(rows.numbers[:, planner.slots[name]])
        else:
            scales[:, k] = sizes
    scales[scales == 0.0] = 1.0
    for k, name in enumerate(names):
        if name in planner.slots:
            numbers[:, k, columns[lift.seeds[name]]] = scales[:, k]
        else:
            start[:, k, lift.deviations[planner.places[name]]] = scales[:, k]
    flat = numbers.reshape(cells * count, -1)
    spans = np.repeat(rows.spans, count, axis=0)
    spans[:, SpanColumn.PERIOD] = periods(equations, flat)  # a derivative by a frequency grows with time: no period
    return CellRows(start.reshape(cells * count, -1), flat, spans), scales
