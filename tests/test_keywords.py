"""The keywords that public functions share: their names and defaults, parameters in two forms, and what is refused."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from catalogue import PAIR

import synchain
from synchain import Criterion, Field, Rates, Scene
from synchain.graphs import chain
from synchain.models.scenes.scene import KEYWORDS
from synchain.results import Progress, Status
from synchain.runtime.bifurcation import skeleton as skeletons
from synchain.runtime.cells.run_keywords import Given
from synchain.runtime.synchronisation.agreement import agreement

SHARED = {
    "workers": None,
    "executor": None,
    "show_progress": None,
    "progress": None,
    "parameters": None,
    "rng": None,
    "precision": None,
    "periods": 5000,
    "transient": None,
    "rtol": None,
}
"""The defaults wherever a function has the keyword."""

CELLS = {"workers", "executor", "show_progress", "progress", "parameters"}
ORBITS = {"workers", "show_progress", "progress", "parameters", "rng", "precision", "periods", "transient", "rtol"}
TAKEN = {
    "run": CELLS | {"rng"},
    "stream": CELLS | {"rng"},
    "basin": CELLS | {"transient", "rng"},
    "thresholds": CELLS | {"precision", "periods"},
    "universal_probe": CELLS,
    "exponents": ORBITS,
    "msf": ORBITS,
    "plane": ORBITS,
    "transition": ORBITS,
    "mismatch": CELLS,
    "work_precision": CELLS - {"workers", "executor"} | {"rtol"},
    "critical": ORBITS,
    "cluster_exponents": ORBITS - {"workers"},
    "lyapunov_spectrum": ORBITS - {"workers"},
    "equilibria": {"parameters", "rng"},
    "equilibrium": {"parameters"},
    "periodic_orbit": {"parameters", "periods"},
    "skeleton": {"show_progress", "progress", "parameters", "rng", "transient", "periods"},
}
"""What each function that computes takes of the shared keywords."""

OTHER = {
    ("periodic_orbit", "periods"): 1,  # of the orbit
    ("work_precision", "rtol"): (1e-4, 1e-6, 1e-8, 1e-10, 1e-12),  # all of them are measured
    ("skeleton", "periods"): (1, 2),  # of the orbits
}
"""Defaults that have another value, as the same word has another task."""

SHORT = Criterion(starts=1, transient=2, window=1)
DRIVEN = Scene(oscillator="duffing", topology=chain(2), parameters={"omega": 1.3}, transient=20.0)


@pytest.mark.parametrize("name", sorted(TAKEN))
def test_the_shared_keywords_have_the_same_names_and_defaults(name: str) -> None:
    parameters = inspect.signature(getattr(synchain, name)).parameters
    assert {word for word in SHARED if word in parameters} == TAKEN[name]
    for word in TAKEN[name]:
        assert parameters[word].default == OTHER.get((name, word), SHARED[word])
    assert [p.name for p in parameters.values() if p.kind is p.VAR_KEYWORD] == [
        "axes" if name in ("basin", "run", "stream", "work_precision") else "more"
    ]


def test_every_function_that_computes_is_in_the_table() -> None:
    functions = {name for name, home in synchain.HOMES.items() if home.startswith("runtime")} - {"Criterion"}
    assert functions - {"compile", "kernel", "open_result", "merge", "energy_function", "follow", "diagram"} == set(
        TAKEN
    )


def calls(scene: Scene, path: Any) -> dict[str, Callable[..., object]]:
    """Each function with what it cannot do without."""
    return {
        "run": lambda **keywords: synchain.run(scene, **keywords),
        "stream": lambda **keywords: synchain.stream(scene, path, **keywords),
        "basin": lambda **keywords: synchain.basin(scene, **keywords),
        "thresholds": lambda **keywords: synchain.thresholds(scene, **keywords),
        "universal_probe": lambda **keywords: synchain.universal_probe(scene, 0.1, 0.1, **keywords),
        "exponents": lambda **keywords: synchain.exponents(scene, [0.1], **keywords),
        "msf": lambda **keywords: synchain.msf(scene, [0.1, 0.2], **keywords),
        "plane": lambda **keywords: synchain.plane(scene, [0.1, 0.2], [0.0, 0.1], **keywords),
        "critical": lambda **keywords: synchain.critical(scene, "sigma", (0.1, 0.2), **keywords),
        "transition": lambda **keywords: synchain.transition(scene, [0.0, 0.2], **keywords),
        "mismatch": lambda **keywords: synchain.mismatch(scene, **keywords),
        "work_precision": lambda **keywords: synchain.work_precision(scene, **keywords),
        "cluster_exponents": lambda **keywords: synchain.cluster_exponents(scene, [0, 0], **keywords),
        "lyapunov_spectrum": lambda **keywords: synchain.lyapunov_spectrum(scene, **keywords),
        "equilibria": lambda **keywords: synchain.equilibria(scene, **keywords),
        "equilibrium": lambda **keywords: synchain.equilibrium(scene, **keywords),
        "periodic_orbit": lambda **keywords: synchain.periodic_orbit(scene, **keywords),
        "skeleton": lambda **keywords: synchain.skeleton(scene, "omega", [1.3], **keywords),
    }


@pytest.mark.parametrize("name", sorted(TAKEN))
def test_every_function_refuses_in_one_line_what_is_no_parameter(name: str, tmp_path: Any) -> None:
    call = calls(DRIVEN, tmp_path / "a.nc")[name]
    refused = [
        ({"window_": 3.0}, rf"unknown parameter or keyword 'window_' of {name}; known: .*; did you mean 'window'\?"),
        ({"paramters": {}}, f"'paramters' of {name}; .*did you mean 'parameters'"),
        ({"initial": {"x": 0.0}}, rf"{name}: 'initial' is a field of the scene; .*write scene\.replace\(initial=…\)"),
        ({"parameters": {"topology": chain(3)}}, rf"{name}: 'topology' is a field .*scene\.replace\(topology=…\)"),
        ({"parameters": {"mu_s": 1.0}, "mu_s": 1.0}, f"{name}: found 'mu_s' in `parameters` and as a keyword"),
        ({"parameters": {"parameters": 1.0}}, f"{name}: found its keyword 'parameters' in `parameters`"),
        ({"parameters": 3}, "parameters: found 3"),
        ({"parameters": {3: 1.0}}, r"parameters: found 3 \(int\); expected text"),
    ]
    if "progress" in TAKEN[name]:
        refused.append(({"progres": print}, f"'progres' of {name}; .*did you mean 'progress'"))
    for keywords, message in refused:
        with pytest.raises((TypeError, ValueError), match=message) as caught:
            call(**keywords)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "word", "why"),
    [
        *((name, "executor", "orbits advance on threads of this process") for name in ("exponents", "msf", "plane")),
        *((n, w, "one orbit") for n in ("cluster_exponents", "lyapunov_spectrum") for w in ("workers", "executor")),
        *(
            (n, w, "needs the one before")
            for n in ("equilibria", "equilibrium", "periodic_orbit", "skeleton")
            for w in ("workers", "executor")
        ),
        *((name, "rtol", "rtol = 1e-12") for name in ("periodic_orbit", "skeleton")),
        *(
            (n, w, rf"Criterion\({w}=…\)")
            for n in ("thresholds", "universal_probe")
            for w in ("rtol", "rng", "transient")
        ),
    ],
)
def test_what_a_function_cannot_use_is_refused_with_the_reason(name: str, word: str, why: str, tmp_path: Any) -> None:
    with pytest.raises(ValueError, match=f"{name} takes no '{word}': .*{why}"):
        calls(DRIVEN, tmp_path / "a.nc")[name](**{word: 1})


ONE_CELL = [(name, n) for name in sorted(set(TAKEN) - {"basin", "run", "stream", "work_precision"}) for n in (1, 2)]


@pytest.mark.parametrize(("name", "n"), ONE_CELL)
@pytest.mark.parametrize(
    ("changes", "remedy"),
    [
        (
            {"axes": {"omega": [1.2, 1.3], "x_1": [0.0, 0.1]}, "zipped": True},
            r"axes of omega, x_1; .*replace\(axes=\(\)\)",
        ),
        ({"draws": {"x": "normal(0, 1)"}, "realisations": 2}, "draws of x; .*realisations=0, draws=None"),
    ],
)
def test_one_cell_stands_for_no_sweep(name: str, n: int, changes: dict[str, Any], remedy: str, tmp_path: Any) -> None:
    swept = DRIVEN.replace(topology=chain(n), **changes)
    with pytest.raises(ValueError, match=f"^{name}: found {remedy}") as caught:
        calls(swept, tmp_path / "a.nc")[name]()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "n"), ONE_CELL)
def test_a_stop_is_refused_where_nothing_stops(name: str, n: int, tmp_path: Any) -> None:
    stopped = DRIVEN.replace(topology=chain(n), stop="x_1 - 9")
    with pytest.raises(ValueError, match=rf"^{name}: found stop = 'x_1 - 9'; .*replace\(stop=None\)$"):
        calls(stopped, tmp_path / "a.nc")[name]()


def test_a_parameter_fixes_an_axis() -> None:
    keywords: dict[str, Any] = {"starts": 1, "transient": 5, "periods": 5, "show_progress": False}
    swept = DRIVEN.replace(axes={"omega": [1.2, 1.4], "delta": [0.3, 0.7]})
    with pytest.raises(ValueError, match="found axes of delta;"):
        synchain.msf(swept, [0.1, 0.2], omega=1.4)
    result = synchain.msf(swept, [0.1, 0.2], omega=1.4, delta=0.7, **keywords)
    expected = synchain.msf(DRIVEN, [0.1, 0.2], omega=1.4, delta=0.7, **keywords)
    assert result.scene == expected.scene
    np.testing.assert_array_equal(result.exponent, expected.exponent)


SHORT_ORBITS: dict[str, Any] = {"starts": 1, "transient": 5, "periods": 5, "show_progress": False}
SAME = {
    "exponents": lambda scene: synchain.exponents(scene, [0.1, 0.2], **SHORT_ORBITS).exponent,
    "msf": lambda scene: synchain.msf(scene, [0.1, 0.2], **SHORT_ORBITS).exponent,
    "a plane of alpha and beta": lambda scene: synchain.plane(scene, [0.1, 0.2], [0.0, 0.1], **SHORT_ORBITS).exponent,
    "a plane of alpha and omega": lambda scene: (
        synchain.plane(scene, [0.1, 0.2], omega=[1.3, 1.4], **SHORT_ORBITS).exponent
    ),
    "universal_probe": lambda scene: (
        synchain.universal_probe(scene, [0.1, 2.0], 0.0, criterion=SHORT, show_progress=False).error
    ),
    "thresholds": lambda scene: [
        edge
        for found in [synchain.thresholds(scene, criterion=SHORT, resolution=0.1, periods=5, show_progress=False)]
        for ranges in (found.direct.intervals, found.probe.intervals, found.exponents.intervals)
        for interval in ranges
        for edge in interval
    ],
    "agreement": lambda scene: [
        (cell.sigma, cell.exponent, cell.error)
        for cell in agreement(scene, [0.1, 0.2], criterion=SHORT, show_progress=False).cells
    ],
}


@pytest.mark.parametrize("name", SAME)
def test_an_axis_of_the_strength_is_no_choice_where_nothing_depends_on_it(name: str) -> None:
    swept = DRIVEN.replace(axes={"sigma": [0.1, 0.3]}, zipped=True)
    expected = SAME[name](DRIVEN)
    assert np.size(expected) >= 2
    np.testing.assert_array_equal(SAME[name](swept), expected)
    with pytest.raises(ValueError, match="found axes of x_1; "):
        SAME[name](DRIVEN.replace(axes={"sigma": [0.1, 0.3], "x_1": [0.1, 0.2]}))


def test_an_axis_of_the_strength_is_refused_where_something_depends_on_it(tmp_path: Any) -> None:
    swept = DRIVEN.replace(axes={"sigma": [0.1, 0.3]})
    for name in ("cluster_exponents", "lyapunov_spectrum"):
        with pytest.raises(ValueError, match=f"^{name}: found axes of sigma; "):
            calls(swept, tmp_path / "a.nc")[name]()
    with pytest.raises(ValueError, match=r"^plane: found axes of sigma; "):
        synchain.plane(swept, omega=[1.2, 1.3], delta=[0.2, 0.3])
    theta = Field({"theta": "1 - theta"})
    pull = Rates({"theta": "g*W*(theta_j - 2*theta_i)"}, {"g": 0.1})
    between_equal_states = Scene(theta, pull, chain(2), axes={"g": [0.1, 0.2]})
    with pytest.raises(ValueError, match=r"^exponents: found axes of g; "):
        synchain.exponents(between_equal_states, [0.1, 0.2])


COLLIDING = (
    "rng",
    "rtol",
    "periods",
    "transient",
    "workers",
    "parameters",
    "alpha",
    "window",
    "scene",
    "name",
    "start",
)


@functools.cache
def colliding() -> Scene:
    """Two equal nodes x' = -p x with a link, whose rate p is the product of all parameters."""
    node = Field({"x": f"-{'*'.join(COLLIDING)}*x"}, parameters=dict.fromkeys(COLLIDING, 1.0))
    return Scene(node, "x->x", chain(2), initial={"x": [1.0, 1.0]}, transient=0.0, window=1.0, time_unit="time")


