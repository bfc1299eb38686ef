"""The command `synchain`: find the command, run it, turn every error into a sentence and an exit code."""

from __future__ import annotations

import logging
import os
import re
import signal
import sys
import warnings
from argparse import Action, ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

from synchain.codegen.machine_code.installation import InstallationError

from .commands import command, names
from .console.outcome import FAILED, FINE, WRONG_USE, Failed, WrongUse, discard_output, sentence, wrong_use

__all__ = ["main", "parser"]

ABOUT = "Networks of coupled oscillators: exact equations and spectra, generated kernels, sweeps, thresholds, figures."
EXAMPLES = (
    "synchain paper --quick --out figures",
    "synchain spectrum chain 4",
    "synchain run figure_4a --out results",
)
CODES = "exit codes: 0 fine, 1 failed run, 2 wrong use; SYNCHAIN_DEBUG=1 shows tracebacks"


class Parser(ArgumentParser):
    """An argument parser that raises WrongUse in place of printing its usage.

    Options may stand anywhere, also between positional arguments that may be left out.
    """

    optional_positionals = False

    def add_argument(self, *names: str, **options: Any) -> Action:
        """Add an argument and remember whether it is a positional one that may be left out."""
        if names and not names[0].startswith("-") and options.get("nargs") in ("?", "*"):
            self.optional_positionals = True
        return super().add_argument(*names, **options)

    def read(self, texts: Sequence[str]) -> Namespace:
        """Parse the arguments after the command."""
        texts = _negative_values(texts)
        return self.parse_intermixed_args(texts) if self.optional_positionals else self.parse_args(texts)

    def error(self, message: str) -> NoReturn:
        """Raise WrongUse with a hint to the help."""
        raise WrongUse(f"{' '.join(message.split())}\nsee: {self.prog} --help")


def _negative_values(texts: Sequence[str]) -> list[str]:
    """Join "--rtol", "-1e-8" to "--rtol=-1e-8": argparse would take such a number for an option."""
    joined: list[str] = []
    for text in texts:
        if joined and joined[-1].startswith("--") and "=" not in joined[-1] and re.match(r"-\.?[0-9]", text):
            joined[-1] += f"={text}"
        else:
            joined.append(text)
    return joined


def main(argv: Sequence[str] | None = None) -> int:
    """Run `synchain` with arguments (default: the command line's) and return its exit code: 0, 1 or 2."""
    line = list(sys.argv[1:] if argv is None else argv)
    name = f"synchain {line[0]}" if line and line[0] in names() else "synchain"
    _escape_unknown_characters(sys.stdout)
    try:
        with _short_warnings(), _log_lines(name):
            code = _dispatch(line)
        if sys.stdout is not None:
            sys.stdout.flush()
        return code
    except BrokenPipeError:  # the reader of the output has closed it
        discard_output()
        return FINE
    except (Exception, KeyboardInterrupt) as problem:
        if argv is None:  # the program ends: a second Ctrl-C must not cut its message short or change its exit code
            with suppress(ValueError):  # only the main thread may set a signal handler
                signal.signal(signal.SIGINT, signal.SIG_IGN)
        return _report(name, problem)


def _dispatch(line: list[str]) -> int:
    """Run the command of a line, or answer --help and --version."""
    if not line:
        raise WrongUse(f"expected a command: {', '.join(names())}\nsee: synchain --help")
    first, *others = line
    if first in ("-h", "--help"):
        print(_help())
        return FINE
    if first == "--version":
        from importlib.metadata import version

        print(f"synchain {version('synchain')}")
        return FINE
    if first.startswith("-"):
        raise WrongUse(f"unknown option {first}; known: --help, --version; other options follow a command")
    try:
        module = command(first)
    except ValueError as problem:
        raise WrongUse(f"{problem}\nsee: synchain --help") from None
    try:
        arguments = parser(first).read(others)
    except SystemExit:  # --help has been printed
        return FINE
    arguments.command_line = ("synchain", *line)
    if getattr(arguments, "allow_code", None):
        from synchain.models.inputs.plugin_files import allow_code

        with wrong_use():
            allow_code(*arguments.allow_code)
    return int(module.execute(arguments))


