"""Leave out stops in links that are open while all oscillators are equal."""

from __future__ import annotations

import sympy as sp

from ..inputs.names import LinkName
from ..interactions.interaction import Potential
from ..mechanics.impacts import Stop
from .scene import Scene


def without_open_stops(scene: Scene) -> Scene:
    """Return the scene without the stops in links that have a positive gap between equal oscillators.

    Small deviations from complete synchronisation cannot close such a gap.  Contacts and other stops stay.
    """
    layers, dropped = [], set[str]()
    for coupling, graph in scene.model.linked:
        if isinstance(coupling, Potential) and coupling.events:
            if not all(isinstance(event, Stop) and _is_open(event, scene) for event in coupling.events):
                return scene
            if coupling.energy == 0:
                raise ValueError(
                    f"coupling '{coupling}': found stops alone, which are open between equal oscillators; expected an energy "
                    "too, which couples small deviations"
                )
            used = {s.name for s in coupling.energy.free_symbols}
            dropped |= {name for name in coupling.parameters if name not in used}
            coupling = Potential(coupling.energy, {k: p for k, p in coupling.parameters.items() if k in used})
        layers.append((coupling, graph))
    if layers == list(scene.model.linked):
        return scene
    links = {name: LinkName.parse(name) for name in scene.given["parameters"] or {}}
    kept = {
        name: value
        for name, value in (scene.given["parameters"] or {}).items()
        if name not in dropped and ((link := links[name]) is None or link.base not in dropped)
    }
    return scene.replace(links=layers, parameters=kept)


def _is_open(stop: Stop, scene: Scene) -> bool:
    """Return True if a stop has a positive gap between equal oscillators, whatever their states are."""
    equal = {s: sp.Symbol(f"{s.name[:-2]}_i", real=True) for s in stop.gap.free_symbols if s.name.endswith("_j")}
    gap = sp.simplify(stop.gap.xreplace(equal))
    values = {s: sp.Float(scene.parameters[s.name]) for s in gap.free_symbols if s.name in scene.parameters}
    gap = gap.xreplace(values)
    return bool(gap.is_number and gap > 0)
