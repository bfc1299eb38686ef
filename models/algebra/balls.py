"""Certified values of SymPy expressions and algebraic numbers: balls of Arb, nearest floats, decimals.

Arb: F. Johansson, IEEE Trans. Comput. 66, 1281 (2017).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

import sympy as sp
from flint import acb, arb, ctx, fmpq, fmpz

from .rationals import to_flint

Ball: TypeAlias = Any  # flint.arb if the number is real, flint.acb if it is complex (flint has no types)
# Largest working precision in bits of `accurate`; ValueError if a ball of this precision still contains 0.
_MOST = 2**20


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Run Arb with a precision of `bits` bits, then restore its precision."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before


def enclose(expression: sp.Expr, bits: int) -> Ball:
    """Return a ball that contains the value of an expression: real (arb) if only real arithmetic occurs."""
    with precision(bits):
        return _ball(expression)


def cotangent(turn: fmpq) -> arb:
    """Return a ball around the cotangent of pi * turn."""
    return arb.cos_pi_fmpq(turn) / arb.sin_pi_fmpq(turn)


def accurate(ball_at: Callable[[int], Ball], bits: int) -> Ball:
    """Increase the precision of `ball_at` until the ball has a radius below 2**-bits times its modulus."""
    working = bits + 16
    while working < _MOST:
        ball = ball_at(working)
        with precision(working):
            radius = ball.rad() if isinstance(ball, arb) else ball.real.rad() + ball.imag.rad()
            if radius == 0 or radius * arb(2) ** bits < abs(ball).lower():
                return ball
        working *= 2
    raise ValueError(f"a number stays within 2**-{bits} of zero at {_MOST} bits; write it as 0 if it is zero")


def nearest(ball_at: Callable[[int], Ball]) -> float | complex:
    """Return the value as a float, within 0.5001 units in the last place."""
    # For a complex value the error is relative to the modulus. Raises ValueError like `accurate`.
    ball = accurate(ball_at, 72)
    if isinstance(ball, arb):
        return float(ball.mid())
    return complex(_part(ball.real, ball, 72), _part(ball.imag, ball, 72))


def decimals(ball_at: Callable[[int], Ball], digits: int) -> sp.Expr:
    """Return the value as a SymPy Float of `digits` digits, correct to one unit of the last digit."""
    # A complex value is returned as real + imaginary * I. Raises ValueError like `accurate`.
    bits = int(3.33 * digits) + 12
    ball = accurate(ball_at, bits)
    with precision(2 * bits):
        if isinstance(ball, arb):
            return _decimal(ball, digits)
        real, imaginary = (_decimal(_part(x, ball, bits), digits) for x in (ball.real, ball.imag))
    return real + imaginary * sp.I


def disjoint(balls: Sequence[Ball]) -> bool:
    """Return whether no two balls overlap; sort by left ends, so that few pairs need a comparison."""
    ordered = sorted((acb(ball) for ball in balls), key=lambda ball: ball.real.lower())
    for i, ball in enumerate(ordered):
        end = ball.real.upper()
        for other in ordered[i + 1 :]:
            if other.real.lower() > end:
                break
            if other.overlaps(ball):
                return False
    return True


def _decimal(x: Ball, digits: int) -> sp.Float:
    return sp.Float(arb(x).mid().str(digits + 5, radius=False), digits)


def _part(part: arb, number: acb, bits: int) -> arb:
    """Return a real or imaginary part; 0 if the part is smaller than 2**-bits times the modulus."""
    with precision(2 * bits):
        return arb(0) if abs(part).upper() * arb(2) ** (bits - 4) < abs(number).lower() else part.mid()


def _ball(e: sp.Expr) -> Ball:
    """Evaluate an expression at the current precision of Arb."""
    if e.is_Rational:
        return arb(to_flint(e))
    if e is sp.pi:
        return arb.pi()
    if e is sp.I:
        return acb(0, 1)
    if isinstance(e, (sp.Add, sp.Mul)):
        total = _ball(e.args[0])
        for part in e.args[1:]:
            total = total + _ball(part) if isinstance(e, sp.Add) else total * _ball(part)
        return total
    if isinstance(e, sp.exp):
        # Pass rational multiples of π to Arb as rationals: π is not rounded.
        turn = e.args[0] / (sp.pi * sp.I)
        if turn.is_Rational:
            ratio = to_flint(turn)
            return acb(arb.cos_pi_fmpq(ratio), arb.sin_pi_fmpq(ratio))
        return _ball(e.args[0]).exp()
    if isinstance(e, sp.Pow) and e.exp.is_Rational:
        return _power(_ball(e.base), to_flint(e.exp))
    if isinstance(e, (sp.sin, sp.cos)):
        turn = e.args[0] / sp.pi
        if turn.is_Rational:
            ratio = to_flint(turn)
            return arb.sin_pi_fmpq(ratio) if isinstance(e, sp.sin) else arb.cos_pi_fmpq(ratio)
        inner = _ball(e.args[0])
        return inner.sin() if isinstance(e, sp.sin) else inner.cos()
    raise TypeError(f"{e} has no certified value; expected rationals, roots, pi, I, sin, cos and exp only")


def _power(base: Ball, exponent: fmpq) -> Ball:
    if exponent.q == 1:
        return base ** fmpz(exponent.p)
    if isinstance(base, arb) and base > 0:
        return base.sqrt() if exponent == fmpq(1, 2) else base ** arb(exponent)
    return acb(base) ** acb(exponent)
