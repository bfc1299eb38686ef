"""From what a user gave to a complete scene: defaults filled in, every value checked against the model."""

from __future__ import annotations

import pkgutil
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import sympy as sp

from ..dynamics.record import Record
from ..inputs.checks import check_choice, check_integer, check_number, check_text, short_repr
from ..inputs.entry_points import announced
from ..inputs.frozen import FrozenDict
from ..inputs.words import Word
from ..mechanics.components import WEIGHT_NUMBER
from ..mechanics.contact import ContactModel, FrictionLaw
from ..mechanics.oscillator import FieldModel
from ..mechanics.physics import check_masses, check_power
from ..networks.layers import as_contact, as_coupling, as_groups, as_law, as_layers, as_oscillator
from ..networks.model import Model, NodeKind
from ..sweeps.axis import LIMIT, Axis
from ..sweeps.checked_axes import check_cells, check_draws, check_sweep, read_axes
from ..sweeps.draw import GRAPH, Draws, drawn_axes, drawn_graph, drawn_nodes, draws
from ..sweeps.initial_values import SEED_LIMIT, chosen_start, default_start
from ..sweeps.parameters import at_nodes, drive, parameters, varied
from .observables import ENDINGS, observables, sections, stop
from .section import Section


class TimeUnit(Word):
    """What `transient` and `window` count."""

    PERIOD = "period"
    TIME = "time"


METHODS = Path(__file__).parents[2] / "codegen" / "integrators"
"""The folder of the integrators, one file each: listed here, imported by the code generator alone."""

LIMITS: Mapping[str, tuple[Any, Any]] = {
    "transient": (0.0, sys.float_info.max),
    "window": (0.0, sys.float_info.max),
    "rtol": (1e-15, 0.1),
    "atol": (0.0, 0.1),
    "max_steps": (1, 10**12),
    "samples": (0, 10**8),
    "seed": (0, SEED_LIMIT),
    "realisations": (0, LIMIT),
    "rng": (0, SEED_LIMIT),
}
"""The range of each number that belongs to a keyword, both ends in it."""


def integrators() -> tuple[str, ...]:
    """Return the names of all integrators: shipped files, and entry points of installed packages."""
    return tuple(sorted({*_shipped_integrators(), *announced("synchain.integrators")}))


@cache
def _shipped_integrators() -> tuple[str, ...]:
    return tuple(m.name for m in pkgutil.iter_modules([str(METHODS)]) if not m.name.startswith("_"))


