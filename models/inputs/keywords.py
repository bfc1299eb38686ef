"""Unknown keywords of public functions and classes: they are refused with those that are known."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from inspect import Parameter, isfunction, signature
from typing import Any

from .checks import suggestion

__all__ = ["public"]


def public(value: Any, package: str) -> Any:
    """Return what a package offers by a name: its call refuses unknown keywords, with a suggestion.

    Parameters
    ----------
    value : object
        A function, a class, whose instances are then made so from anywhere, or anything else, which stays as it is.
    package : str
        The package, where pickles look for the function.
    """
    if isinstance(value, type):
        made = vars(value).get("__init__")
        if isfunction(made) and not hasattr(made, "__wrapped__"):
            value.__init__ = _checked(made, value.__module__)  # type: ignore[misc]
        return value
    return _checked(value, package) if isfunction(value) else value


@cache
def _checked(function: Callable[..., Any], package: str) -> Callable[..., Any]:
    """The function with its keywords checked; one that takes any keywords checks them itself."""
    own = signature(function).parameters.values()
    if any(each.kind is Parameter.VAR_KEYWORD for each in own):
        return function
    known = [each.name for each in own if each.kind is not Parameter.VAR_POSITIONAL and each.name != "self"]

    @wraps(function)
    def checked(*arguments: Any, **keywords: Any) -> Any:
        strange = next((name for name in keywords if name not in known), None)
        if strange is not None:
            other = f"; a parameter is given as parameters={{{strange!r}: …}}" if "parameters" in known else ""
            raise TypeError(
                f"unknown keyword {strange!r} of {function.__qualname__.removesuffix('.__init__')}; "
                f"known: {', '.join(known) or 'none'}{suggestion(strange, known) or other}"
            )
        return function(*arguments, **keywords)

    checked.__module__ = package
    return checked
