"""Claims about spectra: right ones pass, every kind of mistake is found exactly, and nothing in a file is run."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import pytest
import sympy as sp
from claim_files import verdicts
from effort import effort
from family_sizes import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.graphs import chain, ring, star
from synchain.models.algebra.equality import equal
from synchain.models.claims.language import read_claims
from synchain.models.claims.number_text import exact_number, whole_number
from synchain.models.claims.verdict import verify
from synchain.models.graphs.families import topology
from synchain.runtime.cli import main

REFUSAL = 15_000
"""A refusal takes up to 4700 calls."""


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The modules that a command imports and the families that it finds are no effort of what it refuses later."""
    path = tmp_path_factory.mktemp("first") / "claims.txt"
    path.write_text("chain 4: 0\nchian 4: 0")
    main(["check", str(path)])


RIGHT = [
    "chain 4: -2-sqrt(2), -2, -2+sqrt(2), 0",
    "chain 4: 0, -2, -2+sqrt(2), -(2+sqrt(2))  # a comment",
    "star 6: 0, -1^4, -6",
    "star 6: 0, -1, -1^2, -1, -6",
    "star n=2..12: 0, -1^(n-2), -n",
    "complete n=2..9: 0, -n^(n-1)",
    "ring n=3..9: -4*sin(k*pi/n)**2 for k=0..n-1",
    "ring 5: 0, (-5+sqrt(5))/2^2, (-5-sqrt(5))/2^2",
    "ring 5: 0, 2*cos(2*pi/5)-2^2, 2*cos(4*pi/5)-2^2",
    "chain n=1..12: -2+2*cos(k*pi/n) for k=0..n-1",
    "chain 4: ~-3.414, -2, ~-0.59, 0",
    "chain 4: ~-3.41421356237309504880, -2, ~-6e-1, ~0",
    "matrix G.txt: 0, -1+I/2, -1-I/2",
    "chain 4: -2, 0, -2-sqrt(2), -sqrt(6-4*sqrt(2))",
    "hypercube 8: 0, -2^3, -4^3, -6",
    "torus 9 shape=3x3: 0, -3^4, -6^4",
    "circulant n=5..9 offsets=1: -4*sin(k*pi/n)**2 for k=0..n-1",
    "complete_bipartite 7 left=2: 0, -2^4, -5, -7",
    "erdos_renyi 5 p=1 seed=7: 0, -5^4",
    "chain 80: -4*sin(k*pi/160)**2 for k=0..79",
]


@pytest.mark.parametrize("text", RIGHT)
def test_right(text: str, tmp_path: Path) -> None:
    verdict_list = verdicts(tmp_path, text)
    assert [v.problems for v in verdict_list if not v.right] == []


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        ("chain 3: 0, -1, -2", ["claimed -2: no eigenvalue; the nearest is -1", "not claimed: -3, once"]),
        ("star 6: 0, -1^3, -6", ["claimed -1 3 times; it occurs 4 times"]),
        ("star 6: 0, -1^5, -6", ["claimed -1 5 times; it occurs 4 times"]),
        ("star 6: 0, -1^4", ["not claimed: -6, once"]),
        ("chain 2: 0, -2, 7", ["claimed 7: no eigenvalue; the nearest is 0"]),
        (
            "chain 3: 0, ~-1.0, ~-2.9",
            ["claimed ~-2.9: no eigenvalue rounds to it; the nearest", "not claimed: -3, once"],
        ),
        ("chain 3: 0, ~-1, ~-1, -3", ["claimed ~-1 once more than eigenvalues are left that round to it"]),
        (
            "matrix G.txt: 0, -1+I/2, -1-I/3",
            ["claimed -1 - I/3: no eigenvalue; the nearest is", "not claimed: -1 - I/2"],
        ),
    ],
)
def test_wrong(text: str, problems: list[str], tmp_path: Path) -> None:
    (verdict,) = verdicts(tmp_path, text)
    assert len(verdict.problems) == len(problems)
    assert all(
        problem.replace("-1-I/3", "-1 - I/3").startswith(message)
        for problem, message in zip(verdict.problems, problems, strict=True)
    ), verdict.problems


