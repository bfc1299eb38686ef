"""`synchain plot`: the picture of a file with a result of any kind."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..console.outcome import FINE, Failed, WrongUse, sentence, wrong_use

SUMMARY = "draw a saved result of any kind"
EXAMPLES = (
    "synchain plot results/figure_4a.nc",
    "synchain plot results/two_oscillators.nc --kind phase -o phase.pdf",
    "synchain plot branch.nc -o branch.svg",
)

DOTS = 200  # dots per inch of a bitmap, as in figures of the paper (a choice)


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="a .nc, .nc4, .zarr or .partial file")
    parser.add_argument(
        "--kind",
        metavar="KIND",
        help="of a run: error, section, map, time, phase, space, network, end, or an observable; of a basin: image, "
        "shares, starts (default: the first that there are numbers for)",
    )
    parser.add_argument(
        "-o", "--out", metavar="PICTURE", help="a .png, .svg or .pdf file (default: FILE with the ending .png)"
    )


def execute(arguments: Namespace) -> int:
    from ..plots.canvas import off_screen
    from ..results.open import open_result
    from ..results.result import Result
    from ..support.files import whole_file
    from ..synchronisation.basin import Basin

    path = Path(arguments.file)
    target = path.with_suffix(".png") if arguments.out is None else Path(arguments.out)
    with wrong_use():
        try:
            value = open_result(path)
        except ModuleNotFoundError as problem:
            raise Failed(sentence(problem)) from problem
        if arguments.kind is not None and not isinstance(value, Result | Basin):
            raise WrongUse(f"--kind: {path} holds a {type(value).__name__}, which has one kind of plot; leave it out")
        options = {} if arguments.kind is None else {"kind": arguments.kind}
        with off_screen() as (figure, axes):
            if target.suffix.removeprefix(".") not in figure.canvas.get_supported_filetypes():
                raise WrongUse(f"{target}: found the ending {target.suffix!r}; expected .png, .svg or .pdf")
            value.plot(axes, **options)
            with whole_file(target) as temporary:
                figure.savefig(temporary, dpi=DOTS)
    print(f"  {target}")
    return FINE
