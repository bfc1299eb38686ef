"""Parse modules of kernels; their syntax trees stay in the module, where the front end looks them up."""

from __future__ import annotations

import ast
from typing import Any

TREES = "__syntax__"
"""Global variable of a module with the syntax trees of its functions, by first line (as `code.co_firstlineno` has it)."""


def functions(tree: ast.Module) -> dict[int, ast.FunctionDef]:
    """Return the top-level functions of a module by the line of their first decorator, or of `def` without one."""
    definitions = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    return {min([node.lineno, *(part.lineno for part in node.decorator_list)]): node for node in definitions}


def execute(text: str, path: str, namespace: dict[str, Any]) -> None:
    """Execute the text of a module in a namespace and keep its syntax trees there."""
    tree = ast.parse(text, path)
    namespace[TREES] = functions(tree)
    exec(compile(tree, path, "exec"), namespace)
