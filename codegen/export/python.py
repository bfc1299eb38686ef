"""The equations as a Python module for scipy.integrate.solve_ivp that needs NumPy and SciPy only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from synchain.models.dynamics.equations import Equations

from .body import (
    Syntax,
    check_inertia,
    is_unrolled,
    link_body,
    link_places,
    mass_body,
    node_body,
    node_places,
    weights,
    wrapped,
)
from .header import given_values, header
from .loops import jacobian_lines, mass_lines, rhs_lines
from .names import portable
from .printer import NUMPY

__all__ = ["to_python"]

SYNTAX = Syntax(
    NUMPY, declare="{} = {}", whole="{} = {}", assign="{} {} {}", comment="# {}", entry="matrix[{}, {}]", reads=False
)  # fmt: skip

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
    known = given_values(equations, values)
    model, changed = portable(equations)
    known = dict(zip(model.parameters, known.values(), strict=bool(known)))
    small = is_unrolled(model)
    given = _arguments(model, known)
    arguments = "".join(f", {name}={value}" if value else f", {name}" for name, value in given.items())
    after = "" if known or not given else f", args=({next(iter(given))}, …)"
    use = f'solve_ivp(rhs, (0.0, 100.0), start, method="Radau", jac=jac{after}, rtol=1e-8, atol=1e-10)'
    lines = [f"# {line}".rstrip() for line in header(equations, model, changed, known)]
    lines += ["#", f"# Use: {use}", "", *_imports(model, small), ""]
    lines += [
        f"NODES, DIMENSION = {model.n}, {model.dimension}",
        f"STATE = {_state(model)}",
        *_tables(model, small),
        "",
    ]
    check_inertia(model, "python")
    rhs = ["rates = np.empty_like(state)", *(rhs_lines(model, SYNTAX) if small else _rhs(model))]
    rhs += _solved(model, small, "rates")
    lines += _function("rhs", arguments, "Return d(state)/dt, DIMENSION numbers.", rhs)
    jac = _jac(model, small, given)
    pattern = SPARSITY if small or not model.inertial else COUPLED
    kind = "DIMENSION x DIMENSION" if small else "a sparse matrix"
    return "\n".join([*lines, *_function("jac", arguments, f"Return d(rates)/d(state), {kind}.", jac), *pattern]) + "\n"


def _imports(model: Equations, small: bool) -> list[str]:
    solver = "from numpy.linalg import solve" if small else "from scipy.sparse.linalg import spsolve as solve"
    functions = ["from scipy.sparse import csc_matrix", *([solver] if model.inertial else [])]
    return ["import numpy as np", *sorted(functions)]


def _jac(model: Equations, small: bool, given: Mapping[str, str]) -> list[str]:
    """The statements of jac."""
    if small:
        jac = [] if model.constant_mass else [f"rates = rhs({', '.join(['t', 'state', *given])})"]
        jac += ["matrix = np.zeros((DIMENSION, DIMENSION))", *jacobian_lines(model, SYNTAX)]
        return jac + _solved(model, small, "matrix")
    sparse = "csc_matrix((values, (ROWS, COLUMNS)), shape=(DIMENSION, DIMENSION))"
    return ["values = np.empty(ROWS.size)", *_jacobian(model), *_solved(model, small, "matrix", sparse)]


def _solved(model: Equations, small: bool, name: str, value: str = "") -> list[str]:
    """Statements that return M^-1 times an array, which has a name or is the value of an expression."""
    if not model.inertial:
        return [f"return {value or name}"]
    assigned = [f"{name} = {value}"] if value else []
    return [*assigned, *_masses(model, small), f"return solve(mass_, {name})"]


def _arguments(model: Equations, known: Mapping[str, float]) -> dict[str, str]:
    """The parameters that a function takes with their values; of many nodes those that differ come as one sequence."""
    if is_unrolled(model):
        return {name: repr(known[name]) if known else "" for name in model.parameters}
    own = {f"{name}_{i + 1}": name for name in model.varied for i in range(model.n)}
    names = dict.fromkeys(own.get(name, name) for name in model.parameters)
    lists = {name: repr(tuple(known[f"{name}_{i + 1}"] for i in range(model.n))) for name in model.varied if known}
    return {name: lists.get(name) or (repr(known[name]) if known else "") for name in names}


def _function(name: str, arguments: str, about: str, lines: list[str]) -> list[str]:
    """A function of time, state and parameters."""
    inner = [f'"""{about}"""', "state = np.asarray(state, dtype=float)", *lines]
    return ["", f"def {name}(t, state{arguments}):", *(f"    {line}" for line in inner), ""]


def _masses(model: Equations, small: bool) -> list[str]:
    """Statements that build M, by whose inverse the rates are M^-1 times the right-hand side."""
    if small:
        return ["mass_ = np.eye(DIMENSION)", *mass_lines(model, SYNTAX)]
    rows, columns, values = ["np.arange(DIMENSION)"], ["np.arange(DIMENSION)"], ["np.ones(DIMENSION)"]

    def store(place: Any, text: str) -> str:
        there, (r, c) = place
        rows.append(_at(r, "TARGET"))
        columns.append(_at(c, "SOURCE" if there else "TARGET"))
        values.append(f"mass_{len(values)}_")
        return f"{values[-1]} = ({text})*np.ones(len(TARGET))"

    lines = SYNTAX.body(mass_body(model), _loads(model)[1], store)
    parts = (f"np.concatenate([{', '.join(part)}])" for part in (values, rows, columns))
    return [*lines, "mass_ = csc_matrix(({}, ({}, {})), shape=(DIMENSION, DIMENSION))".format(*parts)]


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
    lines = ["NODE = np.arange(NODES)"]
    if model.links:
        ends = {"TARGET": [str(i) for i, _, _ in model.links], "SOURCE": [str(j) for _, j, _ in model.links]}
        for name, table in {**ends, "WEIGHT": weights(model)}.items():
            lines += [f"{name} = np.array([", *wrapped(table), "])"]
    here, there = link_places(model)
    rows = [_at(r, "NODE") for r, _ in node_places(model)] + [_at(r, "TARGET") for r, _ in (*here, *there)]
    columns = [_at(c, "NODE") for _, c in node_places(model)] + [_at(c, "TARGET") for _, c in here]
    columns += [_at(c, "SOURCE") for _, c in there]
    heavy = sorted({r for _, (r, _) in dict(mass_body(model).results)})
    if heavy:
        lines.append(f"HEAVY = np.concatenate([{', '.join(_at(r, 'NODE') for r in heavy)}])")
    empty = "np.zeros(0, dtype=int)"
    for name, parts in (("ROWS", rows), ("COLUMNS", columns)):
        lines.append(f"{name} = np.concatenate([{', '.join(parts)}])" if parts else f"{name} = {empty}")
    return lines


def _small_places(model: Equations) -> list[tuple[int, int]]:
    """Where jac can differ from zero: in whole rows where rates are solved for, each depends on all that its row couples."""
    heavy = {row for row, column in model.mass() if row != column}
    return sorted(set(model.jacobian()) | {(row, column) for row in heavy for column in range(model.dimension)})


def _at(component: int, index: str) -> str:
    return index if component == 0 else f"NODES + {index}" if component == 1 else f"{component}*NODES + {index}"


def _part(component: int) -> str:
    """The slice of one component of all nodes."""
    begin = "" if component == 0 else "NODES" if component == 1 else f"{component}*NODES"
    return f"{begin}:{'NODES' if component == 0 else f'{component + 1}*NODES'}"


def _loads(model: Equations) -> tuple[dict, dict]:
    """Where the states of all nodes are, and those of both ends of all links."""
    size = range(len(model.node.state))
    own = dict(zip(model.node.state, (f"state[{_part(c)}]" for c in size), strict=True))
    own |= {sp.Symbol(name, real=True): f"np.asarray({name}, dtype=float)" for name in model.varied}
    if model.edge is None or not model.links:
        return own, {}
    here = dict(zip(model.edge.here, (f"state[{_at(c, 'TARGET')}]" for c in size), strict=True))
    there = dict(zip(model.edge.there, (f"state[{_at(c, 'SOURCE')}]" for c in size), strict=True))
    mine = {sp.Symbol(name, real=True): f"np.asarray({name}, dtype=float)[TARGET]" for name in model.varied}
    return own, {**mine, **here, **there, model.edge.weight: "WEIGHT"}


def _rhs(model: Equations) -> list[str]:
    own, ends = _loads(model)
    lines = SYNTAX.body(node_body(model), own, lambda c, text: f"rates[{_part(c)}] = {text}")
    if not model.links:
        return lines
    store = "np.add.at(rates, {}, {})"
    return lines + SYNTAX.body(link_body(model), ends, lambda c, text: store.format(_at(c, "TARGET"), text))


def _jacobian(model: Equations) -> list[str]:
    own, ends = _loads(model)
    mine = list(node_places(model))

    def node(place: Any, text: str) -> str:
        return f"values[{_part(mine.index(place))}] = {text}"

    lines = SYNTAX.body(node_body(model, True), own, node)
    here, there = link_places(model)
    slots = [(False, place) for place in here] + [(True, place) for place in there]

    def link(place: Any, text: str) -> str:
        k = slots.index(place)
        return f"values[{len(mine)}*NODES + {k}*LINKS:{len(mine)}*NODES + {k + 1}*LINKS] = {text}"

    links = SYNTAX.body(link_body(model, None, True), ends, link)
    return lines + (["LINKS = len(TARGET)", *links] if slots else [])