def test_a_difference_far_below_any_float_is_found(tmp_path: Path) -> None:
    tiny = "1/(10**29*10**29*10**29*10**29)"
    verdict_list = verdicts(tmp_path, f"chain 4: 0, -2, -2+sqrt(2), -2-sqrt(2)+{tiny}")
    assert [v.right for v in verdict_list] == [False]


def test_a_family_is_wrong_only_where_it_is(tmp_path: Path) -> None:
    """-4 once and -n are one number for the star of 4."""
    verdict_list = verdicts(tmp_path, "star n=3..6: 0, -1^(n-2), -4")
    assert [v.claim.n for v in verdict_list if v.right] == [4]


@pytest.mark.parametrize(("name", "n"), cases(6, 8, 12))
def test_the_expected_spectrum_is_a_right_claim(name: str, n: int, tmp_path: Path) -> None:
    (first,) = verdicts(tmp_path, f"{name} {n}: 17")
    assert not first.right
    (again,) = verdicts(tmp_path, f"{name} {n}: {first.expected}")
    assert again.problems == ()


@settings(max_examples=30, deadline=None)
@given(st.data())
def test_exchanging_two_multiplicities_is_noticed(data: st.DataObject) -> None:
    graph = data.draw(st.sampled_from([chain(5), ring(6), star(7), topology("hypercube", 8)]))
    pairs = [(e.text, e.multiplicity) for e in graph.spectrum.eigenvalues]
    index = data.draw(st.integers(0, len(pairs) - 1))
    change = data.draw(st.sampled_from([-1, 1]))
    entries = [f"({text})^{m + change * (i == index)}" for i, (text, m) in enumerate(pairs)]
    line = f"{graph.name} {graph.n}: {', '.join(entries)}"
    from synchain.models.claims.language import _line

    (claim,) = _line(1, line, Path("."))
    assert len(verify(claim).problems) == 1


# -- equality of algebraic numbers --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("sqrt(5+2*sqrt(6))", "sqrt(2)+sqrt(3)"),
        ("sqrt(2+sqrt(2))/2", "cos(pi/8)"),
        ("cos(2*pi/7)+cos(4*pi/7)+cos(6*pi/7)", "-1/2"),
        ("(2+sqrt(5))**(1/3)", "(1+sqrt(5))/2"),
        ("exp(2*I*pi/7)+exp(-2*I*pi/7)", "2*cos(2*pi/7)"),
        ("1/(sqrt(2)-1)", "1+sqrt(2)"),
        ("sin(pi/7)*sin(2*pi/7)*sin(3*pi/7)", "sqrt(7)/8"),
    ],
)
def test_equal_numbers_in_other_words(a: str, b: str) -> None:
    assert equal(exact_number(a), exact_number(b))
    assert not equal(exact_number(f"{a}+1/10**25"), exact_number(b))


def test_sums_of_fractions_have_the_bound_of_their_common_denominator() -> None:
    """1/3 and 1/7 times a root: the numerator of their difference is larger than those of both."""
    near = sp.sqrt(2) / 10**20
    far = sp.sqrt(2) / (10**20 + 1)
    assert not equal(near, far)
    assert not equal(sp.sqrt(3) / 10**40 + sp.Rational(1, 10**60), sp.sqrt(3) / 10**40)


# -- text ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-2-sqrt(2)", -2 - sp.sqrt(2)),
        ("1/2", sp.Rational(1, 2)),
        ("2**-1", sp.Rational(1, 2)),
        ("3*I", 3 * sp.I),
        ("4*sin(pi/6)**2", sp.S.One),
        ("exp(I*pi)", -sp.S.One),
        ("cos(pi*(1/3 + 1/6))", sp.S.Zero),
    ],
)
def test_numbers(text: str, value: sp.Expr) -> None:
    number = exact_number(text)
    assert number == value
    assert not number.atoms(sp.Float)


