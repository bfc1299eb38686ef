"""Animations of examples without the network: drop the icon font that Matplotlib's page of an animation loads.

`static/site.css` draws the symbols of its buttons instead.
"""

from __future__ import annotations

import re

from sphinx.application import Sphinx


def _drop(_app: Sphinx, docname: str, source: list[str]) -> None:
    """Remove the link to the icon font from a page of the gallery or the tutorial."""
    if docname.startswith("built/"):
        source[0] = re.sub(r'<link rel="stylesheet"\s+href="https://[^"]*font-awesome[^"]*">', "", source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Change pages when they are read."""
    app.connect("source-read", _drop)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
