"""Convert the LaTeX that this package writes to MathML, which browsers display without a network connection."""

# Why no library: reports and notebooks need this at run time, and latex2mathml 3.81, a dependency of the
# documentation only, writes \mathrm{end} as three separate letters, sets \chi'' as a power of a power, keeps no
# LaTeX beside the formula, and brings 411 kB of tables.

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

# Operator in LaTeX -> character in MathML.
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

# Tokens without an element in MathML, which spaces operators itself.
SPACES = ("\\left", "\\right", "\\:", "\\,", "\\;", "\\ ", "\\quad", "&")
NO_BREAK = "\u00a0"  # a space that browsers keep even at the ends of a text
GAP = '<mspace width="0.14em"/>'  # the space around a name of several letters in a product; its width is a choice

LETTERS = {
    **{f"\\{name}": letter for name, letter in greek_unicode.items()},
    **{latex: letter for latex, letter in VARIANTS.values()},
}


def formula(latex: str, display: bool = False) -> str:
    """Convert a formula of this package's LaTeX to a MathML element with the LaTeX as annotation."""
    style = ' display="block"' if display else ""
    source = f'<annotation encoding="application/x-tex">{escape(latex)}</annotation>'
    return f"<math{style}><semantics>{_TokenReader(TOKENS.findall(latex)).row()}{source}</semantics></math>"


def mathml(equations: Equations) -> str:
    """Return the equations as MathML: one formula for each line of `latex`."""
    return "\n".join(formula(line, display=True) for line in lines(equations, Latex()))


@dataclass(slots=True)
class _TokenReader:
    """Parser of LaTeX tokens; each method reads tokens from `at`, advances `at` and returns an element."""

    tokens: list[str]
    at: int = 0
    commands: dict[str, Callable[[], str]] = field(init=False)

    def __post_init__(self) -> None:
        self.commands = {
            "{": lambda: self.row("}"),
            "\\frac": lambda: f"<mfrac>{self.atom()}{self.atom()}</mfrac>",
            "\\sqrt": lambda: f"<msqrt>{self.atom()}</msqrt>",
            "\\mathrm": lambda: f'<mi mathvariant="normal">{self.group_text()}</mi>',
            "\\operatorname": lambda: _function(self.group_text()),
            "\\text": lambda: f"<mtext>{self.group_text().replace(' ', NO_BREAK)}</mtext>",
            "\\begin": self.cases,
            **{f"\\{name}": partial(_function, name) for name in LATEX_FUNCTIONS},
        }

    def row(self, end: str = "") -> str:
        """Read a row of elements up to the token `end`, or up to the last token."""
        elements = []
        while self.at < len(self.tokens) and self.tokens[self.at] != end:
            elements.append(self.scripted())
        self.at += 1
        return f"<mrow>{''.join(elements)}</mrow>"

    def scripted(self) -> str:
        """Read an atom with index, primes and exponent; add gaps on both sides of a word."""
        gap = GAP if self.tokens[self.at] == "\\mathrm" else ""
        element, below, above, primes = self.atom(), "", "", ""
        while self.at < len(self.tokens) and self.tokens[self.at] in ("_", "^", "'"):
            token = self.tokens[self.at]
            self.at += 1
            if token == "_":
                below = self.atom()
            elif token == "^":
                above += self.atom()
            else:
                primes += "′"
        if primes:  # primes follow the index: (χ₁)″
            element = f"<msub>{element}{below}</msub>" if below else element
            element, below = f'<mrow>{element}<mo lspace="0" rspace="0">{primes}</mo></mrow>', ""
        if below and above:
            element = f"<msubsup>{element}{below}{above}</msubsup>"
        elif below or above:
            element = f"<msub>{element}{below}</msub>" if below else f"<msup>{element}{above}</msup>"
        return f"<mrow>{gap}{element}{gap}</mrow>" if gap else element

    def atom(self) -> str:
        """Read a group, a command, a number, a letter or an operator."""
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

        # An operator: a sign at the start of a term has no space, and parentheses do not stretch.
        before = next((t for t in reversed(self.tokens[: self.at - 1]) if not t.isspace()), "=")
        form = ""
        if token in "+-" and before in ("=", "(", "{", "|", ",", "&"):
            form = ' form="prefix"'
        elif token == "|":
            form = ' stretchy="false" lspace="0" rspace="0"'
        elif token in "()[]":
            form = ' stretchy="false"'
        return f"<mo{form}>{escape(SIGNS.get(token, token))}</mo>"

    def group_text(self) -> str:
        self.at += 1
        start, depth = self.at, 1
        while depth:
            depth += {"{": 1, "}": -1}.get(self.tokens[self.at], 0)
            self.at += 1
        return escape("".join(self.tokens[start : self.at - 1]))

    def cases(self) -> str:
        """Read cases with their conditions, between \\begin{cases} and \\end{cases}."""
        name = self.group_text()
        if name != "cases":
            raise ValueError(f"formula: found \\begin{{{name}}}; expected \\begin{{cases}}")
        rows = [[""]]
        while (token := self.tokens[self.at]) != "\\end":
            if token not in ("&", "\\\\"):
                rows[-1][-1] += self.scripted()
                continue
            self.at += 1
            if token == "&":
                rows[-1].append("")
            else:
                rows.append([""])
        self.at += 1
        self.group_text()
        table = "".join(f"<mtr>{''.join(f'<mtd>{cell}</mtd>' for cell in row)}</mtr>" for row in rows)
        return f'<mrow><mo>{{</mo><mtable columnalign="left">{table}</mtable></mrow>'


def _function(name: str) -> str:
    """Write the name of a function after a gap."""
    return f'<mrow>{GAP}<mi mathvariant="normal">{name}</mi></mrow>'
