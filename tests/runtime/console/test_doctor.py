"""The doctor: sound installations are called sound, and each kind of damage is seen."""

from __future__ import annotations

import importlib.metadata
import json
from pathlib import Path

import pytest

from synchain.codegen.machine_code import compile as loading
from synchain.models.graphs.families import topology
from synchain.runtime.cli import main
from synchain.runtime.commands import doctor


def outcome(name: str) -> doctor.Check:
    (check,) = doctor.examine({name: doctor.CHECKS[name]})
    return check


def test_a_sound_installation_without_a_cache(tmp_path: Path, monkeypatch, capsys) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "file"))
    loading.forget()
    assert main(["doctor", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["sound"] is True
    checks = {check["name"]: check for check in report["checks"]}
    assert list(checks) == list(doctor.CHECKS)
    assert checks.pop("cache")["outcome"] == "doubtful"
    assert {check["outcome"] for check in checks.values()} == {"fine"}
    assert "error" in checks["trajectory"]["found"]


def test_one_line_a_check(capsys) -> None:
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == list(doctor.CHECKS)


def test_the_cache_is_named_and_left_as_it_is(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "kernels"))
    check = outcome("cache")
    assert check.outcome == "fine"
    assert str(tmp_path / "kernels") in check.found
    assert list((tmp_path / "kernels").iterdir()) == []


def test_a_missing_and_an_old_package_are_wrong(monkeypatch, capsys) -> None:
    real = importlib.metadata.version

    def version(name: str) -> str:
        if name == "tqdm":
            raise importlib.metadata.PackageNotFoundError(name)
        return "0.1" if name == "numba" else real(name)

    monkeypatch.setattr(importlib.metadata, "version", version)
    check = outcome("packages")
    assert check.outcome == "wrong"
    assert "tqdm is missing, expected tqdm>=" in check.found
    assert "numba is 0.1, expected numba" in check.found
    assert main(["doctor", "--json"]) == 1
    captured = capsys.readouterr()
    assert json.loads(captured.out)["sound"] is False
    assert "wrong: packages" in captured.err


@pytest.mark.parametrize(("error", "expected"), [(2e-9, "wrong"), (float("nan"), "wrong"), (1e-12, "fine")])
def test_a_wrong_answer_is_seen(error: float, expected: str) -> None:
    assert doctor.judge_trajectory(error, 100)[0] == expected


def test_a_wrong_spectrum_is_seen() -> None:
    for name, expected in (("ring", "wrong"), ("chain", "fine")):
        spectrum = topology(name, 4).spectrum
        assert doctor.judge_spectrum({e.exact: e.multiplicity for e in spectrum})[0] == expected


def test_what_cannot_be_checked_is_wrong() -> None:
    def broken() -> tuple[str, str, str]:
        raise ImportError("libLLVM.so: cannot\nopen")

    (check,) = doctor.examine({"processor": broken})
    assert (check.outcome, check.found) == ("wrong", "ImportError: libLLVM.so: cannot open")
