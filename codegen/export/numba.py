"""Export the right-hand side as Python text; Numba compiles it to a C function with the signature of NumbaLSODA."""

from __future__ import annotations

from collections.abc import Mapping

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Load, Name, Number, call
from ..program.printers import MATH
from ..program.statements import Array, Loop, let, store
from .body import array_tables, is_unrolled, wrapped
from .header import Exported
from .loops import mass_statements, rhs_statements


def to_numba(equations: Equations, values: Mapping[str, float] | None = None) -> str:
    """Return a module whose `rhs` is a Numba cfunc of (t, state, rates, numbers), the signature lsoda_sig of NumbaLSODA.

    Networks of up to eight nodes are written out; larger networks become loops.  `values` (name -> number) become the
    array PARAMETERS.  Raises ValueError for functions that Python's math lacks and for unknown or missing values.

    See Also
    --------
    synchain.export.to_python
    synchain.export.to_c

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("harmonic")
    >>> "cfunc" in sc.export.to_numba(scene.equations, scene.parameters)
    True
    """
    exported = Exported.of(equations, values, "numba")
    model = exported.model
    lines = [f"# {line}".rstrip() for line in exported.head]
    lines += ["#", "# Use: numbalsoda.lsoda(rhs.address, state, times, data=numbers); numbers in the order above."]
    lines += ["", "import math", "", "import numpy as np", "from numba import cfunc, types", ""]
    lines += [f"NODES, DIMENSION = {model.n}, {model.dimension}"]
    if exported.numbers:
        lines += ["PARAMETERS = np.array([", *wrapped(map(repr, exported.numbers.values())), "])"]
    if not is_unrolled(model) and model.links:
        lines += [f"LINKS = {len(model.links)}", *array_tables(model)]
    pointer = "types.CPointer(types.double)"
    lines += [f"lsoda_sig = types.void(types.double, {pointer}, {pointer}, {pointer})", "", ""]
    lines += ["@cfunc(lsoda_sig)", "def rhs(t, state, rates, numbers):"]
    body = rhs_statements(model)
    if model.inertial:
        # the rates are M^-1 times the right-hand side; `rates` is a pointer, so copy its values to an array for NumPy
        k = Name("k_")
        body += [*mass_statements(model), Array("right_", Name("DIMENSION"))]
        body += [Loop("k_", Number(0), Name("DIMENSION"), (store("right_", k, Load("rates", k, None)),))]
        body += [let("right_", call("np.linalg.solve", "mass_", "right_"))]
        body += [Loop("k_", Number(0), Name("DIMENSION"), (store("rates", k, Load("right_", k, None)),))]
    lines += ['    """Write d(state)/dt to `rates`."""', *(f"    {line}" for line in MATH.lines(body))]
    return "\n".join(lines) + "\n"
