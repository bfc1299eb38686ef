"""Names that C99, Python and Numba all accept for the symbols of a model."""

from __future__ import annotations

import builtins
import keyword
import re
import unicodedata
from functools import partial

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Edge

from ..program.passes import real

_C = """auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while asm typeof bool true
false main NULL EOF errno INFINITY NAN HUGE_VAL HUGE_VALF HUGE_VALL OVERFLOW UNDERFLOW DOMAIN SING PLOSS TLOSS linux unix
i386 vax sun alignas alignof catch char16_t char32_t constexpr decltype delete dynamic_cast explicit export friend
mutable namespace new noexcept nullptr operator private protected public static_assert template this thread_local throw
typeid typename using virtual wchar_t and_eq bitand bitor compl not_eq or_eq xor xor_eq near far"""
_MATH = """acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 exp10 expm1 fabs fdim floor
fma fmax fmin fmod frexp gamma hypot ilogb ldexp lgamma llrint llround log log10 log1p log2 logb lrint lround modf nan
nearbyint nextafter nexttoward pow pow10 remainder remquo rint round scalb scalbln scalbn significand sin sinh sqrt tan tanh
tgamma trunc drem finite isinf isnan isfinite isnormal signbit fpclassify signgam j0 j1 jn y0 y1 yn float_t double_t"""
_OWN = """np math types cfunc carray csc_matrix lsoda_sig address rhs jac jacobian jacobian_places sparsity state rates
numbers matrix mass_ solve right_ values sign i_ j_ k_ link_ weight_ NODES DIMENSION PARAMETERS LINKS ENTRIES TARGET SOURCE
WEIGHT NUMBER ROWS COLUMNS STATE NODE HEAVY defaults memset
rows_"""
# Names used by the languages, their mathematical libraries or the exported text; a symbol of this name is renamed.
RESERVED = {*f"{_C} {_MATH} {_OWN}".split(), *keyword.kwlist, *keyword.softkwlist, *dir(builtins)}
_MACRO = re.compile(r"(M|FP|MATH)_\w+")  # matches macros of C's mathematical library
_LATER = re.compile(r"w[0-9]+|rate_[ij][0-9]+|mass_[0-9]+_")  # matches numbered names of the exported text


def portable(equations: Equations) -> tuple[Equations, dict[str, str]]:
    """Return the equations with names that every exported language accepts, and the map of changed names."""
    symbols = dict.fromkeys(s for node in equations.nodes for s in (*node.state, *node.parameters))
    taken = {s.name for s in symbols if _accepted(s.name)} | {"t"}
    of_nodes = {s: _renamed(s, taken) for s in symbols}
    changed = {s.name: new.name for s, new in of_nodes.items() if s.name != new.name}
    # links: parameters shared with nodes or other links keep their names; states and weight get free names
    shared = dict(of_nodes)
    edges: dict[Edge, Edge] = {}
    for edge in equations.edges:
        for s in edge.parameters:
            if s not in shared:
                free = s.name not in taken and _accepted(s.name)
                shared[s] = real(s.name) if free else _renamed(s, taken, True)
                taken.add(shared[s].name)
                if shared[s].name != s.name:
                    changed[s.name] = shared[s].name
        swap = {s: shared[s] for s in edge.parameters}
        for s in (s for end in edge.end_states for s in end):
            swap[s] = _renamed(s, taken, s.name in taken)
            taken.add(swap[s].name)
        swap[edge.weight] = real("weight_")
        edges[edge] = edge.map(partial(_replaced, swap))
    renamed = equations.map_templates(
        lambda node: node.map(partial(_replaced, of_nodes)), lambda edge: edges.get(edge, edge), shared
    )
    return renamed, changed


def _replaced(swap: dict[sp.Symbol, sp.Symbol], e: sp.Expr) -> sp.Expr:
    return e.xreplace(swap)


def _accepted(name: str) -> bool:
    """Return True for a name that no language, library or exported text uses."""
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) is not None and "__" not in name
    return plain and name not in RESERVED and not _MACRO.fullmatch(name) and not _LATER.fullmatch(name)


def _renamed(s: sp.Symbol, taken: set[str], occupied: bool = False) -> sp.Symbol:
    """Return the symbol if its name is accepted and free, else a symbol with a similar name."""
    if _accepted(s.name) and not occupied:
        return real(s.name)
    # allow letters, digits and single underscores, with a letter first; then append numbers until the name is free
    name = re.sub("_+", "_", "".join(map(_ascii, unicodedata.normalize("NFKC", s.name)))).strip("_") or "symbol"
    name = name if name[0].isalpha() else f"s_{name}"
    base, number = name if _accepted(name) else f"{name}_", 2
    name = base
    while name in taken or not _accepted(name):
        name, number = f"{base.rstrip('_')}_{number}", number + 1
    taken.add(name)
    return real(name)


def _ascii(letter: str) -> str:
    """Return a character that C allows: the name of a Greek letter, an underscore for any other character."""
    if letter.isascii():
        return letter if letter.isalnum() else "_"
    parts = unicodedata.name(letter, "").split()
    greek = parts[:1] == ["GREEK"] and "LETTER" in parts
    return parts[parts.index("LETTER") + 1].lower() if greek else "_"
