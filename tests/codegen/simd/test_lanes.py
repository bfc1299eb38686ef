"""Every operator and function of lanes against NumPy, at all widths, bit for bit."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from synchain.codegen.simd import lane_types
from synchain.codegen.simd.lane_types import native_width
from synchain.codegen.simd.lanes import (
    absolute,
    any_lane,
    broadcast,
    copysign,
    floor,
    fma,
    lane_bits,
    load,
    maximum,
    minimum,
    scale_binary,
    select,
    split_binary,
    sqrt,
    store,
)

WIDTHS = (1, *(pytest.param(width, marks=pytest.mark.long) for width in (2, 4)), 8)
INF, NAN = np.inf, np.nan
SPECIAL = [0.0, -0.0, 1.0, -1.0, INF, -INF, NAN, 5e-324, -5e-324, 2.3e-308, 1.7e308, -1.7e308, 0.5, -0.5, 1.5, 2.5]
PAIRS = np.array(list(itertools.product(SPECIAL, SPECIAL)))  # 256 pairs
DICE = np.random.default_rng(20240229)
A, B = (
    np.concatenate(
        [special, DICE.normal(size=512) * 10.0 ** DICE.integers(-12, 12, 512), np.round(DICE.normal(size=256))]
    )
    for special in PAIRS.T
)
C = np.roll(A[::-1], 7)


@functools.cache
def compiled(width: int) -> Callable:
    """All functions of three lanes in one loop: one output array a function."""
    names = {f"f{k}": njit(function, error_model="numpy") for k, function in enumerate(FUNCTIONS.values())}
    calls = "\n".join(f"        store(out[{k}], i, {name}(x, y, z))" for k, name in enumerate(names))
    text = f"""
