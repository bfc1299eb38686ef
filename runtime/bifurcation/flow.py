"""The flow of a network over some times, with its exact derivatives by the state and by parameters.

`LiftedFlow` integrates the lifted network (`synchain.models.dynamics.lift`): each lane of the kernel carries the state and
one deviation, so that the columns of all propagators of all segments are cells of one call.  `ContactFlow` integrates
set-valued friction with the kernel of modes, which multiplies deviations by saltation matrices at stick and slip.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np
import sympy as sp
from scipy.sparse.linalg import spsolve

from synchain.codegen.driver.columns import Control, SpanColumn
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import LARGEST_UNROLLED_LIFT
from synchain.codegen.machine_code.compile import load
from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.lift import Lift, lifted
from synchain.models.dynamics.variational import PHASE, clock_shifted, network_variation
from synchain.models.mechanics.components import TIME
from synchain.models.scenes.scene import Scene

from ..cells.drive_times import longest_steps, periods
from ..cells.initial_modes import with_modes
from ..cells.initial_row_modes import row_modes
from ..cells.plan import FIRST_STEP, CellRows
from ..engines.choice import chosen_for_modes, chosen_for_rows
from ..engines.job import JobSpec, RowsJob, RowsSpec
from ..engines.step_control import control_array
from ..stability.motion import OrbitIntegrator, RateFunctions, rates_of
from ..stability.variational_integrator import VariationalIntegrator
from ..support.status import Status
from .linearised import Linearised

TOLERANCE = 1e-12  # relative tolerance of the integration (a choice)
# The absolute tolerance is TOLERANCE times LEAST times the scale of the component with the least scale (a choice).
LEAST = 1e-3

STICKS = 10.0  # a sliding velocity below this many integration errors is zero (a choice)


_lift, _contact_variation = lru_cache(maxsize=32)(lifted), lru_cache(maxsize=32)(network_variation)


class Image(NamedTuple):
    """The state after a time, and its derivatives, segment by segment."""

    states: np.ndarray  # (m, n)
    propagators: np.ndarray  # (m, n, n): derivative by the state at the beginning
    columns: np.ndarray  # (m, n, q): derivative by each parameter at equal time


class Flow(Protocol):
    """The flow of some equations; a state has `size` numbers, without slip states."""

    equations: Equations

    size: int
    steps: float  # mean length of a step of the last call

    def drive_period(self, values: Mapping[str, float]) -> float:
        """Return the period of the drive; 0 without one."""

    def rates(self, values: Mapping[str, float], states: np.ndarray) -> np.ndarray:
        """Return the rates (m, n) at the beginning of a period of the drive."""

    def motion(self, values: Mapping[str, float], state: np.ndarray) -> tuple[OrbitIntegrator, RateFunctions]:
        """Return the motion from a state, step by step, and the functions of its states that `motion.path` needs."""

    def advance(self, values: Mapping[str, float], states: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the states (m, n) after the times (m,), from states (m, n) at the beginning of a period of the drive."""

    def linearise(self, values: Mapping[str, float], states: np.ndarray, times: np.ndarray, scale: np.ndarray) -> Image:
        """Return the states after the times with their derivatives; `scale` (n,) is the size of a deviation."""


def flow_of(scene: Scene, equations: Equations, names: Sequence[str], state: np.ndarray, begin: float = 0.0) -> Flow:
    """Return the flow of equations that belong to a scene, with its derivatives by some parameters.

    The kernel is chosen by the motion at a state (n,).  Under events the flow may begin at another time than 0.
    """
    present = tuple(name for name in names if name in equations.parameters)
    if equations.sticks:
        shifted = clock_shifted(equations) if begin else equations
        return ContactFlow(scene, shifted, present, tuple(names), equations.continuous_dimension, begin)
    # The network at the beginning of a period of the drive.
    still = equations
    if equations.forced:
        begin_at: dict[sp.Expr, sp.Expr] = {TIME: sp.S.Zero}
        still = equations.map_templates(
            lambda node: node.map(lambda e: e.xreplace(begin_at)), lambda edge: edge.map(lambda e: e.xreplace(begin_at))
        )
    network = Linearised.of(still, dict.fromkeys(still.parameters, 1.0))
    # The integrator for the motion from the state.
    scene, lift, at = scene.replace(rtol=TOLERANCE, atol=None), _lift(equations, present), state[None].astype(float)
    seeds = np.zeros((1, len(present)))
    rows = _rows(lift, _row(lift, scene.parameters), present, at, np.ones_like(at), seeds, np.ones(1))
    job = _compiled(lift.equations, chosen_for_rows(scene, lift.equations, rows), scene.max_steps)
    return LiftedFlow(equations, lift, job, present, tuple(names), equations.dimension, network)


