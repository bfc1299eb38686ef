"""Pass functions to a driver as one argument: a table with the addresses of their machine code.

Numba passes first-class functions one by one, and looks up types and addresses of each function at every call, which
takes longer than a short run.  Here the look-up happens once, when the table is created.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.datamodel import default_manager
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, models, register_model, unbox


class FunctionsType(types.Type):
    """Numba type of `Functions`: its attributes are first-class functions of the signatures that it is made with."""

    def __init__(self, signatures: Mapping[str, Any]) -> None:
        self.types = {name: types.FunctionType(signature) for name, signature in signatures.items()}
        super().__init__(name=f"Functions({self.types})")


class Functions:
    """Compiled functions; None stands for a function that is not called."""

    def __init__(self, functions_type: FunctionsType, functions: Sequence[Any]) -> None:
        self._numba_type_ = functions_type  # `typeof` of Numba looks here
        self.functions = functions
        # Numba's struct of a function has several addresses; kernels call the one of the machine code.
        fields = default_manager.lookup(next(iter(functions_type.types.values())))._fields
        self.table = np.zeros((len(functions), len(fields)), np.uintp)
        addresses = self.table[:, fields.index("jit_addr")]
        for k, function in enumerate(functions):
            if function is not None:
                (compiled,) = function.overloads.values()
                addresses[k] = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
        self.address = self.table.ctypes.data


# In machine code the table is a struct of these structs, which a kernel gets as a copy.


@register_model(FunctionsType)
class _Model(models.StructModel):
    def __init__(self, manager: Any, fe_type: FunctionsType) -> None:
        super().__init__(manager, fe_type, list(fe_type.types.items()))


@infer_getattr
class _Attributes(AttributeTemplate):
    key = FunctionsType

    def generic_resolve(self, functions_type: FunctionsType, name: str) -> Any:
        return functions_type.types.get(name)


@lower_getattr_generic(FunctionsType)
def _attribute(context: Any, builder: Any, functions_type: FunctionsType, value: Any, name: str) -> Any:
    function = getattr(cgutils.create_struct_proxy(functions_type)(context, builder, value=value), name)
    return impl_ret_borrowed(context, builder, functions_type.types[name], function)


@unbox(FunctionsType)
def _unbox(functions_type: FunctionsType, functions: Any, c: Any) -> NativeValue:
    """Load the struct from the address that the Python object has as an attribute."""
    number = c.pyapi.object_getattr_string(functions, "address")
    pointer = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    struct = c.context.get_value_type(functions_type)
    return NativeValue(c.builder.load(c.builder.bitcast(pointer, struct.as_pointer())))
