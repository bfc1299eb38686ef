"""The same motion said otherwise, over all functions that compute: texts, names, files, order, signs, copies, angles.

`DEFECTS` lists what is wrong today, by the defect that explains it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from forms import (
    FORMS,
    Relation,
    mirrored,
    of_order,
    pendula,
    pickled,
    renamed,
    replaced,
    swap,
    through_file,
    twice,
    written,
)
from questions import ASKED, TOLERANCE, Answer, Units, ask, expect_equal, plain_answer


def halves(answer: Answer) -> Answer:
    """The first copy of two: its states, and every second one of the sorted exponents."""
    first = {name: value[:, :2] for name, value in answer.items() if name in ("end", "state")}
    return first | {name: np.sort(value)[::-1][::2] for name, value in answer.items() if name not in first}


SAID = {
    **{form: Relation(written(form)) for form in FORMS},
    "renamed": Relation(renamed),
    "permuted": Relation(lambda scene: of_order(scene, (1, 0)), swap),
    "mirrored": Relation(mirrored),
}
"""Equal up to rounding and the error of the method."""

KEPT = {"pickled": pickled, "replaced and back": replaced}
"""Equal to the last bit."""

BETWEEN_NODES = {"permuted", "mirrored"}
ONE_NODE = {"follow", "skeleton"}
QUICK = {
    ("run", "numbers"),
    ("run", "renamed"),
    ("run", "mirrored"),
    ("follow", "trigonometric"),
    ("equilibrium", "trigonometric"),
    ("equilibrium", "renamed"),
    *((name, "permuted") for name in ASKED),
}
"""What shares kernels with other tests, or needs few."""

REFUSED = {("thresholds", "mirrored")}
"""Functions that refuse, in a sentence, how a relation says the motion: a graph with a positive eigenvalue."""

DEFECTS: dict[str, list[tuple[str, str]]] = {}
"""Defect -> pairs of (function, relation) that are wrong today."""
KNOWN = {case: defect for defect, cases in DEFECTS.items() for case in cases}


def cases() -> list[object]:
    collected = []
    for name in ASKED:
        for relation in SAID:
            if (name in ONE_NODE and relation in BETWEEN_NODES) or (name, relation) in REFUSED:
                continue
            marks = [] if (name, relation) in QUICK else [pytest.mark.long]
            if (name, relation) in KNOWN:
                marks.append(pytest.mark.xfail(strict=True, reason=KNOWN[name, relation]))
            collected.append(pytest.param(name, relation, marks=marks, id=f"{name}-{relation}"))
    return collected


@pytest.mark.parametrize(("name", "relation"), cases())
def test_the_same_motion_said_otherwise_has_the_same_answer(
    name: str, relation: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    said = SAID[relation]
    answer = said.back(ask(name, tmp_path, change=said.change))
    expect_equal(name, answer, plain_answer(name, tmp_path_factory.getbasetemp()))


@pytest.mark.parametrize("name", ASKED)
@pytest.mark.parametrize("attribute", [*KEPT, "through its file"])
def test_a_scene_that_was_kept_has_the_same_answer_in_bits(
    name: str, attribute: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    change = KEPT.get(attribute) or through_file(tmp_path)
    answer, expected = ask(name, tmp_path, change=change), plain_answer(name, tmp_path_factory.getbasetemp())
    for what, value in expected.items():
        np.testing.assert_array_equal(answer[what], value, err_msg=f"{name}: {what}")


COPIES = ("run", "stream", "equilibrium", "lyapunov_spectrum")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n == "equilibrium" else pytest.mark.long) for n in COPIES]
)
def test_two_copies_without_a_link_move_as_one_does(
    name: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    base = plain_answer(name, tmp_path_factory.getbasetemp())
    answer = ask(name, tmp_path, change=twice)
    expected = {what: np.sort(value)[::-1] if what not in ("end", "state") else value for what, value in base.items()}
    expect_equal(name, halves(answer), expected)


TURNED = [pytest.param(name, marks=[] if name in ("run", "equilibrium") else [pytest.mark.long]) for name in ASKED]


@pytest.mark.parametrize("turns", [1, -1000])
@pytest.mark.parametrize("name", TURNED)
def test_angles_may_be_shifted_by_turns(name: str, turns: int, tmp_path: Path) -> None:
    expected = ask(name, tmp_path, change=pendula)
    (tmp_path / "turned").mkdir()
    answer = ask(name, tmp_path / "turned", Units(offset=(2.0 * np.pi * turns, 0.0)), pendula)
    expect_equal(name, answer, expected, times=max(1.0, abs(turns) * 1e-6 / TOLERANCE[name]))
