"""What a friction law asks of its parameters together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .plugins import load
from .scene_parameters import at_nodes

__all__ = ["check_friction"]


def check_friction(made: Mapping[str, Any]) -> None:
    """Raise ValueError for set-valued friction with a static coefficient below that of slip, which can neither hold nor
    slip: a law names such pairs in ORDER, the smaller parameter first."""
    if made["contact"] != "set-valued":
        return
    for _, friction, own in at_nodes(made, {name: name for name in made["parameters"]}):
        if friction is not None:
            for low, high in getattr(load("friction", friction), "ORDER", ()):
                _check_order(made, friction, own[low], own[high])


def _check_order(made: Mapping[str, Any], friction: str, low: str, high: str) -> None:
    """Compare two parameters in all cells."""
    axes = {axis.name: axis.values for axis in made["axes"]}
    lows, highs = (axes.get(name, (made["parameters"][name],)) for name in (low, high))
    together = made["zipped"] and low in axes and high in axes
    for a, b in zip(lows, highs, strict=True) if together else ((max(lows), min(highs)),):
        if b < a:
            raise ValueError(f"friction {friction}: found {high} = {b!r} below {low} = {a!r}; expected {low} <= {high}")