def test_letters() -> None:
    assert exact_number("n*(n-1)/2", {"n": 7}) == 21
    assert whole_number("n-2", {"n": 5}) == 3
    with pytest.raises(ValueError, match="expected a whole number"):
        whole_number("n/2", {"n": 5})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("chain 4: -3.414, -2, -0.586, 0", "write ~ before a decimal"),
        ("chain 4: 1e3", "write ~ before a decimal"),
        ("chain 4: .5", "write ~ before a decimal"),
        ("chain 4: ~-3.414+1", "unreadable approximation"),
        ("chain 4: ~nan", "unreadable approximation"),
        ("chain 4: pi", "pi is read inside sin, cos and exp only"),
        ("chain 4: cos(1)", "expected a rational times pi"),
        ("chain 4: cos(sqrt(2)*pi)", "expected a rational times pi"),
        ("chain 4: exp(pi)", "expected a rational times I*pi"),
        ("chain 4: 1/(sqrt(2)*sqrt(3)-sqrt(6))", "divides by zero"),
        ("chain 4: 1/(sqrt(5+2*sqrt(6))-sqrt(2)-sqrt(3))", "divides by zero"),
        ("chain 4: 1/0", "divides by zero"),
        ("chain 4: 0**-1", "divides by zero"),
        ("chain 4: 9**9**9", "exponent"),
        ("chain 4: (((((10**30)**64)**64)**64)**64)", "grows beyond"),
        ("chain 4: 1" + "0" * 31, "more than 30 digits"),
        ("chain 4: " + "(" * 160 + "1" + ")" * 160, "expected at most 300"),
        ("chain 4: 1" + "+1" * 30, "nests more than"),
        ("chain 4: __import__('os')", "character"),
        ("chain 4: n.real", "expected whole numbers"),
        ("chain 4: x", "expected whole numbers"),
        ("chain 4: True", "expected whole numbers"),
        ("chain 4: 1j", "expected whole numbers"),
        ("chain 4: lambda", "unreadable number"),
        ("chain 4: 0, , 1", "empty entry"),
        ("chain 4:", "empty entry"),
        ("chain 4: 2^3^4", "2 times ^"),
        ("chain 4: 2^-1", "multiplicity -1"),
        ("chain 4: 2^sqrt(2)", "expected a whole number"),
        ("chain 4: 1 for n=0..3", "has a meaning already"),
        ("chain 4: k for k=0..100000", "values of k"),
        ("chain 4: 0^100001", "more than 100000 eigenvalues"),
        ("chain 4 0, 1", "expected 'chain 4"),
        ("chain four: 0", "before the colon"),
        ("chian 4: 0", "unknown topology 'chian'"),
        ("torus 9 shape=2x5: 0", "expected at least 3"),
        ("torus 9 sides=3x3: 0", "unknown option 'sides'"),
        ("torus 9 shape=3x3 shape=3x3: 0", "option shape is given twice"),
        ("torus 9 shape: 0", "before the colon"),
        ("ring 2: 0", "expected at least 3"),
        ("star n=5..3: 0", "range that rises"),
        ("star n=5..501: 0", "ends at 500"),
        ("chain 501: 0", "at most 500 nodes"),
        ("star n=1..3: -1^(n-2)", "for n = 1"),
        ("matrix none.txt: 0", "does not exist"),
        ("# nothing", "no claim"),
    ],
)
def test_what_cannot_be_read_is_refused(
    text: str, message: str, ready: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "claims.txt"
    path.write_text(text)
    code, calls = effort(lambda: main(["check", str(path)]))
    assert code == 2
    assert calls < REFUSAL
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert "no claim" in err or "line 1" in err
    assert len(err.splitlines()) <= 2


def test_numbers_that_need_too_many_digits_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    roots = "+".join(f"sqrt({p})" for p in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71))
    path = tmp_path / "claims.txt"
    path.write_text(f"chain 4: {roots}")
    assert main(["check", str(path)]) == 2
    assert "bits to be compared exactly" in capsys.readouterr().err


def test_approximations_are_intervals_of_half_a_unit(tmp_path: Path) -> None:
    (claim,), *_ = read_claims(_written(tmp_path, "chain 4: ~-3.40, ~1.5e-3"))
    assert claim.numbers[0].interval == (Fraction(-3405, 1000), Fraction(-3395, 1000))
    assert claim.numbers[1].interval == (Fraction(145, 100000), Fraction(155, 100000))


