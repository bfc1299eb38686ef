"""A SIMD value for Numba: `Lane(width)` holds one double for each of `width` cells, `Mask(width)` one truth value.

Kernels are written once on lane values.  Width 1 is the scalar kernel, wider ones run several cells of a sweep in
step with each other in one vector register.  Operators and the functions below are branch-free: both sides of a
`select` are computed.  A sum or a difference of which one side is a product of lanes is one fused multiply-add; the first
product is taken if both sides are.  The text alone decides it, so that every width has the same bits; LLVM, which may choose
otherwise from one width to the next, is allowed nothing, and infinities and NaN mean what they mean in IEEE 754.
Without an instruction for it, on old processors, a multiply-add is a product and a sum, which rounds twice; a function of the
C library, which LLVM would call, takes 30 times as long.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin

from .addresses import data_of
from .lane_types import (
    BOOL,
    DOUBLE,
    INT64,
    Lane,
    Mask,
    as_lane,
    common_width,
    constant,
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

FIRST = {"target": "cpu"}
"""Metadata of the operators of lanes: Numba tries what is made for the CPU before its own, which are for any target.

The other way round it asks some dozen operators of arrays, texts and dates first, every time two lanes are added.
"""

PAIRS = [(Lane, Lane), (Lane, types.Float), (types.Float, Lane), (Lane, types.Integer), (types.Integer, Lane)]


def _define_operator(function: Callable[..., Any], emit: Callable[..., Any], result: type) -> None:
    """Give a binary operator its meaning on lanes; numbers are broadcast."""

    @infer_global(function)
    class _Typing(AbstractTemplate):
        metadata = FIRST

        def generic(self, args: Any, kws: Any) -> Any:
            width = common_width(args) if len(args) == 2 else None
            return signature(result(width), *args) if width else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        left, right = (as_lane(context, builder, v, t, width) for v, t in zip(args, sig.args, strict=True))
        return emit(builder, left, right)

    for left, right in PAIRS:
        lower_builtin(function, left, right)(lower)


PRODUCT = "product"
"""What products of lanes are called in LLVM's text, where a lane of one cell and a number are of one type."""


def _factors(value: Any) -> tuple[Any, Any] | None:
    """The factors of lanes that this block has multiplied."""
    of_lanes = getattr(value, "opname", None) == "fmul" and value.name.startswith(PRODUCT)
    return tuple(value.operands) if of_lanes else None


def _call(builder: Any, name: str, *values: Any) -> Any:
    """llvm.<name> of values of one type."""
    kind = values[0].type
    suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
    signed = ir.FunctionType(kind, [kind] * len(values))
    return builder.call(cgutils.get_or_insert_function(builder.module, signed, f"llvm.{name}.{suffix}"), values)


def _multiply_add(builder: Any, x: Any, y: Any, z: Any) -> Any:
    """x * y + z, with one rounding where the processor has an instruction for it."""
    return _call(builder, "fma", x, y, z) if has_fma() else builder.fadd(builder.fmul(x, y), z)


def _exact_multiply_add(builder: Any, x: Any, y: Any, z: Any) -> Any:
    """x * y + z with one rounding, or, without an instruction for it, with an error of about one.

    The product is split into its rounded value and its error (Dekker, Numer. Math. 18, 224, 1971), the sum as well (Knuth).
    """
    if has_fma():
        return _call(builder, "fma", x, y, z)
    add, sub, mul = builder.fadd, builder.fsub, builder.fmul
    splitter = splat(
        builder, ir.Constant(DOUBLE, 134217729.0), x.type.count if isinstance(x.type, ir.VectorType) else 1
    )
    halves = []
    for value in (x, y):
        scaled = mul(value, splitter)
        high = sub(scaled, sub(scaled, value))
        halves.append((high, sub(value, high)))
    (x_high, x_low), (y_high, y_low) = halves
    product = mul(x, y)
    error = sub(mul(x_high, y_high), product)
    for pair in ((x_high, y_low), (x_low, y_high), (x_low, y_low)):
        error = add(error, mul(*pair))
    whole = add(product, z)
    part = sub(whole, product)
    rest = add(sub(product, sub(whole, part)), sub(z, part))
    exact = add(whole, add(rest, error))
    return builder.select(builder.fcmp_ordered("ord", exact, exact), exact, whole)  # large factors have no halves


