"""The kinds of plug-in that mechanics knows, and what their files must hold: checked when a file from outside is loaded.

A definition that another one makes idle and a parameter that no function uses are refused, since the model would
be another than the one that was meant.  Lists of plug-ins need no SymPy: only the functions that check a file load it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, Self

from ..inputs.plugin_file import PluginFile
from ..inputs.plugins import PluginKind
from ..mechanics.parameter import Parameter

if TYPE_CHECKING:
    import sympy as sp

_PHYSICAL = ("scales", "UNITS")
_LAGRANGIAN = ("kinetic", "potential", "force", "dissipation", "particles", "COORDINATES", "PHYSICAL", *_PHYSICAL)

KNOWN = {
    "oscillator": ("SUMMARY", "SOURCE", "FRICTION", "PARAMETERS", "STATE", "INITIAL", "field", *_LAGRANGIAN),
    "friction": ("SUMMARY", "SOURCE", "ODD", "PARAMETERS", "ORDER", "SELF_EXCITING", "force", "static"),
    "coupling": ("SUMMARY", "SOURCE", "PARAMETERS", "BETWEEN", "kinetic", "potential", "dissipation"),
}
"""The public names that a file of each kind may define; imports and names with an underscore in front are its own."""

_NEEDED = {
    "oscillator": ("PARAMETERS", "FRICTION"),
    "friction": ("PARAMETERS", "force"),
    "coupling": ("PARAMETERS",),
}


@dataclass(frozen=True, slots=True)
class _PartFile(PluginFile):
    """The file of a part of a model: it has parameters, and its functions return expressions."""

    @classmethod
    def checked(cls, kind: str, module: ModuleType, where: str, text: bytes) -> Self:
        """Return the file of a part whose names, values and table of parameters are those that its kind may have."""
        file = cls.of(kind, KNOWN[kind], module, where, text)
        file.check_names(_NEEDED[kind])
        file.check_values()
        file.check_parameters()
        return file

    def check_parameters(self) -> None:
        """Refuse a table of parameters that is none."""
        table = self.get("PARAMETERS")
        if not isinstance(table, Mapping):
            raise self.wrong("PARAMETERS", f"PARAMETERS is {table!r}; expected a dict of names and Parameters")
        for name, parameter in table.items():
            if not (isinstance(name, str) and name.isidentifier()):
                raise self.wrong("PARAMETERS", f"PARAMETERS has the key {name!r}; expected a name such as 'delta'")
            if not isinstance(parameter, Parameter):
                like = f'Parameter({parameter!r}, "1", "what it means")'
                raise self.wrong("PARAMETERS", f"PARAMETERS[{name!r}] is {parameter!r}; expected {like}")
            if not parameter.meaning.strip():
                raise self.wrong("PARAMETERS", f"{name!r} has no meaning; expected a phrase that says what it is")

    def expression(self, name: str, given: Mapping[str, object]) -> sp.Expr:
        """What a function returns for symbols, one expression."""
        return self.as_expression(name, self.value(name, given))

    def as_expression(self, name: str, value: object) -> sp.Expr:
        import sympy as sp

        if isinstance(value, int | float) and not isinstance(value, bool):
            return sp.sympify(value)
        if not isinstance(value, sp.Expr):
            raise self.wrong(name, f"{name} returns {value!r} ({type(value).__name__}); expected an expression")
        return value

    def expressions(self, name: str, value: Any, of: tuple[str, ...]) -> list[sp.Expr]:
        """What a function has returned, an expression for each of some names."""
        if not isinstance(value, tuple | list) or len(value) != len(of):
            found = f"{len(value)} expressions" if isinstance(value, tuple | list) else f"{value} alone"
            raise self.wrong(
                name, f"{name} returns {found}; expected a tuple of {len(of)}, one for each of {', '.join(of)}"
            )
        return [self.as_expression(name, entry) for entry in value]

    def check_use(self, found: Iterable[sp.Expr], names: Mapping[str, str]) -> None:
        """Refuse parameters (name -> name in the functions) that occur in no expression."""
        used = {s.name for e in found for s in e.free_symbols}
        for name, inside in names.items():
            if inside not in used:
                own = f"{name!r}" if name == inside else f"{name!r} ({inside} in the functions)"
                raise self.wrong("PARAMETERS", f"no function uses the parameter {own}; use it or leave it out")


def lagrangian_symbols(module: ModuleType) -> dict[str, Any]:
    """Return what the functions of a Lagrangian may ask for, by name, in physical symbols."""
    from ..mechanics.components import TIME
    from ..mechanics.oscillator import FRICTION

    physical = getattr(module, "PHYSICAL", {})
    states = [name for c, (velocity, _) in coordinates_of(module).items() for name in (c, velocity)]
    names = [*(physical.get(name, name) for name in module.PARAMETERS), *states]
    return {**_symbols(names, getattr(module, "UNITS", {})), TIME.name: TIME, "friction": FRICTION}


def coordinates_of(module: ModuleType) -> Mapping[str, tuple[str, str]]:
    """Return coordinate -> (velocity, unit) of the file of a Lagrangian."""
    table: Mapping[str, tuple[str, str]] = getattr(module, "COORDINATES", {"x": ("v", "m")})
    return table


def _symbols(names: Iterable[str], positive: Iterable[str] = ()) -> dict[str, sp.Symbol]:
    import sympy as sp

    return {
        **{name: sp.Symbol(name, positive=True) for name in positive},
        **{name: sp.Symbol(name, real=True) for name in names},
    }


def check_oscillator(module: ModuleType, where: str, text: bytes) -> None:
    """Raise ValueError if a module is neither a vector field nor a Lagrangian, or lacks what its scaling needs."""
    file = _PartFile.checked("oscillator", module, where, text)
    if file.has("field"):
        file.idle(_LAGRANGIAN, "beside field, which is the whole model")
        file.need("STATE")
        found, states = _field(file)
        names = {name: name for name in file.get("PARAMETERS")}
    else:
        file.need("kinetic", "potential")
        file.idle(("STATE",), "without field; a Lagrangian has COORDINATES")
        _check_units(file)
        found, states = _lagrangian(file)
        names = {name: file.get("PHYSICAL", {}).get(name, name) for name in file.get("PARAMETERS")}
    file.check_use(found, names)
    _check_friction(file, found)
    start = file.get("INITIAL", {})
    if not isinstance(start, Mapping) or not set(start) <= set(states):
        raise file.wrong("INITIAL", f"INITIAL is {start!r}; expected a dict with keys out of {', '.join(states)}")


def _field(file: _PartFile) -> tuple[list[sp.Expr], tuple[str, ...]]:
    """The rates of a vector field and the names of its states."""
    from ..mechanics.components import TIME

    state = file.get("STATE")
    if not isinstance(state, tuple | list) or not all(isinstance(s, str) and s.isidentifier() for s in state):
        raise file.wrong("STATE", f'STATE is {state!r}; expected a tuple of names such as ("x", "y")')
    given = _symbols((*file.get("PARAMETERS"), *state)) | {TIME.name: TIME}
    return file.expressions("field", file.value("field", given), tuple(state)), tuple(state)


def _lagrangian(file: _PartFile) -> tuple[list[sp.Expr], tuple[str, ...]]:
    """All that the functions of a Lagrangian return, and the names of its states."""
    found = coordinates_of(file.module)
    for name, pair in found.items() if isinstance(found, Mapping) else [(found, None)]:
        if not (isinstance(pair, tuple) and len(pair) == 2 and all(isinstance(part, str) for part in (name, *pair))):
            raise file.wrong(
                "COORDINATES",
                f'COORDINATES has {name!r}: {pair!r}; expected a velocity and a unit each, such as {{"x": ("v", "m")}}',
            )
    given = lagrangian_symbols(file.module)
    values = [file.expression(name, given) for name in ("kinetic", "potential")]
    if file.has("force"):
        force = file.value("force", given)
        one = len(found) == 1 and not isinstance(force, tuple | list)
        values += file.expressions("force", (force,) if one else force, tuple(found))
    if file.has("dissipation"):
        values.append(file.expression("dissipation", given))
    return values, (*found, *(speed for speed, _ in found.values()))


def _check_units(file: _PartFile) -> None:
    """Scales, UNITS and PHYSICAL belong together."""
    if not file.has("scales"):
        file.idle(("UNITS", "PHYSICAL"), "without scales")
        return
    file.need("UNITS")
    units, physical, parameters = file.get("UNITS"), file.get("PHYSICAL", {}), file.get("PARAMETERS")
    if not isinstance(units, Mapping) or not all(isinstance(part, str) for pair in units.items() for part in pair):
        raise file.wrong("UNITS", f'UNITS is {units!r}; expected quantities and their units, such as {{"m": "kg"}}')
    if not isinstance(physical, Mapping) or set(physical) != set(parameters):
        raise file.wrong(
            "PHYSICAL",
            f"PHYSICAL is {physical!r}; expected the physical quantity of each of {', '.join(parameters) or 'none'}",
        )
    given = _symbols((), units)
    scales = file.value("scales", given)
    if not isinstance(scales, Mapping) or set(scales) != {"kg", "m", "s"}:
        found = f"a dict of {', '.join(map(repr, scales))}" if isinstance(scales, Mapping) else repr(scales)
        raise file.wrong("scales", f"scales returns {found}; expected a dict of 'kg', 'm' and 's'")


def _check_friction(file: _PartFile, found: Iterable[sp.Expr]) -> None:
    """FRICTION says whether there is a friction law in the forces."""
    from ..mechanics.oscillator import FRICTION

    rubs = any(e.has(FRICTION) for e in found)
    if rubs != file.get("FRICTION"):
        does = "a function uses" if rubs else "no function uses"
        raise file.wrong(
            "FRICTION", f"FRICTION is {not rubs}, but {does} friction(…); expected them to agree; correct one"
        )


def check_friction(module: ModuleType, where: str, text: bytes) -> None:
    """Raise ValueError if a module is no friction law."""
    file = _PartFile.checked("friction", module, where, text)
    names = file.get("PARAMETERS")
    given = _symbols(names)
    found = [file.expression("force", {**_symbols("w"), **given})]
    if file.has("static"):
        found.append(file.expression("static", given))
    file.check_use(found, {name: name for name in names})
    order = file.get("ORDER", ())
    pairs = order if isinstance(order, tuple | list) else (order,)
    if not all(isinstance(pair, tuple | list) and len(pair) == 2 and set(pair) <= set(names) for pair in pairs):
        raise file.wrong("ORDER", f'ORDER is {order!r}; expected pairs of parameters, such as (("mu_k", "mu_s"),)')


def check_coupling(module: ModuleType, where: str, text: bytes) -> None:
    """Raise ValueError if a module is no coupling."""
    file = _PartFile.checked("coupling", module, where, text)
    names = file.get("PARAMETERS")
    functions = [name for name in ("potential", "dissipation", "kinetic") if file.has(name)]
    if not functions:
        file.need("potential, dissipation or kinetic")
    between = file.get("BETWEEN")
    if between is not None and not (
        isinstance(between, tuple | list) and len(between) == 2 and all(isinstance(name, str) for name in between)
    ):
        raise file.wrong("BETWEEN", f'BETWEEN is {between!r}; expected two oscillators, such as ("clock", "beam")')
    found = []
    for name in functions:
        ends = ("q_i", "q_j") if name == "potential" else ("v_i", "v_j")
        own = _asked(file.get(name)) if between else ends
        found.append(file.expression(name, _symbols((*own, "weight", *names))))
    file.check_use(found, {name: name for name in names})
    if not any(s.name == "weight" for e in found for s in e.free_symbols):
        raise file.wrong(functions[0], f"{functions[0]} does not use weight; expected the weight of a link as a factor")


def _asked(function: Callable[..., Any]) -> tuple[str, ...]:
    return tuple(inspect.signature(function).parameters)


OSCILLATOR = PluginKind(
    "oscillator", "oscillators", check_oscillator, near={"roessler": "rossler", "vdp": "van_der_pol"}
)
"""Oscillators: the files of the folder `oscillators`."""

FRICTION_LAW = PluginKind(
    "friction",
    "frictions",
    check_friction,
    otherwise=", or an expression, friction_law('mu*sign(w)', {'mu': 0.3})",
)
"""Friction laws: the files of the folder `frictions`."""

COUPLING = PluginKind(
    "coupling",
    "couplings",
    check_coupling,
    near={"dashpot": "damper"},
    otherwise=", or components such as 'x->x'",
)
"""Couplings: the files of the folder `couplings`."""