@pytest.mark.parametrize("name", COLLIDING)
def test_parameters_with_the_names_of_keywords_go_into_the_mapping(name: str) -> None:
    scene = colliding()
    result = synchain.exponents(scene, [0.0, 0.5], parameters={name: 3.0}, starts=1)
    np.testing.assert_allclose(result.exponent, [-3.0, -3.5], rtol=1e-9)
    end = synchain.run(scene, parameters={name: [0.5, 2.0]}, show_progress=False).end
    np.testing.assert_allclose(end.sel(component="x", node=1), np.exp([-0.5, -2.0]), rtol=1e-7)
    assert Given(synchain.run, {name: 1.5}).sweep(scene).parameters[name] == 1.5
    assert synchain.msf(scene, [0.0, 0.5], parameters={name: 3.0}, starts=1).scene.parameters[name] == 3.0


def test_certificates_take_parameters_with_the_names_of_fields() -> None:
    scene = colliding().replace(record=("sync_error",))
    result = synchain.run(scene, parameters={"rng": [1.0, 2.0]}, sigma=0.5, certified=True, show_progress=False)
    np.testing.assert_allclose(result.data["transversal_exponent"], [-2.0, -3.0], rtol=1e-9)


def test_branches_follow_parameters_with_the_names_of_keywords() -> None:
    """x'' = -x - x' + a cos(t): x = a sin(t)."""
    node = Field({"x": "v", "v": "-x - v + start*cos(omega*t)"}, parameters={"start": 0.5, "omega": 1.0})
    scene = Scene(node, "x->x", transient=30.0)
    first = synchain.periodic_orbit(scene, parameters={"start": 0.1})
    branch = synchain.follow(first, "start", values=[0.1, 0.2])
    assert branch.values[[0, -1]].tolist() == [0.1, 0.2]
    np.testing.assert_allclose([orbit.state[1] for orbit in branch.orbits], branch.values, atol=1e-9)


