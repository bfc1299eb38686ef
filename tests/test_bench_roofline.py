"""The roofline counts what is written, and its table is what its columns say."""

from __future__ import annotations

import inspect

import pytest

from synchain.codegen import elementary, lanes
from synchain.runtime.bench import roofline
from synchain.runtime.bench.roofline import PRIMITIVE, Counter

TEXT = """
DENSE = False
WIDTH = 8

def inner(x, y):
    z = fma(x, y, 2.0*3.0)       # 2: a product of numbers costs nothing
    return z*z - sqrt(y), -z     # 3: the sign costs nothing

def step(t, h, y, p):
    a = load(y, 2*WIDTH + 1, WIDTH)          # 0: addresses are integers
    b, c = inner(a, h + t)                   # 1 + 5
    if DENSE:
        store(p, 3, b*c)                     # 0: left out
    else:
        store(p, 3, b/c)                     # 1
    mask = (b > c*c) & (a == 1.0)            # 1
    return select(mask, maximum(a, b), a) + absolute(b)   # 1
"""


def counter(text: str) -> Counter:
    made = Counter()
    made.read(text)
    return made


def test_operations_counted_by_hand():
    assert counter(TEXT).count("inner") == 5
    assert counter(TEXT).count("step") == 9
    assert counter(TEXT.replace("DENSE = False", "DENSE = True")).count("step") == 9
    assert counter(TEXT.replace("b/c", "b/c + b*c")).count("step") == 11


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("for i in range(t):\n        h = h*h", "For cannot be counted"),
        ("h = h**2", "operator Pow cannot be counted"),
        ("h = unheard(h)", "'unheard' is in none of the texts"),
        ("h = np.sqrt(h)", r"np\.sqrt cannot be counted"),
        ("if t:\n        h = h*h", "condition t is no constant"),
    ],
)
def test_what_cannot_be_counted_is_refused(line, words):
    with pytest.raises(ValueError, match=words):
        counter(f"def step(t, h):\n    {line}\n    return h\n").count("step")


def test_every_lane_function_has_a_number():
    assert set(lanes.__all__) - {"Lane", "Mask", "native_width"} <= set(PRIMITIVE)


def test_elementary_functions_count_their_multiply_adds():
    """An elementary function is at least two operations for each fma that it writes."""
    made = counter(inspect.getsource(elementary))
    for name in ("exp", "log", "atan", "cos"):
        written = inspect.getsource(getattr(elementary, name)).count("fma(")
        assert made.count(name) >= 2 * written > 0


def test_table_of_one_oscillator():
    (row,) = roofline.measure(quick=True)
    n, width, flops, nanoseconds, rate, peak, share = row
    assert len(row) == len(roofline.COLUMNS)
    assert (n, width) == (1, lanes.native_width())
    assert rate == pytest.approx(flops * width / nanoseconds, rel=1.0)
    assert 0 < share < 1
    assert rate < peak
