"""Translate functions of numbers and arrays of doubles from a subset of Python to C99.

The subset: annotated arguments; assignments to names and elements; `for` over `range`, `while`, `if`; arithmetic,
comparisons, conditional expressions and calls; `np.empty` for local arrays.  A variable is an int if all values that it is
assigned are, else a double; variables of a function are declared at its top.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterable, Iterator

# The declaration of an argument or function for each annotation.
TYPES = {
    "float": "double {}",
    "int": "int {}",
    "None": "void {}",
    "Doubles": "double *{}",
    "Seen": "void (*{})(double, int, double, double)",
}

# Functions with other names in C.
NAMES = {"max": "fmax", "min": "fmin", "abs": "fabs", "slopes": "rhs", "sqrt": "sqrt"}

SIGNS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/", ast.Mod: "%", ast.Lt: "<", ast.LtE: "<=",
    ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.And: "&&", ast.Or: "||",
    ast.LShift: "<<",
}  # fmt: skip


# How tightly an expression binds; choices, `and` and `or` within others always get parentheses.
CHOICE, COMPARISON, SUM, TERM, UNARY = range(5)


def in_c(source: str, constants: Iterable[str]) -> list[str]:
    """Return the lines of C for functions and tuples of module constants; `constants` are further integers."""
    tree, lines = ast.parse(source), source.splitlines()
    functions = [s for s in tree.body if isinstance(s, ast.FunctionDef)]
    whole = {f.name for f in functions if _annotation(f.returns) == "int"}
    text, integers = list[str](), {*constants}
    for s in tree.body:
        if isinstance(s, ast.Assign):
            names, values = (
                [ast.unparse(e) for e in getattr(side, "elts", [side])] for side in (s.targets[0], s.value)
            )
            if all(value.isdigit() for value in values):
                integers |= set(names)
                text.append(f"enum {{ {', '.join(map(' = '.join, zip(names, values, strict=True)))} }};")
            else:
                text += [f"static const double {' = '.join(pair)};" for pair in zip(names, values, strict=True)]
    for f in functions:
        text += ["", *_Function(f, lines, whole, integers).text()]
    return text


class _Function:
    def __init__(self, function: ast.FunctionDef, lines: list[str], whole: set[str], constants: Iterable[str]) -> None:
        self.function, self.lines, self.functions = function, lines, whole
        self.arguments = {a.arg: _annotation(a.annotation) for a in function.args.args}
        self.ints = {*constants} | {name for name, kind in self.arguments.items() if kind == "int"}
        # a variable is an int until it is assigned a double
        assigned = [(t.id, v) for t, v in _assignments(function.body) if isinstance(t, ast.Name)]
        self.ints |= {name for name, _ in assigned}
        while doubles := {name for name, v in assigned if name in self.ints and not self.whole(v)}:
            self.ints -= doubles
        self.variables = dict.fromkeys(name for name, v in assigned if name not in self.arguments and not _is_array(v))

    def text(self) -> list[str]:
        f = self.function
        head = ", ".join(TYPES[kind].format(name) for name, kind in self.arguments.items())
        head = head.replace("double *numbers", "const double *numbers")
        public = "" if f.name in ("begin", "run") else "static "
        about = textwrap.wrap(" ".join((ast.get_docstring(f) or "").split()), 105)
        declared = [
            f"{kind} {', '.join(names)};"
            for kind, names in (
                ("int", [name for name in self.variables if name in self.ints]),
                ("double", [name for name in self.variables if name not in self.ints]),
            )
            if names
        ]
        body = [*declared, *self.block(f.body[1:])]
        lines = textwrap.wrap(
            f"{public}{TYPES[_annotation(f.returns)].format(f.name)}({head})", 105, subsequent_indent="    "
        )
        return ["/* " + "\n   ".join(about) + " */", *lines, "{", *(f"    {line}" for line in body), "}"]

    def block(self, body: Iterable[ast.stmt]) -> list[str]:
        """Return the lines of some statements, with the comments in front of them."""
        text = []
        for s in body:
            above = self.lines[s.lineno - 2].strip()
            text += [f"/* {above[2:]} */"] if above.startswith("# ") else []
            text += self.statement(s)
        return text

    def statement(self, s: ast.stmt) -> list[str]:
        match s:
            case ast.Assign([ast.Name(name)], value) if _is_array(value):
                assert isinstance(value, ast.Call)
                return [f"double {name}[{self.value(value.args[0])}];"]
            case ast.Assign([target], value):
                return [f"{self.value(target)} = {self.value(value)};"]
            case ast.AugAssign(target, sign, value):
                return [f"{self.value(target)} {SIGNS[type(sign)]}= {self.value(value)};"]
            case ast.For(ast.Name(name), ast.Call(args=bounds), body):
                start, stop = ([ast.Constant(0), *bounds] if len(bounds) < 2 else bounds)[:2]
                until, step = ("<", "++") if len(bounds) < 3 else (">", "--")
                head = f"for ({name} = {self.value(start)}; {name} {until} {self.inner(stop, SUM)}; {name}{step})"
                return self.braces(head, body)
            case ast.While(test, body):
                return self.braces(f"while ({self.value(test)})", body)
            case ast.If(test, body, orelse):
                lines = self.braces(f"if ({self.value(test)})", body)
                if orelse:
                    first, *others = (
                        self.statement(orelse[0]) if isinstance(orelse[0], ast.If) else self.braces("", orelse)
                    )
                    lines[-1:] = [f"}} else {first.strip()}", *others]
                return lines
            case ast.Return(value):
                return [f"return {self.value(value)};" if value else "return;"]
            case ast.Expr(value):
                return [f"{self.value(value)};"]
            case ast.Continue() | ast.Break():
                return [f"{ast.unparse(s)};"]
        raise TypeError(f"no C for {ast.unparse(s)}; this is a mistake in the program")

    def braces(self, head: str, body: list[ast.stmt]) -> list[str]:
        return [f"{head} {{", *(f"    {line}" for line in self.block(body)), "}"]

    def value(self, e: ast.expr) -> str:
        match e:
            case ast.Name(name):
                return name
            case ast.Constant(number):
                return repr(number)
            case ast.Subscript(array, index):
                return f"{self.value(array)}[{self.value(index)}]"
            case ast.UnaryOp(sign, operand):
                return f"{'!' if isinstance(sign, ast.Not) else '-'}{self.inner(operand, UNARY)}"
            case ast.BinOp(left, ast.Pow(), right):
                return f"pow({self.value(left)}, {self.value(right)})"
            case ast.BinOp(left, sign, right):
                return f"{self.inner(left, _level(e))} {SIGNS[type(sign)]} {self.inner(right, _level(e) + 1)}"
            case ast.Compare(left, [sign], [right]):
                return f"{self.inner(left, SUM)} {SIGNS[type(sign)]} {self.inner(right, SUM)}"
            case ast.BoolOp(sign, values):
                return f" {SIGNS[type(sign)]} ".join(self.inner(value, COMPARISON) for value in values)
            case ast.IfExp(test, yes, no):
                return " ? ".join([self.inner(test, COMPARISON), " : ".join(self.inner(e, SUM) for e in (yes, no))])
            case ast.Call(ast.Name(name) | ast.Attribute(attr=name), arguments):
                return f"{NAMES.get(name, name)}({', '.join(map(self.value, arguments))})"
        raise TypeError(f"no C for {ast.unparse(e)}; this is a mistake in the program")

    def inner(self, e: ast.expr, level: int) -> str:
        """Return an operand, in parentheses if it binds more loosely than a level."""
        return self.value(e) if _level(e) >= level else f"({self.value(e)})"

    def whole(self, e: ast.expr) -> bool:
        """Return True for an expression of ints."""
        match e:
            case ast.Name(name):
                return name in self.ints
            case ast.Constant(number):
                return isinstance(number, int)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(ast.Not()):
                return True
            case ast.UnaryOp(operand=operand):
                return self.whole(operand)
            case ast.BinOp(left, sign, right):
                return not isinstance(sign, ast.Div | ast.Pow) and self.whole(left) and self.whole(right)
            case ast.IfExp(_, yes, no):
                return self.whole(yes) and self.whole(no)
            case ast.Call(ast.Name(name)):
                return name in self.functions
        return False


def _annotation(e: ast.expr | None) -> str:
    return "None" if e is None else ast.unparse(e)


def _level(e: ast.expr) -> int:
    match e:
        case ast.IfExp() | ast.BoolOp():
            return CHOICE
        case ast.Compare():
            return COMPARISON
        case ast.BinOp(op=ast.Add() | ast.Sub()):
            return SUM
        case ast.BinOp(op=ast.Mult() | ast.Div() | ast.FloorDiv() | ast.Mod()):
            return TERM
        case ast.UnaryOp():
            return UNARY
    return UNARY + 1


def _is_array(e: ast.expr) -> bool:
    return isinstance(e, ast.Call) and ast.unparse(e.func) == "np.empty"


def _assignments(body: Iterable[ast.stmt]) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield each target with its value; the index of a loop has the value 0."""
    for s in (inner for statement in body for inner in ast.walk(statement)):
        match s:
            case ast.Assign([target], value):
                yield target, value
            case ast.AugAssign(target, sign, value):
                yield target, ast.BinOp(target, sign, value)
            case ast.For(target):
                yield target, ast.Constant(0)