def loop(a, b, c, out):
    for i in range(a.size // {width}):
        x, y, z = load(a, i, {width}), load(b, i, {width}), load(c, i, {width})
{calls}
"""
    space = {**names, "load": load, "store": store}
    exec(text, space)
    return njit(space["loop"], error_model="numpy")


def applied(name: str, width: int, a: np.ndarray = A, b: np.ndarray = B, c: np.ndarray = C) -> np.ndarray:
    """One of FUNCTIONS on three arrays."""
    if a is A and b is B and c is C:
        return on_all_rows(width)[name]
    out = np.full((len(FUNCTIONS), a.size), -77.0)
    compiled(width)(a, b, c, out)
    return out[list(FUNCTIONS).index(name)]


@functools.cache
def on_all_rows(width: int) -> dict[str, np.ndarray]:
    out = np.full((len(FUNCTIONS), A.size), -77.0)
    compiled(width)(A, B, C, out)
    return dict(zip(FUNCTIONS, out, strict=True))


def same(values: np.ndarray, expected: np.ndarray) -> None:
    """Bit for bit, any NaN equal to any other."""
    np.testing.assert_array_equal(np.isnan(values), np.isnan(expected))
    good = ~np.isnan(expected)
    np.testing.assert_array_equal(values[good].view(np.int64), expected[good].view(np.int64))


ARITHMETIC = {
    "add": (lambda a, b, c: a + b, lambda: A + B),
    "subtract": (lambda a, b, c: a - b, lambda: A - B),
    "multiply": (lambda a, b, c: a * b, lambda: A * B),
    "divide": (lambda a, b, c: a / b, lambda: A / B),
    "negate": (lambda a, b, c: -a, lambda: -A),
    "lane and float": (lambda a, b, c: a - 2.5, lambda: A - 2.5),
    "float and lane": (lambda a, b, c: 2.5 / a, lambda: 2.5 / A),
    "lane and integer": (lambda a, b, c: a * 3, lambda: A * 3),
    "integer and lane": (lambda a, b, c: 3 - a, lambda: 3 - A),
    "absolute": (lambda a, b, c: absolute(a), lambda: np.abs(A)),
    "floor": (lambda a, b, c: floor(a), lambda: np.floor(A)),
    "square root": (lambda a, b, c: sqrt(a), lambda: np.sqrt(A)),
    "copysign": (lambda a, b, c: copysign(a, b), lambda: np.copysign(A, B)),
    "copysign of a number": (lambda a, b, c: copysign(2.0, b), lambda: np.copysign(2.0, B)),
}
COMPARISONS = {
    "less": (lambda a, b, c: select(a < b, 1.0, 0.0), lambda: A < B),
    "less or equal": (lambda a, b, c: select(a <= b, 1.0, 0.0), lambda: A <= B),
    "greater": (lambda a, b, c: select(a > b, 1.0, 0.0), lambda: A > B),
    "greater or equal": (lambda a, b, c: select(a >= b, 1.0, 0.0), lambda: A >= B),
    "equal": (lambda a, b, c: select(a == b, 1.0, 0.0), lambda: A == B),
    "compared with a number": (lambda a, b, c: select(a < 0.5, 1.0, 0.0), lambda: A < 0.5),
    "number compared": (lambda a, b, c: select(a <= 1, 1.0, 0.0), lambda: A <= 1),
    "and": (lambda a, b, c: select((a < b) & (b < c), 1.0, 0.0), lambda: (A < B) & (B < C)),
    "or": (lambda a, b, c: select((a < b) | (b < c), 1.0, 0.0), lambda: (A < B) | (B < C)),
    "not": (lambda a, b, c: select(~(a < b), 1.0, 0.0), lambda: ~(A < B)),
    "not of a disjunction": (lambda a, b, c: select(~((a < b) | (c > b)), 1.0, 0.0), lambda: ~((A < B) | (C > B))),
}
CHOICES = {
    "choice of lanes": (lambda a, b, c: select(a < b, b, c), lambda: np.where(A < B, B, C)),
    "choice of lane and number": (lambda a, b, c: select(a < b, b, 7), lambda: np.where(A < B, B, 7.0)),
    "choice of number and lane": (lambda a, b, c: select(a < b, -0.5, c), lambda: np.where(A < B, -0.5, C)),
    "what is not chosen does no harm": (lambda a, b, c: select(b == 0.0, 1.0, a / b),
                                        lambda: np.where(B == 0.0, 1.0, A / np.where(B == 0, 1, B))),
}  # fmt: skip


def long_expression(a, b, c):
    d = (a * b - c) / (b * b + 1.5) + sqrt(absolute(c)) * a
    return select((d > a) | (b < c), fma(d, a, -c) * b - d, minimum(d, floor(b)) + copysign(c, a) * d)


OTHERS = {
    "minimum": lambda a, b, c: minimum(a, b),
    "maximum": lambda a, b, c: maximum(a, b),
    "capped": lambda a, b, c: minimum(a, 2),
    "fma": lambda a, b, c: fma(a, b, c),
    "product and term": lambda a, b, c: a * b + c,
    "term and product": lambda a, b, c: c + a * b,
    "product less term": lambda a, b, c: a * b - c,
    "term less product": lambda a, b, c: c - a * b,
    "sum of products": lambda a, b, c: a * b + c * a,
    "difference of products": lambda a, b, c: a * b - c * a,
    "long expression": long_expression,
    "scaled": lambda a, b, c: scale_binary(a, b),
    "mantissa": lambda a, b, c: split_binary(a, 0.7071067811865476)[0],
    "exponent": lambda a, b, c: split_binary(a, 0.7071067811865476)[1],
}
TABLES = {**ARITHMETIC, **COMPARISONS, **CHOICES}
FUNCTIONS = {**{name: function for name, (function, _) in TABLES.items()}, **OTHERS}


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", ARITHMETIC)
def test_arithmetic(name, width):
    expected = ARITHMETIC[name][1]
    with np.errstate(all="ignore"):
        same(applied(name, width), expected())


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", COMPARISONS)
def test_comparisons_are_false_for_nan(name, width):
    expected = COMPARISONS[name][1]
    same(applied(name, width), expected().astype(float))


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", CHOICES)
def test_select(name, width):
    expected = CHOICES[name][1]
    with np.errstate(all="ignore"):
        same(applied(name, width), expected())


@pytest.mark.parametrize("width", WIDTHS)
def test_minimum_and_maximum_prefer_numbers_to_nan(width):
    low, high = applied("minimum", width), applied("maximum", width)
    np.testing.assert_array_equal(low, np.fmin(A, B))  # equal zeros of either sign are equal
    np.testing.assert_array_equal(high, np.fmax(A, B))
    np.testing.assert_array_equal(applied("capped", width), np.fmin(A, 2.0))


# -- fused multiply-add ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", WIDTHS)
def test_fma_rounds_once(width):
    # (1 + e)(1 - e) - 1 is -e**2, which two roundings lose
    e = 2.0 ** -np.arange(27, 51).astype(float)
    size = e.size
    values = applied("fma", width, 1.0 + e, 1.0 - e, np.full(size, -1.0))
    same(values, -(e * e))
    exact = applied("fma", width)
    middle = slice(256, 768)
    wide = A[middle].astype(np.longdouble) * B[middle] + C[middle]
    np.testing.assert_allclose(exact[middle], wide.astype(float), rtol=3e-16)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_first_product_of_a_sum_is_rounded_with_it(width):
    with np.errstate(all="ignore"):
        other = C * A
    for name, factor, term in (
        ("product and term", A, C), ("term and product", A, C), ("product less term", A, -C),
        ("term less product", -A, C), ("sum of products", A, other), ("difference of products", A, -other),
    ):  # fmt: skip
        same(applied(name, width), applied("fma", 1, factor, B, term))


@pytest.mark.parametrize("width", WIDTHS)
def test_products_of_numbers_are_rounded_by_themselves(width):
    @njit(error_model="numpy")
    def add(a, b, numbers):
        for i in range(a.size // width):
            store(b, 2 * i, load(a, i, width) + numbers[0] * numbers[1])
            store(b, 2 * i + 1, broadcast(numbers[0] * numbers[1], width) - load(a, i, width))

    out = np.empty(16)
    add(np.full(8, -0.01), out, np.array([0.1, 0.1]))
    wide = out.reshape(-1, 2, width)
    assert set(wide[:, 0].ravel()) == {0.1 * 0.1 - 0.01}
    assert set(wide[:, 1].ravel()) == {0.1 * 0.1 + 0.01}


@pytest.mark.parametrize("width", WIDTHS[1:])
def test_widths_agree_in_a_long_expression(width):
    same(applied("long expression", width), applied("long expression", 1))


# -- powers of two --------------------------------------------------------------------------------------------

MAGIC = 6755399441055744.0


@pytest.mark.parametrize("width", WIDTHS)
def test_scale_binary(width):
    powers = np.arange(-1016.0, 1016.0)
    values = DICE.uniform(1.0, 2.0, powers.size) * DICE.choice([-1.0, 1.0], powers.size)
    same(applied("scaled", width, values, MAGIC + powers, powers), np.ldexp(values, powers.astype(int)))


@pytest.mark.parametrize("width", WIDTHS)
def test_split_binary(width):
    values = np.concatenate([
        2.0 ** DICE.uniform(-1021.0, 1023.0, 1000),
        [0.7071067811865476, np.nextafter(0.7071067811865476, 0), 1.0, 2.0, 2.2250738585072014e-308, 1.7976931348623157e308,
         1.4142135623730951, np.nextafter(1.4142135623730951, 2)],
    ])  # fmt: skip
    m, k = (applied(name, width, values, values, values) for name in ("mantissa", "exponent"))
    assert ((m >= 0.7071067811865476) & (m < 2 * 0.7071067811865476)).all()
    np.testing.assert_array_equal(k, np.round(k))
    with np.errstate(over="ignore"):
        scaled = np.ldexp(np.ldexp(m, (k // 2).astype(int)), (k - k // 2).astype(int))
    same(scaled, values)


# -- memory and masks -----------------------------------------------------------------------------------------


@functools.cache
def memory(width: int) -> Callable:
    @njit(error_model="numpy")
    def run(source, target, masks, anyone):
        for i in range(source.size // width - 1):
            value = load(source, i + 1, width)
            store(target, i, value + broadcast(1, width) + broadcast(0.5, width))
            mask = value > 0.0
            masks[i] = lane_bits(mask)
            anyone[i] = any_lane(mask)

    return run


@pytest.mark.parametrize("width", WIDTHS)
def test_memory_and_masks(width):
    # starts 8 bytes off any alignment; groups of `width` neighbours
    size = 32 * width
    source = np.concatenate([[99.0], DICE.normal(size=size) - 0.8])[1:]
    source[3 * width : 4 * width] = NAN
    target, groups = np.full(size, -7.0), size // width - 1
    masks, anyone = np.full(groups, -1, np.int64), np.full(groups, False)
    memory(width)(source, target, masks, anyone)
    np.testing.assert_array_equal(target[:-width], source[width:] + 1.5)
    np.testing.assert_array_equal(target[-width:], -7.0)
    bits = (source[width:].reshape(groups, width) > 0) @ (1 << np.arange(width))
    np.testing.assert_array_equal(masks, bits)
    np.testing.assert_array_equal(anyone, bits != 0)
    assert 0 < np.count_nonzero(bits) < groups or width == 8


# -- refusals and the native width ----------------------------------------------------------------------------


def test_widths_do_not_mix():
    def mixed(a, out):
        store(out, 0, load(a, 0, 2) + load(a, 0, 4))

    with pytest.raises(TypingError, match=r"Lane\(2\)"):
        njit(mixed)(np.zeros(8), np.zeros(8))


def test_masks_are_no_numbers():
    def wrong(a, out):
        store(out, 0, (load(a, 0, 2) < 1.0) + load(a, 0, 2))

    with pytest.raises(TypingError, match=r"Mask\(2\)"):
        njit(wrong)(np.zeros(8), np.zeros(8))


def test_native_width(monkeypatch):
    monkeypatch.delenv("SYNCHAIN_WIDTH", raising=False)
    for features, width in (({"avx512f": True, "avx": True}, 8), ({"avx": True}, 4), ({}, 2)):
        monkeypatch.setattr(lane_types, "HOST_FEATURES", features)
        assert native_width() == width
    monkeypatch.setenv("SYNCHAIN_WIDTH", "16")
    assert native_width() == 16
    for wrong in ("3", "eight", "-1", "8.0"):
        monkeypatch.setenv("SYNCHAIN_WIDTH", wrong)
        with pytest.raises(ValueError, match=rf"SYNCHAIN_WIDTH is '{wrong}'; expected one of 1, 2, 4, 8, 16"):
            native_width()
