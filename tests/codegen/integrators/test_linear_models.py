"""Every integrator, and "auto", on linear models whose rates or Jacobians hold plain numbers, against the matrix exponential.

The front end of the compiler refuses a number where it expects a register of lanes. Python, which runs other tests of
generated steps, accepts both.
"""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from synchain import Field, Rates, Scene, run
from synchain.codegen import integrators
from synchain.codegen.front_end import decorator
from synchain.codegen.machine_code.code_cache import cache_folder
from synchain.graphs import chain
from synchain.runtime.support.status import Status

MODELS: dict[str, tuple[dict[str, str], list[list[float]], list[float]]] = {
    "constant": ({"x": "v", "v": "-4*x - v/2"}, [[0, 1], [-4, -0.5]], [0, 0]),
    "diagonal": ({"x": "-x/2", "v": "-100*v"}, [[-0.5, 0], [0, -100]], [0, 0]),
    "triangular": ({"x": "v - x", "v": "-100*v"}, [[-1, 1], [0, -100]], [0, 0]),
    "zero": ({"x": "1", "v": "-2"}, [[0, 0], [0, 0]], [1, -2]),
}
"""Rates of a node by text, and as a matrix A and a vector b: d(x, v)/dt = A (x, v) + b."""
STARTS = {"x": (1.0, -0.5), "v": (0.25, 2.0)}
WINDOW, RTOL = 12.0, 1e-10


def exact(slopes: np.ndarray, rates: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return the state (dimension,) after WINDOW."""
    size = len(start)
    bordered = np.zeros((size + 1, size + 1))
    bordered[:size, :size], bordered[:size, size] = slopes, rates
    return (expm(WINDOW * bordered) @ [*start, 1.0])[:size]


@pytest.fixture(scope="module")
def drivers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a cache with the compiled drivers of this machine and no kernels."""
    folder = tmp_path_factory.mktemp("cache") / "drivers"
    if cache_folder().is_dir():
        shutil.copytree(cache_folder(), folder, ignore=shutil.ignore_patterns("kernel_*"))
    return folder


@pytest.fixture
def problems(monkeypatch: pytest.MonkeyPatch, drivers: Path) -> list[str]:
    """Compile every kernel anew; return the problems of the front end, whose functions Numba then compiles."""
    problems = list[str]()
    monkeypatch.setenv("SYNCHAIN_CACHE", str(drivers))
    monkeypatch.setattr(decorator, "front_end_problems", problems)
    return problems


@pytest.mark.filterwarnings("ignore:stiff equations")  # explicit steps on a rate of 100
@pytest.mark.parametrize("linked", [False, True], ids=["alone", "linked"])
@pytest.mark.parametrize(("name", "model"), list(itertools.product(("auto", *integrators.names()), MODELS)))
def test_linear_models_compile_and_are_exact(name: str, model: str, linked: bool, problems: list[str]) -> None:
    texts, slopes, rates = MODELS[model]
    coupling = Rates({"x": "W*(x_j - x_i)/4"}) if linked else None
    rtol = 1e-6 if name == "ros34pw2" else RTOL
    scene = Scene(
        Field(texts), coupling, chain(2) if linked else None, integrator=name, rtol=rtol, record=(), transient=0.0,
        window=WINDOW, time_unit="time",
        initial=STARTS if linked else {key: values[0] for key, values in STARTS.items()},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    count = 1 + linked
    matrix = np.kron(slopes, np.eye(count))  # states are in the order x_1, x_2, v_1, v_2
    if linked:
        matrix[:2, :2] += [[-0.25, 0.25], [0.25, -0.25]]
    start = np.array([value for values in STARTS.values() for value in values[:count]])
    expected = exact(matrix, np.repeat(rates, count), start)
    assert problems == []
    assert result.status == Status.FINISHED
    if name == "auto":
        stiff = model in ("diagonal", "triangular")
        assert result.integrators.startswith("rodas5p" if stiff else "taylor")
    np.testing.assert_allclose(result.states("end"), expected, rtol=0, atol=1e3 * rtol)
