"""One-file plug-ins: found by listing their directory, called with the symbols their functions ask for by name.

Besides the files of this package there are entry points of installed packages (groups ``synchain.oscillators``,
``synchain.frictions``, ``synchain.couplings``, ``synchain.topologies``), and files anywhere, named by a path that ends in
``.py``.  Such a file is run only after `allow_code` has been called for it, so that a scene, which is data, never runs code
by itself.

A file outside the package is known by its text, so that an edited file is another model.  What such a file imports is
not looked at: write a model in one file.
"""

from __future__ import annotations

import hashlib
import inspect
import pkgutil
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .checks import check_path, check_text, short_repr, suggestion

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = [
    "OwnFile",
    "PluginKind",
    "allow_code",
    "allowed_code",
    "blamed",
    "call",
    "load",
    "located",
    "named",
    "names",
    "part",
]

PACKAGE = "synchain.models"
"""The package whose folders hold the plug-ins that are shipped."""


@dataclass(frozen=True, slots=True)
class PluginKind:
    """A kind of plug-in, defined by the room that knows what such a file must hold."""

    name: str  # what a file of the kind is called in messages: "oscillator"
    folder: str  # the folder of `synchain.models` that holds the shipped files; it names the group of entry points too
    # called with the module of a file from outside, its name in messages and its text; raises ValueError if the
    # module is not what the kind must be
    check: Callable[[ModuleType, str, bytes], None] = field(compare=False, repr=False)
    # other names of shipped files: what they name is what the file's own name names, unless there is a file of that
    # name
    also: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    # names of other things that are close to a shipped file; they serve suggestions only
    near: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    # what a name can be besides that of a file, for the message that refuses a name
    otherwise: str = field(default="", compare=False, repr=False)


class OwnFile(str):
    """The name of a plug-in file outside the package, as it was written, with the file and the text that it stands for.

    Two of them are equal if name, place and text are equal; none is equal to a plain text.  So whatever is kept for a
    name is kept for one text of one file.
    """

    __slots__ = ("digest", "place")
    place: str
    digest: str

    def __new__(cls, name: str, place: str, digest: str) -> OwnFile:
        file = super().__new__(cls, name)
        file.place, file.digest = place, digest
        return file

    def _key(self) -> tuple[str, str, str]:
        return str(self), self.place, self.digest

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OwnFile) and self._key() == other._key()

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[type[OwnFile], tuple[str, str, str]]:
        return OwnFile, self._key()


_modules: dict[tuple[str, str, str], ModuleType] = {}
"""Kind, place and digest of the text -> what came of it; scenes keep the model that they were made with."""

_allowed: set[Path] = set()


def names(kind: PluginKind) -> tuple[str, ...]:
    """Return the sorted names of all plug-ins of a kind."""
    return tuple(sorted({*_own(kind), *_entry_points(kind)}))


def allow_code(*paths: str | Path) -> None:
    """Allow files outside the package to be run as plug-ins, from now on.

    Afterwards their paths are names: Scene(friction="./my_law.py").  Only allow what you have read.

    Parameters
    ----------
    *paths : str or Path
        The files.

    Raises
    ------
    ValueError
        If one is no file that ends in .py.
    """
    for path in paths:
        place = check_path("plug-in", path)
        if place.suffix != ".py" or not place.is_file():
            raise ValueError(f"plug-in {str(path)!r} is no file that ends in .py; check the path")
        _allowed.add(place.resolve())


def allowed_code() -> tuple[str, ...]:
    """The files outside the package that may be run as plug-ins, sorted."""
    return tuple(sorted(map(str, _allowed)))


def named(kind: PluginKind, name: str) -> str:
    """Return the own name of a plug-in; of a file outside the package an `OwnFile` of its present text.

    What is an `OwnFile` already stays what it is, whatever has become of its file.
    """
    if isinstance(name, OwnFile) or not (isinstance(name, str) and name.endswith(".py")):
        return name if name not in kind.also or name in names(kind) else kind.also[name]
    place = Path(name).resolve()
    text = _text(kind, name, place)
    own = OwnFile(name, str(place), hashlib.sha256(text).hexdigest())
    _module(kind, own, text)
    return own


def load(kind: PluginKind, name: str) -> ModuleType:
    """Return the module of a plug-in."""
    own = named(kind, name)
    if own in _own(kind):
        return import_module(f"{PACKAGE}.{kind.folder}.{own}")
    if isinstance(own, OwnFile):
        return _module(kind, own)
    entries = _entry_points(kind)
    if name in entries:
        return _entry(kind, name)
    known = names(kind)
    hint = suggestion(name, known, {**kind.near, **kind.also})
    raise ValueError(f"unknown {kind.name} {short_repr(name)}; known: {', '.join(known)}{kind.otherwise}{hint}")


