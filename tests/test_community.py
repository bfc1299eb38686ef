"""What a repository shows to its visitors: the paper, the citation, the forms of issues."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

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
