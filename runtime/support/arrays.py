"""Check arrays from the user: finite numbers, in one row, and optionally rising."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from synchain.models.inputs.checks import short_repr

LARGEST = 1e300  # largest size of a number in a row: sums, differences and multiples of them are finite


def numbers(what: str, values: object, *, complex_too: bool = False) -> np.ndarray:
    """Return the values as an array of any shape, of floats or, if `complex_too`, of complex numbers."""
    try:
        array = np.asarray(values)
        # NumPy reads the text "1" as a number, and None as nan
        if array.dtype.kind in ("US" if complex_too else "USc") or (array.dtype.kind == "O" and None in array):
            raise ValueError
        return array if array.dtype.kind == "c" else array.astype(float)
    except (TypeError, ValueError):
        kind = "numbers" if complex_too else "real numbers"
        raise ValueError(f"{what}: found {short_repr(values)}; expected {kind}") from None


def row(what: str, values: ArrayLike, least: int = 1, *, rising: bool = False, complex_too: bool = False) -> np.ndarray:
    """Return values as a row (m,) of floats, or of complex numbers if `complex_too`; no entry may exceed LARGEST in size."""
    array = np.atleast_1d(numbers(what, values, complex_too=complex_too))
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{what}: found {array[~np.isfinite(array)][0]}; expected finite numbers")
    large = np.maximum(np.abs(array.real), np.abs(array.imag)) > LARGEST
    if large.any():
        raise ValueError(f"{what}: found {array[large][0]:g}; expected numbers of at most {LARGEST:g} in size")
    if array.ndim != 1 or len(array) < least:
        shape = array.shape if np.ndim(values) else ()
        wanted = f"a row of at least {least} number{'s' * (least > 1)}"
        raise ValueError(f"{what}: found an array of shape {shape}; expected {wanted}")
    if rising and not np.all(np.diff(array) > 0.0):
        raise ValueError(f"{what}: found numbers that do not increase; expected them from low to high")
    return array
