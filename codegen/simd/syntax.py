"""From the syntax tree of a function to LLVM, in place of Numba's bytecode, SSA form, type inference and lowering.

A step is thousands of lines of plain arithmetic, for which Numba's own way takes twice as long as LLVM takes to make
machine code of them.  Here each expression is read once: it has a type, and a function that writes its code.  Numba says
what operators and functions mean for given types, so that both ways have the same code.  Memory that is allocated, and
what else a step has none of, is left to Numba.
"""

from __future__ import annotations

import ast
import builtins
import operator
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, TypeAlias

from llvmlite import ir
from numba import types
from numba.core import cgutils, errors, lowering
from numba.core.typing.templates import fold_arguments

__all__ = ["Program", "UnreadError", "read"]

OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Invert: operator.invert,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}

Value: TypeAlias = ir.Value
Write: TypeAlias = "Callable[[Writer], Any]"


class UnreadError(errors.NumbaError):
    """Syntax or types that are left to Numba; its compiler goes on with the next way if it sees such an error."""

    def __init__(self) -> None:
        super().__init__("left to Numba")


@dataclass(frozen=True, slots=True)
class Typed:
    """An expression: its type, and what writes its code and returns its value."""

    kind: types.Type
    write: Write

    def cast(self, kind: types.Type) -> Write:
        """What writes the value as one of another type."""
        if kind == self.kind:
            return self.write
        return lambda w: w.context.cast(w.builder, self.write(w), self.kind, kind)


@dataclass(frozen=True, slots=True)
class Program:
    """A function that was read: what writes its statements, the type of its result, and the variables of one block alone."""

    statements: tuple[Write, ...]
    result: types.Type
    local: frozenset[str]

    def write(self, lower: lowering.Lower, arguments: Sequence[Value]) -> None:
        """Write the code of the function, whose arguments have these values."""
        writer = Writer(lower, self)
        for name, value in zip(lower.fndesc.args, arguments, strict=True):
            writer.set(name, value)
        writer.write(self.statements)
        if not writer.ended:
            writer.builder.unreachable()


@dataclass(slots=True)
class Writer:
    """Where code is written: the function, the values of its variables, and where `continue` and `break` lead."""

    lower: lowering.Lower
    program: Program
    values: dict[str, Value] = field(default_factory=dict)
    slots: dict[str, Value] = field(default_factory=dict)
    ends: list[tuple[ir.Block, ir.Block]] = field(default_factory=list)

    @property
    def builder(self) -> ir.IRBuilder:
        return self.lower.builder

    @property
    def context(self) -> Any:
        """What Numba knows of the processor."""
        return self.lower.context

    @property
    def ended(self) -> bool:
        """True behind a statement that leaves the block."""
        return bool(self.builder.block.is_terminated)

    def write(self, statements: Sequence[Write]) -> None:
        """Write statements up to one that leaves the block."""
        for statement in statements:
            if self.ended:
                return
            statement(self)

    def get(self, name: str) -> Value:
        """The value of a variable."""
        return self.values[name] if name in self.values else self.builder.load(self.slots[name])

    def set(self, name: str, value: Value) -> None:
        """Give a variable a value: in a register if it lives in one block, else in memory, which LLVM removes."""
        if name in self.program.local:
            self.values[name] = value
        elif name in self.slots:
            self.builder.store(value, self.slots[name])
        else:
            self.slots[name] = self.memory(value)

    def memory(self, value: Value) -> Value:
        """Memory that holds a value to begin with."""
        slot = cgutils.alloca_once(self.builder, value.type)
        self.builder.store(value, slot)
        return slot

    def blocks(self, count: int) -> list[ir.Block]:
        """New blocks of code."""
        return [self.builder.append_basic_block() for _ in range(count)]

    def inside(self, block: ir.Block, write: Write, after: ir.Block) -> None:
        """Write a block, from which the program goes on at another one."""
        self.builder.position_at_end(block)
        write(self)
        if not self.ended:
            self.builder.branch(after)

    def choose(self, test: Write, yes: Write, no: Write) -> None:
        """Write what is done if a condition holds, and if not."""
        holds, fails, after = self.blocks(3)
        self.builder.cbranch(test(self), holds, fails)
        self.inside(holds, yes, after)
        self.inside(fails, no, after)
        self.builder.position_at_end(after)

    def loop(self, test: Write | None, body: Write, step: Write) -> None:
        """Write what is done while a condition holds, and a step each time before that is looked at anew."""
        again, inside, on, after = self.blocks(4)
        self.builder.branch(again)
        self.builder.position_at_end(again)
        if test is None:
            self.builder.branch(inside)
        else:
            self.builder.cbranch(test(self), inside, after)
        self.ends.append((on, after))
        self.inside(inside, body, on)
        self.ends.pop()
        self.inside(on, step, again)
        self.builder.position_at_end(after)


