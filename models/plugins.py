"""One-file plug-ins: found by listing their directory, called with the symbols their functions ask for by name.

Besides the files of this package there are entry points of installed packages (groups ``synchain.oscillators``,
``synchain.frictions``, ``synchain.couplings``, ``synchain.topologies``), and files anywhere, named by a path that ends in
``.py``.  Such a file is run only after `allow_code` has been called for it, so that a scene, which is data, never runs code
by itself.
"""

from __future__ import annotations

import inspect
import pkgutil
import traceback
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from .scene_checks import shown, suggestion

__all__ = ["allow_code", "allowed_code", "call", "load", "located", "names"]

OTHERWISE = {"coupling": ", or components such as 'x->x'"}
"""What a kind can be besides the name of a file, for the message that refuses a name."""

NEEDED = {"oscillator": ("PARAMETERS", "FRICTION"), "friction": ("PARAMETERS", "force"), "coupling": ("PARAMETERS",),
          "topology": ("SUMMARY", "MINIMUM", "edges")}  # fmt: skip
ONE_OF = {"oscillator": ("field", "kinetic"), "coupling": ("potential", "dissipation")}
"""What a file from outside must hold; of ONE_OF at least one."""

ALSO = {
    "topology": {
        "all_to_all": "complete",
        "biclique": "complete_bipartite",
        "clique": "complete",
        "cubic": "random_cubic",
        "cycle": "ring",
        "gilbert": "erdos_renyi",
        "gnp": "erdos_renyi",
        "hamming": "hypercube",
        "lattice": "grid",
        "line": "chain",
        "newman_watts": "small_world",
        "open_chain": "chain",
        "path": "chain",
        "watts_strogatz": "small_world",
    },
    "oscillator": {"roessler": "rossler", "vdp": "van_der_pol"},
    "coupling": {"dashpot": "damper"},
}
"""Other names of the field for what is here: they serve suggestions only."""

_allowed: set[Path] = set()


def names(kind: str) -> tuple[str, ...]:
    """Return the names of all plug-ins of a kind (``oscillator``, ``friction``, ``coupling``, ``topology``), sorted."""
    return tuple(sorted({*_own(kind), *_entry_points(kind)}))


def allow_code(*paths: str | Path) -> None:
    """Allow files outside the package to be run as plug-ins, from now on; ValueError where one is no .py file.

    Afterwards their paths are names: Scene(friction="./my_law.py").  Only allow what you have read.
    """
    for path in paths:
        place = Path(path)
        if place.suffix != ".py" or not place.is_file():
            raise ValueError(f"plug-in {str(path)!r} is no file that ends in .py; check the path")
        _allowed.add(place.resolve())


def allowed_code() -> tuple[str, ...]:
    """The files outside the package that may be run as plug-ins, sorted."""
    return tuple(sorted(map(str, _allowed)))


def load(kind: str, name: str) -> ModuleType:
    """Return the plug-in module `name`; raises ValueError with the known names where there is none.

    A path that ends in ".py" is loaded where `allow_code` has allowed it; an error in that file names its line.
    """
    if name in _own(kind):
        return import_module(f".{_home(kind)}.{name}", __package__)
    if isinstance(name, str) and name.endswith(".py"):
        return _file(kind, name)
    entries = _entry_points(kind)
    if name in entries:
        return _entry(kind, name)
    known = names(kind)
    hint = suggestion(name, known, ALSO.get(kind))
    raise ValueError(f"unknown {kind} {shown(name)}; known: {', '.join(known)}{OTHERWISE.get(kind, '')}{hint}")


def call(function: Callable[..., Any], symbols: Mapping[str, Any]) -> Any:
    """Call a plug-in's function with those of `symbols` that its signature names.

    Raises ValueError where it asks for a name that is not among them, and where a function from outside the package
    fails, with its file and line.
    """
    wanted = inspect.signature(function).parameters
    for name in wanted:
        if name not in symbols:
            where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
            raise ValueError(f"{where} asks for {name!r}; known: {', '.join(symbols)}; declare it as a parameter")
    given = {name: symbols[name] for name in wanted}
    try:
        return function(**given)
    except Exception as error:
        told = located(error, function)
        if told is error:
            raise
        raise told from error


def _home(kind: str) -> str:
    """The folder of a kind, which also names its entry points."""
    return "topologies" if kind == "topology" else f"{kind}s"


def located(error: Exception, function: Callable[..., Any]) -> Exception:
    """The error of a plug-in's function: as it is from this package, else a ValueError with file and line."""
    if str(function.__module__).startswith(f"{__package__}."):
        return error
    return _located(error, inspect.getsourcefile(function) or function.__module__)


def _own(kind: str) -> tuple[str, ...]:
    package = import_module(f".{_home(kind)}", __package__)
    return tuple(m.name for m in pkgutil.iter_modules(package.__path__) if not m.name.startswith("_"))


@lru_cache(maxsize=8)
def _entry_points(kind: str) -> Mapping[str, Any]:
    """The plug-ins that installed packages announce; none is loaded for this."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group=f"synchain.{_home(kind)}")}


def _entry(kind: str, name: str) -> ModuleType:
    entry = _entry_points(kind)[name]
    try:
        module = entry.load()
    except Exception as error:
        raise _located(error, "", f"{kind} {name!r} of the entry point {entry.value!r}") from error
    return _complete(kind, module, f"{kind} {name!r} of the entry point {entry.value!r}")


def _file(kind: str, name: str) -> ModuleType:
    place = Path(name).resolve()
    if place not in _allowed:
        raise ValueError(
            f"{kind} {name!r} is a file of code, which is not run unasked; read it, then allow it: "
            f"synchain.models.plugins.allow_code({name!r}), or --allow-code where a command has it"
        )
    return _run(kind, place)


@lru_cache(maxsize=64)
def _run(kind: str, place: Path) -> ModuleType:
    spec = spec_from_file_location(f"synchain_{kind}_{place.stem}", place)
    if spec is None or spec.loader is None:
        raise ValueError(f"{kind} {str(place)!r} cannot be loaded as Python; expected a .py file")
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise _located(error, str(place)) from error
    return _complete(kind, module, str(place))


def _complete(kind: str, module: Any, where: str) -> ModuleType:
    """The module, where it holds what its kind must hold."""
    missing = [name for name in NEEDED[kind] if not hasattr(module, name)]
    choice = ONE_OF.get(kind, ())
    if choice and not any(hasattr(module, name) for name in choice):
        missing.append(" or ".join(choice))
    if missing or not isinstance(module, ModuleType):
        found = "no module" if not isinstance(module, ModuleType) else f"no {', no '.join(missing)}"
        raise ValueError(f"{where}: found {found}; expected a {kind} file; see: synchain new {kind} NAME")
    return module


def _located(error: Exception, file: str, what: str = "") -> ValueError:
    """An error in a plug-in with the file and the line where it arose; without `file`, the innermost one."""
    frames = traceback.extract_tb(error.__traceback__)
    places = [(frame.filename, frame.lineno) for frame in frames if file in ("", frame.filename)]
    if isinstance(error, SyntaxError) and error.filename and file in ("", error.filename):
        places.append((error.filename, error.lineno))
    place = f"{places[-1][0]}, line {places[-1][1]}" if places else file
    where = f"{what}: {place}" if what else place
    return ValueError(f"{where}: {type(error).__name__}: {' '.join(str(error).split())}; correct the file")
