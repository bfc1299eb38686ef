"""The equations as a C99 source file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Expression, Name, Number, call
from ..program.printers import C99
from ..program.statements import Array, Do, Statement, called, mentioned
from .body import is_unrolled, link_places, link_tables, node_places, weights, wrapped
from .header import Exported
from .loops import jacobian_statements, mass_statements, rhs_statements

ARGUMENTS = "double t, const double *state, const double *numbers, double *"
SIGN = ["static double sign(double x)", "{", "    return (double)((x > 0.0) - (x < 0.0));", "}", ""]


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
"""Solves a dense system of DIMENSION equations for several right-hand sides in place."""


def to_c(equations: Equations, values: Mapping[str, float] | None = None) -> str:
    """Return a C99 source with `rhs` and `jacobian`; up to eight nodes are written out, more are loops.

    `values` (name -> number) are written as PARAMETERS' defaults.  Raises ValueError for functions that C99 lacks and for
    unknown or missing values.
    """
    exported = Exported.of(equations, values, "c")
    model, known, small = exported.model, exported.numbers, is_unrolled(exported.model)
    rhs = [*rhs_statements(model), *_solved(model, "rates", Number(1))]
    jacobian = _jacobian(model, small)
    functions = [*_function(f"void rhs({ARGUMENTS}rates)", rhs), ""]
    functions += _function(f"void jacobian({ARGUMENTS}{'matrix' if small else 'values'})", jacobian)
    functions += [] if small else ["", *_places(model)]
    lines = [
        "/*",
        *(f" * {_safe(line)}".rstrip() for line in exported.head),
        *_usage(small),
        " */",
        "",
    ]
    lines += ["#include <math.h>", *(["#include <string.h>"] if small else []), ""]
    lines += _sizes(model, small)
    if known:
        lines += ["/* values of the scene, in the order of `numbers` */"]
        lines += ["const double defaults[PARAMETERS] = {", *wrapped(map(repr, known.values())), "};", ""]
    lines += [*SOLVE.splitlines(), ""] if model.inertial else []
    lines += [*(SIGN if "sign" in called([*rhs, *jacobian]) else []), *functions]
    return "\n".join(lines) + "\n"


def _safe(line: str) -> str:
    """Text that cannot end the comment it stands in."""
    return line.replace("\\", "/").replace("*/", "* /").replace("/*", "/ *")


def _usage(small: bool) -> list[str]:
    lines = [
        " *",
        " * rhs writes d(state)/dt to rates; state and rates have DIMENSION numbers, numbers has PARAMETERS.",
    ]
    if small:
        return [*lines, " * jacobian writes d(rates)/d(state) to matrix, row by row, DIMENSION*DIMENSION numbers."]
    return [
        *lines,
        " * jacobian writes the ENTRIES entries of d(rates)/d(state) to values; jacobian_places writes their rows and",
        " * columns (from 0).  Entries at one place add up, as in the coordinate format of sparse matrices.",
    ]


def _sizes(model: Equations, small: bool) -> list[str]:
    names = {"NODES": model.n, "DIMENSION": model.dimension, "PARAMETERS": len(model.parameters)}
    if not small:
        links = len(model.links)
        names |= {"LINKS": links, "ENTRIES": len(node_places(model)) * model.n + len(link_places(model)) * links}
    lines = [f"enum {{ {', '.join(f'{name} = {value}' for name, value in names.items())} }};", ""]
    if small or not model.links:
        return lines
    for name, table in link_tables(model).items():
        lines += [f"static const int {name}[LINKS] = {{", *wrapped(table), "};"]
    if any(e.has(edge.weight) for edge in model.edges for e in edge.rhs):
        lines += ["static const double WEIGHT[LINKS] = {", *wrapped(weights(model)), "};"]
    return [*lines, ""]


def _function(head: str, body: Sequence[Statement]) -> list[str]:
    """A function; arguments that are not used are named, so that compilers do not warn."""
    arguments = re.findall(r"(\w+)[,)]", head)
    unused = [f"(void){name};" for name in arguments if name not in mentioned(body)]
    return [head, "{", *(f"    {line}" for line in (*unused, *C99.lines(body))), "}"]


def _solved(model: Equations, name: str, columns: Expression) -> list[Statement]:
    """Statements that multiply by the inverse of the mass matrix where it is not the identity."""
    if not model.inertial:
        return []
    return [*mass_statements(model), Do(call("solve", "mass_", name, columns))]


def _jacobian(model: Equations, small: bool) -> list[Statement]:
    if not small:
        return jacobian_statements(model)
    rates: list[Statement] = [Array("rates", Name("DIMENSION")), Do(call("rhs", "t", "state", "numbers", "rates"))]
    cleared = Do(call("memset", "matrix", 0, Name("sizeof(double)") * "DIMENSION" * "DIMENSION"))
    solved = _solved(model, "matrix", Name("DIMENSION"))
    return [*([] if model.constant_mass else rates), cleared, *jacobian_statements(model), *solved]


def _places(model: Equations) -> list[str]:
    """The function that says where the entries of the Jacobian are."""
    lines = []
    for r, c in node_places(model):
        lines.append(_place("i", "NODES", f"{r}*NODES + i", f"{c}*NODES + i"))
    for there, (r, c) in link_places(model):
        end = "SOURCE" if there else "TARGET"
        lines.append(_place("link", "LINKS", f"{r}*NODES + TARGET[link]", f"{c}*NODES + {end}[link]"))
    inner = ["int k = 0;", *lines] if lines else ["(void)rows;", "(void)columns;"]
    return ["void jacobian_places(int *rows, int *columns)", "{", *(f"    {line}" for line in inner), "}"]


def _place(index: str, end: str, row: str, column: str) -> str:
    return f"for (int {index} = 0; {index} < {end}; {index}++) {{ rows[k] = {row}; columns[k++] = {column}; }}"
