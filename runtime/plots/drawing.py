"""Plots of every kind of result: functions that draw into axes and return the axes."""

from __future__ import annotations

import inspect
from functools import singledispatch
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from synchain.models.inputs.display import HasPlot
from synchain.models.spectra.spectrum import Spectrum

from ..bifurcation.equilibrium import Equilibrium
from ..bifurcation.periodic_result import PeriodicOrbit
from ..bifurcation.results import Bifurcation, Branch, Curve, Diagram
from ..results.reproduction import Reproduction
from ..results.result import Result
from ..stability.cluster_exponents import BlockVerdict, ClusterExponents
from ..stability.exponent_plane import Plane
from ..stability.exponents import Exponents
from ..stability.lyapunov import Lyapunov
from ..stability.msf import MSF
from ..sweeps.run import run
from ..sweeps.stream import Streamed
from ..sweeps.work_precision import WorkPrecision
from ..synchronisation.basin import Basin
from ..synchronisation.critical import Critical
from ..synchronisation.mismatch import Mismatch
from ..synchronisation.probe import Probe
from ..synchronisation.threshold import Thresholds
from ..synchronisation.transition import Transition, TransitionCheck
from .basin_plot import draw_basin
from .canvas import axes_of, check_style, line_style
from .diagram import draw_branches, draw_curve
from .exponent import draw_exponent, finite
from .graph_picture import ALONE, class_colours
from .plane import draw_plane
from .result_plot import draw_result
from .style import BLACK, BLUE, GREEN, GREY, ORANGE, bands, note, symbol

SAMPLES = 400  # points per drive period of a drawn orbit: enough for a smooth curve
COLOURS = (BLUE, GREEN, BLACK, GREY)  # colours of the nodes of an orbit
DOTS: dict[str, Any] = {"linestyle": "none", "marker": "."}  # style of points without a line


def drawn(value: HasPlot, ax: Axes | None, **style: Any) -> Axes:
    """Draw a value into axes (default: pyplot's) and return the axes; pass `style` to Matplotlib's artists."""
    keywords = [name for name in inspect.signature(type(value).plot).parameters if name not in ("self", "style")]
    check_style({name: x for name, x in style.items() if name not in keywords}, "plot", ", ".join(keywords))
    if isinstance(value, Result | Streamed):  # `draw_result` checks the kind of plot before a figure is opened
        return draw_result(value if isinstance(value, Result) else value.result, ax, **style)
    return _draw(value, axes_of(ax), **style)


@singledispatch
def _draw(value: object, axes: Axes, **style: Any) -> Axes:
    raise TypeError(f"found {type(value).__name__}; expected a value with a plot")


@_draw.register
def _(value: MSF, axes: Axes, sigma: float | None = None, **style: Any) -> Axes:
    return draw_exponent(axes, value, sigma, **style)


@_draw.register
def _(value: Plane, axes: Axes, **style: Any) -> Axes:
    return draw_plane(axes, value, **style)


@_draw.register
def _(value: Exponents, axes: Axes, **style: Any) -> Axes:
    """Draw exponents over one strength as a line, over two strengths of a mode as dots, else by index."""
    label, strengths = r"exponent $\Lambda$ per unit of $\tau$", value.alpha.reshape(len(value.alpha), -1)
    columns = np.concatenate([strengths.real, strengths.imag], axis=1).T if np.iscomplexobj(strengths) else strengths.T
    # two strengths, or real and imaginary part of one: coloured dots in their plane, white at zero
    if len(columns) == 2:
        names = (r"$\alpha$", r"$\beta$") if value.alpha.ndim == 1 else (r"$\alpha_1$", r"$\alpha_2$")
        colour = finite(value.exponent)
        top = float(np.nanmax(np.abs(colour), initial=0.0)) or 1.0
        defaults = {"cmap": "RdBu_r", "s": 14.0, "edgecolors": BLACK, "linewidths": 0.3, "vmin": -top, "vmax": top}
        dots = axes.scatter(columns[0], columns[1], c=colour, **{**defaults, **style})
        axes.set(xlabel=names[0], ylabel=names[1])
        axes.figure.colorbar(dots, ax=axes, label=label)
        return axes
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    x = value.alpha if value.on_a_line else np.arange(len(value.alpha))
    axes.errorbar(x, finite(value.exponent), 2 * finite(value.stderr), **line_style(style, color=BLUE))
    axes.set(xlabel=r"strength of a mode $\alpha$" if value.on_a_line else "number of the mode", ylabel=label)
    return axes


