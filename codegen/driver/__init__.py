"""Real Python around the generated step; its text becomes part of every kernel module."""

from __future__ import annotations

from importlib.resources import files

__all__ = ["MARK", "text"]

MARK = "# --- kernel text below ---\n"


def text(name: str) -> str:
    """Return the part of a skeleton that a kernel module contains."""
    whole = files(__name__).joinpath(f"{name}.py").read_text(encoding="utf-8")
    return whole.split(MARK, 1)[1].strip("\n")
