"""Compile a scene once and call it often, with plain arrays in and out: fits, sliders, bisections.

`run` derives, checks and labels in each call.  `compile` does so once; a call fills rows of numbers and runs the kernel.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from synchain.codegen.driver.columns import Count, SumColumn
from synchain.codegen.machine_code.compile import load
from synchain.codegen.machine_code.processor import processor
from synchain.models.dynamics.observable import Observable
from synchain.models.dynamics.record import Record
from synchain.models.inputs.checks import check_instance, check_number, listed, short_repr, suggestion
from synchain.models.mechanics.parameter import Parameter
from synchain.models.mechanics.physics import checked_parameters
from synchain.models.scenes.defaults import check_events, check_physics
from synchain.models.scenes.scene import Axis, Scene

from ..cells.buffers import Buffers
from ..cells.drive_times import drive_parameters
from ..cells.plan import CellRows, Planner
from ..cells.reduce import reduce_scene
from ..cells.run_keywords import Given
from ..engines.job import versions
from ..engines.ladder_engine import LadderEngine
from ..engines.scene_kernels import chosen_integrator, warn_of_chords, write_kernel
from ..engines.step_warnings import warn_of_steps
from ..results.labels import States, provenance, sample_times
from ..results.result import Result, gather
from .sensitivities import Sensitivities, base_of

# Steps of a cell from which a call looks for stiffness: a choice; the check takes about as long as 500 steps.
LONG = 1024


def compile(
    scene: Scene,
    vary: Iterable[str] = (),
    *,
    t_eval: Iterable[float] | None = None,
    observe: Mapping[str, Observable | str] | None = None,
    gradient: Iterable[str] = (),
) -> CompiledRun:
    """Compile a scene of one cell to a function of some of its parameters and initial states.

    A call of the function takes about 40 microseconds and the time of the integration, and returns plain arrays.  Use it
    in fits, sliders and searches; `run` is for sweeps.

    Parameters
    ----------
    scene : Scene
        A scene without axes and draws.  The integrator "auto" is replaced by the one that suits the scene's own values.
    vary : iterable of str
        Parameters ("k", "k_2") and initial states ("x_1") that calls may give.
    t_eval : iterable of float, optional
        Times of the states, as for `Scene`.  Without them the scene's trajectory is returned if it records one, else
        the state at the end.
    observe : mapping of str to Observable or str, optional
        Observables by name, as for `Scene`, in place of those of the scene.
    gradient : iterable of str
        Parameters and initial states by which the states and observables are differentiated.

    Returns
    -------
    CompiledRun
        A function of the names in `vary`, as keywords.

    Raises
    ------
    ValueError, TypeError
        For unknown names, for a scene with axes or draws, and for what `Scene` refuses.  With `gradient` also for
        set-valued friction, a stop, rates that jump, and parameters that move the sample times.

    See Also
    --------
    run : Runs all cells of a scene and labels the result.

    Notes
    -----
    Records beside the trajectory are left out.  Derivatives are exact: the derivative of each template is integrated
    along with the states, with the same tolerance, when `d` is read.

    Examples
    --------
    The damped oscillator at two times, and the derivative of x by the stiffness:

    >>> import synchain as sc
    >>> node = sc.Field({"x": "v", "v": "-k*x - c*v"}, parameters={"k": 1.0, "c": 0.2})
    >>> scene = sc.Scene(node, initial={"x": 1.0, "v": 0.0}, transient=0, window=5)
    >>> go = sc.compile(scene, vary=["k", "x_1"], t_eval=[2, 5], observe={"A": "maximum(x_1)"}, gradient=["k"])
    >>> end = go(k=4.0)
    >>> end.y.shape, float(end.A)
    ((2, 2, 1), 1.0)
    >>> end.d["k"][:, 0, 0].round(6)
    array([0.299233, 0.374861])
    >>> go(k=[1.0, 4.0, 9.0]).y.shape
    (3, 2, 2, 1)
    """
    varied, by = _names("vary", vary), _names("gradient", gradient)
    Given(compile).expect_one_cell(scene, stops=True)
    changes = {"t_eval": t_eval, "observe": observe}
    scene = scene.replace(**{name: value for name, value in changes.items() if value is not None})
    trajectory = (Record.TRAJECTORY,) if Record.TRAJECTORY in scene.record else ()
    scene = scene.replace(record=trajectory, sections=None, continuation="none")
    for name in varied:
        _check_name("vary", scene, name)
    for name in by:
        _check_name("gradient", scene, name)
    taken = next((name for name in scene.observe if name in RESERVED), None)
    if taken is not None:
        raise ValueError(f"observe: found the name {taken!r}, which a compiled result has; rename it")
    if scene.integrator == "auto":
        scene = scene.replace(integrator=chosen_integrator(reduce_scene(_swept(scene, varied))).name)
    return CompiledRun(scene, varied, by)


class CompiledRun:
    """A scene with a compiled kernel, called with numbers or arrays of its varied parameters and initial states.

    `compile` makes it.  Several threads may call it at once.  It can be pickled: another process loads its kernel from
    the cache.

    Parameters
    ----------
    **values : float or array
        Values of names in `vary`; names without a value keep that of the scene.  Arrays are broadcast against each
        other, and their shape comes first in all results.  Their cells fill the lanes of the kernel.

    Returns
    -------
    CompiledResult
        Times, states, observables and status.

    Attributes
    ----------
    scene : Scene
        The scene that a call without values runs; it names the integrator.
    vary : tuple of str
        The names that a call may give.
    gradient : tuple of str
        The names by which results are differentiated.

    Raises
    ------
    ValueError
        For names outside `vary`, for values that `Scene` refuses, and for arrays whose shapes do not fit.

    See Also
    --------
    compile : Makes it.
    run : The same numbers, labelled: ``run(go.scene, k=4.0)`` has the bits of ``go(k=4.0)``.

    Examples
    --------
    >>> import synchain as sc
    >>> decay = sc.Scene(sc.Field({"x": "-a*x"}, parameters={"a": 1}), initial={"x": 2}, transient=0, window=1)
    >>> go = sc.compile(decay, vary=["a"])
    >>> go(a=[0.0, 1.0]).y.ravel().round(6)
    array([2.      , 0.735759])
    """

    def __init__(self, scene: Scene, vary: tuple[str, ...], gradient: tuple[str, ...]) -> None:
        self.scene, self.vary, self.gradient = scene, vary, gradient
        swept = _swept(scene, vary)
        self._reduction = reduce_scene(swept)
        self._planner = planner = self._reduction.planner
        first = planner.rows(np.zeros(1, dtype=int))
        self._start, self._numbers, self._spans = first.start, first.numbers, first.spans
        # Names that decide the times of the drive, and the checks of masses and friction.
        bases = {base_of(scene, name) for name in vary if name in planner.slots}
        self._moves_times = bool(bases & drive_parameters(planner.equations))
        read = [checked_parameters(kind.oscillator, kind.friction) for kind in swept.model.kinds]
        self._is_checked = bool(bases & set().union(*read))
        self._ranges: dict[str, Parameter | None] = {name: swept.model.parameter(name) for name in vary}
        self._states = States.of(scene)
        self._engines: dict[bool, LadderEngine] = {}
        self._lock = threading.Lock()
        source = write_kernel(self._reduction, 1)
        warn_of_chords(source)
        self._engines[True] = LadderEngine(self._reduction, load(source), 0)
        self._sensitivities = Sensitivities.of(scene, planner, gradient) if gradient else None

    def __call__(self, **values: Any) -> CompiledResult:
        rows, shape = self._rows(values)
        buffers = self._engine(len(rows)).run(self._reduction.rows(rows))
        if not buffers.finished.all() or buffers.counts[:, Count.ACCEPTED].max() > LONG:
            warn_of_steps(self._engines[True].ladder, buffers, lambda cells: self._reduction.rows(rows.take(cells)))
        return CompiledResult(self, values, shape, rows, self._reduction.expand(buffers))

    def __reduce__(self) -> tuple[type[CompiledRun], tuple[object, ...]]:
        return CompiledRun, (self.scene, self.vary, self.gradient)

    def __repr__(self) -> str:
        gradient = f", gradient={self.gradient}" if self.gradient else ""
        return f"CompiledRun({self.scene!r}, vary={self.vary}{gradient})"

    def labelled(self, end: CompiledResult) -> Result:
        """Return the result of a call with labels, as `run` would return it.

        Parameters
        ----------
        end : CompiledResult
            A result of this function.  One array becomes an axis; several become axes that advance together, "cell".

        Returns
        -------
        Result

        Raises
        ------
        ValueError
            If the result is that of another function.

        See Also
        --------
        run : Runs a scene with labels.

        Examples
        --------
        >>> import synchain as sc
        >>> decay = sc.Scene(sc.Field({"x": "-a*x"}, parameters={"a": 1}), transient=0, window=1)
        >>> go = sc.compile(decay, vary=["a"])
        >>> go.labelled(go(a=[0.0, 1.0])).end.dims
        ('a', 'component', 'node')
        """
        if check_instance("end", end, CompiledResult, "what a call of the compiled run returns").run is not self:
            raise ValueError("labelled: found the result of another compiled run; expected one of this run")
        given = {
            name: float(value) if np.ndim(value) == 0 else np.broadcast_to(value, end.shape).ravel()
            for name, value in end.values.items()
        }
        zipped = sum(np.ndim(value) > 0 for value in given.values()) > 1
        scene = Given(compile, given).sweep(self.scene, zipped=zipped)
        kernel, skipped = self._engine(len(end.rows)).kernel, self._reduction.skipped
        return gather(
            scene, lambda: provenance(scene, kernel, skipped, versions(), processor()), end.rows.spans, end.buffers
        )

    def _rows(self, values: Mapping[str, Any]) -> tuple[CellRows, tuple[int, ...]]:
        """Return the rows of a call, and the shape of its arrays."""
        # 1. Numbers, or arrays of one shape.
        columns, shape = {}, ()
        for name, value in values.items():
            if name not in self._ranges:
                raise ValueError(self._refusal(name))
            if not isinstance(value, float | int) or isinstance(value, bool):
                value = _array(name, value)
                try:
                    shape = np.broadcast_shapes(shape, value.shape)
                except ValueError:
                    raise ValueError(
                        f"compiled run: found {name} of the shape {value.shape} beside {shape}; expected shapes that "
                        "broadcast; give equal lengths"
                    ) from None
            columns[name] = value
        cells = math.prod(shape)
        if not cells:
            raise ValueError(f"compiled run: found arrays of the shape {shape}; expected at least one cell")
        # 2. Their columns in the rows.
        start, numbers = np.repeat(self._start, cells, axis=0), np.repeat(self._numbers, cells, axis=0)
        planner = self._planner
        for name, value in columns.items():
            self._check(name, value)
            column = value if isinstance(value, float | int) else np.broadcast_to(value, shape).ravel()
            if name in planner.slots:
                numbers[:, planner.slots[name]] = column
            else:
                start[:, planner.places[name]] = column
        if self._is_checked:
            model, axes = self.scene.model, [Axis(name, np.ravel(value)) for name, value in columns.items()]
            check_physics(model, planner.scene.parameters, axes)
            check_events(model, planner.scene.parameters, axes, zipped=False)
        # 3. Times of the window and of the drive, and slip states.
        spans = planner.spans_at(numbers) if self._moves_times else np.repeat(self._spans, cells, axis=0)
        return planner.started(start, numbers, spans), shape

    def _check(self, name: str, value: Any) -> None:
        """Raise ValueError for values outside the range of a parameter, and for values that are no finite numbers."""
        parameter = self._ranges[name]
        for number in (value,) if isinstance(value, float | int) else (value.min(), value.max()):
            if parameter is None:
                check_number(name, float(number))
            else:
                parameter.check(name, number)

    def _refusal(self, name: str) -> str:
        try:
            _check_name("compiled run", self.scene, name)
        except ValueError as problem:
            return str(problem)
        varied = listed(self.vary) if self.vary else "none"
        return f"compiled run: found {name!r}; expected one of: {varied}; compile with vary={(*self.vary, name)}"

    def _engine(self, cells: int) -> LadderEngine:
        """Return the engine of one lane for a single cell, else that of whole registers."""
        single = cells == 1
        with self._lock:
            if single not in self._engines:
                kernel = load(write_kernel(self._reduction, None))
                self._engines[single] = LadderEngine(self._reduction, kernel, 0)
            return self._engines[single]


class CompiledResult:
    """What a call of a compiled run returns, as plain arrays.

    The shape of the arrays that were given comes first; it is empty if only numbers were given.

    Attributes
    ----------
    t : ndarray
        Times (…, times), non-dimensional, from the start of the run.
    y : ndarray
        States (…, times, components, nodes); NaN behind the end of a cell that did not finish, and where a node lacks a
        component.
    status : ndarray or int
        A `Status` for each cell.
    d : dict of str to ndarray
        The derivative of `y` by each name of `gradient`, computed when it is first read.
    name, dname
        The value (…) or (…, nodes) of each observable, and the table of its derivatives.

    See Also
    --------
    compile : Makes the function.

    Examples
    --------
    >>> import synchain as sc
    >>> decay = sc.Scene(sc.Field({"x": "-a*x"}, parameters={"a": 1}), initial={"x": 2}, transient=0, window=1)
    >>> end = sc.compile(decay, vary=["a"], observe={"mean": "mean(x_1)"}, gradient=["a"])(a=2.0)
    >>> end.mean.round(6).item(), end.dmean["a"].round(6).item()
    (0.864665, -0.296997)
    >>> sc.results.Status(end.status).name
    'FINISHED'
    """

    def __init__(
        self, run: CompiledRun, values: Mapping[str, Any], shape: tuple[int, ...], rows: CellRows, buffers: Buffers
    ) -> None:
        self.run, self.values, self.shape, self.rows, self.buffers = run, values, shape, rows, buffers

    @property
    def t(self) -> np.ndarray:
        """Times (…, times) of the states."""
        scene = self.run.scene
        times = (
            sample_times(scene, self.rows.spans) if scene.record else self.buffers.sums[:, SumColumn.STOPPED_AT, None]
        )
        return times.reshape(*self.shape, -1)

    @property
    def y(self) -> np.ndarray:
        """States (…, times, components, nodes)."""
        buffers = self.buffers
        return self._table(buffers.samples if self.run.scene.record else buffers.end[:, None])

    @property
    def status(self) -> Any:
        """Status of each cell."""
        return self.buffers.status.reshape(self.shape)[()]

    @cached_property
    def d(self) -> dict[str, np.ndarray]:
        """Derivatives of `y` by name."""
        return {name: self._table(values) for name, values in self._derivatives[0].items()}

    @cached_property
    def _derivatives(self) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
        """Derivatives of the states by name, and of each observable by name."""
        sensitivities = self.run._sensitivities
        if sensitivities is None:
            raise ValueError("compiled run: found no gradient; compile with gradient=(…), the names of the derivatives")
        return sensitivities.of_rows(self.rows, self.buffers.finished)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        arrays = self.run._reduction.observed
        for observable, of_nodes, columns in arrays.columns():
            if name not in (observable, f"d{observable}"):
                continue
            shape = (*self.shape, -1) if of_nodes else self.shape
            if name == observable:
                return self.buffers.sums[:, columns].reshape(shape)[()]
            return {by: values.reshape(shape)[()] for by, values in self._derivatives[1][observable].items()}
        names = listed((*RESERVED, *self.run.scene.observe))
        raise AttributeError(f"compiled result: found {name!r}; expected one of: {names}")

    def __repr__(self) -> str:
        given = ", ".join(f"{name}={short_repr(value)}" for name, value in self.values.items())
        return f"CompiledResult({given})"

    def _table(self, states: np.ndarray) -> np.ndarray:
        """Return states (cells, times, dimension) as (…, times, components, nodes)."""
        table = self.run._states.table(states)
        return table.reshape(*self.shape, *table.shape[1:])


# Names of a compiled result that no observable may have.
RESERVED = ("t", "y", "status", "d", "run", "values", "shape", "rows", "buffers")


def _names(what: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return names without repetition; a single text is one name."""
    if isinstance(names, bool) or not isinstance(names, Iterable):
        raise TypeError(f"compile: {what}: found {names!r}; expected names, e.g. {what}=['k']")
    row = (names,) if isinstance(names, str) else tuple(names)
    if len({*row}) < len(row):
        raise ValueError(f"compile: {what}: found {short_repr(row)}; expected each name once; remove the repetition")
    return row


