"""Synchronous orbits with all their modes: settling on an attractor, then advancing by blocks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Control
from synchain.codegen.integrators import Integrator
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.mode_inertia import inertia_of_modes
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import Variation, mode
from synchain.models.graphs.families import topology
from synchain.models.mechanics.contact import SLIP
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from ..engines.choice import chosen_for_modes
from .averages import BATCHES, SLACK, TRIED, error_of_steps
from .interpolation import Interpolation, exact_interpolation, lines_of, strength_interpolation
from .motion import RateFunctions, Turns, above, extent_of, rates_of, turns_of
from .variational_integrator import NO_TRACKS, Deviations, VariationalIntegrator

NODES, PARTS = (13, 21, 29, 37, 61), (1, 2, 4, 8, 16)
"""Nodes of a panel of strengths, and panels on each side, that are tried; with three for comparison they fill registers."""

BLOCKS, FREE_BLOCKS = (8.0, 4.0, 2.0, 1.0), (1.0, 0.5, 0.25, 0.125)
"""Lengths of a block that are tried, in periods of the drive and in turns of undriven motion."""

STEP, BLOCK = 200, 60_000
"""Multiplications that take as long as a step of a deviation, and as a block without any."""

BESIDE = 42
"""Nodes that cost a strength as much as what else is done for it in a block."""

FAR = 300.0
"""Logarithm of the size beyond which a factor of a propagator is kept apart; numbers end at 745."""

ALLOWED = 1e-12
"""Error of an interpolation that is allowed however tight the tolerance is."""
HOPELESS, FURTHER = 0.1, 1.45
"""An error that so many times more nodes do not mend."""

LEG, LANDINGS = 4.0, 5_000
"""Shortest block in units that is longer than most legs, and multiplications that take as long as the landings of a unit."""

TRIAL = 8
"""Blocks on which an interpolation is tried."""

OF_EXTENT = 1.0
"""Largest absolute tolerance, relative to the relative one times the least extent of a component that moves."""

LOOKS, STROBES = 8, 16
"""States of a period of the drive from which the extent of a motion is seen, and periods before them."""

LOOSENESS = 10.0
"""Ratio of the tolerance of the modes to that of the orbit if their growth is averaged.

