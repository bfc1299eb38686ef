"""`synchain check`: claims about spectra against the proved ones."""

from __future__ import annotations

import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ._outcome import FAILED, FINE, WrongUse, print_json, wrong_use

if TYPE_CHECKING:
    from synchain.models.verdict import Verdict

SUMMARY = "check claims about exact eigenvalues, one a line of a file"
EXAMPLES = (
    "synchain check claims.txt",
    "synchain check claims.txt --json",
    "synchain check claims.txt --junit report.xml",
)

SHOWN = 3
"""Of a line about a range of n, so many wrong sizes are described."""


def configure(parser: ArgumentParser) -> None:
    """Add the file and the forms of the report."""
    parser.add_argument(
        "file",
        metavar="FILE",
        help="a text file of claims such as 'chain 4: 0, -2+sqrt(2), -2, -2-sqrt(2)' or 'star n=3..9: 0, -1^(n-2), -n'",
    )
    parser.add_argument("--json", action="store_true", help="print JSON: file, right, wrong, claims")
    parser.add_argument("--junit", metavar="XML", help="also write a JUnit report, one test case a line")


def execute(arguments: Namespace) -> int:
    """Check every claim; exit code 1 where one is wrong."""
    from synchain.models.claims import read_claims
    from synchain.models.verdict import verify

    with wrong_use():
        lines = read_claims(arguments.file)
    found: list[list[Verdict]] = []
    for line in lines:
        try:
            found.append([verify(claim) for claim in line])
        except (ValueError, TypeError) as problem:
            raise WrongUse(f"{arguments.file}, line {line[0].line}: {' '.join(str(problem).split())}") from problem
    wrong = sum(not all(v.right for v in line) for line in found)
    if arguments.junit is not None:
        with wrong_use():
            _write_junit(arguments.junit, arguments.file, found, wrong)
    code = FAILED if wrong else FINE
    try:
        _print(arguments, found, wrong)
    except BrokenPipeError as closed:  # the reader has seen enough, but the answer counts
        setattr(closed, "exit_code", code)  # noqa: B010
        raise
    return code


def _print(arguments: Namespace, found: Sequence[Sequence[Verdict]], wrong: int) -> None:
    """Print all claims as JSON or text."""
    if arguments.json:
        claims = [_as_dict(line) for line in found]
        print_json({"file": arguments.file, "right": len(found) - wrong, "wrong": wrong, "claims": claims})
    else:
        for verdicts in found:
            print("\n".join(_report(verdicts)))
        print(f"{len(found)} claim{'s' * (len(found) != 1)}: {len(found) - wrong} right, {wrong} wrong")
    if sys.stdout is not None:
        sys.stdout.flush()


def _name(line: Sequence[Verdict]) -> str:
    """The graphs of a line."""
    first, last = line[0].claim, line[-1].claim
    if "(" in first.graph.name and first.n is None:
        return first.graph.name
    sizes = f"n = {first.n} … {last.n}" if first.n is not None else str(first.graph.n)
    chosen = "".join(f" {key}={_option(value)}" for key, value in first.graph.options)
    return f"{first.graph.name} {sizes}{chosen}"


def _option(value: object) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _report(line: Sequence[Verdict]) -> list[str]:
    wrong = [v for v in line if not v.right]
    believed = "" if all(v.proved for v in line) else " (closed form, not multiplied out)"
    return [f"line {line[0].claim.line}: {_name(line)}: {'WRONG' if wrong else 'right'}{believed}", *_problems(line)]


def _problems(line: Sequence[Verdict]) -> list[str]:
    """What is wrong with a line and what would be right, indented."""
    wrong = [v for v in line if not v.right]
    rows = []
    for v in wrong[:SHOWN]:
        size = f"n = {v.claim.n}: " if v.claim.n is not None else ""
        rows += [f"  {size}{problem}" for problem in v.problems]
        rows.append(f"  {size}right: {v.expected}")
    if len(wrong) > SHOWN:
        rows.append(f"  and so on: wrong for {len(wrong)} of {len(line)} sizes")
    return rows


def _as_dict(line: Sequence[Verdict]) -> dict[str, Any]:
    graphs = [
        {"topology": v.claim.graph.name, "n": v.claim.graph.n, "options": dict(v.claim.graph.options),
         "right": v.right, "proved": v.proved, "problems": list(v.problems),
         "expected": v.expected}
        for v in line
    ]  # fmt: skip
    first = line[0].claim
    return {"line": first.line, "claim": first.text, "right": all(v.right for v in line), "graphs": graphs}


def _write_junit(path: str, file: str, found: Sequence[Sequence[Verdict]], wrong: int) -> None:
    from xml.etree import ElementTree as Tree

    from ..files import write_text

    count = str(len(found))
    suites = Tree.Element("testsuites", {"tests": count, "failures": str(wrong)})
    about = {"name": _legal(f"synchain check {file}"), "tests": count, "failures": str(wrong), "errors": "0"}
    suite = Tree.SubElement(suites, "testsuite", about)
    for line in found:
        claim = line[0].claim
        name = _legal(f"line {claim.line}: {claim.text}")
        case = Tree.SubElement(suite, "testcase", {"name": name, "classname": "claims", "file": _legal(file)})
        problems = [row.strip() for row in _problems(line)]
        if problems:
            Tree.SubElement(case, "failure", {"message": _legal(problems[0])}).text = _legal("\n".join(problems))
    Tree.indent(suites)
    write_text(path, '<?xml version="1.0" encoding="utf-8"?>\n' + Tree.tostring(suites, encoding="unicode") + "\n")


def _legal(text: str) -> str:
    """The text without characters that XML cannot hold."""
    return re.sub("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "�", text)
