"""Observables of a run: expressions of the states, reduced over the nodes and then over the window.

A symbol such as ``x`` is a state or a parameter of one node.  It occurs inside ``nodes.mean(…)`` and other reductions
over the nodes, and in an observable that has a value for each node.  The states of the network, ``x_1`` … ``x_n``,
may occur everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import sympy as sp
from sympy.core.function import AppliedUndef

from ..inputs.checks import short_repr
from ..inputs.words import Word


class ObservedWindow(Word):
    """Reductions of a value over the window."""

    MEAN = "mean"
    MAXIMUM = "maximum"
    MINIMUM = "minimum"
    END = "end"
    VARIANCE = "variance"


class _Real(sp.Function):
    """A SymPy function with real values."""

    is_real = True
    spelling: ClassVar[str]

    def _sympystr(self, printer: Any) -> str:
        return f"{self.spelling}({printer._print(self.args[0])})"


class Rate(_Real):
    """The derivative of a state by time."""

    spelling = "rate"


class Reduction(_Real):
    """One value computed from the values of all nodes."""


class NodeSum(Reduction):
    """The sum over the nodes."""

    spelling = "nodes.sum"


class NodeMean(Reduction):
    """The mean over the nodes."""

    spelling = "nodes.mean"


class NodeMaximum(Reduction):
    """The largest value of all nodes."""

    spelling = "nodes.maximum"


class NodeMinimum(Reduction):
    """The smallest value of all nodes."""

    spelling = "nodes.minimum"


class AtNode(Reduction):
    """The value of one node, whose number counts from 1."""

    def _sympystr(self, printer: Any) -> str:
        return f"nodes[{self.args[1]}]({printer._print(self.args[0])})"


class RowSum(Reduction):
    """The sum of a value over the rows of an `ObservableRows`; the argument is the index of that object."""

    spelling = "rows.sum"


@dataclass(frozen=True, slots=True)
class ObservableRows:
    """One expression, evaluated at each of several nodes or links."""

    value: sp.Expr  # an expression of the symbols in `at`, of parameters with one value for all rows, and of t
    # For each symbol of a row its value in every row: names of states or parameters, or numbers.
    at: tuple[tuple[sp.Symbol, tuple[str, ...] | tuple[float, ...]], ...]
    count: int  # the number of rows

    @classmethod
    def of(cls, value: sp.Expr, substitutions: Sequence[Mapping[sp.Symbol, sp.Expr]]) -> ObservableRows:
        """Return the rows of a value; each substitution replaces its symbols by symbols of the network or numbers."""
        used = sorted(value.free_symbols & set(substitutions[0]), key=lambda s: s.name)
        columns = {s: tuple(row[s] for row in substitutions) for s in used}
        fixed = {s: column[0] for s, column in columns.items() if len(set(column)) == 1}
        at = (
            (s, tuple(e.name if e.is_Symbol else float(e) for e in column))
            for s, column in columns.items()
            if s not in fixed
        )
        return cls(value.xreplace(fixed), tuple(at), len(substitutions))

    @property
    def names(self) -> frozenset[str]:
        """The names of all states and parameters in the rows."""
        entries = (entry for _, row in self.at for entry in row if isinstance(entry, str))
        return frozenset({s.name for s in self.value.free_symbols}.union(entries))


class Energy(sp.Symbol):
    """The energy of the whole network, of its nodes and its links, in observables, sections and stops."""


energy = Energy("energy", real=True)
"""The energy of the whole network, of its nodes and its links."""

ENERGY = sp.Symbol(energy.name, real=True)
"""The plain symbol that replaces `energy` in expressions."""


class Nodes:
    """Reductions over the nodes: ``nodes.mean(x)``, and ``nodes[3](x)`` for one node, counted from 1."""

    def sum(self, value: object) -> sp.Expr:
        """Return the sum of a value over all nodes; it may be complex."""
        return _linear(NodeSum, value)

    def mean(self, value: object) -> sp.Expr:
        """Return the mean of a value over all nodes; it may be complex, as in ``abs(nodes.mean(exp(I*theta)))``."""
        return _linear(NodeMean, value)

    def maximum(self, value: object) -> sp.Expr:
        """Return the largest value of all nodes."""
        return NodeMaximum(real(value))

    def minimum(self, value: object) -> sp.Expr:
        """Return the smallest value of all nodes."""
        return NodeMinimum(real(value))

    def std(self, value: object) -> sp.Expr:
        """Return the standard deviation of a value over the nodes; the divisor is n, not n - 1."""
        e = real(value)
        return sp.sqrt(NodeMean((e - NodeMean(e)) ** 2))

    def __getitem__(self, number: int) -> Callable[[object], sp.Expr]:
        """Return a function that evaluates an expression at one node, counted from 1."""
        if isinstance(number, bool) or not isinstance(number, int) or number < 1:
            raise ValueError(f"nodes: found the number {short_repr(number)}; expected a whole number from 1")
        return partial(_linear, AtNode, number=sp.Integer(number))


nodes = Nodes()
"""The nodes of the network, in observables."""


def _linear(kind: type[Reduction], value: object, **more: sp.Expr) -> sp.Expr:
    """Apply a linear reduction to the real and the imaginary part of a value separately."""
    e = _made_real(value)
    if not e.has(sp.I):
        return kind(e, *more.values())
    parts = e.as_real_imag()
    return kind(parts[0], *more.values()) + sp.I * kind(parts[1], *more.values())


def rate(state: object) -> sp.Expr:
    """Return the derivative of a state by time.

    The derivative of the dense output is taken, which is one order less exact than the state.  The mean of a rate is
    the difference of the states at the ends of the window, divided by the length of the window.

    See Also
    --------
    synchain.observe.mean

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> node = sc.Field({"x": "v", "v": "-x"}, initial={"x": 1.0})
    >>> scene = sc.Scene(node, transient=0, window=10, record=(), observe={"value": sc.observe.mean(sc.observe.rate(x)**2)})
    >>> round(sc.run(scene, show_progress=False)["value"].item(), 6)
    0.477176
    """
    e = real(state)
    if not e.is_Symbol:
        raise ValueError(f"rate: found {short_repr(e)}; expected one state, such as rate(theta)")
    return Rate(e)


def _made_real(value: object) -> sp.Expr:
    """Return an expression with real symbols and exact numbers; theta(t) becomes a state, its derivative a `Rate`."""
    if isinstance(value, bool) or not isinstance(value, int | float | sp.Expr):
        kind = type(value).__name__
        raise TypeError(f"observable: found {short_repr(value)} ({kind}); expected an expression of states")
    e = sp.sympify(value)

    # d theta(t)/dt is the rate of theta, and theta(t) the state theta.
    derivatives = {p for p in e.atoms(sp.Derivative) if isinstance(p.expr, AppliedUndef)}
    for p in sorted(derivatives, key=str):
        if p.derivative_count != 1:
            raise ValueError(f"observable: found {short_repr(p)}; expected first derivatives of states by time")
    rates = {p: Rate(sp.Symbol(p.expr.func.__name__, real=True)) for p in derivatives}
    e = e.xreplace(rates)
    states = {p: sp.Symbol(p.func.__name__, real=True) for p in e.atoms(AppliedUndef)}

    symbols = {s: sp.Symbol(s.name, real=True) for s in e.free_symbols}
    numbers = {}
    for number in e.atoms(sp.Float):
        if not number.is_finite:
            raise ValueError(f"observable: found {number}; expected finite real numbers")
        numbers[number] = sp.Rational(repr(float(number)))
    return e.xreplace(states).xreplace({**symbols, **numbers})


def real(value: object) -> sp.Expr:
    """Return an expression with real symbols and exact numbers."""
    e = _made_real(value)
    if e.has(sp.I):
        e = sp.expand_complex(e)
    if e.has(sp.I, sp.re, sp.im, sp.zoo, sp.nan, sp.oo):
        raise ValueError(f"observable: found {short_repr(e)}; expected a real value; take abs(…) of a complex one")
    return e


def node_symbols(e: sp.Expr) -> Iterator[sp.Symbol]:
    """Yield the symbols outside of reductions; if one is a state of a node, the value differs from node to node."""
    if e.is_Symbol:
        yield e
    elif not isinstance(e, Reduction):
        for part in e.args:
            yield from node_symbols(part)


@dataclass(frozen=True, slots=True)
class Observable:
    """A value of the network, or of each node, and its reduction over the window.

    `mean`, `maximum`, `minimum`, `end` and `variance` make observables.

    Parameters
    ----------
    window : Window
    value : Expr
        An expression of the states and their rates, the parameters and t.

    Raises
    ------
    TypeError, ValueError
        If the value is no real expression.

    See Also
    --------
    synchain.observe.mean
    synchain.observe.maximum
    synchain.observe.end
    synchain.run

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> sc.observe.mean(sp.Symbol("x") ** 2)
    Observable(window='mean', value=x**2)
    """

    window: ObservedWindow
    value: sp.Expr

    def __post_init__(self) -> None:
        object.__setattr__(self, "window", ObservedWindow.parse("observable", self.window))
        object.__setattr__(self, "value", real(self.value))

    def __str__(self) -> str:
        return f"{self.window}({sp.sstr(self.value, order='lex')})"


def mean(value: object) -> Observable:
    """Observe the mean of a value over the window; the integral is as exact as the dense output of the steps.

    See Also
    --------
    synchain.observe.variance
    synchain.observe.maximum
    synchain.observe.nodes

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> node = sc.Field({"x": "v", "v": "-x"}, initial={"x": 1.0})
    >>> scene = sc.Scene(node, transient=0, window=10, record=(), observe={"value": sc.observe.mean(x**2)})
    >>> round(sc.run(scene, show_progress=False)["value"].item(), 6)
    0.522824
    """
    return Observable(ObservedWindow.MEAN, value)


def maximum(value: object) -> Observable:
    """Observe the largest value at the points of the quadrature; both ends of every step are among these points.

    See Also
    --------
    synchain.observe.minimum
    synchain.observe.mean

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> node = sc.Field({"x": "v", "v": "-x"}, initial={"x": 1.0})
    >>> scene = sc.Scene(node, transient=0, window=10, record=(), observe={"value": sc.observe.maximum(x)})
    >>> round(sc.run(scene, show_progress=False)["value"].item(), 6)
    1.0
    """
    return Observable(ObservedWindow.MAXIMUM, value)


def minimum(value: object) -> Observable:
    """Observe the smallest value at the points of the quadrature; both ends of every step are among these points.

    See Also
    --------
    synchain.observe.maximum
    synchain.observe.mean

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> node = sc.Field({"x": "v", "v": "-x"}, initial={"x": 1.0})
    >>> scene = sc.Scene(node, transient=0, window=10, record=(), observe={"value": sc.observe.minimum(x)})
    >>> round(sc.run(scene, show_progress=False)["value"].item(), 6)
    -1.0
    """
    return Observable(ObservedWindow.MINIMUM, value)


def end(value: object) -> Observable:
    """Observe a value at the end of the window.

    See Also
    --------
    synchain.observe.mean

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> node = sc.Field({"x": "v", "v": "-x"}, initial={"x": 1.0})
    >>> scene = sc.Scene(node, transient=0, window=10, record=(), observe={"value": sc.observe.end(x)})
    >>> round(sc.run(scene, show_progress=False)["value"].item(), 6)
    -0.839072
    """
    return Observable(ObservedWindow.END, value)


def variance(value: object) -> Observable:
    """Observe the variance of a value over the window: the mean square of its deviation from its mean.

    See Also
    --------
    synchain.observe.mean

    Examples
    --------
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> node = sc.Field({"x": "v", "v": "-x"}, initial={"x": 1.0})
    >>> scene = sc.Scene(node, transient=0, window=10, record=(), observe={"value": sc.observe.variance(x)})
    >>> round(sc.run(scene, show_progress=False)["value"].item(), 6)
    0.519864
    """
    return Observable(ObservedWindow.VARIANCE, value)
