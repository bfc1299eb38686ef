"""The doctor: sound installations are called sound, and each kind of damage is seen."""

from __future__ import annotations

import importlib.metadata
import json
from pathlib import Path

import numpy as np
import pytest

from synchain.codegen.kernels import compile as loading
from synchain.codegen.simd import elementary
from synchain.runtime.cli import main
from synchain.runtime.console import doctor


def outcome(name: str) -> doctor.Check:
    (check,) = (check for check in doctor.examine() if check.name == name)
    return check


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what costs nothing."""
    monkeypatch.setattr(doctor, "CHECKS", {k: doctor.CHECKS[k] for k in ("packages", "cache", "processor", "spectrum")})


def test_a_sound_installation_without_a_cache(tmp_path: Path, monkeypatch, capsys) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "file"))
    loading._load.cache_clear()
    assert main(["doctor", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["sound"] is True
    found = {check["name"]: check for check in report["checks"]}
    assert list(found) == list(doctor.CHECKS)
    assert found.pop("cache")["outcome"] == "doubtful"
    assert {check["outcome"] for check in found.values()} == {"fine"}
    assert "error" in found["trajectory"]["found"]


def test_one_line_a_check(alone, tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "kernels"))
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines] == [["fine", name] for name in doctor.CHECKS]
    assert str(tmp_path / "kernels") in lines[1]
    assert list((tmp_path / "kernels").iterdir()) == []


def test_a_missing_and_an_old_package_are_wrong(alone, monkeypatch, capsys) -> None:
    real = importlib.metadata.version

    def version(name: str) -> str:
        if name == "tqdm":
            raise importlib.metadata.PackageNotFoundError(name)
        return "0.1" if name == "numba" else real(name)

    monkeypatch.setattr(importlib.metadata, "version", version)
    check = outcome("packages")
    assert check.outcome == "wrong"
    assert "tqdm is missing, expected tqdm>=" in check.found
    assert "numba is 0.1, expected numba>=" in check.found
    assert main(["doctor"]) == 1
    assert "wrong: packages" in capsys.readouterr().err


@pytest.mark.parametrize("mistake", [1e-15, float("nan")])
def test_a_wrong_elementary_function_is_seen(mistake: float, monkeypatch) -> None:
    exp = elementary.exp
    monkeypatch.setattr(doctor, "EDGES", {"exp": doctor.EDGES["exp"]})
    assert doctor._elementary_functions()[0] == "fine"
    monkeypatch.setattr(elementary, "exp", elementary.lane_function(lambda x: exp(x) * (1.0 + mistake)))
    assert doctor._elementary_functions()[0] == "wrong"


def test_a_wrong_answer_is_seen(monkeypatch) -> None:
    from synchain.runtime.bench.kit import own_program

    for size, expected in ((2e-9, "wrong"), (float("nan"), "wrong"), (1e-12, "fine")):

        def prepare(case, *rest, size=size):
            return lambda rtol, atol, times: (case.states + size, np.ones((len(times), 6)))

        monkeypatch.setattr(own_program, "prepare", prepare)
        assert outcome("trajectory").outcome == expected


def test_a_wrong_spectrum_is_seen(alone, monkeypatch) -> None:
    from synchain.models.graphs import topology

    real = topology.topology
    monkeypatch.setattr(topology, "topology", lambda name, n: real("ring", n))
    assert outcome("spectrum").outcome == "wrong"


def test_what_cannot_be_checked_is_wrong(alone, monkeypatch, capsys) -> None:
    def broken() -> tuple[str, str, str]:
        raise ImportError("libLLVM.so: cannot\nopen")

    monkeypatch.setitem(doctor.CHECKS, "processor", broken)
    check = outcome("processor")
    assert (check.outcome, check.found) == ("wrong", "ImportError: libLLVM.so: cannot open")
    assert main(["doctor", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["sound"] is False
