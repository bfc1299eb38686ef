"""Constant expressions in scene files: right values, and nothing but constants."""

from __future__ import annotations

import math
import warnings

import pytest
from effort import effort
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.models.inputs.arithmetic import DEPTH, LENGTH, constant

REFUSAL = 400
"""A refusal takes up to 130 calls."""


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2*pi/1.15", 2 * math.pi / 1.15),
        ("sqrt(2)/2", math.sqrt(2) / 2),
        ("-2-sqrt(2)", -2 - math.sqrt(2)),
        (" -(1 + 2)**2 ", -9.0),
        ("2**-1", 0.5),
        ("2**3**2", 512.0),
        ("1e-3", 1e-3),
        ("+.5", 0.5),
        ("exp(log(3))", math.exp(math.log(3))),
        ("sin(0) + cos(0)", 1.0),
        ("7", 7.0),
    ],
)
def test_value(text: str, value: float) -> None:
    found = constant(text)
    assert found == value
    assert type(found) is float


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "unreadable"),
        ("1 +", "unreadable"),
        ("2 pi", "unreadable"),
        ("2*(pi", "unreadable number '2*(pi' with a ( that is not closed"),
        ("(" * 100, "unreadable"),
        ("9**9**9", "exponent 3.8742e+08"),
        ("10**99*10**99", "1e+198"),
        ("1e999", "inf"),
        ("1e999-1e999", "inf"),
        ("1/0", "division by zero"),
        ("(-8)**(1/3)", "complex"),
        ("exp(1e9)", "math range error"),
        ("exp(710)", "math range error"),
        ("sqrt(-1)", "sqrt(-1) "),
        ("log(0)", "log(0) "),
        ("2^3", "write ** for a power"),
        ("1j", "not a constant"),
        ("True", "not a constant"),
        ("None", "not a constant"),
        ("x", "'x' in the number"),
        ("pi.real", "not a constant"),
        ("pi(2)", "not a constant"),
        ("sqrt", "'sqrt' in the number"),
        ("sqrt()", "not a constant"),
        ("7//2", "not a constant"),
        ("exit()", "not a constant"),
        ("__import__(1)", "not a constant"),
        ("sqrt(1,2)", "','"),
        ("[1]", "'['"),
        ("'a'", '"\'"'),
        ("1\n", "'\\n'"),
        ("ｐｉ", "'ｐ'"),
        ("1" * (LENGTH + 1), f"at most {LENGTH}"),
        ("-" * (DEPTH + 1) + "1", f"more than {DEPTH}"),
        ("-" * (LENGTH - 1) + "1", f"more than {DEPTH}"),
    ],
)
def test_refused(text: str, part: str) -> None:
    def refused() -> str:
        with pytest.raises(ValueError, match=r".") as caught:
            constant(text)
        return str(caught.value)

    message, calls = effort(refused)
    assert part in message
    assert "\n" not in message
    assert calls < REFUSAL


def test_numbers_run_into_words_give_no_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match="not a constant"):
            constant("1or 2")


@settings(deadline=None, max_examples=300)
@given(st.text("0123456789.eE+-*/() pisqrtexlogcn_", max_size=40))
def test_any_text_is_a_finite_float_or_an_error(text: str) -> None:
    try:
        value, message = constant(text), "a finite float"
    except ValueError as error:
        value, message = 0.0, str(error)
    assert type(value) is float
    assert math.isfinite(value)
    assert len(message) > 10
    assert "\n" not in message


@settings(deadline=None, max_examples=100)
@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e99, max_value=1e99))
def test_every_float_survives_as_text(value: float) -> None:
    assert constant(repr(value)) == value
