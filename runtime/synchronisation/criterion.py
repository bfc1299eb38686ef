"""When a coupling counts as synchronous: the starts, how long they run, and the error that is allowed."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from synchain.models.inputs.checks import check_instance, check_integer, check_number, check_positive

__all__ = ["IN_CRITERION", "QUICK", "Criterion", "checked", "offsets"]


@dataclass(frozen=True, slots=True)
class Criterion:
    """When a value of sigma counts as synchronous.

    From `starts` different initial states (the scene's own, and copies of it moved as a whole by a
    random amount of up to `reach` in the position), at least half must end with a mean
    synchronisation error below `tolerance`, averaged over `window` drive periods after a transient
    of `transient`.  Near the ends of a range of chaotic motion single starts synchronise or burst
    by chance; their majority does not depend on one of them.

    Distances between oscillators are those of the scene's own start in all of them.  Where oscillators and links are
    linear, a mode in which these distances have no part grows from rounding alone: `thresholds` warns of it.
    """

    tolerance: float = 1e-3
    starts: int = 8
    reach: float = 0.4
    transient: float = 1000.0
    window: float = 100.0
    rtol: float = 1e-8
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("tolerance", "transient", "window", "rtol"):
            object.__setattr__(self, name, check_positive(f"criterion: {name}", getattr(self, name)))
        object.__setattr__(self, "reach", check_number("criterion: reach", self.reach, 0.0))
        check_integer("criterion: starts", self.starts, 1)
        check_integer("criterion: seed", self.seed, 0)


QUICK = Criterion(starts=5, transient=400.0, window=50.0, rtol=1e-6)
"""A criterion for a first look, at a ninth of the effort.

Chains of two, three and four oscillators of the paper at omega = 1.15 and 1.40: ends of ranges at rtol = 1e-6 and 1e-8
differ by as much as with two seeds of the starts, and steps are 2.3 times fewer.
"""


IN_CRITERION = {
    own.name: f"it is one of the criterion; write criterion=Criterion({own.name}=…)" for own in fields(Criterion)
}
"""What functions with a criterion do not take themselves, and why."""


def checked(criterion: Criterion | None) -> Criterion:
    """Return the criterion, or the default one for None; TypeError for anything else."""
    if criterion is None:
        return Criterion()
    return check_instance("criterion", criterion, Criterion, "a Criterion, e.g. Criterion(starts=4)")


def offsets(criterion: Criterion) -> np.ndarray:
    """Return how far the starts are moved: not at all, then at random."""
    random = np.random.default_rng(criterion.seed)
    return np.concatenate([[0.0], random.uniform(-criterion.reach, criterion.reach, criterion.starts - 1)])
