"""Status codes of cells, in every result, with a sentence for each code."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

CODES = 16  # length of arrays of counts by status code, also in files; longer than needed, so that codes can be added


class Status(IntEnum):
    """Status of one cell; only `FINISHED` is success.  Generated kernels use the same numbers.

    See Also
    --------
    synchain.run
    """

    NOT_RUN = 0
    FINISHED = 1
    STEP_BUDGET = 2
    STEP_UNDERFLOW = 3
    DIVERGED = 4
    INTERRUPTED = 5
    CHATTERING = 6
    STOPPED = 7
    PAUSED = 8
    AMBIGUOUS = 9

    @property
    def message(self) -> str:
        """Text that describes the event and the remedy."""
        return _MESSAGES[self]


_MESSAGES = {
    Status.NOT_RUN: "the cell was not started",
    Status.FINISHED: "reached the end of the window",
    Status.STEP_BUDGET: "used up max_steps before the end; raise max_steps or loosen rtol and atol, unless the motion slides "
    "along a jump, such as sign(v) in the rate of v",
    Status.STEP_UNDERFLOW: "the step size fell below rounding; the equations may be singular here, the tolerance tighter "
    "than double precision allows, or a part of them beyond 1e308, such as exp(710): write 1/(1 + exp(-x)) as "
    "(1 + tanh(x/2))/2; where rates are finite and their slopes are not, as at sqrt(0) or acos(1), runs need "
    "integrator = 'dop853'",
    Status.DIVERGED: "the state grew without bound, beyond 2^53 or with steps that shrink so that max_steps will not do, or "
    "became undefined; begin on a bounded motion, such as an equilibrium, or shorten the time",
    Status.CHATTERING: "a contact, stop or reset changed hundreds of times while no time passed; check friction laws, "
    "restitutions, and that guards are negative after their resets",
    Status.AMBIGUOUS: "at an event several motions agree with the laws of the contacts, or none does: the load of a contact is "
    "negative, motion leaves a surface on both sides, the restitution of a stop is outside 0 to 1, or stops that feel each other are hit at once "
    "(in_order of a Stop); change the model there",
    Status.STOPPED: "met the stop condition of the scene before the end of the window",
    Status.PAUSED: "waits for another integrator",
    Status.INTERRUPTED: "stopped by the user before the end; run again with resume",
}


def tally(codes: np.ndarray) -> np.ndarray:
    """Return the number of cells that ended with each code. Shapes: codes (cells,), returns (CODES,)."""
    return np.bincount(codes, minlength=CODES)
