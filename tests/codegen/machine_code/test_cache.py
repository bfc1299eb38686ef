"""The folder of compiled kernels: where it is, whose it is, and what clearing it deletes."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

import pytest

from synchain.codegen.machine_code import code_cache


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """The place of a cache folder that does not exist yet."""
    monkeypatch.setenv("SYNCHAIN_CACHE", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


def test_where_kernels_are_kept(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("SYNCHAIN_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert code_cache.cache_folder() == tmp_path / "synchain"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert code_cache.cache_folder() == tmp_path / ".cache" / "synchain"
    monkeypatch.setattr(sys, "platform", "darwin")
    assert code_cache.cache_folder() == tmp_path / "Library" / "Caches" / "synchain"
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert code_cache.cache_folder() == tmp_path / "local" / "synchain"
    monkeypatch.setenv("SYNCHAIN_CACHE", "~/mine")
    assert code_cache.cache_folder() == tmp_path / "mine"


def test_a_new_folder_belongs_to_its_user_alone(folder):
    with code_cache.open_folder(folder):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_clearing_leaves_other_files_alone(folder):
    assert code_cache.describe() == {"folder": str(folder), "kernels": 0, "drivers": 0, "bytes": 0}
    assert code_cache.clear() == {"kernels": 0, "drivers": 0}
    (folder / "__pycache__").mkdir(parents=True)
    for name, text in (
        ("kernel_a.py", "12"),
        ("kernel_b.py", "345"),
        ("__pycache__/kernel_a.nbi", "6"),
        ("kernel_a.code", "7"),
        ("kernel_b8.tmp", "8"),
        ("driver_a.py", "9"),
        ("driver_a.code", "10"),
        ("driver_b.py-0123.tmp", "11"),
        ("notes.txt", ""),
    ):
        (folder / name).write_text(text)
    assert code_cache.describe() == {"folder": str(folder), "kernels": 2, "drivers": 1, "bytes": 13}
    assert code_cache.clear() == {"kernels": 2, "drivers": 1}
    assert [p.name for p in folder.iterdir()] == ["notes.txt"]
