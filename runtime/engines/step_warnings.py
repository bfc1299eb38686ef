"""Warn about steps: unfinished cells, stiffness, unbounded motion, angles too large for their tolerance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from synchain.codegen.driver.columns import SumColumn
from synchain.models.inputs.keywords import warn

from ..cells.buffers import Buffers
from ..cells.plan import CellRows
from ..support.status import Status
from .choice import STIFF, Ladder

FEW = 100  # there is no warning of short steps for a cell with fewer than FEW steps: a choice
BLOWN = 1e6  # a motion counts as unbounded if it has grown by this factor and still grows at its fastest rate: a choice


def warn_of_steps(ladder: Ladder, buffers: Buffers, rows_of: Callable[[np.ndarray], CellRows]) -> None:
    """Warn of cells that did not finish or made no step, of stiffness, of unbounded motion, and of too large angles."""
    status, steps, times = buffers.status, buffers.steps, buffers.sums[:, SumColumn.STOPPED_AT]
    idle = np.isin(status, (Status.STEP_UNDERFLOW, Status.STEP_BUDGET)) & (times <= 0.0)
    if len(status) and not np.isin(status, (Status.FINISHED, Status.STOPPED, Status.INTERRUPTED, Status.NOT_RUN)).any():
        warn(f"no cell came to its end: {Status(int(status[0])).message}")
    elif idle.any():
        k = int(idle.argmax())
        warn(f"{idle.sum()} of {len(idle)} cells made no step, cell {k} first: {Status(int(status[k])).message}")
    explicit = not (ladder.methods[-1].implicit or ladder.equations.sticks)
    regular = ~np.isin(status, (Status.STEP_UNDERFLOW, Status.DIVERGED)) & (times > 0.0)
    regular &= np.isfinite(buffers.end).all(axis=1)
    sizes = np.abs(buffers.end)
    _warn_of_far_angles(ladder, np.where(regular[:, None], sizes, 0.0))
    # Compute rates at the end of cells with large states, and of cells with many steps of an explicit method.
    sizes = np.minimum(sizes, ladder.longest)
    cells = np.flatnonzero(regular & ((sizes.max(axis=1) > BLOWN) | (explicit & (steps >= FEW))))
    if not len(cells):
        return
    rows, end, steps, times, sizes = rows_of(cells), buffers.end[cells], steps[cells], times[cells], sizes[cells]
    at, length = ladder.at(rows, end, times), times / np.maximum(steps, 1)
    short = (at.fastest * length > 1.0) & np.isfinite(at.fastest)
    begun = np.minimum(np.abs(rows.start), ladder.longest).max(axis=1)
    grown = sizes.max(axis=1) > BLOWN * np.maximum(1.0, begun)
    blown = grown & (at.growth >= 0.5 * at.fastest) & (at.growth * length > 0.5)
    stiff = explicit & short & ~grown & (at.fastest > STIFF * np.maximum(at.turning, at.going))
    if blown.any():
        k = int(blown.argmax())
        warn(
            f"a state grew to {sizes[k].max():.3g} in {steps[k]} steps of a cell; expected a bounded motion; "
            "check the signs and the size of the parameters"
        )
    elif stiff.any():
        k = int(stiff.argmax())
        warn(
            f"stiff equations: found a rate of {at.fastest[k]:.3g} beside slow motion, and {steps[k]} explicit steps in a "
            "cell; expected few; the result may be worse than rtol says; integrator = 'rodas5p' takes longer steps"
        )


def _warn_of_far_angles(ladder: Ladder, sizes: np.ndarray) -> None:
    """Warn if the rounding error of an angle exceeds the tolerance."""
    # `sizes` (cells, dimension): final sizes of states.
    allowed = np.where(np.isinf(ladder.longest), np.inf, ladder.scene.rtol * ladder.longest + ladder.scene.atol)
    shares = np.finfo(float).eps * sizes / allowed
    if shares.max(initial=0.0) <= 1.0:
        return
    cell, slot = np.unravel_index(shares.argmax(), shares.shape)
    size = sizes[cell, slot]
    warn(
        f"the angle {ladder.equations.state[slot]} grew to {size:.3g}, where its rounding is "
        f"{np.finfo(float).eps * size:.2g}; expected less than its tolerance, {allowed[slot]:.2g}; write the equations in a "
        "frame that turns along, start nearer to zero, shorten the run, or loosen rtol"
    )
