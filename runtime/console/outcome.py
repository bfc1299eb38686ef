"""How a command ends: exit codes, the errors that carry them, and what goes to which stream."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["FAILED", "FINE", "WRONG_USE", "Failed", "WrongUse", "print_json", "sentence", "warn", "wrong_use"]

FINE, FAILED, WRONG_USE = 0, 1, 2


class WrongUse(Exception):
    """The user asked for something that cannot be: exit code 2."""


class Failed(Exception):
    """The request was sound but could not be carried out: exit code 1."""


def sentence(problem: BaseException) -> str:
    """The message of an exception on one line; of a bare system error, the file and the reason."""
    if isinstance(problem, OSError) and problem.strerror and len(problem.args) > 1:
        where = f"{problem.filename}: " if problem.filename else ""
        return f"{where}{problem.strerror}"
    return " ".join(str(problem).split()) or type(problem).__name__


@contextmanager
def wrong_use() -> Iterator[None]:
    """Errors about values, types and files inside the block are the user's; anything else stays what it is."""
    try:
        yield
    except BrokenPipeError:  # nobody's mistake: whoever reads the output has seen enough
        raise
    except (ValueError, TypeError, OSError) as problem:
        raise WrongUse(sentence(problem)) from problem


def warn(sentences: Iterable[str]) -> None:
    """Write warnings to stderr, one a line."""
    for words in sentences:
        print(f"warning: {words}", file=sys.stderr)


def print_json(value: Any) -> None:
    """Write JSON to stdout; NaN and infinity are refused."""
    import json

    print(json.dumps(value, indent=2, allow_nan=False))
