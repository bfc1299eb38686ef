"""Where the oscillators start: given numbers, reproducible random numbers, or the default."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any

from ..inputs.checks import check_integer, check_keys, check_number, check_table, first_of, is_row, short_repr
from ..inputs.frozen import FrozenDict

SEED_LIMIT = 2**63 - 1


def default_start(
    components: tuple[str, ...], n: int, centre: Mapping[Any, float] | None = None
) -> dict[str, tuple[float, ...]]:
    """Return the default initial states: the first component differs between oscillators, the rest is 0.

    Up to four oscillators start at 0.30, 0.28, 0.26, 0.24: the first two are those of the source paper
    (Marszal et al., Eur. Phys. J. Special Topics, 2016), the others continue them.  More are spread evenly
    over the same range, 0.30 … 0.24, so that the initial spread does not grow with the network.
    With a `centre` the same distances lie around that state.  Raises ValueError if it has an unknown component.
    """
    if centre is not None:
        check_keys("INITIAL of the oscillator", centre, components)
        middle = {
            name: check_number(f"INITIAL of the oscillator: {name}", centre.get(name, 0.0)) for name in components
        }
        return {name: tuple(x + d for d in _distances(n, k)) for k, (name, x) in enumerate(middle.items())}
    if n <= 4:
        first = tuple((30 - 2 * i) / 100 for i in range(n))
    else:
        first = tuple((30 * (n - 1) - 6 * i) / (100 * (n - 1)) for i in range(n))
    return {name: first if k == 0 else (0.0,) * n for k, name in enumerate(components)}


def _distances(n: int, k: int) -> tuple[float, ...]:
    """How far component k of each oscillator starts from the centre: 0.02 from one to the next, 0.06 over all at most."""
    if k > 0 or n == 1:
        return (0.0,) * n
    width = min(2 * (n - 1), 6)
    return tuple(width * (n - 1 - 2 * i) / (200 * (n - 1)) for i in range(n))


def chosen_start(given: object, defaults: Mapping[str, tuple[float, ...]], seed: int) -> FrozenDict[tuple[float, ...]]:
    """Return {component: floats} from what the user gave for some or all components, the rest as in `defaults`."""
    found = check_table("initial", {} if given is None else given)
    check_keys("initial", found, tuple(defaults))
    states = dict(defaults)
    for name, values in defaults.items():
        if name in found:
            states[name] = _component(f"initial {name}", found[name], name, len(values), seed)
    return FrozenDict(states)


def _component(what: str, value: object, name: str, n: int, seed: int) -> tuple[float, ...]:
    if isinstance(value, Mapping):
        return _uniform(what, value, name, n, seed)
    listed = value.tolist() if hasattr(value, "tolist") else value
    if not is_row(listed):
        return (check_number(what, listed),) * n
    if isinstance(listed, (set, frozenset)):
        raise TypeError(f"{what}: found {short_repr(listed)}; expected a number, {n} numbers or {{low, high, seed}}")
    listed, count = first_of(listed, n)
    if len(listed) != n:
        raise ValueError(f"{what}: found {count} values for {n} oscillators; expected {n} values or one number for all")
    return tuple(check_number(f"{what}_{i + 1}", entry) for i, entry in enumerate(listed))


def _uniform(what: str, given: Mapping[object, object], name: str, n: int, seed: int) -> tuple[float, ...]:
    check_keys(what, given, ("low", "high", "seed"))
    for key in ("low", "high"):
        if key not in given:
            found = short_repr(dict(given))
            raise ValueError(f"{what}: {key!r} is missing in {found}; expected {{low, high}} or {{low, high, seed}}")
    low, high = check_number(f"{what}: low", given["low"]), check_number(f"{what}: high", given["high"])
    if low > high:
        raise ValueError(f"{what}: low = {low!r} is above high = {high!r}; expected low <= high; swap them")
    own = check_integer(f"{what}: seed", given["seed"], 0, SEED_LIMIT) if "seed" in given else seed
    stream = random.Random(f"{own} {name}")  # its own stream: x and v of one seed are independent
    shares = (stream.random() for _ in range(n))
    return tuple((1.0 - share) * low + share * high for share in shares)
