"""One Taylor step as a program, whatever holds the coefficients: names (`unrolled_series`) or memory (`looped_series`).

The step computes the coefficients of the states up to its order, chooses its length from the last of them (`step_length`),
ends at the first kink or contact (`event_location`), and sums the series there.  `StepWriter.statements` is that list.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Compare, Conditional, Name, Number, call
from ..program.passes import real
from ..program.printers import LANES
from ..program.statements import (
    Comment,
    Function,
    If,
    Repeat,
    Return,
    Role,
    Statement,
    let,
    mentioned,
    operations,
)
from ..program.statements import called as called_functions
from .event_location import FUNCTIONS
from .series import Time
from .series_graph import LANE_FUNCTIONS
from .series_writer import SeriesWriter
from .step_length import finished, last_orders, reach

WORDS = frozenset(
    {"unseen", "high", "low", "largest", "scale", "ratio", "reach", "length", "total", "raised", "square", "power", "weight", "number", "inverse", "LINKS", "TERMS", "j_there",
     "slope_scale", "convolution", "passed", "until", "passage", "side_of", "PASSED", "ROUNDING", "NEAREST", "nearest", "loose", "closing", "side_or", "found_side", "news", "new", "floor", "value", "stuck", "side", "way", "room", *LANE_FUNCTIONS.values()}
)  # fmt: skip
PREFIXES = ("positive_", "i_", "e_", "half_", "w_", "n_", "size_", "odd_", "stuck_", "hint_")
"""Names of the step; a user's symbol of that name is called otherwise within the step."""

COUNTED = re.compile(r"[rs]\d+$")
"""Names of the step with a number: shares of `scale`, and sums."""

ARGUMENTS = ("t", "h", "scale", "y", "p", "y_new", "dense", "rtol", "atol")

SOONEST = let("nearest", 1e-13 * call("maximum", "t", 1.0) / "scale")
"""How soon a step may end at a contact or a jump: about 450 roundings of the time, so that time goes on; a choice."""

LEAST_ORDER = 6
"""The least order: the last three orders, which decide the length of a step, lie above the low ones (`step_length.LOW`)."""


@dataclass(frozen=True, slots=True)
class TaylorStep:
    """The function `step` and what a kernel needs to call it.

    order: that of the series, and the number of rows of the dense output; workspace: the groups of memory behind the dense
    output; called: the text of functions that it calls; table: the numbers that it reads in the array `where`.
    """

    function: Function
    order: int
    workspace: int
    called: tuple[str, ...] = ()
    table: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        """Return the step and what it calls, as a kernel has them."""
        return "\n\n\n".join([*self.called, LANES.function(self.function)])

    @property
    def operations(self) -> int:
        """Return the number of additions, multiplications and divisions of the step."""
        return operations(self.function.body)


