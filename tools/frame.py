"""Count the frame of the source: code, docstrings, comments, bodies of functions, double names.

    python tools/frame.py [root of a checkout]

A name is public if the reference shows it, or if it is a public attribute of a class that it shows.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("models", "codegen", "runtime")
ROOT = Path(__file__).resolve().parent.parent


def public_names() -> set[tuple[str, str]]:
    """Modules and qualified names of all that the reference shows."""
    names = set()
    front = importlib.import_module("synchain")
    shown = (*front.MODULES, "codegen.integrators", "codegen.simd", "codegen.export")
    for module in (front, *(importlib.import_module(f"synchain.{name}") for name in shown)):
        for value in (getattr(module, name) for name in module.__all__):
            if inspect.isclass(value):
                for base in value.__mro__:
                    attributes = [name for name in vars(base) if not name.startswith("_")]
                    names |= {(base.__module__, base.__qualname__)}
                    names |= {(base.__module__, f"{base.__qualname__}.{name}") for name in attributes}
            elif inspect.isfunction(function := inspect.unwrap(value) if callable(value) else None):
                names.add((function.__module__, function.__qualname__))
    return names


def definitions(node: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    """Qualified names and nodes of all functions and classes, inner ones too."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            yield prefix + child.name, child
            inner = "." if isinstance(child, ast.ClassDef) else ".<locals>."
            yield from definitions(child, prefix + child.name + inner)
        else:
            yield from definitions(child, prefix)


def strings(body: list[ast.stmt]) -> int:
    """Lines of the strings that stand alone: docstrings, and texts below constants."""
    alone = [s for s in body if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)]
    return sum(s.end_lineno - s.lineno + 1 for s in alone if isinstance(s.value.value, str))


def comments(source: str) -> int:
    """Comments, those that switch a tool off left out."""
    found = (t.string for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.type == tokenize.COMMENT)
    return sum(not re.search(r"noqa|fmt:|type: ignore", text) for text in found)


def count(root: Path) -> dict[str, float]:
    """Count all files below the packages of a checkout."""
    public, lines, files, words = public_names(), Counter[str](), Counter[str](), Counter[str]()
    classes, private, bodies, wide = Counter[str](), Counter[str](), [], 0
    for path in (path for package in PACKAGES for path in sorted((root / package).rglob("*.py"))):
        source = path.read_text("utf-8")
        tree, text = ast.parse(source), source.splitlines()
        module = "synchain." + ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
        files[path.stem] += path.stem != "__init__"
        words.update(re.findall(r"\b_[a-zA-Z]\w*", source))
        lines["all"] += len(text)
        lines["blank"] += sum(not line.strip() for line in text)
        lines["comments"] += comments(source)
        lines["docstrings of modules and constants"] += strings(tree.body)
        for name, node in definitions(tree):
            kind = "public" if (module, name) in public else "private"
            lines[f"docstrings, {kind}"] += (docstring := strings(node.body[:1]))
            if isinstance(node, ast.ClassDef):
                classes[node.name] += 1
                lines["docstrings of modules and constants"] += strings(node.body[1:])
                continue
            written = sum(bool(line.strip()) for line in text[node.body[0].lineno - 1 : node.end_lineno])
            bodies.append(written - docstring)
            arguments = node.args
            wide += len(arguments.posonlyargs + arguments.args + arguments.kwonlyargs) > 12
            private[node.name] += node.name.startswith("_") and not node.name.startswith("__")
    docstrings = sum(number for kind, number in lines.items() if kind.startswith("docstrings"))
    code = lines["all"] - lines["blank"] - docstrings
    return {
        "files": sum(files.values()),
        "lines": lines["all"],
        "code": code,
        "blank": lines["blank"],
        "docstrings": docstrings,
        **{kind: number for kind, number in sorted(lines.items()) if kind.startswith("docstrings")},
        "comments / code": round(lines["comments"] / code, 3),
        "functions": len(bodies),
        "mean body": round(sum(bodies) / len(bodies), 1),
        "bodies of at most 4 lines": round(sum(body <= 4 for body in bodies) / len(bodies), 3),
        "private functions used once": sum(words[name] == 2 for name, defined in private.items() if defined == 1),
        "functions of more than 12 arguments": wide,
        "names of modules that occur twice": sum(number > 1 for number in files.values()),
        "names of classes that occur twice": sum(number > 1 for number in classes.values()),
    }


def main() -> None:
    """Print the counts as a table."""
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    if missing := [package for package in PACKAGES if not (root / package).is_dir()]:
        sys.exit(f"{root}: found no folder {missing[0]}; expected the root of a checkout")
    for name, number in count(root).items():
        print(f"{name:40} {number:>8}")


if __name__ == "__main__":
    main()
