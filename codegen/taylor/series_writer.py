"""The series of a part of a step, and what a step does with them wherever their coefficients are: in names or in memory."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from ..program.expressions import ONE, ZERO, Expression, Name, Number, call
from ..program.statements import Statement, let
from .event_location import Stored, closed, told
from .series import Exponential, Kink, Order, Series, State
from .series_graph import SeriesGraph
from .simplify import absolute, largest, over, times, within
from .step_length import distant, last_orders, unseen


@dataclass(frozen=True, slots=True)
class Gaps:
    """The two gaps of a contact (`Event.gaps`), by its mode, and the sizes of the terms that they begin with.

    names: what these sizes are called; stuck: what is called 1 in stick, 0 in slip; room: memory for one of the series.
    """

    mode: str
    stuck: str
    series: tuple[Series, Series]
    names: tuple[str, str]
    sizes: tuple[Expression, Expression]
    room: Expression


@dataclass(eq=False)
class SeriesWriter(Order):
    """Series that are made together up to some order; it is what their recurrences ask.

    A step that is written out has its coefficients in names (`Lines`), one in loops has them in memory (`Section`).  kept:
    the names of what is computed once in a step; zeros: what is zero in all lanes.
    """

    graph: SeriesGraph
    order: int
    contacts: list[Gaps] = field(default_factory=list)
    kept: dict[str, None] = field(default_factory=dict)
    statements: list[Statement] = field(default_factory=list)
    zeros: ClassVar[Expression]

    # -- where coefficients are -------------------------------------------------------------------------------------

    @abstractmethod
    def at(self, series: Series, k: int) -> Expression:
        """Coefficient k of a series that has been made."""

    @abstractmethod
    def hold(self, series: Series, value: Expression, inline: bool) -> None:
        """Take up a coefficient of a series, which may be written where it is used."""

    @abstractmethod
    def recall(self, what: str) -> Expression:
        """What stands for the whole step."""

    @abstractmethod
    def note(self, what: str, value: Expression) -> Statement:
        """The statement that gives it a value."""

    @abstractmethod
    def signs(self, series: Series) -> list[Statement]:
        """The statements that find the `side` of a series by its coefficients but the first."""

    @abstractmethod
    def weight(self, what: str) -> Name:
        """What the weight of something is called."""

    @abstractmethod
    def enlarge(self, k: int, size: Expression) -> list[Statement]:
        """Let how large a last coefficient is count, in units of the error that it may have."""

    @abstractmethod
    def end_of(self, series: Series, what: str) -> tuple[list[Statement], Expression]:
        """The value of a series, but its last term, at the end of the step."""

    @abstractmethod
    def stored(self, series: Sequence[Series], sizes: Sequence[Expression]) -> tuple[list[Statement], list[Stored]]:
        """Where coefficients of some series stand in memory, and the statements that put them there."""

    def near(self, series: Series, ends: Sequence[Statement]) -> list[Statement]:
        """Statements that end the step where a series passes zero, to be run if it comes as far."""
        return list(ends)

    def run(self, statements: list[Statement]) -> list[Statement]:
        """Statements, if there are any, as often as the part has series of one kind."""
        return statements

    # -- coefficients -----------------------------------------------------------------------------------------------

    def put(self, *statements: Statement) -> None:
        """Append statements."""
        self.statements += statements

    def named(self, name: str, value: Expression) -> Expression:
        """A value under a name, unless it is a name or a number."""
        if isinstance(value, Name | Number):
            return value
        self.put(let(name, value))
        return Name(name)

    def make(self, series: Iterable[Series], first: bool) -> None:
        """Write coefficient 0 of some series, or a later one."""
        inlined = self.graph.inline_start if first else self.graph.inline
        for s in series:
            self.hold(s, s.begin(self) if first else s.coefficient(self), s in inlined)

    # -- sides of zero ----------------------------------------------------------------------------------------------

    def hint(self, series: Series) -> Expression:
        """The side of zero on which a series that begins at zero lies just after."""
        return self.recall(f"hint_{series.name}")

    @property
    def hints(self) -> list[str]:
        """What the sides of series that begin at zero are called."""
        return list(dict.fromkeys(f"hint_{kink.base.name}" for kink in self.graph.kinks))

    def unknown(self) -> list[Statement]:
        """The statements that forget these sides."""
        return self.run([self.note(hint, self.zeros) for hint in self.hints])

    def sides(self) -> list[Statement]:
        """The statements that take note of those that the coefficients tell."""
        return self.run([self.side(kink) for kink in self.graph.kinks])

    def side(self, kink: Kink) -> Statement:
        """The statement that takes note of one."""
        note = self.note(f"hint_{kink.base.name}", call("side_or", self.hint(kink.base), "new"))
        return told(self.recall(kink.name), self.signs(kink.base), note)

    # -- end of the step --------------------------------------------------------------------------------------------

    def lengths(self) -> list[Statement]:
        """The statements that make the step no longer than coefficients let it be, those of watched series apart."""
        found = [statement for s in self.graph.gaps for statement in self.counted(s)]
        for gaps in self.contacts:
            for s, name, size in zip(gaps.series, gaps.names, gaps.sizes, strict=True):
                found += self.weighed(s, name, Name("loose") * size)
        return found

    def watches(self) -> list[Statement]:
        """The statements that make it no longer than the watched series let it be."""
        return [s for w in self.graph.watched for s in unseen([self.at(w, k) for k in range(self.order)])]

    def distances(self) -> list[Statement]:
        """The statements that make it no longer than the way to where exponentials are seen that are too small now."""
        exponentials = [s for s in self.graph.series if isinstance(s, Exponential)]
        return self.run([statement for s in exponentials for statement in self.distance(s)])

    def distance(self, s: Exponential) -> list[Statement]:
        """The statements for one of them."""
        further = [times(Number(s.steepness), self.of_exponent(s, k)) for k in range(1, self.order)]
        return distant(self.recall(s.exponent), further)

    def of_exponent(self, series: Exponential, k: int) -> Expression:
        """Coefficient k > 0 of what a series is an exponential of."""
        return times(Number(1.0 / k), self.at(series.slope, k))

    def counted(self, series: Series) -> list[Statement]:
        """Let the last coefficients of a series count, in units of the error that it may have beside its low ones."""
        if all(self.at(series, k) == ZERO for k in last_orders(self.order)):
            return []
        return self.weighed(series, series.name, Name("rtol") * self.low(series))

    def low(self, series: Series) -> Expression:
        """The largest of the first coefficients of a series, at most the period of an angle."""
        found = largest(absolute(e) for k in range(3) if (e := self.at(series, k)) != ZERO)
        return within(found, series.period) if isinstance(series, State) else found

    def weighed(self, series: Series, what: str, error: Expression) -> list[Statement]:
        """Let the last coefficients of a series count, in units of an error beside the absolute tolerance."""
        weight = self.weight(what)
        found: list[Statement] = [let(weight.text, 1.0 / (Name("atol") + error))]
        for k in last_orders(self.order):
            if (e := self.at(series, k)) != ZERO:
                found += self.enlarge(k, times(absolute(e), weight))
        return found

    def passages(self, exact: bool) -> list[Statement]:
        """The statements that end the step where a series passes a kink or closes a contact."""
        found = list[Statement]()
        for kink in self.graph.kinks:
            found += self.passage(kink)
        for gaps in self.contacts:
            stores, both = self.stored(gaps.series, gaps.sizes)
            found += [*stores, *closed(gaps.mode, exact, both, gaps.stuck, gaps.room)]
        return self.run(found)

    def passage(self, kink: Kink) -> list[Statement]:
        """The statements that end the step where a series passes one kink."""
        stores, (stored,) = self.stored([kink.base], [self.recall(f"size_{kink.name}")])
        return self.near(kink.base, [*stores, *kink.passages(self.recall(kink.name), stored)])

    def broken(self) -> list[Statement]:
        """The statements that make the step NaN where a series passes zero that cannot: a root of a polynomial may be one."""
        found = list[Statement]()
        for which, s in enumerate(self.graph.positive):
            found += self.breaks(s, f"positive_{which}")
        return self.run(found)

    def breaks(self, s: Series, what: str) -> list[Statement]:
        """The statements that make the step NaN where one series passes zero."""
        value, end = self.end_of(s, what)
        share = over(end, times(ONE, self.at(s, 0)))
        return [*value, let("total", Name("total") + 0.0 * call("log", share))]
