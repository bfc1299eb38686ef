"""Opening the files of results of every kind, finished or not."""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path

import xarray as xr

from synchain.models.inputs.checks import check_path
from synchain.models.inputs.keywords import warn

from ..results.block_log import is_block_log
from ..results.codec import decode
from ..results.labelled import KIND, VALUE, Labelled
from ..results.labels import changed
from ..results.partial import read_partial
from ..results.result import Result, result_of
from ..results.store import read_data
from ..support.files import understood


@cache
def _classes() -> dict[str, type]:
    """All classes that a file may name: those of values that are kept, and of their parts."""
    from synchain.models.symmetries.clusters import Block, Clusters

    from ..bifurcation.bifurcations import Bifurcation, BifurcationKind
    from ..bifurcation.branches import Branch
    from ..bifurcation.equilibrium import Equilibrium
    from ..bifurcation.periodic import PeriodicOrbit
    from ..bifurcation.phases import Phases
    from ..bifurcation.skeleton import Skeleton
    from ..stability.attractor import Attractor, Motion
    from ..stability.cluster_exponents import ClusterExponents
    from ..stability.exponents import Exponents
    from ..stability.lyapunov import Lyapunov
    from ..stability.msf import MSF, Plane
    from ..synchronisation.basin import Basin
    from ..synchronisation.criterion import AppliedCriterion, Criterion
    from ..synchronisation.exponent_windows import ExponentWindows
    from ..synchronisation.probe import Probe
    from ..synchronisation.threshold import Sweep, Thresholds

    exponents = (ClusterExponents, Exponents, Lyapunov, MSF, Plane)
    kept = (Basin, Branch, Equilibrium, PeriodicOrbit, Probe, Skeleton, Thresholds, *exponents)
    motions = (Attractor, Bifurcation, BifurcationKind, Block, Clusters, Motion, Phases)
    parts = (*motions, AppliedCriterion, Criterion, ExponentWindows, Sweep)
    return {kind.__name__: kind for kind in (*kept, *parts)}


def open_result(path: str | os.PathLike[str]) -> Labelled:
    """Read the file of a result of any kind, or the cells so far of a run that is not finished.

    Parameters
    ----------
    path : str or path
        A file written by the `save` of any result or by `stream`, or the file ".partial" beside it
        while a run is not finished.

    Returns
    -------
    Result, MSF, Thresholds …
        The value that was saved.  Of an unfinished run all cells; those that have not ended have
        the status NOT_RUN.

    Raises
    ------
    OSError, ValueError
        If the file is none of these or if it is damaged.
    ModuleNotFoundError
        If the file needs a package that is not installed.

    Warns
    -----
    RuntimeWarning
        If the file has no digest because another program or an earlier version wrote it: damage
        cannot be seen.
    UserWarning
        If the code of the model has changed since: the numbers are those of the former model, the
        scene names the present one.
    """
    path = check_path("result", path)
    if is_block_log(path):
        return _as_it_was(read_partial(path), path)
    data = read_data(path)
    if KIND in data.attrs:
        return _value(data, path)
    return _as_it_was(result_of(data, path), path)


def _value(data: xr.Dataset, path: Path) -> Labelled:
    """The value of the data of a file that is not a sweep's."""
    with understood(path):
        made = decode(json.loads(data.attrs[VALUE]), data, _classes())
        if not isinstance(made, Labelled):
            raise ValueError(f"it holds a {data.attrs[KIND]}; expected a result")
        return made


def _as_it_was(result: Result, path: Path) -> Result:
    """The result, after a warning if the code of its model has changed."""
    if changed(result.data.attrs, result.scene):
        warn(
            f"{path}: the code of its model has changed since it was written: its numbers are those of the former "
            "model, its scene has the equations of the present one; restore the code, or run it again",
            UserWarning,
        )
    return result
