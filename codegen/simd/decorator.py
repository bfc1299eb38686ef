"""The decorator of the functions of a kernel: Numba's, without what nobody calls."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numba
from llvmlite.binding.newpassmanagers import ModulePassManager
from numba.core import base, bytecode, codegen, ir, lowering
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.typed_passes import NativeLowering, NoPythonBackend

from . import syntax
from .writing import Program

__all__ = ["execute", "njit", "without_repetition"]


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

    def __init__(self, identity: Any, program: Program) -> None:
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
        program = syntax.read(state.typingctx, identity.func, state.args, state.return_type)
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


class _Compiler(CompilerBase):
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


class _LinkedCompiler(_Compiler):
    """The compiler of functions that others link."""

    lowering = _LinkedLowering


def execute(text: str, path: str, space: dict[str, Any]) -> None:
    """Run the text of a module in a namespace, with the syntax from which its functions are compiled."""
    tree = ast.parse(text, path)
    space[syntax.TREES] = syntax.functions(tree)
    exec(compile(tree, path, "exec"), space)


ENTRY = {"pipeline_class": _Compiler}
INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _LinkedCompiler}


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(**options)`; a function that is not cached is no entry point, and cannot be called from Python.

    A kernel has some eighty functions and one entry point; wrappers and machine code of them all are half of its compilation.
    """
    return numba.njit(**{**options, **(ENTRY if options.get("cache") else INNER)})


@contextmanager
def without_repetition() -> Iterator[None]:
    """Let Numba do once what it does over and over, and leave out what kernels do not need; only one thread may be within.

    Numba finds out once how large a type is, whether a function wants to know where it is called, and that LLVM reads the
    locale.  LLVM does not optimise the functions that a module only names, and does not thread jumps before it has merged
    the blocks of inlined functions, thousands in a kernel: its own passes do it later and come to the same machine code.
    """
    with ExitStack() as stack:
        for owner, name, instead in _instead():
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, instead)
        yield


def _optimize_functions(library: Any, module: Any) -> None:
    """Let LLVM optimise what a module defines."""
    module.data_layout = library._codegen._data_layout
    for function in module.functions:
        if not function.is_declaration:
            manager, builder = library._codegen._function_pass_manager()
            manager.run(function, builder)


def _instead() -> list[tuple[Any, str, Callable[..., Any]]]:
    """What stands in the place of functions of Numba, by owner and name; each remembers its answers for itself."""
    size, sizes = base.BaseContext.get_abi_sizeof, dict[str, int]()

    def abi_size(context: Any, kind: Any) -> int:
        key = str(kind)
        if key not in sizes:
            sizes[key] = size(context, kind)
        return sizes[key]

    return [
        (base, "_has_loc", functools.cache(base._has_loc)),
        (base.BaseContext, "get_abi_sizeof", abi_size),
        (codegen.CPUCodeLibrary, "_optimize_functions", _optimize_functions),
        (codegen.CPUCodegen, "_check_llvm_bugs", functools.cache(codegen.CPUCodegen._check_llvm_bugs)),
        (ModulePassManager, "add_jump_threading_pass", lambda passes, threshold=-1: None),
    ]
