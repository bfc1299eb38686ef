"""Floating-point operations of a step, counted in the text of its kernel and of every function that
it calls.

One for each +, -, *, / and square root, two for a fused multiply-add, and those of its own text for
an elementary function; none for signs, comparisons, selections, maxima, roundings, conversions,
work on bits, loads and stores.
"""

from __future__ import annotations

import ast
import inspect
from dataclasses import dataclass, field

from synchain.codegen.kernels.kernel_text import KernelSource
from synchain.codegen.simd import elementary

PRIMITIVE = {"fma": 2, "multiply_add": 2, "sqrt": 1} | dict.fromkeys(
    (
        "absolute",
        "any_lane",
        "broadcast",
        "copysign",
        "flip_if_odd",
        "floor",
        "lane_bits",
        "load",
        "maximum",
        "minimum",
        "one_lane",
        "scale_binary",
        "select",
        "split_binary",
        "store",
        "truncated",
        "range",
    ),
    0,
)
"""Operations of what is no function of the text."""

FREE = (ast.BitAnd, ast.BitOr, ast.BitXor, ast.LShift, ast.RShift)


@dataclass(slots=True)
class Counter:
    """Counts the floating-point operations of functions in texts, each text given as its module's
    source.
    """

    functions: dict[str, ast.FunctionDef] = field(default_factory=dict)
    constants: dict[str, object] = field(default_factory=dict)
    known: dict[str, int] = field(default_factory=dict)

    def read(self, text: str) -> None:
        """Add the functions and constants of a module."""
        for statement in ast.parse(text).body:
            if isinstance(statement, ast.FunctionDef):
                if any(isinstance(d, ast.Name) and d.id == "intrinsic" for d in statement.decorator_list):
                    self.known[statement.name] = 0  # works on the bits
                self.functions[statement.name] = statement
            elif isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant):
                for name in statement.targets:
                    if isinstance(name, ast.Name):
                        self.constants[name.id] = statement.value.value

    def count(self, name: str) -> int:
        """Operations of one call; ValueError for what cannot be counted in the text (loops over
        data, powers).
        """
        if name not in self.known:
            if name in PRIMITIVE:
                self.known[name] = PRIMITIVE[name]
            elif name in self.functions:
                self.known[name] = sum(self._of(statement) for statement in self.functions[name].body)
            else:
                raise ValueError(f"function {name!r} is in none of the texts; cannot count its operations")
        return self.known[name]

    def _of(self, part: ast.AST) -> int:
        if isinstance(part, (ast.For, ast.While, ast.IfExp)):
            raise ValueError(f"line {part.lineno}: {type(part).__name__} cannot be counted; expected straight text")
        if isinstance(part, ast.If):
            return sum(map(self._of, part.body if self._truth(part.test) else part.orelse))
        total = sum(self._of(child) for child in self._inside(part))
        if isinstance(part, ast.BinOp):
            total += self._operator(part)
        if isinstance(part, ast.Call):
            if not isinstance(part.func, ast.Name):
                raise ValueError(
                    f"line {part.lineno}: {ast.unparse(part.func)} cannot be counted; expected a plain name"
                )
            total += self.count(part.func.id)
        return total

    def _inside(self, part: ast.AST) -> list[ast.AST]:
        """What lies inside, less the integer arithmetic of addresses."""
        if isinstance(part, ast.Call) and isinstance(part.func, ast.Name) and part.func.id in ("load", "store"):
            return list(part.args[2:])
        return list(ast.iter_child_nodes(part))

    def _operator(self, part: ast.BinOp) -> int:
        if isinstance(part.op, (ast.Add, ast.Sub, ast.Mult, ast.Div)):
            fixed = all(isinstance(side, ast.Constant) for side in (part.left, part.right))
            return 0 if fixed else 1
        if isinstance(part.op, FREE):
            return 0
        raise ValueError(f"line {part.lineno}: operator {type(part.op).__name__} cannot be counted")

    def _truth(self, test: ast.expr) -> bool:
        if isinstance(test, ast.Name) and test.id in self.constants:
            return bool(self.constants[test.id])
        raise ValueError(f"line {test.lineno}: the condition {ast.unparse(test)} is no constant of the text")


def operations(source: KernelSource) -> int:
    """Operations of one step in one lane, from the text of a kernel that is written out; ValueError
    for one with loops.
    """
    if source.driver.looped:
        raise ValueError("operations are counted in unrolled kernels alone; found one that loops over its nodes")
    counter = Counter()
    counter.read(inspect.getsource(elementary))
    counter.read(source.text)
    return counter.count("step")
