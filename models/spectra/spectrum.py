"""The spectrum of a matrix, and its table as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import overload

import sympy as sp

from ..algebra.balls import precision
from ..algebra.lazy import LazyEigenvalues
from ..algebra.roots import Root, coefficient_text
from ..inputs.checks import check_instance
from ..inputs.display import HasLatex, HasPlot
from .eigenvalue import Eigenvalue, decimal

SHOWN = 24  # most eigenvalues in the text of a spectrum; of more, the text leaves out the middle


@dataclass(frozen=True, slots=True)
class Spectrum(HasLatex, HasPlot):
    """The distinct eigenvalues by decreasing real part, conjugates side by side.

    Parameters
    ----------
    eigenvalues : sequence of Eigenvalue
        A tuple; for large chains and rings a lazy sequence that computes an item when it is read.
    verified : bool, optional
        True if the product of (z - γ)^multiplicity was proved equal to the exact characteristic
        polynomial; False for the closed form of a large graph.
    error_probability : float, optional
        If the two polynomials were compared modulo large primes: the approximate probability that
        the comparison missed a difference.

    See Also
    --------
    synchain.graphs.Topology
    synchain.graphs.joint_spectrum

    Examples
    --------
    >>> import synchain as sc
    >>> spectrum = sc.graphs.star(6).spectrum
    >>> print(spectrum)
    {0: 1, -1: 4, -6: 1}
    >>> [(str(e.exact), e.multiplicity) for e in spectrum]
    [('0', 1), ('-1', 4), ('-6', 1)]
    """

    eigenvalues: Sequence[Eigenvalue]
    verified: bool = False
    error_probability: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.eigenvalues, LazyEigenvalues):
            for e in check_instance(
                "spectrum", self.eigenvalues, (tuple, list), "Eigenvalues; take the spectrum of a graph"
            ):
                check_instance("spectrum", e, Eigenvalue, "an Eigenvalue; take the spectrum of a graph")
        if not self.eigenvalues:
            raise ValueError("a spectrum without eigenvalues; expected at least one")

    @property
    def n(self) -> int:
        """Number of eigenvalues, counted with multiplicity."""
        if isinstance(self.eigenvalues, LazyEigenvalues):
            return self.eigenvalues.n
        return sum(self.multiplicities)

    def __len__(self) -> int:
        return len(self.eigenvalues)

    @overload
    def __getitem__(self, index: int) -> Eigenvalue: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Eigenvalue]: ...
    def __getitem__(self, index: int | slice) -> Eigenvalue | Sequence[Eigenvalue]:
        return self.eigenvalues[index]

    def __iter__(self) -> Iterator[Eigenvalue]:
        return iter(self.eigenvalues)

    @property
    def exact(self) -> tuple[sp.Expr, ...]:
        """The distinct eigenvalues as SymPy expressions."""
        return tuple(e.exact for e in self.eigenvalues)

    @property
    def values(self) -> tuple[float | complex, ...]:
        """The distinct eigenvalues as nearest floats; complex ones as complex numbers."""
        return tuple(e.value for e in self.eigenvalues)

    @property
    def multiplicities(self) -> tuple[int, ...]:
        """The algebraic multiplicity of each distinct eigenvalue."""
        return tuple(e.multiplicity for e in self.eigenvalues)

    @property
    def nonzero(self) -> tuple[Eigenvalue, ...]:
        """The eigenvalues other than 0: the transverse modes of a connected graph."""
        return tuple(e for e in self.eigenvalues if e.number is not sp.S.Zero)

    @property
    def defective(self) -> tuple[Eigenvalue, ...]:
        """The eigenvalues known to have fewer independent eigenvectors than their multiplicity."""
        if isinstance(self.eigenvalues, LazyEigenvalues):
            return ()
        return tuple(e for e in self.eigenvalues if e.defective)

    @property
    def zeros(self) -> int:
        """The multiplicity of 0."""
        if isinstance(self.eigenvalues, LazyEigenvalues):
            first: Eigenvalue = self.eigenvalues[0]  # 0 is the largest
            return first.multiplicity
        return sum(e.multiplicity for e in self.eigenvalues if e.number is sp.S.Zero)

    @property
    def largest(self) -> sp.Expr:
        """The eigenvalue of largest modulus; of several, the first in the order of the spectrum."""
        if isinstance(self.eigenvalues, LazyEigenvalues):  # all real, none positive
            return self.eigenvalues[-1].exact
        return _farthest(self.eigenvalues, 1)

    @property
    def slowest(self) -> sp.Expr:
        """The non-zero eigenvalue of smallest modulus, the first of several; ValueError if all are 0."""
        lazy = isinstance(self.eigenvalues, LazyEigenvalues)
        others = self.eigenvalues[1:2] if lazy else self.nonzero
        if not others:
            raise ValueError("all eigenvalues are 0; expected a graph with links")
        return others[0].exact if lazy else _farthest(others, -1)

    def evaluate(self, digits: int) -> tuple[sp.Expr, ...]:
        """Return SymPy Floats, each within one unit of the last of `digits` digits."""
        return tuple(e.evaluate(digits) for e in self.eigenvalues)

    def as_dict(self) -> dict[str, object]:
        """Return the dictionary that `synchain spectrum --json` prints; a complex value is [real, imaginary].

        Each polynomial is written once.  A root refers to its polynomial by number, and has the index of CRootOf.
        """
        polynomial_index: dict[tuple[int, ...], int] = {}
        listed = []
        for e in self.eigenvalues:
            number, index, exact = None, None, None
            if isinstance(e.number, Root):
                number, index = polynomial_index.setdefault(e.number.polynomial, len(polynomial_index)), e.number.index
                exact = f"CRootOf(p{number}, {index})"
            listed.append(
                {
                    "exact": exact or e.text,
                    "polynomial": number,
                    "index": index,
                    "value": [e.value.real, e.value.imag] if isinstance(e.value, complex) else e.value,
                    "multiplicity": e.multiplicity,
                    "geometric_multiplicity": e.geometric,
                    "jordan_blocks": None if e.blocks is None else [list(block) for block in e.blocks],
                }
            )
        polynomials = [[coefficient_text(c) for c in polynomial] for polynomial in polynomial_index]
        return {
            "n": self.n,
            "polynomials": polynomials,
            "eigenvalues": listed,
            "verified": self.verified,
            "chance": self.error_probability,
        }

    def text(self, limit: int) -> str:
        """Return text such as {0: 1, -2: 3}; of more than `limit` eigenvalues leave out the middle."""
        many = len(self) > limit
        shown = [f"{e}: {e.multiplicity}" for e in (self.eigenvalues[: limit - 1] if many else self.eigenvalues)]
        last = [f"… ({len(self) - limit} more)", f"{self[-1]}: {self[-1].multiplicity}"] if many else []
        return "{" + ", ".join(shown + last) + "}"

    def __repr__(self) -> str:
        return self.text(SHOWN)


def _farthest(eigenvalues: Sequence[Eigenvalue], way: int) -> sp.Expr:
    """Return the first eigenvalue of largest modulus (smallest if `way` is -1), compared to 1024 bits."""
    top = max(way * abs(e.value) for e in eigenvalues)
    bound = top - 1e-12 * abs(top)
    best, bits = [e for e in eigenvalues if not way * abs(e.value) < bound], 64  # all, if floats overflow
    while len(best) > 1 and bits <= 1024:
        with precision(bits + 64):
            sizes = [way * abs(e.enclosure(bits)) for e in best]
            first = reduce(lambda a, b: b if b > a else a, sizes)
            best = [e for e, size in zip(best, sizes, strict=True) if not size < first]
        bits *= 4
    return best[0].exact


def table(spectrum: Spectrum, limit: int | None = None) -> str:
    """Write a spectrum as a table; long polynomials are abbreviated."""
    head = ("exact", "decimal", "multiplicity")
    many = limit is not None and len(spectrum) > limit
    half = (limit or 0) // 2
    shown = [*spectrum[:half], *spectrum[len(spectrum) - half :]] if many else list(spectrum.eigenvalues)
    lines = [(_short(e), decimal(e.value), str(e.multiplicity)) for e in shown]
    wide = [max(len(line[k]) for line in (head, *lines)) for k in range(3)]
    rows = [f"{a:<{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}" for a, b, c in (head, *lines)]
    if spectrum.defective:
        block_texts = ("Jordan blocks", *(_blocks(e) for e in shown))
        rows = [f"{row}  {word}" for row, word in zip(rows, block_texts, strict=True)]
    if many:
        rows.insert(half + 1, f"… ({len(spectrum) - 2 * half} more)")
    state = "proved" if spectrum.verified else "not proved (closed form of a large graph)"
    if spectrum.error_probability is not None:
        chance = f"{spectrum.error_probability:.0e}"
        state = f"the same modulo three large primes (a difference would show but for a chance of {chance})"
    rows.append(f"{spectrum.n} eigenvalues, {len(spectrum)} distinct; characteristic polynomial: {state}")
    if spectrum.defective:
        rows.append(
            "defective: of a block of size s, errors go as t^(s-1) exp(lambda t), lambda the exponent of its mode"
        )
    return "\n".join(rows)


def _blocks(e: Eigenvalue) -> str:
    """Write the sizes of Jordan blocks, such as "3, 1 (2 times)"."""
    if e.blocks is None:
        return "not computed"
    return ", ".join(f"{size}" if times == 1 else f"{size} ({times} times)" for size, times in e.blocks)


def _short(e: Eigenvalue) -> str:
    if len(e.text) <= 60 or not isinstance(e.number, Root):
        return e.text
    return f"root {e.number.index} of a polynomial of degree {len(e.number.polynomial) - 1}"
