"""Published numbers beside computed ones, each with the difference that counts as agreement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from synchain.models.inputs.checks import check_number
from synchain.models.inputs.frozen import FrozenDict

from .labelled import Labelled, dataset

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Reproduction(Labelled):
    """Numbers that a paper prints, beside numbers that were computed.

    Parameters
    ----------
    claims : mapping of str to (float, float, float)
        For each quantity the published number, the computed number and the largest difference that counts as
        agreement: half a unit of the last printed digit, plus the errors of both numbers.  A computed number that is
        not finite never agrees.

    Raises
    ------
    ValueError
        If there is no claim, if a claim does not hold three numbers, if a published number is not finite, or if a
        difference is negative.

    See Also
    --------
    synchain.results.MSF : Ranges with their errors.

    Notes
    -----
    `synchain reproduce --list` lists the papers whose scripts come with the package.

    Examples
    --------
    The largest eigenvalue of a ring of four nodes, and a wrong number:

    >>> import synchain as sc
    >>> largest = -float(sc.graphs.ring(4).spectrum.eigenvalues[-1].value)
    >>> table = sc.results.Reproduction({"four nodes": (4, largest, 0), "wrong": (3.8, largest, 0.05)})
    >>> print(table)
    Reproduction
      four nodes  published 4, found 4
      wrong       published 3.8, found 4: not within 0.05
    >>> table.reproduced
    False
    """

    claims: Mapping[str, tuple[float, float, float]]

    def __post_init__(self) -> None:
        if not self.claims:
            raise ValueError("claims: found none; expected at least one quantity with its three numbers")
        claims = {}
        for quantity, numbers in self.claims.items():
            if len(numbers) != 3:
                raise ValueError(f"{quantity}: found {len(numbers)} numbers; expected published, found, difference")
            published, found, difference = map(float, numbers)
            check_number(f"{quantity}: published number", published)
            check_number(f"{quantity}: difference", difference, low=0.0)
            claims[quantity] = published, found, difference
        object.__setattr__(self, "claims", FrozenDict(claims))

    @property
    def agrees(self) -> np.ndarray:
        """True for each claim whose number differs by no more than its allowed difference (claims,)."""
        published, found, difference = np.array([*self.claims.values()]).T
        # rounding of decimal fractions is no disagreement
        near: np.ndarray = np.abs(found - published) <= difference + 1e-12 * np.abs(published)
        return near

    @property
    def reproduced(self) -> bool:
        """Whether every computed number agrees."""
        return bool(self.agrees.all())

    @property
    def data(self) -> xr.Dataset:
        """Published and computed numbers over the quantities."""
        published, found, difference = np.array([*self.claims.values()]).T
        return dataset(
            {
                "published": (("quantity",), published, "number that the paper prints"),
                "found": (("quantity",), found, "computed number"),
                "difference": (("quantity",), difference, "largest difference that counts as agreement"),
                "agrees": (("quantity",), self.agrees, "whether the difference is at most that"),
            },
            {"quantity": list(self.claims)},
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """A line for each claim."""
        rows = []
        for (quantity, (published, found, difference)), agrees in zip(self.claims.items(), self.agrees, strict=True):
            verdict = "" if difference == 0.0 and agrees else f"{',' if agrees else ': not'} within {difference:.2g}"
            rows.append((quantity, f"published {published:.6g}, found {found:.6g}{verdict}"))
        return tuple(rows)