def _check_name(what: str, scene: Scene, name: str) -> None:
    if not (scene.takes(name) or name in scene.equations.state):
        names = (*scene.parameters, *scene.equations.state)
        raise ValueError(
            f"{what}: found {name!r}; expected a parameter or an initial state: {listed(names[:12])}"
            f"{suggestion(name, names)}"
        )


def _array(name: str, value: object) -> np.ndarray:
    try:
        array = np.asarray(value)
        if array.dtype.kind in "bc":  # astype would drop imaginary parts
            raise TypeError
        return array.astype(float)
    except (TypeError, ValueError):
        raise TypeError(f"{name} = {short_repr(value)}; expected a number or an array of numbers") from None


def _swept(scene: Scene, names: tuple[str, ...]) -> Scene:
    """Return the scene with two zipped cells, in which all values of the names differ."""
    # Reductions then leave out nothing that depends on a value.
    if not names:
        return scene
    # An axis with any value shows the value of the scene: parameters of single nodes are listed only if one is swept.
    anywhere = [Axis(name, (_default(scene, name),)) for name in names]
    probe = Planner(scene.replace(axes=anywhere, zipped=True))
    start = dict(zip(probe.equations.state, scene.y0, strict=True))
    axes = []
    for k, name in enumerate(names, 1):
        value = start[name] if name in start else probe.scene.parameters[name]
        up, down = value, value
        for _ in range(k):  # another distance for each name: nodes whose values are equal in both cells would be merged
            up, down = math.nextafter(up, math.inf), math.nextafter(down, -math.inf)
        parameter = scene.model.parameter(name)
        other = up if parameter is None or parameter.maximum is None or up <= parameter.maximum else down
        axes.append(Axis(name, (value, other)))
    return scene.replace(axes=axes, zipped=True)


def _default(scene: Scene, name: str) -> float:
    parameter = scene.model.parameter(name)
    return 0.0 if parameter is None else float(parameter.default)
