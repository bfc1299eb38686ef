"""Define SIMD values for Numba: `Lane(width)` holds one double for each of `width` cells, `Mask(width)` a truth value.

Each kernel is written once, for lanes of any width.  Width 1 gives a scalar kernel.  A wider kernel runs several cells
of a sweep at the same time in one vector register.  Operators and functions have no branches: both sides of a `select`
are computed.

Rounding.  If one side of a sum or difference is a product of lanes, the two operations become one fused multiply-add;
if both sides are products, the first product is fused.  Only the text of the kernel decides about fusion, so that all
widths give the same bits.  LLVM gets no fast-math flags, because LLVM could fuse differently at different widths.
Infinities and NaN follow IEEE 754.  Old processors have no such instruction; there a multiply-add is a product and a
sum, which round twice, because the C library's function `fma` takes 30 times as long.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin

from .addresses import FIRST, data_of
from .lane_types import (
    BOOL,
    DOUBLE,
    INT64,
    Lane,
    Mask,
    as_lane,
    common_width,
    constant_like,
    has_fma,
    native_width,
    splat,
    vector,
)  # fmt: skip

__all__ = [
    "Lane", "Mask", "absolute", "any_lane", "broadcast", "copysign", "floor", "fma", "lane_bits", "load",
    "maximum", "minimum", "native_width", "one_lane",
    "scale_binary", "select", "split_binary", "sqrt", "store", "truncated",
]  # fmt: skip

# -- operators ---------------------------------------------------------------------------------------------------

PRODUCT = "product"
"""LLVM name of products of lanes.  At width 1 only the name tells lanes from numbers, whose products stay unfused."""


def _factors(value: ir.Value) -> tuple[ir.Value, ir.Value] | None:
    """Return the factors of a product of lanes; None for any other value, and for a product loaded from memory."""
    of_lanes = getattr(value, "opname", None) == "fmul" and value.name.startswith(PRODUCT)
    return tuple(value.operands) if of_lanes else None


def _call(builder: ir.IRBuilder, name: str, *values: ir.Value) -> ir.Value:
    """Call the function llvm.<name> for the common type of the values."""
    kind = values[0].type
    suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
    function_type = ir.FunctionType(kind, [kind] * len(values))
    return builder.call(cgutils.get_or_insert_function(builder.module, function_type, f"llvm.{name}.{suffix}"), values)


def _multiply_add(builder: ir.IRBuilder, x: ir.Value, y: ir.Value, z: ir.Value) -> ir.Value:
    """x * y + z, rounded once if the processor has the instruction."""
    return _call(builder, "fma", x, y, z) if has_fma() else builder.fadd(builder.fmul(x, y), z)


def _exact_multiply_add(builder: ir.IRBuilder, x: ir.Value, y: ir.Value, z: ir.Value) -> ir.Value:
    """x * y + z, rounded once if the processor has the instruction; else with an error of about one rounding."""
    if has_fma():
        return _call(builder, "fma", x, y, z)
    add, sub, mul = builder.fadd, builder.fsub, builder.fmul
    # Dekker, Numer. Math. 18, 224, 1971: multiply by 2**27 + 1 to split each factor into halves of 26 bits; products of
    # halves are exact.
    splitter = constant_like(x, 134217729.0)
    halves = []
    for value in (x, y):
        scaled = mul(value, splitter)
        high = sub(scaled, sub(scaled, value))
        halves.append((high, sub(value, high)))
    (x_high, x_low), (y_high, y_low) = halves
    product = mul(x, y)
    product_error = sub(mul(x_high, y_high), product)
    for pair in ((x_high, y_low), (x_low, y_high), (x_low, y_low)):
        product_error = add(product_error, mul(*pair))
    # Knuth's sum of two numbers and its error.
    total = add(product, z)
    added = sub(total, product)
    total_error = add(sub(product, sub(total, added)), sub(z, added))
    exact = add(total, add(total_error, product_error))
    # The halves of large factors overflow: return the sum that rounds twice then.
    return builder.select(builder.fcmp_ordered("ord", exact, exact), exact, total)


def _sum(builder: ir.IRBuilder, x: ir.Value, y: ir.Value) -> ir.Value:
    if product := _factors(x):
        return _multiply_add(builder, *product, y)
    if product := _factors(y):
        return _multiply_add(builder, *product, x)
    return builder.fadd(x, y)


def _difference(builder: ir.IRBuilder, x: ir.Value, y: ir.Value) -> ir.Value:
    if product := _factors(x):
        return _multiply_add(builder, *product, builder.fneg(y))
    if product := _factors(y):
        return _multiply_add(builder, builder.fneg(product[0]), product[1], x)
    return builder.fsub(x, y)


def _define_operator(
    function: Callable[..., Any], operands: Sequence[tuple[type, ...]], result: type, emit: Callable[..., ir.Value]
) -> None:
    """Define an operator for operands of these Numba types; a number is broadcast to the width of the other operand."""

    @infer_global(function)
    class _Typing(AbstractTemplate):
        metadata = FIRST

        def generic(self, args: Any, kws: Any) -> Any:
            widths = {a.width for a in args if isinstance(a, Lane | Mask)}
            fits = any(len(args) == len(kinds) and all(map(isinstance, args, kinds)) for kinds in operands)
            return signature(result(*widths), *args) if fits and len(widths) == 1 else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        return emit(builder, *(as_lane(context, builder, v, t, width) for v, t in zip(args, sig.args, strict=True)))

    for kinds in operands:
        lower_builtin(function, *kinds)(lower)


_PAIRS = [(Lane, Lane), (Lane, types.Float), (types.Float, Lane), (Lane, types.Integer), (types.Integer, Lane)]
_define_operator(operator.add, _PAIRS, Lane, _sum)
_define_operator(operator.sub, _PAIRS, Lane, _difference)
_define_operator(operator.mul, _PAIRS, Lane, lambda b, x, y: b.fmul(x, y, PRODUCT))
_define_operator(operator.truediv, _PAIRS, Lane, lambda b, x, y: b.fdiv(x, y))
_define_operator(operator.neg, [(Lane,)], Lane, lambda b, x: b.fneg(x))
for _function, _relation in (
    (operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="), (operator.eq, "=="),
):  # fmt: skip
    _define_operator(_function, _PAIRS, Mask, lambda b, x, y, _r=_relation: b.fcmp_ordered(_r, x, y))
_define_operator(operator.and_, [(Mask, Mask)], Mask, lambda b, x, y: b.and_(x, y))
_define_operator(operator.or_, [(Mask, Mask)], Mask, lambda b, x, y: b.or_(x, y))
_define_operator(operator.invert, [(Mask,)], Mask, lambda b, x: b.not_(x))


# -- functions of lanes ------------------------------------------------------------------------------------------


def _on_lanes(emit: Callable[..., ir.Value], arity: int) -> Any:
    """Return an intrinsic on lanes that `emit(builder, *lanes)` emits; numbers among its arguments are broadcast."""

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        return emit(builder, *(as_lane(context, builder, v, t, width) for v, t in zip(args, sig.args, strict=True)))

    def typed(*arguments: Any) -> Any:
        width = common_width(arguments)
        return (Lane(width)(*arguments), lower) if width else None

    # Numba reads the number of arguments from the signature.
    if arity == 1:
        return intrinsic(lambda typingctx, x: typed(x))
    if arity == 2:
        return intrinsic(lambda typingctx, x, y: typed(x, y))
    return intrinsic(lambda typingctx, x, y, z: typed(x, y, z))


def on_bits(emit: Callable[..., ir.Value], arity: int) -> Any:
    """Return an intrinsic on lanes; `emit(builder, *integers)` takes and returns their bits as 64-bit integers."""

    def on_doubles(builder: ir.IRBuilder, *values: ir.Value) -> ir.Value:
        doubles = values[0].type
        integers = ir.VectorType(INT64, doubles.count) if isinstance(doubles, ir.VectorType) else INT64
        return builder.bitcast(emit(builder, *(builder.bitcast(value, integers) for value in values)), doubles)

    return _on_lanes(on_doubles, arity)


def _llvm_function(name: str, arity: int) -> Any:
    return _on_lanes(lambda builder, *values: _call(builder, name, *values), arity)


def _extreme(relation: str) -> Any:
    """Return the intrinsic for the smaller or the larger of two numbers; if one of the two is NaN, it returns the
    other.

    LLVM's maxnum and minnum are not used: LLVM 22 vectorises loops of maxima over nodes incorrectly and drops some
    values.
    """

    def emit(builder: Any, x: Any, y: Any) -> Any:
        y_wins = builder.fcmp_ordered(relation, y, x)
        return builder.select(builder.fcmp_unordered("uno", x, x), y, builder.select(y_wins, y, x))

    return _on_lanes(emit, 2)


absolute = _llvm_function("fabs", 1)
floor = _llvm_function("floor", 1)
sqrt = _llvm_function("sqrt", 1)
copysign = _llvm_function("copysign", 2)
minimum = _extreme("<")
maximum = _extreme(">")
fma = _on_lanes(_exact_multiply_add, 3)
multiply_add = _on_lanes(_multiply_add, 3)

# A double has 1 bit of sign, 11 of exponent and 52 of significand.  `shifted` is k + 1.5 * 2**52 for an integer k, whose
# lowest bits are those of k.
scale_binary = on_bits(lambda b, x, shifted: b.add(x, b.shl(shifted, constant_like(x, 52))), 2)
"""value * 2**k for k in -1023 … 1023, by one addition to the exponent."""
flip_if_odd = on_bits(lambda b, x, shifted: b.xor(x, b.shl(shifted, constant_like(x, 63))), 2)
"""-value for odd k, else value."""
truncated = on_bits(lambda b, x: b.and_(x, constant_like(x, -1 << 44)), 1)
"""The number rounded towards zero to the first 9 bits of its significand."""


@intrinsic
def select(typingctx: Any, mask: Any, yes: Any, no: Any) -> Any:
    """Per lane: `yes` where the mask holds, else `no`; both are evaluated."""
    if not isinstance(mask, Mask):
        return None
    width = mask.width

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pair = (as_lane(context, builder, v, t, width) for v, t in zip(args[1:], sig.args[1:], strict=True))
        return builder.select(args[0], *pair)

    return Lane(width)(mask, yes, no), lower


@intrinsic
def split_binary(typingctx: Any, value: Any, pivot: Any) -> Any:
    """Split a positive normal `value` = m * 2**k with m in [pivot, 2 pivot) into the lanes (m, k)."""
    if not isinstance(value, Lane) or not isinstance(pivot, types.Float):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        integers = vector(INT64, value.width)
        bits, start = (
            builder.bitcast(args[0], integers),
            builder.bitcast(splat(builder, args[1], value.width), integers),
        )
        # Bits of positive doubles are ordered as the doubles are, and 2**52 of them lie between x and 2 x.
        shift = constant_like(bits, 52)
        exponent = builder.ashr(builder.sub(bits, start), shift)
        mantissa = builder.sub(bits, builder.shl(exponent, shift))
        parts = [builder.bitcast(mantissa, args[0].type), builder.sitofp(exponent, args[0].type)]
        return context.make_tuple(builder, sig.return_type, parts)

    return types.UniTuple(value, 2)(value, pivot), lower


# -- masks -------------------------------------------------------------------------------------------------------


@intrinsic
def lane_bits(typingctx: Any, mask: Any) -> Any:
    """Return the mask as an integer: bit l is lane l."""
    if not isinstance(mask, Mask):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(mask.width)), INT64)

    return types.int64(mask), lower


@intrinsic
def any_lane(typingctx: Any, mask: Any) -> Any:
    """Return True if at least one lane of the mask holds."""
    if not isinstance(mask, Mask):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(mask.width))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), lower


def _width_of(literal: Any) -> int | None:
    return literal.literal_value if isinstance(literal, types.IntegerLiteral) else None


@intrinsic(prefer_literal=True)
def one_lane(typingctx: Any, lane: Any, width: Any) -> Any:
    """Return the mask that is True in one lane only."""
    size = _width_of(width)
    if size is None or not isinstance(lane, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[0], sig.args[0], types.int64)
        bits = builder.trunc(builder.shl(ir.Constant(INT64, 1), index), ir.IntType(size))
        return builder.bitcast(bits, vector(BOOL, size))

    return Mask(size)(lane, width), lower


# -- memory ------------------------------------------------------------------------------------------------------


def _pointer(context: Any, builder: Any, sig: Any, args: Any, width: int) -> Any:
    """Return the pointer to lane number `args[1]` of an array or address `args[0]`."""
    slot = context.cast(builder, args[1], sig.args[1], types.intp)
    first = builder.gep(
        data_of(context, builder, args[0], sig.args[0]), [builder.mul(slot, ir.Constant(slot.type, width))]
    )
    return builder.bitcast(first, vector(DOUBLE, width).as_pointer())


@intrinsic(prefer_literal=True)
def load(typingctx: Any, array: Any, slot: Any, width: Any) -> Any:
    """Read group number `slot` of `width` consecutive doubles, from a flat array or an address, as a lane."""
    size = _width_of(width)
    if size is None or not isinstance(slot, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, sig, args, size), align=8)  # entries are aligned, not lanes

    return Lane(size)(array, slot, width), lower


@intrinsic
def store(typingctx: Any, array: Any, slot: Any, value: Any) -> Any:
    """Write a lane as group number `slot` of consecutive doubles, to a flat array or an address."""
    if not isinstance(value, Lane) or not isinstance(slot, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _pointer(context, builder, sig, args, sig.args[2].width), align=8)
        return context.get_dummy_value()

    return types.void(array, slot, value), lower


@intrinsic(prefer_literal=True)
def broadcast(typingctx: Any, number: Any, width: Any) -> Any:
    """Return a lane that holds the same number everywhere."""
    size = _width_of(width)
    if size is None or not isinstance(number, types.Float | types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return as_lane(context, builder, args[0], sig.args[0], size)

    return Lane(size)(number, width), lower
