"""Links as sums of products: what separates, what does not, and that each separation is proved."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from samples import real

from synchain.models.interactions import separation
from synchain.models.interactions.separation import ADDITION_THEOREMS, separated, summed
from synchain.models.mechanics.components import TIME, Edge

X, Y, X_J, Y_J, W, K, A, OMEGA, OMEGA_J = real("x_i", "y_i", "x_j", "y_j", "weight", "K", "a", "omega", "omega_j")
GAP = X_J - X


def edge(*rates: sp.Expr, theirs: bool = False, **options: object) -> Edge:
    """A link between nodes of two states."""
    pairs = ((OMEGA_J, OMEGA),) if theirs else ()
    return Edge(
        (X, Y), (X_J, Y_J), W, (*rates, *[sp.S.Zero] * (2 - len(rates))), (K, A, OMEGA), theirs=pairs, **options
    )


SEPARATE = {
    "sine": (edge(K * W * sp.sin(GAP)), 2, ()),
    "lag": (edge(K * W * sp.sin(GAP - A)), 2, ()),
    "travelling lag": (edge(K * W * sp.cos(GAP - A * TIME)), 2, ()),
    "harmonics": (edge(K * W * (sp.sin(GAP) + A * sp.sin(2 * GAP))), 4, ()),
    "square of a sine": (edge(K * W * sp.sin(GAP) ** 2), 3, ()),
    "difference": (edge(sp.S.Zero, K * W * GAP), 2, (0,)),
    "cube": (edge(K * W * GAP**3), 4, (0,)),
    "cube of two": (edge(K * W * (GAP + Y_J - Y) ** 3), 10, (0, 1)),
    "exponential": (edge(K * W * sp.exp(GAP / 3)), 1, (0,)),
    "hyperbolic": (edge(K * W * sp.sinh(GAP / 3) + W * sp.cosh(GAP / 3)), 2, (0,)),
    "synapse": (edge(-K * W * (X - A) / (1 + sp.exp(-3 * X_J))), 1, ()),
    "two rates": (edge(K * W * X_J * Y, W * X_J * X**2), 1, ()),
    "weight inside": (edge(K * sp.sin(GAP + W)), 2, ()),
    "parameters of both": (edge(K * W * (OMEGA_J - OMEGA) * sp.sin(X_J), theirs=True), 2, ()),
}  # fmt: skip

TOGETHER = {
    "tanh": edge(K * W * sp.tanh(GAP)),
    "quotient": edge(K * W / (1 + GAP**2)),
    "modulus": edge(K * W * sp.Abs(GAP)),
    "product inside": edge(K * W * sp.sin(X * X_J)),
    "parameter of the target inside": edge(K * W * sp.sin(OMEGA * X_J)),
    "high power": edge(K * W * (X_J - X) ** 64),
    "oriented": edge(K * W * GAP, oriented=True),
}


@pytest.mark.parametrize("name", SEPARATE)
def test_products_are_the_link(name: str) -> None:
    link, sources, shifted = SEPARATE[name]
    products = separated(link, ("omega",))
    assert products is not None
    assert (len(products.sources), products.shifted) == (sources, shifted)
    symbols = (X, Y, X_J, Y_J, W, K, A, OMEGA, OMEGA_J, TIME)
    values = dict(zip(symbols, np.random.default_rng(3).uniform(0.2, 1.0, len(symbols)), strict=True))
    for rate, row in zip(link.rhs, products.products, strict=True):
        assert float(sum(c * a * b for c, a, b in row).subs(values) if row else 0) == pytest.approx(
            float(rate.subs(values))
        )
        for shared, target, source in row:
            assert not shared.free_symbols & {X, Y, X_J, Y_J, OMEGA, OMEGA_J}
            assert not target.free_symbols & {X_J, Y_J, OMEGA_J}
            assert not source.free_symbols & {X, Y, OMEGA}


def test_a_node_would_feel_itself_by_the_lag_alone() -> None:
    products = separated(SEPARATE["lag"][0])
    assert products is not None
    assert products.own[0] == -K * W * sp.sin(A)
    assert separated(SEPARATE["sine"][0]).own == (0, 0)


@pytest.mark.parametrize("name", TOGETHER)
def test_other_links_stay_as_they_are(name: str) -> None:
    assert separated(TOGETHER[name], ("omega",)) is None


def test_a_parameter_that_all_share_may_stand_anywhere() -> None:
    assert separated(TOGETHER["parameter of the target inside"]) is not None


@pytest.mark.parametrize("name", ["sine", "lag", "hyperbolic", "exponential"])
def test_a_wrong_theorem_does_not_pass_the_proof(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = {
        f: lambda a, b, theorem=theorem: tuple((-g, h) for g, h in theorem(a, b))
        for f, theorem in ADDITION_THEOREMS.items()
    }
    monkeypatch.setattr(separation, "ADDITION_THEOREMS", wrong)
    assert separated.__wrapped__(SEPARATE[name][0]) is None


SUMMED = {
    "sine": (edge(K * W * sp.sin(GAP - A)), 2, False),
    "sum inside": (edge(K * W * (sp.sin(GAP) + A * sp.cos(2 * GAP))), 4, False),
    "synapse": (edge(-K * W * (X - A) / (1 + sp.exp(-3 * X_J))), 1, False),
    "sine beside a spring": (edge(W * sp.sin(GAP) + K * W * GAP), 2, True),
    "parameters of both": (edge(K * W * OMEGA * OMEGA_J * sp.sin(X_J), theirs=True), 1, False),
}  # fmt: skip

UNSUMMED = {
    "difference": edge(K * W * GAP),
    "cube": edge(K * W * GAP**3),
    "exponential": edge(K * W * sp.exp(GAP)),
    "gap times a function": edge(K * W * GAP * sp.tanh(X_J)),
    "square of a sine": edge(K * W * sp.sin(GAP) ** 2),
    "driven": edge(K * W * sp.sin(GAP - TIME)),
    "oriented": edge(K * W * sp.sin(X_J), oriented=True),
}


@pytest.mark.parametrize("name", SUMMED)
def test_sums_over_links_and_the_rest_are_the_link(name: str) -> None:
    link, sources, remains = SUMMED[name]
    sums = summed(link, ("omega",))
    assert sums is not None
    assert (len(sums.sources), any(sums.rest)) == (sources, remains)
    for rate, row, remainder in zip(link.rhs, sums.products, sums.rest, strict=True):
        total = remainder + sum(shared * of_link * target * source for shared, of_link, target, source in row)
        assert sp.expand(sp.expand_trig(rate - total)) == 0
        for shared, of_link, target, source in row:
            assert not shared.free_symbols & {X, Y, X_J, Y_J, OMEGA, OMEGA_J, W}
            assert of_link.free_symbols <= {W}
            assert not target.free_symbols & {X_J, Y_J, OMEGA_J}
            assert not source.free_symbols & {X, Y, OMEGA}


@pytest.mark.parametrize("name", UNSUMMED)
def test_links_whose_products_lose_digits_stay_as_they_are(name: str) -> None:
    assert summed(UNSUMMED[name], ("omega",)) is None


def test_numbers_of_a_link_stand_with_its_weight() -> None:
    sums = summed(edge(K * A * W * sp.sin(GAP)), (), ("a",))
    assert {of_link for _, of_link, *_ in sums.products[0]} == {A * W}


@pytest.mark.parametrize("rate", [W * sp.tanh(A * X_J), sp.tanh(W * X_J), W * X_J * sp.exp(-A * X)])
def test_a_function_that_differs_from_link_to_link_stays_with_it(rate: sp.Expr) -> None:
    assert summed(edge(rate), (), ("a",)) is None
