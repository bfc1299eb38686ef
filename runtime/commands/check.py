"""`synchain check`: claims about spectra against the proved ones."""

from __future__ import annotations

import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

from ..console.outcome import FAILED, FINE, WrongUse, discard_output, print_json, wrong_use
from ..support.error_text import counted

if TYPE_CHECKING:
    from synchain.models.claims.verdict import ClaimVerdict

SUMMARY = "check claims about exact eigenvalues, one a line of a file"
EXAMPLES = (
    "synchain check claims.txt",
    "synchain check claims.txt --json",
    "synchain check claims.txt --junit report.xml",
)

Undecided: TypeAlias = tuple[int, str, str]  # line, text and reason of a claim that cannot be decided
SHOWN = 3  # wrong sizes that are described of a line about a range of n


def configure(parser: ArgumentParser) -> None:
    parser.add_argument(
        "file",
        metavar="FILE",
        help="a text file of claims such as 'chain 4: 0, -2+sqrt(2), -2, -2-sqrt(2)' or 'star n=3..9: 0, -1^(n-2), -n'",
    )
    parser.add_argument("--json", action="store_true", help="print JSON: file, right, wrong, claims")
    parser.add_argument("--junit", metavar="XML", help="also write a JUnit report, one test case a line")


def execute(arguments: Namespace) -> int:
    from synchain.models.claims.language import read_claims
    from synchain.models.claims.verdict import verify

    with wrong_use():
        lines = read_claims(arguments.file)
    judged: list[list[ClaimVerdict]] = []
    undecided: list[Undecided] = []
    for line in lines:
        try:
            judged.append([verify(claim) for claim in line])
        except (ValueError, TypeError) as problem:
            undecided.append((line[0].line, line[0].text, " ".join(str(problem).split())))
    if arguments.junit is not None:
        with wrong_use():
            _write_junit(arguments.junit, arguments.file, judged, undecided)
    code = FAILED if _wrong(judged) else FINE
    try:
        _print(arguments, judged, undecided)
    except BrokenPipeError:  # the reader has closed the output, but the exit code counts
        discard_output()
        return code
    if undecided:
        number, _, why = undecided[0]
        more = f" (and {len(undecided) - 1} more)" * (len(undecided) > 1)
        raise WrongUse(f"{arguments.file}, line {number}: {why}{more}")
    return code


def _wrong(judged: Sequence[Sequence[ClaimVerdict]]) -> int:
    return sum(not all(v.right for v in line) for line in judged)


def _print(arguments: Namespace, judged: Sequence[Sequence[ClaimVerdict]], undecided: Sequence[Undecided]) -> None:
    wrong = _wrong(judged)
    if arguments.json:
        claims = [_as_dict(line) for line in judged]
        reasons = [{"line": line, "claim": text, "why": why} for line, text, why in undecided]
        counts = {"right": len(judged) - wrong, "wrong": wrong}
        print_json({"file": arguments.file, **counts, "claims": claims, "undecided": reasons})
    else:
        for line in judged:
            state = "right" if all(v.right for v in line) else "WRONG"
            unproved = "" if all(v.proved for v in line) else " (closed form, not multiplied out)"
            heading = f"line {line[0].claim.line}: {_name(line)}: {state}{unproved}"
            print("\n".join([heading, *_problems(line)]))
        print(f"{counted(len(judged), 'claim')}: {len(judged) - wrong} right, {wrong} wrong")
    if sys.stdout is not None:
        sys.stdout.flush()


def _name(line: Sequence[ClaimVerdict]) -> str:
    """Return the family of graphs of a line, its sizes and its options."""
    first, last = line[0].claim, line[-1].claim
    if "(" in first.graph.name and first.n is None:
        return first.graph.name
    sizes = f"n = {first.n} … {last.n}" if first.n is not None else str(first.graph.n)
    options = ((key, value if isinstance(value, tuple) else (value,)) for key, value in first.graph.options)
    return f"{first.graph.name} {sizes}" + "".join(f" {key}={','.join(map(str, values))}" for key, values in options)


def _problems(line: Sequence[ClaimVerdict]) -> list[str]:
    """Return what is wrong with a line and what is right, indented."""
    wrong = [v for v in line if not v.right]
    rows = []
    for v in wrong[:SHOWN]:
        size = f"n = {v.claim.n}: " if v.claim.n is not None else ""
        rows += [f"  {size}{problem}" for problem in v.problems]
        rows.append(f"  {size}right: {v.expected}")
    if len(wrong) > SHOWN:
        rows.append(f"  and so on: wrong for {len(wrong)} of {len(line)} sizes")
    return rows


def _as_dict(line: Sequence[ClaimVerdict]) -> dict[str, object]:
    graphs = [
        {
            "topology": v.claim.graph.name,
            "n": v.claim.graph.n,
            "options": dict(v.claim.graph.options),
            "right": v.right,
            "proved": v.proved,
            "problems": list(v.problems),
            "expected": v.expected,
        }
        for v in line
    ]
    first = line[0].claim
    return {"line": first.line, "claim": first.text, "right": all(v.right for v in line), "graphs": graphs}


def _write_junit(
    path: str, file: str, judged: Sequence[Sequence[ClaimVerdict]], undecided: Sequence[Undecided]
) -> None:
    from xml.etree import ElementTree as Tree

    from ..support.files import write_text

    counts = {
        "tests": str(len(judged) + len(undecided)),
        "failures": str(_wrong(judged)),
        "errors": str(len(undecided)),
    }
    suites = Tree.Element("testsuites", counts)
    suite = Tree.SubElement(suites, "testsuite", {"name": _legal(f"synchain check {file}"), **counts})

    def case(number: int, text: str) -> Tree.Element:
        attributes = {"name": _legal(f"line {number}: {text}"), "classname": "claims", "file": _legal(file)}
        return Tree.SubElement(suite, "testcase", attributes)

    for line in judged:
        one = case(line[0].claim.line, line[0].claim.text)
        problems = [row.strip() for row in _problems(line)]
        if problems:
            Tree.SubElement(one, "failure", {"message": _legal(problems[0])}).text = _legal("\n".join(problems))
    for number, text, why in undecided:
        Tree.SubElement(case(number, text), "error", {"message": _legal(why)})
    Tree.indent(suites)
    write_text(path, '<?xml version="1.0" encoding="utf-8"?>\n' + Tree.tostring(suites, encoding="unicode") + "\n")


def _legal(text: str) -> str:
    """Replace characters that XML cannot hold."""
    return re.sub("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "�", text)
