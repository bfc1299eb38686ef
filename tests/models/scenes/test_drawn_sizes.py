"""Graphs that cannot fit are refused before their links are drawn."""

from __future__ import annotations

import pytest

import synchain as sc
from synchain.models.graphs.families import FamilyRule


@pytest.mark.parametrize("text", ["random_regular(1000, degree=999)", "erdos_renyi(900, p=0.9)"])
def test_no_link_is_drawn_of_a_graph_with_other_nodes(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FamilyRule, "links", None)
    with pytest.raises(ValueError, match=r"found graphs of \d+ nodes; expected graphs of 2 nodes"):
        sc.Scene("mass", "spring", sc.graphs.chain(2), realisations=2, draws={"topology": text})
