"""Further functions of lanes: errors against mpmath, special values, the same bits at every width."""

from __future__ import annotations

import functools

import mpmath
import numpy as np
import pytest
from numba import njit

from synchain.codegen.simd import special
from synchain.codegen.simd.lanes import load, store

INF, NAN = np.inf, np.nan
RANGES = {
    "acos": 1.0, "acosh": 1e12, "asin": 1.0, "asinh": 1e12, "atanh": 1.0, "cosh": 300.0, "erf": 7.0, "sinh": 300.0,
    "tan": 20.0,
}  # fmt: skip
ULPS = {"acos": 4, "acosh": 4, "asin": 4, "asinh": 3, "atanh": 3, "cosh": 3, "erf": 3, "sinh": 4, "tan": 4}
NAMES = (*RANGES, "ceiling", "power_of_two")


def squared(x):
    return special.power(x, 2.5)


@functools.cache
def compiled(width: int):
    functions = [
        *(getattr(special, name) for name in NAMES[:-1]),
        njit(lambda x: special.power_of_two(x)),
        njit(squared),
    ]
    calls = "\n".join(f"        store(out[{k}], i, f{k}(x))" for k in range(len(functions)))
    text = f"def loop(a, out):\n    for i in range(a.size // {width}):\n        x = load(a, i, {width})\n{calls}\n"
    space = {"load": load, "store": store, **{f"f{k}": f for k, f in enumerate(functions)}}
    exec(text, space)
    return njit(space["loop"], error_model="numpy")


def at(x: np.ndarray, width: int = 8) -> dict[str, np.ndarray]:
    fill = -len(x) % width
    out = np.zeros((len(NAMES) + 1, len(x) + fill))
    compiled(width)(np.concatenate([x, np.ones(fill)]), out)
    return {name: row[: len(x)] for name, row in zip((*NAMES, "power"), out, strict=True)}


@pytest.mark.parametrize("name", RANGES)
def test_errors_are_a_few_units_in_the_last_place(name):
    size = RANGES[name]
    rng = np.random.default_rng(3)
    x = np.concatenate([rng.uniform(-size, size, 1500), rng.uniform(-1, 1, 500) * 10.0 ** rng.uniform(-12, 0, 500)])
    x = 1.0 + np.abs(x) if name == "acosh" else x
    values = at(x)[name]
    with mpmath.workprec(120):
        exact = np.array([float(getattr(mpmath, name)(float(v))) for v in x])
    assert (np.abs(values - exact) <= ULPS[name] * np.spacing(np.abs(exact))).all()


def test_powers_are_accurate_for_moderate_logarithms():
    x = np.random.default_rng(4).uniform(0.1, 10.0, 1000)
    exact = np.array([float(mpmath.mpf(v) ** 2.5) for v in x])
    assert (np.abs(at(x)["power"] / exact - 1.0) < 2e-15).all()


def test_special_values():
    values = at(np.array([0.0, -0.0, 1.0, -1.0, 2.0, INF, -INF, NAN]))
    assert values["asin"][:4].tolist() == [0.0, -0.0, np.pi / 2, -np.pi / 2]
    assert values["acos"][[2, 3]].tolist() == [0.0, np.pi]
    assert np.isnan(values["asin"][4:]).all()
    assert np.isnan(values["acos"][4:]).all()
    assert values["erf"][5:7].tolist() == [1.0, -1.0]
    assert values["cosh"][[0, 5, 6]].tolist() == [1.0, INF, INF]
    assert values["sinh"][[0, 5, 6]].tolist() == [0.0, INF, -INF]
    assert np.signbit(values["sinh"][1])
    assert values["asinh"][[0, 5, 6]].tolist() == [0.0, INF, -INF]
    assert np.signbit(values["asinh"][1])
    assert values["acosh"][[2, 5]].tolist() == [0.0, INF]
    assert np.isnan(values["acosh"][[0, 3, 6]]).all()
    assert values["atanh"][[0, 2, 3]].tolist() == [0.0, INF, -INF]
    assert np.isnan(values["atanh"][4:]).all()
    assert values["ceiling"][:7].tolist() == [0.0, 0.0, 1.0, -1.0, 2.0, INF, -INF]
    for name in ("erf", "cosh", "sinh", "tan", "power", "asinh", "acosh", "ceiling"):
        assert np.isnan(values[name][7])
    assert np.isnan(values["power"][3])


@functools.cache
def angles():
    @njit(error_model="numpy")
    def loop(y, x, out):
        for i in range(y.size // 8):
            store(out, i, special.atan2(load(y, i, 8), load(x, i, 8)))

    return loop


def angle(y, x) -> np.ndarray:
    y, x = (np.array(part, dtype=float) for part in (y, x))
    fill = -len(y) % 8
    out = np.zeros(len(y) + fill)
    angles()(np.append(y, np.ones(fill)), np.append(x, np.ones(fill)), out)
    return out[: len(y)]


def test_angles_of_points_are_accurate_all_around():
    rng = np.random.default_rng(6)
    y, x = rng.normal(size=(2, 2000)) * 10.0 ** rng.uniform(-8, 8, size=(2, 2000))
    exact = np.array([float(mpmath.atan2(float(a), float(b))) for a, b in zip(y, x, strict=True)])
    assert (np.abs(angle(y, x) - exact) <= 3 * np.spacing(np.abs(exact))).all()


def test_angles_on_axes_at_infinity_and_of_nothing_are_those_of_c():
    places = [0.0, -0.0, 1.0, -1.0, INF, -INF, NAN]
    y, x = (part.ravel() for part in np.meshgrid(places, places))
    np.testing.assert_array_max_ulp(angle(y, x), np.arctan2(y, x), 1)
    numeric = ~(np.isnan(y) | np.isnan(x))
    assert np.array_equal(np.signbit(angle(y, x))[numeric], np.signbit(np.arctan2(y, x))[numeric])


def test_whole_numbers_above():
    x = np.random.default_rng(5).uniform(-5.0, 5.0, 100)
    assert np.array_equal(at(x)["ceiling"], np.ceil(x))


def test_powers_of_two_are_cut_downwards():
    x = np.array([1.0, 1.999, 2.0, 3.7, 0.3, 1e-300, 1e300])
    assert at(x)["power_of_two"].tolist() == [2.0 ** np.floor(np.log2(v)) for v in x]


@pytest.mark.parametrize("width", [1, pytest.param(4, marks=pytest.mark.long)])
def test_every_width_has_the_same_bits(width):
    x = np.linspace(-3.0, 3.0, 101)
    one, other = at(x, width), at(x, 8)
    assert all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)
