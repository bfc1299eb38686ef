"""`synchain cache`: the folder of compiled kernels."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, Failed, sentence

SUMMARY = "show or empty the folder of compiled kernels"
EXAMPLES = ("synchain cache info", "synchain cache clear")


def configure(parser: ArgumentParser) -> None:
    """Add what to do."""
    parser.add_argument(
        "action",
        choices=("info", "clear"),
        help="info: folder, number of kernels and size; clear: delete the kernels; they are compiled again when needed",
    )


def execute(arguments: Namespace) -> int:
    """Describe or empty the cache."""
    from synchain.codegen.kernels.cache import clear, describe

    try:
        info = describe()
        if arguments.action == "info":
            print(f"folder   {info['folder']}\nkernels  {info['kernels']}\nsize     {_size(int(info['bytes']))}")
        else:
            print(f"deleted {_counted(clear())} from {info['folder']}")
    except PermissionError as problem:
        raise Failed(f"the kernel cache cannot be read or emptied: {sentence(problem)}") from problem
    except RuntimeError as problem:  # no home folder
        raise Failed(f"no kernel cache: {sentence(problem)} Set SYNCHAIN_CACHE to a folder of yours") from problem
    return FINE


def _size(count: int) -> str:
    if count < 1000:
        return f"{count} bytes"
    return f"{count / 1e3:.0f} kB" if count < 1e6 else f"{count / 1e6:.1f} MB"


def _counted(kernels: int) -> str:
    return f"{kernels} kernel{'s' * (kernels != 1)}"