class TaylorStepWriter(ABC):
    """Writes the step of some order for tidy equations.

    `parts` are the series that it makes together; `exact` is True if the tolerance alone decides how exact loads of contacts
    are: slip of some contact begins with a jump of acceleration.
    """

    parts: Sequence[SeriesWriter]
    functions: Sequence[str] = ()

    def __init__(self, equations: Equations, order: int, symbols: Collection[str]) -> None:
        self.equations, self.order = equations, order
        self.exact = any(event.jumps for node in equations.nodes for event in node.events)
        self.called, self.time = called(symbols), Time(name="t")
        self.substitutes: dict[sp.Symbol, sp.Expr] = {real(old): real(new) for old, new in self.called.items()}

    def step(self, *more: str) -> TaylorStep:
        """Return the step, which takes `more` arguments."""
        body = tuple(self.statements())
        docstring = (
            "One step from (t, y): writes y_new and the dense output, returns its length and how far its series reach."
        )
        function = Function("step", (*ARGUMENTS, *more), docstring, body, Role.ENTRY)
        names = called_functions(body)
        texts = [text for text, users in FUNCTIONS.items() if names & users]
        return TaylorStep(function, self.order, self.workspace, (*texts, *self.functions))

    def statements(self) -> list[Statement]:
        """Return the body of the step."""
        # coefficients of all orders; while they show on which sides series lie that begin at zero, they are computed again.
        # each turn finds one more side at least: what one jump sets off may decide the next one
        coefficients = self.coefficients()
        if forget := [s for part in self.parts for s in part.forget_sides()]:
            find = [s for part in self.parts for s in part.find_sides()]
            body = (*coefficients, Comment("sides of what begins at zero"), let("news", 0.0 * Name("t")), *find)
            coefficients = [*forget, Repeat(body, call("any_lane", Compare(">", Name("news"), Number(0.5))))]

        # the first of the passages, each of which looks no further than the one before
        passages = [s for part in self.parts for s in part.passages(self.exact)]
        if passages:
            begin: list[Statement] = [Comment("first passage"), let("passed", "ratio")]
            begin += [SOONEST] if "nearest" in mentioned(passages) else []
            passed = Compare("<", Name("passed"), Name("ratio"))
            until = Conditional(passed, Name("passed") * "scale", Name("length"))
            passages = [*begin, *passages, let("until", until), let("ratio", "passed")]

        # the length by the last coefficients of states, gaps of kinks and contacts, and by what is still too small to be seen.
        # a load that is wrong by some part frees a body too early or late, with less than the power 3/2 of it as velocity,
        # unless friction falls at once: its tolerance is rtol**(3/4)
        loose = let("loose", "rtol" if self.exact else call("math.sqrt", Name("rtol") * call("math.sqrt", "rtol")))
        length = [
            Comment("step length"),
            *self.sizes(),
            *([loose] if self.equations.sticks else []),
            *(s for part in self.parts for s in part.lengths()),
            *self.reach(),
            *finished(self.order, self.watching, self.equations.sticks),
            *(s for part in self.parts for s in part.distances()),
        ]

        far = Name("length") + 0.0 * Name("total")
        return [
            *self.opening(),
            *coefficients,
            *length,
            *passages,
            Comment("new state"),
            *self.new_state(),
            *(s for part in self.parts for s in part.broken()),
            If(Name("DENSE"), tuple(self.rows())),
            Return((Name("until" if passages else "length"), far), "NaN where any coefficient is infinite or NaN"),
        ]

    @property
    def watching(self) -> bool:
        """Return True if any series is watched."""
        return any(part.graph.watched for part in self.parts)

    @property
    @abstractmethod
    def workspace(self) -> int:
        """Return the number of groups of memory that the statements need."""

    def opening(self) -> list[Statement]:
        """Load what the step needs beside its coefficients."""
        return []

    @abstractmethod
    def coefficients(self) -> list[Statement]:
        """Compute the coefficients of the states and of all series."""

    @abstractmethod
    def sizes(self) -> list[Statement]:
        """Compute the sizes of the last coefficients of the states."""

    def reach(self) -> list[Statement]:
        """Compute how far the step may go by all sizes."""
        return [let("reach", reach(last_orders(self.order)))]

    @abstractmethod
    def new_state(self) -> list[Statement]:
        """Compute the new state and its total."""

    @abstractmethod
    def rows(self) -> list[Statement]:
        """Compute the dense output."""


def check_order(order: int) -> None:
    """Raise ValueError for an order that is too small."""
    if order < LEAST_ORDER:
        raise ValueError(f"taylor: found order {order}; expected at least {LEAST_ORDER}")


def called(symbols: Collection[str]) -> dict[str, str]:
    """Return the names of symbols within the step: unchanged, unless the step needs a name itself."""
    names: dict[str, str] = {}
    for symbol in sorted(symbols):
        name = symbol
        if symbol in WORDS or symbol.startswith(PREFIXES) or COUNTED.match(symbol):
            name = f"user_{symbol}"
            while name in symbols or name in names.values():
                name += "_"
        names[symbol] = name
    return names
