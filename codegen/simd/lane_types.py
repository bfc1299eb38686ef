"""Numba types of lanes: `Lane(width)` for doubles, `Mask(width)` for truth values, and their LLVM vectors."""

from __future__ import annotations

import os
import platform
from typing import Any

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba import types
from numba.extending import models, register_model

DOUBLE, INT32, INT64, BOOL = ir.DoubleType(), ir.IntType(32), ir.IntType(64), ir.IntType(1)
WIDTHS = (1, 2, 4, 8, 16)
"""Widths of lanes: scalars, one register of SSE2, AVX and AVX-512, two registers of AVX-512."""

HOST_NAME, HOST_FEATURES = llvm.get_host_cpu_name(), dict(llvm.get_host_cpu_features())
"""Name and features of the processor.

Read once, at import: LLVM holds a lock during the call, and the child of a fork in another thread would wait for it forever.
"""


class Lane(types.Type):
    """Numba type of `width` doubles in one vector register."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lane({width})")


class Mask(types.Type):
    """Numba type of `width` truth values, the result of comparing lanes."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Mask({width})")


def vector(element: ir.Type, width: int) -> ir.Type:
    """Return the LLVM vector of `width` elements, a scalar for width 1 (LLVM 20 aborts on some vectors of one bit)."""
    return element if width == 1 else ir.VectorType(element, width)


def constant_like(value: ir.Value, number: float) -> ir.Constant:
    """Return a constant of the type of `value`, with the same number in every lane."""
    kind = value.type
    return ir.Constant(kind, [number] * kind.count if isinstance(kind, ir.VectorType) else number)


@register_model(Lane)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: Lane) -> None:
        super().__init__(manager, fe_type, vector(DOUBLE, fe_type.width))


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: Mask) -> None:
        super().__init__(manager, fe_type, vector(BOOL, fe_type.width))


def native_width(registers: int = 1) -> int:
    """Return the lane width for `registers` registers of this CPU; SYNCHAIN_WIDTH overrides the width.

    A register holds 8 doubles with AVX-512, 4 with AVX, else 2.  Raises ValueError if SYNCHAIN_WIDTH is not one of 1,
    2, 4, 8, 16.
    """
    wish = os.environ.get("SYNCHAIN_WIDTH", "")
    if wish:
        if wish not in map(str, WIDTHS):
            raise ValueError(f"SYNCHAIN_WIDTH is {wish!r}; expected one of {', '.join(map(str, WIDTHS))}")
        return int(wish)
    if HOST_FEATURES.get("avx512f"):
        return 8 * registers
    return (4 if HOST_FEATURES.get("avx") else 2) * registers


def has_fma() -> bool:
    """Return True if the processor for which kernels are compiled can compute x * y + z with a single rounding."""
    if platform.machine().lower() not in ("x86_64", "amd64", "i386", "i686"):
        return True  # all other processors for which Numba compiles have the instruction
    if numba.config.CPU_FEATURES is not None:
        return "+fma" in numba.config.CPU_FEATURES.split(",")
    return bool(numba.config.ENABLE_AVX and HOST_FEATURES.get("fma"))


def splat(builder: ir.IRBuilder, value: ir.Value, width: int) -> ir.Value:
    """Return the vector with the same value in every lane."""
    if width == 1:
        return value
    undefined = ir.Constant(vector(DOUBLE, width), ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(INT32, 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(vector(INT32, width), [0] * width))


def as_lane(context: Any, builder: ir.IRBuilder, value: ir.Value, fe_type: types.Type, width: int) -> ir.Value:
    """Return an operand of a lane function as a vector: broadcast a number, return a lane or a mask unchanged."""
    if isinstance(fe_type, Lane | Mask):
        return value
    if fe_type != types.float64:
        value = context.cast(builder, value, fe_type, types.float64)
    return splat(builder, value, width)


def common_width(arguments: Any) -> int | None:
    """Return the common width of the lanes among lanes and numbers; None if widths differ, or for other types."""
    widths = {a.width for a in arguments if isinstance(a, Lane)}
    all_fit = all(isinstance(a, Lane | types.Float | types.Integer) for a in arguments)
    return widths.pop() if len(widths) == 1 and all_fit else None
