"""Refuse wrong arguments of public functions, classes and methods with a helpful message; warn at the user's line."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache, wraps
from inspect import Parameter, currentframe, isfunction, signature
from typing import Any

from .checks import short_repr, suggestion
from .unsupported import unsupported


def warn(message: str, kind: type[Warning] = RuntimeWarning) -> None:
    """Issue a warning that refers to the calling line outside this package."""
    package, level, frame = __name__.partition(".")[0], 1, currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, kind, stacklevel=level)


def called_from_outside(*modules: str) -> bool:
    """Return whether the caller's caller, skipping `modules`, is outside this package."""
    here = currentframe()
    frame = here.f_back.f_back if here and here.f_back else None
    while frame is not None and frame.f_globals.get("__name__") in (__name__, *modules):
        frame = frame.f_back
    return frame is None or frame.f_globals.get("__name__", "").partition(".")[0] != __name__.partition(".")[0]


def public(value: Any, package: str) -> Any:
    """Make a public function or class refuse wrong arguments, with a suggestion for an unknown keyword."""
    if isinstance(value, type):
        init = vars(value).get("__init__")
        if isfunction(init) and not hasattr(init, "__wrapped__"):
            value.__init__ = _checked(init, value.__module__)  # type: ignore[misc]
        return value
    return _checked(value, package) if isfunction(value) else value


def check_methods(kind: type) -> None:
    """Make the public methods that a class defines refuse wrong arguments."""
    for name, method in list(vars(kind).items()):
        if isfunction(method) and not name.startswith("_") and not hasattr(method, "__wrapped__"):
            setattr(kind, name, _checked(method, kind.__module__))


@dataclass(frozen=True, slots=True)
class _Arguments:
    name: str  # the function's name, the class's for `__init__`
    positional: tuple[str, ...]  # arguments that may be given by position, `self` among them
    names: tuple[str, ...]  # all arguments but `self`
    needed: tuple[str, ...]  # those without a default
    enough: range  # numbers of positional arguments that need no keywords
    any_position: bool  # True with *arguments
    any_name: bool  # True with **keywords

    @classmethod
    def of(cls, function: Callable[..., Any]) -> _Arguments:
        parameters = signature(function).parameters.values()
        further = {each.kind for each in parameters} & {Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD}
        named = [each for each in parameters if each.kind not in further]
        positional = tuple(each.name for each in named if each.kind is not Parameter.KEYWORD_ONLY)
        needed = tuple(each.name for each in named if each.default is Parameter.empty)
        return cls(
            function.__qualname__.removesuffix(".__init__").rpartition(".")[2],
            positional,
            tuple(each.name for each in named if each.name != "self"),
            needed,
            range(len(needed), len(positional) + 1) if set(needed) <= set(positional) else range(0),
            Parameter.VAR_POSITIONAL in further,
            Parameter.VAR_KEYWORD in further,
        )

    def refusal(self, count: int, keywords: Collection[str]) -> str | None:
        """Explain why `count` positional arguments and `keywords` do not fit; None if they fit."""
        if not keywords and count in self.enough:
            return None
        # An unknown keyword.
        strange = next((name for name in keywords if name not in self.names and not self.any_name), None)
        if strange is not None:
            if reason := unsupported(strange):
                return f"unknown keyword {strange!r} of {self.name}: {reason}"
            other = (
                f"; a parameter is given as parameters={{{short_repr(strange)}: …}}"
                if "parameters" in self.names
                else ""
            )
            return (
                f"unknown keyword {short_repr(strange)} of {self.name}; known: {', '.join(self.names) or 'none'}"
                f"{suggestion(strange, self.names) or other}"
            )
        # Too many positional arguments.
        if count > len(self.positional) and not self.any_position:
            shown = [name for name in self.positional if name in self.names]
            by_name = [name for name in self.names if name not in self.positional]
            most = f"at most {len(shown)}, {', '.join(shown)}" if shown else "none"
            others = f"; give the others by name: {', '.join(by_name)}" if by_name else ""
            without = count - len(self.positional) + len(shown)
            return f"{self.name}: found {without} argument{'s' * (without > 1)} without a name; expected {most}{others}"
        # An argument given twice, or a missing argument.
        placed = self.positional[:count]
        twice = next((name for name in placed if name in keywords), None)
        if twice is not None:
            return f"{self.name}: found {twice!r} without a name and by name; expected it once"
        missing = next((name for name in self.needed if name not in keywords and name not in placed), None)
        if missing is not None:
            return f"{self.name}: found no {missing!r}; expected {', '.join(n for n in self.needed if n != 'self')}"
        return None


@cache
def _checked(function: Callable[..., Any], package: str) -> Callable[..., Any]:
    """Wrap a function so that a TypeError for wrong arguments gets a better message; correct calls cost nothing."""
    accepted = _Arguments.of(function)

    @wraps(function)
    def checked(*arguments: Any, **keywords: Any) -> Any:
        try:
            return function(*arguments, **keywords)
        except TypeError:
            if (refusal := accepted.refusal(len(arguments), keywords)) is not None:
                raise TypeError(refusal) from None
            raise

    checked.__module__ = package
    return checked
