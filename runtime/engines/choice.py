"""Choose the integrator of each cell: at the start by the rates of the motion, later by the lengths of the steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from synchain.codegen.driver.clock_slots import WORTH
from synchain.codegen.driver.columns import Count, SpanColumn, SumColumn
from synchain.codegen.integrators import Integrator, integrator
from synchain.codegen.kernels.sweep_kernel import AUTO, LARGEST_UNROLLED
from synchain.codegen.taylor import (
    is_analytic,
    is_large,
    is_linear,
    may_cross_singularity,
    order_for,
    taylor_obstacle,
    unpassed,
)
from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation
from synchain.models.graphs.links import LINK_LIMIT
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.paces import Paces, Templates
from ..cells.plan import CellRows
from ..cells.stiffness_rates import eigenvalue_rates, mode_rates
from ..support.status import Status
from .step_control import first_step, scale_of_atol, tolerances

# Rosenbrock steps are faster if decay is STIFF times as fast as the turning and the change of a motion; measured in
# docs/performance.md.
STIFF = 30.0
# Weight of the stiffness inside the layer of a smoothed jump: a choice; motion is in the layer for part of the time.
LAYER = 0.1
FIRST_LOOK = 64.0  # steps after which a cell first pauses if many more are to come: a choice
# Steps below this part of the shortest time of a motion are limited by the series, for example by a hidden pole: a
# choice.
STALLED = 0.01
# A slide along a jump is ended after 1/SLIDE of max_steps if its remaining time needs SLIDE times max_steps: a choice.
SLIDE = 64.0
AUTOMATIC = ("taylor", "dop853", AUTO)  # the integrators of `auto`, in the order in which cells try them


def method_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of the integrators that cells of a scene may use."""
    return AUTOMATIC if scene.integrator == "auto" else (scene.integrator,)


