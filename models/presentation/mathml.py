"""The LaTeX that this package writes, as MathML, which browsers show without help from a network."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from html import escape

from sympy.printing.pretty.pretty_symbology import greek_unicode

from ..dynamics.equations import Equations
from .equations_text import lines
from .writer import LATEX_FUNCTIONS, VARIANTS, Latex

TOKENS = re.compile(r"\\[A-Za-z]+|\\.|\d+(?:\.\d+)?|[A-Za-z]|\s+|.", re.DOTALL)

SIGNS = {
    "\\cdot": "·",
    "\\dots": "…",
    "\\geq": "≥",
    "\\infty": "∞",
    "\\leq": "≤",
    "\\ne": "≠",
    "\\neq": "≠",
    "\\sum": "∑",
    "\\wedge": "∧",
    "\\vee": "∨",
    "\\lfloor": "⌊",
    "\\rfloor": "⌋",
    "\\{": "{",
    "\\}": "}",
    "-": "−",
}
"""Operators that are not written as they stand."""

SPACES = ("\\left", "\\right", "\\:", "\\,", "\\;", "\\ ", "\\quad", "&")
"""What MathML spaces by itself."""

NO_BREAK = "\u00a0"
"""The space that stands at the ends of words too."""

GAP = '<mspace width="0.14em"/>'
"""What sets names of several letters apart from their neighbours in a product."""

LETTERS = {
    **{f"\\{name}": letter for name, letter in greek_unicode.items()},
    **{latex: letter for latex, letter in VARIANTS.values()},
}


def formula(latex: str, display: bool = False) -> str:
    """Return a formula in this package's LaTeX as a MathML element that keeps the LaTeX beside it."""
    style = ' display="block"' if display else ""
    source = f'<annotation encoding="application/x-tex">{escape(latex)}</annotation>'
    return f"<math{style}><semantics>{_TokenReader(TOKENS.findall(latex)).row()}{source}</semantics></math>"


def mathml(equations: Equations) -> str:
    """Return the equations as MathML: one formula for each line of `latex`."""
    return "\n".join(formula(line, display=True) for line in lines(equations, Latex()))


@dataclass(slots=True)
class _TokenReader:
    """Reads tokens of LaTeX from left to right."""

    tokens: list[str]
    at: int = 0
    commands: dict[str, Callable[[], str]] = field(init=False)

    def __post_init__(self) -> None:
        self.commands = {
            "{": lambda: self.row("}"),
            "\\frac": lambda: f"<mfrac>{self.atom()}{self.atom()}</mfrac>",
            "\\sqrt": lambda: f"<msqrt>{self.atom()}</msqrt>",
            "\\mathrm": lambda: f'<mi mathvariant="normal">{self.words()}</mi>',
            "\\operatorname": lambda: _function(self.words()),
            "\\text": lambda: f"<mtext>{self.words().replace(' ', NO_BREAK)}</mtext>",
            "\\begin": self.cases,
            **{f"\\{name}": partial(_function, name) for name in LATEX_FUNCTIONS},
        }

    def row(self, end: str = "") -> str:
        """All up to a token, or to the end."""
        found = []
        while self.at < len(self.tokens) and self.tokens[self.at] != end:
            found.append(self.scripted())
        self.at += 1
        return f"<mrow>{''.join(found)}</mrow>"

    def scripted(self) -> str:
        """An atom with what stands below and above it."""
        gap = GAP if self.tokens[self.at] == "\\mathrm" else ""
        made = self.raised()
        return f"<mrow>{gap}{made}{gap}</mrow>" if gap else made

    def raised(self) -> str:
        """An atom with its index, its primes and its exponent."""
        base, below, above, primes = self.atom(), "", "", ""
        while self.at < len(self.tokens) and self.tokens[self.at] in ("_", "^", "'"):
            token = self.tokens[self.at]
            self.at += 1
            if token == "_":
                below = self.atom()
            elif token == "^":
                above += self.atom()
            else:
                primes += "′"
        if primes:
            base = f"<msub>{base}{below}</msub>" if below else base
            base, below = f'<mrow>{base}<mo lspace="0" rspace="0">{primes}</mo></mrow>', ""
        if below and above:
            return f"<msubsup>{base}{below}{above}</msubsup>"
        return f"<msub>{base}{below}</msub>" if below else f"<msup>{base}{above}</msup>" if above else base

    def atom(self) -> str:
        """A group, a command, a number, a letter or an operator."""
        token = self.tokens[self.at]
        self.at += 1
        if token in self.commands:
            return self.commands[token]()
        if token.isspace() or token in SPACES:
            return ""
        if token in LETTERS or (len(token) == 1 and token.isalpha()):
            return f"<mi>{LETTERS.get(token, token)}</mi>"
        if token[0].isdigit():
            return f"<mn>{token}</mn>"
        if token.startswith("\\") and token not in SIGNS:
            raise ValueError(f"formula: found {token}; expected LaTeX as this package writes it")
        return f"<mo{self.form(token)}>{escape(SIGNS.get(token, token))}</mo>"

    def form(self, token: str) -> str:
        """The attributes of an operator: signs stand close to what follows, fences keep their size."""
        before = next((t for t in reversed(self.tokens[: self.at - 1]) if not t.isspace()), "=")
        if token in "+-" and before in ("=", "(", "{", "|", ",", "&"):
            return ' form="prefix"'
        if token == "|":
            return ' stretchy="false" lspace="0" rspace="0"'
        return ' stretchy="false"' if token in "()[]" else ""

    def words(self) -> str:
        """The text of a group, as it is."""
        self.at += 1
        start, depth = self.at, 1
        while depth:
            depth += {"{": 1, "}": -1}.get(self.tokens[self.at], 0)
            self.at += 1
        return escape("".join(self.tokens[start : self.at - 1]))

    def cases(self) -> str:
        """Cases with their conditions."""
        name = self.words()
        if name != "cases":
            raise ValueError(f"formula: found \\begin{{{name}}}; expected \\begin{{cases}}")
        rows: list[list[str]] = []
        cells: list[str] = []
        found: list[str] = []
        while self.tokens[self.at] != "\\end":
            token = self.tokens[self.at]
            if token in ("&", "\\\\"):
                self.at += 1
                cells.append("".join(found))
                found = []
                if token == "\\\\":
                    rows.append(cells)
                    cells = []
                continue
            found.append(self.scripted())
        self.at += 1
        self.words()
        rows.append([*cells, "".join(found)])
        made = "".join(f"<mtr>{''.join(f'<mtd>{cell}</mtd>' for cell in row)}</mtr>" for row in rows)
        return f'<mrow><mo>{{</mo><mtable columnalign="left">{made}</mtable></mrow>'


def _function(name: str) -> str:
    """The name of a function, a little apart from what stands before it."""
    return f'<mrow>{GAP}<mi mathvariant="normal">{name}</mi></mrow>'
