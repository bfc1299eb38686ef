"""What is known about a parameter before it has a value: default, unit, meaning, allowed range."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .units import dimension

__all__ = ["Parameter"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number of the non-dimensional equations that gets its value at run time.

    `default`, `minimum` and `maximum` are non-dimensional.  `unit` is the SI unit of the physical quantity behind
    the number, and `scale` says, in the physical symbols of the oscillator, how much of that quantity the value 1
    stands for: a belt speed theta_b = 0.1 with unit m/s and scale g*sqrt(m)/sqrt(k) is 0.1 g sqrt(m/k) metres per
    second.  Both ends of the range are allowed values, except zero where `positive` is set.

    Raises ValueError where the default is not finite or outside the range, or where the unit cannot be read.
    """

    default: float
    unit: str
    meaning: str
    minimum: float | None = None
    maximum: float | None = None
    positive: bool = False
    scale: str = "1"

    def __post_init__(self) -> None:
        dimension(self.unit)
        if not self.meaning.strip():
            raise ValueError("a parameter has no meaning; expected a phrase that says what it is")
        if self.minimum is not None and self.maximum is not None and self.minimum > self.maximum:
            raise ValueError(f"parameter range is empty: minimum {self.minimum} above maximum {self.maximum}")
        self.check(f"default of {self.meaning!r}", self.default)

    def check(self, name: str, value: float) -> float:
        """Return `value` as a float, or raise ValueError (TypeError: no number) that names it and the range."""
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
        """The allowed values in words."""
        words = []
        if self.positive:
            words.append("above 0")
        if self.minimum is not None and not (self.positive and self.minimum <= 0):
            words.append(f"at least {self.minimum:g}")
        if self.maximum is not None:
            words.append(f"at most {self.maximum:g}")
        return "a finite number" + (" " + " and ".join(words) if words else "")
