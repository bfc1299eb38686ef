"""The table of docs/problems.md, made by ``python docs/measure.py [EXAMPLE ...]``.

Each example of the gallery, or each one named, runs in two fresh processes: the first has an empty
cache of kernels, the second has the kernels of the first.  Counted are the sections *Model and run*
and *Figure* with their imports; the check runs too, and its time is not counted.
"""

from __future__ import annotations

import json
import math
import os
import re
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

GALLERY = Path(__file__).parent / "gallery"


def sections(example: Path) -> dict[str, str]:
    """Return the sections of an example by their headings."""
    parts = re.split(r"^# %%\n# (.+)\n# -+\n", example.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def lines(example: Path) -> int:
    """Return the number of lines of model and run, without comments and empty lines."""
    return len(re.findall(r"^[^#\n].*", sections(example)["Model and run"], re.MULTILINE))


def title(example: Path) -> str:
    """Return what the page of an example is called."""
    return example.read_text(encoding="utf-8").splitlines()[1]


def measure(example: Path) -> dict[str, list[float]]:
    """Run an example here; return wall and CPU seconds of its sections, and its difference."""
    namespace: dict[str, object] = {"__name__": "__main__"}
    found: dict[str, list[float]] = {}
    for heading, text in sections(example).items():
        wall, used = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
        exec(compile(text, str(example), "exec"), namespace)
        if heading == "Figure":
            sys.modules["matplotlib.pyplot"].savefig(os.devnull, format="png")
        now = resource.getrusage(resource.RUSAGE_SELF)
        processor = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
        found[heading] = [time.perf_counter() - wall, processor]
    return found | {"difference": [float(namespace["difference"])]}  # type: ignore[arg-type]


def row(example: Path) -> str:
    """Return the line of the table for an example."""
    with TemporaryDirectory() as cache:
        environment = os.environ | {"SYNCHAIN_CACHE": cache, "MPLBACKEND": "agg"}
        command = [sys.executable, __file__, "--here", example.stem]
        runs = [json.loads(subprocess.check_output(command, env=environment).splitlines()[-1]) for _ in "12"]
    times = [[sum(run[part][k] for part in ("Model and run", "Figure")) for k in (0, 1)] for run in runs]
    digits = math.floor(-math.log10(runs[0]["difference"][0]))
    numbers = " | ".join(f"{wall:.1f} | {processor:.1f}" for wall, processor in times)
    return f"| [{title(example)}](built/gallery/{example.stem}) | {lines(example)} | {digits} | {numbers} |"


if __name__ == "__main__":
    if sys.argv[1:2] == ["--here"]:
        print(json.dumps(measure(GALLERY / f"{sys.argv[2]}.py")))
    else:
        print("| example | lines | digits | first run: s | CPU s | later: s | CPU s |")
        print("|---|---:|---:|---:|---:|---:|---:|")
        for name in sys.argv[1:] or sorted(path.stem for path in GALLERY.glob("*.py")):
            print(row(GALLERY / f"{name}.py"), flush=True)
