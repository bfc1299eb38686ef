"""What to simulate and what to record: the frozen description that everything else starts from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from ..graphs.topology import Topology
from ..inputs.checks import instance, suggestion, table, text
from ..inputs.frozen import Frozen
from .axis import Axis
from .complete import complete
from .model import Group, bare, by_kind, derived, model_parameters
from .parameters import drive, known_name, varied, without
from .section import Section

if TYPE_CHECKING:
    from ..dynamics.equations import Equations
    from ..dynamics.periodicity import Drive
    from ..graphs.topology import Topology
    from ..spectra.spectrum import Spectrum

__all__ = ["Axis", "Scene", "Section", "a_scene"]

_MODEL = ("oscillator", "friction", "contact", "coupling", "nodes")


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Scene:
    """A network of oscillators, its numbers, its start, what to record and what to sweep.

    Every keyword has a default; the same names are the keys of a scene file (see docs/scenes.md).  States,
    parameters and times are non-dimensional; `transient` and `window` count periods of the drive if `time_unit`
    is "period", the default if the equations repeat themselves in time.  `atol` is a tenth of `rtol` unless given.
    `friction` "default" is "exponential" where the oscillator takes a friction law, else None.  Raises ValueError
    or TypeError on anything that the model does not know or cannot be given.
    """

    title: str
    oscillator: str
    friction: str | None
    contact: str
    coupling: str | None
    nodes: tuple[Group, ...]
    topology: Topology
    parameters: Frozen[float]
    initial: Frozen[tuple[float, ...]]
    record: tuple[str, ...]
    section: Section
    transient: float
    window: float
    time_unit: str
    samples: int
    integrator: str
    rtol: float
    atol: float
    max_steps: int
    axes: tuple[Axis, ...]
    zipped: bool
    continuation: str
    seed: int

    def __init__(
        self,
        *,
        title: str = "",
        oscillator: str = "friction",
        friction: str | None = "default",
        contact: str = "atan",
        coupling: str | None = "spring",
        nodes: Iterable[Group | Mapping[str, Any]] | None = None,
        topology: Topology | None = None,
        parameters: Mapping[str, Any] | None = None,
        initial: Mapping[str, Any] | None = None,
        record: Iterable[str] | None = None,
        section: Section | str | None = None,
        transient: float = 300.0,
        window: float = 100.0,
        time_unit: str | None = None,
        samples: int = 0,
        integrator: str = "auto",
        rtol: float = 1e-8,
        atol: float | None = None,
        max_steps: int = 10_000_000,
        axes: Iterable[Axis] | Mapping[str, Any] = (),
        zipped: bool = False,
        continuation: str = "none",
        seed: int = 0,
    ) -> None:
        given = dict(locals())
        del given["self"]
        for name, value in complete(given).items():
            object.__setattr__(self, name, value)

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
        templates, kinds = by_kind(self.oscillator, self.friction, self.nodes, self.n)
        return derived(templates, kinds, self.contact, self.coupling, self.topology, self.varied)

    @property
    def templates(self) -> tuple[tuple[str, str | None], ...]:
        """(oscillator, friction law) of each kind of node that there is, in the order of their first nodes."""
        return by_kind(self.oscillator, self.friction, self.nodes, self.n)[0]

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of the parameters that have a value for each node: `parameters` has them as a_1 … a_n."""
        return varied(self.parameters, model_parameters(self.model()))

    @property
    def spectrum(self) -> Spectrum:
        """The exact eigenvalues of the connectivity matrix."""
        return _spectrum(self.topology)

    @property
    def forced(self) -> bool:
        """True where time occurs explicitly in the equations."""
        return any(node.forced for node in bare(self.model()).nodes)

    @property
    def drive(self) -> Drive:
        """At which frequencies time enters the equations: expressions of the parameters, derived from the equations."""
        return drive({**self.model(), "parameters": self.parameters})

    @property
    def angular_frequency(self) -> float | None:
        """Angular frequency of the drive (an axis may sweep it), None if the equations do not repeat themselves."""
        from ..dynamics.periodicity import as_function, names_in

        frequency = self.drive.frequency
        if frequency is None:
            return None
        return as_function(frequency)(*(self.parameters[name] for name in names_in(frequency)))

    @property
    def period(self) -> float | None:
        """Period of the drive in non-dimensional time, None if there is no drive or its frequency is 0."""
        from ..dynamics.periodicity import period_of

        return period_of(self.angular_frequency or 0.0)

    @property
    def y0(self) -> tuple[float, ...]:
        """The initial states in state order: x_1 … x_n, v_1 … v_n."""
        return tuple(value for values in self.initial.values() for value in values)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of cells along each dimension of the sweep; zipped axes are one dimension, no axes none."""
        lengths = tuple(len(axis) for axis in self.axes)
        return lengths[:1] if self.zipped else lengths

    @property
    def cells(self) -> int:
        """Number of simulations."""
        return math.prod(self.shape)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about what is allowed but probably not meant."""
        from .warnings import warnings

        return warnings(self)

    def takes(self, name: str) -> bool:
        """True for the name of a parameter, "a", and for that of a parameter of one node, "a_2"."""
        return known_name(self.model(), text("name", name)) is not None

    def replace(self, **changes: Any) -> Scene:
        """Return a scene with some keywords changed, checked anew: replace(rtol=1e-6, sigma=0.2).

        `parameters` replaces them all, a parameter's own name (sigma above) that one alone.  What stood at
        its default goes to the new default; another number or kind of oscillators starts from the default
        initial states unless `initial` is given.
        """
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        given.update(_defaulted(self))
        taken = [name for name in tuple(changes) if name not in given and self.takes(name)]
        strange = next((name for name in changes if name not in given and name not in taken), None)
        if strange is not None:
            names = (*self.parameters, *given)
            raise TypeError(
                f"unknown parameter or keyword {strange!r}; known: {', '.join(names)}{suggestion(strange, names)}"
            )
        if changes.get("parameters") is not None:
            table("parameters", changes["parameters"])
        single = {name: changes.pop(name) for name in taken}
        given.update(changes)
        if self.varied and "parameters" not in changes and getattr(given["topology"], "n", None) != self.n:
            raise ValueError(f"{self.varied[0]} has values for {self.n} nodes; give `parameters` for another number")
        given["parameters"] = {**without(given["parameters"] or {}, single, self.varied), **single}
        if "initial" not in changes and (
            given["oscillator"] != self.oscillator
            or "nodes" in changes
            or getattr(given["topology"], "n", None) != self.n
        ):
            given["initial"] = None
        elif "initial" not in changes and given["initial"] and ("contact" in changes or "friction" in changes):
            from ..mechanics.stick_slip import SLIP

            own = {name: at for name, at in given["initial"].items() if name != SLIP.name}  # modes follow from x and v
            given["initial"] = own
        return Scene(**given)

    def model(self) -> dict[str, Any]:
        """What decides on the equations, by the names of the keywords."""
        return {name: getattr(self, name) for name in (*_MODEL, "topology")}

    def as_dict(self) -> dict[str, Any]:
        """Return the whole scene in JSON types; `Scene.from_dict` makes an equal scene of it."""
        from .dictionary import as_dict

        return as_dict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Scene:
        """Return the scene of a scene file's names and values; ValueError or TypeError on anything else."""
        from .dictionary import from_dict

        return from_dict(values)

    def __repr__(self) -> str:
        oscillators, laws = (
            " and ".join(dict.fromkeys(filter(None, own))) for own in zip(*self.templates, strict=True)
        )
        names = [oscillators, laws, self.coupling if self.topology.links else None]
        words = [repr(self.title)] if self.title else []
        words += [
            "/".join(name for name in names if name),
            f"{self.topology.name}({self.n})",
            *map(repr, self.axes),
        ]
        return f"Scene({', '.join(words)})"


@lru_cache(maxsize=64)
def _spectrum(graph: Topology) -> Spectrum:
    return graph.spectrum


def _defaulted(scene: Scene) -> dict[str, Any]:
    default = Scene(**scene.model())
    values = {name: v for name, v in scene.parameters.items() if v != default.parameters.get(name)}
    changed: dict[str, Any] = {"parameters": values}
    if scene.atol == scene.rtol / 10:
        changed["atol"] = None
    for name in ("record", "section", "time_unit"):
        if getattr(scene, name) == getattr(default, name):
            changed[name] = None
    return changed


def a_scene(value: object) -> Scene:
    """Return the value where it is a Scene, else raise TypeError."""

    return instance("scene", value, Scene, "a Scene, e.g. load_scene('figure_4a')")
