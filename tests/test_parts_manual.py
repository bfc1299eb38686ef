"""The manual's tables of oscillators, friction laws and couplings against the modules themselves."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from synchain.models.inputs.arithmetic import constant
from synchain.models.inputs.plugin_files import PluginKind, load, names
from synchain.models.interactions.coupling import STRENGTH
from synchain.models.mechanics.contact import KAPPA

MANUAL = (Path(__file__).parent.parent / "docs" / "scenes.md").read_text("utf-8")
TABLES = {OSCILLATOR: "Oscillators", FRICTION_LAW: "Friction laws", COUPLING: "Couplings"}

Row = tuple[str, float, str]


def table(title: str) -> dict[str, list[Row]]:
    """Name -> rows of (parameter, default, meaning) of the table below a title."""
    part = re.split(r"^#+ ", MANUAL.split(f"\n### {title}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]
    collected: dict[str, list[Row]] = {}
    last = ""
    for line in re.findall(r"^\| (.*) \|$", part, re.MULTILINE)[1:]:
        name, parameter, default, meaning = (cell.strip() for cell in re.split(r"(?:^|(?<= ))\| ", f"{line} "))
        last = name or last
        rows = collected.setdefault(last, [])
        if parameter:
            rows.append((parameter.strip("`"), constant(default), meaning.replace(r"\|", "|")))
    return collected


@pytest.mark.parametrize("kind", TABLES)
def test_the_tables_are_those_of_the_modules(kind: PluginKind) -> None:
    expected = {name: load(kind, name).parameters for name in names(kind)}
    if kind is COUPLING:
        expected["components"] = STRENGTH
    assert table(TABLES[kind]) == {
        name: [(p, value.default, value.meaning) for p, value in parameters_of_part.items()]
        for name, parameters_of_part in expected.items()
    }


def test_the_steepness() -> None:
    assert f"`kappa` = {KAPPA.default:.0f}, the steepness" in MANUAL
