"""Complete the keywords of a scene: fill in defaults and check every value against the model."""

from __future__ import annotations

import math
import pkgutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, partial
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import sympy as sp

from ..dynamics.record import Record
from ..inputs.checks import check_choice, check_integer, check_number, check_seed, check_text, is_row, short_repr
from ..inputs.entry_points import announced
from ..inputs.frozen import FrozenDict
from ..inputs.words import Word
from ..mechanics.components import WEIGHT_NUMBER
from ..mechanics.contact import ContactModel, FrictionLaw, coefficient_at_rest
from ..mechanics.impacts import Friction, Stop
from ..mechanics.nondimensional import friction_coefficient, static_coefficient
from ..mechanics.oscillator import FieldModel
from ..mechanics.physics import check_masses, check_power
from ..networks.layers import as_contact, as_coupling, as_groups, as_law, as_layers, as_oscillator
from ..networks.model import Model, NodeKind
from ..sweeps.axis import LIMIT, Axis
from ..sweeps.checked_axes import check_cells, check_draws, check_sweep, read_axes
from ..sweeps.draws import GRAPH, Draws, drawn_axes, drawn_graph, drawn_nodes, draws
from ..sweeps.initial_values import SEED_LIMIT, chosen_start, default_start
from ..sweeps.parameters import at_links, at_nodes, drive, parameters, varied
from .observables import ENDINGS, observables, sections, stop
from .section import Section


class TimeUnit(Word):
    """The unit of `transient` and `window`."""

    PERIOD = "period"
    TIME = "time"


METHODS = Path(__file__).parents[2] / "codegen" / "integrators"
"""Folder of the integrators, one file each.  This module lists the names; only the code generator imports the files."""

LIMITS: Mapping[str, tuple[Any, Any]] = {
    "transient": (0.0, sys.float_info.max),
    "window": (0.0, sys.float_info.max),
    "rtol": (1e-15, 0.1),
    "atol": (0.0, 0.1),
    "max_steps": (1, 10**12),
    "samples": (0, 10**8),
    "realisations": (0, LIMIT),
    "rng": (0, SEED_LIMIT),
}
"""The range of each keyword that is a number, both ends included."""

MOST_COMPARED = 10**5
"""Most cells of a grid of which all are compared with the ranges of events (a choice)."""

SAMPLES = (401, 100, 20_001)
"""Default points of a trajectory: fewest, points per unit of time of the window, most (choices).

About 40 points per turn draw a smooth curve, and motions turn more than once in a unit of time.
"""


def integrators() -> tuple[str, ...]:
    """Return the names of all integrators: shipped files, and entry points of installed packages."""
    return tuple(sorted({*_shipped_integrators(), *announced("synchain.integrators")}))


@cache
def _shipped_integrators() -> tuple[str, ...]:
    return tuple(m.name for m in pkgutil.iter_modules([str(METHODS)]) if not m.name.startswith("_"))