def test_mapping_and_keywords_say_the_same() -> None:
    both = {"omega": 1.2, "kappa": 1e4}
    assert Given(synchain.msf, both, {}).scene(Scene()) == Given(synchain.msf, {"omega": 1.2}, {"kappa": 1e4}).scene(
        Scene()
    )
    by_name = synchain.run(PAIR, sigma=[0.1, 0.2], x_1=0.5, show_progress=False)
    by_table = synchain.run(PAIR, parameters={"sigma": [0.1, 0.2], "x_1": 0.5}, show_progress=False)
    mixed = synchain.run(PAIR, sigma=[0.1, 0.2], parameters={"x_1": 0.5}, show_progress=False)
    assert by_name.data.identical(by_table.data)
    assert by_name.data.identical(mixed.data)
    assert by_name.scene.initial["x"][0] == 0.5


def test_progress_of_orbits_counts_periods_and_values() -> None:
    heard: list[Progress] = []
    options = {"show_progress": False, "progress": heard.append}
    rossler = Scene(oscillator="rossler", coupling="x->x", topology=chain(2))
    for call in (
        lambda: synchain.exponents(rossler, [0.1], starts=1, transient=10, periods=20, **options),
        lambda: synchain.msf(rossler, [0.1, 0.2], starts=1, transient=10, periods=20, **options),
        lambda: synchain.plane(rossler, [0.1, 0.2], [0.0, 0.1], starts=1, transient=10, periods=20, **options),
        lambda: synchain.cluster_exponents(rossler, [0, 0], transient=10, periods=20, **options),
        lambda: synchain.lyapunov_spectrum(rossler, transient=10, periods=20, **options),
    ):
        heard.clear()
        call()
        assert (heard[0].done, heard[-1].done, heard[-1].total, heard[-1].unit) == (0, 30, 30, "period")
        assert [p.done for p in heard] == sorted({p.done for p in heard})
    heard.clear()
    synchain.skeleton(DRIVEN, "omega", [1.3, 1.31], (1,), 2, **options)
    assert [(p.done, p.total) for p in heard] == [(0, 2), (1, 2), (2, 2)]
    assert "2 of 2 values (100 %)" in str(heard[-1])


