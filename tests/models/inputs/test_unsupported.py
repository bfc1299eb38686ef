"""Words that ask for what is not supported are answered so wherever they may stand; long lists of names are short."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import synchain as sc
from synchain.models.inputs.checks import listed

PAIR = sc.Scene("van_der_pol", "x->x", sc.graphs.chain(2))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sc.Scene(delay=1), "delays are not supported; JiTCDDE"),
        (lambda: PAIR.replace(noise=0.1), "noise is not supported; JiTCSDE"),
        (lambda: sc.run(PAIR, resets=1), "resets are events of an oscillator; write Field"),
        (lambda: sc.Scene.from_dict({"triads": 1}), "links of three nodes are rates or potentials"),
        (lambda: sc.Scene(parameters={"delay": 1}), "delays are not supported"),
        (lambda: sc.equilibrium(PAIR, maps=1), "maps are not supported"),
        (lambda: sc.Rates({"x": "tanh(sum(W*x_j))"}), "a function of the sum of inputs is not supported"),
        (lambda: sc.Field({"x": "-x + delay(x, 1)"}), "delays are not supported"),
        (lambda: sc.Field({"z": "sqrt(-1)*z"}), "real and imaginary part are two states"),
    ],
)
def test_words_that_ask_for_other_things(call: Callable[[], object], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=r"unknown|found|rate of") as error:
        call()
    assert message in str(error.value)


@pytest.mark.parametrize("function", [sc.equilibrium, sc.periodic_orbit, sc.lyapunov_spectrum])
def test_functions_without_axes_refuse_lists(function: Callable[..., object]) -> None:
    scene = sc.Scene("van_der_pol", "x->x", sc.graphs.chain(3))
    with pytest.raises(ValueError, match=r"found a list for 'mu'; .* scene\.replace\(mu=\[…\]\)"):
        function(scene, mu=[0.1, 0.2])


def test_numbered_names_are_elided() -> None:
    assert listed(["a", *(f"k_{k}_{k + 1}" for k in range(1, 5)), "x_1", "x_2"]) == "a, k_1_2 … k_4_5, x_1, x_2"
