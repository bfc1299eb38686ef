"""Mean fields: sums over the nodes do what the listed links of a complete graph do."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
import sympy as sp
from samples import FLOATS, Interpreted, plain, real, take_step

from synchain.codegen.integrators import integrator
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.program.printers import LANES
from synchain.codegen.steps.fields import compensated
from synchain.models.dynamics.equations import Equations, Layer
from synchain.models.graphs.links import LINK_LIMIT, AllPairs
from synchain.models.mechanics.components import TIME, Edge, Node

X, V, X_J, V_J, W, K, A, OMEGA, OMEGA_J = real("x", "v", "x_j", "v_j", "weight", "K", "a", "omega", "omega_j")
GAP = X_J - X
NODE = Node((X, V), (V, -sp.sin(X) + OMEGA + sp.cos(TIME) / 5), (OMEGA,))
RATES = {
    "sine with a lag": (sp.S.Zero, K * W * sp.sin(GAP - A)),
    "harmonics": (K * W * sp.sin(GAP), K * W * sp.sin(2 * GAP + A)),
    "springs": (sp.S.Zero, K * W * GAP),
    "cubic springs": (sp.S.Zero, K * W * GAP**3),
    "exponential": (K * W * sp.exp(GAP / 2) / 10, sp.S.Zero),
    "time": (K * W * sp.cos(GAP - A * TIME), K * W * X_J * sp.sin(TIME)),
    "own parameters": (sp.S.Zero, K * W * OMEGA_J * (V_J - OMEGA * V)),
    "one of the target alone": (K * W * V, K * W * X_J**2),
}
TRUNCATED = {**FLOATS, "truncated": float, "log": lambda x: math.log(x) if x > 0.0 else -math.inf}


@cache
def network(name: str, n: int, listed: bool) -> Equations:
    """All pairs of n nodes, as a mean field or in a list."""
    used = {s for e in RATES[name] for s in e.free_symbols}
    edge = Edge((X, V), (X_J, V_J), W, RATES[name], tuple(s for s in (K, A, OMEGA) if s in used),
                theirs=((OMEGA_J, OMEGA),) if OMEGA_J in used else ())  # fmt: skip
    pairs = AllPairs(n, Fraction(2, 3 * n))
    return Equations((NODE,), (0,) * n, (Layer((((0, 0), edge),), tuple(pairs) if listed else pairs),), ("omega",))


def stepped(equations: Equations, method: str, far: float = 0.0) -> np.ndarray:
    """The new state of one step in loops, by plain Python, all positions moved by `far`."""
    rng = np.random.default_rng(5)
    n = equations.n
    y = [*(far + rng.normal(size=n)), *rng.normal(size=n)]
    p = [*rng.uniform(0.5, 1.5, n), *[0.7] * (len(equations.parameters) - n)]
    chosen = integrator(method, 12) if method == "taylor" else integrator(method)
    source = emit(equations, chosen, Recording(()), width=1, unroll=0)
    kernel, plan = Interpreted.of(source, TRUNCATED), source.elimination
    if method != "taylor":
        return np.array(take_step(kernel, 0.3, 0.1, y, p, 1e-9, 1e-9, plan.arrays, plan.weights).y_new)
    y_new, dense = [None] * (2 * n), [None] * (source.dimensions.dense_rows * 2 * n + source.dimensions.workspace)
    kernel.names["step"](0.3, 0.05, 0.125, y, [*y, *p], y_new, dense, 1e-9, 1e-9, plan.arrays, plan.weights)
    return np.array(y_new)


@pytest.mark.parametrize("method", ["dop853", "taylor"])
@pytest.mark.parametrize("name", RATES)
@pytest.mark.parametrize("n", [3, pytest.param(4, marks=pytest.mark.long), 12])
def test_sums_do_what_listed_links_do(name: str, method: str, n: int) -> None:
    field, listed = (stepped(network(name, n, how), method) for how in (False, True))
    assert abs(field - listed).max() < 4e-15 * max(1.0, abs(listed).max())
    assert abs(listed[n:] - stepped(network(name, n, True), method, 0.1)[n:]).max() > 1e-6


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_fifty_nodes(method: str) -> None:
    field, listed = (stepped(network("sine with a lag", 50, how), method) for how in (False, True))
    assert abs(field - listed).max() < 1e-14


@pytest.mark.parametrize("method", ["dop853", "taylor"])
@pytest.mark.parametrize("name", ["cubic springs", "exponential"])
def test_differences_keep_their_digits_far_away(name: str, method: str) -> None:
    """At a distance of 1e5 cubes of positions have no digit of a difference left, and exponentials no value."""
    field, listed = (stepped(network(name, 5, how), method, 1e5) for how in (False, True))
    assert abs(field - listed).max() < 1e-10


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_two_fields_have_sums_of_their_own(method: str) -> None:
    one, other = (network(name, 6, False) for name in ("springs", "sine with a lag"))
    both = Equations(one.nodes, one.kind_of, (*one.layers, *other.layers), one.varied)
    end = stepped(both, method)
    assert abs(end - stepped(both.without_fields(), method)).max() < 1e-14
    assert abs(end - stepped(Equations(both.nodes, both.kind_of, both.layers[:1], both.varied), method)).max() > 1e-4


def test_the_text_does_not_grow_and_lists_no_link() -> None:
    few, many = (
        emit(network("sine with a lag", n, False), "dop853", Recording(()), width=1, unroll=0) for n in (20, 10**4)
    )
    assert len(many.text) - len(few.text) < 100
    assert many.elimination is not None
    assert many.elimination.weights.size == 0
    assert "in range(target.size)" not in many.text


def test_equations_of_many_nodes_list_no_link() -> None:
    field = network("springs", 10**5, False)
    assert field.link_count == 10**5 * (10**5 - 1)
    assert "9999900000 links" in repr(field)
    assert field.digest != network("springs", 10**5 - 1, False).digest
    assert network("springs", 20, False).digest == network("springs", 20, True).digest
    with pytest.raises(ValueError, match=f"found 9999900000 links between 100000 nodes; expected at most {LINK_LIMIT}"):
        field.without_fields()


def test_rosenbrock_steps_list_the_pairs_or_refuse() -> None:
    source = emit(network("springs", 20, False), "rodas5p", Recording(()), width=1)
    assert source.equations.fields == ()
    assert source.elimination is not None
    assert source.elimination.weights.size == 380
    with pytest.raises(ValueError, match=r"rodas5p: found a mean field of 3000 nodes, .* use dop853 or taylor"):
        emit(network("springs", 3000, False), "rodas5p", Recording(()), width=1)


def test_all_pairs_need_a_link_that_separates() -> None:
    edge = Edge((X, V), (X_J, V_J), W, (W * sp.tanh(GAP), sp.S.Zero), ())
    with pytest.raises(ValueError, match="finite sum of products"):
        Equations((NODE,), (0,) * 4, (Layer((((0, 0), edge),), AllPairs(4, Fraction(1))),))


def test_sums_of_a_million_terms_keep_their_digits() -> None:
    """Plain sums lose some digits here, those of the kernel none."""
    body = "\n        ".join(LANES.lines(compensated("total", "value")))
    text = f"def add(values):\n    total = total_rest = 0.0\n    for value in values:\n        {body}\n    return total"
    values = np.cos(np.random.default_rng(2).uniform(0.0, 0.5, 10**6)).tolist()
    exact = math.fsum(values)
    assert abs(plain(text, {})["add"](values) - exact) <= math.ulp(exact)
    naive = 0.0
    for value in values:
        naive += value
    assert abs(naive - exact) > 20 * math.ulp(exact)
