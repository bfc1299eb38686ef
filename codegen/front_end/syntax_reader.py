"""From the syntax tree of a function to LLVM: what Numba does by bytecode, SSA form, type inference and lowering.

A step is thousands of lines of plain arithmetic, for which Numba's own way takes twice as long as LLVM takes to make
machine code of them.  Here each expression is read once: it has a type, and a function that writes its code.  Numba says
what operators and functions mean for given types, so that kernels have the bits that Numba itself would give them, but
for one case: a product in a variable that several blocks give values to, which is added to something in its own block.
"""

from __future__ import annotations

import ast
import builtins
import operator
from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import types
from numba.core import cgutils, errors
from numba.core.typing.templates import fold_arguments

from .emitter import CodeWriter, ReadFunction, TypedExpr, Value, Write
from .syntax_trees import TREES, functions

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


class UnreadError(errors.NumbaError):
    """Syntax that is not read, or a type that it is not read for."""

    def __init__(self, found: str = "") -> None:
        super().__init__(found)
        self.found = found

    def __str__(self) -> str:
        return f"functions of kernels: found {self.found}; expected what codegen/front_end/syntax_reader.py reads"


def tree_of(function: Any) -> ast.FunctionDef:
    """Return the syntax tree of a function at the top of a module."""
    if TREES not in function.__globals__:
        text = Path(function.__code__.co_filename).read_text(encoding="utf-8")
        function.__globals__[TREES] = functions(ast.parse(text))
    found: ast.FunctionDef = function.__globals__[TREES][function.__code__.co_firstlineno]
    return found


def read(context: Any, function: Any, args: Sequence[types.Type], result: types.Type | None) -> ReadFunction:
    """Read a function."""
    return _TreeReader(context, function.__globals__).function(tree_of(function), args, result)


def gathered(parts: Sequence[TypedExpr], record: type | None = None) -> TypedExpr:
    """Return a tuple, or a NamedTuple of the class `record`."""
    if any(part.owned for part in parts):
        raise UnreadError
    kinds = [part.kind if record is None else types.unliteral(part.kind) for part in parts]
    kind, writes = (
        types.BaseTuple.from_types(kinds, record),
        [part.cast(k) for part, k in zip(parts, kinds, strict=True)],
    )
    return TypedExpr(kind, lambda w: w.context.make_tuple(w.builder, kind, [write(w) for write in writes]))


def part(value: TypedExpr, k: int) -> TypedExpr:
    """A part of a tuple."""
    return TypedExpr(value.kind.types[k], lambda w: w.builder.extract_value(value.write(w), k))


def lent(value: TypedExpr) -> TypedExpr:
    """The argument of a function, which has it to its end."""
    if not value.owned:
        return value

    def write(w: CodeWriter) -> Value:
        found = value.write(w)
        w.lent.append((value.kind, found))
        return found

    return TypedExpr(value.kind, write)


def called(kind: types.Type, given: Sequence[Write], call: Callable[[CodeWriter, Sequence[Value]], Value]) -> TypedExpr:
    """What a function returns, which gives back the arrays that were lent to it."""

    def write(w: CodeWriter) -> Value:
        before = len(w.lent)
        found = call(w, [argument(w) for argument in given])
        w.take_back(before)
        return found

    return TypedExpr(kind, write, isinstance(kind, types.Array))


def held(value: TypedExpr) -> tuple[Write, TypedExpr]:
    """What computes a value, and the value for those that are written behind it."""
    place: list[Value] = []
    return lambda w: place.append(value.write(w)), TypedExpr(value.kind, lambda w: place[-1], value.owned)


def in_turn(writes: Sequence[Write]) -> Write:
    """What writes statements that follow each other."""
    return lambda w: w.write(writes)


