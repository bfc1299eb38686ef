"""Define the error for a fault of the installation, as opposed to a fault in a scene."""

from __future__ import annotations


class InstallationError(RuntimeError):
    """Raised if this installation cannot make a kernel: versions or kernels differ, or Numba fails to compile."""
