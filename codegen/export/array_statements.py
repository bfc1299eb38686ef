"""Write NumPy statements on arrays of all nodes and all links, for networks of many equal nodes.

State component c of all nodes is the slice [c*NODES, (c + 1)*NODES) of the state.  TARGET and SOURCE are the nodes at
the ends of the links.  Sparse matrices are lists of entries; entries with the same row and column are added.
"""

from __future__ import annotations

from collections.abc import Iterable

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Expression, Load, Name, Number, ProductExpr, Slice, call, plus
from ..program.passes import real
from ..program.printers import NUMPY
from ..program.statements import Do, Statement, Store, let, whole
from .body import Entry, ExportBody, array_tables, link_jacobian, link_mass, link_rhs, node_jacobian, node_rhs
from .loops import element_of


def rhs_arrays(model: Equations) -> list[Statement]:
    """Return the statements that write the right-hand side to `rates`."""
    of_nodes, of_links = _loads(model)
    statements = ExportBody.of(node_rhs(model)).statements(of_nodes, lambda c, e: Store("rates", _block(c), e))
    statements += ExportBody.of(link_rhs(model)).statements(
        of_links, lambda c, e: Do(call("np.add.at", "rates", _element(c, "TARGET"), e))
    )
    return statements


def jacobian_arrays(model: Equations) -> list[Statement]:
    """Return the statements that write the entries of the Jacobian, in the order of ROWS and COLUMNS, to `values`."""
    of_nodes, of_links = _loads(model)
    nodes, links = node_jacobian(model), link_jacobian(model)
    slots = {entry: _block(k) for k, entry in enumerate(nodes)}
    statements = ExportBody.of(nodes).statements(of_nodes, lambda entry, e: Store("values", slots[entry], e))
    if not links:
        return statements
    # `values` holds the entries of the nodes first, then the entries of the links
    begin = len(nodes) * Name("NODES")
    behind = {entry: Slice(*(plus(begin, j * Name("LINKS")) for j in (k, k + 1))) for k, entry in enumerate(links)}
    statements.append(whole("LINKS", call("len", "TARGET")))
    return statements + ExportBody.of(links).statements(of_links, lambda entry, e: Store("values", behind[entry], e))


def mass_arrays(model: Equations) -> list[Statement]:
    """Return the statements that build the sparse mass matrix `mass_`: the identity plus the entries of links."""
    # begin with the identity; `store` appends the entries that each link adds
    every = call("np.arange", "DIMENSION")
    rows: list[Expression] = [every]
    columns: list[Expression] = [every]
    values: list[Expression] = [call("np.ones", "DIMENSION")]

    def store(entry: Entry, value: Expression) -> Statement:
        row, column = _of_links(entry)
        rows.append(row)
        columns.append(column)
        name = f"mass_{len(values)}_"
        values.append(Name(name))
        return let(name, ProductExpr((value, call("np.ones", call("len", "TARGET")))))

    statements = ExportBody.of(link_mass(model)).statements(_loads(model)[1], store)
    entries, row, column = (NUMPY.text(_joined(part)) for part in (values, rows, columns))
    matrix = call("csc_matrix", f"({entries}, ({row}, {column}))", "shape=(DIMENSION, DIMENSION)")
    return [*statements, let("mass_", matrix)]


def entry_tables(model: Equations) -> list[str]:
    """Return lines that make the arrays of links, and the rows and columns of the entries of the Jacobian."""
    lines = ["NODE = np.arange(NODES)", *array_tables(model)]
    places = [(_element(e.row, "NODE"), _element(e.column, "NODE")) for e in node_jacobian(model)]
    places += map(_of_links, link_jacobian(model))
    # rows in which M is not the identity: their rates depend on all states that M couples
    if heavy := sorted({entry.row for entry in link_mass(model)}):
        lines += NUMPY.lines([let("HEAVY", _joined([_element(r, "NODE") for r in heavy]))])
    empty = call("np.zeros", 0, "dtype=int")
    tables = zip(("ROWS", "COLUMNS"), zip(*places, strict=True) if places else ((), ()), strict=True)
    return lines + NUMPY.lines(let(name, _joined(parts) if parts else empty) for name, parts in tables)


def _loads(model: Equations) -> tuple[dict[sp.Symbol, Expression], dict[sp.Symbol, Expression]]:
    """Return two maps from symbols to array expressions: for all nodes, and for both ends of all links."""
    varied = {real(name): f"np.asarray({name}, dtype=float)" for name in model.varied}
    of_nodes: dict[sp.Symbol, Expression] = {s: Load("state", _block(c), None) for c, s in enumerate(model.node.state)}
    of_nodes |= {s: Name(text) for s, text in varied.items()}
    if model.edge is None or not model.links:
        return of_nodes, {}
    of_links: dict[sp.Symbol, Expression] = {s: Load(text, Name("TARGET"), None) for s, text in varied.items()}
    for name in model.numbered:
        of_links[real(name)] = Load(f"np.asarray({name}, dtype=float)", Name("NUMBER"), None)
    for end, states in (("TARGET", model.edge.here), ("SOURCE", model.edge.there)):
        of_links |= {s: Load("state", _element(c, end), None) for c, s in enumerate(states)}
    return of_nodes, of_links | {model.edge.weight: Name("WEIGHT")}


def _element(component: int, nodes: str) -> Expression:
    """Return the indices, in the state, of one component of some nodes."""
    return element_of(component, "NODES", nodes)


def _of_links(entry: Entry) -> tuple[Expression, Expression]:
    """Return the rows and columns, for all links, of an entry that links add to."""
    return _element(entry.row, "TARGET"), _element(entry.column, "SOURCE" if entry.source else "TARGET")


def _block(k: int) -> Slice:
    """Return the slice of block `k` in an array of blocks of NODES numbers."""
    end = Name("NODES") if k == 0 else (k + 1) * Name("NODES")
    return Slice(Number(0) if k == 0 else Name("NODES") if k == 1 else k * Name("NODES"), end)


def _joined(parts: Iterable[Expression]) -> Expression:
    return call("np.concatenate", f"[{', '.join(map(NUMPY.text, parts))}]")