It moves exponents by less than rtol, but more where a multiplier passes through zero: there the
exponent dips towards -inf and magnifies every error.
"""


@dataclass(slots=True)
class Orbits:
    """Orbits from several starts with the modes of all strengths along them."""

    scene: Scene  # oscillator, coupling and numerical settings
    variation: Variation  # variational equation of a mode
    # (m,) or (m, layers): strengths in the variational equation: alpha + i beta unless links have inertia; of several
    # layers one each
    strengths: np.ndarray
    state: np.ndarray  # (starts, components): current states
    workers: int | None  # number of threads
    # the unit of time, which is the period of the drive or the mean return time of undriven motion, and how far the
    # components move; without a drive from the start of the first orbit, with one from `settle` on
    turns: Turns
    method: Integrator  # method of all steps, the one that suits all strengths
    block: float = 1.0  # number of units of a block
    # interpolation in the strength, set by `prepare`, as what follows is
    interpolation: Interpolation = field(init=False, repr=False)
    integrator: VariationalIntegrator = field(init=False, repr=False)  # integrator of the nodes of the interpolation
    # deviations of all strengths, and the largest error of the interpolation so far
    travellers: Deviations = field(init=False, repr=False)

    @classmethod
    def make(
        cls, scene: Scene, strengths: np.ndarray, state: np.ndarray, workers: int | None, turns: Turns | None = None
    ) -> Orbits:
        """Set up orbits at the start of their transient.

        Shapes: strengths (m,) or (m, layers), state (starts, components).
        """
        scene = scene if scene.model.linked else _joined(scene, strengths)
        equations = without_drive(scene.equations, scene.parameters)
        variation, layers = _variation(equations, bool(np.iscomplexobj(strengths))), len(equations.layers)
        if strengths.size != len(strengths) * layers:
            raise ValueError(
                f"transversal modes: found {layers} layer{'s' * (layers > 1)} of links, so that a mode has as many strengths; expected "
                "one for each; `plane` takes the strengths of layers as axes, e.g. plane(scene, k=[0, 1], g=[0, 1])"
            )
        unit = unit_of_time(scene)
        row = np.array([[scene.parameters[name] for name in variation.orbit.parameters]])
        numbers = np.repeat(row, len(state), axis=0)
        state, strengths = with_modes(variation.orbit, state, numbers), _of_modes(scene, strengths)
        if turns is None and equations.forced:
            turns = Turns(unit, np.zeros(state.shape[1]), "period of the drive")
        rows = (variation, state, numbers, _rows(strengths))
        # until the motion is known, all of it may be fast: power series, whose steps find their length, look at it first
        method = chosen_for_modes(scene, *rows, 2.0 * math.pi / turns.time if turns else math.inf)
        orbits = cls(
            scene, variation, strengths, state, workers, turns or Turns(unit, np.zeros(state.shape[1])), method
        )
        if turns is None and not orbits.linear:
            orbits.turns = turns_of(orbits._observer(), orbits.rates)
            orbits.method = chosen_for_modes(scene, *rows, 2.0 * math.pi / orbits.unit)
        return orbits

    def _observer(self) -> VariationalIntegrator:
        """An integrator of the first orbit, whose steps are too short and too few to warn of."""
        integrator = self.part([0]).integrator_of(np.zeros_like(self.strengths[:1]))
        integrator.observes = True
        return integrator

    @property
    def unit(self) -> float:
        """Unit of time: the period of the drive, or the mean return time of undriven motion."""
        return self.turns.time

    @property
    def extent(self) -> np.ndarray:
        """How far each component (p,) of the first orbit moves."""
        return self.turns.extent

    @property
    def rates(self) -> RateFunctions:
        """Rates of the state, at time 0."""
        return _rates(self.variation.orbit, tuple(self.numbers))

    @property
    def components(self) -> int:
        """State variables of one deviation, real or complex."""
        return len(self.variation.orbit.node.continuous)

    @property
    def numbers(self) -> np.ndarray:
        """Values (parameters,) of the parameters of the orbit."""
        return np.array([self.scene.parameters[name] for name in self.variation.orbit.parameters])

    @property
    def forced(self) -> bool:
        """True if a drive acts."""
        return self.variation.orbit.forced

    @property
    def lands(self) -> bool:
        """True if a landing leaves one of the two components that a deviation has."""
        return self.variation.events is not None and self.variation.size == self.components == 2

    @property
    def linear(self) -> bool:
        """True if no state occurs in the variational equation: it is the same along every orbit, bounded or not."""
        states = {sp.Symbol(name, real=True) for name in self.variation.orbit.state}
        return not any(e.free_symbols & states for _, e in self.variation.matrix)

    def part(self, rows: list[int]) -> Orbits:
        """Return the orbits of some starts."""
        return replace(self, state=self.state[rows], block=1.0)

    def integrator_of(
        self, strengths: np.ndarray, looseness: float = 1.0, tolerance: float = 1.0
    ) -> VariationalIntegrator:
        """Return an integrator along the orbits from their current states. Shapes: strengths (k,)."""
        repeated = np.repeat(strengths, self.components, axis=0)
        rows = _rows(repeated.astype(self.strengths.dtype))
        numbers = np.tile(self.numbers, (len(self.state), 1))
        integrator = VariationalIntegrator.make(
            self.scene, self.variation, self.state, numbers, rows, self.workers, looseness, self.method
        )
        moving = self.extent[self.extent > 0.0]
        least = integrator.control[Control.RTOL] * float(moving.min(initial=np.inf))
        integrator.control[Control.ATOL] = min(integrator.control[Control.ATOL], OF_EXTENT * least)
        integrator.loosen(tolerance)
        integrator.slow = 2.0 * math.pi / self.unit
        return integrator

    def begun_at(self, states: np.ndarray) -> Orbits:
        """Return the orbits with the same scales from other states (starts, components of a node)."""
        numbers = np.repeat(self.numbers[None], len(states), axis=0)
        return replace(self, state=with_modes(self.variation.orbit, states, numbers))

    def observe(self) -> None:
        """Set the extent of driven motion by the first orbit, from its current state on."""
        if not self.forced:
            return
        states = [self.state[:1], *driven_states(self.part([0]))]
        extent = above(extent_of(np.concatenate(states), states[-1]), self.rates.rounding(self.state[0], self.unit))
        self.turns = self.turns._replace(extent=extent)

    def settle(self, periods: float, advanced: Callable[[float], object] | None = None) -> None:
        """Advance all orbits over a transient of a number of units."""
        self.observe()
        integrator = self.integrator_of(self.strengths[:1])
        for length in _stretches(round(periods)):
            integrator.advance(length * self.unit)
            if advanced is not None:
                advanced(length)
        self.state = integrator.state

    def prepare(self, periods: float) -> None:
        """Choose block and interpolation by trial on the next blocks, and start the deviations."""
        limit = max(0.01 * self.scene.rtol, ALLOWED)  # later blocks of a chaotic orbit are up to ten times worse
        failed: list[InterpolationChoice] = []
        for choice in self._choices(periods):
            if any(choice.is_coarser(other) for other in failed):
                continue
            outer = strength_interpolation(self.strengths, choice.nodes, choice.parts)
            legs = strength_interpolation(outer.nodes, choice.of_legs, choice.parts) if choice.of_legs else None
            _, travellers = self.start(outer, choice.block, legs=legs)
            if outer.is_exact and (legs is None or legs.is_exact):
                return
            self.growths(np.full(1, TRIAL))
            if travellers.error < limit:
                break
            far = FURTHER if travellers.error > HOPELESS else 1.0
            failed.append(replace(choice, nodes=int(far * choice.nodes), of_legs=int(far * choice.of_legs)))
        else:
            outer, legs = exact_interpolation(self.strengths), None
        self.start(outer, choice.block, legs=legs)

    def _choices(self, periods: float) -> list[InterpolationChoice]:
        """What may suit an average of some length, the cheapest first, by the steps that one mode takes in a unit."""
        one = self.integrator_of(self.strengths[:1], LOOSENESS)
        one.advance(self.unit)
        taken = STEP * self.components * one.steps / len(self.state)
        whole = [b for b in BLOCKS if b <= max(4.0, periods / BATCHES) and periods % b == 0.0]
        lines = 1 if self.strengths.ndim == 1 else len(lines_of(self.strengths)[1])
        found: list[InterpolationChoice] = []
        if self.lands and lines == 1:
            found += _choices_of_legs([b for b in whole if b >= LEG], taken, len(self.strengths))
        if not found:
            numbers = len(self.strengths) * self.components**2
            found += _choices_of_blocks(whole if self.forced else FREE_BLOCKS, lines * taken, numbers)
        return sorted(found, key=lambda choice: choice.cost)

    def start(
        self,
        interpolation: Interpolation,
        block: float,
        looseness: float = LOOSENESS,
        legs: Interpolation | None = None,
    ) -> tuple[VariationalIntegrator, Deviations]:
        """Start deviations of all strengths along the orbits from their settled states."""
        if self.lands:
            legs = legs or exact_interpolation(interpolation.nodes)
        integrator = self.integrator_of((legs or interpolation).nodes, looseness)
        integrator.set_deviations(self._basis(integrator))
        width = integrator.kernel.origin.width
        travellers = Deviations.make(
            interpolation.registers(width),
            len(self.state),
            self.components,
            self.variation.size,
            None if legs is None else legs.registers(width),
        )
        self.interpolation, self.block, self.integrator, self.travellers = interpolation, block, integrator, travellers
        return integrator, travellers

    def _basis(self, integrator: VariationalIntegrator) -> np.ndarray:
        """The columns of the identity (cells, size, modes), for each node."""
        basis = np.zeros((len(self.state), self.variation.size, len(integrator.order)))
        for k in range(self.components):
            basis[:, k, k :: self.components] = 1.0
        return basis

    def propagators(self) -> tuple[np.ndarray, np.ndarray]:
        """Advance by one block.

        Shapes: returns propagators (starts, nodes, components, components), logarithms (starts, nodes).
        """
        integrator, p, size = self.integrator, self.components, self.variation.size
        integrator.set_deviations(self._basis(integrator))
        growth = integrator.advance(self.block * self.unit)
        largest = growth.reshape(len(self.state), -1, p).max(axis=-1)
        logarithms = np.where((np.abs(largest) > FAR) & np.isfinite(largest), largest, 0.0)
        columns = integrator.deviations * np.exp(growth - np.repeat(logarithms, p, axis=-1))[:, None, :]
        if size != p:
            columns = columns[:, :p] + 1j * columns[:, p:]
        return np.asarray(columns.reshape(len(self.state), p, -1, p).transpose(0, 2, 1, 3)), logarithms

    def growths(self, batches: np.ndarray, tracks: np.ndarray = NO_TRACKS) -> np.ndarray:
        """Advance orbits and deviations by batches of blocks.

        Shapes: batches (b,), tracks (starts, b, any); returns (b, starts, m).
        """
        return self.integrator.follow(self.block * self.unit, batches, self.travellers, tracks)

    def tried(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Advance by TRIED blocks, or by fewer. Shapes: returns growths (blocks, starts, m), error (starts, m)."""
        count, (starts, size), vectors = min(most, TRIED), self.state.shape, self.travellers.vectors
        tracks = np.empty((starts, count, size + vectors.shape[1]))
        usual = self.growths(np.ones(count, dtype=np.int64), tracks)
        begun = tracks.swapaxes(0, 1).reshape(count * starts, -1)
        beside = self.integrator.beside(np.ascontiguousarray(begun[:, :size]), SLACK)
        travellers = replace(self.travellers, vectors=np.ascontiguousarray(begun[:, size:]))
        length = self.block * self.unit
        looser = beside.follow(length, np.ones(1, dtype=np.int64), travellers)[0].reshape(usual.shape)
        return usual, error_of_steps(usual, looser, length)


