"""The equations as a C99 source file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Name, Number, call
from ..program.printers import C99
from ..program.statements import Array, Do, Statement, called, mentioned
from .body import is_unrolled, link_jacobian, link_tables, node_jacobian, weights, wrapped
from .c_functions import in_c
from .exported_events import EventText, algorithm, has_events, tables
from .header import Exported
from .loops import jacobian_statements, mass_statements, rhs_statements

ARGUMENTS = "double t, const double *state, const double *numbers, double *"
SIGN = ["static double sign(double x)", "{", "    return (double)((x > 0.0) - (x < 0.0));", "}", ""]


# C text that solves a dense system of DIMENSION equations in place, for several right-hand sides.
SOLVE = """static void solve(double *mass, double *right, int columns)
{
    for (int k = 0; k < DIMENSION; k++) { /* Gaussian elimination with row exchanges */
        int pivot = k;
        for (int i = k + 1; i < DIMENSION; i++)
            if (fabs(mass[i*DIMENSION + k]) > fabs(mass[pivot*DIMENSION + k])) pivot = i;
        for (int j = 0; j < DIMENSION; j++) {
            const double old = mass[k*DIMENSION + j];
            mass[k*DIMENSION + j] = mass[pivot*DIMENSION + j];
            mass[pivot*DIMENSION + j] = old;
        }
        for (int j = 0; j < columns; j++) {
            const double old = right[k*columns + j];
            right[k*columns + j] = right[pivot*columns + j];
            right[pivot*columns + j] = old;
        }
        for (int i = k + 1; i < DIMENSION; i++) {
            const double factor = mass[i*DIMENSION + k]/mass[k*DIMENSION + k];
            for (int j = k; j < DIMENSION; j++) mass[i*DIMENSION + j] -= factor*mass[k*DIMENSION + j];
            for (int j = 0; j < columns; j++) right[i*columns + j] -= factor*right[k*columns + j];
        }
    }
    for (int k = DIMENSION - 1; k >= 0; k--)
        for (int j = 0; j < columns; j++) {
            for (int i = k + 1; i < DIMENSION; i++) right[k*columns + j] -= mass[k*DIMENSION + i]*right[i*columns + j];
            right[k*columns + j] /= mass[k*DIMENSION + k];
        }
}
"""

USE = """
rhs writes d(state)/dt to rates; state and rates have DIMENSION numbers, numbers has PARAMETERS."""

DENSE = """
jacobian writes d(rates)/d(state) to matrix, row by row, DIMENSION*DIMENSION numbers."""

SPARSE = """
jacobian writes the ENTRIES entries of d(rates)/d(state) to values; jacobian_places writes their rows and
columns (from 0).  Entries at one place add up, as in the coordinate format of sparse matrices."""


def to_c(equations: Equations, values: Mapping[str, float] | None = None) -> str:
    """Return a C99 source with `rhs` and `jacobian`.

    Networks of up to eight nodes are written out; larger networks become loops.  `values` (name -> number) become the
    defaults of PARAMETERS.  With events, texts that are written out also have `begin` and `run`, which move a state through
    all events.  Raises ValueError for functions that C99 lacks and for unknown or missing values.

    See Also
    --------
    synchain.export.to_python
    synchain.export.to_numba

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("harmonic")
    >>> "void rhs(" in sc.export.to_c(scene.equations, scene.parameters)
    True
    """
    exported = Exported.of(equations, values, "c")
    model, numbers, small = exported.model, exported.numbers, is_unrolled(exported.model)

    # if M is not the identity, rhs and jacobian solve with M at the end
    masses = mass_statements(model) if model.inertial else []
    rhs = rhs_statements(model)
    jacobian = jacobian_statements(model)
    if small:
        rates: list[Statement] = [Array("rates", Name("DIMENSION")), Do(call("rhs", "t", "state", "numbers", "rates"))]
        cleared = Do(call("memset", "matrix", 0, Name("sizeof(double)") * "DIMENSION" * "DIMENSION"))
        jacobian = [*([] if model.constant_mass else rates), cleared, *jacobian]
    if model.inertial:
        rhs += [*masses, Do(call("solve", "mass_", "rates", Number(1)))]
        jacobian += [*masses, Do(call("solve", "mass_", "matrix", Name("DIMENSION")))]

    events = EventText(model) if has_events(model) else None
    pushes, strike = (events.pushes(), events.strike()) if events else ([], [])
    usage = (USE + (DENSE if small else SPARSE)).splitlines() + (["", *events.use()] if events else [])
    lines = ["/*", *(f" * {line}".rstrip() for line in (*map(_safe, exported.head), *usage)), " */", ""]
    lines += ["#include <math.h>", *(["#include <string.h>"] if small else []), ""]
    lines += _sizes(model, small)
    if numbers:
        lines += ["/* values of the scene, in the order of `numbers` */"]
        lines += ["const double defaults[PARAMETERS] = {", *wrapped(map(repr, numbers.values())), "};", ""]
    lines += [*SOLVE.splitlines(), ""] if model.inertial else []
    lines += SIGN if "sign" in called([*rhs, *jacobian, *pushes, *strike]) else []
    lines += [*_function(f"void rhs({ARGUMENTS}rates)", rhs), ""]
    lines += _function(f"void jacobian({ARGUMENTS}{'matrix' if small else 'values'})", jacobian)
    lines += [] if small else ["", *_places(model)]
    if events:
        sizes = ", ".join(f"{name} = {value}" for name, value in events.sizes().items())
        lines += ["", "/* events */", f"enum {{ {sizes} }};"]
        for name, table in tables().items():
            lines += [f"static const double {name}[] = {{", *table, "};"]
        lines += ["", *_function(f"static void pushes({ARGUMENTS}rows_)", pushes)]
        lines += [
            "",
            *_function(f"static void strike({ARGUMENTS.replace('const double *state', 'double *state')}rows_)", strike),
        ]
        lines += ["", *in_c(algorithm(), ["DIMENSION", *events.sizes()])]
    return "\n".join(lines) + "\n"


def _safe(line: str) -> str:
    """Return text without the characters that would end the comment around it."""
    return line.replace("\\", "/").replace("*/", "* /").replace("/*", "/ *")


def _sizes(model: Equations, small: bool) -> list[str]:
    """Return the lines of the sizes and, for many nodes, of the tables of the links."""
    sizes = {"NODES": model.n, "DIMENSION": model.dimension, "PARAMETERS": len(model.parameters)}
    if not small:
        links = len(model.links)
        sizes |= {"LINKS": links, "ENTRIES": len(node_jacobian(model)) * model.n + len(link_jacobian(model)) * links}
    lines = [f"enum {{ {', '.join(f'{name} = {value}' for name, value in sizes.items())} }};", ""]
    if small or not model.links:
        return lines
    for name, table in link_tables(model).items():
        lines += [f"static const int {name}[LINKS] = {{", *wrapped(table), "};"]
    if any(e.has(edge.weight) for edge in model.edges for e in edge.rhs):
        lines += ["static const double WEIGHT[LINKS] = {", *wrapped(weights(model)), "};"]
    return [*lines, ""]


def _function(head: str, body: Sequence[Statement]) -> list[str]:
    """Return the lines of a C function; mention unused arguments, so that compilers do not warn."""
    arguments = re.findall(r"(\w+)[,)]", head)
    unused = [f"(void){name};" for name in arguments if name not in mentioned(body)]
    return [head, "{", *(f"    {line}" for line in (*unused, *C99.lines(body))), "}"]


def _places(model: Equations) -> list[str]:
    """Return the C function that writes the rows and columns of the Jacobian's entries, for many nodes."""
    loops = [("i", "NODES", f"{e.row}*NODES + i", f"{e.column}*NODES + i") for e in node_jacobian(model)]
    for e in link_jacobian(model):
        end = "SOURCE" if e.source else "TARGET"
        loops.append(("link", "LINKS", f"{e.row}*NODES + TARGET[link]", f"{e.column}*NODES + {end}[link]"))
    lines = ["int k = 0;"] if loops else ["(void)rows;", "(void)columns;"]
    for i, end, row, column in loops:
        lines.append(f"for (int {i} = 0; {i} < {end}; {i}++) {{ rows[k] = {row}; columns[k++] = {column}; }}")
    return ["void jacobian_places(int *rows, int *columns)", "{", *(f"    {line}" for line in lines), "}"]
