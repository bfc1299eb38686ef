"""The front door: all names of the models and of the runtime, each loaded when it is first used.

``import synchain`` is this file.  It knows the two packages and nothing of their rooms;
`__init__.pyi` says to editors what it offers.
"""

from __future__ import annotations

from typing import Any

from synchain import models, runtime


def __getattr__(name: str) -> Any:
    if name == "__all__":
        value: Any = [public for public in __dir__() if not public.startswith("__")]
    elif name == "__version__":
        from importlib.metadata import version

        value = version("synchain")
    else:
        home = next((package for package in (runtime, models) if name in dir(package)), None)
        if home is None or name.startswith("_"):
            raise AttributeError(f"module 'synchain' has no attribute {name!r}")
        value = getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    own = {name for name in globals() if name.startswith("__")}
    return sorted({*own, "__version__", "models", "runtime", *runtime.__all__, *_offered(models)})


def _offered(package: Any) -> list[str]:
    return [name for name in dir(package) if not name.startswith("_")]
