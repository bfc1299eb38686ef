"""The elementary functions of lanes: measured errors, special values, the same bits at every width."""

from __future__ import annotations

import functools
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from numba import njit

from synchain.codegen.simd import elementary
from synchain.codegen.simd.lanes import load, store

INF, NAN = np.inf, np.nan
POINTS = 200_000
NAMES = ("exp", "expm1", "log", "atan", "sin", "cos", "tanh", "sign", "sqrt", "floor")
EXTENDED = np.finfo(np.longdouble).eps < 1e-18
"""False where long double is no better than double: references then come from mpmath, on fewer points."""


def all_functions() -> dict[str, Callable]:
    named = {name: getattr(elementary, name) for name in NAMES}
    named["sqrt"] = njit(lambda x: elementary.sqrt(x))
    named["floor"] = njit(lambda x: elementary.floor(x))
    return named


@functools.cache
def compiled(width: int) -> Callable:
    """All functions in one loop: one output array a function."""
    functions = list(all_functions().values())
    calls = "\n".join(f"        store(out[{k}], i, f{k}(x))" for k in range(len(functions)))
    text = f"def loop(a, out):\n    for i in range(a.size // {width}):\n        x = load(a, i, {width})\n{calls}\n"
    space = {"load": load, "store": store, **{f"f{k}": f for k, f in enumerate(functions)}}
    exec(text, space)
    return njit(space["loop"], error_model="numpy")


def at(x: np.ndarray, width: int = 8) -> dict[str, np.ndarray]:
    """All functions at all points."""
    fill = -len(x) % width
    out = np.full((len(all_functions()), len(x) + fill), -77.0)
    compiled(width)(np.concatenate([x, np.ones(fill)]), out)
    return {name: row[: len(x)] for name, row in zip(all_functions(), out, strict=True)}


def exactly(name: str, x: np.ndarray) -> np.ndarray:
    """The function in extended precision."""
    if EXTENDED:
        return getattr(np, {"atan": "arctan"}.get(name, name))(x.astype(np.longdouble))
    with mpmath.workdps(40):
        return np.array([np.longdouble(mpmath.nstr(getattr(mpmath, name)(mpmath.mpf(float(v))), 25)) for v in x])