def test_what_tells_and_what_works_is_checked_in_all_functions(tmp_path: Any) -> None:
    for name, call in calls(DRIVEN, tmp_path / "a.nc").items():
        for word in {"progress", "show_progress", "executor", "workers"} & TAKEN[name]:
            with pytest.raises((TypeError, ValueError), match=f"{word}( =|:)"):
                call(**{word: "x"})


def test_seed_and_transient_of_a_skeleton_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, float]] = []
    states, settled = skeletons.starts_of, skeletons.OrbitProblem.settled
    monkeypatch.setattr(
        skeletons, "starts_of", lambda s, seed, box: asked.append(("rng", seed)) or states(s, seed, box)
    )
    monkeypatch.setattr(
        skeletons.OrbitProblem,
        "settled",
        lambda problem, starts, length: asked.append(("transient", length)) or settled(problem, starts, length),
    )
    synchain.skeleton(DRIVEN, "omega", [1.3], (1,), 1, transient=7, rng=3, show_progress=False)
    assert asked == [("rng", 3), ("transient", 7.0)]


FIELDS: dict[str, Any] = {"rtol": 1e-5, "transient": 3.0, "window": 2.5, "rng": 3}
OPEN = Criterion(starts=2, tolerance=1.0, reach=0.1)
SIMULATIONS = {
    "basin": lambda scene: synchain.basin(scene, samples=2, ranges={"x": (-1.0, 1.0)}, show_progress=False),
    "thresholds": lambda scene: synchain.thresholds(
        scene, sigma=[0.1, 0.2], criterion=OPEN, resolution=1.0, periods=2, show_progress=False
    ),
    "universal_probe": lambda scene: synchain.universal_probe(scene, 0.1, 0.0, criterion=OPEN, show_progress=False),
    "agreement": lambda scene: agreement(scene, [0.1], criterion=OPEN, show_progress=False),
}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_simulations_obey_the_times_tolerance_and_seed_of_a_scene(name: str) -> None:
    short = DRIVEN.replace(topology=chain(2), transient=5.0, window=2.0)
    plain = SIMULATIONS[name](short).criterion
    for field, value in FIELDS.items():
        criterion = SIMULATIONS[name](short.replace(**{field: value})).criterion
        assert getattr(criterion, field) == value != getattr(plain, field), field
        for other in {"transient", "window"} - {field}:
            assert getattr(criterion, other) == getattr(short, other)


