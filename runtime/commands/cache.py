"""`synchain cache`: the folder of compiled kernels."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, Failed, WrongUse, print_json, sentence
from ..support.error_text import counted

SUMMARY = "show, empty or fill the folder of compiled kernels"
EXAMPLES = ("synchain cache info", "synchain cache clear", "synchain cache warm")


def configure(parser: ArgumentParser) -> None:
    parser.add_argument(
        "action",
        choices=("info", "clear", "warm"),
        help="info: folder, number of kernels and size; clear: delete the kernels and drivers; they are compiled again "
        "when needed; warm: compile the drivers and recorders that most scenes share",
    )
    parser.add_argument("--json", action="store_true", help="info: print JSON: folder, kernels, drivers, bytes")


def execute(arguments: Namespace) -> int:
    if arguments.json and arguments.action != "info":
        raise WrongUse(f"found --json with {arguments.action}; expected it with info; leave it out")
    if arguments.action == "warm":
        # Compile the common drivers that the folder lacks, with a line for each.
        from synchain.codegen.kernels import driver
        from synchain.codegen.machine_code.compile import load_shared

        for common in driver.common_drivers():
            shared = load_shared(common)
            if shared.problem:
                raise Failed(f"drivers are not kept on disk: {shared.problem}")
            print(f"{'was there' if shared.from_cache else 'compiled':9}  {common}", flush=True)
        return FINE
    from synchain.codegen.machine_code.code_cache import clear, describe

    try:
        info = describe()
        if arguments.json:
            print_json({**info, "folder": str(info["folder"])})
        elif arguments.action == "info":
            print(f"folder   {info['folder']}\nkernels  {info['kernels']}\ndrivers  {info['drivers']}")
            print(f"size     {_size(int(info['bytes']))}")
        else:
            counts = clear()
            deleted = " and ".join(counted(counts[f"{kind}s"], kind) for kind in ("kernel", "driver"))
            print(f"deleted {deleted} from {info['folder']}")
    except PermissionError as problem:
        raise Failed(f"the kernel cache cannot be read or emptied: {sentence(problem)}") from problem
    except RuntimeError as problem:  # no home folder
        raise Failed(f"no kernel cache: {sentence(problem)} Set SYNCHAIN_CACHE to a folder of yours") from problem
    return FINE


def _size(count: int) -> str:
    if count < 1000:
        return f"{count} bytes"
    return f"{count / 1e3:.0f} kB" if count < 1e6 else f"{count / 1e6:.1f} MB"
