"""`synchain completion`: the script by which a shell completes command lines."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TypeAlias

from ..console.outcome import FINE

SUMMARY = "print the completion of command lines for a shell"
EXAMPLES = (
    "synchain completion bash > ~/.local/share/bash-completion/completions/synchain",
    "synchain completion zsh > ~/.zfunc/_synchain",
    "synchain completion fish > ~/.config/fish/completions/synchain.fish",
)

SHELLS = ("bash", "zsh", "fish")

ByShell: TypeAlias = dict[str, str]

# What completes SCENE: a function of PREAMBLE, which offers the shipped scenes and files.
SCENES: ByShell = {"bash": "_synchain_scene_files", "zsh": "_synchain_scene_files", "fish": "(_synchain_scene_files)"}

PREAMBLE: ByShell = {
    "bash": """\
_synchain_scene_files() {{
  compgen -W "{names}" -- "$1"
  compgen -f -X '!*.toml' -- "$1"
  compgen -d -- "$1"
}}""",
    "zsh": """\
_synchain_scene_files() {{
  compadd {names}
  _files -g '*.toml'
}}""",
    "fish": """\
function _synchain_scene_files
  printf '%s\\n' {names}
  __fish_complete_path (commandline -ct) | string match -er '(\\.toml|/)(\\t|$)'
end""",
}


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))


def execute(arguments: Namespace) -> int:
    import shtab

    from synchain.models.scenes.file import scene_names

    preamble = PREAMBLE[arguments.shell].format(names=" ".join(scene_names()))
    print(shtab.complete(_parser_of_all(), arguments.shell, preamble={arguments.shell: preamble}))
    return FINE


def _parser_of_all() -> ArgumentParser:
    """Return one parser of all commands, with completions by the placeholders of the arguments."""
    import shtab

    from synchain.models.graphs.families import names as families

    from ..paper import names as figures
    from . import command, names

    paths = {"DIR": shtab.DIRECTORY, "FILE": shtab.FILE, "PICTURE": shtab.FILE, "XML": shtab.FILE, "SCENE": SCENES}
    choices = {"TOPOLOGY": families(), "FIGURE": figures(extra=True)}
    all_commands = ArgumentParser(prog="synchain")
    all_commands.add_argument("--version", action="store_true", help="print the version")
    commands = all_commands.add_subparsers(dest="command")
    for name in names():
        module = command(name)
        parser = commands.add_parser(name, help=module.SUMMARY, description=module.SUMMARY)
        module.configure(parser)
        for action in parser._actions:
            if action.metavar in paths:
                action.complete = paths[action.metavar]  # type: ignore[attr-defined]  # where shtab looks
            elif action.metavar in choices:
                action.choices = choices[action.metavar]
    return all_commands
