"""After a build: what pages link to and load exists, anchors too.

Nothing is loaded from the network.  Links to other sites are not followed.
"""

from __future__ import annotations

from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from sphinx.application import Sphinx
from sphinx.errors import SphinxError


class _Page(HTMLParser):
    """The anchors of a page, where its links lead, and what it loads."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.loads: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        words = {name: value or "" for name, value in attrs}
        self.anchors.update(words[name] for name in ("id", "name") if name in words)
        self.links.update(words[name] for name in ("href", "src") if name in words)
        self.loads.update(words[name] for name in ("src",) if name in words)
        if tag == "link":
            self.loads.add(words.get("href", ""))


def broken(folder: Path) -> list[str]:
    """A line for each link of the pages in `folder` that leads nowhere or loads from elsewhere."""
    read = cache(_Page)
    found = []
    for path in sorted(folder.rglob("*.html")):
        page, name = read(path), path.relative_to(folder)
        found += [f"{name}: loads {target} from the network" for target in page.loads if urlsplit(target).netloc]
        for target in sorted(page.links):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            goal = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not goal.is_file():
                found.append(f"{name}: {target} does not exist")
            elif parts.fragment and goal.suffix == ".html" and unquote(parts.fragment) not in read(goal).anchors:
                found.append(f"{name}: {target} has no such anchor")
    return found


def _check(app: Sphinx, exception: Exception | None) -> None:
    if exception is None and app.builder.format == "html" and (lines := broken(Path(app.outdir))):
        raise SphinxError("broken links:\n" + "\n".join(lines))


def setup(app: Sphinx) -> dict[str, bool]:
    """Check the pages when they have been written."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
