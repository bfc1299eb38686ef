"""Type the syntax tree of a function: expressions become `TypedExpr`, statements become `Emit` (see `emitter`).

Types are resolved in the order of the text, without inference backwards: a variable of several basic blocks has one
type. Numba's typing context returns the types of operators, attributes and calls.  The basic blocks are numbered as
in Numba, because a sum is fused with a product that stands in a register (codegen/simd/lanes.py): the same variables
must be registers. Exception: a product assigned to a variable of several basic blocks, and added to something in its
own block.  Numba renames such a variable in each block (SSA form) and fuses the sum; here the product is loaded from
a stack slot and not fused.

The subset of Python: assignments to names, elements and tuples; `if`, `while`, `for` over `range`, tuples and
`enumerate` of tuples; arithmetic, comparisons, `and`, `or`, conditional expressions; NamedTuples; calls without
keywords.  Anything else raises `UnreadError`.
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

from .emitter import Emit, Emitter, TypedExpr, TypedFunction, Value
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
    """Raised for syntax outside the subset, and for operand types that the subset does not support."""

    def __init__(self, syntax: str = "") -> None:
        super().__init__(syntax)
        self.syntax = syntax  # empty at first: `visit` fills in the innermost node

    def __str__(self) -> str:
        return f"functions of kernels: found {self.syntax}; expected what codegen/front_end/syntax_reader.py reads"


def read(context: Any, function: Any, args: Sequence[types.Type], result: types.Type | None) -> TypedFunction:
    """Type a top-level function of a module for given types of its arguments and, unless None, of its result."""
    module = function.__globals__
    if TREES not in module:  # a module that Python imported: drivers, recorders, elementary functions
        module[TREES] = functions(ast.parse(Path(function.__code__.co_filename).read_text(encoding="utf-8")))
    return _TreeReader(context, module).function(module[TREES][function.__code__.co_firstlineno], args, result)


# -- compositions of expressions and of statements -------------------------------------------------------------


def sequence(statements: Sequence[Emit]) -> Emit:
    return lambda e: e.emit_all(statements)


def tuple_of(items: Sequence[TypedExpr], record: type | None = None) -> TypedExpr:
    """Make a tuple, or a NamedTuple of the class `record`, whose fields have no literal types."""
    if any(item.returns_new_reference for item in items):
        raise UnreadError
    item_types = [item.type if record is None else types.unliteral(item.type) for item in items]
    tuple_type = types.BaseTuple.from_types(item_types, record)
    emits = [item.cast(item_type) for item, item_type in zip(items, item_types, strict=True)]
    return TypedExpr(tuple_type, lambda e: e.context.make_tuple(e.builder, tuple_type, [emit(e) for emit in emits]))


def tuple_item(value: TypedExpr, k: int) -> TypedExpr:
    return TypedExpr(value.type.types[k], lambda e: e.builder.extract_value(value.emit(e), k))


def evaluated_once(value: TypedExpr) -> tuple[Emit, TypedExpr]:
    """Split an expression into a statement that evaluates it, and a reference to the result for later statements."""
    results: list[Value] = []
    reference = TypedExpr(value.type, lambda e: results[-1], value.returns_new_reference)
    return lambda e: results.append(value.emit(e)), reference


def borrowed(value: TypedExpr) -> TypedExpr:
    """Borrow an array for one call: a new array is released after the call (`call_expr`)."""
    if not value.returns_new_reference:
        return value

    def emit(e: Emitter) -> Value:
        array = value.emit(e)
        e.borrowed.append((value.type, array))
        return array

    return TypedExpr(value.type, emit)


def call_expr(
    result: types.Type, operands: Sequence[Emit], call: Callable[[Emitter, Sequence[Value]], Value]
) -> TypedExpr:
    """Emit the operands and a call, then release the arrays that the call borrowed."""

    def emit(e: Emitter) -> Value:
        before = len(e.borrowed)
        value = call(e, [operand(e) for operand in operands])
        e.release_borrowed(before)
        return value

    return TypedExpr(result, emit, returns_new_reference=isinstance(result, types.Array))


class _TreeReader(ast.NodeVisitor):
    """Read one function; `visit` returns a `TypedExpr` for an expression, an `Emit` for a statement."""

    def __init__(self, context: Any, module: dict[str, Any]) -> None:
        self.context, self.module = context, module
        self.types: dict[str, types.Type] = {}  # of each variable
        self.retyped: set[str] = set()  # variables of several types
        self.arrays: dict[str, types.Type] = {}  # variables that hold a reference to an array
        self.block = 0  # the number of the current basic block
        self.blocks: defaultdict[str, set[int]] = defaultdict(set)  # where each variable is assigned or used
        self.results: list[TypedExpr] = []
        self.signatures: dict[Any, tuple[types.Type, Any]] = {}  # by function and types of its arguments

    def function(self, tree: ast.FunctionDef, args: Sequence[types.Type], result: types.Type | None) -> TypedFunction:
        for argument, argument_type in zip(tree.args.args, args, strict=True):
            self.declare(argument.arg, argument_type)
        statements = self.read_body(tree.body)
        if not isinstance(tree.body[-1], ast.Return):
            statements.append(self.visit_Return(ast.Return()))
        registers = frozenset(
            name for name, blocks in self.blocks.items() if len(blocks) == 1 and name not in self.arrays
        )
        # A register may change its type with its value; a stack slot cannot.
        if not self.retyped <= registers:
            raise UnreadError(f"{', '.join(sorted(self.retyped - registers))} of several types")
        calls = tuple(signature for _, signature in self.signatures.values())
        return TypedFunction(tuple(statements), result or self.common_type(self.results), registers, self.arrays, calls)

    def visit(self, node: ast.AST) -> Any:
        try:
            return super().visit(node)
        except UnreadError as error:
            error.syntax = error.syntax or f"{ast.unparse(node)!r} in line {getattr(node, 'lineno', 0)}"
            raise

    def generic_visit(self, node: ast.AST) -> Any:
        """Raise for nodes without a method here."""
        raise UnreadError

    def next_block(self) -> None:
        self.block += 1

    def declare(self, name: str, value_type: types.Type) -> types.Type:
        """Record an assignment to a variable in the current block; return the type that the variable gets."""
        variable_type = types.unliteral(value_type)
        if self.types.setdefault(name, variable_type) != variable_type:
            self.retyped.add(name)
            self.types[name] = variable_type
        self.blocks[name].add(self.block)
        return variable_type

    def common_type(self, values: Sequence[TypedExpr]) -> types.Type:
        """Return the type to which all values convert, or raise."""
        unified = self.context.unify_types(*(types.unliteral(value.type) for value in values))
        if unified is None or not unified.is_precise():
            raise UnreadError
        return unified

    # -- constants: literals, and globals of the module, whose values are final ---------------------------------

    def constant(self, value: Any) -> TypedExpr:
        constant_type = types.maybe_literal(value) or self.context.resolve_value_type(value)
        return TypedExpr(constant_type, lambda e: e.context.get_constant_generic(e.builder, constant_type, value))

    def is_global(self, node: ast.expr) -> bool:
        """Return True for a name that is no variable, and for `name.attribute…` of one."""
        while isinstance(node, ast.Attribute):
            node = node.value
        return isinstance(node, ast.Name) and node.id not in self.types

    def global_value(self, node: ast.expr) -> Any:
        """Look up a name in the module and in the builtins, or an attribute of an imported module."""
        if isinstance(node, ast.Attribute) and isinstance(module := self.global_value(node.value), ModuleType):
            return getattr(module, node.attr)
        if not isinstance(node, ast.Name) or node.id in self.types:
            raise UnreadError
        if node.id in self.module:
            return self.module[node.id]
        if not hasattr(builtins, node.id):
            raise UnreadError
        return getattr(builtins, node.id)

    # -- calls, and operators, which are calls of functions of the module `operator` -----------------------------

    def call(self, function: Any, *values: TypedExpr) -> TypedExpr:
        function_type, signature = self.signature(function, tuple(value.type for value in values))
        if signature is None or signature.recvr:
            raise UnreadError
        # Convert the operands to the types of the signature; a compiled Python function may add defaults and `*args`.
        wanted, operands = signature.args, [borrowed(value) for value in values]
        if signature.pysig is None:
            converted = [value.cast(wanted_type) for value, wanted_type in zip(operands, wanted, strict=True)]
        else:
            converted = fold_arguments(
                signature.pysig,
                operands,
                {},
                lambda index, _, value: value.cast(wanted[index]),
                lambda index, _, value: lambda e: e.context.get_constant_generic(e.builder, wanted[index], value),
                lambda index, _, values: tuple_of(values).cast(wanted[index]),
            )

        def emit(e: Emitter, arguments: Sequence[Value]) -> Value:
            value = e.context.get_function(function_type, signature)(e.builder, arguments)
            return e.context.get_dummy_value() if value is None else value

        return call_expr(signature.return_type, converted, emit)

    def signature(self, function: Any, argument_types: tuple[types.Type, ...]) -> tuple[types.Type, Any]:
        """Return the type of a function and its signature for given arguments, both resolved by Numba."""
        # Cached: a step adds and multiplies thousands of times.
        if (function, argument_types) not in self.signatures:
            function_type = self.context.resolve_value_type(function)
            resolved = argument_types
            if isinstance(function_type, types.Dispatcher):
                # A compiled function takes integers: it is not compiled again for each of the literals 3, 4 and 5.
                resolved = tuple(map(types.unliteral, argument_types))
            signature = self.context.resolve_function_type(function_type, resolved, {})
            self.signatures[function, argument_types] = function_type, signature
        return self.signatures[function, argument_types]

    def call_address(self, function: TypedExpr, values: Sequence[TypedExpr]) -> TypedExpr:
        """Call a first-class function (`types.FunctionType`) by the address of its machine code."""
        if not isinstance(function.type, types.FunctionType) or len(values) != len(function.type.signature.args):
            raise UnreadError
        result, wanted = function.type.signature.return_type, function.type.signature.args
        converted = [borrowed(value).cast(wanted_type) for value, wanted_type in zip(values, wanted, strict=True)]

        def emit(e: Emitter, arguments: Sequence[Value]) -> Value:
            convention, builder = e.context.call_conv, e.builder
            address = cgutils.create_struct_proxy(function.type)(e.context, builder, value=function.emit(e)).jit_addr
            pointer = builder.bitcast(address, convention.get_function_type(result, wanted).as_pointer())
            status, value = convention.call_function(builder, pointer, result, wanted, arguments)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return value

        return call_expr(result, converted, emit)

    def visit_Call(self, node: ast.Call) -> TypedExpr:
        if node.keywords:
            raise UnreadError
        if self.is_global(node.func):
            function, values = self.global_value(node.func), [self.visit(value) for value in node.args]
            if isinstance(function, type) and issubclass(function, tuple) and function is not tuple:
                return tuple_of(values, function)  # a NamedTuple
            return self.call(function, *values)
        return self.call_address(self.visit(node.func), [self.visit(value) for value in node.args])

    def visit_BinOp(self, node: ast.BinOp) -> TypedExpr:
        return self.call(OPERATORS[type(node.op)], self.visit(node.left), self.visit(node.right))

    def visit_UnaryOp(self, node: ast.UnaryOp) -> TypedExpr:
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return self.constant(ast.literal_eval(node))
        return self.call(OPERATORS[type(node.op)], self.visit(node.operand))

    def visit_Compare(self, node: ast.Compare) -> TypedExpr:
        if len(node.ops) > 1:  # x < y < z is x < y and y < z
            pairs = zip(pairwise([node.left, *node.comparators]), node.ops, strict=True)
            return self.visit_BoolOp(ast.BoolOp(ast.And(), [ast.Compare(x, [op], [y]) for (x, y), op in pairs]))
        if type(node.ops[0]) not in OPERATORS:
            raise UnreadError
        return self.call(OPERATORS[type(node.ops[0])], self.visit(node.left), self.visit(node.comparators[0]))

    # -- names, attributes, elements, tuples -----------------------------------------------------------------------

    def visit_Name(self, node: ast.Name) -> TypedExpr:
        name = node.id
        if name not in self.types:
            return self.constant(self.global_value(node))
        self.blocks[name].add(self.block)
        return TypedExpr(self.types[name], lambda e: e.get_variable(name))

    def visit_Constant(self, node: ast.Constant) -> TypedExpr:
        return self.constant(node.value)

    def visit_Attribute(self, node: ast.Attribute) -> TypedExpr:
        if self.is_global(node):
            return self.constant(self.global_value(node))
        base: TypedExpr = self.visit(node.value)
        name, base_type = node.attr, base.type
        if isinstance(base_type, types.BaseNamedTuple):
            return tuple_item(base, base_type.fields.index(name))
        attribute_type = self.context.resolve_getattr(typ=base_type, attr=name)
        # Not read: methods, and arrays, whose references would have to be counted.
        if attribute_type is None or isinstance(attribute_type, types.Callable | types.Array):
            raise UnreadError
        if base.returns_new_reference:
            raise UnreadError

        def emit(e: Emitter) -> Value:
            return e.context.get_getattr(base_type, name)(e.context, e.builder, base_type, base.emit(e), name)

        return TypedExpr(attribute_type, emit)

    def visit_Subscript(self, node: ast.Subscript) -> TypedExpr:
        base: TypedExpr = self.visit(node.value)
        # Tuples by constant indices: each item has a type of its own.
        if isinstance(base.type, types.BaseTuple) and isinstance(node.slice, ast.Slice):
            first, last = (
                None if bound is None else int(ast.literal_eval(bound))
                for bound in (node.slice.lower, node.slice.upper)
            )
            return tuple_of([tuple_item(base, k) for k in range(len(base.type))[first:last]])
        if isinstance(base.type, types.BaseTuple) and isinstance(node.slice, ast.Constant):
            return tuple_item(base, ast.literal_eval(node.slice))
        return self.call(operator.getitem, base, self.visit(node.slice))

    def visit_Slice(self, node: ast.Slice) -> TypedExpr:
        bounds = [self.constant(None) if bound is None else self.visit(bound) for bound in (node.lower, node.upper)]
        return self.call(slice, *bounds, *([] if node.step is None else [self.visit(node.step)]))

    def visit_Tuple(self, node: ast.Tuple) -> TypedExpr:
        return tuple_of([self.visit(item) for item in node.elts])

    # -- conditions ------------------------------------------------------------------------------------------------

    def condition(self, node: ast.expr) -> TypedExpr:
        value: TypedExpr = self.visit(node)
        return value if value.type == types.boolean else self.call(bool, value)

    def conditional(self, condition: TypedExpr, yes: TypedExpr, no: TypedExpr) -> TypedExpr:
        if yes.returns_new_reference or no.returns_new_reference:
            raise UnreadError
        result = self.common_type([yes, no])
        first, second = yes.cast(result), no.cast(result)

        def emit(e: Emitter) -> Value:
            slot = cgutils.alloca_once(e.builder, e.context.get_value_type(result))
            e.if_else(
                condition.emit, lambda e: e.builder.store(first(e), slot), lambda e: e.builder.store(second(e), slot)
            )
            return e.builder.load(slot)

        return TypedExpr(result, emit)

    def visit_BoolOp(self, node: ast.BoolOp) -> TypedExpr:
        operands = []
        for value in node.values:  # each is evaluated in a basic block of its own
            operands.append(self.condition(value))
            self.next_block()
        # a and b and c is `(b if a else False)` with b replaced by `(c if b else False)`; `or` is alike.
        result = operands.pop()
        for operand in reversed(operands):
            if isinstance(node.op, ast.And):
                result = self.conditional(operand, result, self.constant(False))
            else:
                result = self.conditional(operand, self.constant(True), result)
        return result

    def visit_IfExp(self, node: ast.IfExp) -> TypedExpr:
        operands = []
        for read_operand, operand in ((self.condition, node.test), (self.visit, node.body), (self.visit, node.orelse)):
            operands.append(read_operand(operand))
            self.next_block()
        return self.conditional(*operands)

    # -- statements ------------------------------------------------------------------------------------------------

    def read_body(self, statements: Sequence[ast.stmt]) -> list[Emit]:
        """Read statements up to one that ends the block; the unreachable ones behind it may have no type."""
        emits = []
        for statement in statements:
            emits.append(self.visit(statement))
            if self.ends_block(statement):
                break
        return emits

    def ends_block(self, statement: ast.stmt) -> bool:
        if isinstance(statement, ast.If) and (branch := self.constant_branch(statement)):
            return self.ends_block(branch[-1])
        return isinstance(statement, ast.Return | ast.Break | ast.Continue)

    def constant_branch(self, node: ast.If) -> list[ast.stmt] | None:
        """Return the branch that a global constant chooses; None if the condition is computed."""
        if not self.is_global(node.test):
            return None
        return node.body if self.global_value(node.test) else node.orelse

    def read_block(self, statements: Sequence[ast.stmt]) -> Emit:
        """Read statements in basic blocks of their own."""
        self.next_block()
        emits = self.read_body(statements)
        self.next_block()
        return sequence(emits)

    def visit_Assign(self, node: ast.Assign) -> Emit:
        target, several = node.targets[0], len(node.targets) > 1
        # a, b = x, y: evaluate all values before the first assignment.
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple) and not several:
            pairs = [
                (item, *evaluated_once(self.visit(value)))
                for item, value in zip(target.elts, node.value.elts, strict=True)
            ]
            evaluations = [evaluation for _, evaluation, _ in pairs]
            return sequence(evaluations + [self.assign(item, result) for item, _, result in pairs])
        value: TypedExpr = self.visit(node.value)
        if not several:
            return self.assign(target, value)
        # a = b = x
        if value.returns_new_reference:
            raise UnreadError
        evaluation, result = evaluated_once(value)
        return sequence([evaluation, *(self.assign(target, result) for target in node.targets)])

    def assign(self, target: ast.expr, value: TypedExpr) -> Emit:
        """Assign a value to an element, to the names in a tuple, or to a name."""
        if isinstance(target, ast.Subscript):
            return self.call(operator.setitem, self.visit(target.value), self.visit(target.slice), value).emit
        if isinstance(target, ast.Tuple):
            if not isinstance(value.type, types.BaseTuple) or len(value.type) != len(target.elts):
                raise UnreadError
            evaluation, result = evaluated_once(value)
            items = [self.assign(item, tuple_item(result, k)) for k, item in enumerate(target.elts)]
            return sequence([evaluation, *items])
        if not isinstance(target, ast.Name):
            raise UnreadError
        name = target.id
        if name == "_" and not value.returns_new_reference:  # evaluate only
            return value.emit
        variable_type = self.declare(name, value.type)
        if not isinstance(variable_type, types.Array):
            converted = value.cast(variable_type)
            return lambda e: e.set_variable(name, converted(e))

        # An array variable takes over a new reference, and adds one to an array that another variable holds.
        self.arrays[name] = variable_type

        def emit(e: Emitter) -> None:
            array = value.emit(e)
            if not value.returns_new_reference:
                e.add_reference(variable_type, array)
            e.set_variable(name, array)

        return emit

    def visit_AugAssign(self, node: ast.AugAssign) -> Emit:
        if isinstance(node.target, ast.Name) and self.visit(node.target).type.mutable:
            raise UnreadError  # a += b of arrays works in place
        return self.visit_Assign(ast.Assign([node.target], ast.BinOp(node.target, node.op, node.value)))

    def visit_Expr(self, node: ast.Expr) -> Emit:
        if isinstance(node.value, ast.Constant):  # a docstring
            return lambda e: None
        value: TypedExpr = self.visit(node.value)
        if value.returns_new_reference:
            raise UnreadError
        return value.emit

    def visit_Return(self, node: ast.Return) -> Emit:
        value = self.constant(None) if node.value is None else self.visit(node.value)
        self.results.append(value)

        def emit(e: Emitter) -> None:
            result_type = e.function.result  # known when all `return` are read
            result = value.cast(result_type)(e)
            # The caller gets a reference, then the variables release theirs.
            if not value.returns_new_reference:
                e.add_reference(result_type, result)
            for name in e.function.arrays:
                e.release_variable(name)
            e.lower.call_conv.return_value(e.builder, e.context.get_return_value(e.builder, result_type, result))

        return emit

    def visit_If(self, node: ast.If) -> Emit:
        if (branch := self.constant_branch(node)) is not None:  # the other branch may have no type
            return self.read_block(branch)
        condition, yes, no = self.condition(node.test), self.read_block(node.body), self.read_block(node.orelse)
        return lambda e: e.if_else(condition.emit, yes, no)

    # -- loops -----------------------------------------------------------------------------------------------------

    def visit_Break(self, node: ast.Break) -> Emit:
        return lambda e: e.builder.branch(e.loops[-1][1])

    def visit_Continue(self, node: ast.Continue) -> Emit:
        return lambda e: e.builder.branch(e.loops[-1][0])

    def visit_While(self, node: ast.While) -> Emit:
        if node.orelse:
            raise UnreadError
        self.next_block()
        endless = isinstance(node.test, ast.Constant) and node.test.value is True
        condition = None if endless else self.condition(node.test).emit
        body = self.read_block(node.body)
        return lambda e: e.while_loop(condition, body)

    def visit_For(self, node: ast.For) -> Emit:
        if node.orelse:
            raise UnreadError
        # A loop over the items of a tuple, whose types may differ: read the body once for each item.
        if (items := self.unrolled_items(node.iter)) is not None:
            bodies = []
            for item in items:
                self.next_block()
                bodies.append(sequence([self.assign(node.target, item), *self.read_body(node.body)]))
            self.next_block()
            return lambda e: e.unrolled_loop(bodies)
        if not (isinstance(node.iter, ast.Call) and self.global_value(node.iter.func) is range):
            raise UnreadError
        return self.range_loop(node, [self.visit(bound) for bound in node.iter.args])

    def unrolled_items(self, node: ast.expr) -> list[TypedExpr] | None:
        """Return the items of a displayed or global tuple, or of `enumerate` of one; None for anything else."""
        if isinstance(node, ast.Tuple):
            return [self.visit(item) for item in node.elts]
        if self.is_global(node) and isinstance(values := self.global_value(node), tuple):
            return [self.constant(value) for value in values]
        if isinstance(node, ast.Call) and self.global_value(node.func) is enumerate and len(node.args) == 1:
            items = self.unrolled_items(node.args[0])
            return None if items is None else [tuple_of([self.constant(k), item]) for k, item in enumerate(items)]
        return None

    def range_loop(self, node: ast.For, bounds: Sequence[TypedExpr]) -> Emit:
        """Read `for name in range(*bounds)`; the step must be an integer literal, so that its sign is known."""
        if not all(isinstance(bound.type, types.Integer) for bound in bounds):
            raise UnreadError
        start, stop = (self.constant(0), *bounds) if len(bounds) == 1 else bounds[:2]
        step_type = bounds[2].type if len(bounds) == 3 else types.literal(1)
        if not isinstance(step_type, types.IntegerLiteral) or step_type.literal_value == 0:
            raise UnreadError
        emit_start, emit_stop, step = start.cast(types.int64), stop.cast(types.int64), step_type.literal_value
        # Read the body in a basic block of its own; `counts` holds the value of the loop variable there.
        self.next_block()
        counts: list[Value] = []
        count = TypedExpr(types.int64, lambda e: counts[-1])
        body = sequence([self.assign(node.target, count), *self.read_body(node.body)])
        self.next_block()

        def emit(e: Emitter) -> None:
            first, last = emit_start(e), emit_stop(e)
            following = e.stack_slot(first)

            def count_and_run(e: Emitter) -> None:
                # Count before the body, as Numba does: LLVM then peels the first turn off short loops.
                counts.append(e.builder.load(following))
                e.builder.store(e.builder.add(counts[-1], first.type(step)), following)
                body(e)

            relation = "<" if step > 0 else ">"
            e.while_loop(lambda e: e.builder.icmp_signed(relation, e.builder.load(following), last), count_and_run)

        return emit
