"""Words and files of the reports on master stability functions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene

from ..prediction.modes import NetworkMode
from ..prediction.synchronisability import Window
from .drive import drive_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..figures.tables import Table

__all__ = [
    "defective_rows",
    "exact",
    "finite",
    "headline",
    "how",
    "measured",
    "rows_of",
    "window_dict",
    "window_text",
    "write_files",
]


def headline(scene: Scene, axes: Collection[str] = ()) -> str:
    """Return the first line of a report: oscillators, coupling, the drive if it is none of the
    `axes`, and the unit of exponents.
    """
    coupling = f", {scene.coupling} coupling" if scene.coupling else ""
    oscillators = " and ".join(dict.fromkeys(kind.oscillator.name for kind in scene.model.kinds))
    return f"{oscillators} oscillator{coupling}{drive_words(scene, axes)}: exponents per unit of time"


def how(period: float, attractors: Sequence[str], time: float, stderr: np.ndarray) -> list[tuple[str, str]]:
    """Return the rows on the orbits and on the length of the average.

    Parameters
    ----------
    period : float
        Period of the drive; 0 without one, or if an axis changes it.
    attractors : sequence of str
        The kind of attractor that each start settled on.
    time : float
        Units of time that each start was averaged over; 0 if no average was needed.
    stderr : ndarray
        Standard errors of the exponents, in units of 1/time.

    Returns
    -------
    list of (str, str)
        Names and words of the rows.
    """
    kinds = "; ".join(
        f"{kind} ({count} of {len(attractors)} starts)" for kind, count in Counter(attractors).most_common()
    )
    worst = float(np.max(stderr))
    sure = f"largest standard error {worst:.1g}" if math.isfinite(worst) else "too short for an error: raise --periods"
    drive = f" ({time / period:.0f} drive periods)" if period else ""
    length = f"{time:.6g} units of time{drive} for each start" if time else "not needed"
    return [("attractor", kinds), ("average", f"{length}, {sure}")]


def rows_of(rows: Sequence[tuple[str, str]]) -> list[str]:
    """Return names and words as lines in two columns."""
    wide = max(len(name) for name, _ in rows)
    return [f"  {name:<{wide}}  {words}" for name, words in rows]


def measured(value: float, error: float, at_end: bool = False) -> str:
    """Return a number with its error, to the digits that are certain; dots if a grid ends at it."""
    if at_end:
        return f"{value:zg}" + ("..." if value else "")
    if not (error > 0 and math.isfinite(error)):
        return f"{value:z.4f}"
    digits = min(max(1 - math.floor(math.log10(error)), 2), 5)
    return f"{value:z.{digits}f} ± {max(error, 10.0**-digits):.{digits}f}"


def window_text(window: Window, error: bool = True) -> str:
    """Return a window of sigma and the modes lost at its ends; dots if a grid ends there."""
    ends, lost = [], []
    for side in ("low", "high"):
        sigma, mode = getattr(window, side), getattr(window, f"{side}_mode")
        if mode is None:
            ends.append("0" if sigma == 0 else "any" if math.isinf(sigma) else f"{sigma:z.4f}...")
        else:
            ends.append(measured(sigma, getattr(window, f"{side}_error") if error else 0.0))
            lost.append(f"lost {'below' if side == 'low' else 'above'}: gamma = {mode.eigenvalue}")
    return "; ".join([" … ".join(ends), *lost])


def window_dict(window: Window) -> dict[str, object]:
    """Return a window in JSON types; a mode is its exact eigenvalue, or None if none is lost."""
    names = ("low", "high", "low_error", "high_error")
    modes = {name: exact(getattr(window, name)) for name in ("low_mode", "high_mode")}
    return {**{name: getattr(window, name) for name in names}, **modes}


def exact(mode: NetworkMode | None) -> str | None:
    """Return the eigenvalue of a mode as exact text."""
    return None if mode is None else mode.eigenvalue.text


def finite(value: object) -> object:
    """Return the value with None in place of NaN and infinities, which JSON does not have."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_files(folder: Path, name: str, numbers: Table, draw: Callable[[Axes], object]) -> list[Path]:
    """Write numbers to NAME.csv and a figure to NAME.png.

    Parameters
    ----------
    folder : Path
        The folder of the files.
    name : str
        The name of both files without extension.
    numbers : Table
        The columns of the CSV file.
    draw : callable
        Draws on the axes that it is called with.

    Returns
    -------
    list of Path
        The two files.
    """
    import matplotlib

    matplotlib.use("Agg")
    from ..figures.style import context, new_figure
    from ..figures.tables import as_csv
    from ..support.files import whole_file, write_text

    paths = [folder / f"{name}.csv", folder / f"{name}.png"]
    write_text(paths[0], as_csv(numbers))
    with context():
        figure = new_figure((4.8, 3.4))
        draw(figure.add_subplot())
        with whole_file(paths[1]) as temporary:
            figure.savefig(temporary, dpi=200)
    return paths


def defective_rows(graph: Topology) -> list[tuple[str, str]]:
    """Return a row for each defective eigenvalue: how its errors grow if its exponent is lambda."""
    rows = []
    for e in graph.spectrum.defective:
        power = e.blocks[0][0] - 1 if e.blocks else 0
        words = f"gamma = {e}: growth t^{power} e^(lambda t)" if power > 1 else f"gamma = {e}: growth t e^(lambda t)"
        rows.append(("defective", words))
    return rows