def read(
    context: Any, tree: ast.FunctionDef, names: dict[str, Any], args: Sequence[types.Type], result: types.Type | None
) -> Program:
    """Read a function.

    Parameters
    ----------
    context : numba.core.typing.Context
        What Numba knows of types.
    tree : ast.FunctionDef
        The function.
    names : dict
        What the names of its module stand for.
    args : sequence of numba.types.Type
        The types of its arguments.
    result : numba.types.Type, optional
        The type of what it returns; by default that of the values themselves.

    Raises
    ------
    UnreadError
        If it has something that is left to Numba.
    """
    return _Reader(context, names).function(tree, args, result)


class _Reader(ast.NodeVisitor):
    """Reads the nodes of a syntax tree, expressions into `Typed`, statements into what writes them.

    Blocks are those of Numba, and a variable is kept in a register if Numba does so: sums are fused with products that stand
    in registers (codegen/simd/lanes.py).
    """

    def __init__(self, context: Any, names: dict[str, Any]) -> None:
        self.context, self.names = context, names
        self.kinds: dict[str, types.Type] = {}
        self.blocks: defaultdict[str, set[int]] = defaultdict(set)
        self.place = 0
        self.changing: set[str] = set()
        self.results: list[Typed] = []

    def function(self, tree: ast.FunctionDef, args: Sequence[types.Type], result: types.Type | None) -> Program:
        for argument, kind in zip(tree.args.args, args, strict=True):
            self.declare(argument.arg, kind)
        statements = self.body(tree.body)
        if not isinstance(tree.body[-1], ast.Return):
            statements.append(self.visit_Return(ast.Return()))
        kind = result or self.common(self.results)
        local = frozenset(name for name, blocks in self.blocks.items() if len(blocks) == 1)
        if any(isinstance(part, types.Array) for part in getattr(kind, "types", (kind,))) or not self.changing <= local:
            raise UnreadError
        return Program(tuple(statements), kind, local)

    def generic_visit(self, node: ast.AST) -> Any:
        """Leave to Numba what has no method here."""
        raise UnreadError

    def turn(self) -> None:
        """Begin another block."""
        self.place += 1

    def declare(self, name: str, kind: types.Type) -> types.Type:
        """Return the type of a variable that gets a value; a variable of one block may have another type each time."""
        kind = types.unliteral(kind)
        if self.kinds.setdefault(name, kind) != kind:
            self.changing.add(name)
            self.kinds[name] = kind
        self.blocks[name].add(self.place)
        return kind

    # -- expressions ------------------------------------------------------------------------------------------

    def call(self, function: Any, *values: Typed) -> Typed:
        """The value of a function or of an operator."""
        try:
            kind = self.context.resolve_value_type(function)
            signature = self.context.resolve_function_type(kind, tuple(value.kind for value in values), {})
        except errors.TypingError as error:
            raise UnreadError from error
        if signature is None or signature.recvr or isinstance(signature.return_type, types.Array):
            raise UnreadError
        wanted = signature.args
        if signature.pysig is None:
            given = [value.cast(kind) for value, kind in zip(values, wanted, strict=True)]
        else:
            given = fold_arguments(
                signature.pysig, values, {}, self.argument(wanted), self.default, self.others(wanted)
            )

        def write(w: Writer) -> Value:
            found = w.context.get_function(kind, signature)(w.builder, [argument(w) for argument in given])
            return w.context.get_dummy_value() if found is None else found

        return Typed(signature.return_type, write)

    @staticmethod
    def argument(wanted: Sequence[types.Type]) -> Callable[[int, Any, Typed], Write]:
        return lambda index, _, value: value.cast(wanted[index])

    @staticmethod
    def default(*_: Any) -> Write:
        """Leave an argument that is not given to Numba."""
        raise UnreadError

    def others(self, wanted: Sequence[types.Type]) -> Callable[[int, Any, Sequence[Typed]], Write]:
        """What makes a tuple of all further arguments."""
        return lambda index, _, values: self.gathered(values).cast(wanted[index])

    @staticmethod
    def gathered(parts: Sequence[Typed]) -> Typed:
        """A tuple."""
        kind = types.BaseTuple.from_types([part.kind for part in parts])
        return Typed(kind, lambda w: w.context.make_tuple(w.builder, kind, [part.write(w) for part in parts]))

    @staticmethod
    def part(value: Typed, k: int) -> Typed:
        """A part of a tuple."""
        return Typed(value.kind.types[k], lambda w: w.builder.extract_value(value.write(w), k))

    def known(self, value: Any) -> Typed:
        """A value that is known when the function is read."""
        try:
            kind = types.maybe_literal(value) or self.context.resolve_value_type(value)
        except (errors.TypingError, ValueError) as error:
            raise UnreadError from error
        return Typed(kind, lambda w: w.context.get_constant_generic(w.builder, kind, value))

    def found(self, node: ast.expr) -> Any:
        """What a name of the module stands for, or an attribute of another module."""
        if isinstance(node, ast.Attribute) and isinstance(module := self.found(node.value), ModuleType):
            return getattr(module, node.attr)
        if not isinstance(node, ast.Name) or node.id in self.kinds:
            raise UnreadError
        return self.names[node.id] if node.id in self.names else getattr(builtins, node.id)

    def common(self, values: Sequence[Typed]) -> types.Type:
        """The type that values of several can have."""
        kind = self.context.unify_types(*(types.unliteral(value.kind) for value in values))
        if kind is None or not kind.is_precise():
            raise UnreadError
        return kind

    def chosen(self, test: Typed, yes: Typed, no: Typed) -> Typed:
        """One value if a condition holds, else another one."""
        kind = self.common([yes, no])
        first, second = yes.cast(kind), no.cast(kind)

        def write(w: Writer) -> Value:
            slot = cgutils.alloca_once(w.builder, w.context.get_value_type(kind))
            w.choose(test.write, lambda w: w.builder.store(first(w), slot), lambda w: w.builder.store(second(w), slot))
            return w.builder.load(slot)

        return Typed(kind, write)

    def test(self, node: ast.expr) -> Typed:
        """A condition."""
        found: Typed = self.visit(node)
        return found if found.kind == types.boolean else self.call(bool, found)

    def visit_Name(self, node: ast.Name) -> Typed:
        name = node.id
        if name not in self.kinds:
            return self.known(self.found(node))
        self.blocks[name].add(self.place)
        return Typed(self.kinds[name], lambda w: w.get(name))

    def visit_Constant(self, node: ast.Constant) -> Typed:
        return self.known(node.value)

    def visit_Attribute(self, node: ast.Attribute) -> Typed:
        name = node.attr
        if isinstance(node.value, ast.Name) and node.value.id not in self.kinds:
            return self.known(self.found(node))
        base: Typed = self.visit(node.value)
        kind = self.context.resolve_getattr(typ=base.kind, attr=name)
        if kind is None or isinstance(kind, types.Callable):
            raise UnreadError

        def write(w: Writer) -> Value:
            return w.context.get_getattr(base.kind, name)(w.context, w.builder, base.kind, base.write(w), name)

        return Typed(kind, write)

    def visit_Subscript(self, node: ast.Subscript) -> Typed:
        base: Typed = self.visit(node.value)
        if not isinstance(base.kind, types.BaseTuple):
            return self.call(operator.getitem, base, self.visit(node.slice))
        if not (isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int)):
            raise UnreadError
        return self.part(base, node.slice.value)

    def visit_Tuple(self, node: ast.Tuple) -> Typed:
        return self.gathered([self.visit(part) for part in node.elts])

    def visit_BinOp(self, node: ast.BinOp) -> Typed:
        return self.call(OPERATORS[type(node.op)], self.visit(node.left), self.visit(node.right))

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Typed:
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return self.known(ast.literal_eval(node))
        return self.call(OPERATORS[type(node.op)], self.visit(node.operand))

    def visit_Compare(self, node: ast.Compare) -> Typed:
        if len(node.ops) > 1 or type(node.ops[0]) not in OPERATORS:
            raise UnreadError
        return self.call(OPERATORS[type(node.ops[0])], self.visit(node.left), self.visit(node.comparators[0]))

    def visit_BoolOp(self, node: ast.BoolOp) -> Typed:
        tests = []
        for value in node.values:
            tests.append(self.test(value))
            self.turn()
        found = tests.pop()
        for test in reversed(tests):
            yes, no = (found, self.known(False)) if isinstance(node.op, ast.And) else (self.known(True), found)
            found = self.chosen(test, yes, no)
        return found

    def visit_IfExp(self, node: ast.IfExp) -> Typed:
        parts = []
        for read, part in ((self.test, node.test), (self.visit, node.body), (self.visit, node.orelse)):
            parts.append(read(part))
            self.turn()
        return self.chosen(*parts)

    def visit_Call(self, node: ast.Call) -> Typed:
        if node.keywords:
            raise UnreadError
        return self.call(self.found(node.func), *map(self.visit, node.args))

    # -- statements -------------------------------------------------------------------------------------------

    def body(self, statements: Sequence[ast.stmt]) -> list[Write]:
        return [self.visit(statement) for statement in statements]

    def block(self, statements: Sequence[ast.stmt]) -> list[Write]:
        """Statements in a block of their own; another one begins behind them."""
        self.turn()
        found = self.body(statements)
        self.turn()
        return found

    def given(self, target: ast.expr, value: Typed) -> tuple[str, Write]:
        """A variable that gets a value, and what writes the value."""
        if not isinstance(target, ast.Name):
            raise UnreadError
        return target.id, value.cast(self.declare(target.id, value.kind))

    def visit_Assign(self, node: ast.Assign) -> Write:
        target = node.targets[0]
        if len(node.targets) > 1:
            raise UnreadError
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            values = [self.visit(value) for value in node.value.elts]
            return self.several([self.given(*pair) for pair in zip(target.elts, values, strict=True)])
        value: Typed = self.visit(node.value)
        if isinstance(target, ast.Tuple):
            return self.unpacked(target.elts, value)
        if isinstance(target, ast.Subscript):
            return self.call(operator.setitem, self.visit(target.value), self.visit(target.slice), value).write
        name, found = self.given(target, value)
        return lambda w: w.set(name, found(w))

    @staticmethod
    def several(pairs: Sequence[tuple[str, Write]]) -> Write:
        """What gives variables values that are all computed before."""

        def write(w: Writer) -> None:
            for name, value in [(name, found(w)) for name, found in pairs]:
                w.set(name, value)

        return write

    def unpacked(self, targets: Sequence[ast.expr], value: Typed) -> Write:
        """What gives variables the parts of a tuple."""
        if not isinstance(value.kind, types.BaseTuple):
            raise UnreadError
        held: list[Value] = []
        whole = Typed(value.kind, lambda w: held[-1])
        give = self.several([self.given(target, self.part(whole, k)) for k, target in enumerate(targets)])

        def write(w: Writer) -> None:
            held.append(value.write(w))
            give(w)

        return write

    def visit_AugAssign(self, node: ast.AugAssign) -> Write:
        value = ast.BinOp(node.target, node.op, node.value)
        if not isinstance(node.target, ast.Name) or self.visit(node.target).kind.mutable:
            raise UnreadError
        return self.visit_Assign(ast.Assign([node.target], value))

    def visit_Expr(self, node: ast.Expr) -> Write:
        if isinstance(node.value, ast.Constant):  # a docstring
            return lambda w: None
        found: Typed = self.visit(node.value)
        return found.write

    def visit_Return(self, node: ast.Return) -> Write:
        value = self.known(None) if node.value is None else self.visit(node.value)
        self.results.append(value)

        def write(w: Writer) -> None:
            kind = w.program.result
            found = w.context.get_return_value(w.builder, kind, value.cast(kind)(w))
            w.lower.call_conv.return_value(w.builder, found)

        return write

    def visit_Break(self, node: ast.Break) -> Write:
        return lambda w: w.builder.branch(w.ends[-1][1])

    def visit_Continue(self, node: ast.Continue) -> Write:
        return lambda w: w.builder.branch(w.ends[-1][0])

    def visit_If(self, node: ast.If) -> Write:
        if isinstance(node.test, ast.Name) and node.test.id not in self.kinds:
            statements = self.block(node.body if self.found(node.test) else node.orelse)  # the others may have no type
            return lambda w: w.write(statements)
        test, yes, no = self.test(node.test), self.block(node.body), self.block(node.orelse)
        return lambda w: w.choose(test.write, lambda w: w.write(yes), lambda w: w.write(no))

    def visit_While(self, node: ast.While) -> Write:
        if node.orelse:
            raise UnreadError
        self.turn()
        endless = isinstance(node.test, ast.Constant) and node.test.value is True
        test = None if endless else self.test(node.test).write
        statements = self.block(node.body)
        return lambda w: w.loop(test, lambda w: w.write(statements), lambda w: None)

    def visit_For(self, node: ast.For) -> Write:
        counted = node.iter
        if node.orelse or not (isinstance(counted, ast.Call) and self.found(counted.func) is range):
            raise UnreadError
        start, stop, step = self.bounds([self.visit(bound) for bound in counted.args])
        self.turn()
        held: list[Value] = []
        name, value = self.given(node.target, Typed(types.int64, lambda w: w.builder.load(held[-1])))
        statements = [lambda w: w.set(name, value(w)), *self.body(node.body)]
        self.turn()

        def write(w: Writer) -> None:
            first, last = start(w), stop(w)
            slot = w.memory(first)
            held.append(slot)
            w.loop(
                lambda w: w.builder.icmp_signed("<" if step > 0 else ">", w.builder.load(slot), last),
                lambda w: w.write(statements),
                lambda w: w.builder.store(w.builder.add(w.builder.load(slot), first.type(step)), slot),
            )

        return write

    def bounds(self, given: Sequence[Typed]) -> tuple[Write, Write, int]:
        """What writes the first number of a range and the one behind it, and the step."""
        if not all(isinstance(bound.kind, types.Integer) for bound in given):
            raise UnreadError
        start, stop = (self.known(0), *given) if len(given) == 1 else given[:2]
        step = given[2].kind if len(given) == 3 else types.literal(1)
        if not isinstance(step, types.IntegerLiteral) or step.literal_value == 0:
            raise UnreadError
        return start.cast(types.int64), stop.cast(types.int64), step.literal_value
