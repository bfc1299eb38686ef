"""Units of physical quantities as powers of mass, length and time."""

from __future__ import annotations

__all__ = ["Dimension", "dimension"]

Dimension = tuple[int, int, int]
"""Powers of (kg, m, s)."""

UNITS: dict[str, Dimension] = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
}


def dimension(unit: str) -> Dimension:
    """Return the powers of (kg, m, s) in a unit such as ``N/m``, ``kg*m/s^2`` or ``1``.

    Raises ValueError on a name outside kg, m, s, N, rad, 1 and on a power that is not an integer, TypeError on no text.
    """
    if not isinstance(unit, str):
        raise TypeError(f"unit {unit!r} is a {type(unit).__name__}; expected text such as 'N/m' or '1'")
    total = [0, 0, 0]
    sign, rest = 1, unit.replace(" ", "")
    while True:
        cut = min((i for i in (rest.find("*"), rest.find("/")) if i >= 0), default=len(rest))
        name, raised, power = rest[:cut].partition("^")
        power = power if raised else "1"
        if name not in UNITS or not _is_integer(power):
            raise ValueError(
                f"unit {unit!r}: cannot read {rest[:cut]!r}; expected products and quotients of "
                f"{', '.join(UNITS)} with integer powers, such as 'N/m' or 'kg*m/s^2'"
            )
        for k, exponent in enumerate(UNITS[name]):
            total[k] += sign * int(power) * exponent
        if cut == len(rest):
            return (total[0], total[1], total[2])
        sign, rest = (1 if rest[cut] == "*" else -1), rest[cut + 1 :]


def _is_integer(text: str) -> bool:
    return text.removeprefix("-").isascii() and text.removeprefix("-").isdigit()
