"""Emit LLVM: the values of variables, basic blocks, loops, and the reference counts of arrays.

`syntax_reader` translates an expression into a `TypedExpr` and a statement into an `Emit`, functions that take the
`Emitter` of the function under construction.  They run after the whole function was read, when the types of all
variables are final.

Variables.  One that lives in a single basic block is an LLVM register, as in Numba.  The others are stack slots
(`alloca`), which LLVM turns into registers.

Arrays are counted by Numba's runtime (NRT).  An array variable holds one reference, which an assignment or `return`
releases. An expression either refers to an array that a variable holds, or returns a new reference
(`returns_new_reference`): a variable takes this over, and a call borrows it and releases it afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from llvmlite import ir
from numba import types
from numba.core import cgutils, lowering

Value: TypeAlias = ir.Value
Emit: TypeAlias = "Callable[[Emitter], Any]"


@dataclass(frozen=True, slots=True)
class TypedExpr:
    """An expression: its Numba type, and `emit`, which emits its code and returns its value."""

    type: types.Type
    emit: Emit
    returns_new_reference: bool = False  # to an array, which the consumer must release

    def cast(self, target: types.Type) -> Emit:
        """Return the `emit` of this expression converted to another type."""
        if target == self.type:
            return self.emit
        return lambda e: e.context.cast(e.builder, self.emit(e), self.type, target)


@dataclass(frozen=True, slots=True)
class TypedFunction:
    """A function with the types of all its variables."""

    statements: tuple[Emit, ...]
    result: types.Type
    registers: frozenset[str]  # the variables that live in a single basic block
    arrays: dict[str, types.Type]  # the variables that hold a reference to an array, with their types
    calls: tuple[Any, ...]  # Numba's signatures of all operators and calls

    def emit(self, lower: lowering.Lower, arguments: Sequence[Value]) -> None:
        """Emit the body of the function, given the LLVM values of its arguments."""
        emitter = Emitter(lower, self)
        for name, array_type in self.arrays.items():
            # Zeros are a null reference, which the first assignment may release.
            llvm_type = lower.context.get_value_type(array_type)
            emitter.slots[name] = cgutils.alloca_once(emitter.builder, llvm_type, zfill=True)
        for name, value in zip(lower.fndesc.args, arguments, strict=True):
            if name in self.arrays:  # the caller holds the argument, the variable needs a reference as well
                emitter.add_reference(self.arrays[name], value)
            emitter.set_variable(name, value)
        emitter.emit_all(self.statements)
        if not emitter.block_ended:
            emitter.builder.unreachable()


@dataclass(slots=True)
class Emitter:
    """The state of a function under construction."""

    lower: lowering.Lower
    function: TypedFunction
    registers: dict[str, Value] = field(default_factory=dict)  # values of the variables in registers
    slots: dict[str, Value] = field(default_factory=dict)  # stack slots of the other variables
    loops: list[tuple[ir.Block, ir.Block]] = field(
        default_factory=list
    )  # targets of `continue`, `break`; innermost last
    borrowed: list[tuple[types.Type, Value]] = field(default_factory=list)  # new arrays that the current calls borrow

    @property
    def builder(self) -> ir.IRBuilder:
        return self.lower.builder

    @property
    def context(self) -> Any:
        """Numba's target context, which emits operators, calls and conversions."""
        return self.lower.context

    @property
    def block_ended(self) -> bool:
        """True after a `return`, `break` or `continue`."""
        return bool(self.builder.block.is_terminated)

    def emit_all(self, statements: Sequence[Emit]) -> None:
        """Emit statements in turn, up to one that ends the basic block."""
        for statement in statements:
            if self.block_ended:
                return
            statement(self)

    # -- variables and references -----------------------------------------------------------------------------

    def get_variable(self, name: str) -> Value:
        return self.registers[name] if name in self.registers else self.builder.load(self.slots[name])

    def set_variable(self, name: str, value: Value) -> None:
        if name in self.function.registers:
            self.registers[name] = value
        elif name in self.slots:
            self.release_variable(name)
            self.builder.store(value, self.slots[name])
        else:
            self.slots[name] = self.stack_slot(value)

    def stack_slot(self, value: Value) -> Value:
        """Return new stack memory with an initial value."""
        slot = cgutils.alloca_once(self.builder, value.type)
        self.builder.store(value, slot)
        return slot

    def add_reference(self, array_type: types.Type, value: Value) -> None:
        self.context.nrt.incref(self.builder, array_type, value)

    def release_variable(self, name: str) -> None:
        """Release the array that a variable holds; do nothing for other variables."""
        if name in self.function.arrays:
            self.context.nrt.decref(self.builder, self.function.arrays[name], self.get_variable(name))

    def release_borrowed(self, first: int) -> None:
        """Release the borrowed arrays from number `first` on."""
        for array_type, value in self.borrowed[first:]:
            self.context.nrt.decref(self.builder, array_type, value)
        del self.borrowed[first:]

    # -- control flow -----------------------------------------------------------------------------------------

    def new_blocks(self, count: int) -> list[ir.Block]:
        return [self.builder.append_basic_block() for _ in range(count)]

    def fill_block(self, block: ir.Block, emit: Emit, successor: ir.Block) -> None:
        """Emit code into a basic block, which goes on at `successor` unless the code ends it."""
        self.builder.position_at_end(block)
        emit(self)
        if not self.block_ended:
            self.builder.branch(successor)

    def if_else(self, condition: Emit, yes: Emit, no: Emit) -> None:
        yes_block, no_block, after = self.new_blocks(3)
        self.builder.cbranch(condition(self), yes_block, no_block)
        self.fill_block(yes_block, yes, after)
        self.fill_block(no_block, no, after)
        self.builder.position_at_end(after)

    def unrolled_loop(self, bodies: Sequence[Emit]) -> None:
        """Emit one body for each turn of a loop; `continue` leads to the next body, `break` behind the last."""
        (after,) = self.new_blocks(1)
        for body in bodies:
            (following,) = self.new_blocks(1)
            self.loops.append((following, after))
            self.fill_block(self.builder.block, body, following)
            self.loops.pop()
            self.builder.position_at_end(following)
        self.builder.branch(after)
        self.builder.position_at_end(after)

    def while_loop(self, condition: Emit | None, body: Emit) -> None:
        """Emit a loop; without a condition an endless one, which only `break` and `return` leave."""
        head, inside, after = self.new_blocks(3)
        self.builder.branch(head)
        self.builder.position_at_end(head)
        if condition is None:
            self.builder.branch(inside)
        else:
            self.builder.cbranch(condition(self), inside, after)
        self.loops.append((head, after))
        self.fill_block(inside, body, head)
        self.loops.pop()
        self.builder.position_at_end(after)
