"""The pipeline of kernel functions: read from the syntax tree, written as LLVM; `decorator` goes on without it."""

from __future__ import annotations

from typing import Any

from numba.core import bytecode, ir, lowering
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.typed_passes import NativeLowering, NoPythonBackend

from . import syntax_reader
from .emitter import ReadFunction


class _Linked(JITCodeLibrary):
    """LLVM code of a function that only others of its module call: they link it, and it is optimised with them.

    Numba optimises a function and makes machine code of it before it links it into those that call it, and there it does
    so again.  Nothing calls this machine code, so all of it waits for the entry point.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Finish the code; there is no machine code to point to."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _Linked:
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing; only machine code has a place for objects of Python."""


class _Function(ir.FunctionIR):
    """What Numba asks of a function that was read from its syntax tree."""

    def __init__(self, identity: Any, program: ReadFunction) -> None:
        place = ir.Loc(identity.filename, identity.firstlineno)
        blocks = {0: ir.Block(ir.Scope(None, place), place)}
        super().__init__(blocks, False, identity, place, {}, identity.arg_count, identity.arg_names)
        self.program = program


@register_pass(mutates_CFG=True, analysis_only=False)
class _Reading(FunctionPass):
    """Reads a function."""

    _name = "reading"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        identity = state.func_id
        program = syntax_reader.read(state.typingctx, identity.func, state.args, state.return_type)
        state.func_ir, state.return_type = _Function(identity, program), program.result
        state.calltypes = dict(enumerate(program.calls))  # some versions of Numba look for calls that return arrays
        state.typemap = {f"arg.{name}": kind for name, kind in zip(identity.arg_names, state.args, strict=True)}
        return True


class _Lower(lowering.Lower):
    """Lowering of a function that was read."""

    def lower_normal_function(self, fndesc: Any) -> None:
        self.setup_function(fndesc)
        self.func_ir.program.write(self, self.extract_function_arguments())


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    """Writes a function that was read."""

    _name = "writing"
    lowering_class = _Lower


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(_Lowering):
    """Writes a function into a `_Linked` library."""

    _name = "linked_writing"

    def run_pass(self, state: Any) -> bool:
        state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class EntryCompiler(CompilerBase):
    """Compiles a function from its syntax tree."""

    lowering: type = _Lowering

    def compile_extra(self, func: Any) -> Any:
        self.state.func_id, self.state.lifted = bytecode.FunctionIdentity.from_function(func), ()
        return self._compile_core()

    def define_pipelines(self) -> list[PassManager]:
        manager = PassManager("syntax")
        manager.passes = [(_Reading, "read"), (self.lowering, "write"), (NoPythonBackend, "finish")]
        manager.finalize()
        return [manager]


class InnerCompiler(EntryCompiler):
    """The compiler of functions that others link."""

    lowering = _LinkedLowering


class _SeparateLower(_Lower):
    """Lowering of a function that LLVM does not inline."""

    def lower_normal_function(self, fndesc: Any) -> None:
        super().lower_normal_function(fndesc)
        self.function.attributes.add("noinline")


@register_pass(mutates_CFG=True, analysis_only=False)
class _SeparateLowering(_LinkedLowering):
    """Writes a function that LLVM does not inline into a `_Linked` library."""

    _name = "separate_writing"
    lowering_class = _SeparateLower


class SeparateCompiler(InnerCompiler):
    """The compiler of functions that others link and call."""

    lowering = _SeparateLowering