class _TreeReader(ast.NodeVisitor):
    """Reads the nodes of a syntax tree, expressions into `TypedExpr`, statements into what writes them.

    Blocks are those of Numba, and a variable is kept in a register if Numba does so: sums are fused with products that stand
    in registers (codegen/simd/lanes.py).
    """

    def __init__(self, context: Any, names: dict[str, Any]) -> None:
        self.context, self.names = context, names
        self.kinds: dict[str, types.Type] = {}
        self.blocks: defaultdict[str, set[int]] = defaultdict(set)
        self.place = 0
        self.changing: set[str] = set()
        self.arrays: dict[str, types.Type] = {}
        self.results: list[TypedExpr] = []
        self.meanings: dict[Any, tuple[types.Type, Any]] = {}

    def function(self, tree: ast.FunctionDef, args: Sequence[types.Type], result: types.Type | None) -> ReadFunction:
        for argument, kind in zip(tree.args.args, args, strict=True):
            self.declare(argument.arg, kind)
        statements = self.body(tree.body)
        if not isinstance(tree.body[-1], ast.Return):
            statements.append(self.visit_Return(ast.Return()))
        kind = result or self.common(self.results)
        local = frozenset(name for name, blocks in self.blocks.items() if len(blocks) == 1 and name not in self.arrays)
        if not self.changing <= local:
            raise UnreadError(f"{', '.join(sorted(self.changing - local))} of several types")
        calls = tuple(signature for _, signature in self.meanings.values())
        return ReadFunction(tuple(statements), kind, local, self.arrays, calls)

    def visit(self, node: ast.AST) -> Any:
        """Read a node."""
        try:
            return super().visit(node)
        except UnreadError as error:
            error.found = error.found or f"{ast.unparse(node)!r} in line {getattr(node, 'lineno', 0)}"
            raise

    def generic_visit(self, node: ast.AST) -> Any:
        """Refuse what has no method here."""
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

    def call(self, function: Any, *values: TypedExpr) -> TypedExpr:
        """The value of a function or of an operator."""
        kind, signature = self.meaning(function, tuple(value.kind for value in values))
        if signature is None or signature.recvr:
            raise UnreadError
        wanted, operands = signature.args, [lent(value) for value in values]
        if signature.pysig is None:
            given = [value.cast(kind) for value, kind in zip(operands, wanted, strict=True)]
        else:
            given = fold_arguments(
                signature.pysig,
                operands,
                {},
                lambda index, _, value: value.cast(wanted[index]),
                lambda index, _, value: lambda w: w.context.get_constant_generic(w.builder, wanted[index], value),
                lambda index, _, values: gathered(values).cast(wanted[index]),
            )

        def write(w: CodeWriter, arguments: Sequence[Value]) -> Value:
            found = w.context.get_function(kind, signature)(w.builder, arguments)
            return w.context.get_dummy_value() if found is None else found

        return called(signature.return_type, given, write)

    def meaning(self, function: Any, kinds: tuple[types.Type, ...]) -> tuple[types.Type, Any]:
        """The type of a function or of an operator, and what it takes and returns for operands of some types.

        It is found out once: a step adds and multiplies thousands of times.  A function is compiled for integers, not for
        3, 4 and 5 apart.
        """
        if (function, kinds) not in self.meanings:
            kind = self.context.resolve_value_type(function)
            given = tuple(map(types.unliteral, kinds)) if isinstance(kind, types.Dispatcher) else kinds
            self.meanings[function, kinds] = kind, self.context.resolve_function_type(kind, given, {})
        return self.meanings[function, kinds]

    def known(self, value: Any) -> TypedExpr:
        """A value that is known when the function is read."""
        kind = types.maybe_literal(value) or self.context.resolve_value_type(value)
        return TypedExpr(kind, lambda w: w.context.get_constant_generic(w.builder, kind, value))

    def is_known(self, node: ast.expr) -> bool:
        """True for a name of the module, or an attribute of one: it has a value when the function is read."""
        while isinstance(node, ast.Attribute):
            node = node.value
        return isinstance(node, ast.Name) and node.id not in self.kinds

    def found(self, node: ast.expr) -> Any:
        """What a name of the module stands for, or an attribute of another module."""
        if isinstance(node, ast.Attribute) and isinstance(module := self.found(node.value), ModuleType):
            return getattr(module, node.attr)
        if not isinstance(node, ast.Name) or node.id in self.kinds:
            raise UnreadError
        if node.id in self.names:
            return self.names[node.id]
        if not hasattr(builtins, node.id):
            raise UnreadError
        return getattr(builtins, node.id)

    def common(self, values: Sequence[TypedExpr]) -> types.Type:
        """The type that values of several can have."""
        kind = self.context.unify_types(*(types.unliteral(value.kind) for value in values))
        if kind is None or not kind.is_precise():
            raise UnreadError
        return kind

    def chosen(self, test: TypedExpr, yes: TypedExpr, no: TypedExpr) -> TypedExpr:
        """One value if a condition holds, else another one."""
        if yes.owned or no.owned:
            raise UnreadError
        kind = self.common([yes, no])
        first, second = yes.cast(kind), no.cast(kind)

        def write(w: CodeWriter) -> Value:
            slot = cgutils.alloca_once(w.builder, w.context.get_value_type(kind))
            w.choose(test.write, lambda w: w.builder.store(first(w), slot), lambda w: w.builder.store(second(w), slot))
            return w.builder.load(slot)

        return TypedExpr(kind, write)

    def test(self, node: ast.expr) -> TypedExpr:
        """A condition."""
        found: TypedExpr = self.visit(node)
        return found if found.kind == types.boolean else self.call(bool, found)

    def visit_Name(self, node: ast.Name) -> TypedExpr:
        name = node.id
        if name not in self.kinds:
            return self.known(self.found(node))
        self.blocks[name].add(self.place)
        return TypedExpr(self.kinds[name], lambda w: w.get(name))

    def visit_Constant(self, node: ast.Constant) -> TypedExpr:
        return self.known(node.value)

    def visit_Attribute(self, node: ast.Attribute) -> TypedExpr:
        name = node.attr
        if self.is_known(node):
            return self.known(self.found(node))
        base: TypedExpr = self.visit(node.value)
        if isinstance(base.kind, types.BaseNamedTuple):
            return part(base, base.kind.fields.index(name))
        kind = self.context.resolve_getattr(typ=base.kind, attr=name)
        if kind is None or isinstance(kind, types.Callable | types.Array) or base.owned:
            raise UnreadError

        def write(w: CodeWriter) -> Value:
            return w.context.get_getattr(base.kind, name)(w.context, w.builder, base.kind, base.write(w), name)

        return TypedExpr(kind, write)

    def visit_Subscript(self, node: ast.Subscript) -> TypedExpr:
        base: TypedExpr = self.visit(node.value)
        if isinstance(base.kind, types.BaseTuple) and isinstance(node.slice, ast.Slice):
            first, last = (
                None if bound is None else int(ast.literal_eval(bound))
                for bound in (node.slice.lower, node.slice.upper)
            )
            return gathered([part(base, k) for k in range(len(base.kind))[first:last]])
        if isinstance(base.kind, types.BaseTuple) and isinstance(node.slice, ast.Constant):
            return part(base, ast.literal_eval(node.slice))
        return self.call(operator.getitem, base, self.visit(node.slice))

    def visit_Slice(self, node: ast.Slice) -> TypedExpr:
        bounds = [self.known(None) if bound is None else self.visit(bound) for bound in (node.lower, node.upper)]
        return self.call(slice, *bounds, *([] if node.step is None else [self.visit(node.step)]))

    def visit_Tuple(self, node: ast.Tuple) -> TypedExpr:
        return gathered([self.visit(part) for part in node.elts])

    def visit_BinOp(self, node: ast.BinOp) -> TypedExpr:
        return self.call(OPERATORS[type(node.op)], self.visit(node.left), self.visit(node.right))

    def visit_UnaryOp(self, node: ast.UnaryOp) -> TypedExpr:
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return self.known(ast.literal_eval(node))
        return self.call(OPERATORS[type(node.op)], self.visit(node.operand))

    def visit_Compare(self, node: ast.Compare) -> TypedExpr:
        if len(node.ops) > 1:
            pairs = zip(pairwise([node.left, *node.comparators]), node.ops, strict=True)
            return self.visit_BoolOp(ast.BoolOp(ast.And(), [ast.Compare(x, [op], [y]) for (x, y), op in pairs]))
        if type(node.ops[0]) not in OPERATORS:
            raise UnreadError
        return self.call(OPERATORS[type(node.ops[0])], self.visit(node.left), self.visit(node.comparators[0]))

    def visit_BoolOp(self, node: ast.BoolOp) -> TypedExpr:
        tests = []
        for value in node.values:
            tests.append(self.test(value))
            self.turn()
        found = tests.pop()
        for test in reversed(tests):
            yes, no = (found, self.known(False)) if isinstance(node.op, ast.And) else (self.known(True), found)
            found = self.chosen(test, yes, no)
        return found

    def visit_IfExp(self, node: ast.IfExp) -> TypedExpr:
        parts = []
        for read, piece in ((self.test, node.test), (self.visit, node.body), (self.visit, node.orelse)):
            parts.append(read(piece))
            self.turn()
        return self.chosen(*parts)

    def visit_Call(self, node: ast.Call) -> TypedExpr:
        if node.keywords:
            raise UnreadError
        if self.is_known(node.func):
            function, values = self.found(node.func), [self.visit(value) for value in node.args]
            if isinstance(function, type) and issubclass(function, tuple) and function is not tuple:
                return gathered(values, function)
            return self.call(function, *values)
        return self.pointed(self.visit(node.func), [self.visit(value) for value in node.args])

    def pointed(self, function: TypedExpr, values: Sequence[TypedExpr]) -> TypedExpr:
        """The value of a function that is given by the address of its machine code."""
        if not isinstance(function.kind, types.FunctionType) or len(values) != len(function.kind.signature.args):
            raise UnreadError
        result, kinds = function.kind.signature.return_type, function.kind.signature.args
        given = [lent(value).cast(kind) for value, kind in zip(values, kinds, strict=True)]

        def write(w: CodeWriter, arguments: Sequence[Value]) -> Value:
            calls, builder = w.context.call_conv, w.builder
            address = cgutils.create_struct_proxy(function.kind)(w.context, builder, value=function.write(w)).jit_addr
            pointer = builder.bitcast(address, calls.get_function_type(result, kinds).as_pointer())
            status, found = calls.call_function(builder, pointer, result, kinds, arguments)
            with cgutils.if_unlikely(builder, status.is_error):
                calls.return_status_propagate(builder, status)
            return found

        return called(result, given, write)

    # -- statements -------------------------------------------------------------------------------------------

    def body(self, statements: Sequence[ast.stmt]) -> list[Write]:
        """What writes statements, up to one that leaves them; what stands behind it may have no type."""
        found = []
        for statement in statements:
            found.append(self.visit(statement))
            if self.leaves(statement):
                break
        return found

    def leaves(self, statement: ast.stmt) -> bool:
        """True for a statement behind which nothing is done."""
        if isinstance(statement, ast.If) and (chosen := self.chosen_body(statement)):
            return self.leaves(chosen[-1])
        return isinstance(statement, ast.Return | ast.Break | ast.Continue)

    def chosen_body(self, node: ast.If) -> list[ast.stmt] | None:
        """The statements of a choice by a constant; None if it is another choice."""
        if not self.is_known(node.test):
            return None
        return node.body if self.found(node.test) else node.orelse

    def block(self, statements: Sequence[ast.stmt]) -> Write:
        """What writes statements in a block of their own; another one begins behind them."""
        self.turn()
        found = self.body(statements)
        self.turn()
        return in_turn(found)

    def visit_Assign(self, node: ast.Assign) -> Write:
        target, many = node.targets[0], len(node.targets) > 1
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple) and not many:
            pairs = [(one, *held(self.visit(value))) for one, value in zip(target.elts, node.value.elts, strict=True)]
            return in_turn(
                [computed for _, computed, _ in pairs] + [self.assigned(one, value) for one, _, value in pairs]
            )
        value: TypedExpr = self.visit(node.value)
        if not many:
            return self.assigned(target, value)
        if value.owned:
            raise UnreadError
        computed, whole = held(value)
        return in_turn([computed, *(self.assigned(target, whole) for target in node.targets)])

    def assigned(self, target: ast.expr, value: TypedExpr) -> Write:
        """What gives a variable, an element, or several of them a value."""
        if isinstance(target, ast.Subscript):
            return self.call(operator.setitem, self.visit(target.value), self.visit(target.slice), value).write
        if isinstance(target, ast.Tuple):
            if not isinstance(value.kind, types.BaseTuple) or len(value.kind) != len(target.elts):
                raise UnreadError
            computed, whole = held(value)
            return in_turn([computed, *(self.assigned(one, part(whole, k)) for k, one in enumerate(target.elts))])
        if not isinstance(target, ast.Name):
            raise UnreadError
        if target.id == "_" and not value.owned:
            return value.write
        name, kind = target.id, self.declare(target.id, value.kind)
        found = value.cast(kind)
        if isinstance(kind, types.Array):
            self.arrays[name] = kind
            found = value.write if value.owned else lambda w: w.keep(kind, value.write(w))
        return lambda w: w.set(name, found(w))

    def visit_AugAssign(self, node: ast.AugAssign) -> Write:
        if isinstance(node.target, ast.Name) and self.visit(node.target).kind.mutable:
            raise UnreadError
        return self.visit_Assign(ast.Assign([node.target], ast.BinOp(node.target, node.op, node.value)))

    def visit_Expr(self, node: ast.Expr) -> Write:
        if isinstance(node.value, ast.Constant):  # a docstring
            return lambda w: None
        found: TypedExpr = self.visit(node.value)
        if found.owned:
            raise UnreadError
        return found.write

    def visit_Return(self, node: ast.Return) -> Write:
        value = self.known(None) if node.value is None else self.visit(node.value)
        self.results.append(value)

        def write(w: CodeWriter) -> None:
            kind = w.program.result
            found = value.cast(kind)(w)
            if not value.owned:
                w.keep(kind, found)
            for name in w.program.arrays:
                w.release(name)
            w.lower.call_conv.return_value(w.builder, w.context.get_return_value(w.builder, kind, found))

        return write

    def visit_Break(self, node: ast.Break) -> Write:
        return lambda w: w.builder.branch(w.ends[-1][1])

    def visit_Continue(self, node: ast.Continue) -> Write:
        return lambda w: w.builder.branch(w.ends[-1][0])

    def visit_If(self, node: ast.If) -> Write:
        if (chosen := self.chosen_body(node)) is not None:  # the others may have no type
            return self.block(chosen)
        test, yes, no = self.test(node.test), self.block(node.body), self.block(node.orelse)
        return lambda w: w.choose(test.write, yes, no)

    def visit_While(self, node: ast.While) -> Write:
        if node.orelse:
            raise UnreadError
        self.turn()
        endless = isinstance(node.test, ast.Constant) and node.test.value is True
        test = None if endless else self.test(node.test).write
        body = self.block(node.body)
        return lambda w: w.loop(test, body)

    def visit_For(self, node: ast.For) -> Write:
        if node.orelse:
            raise UnreadError
        if (pieces := self.pieces(node.iter)) is not None:
            return self.unrolled(node, pieces)
        if not (isinstance(node.iter, ast.Call) and self.found(node.iter.func) is range):
            raise UnreadError
        start, stop, step = self.bounds([self.visit(bound) for bound in node.iter.args])
        self.turn()
        numbers: list[Value] = []
        now = TypedExpr(types.int64, lambda w: numbers[-1])
        body = in_turn([self.assigned(node.target, now), *self.body(node.body)])
        self.turn()

        def write(w: CodeWriter) -> None:
            first, last = start(w), stop(w)
            following = w.memory(first)

            def count(w: CodeWriter) -> None:
                """Count before the body, as Numba does: LLVM takes the first turn out of short loops then."""
                numbers.append(w.builder.load(following))
                w.builder.store(w.builder.add(numbers[-1], first.type(step)), following)
                body(w)

            more = "<" if step > 0 else ">"
            w.loop(lambda w: w.builder.icmp_signed(more, w.builder.load(following), last), count)

        return write

    def bounds(self, given: Sequence[TypedExpr]) -> tuple[Write, Write, int]:
        """What writes the first number of a range and the one behind it, and the step."""
        if not all(isinstance(bound.kind, types.Integer) for bound in given):
            raise UnreadError
        start, stop = (self.known(0), *given) if len(given) == 1 else given[:2]
        step = given[2].kind if len(given) == 3 else types.literal(1)
        if not isinstance(step, types.IntegerLiteral) or step.literal_value == 0:
            raise UnreadError
        return start.cast(types.int64), stop.cast(types.int64), step.literal_value

    def pieces(self, node: ast.expr) -> list[TypedExpr] | None:
        """The values of a tuple that is written out or known, numbered by `enumerate` if that is asked for; else None."""
        if isinstance(node, ast.Tuple):
            return [self.visit(piece) for piece in node.elts]
        if self.is_known(node) and isinstance(values := self.found(node), tuple):
            return [self.known(value) for value in values]
        if isinstance(node, ast.Call) and self.found(node.func) is enumerate and len(node.args) == 1:
            pieces = self.pieces(node.args[0])
            return None if pieces is None else [gathered([self.known(k), piece]) for k, piece in enumerate(pieces)]
        return None

    def unrolled(self, node: ast.For, pieces: Sequence[TypedExpr]) -> Write:
        """A loop whose statements stand there for each of some values."""
        bodies = []
        for piece in pieces:
            self.turn()
            bodies.append(in_turn([self.assigned(node.target, piece), *self.body(node.body)]))
        self.turn()
        return lambda w: w.each(bodies)