def _sum(builder: Any, x: Any, y: Any) -> Any:
    """x + y; the first product of the two is fused."""
    if product := _factors(x):
        return _multiply_add(builder, *product, y)
    if product := _factors(y):
        return _multiply_add(builder, *product, x)
    return builder.fadd(x, y)


def _difference(builder: Any, x: Any, y: Any) -> Any:
    """x - y; the first product of the two is fused."""
    if product := _factors(x):
        return _multiply_add(builder, *product, builder.fneg(y))
    if product := _factors(y):
        return _multiply_add(builder, builder.fneg(product[0]), product[1], x)
    return builder.fsub(x, y)


for _function, _emit in (
    (operator.add, _sum),
    (operator.sub, _difference),
    (operator.mul, lambda b, x, y: b.fmul(x, y, PRODUCT)),
    (operator.truediv, lambda b, x, y: b.fdiv(x, y)),
):
    _define_operator(_function, _emit, Lane)
for _function, _name in (
    (operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="), (operator.eq, "=="),
):  # fmt: skip
    _define_operator(_function, lambda b, x, y, _n=_name: b.fcmp_ordered(_n, x, y), Mask)


@infer_global(operator.neg)
class _NegTyping(AbstractTemplate):
    metadata = FIRST

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(args[0], *args) if isinstance(args[0], Lane) else None


@lower_builtin(operator.neg, Lane)
def _lower_neg(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


def _define_logic(function: Callable[..., Any], name: str) -> None:
    @infer_global(function)
    class _Typing(AbstractTemplate):
        metadata = FIRST

        def generic(self, args: Any, kws: Any) -> Any:
            same = len(args) == 2 and isinstance(args[0], Mask) and args[0] == args[1]
            return signature(args[0], *args) if same else None

    @lower_builtin(function, Mask, Mask)
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, name)(*args)


_define_logic(operator.and_, "and_")
_define_logic(operator.or_, "or_")


@infer_global(operator.invert)
class _InvertTyping(AbstractTemplate):
    metadata = FIRST

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(args[0], *args) if isinstance(args[0], Mask) else None


@lower_builtin(operator.invert, Mask)
def _lower_invert(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.not_(args[0])


def _on_lanes(emit: Callable[..., Any], arity: int) -> Any:
    """An intrinsic on lanes that `emit` builds; numbers among the arguments are broadcast."""

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        return emit(builder, *(as_lane(context, builder, v, t, width) for v, t in zip(args, sig.args, strict=True)))

    def typed(*arguments: Any) -> Any:
        width = common_width(arguments)
        return (Lane(width)(*arguments), lower) if width else None

    if arity == 1:
        return intrinsic(lambda typingctx, x: typed(x))
    if arity == 2:
        return intrinsic(lambda typingctx, x, y: typed(x, y))
    return intrinsic(lambda typingctx, x, y, z: typed(x, y, z))


def _llvm_function(name: str, arity: int) -> Any:
    """An intrinsic that calls llvm.<name> on lanes."""
    return _on_lanes(lambda builder, *values: _call(builder, name, *values), arity)


def _extreme(relation: str) -> Any:
    """The one of two numbers that stands in a relation to the other; of a number and a NaN, the number.

    Not maxnum and minnum of LLVM, whose version 22 vectorises loops over nodes that take maxima by them, and loses some.
    """

    def emit(builder: Any, x: Any, y: Any) -> Any:
        second = builder.fcmp_ordered(relation, y, x)
        return builder.select(builder.fcmp_unordered("uno", x, x), y, builder.select(second, y, x))

    return _on_lanes(emit, 2)


absolute = _llvm_function("fabs", 1)
floor = _llvm_function("floor", 1)
sqrt = _llvm_function("sqrt", 1)
copysign = _llvm_function("copysign", 2)
minimum = _extreme("<")
maximum = _extreme(">")
fma = _on_lanes(_exact_multiply_add, 3)
multiply_add = _on_lanes(_multiply_add, 3)


@intrinsic
def select(typingctx: Any, mask: Any, yes: Any, no: Any) -> Any:
    """Per lane: `yes` where the mask holds, else `no`."""
    if not isinstance(mask, Mask):
        return None
    width = mask.width

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pair = (as_lane(context, builder, v, t, width) for v, t in zip(args[1:], sig.args[1:], strict=True))
        return builder.select(args[0], *pair)

    return Lane(width)(mask, yes, no), lower


@intrinsic
def lane_bits(typingctx: Any, mask: Any) -> Any:
    """The mask as an integer: bit l is lane l."""
    if not isinstance(mask, Mask):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(mask.width)), INT64)

    return types.int64(mask), lower


