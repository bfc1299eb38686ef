"""Parameters before they have values: default, unit, meaning, allowed range."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..inputs.checks import check_flag, check_keys, check_number, check_text, short_repr


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of the non-dimensional equations, whose value is set for each run.

    Parameters
    ----------
    default : float
        The non-dimensional value if a scene gives no other.
    unit : str
        The SI unit of the physical quantity of the parameter, such as "N/m"; "1" without a physical quantity.
    meaning : str
        A short description.
    minimum, maximum : float, optional
        The range, both ends included.
    positive : bool
        True if zero and negative values are not allowed.
    scale : str
        The physical amount of the value 1, in the physical symbols of the oscillator.  For example, a belt speed 0.1
        with the unit m/s and the scale g*sqrt(m)/sqrt(k) is 0.1 g sqrt(m/k) metres per second.

    Raises
    ------
    ValueError
        If the default is not finite or outside the range, and if the unit cannot be read.

    See Also
    --------
    synchain.Lagrangian
    synchain.Field

    Examples
    --------
    >>> import synchain as sc
    >>> sc.Parameter(0.5, "N*s/m")
    Parameter(default=0.5, unit='N*s/m', meaning='', minimum=None, maximum=None, positive=False, scale='1')
    """

    default: float
    unit: str = "1"
    meaning: str = ""
    minimum: float | None = None
    maximum: float | None = None
    positive: bool = False
    scale: str = "1"

    def __post_init__(self) -> None:
        dimension(self.unit)
        if self.minimum is not None and self.maximum is not None and self.minimum > self.maximum:
            raise ValueError(f"parameter range is empty: minimum {self.minimum} above maximum {self.maximum}")
        self.check(f"default of {self.meaning!r}" if self.meaning else "default", self.default)

    @classmethod
    def of_table(cls, what: str, table: Mapping[Any, object], keys: Sequence[str], **usual: object) -> Parameter:
        """Return the parameter from a table of arguments; arguments in `usual` may be missing.

        Raises ValueError or TypeError for names outside `keys`, for values of a wrong type and for a table without a
        default; the message begins with `what`.
        """
        check_keys(what, table, keys)
        if "default" not in table:
            raise ValueError(
                f"{what}: 'default' is missing in {short_repr(dict(table))}; expected a table with a default"
            )
        arguments = {**usual, **table}
        return cls(**{key: _CHECKS.get(key, check_text)(f"{what}: {key}", value) for key, value in arguments.items()})

    def check(self, name: str, value: float) -> float:
        """Return `value` as a float; raise ValueError outside the range, TypeError if it is not a number."""
        if isinstance(value, bool) or not hasattr(value, "__float__"):
            raise TypeError(f"{name} = {value!r} is no number; expected {self.range}")
        number = float(value)
        low = self.minimum is not None and number < self.minimum
        high = self.maximum is not None and number > self.maximum
        if not math.isfinite(number) or low or high or (self.positive and number <= 0):
            raise ValueError(f"{name} = {value} is not allowed; expected {self.range}")
        return number

    @property
    def range(self) -> str:
        """The allowed values, for messages."""
        limits = []
        if self.positive:
            limits.append("above 0")
        if self.minimum is not None and not (self.positive and self.minimum <= 0):
            limits.append(f"at least {self.minimum:g}")
        if self.maximum is not None:
            limits.append(f"at most {self.maximum:g}")
        return "a finite number" + (" " + " and ".join(limits) if limits else "")


_CHECKS: Mapping[str, Callable[[str, object], Any]] = {
    "default": check_number,
    "minimum": check_number,
    "maximum": check_number,
    "positive": check_flag,
}
"""Check functions of the arguments that are not texts."""

Dimension = tuple[int, int, int]
"""Powers of (kg, m, s)."""

UNITS: dict[str, Dimension] = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
}


def dimension(unit: str) -> Dimension:
    """Return the powers of (kg, m, s) in a unit such as ``N/m``, ``kg*m/s^2`` or ``1``.

    Raises ValueError for a name other than kg, m, s, N, rad, 1 and for a power that is not an integer.  Raises
    TypeError for a value that is no text.
    """
    if not isinstance(unit, str):
        raise TypeError(f"unit {unit!r} is a {type(unit).__name__}; expected text such as 'N/m' or '1'")
    total = [0, 0, 0]
    # Products and quotients from left to right, each factor with an integer power.
    for sign, factor in re.findall(r"(^|[*/])([^*/]*)", unit.replace(" ", "")):
        name, raised, power = factor.partition("^")
        if name not in UNITS or (raised and not re.fullmatch(r"-?[0-9]+", power)):
            raise ValueError(
                f"unit {unit!r}: cannot read {factor!r}; expected products and quotients of "
                f"{', '.join(UNITS)} with integer powers, such as 'N/m' or 'kg*m/s^2'"
            )
        times = int(power or 1) * (-1 if sign == "/" else 1)
        total = [sum_of + times * exponent for sum_of, exponent in zip(total, UNITS[name], strict=True)]
    return (total[0], total[1], total[2])


def defaults_text(parameters: Mapping[str, Parameter]) -> str:
    """Return "; a = 1, b = 2" of parameters with their defaults; empty without any."""
    values = ", ".join(f"{name} = {each.default:g}" for name, each in parameters.items())
    return f"; {values}" if values else ""
