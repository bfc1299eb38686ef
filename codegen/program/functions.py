"""List the functions that expressions may call, with their names in each language."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

# Names in programs of SymPy's functions. A square root is a power in SymPy, and the function "sqrt" in programs.
FUNCTIONS: dict[type, str] = {
    sp.exp: "exp", sp.log: "log", sp.sin: "sin", sp.cos: "cos", sp.tan: "tan", sp.sinh: "sinh", sp.cosh: "cosh",
    sp.tanh: "tanh", sp.asin: "asin", sp.acos: "acos", sp.atan: "atan", sp.asinh: "asinh", sp.acosh: "acosh",
    sp.atanh: "atanh", sp.atan2: "atan2", sp.floor: "floor", sp.ceiling: "ceiling", sp.Abs: "absolute",
    sp.sign: "sign", sp.Max: "maximum", sp.Min: "minimum", sp.erf: "erf",
}  # fmt: skip

NAMES = (*FUNCTIONS.values(), "sqrt")


def _named(prefix: str, **others: str) -> Mapping[str, str]:
    return {name: others.get(name, prefix + name) for name in NAMES}


LANES = _named("")  # the functions on lanes
# The functions of math.h, and `sign`, which the exported text defines.
C99 = _named("", absolute="fabs", maximum="fmax", minimum="fmin", ceiling="ceil")

# The functions of NumPy, and SciPy's `erf`.
NUMPY = _named("np.", asin="np.arcsin", acos="np.arccos", atan="np.arctan", asinh="np.arcsinh", acosh="np.arccosh",
               atanh="np.arctanh", atan2="np.arctan2", absolute="np.abs", ceiling="np.ceil", erf="erf")  # fmt: skip

# The functions of Python's module `math` that Numba compiles.
MATH = _named("math.", absolute="abs", sign="np.sign", maximum="max", minimum="min", ceiling="math.ceil")
