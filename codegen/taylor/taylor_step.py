"""One Taylor step as a program, whatever holds the coefficients: names or memory."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Name
from ..program.passes import real
from ..program.printers import LANES
from ..program.statements import Comment, Function, If, Return, Role, Statement, let, operations
from .event_location import first_passage, functions, jumps, loose, settled
from .series import Time
from .series_graph import STARTS
from .series_writer import SeriesWriter
from .step_length import finished, last_orders, reach

WORDS = frozenset(
    {"unseen", "high", "low", "largest", "scale", "ratio", "reach", "length", "total", "raised", "square", "power", "weight", "number", "inverse", "LINKS", "TERMS", "j_there",
     "slope_scale", "convolution", "passed", "until", "passage", "side_of", "PASSED", "ROUNDING", "NEAREST", "nearest", "loose", "closing", "side_or", "found_side", "news", "new", "floor", "value", "stuck", "side", "way", "room", *STARTS.values()}
)  # fmt: skip
PREFIXES = ("positive_", "i_", "e_", "half_", "w_", "n_", "size_", "odd_", "stuck_", "hint_")
"""Names of the step; a user's symbol of that name is called otherwise within the step."""

COUNTED = re.compile(r"[rs]\d+$")

ARGUMENTS = ("t", "h", "scale", "y", "p", "y_new", "dense", "rtol", "atol")


@dataclass(frozen=True, slots=True)
class TaylorStep:
    """The function `step` and what a kernel must know of it.

    order: that of the series, and the number of rows of the dense output; workspace: the groups of memory that it needs
    behind the dense output; called: the text of functions that it calls; table: what it reads in the array `where`.
    """

    function: Function
    order: int
    workspace: int
    called: tuple[str, ...] = ()
    table: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        """The step and what it calls, as a kernel has them."""
        return "\n\n\n".join([*self.called, LANES.function(self.function)])

    @property
    def operations(self) -> int:
        """The number of additions, multiplications and divisions of the step."""
        return operations(self.function.body)


class StepWriter(ABC):
    """Writes the step of some order for tidy equations.

    The steps of all networks are alike.  `Unrolled` makes the coefficients of all series one after another, in names,
    `Looped` has them in memory and runs over orders, nodes and links.  `parts` are those of its series that it makes
    together.
    """

    parts: Sequence[SeriesWriter]
    functions: Sequence[str] = ()

    def __init__(self, equations: Equations, order: int, words: Collection[str]) -> None:
        self.equations, self.order, self.exact = equations, order, jumps(equations)
        self.called, self.time = called(words), Time(name="t")
        self.swap: dict[sp.Symbol, sp.Expr] = {real(old): real(new) for old, new in self.called.items()}

    def step(self, *more: str) -> TaylorStep:
        """The step, which takes `more` arguments."""
        body, arguments = tuple(self.statements()), (*ARGUMENTS, *more)
        about = (
            "One step from (t, y): writes y_new and the dense output, returns its length and how far its series reach."
        )
        function = Function("step", arguments, about, body, Role.ENTRY)
        return TaylorStep(function, self.order, self.workspace, (*functions(body), *self.functions))

    def statements(self) -> list[Statement]:
        """What the step does."""
        coefficients = self.coefficients()
        unknown = [s for part in self.parts for s in part.unknown()]
        sides = [s for part in self.parts for s in part.sides()]
        passages = first_passage([s for part in self.parts for s in part.passages(self.exact)])
        far = Name("length") + 0.0 * Name("total")
        return [
            *self.opening(),
            *settled(unknown, coefficients, sides),
            Comment("step length"),
            *self.sizes(),
            *([loose(self.exact)] if self.equations.sticks else []),
            *(s for part in self.parts for s in part.lengths()),
            *self.reach(),
            *finished(self.order, self.watching, self.equations.sticks),
            *(s for part in self.parts for s in part.distances()),
            *passages,
            Comment("new state"),
            *self.new_state(),
            *(s for part in self.parts for s in part.broken()),
            If(Name("DENSE"), tuple(self.rows())),
            Return((Name("until" if passages else "length"), far), "NaN where any coefficient is infinite or NaN"),
        ]

    @property
    def watching(self) -> bool:
        """True if any series is watched."""
        return any(part.graph.watched for part in self.parts)

    @property
    @abstractmethod
    def workspace(self) -> int:
        """The groups of memory that the statements need."""

    def opening(self) -> list[Statement]:
        """Load what the step needs beside its coefficients."""
        return []

    @abstractmethod
    def coefficients(self) -> list[Statement]:
        """Make the coefficients of the states and of all series."""

    @abstractmethod
    def sizes(self) -> list[Statement]:
        """Let the last coefficients of the states count."""

    def reach(self) -> list[Statement]:
        """How far the step may go by all that counts."""
        return [let("reach", reach(last_orders(self.order)))]

    @abstractmethod
    def new_state(self) -> list[Statement]:
        """Compute the new state and its total."""

    @abstractmethod
    def rows(self) -> list[Statement]:
        """Compute the dense output."""


def check_order(order: int) -> None:
    """Raise ValueError for an order that is too small."""
    if order < 6:
        raise ValueError(f"taylor: found order {order}; expected at least 6")


def called(words: Collection[str]) -> dict[str, str]:
    """What symbols are called within the step: as they are, unless the step needs that name itself."""
    found: dict[str, str] = {}
    for word in sorted(words):
        name = word
        if word in WORDS or word.startswith(PREFIXES) or COUNTED.match(word):
            name = f"user_{word}"
            while name in words or name in found.values():
                name += "_"
        found[word] = name
    return found
