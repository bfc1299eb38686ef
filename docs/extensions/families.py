"""Directive `families`: every family of graphs as a function, with its options and its source."""

from __future__ import annotations

from inspect import signature

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from synchain import graphs
from synchain.models.graphs.families import Family


class Families(SphinxDirective):
    """One entry of the domain `py` for each family of `synchain.graphs`."""

    def run(self) -> list[nodes.Node]:
        """Return the entries."""
        lines: list[str] = []
        for name in dir(graphs):
            family = getattr(graphs, name) if not name.startswith("_") else None
            if isinstance(family, Family):
                call = signature(family)
                lines += [f".. py:function:: {name}{call.replace(return_annotation=call.empty)}"]
                lines += ["   :module: synchain.graphs", ""]
                lines += [f"   {line}" for line in _text(name, family)] + [""]
        return self.parse_text_to_nodes("\n".join(lines))


def _text(name: str, family: Family) -> list[str]:
    """The paragraphs of a family, as lines."""
    also = [f"Another name of :func:`~synchain.graphs.{family.name}`.", ""] if name != family.name else []
    source = ["", f"Source: {family.source}."] if family.source else []
    return [*also, f"{family.summary[0].upper()}{family.summary[1:]}; n ≥ {family.minimum}.", *source]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("families", Families)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
