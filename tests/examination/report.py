"""The tables of docs/examination.md, made by ``python tests/examination/report.py [flows|problems|graphs|lagrangians ...]``.

Names after a part restrict it: ``python tests/examination/report.py problems VDPOL RING``.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator

import flows
import lagrangians
import numpy as np
import problems
import test_atlas
from test_flows import DIGITS as OF_FLOWS
from test_problems import DIGITS as OF_PROBLEMS


def attempted(digits: Callable[[], float]) -> tuple[float, str]:
    """Digits, or minus infinity, and why there are none."""
    try:
        number = digits()
    except Exception as error:
        return -np.inf, str(error).splitlines()[0][:80]
    return number, "" if np.isfinite(number) else "the run did not end"


def table(names: list[str], digits: Callable[[str], float], least: float) -> Iterator[str]:
    """A line for each name, then right, wrong and lost ones."""
    collected = {}
    yield "| name | digits | |"
    yield "|---|---:|---|"
    for name in names:
        collected[name], why = attempted(lambda name=name: digits(name))
        yield (
            f"| {name} | {collected[name]:.1f} | {why} |"
            if np.isfinite(collected[name])
            else f"| {name} | lost | {why} |"
        )
    values = np.array(list(collected.values()))
    right, lost = int((values > least).sum()), int((~np.isfinite(values)).sum())
    ended = values[np.isfinite(values)]
    middle = f"; median {np.median(ended):.1f} digits" if len(ended) else ""
    yield f"\n{len(values)} tried: {right} right, {len(values) - right - lost} wrong, {lost} lost{middle}.\n"


PARTS: dict[str, tuple[Callable[[], list[str]], Callable[[str], float], float]] = {
    "flows": (flows.names, lambda name: flows.digits(flows.flow(name)), OF_FLOWS),
    "problems": (lambda: list(problems.PROBLEMS), lambda name: problems.digits(problems.PROBLEMS[name]), OF_PROBLEMS),
    "lagrangians": (
        lambda: list(lagrangians.SYSTEMS),
        lambda name: float(-np.log10(max(lagrangians.difference(name), 1e-16))),
        10.0,
    ),
    "graphs": (
        lambda: [str(number) for number in range(1, test_atlas.GRAPHS)],
        lambda name: float(-np.log10(max(test_atlas.check(int(name)), 1e-16))),
        12.0,
    ),
}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    parts = [word for word in sys.argv[1:] if word in PARTS] or list(PARTS)
    chosen = [word for word in sys.argv[1:] if word not in PARTS]
    for part in parts:
        names, digits, least = PARTS[part]
        print(f"### {part}\n")
        for line in table(chosen or names(), digits, least):
            print(line, flush=True)
