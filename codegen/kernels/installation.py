"""The error for what is wrong with an installation and not with a scene."""

from __future__ import annotations

__all__ = ["InstallationError"]


class InstallationError(RuntimeError):
    """A kernel cannot be made here as it must be: other versions, another kernel, or a Numba that does not compile."""
