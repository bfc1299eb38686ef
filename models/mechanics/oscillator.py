"""One oscillator as a value: a Lagrangian or a vector field with its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from ..inputs.frozen import FrozenDict
from .contact import ContactModel, FrictionLaw
from .impacts import EventDefinition, Friction
from .parameter import Parameter, defaults_text

FRICTION = sp.Function("f", real=True)
"""An undefined function of the sliding velocity, which the expression of a friction law replaces."""


def friction(velocity: sp.Expr) -> sp.Expr:
    """Return the friction coefficient at a sliding velocity, for the forces of a Lagrangian.

    Parameters
    ----------
    velocity : Expr
        The velocity of the ground relative to the body, so that a positive coefficient drags the body along.

    Returns
    -------
    Expr
        An undefined function of the velocity; the friction law of the node replaces this function.

    See Also
    --------
    synchain.friction_law
    synchain.Lagrangian

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain import friction
    >>> N, belt, v = sp.symbols("N belt v")
    >>> N * friction(belt - v)
    N*f(belt - v)
    """
    return FRICTION(velocity)


@dataclass(frozen=True, slots=True)
class Coordinate:
    """A generalised coordinate, the name of its velocity, and its unit, "1" if the Lagrangian is non-dimensional."""

    name: str
    velocity: str
    unit: str = "1"


@dataclass(frozen=True, slots=True)
class Scaling:
    """Units and scales that make the physical quantities of a Lagrangian non-dimensional."""

    units: FrozenDict[str]  # unit of each quantity that fixes the scales
    physical: FrozenDict[str]  # physical quantity that belongs to each parameter
    scales: FrozenDict[
        sp.Expr
    ]  # units of mass, length, time (keys kg, m, s) in positive symbols of the names in `units`


@dataclass(frozen=True, slots=True)
class LagrangianModel:
    """A mechanical system: energies and forces as expressions, in which `FRICTION` stands for a friction law.

    Coordinates, velocities and parameters are real symbols.  With a `scaling` all quantities are physical, and the
    parameters have their physical names.  Without a `scaling` the expressions are non-dimensional.
    """

    coordinates: tuple[Coordinate, ...]  # the generalised coordinates
    kinetic: sp.Expr  # the energies
    potential: sp.Expr
    forces: tuple[sp.Expr, ...]  # a generalised force for each coordinate, without the forces of `dissipation`
    dissipation: sp.Expr = sp.S.Zero  # Rayleigh's function R, half the power lost; -dR/dv is added to the forces
    scaling: Scaling | None = None  # the units of physical quantities
    events: tuple[EventDefinition, ...] = ()

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions of the system."""
        of_events = (e for event in self.events for e in event.expressions)
        return self.kinetic, self.potential, *self.forces, self.dissipation, *of_events


@dataclass(frozen=True, slots=True)
class FieldModel:
    """A first-order vector field: the names of the states and an expression for the rate of each."""

    state: tuple[str, ...]
    rates: tuple[sp.Expr, ...]
    events: tuple[EventDefinition, ...] = ()

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """All expressions of the field."""
        return (*self.rates, *(e for event in self.events for e in event.expressions))


@dataclass(frozen=True, slots=True)
class Oscillator:
    """An oscillator by itself.  Equal contents make equal oscillators.

    Parameters
    ----------
    name : str
        Name in messages and scene files.
    parameters : mapping of str to Parameter
        Parameters of the non-dimensional equations.
    model : LagrangianModel or FieldModel
        The equations: energies and forces, or rates.
    initial : mapping of str to float, optional
        The state around which oscillators start; states that are left out are 0.
    friction : FrictionLaw, optional
        The friction law of the oscillator unless a scene gives another law.
    contact : ContactModel
        Default treatment of the jump of a law at rest.
    summary, source : str
        A description, and the publication.

    Attributes
    ----------
    states : tuple of str
        Names of the states.  The symbol of each state is an attribute: ``node.x``.

    See Also
    --------
    synchain.Lagrangian
    synchain.Field
    synchain.load_oscillator

    Examples
    --------
    >>> import synchain as sc
    >>> sc.load_oscillator("rossler").states
    ('x', 'y', 'z')
    """

    name: str
    parameters: FrozenDict[Parameter]
    model: LagrangianModel | FieldModel
    initial: Mapping[str, Any] | None = None
    friction: FrictionLaw | None = None
    contact: ContactModel = ContactModel.ATAN
    summary: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return f"Oscillator({self.name!r}, states {', '.join(self.states)}{defaults_text(self.parameters)})"

    @property
    def takes_friction(self) -> bool:
        """True if the forces contain a friction coefficient, so that the oscillator needs a friction law."""
        contacts = (event for event in self.model.events if isinstance(event, Friction))
        return any(e.has(FRICTION) for e in self.model.expressions) or any(event.law is None for event in contacts)

    @property
    def has_contact(self) -> bool:
        """True if the treatment of jumps (`ContactModel`) changes the equations."""
        surfaces = isinstance(self.model, FieldModel) and self.contact is ContactModel.SET_VALUED
        return self.takes_friction or bool(self.laws) or surfaces

    @property
    def laws(self) -> dict[int, FrictionLaw]:
        """The friction laws of single contacts, by the numbers of their events."""
        pairs = ((k, event.law) for k, event in enumerate(self.model.events) if isinstance(event, Friction))
        return {k: law for k, law in pairs if isinstance(law, FrictionLaw)}

    def __getattr__(self, name: str) -> sp.Symbol:
        if name not in Oscillator.__dict__ and name in self.states:
            return sp.Symbol(name, real=True)
        raise AttributeError(f"oscillator has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), *self.states]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: the coordinates and their velocities, or the states of a vector field."""
        if isinstance(self.model, FieldModel):
            return self.model.state
        return (*self.coordinates, *(c.velocity for c in self.model.coordinates))

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates; empty for a vector field."""
        return tuple(c.name for c in self.model.coordinates) if isinstance(self.model, LagrangianModel) else ()