OBEYED: dict[str, Any] = {
    **FIELDS,
    "atol": 1e-4,
    "max_steps": 20,
    "integrator": "dop853",
    "initial": {"x": [0.2, 0.3], "v": 0.2},
    "time_unit": "time",
}
RECORDED: dict[str, Any] = {
    "title": "another",
    "record": ("trajectory",),
    "samples": None,
    "t_eval": [5.5, 6.0, 6.9],
    "observe": {"e": "mean(x_1)"},
    "section": "v_1 rising",
    "sections": {"passed": {"function": "x_1"}},
}
SWEPT = {"axes", "zipped", "continuation", "realisations", "draws"}
MODEL = {"oscillator", "coupling", "topology", "friction", "contact", "nodes", "links", "parameters"}
ANSWERS: dict[str, Callable[[Any], tuple[Any, ...]]] = {
    "basin": lambda found: (found.error, found.status),
    "thresholds": lambda found: (found.direct.error, found.probe.error),
    "universal_probe": lambda found: (found.error, found.status),
    "agreement": lambda found: tuple(cell.error for cell in found.cells),
}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_simulations_obey_or_refuse_every_field_of_a_scene(name: str) -> None:
    """What is swept, and a stop, is refused above; parts of the model make the equations."""
    assert sorted((*OBEYED, *RECORDED, *SWEPT, *MODEL, "stop")) == sorted(KEYWORDS)
    short = DRIVEN.replace(transient=5.0, window=2.0)

    def answer(**changes: Any) -> list[float]:
        try:
            found = ANSWERS[name](SIMULATIONS[name](short.replace(**changes)))
        except FloatingPointError:  # the exponents ran out of steps
            return []
        return np.concatenate([np.ravel(part) for part in found]).tolist()

    plain = answer()
    assert answer(**RECORDED) == plain
    assert [field for field, value in OBEYED.items() if answer(**{field: value}) == plain] == []


