"""Oscillators, friction laws and couplings from expressions in SymPy or text: for notebooks, scene files and plug-in files.

States are functions of time or plain symbols, the time is any symbol called t, decimals are exact: 0.1 is 1/10.  Symbols of
one name are one quantity, real whatever was assumed; a parameter that was assumed positive or nonnegative has that range.
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
from ..mechanics.lagrangian import check_masses_exist, mass_matrix
from ..mechanics.oscillator import FRICTION, Coordinate, FieldModel, LagrangianModel, Oscillator, Scaling
from ..mechanics.parameter import Parameter, dimension
from .loader import load_friction_law

Expression: TypeAlias = "sp.Expr | float | str"
"""An expression of SymPy, a number, or text that is parsed and not run."""

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
        The generalised force on each coordinate, 0 for those left out.  ``friction(velocity)`` in it is the friction
        coefficient at a sliding velocity.
    R : Expr, number or str
        Rayleigh's function, half the power lost; its negative derivatives by the velocities are added to the forces.
    coordinates : iterable or mapping, optional
        The coordinates in their order, or each with the name of its velocity: ``{x: v}``.  Left out, they are the
        functions of time in the expressions, sorted by name.  Velocities are derivatives of such functions; as states
        and in text they are called v if there is one coordinate, v_x and v_y if there are several, unless said
        otherwise.  Coordinates that are plain symbols must be given.
    friction : str, FrictionLaw or Expr, optional
        The friction law: its name, its value, or the friction coefficient as an expression of SymPy of the sliding
        velocity ``w`` and of parameters that occur nowhere else; `friction_law` reads one from text.  A scene may name
        another.
    contact : str, optional
        How the jump of the law at rest is treated: "atan" (the default), "sign" or "set-valued".  A law without a
        jump never sticks.
    parameters : mapping, optional
        The default of each parameter: a number, or a `Parameter` with its range.
    initial : mapping, optional
        The state around which oscillators start, 0 for the states left out.
    scaling : mapping, optional
        Keyed if the Lagrangian is in physical quantities, from which the non-dimensional equations are derived.
        ``units`` has the SI unit of each constant, such as ``{"m": "kg", "k": "N/m"}``, and of each coordinate with a
        unit; ``scales`` the units of mass, length and time made of the constants, ``{"kg": "m", "m": …, "s":
        "sqrt(m/k)"}``; ``physical`` the name in the expressions of each parameter that has another name there.
    source : str
        Where the model was published.
    name : str
        Name in messages and scene files.

    Returns
    -------
    Oscillator
        The oscillator; its states are its attributes, ``node.x``.

    Raises
    ------
    ValueError, TypeError
        For undeclared symbols, unused parameters, functions that generated code does not know, numbers that are not
        finite and real, unknown coordinates, two meanings of one name, and a velocity without kinetic energy.

    Examples
    --------
    >>> import sympy as sp
    >>> from sympy.physics.mechanics import dynamicsymbols
    >>> from synchain.models import Lagrangian
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
    # Friction: a law or a contact needs a force with friction(…).
    law = _law(what, friction, defaults)
    rubs = any(force.has(FRICTION) for force in acting)
    for keyword, value in (("friction", law), ("contact", contact)):
        if value is not None and not rubs:
            raise ValueError(f"{what}: found {keyword} {str(value)!r}, but no force has friction(…); leave it out")
    treatment = ContactModel.ATAN if contact is None else ContactModel.parse("contact", contact)
    # A law that was written as an expression takes its parameters along.
    written = law if isinstance(friction, sp.Expr | int | float) else None
    node_parameters = names.used_parameters((*energies, *acting), written)
    if scales is not None:
        scales = replace(scales, physical=FrozenDict({name: scales.physical[name] for name in node_parameters}))
    model = LagrangianModel(
        tuple(Coordinate(c, speed, units.get(c, "1")) for c, speed in table.items()),
        kinetic,
        potential,
        acting,
        dissipation,
        scales,
    )
    start, citation = names.initial(initial), check_text("source", source, LONGEST_SOURCE)
    return Oscillator(name, node_parameters, model, start, law, treatment, source=citation)


def Field(
    rates: Mapping[Any, Expression],
    *,
    parameters: Keyed | None = None,
    initial: Keyed | None = None,
    source: str = "",
    name: str = "field",
) -> Oscillator:
    """Return the oscillator of a first-order vector field of any dimension.

    Parameters
    ----------
    rates : mapping
        The rate of each state, in the order of the states: plain symbols, functions of time, or names.  Rates are
        expressions of SymPy, numbers, or text that is parsed, not run.
    parameters : mapping, optional
        The default of each parameter: a number, or a `Parameter` with its range.
    initial : mapping, optional
        The state around which oscillators start, 0 for the states left out.
    source : str
        Where the model was published.
    name : str
        Name in messages and scene files.

    Returns
    -------
    Oscillator
        The oscillator; its states are its attributes, ``node.x``.

    Raises
    ------
    ValueError, TypeError
        As `Lagrangian` does.

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain.models import Field
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
    model = FieldModel(tuple(table), field_rates)
    return Oscillator(
        name,
        names.used_parameters(field_rates),
        model,
        names.initial(initial),
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
        Friction force over normal load, of the velocity w of the ground relative to the body; w f(w) >= 0.  A jump
        at w = 0 is written with sign(w), and refused if it is not.
    parameters : mapping, optional
        The default of each parameter.  If none has a unit, w is the non-dimensional velocity.
    static : Expr, number or str, optional
        The static friction coefficient if it exceeds f(0+); for set-valued contact alone.
    order : iterable of (str, str)
        Pairs of parameters of which the first must not exceed the second under set-valued contact.
    self_exciting : bool
        True if the law is meant to feed energy.
    source : str
        Where the law was published.
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

    Examples
    --------
    >>> from synchain.models import friction_law
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
    """Return the coupling of the energies of a link between equal coordinates of its two ends, whatever these are called.

    Parameters
    ----------
    V : Expr, number or str
        The potential energy of a link of weight ``W`` between the coordinates ``q_i`` and ``q_j`` of its ends; as text,
        ``"k*W*(q_i - q_j)**2/2"``.  Written in the difference, equal states feel exactly nothing.  Where exchanging i
        and j changes an energy, links have a direction and the weight 1.
    R : Expr, number or str
        Rayleigh's function of the velocities ``v_i`` and ``v_j``, half the power lost.
    T : Expr, number or str
        The kinetic energy of a link in ``v_i`` and ``v_j``, which gives it inertia.
    parameters : mapping, optional
        The default of each parameter: a number, or a `Parameter` with its range.
    between : mapping, optional
        Two oscillators by name, each with those of its states that the energies contain, in place of the ends above.
    source : str
        Where the coupling was published.
    name : str
        Name in messages and scene files.

    Returns
    -------
    LagrangianCoupling
        The coupling; `Potential` and `Rates` make those of given states.

    Raises
    ------
    ValueError, TypeError
        As `Lagrangian` does, and for energies without the weight of the link.

    Examples
    --------
    >>> from synchain.models import link_energy
    >>> spring = link_energy("k*W*(q_i - q_j)**2/2", parameters={"k": 0.3})
    >>> str(spring.potential)
    'k*weight*(q_i - q_j)**2/2'
    """
    what = f"coupling {_called(name)!r}"
    defaults = _parameters(what, parameters)
    # The ends in the energies: coordinates and velocities of any oscillator, or the states of two given ones.
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


def _called(name: object) -> str:
    """The name of a model: a short text, and no path of a file of code."""
    text = check_text("name", name)
    if text.endswith(".py"):
        raise ValueError(f"name: found {text!r}, which names a file of code; expected another name")
    return text


# -- names -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _ModelNames:
    """The symbols of the names in the expressions of one model."""

    what: str  # the model in messages
    symbols: Mapping[str, sp.Symbol]
    states: tuple[str, ...] = ()
    # functions of time and their derivatives -> the symbols that take their places; a plain symbol of the same name is
    # refused, since SymPy's derivatives would not have seen it
    moving: Mapping[sp.Expr, sp.Symbol] = field(default_factory=dict)
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    # parameter -> its name in the expressions; parameters left out have one name
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
        """The names of a model: coordinates with the names of their velocities ("" for none), and quantities."""
        states = (*table, *filter(None, table.values()))
        physical: Mapping[str, str] = {} if scaling is None else scaling.physical
        # The constants that fix the scales are positive, so that SymPy takes roots of their products apart.
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
        """The names of a friction law: the sliding velocity and parameters."""
        if SLIDING.name in parameters:
            raise ValueError(f"{what}: the name 'w' stands for the sliding velocity; rename that parameter")
        symbols = {name: sp.Symbol(name, real=True) for name in parameters}
        return cls(what, {SLIDING.name: SLIDING, **symbols}, parameters=parameters)

    @classmethod
    def of_link(cls, what: str, states: Iterable[str], parameters: Mapping[str, Parameter]) -> _ModelNames:
        """The names of the energy of a link: states of its ends, its weight under two names, and parameters."""
        weights = {"W": WEIGHT, WEIGHT.name: WEIGHT}
        clash = next((name for name in (*states, *weights) if name in parameters), None)
        if clash is not None:
            raise ValueError(f"{what}: the name {clash!r} stands for two things; rename the parameter")
        symbols = {name: sp.Symbol(name, real=True) for name in (*states, *parameters)}
        return cls(what, {**symbols, **weights}, parameters=parameters)

    def expression(self, about: str, value: object) -> sp.Expr:
        """The expression of a user in the form that a model keeps."""
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
        """The name of a state out of some that is a key of a mapping."""
        symbol = self.moving.get(key)
        name = symbol.name if symbol is not None else _name(self.what, about, key)
        if name not in known:
            expected = f"{', '.join(known)}{suggestion(name, known)}"
            raise ValueError(f"{self.what}: {about} has the key {short_repr(key)}; expected {expected}")
        return name

    def initial(self, value: Keyed | None) -> FrozenDict[float] | None:
        """The state around which oscillators start."""
        if value is None:
            return None
        table = check_table(f"{self.what}: initial", value)
        return FrozenDict(
            {self.state("initial", key, self.states): _value(f"initial {key}", number) for key, number in table.items()}
        )

    def used_parameters(self, expressions: Iterable[sp.Expr], law: FrictionLaw | None = None) -> FrozenDict[Parameter]:
        """The parameters without those of a law written among them; ValueError if one is unused, or used in both."""
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
    """The functions of time in some expressions, sorted by name."""
    functions = {f for value in values if isinstance(value, sp.Expr) for f in value.atoms(AppliedUndef)}
    moving = sorted((f for f in functions if f.func != FRICTION), key=str)
    for function in moving:
        if len(function.args) != 1 or getattr(function.args[0], "name", "") != TIME.name:
            raise ValueError(f"{what}: found the function {function}; expected functions of t alone, e.g. x(t)")
    return moving


def _coordinates(what: str, value: object, moving: Iterable[AppliedUndef]) -> Mapping[str, str]:
    """Each coordinate with the name of its velocity."""
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
    speeds = ["v"] if len(names) == 1 else [f"v_{name}" for name in names]
    return _distinct(what, "coordinate", dict(zip(names, speeds, strict=True)), len(names))


def _distinct(what: str, role: str, table: dict[str, str], count: int) -> dict[str, str]:
    if len(table) < count:
        raise ValueError(f"{what}: two keys are the same {role}; expected each once")
    return table


def _name(what: str, role: str, key: object) -> str:
    """The name of a symbol, a function of time or a text, as a name that all texts can have."""
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
    """The scaling of a table, and the units of all quantities that are no parameters."""
    what = f"{what}: scaling"
    entries = check_table(what, table)
    check_keys(what, entries, ("units", "scales", "physical"))
    units: dict[str, str] = {}
    for key, unit in check_table(f"{what}: units", entries.get("units", {})).items():
        name = _name(what, "quantity", key)
        units[name] = check_text(f"{what}: unit of {name}", unit)
        _try(f"{what}: {name}", lambda unit=unit: dimension(unit))
    constants = {name: unit for name, unit in units.items() if name not in coordinates}
    # Parameters have another name in the expressions, or the same.
    renamed = check_table(f"{what}: physical", entries.get("physical", {}))
    check_keys(f"{what}: physical", renamed, parameters)
    physical = {name: _name(what, "quantity", renamed.get(name, name)) for name in parameters}
    # The units of mass, length and time are made of the constants.
    scales = check_table(f"{what}: scales", entries.get("scales", {}))
    if set(scales) != {"kg", "m", "s"}:
        keys = ", ".join(map(repr, scales)) or "nothing"
        raise ValueError(f"{what}: found scales of {keys}; expected those of 'kg', 'm' and 's'")
    names = _ModelNames(what, {name: sp.Symbol(name, positive=True) for name in constants})
    made = {str(key): names.expression(f"scale of {key}", value) for key, value in scales.items()}
    return Scaling(FrozenDict(constants), FrozenDict(physical), FrozenDict(made)), units


def _parameters(what: str, parameters: Keyed | None) -> dict[str, Parameter]:
    """Name -> Parameter, with the range that a symbol was assumed to have."""
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
    """A finite number; constants of SymPy and fractions are numbers too."""
    if isinstance(value, sp.Expr) and value.is_number and value.is_real:
        return check_number(what, float(value))
    return check_number(what, float(value) if isinstance(value, Fraction) else value)


_REAL = sp.Symbol("x", real=True).assumptions0
_POSITIVE = sp.Symbol("x", positive=True).assumptions0
_NONNEGATIVE = sp.Symbol("x", nonnegative=True).assumptions0


def _assumed(key: object, parameter: Parameter) -> Parameter:
    """A parameter with the range of the assumptions of its symbol; ValueError if no range says the same."""
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
    """The friction law of a name, a value, or an expression of the sliding velocity and some of the parameters."""
    if value is None or isinstance(value, FrictionLaw):
        return value
    if isinstance(value, str):
        return load_friction_law(value)
    expected = "a name, a law that friction_law('mu*sign(w)', {'mu': 0.3}) makes, or an expression of SymPy of w"
    force = check_instance(f"{what}: friction", value, (sp.Expr, int, float), expected)
    about = f"{what}: friction"
    coefficient = _ModelNames.of_law(about, defaults).expression("law", force)
    used = {s.name for s in coefficient.free_symbols}
    return friction_law(coefficient, {name: parameter for name, parameter in defaults.items() if name in used})


def _try(what: str, action: Any) -> Any:
    """What an action returns; its errors begin with `what`."""
    try:
        return action()
    except (ValueError, TypeError) as error:
        raise type(error)(f"{what}: {' '.join(str(error).split())}") from None
