"""Frozen values as JSON and arrays, and back: no code runs when they are read.

Numbers stand in the JSON, arrays in the dataset: an array that the labelled data hold already is
named, any other becomes a variable of its own.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.dictionary import graph_of, graph_table
from synchain.models.scenes.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

Tree: TypeAlias = "dict[str, Any]"
Variables: TypeAlias = "dict[str, tuple[tuple[str, ...], np.ndarray]]"


def encode(value: object, data: xr.Dataset) -> tuple[Tree, Variables]:
    """Return the fields of a frozen value as JSON types, and the arrays that `data` lack."""
    writer = _SceneCollector(data)
    tree = writer.tree(value, "")
    return {"root": tree, "scenes": [json.loads(text) for text in writer.scenes]}, writer.further


def decode(tree: Mapping[str, Any], data: xr.Dataset, classes: Mapping[str, type]) -> Any:
    """Return the value of a tree."""
    return _ValueReader(data, classes, [Scene.from_dict(each) for each in tree["scenes"]]).value(tree["root"])


class _SceneCollector:
    """Collects the scenes and the further arrays of a value."""

    def __init__(self, data: xr.Dataset) -> None:
        self.data = data
        self.scenes: dict[str, int] = {}
        self.further: Variables = {}

    def tree(self, value: Any, path: str) -> Any:
        """The value in JSON types; `path` names it in the dataset."""
        if isinstance(value, Enum):
            return {"enum": [type(value).__name__, value.value]}
        if isinstance(value, np.generic):
            return self.tree(value.item(), path)
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray):
            return self._array(value, path)
        if isinstance(value, tuple | list):
            return [self.tree(item, f"{path}_{k}" if path else str(k)) for k, item in enumerate(value)]
        return self._tagged(value, path)

    def _tagged(self, value: Any, path: str) -> Tree:
        if isinstance(value, complex):
            return {"complex": [value.real, value.imag]}
        if isinstance(value, Fraction):
            return {"fraction": str(value)}
        if isinstance(value, Scene):
            text = json.dumps(value.as_dict(), sort_keys=True)
            return {"scene": self.scenes.setdefault(text, len(self.scenes))}
        if isinstance(value, FrozenDict):
            return {"table": {name: self.tree(item, f"{path}_{name}") for name, item in value.items()}}
        if isinstance(value, Topology):
            return {"graph": graph_table(value)}
        if is_dataclass(value) and not isinstance(value, type):
            parts = {
                own.name: self.tree(getattr(value, own.name), f"{path}_{own.name}".lstrip("_"))
                for own in fields(value)
                if own.init
            }
            return {"value": type(value).__name__, "fields": parts}
        raise TypeError(f"{path}: found {type(value).__name__}; expected numbers, arrays, texts or frozen values")

    def _array(self, values: np.ndarray, path: str) -> Tree:
        known = self.data.get(path)
        if (
            known is None
            or known.shape != values.shape
            or not np.array_equal(known.values, values, equal_nan=values.dtype.kind in "fc")
        ):
            path = f"field_{path}"
            self.further[path] = (tuple(f"{path}_{k}" for k in range(values.ndim)), values)
        return {"array": path, "dtype": values.dtype.str}


class _ValueReader:
    """Makes values of a tree again."""

    def __init__(self, data: xr.Dataset, classes: Mapping[str, type], scenes: list[Scene]) -> None:
        self.data, self.classes, self.scenes = data, classes, scenes

    def value(self, tree: Any) -> Any:
        """The value of a part of the tree."""
        if isinstance(tree, list):
            return tuple(map(self.value, tree))
        if not isinstance(tree, dict):
            return tree
        if "value" in tree:
            return self.classes[tree["value"]](**{name: self.value(part) for name, part in tree["fields"].items()})
        ((tag, part),) = ((tag, part) for tag, part in tree.items() if tag != "dtype")
        if tag == "array":
            return np.array(self.data[part].values, dtype=np.dtype(tree["dtype"]))
        if tag == "enum":
            return self.classes[part[0]](part[1])
        readers: dict[str, Callable[[], Any]] = {
            "complex": lambda: complex(*part),
            "fraction": lambda: Fraction(part),
            "graph": lambda: graph_of(part),
            "table": lambda: FrozenDict({name: self.value(item) for name, item in part.items()}),
        }
        return readers[tag]() if tag in readers else self.scenes[part]
