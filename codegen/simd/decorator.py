"""The decorator of the functions of a kernel: Numba's, without what nobody calls."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from types import BuiltinFunctionType
from typing import Any

import numba
from llvmlite.binding.newpassmanagers import ModulePassManager
from numba import types
from numba.core import (
    base,
    bytecode,
    codegen,
    errors,
    interpreter,
    ir,
    lowering,
    postproc,
    transforms,
    typeinfer,
    utils,
)
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.typed_passes import AnnotateTypes, InlineOverloads, NativeLowering, NoPythonBackend, NopythonRewrites
from numba.core.typing.context import BaseContext
from numba.core.untyped_passes import (
    ExtractByteCode,
    InlineClosureLikes,
    InlineInlinables,
    TranslateByteCode,
    WithLifting,
)

from . import syntax

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


class _Read(ir.FunctionIR):
    """What Numba asks of a function that was read from its syntax tree."""

    def __init__(self, identity: Any, program: syntax.Program) -> None:
        place = ir.Loc(identity.filename, identity.firstlineno)
        blocks = {0: ir.Block(ir.Scope(None, place), place)}
        super().__init__(blocks, False, identity, place, {}, identity.arg_count, identity.arg_names)
        self.program = program


class _Lower(lowering.Lower):
    """Numba's lowering, and that of functions that were read."""

    def lower_normal_function(self, fndesc: Any) -> None:
        if isinstance(self.func_ir, _Read):
            self.setup_function(fndesc)
            self.func_ir.program.write(self, self.extract_function_arguments())
        else:
            super().lower_normal_function(fndesc)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Reading(FunctionPass):
    """Reads a function from its syntax tree, if its module has one."""

    _name = "reading"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        function, identity = state.func_id.func, state.func_id
        tree = function.__globals__.get(SYNTAX, {}).get(function.__name__)
        if tree is None:
            raise syntax.UnreadError
        program = syntax.read(state.typingctx, tree, function.__globals__, state.args, state.return_type)
        state.func_ir, state.calltypes, state.return_type = _Read(identity, program), {}, program.result
        state.typemap = {f"arg.{name}": kind for name, kind in zip(identity.arg_names, state.args, strict=True)}
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Translation(TranslateByteCode):
    """Numba's translation, with the bytecode that it begins with."""

    def run_pass(self, state: Any) -> bool:
        state.status.fail_reason = None  # that the function was not read is no error
        ExtractByteCode().run_pass(state)
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    """Lowering by `_Lower`."""

    _name = "lowering"
    lowering_class = _Lower


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(_Lowering):
    """The same into a `_Linked` library."""

    _name = "linked_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class _Compiler(CompilerBase):
    """Compiles a function from its syntax tree, or as Numba does.

    Numba's way goes without the passes for what kernels have none of, or nobody reads.
    """

    lowering: type = _Lowering
    unused = (AnnotateTypes, InlineClosureLikes, InlineInlinables, InlineOverloads, NopythonRewrites, WithLifting)
    """The listing with types, closures, functions that are inlined by Numba, expressions of whole arrays, `with`."""

    def compile_extra(self, func: Any) -> Any:
        self.state.func_id, self.state.lifted = bytecode.FunctionIdentity.from_function(func), ()
        return self._compile_bytecode()

    def define_pipelines(self) -> list[PassManager]:
        lower = [(self.lowering, "lower"), (NoPythonBackend, "backend")]
        whole = DefaultPassBuilder.define_nopython_pipeline(self.state).passes
        before = whole[: [one for one, _ in whole].index(NativeLowering)]
        kept = [
            (_Translation if one is TranslateByteCode else one, why) for one, why in before if one not in self.unused
        ]
        return [_manager("syntax", [(_Reading, "read"), *lower]), _manager("bytecode", [*kept, *lower])]


def _manager(name: str, passes: list[tuple[type, str]]) -> PassManager:
    """Passes that follow each other; if one has an error of Numba, the next ones of a compiler are tried."""
    manager = PassManager(name)
    manager.passes = passes
    manager.finalize()
    return manager


class _LinkedCompiler(_Compiler):
    """The compiler of functions that others link."""

    lowering = _LinkedLowering


SYNTAX = "__syntax__"
"""What a module calls the syntax trees of its functions, by their names."""


