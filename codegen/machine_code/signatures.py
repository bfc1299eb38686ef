"""Define the Numba types of the functions in drivers, recorders and scenes.

Each function of a kernel is compiled only for these types.  In the comments, `lane` holds one entry for each cell of a
register, and an address points to groups of doubles, one double for each cell (codegen/simd/addresses.py).
"""

from __future__ import annotations

from typing import Any

from numba import types

from ..driver.dimensions import Dimensions, ModeDimensions
from ..driver.records import Step
from ..kernels.driver import Driver, KernelKind
from ..simd.addresses import ADDRESS
from ..simd.lane_types import Lane, Mask
from ..steps.safe_names import NAMES
from .function_table import FunctionsType

NUMBER, INTEGER = types.float64, types.int64
VECTOR, MATRIX, CUBE = NUMBER[::1], NUMBER[:, ::1], NUMBER[:, :, ::1]
CELLS, COUNTS = INTEGER[::1], INTEGER[:, ::1]
# Type of a matrix that a kernel only reads; callers may pass writable or read-only arrays.
READ_ONLY = types.Array(NUMBER, 2, "C", readonly=True)
# Links and elimination program of a step in loops (codegen/steps/safe_names.py), and the weights of its links.
NETWORK = (types.UniTuple(CELLS, len(NAMES)), VECTOR)
ROWS = types.Tuple((READ_ONLY, READ_ONLY, READ_ONLY, VECTOR))  # input of a driver: the fields of `Rows`


def _sizes(kind: type[Dimensions] | type[ModeDimensions]) -> Any:
    return types.NamedUniTuple(INTEGER, len(kind._fields), kind)


def signatures(driver: Driver) -> dict[str, Any]:
    """Return the types of the functions that a driver takes, and of its own entry point, by name."""
    taken, arguments, outputs = _of_modes(driver) if driver.kind is KernelKind.MODES else _of_sweep(driver)
    functions = FunctionsType({name: taken[name] for name in driver.functions})
    # functions, arguments of the scene, first and last cell, arrays
    rows = types.Tuple((MATRIX, MATRIX, MATRIX, VECTOR)) if driver.kind is KernelKind.FRAME else ROWS
    entry = types.void(functions, *arguments, INTEGER, INTEGER, rows, *map(types.Tuple, outputs))
    return {**taken, driver.entry: entry}


def recorder_signatures(width: int) -> dict[str, Any]:
    """Return the types of the recorders, and of the functions of a scene that they call, by name."""
    lane, mask, sizes = Lane(width), Mask(width), _sizes(Dimensions)
    # theta, t, h, y, y_new, dense, output, (dimension, dense_rows)
    values = types.void(lane, lane, lane, *[ADDRESS] * 4, types.UniTuple(INTEGER, 2))
    function = types.FunctionType(values)
    step = types.NamedTuple((lane, lane, *[ADDRESS] * 3), Step)
    return {
        "section": values,
        "values": values,
        "halt": lane(mask, step, *[ADDRESS] * 3, MATRIX, sizes, function),
        "observe": types.void(mask, mask, step, *[ADDRESS] * 3, sizes),
        "cut": types.void(mask, step, ADDRESS, CELLS, COUNTS, CUBE, ADDRESS, MATRIX, sizes, function),
        "tally": types.void(INTEGER, step, ADDRESS, CELLS, MATRIX, ADDRESS, MATRIX, sizes, function),
        "sample": types.void(INTEGER, lane, step, ADDRESS, CELLS, READ_ONLY, CUBE, VECTOR, sizes),
    }


def _of_sweep(driver: Driver) -> tuple[dict[str, Any], tuple[Any, ...], tuple[Any, ...]]:
    """Return the functions that a driver of sweeps takes, its arguments of a scene, and its groups of outputs."""
    lane = Lane(driver.width)
    network = NETWORK if driver.looped else ()
    # t, h; Taylor steps take the time to the next event and a scale, and return their length and reach
    times, result = ((lane, lane, lane), types.UniTuple(lane, 2)) if driver.series else ((lane, lane), lane)
    taken = {
        "step": result(*times, *[ADDRESS] * 4, NUMBER, NUMBER, *network),  # y, p, y_new, dense; rtol, atol
        "pushes": types.void(lane, *[ADDRESS] * 3, *network),  # t, y, p, output
        "strike": types.void(lane, *[ADDRESS] * 3, *network),
        **recorder_signatures(driver.width),
    }
    arguments = (_sizes(Dimensions), VECTOR, MATRIX, types.Tuple(network))  # sizes, multiplicity, rule, network
    results = (MATRIX, MATRIX, COUNTS, CUBE, CUBE, MATRIX)  # the fields of `Results`
    # of a frame: batches, plan, frame, places, units, basis, sums, steps
    framing = (CELLS, CELLS, MATRIX, COUNTS, VECTOR, MATRIX, MATRIX, CELLS)
    return taken, arguments, (results, framing) if driver.kind is KernelKind.FRAME else (results,)


def _of_modes(driver: Driver) -> tuple[dict[str, Any], tuple[Any, ...], tuple[Any, ...]]:
    """Return the same for a driver of orbits and their modes; an orbit is one cell in a lane of width 1."""
    one = Lane(1)
    times, result = ((one, one, one), types.UniTuple(one, 2)) if driver.series else ((one, one), one)
    registers = [INTEGER] * (1 if driver.series else 2)  # their number; without series the first and the last
    taken = {
        "step": result(*times, *[ADDRESS] * 4, NUMBER, NUMBER, ADDRESS),  # as above, and Jacobians for `carry`
        "carry": NUMBER(*[ADDRESS] * 4, *registers, NUMBER),  # Jacobians, strengths, old, new; registers; tolerance
        "pushes": types.void(one, *[ADDRESS] * 3),
        "strike": types.void(one, *[ADDRESS] * 3),
        # contact or row, t; y before and after, strengths, deviations; register
        "saltate": types.void(INTEGER, NUMBER, *[ADDRESS] * 4, INTEGER),
    }
    deviations, outputs = (READ_ONLY, CUBE, MATRIX), (MATRIX, MATRIX, COUNTS)
    # batches, places, panels, weights, targets, gains, errors; intervals, shares, where; batch_starts
    propagation = (CELLS, MATRIX, MATRIX, VECTOR, MATRIX, CUBE, VECTOR, MATRIX, VECTOR, VECTOR, CUBE)
    framing = (CELLS, MATRIX)  # plan, frame
    return taken, (_sizes(ModeDimensions),), (deviations, outputs, propagation, framing)