@_draw.register
def _(value: Thresholds, axes: Axes, **style: Any) -> Axes:
    """Draw the share of synchronous starts over sigma, with predicted intervals above."""
    # grey where at least half of the starts synchronise
    bands(axes, value.direct.intervals)
    simulated = line_style(style, color=BLUE, drawstyle="steps-mid", label="simulated")
    axes.plot(value.direct.x, value.direct.share, **simulated)
    # intervals above the curve: predicted by the probe, and of negative exponents with two standard errors
    for k, (low, high) in enumerate(value.predicted):
        axes.plot([low, high], [1.06, 1.06], color=ORANGE, marker="|", label="" if k else "predicted by the probe")
    for k, (ends, errors) in enumerate(zip(value.exponents.intervals, value.exponents.errors, strict=True)):
        spread = 2 * finite(np.array(errors))
        axes.errorbar(ends, [1.12, 1.12], xerr=spread, color=GREEN, capsize=2, label="" if k else "negative exponents")
    axes.set(xlabel=symbol(value.scene.strength), ylabel="share of synchronous starts", ylim=(-0.05, 1.18))
    axes.set_xlim(value.direct.x[0], value.direct.x[-1])
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    note(axes, "exponents: not computed" if value.exponents.absent else "")
    return axes


@_draw.register
def _(value: Basin, axes: Axes, kind: str | None = None, **style: Any) -> Axes:
    return draw_basin(axes, value, kind, style)


@_draw.register
def _(value: Spectrum, axes: Axes, **style: Any) -> Axes:
    """Draw multiplicities over real eigenvalues, and complex eigenvalues as points of the complex plane."""
    values, counts = np.array(list(value.values)), np.array(list(value.multiplicities))
    if np.iscomplexobj(values):
        dots = {"s": 24.0 * counts, "color": BLUE, "alpha": 0.7, **style}
        axes.scatter(values.real, values.imag, **dots)
        axes.axhline(0.0, color=BLACK, linewidth=0.4)
        axes.axvline(0.0, color=BLACK, linewidth=0.4)
        axes.set(xlabel=r"real part of $\gamma$", ylabel=r"imaginary part of $\gamma$")
        note(axes, "areas show multiplicities" if counts.max() > 1 else "")
        return axes
    axes.vlines(values, 0.0, counts, colors=style.get("color", BLUE), linewidth=0.8)
    axes.plot(values, counts, **line_style(style, color=BLUE, marker="o", markersize=4.0, linestyle="none"))
    axes.set(xlabel=r"eigenvalue $\gamma$", ylabel="multiplicity", ylim=(0.0, 1.15 * counts.max()))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    return axes


@_draw.register
def _(value: Lyapunov, axes: Axes, **style: Any) -> Axes:
    """Draw the running averages of the exponents over the length of the average, and their errors at its end."""
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    for running, last, error in zip(value.running.T, value.exponent, value.stderr, strict=True):
        (line,) = axes.plot(value.lengths, finite(running), **line_style(style, linewidth=0.8))
        dot = {"color": line.get_color(), "fmt": "o", "markersize": 2.0, "capsize": 2.0}
        axes.errorbar(value.time, *finite(np.array([last, 2.0 * error])), **dot)
    axes.set(xlabel="length of the average", ylabel="Lyapunov exponents per unit of time")
    lost = int((~value.resolved).sum())
    note(axes, f"{lost} of {len(value.exponent)} decay too fast to be followed" if lost else "")
    return axes


@_draw.register
def _(value: ClusterExponents, axes: Axes, **style: Any) -> Axes:
    """Draw the exponent of each block with two standard errors, coloured by its verdict."""
    colours = {BlockVerdict.STABLE: BLUE, BlockVerdict.UNDECIDED: GREY, BlockVerdict.UNSTABLE: ORANGE}
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    for k, verdict in enumerate(value.verdicts):
        look = line_style(style, color=colours[verdict], linestyle="none", marker="o")
        axes.errorbar([k + 1], finite(value.exponent[[k]]), 2 * value.stderr[[k]], **look)
    names = [f"block {k + 1}\nclusters {', '.join(str(c + 1) for c in row)}" for k, row in enumerate(value.intertwined)]
    axes.set_xticks(range(1, len(names) + 1), names)
    axes.set_ylabel("exponent per unit of time")
    axes.margins(x=0.2)
    return axes


