"""Tables of numbers, and their CSV text."""

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


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of equal length."""

    columns: tuple[str, ...]  # names of the columns
    rows: tuple[tuple[Any, ...], ...]  # rows with one entry for each column

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(
                    f"a row of {len(row)} entries; expected {len(self.columns)}: {', '.join(self.columns)}"
                )

    @classmethod
    def of(cls, **columns: Iterable[object]) -> Table:
        """Build a table from columns of equal length."""
        return cls(tuple(columns), tuple(zip(*columns.values(), strict=True)))

    def column(self, name: str) -> tuple[Any, ...]:
        """Return the entries of one column."""
        k = self.columns.index(name)
        return tuple(row[k] for row in self.rows)


def as_csv(table: Table) -> str:
    """Return CSV text with a header and 12 digits; missing and non-finite numbers are empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([_csv_text(value) for value in row] for row in table.rows)
    return text.getvalue()


def status_names(status: xr.DataArray) -> list[str]:
    """Return the status of each cell in lower case, in C order."""
    return [Status(int(code)).name.lower() for code in np.ravel(status.values)]


def _csv_text(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, (float, np.floating)):
        return f"{value:.12g}" if math.isfinite(value) else ""
    return str(value)