def part(what: str, value: object) -> str:
    """Return the name of a part of the model as text; it may be a long path to a file of code."""
    return check_text(what, value, 1000 if isinstance(value, str) and ".py" in value else 200)


def call(function: Callable[..., object], symbols: Mapping[str, object]) -> Any:
    """Call a plug-in's function with those of `symbols` that its signature names."""
    wanted = inspect.signature(function).parameters
    for name in wanted:
        if name not in symbols:
            where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
            raise ValueError(f"{where} asks for {name!r}; known: {', '.join(symbols)}{_instead(name, symbols)}")
    with blamed(function):
        return function(**{name: symbols[name] for name in wanted})


@contextmanager
def blamed(function: Callable[..., object]) -> Iterator[None]:
    """Within it, an error of a function from outside the package becomes a ValueError with its file and line."""
    try:
        yield
    except Exception as error:
        told = located(error, function)
        if told is error:
            raise
        raise told from error


def _instead(name: str, known: Iterable[str]) -> str:
    """What to do about a name that a plug-in's function asks for in vain; the states of a link's ends have fixed names."""
    ends = [other for other in known if other.endswith(("_i", "_j"))]
    if ends and name.endswith(("_i", "_j")):
        return f"; the ends of a link are {', '.join(ends)} whatever the coordinate is; use these names"
    return "; correct the name or declare it as a parameter"


def located(error: Exception, function: Callable[..., object]) -> Exception:
    """The error of a plug-in's function: as it is from this package, else a ValueError with file and line."""
    if str(function.__module__).startswith(f"{PACKAGE}."):
        return error
    return _located(error, inspect.getsourcefile(function) or function.__module__)


def _own(kind: PluginKind) -> tuple[str, ...]:
    package = import_module(f"{PACKAGE}.{kind.folder}")
    return tuple(m.name for m in pkgutil.iter_modules(package.__path__) if not m.name.startswith("_"))


def _entry_points(kind: PluginKind) -> Mapping[str, EntryPoint]:
    """The plug-ins that installed packages announce; none is loaded for this."""
    return _announced(f"synchain.{kind.folder}", tuple(sys.path))


@lru_cache(maxsize=8)
def _announced(group: str, places: tuple[str, ...]) -> Mapping[str, EntryPoint]:
    """The entry points of a group in the packages at these places, by name."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group=group)}


def _entry(kind: PluginKind, name: str) -> ModuleType:
    entry = _entry_points(kind)[name]
    where = f"{kind.name} {name!r} of the entry point {entry.value!r}"
    try:
        module = entry.load()
    except Exception as error:
        raise _located(error, "", where) from error
    if not isinstance(module, ModuleType):
        raise ValueError(f"{where}: found no module; expected a {kind.name} file; see: synchain new {kind.name} NAME")
    _check_installed(kind, module, where)
    return module


@lru_cache(maxsize=64)
def _check_installed(kind: PluginKind, module: ModuleType, where: str) -> None:
    """Check a module of an installed package, once."""
    try:
        text = inspect.getsource(module).encode()
    except (OSError, TypeError):  # it has no source, and so no names that could be looked at
        text = b""
    kind.check(module, where, text)


def _text(kind: PluginKind, name: str, place: Path) -> bytes:
    """What stands in a file that may be run; ValueError if it may not, or cannot be read."""
    if not place.is_file():
        raise ValueError(f"{kind.name} {name!r}: no such file: {place}; expected a .py file; check the path")
    if place not in _allowed:
        raise ValueError(
            f"{kind.name} {name!r} is a file of code, which is not run unasked; read it, then allow it: "
            f"synchain.models.inputs.plugins.allow_code({name!r}), or --allow-code where a command has it"
        )
    try:
        return place.read_bytes()
    except OSError as error:
        raise ValueError(
            f"{kind.name} {name!r}: cannot be read ({error.strerror}); check the rights of {place}"
        ) from None


def _module(kind: PluginKind, own: OwnFile, text: bytes | None = None) -> ModuleType:
    """What the text of a file of code defines, run once for each text."""
    key = (kind.name, own.place, own.digest)
    if key in _modules:
        return _modules[key]
    if text is None:
        text = _text(kind, own, Path(own.place))
        if hashlib.sha256(text).hexdigest() != own.digest:
            raise ValueError(
                f"{kind.name} {str(own)!r}: found another text in {own.place} than when its scene was made; "
                "expected the same text; make the scene anew, or restore the file"
            )
    module = ModuleType(f"synchain_{kind.name}_{Path(own.place).stem}")
    module.__file__ = own.place
    try:
        exec(compile(text, own.place, "exec", dont_inherit=True), module.__dict__)
    except Exception as error:
        raise _located(error, own.place) from error
    kind.check(module, own.place, text)
    _modules[key] = module
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
