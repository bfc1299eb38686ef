"""Plug-ins: Python files that assign one value, an oscillator, a friction law, a coupling or a family of graphs.

There are three sources of plug-ins: files of this package, entry points of installed packages (groups
``synchain.oscillators``, ``synchain.frictions``, ``synchain.couplings``, ``synchain.topologies``), and files anywhere,
named by a path that ends in ``.py``.  A file named by a path is run only after `allow_code` was called with that path,
so a scene alone, which is data, never runs code.

A file outside the package is identified by its text: an edited file is another model.  Files that a plug-in imports are
not compared, so write a model in one file.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import pkgutil
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from .checks import check_path, check_text, short_repr, suggestion
from .entry_points import announced

PACKAGE = "synchain.models"  # the package whose folders contain the shipped plug-ins


@dataclass(frozen=True, slots=True)
class PluginKind:
    """A kind of plug-in: the folder of its files, and the type of the value that a file assigns."""

    name: str  # the kind in messages, "oscillator"; in capitals, the variable that a file assigns: OSCILLATOR
    folder: str  # the folder of `synchain.models` with the shipped files, and the name of the group of entry points
    # returns the allowed types of the value; a function, because lists of plug-ins must not load SymPy
    types: Callable[[], tuple[type, ...]] = field(compare=False, repr=False)
    example: str = field(compare=False, repr=False)  # the right-hand side of the assignment, for messages
    # synonym -> name of a shipped file; a file with the synonym's name takes precedence
    also: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    # other word -> name of a related shipped file, for suggestions only
    near: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    # alternatives to a name, for the error message on an unknown name
    otherwise: str = field(default="", compare=False, repr=False)


class OwnFile(str):
    """The name of a plug-in file outside the package, as the user wrote it, with the path and the digest of its text.

    Two such names are equal if name, path and digest are equal; no such name equals a plain str.  A cache keyed by
    names therefore stores one value for each text of each file.
    """

    __slots__ = ("digest", "path")
    path: str
    digest: str

    def __new__(cls, name: str, path: str, digest: str) -> OwnFile:
        file = super().__new__(cls, name)
        file.path, file.digest = path, digest
        return file

    def _key(self) -> tuple[str, str, str]:
        return str(self), self.path, self.digest

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OwnFile) and self._key() == other._key()

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[type[OwnFile], tuple[str, str, str]]:
        return OwnFile, self._key()


# (kind, path, digest) -> module of a file outside the package; a scene keeps its model even if the file changes.
_modules: dict[tuple[str, str, str], ModuleType] = {}

_allowed: set[Path] = set()


def names(kind: PluginKind) -> tuple[str, ...]:
    """Return the sorted names of all plug-ins of a kind."""
    return tuple(sorted({*_shipped(kind), *announced(_group(kind))}))


def allow_code(*paths: str | Path) -> None:
    """Allow files outside the package to be run as plug-ins, from now on.

    Afterwards a path can be used as a name: Scene(friction="./my_law.py").  Allow only files that you have read.

    Parameters
    ----------
    *paths : str or Path
        The files.

    Raises
    ------
    ValueError
        If a path is not a file that ends in .py.

    See Also
    --------
    synchain.load_scene
    synchain.load_oscillator

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import synchain as sc
    >>> file = Path(mkdtemp()) / "decay.py"
    >>> text = "from synchain import Field\\nOSCILLATOR = Field({'x': '-x'}, initial={'x': 1.0})\\n"
    >>> _ = file.write_text(text)
    >>> sc.plugins.allow_code(file)
    >>> sc.Scene(str(file)).n
    1
    """
    for path in paths:
        file = check_path("plug-in", path)
        if file.suffix != ".py" or not file.is_file():
            raise ValueError(f"plug-in {str(path)!r} is no file that ends in .py; check the path")
        _allowed.add(file.resolve())


def allowed_code() -> tuple[str, ...]:
    """Return the files outside the package that may be run as plug-ins, sorted."""
    return tuple(sorted(map(str, _allowed)))


def named(kind: PluginKind, name: str) -> str:
    """Return the canonical name of a plug-in: an `OwnFile` of the current text for a path, the file name for a synonym.

    An `OwnFile` is returned unchanged, even if the file was edited or removed later.
    """
    if isinstance(name, OwnFile):
        return name
    if isinstance(name, str) and name.endswith(".py"):
        path = Path(name).resolve()
        text = _text(kind, name, path)
        own = OwnFile(name, str(path), hashlib.sha256(text).hexdigest())
        _module(kind, own, text)
        return own
    return kind.also[name] if name in kind.also and name not in names(kind) else name


def load(kind: PluginKind, name: str) -> Any:
    """Return the value that a plug-in file assigns, with the plug-in's name and the summary from its docstring."""
    name = named(kind, name)
    if isinstance(name, OwnFile):
        return _value(kind, name, _module(kind, name), name.path)
    if name in _shipped(kind):
        module = import_module(f"{PACKAGE}.{kind.folder}.{name}")
        return _value(kind, name, module, str(module.__file__))
    if name in announced(_group(kind)):
        return _value(kind, name, *_installed(kind, name))
    valid = names(kind)
    hint = suggestion(name, valid, {**kind.near, **kind.also})
    raise ValueError(f"unknown {kind.name} {short_repr(name)}; known: {', '.join(valid)}{kind.otherwise}{hint}")


