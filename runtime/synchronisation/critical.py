"""Find where synchronous motion becomes stable: the zero of the largest transversal exponent in any parameter.

The exponent of a point comes from the multipliers of a periodic orbit, from the eigenvalues of a fixed point, or from an
average with a standard error. A zero is found by false position with the weights of Illinois (Dowell & Jarratt, BIT 11,
168 (1971)), until the sign of an exponent is uncertain by two standard errors. The slope there follows from a line
through three points, and the error of the zero is that of the exponent divided by the slope.

Along a second parameter, the zero is predicted by a secant through the last two zeros.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import ORBITS, Given, chosen, with_numbers
from ..results.labelled import Labelled, dataset, scene_text
from ..stability.averages import ROUNDING, Averaging, document_keywords
from ..stability.exponents import RTOL, coupled_cell, with_partner
from ..stability.largest_exponents import check_parameters, largest_exponents
from ..stability.motion import Spread
from ..stability.transversal_modes import shared_orbits, transversal_modes
from ..support.arrays import row
from ..support.error_text import range_text, with_error
from ..support.execution import Execution
from ..support.progress import Hook

CERTAIN = 2.0
"""The sign of an exponent is certain if the exponent exceeds CERTAIN standard errors."""

MOST = 80
"""Most evaluations in the search for one zero; bisection alone reaches the last digit in 53."""

NARROW = 1e-13
"""A bracket of this width, relative to its ends, that still has certain signs contains a jump of the exponent."""

APART, LEAST = 8.0, 1e-3
"""The slope at a zero is measured over APART errors of the zero on either side, but at least over the part LEAST of the
range that is searched."""

CLOSER = 4.0
"""Ratio of successive distances from a jump at which the signs of averages are tested (a choice)."""

FIRST, MARGIN = 0.02, 3.0
"""First bracket around a predicted zero: the larger of the part FIRST of the range, and MARGIN times the last error of
the prediction or of the zero."""


class Evaluation(NamedTuple):
    """Largest exponent of all modes at one value of the parameter."""

    x: float  # value of the parameter
    y: float  # largest exponent
    error: float  # standard error of the exponent
    mode: int  # index of the mode with this exponent
    kind: str  # kind of motion of the scene's own start
    spread: Spread = Spread(np.zeros(0), np.zeros(0))  # mean and extent of this motion

    @property
    def sign(self) -> int:
        """Sign of the exponent; 0 if it is uncertain."""
        return 0 if abs(self.y) <= CERTAIN * self.error else int(math.copysign(1, self.y))


class Zero(NamedTuple):
    """Zero of the largest exponent."""

    value: float = math.nan
    error: float = math.nan
    slope: float = math.nan  # change of the exponent per unit of the parameter
    mode: int = -1
    kind: str = ""
    remark: str = "no zero in the range"


@dataclass(frozen=True, slots=True, repr=False)
class Critical(Labelled):
    """Values of a parameter at which the largest transversal exponent passes zero.

    Parameters
    ----------
    scene : Scene
        The network.
    name : str
        Name of the parameter.
    value, error, slope : ndarray, shape () or (m,)
        Value of the parameter at the zero, its standard error, and the change of the exponent per unit of the
        parameter. Over a second parameter one entry for each of its values; NaN where no zero was found.
    modes : tuple of str
        Exact eigenvalues of the mode that passes zero at each value, one for each layer of links; empty without a zero.
    motions : tuple of str
        Kind of synchronous motion at each value.
    remarks : tuple of str
        Where the exponent or the synchronous motion jumps, or why there is no value; else empty.
    evaluations : ndarray, shape (k, 4)
        All points at which exponents were computed: second parameter (NaN without one), parameter, exponent, and
        standard error.
    along : str
        Name of the second parameter; empty without one.
    along_values : ndarray, shape (m,)
        Values of the second parameter.
    """

    scene: Scene
    name: str
    value: np.ndarray
    error: np.ndarray
    slope: np.ndarray
    modes: tuple[str, ...]
    motions: tuple[str, ...]
    remarks: tuple[str, ...]
    evaluations: np.ndarray
    along: str = ""
    along_values: np.ndarray | None = None

    @property
    def data(self) -> xr.Dataset:
        """Values, errors and slopes, over the second parameter if there is one, and all evaluations."""
        dims = (self.along,) if self.along else ()
        shape = self.value.shape
        _, tried, exponent, stderr = self.evaluations.T
        variables = {
            "value": (dims, self.value, f"{self.name} at which the largest transversal exponent is zero"),
            "error": (dims, self.error, "standard error of the value"),
            "slope": (dims, self.slope, f"change of the exponent per unit of {self.name}"),
            "mode": (dims, np.reshape(self.modes, shape), "exact eigenvalue of the mode that passes zero"),
            "motion": (dims, np.reshape(self.motions, shape), "kind of synchronous motion"),
            "tried": (("evaluation",), tried, f"{self.name} at which exponents were computed"),
            "exponent": (("evaluation",), exponent, "largest transversal exponent per unit of time"),
            "stderr": (("evaluation",), stderr, "standard error of the exponent"),
        }
        return dataset(variables, {self.along: self.along_values} if self.along else {}, self.scene)

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, one line for each zero, and the number of evaluations."""
        rows = [("scene", scene_text(self.scene, [self.name, self.along]))]
        places = (
            [f"{self.along} = {x:.6g}" for x in self.along_values] if self.along_values is not None else ["critical"]
        )
        numbers = (np.atleast_1d(part).tolist() for part in (self.value, self.error, self.slope))
        for place, value, error, slope, gamma, motion, remark in zip(
            places, *numbers, self.modes, self.motions, self.remarks, strict=True
        ):
            if math.isfinite(value):
                way = "stable above" if slope < 0.0 else "stable below"
                text = f"{self.name} = {with_error(value, error)}, {way}; lost by gamma = {gamma}; motion {motion}"
                rows.append((place, f"{text}; {remark}" if remark else text))
            else:
                rows.append((place, remark))
        tried = self.evaluations[:, 1]
        rows.append(("evaluations", f"{len(tried)}, {self.name} {range_text(tried)}"))
        return tuple(rows)