@_draw.register
def _(value: Reproduction, axes: Axes, **style: Any) -> Axes:
    """Draw each computed number less the published one, in units of the largest difference that counts as agreement."""
    published, found, difference = np.array([*value.claims.values()]).T
    units = np.where(difference > 0.0, difference, np.where(published == 0.0, 1.0, np.abs(published)))
    heights = np.arange(len(units))[::-1]
    axes.axvspan(-1.0, 1.0, color=GREY, alpha=0.25, linewidth=0.0)
    axes.plot((found - published) / units, heights, **line_style(style, color=BLUE, linestyle="none", marker="o"))
    axes.set_yticks(heights, list(value.claims))
    axes.set(xlabel="found − published, in units of what counts as agreement", ylim=(-0.6, len(units) - 0.4))
    return axes


@_draw.register
def _(value: Equilibrium, axes: Axes, **style: Any) -> Axes:
    """Draw the eigenvalues in the complex plane, orange where perturbations grow."""
    grows = value.eigenvalues.real > 0.0 if value.growing else np.zeros(len(value.eigenvalues), dtype=bool)
    axes.axvline(0.0, color=BLACK, linewidth=0.6)
    for chosen, colour in ((~grows, BLUE), (grows, ORANGE)):
        axes.plot(
            value.eigenvalues.real[chosen], value.eigenvalues.imag[chosen], **line_style(style, **DOTS, color=colour)
        )
    axes.set(xlabel="real part of eigenvalues", ylabel="imaginary part")
    note(axes, value.verdict)
    return axes


@_draw.register
def _(value: PeriodicOrbit, axes: Axes, **style: Any) -> Axes:
    """Draw the closed curve of the first two components of each node, with a dot at the start of each period."""
    components, nodes = len(value.components), value.scene.n
    one = value.scene.replace(
        record=("trajectory",),
        samples=SAMPLES * value.periods,
        transient=0.0,
        window=value.period,
        time_unit="time",
        initial={name: value.data.state.sel(component=name).values.tolist() for name in value.components},
        rtol=1e-12,
    )
    trajectory = run(one, show_progress=False, workers=1).trajectory
    names = value.components[0], value.components[min(1, components - 1)]
    points = value.points.reshape(value.periods, components, nodes)
    # nodes that move alike are drawn once
    for node in sorted({value.classes.index(k) for k in value.classes}):
        path = trajectory.isel(node=node)
        colour = COLOURS[node % len(COLOURS)]
        axes.plot(*(path.sel(component=name) for name in names), **line_style(style, color=colour))
        axes.plot(points[:, 0, node], points[:, min(1, components - 1), node], **DOTS, markersize=6.0, color=ORANGE)
    axes.set(xlabel=symbol(names[0]), ylabel=symbol(names[1]))
    return axes


@_draw.register
def _(value: Bifurcation, axes: Axes, **style: Any) -> Axes:
    return _draw(value.solution, axes, **style)


@_draw.register
def _(value: Branch, axes: Axes, y: str | None = None, **style: Any) -> Axes:
    return draw_branches(axes, (value,), y, style)


@_draw.register
def _(value: Diagram, axes: Axes, y: str | None = None, **style: Any) -> Axes:
    return draw_branches(axes, value.branches, y, style)


@_draw.register
def _(value: Curve, axes: Axes, **style: Any) -> Axes:
    return draw_curve(axes, value, style)


@_draw.register
def _(value: Probe, axes: Axes, **style: Any) -> Axes:
    """Draw strengths in the complex plane: dots where synchronous, crosses where not."""
    good = value.synchronous
    axes.plot(
        value.alpha[good],
        value.beta[good],
        **line_style(style, **DOTS, markersize=7.0, color=BLUE, label="synchronous"),
    )
    crosses: dict[str, Any] = {"linestyle": "none", "marker": "x", "markersize": 5.0}
    axes.plot(
        value.alpha[~good], value.beta[~good], **line_style(style, **crosses, color=ORANGE, label="not synchronous")
    )
    axes.set(xlabel=r"$\alpha$", ylabel=r"$\beta$")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return axes


