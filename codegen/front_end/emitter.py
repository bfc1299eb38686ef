"""Where functions of kernels are written: values of LLVM, variables, blocks, loops, and arrays that are kept alive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from llvmlite import ir
from numba import types
from numba.core import cgutils, lowering

Value: TypeAlias = ir.Value
Write: TypeAlias = "Callable[[CodeWriter], Any]"


@dataclass(frozen=True, slots=True)
class TypedExpr:
    """An expression: its type, what writes its code and returns its value, and whether that is an array of nobody else."""

    kind: types.Type
    write: Write
    owned: bool = False

    def cast(self, kind: types.Type) -> Write:
        """What writes the value as one of another type."""
        if kind == self.kind:
            return self.write
        return lambda w: w.context.cast(w.builder, self.write(w), self.kind, kind)


@dataclass(frozen=True, slots=True)
class ReadFunction:
    """A function that was read."""

    statements: tuple[Write, ...]  # what writes its statements
    result: types.Type  # the type of what it returns
    local: frozenset[str]  # the variables of one block alone
    arrays: dict[str, types.Type]  # the variables that keep arrays alive, and their types
    calls: tuple[Any, ...]

    def write(self, lower: lowering.Lower, arguments: Sequence[Value]) -> None:
        """Write the code of the function, whose arguments have these values."""
        writer = CodeWriter(lower, self)
        for name, kind in self.arrays.items():
            whole = lower.context.get_value_type(kind)
            writer.slots[name] = cgutils.alloca_once(writer.builder, whole, zfill=True)
        for name, value in zip(lower.fndesc.args, arguments, strict=True):
            writer.set(name, writer.keep(self.arrays[name], value) if name in self.arrays else value)
        writer.write(self.statements)
        if not writer.ended:
            writer.builder.unreachable()


@dataclass(slots=True)
class CodeWriter:
    """Where code is written: the function, the values of its variables, and where `continue` and `break` lead."""

    lower: lowering.Lower
    program: ReadFunction
    values: dict[str, Value] = field(default_factory=dict)
    slots: dict[str, Value] = field(default_factory=dict)
    ends: list[tuple[ir.Block, ir.Block]] = field(default_factory=list)
    lent: list[tuple[types.Type, Value]] = field(default_factory=list)

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
            self.release(name)
            self.builder.store(value, self.slots[name])
        else:
            self.slots[name] = self.memory(value)

    def keep(self, kind: types.Type, value: Value) -> Value:
        """An array that one variable more keeps alive."""
        self.context.nrt.incref(self.builder, kind, value)
        return value

    def release(self, name: str) -> None:
        """Keep the array of a variable alive no longer."""
        if name in self.program.arrays:
            self.context.nrt.decref(self.builder, self.program.arrays[name], self.get(name))

    def take_back(self, first: int) -> None:
        """Keep arrays that were lent to a function alive no longer."""
        for kind, value in self.lent[first:]:
            self.context.nrt.decref(self.builder, kind, value)
        del self.lent[first:]

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

    def each(self, bodies: Sequence[Write]) -> None:
        """Write what is done in turn."""
        (after,) = self.blocks(1)
        for body in bodies:
            (on,) = self.blocks(1)
            self.ends.append((on, after))
            self.inside(self.builder.block, body, on)
            self.ends.pop()
            self.builder.position_at_end(on)
        self.builder.branch(after)
        self.builder.position_at_end(after)

    def loop(self, test: Write | None, body: Write) -> None:
        """Write what is done while a condition holds."""
        again, inside, after = self.blocks(3)
        self.builder.branch(again)
        self.builder.position_at_end(again)
        if test is None:
            self.builder.branch(inside)
        else:
            self.builder.cbranch(test(self), inside, after)
        self.ends.append((again, after))
        self.inside(inside, body, again)
        self.ends.pop()
        self.builder.position_at_end(after)