@document_keywords
def critical(
    scene: Scene,
    name: str,
    between: Sequence[float],
    *,
    precision: float | None = None,
    periods: float = 5000,
    transient: float | None = None,
    starts: int = 4,
    rtol: float | None = None,
    rng: int | np.random.Generator | None = None,
    workers: int | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float | Sequence[float] | np.ndarray] | None = None,
    **more: float | Sequence[float] | np.ndarray,
) -> Critical:
    """Find the value of a parameter at which synchronous motion becomes stable or unstable.

    There the largest transversal exponent of all modes of the network passes zero. The parameter may be a coupling
    strength or any other parameter. A second parameter with a row of values makes a curve of such values:
    ``critical(scene, "sigma", (0.1, 0.4), omega=[1.1, 1.15, 1.2])``.

    Parameters
    ----------
    scene : Scene
        The network.
    name : str
        Name of the parameter.
    between : (float, float)
        Range with one zero: at its ends the exponents have different signs. Along a second parameter the zero is
        followed inside this range.
    {orbits}
    parameters, **more
        Parameters of the scene. A number sets a parameter; an increasing sequence of numbers of one parameter makes a
        curve.

    Returns
    -------
    Critical
        Its errors are those of the exponents, divided by the slope. On periodic orbits they are errors of the steps,
        which `rtol` reduces; on other motion `precision` and `periods` determine them. Where the synchronous motion
        itself changes at the zero, the error is the width of the range in which it changes.

    Raises
    ------
    ValueError
        If the signs at both ends do not differ with certainty; if no exponent depends on the parameter; if there is more
        than one second parameter; and as in `plane`.
    FloatingPointError
        If an integration fails.

    Warns
    -----
    RuntimeWarning
        As `exponents`.

    See Also
    --------
    plane : Computes the largest exponent over two parameters.
    thresholds : Finds all ranges of the coupling strength, also by simulation.

    Examples
    --------
    The matrix of a mode of strength alpha has the trace 1.5 - alpha and the determinant 2 - alpha/2:

    >>> import synchain as sc
    >>> node = sc.Field({"x": "x + y", "y": "-1.5*x + 0.5*y"})
    >>> pair = sc.Scene(node, "x->x", sc.graphs.chain(2))
    >>> bool(abs(sc.critical(pair, "sigma", (0.1, 1)).value - 0.75) < 1e-12)
    True
    """
    averaging = Averaging.for_scene(
        scene, precision, periods, transient, rng, Execution(workers, None, show_progress, progress)
    )
    call = Given(critical, parameters, more, ORBITS)
    call.checked(with_partner(scene))
    rows, fixed = call.parted()
    if name in call.values:
        raise ValueError(f"critical: found a value of {name!r} besides between; expected between alone")
    if len(rows) > 1:
        raise ValueError(f"critical: found rows of values of {', '.join(rows)}; expected at most one second parameter")
    ends = row("between", between, 2, rising=True)
    if len(ends) != 2:
        raise ValueError(f"critical: found {len(ends)} values of between; expected a lower and an upper end")
    along = next(iter(rows), "")
    seconds = row(along, rows[along], 2, rising=True) if along else np.full(1, math.nan)

    first = {**fixed.values, name: float(ends[0]), **({along: float(seconds[0])} if along else {})}
    first_call = replace(fixed, table=first)
    first_call.expect_one_cell(check_scene(scene))  # the exponents depend on all strengths of the scene
    if not scene.model.linked:
        raise ValueError("critical: found a scene without links; expected a network, whose modes have exponents")
    cell = coupled_cell(first_call, scene, chosen(scene, "rtol", rtol, RTOL))
    check_parameters("critical", cell, {name: ends, **({along: seconds} if along else {})})
    modes = tuple(map(str, transversal_modes(cell)))

    evaluations: list[tuple[float, Evaluation]] = []
    zeros: list[Zero] = []
    for second in map(float, seconds):

        def measure(x: float, second: float = second) -> Evaluation:
            columns = {name: np.array([x]), **({along: np.array([second])} if along else {})}
            found = largest_exponents(cell, list(shared_orbits(cell, columns)), starts, averaging)
            exponent, stderr = float(found.exponent[0]), float(found.stderr[0])
            evaluation = Evaluation(x, exponent, stderr, int(found.mode[0]), str(found.kinds[0, 0]), found.spreads[0])
            evaluations.append((second, evaluation))
            return evaluation

        if not zeros:
            low, high = (measure(float(end)) for end in ends)
            if low.sign * high.sign >= 0:
                shown = " and ".join(f"{with_error(e.y, e.error)} at {e.x:g}" for e in (low, high))
                raise ValueError(
                    f"critical: found the largest exponents {shown}; expected different signs at both ends; choose other "
                    f"values of between"
                )
            rising = high.sign
            zeros.append(_zero(measure, low, high))
        else:
            zeros.append(_next_zero(measure, seconds[: len(zeros) + 1], zeros, ends, rising))

    shape = seconds.shape if along else ()
    value, error, slope = (np.reshape([zero[k] for zero in zeros], shape) for k in range(3))
    gammas = tuple("" if zero.mode < 0 else _gamma(modes[zero.mode]) for zero in zeros)
    shown_scene = with_numbers(scene, {key: x for key, x in fixed.values.items() if scene.takes(key)})
    return Critical(
        shown_scene.replace(axes=()),
        name,
        value,
        error,
        slope,
        gammas,
        tuple(zero.kind for zero in zeros),
        tuple(zero.remark for zero in zeros),
        np.array([(second, e.x, e.y, e.error) for second, e in evaluations]),
        along,
        seconds if along else None,
    )


