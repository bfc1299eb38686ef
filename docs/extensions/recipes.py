"""Run the Python of `docs/how-to` while pages are read, and put its output below each block.

Text is what a block prints, figures are those that it leaves open in pyplot.  A block that raises stops the build.
"""

from __future__ import annotations

import io
import re
from contextlib import redirect_stdout
from pathlib import Path

from sphinx.application import Sphinx

_BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.MULTILINE | re.DOTALL)


def _figures(folder: Path, page: str, start: int) -> list[str]:
    """Write and close the open figures; return a Markdown image for each."""
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    images = []
    for number in plt.get_fignums():
        name = f"{page}_{start + len(images)}.png"
        plt.figure(number).savefig(folder / name, dpi=160, bbox_inches="tight")
        images.append(f"```{{image}} ../built/how-to/{name}\n:width: 560px\n:alt: Figure of the code above\n```\n")
    plt.close("all")
    return images


def _run(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add the output of every block to the text of a page."""
    if not docname.startswith("how-to/"):
        return
    import matplotlib

    matplotlib.use("Agg")
    page, drawn = docname.rpartition("/")[2], 0
    namespace: dict[str, object] = {}

    def with_output(match: re.Match[str]) -> str:
        nonlocal drawn
        printed = io.StringIO()
        with redirect_stdout(printed):
            exec(compile(match[1], f"{docname}.md", "exec"), namespace)
        images = _figures(Path(app.srcdir) / "built" / "how-to", page, drawn)
        drawn += len(images)
        text = f"\n```text\n{printed.getvalue().rstrip()}\n```\n" if printed.getvalue().strip() else ""
        return "\n".join([match[0] + text, *images])

    source[0] = _BLOCK.sub(with_output, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Run recipes when their pages are read."""
    app.connect("source-read", _run)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
