"""Papers: each script is short, cites its paper, and finds the printed numbers; a wrong number is seen."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

from synchain.results import Reproduction
from synchain.runtime import papers
from synchain.runtime.cli import main

MOST_LINES = 30
"""Lines of a script without its docstring, comments and empty lines."""
CITATION = re.compile(r"(.+( &|et al\.).*|\w+), \D+( \d+, \w+)? \(\d{4}\)\.$")
"""Authors or an author, journal, volume and page (some special issues have none), year."""

each = pytest.mark.parametrize("name", papers.names())


@each
def test_a_script_is_short_and_cites_its_paper(name: str) -> None:
    text = papers.script(name).read_text("utf-8")
    page = ast.get_docstring(ast.parse(text), clean=False)
    assert page is not None
    lines = page.splitlines()
    assert lines[2] == "=" * len(lines[1])
    assert CITATION.match(lines[4])
    assert name.rpartition("_")[2] in lines[4]
    code = text[text.index('"""', text.index('"""') + 3) + 3 :]
    assert len(re.findall(r"^[^#\n].*", code, re.MULTILINE)) <= MOST_LINES
    assert set(re.findall(r"^(?:import|from) (\w+)", code, re.MULTILINE)) <= {
        "matplotlib",
        "numpy",
        "sympy",
        "synchain",
    }


@each
def test_the_printed_numbers_are_found(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    mpl.use("Agg")
    table = papers.reproduce(name)
    assert table.reproduced, f"\n{table}"
    assert plt.get_fignums()
    plt.close("all")


def test_the_command_lists_papers_and_refuses_others(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(papers.names())
    assert "Clusters on the way to synchrony: Bayani et al., Nature Communications 15, 4955 (2024)." in "\n".join(lines)
    assert main(["reproduce", "bayani_2023"]) == 2
    assert "unknown paper 'bayani_2023'; known: " in capsys.readouterr().err
    assert main(["reproduce"]) == 2
    assert "found no paper; expected a name" in capsys.readouterr().err


def test_the_exit_code_tells_a_number_that_differs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for found, code in ((1.05, 0), (1.2, 1), (np.nan, 1)):
        table = Reproduction({"threshold": (1.0, found, 0.1)})
        monkeypatch.setattr(papers, "reproduce", lambda name, table=table: table)
        assert main(["reproduce", papers.names()[0]]) == code
        assert ("not within 0.1" in capsys.readouterr().out) == bool(code)