@dataclass(slots=True)
class LiftedFlow:
    """The flow of a network with smooth rates."""

    equations: Equations
    lift: Lift
    job: RowsJob
    present: tuple[str, ...]  # the parameters among `names` that the equations contain
    names: tuple[str, ...]
    size: int
    network: Linearised  # the equations at the beginning of a period of the drive
    steps: float = math.nan
    last: tuple[tuple[float, ...], Linearised, CellRows, float] | None = field(default=None, repr=False)

    def at(self, values: Mapping[str, float]) -> tuple[Linearised, CellRows, float]:
        """Return equations, a row of a unit of time and the drive's period at some parameters; the last ones are kept."""
        key = tuple(values[name] for name in self.equations.parameters)
        if self.last is None or self.last[0] != key:
            period = float(periods(self.equations, np.array([key]))[0])
            self.last = key, self.network.at(values), _row(self.lift, values), period
        return self.last[1:]

    def drive_period(self, values: Mapping[str, float]) -> float:
        """Return the period of the drive."""
        return self.at(values)[2]

    def rates(self, values: Mapping[str, float], states: np.ndarray) -> np.ndarray:
        """Evaluate the templates, and solve with the mass matrix if there is one."""
        network, *_ = self.at(values)
        rates = [network.rates(state) for state in states]
        if not network.mass_templates:
            return np.array(rates)
        return np.array([spsolve(network.mass(state), r) for state, r in zip(states, rates, strict=True)])

    def motion(self, values: Mapping[str, float], state: np.ndarray) -> tuple[OrbitIntegrator, RateFunctions]:
        """Return the motion from a state, and its rates."""
        network, *_ = self.at(values)

        def sizes(x: np.ndarray) -> np.ndarray:
            terms, mass = network.term_sizes(x), network.mass(x)
            return terms if mass is None else np.abs(spsolve(mass, terms))

        return Walker(self, values, state), RateFunctions(
            lambda x: self.rates(values, x[None])[0], sizes, periods_of_states(self.equations), self.equations.sticks
        )

    def advance(self, values: Mapping[str, float], states: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Integrate the states without deviations."""
        return self._run(
            values, states, np.zeros_like(states), np.zeros((len(states), len(self.present))), times, np.abs(states)
        )[0]

    def linearise(self, values: Mapping[str, float], states: np.ndarray, times: np.ndarray, scale: np.ndarray) -> Image:
        """Integrate a lane for each column of each propagator, and one for each parameter."""
        (m, n), q = states.shape, len(self.present)
        # A deviation of the size of the motion, so that all tolerances are relative to the same scale.
        sizes = np.append(scale, [abs(values[name]) or 1.0 for name in self.present])
        lanes = np.zeros((m, n + q, n + q))
        lanes[:, np.arange(n + q), np.arange(n + q)] = sizes
        lanes = lanes.reshape(m * (n + q), n + q)
        both = self._run(values, states.repeat(n + q, axis=0), lanes[:, :n], lanes[:, n:], times.repeat(n + q), scale)
        images, moved = (part.reshape(m, n + q, n) for part in both)
        matrices = (moved / sizes[:, None]).transpose(0, 2, 1)
        columns = np.zeros((m, n, len(self.names)))
        for k, name in enumerate(self.present):
            columns[:, :, self.names.index(name)] = matrices[:, :, n + k]
        return Image(images[:, 0], matrices[:, :, :n], columns)

    def _run(
        self,
        values: Mapping[str, float],
        states: np.ndarray,
        deviations: np.ndarray,
        seeds: np.ndarray,
        times: np.ndarray,
        scale: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Integrate rows of states, deviations and seeds; return the states and the deviations."""
        rows = _rows(self.lift, self.at(values)[1], self.present, states, deviations, seeds, times)
        self.job.control[Control.ATOL] = LEAST * TOLERANCE * float(scale[scale > 0.0].min(initial=1.0))
        buffers = self.job.run(rows)
        failed = buffers.status != Status.FINISHED
        if failed.any():
            status = Status(int(buffers.status[failed.argmax()]))
            raise FloatingPointError(f"the motion cannot be integrated: {status.message}")
        self.steps = float(times.sum() / max(1, int(buffers.steps.sum())))
        return buffers.end[:, self.lift.states], buffers.end[:, self.lift.deviations]


class Walker:
    """One motion of a lifted network that advances step by step."""

    def __init__(self, flow: LiftedFlow, values: Mapping[str, float], state: np.ndarray) -> None:
        self.flow, self.values, self.state, self.steps = flow, values, state[None], 0
        self.control = flow.job.control

    def advance(self, length: float) -> None:
        """Integrate over a length of time."""
        self.state = self.flow.advance(self.values, self.state, np.full(1, length))
        self.steps += max(1, round(length / self.flow.steps))


def _row(lift: Lift, values: Mapping[str, float]) -> CellRows:
    """Return a row of a lifted network over a unit of time, with its parameters and the times of its drive."""
    equations = lift.equations
    numbers = np.array([[float(values.get(name, 0.0)) for name in equations.parameters]])
    spans = np.zeros((1, len(SpanColumn)))
    spans[:, SpanColumn.END], spans[:, SpanColumn.FIRST_STEP] = 1.0, FIRST_STEP
    spans[:, SpanColumn.LOOK], spans[:, SpanColumn.LONGEST] = math.inf, math.inf
    if equations.forced:
        spans[:, SpanColumn.PERIOD] = periods(equations, numbers)
        spans[:, SpanColumn.LONGEST] = longest_steps(equations, numbers, np.ones(1))
    return CellRows(np.zeros((1, equations.dimension)), numbers, spans)


def _rows(
    lift: Lift,
    row: CellRows,
    names: Sequence[str],
    states: np.ndarray,
    deviations: np.ndarray,
    seeds: np.ndarray,
    times: np.ndarray,
) -> CellRows:
    """Lay out rows of a lifted network like a row. Shapes: states, deviations (k, n), seeds (k, q), times (k,)."""
    start, numbers, spans = (np.repeat(each, len(states), axis=0) for each in (row.start, row.numbers, row.spans))
    start[:, lift.states], start[:, lift.deviations] = states, deviations
    for name, column in zip(names, seeds.T, strict=True):
        numbers[:, lift.equations.parameters.index(lift.seeds[name])] = column
    spans[:, SpanColumn.END], spans[:, SpanColumn.FIRST_STEP] = times, FIRST_STEP * times
    return CellRows(start, numbers, spans)


@lru_cache(maxsize=32)
def _compiled(equations: Equations, method: Integrator, max_steps: int) -> RowsJob:
    """Return the job of a lifted network."""
    control = control_array(TOLERANCE, LEAST * TOLERANCE, math.inf, max_steps, jumps=False)
    spec = RowsSpec(equations, method, control, Recording(()), LARGEST_UNROLLED_LIFT)
    source = spec.source()
    return spec.job(JobSpec.of(spec, source), load(source))


@dataclass(slots=True)
class ContactFlow:
    """The flow of a network with set-valued friction; the slip states follow from the velocities and the loads."""

    scene: Scene
    equations: Equations
    present: tuple[str, ...]  # the parameters among `names` that the equations contain
    names: tuple[str, ...]
    size: int
    begin: float = 0.0  # time of the drive at which the flow begins
    steps: float = math.nan
    method: Integrator | None = field(default=None, repr=False)

    def _numbers(self, values: Mapping[str, float], rows: int = 1) -> np.ndarray:
        """Return the parameters (rows, parameters) of the equations."""
        known = {**values, PHASE.name: self.begin}
        return np.tile([known[name] for name in self.equations.parameters], (rows, 1))

    def drive_period(self, values: Mapping[str, float]) -> float:
        """Return the period of the drive."""
        return float(periods(self.equations, self._numbers(values))[0])

    def rates(self, values: Mapping[str, float], states: np.ndarray) -> np.ndarray:
        """Evaluate the rates with the slip states that belong to the states."""
        rates = self._functions(values)
        return np.array([rates.values(state)[: self.size] for state in self._with_slips(values, states)])

    def motion(self, values: Mapping[str, float], state: np.ndarray) -> tuple[OrbitIntegrator, RateFunctions]:
        """Return the motion from a state with its slip states, which belong to the states of the motion."""
        full = self._with_slips(values, state[None]) if len(state) == self.size else state[None]
        integrator = self._integrator(values, full)
        integrator.control[Control.ATOL] = (
            LEAST * TOLERANCE * min(float(np.abs(full[:, : self.size]).max()) or 1.0, 1.0)
        )
        return integrator, self._functions(values)

    def _integrator(self, values: Mapping[str, float], states: np.ndarray) -> VariationalIntegrator:
        """Return an integrator from states with slip states, with all deviations."""
        variation, none = _contact_variation(self.equations, self.present), np.zeros((0, self.size + len(self.present)))
        numbers = self._numbers(values, len(states))
        if self.method is None:
            self.method = chosen_for_modes(self.scene, variation, states, numbers, none)
        integrator = VariationalIntegrator.make(self.scene, variation, states, numbers, none, 1, method=self.method)
        integrator.observes = True  # single periods are too short for a warning of short steps
        if any(p in self.present for p in _of_drive(self.equations)):
            integrator.period = np.zeros(len(states))  # the derivative by the frequency of a drive grows with time
        integrator.control[Control.RTOL] = TOLERANCE
        return integrator

    def _functions(self, values: Mapping[str, float]) -> RateFunctions:
        return _contact_rates(self.equations, tuple(self._numbers(values)[0]))

    def _with_slips(self, values: Mapping[str, float], states: np.ndarray) -> np.ndarray:
        """Return states with slip states; a velocity that differs from the ground's by rounding is the ground's."""
        n = self.equations.n
        numbers = self._numbers(values, len(states))
        modes = np.zeros((len(states), self.equations.dimension - self.size))
        if self.equations.has_rows:
            slack = STICKS * TOLERANCE * float(np.abs(states).max())
            try:
                return row_modes(self.equations, np.hstack([states, modes]), numbers, slack)
            except ValueError as problem:  # Newton's method looks behind a stop or a guard
                raise ArithmeticError(str(problem)) from None
        states, grounds = states.copy(), _grounds(self.equations)(*numbers[0])
        velocities = states[:, n:]
        speeds = np.maximum(np.abs(velocities).max(axis=0), np.abs(grounds))
        near = np.abs(velocities - grounds) <= STICKS * TOLERANCE * (speeds + np.abs(states[:, :n]).max(axis=0))
        velocities[near] = np.broadcast_to(grounds, velocities.shape)[near]
        return with_modes(self.equations, np.hstack([states, modes]), numbers)

    def advance(self, values: Mapping[str, float], states: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Integrate the states; the deviations come along."""
        return self.linearise(values, states, times, np.abs(states).max(axis=0)).states

    def linearise(self, values: Mapping[str, float], states: np.ndarray, times: np.ndarray, scale: np.ndarray) -> Image:
        """Integrate each segment with all its deviations."""
        (m, n), q = states.shape, len(self.present)
        integrator = self._integrator(values, self._with_slips(values, states))
        columns = np.eye(n + q)
        relative = q > 0 and not self.equations.has_rows
        if relative:  # velocities relative to the ground
            grounds = _ground_slopes(self.equations, self.present)(*integrator.parameter_values[0])
            columns[n // 2 : n, n:] -= grounds
        integrator.control[Control.ATOL] = LEAST * TOLERANCE * float(scale[scale > 0.0].min(initial=1.0))
        lengths = np.linalg.norm(columns, axis=0)
        integrator.set_deviations(np.tile(columns / lengths, (m, 1, 1)))
        growth = integrator.advance(times)
        with np.errstate(all="ignore"):  # over a long transient deviations leave the range of numbers
            matrices = integrator.deviations * (np.exp(growth) * lengths)[:, None, :]
        if relative:
            matrices[:, n // 2 : n, n:] += grounds
        self.steps = float(times.sum() / max(1, integrator.steps))
        moved = np.zeros((m, n, len(self.names)))
        moved[:, :, [self.names.index(name) for name in self.present]] = matrices[:, :n, n:]
        return Image(integrator.state[:, :n], matrices[:, :n, :n], moved)


@lru_cache(maxsize=32)
def _contact_rates(equations: Equations, numbers: tuple[float, ...]) -> RateFunctions:
    return rates_of(equations, dict(zip(equations.parameters, numbers, strict=True)))


@lru_cache(maxsize=32)
def _grounds(equations: Equations) -> Callable[..., np.ndarray]:
    """Return the velocities (n,) of the grounds as a function of all parameters."""
    targets = [event.target for i in range(equations.n) for event in equations.events_at(i)]
    function = sp.lambdify([sp.Symbol(p, real=True) for p in equations.parameters], targets, "numpy")
    return lambda *values: np.array(function(*values), dtype=float)


@lru_cache(maxsize=32)
def _ground_slopes(equations: Equations, names: tuple[str, ...]) -> Callable[..., np.ndarray]:
    """Return the derivatives (n, q) of the velocities of the grounds by some parameters, as a function of all parameters."""
    targets = [event.target for i in range(equations.n) for event in equations.events_at(i)]
    slopes = [[target.diff(sp.Symbol(name, real=True)) for name in names] for target in targets]
    function = sp.lambdify([sp.Symbol(p, real=True) for p in equations.parameters], slopes, "numpy")
    return lambda *values: np.array(function(*values), dtype=float).reshape(len(targets), len(names))


def _of_drive(equations: Equations) -> set[str]:
    """Return the names of the parameters in the frequency of the drive."""
    waves = (part for e in equations.node.rhs for part in e.atoms(sp.Function) if part.has(TIME))
    return {s.name for part in waves for s in part.free_symbols}
