"""`Scene`: a model, its numbers and its records; every computation starts from a scene."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..dynamics.equations import Equations
from ..dynamics.observable import Observable
from ..dynamics.periodicity import Drive, as_function, names_in, period_of
from ..dynamics.record import Record
from ..graphs.topology import Topology
from ..inputs.checks import check_instance, check_table, check_text, is_row, listed, suggestion
from ..inputs.display import HasDrawing, HasLatex
from ..inputs.frozen import FrozenDict
from ..inputs.keywords import called_from_outside, warn
from ..inputs.names import NodeName
from ..inputs.unsupported import unsupported
from ..interactions.coupling import Coupling
from ..interactions.link import strength
from ..mechanics.contact import ContactModel, FrictionLaw
from ..mechanics.oscillator import Oscillator
from ..networks.layers import as_topology
from ..networks.model import Group, Model
from ..sweeps.axis import Axis
from ..sweeps.checked_axes import Continuation
from ..sweeps.draws import GRAPH, Draws, drawn_axes
from ..sweeps.parameters import drive, varied, without
from .defaults import MODEL_KEYWORDS, TimeUnit, complete, model_of
from .dictionary import arguments, as_dict
from .section import Section
from .toml import write
from .warnings import asynchrony, function_of_inputs, unresolved_smoothing, warnings

if TYPE_CHECKING:
    from ..spectra.spectrum import Spectrum

__all__ = ["KEYWORDS", "Axis", "Scene", "Section", "check_scene"]


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Scene(HasDrawing, HasLatex):
    """A network of oscillators with parameters, initial states, records and axes of a sweep.

    Every keyword has a default; the same names are the keys of a scene file (see docs/scenes.md).  States,
    parameters and times are non-dimensional.

    Parameters
    ----------
    oscillator : Oscillator or str
        The nodes, by value (`Lagrangian`, `Field`) or by name.
    coupling : Coupling or str, optional
        The coupling: a name ("spring", "spring on x"), components ("x->x, 1/2 y->z"), `Rates` or a `Potential`.
    topology : Topology, optional
        The graph; a single node if left out.  With several layers of links it is the union of their graphs.
    title : str
        The title of the scene.
    friction : FrictionLaw or str, optional
        The friction law of the oscillators; "default" is the law of the oscillator itself, None is no friction.
    contact : str, optional
        Treatment of the jump of a friction law at rest: "atan", "sign" or "set-valued"; by default the choice of the
        oscillator.
    nodes : iterable of Group or tables, optional
        Nodes of other kinds.
    links : iterable of (Coupling or str, Topology), optional
        Several layers of links, each with its own graph, in place of `coupling` and `topology`.
    parameters : mapping, optional
        Values of parameters: a number, or a list with one number for each node (for each edge or link, if the parameter
        belongs to the coupling).
    initial : mapping, optional
        Initial states: a number, one number for each node, or {low, high, rng} for random ones.
    record : iterable of str, optional
        Records of each cell: "sync_error", "section", "trajectory", "events" of contacts, stops, resets and surfaces.
    observe : mapping of str to Observable or str, optional
        Observables of each cell by name: `mean`, `maximum`, `minimum`, `end` or `variance` over the window of an
        expression of the states, such as ``"mean(nodes.mean(v**2/2))"``.  The result has a variable of each name.
    section : Section or str, optional
        Condition at which section points are recorded, such as "v_1 falling".
    sections : mapping of str to Section or table, optional
        Sections on functions of the states by name, such as
        ``Section("x_1 - x_2", "rising", keep=("v_1", "v_2"))``.  The result has a variable of each name.
    stop : str or Expr, optional
        A function of the states, parameters and t that ends a cell when it passes zero, also in the transient.  As with
        terminal events of SciPy, the cell ends only when the function changes sign, not when it starts at zero.
    transient, window : float
        Duration before the records, and duration of the records, in units of `time_unit`.
    time_unit : str, optional
        "period" (of the drive; the default if the equations repeat themselves in time at all values of the parameters)
        or "time".
    samples : int, optional
        Points of a trajectory, both ends of the window included; by default 100 a period or unit of time, between 401
        and 20 001.
    t_eval : iterable of float, optional
        Times of the points of a trajectory, in place of `samples`: increasing, from the end of the transient to the end
        of the window, in units of `time_unit` from the start of the run.  They add "trajectory" to `record`.
    integrator : str
        The method; "auto" chooses one.
    rtol, atol : float
        Tolerances; `atol` is a tenth of `rtol` unless given.
    max_steps : int
        Most steps of a cell.
    axes : iterable of Axis or mapping
        The parameters or initial states that are swept, with their values.
    zipped : bool
        True if the axes run together.
    continuation : str
        "up" or "down" if each cell starts from the final state of its neighbour along the last axis (of the scene or of
        a run), else "none".
    realisations : int
        Number of realisations of the draws, a further dimension of the sweep; 0 for no draws.
    draws : mapping, optional
        Random numbers by the name of a parameter or initial state, or by "W" for the weights of links: `normal`,
        `uniform`, `lorentzian` (drawn for each node or edge separately), or a list with one entry for each realisation.
        The name "topology" draws graphs: a list of graphs, or a random graph as text, "erdos_renyi(20, p=0.3)".
    rng : int or Generator
        Seed of random initial states and of the draws, or a NumPy Generator that gives it.

    Attributes
    ----------
    model : Model
        The oscillators, friction laws, couplings and graphs, which determine the equations.
    given : mapping
        Each keyword as the caller gave it; None (or "default") for keywords whose default depends on other keywords.

    Raises
    ------
    ValueError, TypeError
        For unknown names, values out of range, and combinations of keywords that exclude each other.

    See Also
    --------
    load_scene : The scene of a file.
    synchain.run : Simulate every cell.

    Examples
    --------
    >>> from synchain import Scene
    >>> from synchain.graphs import chain
    >>> scene = Scene("van_der_pol", "spring", chain(3), parameters={"mu": 1.5}, axes={"sigma": [0.1, 0.2]})
    >>> scene.n, scene.cells, scene.components
    (3, 2, ('x', 'v'))
    >>> scene.replace(sigma=0.1, axes=()).parameters["sigma"]
    0.1
    """

    title: str
    oscillator: Oscillator
    friction: FrictionLaw | None
    contact: ContactModel
    coupling: Coupling | None
    nodes: tuple[Group, ...]
    topology: Topology
    links: tuple[tuple[Coupling | None, Topology], ...] | None
    parameters: FrozenDict[float]
    initial: FrozenDict[tuple[float, ...]]
    record: tuple[Record, ...]
    observe: FrozenDict[Observable]
    section: Section
    sections: FrozenDict[Section]
    stop: str | None
    transient: float
    window: float
    time_unit: TimeUnit
    samples: int
    t_eval: tuple[float, ...]
    integrator: str
    rtol: float
    atol: float
    max_steps: int
    axes: tuple[Axis, ...]
    zipped: bool
    continuation: Continuation
    realisations: int
    draws: FrozenDict[Draws]
    rng: int
    model: Model = field(compare=False)
    given: FrozenDict[Any] = field(compare=False)

    def __init__(
        self,
        oscillator: Oscillator | str = "friction",
        coupling: Coupling | str | None = "spring",
        topology: Topology | None = None,
        *,
        title: str = "",
        friction: FrictionLaw | str | None = "default",
        contact: str | None = None,
        nodes: Iterable[Group | Mapping[str, object]] | None = None,
        links: Iterable[tuple[Coupling | str, Topology]] | None = None,
        parameters: Mapping[str, object] | None = None,
        initial: Mapping[str, object] | None = None,
        record: Iterable[str] | None = None,
        observe: Mapping[str, Observable | str] | None = None,
        section: Section | str | None = None,
        sections: Mapping[str, Section | Mapping[str, object]] | None = None,
        stop: object = None,
        transient: float = 300.0,
        window: float = 100.0,
        time_unit: str | None = None,
        samples: int | None = None,
        t_eval: Iterable[float] | None = None,
        integrator: str = "auto",
        rtol: float = 1e-8,
        atol: float | None = None,
        max_steps: int = 10_000_000,
        axes: Iterable[Axis] | Mapping[str, object] = (),
        zipped: bool = False,
        continuation: str = "none",
        realisations: int = 0,
        draws: Mapping[str, object] | None = None,
        rng: object = 0,
    ) -> None:
        keywords = {name: value for name, value in locals().items() if name != "self"}
        values = complete(keywords)
        for name, value in values.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "given", _frozen_keywords(keywords, values))
        if called_from_outside():
            _warn(self)

    @property
    def n(self) -> int:
        """Number of oscillators."""
        return self.topology.n

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the states of one oscillator, such as ("x", "v")."""
        return tuple(self.initial)

    @property
    def equations(self) -> Equations:
        """The derived equations of motion of the network."""
        return self.model.equations(self.varied)

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of parameters with a value for each node or link, which `parameters` lists as a_1 … a_n or k_1_2 …"""
        return varied(self.parameters, self.model.parameters)

    @property
    def spectrum(self) -> Spectrum:
        """The exact eigenvalues of the connectivity matrix; ValueError for several layers of links."""
        if self.links is not None:
            raise ValueError(
                f"spectrum: found {len(self.links)} layers of links; expected one; take the graph of a layer, scene.links"
            )
        return _spectrum(self.topology)

    @property
    def strength(self) -> str:
        """Name of the strength of the links: sigma, or the only parameter that is a factor of the whole link.

        Raises ValueError for several layers of links, without links, and if none or several parameters are factors.
        """
        if len(self.model.linked) != 1:
            raise ValueError(f"strength of the links: found {len(self.model.linked)} layers of links; expected one")
        return self.strengths[0]

    @property
    def strengths(self) -> tuple[str, ...]:
        """The name of the strength in each layer that has links; ValueError if a layer has no unique strength."""
        equations, names_of_layers = self.equations, []
        numbered = tuple(s for edge in equations.edges for s in edge.parameters if s.name in equations.numbered)
        for layer in equations.layers:
            of_ends = (((*equations.nodes[a].parameters, *numbered), edge) for (a, _), edge in layer.edge_of)
            names = {strength(edge, others).name for others, edge in of_ends}
            if len(names) > 1:
                raise ValueError(f"strength of the links: found {', '.join(sorted(names))}; expected one for all links")
            names_of_layers.append(names.pop())
        return tuple(names_of_layers)

    @property
    def forced(self) -> bool:
        """True if time occurs explicitly in the equations."""
        return self.model.forced

    @property
    def drive(self) -> Drive:
        """The drive: frequencies of the explicit time dependence as expressions of the parameters."""
        return drive(self.model, self.parameters)

    @property
    def angular_frequency(self) -> float | None:
        """Angular frequency of the drive at the parameters of the scene; None if the equations are not periodic."""
        frequency = self.drive.frequency
        if frequency is None:
            return None
        return as_function(frequency)(*(self.parameters[name] for name in names_in(frequency)))

    @property
    def period(self) -> float | None:
        """Period of the drive in non-dimensional time, None if there is no drive or its frequency is 0."""
        return period_of(self.angular_frequency or 0.0)

    @property
    def y0(self) -> tuple[float, ...]:
        """The initial states in state order: x_1 … x_n, v_1 … v_n."""
        return tuple(value for values in self.initial.values() for value in values)

    @property
    def lone(self) -> Scene:
        """The first oscillator without links: its parameters, its start and the settings of the scene.

        >>> from synchain import Scene
        >>> from synchain.graphs import chain
        >>> Scene("van_der_pol", "spring", chain(5), initial={"x": [1, 2, 3, 4, 5]}).lone.y0
        (1.0, 0.0)
        """
        kind = self.equations.kind_of[0]
        node, names = self.equations.nodes[kind], {s.name for s in self.equations.nodes[kind].parameters}
        kept = [
            "friction",
            "contact",
            "transient",
            "window",
            "time_unit",
            "integrator",
            "rtol",
            "atol",
            "max_steps",
            "rng",
        ]
        return Scene(
            self.model.kinds[kind].oscillator,
            None,
            parameters={
                name: self.parameters[str(NodeName(name, 0)) if name in self.varied else name] for name in sorted(names)
            },
            initial={s.name: self.initial[s.name][0] for s in node.continuous},
            record=(),
            **{name: self.given[name] for name in kept},
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of cells along each dimension of the sweep, realisations last; zipped axes are one dimension."""
        lengths = tuple(len(axis) for axis in self.axes)
        more = (self.realisations,) if self.realisations else ()
        return (*(lengths[:1] if self.zipped else lengths), *more)

    @property
    def continued(self) -> bool:
        """True if each cell starts from the final state of its neighbour along the last axis."""
        return bool(self.axes) and self.continuation != Continuation.NONE

    @property
    def drawn(self) -> tuple[Axis, ...]:
        """Drawn parameters and states, with a value for each realisation, along the last dimension of the sweep."""
        return drawn_axes(self.model, self.draws, self.realisations, self.rng)

    @property
    def cells(self) -> int:
        """Number of simulations."""
        return math.prod(self.shape)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings: sentences about choices that are allowed but probably not intended."""
        unit = self.period or 1.0 if self.time_unit == TimeUnit.PERIOD else 1.0
        return warnings(self.model, self.varied, self._values(), (self.transient + self.window) * unit)

    def takes(self, name: str) -> bool:
        """Return True for the name of a parameter, "a", or of a parameter of one node, "a_2"."""
        return self.model.parameter(check_text("name", name)) is not None

    def replace(self, **changes: Any) -> Scene:
        """Return a new, checked scene with some keywords changed, as in replace(rtol=1e-6, sigma=0.2).

        Parameters
        ----------
        **changes
            Keywords of `Scene`, or names of parameters such as sigma, of the new model.  The name of a parameter changes
            only this parameter; `parameters` replaces all of them.  A list is one number for each node or link; the
            numbers of a sweep are an axis, of `run` or of the keyword `axes`.  A named parameter replaces its axis.  Keywords that were never given follow their defaults.  Given
            initial states are kept: a number or a range fits every number of nodes; a list that no longer fits raises
            ValueError.

        Raises
        ------
        ValueError, TypeError
            For unknown names, and for values that `Scene` refuses.
        """
        # Separate names of parameters, names of keywords, and unknown names.
        single = {name: changes.pop(name) for name in tuple(changes) if name not in self.given}
        model = self.model
        if any(model.parameter(name) is None for name in single) and not MODEL_KEYWORDS.isdisjoint(changes):
            model = model_of({**self.given, **changes})  # the new contact, friction or graph has other parameters
        strange = next((name for name in single if model.parameter(name) is None), None)
        if strange is not None:
            names, reason = (*model.parameters, *self.given), model.no_link(strange) or unsupported(strange)
            raise TypeError(
                f"unknown parameter {strange!r}; {reason}"
                if reason
                else f"unknown parameter or keyword {strange!r}; known: {listed(names)}{suggestion(strange, names)}"
            )
        if changes.get("topology") is not None:
            changes["topology"] = as_topology(changes["topology"])
        start: Mapping[str, object] | None = self.given["initial"]
        if start and not {"contact", "friction", "oscillator", "nodes"}.isdisjoint(changes):
            # Drop the modes of contacts: friction may have changed, and the modes follow from x and v.
            start = {name: at for name, at in start.items() if name not in self.model.unlinked.modes}
        keywords = {**self.given, "initial": start, **changes}
        if keywords["links"] is not None:  # layers of links replace the coupling and the graph of a single layer
            keywords |= {"coupling": None, "topology": None} | changes
        for name, other in (("t_eval", "samples"), ("samples", "t_eval")):  # sample times of one kind replace the other
            if changes.get(name) is not None:
                keywords[other] = changes.get(other)
        if keywords["parameters"] is not None or single:
            table = {} if keywords["parameters"] is None else check_table("parameters", keywords["parameters"])
            keywords["parameters"] = {**without(self.model, table, single), **single}
        if "axes" not in changes and any(axis.name in single for axis in self.axes):
            # one number in place of an axis, as in `run`
            keywords["axes"] = tuple(axis for axis in self.axes if axis.name not in single)
            keywords["zipped"] = self.zipped and bool(keywords["axes"])
        if self.varied and "parameters" not in changes and _node_count(keywords) != self.n:
            raise ValueError(
                f"{self.varied[0]} has values for {self.n} nodes, or for their links; give `parameters` for another number"
            )
        scene = Scene(**keywords)
        if called_from_outside():
            _warn(scene, self)
        return scene

    def _values(self) -> dict[str, Any]:
        """The completed value of each keyword."""
        return {name: getattr(self, name) for name in KEYWORDS}

    def as_dict(self) -> dict[str, object]:
        """Return the scene in JSON types, from which `Scene.from_dict` returns an equal scene."""
        return as_dict(self._values(), self.varied)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scene to a TOML file, from which `load_scene` returns an equal scene.

        Parameters
        ----------
        path : str or path
            The file, whose name ends in .toml.  A file of this name is replaced.

        Raises
        ------
        ValueError
            For another ending, for more than a megabyte, and for parts that a file cannot represent.
        """
        write(self.as_dict(), path)

    @classmethod
    def from_dict(cls, values: Mapping[str, object], folder: Path | None = None) -> Scene:
        """Return the scene of a scene file's names and values.

        Parameters
        ----------
        values : mapping
            Names and values in JSON types, as `as_dict` returns them.
        folder : Path, optional
            Folder at which relative paths in `values` start; the working folder if left out.

        Raises
        ------
        ValueError, TypeError
            For unknown names, and for whatever `Scene` refuses.
        """
        scene = cls(**arguments(values, KEYWORDS, folder))
        if called_from_outside(f"{__package__}.file"):
            _warn(scene)
        return scene

    def __repr__(self) -> str:
        oscillators = " and ".join(dict.fromkeys(kind.oscillator.name for kind in self.model.kinds))
        laws = " and ".join(dict.fromkeys(kind.friction.name for kind in self.model.kinds if kind.friction))
        names = [oscillators, laws, *(str(coupling) for coupling, _ in self.model.linked)]
        title = [repr(self.title)] if self.title else []
        parts = "/".join(name for name in names if name)
        return f"Scene({', '.join([*title, parts, f'{self.topology.name}({self.n})', *map(repr, self.axes)])})"