AVERAGES: dict[str, Callable[..., Any]] = {
    "exponents": lambda scene, **w: synchain.exponents(scene, [0.1, 0.2], starts=2, **w).by_start,
    "msf": lambda scene, **w: synchain.msf(scene, [0.1, 0.2], starts=2, **w).fine.by_start,
    "plane": lambda scene, **w: synchain.plane(scene, [0.1, 0.2], [0.0, 0.1], starts=2, **w).exponent,
    "cluster_exponents": lambda scene, **w: synchain.cluster_exponents(scene, [0, 0], **w).exponent,
    "lyapunov_spectrum": lambda scene, **w: synchain.lyapunov_spectrum(scene, **w).exponent,
}
ROSSLER = Scene("rossler", "x->x", chain(2), parameters={"sigma": 0.1}, integrator="taylor", transient=10.0)
GIVEN: dict[str, Any] = {
    "rtol": 1e-5,
    "atol": 1e-3,
    "transient": 40.0,
    "rng": 3,
    "max_steps": 3,
    "integrator": "rodas5p",
    "time_unit": "time",
    "initial": {"x": 1.5, "y": 0.5, "z": 0.5},
}
"""Fields that the motion depends on, each with a value of its own."""


@pytest.mark.parametrize("name", AVERAGES)
@pytest.mark.parametrize("field", [name for name in GIVEN if name != "time_unit"])
def test_averages_obey_what_a_scene_was_given(name: str, field: str) -> None:
    def answer(scene: Scene, **words: Any) -> Any:
        try:
            return AVERAGES[name](scene, periods=8, show_progress=False, **words).tolist()
        except FloatingPointError as problem:
            return str(problem)

    changed = answer(ROSSLER.replace(**{field: GIVEN[field]}))
    assert changed != answer(ROSSLER)
    if field in ("rtol", "rng"):  # a keyword says the same, and beats the scene
        assert answer(ROSSLER, **{field: GIVEN[field]}) == changed
        assert answer(ROSSLER.replace(**{field: 7 if field == "rng" else 1e-7}), **{field: GIVEN[field]}) == changed