def parser(name: str) -> Parser:
    """Return the parser of a command; raise ValueError for an unknown name."""
    module = command(name)
    reader = Parser(
        prog=f"synchain {name}",
        description=f"{module.SUMMARY[0].upper()}{module.SUMMARY[1:]}.",
        epilog=_examples(module.EXAMPLES),
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    module.configure(reader)
    return reader


def _help() -> str:
    rows = [(name, command(name).SUMMARY) for name in names()]
    width = max(len(name) for name, _ in rows)
    listed = "\n".join(f"  {name:<{width}}  {summary}" for name, summary in rows)
    return (
        f"usage: synchain COMMAND ... | --version | --help\n\n{ABOUT}\n\ncommands:\n{listed}\n\n"
        f"{_examples(EXAMPLES)}\n\nsynchain COMMAND --help describes a command\n{CODES}"
    )


def _examples(lines: Sequence[str]) -> str:
    return "\n".join([f"example{'s' * (len(lines) > 1)}:", *(f"  {line}" for line in lines)])


def _after_ctrl_c(problem: BaseException) -> bool:
    """Return whether an error came after Ctrl-C: pressed again, it may cut the end of a lock short."""
    earlier = problem.__context__
    return earlier is not None and (isinstance(earlier, KeyboardInterrupt) or _after_ctrl_c(earlier))


def _report(name: str, problem: BaseException) -> int:
    """Write one or two lines about an error to stderr and return the exit code."""
    if os.environ.get("SYNCHAIN_DEBUG", "") not in ("", "0"):
        import traceback

        traceback.print_exception(problem, file=sys.stderr)
    code = FAILED
    if isinstance(problem, WrongUse):
        message, code = str(problem), WRONG_USE
    elif isinstance(problem, Failed):
        message = str(problem)
    elif isinstance(problem, KeyboardInterrupt) or (isinstance(problem, RuntimeError) and _after_ctrl_c(problem)):
        message = "interrupted"
    elif isinstance(problem, MemoryError):
        message = "not enough memory; use a smaller network, fewer cells or a shorter record"
    elif isinstance(problem, ModuleNotFoundError) and not str(problem.name).startswith("synchain"):
        package = str(problem.name).partition(".")[0]
        message = f"the package {package} is missing; install it: python -m pip install {package}"
    elif isinstance(problem, OSError | InstallationError):
        message = sentence(problem)
    elif isinstance(problem, RuntimeError) and "can't start new thread" in str(problem):
        message = (
            "no thread can be started: not enough memory, or too many processes; use fewer workers or raise the limit"
        )
    else:
        message = (
            f"internal error, a bug in synchain: {type(problem).__name__}: {sentence(problem)}\n"
            "please report it with this command line; SYNCHAIN_DEBUG=1 shows where it happened"
        )
    if sys.stderr is not None:
        with suppress(OSError):
            print(f"{name}: {message}", file=sys.stderr)
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        discard_output()
    return code


@contextmanager
def _short_warnings() -> Iterator[None]:
    """Print warnings on one line, without file and line number."""

    def show(message: Warning | str, *_: object, **__: object) -> None:
        print(f"warning: {' '.join(str(message).split())}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


@contextmanager
def _log_lines(name: str) -> Iterator[None]:
    """Print messages of the package's logger, such as that it compiles, on stderr."""
    handler, logger = logging.StreamHandler(sys.stderr), logging.getLogger("synchain")
    handler.setFormatter(logging.Formatter(f"{name}: %(message)s"))
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.setLevel(before)
        logger.removeHandler(handler)


def _escape_unknown_characters(stream: object) -> None:
    """Write characters that the stream's encoding lacks as escapes instead of failing."""
    if getattr(stream, "errors", None) in ("strict", "surrogateescape") and hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="backslashreplace")