def is_shipped(kind: PluginKind, name: str) -> bool:
    return not isinstance(name, OwnFile) and name in _shipped(kind)


@lru_cache(maxsize=512)
def _value(kind: PluginKind, name: str, module: ModuleType, where: str) -> Any:
    """Return the value of a module with the name of the plug-in; ValueError if the module assigns no value."""
    variable = kind.name.upper()
    value = getattr(module, variable, None)
    if not isinstance(value, kind.types()):
        found = f"no {variable}" if value is None else f"{variable} = {short_repr(value)}"
        raise ValueError(
            f"{where}: found {found}; expected {variable} = {kind.example}; see: synchain new {kind.name} NAME"
        )
    if not hasattr(value, "summary"):  # rates and potentials of links have no name
        return value
    # The summary is the first paragraph of the docstring, without its full stop.
    summary = " ".join((inspect.getdoc(module) or "").partition("\n\n")[0].split()).removesuffix(".")
    described: Any = value
    return replace(described, name=name, summary=summary)


def part(what: str, value: object) -> str:
    """Return the name of an oscillator, law, coupling or family as text; the limit allows long paths."""
    return check_text(what, value, 1000 if isinstance(value, str) and ".py" in value else 200)


@contextmanager
def blamed(function: Callable[..., object]) -> Iterator[None]:
    """Turn an error of a plug-in's function into a ValueError with its file and line."""
    try:
        yield
    except Exception as error:
        raise located(error, function) from error


def located(error: Exception, function: Callable[..., object]) -> ValueError:
    """Return a ValueError that names the file and line of an error in a plug-in's function."""
    return _located(error, inspect.getsourcefile(function) or function.__module__)


def _shipped(kind: PluginKind) -> tuple[str, ...]:
    folders = tuple(import_module(f"{PACKAGE}.{kind.folder}").__path__)
    return _listed(folders, tuple(os.stat(path).st_mtime_ns if os.path.isdir(path) else 0 for path in folders))


@lru_cache(maxsize=64)
def _listed(folders: tuple[str, ...], times: tuple[int, ...]) -> tuple[str, ...]:
    """Return the modules of folders; `times` of their last change keep the list up to date when a file is added."""
    return tuple(m.name for m in pkgutil.iter_modules(folders) if not m.name.startswith("_"))


def _group(kind: PluginKind) -> str:
    return f"synchain.{kind.folder}"


def _installed(kind: PluginKind, name: str) -> tuple[ModuleType, str]:
    """Return the module of an entry point, and its name in messages."""
    entry = announced(_group(kind))[name]
    where = f"{kind.name} {name!r} of the entry point {entry.value!r}"
    try:
        module = entry.load()
    except Exception as error:
        raise _located(error, "", where) from error
    if not isinstance(module, ModuleType):
        raise ValueError(f"{where}: found no module; expected a {kind.name} file; see: synchain new {kind.name} NAME")
    return module, where


def _text(kind: PluginKind, name: str, path: Path) -> bytes:
    """Read a file that `allow_code` has allowed; ValueError if the file is not allowed or cannot be read."""
    if not path.is_file():
        raise ValueError(f"{kind.name} {name!r}: no such file: {path}; expected a .py file; check the path")
    if path not in _allowed:
        raise ValueError(
            f"{kind.name} {name!r} is a file of code, which is not run unasked; read it, then allow it: "
            f"synchain.plugins.allow_code({name!r}), or --allow-code where a command has it"
        )
    try:
        return path.read_bytes()
    except OSError as error:
        raise ValueError(
            f"{kind.name} {name!r}: cannot be read ({error.strerror}); check the rights of {path}"
        ) from None


def _module(kind: PluginKind, own: OwnFile, text: bytes | None = None) -> ModuleType:
    """Return the module of a plug-in file; each text of the file is run once."""
    key = (kind.name, own.path, own.digest)
    if key in _modules:
        return _modules[key]
    # A scene from another process has only the digest: run the file only if its text is still the same.
    if text is None:
        text = _text(kind, own, Path(own.path))
        if hashlib.sha256(text).hexdigest() != own.digest:
            raise ValueError(
                f"{kind.name} {str(own)!r}: found another text in {own.path} than when its scene was made; "
                "expected the same text; make the scene anew, or restore the file"
            )
    module = ModuleType(f"synchain_{kind.name}_{Path(own.path).stem}")
    module.__file__ = own.path
    try:
        exec(compile(text, own.path, "exec", dont_inherit=True), module.__dict__)
    except Exception as error:
        raise _located(error, own.path) from error
    _modules[key] = module
    return module


def _located(error: Exception, file: str, what: str = "") -> ValueError:
    """Make a ValueError that names the innermost line of `file` in a traceback; "" means any file."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [(frame.filename, frame.lineno) for frame in frames if file in ("", frame.filename)]
    if isinstance(error, SyntaxError) and error.filename and file in ("", error.filename):
        lines.append((error.filename, error.lineno))
    where = f"{lines[-1][0]}, line {lines[-1][1]}" if lines else file
    where = f"{what}: {where}" if what else where
    return ValueError(f"{where}: {type(error).__name__}: {' '.join(str(error).split())}; correct the file")
