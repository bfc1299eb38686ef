"""Write one Taylor step as a program, with coefficients in variables (`unrolled_series`) or memory (`looped_series`).

The step computes the coefficients of the states up to its order, chooses its length from the last coefficients
(`step_length`), moves its end to the first kink or contact (`event_location`), and sums the series there.
`TaylorStepWriter.statements` lists these parts.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.rows import Law

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
from ..steps.row_step import all_rows
from .event_location import FUNCTIONS
from .series import Time
from .series_graph import LANE_FUNCTIONS
from .series_writer import SeriesWriter
from .step_length import finished, last_orders, reach

WORDS = frozenset(
    {"unseen", "high", "low", "largest", "scale", "ratio", "reach", "length", "total", "raised", "square", "power", "weight", "number", "inverse", "LINKS", "TERMS", "j_there",
     "slope_scale", "convolution", "passed", "until", "passage", "side_of", "PASSED", "ROUNDING", "NEAREST", "nearest", "loose", "closing", "row_closing", "NOTHING", "side_or", "found_side", "news", "new", "floor", "value", "stuck", "side", "way", "room", *LANE_FUNCTIONS.values()}
)  # fmt: skip
PREFIXES = ("positive_", "i_", "e_", "half_", "w_", "n_", "size_", "odd_", "stuck_", "hint_")
"""Prefixes of variables of the step; a user's symbol with such a prefix is renamed within the step."""

COUNTED = re.compile(r"[rs]\d+$")
"""Matches numbered variables of the step: r1, r2, … (shares of `scale`) and s1, s2, … (sums)."""

ARGUMENTS = ("t", "h", "scale", "y", "p", "y_new", "dense", "rtol", "atol")


def soonest(equations: Equations) -> Statement:
    """Return the least step to an event: about 450 rounding errors of the time, so that time advances.

    Impacts may follow each other in any unit of time.  Contacts need a step in which a sliding velocity changes by more
    than rounding; as such a step serves a unit of time (a choice).
    """
    stops = any(row.law is Law.STOP for rows in all_rows(equations) for row in rows)
    least = Name("scale") if stops else Number(1.0)
    return let("nearest", 1e-13 * call("maximum", "t", least) / "scale")


LEAST_ORDER = 6
"""The least order: its last three orders, which determine the step length, lie above the orders `step_length.LOW`."""


@dataclass(frozen=True, slots=True)
class TaylorStep:
    """The function `step`, and the data that a kernel needs to call `step`.

    order: order of the series, and number of rows of the dense output. workspace: number of groups of memory behind the
    dense output. called: texts of the functions that `step` calls. table: the numbers that `step` reads from the array
    `where`.
    """

    function: Function
    order: int
    workspace: int
    called: tuple[str, ...] = ()
    table: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        """The text of the step and of the functions that it calls, as in a kernel."""
        return "\n\n\n".join([*self.called, LANES.function(self.function)])

    @property
    def operations(self) -> int:
        """Return the number of additions, multiplications and divisions of the step."""
        return operations(self.function.body)


class TaylorStepWriter(ABC):
    """Write the step of some order for equations with names that are free in generated code (`tidy`).

    `parts`: the groups of series that are computed together. `exact`: True if the slip of some contact begins with a
    jump of acceleration, or for rows; loads of contacts then need the full tolerance.
    """

    parts: Sequence[SeriesWriter]
    functions: Sequence[str] = ()

    def __init__(self, equations: Equations, order: int, symbols: Collection[str]) -> None:
        self.equations, self.order = equations, order
        self.exact = equations.has_rows or any(event.jumps for node in equations.nodes for event in node.events)
        self.called, self.time = called(symbols), Time(name="t")
        self.substitutes: dict[sp.Symbol, sp.Expr] = {real(old): real(new) for old, new in self.called.items()}

    def step(self, *more: str) -> TaylorStep:
        """Return the step; the names in `more` become additional arguments."""
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
        # compute the coefficients of all orders.  if they decide the sign of a series that begins at zero, compute them
        # again.  each turn decides at least one more sign; several turns occur because one jump may cause another
        coefficients = self.coefficients()
        if forget := [s for part in self.parts for s in part.forget_sides()]:
            find = [s for part in self.parts for s in part.find_sides()]
            body = (*coefficients, Comment("sides of what begins at zero"), let("news", 0.0 * Name("t")), *find)
            coefficients = [*forget, Repeat(body, call("any_lane", Compare(">", Name("news"), Number(0.5))))]

        # find the first passage: each search ends at the earliest passage so far
        passages = [s for part in self.parts for s in part.passages(self.exact)]
        if passages:
            begin: list[Statement] = [Comment("first passage"), let("passed", "ratio")]
            begin += [soonest(self.equations)] if "nearest" in mentioned(passages) else []
            passed = Compare("<", Name("passed"), Name("ratio"))
            until = Conditional(passed, Name("passed") * "scale", Name("length"))
            passages = [*begin, *passages, let("until", until), let("ratio", "passed")]

        # choose the length by the last coefficients of states, of gaps of kinks and contacts, and by watched series.
        # a relative error of a load releases a body too early or too late; the velocity error is at most the power
        # 3/2 of the load's error unless friction drops at once, so the tolerance of loads is rtol**(3/4)
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
        """Number of groups of memory that the statements need."""

    def opening(self) -> list[Statement]:
        """Load the values that the step needs besides the coefficients, such as parameters."""
        return []

    @abstractmethod
    def coefficients(self) -> list[Statement]:
        """Compute the coefficients of the states and of all series."""

    @abstractmethod
    def sizes(self) -> list[Statement]:
        """Compute the sizes of the last coefficients of the states."""

    def reach(self) -> list[Statement]:
        """Compute `reach`, the logarithm of (step length)/scale, from all sizes."""
        return [let("reach", reach(last_orders(self.order)))]

    @abstractmethod
    def new_state(self) -> list[Statement]:
        """Compute the new state and the sum `total` of its entries, which is NaN if any entry is."""

    @abstractmethod
    def rows(self) -> list[Statement]:
        """Compute the dense output."""


def check_order(order: int) -> None:
    """Raise ValueError for an order that is too small."""
    if order < LEAST_ORDER:
        raise ValueError(f"taylor: found order {order}; expected at least {LEAST_ORDER}")


def called(symbols: Collection[str]) -> dict[str, str]:
    """Return the names of symbols within the step: unchanged, unless the step uses the same name for a variable."""
    names: dict[str, str] = {}
    for symbol in sorted(symbols):
        name = symbol
        if symbol in WORDS or symbol.startswith(PREFIXES) or COUNTED.match(symbol):
            name = f"user_{symbol}"
            while name in symbols or name in names.values():
                name += "_"
        names[symbol] = name
    return names
