"""Calls of public functions, classes and methods: what does not fit is refused with what would, and warnings stand at the call."""

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
    """Warn at the line that called this package, through however many of its functions."""
    package, level, frame = __name__.partition(".")[0], 1, currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, kind, stacklevel=level)


def called_from_outside(*modules: str) -> bool:
    """Return True if the function that asks was called from outside of this package, directly or through these modules."""
    asking = currentframe()
    frame = asking.f_back.f_back if asking and asking.f_back else None
    while frame is not None and frame.f_globals.get("__name__") in (__name__, *modules):
        frame = frame.f_back
    return frame is None or frame.f_globals.get("__name__", "").partition(".")[0] != __name__.partition(".")[0]


def public(value: Any, package: str) -> Any:
    """Return what a package offers by a name: its call refuses what does not fit, unknown keywords with a suggestion."""
    if isinstance(value, type):
        made = vars(value).get("__init__")
        if isfunction(made) and not hasattr(made, "__wrapped__"):
            value.__init__ = _checked(made, value.__module__)  # type: ignore[misc]
        return value
    return _checked(value, package) if isfunction(value) else value


def check_methods(kind: type) -> None:
    """Make the public methods that a class defines refuse what does not fit."""
    for name, method in list(vars(kind).items()):
        if isfunction(method) and not name.startswith("_") and not hasattr(method, "__wrapped__"):
            setattr(kind, name, _checked(method, kind.__module__))


@dataclass(frozen=True, slots=True)
class _Taken:
    """What a function takes."""

    name: str  # what it is called; a class in place of its `__init__`
    places: tuple[str, ...]  # arguments that may be given without their names, `self` among them
    names: tuple[str, ...]  # arguments that have a name, but for `self`
    needed: tuple[str, ...]  # those without a default
    enough: range  # how many arguments without a name do without any that has one
    any_place: bool  # whether it takes further arguments, as the function itself decides
    any_name: bool

    @classmethod
    def by(cls, function: Callable[..., Any]) -> _Taken:
        """Return what a function takes."""
        own = signature(function).parameters.values()
        further = {each.kind for each in own} & {Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD}
        named = [each for each in own if each.kind not in further]
        places = tuple(each.name for each in named if each.kind is not Parameter.KEYWORD_ONLY)
        needed = tuple(each.name for each in named if each.default is Parameter.empty)
        return cls(
            function.__qualname__.removesuffix(".__init__").rpartition(".")[2],
            places,
            tuple(each.name for each in named if each.name != "self"),
            needed,
            range(len(needed), len(places) + 1) if set(needed) <= set(places) else range(0),
            Parameter.VAR_POSITIONAL in further,
            Parameter.VAR_KEYWORD in further,
        )

    def refusal(self, given: int, keywords: Collection[str]) -> str | None:
        """Why so many arguments without a name and these keywords do not fit; None if they do."""
        if not keywords and given in self.enough:
            return None
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
        if given > len(self.places) and not self.any_place:
            shown = [name for name in self.places if name in self.names]
            by_name = [name for name in self.names if name not in self.places]
            most = f"at most {len(shown)}, {', '.join(shown)}" if shown else "none"
            others = f"; give the others by name: {', '.join(by_name)}" if by_name else ""
            without = given - len(self.places) + len(shown)
            return f"{self.name}: found {without} argument{'s' * (without > 1)} without a name; expected {most}{others}"
        placed = self.places[:given]
        twice = next((name for name in placed if name in keywords), None)
        if twice is not None:
            return f"{self.name}: found {twice!r} without a name and by name; expected it once"
        missing = next((name for name in self.needed if name not in keywords and name not in placed), None)
        if missing is not None:
            return f"{self.name}: found no {missing!r}; expected {', '.join(n for n in self.needed if n != 'self')}"
        return None


@cache
def _checked(function: Callable[..., Any], package: str) -> Callable[..., Any]:
    """The function, whose arguments are looked at if it refuses them; one that takes any keywords checks these itself."""
    taken = _Taken.by(function)

    @wraps(function)
    def checked(*arguments: Any, **keywords: Any) -> Any:
        try:
            return function(*arguments, **keywords)
        except TypeError:
            if (refusal := taken.refusal(len(arguments), keywords)) is not None:
                raise TypeError(refusal) from None
            raise

    checked.__module__ = package
    return checked
