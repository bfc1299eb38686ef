"""From what a user gave to a complete scene: defaults filled in, every value checked against the model."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..graphs.families import topology
from ..graphs.topology import Topology
from ..inputs.checks import choice, integer, number, shown, text
from ..inputs.frozen import Frozen
from ..inputs.plugins import load, named, part
from ..mechanics.coupling_text import canonical, is_matrix, split
from ..mechanics.coupling_text import canonical_coordinates as chosen_coordinates
from ..mechanics.coupling_text import named as named_coupling
from ..mechanics.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from .model import bare, by_kind, check_links, check_state, components, coordinate_names, default_friction, groups
from .parameters import at_nodes, drive, parameters
from .section import Section
from .start import SEED_LIMIT, chosen_start, default_start, start
from .sweep import check_sweep, read_axes

__all__ = ["check_friction", "complete", "integrators"]

RECORDS = ("sync_error", "section", "trajectory")

TIME_UNITS = ("period", "time")

METHODS = Path(__file__).parents[2] / "codegen" / "integrators"
"""The folder of the integrators, one file each; it is listed here, and read by the code generator alone."""

TIME_LIMIT, STEP_LIMIT, SAMPLE_LIMIT = 1e9, 10**12, 10**8


def integrators() -> tuple[str, ...]:
    """Names of all integrators."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules([str(METHODS)]) if not m.name.startswith("_")))


