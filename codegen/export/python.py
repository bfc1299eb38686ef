"""The equations as a Python module for scipy.integrate.solve_ivp that needs NumPy and SciPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Any

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Expression, Load, Name, Number, Product, Slice, call, plus
from ..program.passes import real
from ..program.printers import NUMPY
from ..program.statements import Array, Do, Return, Statement, Store, called, let, whole
from .body import (
    array_tables,
    is_unrolled,
    link_body,
    link_places,
    mass_body,
    node_body,
    node_places,
    wrapped,
)
from .header import Exported
from .loops import jacobian_statements, mass_statements, place_of, rhs_statements

SPARSITY = [
    "",
    "def sparsity():",
    '    """Return a sparse matrix of ones where jac can differ from zero."""',
    "    matrix = csc_matrix((np.ones(len(ROWS)), (ROWS, COLUMNS)), shape=(DIMENSION, DIMENSION))",
    "    matrix.data[:] = 1.0",
    "    return matrix",
]


COUPLED = [
    "",
    "def sparsity():",
    '    """Return a sparse matrix of ones where jac can differ from zero: all of the rows that inertia couples."""',
    "    rows = np.concatenate([ROWS, np.repeat(HEAVY, DIMENSION)])",
    "    columns = np.concatenate([COLUMNS, np.tile(np.arange(DIMENSION), len(HEAVY))])",
    "    matrix = csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(DIMENSION, DIMENSION))",
    "    matrix.data[:] = 1.0",
    "    return matrix",
]


def to_python(equations: Equations, values: Mapping[str, float] | None = None) -> str:
    """Return a module with rhs(t, state, …), jac(t, state, …) and sparsity() for scipy.integrate.solve_ivp.

    The parameters follow the state, in the order of Equations.parameters; `values` (name -> number) become their defaults.
    Up to eight nodes are written out and jac is dense; more are array operations and jac is a sparse matrix.  Raises
    ValueError for functions that NumPy lacks and for unknown or missing values.
    """
    exported = Exported.of(equations, values, "python")
    model, known, small = exported.model, exported.numbers, is_unrolled(exported.model)
    given = _arguments(model, known)
    arguments = "".join(f", {name}={value}" if value else f", {name}" for name, value in given.items())
    after = "" if known or not given else f", args=({next(iter(given))}, …)"
    use = f'solve_ivp(rhs, (0.0, 100.0), start, method="Radau", jac=jac{after}, rtol=1e-8, atol=1e-10)'
    rhs: list[Statement] = [let("rates", call("np.empty_like", "state"))]
    rhs += rhs_statements(model, reads=False) if small else _rhs(model)
    rhs += _solved(model, small, Name("rates"))
    jac = _jac(model, small, given)
    pattern = SPARSITY if small or not model.inertial else COUPLED
    kind = "DIMENSION x DIMENSION" if small else "a sparse matrix"
    lines = [f"# {line}".rstrip() for line in exported.head]
    lines += ["#", f"# Use: {use}", "", *_imports(model, small, called([*rhs, *jac])), ""]
    lines += [
        f"NODES, DIMENSION = {model.n}, {model.dimension}",
        f"STATE = {_state(model)}",
        *_tables(model, small),
        "",
    ]
    lines += _function("rhs", arguments, "Return d(state)/dt, DIMENSION numbers.", rhs)
    return "\n".join([*lines, *_function("jac", arguments, f"Return d(rates)/d(state), {kind}.", jac), *pattern]) + "\n"


def _imports(model: Equations, small: bool, functions: Set[str]) -> list[str]:
    solver = "from numpy.linalg import solve" if small else "from scipy.sparse.linalg import spsolve as solve"
    lines = ["from scipy.sparse import csc_matrix", *([solver] if model.inertial else [])]
    lines += ["from scipy.special import erf"] if "erf" in functions else []
    return ["import numpy as np", *sorted(lines)]


def _jac(model: Equations, small: bool, given: Mapping[str, str]) -> list[Statement]:
    """The statements of jac."""
    if small:
        found: list[Statement] = [] if model.constant_mass else [let("rates", call("rhs", "t", "state", *given))]
        found += [let("matrix", call("np.zeros", "(DIMENSION, DIMENSION)"))]
        return [*found, *jacobian_statements(model, reads=False), *_solved(model, small, Name("matrix"))]
    sparse = call("csc_matrix", "(values, (ROWS, COLUMNS))", "shape=(DIMENSION, DIMENSION)")
    return [Array("values", Name("ROWS.size")), *_jacobian(model), *_solved(model, small, sparse)]


def _solved(model: Equations, small: bool, value: Expression) -> list[Statement]:
    """Statements that return M^-1 times an array, which has a name or is a sparse matrix of that."""
    if not model.inertial:
        return [Return((value,))]
    assigned = [] if isinstance(value, Name) else [let("matrix", value)]
    name = value if isinstance(value, Name) else Name("matrix")
    return [*assigned, *_masses(model, small), Return((call("solve", "mass_", name),))]


def _arguments(model: Equations, known: Mapping[str, float]) -> dict[str, str]:
    """The parameters that a function takes with their values.

    Of many nodes, and of their links, those that differ come as one sequence.
    """
    if is_unrolled(model):
        return {name: repr(known[name]) if known else "" for name in model.parameters}
    single = {name: [f"{name}_{i + 1}" for i in range(model.n)] for name in model.varied}
    single |= {name: list(layer.names(name)) for name, layer in model.numbered.items()}
    own = {one: name for name, ones in single.items() for one in ones}
    names = dict.fromkeys(own.get(name, name) for name in model.parameters)
    lists = {name: repr(tuple(known[one] for one in ones)) for name, ones in single.items() if known}
    return {name: lists.get(name) or (repr(known[name]) if known else "") for name in names}


def _function(name: str, arguments: str, about: str, body: list[Statement]) -> list[str]:
    """A function of time, state and parameters."""
    inner = [f'"""{about}"""', "state = np.asarray(state, dtype=float)", *NUMPY.lines(body)]
    return ["", f"def {name}(t, state{arguments}):", *(f"    {line}" for line in inner), ""]


def _masses(model: Equations, small: bool) -> list[Statement]:
    """Statements that build M, by whose inverse the rates are M^-1 times the right-hand side."""
    if small:
        return mass_statements(model, reads=False)
    every = call("np.arange", "DIMENSION")
    rows: list[Expression] = [every]
    columns: list[Expression] = [every]
    values: list[Expression] = [call("np.ones", "DIMENSION")]

    def storing(place: Any, value: Expression) -> Statement:
        there, (r, c) = place
        rows.append(_at(r, "TARGET"))
        columns.append(_at(c, "SOURCE" if there else "TARGET"))
        name = f"mass_{len(values)}_"
        values.append(Name(name))
        return let(name, Product((value, call("np.ones", call("len", "TARGET")))))

    body = mass_body(model).statements(_loads(model)[1], storing)
    entries, row, column = (NUMPY.text(_joined(part)) for part in (values, rows, columns))
    made = call("csc_matrix", f"({entries}, ({row}, {column}))", "shape=(DIMENSION, DIMENSION)")
    return [*body, let("mass_", made)]


def _joined(parts: Sequence[Expression]) -> Expression:
    """Arrays behind each other."""
    return call("np.concatenate", f"[{', '.join(map(NUMPY.text, parts))}]")


def _state(model: Equations) -> str:
    """The names of the states: a list, or for many nodes the expression that makes it."""
    if is_unrolled(model):
        return repr(list(model.state))
    names = [s.name for s in model.node.state]
    return f'[f"{{name}}_{{i + 1}}" for name in {names!r} for i in range(NODES)]'


def _tables(model: Equations, small: bool) -> list[str]:
    """Links, and the places of the entries of the Jacobian: entries at one place add up."""
    if small:
        places = _small_places(model)
        lines = ["ROWS = [", *wrapped(str(r) for r, _ in places), "]"] if places else ["ROWS = []"]
        return lines + (["COLUMNS = [", *wrapped(str(c) for _, c in places), "]"] if places else ["COLUMNS = []"])
    lines = ["NODE = np.arange(NODES)", *array_tables(model)]
    own, links = node_places(model), link_places(model)
    rows = [_at(r, "NODE") for r, _ in own] + [_at(r, "TARGET") for _, (r, _) in links]
    columns = [_at(c, "NODE") for _, c in own]
    columns += [_at(c, "SOURCE" if there else "TARGET") for there, (_, c) in links]
    heavy = sorted({r for _, (r, _) in dict(mass_body(model).results)})
    if heavy:
        lines += NUMPY.lines([let("HEAVY", _joined([_at(r, "NODE") for r in heavy]))])
    empty = call("np.zeros", 0, "dtype=int")
    tables = (("ROWS", rows), ("COLUMNS", columns))
    return lines + NUMPY.lines(let(name, _joined(parts) if parts else empty) for name, parts in tables)


def _small_places(model: Equations) -> list[tuple[int, int]]:
    """Where jac can differ from zero: in whole rows where rates are solved for, each depends on all that its row couples."""
    heavy = {row for (row, column), e in model.mass().items() if e != sp.Integer(row == column)}
    return sorted(set(model.jacobian()) | {(row, column) for row in heavy for column in range(model.dimension)})


def _at(component: int, index: str) -> Expression:
    return place_of(component, "NODES", index)


def _part(block: int, size: str = "NODES", first: Expression | None = None) -> Slice:
    """One of several blocks of an array, behind a first part."""

    def end(k: int) -> Expression:
        if first is None:
            return Name(size) if k == 1 else k * Name(size)
        return plus(first, k * Name(size))

    return Slice(Number(0) if block == 0 and first is None else end(block), end(block + 1))


def _loads(model: Equations) -> tuple[dict[sp.Symbol, Expression], dict[sp.Symbol, Expression]]:
    """Where the states of all nodes are, and those of both ends of all links."""

    def state(index: Expression) -> Load:
        return Load("state", index, None)

    varied = {real(name): f"np.asarray({name}, dtype=float)" for name in model.varied}
    own: dict[sp.Symbol, Expression] = {s: state(_part(c)) for c, s in enumerate(model.node.state)}
    own |= {s: Name(text) for s, text in varied.items()}
    if model.edge is None or not model.links:
        return own, {}
    ends: dict[sp.Symbol, Expression] = {s: Load(text, Name("TARGET"), None) for s, text in varied.items()}
    for name in model.numbered:
        ends[real(name)] = Load(f"np.asarray({name}, dtype=float)", Name("NUMBER"), None)
    for index, states in (("TARGET", model.edge.here), ("SOURCE", model.edge.there)):
        ends |= {s: state(_at(c, index)) for c, s in enumerate(states)}
    return own, ends | {model.edge.weight: Name("WEIGHT")}


def _rhs(model: Equations) -> list[Statement]:
    own, ends = _loads(model)
    found = node_body(model).statements(own, lambda c, value: Store("rates", _part(c), value))
    if not model.links:
        return found

    def adding(c: int, value: Expression) -> Statement:
        return Do(call("np.add.at", "rates", _at(c, "TARGET"), value))

    return found + link_body(model).statements(ends, adding)


def _jacobian(model: Equations) -> list[Statement]:
    own, ends = _loads(model)
    mine = list(node_places(model))
    found = node_body(model, True).statements(own, lambda place, e: Store("values", _part(mine.index(place)), e))
    slots = list(link_places(model))
    if not slots:
        return found
    behind = len(mine) * Name("NODES")

    def link(place: Any, value: Expression) -> Statement:
        return Store("values", _part(slots.index(place), "LINKS", behind), value)

    counted = whole("LINKS", call("len", "TARGET"))
    return [*found, counted, *link_body(model, None, True).statements(ends, link)]