def complete(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of all keywords of a scene, together with the model."""
    values = dict(keywords)
    values["title"] = check_text("title", keywords["title"])
    values["rng"] = check_seed("rng", keywords["rng"], LIMITS["rng"][1])
    # Build the model, on the union of drawn graphs.
    values["draws"] = draws(keywords["draws"], keywords["realisations"])
    values |= _model(keywords, values["draws"], values["rng"])
    model: Model = values["model"]
    # Axes, draws and parameters. A parameter has a value for each node or link if a single one is swept or drawn.
    values["axes"] = axes = read_axes(keywords["axes"], keywords["zipped"])
    check_cells(axes, keywords["zipped"], keywords["realisations"])
    drawn = drawn_axes(model, values["draws"], keywords["realisations"], values["rng"])
    values["parameters"] = parameter_values = parameters(model, keywords["parameters"], (*axes, *drawn))
    differing = varied(parameter_values, model.parameters)
    if any(model.link_names(name) for name in differing):
        model.equations(differing)  # raises ValueError for links whose parameters cannot differ
    if GRAPH in values["draws"]:
        _check_graphs(model, differing)
    # Start, records and times.
    values["initial"] = _start(model, keywords["initial"], values["rng"])
    values["t_eval"] = _sample_times(keywords["t_eval"])
    values["record"] = _records(model, keywords["record"], bool(values["t_eval"]))
    values["section"] = _section(model, keywords["section"])
    values["observe"] = observables(model, parameter_values, keywords["observe"])
    values["sections"] = sections(model, parameter_values, keywords["sections"])
    values["stop"] = stop(model, parameter_values, keywords["stop"])
    _check_sections(values)
    values["time_unit"] = _time_unit(model, parameter_values, keywords["time_unit"])
    for name in ("transient", "window"):
        values[name] = check_number(name, keywords[name], *LIMITS[name])
    recorded = (*values["record"], *values["observe"], *values["sections"])
    if recorded and values["window"] == 0.0:
        raise ValueError(f"window: found 0, in which {str(recorded[0])!r} has nothing to record; give a window > 0")
    _check_sample_times(values["t_eval"], values["transient"], values["window"])
    values |= _numerics(keywords, values["record"], values["window"], len(values["t_eval"]))
    # Checks of several keywords together.
    values["continuation"] = check_sweep(model, values)
    check_draws(model, values, drawn)
    check_events(model, parameter_values, (*axes, *drawn), values["zipped"])
    check_physics(model, parameter_values, (*axes, *drawn))
    return values


def _check_graphs(model: Model, differing: tuple[str, ...]) -> None:
    """Raise ValueError for graphs by realisation if a link of weight 0, which stands for no link, still acts."""
    for edge in model.equations(differing).edges:
        acting = next((e for e in edge.expressions if e.xreplace({WEIGHT_NUMBER: sp.S.Zero}) != 0), None)
        if acting is not None:
            raise ValueError(
                f"draw topology: found a link that adds {acting}; expected nothing at the weight W = 0, which stands for no link"
            )


MODEL_KEYWORDS = frozenset({"oscillator", "friction", "contact", "coupling", "topology", "links", "nodes", "draws"})
"""Keywords on which the names of parameters depend."""


def model_of(keywords: Mapping[str, Any]) -> Model:
    """Return the model of a scene with some keywords."""
    drawn = draws(keywords["draws"], keywords["realisations"])
    model: Model = _model(keywords, drawn, check_seed("rng", keywords["rng"], LIMITS["rng"][1]))["model"]
    return model


def _model(keywords: Mapping[str, Any], drawn: Mapping[str, Draws], rng: int) -> dict[str, Any]:
    """Return the model and its parts, on the union of drawn graphs if there are any."""
    oscillator = as_oscillator(keywords["oscillator"])
    if keywords["links"] is not None and keywords["coupling"] not in (None, "spring"):
        raise ValueError("links: found a coupling beside it; expected each layer with its own coupling; leave one out")
    coupling = as_coupling(keywords["coupling"]) if keywords["links"] is None else None
    layers = as_layers(keywords["links"], coupling, keywords["topology"])
    if GRAPH in drawn:
        nodes = drawn_nodes(drawn, rng)  # number of nodes, found without drawing links
        if len(layers) > 1 or (keywords["topology"] is not None and layers[0][1].n != nodes):
            drawn_text = f"{len(layers)} layers of links" if len(layers) > 1 else f"graphs of {nodes} nodes"
            raise ValueError(
                f"draw topology: found {drawn_text}; expected graphs of {layers[0][1].n} nodes for a single layer"
            )
        layers = ((coupling, drawn_graph(drawn, keywords["realisations"], rng)),)
    friction = as_law(keywords["friction"], oscillator)
    groups = as_groups(keywords["nodes"], layers[0][1].n)
    contact = as_contact(keywords["contact"], (oscillator, *(group.oscillator for group in groups)))
    model = Model.of(NodeKind(oscillator, friction), groups, contact, layers)
    single = len(layers) == 1
    return {
        "oscillator": oscillator,
        "contact": contact,
        "topology": model.topology,
        "friction": friction,
        "nodes": groups,
        "coupling": model.layers[0][0] if single else None,
        "links": None if single else model.layers,
        "model": model,
    }


def check_physics(model: Model, parameter_values: Mapping[str, float], axes: Sequence[Axis]) -> None:
    """Check friction and masses at the parameters of the scene and at the ends of its axes."""
    if all(isinstance(kind.oscillator.model, FieldModel) and kind.friction is None for kind in model.kinds):
        return
    for ends in (min, max):
        swept = {axis.name: ends(axis.values) for axis in axes}
        values = {name: swept.get(name, value) for name, value in parameter_values.items()}
        for kind, at_node in at_nodes(model, values):
            check_masses(kind.oscillator, at_node)
            if kind.friction is not None:
                check_power(kind.friction, at_node)


def _start(model: Model, initial: object, rng: int) -> FrozenDict[tuple[float, ...]]:
    """Return the initial states by component; by default around the initial state of each kind of node."""
    for name in model.components:
        base, _, number = name.rpartition("_")
        if base in model.components and number.isdecimal() and 1 <= int(number) <= model.n:
            raise ValueError(f"the state variable {name!r} has the name of {base!r} at node {number}; rename it")
    network = model.unlinked
    by_kind = [
        default_start(tuple(s.name for s in node.state), model.n, kind.oscillator.initial)
        for node, kind in zip(network.nodes, model.kinds, strict=True)
    ]
    defaults = {
        name: tuple(by_kind[model.kind_of[i]][name][i] for i in network.holders(name)) for name in model.components
    }
    return chosen_start(initial, defaults, rng)


def _records(model: Model, record: object, sampled: bool) -> tuple[Record, ...]:
    """Return the records in the order of `Record`, with the trajectory if it is `sampled` at given times.

    The default is the synchronisation error if states can be compared.
    """
    n, common = model.n, bool(model.unlinked.common)
    listed = ((Record.SYNC_ERROR,) if n > 1 and common else ()) if record is None else record
    if not isinstance(listed, (list, tuple)):
        raise TypeError(f"record: found {short_repr(listed)}; expected a list out of {', '.join(Record)}")
    names = [Record.parse("record", name) for name in listed]
    if len(set(names)) < len(names):
        raise ValueError(f"record: found {short_repr(names)}; expected each record once; remove the repetition")
    if n == 1 and Record.SYNC_ERROR in names:
        raise ValueError(
            "record: found 'sync_error' for one oscillator; expected at least two to compare; take it out of record"
        )
    if Record.SYNC_ERROR in names and not common:
        raise ValueError("record: found 'sync_error', but these oscillators have no states of one name to compare")
    if Record.EVENTS in names and not model.unlinked.sticks:
        raise ValueError(
            "record: found 'events', but no node has any; expected set-valued contacts, stops, resets or surfaces"
        )
    names += [Record.TRAJECTORY] if sampled else []
    return tuple(name for name in Record if name in names)


def _sample_times(times: object) -> tuple[float, ...]:
    """Return the sample times; none if they are equally spaced."""
    if times is None:
        return ()
    listed = times.tolist() if hasattr(times, "tolist") else times
    if not is_row(listed):
        raise TypeError(f"t_eval: found {short_repr(times)}; expected a list of times, e.g. [0.1, 0.5, 2]")
    floats = tuple(check_number("t_eval", time) for time in listed)
    if not floats:
        raise ValueError("t_eval: found no times; expected at least one; leave it out")
    unsorted = next((pair for pair in pairwise(floats) if pair[0] >= pair[1]), None)
    if unsorted is not None:
        raise ValueError(f"t_eval: found {unsorted[1]:g} behind {unsorted[0]:g}; expected increasing times; sort them")
    return floats


def _check_sample_times(times: Sequence[float], transient: float, window: float) -> None:
    end = transient + window
    outside = next((time for time in times if not transient <= time <= end), None)
    if outside is not None:
        raise ValueError(
            f"t_eval: found {outside:g}; expected times of the window, from {transient:g} to {end:g}; "
            "change transient and window, or the times"
        )


def _section(model: Model, section_text: object) -> Section:
    """Return the section; by default the first velocity, or the first state of a vector field, falls through 0."""
    states = tuple(s.name for s in model.unlinked.node_at(0).continuous)
    crossed = states[0] if isinstance(model.kinds[model.kind_of[0]].oscillator.model, FieldModel) else states[-1]
    default = f"{'v' if 'v' in states else crossed}_1 falling"
    section = Section.parse(default if section_text is None else section_text)
    model.check_state(section.variable, "section variable")
    return section


def _check_sections(values: Mapping[str, Any]) -> None:
    """Raise ValueError for one name of two variables, and for a section together with sections or a stop."""
    other = "sections" if values["sections"] else "stop" if values["stop"] else None
    if Record.SECTION in values["record"] and other:
        raise ValueError(f"record: found 'section' beside {other}; expected one of them; make it one of the sections")
    if Record.EVENTS in values["record"] and (other or Record.SECTION in values["record"]):
        raise ValueError(f"record: found 'events' beside {other or 'section'}; expected one of them")
    variables = {f"{name}{ending}" for name in values["sections"] for ending in ENDINGS}
    twice = sorted(variables & {*values["observe"]})
    if twice:
        raise ValueError(f"observe: found the name {twice[0]!r}, which a section has; rename one of them")


def _time_unit(model: Model, parameter_values: Mapping[str, float], unit_text: object) -> TimeUnit:
    """Return the unit of time; by default the period of the drive if a period exists at all parameter values."""
    motion = drive(model, parameter_values)
    default = TimeUnit.TIME if motion.frequency is None or motion.by_values else TimeUnit.PERIOD
    unit = default if unit_text is None else TimeUnit.parse("time_unit", unit_text)
    if unit == TimeUnit.PERIOD and motion.frequency is None:
        names = " and ".join(dict.fromkeys(repr(kind.oscillator.name) for kind in model.kinds))
        subject = names if len(model.kinds) == 1 else f"the network of {names}"
        raise ValueError(
            f"time_unit: found 'period', but {subject} {motion.problem}; expected 'time'; change it or leave it out"
        )
    return unit


def _numerics(
    keywords: Mapping[str, object], records: Sequence[Record], window: float, times: int
) -> dict[str, object]:
    """Return the integrator, its tolerances and limits; `times`: number of given sample times."""
    rtol = check_number("rtol", keywords["rtol"], *LIMITS["rtol"])
    atol = rtol / 10 if keywords["atol"] is None else check_number("atol", keywords["atol"], *LIMITS["atol"])
    integrator = check_choice("integrator", keywords["integrator"], ("auto", *integrators()))
    if atol < 1e-300:
        raise ValueError(
            f"atol: found {atol!r}; expected a number above 0, since states pass through 0; take e.g. 1e-10"
        )
    max_steps = check_integer("max_steps", keywords["max_steps"], *LIMITS["max_steps"])
    trajectory = Record.TRAJECTORY in records
    if times:
        if keywords["samples"] is not None:
            raise ValueError("samples: found it beside t_eval; expected one of them; leave one out")
        samples = times
    elif keywords["samples"] is None:
        samples = round(min(max(SAMPLES[0], SAMPLES[1] * window + 1), SAMPLES[2])) if trajectory else 0
    else:
        samples = check_integer("samples", keywords["samples"], *LIMITS["samples"])
    if trajectory and samples < 2 and not times:
        raise ValueError(
            f"samples: found {samples} for the trajectory; expected at least 2, "
            "since both ends of the window are included; raise samples"
        )
    return {"integrator": integrator, "rtol": rtol, "atol": atol, "max_steps": max_steps, "samples": samples}


def _first_below(
    values_of: Mapping[str, tuple[float, ...]],
    zipped: bool,
    high: sp.Expr,
    low: sp.Expr,
    names: Mapping[str, str],
    slack: float = 0.0,
) -> list[str] | None:
    """Return high and low in the first cell with high < low, and where it is; None if there is no such cell."""
    used = {s: names[s.name] for s in sorted(high.free_symbols | low.free_symbols, key=str)}
    values = [values_of[name] for name in used.values()]
    # Zipped axes value by value; of a grid all cells, or if they are many its corners.
    cells: Iterable[tuple[float, ...]] = product(*values)
    if zipped and len({len(v) for v in values} - {1}) == 1:
        longest = max(map(len, values))
        cells = zip(*(v * (longest // len(v)) for v in values), strict=True)
    elif math.prod(map(len, values)) > MOST_COMPARED:
        cells = product(*((min(v), max(v)) for v in values))
    both = sp.lambdify(list(used), [high, low], "math")
    for cell in cells:
        try:
            b, a = map(float, both(*map(float, cell)))
        except (ArithmeticError, TypeError, ValueError):
            continue  # no real number
        if b < a * (1.0 - slack):
            at = ", ".join(f"{name} = {value:.6g}" for name, value in zip(used.values(), cell, strict=True))
            return [f"{b:.6g}", f"{a:.6g}", at and f" at {at}"]
    return None


def check_events(model: Model, parameter_values: Mapping[str, float], axes: Sequence[Axis], zipped: bool) -> None:
    """Raise ValueError if in a cell a stop gains energy, or static friction is below the friction of slow slip."""
    axis_values = {axis.name: tuple(axis.values) for axis in axes}
    values_of = {name: (value,) for name, value in parameter_values.items()} | axis_values
    first_below = partial(_first_below, values_of, zipped)
    of_nodes: list[tuple[NodeKind, Mapping[str, str]]] = list(
        at_nodes(model, {name: name for name in parameter_values})
    )
    of_links: list[tuple[Any, Mapping[str, str]]] = list(at_links(model, parameter_values))
    for part, names in [*((kind.oscillator.model, names) for kind, names in of_nodes), *of_links]:
        for each in (event for event in getattr(part, "events", ()) if isinstance(event, Stop)):
            e, one, zero = each.restitution, sp.S.One, sp.S.Zero
            if not {s.name for s in e.free_symbols} <= names.keys():
                continue
            above = first_below(one, e, names)
            if found := above or first_below(e, zero, names):
                value, at = found[1 if above else 0], found[2]
                text = e.xreplace({s: sp.Symbol(names[s.name]) for s in e.free_symbols})
                raise ValueError(
                    f"stop {each.gap}: found the restitution {text} = {value}{'' if e.is_Symbol else at}; expected a number "
                    "from 0 to 1"
                )

    laws: list[tuple[Any, Mapping[str, str]]] = [
        (law, names)
        for kind, names in of_nodes
        if model.contact == ContactModel.SET_VALUED
        for law in (kind.friction, *kind.oscillator.laws.values())
    ]
    laws += [(each.law, names) for part, names in of_links for each in part.events if isinstance(each, Friction)]
    for law, names in laws:
        if not isinstance(law, FrictionLaw) or not law.parameters.keys() <= names.keys():
            continue  # no law, or parameters of a link that differ between nodes, which the equations refuse
        for pair in law.order:
            low, high = (names[name] for name in pair)
            if found := first_below(sp.Symbol(pair[1]), sp.Symbol(pair[0]), names):
                raise ValueError(
                    f"friction {law}: found {high} = {found[0]} below {low} = {found[1]}; expected {low} <= {high}"
                )
        if (static := static_coefficient(law)) is not None:
            w = sp.Dummy("w", positive=True)
            slow = coefficient_at_rest(friction_coefficient(law, ContactModel.SET_VALUED)(w), w)
            if found := first_below(static, slow, names, slack=1e-12):
                raise ValueError(
                    f"friction {law}: found the static coefficient {found[0]} below {found[1]} of slow slip{found[2]}; "
                    "expected at least as much"
                )
