"""What the numbers of a kernel are called in a result: variables of any of its cells, coordinates, provenance."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from synchain.models.scenes.scene import Scene

from ..support.status import Status
from .certificate import VERDICTS, Certificate

if TYPE_CHECKING:
    from synchain.codegen.kernels.compile import Kernel

    from ..cells.buffers import Buffers

__all__ = [
    "MEANINGS",
    "Variable",
    "alike",
    "changed",
    "coordinates",
    "dimensions",
    "provenance",
    "scene_of",
    "variables",
]

Variable = tuple[str, tuple[str, ...], np.ndarray]
"""Name, dimensions besides those of the sweep, values with one row for each cell."""

TOLD = ("scene", "title", "equations", "kernel", "versions")
"""Attributes of a result that are text."""

MEANINGS = {
    "sync_error": "average synchronisation error",
    "sync_error_max": "largest synchronisation error seen in the window",
    "sync_error_end": "synchronisation error at the end of the window",
    "status": "how the cell ended: " + "; ".join(f"{s.value} {s.name.lower()}" for s in Status),
    "steps": "accepted steps",
    "rejected": "rejected steps",
    "periods_skipped": "periods of the drive jumped over in a cell that repeats itself",
    "end": "state at the end of the window",
    "end_time": "non-dimensional time at which the cell stopped",
    "section_count": "number of section points in the window",
    "section_time": "times of the section points",
    "section": "states at the section points, NaN where there are fewer",
    "trajectory": "states at equally spaced times of the window",
    "trajectory_time": "times of the trajectory",
    "transversal_exponent": "largest transversal exponent of the synchronous state",
    "transversal_stderr": "standard error of the transversal exponent",
    "ended_early": "1 where the cell ended before its window did, certain to stay synchronous",
    "verdict": "; ".join(f"{k} {words}" for k, words in enumerate(VERDICTS)),
}


def variables(
    scene: Scene, spans: np.ndarray, buffers: Buffers, certificate: Certificate | None, most: int
) -> Iterator[Variable]:
    """The variables of some cells, with room for `most` section points each; spans, buffers, certificate: of these cells."""
    for name, column in (("status", 0), ("steps", 1), ("rejected", 2), ("periods_skipped", 4)):
        yield name, (), buffers.counts[:, column].astype(np.int32)
    yield "end", ("state",), buffers.end
    yield "end_time", (), buffers.sums[:, 3]
    if "sync_error" in scene.record:
        for column, name in enumerate(("sync_error", "sync_error_max", "sync_error_end")):
            yield name, (), buffers.sums[:, column]
    if certificate is not None:
        for name, values in _certified(scene, spans, buffers, certificate).items():
            yield name, (), values
    if "section" in scene.record:
        points = np.full((len(spans), max(most, 1), buffers.points.shape[2]), np.nan)
        there = min(most, buffers.points.shape[1])
        points[:, :there] = buffers.points[:, :there]
        yield "section_count", (), buffers.counts[:, 3].astype(np.int32)
        yield "section_time", ("point",), points[:, :, 0]
        yield "section", ("point", "state"), points[:, :, 1:]
    if "trajectory" in scene.record:
        parts = np.linspace(0.0, 1.0, scene.samples) if scene.samples > 1 else np.zeros(1)
        times = spans[:, :1] + (spans[:, 1:2] - spans[:, :1]) * parts
        yield "trajectory_time", ("sample",), times
        yield "trajectory", ("sample", "state"), buffers.samples


def dimensions(scene: Scene) -> tuple[str, ...]:
    """The dimensions of a sweep: the names of its axes, or "cell" where they are zipped."""
    return ("cell",) if scene.zipped else tuple(axis.name for axis in scene.axes)


def _certified(scene: Scene, spans: np.ndarray, buffers: Buffers, certificate: Certificate) -> dict[str, np.ndarray]:
    """What a certificate says of each cell."""
    made = {"transversal_exponent": certificate.exponent, "transversal_stderr": certificate.stderr}
    last = spans[:, 1]
    made["ended_early"] = ((buffers.counts[:, 0] == Status.FINISHED) & (buffers.sums[:, 3] < last)).astype(np.int32)
    if "sync_error" in scene.record:
        finished = buffers.counts[:, 0] == Status.FINISHED
        made["verdict"] = certificate.verdicts(finished, buffers.sums[:, 0], buffers.sums[:, 1]).astype(np.int32)
    return made


def coordinates(scene: Scene) -> dict[str, Any]:
    """The coordinates of a result: the axes and the names of the states."""
    made: dict[str, Any] = {"state": list(scene.equations.state)}
    for axis in scene.axes:
        made[axis.name] = ("cell" if scene.zipped else axis.name, np.array(axis.values))
    return made


def scene_of(attributes: Mapping[Any, Any]) -> Scene:
    """The scene that a result says it is of; ValueError or TypeError if it does not say it as `provenance` does, or if the
    models that are here cannot make it."""
    missing = [name for name in TOLD if not isinstance(attributes.get(name), str)]
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
    """True where two scenes differ in their titles at most, and in the text of the files of code that they name."""
    one, other = first.replace(title=""), second.replace(title="")
    return one == other or one.as_dict() == other.as_dict()


def changed(attributes: Mapping[Any, Any], scene: Scene) -> bool:
    """True where a result of a scene comes of another model: the code behind the names of its parts has changed since."""
    return "model" in attributes and attributes["model"] != scene.equations.digest


def provenance(
    scene: Scene,
    kernel: Kernel,
    tolerances: tuple[float, float],
    skipped: tuple[str, ...],
    versions: str,
    processor: str,
) -> dict[str, Any]:
    """Where a result comes from; `skipped` says what was left out of the equations (see `synchain.runtime.cells.reduce`)."""
    return {
        "title": scene.title or repr(scene),
        "scene": json.dumps(scene.as_dict()),
        "model": scene.equations.digest,
        "equations": kernel.equations.digest,
        "kernel": kernel.digest,
        "lanes": kernel.origin.width,
        "rtol_used": tolerances[0],
        "atol_used": tolerances[1],
        "seed": scene.seed,
        "versions": versions,
        "processor": processor,
        "skipped": "; ".join(skipped) or "nothing",
    }