@intrinsic
def any_lane(typingctx: Any, mask: Any) -> Any:
    """True where at least one lane of the mask holds."""
    if not isinstance(mask, Mask):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        small = ir.IntType(mask.width)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], small), ir.Constant(small, 0))

    return types.boolean(mask), lower


def _slot(context: Any, builder: Any, array: Any, array_type: Any, index: Any, width: int) -> Any:
    data = data_of(context, builder, array, array_type)
    offset = builder.mul(index, ir.Constant(index.type, width))
    return builder.bitcast(builder.gep(data, [offset]), vector(DOUBLE, width).as_pointer())


def _width_of(literal: Any) -> int | None:
    return literal.literal_value if isinstance(literal, types.IntegerLiteral) else None


@intrinsic(prefer_literal=True)
def load(typingctx: Any, array: Any, slot: Any, width: Any) -> Any:
    """Lane number `slot` of a flat float64 array, or an address, whose entries stand in groups of `width`."""
    size = _width_of(width)
    if size is None or not isinstance(slot, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        return builder.load(_slot(context, builder, args[0], sig.args[0], index, size), align=8)

    return Lane(size)(array, slot, width), lower


@intrinsic
def store(typingctx: Any, array: Any, slot: Any, value: Any) -> Any:
    """Write a lane to a flat float64 array, or an address, at group number `slot`."""
    if not isinstance(value, Lane) or not isinstance(slot, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        place = _slot(context, builder, args[0], sig.args[0], index, sig.args[2].width)
        builder.store(args[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, slot, value), lower


@intrinsic(prefer_literal=True)
def broadcast(typingctx: Any, number: Any, width: Any) -> Any:
    """A lane that holds the same number everywhere."""
    size = _width_of(width)
    if size is None or not isinstance(number, types.Float | types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return as_lane(context, builder, args[0], sig.args[0], size)

    return Lane(size)(number, width), lower


@intrinsic
def scale_binary(typingctx: Any, value: Any, shifted: Any) -> Any:
    """value * 2**k for k = shifted - 1.5 * 2**52, an integer in -1023 … 1023; one integer addition."""
    if not isinstance(value, Lane):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole, shift = vector(INT64, value.width), constant(INT64, value.width, 52)
        exponent = builder.shl(builder.bitcast(args[1], whole), shift)
        return builder.bitcast(builder.add(builder.bitcast(args[0], whole), exponent), args[0].type)

    return value(value, shifted), lower


@intrinsic
def split_binary(typingctx: Any, value: Any, pivot: Any) -> Any:
    """For positive normal `value` = m * 2**k with m in [pivot, 2 pivot): the pair (m, k), both lanes."""
    if not isinstance(value, Lane) or not isinstance(pivot, types.Float):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = value.width
        whole, shift = vector(INT64, width), constant(INT64, width, 52)
        start = builder.bitcast(splat(builder, args[1], width), whole)
        distance = builder.sub(builder.bitcast(args[0], whole), start)
        exponent = builder.ashr(distance, shift)
        back = builder.shl(exponent, shift)
        mantissa = builder.bitcast(builder.sub(builder.bitcast(args[0], whole), back), args[0].type)
        number = builder.sitofp(exponent, args[0].type)
        return context.make_tuple(builder, sig.return_type, [mantissa, number])

    return types.UniTuple(value, 2)(value, pivot), lower


@intrinsic
def truncated(typingctx: Any, value: Any) -> Any:
    """The number cut to the first 9 bits of its significand, towards zero."""
    if not isinstance(value, Lane):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole, mask = vector(INT64, value.width), constant(INT64, value.width, -(1 << 44))
        return builder.bitcast(builder.and_(builder.bitcast(args[0], whole), mask), args[0].type)

    return value(value), lower


@intrinsic(prefer_literal=True)
def one_lane(typingctx: Any, which: Any, width: Any) -> Any:
    """The mask that holds in one lane alone."""
    size = _width_of(width)
    if size is None or not isinstance(which, types.Integer):
        return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[0], sig.args[0], types.int64)
        small = builder.trunc(builder.shl(ir.Constant(INT64, 1), index), ir.IntType(size))
        return builder.bitcast(small, vector(BOOL, size))

    return Mask(size)(which, width), lower
