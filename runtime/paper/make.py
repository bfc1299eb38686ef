"""Writing figures and tables into a folder."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

from ..plots.csv_table import as_csv
from ..plots.style import context, new_figure, save
from ..support.files import output_folder, write_text
from ..support.progress import Reporter
from . import Drawing, load
from . import names as all_names
from .figure_runs import FULL, QUICK, FigureRuns

AT_ONCE = 2
"""Figures that are computed at a time."""


def make(
    names: Iterable[str] | None,
    out: str | PathLike[str],
    quick: bool = False,
    workers: int | None = None,
    show_progress: bool | None = None,
) -> list[Path]:
    """Compute and draw figures.

    Each figure gives `<name>.png`, `<name>.svg` and `<name>.csv`, some also `<name>_ranges.csv` or
    `<name>.md`.
    """
    return [*written(names, out, quick, workers, show_progress)]


def written(
    names: Iterable[str] | None, out: str | PathLike[str], quick: bool, workers: int | None, show_progress: bool | None
) -> Iterator[Path]:
    """Yield the files of `make` as soon as they are whole."""
    wanted = [load(name) for name in dict.fromkeys(names or all_names())]
    folder = output_folder(out)
    runs = FigureRuns(QUICK if quick else FULL, workers=workers)
    with Reporter(len(wanted), show_progress, unit="figure") as reporter, _computed(wanted, runs) as computed:
        for drawing, data in zip(wanted, reporter.each(computed), strict=True):
            yield from produce(drawing, data, folder)


@contextmanager
def _computed(wanted: Sequence[Drawing], runs: FigureRuns) -> Iterator[Iterator[object]]:
    """The data of figures in turn.

    They are computed AT_ONCE at a time, so that compilation and spectra of one do not leave the cores idle. What runs
    is stopped if the caller does not go on, at Ctrl-C for one.
    """
    with ThreadPoolExecutor(min(AT_ONCE, runs.execution.size)) as pool:
        try:
            yield pool.map(lambda drawing: drawing.compute(runs), wanted)
        except BaseException:
            runs.stop()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def produce(drawing: Drawing, data: object, folder: Path) -> list[Path]:
    """Write the files of one figure: first the numbers, then the drawing."""
    texts = {f"{drawing.name}.csv": as_csv(drawing.table(data))}
    ranges, document = drawing.ranges(data), drawing.document(data)
    if ranges is not None:
        texts[f"{drawing.name}_ranges.csv"] = as_csv(ranges)
    if document is not None:
        texts[f"{drawing.name}.md"] = document
    for name, text in texts.items():
        write_text(folder / name, text)
    with context():
        figure = new_figure(drawing.size)
        drawing.draw(drawing.layout(figure), data)
        return [*(folder / name for name in texts), *save(figure, folder, drawing.name)]
