"""Directive `package-words`: the glossary in the docstring of a package."""

from __future__ import annotations

import re
from importlib import import_module

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class PackageWords(SphinxDirective):
    """A list of definitions; the argument is the name of the package."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the list."""
        text = import_module(self.arguments[0]).__doc__ or ""
        heading, _, table = text.partition("Glossary\n--------\n")
        if not table:
            raise self.error(f"{self.arguments[0]}: found no section 'Glossary' in its docstring {heading[:60]!r}")
        lines = re.sub(r"\n {3,}", " ", table).strip().splitlines()
        entries = (re.split(r" {2,}", line, maxsplit=1) for line in lines)
        return self.parse_text_to_nodes("\n".join(f"{word}\n   {meaning}" for word, meaning in entries))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("package-words", PackageWords)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
