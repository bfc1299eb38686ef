"""`synchain equations`: the derived equations of motion."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ._arguments import add_scene
from ._outcome import FINE, print_json, wrong_use

SUMMARY = "print the equations of motion that a scene integrates"
EXAMPLES = ("synchain equations figure_4a", "synchain equations duffing_chain --latex")


def configure(parser: ArgumentParser) -> None:
    """Add the scene and the form."""
    add_scene(parser)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--latex", action="store_true", help="print LaTeX")
    form.add_argument("--json", action="store_true", help="print JSON: states, parameters, right-hand sides")


def execute(arguments: Namespace) -> int:
    """Print the equations as text, LaTeX or JSON."""
    from synchain.models.present import as_dict, latex, text
    from synchain.models.scene_file import load_scene

    with wrong_use():
        scene = load_scene(arguments.scene)
    if arguments.json:
        print_json(as_dict(scene.equations))
    else:
        print((latex if arguments.latex else text)(scene.equations))
    return FINE
