"""Whole kernel modules: step and driver put together, kept on disk, compiled and loaded."""
