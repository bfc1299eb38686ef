"""Makes figures and tables into a folder."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from tqdm import tqdm

from ..support.files import output_folder, write_text
from . import Drawing, load
from . import names as all_names
from .figure_runs import FULL, QUICK, FigureRuns
from .style import context, new_figure, save
from .tables import as_csv

__all__ = ["make"]


def make(
    names: Iterable[str] | None,
    out: str | PathLike[str],
    quick: bool = False,
    workers: int | None = None,
    show_progress: bool | None = None,
) -> list[Path]:
    """Compute and draw figures (all of them where `names` is None or empty) and return the files written.

    Each figure gives `<name>.png`, `<name>.svg` and `<name>.csv`, some also `<name>_ranges.csv` or `<name>.md`.  `quick`
    takes coarse grids and a short transient; `workers` is the number of threads (default: all cores).  A bar is shown on
    terminals, always or never with `show_progress` None, True or False.

    Raises ValueError for an unknown name, OSError for a folder that cannot be written to; both before anything is computed.
    """
    wanted = [load(name) for name in dict.fromkeys(names or all_names())]
    folder = output_folder(out)
    runs = FigureRuns(QUICK if quick else FULL, workers=workers)
    written: list[Path] = []
    with tqdm(wanted, unit="figure", disable=None if show_progress is None else not show_progress) as bar:
        for drawing in bar:
            bar.set_postfix_str(drawing.name)
            written += produce(drawing, runs, folder)
    return written


def produce(drawing: Drawing, runs: FigureRuns, folder: Path) -> list[Path]:
    """Compute one figure and write its files: the numbers first, then what they look like."""
    data = drawing.compute(runs)
    texts = {f"{drawing.name}.csv": as_csv(drawing.table(data))}
    if hasattr(drawing.module, "ranges"):
        texts[f"{drawing.name}_ranges.csv"] = as_csv(drawing.module.ranges(data))
    if hasattr(drawing.module, "document"):
        texts[f"{drawing.name}.md"] = drawing.module.document(data)
    for name, text in texts.items():
        write_text(folder / name, text)
    with context():
        figure = new_figure(drawing.size)
        drawing.draw(drawing.layout(figure), data)
        return [*(folder / name for name in texts), *save(figure, folder, drawing.name)]