def test_the_transient_of_a_scene_counts_in_its_own_unit() -> None:
    """Periods of a drive, whole ones; units of time without a drive, in as many mean return times."""
    words: dict[str, Any] = {"starts": 1, "periods": 4, "show_progress": False}
    driven = DRIVEN.replace(transient=19.2)
    expected = synchain.exponents(DRIVEN, [0.1], transient=20, **words).exponent
    np.testing.assert_array_equal(synchain.exponents(driven, [0.1], **words).exponent, expected)
    free = synchain.exponents(ROSSLER, [0.1], **words)
    turn = float(free.unit.partition(",")[2].split()[0])
    counted = synchain.exponents(ROSSLER, [0.1], transient=int(np.ceil(10.0 / turn)), **words)
    np.testing.assert_array_equal(free.exponent, counted.exponent)
    heard: list[Progress] = []
    synchain.exponents(ROSSLER, [0.1], progress=heard.append, **words)
    assert heard[0].total == np.ceil(10.0 / turn) + 4


def test_defaults_of_functions_hold_where_a_scene_was_given_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = ROSSLER.replace(transient=300.0)
    words: dict[str, Any] = {"starts": 1, "periods": 1, "show_progress": False}
    heard: list[Progress] = []
    found = synchain.exponents(plain, [0.1], progress=heard.append, **words)
    assert heard[0].total == 301
    same = synchain.exponents(plain, [0.1], transient=300, rtol=1e-6, rng=0, **words)
    np.testing.assert_array_equal(found.exponent, same.exponent)


def test_skeletons_obey_the_transient_and_the_seed_of_a_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    monkeypatch.setattr(skeletons, "starts_of", lambda scene, rng, box: asked.append(rng) or np.zeros((1, 2)))
    monkeypatch.setattr(
        skeletons, "near_returns", lambda scene, periods, transient, states: asked.append(transient) or []
    )
    for changes, expected in (
        ({}, [0, 20.0]),
        ({"transient": 7.0, "rng": 3}, [3, 7.0]),
        ({"transient": 300.0}, [0, skeletons.DROPPED]),
        ({"transient": 10.0, "time_unit": "time"}, [0, 10.0 / (2 * np.pi / 1.3)]),
    ):
        asked.clear()
        synchain.skeleton(DRIVEN.replace(**changes), "omega", [1.3], (1,), 1, show_progress=False)
        assert asked == pytest.approx(expected)


def test_basins_end_where_a_scene_stops() -> None:
    found = SIMULATIONS["basin"](DRIVEN.replace(transient=5.0, window=2.0, stop="x_1 - 1/10"))
    assert Status.STOPPED in found.statuses


def test_an_executor_runs_the_cells_of_the_probe_and_parameters_reach_it() -> None:
    with ThreadPoolExecutor(1) as pool:
        result = synchain.universal_probe(
            DRIVEN, [0.1], [0.0], criterion=SHORT, executor=pool, parameters={"delta": 0.7}, show_progress=False
        )
    assert result.scene.parameters["delta"] == 0.7


def test_a_scene_that_records_from_its_start_still_gives_averages_a_transient() -> None:
    """A transient of 0 is for the records of a run; the average would count the way to the attractor."""
    from synchain.runtime.stability.averages import TRANSIENT, Averaging
    from synchain.runtime.support.execution import Execution

    for length, expected in ((0.0, TRANSIENT), (30.0, 30.0)):
        averaging = Averaging.for_scene(DRIVEN.replace(transient=length), 1e-3, 100, None, None, Execution())
        assert averaging.transient == expected
