"""What a plug-in file from outside may and must define, and that all of it takes effect: checked when the file is loaded.

A name that its kind does not know, a definition that another one makes idle and a parameter that no function uses are
refused, since the model would be another than the one that was meant.
"""

from __future__ import annotations

import ast
import difflib
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..graphs.families import defaults
from ..inputs.plugins import call
from .parameter import Parameter

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["KNOWN", "check"]

_PHYSICAL = ("scales", "UNITS")
_LAGRANGIAN = ("kinetic", "potential", "force", "dissipation", "particles", "COORDINATES", "PHYSICAL", *_PHYSICAL)

KNOWN = {
    "oscillator": ("SUMMARY", "SOURCE", "FRICTION", "PARAMETERS", "STATE", "INITIAL", "field", *_LAGRANGIAN),
    "friction": ("SUMMARY", "SOURCE", "ODD", "PARAMETERS", "ORDER", "SELF_EXCITING", "force", "static"),
    "coupling": ("SUMMARY", "SOURCE", "PARAMETERS", "BETWEEN", "kinetic", "potential", "dissipation"),
    "topology": (
        *("SUMMARY", "SOURCE", "MINIMUM", "TOO_SMALL", "DIRECTED", "CONNECTED"),
        *("edges", "settle", "count", "expected", "spectrum", "formula", "sides"),
    ),
}
"""The public names that a file of each kind may define; imports and names with an underscore in front are its own."""

_NEEDED = {
    "oscillator": ("PARAMETERS", "FRICTION"),
    "friction": ("PARAMETERS", "force"),
    "coupling": ("PARAMETERS",),
    "topology": ("SUMMARY", "MINIMUM", "edges"),
}
_FLAGS = ("FRICTION", "ODD", "SELF_EXCITING", "DIRECTED", "CONNECTED")
_TEXTS = ("SUMMARY", "SOURCE", "TOO_SMALL")


def check(kind: str, module: ModuleType, where: str, text: bytes) -> None:
    """Raise ValueError where a module is not what its kind must be; `text` is what its file holds, `where` names it."""
    file = _File(kind, module, where, dict(_defined(text)))
    file.check_names()
    file.check_values()
    {"oscillator": _oscillator, "friction": _friction, "coupling": _coupling, "topology": _topology}[kind](file)


@dataclass(frozen=True, slots=True)
class _File:
    """A plug-in file: its module, its name in messages and the line of each public name that it defines."""

    kind: str
    module: ModuleType
    where: str
    lines: Mapping[str, int]

    def has(self, name: str) -> bool:
        return hasattr(self.module, name)

    def get(self, name: str, otherwise: Any = None) -> Any:
        return getattr(self.module, name, otherwise)

    def wrong(self, name: str, words: str) -> ValueError:
        """An error at the definition of a name."""
        place = f"{self.where}, line {self.lines[name]}" if name in self.lines else self.where
        return ValueError(f"{place}: {words}")

    def need(self, *names: str) -> None:
        """Raise where one of these names is not defined; a name that is close to it may be a slip of the pen."""
        missing = [name for name in names if not self.has(name)]
        if missing:
            own = [name for name in self.lines if name not in KNOWN[self.kind]]
            close = next((near for name in missing for near in difflib.get_close_matches(name, own, 1)), None)
            hint = f"; found {close!r} in line {self.lines[close]}: is that it?" if close else ""
            raise ValueError(
                f"{self.where}: found no {', no '.join(missing)}; expected {_kind(self.kind)} file{hint}; "
                f"see: synchain new {self.kind} NAME"
            )

    def idle(self, names: Iterable[str], reason: str) -> None:
        """Raise where one of these names is defined: nothing would look at it."""
        for name in names:
            if self.has(name):
                raise self.wrong(name, f"found {name} {reason}; it would be ignored; leave one out")

    def check_names(self) -> None:
        """Refuse what is missing, and public names that a file of this kind does not know."""
        self.need(*_NEEDED[self.kind])
        known = KNOWN[self.kind]
        for name in self.lines:
            if name not in known:
                close = difflib.get_close_matches(name, known, 1)
                hint = f"did you mean {close[0]!r}?" if close else f"call what is your own _{name}"
                raise self.wrong(name, f"found {name!r}; {_kind(self.kind)} file knows {', '.join(known)}; {hint}")

    def check_values(self) -> None:
        """Refuse wrong types of what all kinds have."""
        for name in known_of(self.module, KNOWN[self.kind]):
            value = self.get(name)
            if name in _FLAGS and not isinstance(value, bool):
                raise self.wrong(name, f"{name} is {value!r}; expected True or False")
            if name in _TEXTS and not isinstance(value, str):
                raise self.wrong(name, f"{name} is {value!r}; expected text in quotation marks")
            if name.islower() and not callable(value):
                raise self.wrong(name, f"{name} is {value!r}; expected a function: def {name}(…)")
        if self.kind != "topology":
            self._check_parameters()

    def _check_parameters(self) -> None:
        table = self.get("PARAMETERS")
        if not isinstance(table, Mapping):
            raise self.wrong("PARAMETERS", f"PARAMETERS is {table!r}; expected a dict of names and Parameters")
        for name, parameter in table.items():
            if not (isinstance(name, str) and name.isidentifier()):
                raise self.wrong("PARAMETERS", f"PARAMETERS has the key {name!r}; expected a name such as 'delta'")
            if not isinstance(parameter, Parameter):
                like = f'Parameter({parameter!r}, "1", "what it means")'
                raise self.wrong("PARAMETERS", f"PARAMETERS[{name!r}] is {parameter!r}; expected {like}")

    def value(self, name: str, given: Mapping[str, Any]) -> Any:
        """What a function returns for symbols."""
        return call(self.get(name), given)

    def expression(self, name: str, given: Mapping[str, Any]) -> sp.Expr:
        """What a function returns for symbols, one expression."""
        return self.as_expression(name, self.value(name, given))

    def as_expression(self, name: str, value: Any) -> sp.Expr:
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


