"""What a friction law asks of its parameters together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .plugins import load

__all__ = ["check_friction"]


def check_friction(made: Mapping[str, Any]) -> None:
    """Raise ValueError for set-valued friction with a static coefficient below that of slip, which can neither hold nor
    slip: a law names such pairs in ORDER, the smaller parameter first."""
    if made["friction"] is None or made["contact"] != "set-valued":
        return
    axes = {axis.name: axis.values for axis in made["axes"]}
    for low, high in getattr(load("friction", made["friction"]), "ORDER", ()):
        lows, highs = (_values(made, axes, name) for name in (low, high))
        together = made["zipped"] and low in axes and high in axes
        pairs = zip(lows, highs, strict=True) if together else ((max(lows), min(highs)),)
        for a, b in pairs:
            if b < a:
                raise ValueError(
                    f"friction {made['friction']}: found {high} = {b!r} below {low} = {a!r}; expected {low} <= {high}"
                )


def _values(made: Mapping[str, Any], axes: Mapping[str, tuple[float, ...]], name: str) -> tuple[float, ...]:
    """The values of a parameter in all cells, and at all nodes where these differ."""
    own = (key for key in made["parameters"] if key == name or key.rpartition("_")[0] == name)
    return tuple(value for key in own for value in axes.get(key, (made["parameters"][key],)))
