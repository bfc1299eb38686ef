"""Load public names when they are first used, so that `import synchain` costs next to nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def offer(package: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a module that offers the public names in `homes`."""
    # `homes` maps a name to the module of `synchain` that defines it; a module of that name itself is written "".

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}{_elsewhere(name, package)}")
        if not homes[name]:
            value: Any = import_module(f"{package}.{name}")
        else:
            from synchain.models.inputs.keywords import public

            value = public(getattr(import_module(f"synchain.{homes[name]}"), name), package)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*homes, *(name for name in vars(sys.modules[package]) if name.startswith("__"))})

    return load, names


def _elsewhere(name: str, package: str) -> str:
    """Say which module of `synchain` offers a name that `package` lacks."""
    front = sys.modules["synchain"]
    for module in (front, *(import_module(f"synchain.{part}") for part in front.MODULES)):
        if module.__name__ != package and name in module.__all__:
            return f"; use {module.__name__}.{name}"
    return ""
