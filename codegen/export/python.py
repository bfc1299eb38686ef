"""Export the equations as a Python module for scipy.integrate.solve_ivp; the module needs only NumPy and SciPy."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Name, call
from ..program.printers import MATH, NUMPY
from ..program.statements import Array, Return, Statement, called, let
from .array_statements import entry_tables, jacobian_arrays, mass_arrays, rhs_arrays
from .body import is_unrolled, wrapped
from .exported_events import EventText, algorithm_in_lists, has_events, tables
from .header import Exported
from .loops import jacobian_statements, mass_statements, rhs_statements

SPARSITY = '''
def sparsity():
    """Return a sparse matrix of ones where jac can differ from zero."""
    matrix = csc_matrix((np.ones(len(ROWS)), (ROWS, COLUMNS)), shape=(DIMENSION, DIMENSION))
    matrix.data[:] = 1.0
    return matrix'''

COUPLED = '''
def sparsity():
    """Return a sparse matrix of ones where jac can differ from zero: all of the rows that inertia couples."""
    rows = np.concatenate([ROWS, np.repeat(HEAVY, DIMENSION)])
    columns = np.concatenate([COLUMNS, np.tile(np.arange(DIMENSION), len(HEAVY))])
    matrix = csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(DIMENSION, DIMENSION))
    matrix.data[:] = 1.0
    return matrix'''

SLOPES = '''

def slopes(t, state, numbers, rates):
    """Write d(state)/dt."""
    with np.errstate(all="ignore"):  # of a step that is too long
        rates[:] = rhs(t, state, *numbers).tolist()

'''


def to_python(equations: Equations, values: Mapping[str, float] | None = None) -> str:
    """Return a module with rhs(t, state, …), jac(t, state, …) and sparsity() for scipy.integrate.solve_ivp.

    The parameters follow the state, in the order of Equations.parameters; `values` (name -> number) become their
    defaults.  Networks of up to eight nodes are written out, and jac returns a dense matrix.  Larger networks become
    array operations, and jac returns a sparse matrix.  With events, modules that are written out also have `begin` and
    `run`, which move a state through all events.  Raises ValueError for functions that NumPy lacks and for unknown or
    missing values.

    See Also
    --------
    synchain.export.to_c
    synchain.export.to_numba
    synchain.kernel

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("harmonic")
    >>> module = {}
    >>> exec(sc.export.to_python(scene.equations, scene.parameters), module)
    >>> module["rhs"](0.0, [1.0, 0.0])
    array([ 0., -1.])
    """
    exported = Exported.of(equations, values, "python")
    model, numbers, small = exported.model, exported.numbers, is_unrolled(exported.model)
    defaults = _defaults(model, numbers)
    arguments = "".join(f", {name}={value}" if value else f", {name}" for name, value in defaults.items())

    rhs: list[Statement] = [let("rates", call("np.empty_like", "state"))]
    rhs += rhs_statements(model, reads=False) if small else rhs_arrays(model)
    if small:
        # if M depends on the state, the Jacobian depends on the rates
        jac: list[Statement] = [] if model.constant_mass else [let("rates", call("rhs", "t", "state", *defaults))]
        jac += [let("matrix", call("np.zeros", "(DIMENSION, DIMENSION)")), *jacobian_statements(model, reads=False)]
    else:
        jac = [Array("values", Name("ROWS.size")), *jacobian_arrays(model)]
    # the Jacobian of many nodes is a sparse matrix; if M is not the identity, rhs and jac solve with M
    sparse = call("csc_matrix", "(values, (ROWS, COLUMNS))", "shape=(DIMENSION, DIMENSION)")
    if model.inertial:
        masses = mass_statements(model, reads=False) if small else mass_arrays(model)
        rhs += [*masses, Return((call("solve", "mass_", "rates"),))]
        jac += [*([] if small else [let("matrix", sparse)]), *masses, Return((call("solve", "mass_", "matrix"),))]
    else:
        rhs.append(Return((Name("rates"),)))
        jac.append(Return((Name("matrix") if small else sparse,)))

    # head, imports, tables, functions
    after = "" if numbers or not defaults else f", args=({next(iter(defaults))}, …)"
    use = f'solve_ivp(rhs, (0.0, 100.0), start, method="Radau", jac=jac{after}, rtol=1e-8, atol=1e-10)'
    solver = "from numpy.linalg import solve" if small else "from scipy.sparse.linalg import spsolve as solve"
    imports = ["from scipy.sparse import csc_matrix", *([solver] if model.inertial else [])]
    imports += ["from scipy.special import erf"] if "erf" in called([*rhs, *jac]) else []
    state = repr(list(model.state))
    if not small:
        state = f'[f"{{name}}_{{i + 1}}" for name in {[s.name for s in model.node.state]!r} for i in range(NODES)]'
    events = EventText(model) if has_events(model) else None
    kind = "DIMENSION x DIMENSION" if small else "a sparse matrix"
    lines = [
        *(f"# {line}".rstrip() for line in exported.head),
        *(
            "#",
            f"# Use: {use}",
            *(f"# {line}" for line in (events.use() if events else [])),
            "",
            "import numpy as np",
            *sorted(imports),
            "",
        ),
        f"NODES, DIMENSION = {model.n}, {model.dimension}",
        f"STATE = {state}",
        *(_dense_places(model) if small else entry_tables(model)),
        "",
        *_function("rhs", arguments, "Return d(state)/dt, DIMENSION numbers.", rhs),
        *_function("jac", arguments, f"Return d(rates)/d(state), {kind}.", jac),
        SPARSITY if small or not model.inertial else COUPLED,
        *(_events(events, numbers) if events else []),
    ]
    return "\n".join(lines) + "\n"


def _events(events: EventText, numbers: Mapping[str, float]) -> list[str]:
    """Return the lines of a run through events."""
    lines = ["", "", "# events", "import math", ""]
    lines += [f"{name} = {value}" for name, value in events.sizes().items()]
    lines += (
        ["NUMBERS = [", *wrapped(map(repr, numbers.values())), "]"] if numbers or not events.model.parameters else []
    )
    lines += [line for name, table in tables().items() for line in (f"{name} = [", *table, "]")]
    about = {"pushes": "Write the numbers of all rows.", "strike": "Change a state at an event."}
    for name, body in (("pushes", events.pushes()), ("strike", events.strike())):
        lines += ["", "", f"def {name}(t, state, numbers, rows_):", f'    """{about[name]}"""']
        lines += [f"    {line}" for line in MATH.lines(body)]
    return [*lines, *SLOPES.splitlines(), "", algorithm_in_lists()]


def _defaults(model: Equations, numbers: Mapping[str, float]) -> dict[str, str]:
    """Return the parameters that a function takes, each with its value, "" without values."""
    # In a large network, a parameter that differs between nodes or links is one sequence.
    if is_unrolled(model):
        return {name: repr(numbers[name]) if numbers else "" for name in model.parameters}
    sequences = {name: [f"{name}_{i + 1}" for i in range(model.n)] for name in model.varied}
    sequences |= {name: list(layer.names(name)) for name, layer in model.numbered.items()}
    sequence_of = {element: name for name, elements in sequences.items() for element in elements}
    names = dict.fromkeys(sequence_of.get(name, name) for name in model.parameters)
    if not numbers:
        return dict.fromkeys(names, "")
    values = {name: repr(tuple(numbers[element] for element in elements)) for name, elements in sequences.items()}
    return {name: values.get(name) or repr(numbers[name]) for name in names}


def _function(name: str, arguments: str, docstring: str, body: list[Statement]) -> list[str]:
    inner = [f'"""{docstring}"""', "state = np.asarray(state, dtype=float)", *NUMPY.lines(body)]
    return ["", f"def {name}(t, state{arguments}):", *(f"    {line}" for line in inner), ""]


def _dense_places(model: Equations) -> list[str]:
    """Return lines with the rows and columns of the entries of jac that can differ from zero."""
    # In the rows that M couples, all entries count: solving with M makes each of these rates depend on all of their
    # terms.
    heavy = {row for (row, column), e in model.mass().items() if e != sp.Integer(row == column)}
    places = sorted(set(model.jacobian()) | {(row, column) for row in heavy for column in range(model.dimension)})
    if not places:
        return ["ROWS = []", "COLUMNS = []"]
    rows, columns = ([str(place[k]) for place in places] for k in (0, 1))
    return ["ROWS = [", *wrapped(rows), "]", "COLUMNS = [", *wrapped(columns), "]"]
