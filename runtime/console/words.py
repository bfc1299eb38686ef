"""How reports on master stability functions are worded and written to files."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene

from ..prediction.modes import NetworkMode
from ..prediction.synchronisability import Window
from .drive import drive_words

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


def headline(scene: Scene) -> str:
    """What oscillates, and what is computed."""
    coupling = f", {scene.coupling} coupling" if scene.coupling else ""
    oscillators = " and ".join(dict.fromkeys(kind.oscillator.name for kind in scene.model.kinds))
    return f"{oscillators} oscillator{coupling}{drive_words(scene)}: exponents per unit of time"


def how(scene: Scene, attractors: Sequence[str], time: float, stderr: np.ndarray) -> list[tuple[str, str]]:
    """What the orbits settled on, and how long the average is."""
    kinds = "; ".join(
        f"{kind} ({count} of {len(attractors)} starts)" for kind, count in Counter(attractors).most_common()
    )
    worst = float(np.max(stderr))
    sure = f"largest standard error {worst:.1g}" if math.isfinite(worst) else "too short for an error: raise --periods"
    drive = f" ({time / scene.period:.0f} drive periods)" if scene.period else ""
    length = f"{time:.6g} units of time{drive} for each start" if time else "not needed"
    return [("attractor", kinds), ("average", f"{length}, {sure}")]


def rows_of(rows: Sequence[tuple[str, str]]) -> list[str]:
    """Names and words as lines in two columns."""
    wide = max(len(name) for name, _ in rows)
    return [f"  {name:<{wide}}  {words}" for name, words in rows]


def measured(value: float, error: float, at_end: bool = False) -> str:
    """A number with its error, to as many digits as that is good for; dots where a grid ends."""
    if at_end:
        return f"{value:g}" + ("..." if value else "")
    if not (error > 0 and math.isfinite(error)):
        return f"{value:.4f}"
    digits = min(max(1 - math.floor(math.log10(error)), 2), 5)
    return f"{value:.{digits}f} ± {max(error, 10.0**-digits):.{digits}f}"


def window_text(window: Window, error: bool = True) -> str:
    """A window of sigma and the modes that are lost at its ends; dots where a grid ends."""
    ends, lost = [], []
    for side in ("low", "high"):
        sigma, mode = getattr(window, side), getattr(window, f"{side}_mode")
        if mode is None:
            ends.append("0" if sigma == 0 else "any" if sigma == math.inf else f"{sigma:.4f}...")
        else:
            ends.append(measured(sigma, getattr(window, f"{side}_error") if error else 0.0))
            lost.append(f"lost {'below' if side == 'low' else 'above'}: gamma = {mode.eigenvalue}")
    return "; ".join([" … ".join(ends), *lost])


def window_dict(window: Window) -> dict[str, Any]:
    """A window in JSON types; a mode by its exact eigenvalue, None where none is lost."""
    names = ("low", "high", "low_error", "high_error")
    modes = {name: exact(getattr(window, name)) for name in ("low_mode", "high_mode")}
    return {**{name: getattr(window, name) for name in names}, **modes}


def exact(mode: NetworkMode | None) -> str | None:
    """The eigenvalue of a mode as exact text."""
    return None if mode is None else mode.eigenvalue.text


def finite(value: Any) -> Any:
    """The value with None in place of every number that JSON does not have."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_files(folder: Path, name: str, numbers: Any, draw: Any) -> list[Path]:
    """Write the numbers, then the figure."""
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
    """A row for each eigenvalue that lacks eigenvectors: how its errors go while its exponent is lambda."""
    rows = []
    for e in graph.spectrum.defective:
        power = e.blocks[0][0] - 1 if e.blocks else 0
        words = f"gamma = {e}: growth t^{power} e^(lambda t)" if power > 1 else f"gamma = {e}: growth t e^(lambda t)"
        rows.append(("defective", words))
    return rows
