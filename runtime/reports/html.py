"""Convert values to HTML for notebooks and to LaTeX: short, escaped, without scripts.

Fragments inherit the colours of the page, so that they are readable on light and dark backgrounds.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterable, Sequence
from functools import singledispatch
from html import escape
from itertools import islice
from typing import TYPE_CHECKING

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.topology import Topology, edges_text
from synchain.models.presentation.equations_text import latex as latex_of
from synchain.models.presentation.equations_text import lines
from synchain.models.presentation.mathml import formula
from synchain.models.presentation.writer import ExpressionWriter, Latex, Text
from synchain.models.scenes.scene import Scene
from synchain.models.spectra.eigenvalue import Eigenvalue, decimal
from synchain.models.spectra.spectrum import Spectrum
from synchain.models.sweeps.distribution import Draw
from synchain.models.sweeps.draws import RandomGraph

from ..plots.graph_picture import svg
from ..results.labelled import Labelled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Style rules of all fragments; fragments inherit the colours of the page. The attributes mark dark pages of Jupyter,
# Visual Studio Code and this documentation: there, white plots with dark lines become dark plots with light lines.
STYLE = """
.synchain{font-family:system-ui,sans-serif;line-height:1.45}
.synchain table{border-collapse:collapse;margin:.4em 0}
.synchain th,.synchain td{text-align:left;padding:.12em .9em .12em 0;border-bottom:1px solid rgba(128,128,128,.3);
vertical-align:middle}
.synchain th{font-weight:600}
.synchain td.number{text-align:right;font-variant-numeric:tabular-nums}
.synchain math{font-size:1.08em;margin:.25em 0}
.synchain math[display=block]{text-align:left;display:block math;width:max-content}
.synchain .side{display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start}
.synchain .formulae{overflow-x:auto;padding:.1em 0}
.synchain img{max-width:100%;background:#fff}
[data-jp-theme-light=false] .synchain img,.vscode-dark .synchain img,[data-theme=dark] .synchain img{
filter:invert(.9) hue-rotate(180deg)}
.synchain .quiet{opacity:.75}
"""

LINES, ROWS = 14, 12  # most lines of equations, and most rows of a table (a choice)
LONG = 400  # most characters of LaTeX of an equation; a longer equation is shown as plain text, whose lines can break
EXACT = 40  # most nodes of a graph without a closed form whose spectrum is computed for display

PLAIN = ExpressionWriter(Latex(), {}, frozenset())


def fragment(value: object) -> str:
    """Return a value as HTML that can be inserted into a page."""
    return f'<style>{STYLE}</style><div class="synchain">{body(value)}</div>'


def latex(value: object) -> str:
    """Return equations, a spectrum or a scene's equations as LaTeX."""
    if isinstance(value, Scene):
        return latex(value.equations)
    if isinstance(value, Equations):
        return latex_of(value) if _short(value) else "\n".join(["\\begin{gather*}", *_joined(value), "\\end{gather*}"])
    if isinstance(value, Spectrum):
        rows = " \\\\\n".join(f"{_exact(e)} & {e.multiplicity}" for e in _chosen(value))
        more = f" \\\\\n\\dots & {len(value)}\\text{{ distinct}}" if len(value) > ROWS else ""
        return (
            f"$$\\begin{{array}}{{lr}}\n\\gamma & \\text{{multiplicity}} \\\\\n\\hline\n{rows}{more}\n\\end{{array}}$$"
        )
    raise TypeError(f"found {type(value).__name__}; expected equations or a spectrum")


@singledispatch
def body(value: object) -> str:
    """Return a value as HTML without style rules; raise TypeError if it cannot be shown."""
    raise TypeError(f"found {type(value).__name__}; expected a value that can be shown")


@body.register
def _(value: Equations) -> str:
    pairs = islice(zip(lines(value, Latex()), lines(value, Text()), strict=True), LINES)
    written = [formula(line, display=True) if len(line) < LONG else f"<p>{escape(text)}</p>" for line, text in pairs]
    more = "" if _short(value) else '<p class="quiet">… and so on for the other nodes</p>'
    return f'<div class="formulae">{"".join(written)}</div>{more}'


@body.register
def _(value: Spectrum) -> str:
    rows = [(_shown(e), decimal(e.value), str(e.multiplicity)) for e in _chosen(value)]
    listed = [
        f'<tr><td>{a}</td><td class="number">{escape(b)}</td><td class="number">{c}</td></tr>' for a, b, c in rows
    ]
    if len(value) > len(rows):
        listed.insert(len(rows) - 1, f'<tr><td colspan="3">… {len(value) - len(rows)} more</td></tr>')
    state = "proved" if value.verified else "not multiplied out (closed form of a large graph, or modulo primes)"
    counts = f"{value.n} eigenvalues, {len(value)} distinct; characteristic polynomial: {state}"
    head = "<tr><th>eigenvalue γ</th><th>decimal</th><th>multiplicity</th></tr>"
    return f'<table>{head}{"".join(listed)}</table><p class="quiet">{counts}</p>'


@body.register
def _(value: Topology) -> str:
    return f"<p><b>{escape(_graph_text(value))}</b></p>{_beside(svg(value), _spectrum_body(value))}"


@body.register
def _(value: Scene) -> str:
    title = escape(value.title or "Scene")
    rows = [("oscillators", _oscillators(value)), *_records(value)]
    parts = [f"<p><b>{title}</b></p>", body(value.equations), rows_table(rows)]
    parts += [f"<p><b>{escape(_graph_text(value.topology))}</b></p>"]
    parts += [_beside(svg(value), _spectrum_body(value.topology))] if value.n > 1 else []
    return "".join(parts)


@body.register
def _(value: Labelled) -> str:
    name = f"<p><b>{escape(type(value).__name__)}</b></p>"
    return f"{name}{rows_table(value.summary)}{figure(value.plot, type(value).__name__)}"


def rows_table(rows: Iterable[tuple[str, str]]) -> str:
    listed = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
    return f"<table>{listed}</table>"


def figure(plot: Callable[[Axes], Axes], description: str) -> str:
    """Return a plot as an image embedded in the page, drawn without pyplot."""
    from ..plots.canvas import off_screen

    buffer = io.BytesIO()
    with off_screen() as (drawn, axes):
        plot(axes)
        drawn.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    text = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{escape(description, quote=True)}" src="data:image/png;base64,{text}"/>'


def spectrum_of(graph: Topology) -> Spectrum | None:
    """Return the exact spectrum if fast to compute (a closed form or a small graph), else None."""
    return graph.spectrum if graph.n <= EXACT or graph.closed_form() is not None else None


def provenance_rows(scene: Scene) -> list[tuple[str, str]]:
    """Return the numbers of a scene as names and texts: parameters, start, method, tolerances."""
    unit = "drive periods" if scene.time_unit == "period" else "units of time"
    numbers = [f"{name} = {value:g}" for name, value in scene.parameters.items()]
    start = [f"{name} = {_numbers(values)}" for name, values in scene.initial.items()]
    axes = [f"{axis.name} from {min(axis.values):g} to {max(axis.values):g}, {len(axis)} values" for axis in scene.axes]
    observed = [f"{name} = {value}" for name, value in scene.observe.items()]
    drawn = [
        f"{name} = {value if isinstance(value, Draw | RandomGraph) else 'a list'}"
        for name, value in scene.draws.items()
    ]
    count = f", {scene.realisations} realisations" if drawn else ""
    more = [("sweep", "; ".join(axes)), ("drawn", "; ".join(drawn) + count), ("observed", "; ".join(observed))]
    return [
        ("parameters", _few(numbers)),
        ("start", "; ".join(start)),
        ("time", f"transient {scene.transient:g}, window {scene.window:g} {unit}"),
        ("integrator", f"{scene.integrator}, rtol {scene.rtol:g}, atol {scene.atol:g}"),
        *(row for row in more if row[1]),
    ]


def _spectrum_body(graph: Topology) -> str:
    spectrum = spectrum_of(graph)
    if spectrum is None:
        return '<p class="quiet">its spectrum has no closed form; <code>.spectrum</code> computes it exactly</p>'
    return body(spectrum)


def _beside(first: str, second: str) -> str:
    return f'<div class="side"><div>{first}</div><div>{second}</div></div>'


def _graph_text(graph: Topology) -> str:
    options = "".join(f", {key} = {value}" for key, value in graph.options)
    return f"{graph.name}: {graph.n} node{'s' * (graph.n > 1)}, {edges_text(graph)}{options}"


def _oscillators(scene: Scene) -> str:
    kinds = [
        f"{kind.oscillator.name} with {kind.friction.name} friction" if kind.friction else kind.oscillator.name
        for kind in scene.model.kinds
    ]
    coupling = f", {scene.coupling} coupling" if scene.coupling and scene.topology.link_count else ""
    return " and ".join(dict.fromkeys(kinds)) + coupling


def _records(scene: Scene) -> list[tuple[str, str]]:
    record = ", ".join(map(str, scene.record)) or "the end of the window only"
    if "section" in scene.record:
        record += f" ({scene.section})"
    axes = " × ".join(
        f"{axis.name}: {len(axis)} values, {min(axis.values):g} … {max(axis.values):g}" for axis in scene.axes
    )
    cells = [("sweep", axes + (" together" if scene.zipped else ""))] if scene.axes else []
    return [*provenance_rows(scene), ("records", record), *cells]


def _numbers(values: Sequence[float]) -> str:
    return _few([f"{value:g}" for value in values])


def _few(texts: Sequence[str], most: int = 12) -> str:
    more = [f"… {len(texts) - most} more"] if len(texts) > most else []
    return ", ".join([*texts[:most], *more])


def _short(equations: Equations) -> bool:
    """Return True if the equations are few enough to show all."""
    return len(list(islice(lines(equations, Latex()), LINES + 1))) <= LINES


def _joined(equations: Equations) -> list[str]:
    return [f"{line} \\\\" for line in islice(lines(equations, Latex()), LINES)] + ["\\dots"]


def _chosen(spectrum: Spectrum) -> list[Eigenvalue]:
    """Return the first eigenvalues and the last."""
    if len(spectrum) <= ROWS:
        return list(spectrum)
    return [*spectrum[: ROWS - 2], spectrum[-1]]


def _exact(e: Eigenvalue) -> str:
    """Return an eigenvalue as LaTeX, or as a decimal number if it is a root of a long polynomial."""
    if isinstance(e.number, sp.Expr) and not e.number.atoms(sp.Piecewise):
        return PLAIN.write(e.number)
    return f"\\text{{{e}}}"


def _shown(e: Eigenvalue) -> str:
    text = _exact(e)
    return escape(str(e)) if text.startswith("\\text") or len(text) > 300 else formula(text)