@_draw.register
def _(value: Transition, axes: Axes, **style: Any) -> Axes:
    """Draw a line for each node over the coupling strength, coloured by its cluster; grey bands are errors of steps."""
    steps, labels = value.steps, value.scene.topology.labels
    states = [value.first, *(step.classes for step in steps)]
    # nodes that join early are neighbours: sort by the clusters of the last state first
    order = sorted(range(len(labels)), key=lambda i: tuple(state[i] for state in reversed(states)))
    height = {node: place for place, node in enumerate(order)}
    ends = [0.0, *(step.strength for step in steps), value.highest]
    for state, low, high in zip(states, ends[:-1], ends[1:], strict=True):
        for node, colour in enumerate(class_colours(np.array(state))):
            width = 1.0 if colour == ALONE else 5.0
            look = line_style(style, color=colour, linewidth=width, solid_capstyle="butt")
            axes.plot([low, high], [height[node]] * 2, **look)
    for step in steps:
        axes.axvline(step.strength, color=BLACK, linewidth=0.6)
        if np.isfinite(step.error):
            bands(axes, [(step.strength - step.error, step.strength + step.error)])
    axes.set(xlabel=symbol(value.scene.strength), ylabel="node", xlim=(0.0, value.highest))
    axes.set_yticks(range(len(order)), [str(labels[node]) for node in order])
    return axes


@_draw.register
def _(value: TransitionCheck, axes: Axes, **style: Any) -> Axes:
    """Draw the exponents of each step's state over the strength relative to the predicted one."""
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    axes.axvline(1.0, color=BLACK, linewidth=0.6)
    for k, step in enumerate(value.transition.steps):
        if np.isfinite(value.exponent[k]).all():
            look = line_style(style, marker="o", label=f"step {k + 1}")
            axes.errorbar(value.strength[k] / step.strength, value.exponent[k], 2 * value.stderr[k], **look)
    axes.set(xlabel="strength / predicted strength", ylabel="exponent of the cluster state per unit of time")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4)
    else:
        note(axes, "no step has exponents on both sides")
    return axes


@_draw.register
def _(value: Mismatch, axes: Axes, **style: Any) -> Axes:
    """Draw the part of each mode in the deviations over its eigenvalue."""
    for k, name in enumerate(value.component):
        parts = value.size * value.response[:, k] / np.sqrt(value.scene.n)
        axes.plot(value.gamma, parts, **line_style(style, marker="o", linestyle="", label=symbol(name)))
    axes.set(xlabel=symbol("gamma"), ylabel="root mean square of deviations", yscale="log")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4)
    return axes


@_draw.register
def _(value: Critical, axes: Axes, **style: Any) -> Axes:
    """Draw the values over the second parameter, else the exponents over the parameter; bars are two errors long."""
    bars = {"marker": "o", "markersize": 3.0, "color": BLUE}
    if value.along_values is not None:
        axes.errorbar(value.along_values, value.value, 2 * value.error, **line_style(style, **bars))
        axes.set(xlabel=symbol(value.along), ylabel=symbol(value.name))
        return axes
    tried = value.evaluations[np.argsort(value.evaluations[:, 1])]
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    axes.errorbar(tried[:, 1], finite(tried[:, 2]), 2 * tried[:, 3], **line_style(style, **bars))
    bands(axes, [(float(value.value - value.error), float(value.value + value.error))])
    axes.axvline(float(value.value), color=ORANGE, linewidth=0.9)
    axes.set(xlabel=symbol(value.name), ylabel="largest exponent per unit of time")
    return axes


@_draw.register
def _(value: WorkPrecision, axes: Axes, **style: Any) -> Axes:
    """Draw time over error, a line for each integrator; the grey band has errors below the reference's."""
    for name, seconds, error in zip(value.integrator, value.seconds, value.error, strict=True):
        axes.loglog(error, 1e3 * seconds, **line_style(style, marker="o", label=name))
    low = np.nanmin(value.error[value.error > 0], initial=1.0)
    if value.reference_error > low:
        bands(axes, [(low, value.reference_error)])
    axes.invert_xaxis()
    axes.set(xlabel="largest relative error of the final states", ylabel="CPU time (ms)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    return axes
