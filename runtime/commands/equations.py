"""`synchain equations`: the derived equations of motion."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE, print_json, warn, wrong_use
from ..console.scene_arguments import add_changed_scene, changed_scene

SUMMARY = "print the equations of motion that a scene integrates"
EXAMPLES = (
    "synchain equations figure_4a",
    "synchain equations duffing_chain --latex",
    "synchain equations figure_7 --c > figure_7.c",
)

SOURCES = {
    "python": "print a Python module: rhs, jac and sparsity for scipy.integrate.solve_ivp",
    "c": "print C99 source: rhs and jacobian",
    "numba": "print a Python module whose rhs is a Numba cfunc with NumbaLSODA's signature",
}


def configure(parser: ArgumentParser) -> None:
    add_changed_scene(parser)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--latex", action="store_true", help="print LaTeX")
    form.add_argument("--json", action="store_true", help="print JSON: states, parameters, right-hand sides")
    for name, meaning in SOURCES.items():
        form.add_argument(f"--{name}", action="store_true", help=meaning)


def execute(arguments: Namespace) -> int:
    from synchain.models.presentation.equations_text import as_dict, latex, text

    with wrong_use():
        scene = changed_scene(arguments)
    source = next((name for name in SOURCES if getattr(arguments, name)), None)
    if source is not None:
        from synchain.codegen import export

        if scene.contact == "set-valued":
            warn(["set-valued contact: the source holds between events; where sticking starts and ends is not in it"])
        with wrong_use():
            print(getattr(export, f"to_{source}")(scene.equations, scene.parameters), end="")
    elif arguments.json:
        print_json(as_dict(scene.equations))
    else:
        print((latex if arguments.latex else text)(scene.equations))
    return FINE
