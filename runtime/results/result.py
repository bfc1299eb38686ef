"""The labelled result of a run: the numbers, their meaning and their provenance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.codegen.driver.columns import Count, PointColumn
from synchain.codegen.machine_code.processor import processor, told_apart
from synchain.models.dynamics.record import Record
from synchain.models.inputs.checks import check_choice, check_instance
from synchain.models.inputs.display import HasAnimation, HasPlot
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.buffers import Buffers
from ..cells.observable_arrays import ObservableArrays, Sections
from ..support.files import understood
from ..support.status import Status
from .certificate import Certificate
from .labelled import Labelled
from .labels import (
    COUNTS,
    START_STATE,
    STATE,
    SUMS,
    TOLERANCES,
    States,
    alike,
    changed,
    dimensions,
    labelled,
    scene_of,
    variables,
)
from .store import read_data, write_data

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Sequence

    from matplotlib.axes import Axes

    from synchain.models.dynamics.equations import Equations


class _Deferred:
    """Hold the function that computes the labelled data of a result on first use.

    This is a base class because the slots of a dataclass are only its fields.
    """

    __slots__ = ("_make",)
    _make: Callable[[], xr.Dataset]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Result(_Deferred, HasAnimation, Labelled):
    """Labelled arrays of a run, with the interface of an `xarray.Dataset`.

    A variable is an item and an attribute: ``result["sync_error"]`` and ``result.sync_error`` are the same array.
    `sel`, `isel`, `to_dataframe`, iteration and ``in`` act on the dataset.  Call other methods of the dataset on
    `data`.

    Attributes
    ----------
    data : xarray.Dataset
        The dataset.  Its dimensions are the names of the axes (or "cell" if the axes are zipped), then "sample" or
        "point" of a record, then "component" and "node" of a state: `result.end.sel(component="v", node=3)`.  A state
        that a node lacks is NaN.  The times of samples and points are the coordinates `time` and `section_time`.  The
        attributes of the dataset are the scene, the versions and the processor.  The attributes of a variable are its
        meaning, units and the meanings of its codes, by the CF conventions.
    scene : Scene
        The scene, with its axes.

    See Also
    --------
    run : Computes a result.
    open_result : Reads a result from a file.

    Notes
    -----
    Every cell has a `status`; `synchain.results.Status` names the codes.  Times are non-dimensional.

    References
    ----------
    CF Metadata Conventions 1.11, sections 3.1 (units) and 3.5 (flags), https://cfconventions.org.

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("van_der_pol", "x->v", sc.graphs.ring(4), transient=5, window=10)
    >>> result = sc.run(scene, sigma=[0.0, 0.5, 1.0], show_progress=False)
    >>> result["sync_error"].dims
    ('sigma',)
    >>> result.sel(sigma=0.4, method="nearest").status.item() == sc.results.Status.FINISHED
    True
    >>> result["status"].attrs["flag_meanings"].split()[:2]
    ['not_run', 'finished']
    >>> result.mean  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    AttributeError: this result has no 'mean'; it has: ...; methods of its dataset: result.data.mean(…)
    """

    data: xr.Dataset
    scene: Scene

    def __post_init__(self) -> None:
        check_instance("data", self.data, xr.Dataset, "an xarray.Dataset; open_result reads one from a file")
        check_scene(self.scene)

    @classmethod
    def _deferred(cls, make: Callable[[], xr.Dataset], scene: Scene) -> Result:
        """Return a result whose data are built at the first access: building labels takes longer than a short run."""
        result = cls.__new__(cls)
        object.__setattr__(result, "_make", make)
        object.__setattr__(result, "scene", scene)
        return result

    def __getattr__(self, name: str) -> xr.DataArray:
        if name == "_make":
            raise AttributeError(name)
        if name == "data":
            # keep `_make`: two threads may read `data` at the same time
            data: Any = self._make()
            object.__setattr__(self, "data", data)
            object.__setattr__(self, "_make", lambda: data)
            return data
        if name.startswith("_") or name not in self.data:
            raise AttributeError(self._refusal(name))
        return self.data[name]

    def _refusal(self, name: object) -> str:
        names = ", ".join(sorted(map(str, self.data.data_vars)))
        text = f"this result has no {name!r}; it has: {names}"
        method = isinstance(name, str) and not name.startswith("_") and hasattr(xr.Dataset, name)
        return f"{text}; methods of its dataset: result.data.{name}(…)" if method else f"{text}; its dataset is .data"

    def __getitem__(self, name: str | Sequence[str]) -> Any:
        names = [name] if isinstance(name, str) else name
        missing = next((each for each in names if each not in self.data), None)
        if missing is not None:
            raise KeyError(self._refusal(missing))
        return self.data[name] if isinstance(name, str) else self.data[list(name)]

    def __contains__(self, name: object) -> bool:
        return name in self.data

    def __iter__(self) -> Iterator[str]:
        return map(str, self.data)

    def sel(self, indexers: Mapping[str, Any] | None = None, **more: Any) -> xr.Dataset:
        """Select cells, samples, components and nodes by their values; see `xarray.Dataset.sel`.

        Parameters
        ----------
        indexers : mapping, optional
            Values, lists or slices of values by the names of dimensions.
        **more
            The indexers as keywords; `method="nearest"` selects the nearest value, at most `tolerance` away.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        KeyError
            If an axis does not have the value.

        See Also
        --------
        isel : Selects by position.

        Examples
        --------
        >>> import synchain as sc
        >>> scene = sc.Scene("van_der_pol", "x->v", sc.graphs.ring(4), transient=0, window=1)
        >>> result = sc.run(scene, sigma=[0.0, 0.5], show_progress=False)
        >>> result.sel(sigma=0.5, component="x").end.shape
        (4,)
        """
        return self.data.sel(indexers, **more)

    def isel(self, indexers: Mapping[str, Any] | None = None, **more: Any) -> xr.Dataset:
        """Select cells, samples, components and nodes by position; see `xarray.Dataset.isel`.

        Parameters
        ----------
        indexers : mapping, optional
            Integers, lists or slices of integers by the names of dimensions, counted from 0.
        **more
            The indexers as keywords.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        IndexError
            If a position is out of range.

        See Also
        --------
        sel : Selects by value.

        Examples
        --------
        >>> import synchain as sc
        >>> scene = sc.Scene("van_der_pol", "x->v", sc.graphs.ring(4), transient=0, window=1)
        >>> result = sc.run(scene, sigma=[0.0, 0.5], show_progress=False)
        >>> result.isel(sigma=-1).sigma.item()
        0.5
        """
        return self.data.isel(indexers, **more)

    def to_xarray(self) -> xr.Dataset:
        """Return the dataset, `data`.

        Returns
        -------
        xarray.Dataset

        See Also
        --------
        to_dataframe : Makes a table.

        Examples
        --------
        >>> import synchain as sc
        >>> scene = sc.Scene("van_der_pol", "x->v", sc.graphs.ring(4), transient=0, window=1)
        >>> sc.run(scene, sigma=[0.0, 0.5], show_progress=False).to_xarray().sizes["sigma"]
        2
        """
        return self.data

    def to_dataframe(self, names: str | Sequence[str] | None = None) -> Any:
        """Return a table with one row for each cell, or for each value of the named variables.

        Parameters
        ----------
        names : str or sequence of str, optional
            Variables; by default all with one number for each cell, without states and records.

        Returns
        -------
        pandas.DataFrame
            Its index are the dimensions of the variables; a single cell is one row.

        Raises
        ------
        KeyError
            If the result has no such variable.

        See Also
        --------
        to_xarray : Returns all variables with their dimensions.

        Examples
        --------
        >>> import synchain as sc
        >>> scene = sc.Scene("van_der_pol", "x->v", sc.graphs.ring(4), transient=0, window=1)
        >>> result = sc.run(scene, sigma=[0.0, 0.5], show_progress=False)
        >>> result.to_dataframe()["status"].tolist()
        [1, 1]
        >>> result.to_dataframe("end").index.names
        FrozenList(['sigma', 'component', 'node'])
        """
        if names is None:
            cells = set(dimensions(self.scene))
            names = [str(name) for name, values in self.data.items() if set(values.dims) <= cells]
        chosen: xr.Dataset = self[[names] if isinstance(names, str) else list(names)]
        # Drop coordinates of records, such as times of samples, which would add the dimensions of the record.
        used = {str(dim) for values in chosen.values() for dim in values.dims}
        chosen = chosen.drop_vars([name for name, values in chosen.coords.items() if not set(values.dims) <= used])
        return (chosen if used else chosen.expand_dims("cell")).to_dataframe()

    @property
    def success(self) -> bool:
        """True if every cell reached the end of its window."""
        return bool((self.data.status == Status.FINISHED).all())

    @property
    def message(self) -> str:
        """Number of cells that ended with each status, as text."""
        codes, counts = np.unique(self.data.status.values, return_counts=True)
        parts = [
            f"{n} cell{'s' * (n > 1)}: {Status(int(c)).message}" for c, n in zip(codes, counts.tolist(), strict=True)
        ]
        return "; ".join(parts)

    @property
    def integrators(self) -> str:
        """Integrators that the cells used in turn, with their mean numbers of steps, as text."""
        if "methods" not in self.data:
            return str(self.scene.integrator)
        names, flags = self.data.integrator.values, self.data.methods.values  # bit k: the k-th integrator was used
        steps = self.data.method_steps.values.reshape(flags.size, -1)
        parts = []
        codes, counts = np.unique(flags, return_counts=True)
        for code, count in zip(codes.tolist(), counts.tolist(), strict=True):
            used = [k for k in range(len(names)) if code >> k & 1]
            mean = steps[flags.ravel() == code].mean(axis=0)
            text = ", then ".join(f"{names[k]} ({mean[k]:.4g} steps)" for k in used) or "no step"
            parts.append(text if count == flags.size else f"{text} in {count} cell{'s' * (count > 1)}")
        return "; ".join(parts)

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Rows of the summary: scene, cells by status, variables."""
        sizes = ", ".join(f"{name} {size}" for name, size in self.data.sizes.items())
        cells = self.scene.cells
        counts = {name: self.data.get(f"event_{name}") for name in ("impacts", "slips", "resets")}
        events = ", ".join(f"{int(count.sum())} {name}" for name, count in counts.items() if count is not None)
        return (
            ("scene", str(self.data.attrs.get("title", repr(self.scene)))),
            ("cells", self.message if cells > 1 else self.message.removeprefix("1 cell: ")),
            ("integrators", self.integrators),
            *((("events", events),) if events else ()),
            ("dimensions", sizes),
            ("variables", ", ".join(map(str, self.data.data_vars))),
        )

    def plot(
        self, ax: Axes | None = None, kind: str | None = None, *, windows: Iterable[Any] = (), **style: Any
    ) -> Axes:
        """Draw the result into the current figure of pyplot, or into given axes.

        Parameters
        ----------
        ax : Axes, optional
            Matplotlib axes; by default pyplot's current ones, or those of a new figure.
        kind : {"error", "section", "map", "time", "phase", "space", "network", "end"} or str, optional
            By default the most specific kind that axes and records allow.

            * error: synchronisation error over an axis of parameters
            * section: bifurcation diagram, points of the section over an axis; without an axis each
              point over the one before
            * map: colours over two axes of parameters
            * time: first state of each oscillator over time
            * phase: phase portrait, second state over first
            * space: space-time map, first state as colours over time and oscillator
            * network: the graph, oscillators coloured by their first state at the end
            * end: final states
            * the name of an observable: its value over an axis
        windows : sequence of Window, optional
            Intervals of the coupling strength, shaded behind the curve: predicted ranges of synchronisation, such as
            ``msf(…).windows``.
        **style
            Keywords of the Matplotlib artist, such as `color`, `linewidth`, `cmap`.

        Returns
        -------
        Axes
            ``plt.show()`` shows the figure, a notebook shows it after the cell, and
            ``plt.savefig("figure.png")`` writes it.

        Raises
        ------
        ValueError
            If the kind is unknown, if the result has no numbers for it, or if windows are given
            for a plot that is not over the coupling strength.

        Examples
        --------
        >>> import synchain as sc
        >>> scene = sc.Scene("van_der_pol", "x->v", sc.graphs.ring(4), record=["trajectory"], transient=0, window=20)
        >>> axes = sc.run(scene, sigma=0.5).plot(kind="time")
        """
        return HasPlot.plot(self, ax, kind=kind, windows=windows, **style)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the dataset of the result to a file (see `Labelled.save` for the formats)."""
        write_data(self.data, path, overwrite)

    def states(self, name: str = "end") -> np.ndarray:
        """Return the states (…, states) of a variable in the order of the equations: x_1 … x_n, v_1 …

        Raises ValueError for a variable that holds no states.
        """
        names = tuple(str(each) for each, values in self.data.items() if values.dims[-2:] == STATE)
        return States.of(self.scene).flat(self.data[check_choice("variable of states", name, names)].values)

    @property
    def events(self) -> xr.Dataset:
        """The recorded events: time, node and row of the node (from 1), mode of the row before and after; their numbers.

        Contacts and surfaces have the modes +1, -1 and, while held, 0; a stop is open (1) or closed (0); at a reset both
        modes are 1.  Rows with NaN follow the last event of a cell.
        """
        names = [name for name in self.data.variables if str(name).startswith("event_")]
        if not names:
            raise ValueError("the result has no events; expected record = ('events',)")
        return self.data[names]

    def belongs_to(self, scene: Scene) -> bool:
        """Return True if the scene equals the scene of this result, apart from the title."""
        return alike(self.scene, scene)

    def stepped(self, equations: Equations) -> bool:
        """Return True if this result was computed by integrating `equations` (of the scene, reduced or not)."""
        return bool(self.data.attrs["equations"] == equations.digest)

    def restore(self, scene: Scene, buffers: Buffers, equations: Equations) -> None:
        """Copy the finished cells of this result into the buffers of a new run of the same scene.

        Parameters
        ----------
        scene : Scene
            Scene of the new run.
        buffers : Buffers
            Buffers of all its cells.
        equations : Equations
            The equations that the new run steps.

        Raises
        ------
        ValueError
            If the scenes differ in more than their titles, or if this result was computed from other equations or on
            another kind of processor.
        """
        if not self.belongs_to(scene):
            raise ValueError("the result to resume belongs to another scene; run without resume")
        if changed(self.data.attrs, scene):
            raise ValueError(
                "the result to resume comes of another model: its code has changed since; "
                "restore the code, or run without resume"
            )
        if not self.stepped(equations):
            raise ValueError(
                "the result to resume left out other parts of its scene; resume with the reduction of that run"
            )
        if (begun := str(self.data.attrs.get("processor"))) != processor():
            before, now = told_apart(begun, processor())
            raise ValueError(
                f"the result to resume was begun on the processor {before}; found {now}, which may round otherwise; "
                "resume on the first kind, or run without resume"
            )
        self._fill(buffers)
        buffers.clear(~buffers.finished)

    def _fill(self, buffers: Buffers) -> None:
        """Copy all cells into the buffers; the inverse of `gather`."""
        cells, data = self.scene.cells, self.data
        states = States.of(self.scene)

        def put_points(points: np.ndarray) -> None:
            """Copy section points (cells, points, columns)."""
            buffers.widen(points.shape[1])
            buffers.points[:, : points.shape[1]] = points

        for source, target in (("end", buffers.end), ("trajectory", buffers.samples)):
            if source in data:
                target[:] = states.flat(data[source].values).reshape(target.shape)
        for table, columns in ((buffers.counts, COUNTS), (buffers.sums, SUMS)):
            for name, column in columns.items():
                if name in data:
                    table[:, column] = data[name].values.reshape(cells)
        for k, name in enumerate(TOLERANCES):
            if name in data:
                buffers.tolerances[:, k] = data[name].values.reshape(cells)
        if "method_steps" in data:
            by_method = data.method_steps.values.reshape(cells, -1)
            buffers.counts[:, Count.BY_METHOD : Count.BY_METHOD + by_method.shape[1]] = by_method
        for name, _, columns_of_observable in ObservableArrays(self.scene).columns():
            buffers.sums[:, columns_of_observable] = data[name].values.reshape(cells, -1)
        if self.scene.sections or Record.EVENTS in self.scene.record:
            points = Sections(self.scene).points(cells, {str(name): data[name].values for name in data})
            buffers.counts[:, Count.POINTS] = np.isfinite(points[:, :, PointColumn.TIME]).sum(axis=1)
            put_points(points)
        if "section" in data:
            points = np.concatenate([data.section_time.values[..., None], states.flat(data.section.values)], axis=-1)
            put_points(points.reshape(cells, -1, points.shape[-1]))


def read_result(path: Path) -> Result:
    """Read a file of `Result.save` or `stream`."""
    return result_of(read_data(path), path)


def result_of(data: xr.Dataset, path: Path) -> Result:
    """Return the result of a dataset from a file; raise ValueError if the dataset is not of a result."""
    with understood(path):
        scene = scene_of(data.attrs)
        status = data.get("status")
        if status is None or status.dims != dimensions(scene) or status.shape != scene.shape:
            raise ValueError("its variables are not those of its scene")
        list(map(Status, np.unique(status.values).tolist()))
        if "end" not in data or data.end.dims[-2:] != STATE:
            raise ValueError("an earlier version wrote it, with states in one row; run its scene again")
    return Result(data, scene)


def gather(
    scene: Scene,
    attributes: Callable[[], Mapping[str, object]],
    spans: np.ndarray,
    buffers: Buffers,
    certificate: Certificate | None = None,
    starts: np.ndarray | None = None,
) -> Result:
    """Return the labelled result of all cells. Shapes: spans (cells, len(SpanColumn)), starts (cells, dimension)."""

    def make() -> xr.Dataset:
        recorded = list(variables(scene, spans, buffers, certificate, buffers.most_points))
        data = labelled(scene, recorded, scene.shape, attributes())
        if starts is None:
            return data
        table = States.of(scene).table(starts.reshape(*scene.shape, -1))
        attributes_of_starts = {"long_name": "states that the cells started from"}
        return data.assign({START_STATE: ((*dimensions(scene), *STATE), table, attributes_of_starts)})

    return Result._deferred(make, scene)