def _written(folder: Path, text: str) -> Path:
    path = folder / "claims.txt"
    path.write_text(text, encoding="utf-8")
    return path


def test_approximations_share_eigenvalues_as_well_as_they_can(tmp_path: Path) -> None:
    """-1 is in both intervals, -0.6 in one: taking the first that fits would leave one without."""
    (tmp_path / "M.txt").write_text("-1 1 0 0\n0 -3/5 3/5 0\n0 0 -3 3\n0 0 0 0\n")
    for text in ("~-1, ~-1.0, ~-3, 0", "~-1.0, ~-1, ~-3, 0"):
        (claim,), *_ = read_claims(_written(tmp_path, f"matrix M.txt: {text}"))
        assert verify(claim).problems == ()


# -- the command --------------------------------------------------------------------------------------------


def test_exit_codes_and_forms(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _written(tmp_path, "# two\nchain 3: 0, -1, -3\n\nstar n=3..9: 0, -1^(n-2), -5\n")
    report = tmp_path / "report.xml"
    assert main(["check", str(path), "--junit", str(report)]) == 1
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "line 2: chain 3: right"
    assert out[1] == "line 4: star n = 3 … 9: WRONG"
    assert out[2:5] == [
        "  n = 3: claimed -5: no eigenvalue; the nearest is -3",
        "  n = 3: not claimed: -3, once",
        "  n = 3: right: 0, -1, -3",
    ]
    assert out[-2:] == ["  and so on: wrong for 6 of 7 sizes", "2 claims: 1 right, 1 wrong"]
    assert main(["check", str(path), "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["right"], answer["wrong"]) == (1, 1)
    assert [(c["line"], c["right"], len(c["graphs"])) for c in answer["claims"]] == [(2, True, 1), (4, False, 7)]
    assert answer["claims"][1]["graphs"][2] == {
        "topology": "star",
        "n": 5,
        "options": {},
        "right": True,
        "proved": True,
        "problems": [],
        "expected": "0, -1^3, -5",
    }
    suites = ElementTree.parse(report).getroot()
    cases = suites.findall("testsuite/testcase")
    assert [suites.get("tests"), suites.get("failures"), len(cases)] == ["2", "1", 2]
    assert [len(case.findall("failure")) for case in cases] == [0, 1]
    assert "not claimed: -3" in str(cases[1].find("failure").text)  # type: ignore[union-attr]
    assert main(["check", str(_written(tmp_path, "chain 3: 0, -1, -3"))]) == 0


def test_files_that_cannot_be_written_or_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _written(tmp_path, "chain 3: 0, -1, -3")
    assert main(["check", str(path), "--junit", str(tmp_path / "none" / "r.xml")]) == 2
    assert main(["check", str(tmp_path / "none.txt")]) == 2
    assert main(["check", str(tmp_path)]) == 2
    path.write_bytes(b"chain 3: 0, \xff")
    assert main(["check", str(path)]) == 2
    assert "UTF-8" in capsys.readouterr().err


def test_claims_that_cannot_be_decided_do_not_hide_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, report = tmp_path / "claims.txt", tmp_path / "report.xml"
    path.write_text("erdos_renyi 501: largest < 0\nchain 3: 0, -1, -3\nrandom_cubic 600: distinct = 3\n")
    assert main(["check", str(path), "--junit", str(report)]) == 2
    shown = capsys.readouterr()
    assert shown.out.splitlines() == ["line 2: chain 3: right", "1 claim: 1 right, 0 wrong"]
    assert "line 1: erdos_renyi 501: a graph without a closed form" in shown.err
    assert "(and 1 more)" in shown.err
    suites = ElementTree.parse(report).getroot()
    assert (suites.get("tests"), suites.get("failures"), suites.get("errors")) == ("3", "0", "2")
    assert [case.find("error") is None for case in suites.iter("testcase")] == [True, False, False]
    assert main(["check", str(path), "--json"]) == 2
    answer = json.loads(capsys.readouterr().out)
    assert [u["line"] for u in answer["undecided"]] == [1, 3]