def complete(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the same names with defaults filled in and values checked; ValueError or TypeError else."""
    made = dict(given)
    made["title"] = text("title", made["title"])
    made["seed"] = integer("seed", made["seed"], 0, SEED_LIMIT)
    _model(made)
    made["axes"] = read_axes(made["axes"], made["zipped"])
    made["parameters"] = parameters(made)
    made["initial"] = _start(made)
    _records(made)
    _times(made)
    _numerics(made)
    check_sweep(made)
    check_friction(made)
    _physics(made)
    return made


def _physics(made: Mapping[str, Any]) -> None:
    """Refuse wrong physics at the scene's parameters and at the ends of its axes."""
    from ..mechanics.physics import check_masses, check_power

    for ends in (min, max):
        swept = {axis.name: ends(axis.values) for axis in made["axes"]}
        values = {name: swept.get(name, value) for name, value in made["parameters"].items()}
        for oscillator, friction, own in at_nodes(made, values):
            check_masses(oscillator, own)
            if friction is not None:
                check_power(friction, own)


def _model(made: dict[str, Any]) -> None:
    made["oscillator"] = named(OSCILLATOR, part("oscillator", made["oscillator"]))
    made["contact"] = text("contact", made["contact"])
    graph = made["topology"] = topology("chain", 1) if made["topology"] is None else made["topology"]
    if not isinstance(graph, Topology):
        raise TypeError(f"topology: found {shown(graph)} ({type(graph).__name__}); expected a graph, e.g. chain(4)")
    made["friction"] = default_friction(made["oscillator"], made["friction"])
    made["nodes"] = groups(made["nodes"], graph.n)
    if made["coupling"] is not None:
        coupling = part("coupling", made["coupling"])
        made["coupling"] = None if coupling == "none" else named_coupling(coupling)
    if made["coupling"] is not None and not is_matrix(made["coupling"]):
        load(COUPLING, split(made["coupling"])[0])  # an unknown name is refused even where nothing uses it
    if made["coupling"] is not None and is_matrix(made["coupling"]):
        made["coupling"] = canonical(made["coupling"], components(made))
    elif made["coupling"] is not None and split(made["coupling"])[1] is not None:
        made["coupling"] = chosen_coordinates(made["coupling"], coordinate_names(made))
    if graph.links and made["coupling"] is None:
        raise ValueError(
            f"coupling: found none for {graph.name}({graph.n}), which has links; "
            "expected the name of a coupling, e.g. 'spring'"
        )
    check_links(made)


def _start(made: Mapping[str, Any]) -> Frozen[tuple[float, ...]]:
    """The initial states, component by component, those of each kind of node around its own centre."""
    graph, names = made["topology"], components(made)
    templates, kinds = by_kind(made["oscillator"], made["friction"], made["nodes"], graph.n)
    centres = [getattr(load(OSCILLATOR, oscillator), "INITIAL", None) for oscillator, _ in templates]
    if not kinds:
        return start(made["initial"], names, graph.n, made["seed"], centres[0])
    nodes = bare(made)
    own = [
        default_start(tuple(s.name for s in one.state), graph.n, c) for one, c in zip(nodes.nodes, centres, strict=True)
    ]
    defaults = {name: tuple(own[kinds[i]][name][i] for i in nodes.holders(name)) for name in names}
    return chosen_start(made["initial"], defaults, made["seed"])


def _records(made: dict[str, Any]) -> None:
    n = made["topology"].n
    found = made["record"]
    if found is None:
        found = ("sync_error",) if n > 1 and bare(made).common else ()
    if not isinstance(found, (list, tuple)):
        raise TypeError(f"record: found {shown(found)}; expected a list out of {', '.join(RECORDS)}")
    names = [choice("record", name, RECORDS) for name in found]
    if len(set(names)) < len(names):
        raise ValueError(f"record: found {shown(names)}; expected each record once; remove the repetition")
    if n == 1 and "sync_error" in names:
        raise ValueError(
            "record: found 'sync_error' for one oscillator; expected at least two to compare; take it out of record"
        )
    made["record"] = tuple(name for name in RECORDS if name in names)
    if "sync_error" in names and not bare(made).common:
        raise ValueError("record: found 'sync_error', but these oscillators have no states of one name to compare")
    templates, kinds = by_kind(made["oscillator"], made["friction"], made["nodes"], n)
    own = tuple(s.name for s in bare(made).node_at(0).state)
    crossed = own[0] if hasattr(load(OSCILLATOR, templates[kinds[0] if kinds else 0][0]), "field") else own[-1]
    default = f"{'v' if 'v' in own else crossed}_1 falling"
    made["section"] = Section.parse(default if made["section"] is None else made["section"])
    check_state(made, made["section"].variable, "section variable")


def _times(made: dict[str, Any]) -> None:
    found = drive(made)
    if made["time_unit"] is None:
        made["time_unit"] = "time" if found.frequency is None else "period"
    made["time_unit"] = choice("time_unit", made["time_unit"], TIME_UNITS)
    if made["time_unit"] == "period" and found.frequency is None:
        templates, _ = by_kind(made["oscillator"], made["friction"], made["nodes"], made["topology"].n)
        names = " and ".join(dict.fromkeys(repr(oscillator) for oscillator, _ in templates))
        whole = names if len(templates) == 1 else f"the network of {names}"
        raise ValueError(
            f"time_unit: found 'period', but {whole} {found.problem}; expected 'time'; change it or leave it out"
        )
    for name in ("transient", "window"):
        made[name] = number(name, made[name], 0.0, TIME_LIMIT)
    if made["record"] and made["window"] == 0.0:
        raise ValueError(f"window: found 0, in which {made['record'][0]!r} has nothing to record; give a window > 0")


def _numerics(made: dict[str, Any]) -> None:
    made["integrator"] = choice("integrator", made["integrator"], ("auto", *integrators()))
    made["rtol"] = number("rtol", made["rtol"], 1e-15, 0.1)
    made["atol"] = made["rtol"] / 10 if made["atol"] is None else number("atol", made["atol"], 0.0, 0.1)
    if made["atol"] < 1e-300:
        raise ValueError(
            f"atol: found {made['atol']!r}; expected a number above 0, since states pass through 0; take e.g. 1e-10"
        )
    made["max_steps"] = integer("max_steps", made["max_steps"], 1, STEP_LIMIT)
    made["samples"] = integer("samples", made["samples"], 0, SAMPLE_LIMIT)
    if "trajectory" in made["record"] and made["samples"] < 2:
        raise ValueError(
            f"samples: found {made['samples']} for the trajectory; expected at least 2, "
            "since both ends of the window are included; raise samples"
        )


def check_friction(made: Mapping[str, Any]) -> None:
    """Raise ValueError for set-valued friction with a static coefficient below that of slip, which can neither hold nor
    slip: a law names such pairs in ORDER, the smaller parameter first."""
    if made["contact"] != "set-valued":
        return
    for _, friction, own in at_nodes(made, {name: name for name in made["parameters"]}):
        if friction is not None:
            for low, high in getattr(load(FRICTION_LAW, friction), "ORDER", ()):
                _check_order(made, friction, own[low], own[high])


def _check_order(made: Mapping[str, Any], friction: str, low: str, high: str) -> None:
    """Compare two parameters in all cells."""
    axes = {axis.name: axis.values for axis in made["axes"]}
    lows, highs = (axes.get(name, (made["parameters"][name],)) for name in (low, high))
    together = made["zipped"] and low in axes and high in axes
    for a, b in zip(lows, highs, strict=True) if together else ((max(lows), min(highs)),):
        if b < a:
            raise ValueError(f"friction {friction}: found {high} = {b!r} below {low} = {a!r}; expected {low} <= {high}")
