"""Initial states of oscillators: given numbers, reproducible random numbers, or the default."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any

from ..inputs.checks import check_integer, check_keys, check_number, check_table, first_of, is_row, short_repr
from ..inputs.frozen import FrozenDict

SEED_LIMIT = 2**63 - 1  # largest seed: the largest signed integer of 64 bits, which netCDF and JSON readers keep


def default_start(
    components: tuple[str, ...], n: int, centre: Mapping[Any, float] | None = None
) -> dict[str, tuple[float, ...]]:
    """Return the default initial states: the first component differs between oscillators, the others are 0."""
    # Up to four oscillators start at 0.30, 0.28, 0.26, 0.24. The first two values are from the source paper (Marszal et
    # al., Eur. Phys. J. Special Topics, 2016); the others continue the sequence. More oscillators are spread evenly
    # over 0.30 … 0.24, so that the initial spread does not grow with the network. Around a `centre` the same distances
    # are parts of its first component, or of its largest one if the first is 0. Raises ValueError if `centre` has an
    # unknown component.
    if centre is None:
        if n <= 4:
            first = tuple((30 - 2 * i) / 100 for i in range(n))
        else:
            first = tuple((30 * (n - 1) - 6 * i) / (100 * (n - 1)) for i in range(n))
        return {name: first if k == 0 else (0.0,) * n for k, name in enumerate(components)}
    check_keys("INITIAL of the oscillator", centre, components)
    middle = {name: check_number(f"INITIAL of the oscillator: {name}", centre.get(name, 0.0)) for name in components}
    # 0.02 from one oscillator to the next, 0.06 over all at most, in a unit that changes with that of the states
    width, unit = min(2 * (n - 1), 6), abs(middle[components[0]]) or max(map(abs, middle.values())) or 1.0
    first = tuple(unit * width * (n - 1 - 2 * i) / (200 * (n - 1)) for i in range(n)) if n > 1 else (0.0,)
    return {
        name: tuple(x + distance for distance in (first if k == 0 else (0.0,) * n))
        for k, (name, x) in enumerate(middle.items())
    }


def chosen_start(value: object, defaults: Mapping[str, tuple[float, ...]], rng: int) -> FrozenDict[tuple[float, ...]]:
    """Return {component: floats} from a table of some or all components; other components are taken from `defaults`."""
    table = check_table("initial", {} if value is None else value)
    check_keys("initial", table, tuple(defaults))
    states = dict(defaults)
    for name, values in defaults.items():
        if name in table:
            states[name] = _component(f"initial {name}", table[name], name, len(values), rng)
    return FrozenDict(states)


def _component(what: str, value: object, name: str, n: int, rng: int) -> tuple[float, ...]:
    """Return the states of one component from a random range, one number for all nodes, or one number for each."""
    if isinstance(value, Mapping):
        check_keys(what, value, ("low", "high", "rng"))
        for key in ("low", "high"):
            if key not in value:
                raise ValueError(
                    f"{what}: {key!r} is missing in {short_repr(dict(value))}; expected {{low, high}} or {{low, high, rng}}"
                )
        low, high = check_number(f"{what}: low", value["low"]), check_number(f"{what}: high", value["high"])
        if low > high:
            raise ValueError(f"{what}: low = {low!r} is above high = {high!r}; expected low <= high; swap them")
        if "rng" in value:
            rng = check_integer(f"{what}: rng", value["rng"], 0, SEED_LIMIT)
        stream = random.Random(f"{rng} {name}")  # one for each component: x and v of one seed are independent
        shares = (stream.random() for _ in range(n))
        return tuple((1.0 - share) * low + share * high for share in shares)
    listed = value.tolist() if hasattr(value, "tolist") else value
    if not is_row(listed):
        return (check_number(what, listed),) * n
    if isinstance(listed, (set, frozenset)):
        raise TypeError(f"{what}: found {short_repr(listed)}; expected a number, {n} numbers or {{low, high, rng}}")
    listed, count = first_of(listed, n)
    if len(listed) != n:
        raise ValueError(f"{what}: found {count} values for {n} oscillators; expected {n} values or one number for all")
    return tuple(check_number(f"{what}_{i + 1}", entry) for i, entry in enumerate(listed))
