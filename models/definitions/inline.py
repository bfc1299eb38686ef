"""Define oscillators, friction laws and couplings by expressions in SymPy or text, in notebooks and files.

States are functions of time or plain symbols.  Time is any symbol called t.  Decimals are exact: 0.1 is 1/10.  Symbols
with the same name are the same quantity, which is real regardless of the assumptions of the symbol.  A parameter whose
symbol is assumed positive or nonnegative gets that range.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from keyword import iskeyword
from typing import Any, TypeAlias

import sympy as sp
from sympy.core.function import AppliedUndef

from ..inputs.checks import (
    check_flag,
    check_instance,
    check_keys,
    check_number,
    check_table,
    check_text,
    short_repr,
    suggestion,
    typed_repr,
)
from ..inputs.expression_text import FUNCTIONS
from ..inputs.frozen import FrozenDict
from ..interactions.coupling import WEIGHT, LagrangianCoupling
from ..mechanics.components import TIME
from ..mechanics.contact import SLIDING, ContactModel, FrictionLaw
from ..mechanics.expression import RESERVED, exact
from ..mechanics.impacts import EventDefinition, Friction, Reset, Stop
from ..mechanics.lagrangian import check_masses_exist, mass_matrix
from ..mechanics.oscillator import FRICTION, Coordinate, FieldModel, LagrangianModel, Oscillator, Scaling
from ..mechanics.parameter import Parameter, dimension
from ..mechanics.sliding import sliding_surfaces
from .loader import load_friction_law

Expression: TypeAlias = "sp.Expr | float | str"
"""An expression of SymPy, a number, or a text, which is parsed, not run."""

LONGEST_SOURCE = 4096
"""Most characters of a citation, a choice."""

Keyed: TypeAlias = "Mapping[Any, Any]"
"""A mapping whose keys are symbols, functions of time, or names."""


def Lagrangian(
    T: Expression,
    V: Expression = 0,
    Q: Mapping[Any, Expression] | None = None,
    R: Expression = 0,
    *,
    coordinates: Keyed | Iterable[Any] | None = None,
    friction: FrictionLaw | Expression | Keyed | None = None,
    contact: str | None = None,
    events: Iterable[EventDefinition] = (),
    parameters: Keyed | None = None,
    initial: Keyed | None = None,
    scaling: Mapping[str, Mapping[str, Any]] | None = None,
    source: str = "",
    name: str = "oscillator",
) -> Oscillator:
    """Return the oscillator of a Lagrangian L = T - V with generalised forces.

    Parameters
    ----------
    T, V : Expr, number or str
        Kinetic and potential energy.  A text is parsed, not run: ``"k*x**2/2"``.
    Q : mapping, optional
        Coordinate -> generalised force, 0 for coordinates left out.  In a force, ``friction(velocity)`` stands for
        the friction coefficient at a sliding velocity.
    R : Expr, number or str
        Rayleigh's dissipation function, half the dissipated power.  Its negative derivatives with respect to the
        velocities are added to the forces.
    coordinates : iterable or mapping, optional
        The coordinates in order, or a mapping from coordinates to names of velocities: ``{x: v}``.  By default the
        coordinates are the functions of time in the expressions, sorted by name.  Coordinates that are plain symbols
        must be given.  In SymPy a velocity is the derivative of a coordinate.  As a state and in text a velocity is
        called v if there is one coordinate, else v_x, v_y, …, unless the mapping gives another name.
    friction : str, FrictionLaw or Expr, optional
        The friction law: the name of a law, a `FrictionLaw`, or the friction coefficient as a SymPy expression of the
        sliding velocity ``w`` and of parameters that occur nowhere else.  `friction_law` makes a law from text.  A
        scene may replace the law.
    contact : str, optional
        Treatment of the law's jump at zero velocity: "atan" (the default), "sign" or "set-valued".  A law without a
        jump never sticks.
    events : iterable of Friction, Stop or Reset, optional
        Contacts with a law of their own, stops, and resets of states.
    parameters : mapping, optional
        The default of each parameter: a number, or a `Parameter` with its range.
    initial : mapping, optional
        The state around which oscillators start, 0 for the states left out.
    scaling : mapping, optional
        Needed for a Lagrangian in physical quantities; the non-dimensional equations are derived from it.  The
        mapping has up to three keys.  ``units`` maps each constant, and each coordinate with a unit, to its SI unit:
        ``{"m": "kg", "k": "N/m"}``.  ``scales`` maps the units of mass, length and time to expressions of the
        constants: ``{"kg": "m", "m": …, "s": "sqrt(m/k)"}``.  ``physical`` maps parameters to their names in the
        expressions, if the names differ.
    source : str
        Publication of the model.
    name : str
        Name in messages and scene files.

    Returns
    -------
    Oscillator
        The oscillator.  Its states are attributes, such as ``node.x``.

    Raises
    ------
    ValueError, TypeError
        For undeclared symbols, unused parameters, functions that generated code does not have, numbers that are not
        finite and real, unknown coordinates, a name with two meanings, and a velocity without kinetic energy.

    See Also
    --------
    synchain.Field
    synchain.Potential
    synchain.friction
    synchain.Parameter

    Examples
    --------
    >>> import sympy as sp
    >>> from sympy.physics.mechanics import dynamicsymbols
    >>> from synchain import Lagrangian
    >>> x, t = dynamicsymbols("x"), dynamicsymbols._t
    >>> v, mu, u, omega = x.diff(t), *sp.symbols("mu u omega")
    >>> node = Lagrangian(v**2/2, x**2/2, {x: mu*(1 - x**2)*v + u*sp.cos(omega*t)},
    ...                   parameters={mu: 0.2, u: 0.5, omega: 0.9})
    >>> node.states
    ('x', 'v')
    """
    what = f"oscillator {_called(name)!r}"
    forces = dict(check_table(f"{what}: Q", {} if Q is None else Q))
    moving = _functions(what, [T, V, R, *forces, *forces.values()])
    table = _coordinates(what, coordinates, moving)
    defaults = _parameters(what, parameters)
    scales, units = (None, {}) if scaling is None else _scaling(what, scaling, table, defaults)
    names = _ModelNames.of(what, table, moving, defaults, scales)
    # Energies and forces, one force for each coordinate.
    energies = [names.expression(about, e) for about, e in (("T", T), ("V", V), ("R", R))]
    for about, energy in zip("TVR", energies, strict=True):
        if energy.has(FRICTION):
            raise ValueError(f"{what}: found friction(…) in {about}; expected it in the forces Q alone")
    kinetic, potential, dissipation = energies
    on = {names.state("Q", key, table): value for key, value in forces.items()}
    acting = tuple(names.expression(f"force on {c}", on.get(c, 0)) for c in table)
    speeds = [sp.Symbol(speed, real=True) for speed in table.values()]
    _try(what, lambda: check_masses_exist(mass_matrix(kinetic - potential, speeds), speeds))
    declared = _events(what, events, names, defaults, table)
    if declared and scales is not None:
        raise ValueError(f"{what}: found events beside a scaling; expected non-dimensional equations")
    contacts = [event for event in declared if isinstance(event, Friction)]
    # A law or a contact requires a force that contains friction(…), or a contact among the events.
    law = _law(what, friction, defaults)
    rubs = any(force.has(FRICTION) for force in acting) or any(event.law is None for event in contacts)
    for keyword, value in (("friction", law), ("contact", contact)):
        if value is not None and not rubs and not (contacts and keyword == "contact"):
            raise ValueError(f"{what}: found {keyword} {str(value)!r}, but no force has friction(…); leave it out")
    treatment = ContactModel.ATAN if contact is None else ContactModel.parse("contact", contact)
    # The parameters of a law given as an expression belong to the law, not to the oscillator.
    written = law if isinstance(friction, sp.Expr | int | float) else None
    of_events = (e for event in declared for e in event.expressions)
    node_parameters = names.used_parameters((*energies, *acting, *of_events), written)
    if scales is not None:
        scales = replace(scales, physical=FrozenDict({name: scales.physical[name] for name in node_parameters}))
    model = LagrangianModel(
        tuple(Coordinate(c, speed, units.get(c, "1")) for c, speed in table.items()),
        kinetic,
        potential,
        acting,
        dissipation,
        scales,
        declared,
    )
    start, citation = names.initial(initial), check_text("source", source, LONGEST_SOURCE)
    return Oscillator(name, node_parameters, model, start, law, treatment, source=citation)


def Field(
    rates: Mapping[Any, Expression],
    *,
    contact: str | None = None,
    events: Iterable[EventDefinition] = (),
    parameters: Keyed | None = None,
    initial: Keyed | None = None,
    source: str = "",
    name: str = "field",
) -> Oscillator:
    """Return the oscillator of a first-order vector field of any dimension.

    Parameters
    ----------
    rates : mapping
        State -> rate, in the order of the states.  States are plain symbols, functions of time, or names.  Rates are
        expressions of SymPy, numbers, or texts, which are parsed, not run.
    contact : str, optional
        Treatment of jumps, "sign" (the default) or "set-valued".  With "set-valued" motion slides along the zeros of
        the arguments of signs, where the rates on both sides push towards them (Filippov's convex rule).
    events : iterable of Reset, optional
        Jumps of states where a guard passes zero.
    parameters : mapping, optional
        The default of each parameter: a number, or a `Parameter` with its range.
    initial : mapping, optional
        The state around which oscillators start, 0 for the states left out.
    source : str
        Publication of the model.
    name : str
        Name in messages and scene files.

    Returns
    -------
    Oscillator
        The oscillator.  Its states are attributes, such as ``node.x``.

    Raises
    ------
    ValueError, TypeError
        As `Lagrangian` does.

    See Also
    --------
    synchain.Lagrangian
    synchain.Rates
    synchain.Parameter

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain import Field
    >>> x, y, c = sp.symbols("x y c")
    >>> node = Field({x: c*(y + x - x**3/3), y: -(x - 0.7 + 0.8*y)/c}, parameters={c: 3})
    >>> node.y
    y
    """
    what = f"oscillator {_called(name)!r}"
    entries = dict(check_table(f"{what}: rates", rates))
    if not entries:
        raise ValueError(f"{what}: found no rates; expected one for each state")
    moving = _functions(what, [*entries, *entries.values()])
    table = _distinct(what, "state", {_name(what, "state", key): "" for key in entries}, len(entries))
    defaults = _parameters(what, parameters)
    names = _ModelNames.of(what, table, moving, defaults)
    field_rates = tuple(names.expression(f"rate of {s}", e) for s, e in zip(table, entries.values(), strict=True))
    if any(rate.has(FRICTION) for rate in field_rates):
        raise ValueError(f"{what}: found friction(…) in a rate; expected it in the forces of a Lagrangian")
    declared = _events(what, events, names, defaults, None)
    model = FieldModel(tuple(table), field_rates, declared)
    treatment = ContactModel.SIGN if contact is None else ContactModel.parse("contact", contact)
    if treatment is ContactModel.ATAN:
        raise ValueError(f"{what}: found contact 'atan'; expected 'sign' or 'set-valued' for a field")
    if treatment is ContactModel.SET_VALUED:
        states = tuple(sp.Symbol(s, real=True) for s in table)
        _try(what, lambda: sliding_surfaces(states, field_rates))
    return Oscillator(
        name,
        names.used_parameters(model.expressions),
        model,
        names.initial(initial),
        contact=ContactModel.ATAN if contact is None else treatment,
        source=check_text("source", source, LONGEST_SOURCE),
    )


def friction_law(
    force: Expression,
    parameters: Keyed | None = None,
    *,
    static: Expression | None = None,
    order: Iterable[tuple[str, str]] = (),
    self_exciting: bool = False,
    source: str = "",
    name: str = "law",
) -> FrictionLaw:
    """Return a friction law from its coefficient as an expression of the sliding velocity ``w``.

    Parameters
    ----------
    force : Expr, number or str
        Friction force divided by normal load, as a function f of the velocity w of the ground relative to the body,
        with w f(w) >= 0.  A jump at w = 0 must be written with sign(w).
    parameters : mapping, optional
        The default of each parameter.  If none has a unit, w is the non-dimensional velocity.
    static : Expr, number or str, optional
        The static friction coefficient, if it exceeds f(0+).  Used by set-valued contact only.
    order : iterable of (str, str)
        Pairs of parameters (p, q) that must satisfy p <= q under set-valued contact.
    self_exciting : bool
        True if the law may feed energy into the oscillator.
    source : str
        Publication of the law.
    name : str
        Name in messages and scene files.

    Returns
    -------
    FrictionLaw
        The law.

    Raises
    ------
    ValueError, TypeError
        As `Lagrangian` does.

    See Also
    --------
    synchain.friction
    synchain.plugins.FrictionLaw

    Examples
    --------
    >>> from synchain import friction_law
    >>> friction_law("mu*sign(w)/(1 + abs(w))", {"mu": 0.3}).jumps
    True
    """
    what = f"friction law {_called(name)!r}"
    defaults = _parameters(what, parameters)
    names = _ModelNames.of_law(what, defaults)
    coefficient = names.expression("force", force)
    holding = None if static is None else names.expression("static", static)
    used = (coefficient,) if holding is None else (coefficient, holding)
    if any(e.has(FRICTION) for e in used) or (holding is not None and holding.has(SLIDING)):
        raise ValueError(f"{what}: found friction(…), or w in static; expected a force of w and a static coefficient")
    pairs = tuple((str(low), str(high)) for low, high in order)
    for name_of in (entry for pair in pairs for entry in pair):
        if name_of not in defaults:
            raise ValueError(f"{what}: order names {name_of!r}; expected parameters: {', '.join(defaults) or 'none'}")
    own, feeds = names.used_parameters(used), check_flag("self_exciting", self_exciting)
    return FrictionLaw(
        name, own, coefficient, holding, pairs, feeds, source=check_text("source", source, LONGEST_SOURCE)
    )


def link_energy(
    V: Expression = 0,
    *,
    R: Expression = 0,
    T: Expression = 0,
    parameters: Keyed | None = None,
    between: Mapping[str, Iterable[str]] | None = None,
    source: str = "",
    name: str = "coupling",
) -> LagrangianCoupling:
    """Return the coupling given by energies of a link between corresponding coordinates of the two ends.

    The coordinates may have any names.

    Parameters
    ----------
    V : Expr, number or str
        The potential energy of a link of weight ``W`` between the coordinates ``q_i`` and ``q_j`` of its ends; as text,
        ``"k*W*(q_i - q_j)**2/2"``.  An energy of the difference q_i - q_j exerts exactly no force on equal states.
        If exchanging i and j changes an energy, links have a direction and the weight 1.
    R : Expr, number or str
        Rayleigh's dissipation function of the velocities ``v_i`` and ``v_j``, half the dissipated power.
    T : Expr, number or str
        The kinetic energy of a link, a function of ``v_i`` and ``v_j``, if the link has inertia.
    parameters : mapping, optional
        The default of each parameter: a number, or a `Parameter` with its range.
    between : mapping, optional
        Links between two kinds of oscillators: maps the names of both to the states that the energies contain, in
        place of ``q_i``, ``q_j``, ``v_i`` and ``v_j``.
    source : str
        Publication of the coupling.
    name : str
        Name in messages and scene files.

    Returns
    -------
    LagrangianCoupling
        The coupling.  For couplings of particular states use `Potential` and `Rates`.

    Raises
    ------
    ValueError, TypeError
        As `Lagrangian` does, and if no energy contains the weight of the link.

    See Also
    --------
    synchain.Potential
    synchain.Rates

    Examples
    --------
    >>> from synchain import link_energy
    >>> spring = link_energy("k*W*(q_i - q_j)**2/2", parameters={"k": 0.3})
    >>> str(spring.potential)
    'k*weight*(q_i - q_j)**2/2'
    """
    what = f"coupling {_called(name)!r}"
    defaults = _parameters(what, parameters)
    # Symbols of the ends: coordinates and velocities of any oscillator, or the states of two given oscillators.
    kinds: tuple[str, str] | None = None
    ends = {"V": ["q_i", "q_j"], "R": ["v_i", "v_j"], "T": ["v_i", "v_j"]}
    if between is not None:
        table: Mapping[Any, Any] = check_table(f"{what}: between", between)
        if len(table) != 2 or not all(isinstance(states, list | tuple) for states in table.values()):
            raise ValueError(
                f"{what}: between is {short_repr(dict(table))}; expected two oscillators and their states, "
                "such as {'clock': ['theta'], 'beam': ['x']}"
            )
        first, second = map(str, table)
        kinds, states = (first, second), [_name(what, "state", state) for row in table.values() for state in row]
        twice = next((state for state in states if states.count(state) > 1), None)
        if twice is not None:
            raise ValueError(f"{what}: between has the state {twice!r} twice; expected states of different names")
        ends = dict.fromkeys(ends, states)
    energies = []
    for about, value in (("V", V), ("R", R), ("T", T)):
        names = _ModelNames.of_link(f"{what}: {about}", ends[about], defaults)
        energies.append(names.expression("energy", value))
    if any(e.has(FRICTION) for e in energies):
        raise ValueError(f"{what}: found friction(…); expected it in the forces of a Lagrangian")
    if not any(e.has(WEIGHT) for e in energies):
        raise ValueError(f"{what}: no energy has the weight W of a link; expected it as a factor, k*W*(q_i - q_j)**2/2")
    link_parameters = replace(names, what=what).used_parameters(energies)
    potential, dissipation, kinetic = energies
    citation = check_text("source", source, LONGEST_SOURCE)
    return LagrangianCoupling(name, link_parameters, potential, dissipation, kinetic, kinds, source=citation)


def _events(
    what: str,
    events: Iterable[object],
    names: _ModelNames,
    defaults: Mapping[str, Parameter],
    coordinates: Mapping[str, str] | None,
) -> tuple[EventDefinition, ...]:
    """Convert the events of a model; of a field, `coordinates` is None and resets alone have a meaning."""
    found: list[EventDefinition] = []
    for k, event in enumerate(check_instance(f"{what}: events", events, (list, tuple), "a list of events")):
        about = f"event {k + 1}"
        expected: tuple[type[EventDefinition], ...] = (Reset,) if coordinates is None else (Friction, Stop, Reset)
        declared: EventDefinition = check_instance(
            f"{what}: {about}", event, expected, " or ".join(kind.__name__ for kind in expected)
        )

        def change(part: str, value: object, about: str = about) -> sp.Expr:
            return names.expression(f"{about}: {part}", value)

        def state(key: object, about: str = about) -> str:
            return names.state(f"{about}: sets", key, names.states)

        made: EventDefinition = declared.map(change, state)
        if isinstance(made, Friction):
            if made.law is not None:
                check_instance(f"{what}: {about}: law", made.law, (str, FrictionLaw), "a name, or a friction_law(…)")
            made = replace(made, law=_law(f"{what}: {about}", made.law, defaults))
        speeds = {sp.Symbol(name, real=True) for name in (coordinates or {}).values()}
        if isinstance(made, Stop) and (
            made.gap.free_symbols & speeds or not made.gap.free_symbols & _reals(coordinates)
        ):
            raise ValueError(f"{what}: {about}: found the gap {made.gap}; expected a function of coordinates and time")
        if isinstance(made, Friction) and not made.sliding.free_symbols & speeds:
            raise ValueError(
                f"{what}: {about}: found the sliding velocity {made.sliding}; expected one with a velocity"
            )
        if any(e.has(FRICTION) for e in made.expressions):
            raise ValueError(f"{what}: {about}: found friction(…); expected it in the forces Q alone")
        found.append(made)
    return tuple(found)


def _reals(names: Iterable[str] | None) -> set[sp.Symbol]:
    return {sp.Symbol(name, real=True) for name in names or ()}


def _called(name: object) -> str:
    """Check the name of a model: a short text that is no path of a plug-in file."""
    text = check_text("name", name)
    if text.endswith(".py"):
        raise ValueError(f"name: found {text!r}, which names a file of code; expected another name")
    return text


# -- names -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _ModelNames:
    """Map names to symbols, and convert expressions, for one model."""

    what: str  # name of the model in messages
    symbols: Mapping[str, sp.Symbol]
    states: tuple[str, ...] = ()
    # function of time or derivative of one -> symbol that replaces it; a plain symbol of the same name is refused,
    # because SymPy's derivative by time treated that symbol as constant
    moving: Mapping[sp.Expr, sp.Symbol] = field(default_factory=dict)
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    # parameter -> name in the expressions, if the two names differ
    physical: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        what: str,
        table: Mapping[str, str],
        functions: Iterable[AppliedUndef],
        parameters: Mapping[str, Parameter],
        scaling: Scaling | None = None,
    ) -> _ModelNames:
        """Make the names of a model; `table` maps coordinates to names of velocities ("" for none)."""
        states = (*table, *filter(None, table.values()))
        physical: Mapping[str, str] = {} if scaling is None else scaling.physical
        # Constants that define the scales are positive, so that SymPy splits roots of their products.
        quantities = {} if scaling is None else {name: sp.Symbol(name, positive=True) for name in scaling.units}
        for name in (physical.get(name, name) for name in parameters):
            if name in quantities:
                raise ValueError(f"{what}: the name {name!r} stands for two quantities; rename one")
            quantities[name] = sp.Symbol(name, real=True)
        for state in states:
            if state in Oscillator.__dict__:
                raise ValueError(f"{what}: the state {state!r} has the name of an attribute of nodes; rename it")
        clash = next((s for i, s in enumerate(states) if s in states[:i] or s in quantities), None)
        if clash is not None:
            raise ValueError(
                f"{what}: the name {clash!r} stands for two things; rename one, e.g. by coordinates={{x: v}}"
            )
        moving: dict[sp.Expr, sp.Symbol] = {}
        for function in functions:
            state = function.func.__name__
            if state not in table:
                raise ValueError(f"{what}: undeclared function {function}; declared: {', '.join(table)}")
            moving[function] = sp.Symbol(state, real=True)
            if table[state]:
                moving[function.diff(function.args[0])] = sp.Symbol(table[state], real=True)
        symbols = {name: sp.Symbol(name, real=True) for name in states}
        return cls(what, {**symbols, **quantities, TIME.name: TIME}, states, moving, parameters, physical)

    @classmethod
    def of_law(cls, what: str, parameters: Mapping[str, Parameter]) -> _ModelNames:
        """Make the names of a friction law: sliding velocity and parameters."""
        if SLIDING.name in parameters:
            raise ValueError(f"{what}: the name 'w' stands for the sliding velocity; rename that parameter")
        symbols = {name: sp.Symbol(name, real=True) for name in parameters}
        return cls(what, {SLIDING.name: SLIDING, **symbols}, parameters=parameters)

    @classmethod
    def of_link(cls, what: str, states: Iterable[str], parameters: Mapping[str, Parameter]) -> _ModelNames:
        """Make the names of a link's energies: states of the ends, the weight under two names, parameters."""
        weights = {"W": WEIGHT, WEIGHT.name: WEIGHT}
        clash = next((name for name in (*states, *weights) if name in parameters), None)
        if clash is not None:
            raise ValueError(f"{what}: the name {clash!r} stands for two things; rename the parameter")
        symbols = {name: sp.Symbol(name, real=True) for name in (*states, *parameters)}
        return cls(what, {**symbols, **weights}, parameters=parameters)

    def expression(self, about: str, value: object) -> sp.Expr:
        """Convert the user's expression to the form that a model stores."""
        about = f"{self.what}: {about}"
        if not isinstance(value, sp.Expr):
            return exact(about, value, self.symbols)
        hidden = {symbol.name for symbol in self.moving.values()}
        for symbol in sorted(value.free_symbols, key=str):
            if symbol.name in hidden:
                raise ValueError(
                    f"{about}: found the symbol {symbol} beside functions of time; expected one of the two"
                )
        unknown = [e for e in value.atoms(AppliedUndef, sp.Derivative) if e.func != FRICTION and e not in self.moving]
        if unknown:
            raise ValueError(
                f"{about}: found {min(map(str, unknown))}; expected {', '.join(map(str, self.moving)) or 'plain symbols'}"
            )
        return exact(about, value.xreplace(self.moving), self.symbols)

    def state(self, about: str, key: object, known: Collection[str]) -> str:
        """Convert a key of a mapping to the name of a state; ValueError unless the name is in `known`."""
        symbol = self.moving.get(key)
        name = symbol.name if symbol is not None else _name(self.what, about, key)
        if name not in known:
            expected = f"{', '.join(known)}{suggestion(name, known)}"
            raise ValueError(f"{self.what}: {about} has the key {short_repr(key)}; expected {expected}")
        return name

    def initial(self, value: Keyed | None) -> FrozenDict[float] | None:
        """Check the state around which oscillators start."""
        if value is None:
            return None
        table = check_table(f"{self.what}: initial", value)
        return FrozenDict(
            {self.state("initial", key, self.states): _value(f"initial {key}", number) for key, number in table.items()}
        )

    def used_parameters(self, expressions: Iterable[sp.Expr], law: FrictionLaw | None = None) -> FrozenDict[Parameter]:
        """Return the parameters outside the law; ValueError if one is unused, or used inside and outside the law."""
        symbols = {s.name for e in expressions for s in e.free_symbols}
        of_law = frozenset(() if law is None else law.parameters)
        for name in self.parameters:
            inside = self.physical.get(name, name)
            if name in of_law and inside in symbols:
                raise ValueError(
                    f"{self.what}: {name!r} is in the friction law and outside of it; expected it in one of them"
                )
            if name not in of_law and inside not in symbols:
                shown = repr(name) if inside == name else f"{name!r} ({inside} in the expressions)"
                raise ValueError(f"{self.what}: no expression has the parameter {shown}; use it or leave it out")
        return FrozenDict({name: parameter for name, parameter in self.parameters.items() if name not in of_law})


def _functions(what: str, values: Iterable[object]) -> list[AppliedUndef]:
    """Collect the functions of time in expressions, sorted by name."""
    functions = {f for value in values if isinstance(value, sp.Expr) for f in value.atoms(AppliedUndef)}
    moving = sorted((f for f in functions if f.func != FRICTION), key=str)
    for function in moving:
        if len(function.args) != 1 or getattr(function.args[0], "name", "") != TIME.name:
            raise ValueError(f"{what}: found the function {function}; expected functions of t alone, e.g. x(t)")
    return moving


def _coordinates(what: str, value: object, moving: Iterable[AppliedUndef]) -> Mapping[str, str]:
    """Map each coordinate to the name of its velocity."""
    if value is None:
        value = list(dict.fromkeys(function.func.__name__ for function in moving))
        if not value:
            raise ValueError(f"{what}: found no function of time; expected coordinates = {{x: v}} for plain symbols")
    if isinstance(value, Mapping):
        table = {_name(what, "coordinate", key): _name(what, "velocity", speed) for key, speed in value.items()}
        return _distinct(what, "coordinate", table, len(value))
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise TypeError(
            f"{what}: coordinates: found {typed_repr(value)}; expected a list, or a mapping such as {{x: v}}"
        )
    names = [_name(what, "coordinate", key) for key in value]
    if not names:
        raise ValueError(f"{what}: found no coordinates; expected at least one")
    # Default names of velocities: v for a single coordinate, else v_x, v_y, …
    speeds = ["v"] if len(names) == 1 else [f"v_{name}" for name in names]
    return _distinct(what, "coordinate", dict(zip(names, speeds, strict=True)), len(names))


def _distinct(what: str, role: str, table: dict[str, str], count: int) -> dict[str, str]:
    if len(table) < count:
        raise ValueError(f"{what}: two keys are the same {role}; expected each once")
    return table


def _name(what: str, role: str, key: object) -> str:
    """Return the name of a symbol, a function of time or a text; ValueError if text cannot contain that name."""
    name = key.func.__name__ if isinstance(key, AppliedUndef) else getattr(key, "name", key)
    if not isinstance(name, str):
        raise TypeError(
            f"{what}: found {typed_repr(key)} for a {role}; expected a symbol, a function of time or a name"
        )
    plain = name.isidentifier() and not iskeyword(name) and not name.startswith("_") and len(name) <= 60
    if iskeyword(name):
        raise ValueError(
            f"{what}: {name!r} is a word of Python, which no text can use; call the {role} {name}_ or {name[:3]}"
        )
    if not plain or unicodedata.normalize("NFKC", name) != name:
        raise ValueError(
            f"{what}: {short_repr(name)} is no name of a {role}; expected letters and digits, such as 'mu_1'"
        )
    if name in RESERVED or name in FUNCTIONS:
        raise ValueError(f"{what}: the name {name!r} of a {role} has another meaning in expressions; rename it")
    return name


# -- parameters and units ----------------------------------------------------------------------------------------


def _scaling(
    what: str, table: object, coordinates: Mapping[str, str], parameters: Iterable[str]
) -> tuple[Scaling, dict[str, str]]:
    """Read a scaling from a table; also return the units of all quantities that are not parameters."""
    what = f"{what}: scaling"
    entries = check_table(what, table)
    check_keys(what, entries, ("units", "scales", "physical"))
    units: dict[str, str] = {}
    for key, unit in check_table(f"{what}: units", entries.get("units", {})).items():
        name = _name(what, "quantity", key)
        units[name] = check_text(f"{what}: unit of {name}", unit)
        _try(f"{what}: {name}", lambda unit=unit: dimension(unit))
    constants = {name: unit for name, unit in units.items() if name not in coordinates}
    # Map each parameter to its name in the expressions.
    renamed = check_table(f"{what}: physical", entries.get("physical", {}))
    check_keys(f"{what}: physical", renamed, parameters)
    physical = {name: _name(what, "quantity", renamed.get(name, name)) for name in parameters}
    # Read the units of mass, length and time as expressions of the constants.
    scales = check_table(f"{what}: scales", entries.get("scales", {}))
    if set(scales) != {"kg", "m", "s"}:
        keys = ", ".join(map(repr, scales)) or "nothing"
        raise ValueError(f"{what}: found scales of {keys}; expected those of 'kg', 'm' and 's'")
    names = _ModelNames(what, {name: sp.Symbol(name, positive=True) for name in constants})
    made = {str(key): names.expression(f"scale of {key}", value) for key, value in scales.items()}
    return Scaling(FrozenDict(constants), FrozenDict(physical), FrozenDict(made)), units


def _parameters(what: str, parameters: Keyed | None) -> dict[str, Parameter]:
    """Map names to parameters; assumptions of a symbol (positive, nonnegative) become the range."""
    table: dict[str, Parameter] = {}
    for key, value in check_table(f"{what}: parameters", {} if parameters is None else parameters).items():
        name = _name(what, "parameter", key)
        if name in table:
            raise ValueError(f"{what}: two parameters are called {name!r}; expected each name once")
        table[name] = _try(f"{what}: {name}", lambda key=key, value=value: _assumed(key, _parameter(value)))
    return table


def _parameter(value: object) -> Parameter:
    if isinstance(value, Parameter):
        return value
    if not isinstance(value, Mapping):
        return Parameter(_value("default", value))
    return Parameter.of_table("parameter", value, [entry.name for entry in fields(Parameter)])


def _value(what: str, value: object) -> float:
    """Convert a number, a fraction or a constant of SymPy to a finite float."""
    if isinstance(value, sp.Expr) and value.is_number and value.is_real:
        return check_number(what, float(value))
    return check_number(what, float(value) if isinstance(value, Fraction) else value)


_REAL = sp.Symbol("x", real=True).assumptions0
_POSITIVE = sp.Symbol("x", positive=True).assumptions0
_NONNEGATIVE = sp.Symbol("x", nonnegative=True).assumptions0


def _assumed(key: object, parameter: Parameter) -> Parameter:
    """Give a parameter the range assumed for its symbol; ValueError if no range expresses an assumption."""
    facts = key.assumptions0 if isinstance(key, sp.Symbol) else _REAL
    if facts.items() <= _REAL.items():
        return parameter
    if facts.items() <= _NONNEGATIVE.items():
        return replace(parameter, minimum=max(0.0, parameter.minimum or 0.0))
    if facts.items() <= _POSITIVE.items():
        return replace(parameter, positive=True)
    assumed = ", ".join(sorted(name for name, holds in facts.items() if holds and name not in _POSITIVE))
    raise ValueError(f"its symbol is assumed to be {assumed or 'nonzero'}; expected real, nonnegative or positive")


def _law(what: str, value: object, defaults: Mapping[str, Parameter]) -> FrictionLaw | None:
    """Make a friction law from a name, a FrictionLaw, or an expression of the sliding velocity and parameters."""
    if value is None or isinstance(value, FrictionLaw):
        return value
    if isinstance(value, str):
        return load_friction_law(value)
    expected = "a name, a law that friction_law('mu*sign(w)', {'mu': 0.3}) makes, or an expression of SymPy of w"
    expected += "; a law of one contact: events=[Friction(w, load, law)]" if isinstance(value, Mapping) else ""
    force = check_instance(f"{what}: friction", value, (sp.Expr, int, float), expected)
    about = f"{what}: friction"
    coefficient = _ModelNames.of_law(about, defaults).expression("law", force)
    used = {s.name for s in coefficient.free_symbols}
    return friction_law(coefficient, {name: parameter for name, parameter in defaults.items() if name in used})


def _try(what: str, action: Any) -> Any:
    """Call `action` and return its result; prefix its error messages with `what`."""
    try:
        return action()
    except (ValueError, TypeError) as error:
        raise type(error)(f"{what}: {' '.join(str(error).split())}") from None
