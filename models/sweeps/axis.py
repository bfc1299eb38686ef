"""One axis of a sweep: the name of a parameter or an initial state, and its values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sized
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice

from ..inputs.checks import check_integer, check_keys, check_number, check_text, short_repr

LIMIT = 10_000_000  # most values on one axis: a choice that bounds the memory of a scene


@dataclass(frozen=True, slots=True)
class Axis:
    """A parameter ("sigma") or an initial state ("x_1") and its values in the order of the sweep.

    `values` may be any iterable of finite numbers, such as a NumPy array, and is stored as a tuple of floats.
    Raises TypeError or ValueError for an empty axis, for more than LIMIT values, and for values that are no finite
    numbers.

    See Also
    --------
    synchain.Scene
    synchain.run

    Examples
    --------
    >>> from synchain import Axis
    >>> Axis("sigma", [0.1, 0.2])
    Axis('sigma', [0.1, 0.2])
    >>> Axis.between("omega", 0, 1, 5).values
    (0.0, 0.25, 0.5, 0.75, 1.0)
    """

    name: str
    values: tuple[float, ...]

    def __init__(self, name: str, values: Iterable[float]) -> None:
        object.__setattr__(self, "name", check_text("axis name", name))
        object.__setattr__(self, "values", _values(self.name, values))

    @classmethod
    def between(cls, name: str, first: float, last: float, count: int) -> Axis:
        """Return an axis of `count` equally spaced values from first to last: exact decimals, rounded to the nearest floats."""
        what = f"axis {name}"
        ends = [Fraction(repr(check_number(f"{what}: {end}", value))) for end, value in (("from", first), ("to", last))]
        size = check_integer(f"{what}: count", count, 1, LIMIT)
        if size == 1 and ends[0] != ends[1]:
            raise ValueError(f"{what}: count = 1 with two different ends; expected at least 2 values; raise count")
        return cls(name, _spaced(ends[0], ends[1], size))

    @classmethod
    def from_table(cls, name: str, values: object) -> Axis:
        """Return the axis of a scene file: a list of numbers or {from = …, to = …, count = …}."""
        if not isinstance(values, Mapping):
            return cls(name, values)  # type: ignore[arg-type]  # checked at birth
        check_keys(f"axis {name}", values, ("from", "to", "count"))
        missing = [key for key in ("from", "to", "count") if key not in values]
        if missing:
            raise ValueError(
                f"axis {name}: {missing[0]!r} is missing in {short_repr(dict(values))}; expected {{from, to, count}}"
            )
        return cls.between(name, values["from"], values["to"], values["count"])

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        if len(self.values) < 5:
            return f"Axis({self.name!r}, {list(self.values)})"
        return f"Axis({self.name!r}, {len(self.values)} values from {self.values[0]:g} to {self.values[-1]:g})"


def known_length(values: object) -> int:
    """Return the number of values of an axis in a table without computing the values; 1 if the number is not known."""
    size = values.get("count") if isinstance(values, Mapping) else len(values) if isinstance(values, Sized) else 1
    return size if isinstance(size, int) and 0 < size <= LIMIT else 1


def thinned(axis: Axis, most: int | None) -> Axis:
    """Return an axis with at most `most` of its values, evenly spread and with both ends; None keeps all values."""
    if most is None or len(axis) <= most:
        return axis
    last = len(axis) - 1
    return Axis(axis.name, [axis.values[round(k * (last / (most - 1)))] for k in range(most)])


def _spaced(first: Fraction, last: Fraction, count: int) -> Iterator[float]:
    """Yield equally spaced values; integers over one denominator, so that each value is rounded only once."""
    base = first.denominator * last.denominator
    a, b = first.numerator * last.denominator, last.numerator * first.denominator
    steps = max(count - 1, 1)
    return ((a * (steps - i) + b * i) / (base * steps) for i in range(count))


def _values(name: str, values: object) -> tuple[float, ...]:
    what = f"axis {name}"
    if getattr(values, "ndim", 1) > 1:
        shape = getattr(values, "shape", "")
        raise ValueError(f"{what}: found an array of shape {shape}; expected one row of numbers, e.g. its ravel()")
    listed = values.tolist() if hasattr(values, "tolist") else values
    if isinstance(listed, (str, bytes, Mapping)) or not isinstance(listed, Iterable):
        raise TypeError(f"{what}: found {short_repr(values)}; expected a list of numbers, e.g. [0.1, 0.2]")
    if isinstance(listed, (set, frozenset)):
        raise TypeError(f"{what}: found a set, which has no order; expected a list of numbers")
    floats = tuple(check_number(what, value) for value in islice(listed, LIMIT + 1))
    if len(floats) > LIMIT:
        raise ValueError(f"{what}: more than {LIMIT} values; expected at most {LIMIT}; split the sweep")
    if not floats:
        raise ValueError(f"{what}: no values; expected at least one number; leave the axis out or fill it")
    return floats
