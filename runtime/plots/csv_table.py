"""Tables of numbers as CSV text."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from ..support.status import Status


def as_csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return CSV text with a header and 12 digits; missing and non-finite numbers are empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        if len(row) != len(columns):
            raise ValueError(f"a row of {len(row)} entries; expected {len(columns)}: {', '.join(columns)}")
        writer.writerow(map(_csv_text, row))
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
