"""Normal, uniform and Lorentzian distributions, as values and as text."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import NoReturn

from ..inputs.arithmetic import constant
from ..inputs.checks import check_number, check_positive, check_text, short_repr
from ..inputs.reader import Algebra, NoMeaning, parse, unpaired
from ..inputs.words import Word

# List of all distributions for messages.
KNOWN = "normal(mean, deviation), uniform(low, high), lorentzian(centre, half width)"


class Distribution(Word):
    NORMAL = "normal"
    UNIFORM = "uniform"
    LORENTZIAN = "lorentzian"


@dataclass(frozen=True, slots=True)
class Draw:
    """A distribution: normal (mean, standard deviation), uniform (low, high) or Lorentzian (centre, half width).

    Raises ValueError or TypeError if a parameter is no finite number, if a deviation or half width is not positive, and
    if low is not below high.

    Examples
    --------
    >>> from synchain.draw import normal, uniform
    >>> print(normal(0, 1), uniform(-1, 1))
    normal(0.0, 1.0) uniform(-1.0, 1.0)
    """

    distribution: Distribution
    first: float
    second: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "distribution", Distribution.parse("draw", self.distribution))
        object.__setattr__(self, "first", check_number(f"{self.distribution}: first", self.first))
        object.__setattr__(self, "second", check_number(f"{self.distribution}: second", self.second))
        if self.distribution is Distribution.NORMAL:
            check_positive("normal: standard deviation", self.second)
        elif self.distribution is Distribution.LORENTZIAN:
            check_positive("lorentzian: half width", self.second)
        elif not self.first < self.second:
            raise ValueError(f"uniform: found the ends {self.first!r} and {self.second!r}; expected rising ends")

    def value(self, chance: float) -> float:
        """Return the quantile: a random number lies below this value with the probability `chance`."""
        if self.distribution is Distribution.NORMAL:
            return NormalDist(self.first, self.second).inv_cdf(chance)
        if self.distribution is Distribution.LORENTZIAN:
            return self.first + self.second * math.tan(math.pi * (chance - 0.5))
        return self.first + (self.second - self.first) * chance

    def __str__(self) -> str:
        return f"{self.distribution}({self.first!r}, {self.second!r})"


def normal(mean: float, deviation: float) -> Draw:
    """Return the normal distribution of a mean and a standard deviation.

    See Also
    --------
    synchain.draw.uniform
    synchain.draw.lorentzian
    synchain.run

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("van_der_pol", "x->x", sc.graphs.ring(5), record=())
    >>> result = sc.run(scene, realisations=3, draws={"x": sc.draw.normal(0, 0.1)}, rng=1)
    >>> result.data.sizes["realisation"]
    3
    """
    return Draw(Distribution.NORMAL, mean, deviation)


def uniform(low: float, high: float) -> Draw:
    """Return the uniform distribution between two numbers.

    See Also
    --------
    synchain.draw.normal
    synchain.draw.lorentzian
    synchain.run

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("van_der_pol", "x->x", sc.graphs.ring(5), record=())
    >>> draws = {"x": sc.draw.uniform(-2, 2)}
    >>> sc.run(scene, realisations=3, draws=draws, rng=1, show_progress=False).data.sizes["realisation"]
    3
    """
    return Draw(Distribution.UNIFORM, low, high)


def lorentzian(centre: float, half_width: float) -> Draw:
    """Return the Lorentz (Cauchy) distribution of a centre and a half width at half maximum.

    See Also
    --------
    synchain.draw.normal
    synchain.draw.uniform
    synchain.run

    Examples
    --------
    >>> import synchain as sc
    >>> frequencies = sc.draw.lorentzian(0, 0.5)
    >>> frequencies
    Draw(distribution='lorentzian', first=0.0, second=0.5)
    """
    return Draw(Distribution.LORENTZIAN, centre, half_width)


@dataclass(frozen=True, slots=True)
class _Distributions(Algebra[Draw]):
    """Read a text that calls a distribution with two constants."""

    what: str
    deepest = 2

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        raise ValueError(f"{self.what}: found {short_repr(ast.unparse(node))}; expected {KNOWN}")

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[None]:
        if function not in tuple(Distribution) or count != 2 or options:
            raise NoMeaning
        return (None, None)

    def call(self, function: str, arguments: Sequence[str], options: Mapping[str, str]) -> Draw:
        first, second = map(constant, arguments)
        return Draw(Distribution(function), first, second)


def read_draw(what: str, text: str) -> Draw:
    """Return the distribution of a text such as "normal(0, 1)"; a ValueError for any other text begins with `what`."""
    expression = parse(check_text(what, text))
    if expression is None:
        raise ValueError(f"{what}: unreadable distribution {short_repr(text)}{unpaired(text)}; expected {KNOWN}")
    try:
        return expression.evaluate(_Distributions(what))
    except ValueError as error:
        message = str(error)
        raise ValueError(message if message.startswith(what) else f"{what}: {message}") from None
