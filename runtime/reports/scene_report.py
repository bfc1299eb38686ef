"""Report of a scene as one page of HTML: equations, graph, exact spectrum, stability, a sweep, provenance.

The page is self-contained: it loads no script, font or image.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from html import escape

from synchain.models.presentation.equations_text import latex
from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.sweeps.axis import thinned

from ..engines.job import versions
from ..engines.scene_kernels import kernel_source
from ..stability.msf import MSF, default_strengths, msf
from ..sweeps.run import run
from .html import STYLE, body, figure, provenance_rows, rows_table

PAGE = """
:root{color-scheme:light dark}
body{margin:0 auto;max-width:52em;padding:1.5em;background:#fff;color:#1a1a1a}
h1{font-size:1.5em;line-height:1.25;margin:.2em 0 .6em}
h2{font-size:1.15em;margin:1.6em 0 .5em;padding-top:.5em;border-top:1px solid rgba(128,128,128,.5)}
pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:.85em}
code{overflow-wrap:anywhere}
img{display:block}
@media screen and (prefers-color-scheme:dark){body{background:#16181c;color:#e6e6e6}
circle{stroke:#e6e6e6;stroke-width:.5}
img{filter:invert(.9) hue-rotate(180deg)}}
@media print{body{background:#fff;color:#000;max-width:none;padding:0}h2{break-after:avoid}
img,svg,table,math{break-inside:avoid}details{display:none}}
"""


# Tells the browser to run no script and to load nothing.
POLICY = (
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; style-src 'unsafe-inline'; img-src data:\">"
)


@dataclass(frozen=True, slots=True)
class Effort:
    strengths: int = 241  # number of strengths of the master stability function
    precision: float | None = None  # as for `synchain.exponents`
    periods: float = 5000.0
    values: int | None = None  # largest number of values of each axis of the sweep; None for all values


QUICK = Effort(strengths=61, precision=1e-2, periods=300.0, values=25)  # effort for a first look


def report(
    scene: Scene, effort: Effort | None = None, *, workers: int | None = None, show_progress: bool | None = None
) -> str:
    """Compute the report of a scene and return it as a page of HTML."""
    effort = Effort() if effort is None else effort
    title = escape(check_scene(scene).title or repr(scene))
    parts = [f"<h1>{title}</h1>", *(f"<p>Note: {escape(words)}</p>" for words in scene.warnings)]
    source = f"<details><summary>LaTeX</summary><pre>{escape(latex(scene.equations))}</pre></details>"
    parts += [_section("Equations", body(scene.equations) + source)]
    parts += [_section("Numbers", rows_table(provenance_rows(scene)))]
    if scene.n > 1:
        parts += [_section("Network and exact spectrum", body(scene.topology))]
        parts += [_section("Master stability function", _stability(scene, effort, workers, show_progress))]
    if scene.axes:
        # Run the sweep of the scene, thinned to the values of the effort, and return it as HTML.
        coarse = scene.replace(axes=tuple(thinned(axis, effort.values) for axis in scene.axes))
        result = run(coarse, workers=workers, show_progress=show_progress)
        plain = [None] if not scene.observe or {"sync_error", "section"} & set(scene.record) else []
        pictures = "".join(
            figure(partial(result.plot, kind=kind), kind or "sweep") for kind in (*plain, *scene.observe)
        )
        count = "" if coarse.cells == scene.cells else f"<p>{coarse.cells} of the scene's {scene.cells} cells.</p>"
        sweep = f"{count}{rows_table(result.summary[1:3])}{pictures}"
        parts += [_section("Sweep", sweep)]
    rows = [
        ("versions", versions()),
        ("equations", scene.equations.digest),
        ("kernel", kernel_source(scene).digest),
        ("seed", str(scene.rng)),
    ]
    text = json.dumps(scene.as_dict(), indent=1)
    provenance = f"{rows_table(rows)}<details><summary>the scene</summary><pre>{escape(text)}</pre></details>"
    parts += [_section("Provenance", provenance)]
    head = f'<meta charset="utf-8">{POLICY}<meta name="viewport" content="width=device-width"><title>{title}</title>'
    content = "\n".join(parts)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head>{head}<style>{STYLE}{PAGE}</style></head>\n'
        f'<body class="synchain">\n{content}\n</body></html>\n'
    )


def _section(name: str, content: str) -> str:
    return f"<section><h2>{escape(name)}</h2>{content}</section>"


def _stability(scene: Scene, effort: Effort, workers: int | None, show_progress: bool | None) -> str:
    """Return the master stability function with its windows, or the reason why there is none."""
    try:
        function = msf(
            scene.replace(axes=()),
            default_strengths(scene, effort.strengths),
            precision=effort.precision,
            periods=effort.periods,
            workers=workers,
            show_progress=show_progress,
        )
        picture = figure(function.plot, "exponent over strength")
        return f"{rows_table(function.summary[1:])}{picture}{_ends(function)}{_fixed(scene)}"
    except (ValueError, FloatingPointError) as problem:
        return f"<p>This scene has none: {escape(str(problem))}</p>"


def _ends(function: MSF) -> str:
    """Return a sentence if a stable range may continue beyond the grid; strengths begin at 0."""
    first, last = function.fine.alpha[[0, -1]]
    cut = [low for low, _ in function.intervals if low == first != 0.0]
    cut += [high for _, high in function.intervals if high == last]
    ends = " and at ".join(f"{end:g}" for end in cut)
    return f'<p class="quiet">The range that ends at alpha = {ends} ends there with the grid.</p>' if cut else ""


def _fixed(scene: Scene) -> str:
    """Return a sentence if the sweep changes other parameters than the strength, which the function keeps fixed."""
    moved = [axis.name for axis in scene.axes if axis.name != scene.strength]
    text = f"The sweep moves {', '.join(moved)}; this function is that of the scene's own values."
    return f'<p class="quiet">{escape(text)}</p>' if moved else ""