def pair_of(scene: Scene, **changes: Any) -> Scene:
    """Return two copies of a lone oscillator that start where it does."""
    start = {name: values[0] for name, values in scene.initial.items() if name != SLIP.name}
    return scene.replace(topology=topology("chain", 2), initial=start, **changes)


def driven_states(orbits: Orbits) -> tuple[np.ndarray, np.ndarray]:
    """States of a driven orbit at the beginning of its next STROBES periods, and LOOKS ones within each of the later half."""
    integrator, found = orbits.integrator_of(orbits.strengths[:1]), []
    for _ in range(STROBES):
        integrator.advance(orbits.unit)
        found.append(integrator.state[0])
    strobes = np.array(found)
    return strobes, within(replace(orbits, state=strobes[STROBES // 2 :]))


def within(orbits: Orbits, periods: int = 1) -> np.ndarray:
    """States (starts looks, components) of driven orbits within their next periods, LOOKS in each of the first few."""
    starts, looks = len(orbits.state), LOOKS * min(periods, LOOKS)
    integrator = orbits.part([*range(starts)] * looks).integrator_of(orbits.strengths[:1])
    integrator.advance(orbits.unit * np.repeat(np.arange(1, looks + 1), starts) / LOOKS)
    return integrator.state


def _joined(scene: Scene, strengths: np.ndarray) -> Scene:
    """A lone oscillator and a partner, joined by any link: its strength is 0; ValueError if it is not."""
    first = next(iter(scene.initial))
    if not np.any(strengths):
        return pair_of(scene, coupling=f"{first}->{first}")
    try:
        pair_of(scene)
    except ValueError as error:
        raise ValueError(f"transversal modes need a link to a partner: {error}; strength 0 needs none") from None
    raise ValueError(f"transversal modes: found no links in {scene!r}; expected a coupling and a topology")


def _rows(strengths: np.ndarray) -> np.ndarray:
    """The real numbers (rows, modes) of real or complex strengths: one or two rows for each layer."""
    rows = strengths.reshape(len(strengths), -1).T
    return np.concatenate([rows.real, rows.imag]) if np.iscomplexobj(strengths) else rows


def _of_modes(scene: Scene, alpha: np.ndarray) -> np.ndarray:
    """Strengths tau = alpha/(1 + b alpha) of modes whose links have inertia.

    See `synchain.models.dynamics.mode_inertia`.
    """
    _, share = inertia_of_modes(scene.equations)
    if share == 0:
        return alpha
    b = float(share.xreplace({sp.Symbol(name, real=True): value for name, value in scene.parameters.items()}))
    mass = 1.0 + b * alpha
    if not np.all(mass.real > 0.0):
        worst = alpha[mass.real.argmin()]
        raise ValueError(f"alpha = {worst}: the mass of this mode is not positive; expected strengths above {-1 / b:g}")
    return np.asarray(alpha / mass)


@lru_cache(maxsize=16)
def _variation(equations: Equations, plane: bool) -> Variation:
    """Variational equation of a mode; Newton's method on an orbit needs it at every step."""
    return mode(equations, plane=plane)


@lru_cache(maxsize=16)
def _rates(equations: Equations, numbers: tuple[float, ...]) -> RateFunctions:
    """The rates of equations; a limit cycle needs them at every step."""
    return rates_of(equations, dict(zip(equations.parameters, numbers, strict=True)))


def unit_of_time(scene: Scene) -> float:
    """Return the period of the drive, or 2 pi if there is none, in units of non-dimensional time."""
    drive = scene.drive
    if scene.forced and drive.frequency is None:
        raise ValueError(
            f"drive: the oscillator {scene.oscillator.name!r} {drive.problem}; expected one with a period; "
            "`run` integrates others with time_unit = 'time'"
        )
    return scene.period or 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class InterpolationChoice:
    """How propagators may be interpolated, and what it costs in multiplications for each unit of time.

    nodes, parts: of a panel, and panels on each side; of_legs: nodes that are integrated from landing to landing, 0 if all
    nodes are, from the beginning of a block to its end.
    """

    cost: float
    block: float
    nodes: int
    parts: int
    of_legs: int = 0

    def is_coarser(self, other: InterpolationChoice) -> bool:
        """True if another choice has shorter blocks and more nodes, in each panel and in all, or as many.

        Of as many nodes in all, those of few panels interpolate better.
        """
        own, theirs = ((c.nodes, c.of_legs, c.nodes * c.parts, c.of_legs * c.parts) for c in (self, other))
        return self.block >= other.block and all(a <= b for a, b in zip(own, theirs, strict=True))


def _choices_of_blocks(blocks: Sequence[float], taken: float, numbers: int) -> Iterator[InterpolationChoice]:
    """Yield choices of blocks, nodes and panels.

    `taken`: multiplications that integrate a node of each line over a unit of time; `numbers`: those of all propagators.
    """
    for block, nodes, parts in itertools.product(blocks, NODES, PARTS):
        yield InterpolationChoice(
            nodes * parts * taken + (numbers * (nodes + BESIDE) + BLOCK) / block, block, nodes, parts
        )


def _choices_of_legs(blocks: Sequence[float], taken: float, numbers: int) -> Iterator[InterpolationChoice]:
    """Yield choices for a body that sticks; the arguments are those of `_choices_of_blocks`, with the number of strengths.

    One column of two is integrated, and one number of four is interpolated.
    """
    for block, of_legs, nodes, parts in itertools.product(blocks, NODES, NODES, PARTS):
        if of_legs < nodes:
            cost = of_legs * parts * (taken / 2 + nodes) + LANDINGS + numbers * (nodes + BESIDE / 4) / block
            yield InterpolationChoice(cost, block, nodes, parts, of_legs)


def _stretches(periods: int) -> list[int]:
    """Split a number of periods into pieces, so that Ctrl-C is noticed."""
    whole, rest = divmod(max(periods, 0), 100)
    return [100] * whole + ([rest] if rest else [])
