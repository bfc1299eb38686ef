"""Values on the command line, read strictly: whole numbers, finite numbers, grids and settings.

Readers of values import the models when they are called, so that `synchain --help` does not.
"""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace

from .outcome import WrongUse

NODES = 100_000  # largest number of oscillators on the command line (a choice)


# Endings of files, which no folder has.
FILES = (".csv", ".html", ".json", ".nc", ".nc4", ".pdf", ".png", ".svg", ".toml", ".txt", ".zarr")


def whole(text: str, least: int = -NODES, most: int = NODES) -> int:
    """Read a whole number from `least` to `most`."""
    from synchain.models.inputs.options import integer_option

    try:
        return integer_option("number", text, least, most)
    except (TypeError, ValueError) as error:
        raise ArgumentTypeError(str(error)) from None


def positive(text: str, most: int = NODES) -> int:
    return whole(text, 1, most)


def folder(text: str) -> str:
    """Read the name of a folder, which may not exist yet."""
    from synchain.models.inputs.checks import short_repr

    if not text.strip():
        raise ArgumentTypeError("found an empty name; expected a folder, e.g. results")
    if text.endswith(FILES):
        raise ArgumentTypeError(f"found {short_repr(text)}, the name of a file; expected a folder, e.g. results")
    return text


def number(text: str) -> float:
    """Read a finite number, or a constant such as 2*pi/5, of at most MAGNITUDE in size."""
    from synchain.models.inputs.arithmetic import MAGNITUDE, constant
    from synchain.models.inputs.checks import short_repr

    try:
        return constant(text)
    except ValueError:
        raise ArgumentTypeError(
            f"found {short_repr(text)}; expected a finite number of at most {MAGNITUDE:g} in size, e.g. 1.15 or 2*pi/5"
        ) from None


def above_zero(text: str) -> float:
    value = number(text)
    if not value > 0:
        raise ArgumentTypeError(f"found {text}; expected a number above 0")
    return value


def at_least_zero(text: str) -> float:
    value = number(text)
    if not value >= 0:
        raise ArgumentTypeError(f"found {text}; expected a number of at least 0")
    return value


def periods(text: str) -> float:
    value = above_zero(text)
    if not value.is_integer():
        raise ArgumentTypeError(f"found {text}; expected a whole number of periods")
    return value


def tolerance(text: str) -> float:
    """Read a relative tolerance, above 0 and at most 0.1."""
    value = number(text)
    if not 0 < value <= 0.1:
        raise ArgumentTypeError(f"found {text}; expected a number above 0 and at most 0.1, e.g. 1e-8")
    return value


def span(text: str) -> dict[str, object]:
    """Read LO:HI:N as the table from, to and count of an axis, without its values."""
    from synchain.models.inputs.checks import short_repr
    from synchain.models.sweeps.axis import LIMIT as AXIS_LIMIT

    parts = text.split(":")
    if len(parts) != 3:
        raise ArgumentTypeError(f"found {short_repr(text)}; expected LO:HI:N, e.g. 0:0.6:241")
    low, high, count = number(parts[0]), number(parts[1]), positive(parts[2], AXIS_LIMIT)
    if count < 2 or not low < high:
        raise ArgumentTypeError(f"found {short_repr(text)}; expected LO below HI and at least 2 values")
    return {"from": low, "to": high, "count": count}


def spaced(text: str) -> tuple[float, ...]:
    """Read LO:HI:N as N equally spaced numbers."""
    from synchain.models.sweeps.axis import Axis

    return Axis.from_table("grid", span(text)).values


def times(text: str) -> tuple[float, ...]:
    """Read a,b,c or LO:HI:N as numbers."""
    return spaced(text) if ":" in text else tuple(number(part) for part in text.split(","))


def setting(text: str) -> tuple[str, float | tuple[float, ...] | dict[str, object]]:
    """Read name=value, name=a,b,c or name=LO:HI:N."""
    from synchain.models.inputs.checks import short_repr

    name, equals, value = text.partition("=")
    if not (name.isidentifier() and equals and value):
        raise ArgumentTypeError(
            f"found {short_repr(text)}; expected name=value, name=a,b,c or name=LO:HI:N, after SCENE"
        )
    if ":" in value:
        return name, span(value)
    if "," in value:
        return name, tuple(number(part) for part in value.split(","))
    return name, number(value)


def settings(arguments: Namespace) -> dict[str, float | tuple[float, ...] | dict[str, object]]:
    """Return the names and values of --set; raise WrongUse if one is given twice."""
    values: dict[str, float | tuple[float, ...] | dict[str, object]] = {}
    for name, value in arguments.set:
        if name in values:
            raise WrongUse(f"--set gives {name} twice; expected it once")
        values[name] = value
    return values


def part(text: str) -> tuple[int, int]:
    """Read K/N, part K of N."""
    from synchain.models.inputs.checks import short_repr

    k, slash, parts = text.partition("/")
    if not slash:
        raise ArgumentTypeError(f"found {short_repr(text)}; expected K/N, e.g. 3/8")
    most = positive(parts)
    return whole(k, 1, most), most


def add_set(parser: ArgumentParser, text: str) -> None:
    parser.add_argument("--set", metavar="NAME=VALUE", nargs="+", action="extend", type=setting, default=[], help=text)


def add_scene(parser: ArgumentParser, default: str = "") -> None:
    """Add the argument SCENE; it may be left out if there is a default."""
    text = "a shipped name (see: synchain list scenes) or a path to a .toml file"
    if default:
        parser.add_argument("scene", metavar="SCENE", nargs="?", help=f"{text} (default: {default})")
    else:
        parser.add_argument("scene", metavar="SCENE", help=text)
    add_allow_code(parser)


def add_allow_code(parser: ArgumentParser) -> None:
    """Add the option --allow-code, which `synchain.runtime.cli` applies before the command runs."""
    parser.add_argument(
        "--allow-code",
        metavar="FILE",
        action="append",
        default=[],
        help="let the scene name this .py file as a part of its own, e.g. friction = './my_law.py'; the file is run",
    )


def add_workers(parser: ArgumentParser) -> None:
    parser.add_argument("--workers", metavar="N", type=positive, help="number of threads (default: all cores)")
