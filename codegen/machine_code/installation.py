"""The error for a fault of the installation, as opposed to one of a scene."""

from __future__ import annotations


class InstallationError(RuntimeError):
    """Raised if a kernel cannot be made here: versions differ, the kernel differs, or Numba does not compile."""