def execute(text: str, path: str, space: dict[str, Any]) -> None:
    """Run the text of a module in a namespace, with the syntax from which its functions are compiled."""
    tree = ast.parse(text, path)
    space[SYNTAX] = {part.name: part for part in tree.body if isinstance(part, ast.FunctionDef)}
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

    A kernel adds and multiplies lanes thousands of times: Numba finds out once, not for each line, what an operator means
    for operands of given types, and how large a type is.  A function is compiled for integers, not for 3, 4 and 5 apart.
    No function is a generator or leaves compiled code, which is all that needs the variables alive at the start of a
    block.  LLVM does not optimise the functions that a module only names, and does not thread jumps before it has merged
    the blocks of inlined functions, thousands in a kernel: its own passes do it later and come to the same machine code.
    One look finds a locale that LLVM cannot read.  No kernel has a `with`, updates a dictionary or is warned of.
    """
    with ExitStack() as stack:
        for owner, name, instead in _instead():
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, instead)
        yield


class _Told:
    """What tells an error of Numba where it happened, without the generator of Numba's own."""

    __slots__ = ("given", "words")

    def __init__(self, words: str, /, **given: Any) -> None:
        self.words, self.given = words, given

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if isinstance(error, errors.NumbaError):
            error.add_context(self.words.format(**self.given))


def _variables(statement: Any, value: Any) -> list[Any]:
    """Return the variables in a part of a statement, in order; most parts are variables, places and names."""
    found: list[Any] = []
    for part in value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else (value,):
        if isinstance(part, ir.Var):
            found.append(part)
        elif isinstance(part, ir.Inst):
            found += part.list_vars()
        elif isinstance(part, (list, tuple, dict)):
            found += _variables(statement, part)
    return found


def _optimize_functions(library: Any, module: Any) -> None:
    """Let LLVM optimise what a module defines."""
    module.data_layout = library._codegen._data_layout
    for function in module.functions:
        if not function.is_declaration:
            manager, builder = library._codegen._function_pass_manager()
            manager.run(function, builder)


def _lifetimes(processor: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Find out which variables live how long."""
    source = processor.func_ir
    source.blocks = transforms.canonicalize_cfg(source.blocks)
    source.variable_lifetime = postproc.VariableLifetime(source.blocks)
    source.generator_info = None
    if emit_dels:
        processor._insert_var_dels(extend_lifetimes=extend_lifetimes)


def _instead() -> list[tuple[Any, str, Callable[..., Any]]]:
    """What stands in the place of functions of Numba, by owner and name; each remembers its answers for itself."""
    resolve, call, size = types.Function.get_call_type, types.Dispatcher.get_call_type, base.BaseContext.get_abi_sizeof
    value_type, literal = BaseContext.resolve_value_type, lowering._lit_or_omitted
    meanings: dict[Any, Any] = {}
    operators: dict[Any, Any] = {}
    sizes: dict[str, int] = {}
    unknown = types.Omitted(ir.UNDEFINED)
    look = functools.cache(codegen.CPUCodegen._check_llvm_bugs)

    def meaning(function: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return resolve(function, context, args, kws)
        key = function, tuple(args)
        if key not in meanings:
            meanings[key] = resolve(function, context, args, kws)
        return meanings[key]

    def of_any_integer(function: Any, context: Any, args: Any, kws: Any) -> Any:
        return call(function, context, tuple(map(types.unliteral, args)), kws)

    def of_operators(context: Any, value: Any) -> Any:
        if not (isinstance(value, BuiltinFunctionType) and value in utils.OPERATORS_TO_BUILTINS):
            return value_type(context, value)
        if value not in operators:
            operators[value] = value_type(context, value)
        return operators[value]

    def of_known(value: Any) -> Any:
        return unknown if value is ir.UNDEFINED else literal(value)

    def abi_size(context: Any, kind: Any) -> int:
        key = str(kind)
        if key not in sizes:
            sizes[key] = size(context, kind)
        return sizes[key]

    return [
        (types.Function, "get_call_type", meaning),
        (types.Dispatcher, "get_call_type", of_any_integer),
        (BaseContext, "resolve_value_type", of_operators),
        (lowering, "_lit_or_omitted", of_known),
        (lowering, "new_error_context", _Told),
        (typeinfer, "new_error_context", _Told),
        (interpreter.errors.WarningsFixer, "catch_warnings", lambda fixer, **place: nullcontext()),
        (ir.Inst, "_rec_list_vars", _variables),
        (interpreter, "peep_hole_delete_with_exit", lambda code: code),
        (interpreter, "peep_hole_fuse_dict_add_updates", lambda code: code),
        (base, "_has_loc", functools.cache(base._has_loc)),
        (base.BaseContext, "get_abi_sizeof", abi_size),
        (postproc.PostProcessor, "run", _lifetimes),
        (codegen.CPUCodeLibrary, "_optimize_functions", _optimize_functions),
        (codegen.CPUCodegen, "_check_llvm_bugs", look),
        (ModulePassManager, "add_jump_threading_pass", lambda passes, threshold=-1: None),
    ]
