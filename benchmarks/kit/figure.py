"""Work-precision diagrams: time per period against error, one panel a case, log-log."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from matplotlib.figure import Figure

from synchain.runtime.plots.style import BLACK, BLUE, COLUMN, GREEN, ORANGE, PURPLE, SKY, new_figure

from .compare import curves

COLOURS = (ORANGE, GREEN, PURPLE, SKY, BLACK)
OWN = "o*hdp"
MARKERS = ("s", "^", "v", "D", "P", "X")


def figure(rows: Iterable[Mapping[str, object]], own: set[str]) -> Figure:
    """Draw the rows: this program's methods in blue, dashed for one lane; peers told apart by
    colour and marker.
    """
    cases = curves(rows)
    wide = min(3, max(1, len(cases) + 1))
    high = -(-(len(cases) + 1) // wide)
    made = new_figure((2.0 * COLUMN, 0.75 * COLUMN * high))
    panels = list(made.subplots(high, wide, squeeze=False).flat)
    looks = _looks(cases, own)
    for axes, (case, methods) in zip(panels, cases.items(), strict=False):
        for key, points in methods.items():
            axes.loglog(*zip(*points, strict=True), **looks[key])
        axes.set_title(case)
        axes.set_xlabel("largest error of the state")
        axes.set_ylabel("time per period and core (µs)")
        axes.invert_xaxis()
    for axes in panels[len(cases) :]:
        axes.axis("off")
    entries = [panels[-1].plot([], [], **look)[0] for look in looks.values()]
    panels[-1].legend(handles=entries, loc="center", fontsize=6.0)
    return made


def _looks(
    cases: Mapping[str, Mapping[tuple[str, str], object]], own: set[str]
) -> dict[tuple[str, str], dict[str, object]]:
    """How each curve is drawn, the same in all panels."""
    keys = list(dict.fromkeys(key for methods in cases.values() for key in methods))
    peers = [key for key in keys if key[0] not in own]
    integrators = list(dict.fromkeys(name for name, _ in keys if name in own))
    looks: dict[tuple[str, str], dict[str, object]] = {}
    for name, lanes in keys:
        label = f"{name}, {lanes} lanes" if lanes != "1" else name
        if name in own:
            style, marker = ("-" if lanes != "1" else "--"), OWN[integrators.index(name) % len(OWN)]
            looks[name, lanes] = {"color": BLUE, "linestyle": style, "marker": marker, "label": f"synchain {label}"}
        else:
            place = peers.index((name, lanes))
            colour, marker = COLOURS[place % len(COLOURS)], MARKERS[place % len(MARKERS)]
            looks[name, lanes] = {"color": colour, "linewidth": 0.6, "marker": marker, "label": label}
    return looks