def complete(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a scene's keywords, and its model."""
    values = dict(given)
    values["title"] = check_text("title", given["title"])
    values["seed"] = check_integer("seed", given["seed"], *LIMITS["seed"])
    values["draws"] = draws(given["draws"], given["realisations"])
    values["rng"] = check_integer("rng", given["rng"], *LIMITS["rng"])
    values |= _model(given, values["draws"], values["rng"])
    model: Model = values["model"]
    values["axes"] = axes = read_axes(given["axes"], given["zipped"])
    check_cells(axes, given["zipped"], given["realisations"])
    drawn = drawn_axes(model, values["draws"], given["realisations"], values["rng"])
    values["parameters"] = numbers = parameters(model, given["parameters"], (*axes, *drawn))
    own = varied(numbers, model.parameters)
    if any(model.link_names(name) for name in own):
        model.equations(own)  # refuses links that can have no numbers of their own
    if GRAPH in values["draws"]:
        _check_graphs(model, own)
    values["initial"] = _start(model, given["initial"], values["seed"])
    values["record"] = _records(model, given["record"])
    values["section"] = _section(model, given["section"])
    values["observe"] = observables(model, numbers, given["observe"])
    values["sections"] = sections(model, numbers, given["sections"])
    values["stop"] = stop(model, numbers, given["stop"])
    _check_sections(values)
    values |= _times(model, numbers, given)
    for name in ("transient", "window"):
        values[name] = check_number(name, given[name], *LIMITS[name])
    recorded = (*values["record"], *values["observe"], *values["sections"])
    if recorded and values["window"] == 0.0:
        raise ValueError(f"window: found 0, in which {str(recorded[0])!r} has nothing to record; give a window > 0")
    values |= _numerics(given, values["record"])
    values["continuation"] = check_sweep(model, values)
    check_draws(model, values, drawn)
    _check_friction(model, numbers, (*axes, *drawn), values["zipped"])
    _check_physics(model, numbers, (*axes, *drawn))
    return values


def _check_graphs(model: Model, own: tuple[str, ...]) -> None:
    """Refuse graphs by realisation if a link of weight 0, which stands for none, acts."""
    for edge in model.equations(own).edges:
        acting = next((e for e in edge.expressions if e.xreplace({WEIGHT_NUMBER: sp.S.Zero}) != 0), None)
        if acting is not None:
            raise ValueError(
                f"draw topology: found a link that adds {acting}; expected nothing at the weight W = 0, which stands for no link"
            )


def _model(given: Mapping[str, Any], drawn: Mapping[str, Draws], rng: int) -> dict[str, Any]:
    """The parts of the model, and the model, on the union of the graphs that are drawn if there are any."""
    oscillator = as_oscillator(given["oscillator"])
    if given["links"] is not None and given["coupling"] not in (None, "spring"):
        raise ValueError("links: found a coupling beside it; expected each layer with its own coupling; leave one out")
    coupling = as_coupling(given["coupling"]) if given["links"] is None else None
    layers = as_layers(given["links"], coupling, given["topology"])
    if GRAPH in drawn:
        nodes = drawn_nodes(drawn, rng)  # known before any link is drawn
        if len(layers) > 1 or (given["topology"] is not None and layers[0][1].n != nodes):
            found = f"{len(layers)} layers of links" if len(layers) > 1 else f"graphs of {nodes} nodes"
            raise ValueError(
                f"draw topology: found {found}; expected graphs of {layers[0][1].n} nodes for a single layer"
            )
        layers = ((coupling, drawn_graph(drawn, given["realisations"], rng)),)
    friction = as_law(given["friction"], oscillator)
    groups = as_groups(given["nodes"], layers[0][1].n)
    contact = as_contact(given["contact"], (oscillator, *(group.oscillator for group in groups)))
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


def _check_physics(model: Model, numbers: Mapping[str, float], axes: Sequence[Axis]) -> None:
    """Refuse wrong physics at the scene's parameters and at the ends of its axes."""
    if all(isinstance(kind.oscillator.model, FieldModel) and kind.friction is None for kind in model.kinds):
        return
    for ends in (min, max):
        swept = {axis.name: ends(axis.values) for axis in axes}
        values = {name: swept.get(name, value) for name, value in numbers.items()}
        for kind, own in at_nodes(model, values):
            check_masses(kind.oscillator, own)
            if kind.friction is not None:
                check_power(kind.friction, own)


def _start(model: Model, given: object, seed: int) -> FrozenDict[tuple[float, ...]]:
    """The initial states, component by component, those of each kind of node around its own centre."""
    for name in model.components:
        base, _, number = name.rpartition("_")
        if base in model.components and number.isdecimal() and 1 <= int(number) <= model.n:
            raise ValueError(f"the state variable {name!r} has the name of {base!r} at node {number}; rename it")
    apart = model.unlinked
    own = [
        default_start(tuple(s.name for s in node.state), model.n, kind.oscillator.initial)
        for node, kind in zip(apart.nodes, model.kinds, strict=True)
    ]
    defaults = {name: tuple(own[model.kind_of[i]][name][i] for i in apart.holders(name)) for name in model.components}
    return chosen_start(given, defaults, seed)


def _records(model: Model, given: object) -> tuple[Record, ...]:
    """What is recorded, in the order of the words."""
    n, common = model.n, bool(model.unlinked.common)
    found = ((Record.SYNC_ERROR,) if n > 1 and common else ()) if given is None else given
    if not isinstance(found, (list, tuple)):
        raise TypeError(f"record: found {short_repr(found)}; expected a list out of {', '.join(Record)}")
    names = [Record.parse("record", name) for name in found]
    if len(set(names)) < len(names):
        raise ValueError(f"record: found {short_repr(names)}; expected each record once; remove the repetition")
    if n == 1 and Record.SYNC_ERROR in names:
        raise ValueError(
            "record: found 'sync_error' for one oscillator; expected at least two to compare; take it out of record"
        )
    if Record.SYNC_ERROR in names and not common:
        raise ValueError("record: found 'sync_error', but these oscillators have no states of one name to compare")
    return tuple(name for name in Record if name in names)


def _section(model: Model, given: object) -> Section:
    """The section: unless it is given, a velocity of the first node falls through 0, or the state of a vector field."""
    own = tuple(s.name for s in model.unlinked.node_at(0).state)
    crossed = own[0] if isinstance(model.kinds[model.kind_of[0]].oscillator.model, FieldModel) else own[-1]
    default = f"{'v' if 'v' in own else crossed}_1 falling"
    section = Section.parse(default if given is None else given)
    model.check_state(section.variable, "section variable")
    return section


def _check_sections(values: Mapping[str, Any]) -> None:
    """Refuse two names for one variable, and two ways to say a section."""
    other = "sections" if values["sections"] else "stop" if values["stop"] else None
    if Record.SECTION in values["record"] and other:
        raise ValueError(f"record: found 'section' beside {other}; expected one of them; make it one of the sections")
    made = {f"{name}{more}" for name in values["sections"] for more in ENDINGS}
    twice = sorted(made & {*values["observe"]})
    if twice:
        raise ValueError(f"observe: found the name {twice[0]!r}, which a section has; rename one of them")


def _times(model: Model, numbers: Mapping[str, float], given: Mapping[str, object]) -> dict[str, object]:
    """The unit of time: the period of the drive if there is one."""
    motion = drive(model, numbers)
    default = TimeUnit.TIME if motion.frequency is None or motion.by_values else TimeUnit.PERIOD
    unit = default if given["time_unit"] is None else TimeUnit.parse("time_unit", given["time_unit"])
    if unit == TimeUnit.PERIOD and motion.frequency is None:
        names = " and ".join(dict.fromkeys(repr(kind.oscillator.name) for kind in model.kinds))
        whole = names if len(model.kinds) == 1 else f"the network of {names}"
        raise ValueError(
            f"time_unit: found 'period', but {whole} {motion.problem}; expected 'time'; change it or leave it out"
        )
    return {"time_unit": unit}


def _numerics(given: Mapping[str, object], records: Sequence[Record]) -> dict[str, object]:
    """The integrator, its tolerances and limits."""
    rtol = check_number("rtol", given["rtol"], *LIMITS["rtol"])
    atol = rtol / 10 if given["atol"] is None else check_number("atol", given["atol"], *LIMITS["atol"])
    integrator = check_choice("integrator", given["integrator"], ("auto", *integrators()))
    if atol < 1e-300:
        raise ValueError(
            f"atol: found {atol!r}; expected a number above 0, since states pass through 0; take e.g. 1e-10"
        )
    max_steps = check_integer("max_steps", given["max_steps"], *LIMITS["max_steps"])
    samples = check_integer("samples", given["samples"], *LIMITS["samples"])
    if Record.TRAJECTORY in records and samples < 2:
        raise ValueError(
            f"samples: found {samples} for the trajectory; expected at least 2, "
            "since both ends of the window are included; raise samples"
        )
    return {"integrator": integrator, "rtol": rtol, "atol": atol, "max_steps": max_steps, "samples": samples}


def _check_friction(model: Model, numbers: Mapping[str, float], axes: Sequence[Axis], zipped: bool) -> None:
    """Refuse set-valued friction whose static coefficient is below that of slip, which can neither hold nor slip."""
    if model.contact != ContactModel.SET_VALUED:
        return
    for kind, own in at_nodes(model, {name: name for name in numbers}):
        if kind.friction is not None:
            for low, high in kind.friction.order:
                _check_order(kind.friction, (own[low], own[high]), numbers, axes, zipped)


def _check_order(
    friction: FrictionLaw, pair: tuple[str, str], numbers: Mapping[str, float], axes: Sequence[Axis], zipped: bool
) -> None:
    """Compare two parameters in all cells, the smaller one first."""
    low, high = pair
    swept = {axis.name: axis.values for axis in axes}
    lows, highs = (swept.get(name, (numbers[name],)) for name in pair)
    together = zipped and low in swept and high in swept
    for a, b in zip(lows, highs, strict=True) if together else ((max(lows), min(highs)),):
        if b < a:
            raise ValueError(f"friction {friction}: found {high} = {b!r} below {low} = {a!r}; expected {low} <= {high}")
