"""How a command ends: exit codes, the errors that carry them, and what goes to which stream."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress

FINE, FAILED, WRONG_USE = 0, 1, 2


class WrongUse(Exception):
    """The command line cannot be carried out as written: exit code 2."""


class Failed(Exception):
    """The request was sound but could not be carried out: exit code 1."""


def sentence(problem: BaseException) -> str:
    """Return the message of an exception on one line; of a bare system error, the file and the reason."""
    if isinstance(problem, OSError) and problem.strerror and len(problem.args) > 1:
        where = f"{problem.filename}: " if problem.filename else ""
        return f"{where}{problem.strerror}"
    return " ".join(str(problem).split()) or type(problem).__name__


@contextmanager
def wrong_use() -> Iterator[None]:
    """Turn errors about values, types and files inside the block into WrongUse."""
    try:
        yield
    except BrokenPipeError:  # no mistake: the reader of the output has closed it
        raise
    except (ValueError, TypeError, OSError) as problem:
        raise WrongUse(sentence(problem)) from problem


def warn(sentences: Iterable[str]) -> None:
    """Write warnings to stderr, one a line."""
    for text in sentences:
        print(f"warning: {text}", file=sys.stderr)


def discard_output() -> None:
    """Send the rest of stdout's buffer to nowhere, so that the interpreter ends without an error message."""
    with suppress(OSError, ValueError):
        descriptor = sys.stdout.fileno()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, descriptor)
        os.close(nowhere)


def print_json(value: object) -> None:
    """Write JSON to stdout; raise ValueError for NaN and infinity."""
    import json

    print(json.dumps(value, indent=2, allow_nan=False))
