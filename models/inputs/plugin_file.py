"""What every plug-in file from outside must be: it defines what its kind needs, and nothing that is ignored.

A name that the kind does not know and a definition that another one makes idle are refused, since the model
would be another than the one that was meant.
"""

from __future__ import annotations

import ast
import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Self

from .plugins import call

_FLAGS = ("FRICTION", "ODD", "SELF_EXCITING", "DIRECTED", "CONNECTED", "ALL_TO_ALL")
_TEXTS = ("SUMMARY", "SOURCE", "TOO_SMALL")


@dataclass(frozen=True, slots=True)
class PluginFile:
    """A plug-in file from outside, and the checks that hold for every kind."""

    kind: str  # what a file of its kind is called in messages: "oscillator"
    # the public names that such a file may define; imports and names with an underscore in front are its own
    known: tuple[str, ...]
    module: ModuleType  # what its text defines
    where: str  # the name of the file in messages
    lines: Mapping[str, int]  # the line of each public name that the file defines

    @classmethod
    def of(cls, kind: str, known: tuple[str, ...], module: ModuleType, where: str, text: bytes) -> Self:
        """Return the file of a module, whose text says which names it defines itself."""
        return cls(kind, known, module, where, dict(_defined(text)))

    def has(self, name: str) -> bool:
        """True if the file defines a name."""
        return hasattr(self.module, name)

    def get(self, name: str, otherwise: object = None) -> Any:
        """Return what the file calls by a name, or `otherwise`."""
        return getattr(self.module, name, otherwise)

    def wrong(self, name: str, words: str) -> ValueError:
        """Return an error at the definition of a name."""
        place = f"{self.where}, line {self.lines[name]}" if name in self.lines else self.where
        return ValueError(f"{place}: {words}")

    def need(self, *names: str) -> None:
        """Raise ValueError if one of these names is not defined; a close name may be a slip of the pen."""
        missing = [name for name in names if not self.has(name)]
        if missing:
            own = [name for name in self.lines if name not in self.known]
            close = next((near for name in missing for near in difflib.get_close_matches(name, own, 1)), None)
            hint = f"; found {close!r} in line {self.lines[close]}: is that it?" if close else ""
            raise ValueError(
                f"{self.where}: found no {', no '.join(missing)}; expected {_kind(self.kind)} file{hint}; "
                f"see: synchain new {self.kind} NAME"
            )

    def idle(self, names: Iterable[str], reason: str) -> None:
        """Raise ValueError if one of these names is defined: nothing would look at it."""
        for name in names:
            if self.has(name):
                raise self.wrong(name, f"found {name} {reason}; it would be ignored; leave one out")

    def check_names(self, needed: Iterable[str]) -> None:
        """Refuse a file that lacks one of the `needed` names, and public names that its kind does not know."""
        self.need(*needed)
        known = self.known
        for name in self.lines:
            if name not in known:
                close = difflib.get_close_matches(name, known, 1)
                hint = f"did you mean {close[0]!r}?" if close else f"call what is your own _{name}"
                raise self.wrong(name, f"found {name!r}; {_kind(self.kind)} file knows {', '.join(known)}; {hint}")

    def check_values(self) -> None:
        """Refuse wrong types of what all kinds have."""
        for name in self.defined(self.known):
            value = self.get(name)
            if name in _FLAGS and not isinstance(value, bool):
                raise self.wrong(name, f"{name} is {value!r}; expected True or False")
            if name in _TEXTS and not isinstance(value, str):
                raise self.wrong(name, f"{name} is {value!r}; expected text in quotation marks")
            if name.islower() and not callable(value):
                raise self.wrong(name, f"{name} is {value!r}; expected a function: def {name}(…)")

    def value(self, name: str, given: Mapping[str, object]) -> Any:
        """Return what a function of the file returns for symbols."""
        return call(self.get(name), given)

    def defined(self, names: Iterable[str]) -> Iterator[str]:
        """Those of some names that the file defines."""
        return (name for name in names if self.has(name))


def _kind(kind: str) -> str:
    return f"an {kind}" if kind == "oscillator" else f"a {kind}"


def _defined(text: bytes) -> Iterator[tuple[str, int]]:
    """The public names that the text of a module defines at its top level, with their lines; imports are none."""
    found: list[ast.AST] = [ast.parse(text)]
    while found:
        node = found.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names = [node.name]
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names = [node.id]
        elif isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp | ast.Lambda):
            continue
        else:
            found += reversed(list(ast.iter_child_nodes(node)))
            continue
        yield from ((name, node.lineno) for name in names if not name.startswith("_"))
