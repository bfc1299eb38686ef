"""What a repository shows to its visitors: the paper, the citation, the forms of issues."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
PAPER = (ROOT / "paper" / "paper.md").read_text("utf-8")
BIBLIOGRAPHY = (ROOT / "paper" / "paper.bib").read_text("utf-8")
FORMS = sorted(path for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml") if path.stem != "config")
SECTIONS = ["Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"]
"""Sections that the Journal of Open Source Software asks for, beside the disclosure that the authors write."""

HEAD: dict[str, Any] = yaml.safe_load(PAPER.split("---\n")[1])
BODY = PAPER.split("---\n", 2)[2]


def entries() -> dict[str, str]:
    """Key -> text of every entry of the bibliography."""
    matches = re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", BIBLIOGRAPHY, re.MULTILINE | re.DOTALL)
    assert len({key for key, _ in matches}) == len(matches) == BIBLIOGRAPHY.count("@")
    return dict(matches)


def test_the_paper_cites_its_bibliography_and_nothing_else() -> None:
    assert set(re.findall(r"@(\w+)", BODY)) == set(entries())


def test_entries_say_where_they_are_found() -> None:
    for key, text in entries().items():
        assert re.search(r"^  title +=", text, re.MULTILINE), key
        assert re.search(r"^  (doi|url|volume|journal) +=", text, re.MULTILINE), key
    dois = re.findall(r"doi +=\s*\{(.*)\}", BIBLIOGRAPHY)
    assert len(set(dois)) == len(dois) >= 10
    assert [doi for doi in dois if not re.fullmatch(r"10\.\d{4,5}/[\w./()-]+", doi)] == []


def test_the_paper_has_the_form_of_the_journal() -> None:
    assert {"title", "tags", "authors", "affiliations", "date", "bibliography"} <= set(HEAD)
    assert HEAD["bibliography"] == "paper.bib"
    homes = {affiliation["index"] for affiliation in HEAD["affiliations"]}
    assert {author["affiliation"] for author in HEAD["authors"]} == homes
    titles = re.findall(r"^# (.*)$", BODY, re.MULTILINE)
    assert titles[: len(SECTIONS)] == SECTIONS
    assert titles[-1] == "References"
    assert 750 <= len(BODY.split()) <= 1750


def test_authors_and_version_are_the_same_everywhere() -> None:
    names = [author["name"] for author in PROJECT["authors"]]
    assert [author["name"] for author in CITATION["authors"]] == names
    assert [author["name"] for author in HEAD["authors"]] == names
    assert (str(CITATION["version"]), CITATION["license"]) == (PROJECT["version"], PROJECT["license"])


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_forms_of_issues_can_be_filled_in(path: Path) -> None:
    form = yaml.safe_load(path.read_text("utf-8"))
    assert {"name", "description", "body"} <= set(form)
    fields = [field for field in form["body"] if field["type"] != "markdown"]
    assert {field["type"] for field in fields} <= {"input", "textarea", "dropdown", "checkboxes"}
    assert (
        len({field["id"] for field in fields}) == len({field["attributes"]["label"] for field in fields}) == len(fields)
    )
    assert any(field.get("validations", {}).get("required") for field in fields)


def test_the_code_of_conduct_is_the_covenant_and_is_linked() -> None:
    assert "contributor-covenant.org/version/2/1/" in (ROOT / "CODE_OF_CONDUCT.md").read_text("utf-8")
    assert "(CODE_OF_CONDUCT.md)" in (ROOT / "CONTRIBUTING.md").read_text("utf-8")


# -- workflows -------------------------------------------------------------------------------------------------

WORKFLOWS = {
    path.stem: yaml.safe_load(path.read_text("utf-8")) for path in (ROOT / ".github" / "workflows").glob("*.yml")
}
MATRIX = WORKFLOWS["tests"]["jobs"]["test"]["strategy"]["matrix"]


def test_workflows_test_every_python_and_every_system() -> None:
    pythons = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d", line)]
    assert set(pythons) <= set(MATRIX["python"])
    assert MATRIX["python"][0] == PROJECT["requires-python"].removeprefix(">=")
    assert {name.partition("-")[0] for name in MATRIX["os"]} == {"ubuntu", "macos", "windows"}
    legs = WORKFLOWS["tests"]["jobs"]["variants"]["strategy"]["matrix"]["include"]
    assert {leg["install"] for leg in legs} == {"oldest", "newest", "usual"}
    assert {leg["front_end"] for leg in legs} == {"", "numba"}


def test_a_release_is_tested_and_published_without_a_password() -> None:
    jobs = WORKFLOWS["release"]["jobs"]
    assert set(jobs["publish"]["needs"]) == {"tests", "build"}
    assert jobs["publish"]["permissions"] == {"id-token": "write"}
    assert "secrets." not in (ROOT / ".github" / "workflows" / "release.yml").read_text("utf-8")


def test_extras_and_folders_that_other_files_name_exist() -> None:
    books = yaml.safe_load((ROOT / ".readthedocs.yaml").read_text("utf-8"))
    (install,) = books["python"]["install"]
    assert set(install["extra_requirements"]) <= set(PROJECT["optional-dependencies"])
    assert (ROOT / books["sphinx"]["configuration"]).is_file()


def test_the_oldest_versions_are_the_lower_bounds() -> None:
    done = subprocess.run([sys.executable, ROOT / "tools" / "oldest.py"], capture_output=True, text=True, check=True)
    pinned = [line for line in done.stdout.splitlines() if "==" in line]
    assert len(pinned) == len(PROJECT["dependencies"])
    for pin, line in zip(map(Requirement, pinned), map(Requirement, PROJECT["dependencies"]), strict=True):
        (version,) = (part.version for part in pin.specifier)
        assert (pin.name, line.specifier.contains(version)) == (line.name, True)
