"""The functions that a driver takes, as one argument: a table of the addresses of their machine code.

Numba takes functions one by one and looks for their types and addresses at each call, which takes longer than a short run.
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
    """Numba type of `Functions`, whose attributes are first-class functions of these signatures."""

    def __init__(self, signatures: Mapping[str, Any]) -> None:
        self.kinds = {name: types.FunctionType(signature) for name, signature in signatures.items()}
        super().__init__(name=f"Functions({self.kinds})")


class Functions:
    """Compiled functions, None in the place of those that are not called."""

    def __init__(self, kind: FunctionsType, functions: Sequence[Any]) -> None:
        self._numba_type_ = kind
        self.functions = functions
        addresses = default_manager.lookup(next(iter(kind.kinds.values())))._fields  # Numba has several of a function
        self.table = np.zeros((len(functions), len(addresses)), np.uintp)
        called = self.table[:, addresses.index("jit_addr")]
        for k, function in enumerate(functions):
            if function is not None:
                (found,) = function.overloads.values()
                called[k] = found.library.get_pointer_to_function(found.fndesc.llvm_func_name)
        self.address = self.table.ctypes.data


@register_model(FunctionsType)
class _Model(models.StructModel):
    def __init__(self, manager: Any, fe_type: FunctionsType) -> None:
        super().__init__(manager, fe_type, list(fe_type.kinds.items()))


@infer_getattr
class _Attributes(AttributeTemplate):
    key = FunctionsType

    def generic_resolve(self, kind: FunctionsType, name: str) -> Any:
        return kind.kinds.get(name)


@lower_getattr_generic(FunctionsType)
def _function(context: Any, builder: Any, kind: FunctionsType, value: Any, name: str) -> Any:
    found = getattr(cgutils.create_struct_proxy(kind)(context, builder, value=value), name)
    return impl_ret_borrowed(context, builder, kind.kinds[name], found)


@unbox(FunctionsType)
def _taken(kind: FunctionsType, functions: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(functions, "address")
    place = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.load(c.builder.bitcast(place, c.context.get_value_type(kind).as_pointer())))
