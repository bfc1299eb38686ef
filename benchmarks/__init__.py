"""Benchmarks, one file each: cases as data, `measure(quick) -> list of rows`, and `COLUMNS`; run by
`python -m benchmarks`.

Optional: `summary(rows) -> str`, more tables in Markdown; `notes() -> list of lines`, what is left
out here and why; `measure_long() -> list of rows` for runs of hours; `draw(rows)`, a Matplotlib
figure of the rows, called within the style of `synchain.runtime.plots.style`.
"""

from __future__ import annotations

import csv
import io
import platform
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from synchain.runtime.support import folder

from .kit.tables import markdown

__all__ = ["csv_text", "load", "machine", "names", "text", "write"]


def names() -> tuple[str, ...]:
    """Names of all benchmarks: the files of this folder."""
    return folder.names(__path__)


def load(name: str) -> ModuleType:
    """Return the benchmark of that name; ValueError for an unknown one."""
    return folder.load("benchmark", name, __name__, __path__)


def machine() -> str:
    """One line about the processor and the versions, to stand over every table."""
    import llvmlite.binding as llvm
    import numba

    versions = f"Python {platform.python_version()}, Numba {numba.__version__}"
    return f"{llvm.get_host_cpu_name()}, {platform.system()}, {versions}"


def csv_text(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table as comma-separated values, numbers in full, a number that is not there empty."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(["" if isinstance(v, float) and v != v else v for v in row] for row in rows)
    return target.getvalue()


def text(module: ModuleType, rows: Sequence[Sequence[object]]) -> str:
    """The table of a benchmark in Markdown, and under it its summary where it has one."""
    more = str(module.summary(rows)) if rows and hasattr(module, "summary") else ""
    return markdown(module.COLUMNS, rows) + (f"\n\n{more}" if more else "")


def write(name: str, module: ModuleType, rows: Sequence[Sequence[object]], folder: Path) -> list[Path]:
    """Write `<name>.csv`, `<name>.md` and, where the benchmark draws, `<name>.png` and `.svg`;
    returns their paths.
    """
    from synchain.runtime.support.files import write_text

    table, page = folder / f"{name}.csv", folder / f"{name}.md"
    write_text(table, csv_text(module.COLUMNS, rows))
    left_out = [f"\n{line}\n" for line in (module.notes() if hasattr(module, "notes") else ())]
    write_text(page, f"# {name}\n\n{machine()}\n\n{text(module, rows)}\n{''.join(left_out)}")
    if not hasattr(module, "draw"):
        return [table, page]
    from synchain.runtime.plots.style import context, save

    with context():
        return [table, page, *save(module.draw(rows), folder, name)]
