"""Integrators as data, one file each: exact tableau, orders and the source of the coefficients.

A file holds KIND ("rosenbrock" or "explicit"), ORDER, ERROR_ORDER, DENSE_ORDER, SOURCE and the
coefficients.  Everything else (number of stages, stiff accuracy, sums that can be reused) is
computed from them.  Installed packages announce such modules as entry points of the group
``synchain.integrators``.
"""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from types import ModuleType

from synchain.models.inputs.entry_points import announced

__all__ = ["Integrator", "IntegratorKind", "integrator", "names"]

Row = tuple[float, ...]

GROUP = "synchain.integrators"  # the group of entry points of integrators
# The names that the module of an integrator with stages must have.
NEEDED = ("KIND", "ORDER", "ERROR_ORDER", "DENSE_ORDER", "SOURCE", "A", "B", "C", "E", "DENSE")


class IntegratorKind(StrEnum):
    """The values of KIND in the file of an integrator."""

    ROSENBROCK = "rosenbrock"
    EXPLICIT = "explicit"
    TAYLOR = "taylor"  # The power series of the solution, from recurrences


@dataclass(frozen=True, slots=True)
class Integrator:
    """One-step method with an embedded error estimate and dense output.

    Attributes
    ----------
    name, kind
        Name of the file, and whether the method is a Rosenbrock method or explicit.
    order, error_order, dense_order
        Orders of the result, of the error estimate and of the dense output.
    source
        Where the coefficients were published.
    a, b, c
        The tableau; row i of `a` has at most i entries.  Stages beyond the length of `b` serve the
        dense output alone.
    e
        One or two rows of weights for the error estimate.
    dense
        One row of weights for each D_j below.
    dense_error
        Largest error of the dense output in a component of infinite stiffness, in units of its last
        row; 0 if its order is the same there.
    gamma, d, big_c
        Further coefficients of a Rosenbrock method: gamma, the weights of df/dt, and the matrix C.
    inexact
        True for a W-method, whose order does not need the exact Jacobian: its matrix has one block
        for each oscillator.

    Notes
    -----
    A Rosenbrock method has the form without products with the Jacobian [1]_.  With s = 1/(h gamma)::

        (s - J) k_i = f(t + c_i h, y + sum a_ij k_j) + h d_i df/dt + sum (C_ij/h) k_j
        y_new = y + sum b_i k_i

    An explicit method has k_i = f(t + c_i h, y + h sum a_ij k_j) and y_new = y + h sum b_i k_i.  The
    error is sum e_i k_i (times h); two rows of e are combined as |e1|^2 / sqrt(|e1|^2 + 0.01 |e2|^2), in units
    of the tolerance.
    The dense output is y(theta) = (1-theta) y + theta (y_new + (1-theta) (D_1 + theta (D_2 + …))) with
    D_j = sum dense_ji k_i (times h).

    In the limit of infinite stiffness (y' = z (y - g(t)) + g'(t), z to minus infinity [2]_) the error
    estimate of a stiffly accurate method vanishes, and the dense output of Rosenbrock methods loses
    an order: Rodas5P reproduces g of degree 3, Rodas4 of degree 2.  Where states between steps are
    recorded, dense_error D_last therefore is a second estimate, times 1 - 2 s/p with the pivot p of
    the component in the elimination of s - J: p = s if it is not stiff (no estimate), p >> s if it is.

    References
    ----------
    .. [1] E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer, 1996,
       eq. IV.7.25.
    .. [2] A. Prothero, A. Robinson, Mathematics of Computation 28, 145 (1974).
    """

    name: str
    kind: IntegratorKind
    order: int
    error_order: int
    dense_order: int
    source: str
    a: tuple[Row, ...]
    b: Row
    c: Row
    e: tuple[Row, ...]
    dense: tuple[Row, ...]
    dense_error: float = 0.0
    gamma: float = 0.0
    d: Row = ()
    big_c: tuple[Row, ...] = ()
    inexact: bool = False

    def __post_init__(self) -> None:
        if self.kind not in list(IntegratorKind):
            raise ValueError(
                f"integrator {self.name}: kind {str(self.kind)!r}; expected 'rosenbrock', 'explicit' or 'taylor'"
            )
        if len(self.a) != len(self.c) or any(len(row) > i for i, row in enumerate(self.a)):
            raise ValueError(f"integrator {self.name}: the tableau is not strictly lower triangular")
        if self.implicit and not self.gamma > 0:
            raise ValueError(f"integrator {self.name}: a Rosenbrock method needs gamma > 0")

    @property
    def implicit(self) -> bool:
        """True for a Rosenbrock method, whose stages solve linear systems with the Jacobian."""
        return self.kind == IntegratorKind.ROSENBROCK

    @property
    def series(self) -> bool:
        """True for a Taylor method, which has no stages and chooses the length of its steps itself."""
        return self.kind == IntegratorKind.TAYLOR

    @property
    def dense_rows(self) -> int:
        """Number of coefficients of the dense output for each state variable."""
        return self.order if self.series else len(self.dense)

    @property
    def stages(self) -> int:
        """Number of stages of the step, without the extra stages that only the dense output needs."""
        return len(self.b)


def names() -> tuple[str, ...]:
    """Return the names of all integrators: the files of this folder and entry points of installed packages."""
    return tuple(sorted({*_shipped(), *announced(GROUP)}))


@cache
def _shipped() -> tuple[str, ...]:
    return tuple(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_"))


def _module(name: str) -> ModuleType:
    """Return the module of an integrator; shipped names come first."""
    if name in _shipped():
        return importlib.import_module(f".{name}", __name__)
    entry = announced(GROUP)[name]
    try:
        module: ModuleType = entry.load()
    except Exception as error:
        raise ValueError(f"integrator {name!r} of the entry point {entry.value!r}: {error}") from error
    missing = [key for key in NEEDED if not hasattr(module, key)]
    if missing:
        raise ValueError(
            f"integrator {name!r} of the entry point {entry.value!r}: found no {', '.join(missing)}; expected a module such as "
            "synchain.codegen.integrators.dop853"
        )
    return module


@cache
def integrator(name: str, order: int | None = None) -> Integrator:
    """Return the integrator of a name.

    Parameters
    ----------
    name
        One of `names()`.
    order
        The order of a Taylor method; the order of any other method is fixed.

    Raises
    ------
    ValueError
        If there is no integrator of the name, or the module of an entry point lacks a part of a tableau.
    """
    if name not in names():
        raise ValueError(f"unknown integrator {name!r}; known: {', '.join(names())}")
    data = _module(name)
    if data.KIND == IntegratorKind.TAYLOR:
        order = data.ORDER if order is None else order
        return Integrator(name, IntegratorKind.TAYLOR, order, order, order, data.SOURCE, (), (), (), (), ())
    return Integrator(
        name=name,
        kind=IntegratorKind(data.KIND),
        order=data.ORDER,
        error_order=data.ERROR_ORDER,
        dense_order=data.DENSE_ORDER,
        source=data.SOURCE,
        a=data.A,
        b=data.B,
        c=data.C,
        e=data.E,
        dense=data.DENSE,
        dense_error=getattr(data, "DENSE_ERROR", 0.0),
        gamma=getattr(data, "GAMMA", 0.0),
        d=getattr(data, "TIME_WEIGHTS", ()),
        big_c=getattr(data, "BIG_C", ()),
        inexact=getattr(data, "INEXACT", False),
    )
