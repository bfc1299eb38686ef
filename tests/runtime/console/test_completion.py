"""The completion scripts, asked what they would complete, by the shells that are installed."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from synchain import scene_names
from synchain.models.graphs.families import names as families
from synchain.runtime.cli import main
from synchain.runtime.commands import names as commands
from synchain.runtime.paper import names as figures

ASK = {
    "bash": "source ./script; COMP_WORDS=({quoted}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1));"
    ' COMP_LINE={line}; COMP_POINT=${{#COMP_LINE}}; _shtab_synchain 2>/dev/null; printf "%s\\n" "${{COMPREPLY[@]}}"',
    "fish": "source ./script; complete -C {line}",
}
"""How to ask a shell, without a terminal, what completes a line."""


@pytest.fixture(scope="module", params=["bash", "fish", "zsh"])
def script(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """A shell and a folder with its script, and with files to complete."""
    folder = tmp_path_factory.mktemp(request.param)
    with pytest.MonkeyPatch.context() as patch, (folder / "script").open("w") as file:
        patch.setattr("sys.stdout", file)
        assert main(["completion", request.param]) == 0
    for name in ("mine.toml", "mine.txt", "sub/other.toml"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).touch()
    return request.param, folder


def completed(script: tuple[str, Path], line: str) -> set[str]:
    """What the shell offers for the last word of a line."""
    shell, folder = script
    arguments = shlex.split(line) + ([""] if line.endswith(" ") else [])
    code = ASK[shell].format(line=shlex.quote(line), quoted=" ".join(map(shlex.quote, arguments)))
    done = subprocess.run([shell, "-c", code], cwd=folder, capture_output=True, text=True, timeout=60)
    return {row.split("\t")[0] for row in done.stdout.splitlines() if row}


def test_the_script_is_of_the_shell(script: tuple[str, Path]) -> None:
    shell, folder = script
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    done = subprocess.run([shell, "-n", "script"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_script_has_all_names(script: tuple[str, Path]) -> None:
    text = (script[1] / "script").read_text()
    offered = {*commands(), *scene_names(), *families(), *figures(extra=True), "--certify"}
    assert [name for name in offered if name.removeprefix("--") not in text] == []


CASES = [
    ("synchain ", set(commands()), {"figure_4a"}),
    ("synchain th", {"thresholds"}, {"spectrum"}),
    ("synchain run figure_4", {f"figure_4{k}" for k in "abcdef"}, {"figure_5", "mine.toml"}),
    ("synchain run mi", {"mine.toml"}, {"mine.txt"}),
    ("synchain spectrum s", {"star", "small_world"}, {"chain"}),
    ("synchain msf --topology r", {"ring"}, {"star"}),
    ("synchain thresholds two", {"two_oscillators"}, set()),
    ("synchain run --c", {"--certify"}, {"--rtol"}),
    ("synchain run --format ", {"nc", "nc4", "zarr"}, {"figure_4a"}),
    ("synchain msf --s", {"--set", "--starts"}, {"--alpha"}),
    ("synchain cache ", {"info", "clear", "warm"}, {"figure_4a"}),
    ("synchain new ", {"friction", "topology", "oscillator", "coupling"}, set()),
    ("synchain list ", {"oscillators", "couplings", "frictions", "graphs", "scenes"}, set()),
    ("synchain orbit figure_4", {"figure_4a"}, {"figure_5"}),
    ("synchain show mi", {"mine.toml", "mine.txt"}, {"figure_4a"}),
    ("synchain check mi", {"mine.toml", "mine.txt"}, {"figure_4a"}),
    ("synchain paper figure_4 figure_5", {"figure_5"}, {"figure_4a"}),
]


@pytest.mark.parametrize("script", ASK, indirect=True)  # zsh completes in a terminal only
@pytest.mark.parametrize(("line", "offered", "absent"), CASES, ids=[case[0] for case in CASES])
def test_a_line_is_completed(script: tuple[str, Path], line: str, offered: set[str], absent: set[str]) -> None:
    shell, _ = script
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    matches = completed(script, line)
    assert offered - matches == set()
    assert matches & absent == set()


def test_an_unknown_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "tcsh"]) == 2
    assert "invalid choice: 'tcsh'" in capsys.readouterr().err
