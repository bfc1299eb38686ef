"""Compiled runs: the bits of `run`, exact derivatives, and what is refused."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from effort import effort
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import synchain as sc
from synchain import Field, Scene

OSCILLATOR = Field({"x": "v", "v": "-k*x - c*v"}, parameters={"k": 4.0, "c": 0.3})
TIMES = (0.1, 0.5, 2.0, 5.0)


def scene(**more: Any) -> Scene:
    settings = {"initial": {"x": 1.0, "v": 0.0}, "transient": 0, "window": 5, "rtol": 1e-9, **more}
    return Scene(OSCILLATOR, None, **settings)


def damped(t: Any, k: Any, c: Any) -> np.ndarray:
    """Return x of the damped oscillator from x = 1, v = 0; k may be complex."""
    w = np.sqrt(k - c * c / 4)
    return np.exp(-c * t / 2) * (np.cos(w * t) + c / (2 * w) * np.sin(w * t))


SCENES: dict[str, tuple[Scene, dict[str, Any]]] = {
    "closed form": (scene(), {"k": 7.0, "x_1": 0.4}),
    "dop853": (scene(integrator="dop853"), {"k": 7.0, "v_1": 0.4}),
    "rodas5p": (scene(integrator="rodas5p"), {"c": 1.0}),
    # a default atol that shrinks with the motion
    "small": (scene(initial={"x": 1e-5, "v": 0.0}), {"x_1": 3e-6, "k": 2.0}),
    "driven": (Scene("duffing", "spring", sc.graphs.ring(3), transient=2, window=3), {"omega": 1.37, "x_2": 0.1}),
    "merged": (
        Scene("van_der_pol", "x->v", sc.graphs.ring(5), initial={"x": [1, 2, 1, 1, 2]}, window=4),
        {"sigma": 0.3},
    ),
    "one of many": (
        Scene("van_der_pol", "x->v", sc.graphs.ring(12), window=4, transient=1),
        {"mu_3": 0.3, "x_12": 1.5},
    ),
    "belt": (
        Scene("friction", "spring", sc.graphs.chain(2), contact="set-valued", transient=0, window=3),
        {"sigma": 0.2},
    ),
    "smoothed": (
        Scene("friction", "spring", sc.graphs.chain(2), transient=0, window=2),
        {"kappa": 300.0, "mu_s": 0.35},
    ),
    "masses": (Scene("double_pendulum", transient=0, window=2, time_unit="time"), {"mass_ratio": 0.7}),
}


@pytest.mark.parametrize("name", SCENES)
def test_calls_have_the_bits_of_run(name: str) -> None:
    one, values = SCENES[name]
    end = one.transient + one.window
    times = [one.transient, one.transient + 0.7 * one.window, end]
    go = sc.compile(one, tuple(values), t_eval=times)
    result = sc.run(go.scene, show_progress=False, **values)
    end_of_call = go(**values)
    np.testing.assert_array_equal(end_of_call.y, result.trajectory.values)
    np.testing.assert_array_equal(end_of_call.t, result.time.values)
    assert end_of_call.status == result.status.item() == sc.results.Status.FINISHED
    if name != "smoothed":  # at these values "auto" begins with another integrator
        same = sc.run(one, t_eval=times, show_progress=False, **values)
        np.testing.assert_array_equal(same.trajectory.values, end_of_call.y)


def test_arrays_are_cells_with_the_same_bits() -> None:
    go = sc.compile(scene(), ["k", "c", "x_1"], t_eval=TIMES, observe={"A": "maximum(x_1)", "each": "mean(x**2)"})
    k, c = np.linspace(1, 9, 5)[:, None], np.array([0.1, 0.5, 1.2])
    many = go(k=k, c=c)
    assert many.y.shape == (5, 3, 4, 2, 1)
    assert (many.A.shape, many.each.shape, many.status.shape, many.t.shape) == ((5, 3), (5, 3, 1), (5, 3), (5, 3, 4))
    for i in range(5):
        for j in range(3):
            one = go(k=float(k[i, 0]), c=float(c[j]))
            np.testing.assert_array_equal(one.y, many.y[i, j])
            assert (one.A, one.status) == (many.A[i, j], many.status[i, j])
    np.testing.assert_allclose(many.y[:, :, :, 0, 0], damped(np.array(TIMES), k[..., None], c[:, None]), atol=1e-8)


def test_without_times_the_end_is_returned() -> None:
    go = sc.compile(scene(), "k")
    assert go(k=4).t.tolist() == [5.0]
    np.testing.assert_array_equal(go(k=4).y[-1], sc.run(scene(), k=4, show_progress=False).end.values)
    # a recorded trajectory is returned at its own times
    recorded = sc.compile(scene(record=["trajectory"], samples=11), "k")
    np.testing.assert_allclose(recorded().t, np.linspace(0, 5, 11), rtol=1e-15)
    assert recorded().y.shape == (11, 2, 1)
    # a stop ends the cell, and a failed cell has no states behind its end
    stopped = sc.compile(scene(stop="x_1"), "k")(k=4.0)
    assert stopped.status == sc.results.Status.STOPPED
    assert damped(stopped.t, 4.0, 0.3) == pytest.approx(0.0, abs=1e-8)


def test_a_labelled_result_is_that_of_run() -> None:
    go = sc.compile(scene(), ["k", "c"], t_eval=TIMES, observe={"A": "maximum(x_1)"})
    for values in ({"k": 2.0}, {"k": [1.0, 2.0, 3.0]}, {"k": [1.0, 2.0], "c": [0.1, 0.2]}):
        zipped = len(values) == 2
        one = go.scene.replace(zipped=zipped)
        labelled, result = go.labelled(go(**values)), sc.run(one, show_progress=False, **values)
        assert labelled.scene == result.scene
        assert labelled.data.drop_attrs().identical(result.data.drop_attrs())
        assert {k: v for k, v in labelled.data.attrs.items() if k != "kernel"} == {
            k: v for k, v in result.data.attrs.items() if k != "kernel"
        }
    with pytest.raises(ValueError, match="another compiled run"):
        go.labelled(sc.compile(scene(), "k")())


def test_threads_and_pickles_give_the_same_bits() -> None:
    go = sc.compile(scene(), ["k"], t_eval=TIMES, gradient=["k"])
    ks = np.linspace(1, 9, 40)
    with ThreadPoolExecutor(4) as pool:
        threads = list(pool.map(lambda k: (go(k=k).y, go(k=k).d["k"]), ks.tolist()))
    again = pickle.loads(pickle.dumps(go))
    for k, (y, d) in zip(ks.tolist(), threads, strict=True):
        end = again(k=k)
        np.testing.assert_array_equal(end.y, y)
        np.testing.assert_array_equal(end.d["k"], d)


def test_derivatives_are_those_of_the_closed_form() -> None:
    go = sc.compile(scene(), ["k", "c"], t_eval=TIMES, gradient=["k", "c", "x_1"])
    t, step = np.array(TIMES), 1e-30
    for k, c in ((4.0, 0.3), (9.0, 0.1)):
        d = go(k=k, c=c).d
        np.testing.assert_allclose(d["k"][:, 0, 0], damped(t, k + 1j * step, c).imag / step, atol=1e-8)
        np.testing.assert_allclose(d["c"][:, 0, 0], damped(t, k, c + 1j * step).imag / step, atol=1e-8)
        np.testing.assert_allclose(d["x_1"][:, 0, 0], damped(t, k, c), atol=1e-8)
    # many cells at once
    k = np.array([1.0, 4.0, 9.0])
    np.testing.assert_allclose(go(k=k).d["k"][..., 0, 0], damped(t, k[:, None] + 1j * step, 0.3).imag / step, atol=1e-8)


def quotient(call: Any, at: float, step: float = 3e-4) -> np.ndarray:
    """Return a difference quotient of fourth order."""
    h = step * max(abs(at), 0.1)
    near = np.asarray(call(at + h)) - np.asarray(call(at - h))
    far = np.asarray(call(at + 2 * h)) - np.asarray(call(at - 2 * h))
    return np.asarray((8 * near - far) / (12 * h))


NETWORK = Scene(
    Field({"x": "v", "v": "mu*(1 - x**2)*v - x + f*cos(w*t)"}, parameters={"mu": 1.0, "f": 0.4, "w": 1.1}),
    "x->v",
    sc.graphs.ring(4),
    parameters={"sigma": 0.3, "mu": [1.0, 0.8, 1.2, 1.1]},
    initial={"x": [1.0, -0.5, 0.3, 0.8], "v": 0.1},
    transient=1,
    window=5.5,
    time_unit="time",
    rtol=1e-11,
    observe={
        "power": "mean(nodes.mean(v**2))",
        "spread": "variance(x_1 - x_2)",
        "top": "maximum(x)",
        "low": "minimum(x_2 + v_3)",
        "last": "end(x_1*mu_1 + sigma)",
        "fixed": "mean(t)",
    },
)


def test_derivatives_of_a_network_are_difference_quotients() -> None:
    names = {"sigma": 0.3, "w": 1.1, "mu_2": 0.8, "x_3": 0.3, "f": 0.4}
    go = sc.compile(NETWORK, names, t_eval=[1, 3.3, 6], gradient=names)
    end = go()
    for name, at in names.items():
        np.testing.assert_allclose(end.d[name], quotient(lambda a, n=name: go(**{n: a}).y, at), rtol=1e-6, atol=2e-7)
        for observable in NETWORK.observe:
            found = getattr(end, f"d{observable}")[name]
            wanted = quotient(lambda a, n=name, o=observable: getattr(go(**{n: a}), o), at)
            np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=2e-6, err_msg=f"{observable} by {name}")


SWING = {"phi": [0.9, -0.3], "psi": [0.2, 1.1]}


def test_mass_matrices_have_derivatives() -> None:
    pendulum = Scene(
        "double_pendulum", "spring on phi", sc.graphs.chain(2), transient=0, window=3, rtol=1e-11, initial=SWING
    )
    name = "mass_ratio"
    at, state = pendulum.parameters[name], pendulum.equations.state[0]
    go = sc.compile(pendulum, [name, state], t_eval=[1, 3], gradient=[name, state])
    np.testing.assert_allclose(go().d[name], quotient(lambda a: go(**{name: a}).y, at), rtol=1e-6, atol=1e-6)


def test_a_fit_with_its_jacobian_finds_the_parameters() -> None:
    times = np.linspace(0.2, 5, 25)
    data = damped(times, 5.3, 0.21)
    go = sc.compile(scene(), ["k", "c"], t_eval=times, gradient=["k", "c"])

    def residual(q: np.ndarray) -> np.ndarray:
        return go(k=q[0], c=q[1]).y[:, 0, 0] - data

    def jacobian(q: np.ndarray) -> np.ndarray:
        d = go(k=q[0], c=q[1]).d
        return np.stack([d["k"][:, 0, 0], d["c"][:, 0, 0]], axis=-1)

    fit = least_squares(residual, [4.0, 0.3], jac=jacobian)
    np.testing.assert_allclose(fit.x, [5.3, 0.21], rtol=1e-7)
    assert fit.nfev < 12


def test_states_agree_with_scipy() -> None:
    go = sc.compile(NETWORK, ["sigma"], t_eval=[1, 3.3, 6])
    mu, ring = np.array([1.0, 0.8, 1.2, 1.1]), np.array(NETWORK.topology.matrix, dtype=float)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:4], y[4:]
        return np.concatenate([v, mu * (1 - x**2) * v - x + 0.4 * np.cos(1.1 * t) + 0.7 * ring @ x])

    start = [1.0, -0.5, 0.3, 0.8, 0.1, 0.1, 0.1, 0.1]
    reference = solve_ivp(rates, (0, 6), start, "DOP853", [1, 3.3, 6], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(go(sigma=0.7).y.reshape(3, 8), reference.y.T, atol=1e-9)


def test_long_runs_of_lorenz_have_no_derivative() -> None:
    lorenz = Scene("lorenz", transient=0, window=40, time_unit="time", integrator="taylor")
    name = "rayleigh"
    go = sc.compile(lorenz, [name], gradient=[name])
    with pytest.raises(ValueError, match=r"gradient: found a derivative by .* that grows about as exp\(.* t\)"):
        go().d  # noqa: B018
    short = sc.compile(lorenz.replace(window=3, rtol=1e-11), [name], gradient=[name])
    at = lorenz.parameters[name]
    np.testing.assert_allclose(short().d[name], quotient(lambda a: short(**{name: a}).y, at, 1e-5), rtol=1e-5)


def test_a_growing_motion_that_is_not_chaotic_has_a_derivative() -> None:
    growth = Scene(Field({"x": "a*x"}, parameters={"a": 1.0}), initial={"x": 1.0}, transient=0, window=30)
    d = sc.compile(growth, ["a"], gradient=["a"])().d["a"]
    assert d.item() == pytest.approx(30 * np.exp(30), rel=1e-6)


JUMPING = Field({"x": "v", "v": "-x + f*sign(cos(w*t))"}, parameters={"f": 1.0, "w": 1.0})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sc.compile(scene(), ["q"]), "vary: found 'q'; expected a parameter or an initial state"),
        (lambda: sc.compile(scene(), ["k", "k"]), "expected each name once"),
        (lambda: sc.compile(scene(), gradient=["q"]), "gradient: found 'q'"),
        (lambda: sc.compile(scene(axes={"k": [1, 2]}), ["k"]), "compile: found axes of k"),
        (lambda: sc.compile(scene(), ["k"], observe={"status": "mean(x_1)"}), "status"),
        (lambda: sc.compile(scene(), ["k"], t_eval=[6]), "expected times of the window"),
        (lambda: sc.compile(scene(), ["k"])(c=1.0), r"found 'c'; expected one of: k; compile with vary=\('k', 'c'\)"),
        (
            lambda: sc.compile(scene(), ["k"])(q=1.0),
            "compiled run: found 'q'; expected a parameter or an initial state",
        ),
        (lambda: sc.compile(scene(), ["k"])(k=float("nan")), "k = nan"),
        (lambda: sc.compile(scene(), ["x_1"])(x_1=[1.0, float("inf")]), "x_1"),
        (lambda: sc.compile(scene(), ["k"])(k=[]), "expected at least one cell"),
        (lambda: sc.compile(scene(), ["k", "c"])(k=[1, 2], c=[1, 2, 3]), "shape"),
        (lambda: sc.compile(scene(), ["k"])().d, "compile with gradient"),
        (lambda: sc.compile(scene(stop="x_1"), gradient=["k"]), "gradient: found a stop"),
        (lambda: sc.compile(Scene(contact="set-valued"), gradient=["mu_s"]), "set-valued friction"),
        (lambda: sc.compile(Scene("duffing"), gradient=["omega"]), "set time_unit = 'time'"),
        (lambda: sc.compile(Scene(JUMPING, time_unit="time"), gradient=["w"]), "by which rates jump when a parameter"),
        (lambda: sc.compile(scene(observe={"A": "maximum(abs(x_1))"}), gradient=["k"]), "kinks or rates"),
        (lambda: sc.compile(scene(observe={"A": "mean(sign(x_1))"}), gradient=["k"]), "which jumps"),
        (lambda: sc.compile(scene(observe={"A": "mean(nodes.maximum(x))"}), gradient=["k"]), "whose derivative jumps"),
    ],
)
def test_what_has_no_answer_is_refused(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("value", [True, [True, False], np.True_, 2j, np.array([1.0, 2j])])
def test_truth_values_and_complex_numbers_are_refused(value: Any) -> None:
    with pytest.raises(TypeError, match=r"k = .*(True|2\.?j).*; expected a number or an array of numbers"):
        sc.compile(scene(), ["k"])(k=value)


def test_values_are_checked_as_in_a_scene() -> None:
    pendulum = sc.Lagrangian("m*v**2/2", "k*x**2/2", coordinates={"x": "v"}, parameters={"m": 1.0, "k": 1.0})
    go = sc.compile(Scene(pendulum, transient=0, window=1), ["m", "k"])
    assert go(m=2.0).status == sc.results.Status.FINISHED
    for values in ({"m": -1.0}, {"m": [1.0, -1.0]}):
        with pytest.raises(ValueError, match="kinetic energy not positive"):
            go(**values)
    law = {"friction": "coulomb_static", "contact": "set-valued"}
    belt = sc.compile(Scene("friction", **law, transient=0, window=1), ["mu_s"])
    with pytest.raises(ValueError, match="expected mu_k <= mu_s"):
        belt(mu_s=0.01)


def test_a_call_takes_few_calls_of_functions() -> None:
    """218 calls of functions, a tenth of `run`; 35 microseconds besides those of the kernel."""
    go = sc.compile(scene(), ["k", "x_1"], t_eval=TIMES, gradient=["k"])
    go(k=3.0).d  # noqa: B018
    assert effort(lambda: go(k=4.0).y)[1] < 280
    # a start below 0.1 needs its initial rates for the tolerance
    assert effort(lambda: go(x_1=0.01).y)[1] < 750
    assert effort(lambda: go(k=4.0).d)[1] < 550