def _warn(scene: Scene, before: Scene | None = None) -> None:
    """Warn of firing rates of single inputs, of an error that cannot vanish, and of friction that is not resolved.

    If the scene replaces the scene `before`, warnings of `before` are not repeated.
    """
    sentences = list[str]()
    if before is None or (scene.model, scene.varied) != (before.model, before.varied):
        sentences += (function_of_inputs(coupling, graph) for coupling, graph in scene.model.linked)
        if Record.SYNC_ERROR in scene.record:
            sentences += asynchrony(scene.model, scene.varied)
    unresolved = unresolved_smoothing(scene.model, scene.parameters, scene.axes)
    if unresolved and not (before and unresolved_smoothing(before.model, before.parameters, before.axes)):
        sentences.append(unresolved)
    for sentence in filter(None, sentences):
        warn(sentence)


def _node_count(keywords: Mapping[str, Any]) -> int | None:
    """Return the number of nodes of the links or the graph in the keywords; None if neither is given or readable."""
    try:
        graph = keywords["topology"] if keywords["links"] is None else keywords["links"][0][1]
    except (TypeError, LookupError):
        return None
    return getattr(graph, "n", None)


@lru_cache(maxsize=64)
def _spectrum(graph: Topology) -> Spectrum:
    return graph.spectrum