@dataclass(frozen=True)
class Ladder:
    """The integrators of some equations in the order in which cells try them."""

    # The order is: Taylor series where they exist, explicit stages, a Rosenbrock method. A cell that is stiff at its
    # start begins with the Rosenbrock method, any other cell with the first method. If many steps remain, a cell pauses
    # after 64, 256, 1024 … steps and may change its method. It changes to Rosenbrock steps if its steps are as short as
    # the time of its fastest decay although its motion is slow. It changes to explicit stages if its series steps are
    # far shorter than any time of its motion, or if they underflow because a series has no next term. Each decision
    # depends on the cell alone.

    scene: Scene  # its integrator and its tolerances
    equations: Equations  # the equations that are integrated

    @cached_property
    def methods(self) -> tuple[Integrator, ...]:
        """The integrators; a single one if the scene names its integrator."""
        if self.scene.integrator == "taylor":
            return (_taylor(self.scene, self.equations, is_large(self.equations)),)
        if self.scene.integrator != "auto":
            return (integrator(self.scene.integrator),)
        series = (_taylor(self.scene, self.equations, is_large(self.equations)),) if _has_series(self.equations) else ()
        return (*series, integrator("dop853"), *((integrator(AUTO),) if self.solvable else ()))

    @cached_property
    def columns(self) -> np.ndarray:
        """The index among `method_names` of each method."""
        return np.array([method_names(self.scene).index(method.name) for method in self.methods])

    @property
    def solvable(self) -> bool:
        """True if a Rosenbrock method can step the network: neither too many pairs nor triangles of many nodes."""
        if self.equations.triadic and self.equations.n > LARGEST_UNROLLED:
            return False
        return not any(len(pairs) > LINK_LIMIT for _, pairs in self.equations.fields)

    @cached_property
    def templates(self) -> Templates:
        return Templates(self.equations)

    def first(self, rows: CellRows) -> np.ndarray:
        if len(self.methods) == 1:
            return np.zeros(len(rows), int)
        if self.scene.cells > 1:
            return self._first(rows)
        # A run of a single cell calls this twice with the same row: to choose the kernel, and to start the cell.
        key = b"".join(array.tobytes() for array in (rows.start, rows.numbers, rows.spans))
        if key not in self._chosen:
            self._chosen[key] = self._first(rows)
        return self._chosen[key].copy()

    @cached_property
    def _chosen(self) -> dict[bytes, np.ndarray]:
        return {}

    def _first(self, rows: CellRows) -> np.ndarray:
        # Stiff cells decay far faster than they turn, grow or are driven, for long enough to matter.
        paces = at_start(self.templates, rows)
        endless = ~np.isfinite(paces.size)
        slow = np.maximum(np.maximum(paces.turning, paces.growth), math.pi / rows.spans[:, SpanColumn.LONGEST])
        stiff = (paces.parted > STIFF * slow) & (paces.parted * rows.spans[:, SpanColumn.END] > WORTH) & ~endless
        # Cells that start outside the layers of smoothed jumps may be stiff inside a layer.
        enters = np.zeros(len(rows), dtype=bool)
        for blocks in self.templates.layers(rows.start, rows.numbers):
            fastest, turning, *_ = eigenvalue_rates(blocks)
            within = LAYER * fastest * rows.spans[:, SpanColumn.END] > WORTH
            enters |= within & (LAYER * fastest > STIFF * np.maximum(slow, LAYER * turning)) & np.isfinite(fastest)
        stiff |= ~endless & ~stiff & enters
        last = len(self.methods) - 1 if self.solvable else self._explicit
        return np.where(stiff & (not self.equations.sticks), last, np.where(endless, self._explicit, 0))

    def main(self, rows: CellRows) -> Integrator:
        """Return the method with which most of these cells begin."""
        return self.methods[np.bincount(self.first(rows)).argmax()]

    def steps(self, rows: CellRows, first: np.ndarray) -> np.ndarray:
        """Return spans (cells, len(SpanColumn)) with the first step and the first pause."""
        # `first`: index of the method.
        last = len(self.methods) - 1
        if last == 0 and not self.methods[0].implicit:
            return rows.spans
        spans = rows.spans.copy()
        implicit = np.flatnonzero(np.array([method.implicit for method in self.methods])[first])
        if len(implicit):
            spans[implicit, SpanColumn.FIRST_STEP] = first_steps(self.templates, rows.take(implicit))
        spans[:, SpanColumn.LOOK] = np.where(first < last, FIRST_LOOK, math.inf)
        return spans

    def further(self, rows: CellRows, buffers: Buffers, method: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        """Return the next method (cells,) of cells that paused or have steps that underflow; -1 to end the cell."""
        # Shapes: method (cells,), lengths (cells,), the mean steps since the last pause.
        paused = buffers.status == Status.PAUSED
        series = np.array([m.series for m in self.methods])[method]
        implicit = np.array([m.implicit for m in self.methods])[method]
        untried = buffers.counts[:, Count.BY_METHOD + self.columns[self._explicit]] == 0
        following = np.where(paused, method, np.where(untried, self._explicit, -1))
        looked = np.flatnonzero(paused & ~implicit & np.isfinite(buffers.end).all(axis=1))
        if len(looked):
            at = self.at(rows.take(looked), buffers.end[looked], buffers.sums[looked, SumColumn.STOPPED_AT])
            slow, length = np.maximum(at.turning, at.going), lengths[looked]
            finite = np.isfinite(at.size)
            stiff = finite & (at.fastest > STIFF * slow) & (at.fastest * length > 1.0) & self.solvable
            free = length < STALLED * rows.spans[looked, SpanColumn.LONGEST]
            stalled = series[looked] & finite & free & (np.maximum(at.size, at.going) * length < STALLED)
            unchanged = np.where(stalled, self._explicit, following[looked])
            following[looked] = np.where(stiff, len(self.methods) - 1, unchanged)
        return following

    @cached_property
    def jumps(self) -> bool:
        """True if motion may slide along a jump of a rate."""
        return next(iter(unpassed(self.equations)), None) is not None

    def sliding(self, rows: CellRows, buffers: Buffers, lengths: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Return whether paused cells (cells,) slide along a jump that max_steps cannot finish."""
        # The error across a jump makes explicit steps short and of similar length. `lengths` (cells,) is the mean
        # length since the last pause, `before` (cells,) the mean length before that pause. A slide may end soon, and so
        # may take 1/SLIDE of max_steps.
        left = rows.spans[:, SpanColumn.END] - buffers.sums[:, SumColumn.STOPPED_AT]
        steady = (lengths < 2.0 * before) & (before < 2.0 * lengths)
        hopeless = left > SLIDE * self.scene.max_steps * lengths
        return np.asarray(self.jumps & steady & hopeless & (SLIDE * buffers.steps > self.scene.max_steps))

    def tolerances(self, rows: CellRows) -> tuple[np.ndarray, np.ndarray]:
        """Return (rtol, atol), each (cells,), of the integration."""
        # A default atol shrinks for small motions (`scale_of_atol`). The size of a motion is the larger of the size of
        # its start, and the distance that the initial rates cover in the shortest time of the cell.
        rtol, atol = tolerances(self.scene, self.equations, rows.numbers)
        if self.scene.given["atol"] is None:
            start = np.abs(rows.start[:, self.moving]).max(axis=1)
            small = start < 0.1
            if small.any():
                few = rows.take(small)
                size = np.maximum(start[small], self.templates.reach(few.start, few.numbers))
                atol[small] *= scale_of_atol(size)
        return rtol, atol

    def at(self, rows: CellRows, state: np.ndarray, time: np.ndarray) -> Paces:
        """Return the rates of cells at states and times; the states have errors of the size of the tolerances."""
        rtol, atol = self.tolerances(rows)
        noise = rtol[:, None] * np.minimum(np.abs(state), self.longest) + atol[:, None]
        return self.templates.paces(state, rows.numbers, time, rows.spans[:, SpanColumn.LONGEST], noise)

    @cached_property
    def moving(self) -> np.ndarray:
        """Whether each state (dimension,) moves; modes of events are -1, 0 or 1 in any unit."""
        components, modes = self.equations.components, self.equations.modes
        return np.repeat(
            [name not in modes for name in components], [len(self.equations.holders(c)) for c in components]
        )

    @cached_property
    def longest(self) -> np.ndarray:
        """Size limits (dimension,) of states for tolerances: the period of an angle, infinity for any other state."""
        return np.array([period or np.inf for period in periods_of_states(self.equations)])

    @property
    def _explicit(self) -> int:
        return next(k for k, m in enumerate(self.methods) if not m.series)


def at_start(templates: Templates, rows: CellRows) -> Paces:
    """Return the rates of cells at their start."""
    shortest = np.minimum(rows.spans[:, SpanColumn.LONGEST], np.maximum(rows.spans[:, SpanColumn.END], 1e-300))
    return templates.paces(rows.start, rows.numbers, np.zeros(len(rows)), shortest, None)


def first_steps(templates: Templates, rows: CellRows) -> np.ndarray:
    """Return the first step (cells,) of each cell by a Rosenbrock method."""
    growth = at_start(templates, rows).growth
    return np.array([first_step(rate if math.isfinite(rate) else 0.0) for rate in growth])


@lru_cache(maxsize=64)
def _has_series(equations: Equations) -> bool:
    """Return whether Taylor steps can pass all kinks and jumps of the equations, and compile fast enough."""
    # No motion may slide along a jump, or pass a point without a series. Dense mass matrices are excluded too: their
    # recurrences take longer to compile than most runs.
    return not equations.inertial and taylor_obstacle(equations) is None and not may_cross_singularity(equations)


def chosen_for_rows(scene: Scene, equations: Equations, rows: CellRows) -> Integrator:
    """Return one integrator for all rows: of the methods with which rows begin, the last in the order of the ladder."""
    ladder = Ladder(scene, equations)
    return ladder.methods[int(ladder.first(rows).max())]


def chosen_for_modes(
    scene: Scene,
    variation: Variation,
    state: np.ndarray,
    parameters: np.ndarray,
    strengths: np.ndarray,
    slow: float = 1.0,
) -> Integrator:
    """Return the integrator of orbits with deviations along them: a Taylor or a Rosenbrock method."""
    # Choose Taylor steps if all functions are analytic, and neither the orbit nor the strongest mode is stiff at the
    # start. Shapes: state (cells, dimension), parameters (cells, count), strengths (number of strengths, modes).
    if scene.integrator == "taylor":
        return _taylor(scene, variation.orbit)
    smooth = scene.integrator == "auto" and is_analytic(variation.orbit)
    if smooth and mode_stiffness(variation, state, parameters, strengths, slow) < STIFF:
        return _taylor(scene, variation.orbit)
    return integrator(AUTO)


def _taylor(scene: Scene, equations: Equations, large: bool = False) -> Integrator:
    return integrator("taylor", order_for(scene.rtol, scene.atol, is_linear(equations), large))


def mode_stiffness(
    variation: Variation, state: np.ndarray, parameters: np.ndarray, strengths: np.ndarray, slow: float = 1.0
) -> float:
    """Return the stiffness of modes: the ratio of decay or growth of deviations to their turning, or to `slow`."""
    # The largest ratio along the first orbits counts, for strength zero and the extreme strengths. Parameters as for
    # `chosen_for_modes`.
    rates = mode_rates(variation, state, parameters, strengths)
    return max((at.fastest / max(slow, at.turning) for at in rates), default=0.0)


def warn_of_stiff_modes(
    variation: Variation,
    state: np.ndarray,
    parameters: np.ndarray,
    strengths: np.ndarray,
    step: float,
    slow: float = 1.0,
) -> bool:
    """Warn if Taylor steps with deviations were short because modes are stiff; return True after a warning."""
    # `step`: mean length of the steps. Other parameters as for `chosen_for_modes`.
    if step * STIFF * slow >= 1.0:
        return False
    for fastest, turning, _ in mode_rates(variation, state, parameters, strengths):
        if fastest * step > 1.0 and fastest > STIFF * max(slow, turning):
            warn(
                f"stiff modes: found a rate of {fastest:.3g} beside slow motion, and Taylor steps of {step:.2g}; "
                "expected longer ones; integrator = 'rodas5p' takes them"
            )
            return True
    return False