def _zero(measure: Callable[[float], Evaluation], low: Evaluation, high: Evaluation) -> Zero:
    """Find the zero between two evaluations with certain and different signs."""
    ends, fall = (low, high), abs(high.y - low.y)
    scale = ROUNDING * max(abs(low.y), abs(high.y)) if math.isfinite(low.y * high.y) else 0.0
    weights = [low.y, high.y]
    last_side, widths = 0, 0.0
    for step in range(MOST):
        width = high.x - low.x
        # false position; bisect where an exponent is infinite, and if three steps have not halved the bracket
        x = high.x - weights[1] * width / (weights[1] - weights[0]) if np.isfinite(weights).all() else math.nan
        if step % 3 == 0:
            widths, slow = width, step > 0 and width > 0.5 * widths
            x = math.nan if slow else x
        if not low.x < x < high.x:
            x = low.x + 0.5 * width
        point = measure(x)
        if point.sign == 0 or abs(point.y) <= scale:
            return _at_zero(measure, low, point, high, ends)
        side = 1 if point.sign == high.sign else 0
        low, high = (low, point) if side else (point, high)
        weights[side] = point.y
        # the weights of Illinois: halve the weight of an end that stays
        weights[1 - side] *= 0.5 if side == last_side and step else 1.0
        last_side = side
        if high.x - low.x <= NARROW * max(abs(low.x), abs(high.x)):
            break
    if abs(high.y - low.y) < LEAST * fall:
        return _at_zero(measure, low, min(low, high, key=lambda end: abs(end.y)), high, ends)
    remark = f"the exponent jumps from {with_error(low.y, low.error)} to {with_error(high.y, high.error)}"
    stable = low if low.sign < 0 else high
    slope = math.copysign(math.inf, high.sign)
    value, error = 0.5 * (low.x + high.x), 0.5 * (high.x - low.x)
    # averages may cover both motions, so that signs are random about the jump: approach it once more from outside
    if CERTAIN * max(low.error, high.error) > LEAST * abs(high.y - low.y):
        reach = ends[1].x - ends[0].x
        while reach > LEAST * (ends[1].x - ends[0].x):
            sides = measure(max(value - reach / CLOSER, ends[0].x)), measure(min(value + reach / CLOSER, ends[1].x))
            if (sides[0].sign, sides[1].sign) != (low.sign, high.sign):
                break
            reach /= CLOSER
        error = CLOSER * reach  # both signs may be right by chance
    return Zero(value, error, slope, stable.mode, stable.kind, remark)


