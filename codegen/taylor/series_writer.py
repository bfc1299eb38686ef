"""What a step does with the series that it makes together, wherever their coefficients are: in names or in memory.

A writer is the `Order` that recurrences use.  `make` writes coefficients; the other methods return the statements that follow
them: sides of kinks, sizes that limit the step, passages, checks.
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
    """The two gaps of a contact (`Event.gaps`), by its mode, and the sizes of the terms that they begin with.

    names: of these sizes; stuck: the name of what is 1 in stick, 0 in slip; room: memory for one of the series.
    """

    mode: str
    stuck: str
    series: tuple[Series, Series]
    names: tuple[str, str]
    sizes: tuple[Expression, Expression]
    room: Expression


@dataclass(eq=False)
class SeriesWriter(Order):
    """Series that are made together up to some order.

    `Lines` of a step that is written out has its coefficients in names, `SeriesLoop` of one in loops has them in memory.
    saved: the names of what is computed once in a step; zeros: an expression that is zero in all lanes.
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
        """Return coefficient k of a series that has been made."""

    @abstractmethod
    def define(self, series: Series, value: Expression, inline: bool) -> None:
        """Give the coefficient of a series its value, which may be written where it is used."""

    @abstractmethod
    def recall(self, name: str) -> Expression:
        """Return a value that is saved for the whole step."""

    @abstractmethod
    def assign(self, name: str, value: Expression) -> Statement:
        """Return the statement that saves a value for the whole step."""

    @abstractmethod
    def signs(self, series: Series) -> list[Statement]:
        """Return the statements that find the `side` of a series by its coefficients from order 1 on."""

    @abstractmethod
    def weight(self, name: str) -> Name:
        """Return the name of the weight of a series."""

    @abstractmethod
    def add_size(self, k: int, size: Expression) -> list[Statement]:
        """Let the size of a coefficient of order k, in units of the error that it may have, limit the step."""

    @abstractmethod
    def end_value(self, series: Series, name: str) -> tuple[list[Statement], Expression]:
        """Return the value of a series, without its last term, at the end of the step."""

    @abstractmethod
    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        """Return where coefficients of some series are in memory, and the statements that store them there."""

    def near(self, series: Series, passages: Sequence[Statement]) -> list[Statement]:
        """Return the passages of a series, to be run if the series comes as far as zero."""
        return list(passages)

    def in_loop(self, statements: list[Statement]) -> list[Statement]:
        """Return statements as often as the part has series of one kind."""
        return statements

    # -- coefficients -----------------------------------------------------------------------------------------------

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def named(self, name: str, value: Expression) -> Expression:
        """Return a value under a name, unless it is a name or a number."""
        if isinstance(value, Name | Number):
            return value
        self.put(let(name, value))
        return Name(name)

    def make(self, series: Iterable[Series], first: bool) -> None:
        """Write coefficient 0 of some series, or a later one."""
        inlined = self.graph.inline_start if first else self.graph.inline
        for s in series:
            self.define(s, s.begin(self) if first else s.coefficient(self), s in inlined)

    # -- sides of zero ----------------------------------------------------------------------------------------------

    def hint(self, series: Series) -> Expression:
        return self.recall(f"hint_{series.name}")

    @property
    def hints(self) -> list[str]:
        """Return the names of the sides of series that begin at zero."""
        return list(dict.fromkeys(f"hint_{kink.base.name}" for kink in self.graph.kinks))

    def forget_sides(self) -> list[Statement]:
        return self.in_loop([self.assign(hint, self.zeros) for hint in self.hints])

    def find_sides(self) -> list[Statement]:
        """Return the statements that save the sides which coefficients show."""
        return self.in_loop([self.find_side(kink) for kink in self.graph.kinks])

    def find_side(self, kink: Kink) -> Statement:
        """Return the statement that saves the side of one kink whose series begins at zero."""
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
        """Return the statements by which the gaps of kinks and contacts limit the step."""
        statements = [statement for s in self.graph.gaps for statement in self.counted(s)]
        for gaps in self.contacts:
            for s, name, size in zip(gaps.series, gaps.names, gaps.sizes, strict=True):
                statements += self.weighed(s, name, Name("loose") * size)
        return statements

    def watches(self) -> list[Statement]:
        """Return the statements by which the watched series limit the step."""
        return [s for w in self.graph.watched for s in unseen([self.at(w, k) for k in range(self.order)])]

    def distances(self) -> list[Statement]:
        """Return the statements that end the step before exponentials rise which are too small to be seen."""
        exponentials = [s for s in self.graph.series if isinstance(s, Exponential)]
        return self.in_loop([statement for s in exponentials for statement in self.distance(s)])

    def distance(self, s: Exponential) -> list[Statement]:
        exponents = [times(Number(s.steepness), self.of_exponent(s, k)) for k in range(1, self.order)]
        return distant(self.recall(s.exponent), exponents)

    def of_exponent(self, series: Exponential, k: int) -> Expression:
        """Return coefficient k > 0 of the argument of an exponential."""
        return times(Number(1.0 / k), self.at(series.slope, k))

    def counted(self, series: Series) -> list[Statement]:
        """Let the last coefficients of a series limit the step, by the relative tolerance of its low ones."""
        if all(self.at(series, k) == ZERO for k in last_orders(self.order)):
            return []
        return self.weighed(series, series.name, Name("rtol") * self.low(series))

    def low(self, series: Series) -> Expression:
        """Return the largest of the first three coefficients of a series, at most the period of an angle."""
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
        """Return the statements that end the step where a series passes a kink or closes a contact."""
        statements = [statement for kink in self.graph.kinks for statement in self.passage(kink)]
        for gaps in self.contacts:
            stores, both = self.stored(gaps.series, gaps.sizes)
            statements += [*stores, *closings(gaps.mode, exact, both, gaps.stuck, gaps.room)]
        return self.in_loop(statements)

    def passage(self, kink: Kink) -> list[Statement]:
        """Return the statements that end the step where a series passes one kink."""
        stores, (stored,) = self.stored([kink.base], [self.recall(f"size_{kink.name}")])
        return self.near(kink.base, [*stores, *kink.passages(self.recall(kink.name), stored)])

    def broken(self) -> list[Statement]:
        """Return the statements that make the step NaN where a series passes zero that cannot.

        The polynomial that a step sums can pass zero where a root or the argument of a logarithm cannot.
        """
        positive = enumerate(self.graph.positive)
        return self.in_loop([statement for k, s in positive for statement in self.breaks(s, f"positive_{k}")])

    def breaks(self, s: Series, name: str) -> list[Statement]:
        """Return the statements that make the step NaN where one series passes zero: log of a negative share."""
        statements, end = self.end_value(s, name)
        share = over(end, times(ONE, self.at(s, 0)))
        return [*statements, let("total", Name("total") + 0.0 * call("log", share))]
