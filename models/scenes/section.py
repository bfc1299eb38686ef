"""The surface of a Poincaré section: a state, or a function of the states, crosses a level."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from ..dynamics.observable_text import LENGTH, as_value
from ..inputs.checks import check_keys, check_number, check_table, check_text, short_repr
from ..inputs.words import Word


class Direction(Word):
    """Direction in which a state crosses a level."""

    FALLING = "falling"
    RISING = "rising"
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class Section:
    """A state, or a function of the states, passes `level`: falling (from above), rising or both.

    Parameters
    ----------
    variable : str or Expr
        A state such as "v_1"; in the `sections` of a scene any function of states, parameters and t.
    direction : Direction or str
    level : float
    keep : iterable of str or Expr, optional
        Expressions that are stored at each point beside the time; all states if left out.  An expression of the states
        of one node, such as "x", is stored for each node.

    Raises
    ------
    ValueError, TypeError
        For an unknown direction, a level that is no finite number, or an expression that cannot be read.

    See Also
    --------
    synchain.Scene
    synchain.run

    Examples
    --------
    >>> import synchain as sc
    >>> sc.Section("x_1", direction="rising", level=0.5)
    Section(variable='x_1', direction='rising', level=0.5, keep=None)
    """

    variable: str
    direction: Direction = Direction.FALLING
    level: float = 0.0
    keep: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.variable, sp.Expr):
            object.__setattr__(self, "variable", _text("section", self.variable))
        check_text("section variable", self.variable, LENGTH)
        object.__setattr__(self, "direction", Direction.parse("section direction", self.direction))
        object.__setattr__(self, "level", check_number("section level", self.level))
        if self.keep is not None:
            exprs = (self.keep,) if isinstance(self.keep, str | sp.Expr) else self.keep
            if not isinstance(exprs, Iterable):
                raise TypeError(f"section keep: found {short_repr(exprs)}; expected expressions, such as ('v', 'x_1')")
            object.__setattr__(self, "keep", tuple(_text("section keep", e) for e in exprs))

    @classmethod
    def parse(cls, text: object) -> Section:
        """Return the section of a text such as "v_1 falling" or "x_2 rising 0.1"; return a Section unchanged."""
        if isinstance(text, Section):
            return text
        parts = check_text("section", text).split(maxsplit=2)
        if len(parts) < 2:
            raise ValueError(f"section {text!r}: expected 'state direction [level]', e.g. 'v_1 falling'")
        return cls(
            parts[0],
            Direction.parse("section direction", parts[1]),
            check_number("section level", parts[2]) if len(parts) > 2 else 0.0,
        )

    @classmethod
    def of_table(cls, what: str, value: object) -> Section:
        """Return the section of a table {function, direction, level, keep}; return a Section unchanged."""
        if isinstance(value, Section):
            return value
        table = check_table(what, value)
        check_keys(what, table, ("function", "direction", "level", "keep"))
        if "function" not in table:
            raise ValueError(f"{what}: found {short_repr(dict(table))}; expected function = 'x_1 - x_2'")
        direction, level = table.get("direction", Direction.FALLING), table.get("level", 0.0)
        return cls(table["function"], direction, level, table.get("keep"))  # type: ignore[arg-type]

    def as_table(self) -> dict[str, object]:
        """Return the section as a table in JSON types."""
        level = {"level": self.level} if self.level else {}
        keep = {} if self.keep is None else {"keep": list(self.keep)}
        return {"function": self.variable, "direction": str(self.direction), **level, **keep}

    def __str__(self) -> str:
        return f"{self.variable} {self.direction}" + (f" {self.level!r}" if self.level else "")


def _text(what: str, value: object) -> str:
    """Return the text of an expression, with its terms in lexicographic order."""
    return str(sp.sstr(as_value(what, value), order="lex"))
