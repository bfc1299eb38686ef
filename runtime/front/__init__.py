"""The package `synchain`: all names of its models and of its runtime, each loaded when it is first used.

``import synchain`` is this file, which imports the two packages and none of their rooms; editors read the names in
`__init__.pyi`.
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
    dunders = {name for name in globals() if name.startswith("__")}
    of_models = (name for name in dir(models) if not name.startswith("_"))
    return sorted({*dunders, "__version__", "models", "runtime", *runtime.__all__, *of_models})
