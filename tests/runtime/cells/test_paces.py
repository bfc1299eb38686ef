"""Rates of motion where cells start: slopes of large nodes without their Jacobian."""

from __future__ import annotations

import numpy as np
import sympy as sp

import synchain as sc
from synchain.codegen.taylor import is_large
from synchain.runtime.cells.paces import Templates


def test_slopes_of_large_nodes_are_those_of_their_jacobian(monkeypatch):
    """Powers, quotients and functions, with a parameter and time; NaN and infinite where the Jacobian is."""
    size = 9
    pulls = [
        " + ".join(f"sin(y{j} - y{k})/(1 + (y{j} - a*y{k})**2)**(3/2)" for j in range(size) if j != k)
        for k in range(size)
    ]
    rates = {f"y{k}": f"{pull} + exp(-y{k})*cos(t) + sqrt(y{k})" for k, pull in enumerate(pulls)}
    equations = sc.Scene(sc.Field(rates, parameters={"a": 2.0}), None, initial=dict.fromkeys(rates, 1.0)).equations
    node, rng = equations.nodes[0], np.random.default_rng(1)
    assert is_large(equations)
    states, parameters, times = rng.uniform(0.1, 2.0, (4, size)), np.full((4, 1), 1.3), np.linspace(0.0, 3.0, 4)
    states[3, 2] = 0.0
    time = next(iter({s for e in node.rhs for s in e.free_symbols} - {*node.state, *node.parameters}))
    jacobian = sp.lambdify([*node.state, *node.parameters, time], sp.Matrix(node.jacobian()), "numpy")
    with np.errstate(all="ignore"):
        expected = [jacobian(*y, 1.3, t) for y, t in zip(states, times, strict=True)]
    monkeypatch.setattr(type(node), "jacobian", lambda node: 1 / 0)
    blocks = Templates(equations).blocks(states, parameters, times)[:, 0]
    np.testing.assert_allclose(blocks, expected, rtol=1e-12, atol=1e-12)