KEYWORDS = tuple(row.name for row in fields(Scene) if row.compare)
"""The keywords of a scene, which are the keys of a scene file."""

_FOLLOWING = {
    "friction": "default",
    "contact": None,
    "record": None,
    "section": None,
    "time_unit": None,
    "atol": None,
    "samples": None,
    "t_eval": None,
}
"""Keywords whose default depends on other keywords, with the value that stands for the default."""


def _frozen_keywords(keywords: Mapping[str, Any], values: Mapping[str, Any]) -> FrozenDict[Any]:
    """Return the keywords as immutable values; a default that depends on other keywords stays None or "default"."""
    frozen = {name: values[name] for name in KEYWORDS}
    for name, following in _FOLLOWING.items():
        if isinstance(keywords[name], str | None) and keywords[name] == following:
            frozen[name] = following
    if values["t_eval"] and keywords["record"] is not None and Record.TRAJECTORY not in [*keywords["record"]]:
        frozen["record"] = tuple(name for name in values["record"] if name != Record.TRAJECTORY)
    if GRAPH in values["draws"] and keywords["topology"] is not None:
        frozen["topology"] = as_topology(keywords["topology"])
    # A number or a range fits every number of nodes; a tuple has a number for each.
    frozen["initial"] = frozen["parameters"] = None
    if keywords["initial"] is not None:
        start = {}
        for name, at in keywords["initial"].items():
            states = values["initial"][name]
            is_list = is_row(at.tolist() if hasattr(at, "tolist") else at)
            start[name] = FrozenDict(at) if isinstance(at, Mapping) else states if is_list else states[0]
        frozen["initial"] = FrozenDict(start)
    if keywords["parameters"] is not None:
        frozen["parameters"] = FrozenDict(
            _frozen_parameters(keywords["parameters"], values["model"], values["parameters"])
        )
    return FrozenDict(frozen)


def _frozen_parameters(table: Mapping[str, object], model: Model, values: Mapping[str, float]) -> dict[str, object]:
    """Return the parameters of a table: a number, or a tuple with one number for each node or link."""
    frozen: dict[str, object] = {}
    for name in table:
        if name in values:
            frozen[name] = values[name]
        elif name in model.parameters:
            names = [*dict.fromkeys(map(str, model.link_names(name).values()))]
            names = names or [str(NodeName(name, i)) for i in model.holders(name)]
            frozen[name] = tuple(values[single] for single in names)
        else:  # the parameter of one node, such as a_2, where all nodes have one value
            parts = model.single(name)
            frozen[name] = values[parts.base] if parts else table[name]
    return frozen


def check_scene(value: object) -> Scene:
    """Return the value if it is a Scene, else raise TypeError."""
    return check_instance("scene", value, Scene, "a Scene, e.g. load_scene('figure_4a')")
