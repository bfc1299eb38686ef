"""What makes kernels compile in less time: functions without wrappers, and operators of lanes that Numba tries first."""

from __future__ import annotations

import importlib
import operator
from pathlib import Path
from typing import Any

import pytest
from numba import types
from numba.core import utils
from numba.core.registry import cpu_target
from numba.core.target_extension import get_local_target

from synchain.codegen.front_end import syntax_reader
from synchain.codegen.front_end.decorator import njit
from synchain.codegen.simd import lanes  # noqa: F401  (defines the operators)
from synchain.codegen.simd.lane_types import Lane


def _text(function: Any) -> tuple[str, Any]:
    function.compile((types.float64,))
    overload = function.overloads[(types.float64,)]
    return overload.library.get_llvm_str(), overload.fndesc


@njit(error_model="numpy")
def half(x: float) -> float:
    return 0.5 * x


def test_inner_functions_have_no_wrappers() -> None:
    text, description = _text(half)
    assert description.llvm_func_name in text
    assert description.llvm_cpython_wrapper_name not in text
    assert description.llvm_cfunc_wrapper_name not in text


def _machine_code(symbol: str) -> bool:
    return bool(cpu_target.target_context.codegen()._engine.is_symbol_defined(symbol))


def test_inner_functions_have_no_machine_code_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "two_functions.py").write_text(
        "from synchain.codegen.front_end.decorator import njit\n\n\n"
        '@njit(error_model="numpy")\ndef third(x):\n    return x / 3.0\n\n\n'
        '@njit(error_model="numpy", cache=True)\ndef ninth(x):\n    return third(third(x))\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module("two_functions")
    assert module.ninth(18.0) == 2.0
    (inner,), (entry,) = module.third.overloads.values(), module.ninth.overloads.values()
    assert not _machine_code(inner.fndesc.llvm_func_name)
    assert _machine_code(entry.fndesc.llvm_func_name)


def test_entry_points_are_callable_from_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "entry_point.py").write_text("def double(x):\n    return 2.0 * x\n")
    monkeypatch.syspath_prepend(tmp_path)
    double = njit(error_model="numpy", cache=True)(importlib.import_module("entry_point").double)
    text, description = _text(double)
    assert description.llvm_cpython_wrapper_name in text
    assert double(1.5) == 3.0


@pytest.mark.parametrize(
    "function", [operator.add, operator.sub, operator.mul, operator.truediv, operator.lt, operator.ge]
)
def test_operators_of_lanes_are_tried_first(function: Any) -> None:
    context = cpu_target.typing_context
    context.refresh()
    templates = context.resolve_value_type(function).templates
    first = utils.order_by_target_specificity(get_local_target(context), templates)[0]
    assert len(templates) > 1
    assert first(context).apply((Lane(4), types.float64), {}).args == (Lane(4), types.float64)


@pytest.mark.parametrize("function", [operator.neg])
def test_negation_of_a_lane_is_tried_first(function: Any) -> None:
    context = cpu_target.typing_context
    context.refresh()
    templates = context.resolve_value_type(function).templates
    first = utils.order_by_target_specificity(get_local_target(context), templates)[0]
    assert first(context).apply((Lane(4),), {}).return_type == Lane(4)


def test_the_signature_of_an_operator_is_resolved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    context = cpu_target.typing_context
    context.refresh()
    resolve = context.resolve_function_type
    monkeypatch.setattr(
        context, "resolve_function_type", lambda *request: (asked.append(request[1]), resolve(*request))[1]
    )
    reader, four = syntax_reader._TreeReader(context, {}), Lane(4)
    pairs = [(four, four), (types.float64, four), (four, four)]
    signatures = [reader.signature(operator.add, pair)[1] for pair in pairs]
    assert [signature.args for signature in signatures] == pairs
    assert asked == pairs[:2]
