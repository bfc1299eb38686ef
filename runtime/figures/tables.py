"""Numbers as columns, and as CSV text."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from ..support.status import Status

__all__ = ["Table", "as_csv", "status_names"]


@dataclass(frozen=True, slots=True)
class Table:
    """Names of the columns and the rows; every row is as long as there are columns."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(
                    f"a row of {len(row)} entries; expected {len(self.columns)}: {', '.join(self.columns)}"
                )

    @classmethod
    def of(cls, **columns: Iterable[Any]) -> Table:
        """A table from columns of equal length."""
        return cls(tuple(columns), tuple(zip(*columns.values(), strict=True)))

    def column(self, name: str) -> tuple[Any, ...]:
        """The entries of one column."""
        k = self.columns.index(name)
        return tuple(row[k] for row in self.rows)


def as_csv(table: Table) -> str:
    """CSV text with a header; numbers with 12 digits, an empty cell for what is missing or not a number."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([_cell(value) for value in row] for row in table.rows)
    return text.getvalue()


def status_names(status: xr.DataArray) -> list[str]:
    """How each cell ended, in lower case words, in C order."""
    return [Status(int(code)).name.lower() for code in np.ravel(status.values)]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, (float, np.floating)):
        return f"{value:.12g}" if math.isfinite(value) else ""
    return str(value)
