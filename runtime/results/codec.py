"""Convert frozen values to JSON and arrays, and back; reading executes no code from the file.

Numbers are stored in the JSON, arrays in the dataset.  The JSON refers by name to an array that is already in the
labelled data; any other array becomes a new variable.  A file can name only classes that occur in the types of the
fields of its result.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, get_args, get_type_hints

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.dictionary import graph_of, graph_table
from synchain.models.scenes.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

Tree: TypeAlias = "dict[str, Any]"
Variables: TypeAlias = "dict[str, tuple[tuple[str, ...], np.ndarray]]"
T = TypeVar("T")


def encode(value: object, data: xr.Dataset) -> tuple[Tree, Variables]:
    """Return the fields of a frozen value in JSON types, and the arrays that are not in `data`."""
    writer = _Encoder(data, _classes_in(type(value)))
    root = writer.tree(value, "")
    return {"root": root, "scenes": [json.loads(text) for text in writer.scenes]}, writer.arrays


def decode(tree: Mapping[str, Any], data: xr.Dataset, kind: type[T]) -> T:
    """Return the value of a JSON tree; ValueError if the value is not of the class `kind`."""
    if (name := tree["root"]["value"]) != kind.__name__:
        raise ValueError(f"it holds a {name}; expected a result of the kind {kind.__name__}")
    scenes = [Scene.from_dict(each) for each in tree["scenes"]]
    value: T = _Reader(data, _classes_in(kind), scenes).value(tree["root"])
    return value


def _classes_in(kind: type) -> dict[str, type]:
    """Return a frozen class, and the frozen classes and enums in the types of its fields, by name."""
    classes: dict[str, type] = {}
    hints: list[Any] = [kind]
    while hints:
        hint = hints.pop()
        hints += get_args(hint)  # of tuple[Branch, ...], Scene | None …
        # skip scenes and graphs, which have separate text forms
        if isinstance(hint, type) and hint not in (Scene, Topology, classes.get(hint.__name__)):
            if issubclass(hint, Enum) or is_dataclass(hint):
                classes[hint.__name__] = hint
            if is_dataclass(hint):
                hints += get_type_hints(hint).values()
    return classes


class _Encoder:
    """Convert a value to a JSON tree; collect its scenes and the arrays that are not in the dataset."""

    def __init__(self, data: xr.Dataset, classes: Mapping[str, type]) -> None:
        self.data, self.classes = data, classes
        self.scenes: dict[str, int] = {}  # index of each scene, by the JSON of the scene
        self.arrays: Variables = {}

    def tree(self, value: Any, path: str) -> Any:
        """Return the value in JSON types; `path` names it in the dataset."""
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, Enum):
            return {"enum": [type(value).__name__, value.value]}
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray):
            return self._array(value, path)
        if isinstance(value, tuple | list):
            return [self.tree(item, f"{path}_{k}" if path else str(k)) for k, item in enumerate(value)]
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
        if is_dataclass(value) and self.classes.get(type(value).__name__) is type(value):
            names = [field.name for field in fields(value) if field.init]
            parts = {name: self.tree(getattr(value, name), f"{path}_{name}".lstrip("_")) for name in names}
            return {"value": type(value).__name__, "fields": parts}
        raise TypeError(f"{path}: found {type(value).__name__}; expected numbers, arrays, texts or frozen values")

    def _array(self, values: np.ndarray, path: str) -> Tree:
        if not values.size:  # netCDF-3 has no dimension of length 0
            return {"empty": values.shape, "dtype": values.dtype.str}
        labelled = self.data.get(path)
        if (
            labelled is None
            or labelled.shape != values.shape
            or not np.array_equal(labelled.values, values, equal_nan=values.dtype.kind in "fc")
        ):
            path = f"field_{path}"
            self.arrays[path] = (tuple(f"{path}_{k}" for k in range(values.ndim)), values)
        return {"array": path, "dtype": values.dtype.str}


class _Reader:
    """Build values from a JSON tree."""

    def __init__(self, data: xr.Dataset, classes: Mapping[str, type], scenes: list[Scene]) -> None:
        self.data, self.classes, self.scenes = data, classes, scenes

    def value(self, tree: Any) -> Any:
        if isinstance(tree, list):
            return tuple(map(self.value, tree))
        if not isinstance(tree, dict):
            return tree
        if "value" in tree:
            return self.classes[tree["value"]](**{name: self.value(part) for name, part in tree["fields"].items()})
        ((tag, part),) = ((tag, part) for tag, part in tree.items() if tag != "dtype")
        readers: dict[str, Callable[[], Any]] = {
            "array": lambda: np.array(self.data[part].values, dtype=np.dtype(tree["dtype"])),
            "complex": lambda: complex(*part),
            "empty": lambda: np.zeros(part, dtype=np.dtype(tree["dtype"])),
            "enum": lambda: self.classes[part[0]](part[1]),
            "fraction": lambda: Fraction(part),
            "graph": lambda: graph_of(part),
            "scene": lambda: self.scenes[part],
            "table": lambda: FrozenDict({name: self.value(item) for name, item in part.items()}),
        }
        return readers[tag]()