def _at_zero(
    measure: Callable[[float], Evaluation],
    low: Evaluation,
    point: Evaluation,
    high: Evaluation,
    ends: tuple[Evaluation, Evaluation],
) -> Zero:
    """Return the zero near a point that is zero within its error, from `low` and `high` and new points."""
    first, last = ends[0].x, ends[1].x
    slope = (high.y - low.y) / (high.x - low.x)
    reach = max(APART * point.error / abs(slope) if math.isfinite(slope) else 0.0, LEAST * (last - first))
    near = [point]
    while True:
        # new points: those of the bracket were selected by their scatter
        sides = [measure(max(point.x - reach, first)), measure(min(point.x + reach, last))]
        near += sides
        # the slope of a narrow bracket may be that of the scatter: move apart until the difference is certain
        if not abs(sides[1].y - sides[0].y) < 1.5 * APART * point.error or reach > last - first:
            break
        reach *= 2.0
    x, y, error = (np.array(part) for part in zip(*((e.x, e.y, e.error) for e in near), strict=True))
    if not np.isfinite(y).all():
        return Zero(point.x, 0.5 * reach, math.copysign(math.inf, high.sign), point.mode, point.kind, "")
    slope, level = np.polyfit(x - point.x, y, 1)
    # averages scatter about the line; multipliers are exact, and the line only gives the slope
    averaged = CERTAIN * point.error > LEAST * abs(slope) * (last - first)
    offset = level if averaged else point.y
    spread = math.hypot(float(error.max()), float(np.abs(y - level - slope * (x - point.x)).max()) if averaged else 0.0)
    value, uncertainty = float(point.x - offset / slope), spread / abs(slope) + np.spacing(abs(point.x))
    # the exponent may pass zero by a jump of the motion, which lies anywhere between both sides
    remark = ""
    if not sides[0].spread.like(sides[1].spread):
        uncertainty = max(uncertainty, float(x.max() - x.min()))
        remark = f"the synchronous motion changes between {sides[0].x:.6g} and {sides[1].x:.6g}"
    elif others := [f"{end.x:.6g}" for end in ends if not end.spread.like(point.spread)]:
        remark = f"the synchronous motion differs at {' and '.join(others)}: if it jumps, other starts may pass zero elsewhere"
    return Zero(value, uncertainty, float(slope), point.mode, point.kind, remark)


def _next_zero(
    measure: Callable[[float], Evaluation], seconds: np.ndarray, zeros: Sequence[Zero], ends: np.ndarray, rising: int
) -> Zero:
    """Find the next zero of a curve, at the last of `seconds`, near the secant through the last two zeros."""
    known = [(x, zero) for x, zero in zip(seconds[:-1], zeros, strict=True) if math.isfinite(zero.value)][-3:]
    guess, miss = known[-1][1].value, 0.0
    if len(known) > 1:
        (x1, before), (x2, last) = known[-2:]
        guess = last.value + (last.value - before.value) / (x2 - x1) * (seconds[-1] - x2)
        miss = abs(last.value - before.value)
    half = max(FIRST * (ends[1] - ends[0]), MARGIN * known[-1][1].error, 0.5 * miss)
    # widen the bracket on the side with the wrong sign, up to the ends of the range
    low_x, high_x = (float(np.clip(guess + way * half, *ends)) for way in (-1.0, 1.0))
    low, high = measure(low_x), measure(high_x)
    while low.sign != -rising or high.sign != rising:
        half *= 2.0
        if low.sign != -rising:
            if low.x <= ends[0]:
                return Zero()
            high = low if low.sign == rising else high
            low = measure(float(max(guess - half, ends[0])))
        else:
            if high.x >= ends[1]:
                return Zero()
            low = high if high.sign == -rising else low
            high = measure(float(min(guess + half, ends[1])))
    return _zero(measure, low, high)


def _gamma(text: str) -> str:
    """Return the eigenvalues of a mode without brackets for a single layer."""
    return text if ", " in text else text[1:-1]
