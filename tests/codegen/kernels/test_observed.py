"""The text of the function of observed values: it computes whatever pair of functions stands in an observable."""

from __future__ import annotations

import ast
import builtins
from itertools import product

import pytest

import synchain as sc
from synchain.codegen.kernels.kernel_text import NamedEquations
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.program.functions import LANES
from synchain.codegen.program.printers import Lanes
from synchain.models.dynamics.observable_text import VALUE_FUNCTIONS, as_observable

INSIDE = ("rate(v)", "x", "x_2", "rate(x_1)", "nodes.mean(x*rate(v))", "mu", "t")
PLACES = (
    "{}*x", "{} + rate(x)*v", "x/(2 + {})", "(2 + v**2)**{}", "nodes.sum({}*v)", "nodes[2](x*{})", "nodes.maximum({})*rate(v_1)",
    "abs({})*v", "max({}, v)*x", "atan2({}, x)", "mod({}, 3)", "sign({})*rate(x)",
)  # fmt: skip
SCENE = sc.Scene("van_der_pol", "x->x", sc.graphs.chain(3))
GIVEN = {
    *vars(builtins),
    *LANES.values(),
    "inside",
    "slope",
    "select",
    "store",
    "load",
    "broadcast",
    "power",
    "any_lane",
}


def undefined(text: str) -> set[str]:
    """Names that the text of a function reads and nothing defines."""
    names = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)]
    parameters = {node.arg for node in ast.walk(ast.parse(text)) if isinstance(node, ast.arg)}
    stored = {node.id for node in names if isinstance(node.ctx, ast.Store)}
    return {node.id for node in names} - stored - parameters - GIVEN - {"njit", "WIDTH", "T0", "np", "STRICT"}


def written(text: str) -> str:
    equations = SCENE.equations
    value = as_observable("o", f"mean({text})").value
    return "\n".join(Lanes().function(f) for f in Recording(observed=(value,)).functions(NamedEquations.of(equations)))


def test_functions_in_all_places_read_what_is_defined() -> None:
    for inner, outer in product(INSIDE, PLACES):
        text = outer.format(inner)
        assert not undefined(written(text)), text


@pytest.mark.parametrize(
    "function", [name for name in VALUE_FUNCTIONS if name not in ("rate", "nodes[3]", "atan2", "max", "min", "mod")]
)
def test_functions_of_rates_and_states(function: str) -> None:
    for text in ("rate(v)*x", "rate(x)/3", "x*v/(5 + t)"):
        expression = f"{function}({text})*v"
        assert not undefined(written(expression)), expression
