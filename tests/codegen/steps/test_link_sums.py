"""Links that are products of both ends: sums by nodes do what links that are written out do."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from samples import FLOATS, Interpreted, real, take_step

from synchain.codegen.integrators import integrator
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.models.dynamics.equations import Equations, Layer
from synchain.models.mechanics.components import Edge, Node

X, V, X_J, V_J, W, K, A, OMEGA, OMEGA_J = real("x", "v", "x_j", "v_j", "weight", "K", "a", "omega", "omega_j")
GAP = X_J - X
NODE = Node((X, V), (V, OMEGA - sp.sin(X) - V / 5), (OMEGA,))
RATES = {
    "sine with a lag beside a spring": (sp.S.Zero, K * W * sp.sin(GAP - A) + W * GAP),
    "harmonics": (K * W * sp.sin(GAP), K * W * sp.sin(2 * GAP + A)),
    "synapse": (K * W * (A - X) / (1 + sp.exp(-V_J)), sp.S.Zero),
    "own parameters": (sp.S.Zero, K * W * OMEGA_J * sp.sin(OMEGA * X) * sp.cos(V_J)),
}


def network(name: str, n: int = 7) -> Equations:
    """A directed graph without symmetry, with weights that differ."""
    used = {s for e in RATES[name] for s in e.free_symbols}
    pairs = ((OMEGA_J, OMEGA),) if OMEGA_J in used else ()
    edge = Edge((X, V), (X_J, V_J), W, RATES[name], tuple(s for s in (K, A, OMEGA) if s in used), theirs=pairs)
    links = [(i, j, Fraction(1 + (3 * i + j) % 5, 4)) for i in range(n) for j in range(n) if i != j and (i * j + i) % 3]
    return Equations((NODE,), (0,) * n, (Layer((((0, 0), edge),), tuple(links)),), ("omega",))


def numbers(equations: Equations) -> tuple[list[float], list[float]]:
    """A state and parameters."""
    rng, n = np.random.default_rng(5), equations.n
    return [*rng.normal(size=2 * n)], [*rng.uniform(0.5, 1.5, n), *[0.7] * (len(equations.parameters) - n)]


def exact(equations: Equations, y: list[float], p: list[float]) -> np.ndarray:
    """The right-hand side, link by link."""
    n = equations.n
    shared = dict(zip([sp.Symbol(name, real=True) for name in equations.parameters[n:]], p[n:], strict=True))
    rates = np.zeros(2 * n)
    for i in range(n):
        values = {X: y[i], V: y[n + i], OMEGA: p[i]}
        rates[i], rates[n + i] = (float(e.xreplace(values | shared)) for e in NODE.rhs)
    for (i, j, weight), edge in equations.linked():
        ends = {X: y[i], V: y[n + i], OMEGA: p[i], X_J: y[j], V_J: y[n + j], OMEGA_J: p[j], W: float(weight)}
        for c, e in enumerate(edge.rhs):
            rates[c * n + i] += float(e.xreplace(ends | shared))
    return rates


@pytest.mark.parametrize("name", RATES)
def test_sums_by_nodes_are_the_right_hand_side(name: str) -> None:
    equations = network(name)
    y, p = numbers(equations)
    source = emit(equations, integrator("dop853"), Recording(()), width=1, unroll=0)
    assert "sum_0_0" in source.text
    kernel, plan = Interpreted.of(source, FLOATS), source.elimination
    h = 1e-7
    new = take_step(kernel, 0.0, h, y, p, 1e-9, 1e-9, plan.arrays, plan.weights).y_new
    np.testing.assert_allclose((np.array(new) - y) / h, exact(equations, y, p), atol=2e-6)


@pytest.mark.parametrize("name", RATES)
def test_series_and_stages_agree(name: str) -> None:
    equations = network(name)
    y, p = numbers(equations)
    n, stages = equations.n, emit(equations, integrator("dop853"), Recording(()), width=1, unroll=0)
    kernel, plan = Interpreted.of(stages, FLOATS), stages.elimination
    new = np.array(take_step(kernel, 0.0, 0.02, y, p, 1e-12, 1e-12, plan.arrays, plan.weights).y_new)
    series = emit(equations, integrator("taylor", 12), Recording(()), width=1, unroll=0)
    kernel, plan = Interpreted.of(series, {**FLOATS, "truncated": float, "log": np.log}), series.elimination
    y_new, dense = [None] * (2 * n), [None] * (series.dimensions.dense_rows * 2 * n + series.dimensions.workspace)
    kernel.names["step"](0.0, 0.02, 0.02, y, [*y, *p], y_new, dense, 1e-12, 1e-12, plan.arrays, plan.weights)
    np.testing.assert_allclose(np.array(y_new), new, atol=2e-14)


def test_each_node_has_its_functions_once() -> None:
    """The sine of a phase serves gravity, and both ends of all links."""
    text = emit(
        network("sine with a lag beside a spring"), integrator("taylor", 8), Recording(()), width=1, unroll=0
    ).text
    step = text[text.index("# order 0") : text.index("# all further orders")]
    assert (step.count(" = sin(x)"), step.count(" = cos(x)")) == (1, 1)
