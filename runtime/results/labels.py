"""Label the numbers of a kernel: variables of any cells of a result, coordinates, provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.codegen.driver.columns import Count, PointColumn, SpanColumn, SumColumn
from synchain.models.scenes.scene import Scene

from ..cells.observable_arrays import ObservableArrays, Sections
from ..engines.choice import method_names
from ..support.status import Status
from .certificate import VERDICTS, Certificate

if TYPE_CHECKING:
    from synchain.codegen.machine_code.compile import Kernel

    from ..cells.buffers import Buffers

# Name, dimensions besides the dimensions of the sweep, values with one row for each cell.
Variable = tuple[str, tuple[str, ...], np.ndarray]
STATE = ("component", "node")  # the dimensions of a state
# Variable of the initial states of the cells, if these differ from the initial states of the scene.
START_STATE = "start_state"
# Coordinates of each cell: the time at which it stopped, and the phase of the drive there, from 0 to 1.
END_TIME, DRIVE_PHASE = "end_time", "drive_phase"
# Variables that are coordinates of other variables.
TIMES = ("time", "section_time", "event_time", END_TIME, DRIVE_PHASE)
TEXTS = ("scene", "title", "equations", "kernel", "versions")  # attributes of a result that are text

MEANINGS = {
    "sync_error": "average synchronisation error",
    "sync_error_max": "largest synchronisation error seen in the window",
    "sync_error_end": "synchronisation error at the end of the window",
    "status": "how the cell ended",
    "steps": "accepted steps",
    "rejected": "rejected steps",
    "periods_skipped": "periods of the drive jumped over in a cell that repeats itself",
    "end": "state at the end of the window",
    "end_time": "non-dimensional time at which the cell stopped",
    "drive_phase": "part of a drive period that had passed at end_time; NaN if the drive has no period, 0 without drive",
    "section_count": "number of section points in the window",
    "section_time": "times of the section points",
    "section": "states at the section points, NaN where there are fewer",
    "event_count": "number of events in the window",
    "event_time": "times of the events",
    "event_node": "node of the event",
    "event_row": "contact, stop, reset or surface of the node, from 1",
    "event_before": "mode before the event: sign of the level, 0 held; of a stop 1 open, 0 closed",
    "event_after": "mode after the event",
    "event_impacts": "number of impacts on the stops of each node",
    "event_slips": "number of times that the contacts and surfaces of each node let go",
    "event_resets": "number of resets of each node",
    "trajectory": "states at equally spaced times of the window",
    "time": "times of the trajectory",
    "transversal_exponent": "largest transversal exponent of the synchronous state",
    "transversal_stderr": "standard error of the transversal exponent",
    "ended_early": "1 where the cell ended before its window did, certain to stay synchronous",
    "rtol_used": "relative tolerance of the steps",
    "atol_used": "absolute tolerance of the steps",
    "methods": "integrators that the cell went through",
    "method_steps": "accepted and rejected steps by each integrator",
    "verdict": "; ".join(f"{k} {words}" for k, words in enumerate(VERDICTS)),
}


# Conventions of the attributes `long_name`, `units`, `flag_values`, `flag_masks` and `flag_meanings` of a result.
CONVENTIONS = "CF-1.11"

# Variables with the unit "1" in every model: counts, non-dimensional times, and rates per non-dimensional time. States
# and errors have the units of the model and are dimensionless only in a model with a scaling.
DIMENSIONLESS = frozenset(
    {
        "steps", "rejected", "periods_skipped", "section_count", "method_steps", "end_time", "drive_phase",
        "section_time", "event_time", "event_count",
        "event_impacts", "event_slips", "event_resets", "time", "transversal_exponent", "transversal_stderr", "rtol_used",
    }
)  # fmt: skip

# Variables that are states or distances of states.
SCALED = frozenset({"end", "section", "trajectory", "sync_error", "sync_error_max", "sync_error_end"})

COUNTS = {
    "status": Count.STATUS,
    "steps": Count.ACCEPTED,
    "rejected": Count.REJECTED,
    "periods_skipped": Count.SKIPPED,
    "section_count": Count.POINTS,
}
# The column of `counts` or `sums` of each variable.
SUMS = {
    "sync_error": SumColumn.MEAN,
    "sync_error_max": SumColumn.PEAK,
    "sync_error_end": SumColumn.LAST,
    "end_time": SumColumn.STOPPED_AT,
}

TOLERANCES = ("rtol_used", "atol_used")  # names of the variables of the columns of `Buffers.tolerances`


@dataclass(frozen=True, slots=True)
class States:
    """Row and column of each state of a network in a table of components and nodes."""

    components: tuple[str, ...]
    nodes: int
    rows: np.ndarray  # (states,): index of the component of each state in the order of the equations
    columns: np.ndarray  # (states,): node of each state, from 0
    held: tuple[tuple[int, int], ...] = ()  # places of a state and of the mode that holds it at zero

    @classmethod
    def of(cls, scene: Scene) -> States:
        equations = scene.equations
        holders = [equations.holders(name) for name in equations.components]
        rows = np.repeat(np.arange(len(holders)), [len(nodes) for nodes in holders])
        columns = np.array([node for nodes in holders for node in nodes], dtype=int)
        held = []
        for places, node in ((equations.places[i], equations.node_at(i)) for i in range(equations.n)):
            held += [(places[node.state.index(s)], places[node.state.index(mode)]) for s, mode in node.held]
        return cls(tuple(equations.components), equations.n, rows, columns, tuple(held))

    def table(self, values: np.ndarray) -> np.ndarray:
        """Return states (…, states) as (…, components, nodes); NaN where a node lacks a component."""
        # A state that a row holds at zero is 0, where integration left its rounding error.
        values = np.array(values) if self.held else values
        for state, mode in self.held:
            values[values[..., mode] == 0.0, state] = 0.0
        shape = (*values.shape[:-1], len(self.components), self.nodes)
        if values.shape[-1] == shape[-2] * shape[-1]:
            return values.reshape(shape)
        table = np.full(shape, np.nan)
        table[..., self.rows, self.columns] = values
        return table

    def flat(self, table: np.ndarray) -> np.ndarray:
        """Return states (…, components, nodes) as (…, states); the inverse of `table`."""
        return np.asarray(table[..., self.rows, self.columns])


def variables(
    scene: Scene, spans: np.ndarray, buffers: Buffers, certificate: Certificate | None, most: int
) -> Iterator[Variable]:
    """Yield the variables of some cells; `most` is the largest number of section points in any cell."""
    # Shapes: spans (cells, len(SpanColumn)).
    stopped = buffers.sums[:, SumColumn.STOPPED_AT]
    # How each cell was integrated.
    for name in ("status", "steps", "rejected", "periods_skipped"):
        yield name, (), buffers.counts[:, COUNTS[name]].astype(np.int32)
    ran = buffers.status != Status.NOT_RUN
    for name, values in zip(TOLERANCES, buffers.tolerances.T, strict=True):
        yield name, (), np.where(ran, values, np.nan)
    if scene.integrator == "auto":
        by_method = buffers.counts[:, Count.BY_METHOD : Count.BY_METHOD + len(method_names(scene))]
        yield "methods", (), ((by_method > 0) @ _masks(scene)).astype(np.int32)
        yield "method_steps", ("integrator",), by_method.astype(np.int32)
    # Where the cell stopped: the phase is NaN if the drive has no period, and 0 without a drive.
    states = States.of(scene)
    yield "end", STATE, states.table(buffers.end)
    yield END_TIME, (), stopped
    period = np.where(spans[:, SpanColumn.PERIOD] > 0.0, spans[:, SpanColumn.PERIOD], np.nan)
    yield DRIVE_PHASE, (), np.mod(stopped / period, 1.0) if scene.forced else np.zeros(len(spans))
    # Averages over the window; NaN in a cell that failed before the window.
    if "sync_error" in scene.record:
        unseen = (buffers.status != Status.FINISHED) & (stopped <= spans[:, SpanColumn.START])
        for name in ("sync_error", "sync_error_max"):
            yield name, (), np.where(unseen, np.nan, buffers.sums[:, SUMS[name]])
        yield "sync_error_end", (), buffers.sums[:, SumColumn.LAST]
    for name, rows, columns in ObservableArrays(scene).columns():
        values = buffers.sums[:, columns]
        yield name, ("node",) if rows else (), values if rows else values[:, 0]
    if certificate is not None:
        finished = buffers.finished
        yield "transversal_exponent", (), certificate.exponent
        yield "transversal_stderr", (), certificate.stderr
        yield "ended_early", (), (finished & (stopped < spans[:, SpanColumn.END])).astype(np.int32)
        if "sync_error" in scene.record:
            mean, peak = buffers.sums[:, SumColumn.MEAN], buffers.sums[:, SumColumn.PEAK]
            yield "verdict", (), certificate.verdicts(finished, mean, peak).astype(np.int32)
    # Section points, with NaN after the last point of a cell, and samples of the window.
    if "section" in scene.record:
        points = np.full((len(spans), max(most, 1), buffers.points.shape[2]), np.nan)
        width = min(most, buffers.points.shape[1])
        points[:, :width] = buffers.points[:, :width]
        yield "section_count", (), buffers.point_counts.astype(np.int32)
        yield "section_time", ("point",), points[:, :, PointColumn.TIME]
        yield "section", ("point", *STATE), states.table(points[:, :, PointColumn.STATE :])
    yield from Sections(scene).variables(buffers.points, most)
    if "trajectory" in scene.record:
        yield "time", ("sample",), sample_times(scene, spans)
        yield "trajectory", ("sample", *STATE), states.table(buffers.samples)


def sample_times(scene: Scene, spans: np.ndarray) -> np.ndarray:
    """Return the times (cells, samples) of the trajectory, from t = 0. Shapes: spans (cells, len(SpanColumn))."""
    if scene.t_eval:
        return np.asarray(spans[:, SpanColumn.UNIT, None] * np.array(scene.t_eval))
    fractions = np.linspace(0.0, 1.0, scene.samples) if scene.samples > 1 else np.zeros(1)
    start, end = spans[:, SpanColumn.START, None], spans[:, SpanColumn.END, None]
    return np.asarray(start + (end - start) * fractions)


def _masks(scene: Scene) -> np.ndarray:
    return 2 ** np.arange(len(method_names(scene)))


def _attributes(scene: Scene, name: str) -> dict[str, object]:
    """Return the attributes of a variable by the CF conventions: section 3.1 on units, 3.5 on flags."""
    attributes: dict[str, object] = {"long_name": meaning(scene, name)}
    if name == "methods":  # a set of flags
        attributes |= {"flag_masks": _masks(scene).astype(np.int32), "flag_meanings": " ".join(method_names(scene))}
    elif name == "status":
        attributes |= _flags({int(code): code.name.lower() for code in Status})
    elif name == "verdict":
        attributes |= _flags({code: text.replace(" ", "_") for code, text in enumerate(VERDICTS)})
    elif name == "ended_early":
        attributes |= _flags({0: "whole_window", 1: "ended_early"})
    elif name in DIMENSIONLESS or (name in SCALED and _scaled(scene)):
        attributes["units"] = "1"
    return attributes


def _flags(meanings: Mapping[int, str]) -> dict[str, object]:
    """Return the attributes of a variable of codes."""
    return {"flag_values": np.array(list(meanings), dtype=np.int32), "flag_meanings": " ".join(meanings.values())}


def _scaled(scene: Scene) -> bool:
    """Return True if the scalings of all oscillators make their states non-dimensional."""
    return all(getattr(kind.oscillator.model, "scaling", None) is not None for kind in scene.model.kinds)


def meaning(scene: Scene, name: str) -> str:
    """Return the meaning of a variable of a result as text; for an observable its expression."""
    if name in scene.observe:
        return str(scene.observe[name])
    if name == "status":
        codes = [status for status in Status if scene.stop is not None or status != Status.STOPPED]
        return f"{MEANINGS[name]}: {'; '.join(f'{code.value} {code.name.lower()}' for code in codes)}"
    if name == "trajectory" and scene.t_eval:
        return "states at the times t_eval"
    return Sections(scene).meanings().get(name) or MEANINGS[name]


def dimensions(scene: Scene) -> tuple[str, ...]:
    """Return the dimensions of a sweep: the names of the axes, or "cell" for zipped axes; then "realisation"."""
    axes = ("cell",) if scene.zipped else tuple(axis.name for axis in scene.axes)
    return (*axes, "realisation") if scene.realisations else axes


def coordinates(scene: Scene) -> dict[str, Any]:
    """Return the coordinates of a result: axes, components, numbers of nodes, and expressions stored by sections."""
    coords: dict[str, Any] = {"component": list(scene.equations.components), "node": list(scene.topology.labels)}
    coords |= {"integrator": list(method_names(scene))} if scene.integrator == "auto" else {}
    coords |= {f"{name}_kept": list(section.keep) for name, section in scene.sections.items() if section.keep}
    coords |= {f"{base}_link": list(columns) for base, columns in _of_links(scene).items()}
    return coords | {name: (dims, values) for name, dims, values in swept(scene)}


def swept(scene: Scene) -> Iterator[Variable]:
    """Yield the coordinates that distinguish cells, the values of axes and draws, with a row for each value."""
    for axis in scene.axes:
        yield axis.name, ("cell" if scene.zipped else axis.name,), np.array(axis.values)
    # A draw of all links is one variable with a column for each link, along the dimension `…_link`.
    groups = _of_links(scene)
    grouped = {f"{base}_{ends}" for base, columns in groups.items() for ends in columns}
    for axis in scene.drawn:
        if axis.name not in grouped:
            yield axis.name, ("realisation",), np.array(axis.values)
    for base, columns in groups.items():
        yield base, ("realisation", f"{base}_link"), np.array(list(columns.values())).T


def _of_links(scene: Scene) -> dict[str, dict[str, tuple[float, ...]]]:
    """Return the numbers drawn for all links, by parameter and by the ends of each link, "1_2"."""
    drawn: dict[str, dict[str, tuple[float, ...]]] = {}
    for axis in scene.drawn:
        link = None if axis.name in scene.draws else scene.model.link_parameter(axis.name)
        if link is not None:
            drawn.setdefault(link.base, {})[axis.name.removeprefix(f"{link.base}_")] = axis.values
    return drawn


def labelled(
    scene: Scene, arrays: Iterable[Variable], shape: tuple[int, ...], attributes: Mapping[str, object]
) -> xr.Dataset:
    """Return the dataset of variables with one row for each cell."""
    dims, coords = dimensions(scene), coordinates(scene)
    for name, (dim, *more), values in swept(scene):
        coords[name] = ((dim, *more), values[: shape[dims.index(dim)]])
    labelled_arrays = {
        name: ((*dims, *more), values.reshape((*shape, *values.shape[1:])), _attributes(scene, name))
        for name, more, values in arrays
    }
    coords |= {name: labelled_arrays.pop(name) for name in TIMES if name in labelled_arrays}
    return xr.Dataset(labelled_arrays, coords, {"Conventions": CONVENTIONS, **attributes})


def scene_of(attributes: Mapping[str, Any]) -> Scene:
    missing = [name for name in TEXTS if not isinstance(attributes.get(name), str)]
    if "scene" in missing:
        raise ValueError("it is no synchain result: it has no attribute 'scene'")
    if missing:
        raise ValueError(f"it is no whole synchain result: it has no attribute {missing[0]!r}")
    try:
        values = json.loads(attributes["scene"])
    except (ValueError, RecursionError):
        raise ValueError("its scene is not JSON") from None
    try:
        return Scene.from_dict(values)
    except (ValueError, TypeError) as error:
        raise type(error)(f"its scene cannot be made with the models as they are now: {error}") from None


def alike(first: Scene, second: Scene) -> bool:
    """Return True if two scenes differ at most in their titles and in the contents of files of code."""
    one, other = first.replace(title=""), second.replace(title="")
    return one == other or one.as_dict() == other.as_dict()


def changed(attributes: Mapping[str, Any], scene: Scene) -> bool:
    """Return True if the code of a part of the scene has changed since the result was computed."""
    return "model" in attributes and attributes["model"] != scene.equations.digest


def provenance(
    scene: Scene, kernel: Kernel, skipped: tuple[str, ...], versions: str, processor: str
) -> dict[str, object]:
    """Return the provenance of a result as attributes; `skipped` lists the parts left out of the equations."""
    return {
        "title": scene.title or repr(scene),
        "scene": json.dumps(scene.as_dict()),
        "model": scene.equations.digest,
        "equations": kernel.equations.digest,
        "kernel": kernel.digest,
        "lanes": kernel.origin.width,
        "rng": scene.rng,
        "versions": versions,
        "processor": processor,
        "skipped": "; ".join(skipped) or "nothing",
    }
