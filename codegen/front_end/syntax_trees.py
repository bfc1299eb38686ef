"""The syntax trees of modules of kernels: kept in the module, where the front end finds them."""

from __future__ import annotations

import ast
from typing import Any

TREES = "__syntax__"
"""What a module calls the syntax trees of its functions, by the lines that they begin in."""


def functions(tree: ast.Module) -> dict[int, ast.FunctionDef]:
    """Return the functions of a module, by the lines that they begin in."""
    found = (part for part in tree.body if isinstance(part, ast.FunctionDef))
    return {min([part.lineno, *(one.lineno for one in part.decorator_list)]): part for part in found}


def execute(text: str, path: str, space: dict[str, Any]) -> None:
    """Run the text of a module in a namespace, with the syntax from which its functions are compiled."""
    tree = ast.parse(text, path)
    space[TREES] = functions(tree)
    exec(compile(tree, path, "exec"), space)
