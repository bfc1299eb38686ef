"""Nodes and edges of a GraphML document, without entities: a document that declares any is refused unread."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

__all__ = ["parsed"]

Edge = tuple[str, str, Any, bool]


def parsed(text: str, name: str, weight: str) -> tuple[list[str], list[Edge]]:
    """The node names in order, and edges (from, to, weight as text, one-way); ValueError on anything else."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # anywhere: what looks like a comment may be none
        raise ValueError(f"{name} declares a document type or entities; expected plain GraphML: remove <!DOCTYPE …>")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"{name} is no XML: {error}") from None
    graphs = [element for element in root.iter() if _tag(element) == "graph"]
    if _tag(root) != "graphml" or len(graphs) != 1:
        raise ValueError(f"{name} holds {len(graphs)} graphs in <{_tag(root)}>; expected one, not nested, in <graphml>")
    graph = graphs[0]
    keys, default = _keys(root, weight)
    nodes = [_attribute(element, "id", name) for element in graph if _tag(element) == "node"]
    if len(set(nodes)) != len(nodes):
        raise ValueError(f"{name} has two nodes of one id; expected each id once")
    return nodes, list(_edges(graph, set(nodes), keys, default, name))


def _edges(graph: ElementTree.Element, nodes: set[str], keys: set[str], default: str, name: str) -> Iterator[Edge]:
    directed = graph.get("edgedefault", "undirected") == "directed"
    for element in graph:
        if _tag(element) == "hyperedge":
            raise ValueError(f"{name} has a hyperedge; expected edges of two nodes")
        if _tag(element) != "edge":
            continue
        ends = [_attribute(element, end, name) for end in ("source", "target")]
        unknown = next((end for end in ends if end not in nodes), None)
        if unknown is not None:
            raise ValueError(f"{name} has an edge to node {unknown!r}, which it does not list")
        given = [child.text or "" for child in element if _tag(child) == "data" and child.get("key") in keys]
        one_way = {"true": True, "false": False}.get(element.get("directed", ""), directed)
        yield ends[0], ends[1], given[0].strip() if given else default, one_way


def _keys(root: ElementTree.Element, weight: str) -> tuple[set[str], str]:
    """The ids under which edges hold their weight (one for each type of number), and its default."""
    ids, default = set[str](), "1"
    for element in root:
        if (
            _tag(element) == "key"
            and element.get("for", "all") in ("edge", "all")
            and element.get("attr.name") == weight
        ):
            ids.add(element.get("id", ""))
            default = next((child.text or "" for child in element if _tag(child) == "default"), default).strip()
    return ids, default


def _attribute(element: ElementTree.Element, key: str, name: str) -> str:
    value = element.get(key)
    if value is None:
        raise ValueError(f"{name}: <{_tag(element)}> has no {key!r}; expected one")
    return value


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]
