"""Write the statements for a group of series; subclasses store coefficients in named variables or in memory.

A writer is the `Order` that recurrences use.  `make` writes coefficients.  The other methods return the statements that
follow the coefficients: signs of kinks, sizes that limit the step, passages, checks.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from ..program.expressions import ONE, ZERO, Compare, Expression, Name, Number, call
from ..program.statements import If, Statement, let
from .event_location import Stored, closings
from .series import Exponential, Kink, Order, Series, State
from .series_graph import SeriesGraph
from .simplify import absolute, largest, over, times, within
from .step_length import distant, last_orders, unseen


@dataclass(frozen=True, slots=True)
class Gaps:
    """Taylor series of the gaps of a contact or row (`Event.gaps`), its mode, and sizes of the terms of coefficient 0.

    The sizes bound rounding errors.

    names: variables that hold the sizes; stuck: variable that is 1 in stick and 0 in slip; room: memory for the
    series of one gap; rounds: searches for a passage.
    """

    mode: str
    stuck: str
    series: tuple[Series, ...]
    names: tuple[str, ...]
    sizes: tuple[Expression, ...]
    room: Expression
    rounds: int = 1


@dataclass(eq=False)
class SeriesWriter(Order):
    """A group of series that are computed together up to some order.

    `Lines` (written-out steps) stores coefficients in named variables; `SeriesLoop` (looped steps) stores them in
    memory. saved: the names of values that a step computes once; zeros: an expression that is zero in all lanes.
    """

    graph: SeriesGraph
    order: int
    contacts: list[Gaps] = field(default_factory=list)
    saved: dict[str, None] = field(default_factory=dict)
    statements: list[Statement] = field(default_factory=list)
    zeros: ClassVar[Expression]

    # -- where coefficients are -------------------------------------------------------------------------------------

    @abstractmethod
    def at(self, series: Series, k: int) -> Expression:
        """Return coefficient k of a series, which must have been written before."""

    @abstractmethod
    def define(self, series: Series, value: Expression, inline: bool) -> None:
        """Set the coefficient of a series to a value; if `inline`, the value is written where it is used."""

    @abstractmethod
    def recall(self, name: str) -> Expression:
        """Return a value that was saved for the whole step."""

    @abstractmethod
    def assign(self, name: str, value: Expression) -> Statement:
        """Return the statement that saves a value for the whole step."""

    @abstractmethod
    def signs(self, series: Series) -> list[Statement]:
        """Return the statements that set `side` to the sign of a series' first nonzero coefficient from order 1 on."""

    @abstractmethod
    def weight(self, name: str) -> Name:
        """Return the name of the variable with the weight of a series."""

    @abstractmethod
    def add_size(self, k: int, size: Expression) -> list[Statement]:
        """Let a coefficient of order k limit the step; `size` is the coefficient in units of its allowed error."""

    @abstractmethod
    def end_value(self, series: Series, name: str) -> tuple[list[Statement], Expression]:
        """Return the value of a series, without its last term, at the end of the step."""

    @abstractmethod
    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        """Return statements that store the coefficients of series in memory, and the positions in memory."""

    def near(self, series: Series, passages: Sequence[Statement]) -> list[Statement]:
        """Return the passages of a series, guarded by a test if the series can reach zero in this step."""
        return list(passages)

    def in_loop(self, statements: list[Statement]) -> list[Statement]:
        """Return statements in the loop of the section, if there is one, so that they run for each node or link."""
        return statements

    # -- coefficients -----------------------------------------------------------------------------------------------

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def named(self, name: str, value: Expression) -> Expression:
        """Assign a value to a variable and return the name; return a name or a number unchanged."""
        if isinstance(value, Name | Number):
            return value
        self.put(let(name, value))
        return Name(name)

    def make(self, series: Iterable[Series], first: bool) -> None:
        """Write coefficient 0 of the series if `first`, else coefficient k."""
        inlined = self.graph.inline_start if first else self.graph.inline
        for s in series:
            self.define(s, s.begin(self) if first else s.coefficient(self), s in inlined)

    # -- sides of zero ----------------------------------------------------------------------------------------------

    def hint(self, series: Series) -> Expression:
        return self.recall(f"hint_{series.name}")

    @property
    def hints(self) -> list[str]:
        """The names of the variables with the signs of series that begin at zero."""
        return list(dict.fromkeys(f"hint_{kink.base.name}" for kink in self.graph.kinks))

    def forget_sides(self) -> list[Statement]:
        return self.in_loop([self.assign(hint, self.zeros) for hint in self.hints])

    def find_sides(self) -> list[Statement]:
        """Return the statements that save the signs of series that begin at zero, found from their coefficients."""
        return self.in_loop([self.find_side(kink) for kink in self.graph.kinks])

    def find_side(self, kink: Kink) -> Statement:
        """Return the statement that saves the sign of the series of one kink, if the series begins at zero."""
        begun = self.recall(kink.name)
        side = [
            let("side", 0.0 * Name("t")),
            *self.signs(kink.base),
            let("new", call("found_side", begun, "side")),
            let("news", Name("news") + absolute(Name("new"))),
            self.assign(f"hint_{kink.base.name}", call("side_or", self.hint(kink.base), "new")),
        ]
        return If(call("any_lane", Compare("<", absolute(begun), Number(0.5))), tuple(side))

    # -- step length ------------------------------------------------------------------------------------------------

    def lengths(self) -> list[Statement]:
        """Return the statements that let the gaps of kinks and contacts limit the step."""
        statements = [statement for s in self.graph.gaps for statement in self.counted(s)]
        for gaps in self.contacts:
            for s, name, size in zip(gaps.series, gaps.names, gaps.sizes, strict=True):
                statements += self.weighed(s, name, Name("loose") * size)
        return statements

    def watches(self) -> list[Statement]:
        """Return the statements that let the watched series limit the step."""
        return [s for w in self.graph.watched for s in unseen([self.at(w, k) for k in range(self.order)])]

    def distances(self) -> list[Statement]:
        """Return the statements that end the step before an exponential rises that is zero in double precision now."""
        exponentials = [s for s in self.graph.series if isinstance(s, Exponential)]
        return self.in_loop([statement for s in exponentials for statement in self.distance(s)])

    def distance(self, s: Exponential) -> list[Statement]:
        exponents = [times(Number(s.steepness), self.of_exponent(s, k)) for k in range(1, self.order)]
        return distant(self.recall(s.exponent), exponents)

    def of_exponent(self, series: Exponential, k: int) -> Expression:
        """Return coefficient k > 0 of the argument of an exponential."""
        return times(Number(1.0 / k), self.at(series.slope, k))

    def counted(self, series: Series) -> list[Statement]:
        """Let the last coefficients of a series limit the step; the tolerance is relative to the low coefficients."""
        if all(self.at(series, k) == ZERO for k in last_orders(self.order)):
            return []
        return self.weighed(series, series.name, Name("rtol") * self.low(series))

    def low(self, series: Series) -> Expression:
        """Return the largest of a series' first three absolute coefficients; at most the period for an angle."""
        size = largest(absolute(e) for k in range(3) if (e := self.at(series, k)) != ZERO)
        return within(size, series.period) if isinstance(series, State) else size

    def weighed(self, series: Series, name: str, error: Expression) -> list[Statement]:
        """Let the last coefficients of a series limit the step, in units of atol + error."""
        weight = self.weight(name)
        statements: list[Statement] = [let(weight.text, 1.0 / (Name("atol") + error))]
        for k in last_orders(self.order):
            if (e := self.at(series, k)) != ZERO:
                statements += self.add_size(k, times(absolute(e), weight))
        return statements

    # -- end of the step --------------------------------------------------------------------------------------------

    def passages(self, exact: bool) -> list[Statement]:
        """Return the statements that end the step where a series reaches a kink or a gap of a contact closes."""
        statements = [statement for kink in self.graph.kinks for statement in self.passage(kink)]
        for gaps in self.contacts:
            stores, both = self.stored(gaps.series, gaps.sizes)
            statements += [*stores, *closings(gaps.mode, exact, both, gaps.stuck, gaps.room, gaps.rounds)]
        return self.in_loop(statements)

    def passage(self, kink: Kink) -> list[Statement]:
        """Return the statements that end the step where the series of one kink passes zero."""
        stores, (stored,) = self.stored([kink.base], [self.recall(f"size_{kink.name}")])
        return self.near(kink.base, [*stores, *kink.passages(self.recall(kink.name), stored)])

    def broken(self) -> list[Statement]:
        """Return the statements that make the step NaN if a series passes zero that must stay positive.

        The truncated series of a root, or of the argument of a logarithm, can pass zero, although the function cannot.
        """
        positive = enumerate(self.graph.positive)
        return self.in_loop([statement for k, s in positive for statement in self.breaks(s, f"positive_{k}")])

    def breaks(self, s: Series, name: str) -> list[Statement]:
        """Return the statements that make the step NaN if one series passes zero: the logarithm of end/start."""
        statements, end = self.end_value(s, name)
        share = over(end, times(ONE, self.at(s, 0)))
        return [*statements, let("total", Name("total") + 0.0 * call("log", share))]
