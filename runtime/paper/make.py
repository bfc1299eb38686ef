"""Write figures and their tables into a folder."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from os import PathLike
from pathlib import Path
from typing import Any

from ..plots.style import context, new_figure, save
from ..support.files import output_folder, write_text
from ..support.progress import Reporter
from . import load
from . import names as all_names
from .figure_runs import FULL, QUICK, FigureRuns

AT_ONCE = 2  # figures computed at a time: one uses the cores while the other compiles or computes a spectrum (a choice)


def make(names: Iterable[str] | None, out: str | PathLike[str], **options: Any) -> list[Path]:
    """Compute and draw figures; return the paths of their files. The arguments are those of `written`."""
    return [*written(names, out, **options)]


def written(
    names: Iterable[str] | None,
    out: str | PathLike[str],
    quick: bool = False,
    workers: int | None = None,
    show_progress: bool | None = None,
) -> Iterator[Path]:
    """Compute and draw figures, by default all; yield the path of each file as soon as the file is complete."""
    # The files of a figure are `<name>.png`, `<name>.svg`, `<name>.csv`, and for some figures `<name>_ranges.csv` or
    # `<name>.md`.
    figures = {name: load(name) for name in names or all_names()}
    folder = output_folder(out)
    runs = FigureRuns(QUICK if quick else FULL, workers=workers)
    with (
        Reporter(len(figures), show_progress, unit="figure") as reporter,
        ThreadPoolExecutor(min(AT_ONCE, runs.execution.size)) as pool,
    ):
        try:
            computed = pool.map(lambda name: figures[name].compute(name, runs), figures)
            for name, data in zip(figures, reporter.each(computed), strict=True):
                yield from produce(name, data, folder)
        except BaseException:  # Ctrl-C, an error, or a caller that does not go on
            runs.stop()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def produce(name: str, data: object, folder: Path) -> list[Path]:
    """Write the files of one figure: first the numbers, then the drawing."""
    module, files = load(name), []
    for ending, text in module.texts(data).items():
        files.append(folder / f"{name}{ending}")
        write_text(files[-1], text)
    with context():
        figure = new_figure(module.SIZE)
        module.draw(figure, data)
        return [*files, *save(figure, folder, name)]
