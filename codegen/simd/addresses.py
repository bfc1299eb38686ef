"""Refer to memory by an address: one machine word, without the shape and reference count of an array.

An address is valid while the array that it points into exists.  A kernel holds all of its memory in one array until the
kernel returns.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from .lane_types import DOUBLE

FIRST = {"target": "cpu"}
"""Metadata of operators: Numba tries operators with the target "cpu" before its own operators for any target.

Without this entry, Numba would first try a dozen operators of arrays, strings and dates for each sum of two lanes.
"""


class Address(types.Type):
    """Numba type of an address of doubles: `p[k]` reads and `p[k] = x` writes number k behind it."""

    def __init__(self) -> None:
        super().__init__(name="Address")


ADDRESS = Address()


@register_model(Address)
class _AddressModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: Address) -> None:
        super().__init__(manager, fe_type, DOUBLE.as_pointer())


def data_of(context: Any, builder: ir.IRBuilder, value: ir.Value, fe_type: types.Type) -> ir.Value:
    """Return the pointer to the first double of an array; return an address unchanged."""
    return value if isinstance(fe_type, Address) else context.make_array(fe_type)(context, builder, value).data


@intrinsic
def address(typingctx: Any, array: Any, first: Any) -> Any:
    """Return the address of entry `first` of a flat array of doubles."""
    if not isinstance(first, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        return builder.gep(data_of(context, builder, args[0], sig.args[0]), [index])

    return ADDRESS(array, first), lower


@infer_global(operator.getitem)
class _Read(AbstractTemplate):
    metadata = FIRST

    def generic(self, args: Any, kws: Any) -> Any:
        if isinstance(args[0], Address) and isinstance(args[1], types.Integer):
            return signature(types.float64, args[0], types.intp)
        return None


@infer_global(operator.setitem)
class _Write(AbstractTemplate):
    metadata = FIRST

    def generic(self, args: Any, kws: Any) -> Any:
        if isinstance(args[0], Address) and isinstance(args[1], types.Integer):
            return signature(types.none, args[0], types.intp, types.float64)
        return None


@lower_builtin(operator.getitem, Address, types.Integer)
def _read(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(builder.gep(args[0], [args[1]]))


@lower_builtin(operator.setitem, Address, types.Integer, types.Float)
def _write(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], builder.gep(args[0], [args[1]]))
    return context.get_dummy_value()
