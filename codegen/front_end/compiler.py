"""A Numba compiler with two passes: read the syntax tree, emit LLVM.

If this compiler raises, `decorator` falls back on Numba's own pipeline.
"""

from __future__ import annotations

from typing import Any

from numba.core import bytecode, ir, lowering
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.typed_passes import NativeLowering, NoPythonBackend

from . import syntax_reader
from .emitter import TypedFunction


class _LinkedCode(JITCodeLibrary):
    """LLVM code of an inner function: callers link it, and it is optimised as a part of the entry point."""

    # Numba optimises each function and generates its machine code before it links the function into its callers, where
    # both are done again. Nothing calls the first machine code, and so this class skips it.

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Finish the code; return 0, because there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _LinkedCode:
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing: only machine code refers to an environment of Python objects."""


class _FunctionIR(ir.FunctionIR):
    """A typed function in the form that Numba's passes expect: one empty block stands for its body."""

    def __init__(self, identity: Any, function: TypedFunction, noinline: bool) -> None:
        location = ir.Loc(identity.filename, identity.firstlineno)
        blocks = {0: ir.Block(ir.Scope(None, location), location)}
        super().__init__(blocks, False, identity, location, {}, identity.arg_count, identity.arg_names)
        self.typed_function, self.noinline = function, noinline


@register_pass(mutates_CFG=True, analysis_only=False)
class _Reading(FunctionPass):
    """Read the syntax tree of a function for the types of its arguments."""

    _name = "reading"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        identity = state.func_id
        function = syntax_reader.read(state.typingctx, identity.func, state.args, state.return_type)
        state.func_ir = _FunctionIR(identity, function, state.pipeline.noinline)
        state.return_type = function.result
        state.calltypes = dict(enumerate(function.calls))  # some versions of Numba look for calls that return arrays
        state.typemap = {f"arg.{name}": kind for name, kind in zip(identity.arg_names, state.args, strict=True)}
        return True


class _Lower(lowering.Lower):
    """Emit the body of a typed function; Numba's base class emits what surrounds it."""

    def lower_normal_function(self, fndesc: Any) -> None:
        self.setup_function(fndesc)
        self.func_ir.typed_function.emit(self, self.extract_function_arguments())
        if self.func_ir.noinline:
            self.function.attributes.add("noinline")


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    _name = "writing"
    lowering_class = _Lower


class FrontEnd(CompilerBase):
    """Compile a function from its syntax tree; an `inner` one to LLVM code that its callers link."""

    def __init__(self, *arguments: Any, inner: bool, noinline: bool) -> None:
        super().__init__(*arguments)
        self.inner, self.noinline = inner, noinline

    def compile_extra(self, func: Any) -> Any:
        state = self.state
        state.func_id, state.lifted = bytecode.FunctionIdentity.from_function(func), ()
        if self.inner:
            state.library = _LinkedCode(state.targetctx.codegen(), state.func_id.func_qualname)
        return self._compile_core()

    def define_pipelines(self) -> list[PassManager]:
        manager = PassManager("syntax")
        manager.passes = [(_Reading, "read"), (_Lowering, "write"), (NoPythonBackend, "finish")]
        manager.finalize()
        return [manager]