def error(name: str, x: np.ndarray) -> float:
    """The largest error in units of the last place of the result."""
    x = x if EXTENDED else x[:: len(x) // 500]
    values, expected = at(x)[name], exactly(name, x)
    unit = np.spacing(np.maximum(np.abs(expected.astype(float)), 2.3e-308))
    return float((np.abs(values.astype(np.longdouble) - expected) / unit).max())


def spread(low: float, high: float) -> np.ndarray:
    return np.random.default_rng(11).uniform(low, high, POINTS)


def scaled(low: float, high: float) -> np.ndarray:
    """Of all sizes between two powers of ten, of both signs."""
    dice = np.random.default_rng(12)
    return 10.0 ** dice.uniform(low, high, POINTS) * dice.choice([-1.0, 1.0], POINTS)


ATAN = {
    "around one": (spread(0.9, 1.1), 1.5), "small": (spread(-0.5, 0.5), 1.0), "usual": (spread(-4.0, 4.0), 1.5),
    "above one": (spread(1.0, 1.6), 1.5), "all": (scaled(-307, 308), 1.5), "friction": (spread(-1e5, 1e5), 1.1),
}  # fmt: skip
CIRCULAR = {
    "usual": (spread(-7.0, 7.0), 1.5), "wide": (spread(-1e5, 1e5), 1.5), "very wide": (spread(-1e9, 1e9), 1.5),
    "first turn": (spread(-1.7, 1.7), 1.5), "small": (scaled(-307, -1), 1.5), "tiny": (scaled(-307, -17), 1.0),
}  # fmt: skip
CASES = {
    "exp": {"all": (spread(-708.0, 709.7), 1.5), "usual": (spread(-2.0, 2.0), 1.5), "small": (scaled(-300, -1), 1.0),
            "denormal": (spread(-745.0, -708.0), 1.1), "top": (spread(709.0, 709.782), 1.5)},
    "expm1": {"all": (spread(-700.0, 700.0), 1.5), "usual": (spread(-2.0, 2.0), 1.5), "small": (scaled(-307, -1), 1.0),
              "first seam": (spread(0.3, 0.5), 1.5), "negative seam": (spread(-0.5, -0.2), 1.5)},
    "log": {"all": (np.abs(scaled(-307, 308)), 1.5), "around one": (spread(0.5, 2.0), 1.5),
            "near one": (1.0 + scaled(-15, -3), 1.5), "denormal": (np.abs(scaled(-323, -307)), 1.5)},
    "atan": ATAN,
    "sin": CIRCULAR, "cos": CIRCULAR,
    "tanh": {"usual": (spread(-3.0, 3.0), 1.5), "wide": (spread(-25.0, 25.0), 1.5), "small": (scaled(-307, -1), 1.0),
             "flat": (spread(17.0, 21.0), 1.5)},
}  # fmt: skip


@pytest.mark.parametrize(("name", "where"), [(name, where) for name, cases in CASES.items() for where in cases])
def test_errors_in_units_of_the_last_place(name, where):
    x, bound = CASES[name][where]
    assert error(name, x) <= bound


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_circular_functions_near_their_zeros(name):
    # the doubles next to multiples of pi/2, where the reduction cancels most
    x = np.arange(1, POINTS // 8) * (np.pi / 2)
    x = np.concatenate([x, np.nextafter(x, 0), np.nextafter(x, INF)])
    assert error(name, x) <= 1.5


def test_circular_functions_of_large_numbers():
    dice = np.random.default_rng(13)
    x = np.concatenate([dice.uniform(-1e15, 1e15, 400), dice.uniform(9e14, 1e15, 400)])
    values = at(x)
    with mpmath.workdps(60):
        for name in ("sin", "cos"):
            exact = [getattr(mpmath, name)(mpmath.mpf(float(v))) for v in x]
            assert max(abs(mpmath.mpf(float(a)) - b) for a, b in zip(values[name], exact, strict=True)) < 2e-15
    sizes = 10.0 ** dice.uniform(15, 300, 5000)
    huge = at(np.concatenate([sizes, -sizes, [1.7e308, -1.7e308]]))
    assert max(np.abs(huge["sin"]).max(), np.abs(huge["cos"]).max()) <= 1.0


MOST = 1.7976931348623157e308
SPECIAL = np.array([0.0, -0.0, INF, -INF, NAN, 5e-324, -5e-324, 1e-310, -1e-310, MOST, -MOST])
PI_2 = np.pi / 2
VALUES = {
    "exp": [1.0, 1.0, INF, 0.0, NAN, 1.0, 1.0, 1.0, 1.0, INF, 0.0],
    "log": [-INF, -INF, INF, NAN, NAN, -744.4400719213812, NAN, -713.8013788281542, NAN, 709.782712893384, NAN],
    "atan": [0.0, -0.0, PI_2, -PI_2, NAN, 5e-324, -5e-324, 1e-310, -1e-310, PI_2, -PI_2],
    "tanh": [0.0, -0.0, 1.0, -1.0, NAN, 5e-324, -5e-324, 1e-310, -1e-310, 1.0, -1.0],
    "sign": [0.0, -0.0, 1.0, -1.0, NAN, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0],
    "sqrt": [
        0.0,
        -0.0,
        INF,
        NAN,
        NAN,
        2.2227587494850775e-162,
        NAN,
        9.999999999999985e-156,
        NAN,
        1.3407807929942596e154,
        NAN,
    ],
    "floor": [0.0, -0.0, INF, -INF, NAN, 0.0, -1.0, 0.0, -1.0, MOST, -MOST],
}


@pytest.mark.parametrize("name", VALUES)
def test_special_values(name):
    values, expected = at(SPECIAL)[name], np.array(VALUES[name])
    np.testing.assert_allclose(values, expected, rtol=2.3e-16)
    good = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(values[good]), np.signbit(expected[good]))


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_circular_functions_of_special_values(name):
    values = at(SPECIAL)[name]
    assert np.isnan(values[2:5]).all()
    small = [0, 1, 5, 6, 7, 8]
    np.testing.assert_array_equal(values[small], SPECIAL[small] if name == "sin" else np.ones(6))
    assert np.signbit(at(SPECIAL)["sin"][1])


def test_nan_stays_nan_whatever_its_low_bits():
    # 2**k is made by adding to the bits: that must not turn a NaN into a number
    x = np.array([0x7FF8000000000FFF, 0x7FF80000000007A2, 0xFFF8000000000801, 0x7FFFFFFFFFFFFFFF], dtype=np.uint64)
    for name, values in at(x.view(float)).items():
        assert np.isnan(values).all(), name


def test_expm1_of_special_values():
    values = at(np.array([0.0, -0.0, NAN, 5e-324, -5e-324, -INF, -800.0]))["expm1"]
    np.testing.assert_array_equal(values, [0.0, -0.0, NAN, 5e-324, -5e-324, -1.0, -1.0])
    assert np.signbit(values[1])
    high = at(np.array([700.0, 701.0, 1e300, INF]))["expm1"]
    assert (high == high[0]).all(), "clamped above 700, as its docstring says"


def test_edges_of_the_exponential():
    x = np.array(
        [709.782712893384, 709.7827128933841, 710.0, 1e300, -745.1332191019411, -745.1332191019412, -746.0, -1e300]
    )
    values = at(x)["exp"]
    assert values[0] == pytest.approx(1.797693134862273e308, rel=3e-16)
    np.testing.assert_array_equal(values[1:], [INF, INF, INF, 5e-324, 0.0, 0.0, 0.0])


def test_seams_are_monotonic():
    # no step backwards where one piece of a function meets the next
    for name, seam in (
        ("atan", 1.0),
        ("tanh", 20.0),
        ("tanh", 0.17),
    ):
        x = seam + np.arange(-200, 201) * np.spacing(seam) * 64
        assert (np.diff(at(x)[name]) >= 0.0).all(), (name, seam)


@pytest.mark.parametrize("name", ["atan", "tanh", "sin", "sign"])
def test_odd_functions(name):
    x = scaled(-20, 5)[:10_000]
    np.testing.assert_array_equal(at(-x)[name], -at(x)[name])


@pytest.mark.parametrize("width", [1, pytest.param(2, marks=pytest.mark.long), 4])
def test_the_same_bits_at_every_width(width):
    x = np.concatenate([SPECIAL, spread(-5.0, 5.0)[:5000], scaled(-308, 308)[:5000], spread(-746.0, 711.0)[:5000]])
    for name, values in at(x, width).items():
        expected = at(x)[name]
        good = ~np.isnan(expected)
        np.testing.assert_array_equal(np.isnan(values), ~good)
        np.testing.assert_array_equal(values[good].view(np.int64), expected[good].view(np.int64), err_msg=name)


def test_everything_is_tested():
    assert set(elementary.__all__) == set(NAMES)
