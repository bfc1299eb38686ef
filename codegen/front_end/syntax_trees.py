"""Parse modules of kernels; a global variable of each module holds the syntax trees for the front end."""

from __future__ import annotations

import ast
from typing import Any

# Name of the global variable with the syntax trees of a module's functions, by first line (`code.co_firstlineno`).
TREES = "__syntax__"


def functions(tree: ast.Module) -> dict[int, ast.FunctionDef]:
    """Return the top-level functions of a module by the line of their first decorator, or of `def` without one."""
    definitions = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    return {min([node.lineno, *(part.lineno for part in node.decorator_list)]): node for node in definitions}


def execute(text: str, path: str, namespace: dict[str, Any]) -> None:
    """Execute the text of a module in a namespace and keep its syntax trees there."""
    tree = ast.parse(text, path)
    namespace[TREES] = functions(tree)
    exec(compile(tree, path, "exec"), namespace)