def _kind(kind: str) -> str:
    return f"an {kind}" if kind == "oscillator" else f"a {kind}"


def known_of(module: ModuleType, names: Iterable[str]) -> Iterator[str]:
    """Those of some names that a module has."""
    return (name for name in names if hasattr(module, name))


def _defined(text: bytes) -> Iterator[tuple[str, int]]:
    """The public names that the text of a module defines at its top level, with their lines; imports are none."""
    found: list[ast.AST] = [ast.parse(text)]
    while found:
        node = found.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names = [node.name]
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names = [node.id]
        elif isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp | ast.Lambda):
            continue
        else:
            found += reversed(list(ast.iter_child_nodes(node)))
            continue
        yield from ((name, node.lineno) for name in names if not name.startswith("_"))


def _symbols(names: Iterable[str], positive: Iterable[str] = ()) -> dict[str, sp.Symbol]:
    import sympy as sp

    return {
        **{name: sp.Symbol(name, positive=True) for name in positive},
        **{name: sp.Symbol(name, real=True) for name in names},
    }


def _oscillator(file: _File) -> None:
    """A vector field or a Lagrangian, not both; a Lagrangian with units has all that its scaling needs."""
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


def _field(file: _File) -> tuple[list[sp.Expr], tuple[str, ...]]:
    """The rates of a vector field and the names of its states."""
    from .components import TIME

    state = file.get("STATE")
    if not isinstance(state, tuple | list) or not all(isinstance(s, str) and s.isidentifier() for s in state):
        raise file.wrong("STATE", f'STATE is {state!r}; expected a tuple of names such as ("x", "y")')
    given = _symbols((*file.get("PARAMETERS"), *state)) | {TIME.name: TIME}
    return file.expressions("field", file.value("field", given), tuple(state)), tuple(state)


def _lagrangian(file: _File) -> tuple[list[sp.Expr], tuple[str, ...]]:
    """All that the functions of a Lagrangian return, and the names of its states."""
    from .nondimensional import coordinates, physical_symbols

    found = file.get("COORDINATES", {"x": ("v", "m")})
    for name, pair in found.items() if isinstance(found, Mapping) else [(found, None)]:
        if not (isinstance(pair, tuple) and len(pair) == 2 and all(isinstance(part, str) for part in (name, *pair))):
            raise file.wrong(
                "COORDINATES",
                f'COORDINATES has {name!r}: {pair!r}; expected a velocity and a unit each, such as {{"x": ("v", "m")}}',
            )
    given = physical_symbols(file.module)
    values = [file.expression(name, given) for name in ("kinetic", "potential")]
    if file.has("force"):
        force = file.value("force", given)
        one = len(found) == 1 and not isinstance(force, tuple | list)
        values += file.expressions("force", (force,) if one else force, tuple(found))
    if file.has("dissipation"):
        values.append(file.expression("dissipation", given))
    own = coordinates(file.module)
    return values, (*own, *(speed for speed, _ in own.values()))


def _check_units(file: _File) -> None:
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


def _check_friction(file: _File, found: Iterable[sp.Expr]) -> None:
    """FRICTION says whether there is a friction law in the forces."""
    from .nondimensional import FRICTION

    rubs = any(e.has(FRICTION) for e in found)
    if rubs != file.get("FRICTION"):
        does = "a function uses" if rubs else "no function uses"
        raise file.wrong(
            "FRICTION", f"FRICTION is {not rubs}, but {does} friction(…); expected them to agree; correct one"
        )


def _friction(file: _File) -> None:
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


def _coupling(file: _File) -> None:
    names = file.get("PARAMETERS")
    if "sigma" not in names:
        raise file.wrong("PARAMETERS", "PARAMETERS has no 'sigma'; expected the strength of the coupling by that name")
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


def _topology(file: _File) -> None:
    least = file.get("MINIMUM")
    if isinstance(least, bool) or not isinstance(least, int):
        raise file.wrong("MINIMUM", f"MINIMUM is {least!r}; expected the smallest number of nodes, a whole number")
    options = defaults(file.module)
    for name, value in options.items():
        if value is inspect.Parameter.empty:
            raise file.wrong("edges", f"the option {name!r} of edges has no default; expected one, such as {name}=1")
    if not options:
        file.idle(("settle",), "without options, which are keyword-only parameters of edges")
        return
    file.need("settle")
    for function in known_of(file.module, ("settle", "count", "expected", "spectrum")):
        missing = [name for name in options if name not in _asked(file.get(function))]
        if missing:
            raise file.wrong(function, f"{function} lacks the option {missing[0]!r} of edges; expected the same ones")
