"""Programs as text that is meant to be read: minimal parentheses, one dialect for each language."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from . import functions
from .expressions import (
    Call,
    Compare,
    Conditional,
    Expression,
    Junction,
    Load,
    Name,
    Negation,
    Not,
    Number,
    Power,
    Product,
    Quotient,
    Slice,
    Sum,
    call,
    negative,
    plus,
)
from .statements import (
    Accumulate,
    Array,
    Assign,
    Comment,
    Do,
    Function,
    Identity,
    If,
    Index,
    Loop,
    Repeat,
    Return,
    Role,
    Statement,
    Store,
    Titled,
)

SUM, TERM, POWER, ATOM = range(4)
"""How tightly a piece of text holds together."""

WIDEST = 110
"""Columns of an assignment on one line."""

OPTIONS = {Role.INLINED: ", forceinline=True", Role.CALLED: "", Role.ENTRY: ", cache=True"}
"""What Numba is told of a function."""


class Printer:
    """What all languages have in common; each says the rest."""

    functions: Mapping[str, str]
    words: Mapping[str, str]
    comment = "# {}"
    assign = whole = "{} = {}"

    # -- expressions ------------------------------------------------------------------------------------------

    def text(self, e: Expression, level: int = SUM) -> str:
        """Return an expression, in parentheses where it holds less together than `level`."""
        text, tight = self.piece(e)
        return text if tight >= level else f"({text})"

    def piece(self, e: Expression) -> tuple[str, int]:
        """The text of an expression, and how tightly it holds together."""
        match e:
            case Name(text):
                return text, ATOM
            case Number(value):
                return repr(value), SUM if value < 0 else ATOM
            case Sum(terms):
                return self.sum(terms), SUM
            case Negation(value):
                return f"-{self.text(value, TERM)}", SUM
            case Product(factors):
                first, *others = factors
                start = repr(first.value) if isinstance(first, Number) else self.text(first, TERM)
                return "*".join([start, *(self.text(f, POWER) for f in others)]), TERM
            case Quotient(top, bottom):
                return f"{self.text(top, TERM)}/{self.text(bottom, ATOM)}", TERM
            case Power(base, exponent):
                return self.power(base, exponent)
            case Call(function, arguments):
                name = self.functions.get(function, function)
                return f"{name}({', '.join(map(self.text, arguments))})", ATOM
            case Conditional(condition, yes, no):
                return self.choice(*map(self.text, (condition, yes, no))), ATOM
            case Slice(start, stop):
                return f"{'' if start == Number(0) else self.text(start)}:{self.text(stop)}", SUM
            case Load(array, index, width):
                return self.load(array, index, width), ATOM
        return self.condition(e), SUM

    def sum(self, terms: tuple[Expression, ...]) -> str:
        """Terms with their signs between them."""
        text = self.text(terms[0])
        for term in terms[1:]:
            minus = isinstance(term, Negation) or (isinstance(term, Number) and term.value < 0)
            text += f" - {self.text(negative(term), TERM)}" if minus else f" + {self.text(term, TERM)}"
        return text

    def condition(self, e: Expression) -> str:
        """A condition; the parts of a larger one stand in parentheses unless they are names."""
        match e:
            case Compare(sign, left, right):
                return f"{self.text(left, TERM)} {sign} {self.text(right, TERM)}"
            case Not(condition):
                return f"{self.words['not']}{self.text(condition, ATOM)}"
            case Junction(word, conditions):
                named = ((isinstance(c, Name | Not), self.text(c)) for c in conditions)
                return self.words[word].join(text if name else f"({text})" for name, text in named)
        raise TypeError(f"no text for {type(e).__name__}; this is a mistake in the program")

    def power(self, base: Expression, exponent: Expression) -> tuple[str, int]:
        """A power."""
        return f"{self.text(base, ATOM)}**{self.text(exponent, ATOM)}", POWER

    def choice(self, condition: str, yes: str, no: str) -> str:
        """One of two values."""
        raise NotImplementedError

    def load(self, array: str, index: Expression, width: str | None) -> str:
        """An element of an array."""
        return f"{array}[{self.text(index)}]"

    # -- statements -------------------------------------------------------------------------------------------

    def lines(self, statements: Iterable[Statement]) -> list[str]:
        """Return the lines of some statements."""
        return [line for statement in statements for line in self.statement(statement)]

    def block(self, head: str, body: Iterable[Statement]) -> list[str]:
        """Statements behind a head."""
        return [f"{head}:", *(f"    {line}" for line in self.lines(body) or ["pass"])]

    def statement(self, s: Statement) -> list[str]:
        """The lines of one statement."""
        match s:
            case Assign(targets, value, whole):
                return [(self.whole if whole else self.assign).format(", ".join(targets), self.text(value))]
            case Array(name, size):
                return [self.array(name, self.text(size))]
            case Identity(name, size):
                return self.identity(name, self.text(size))
            case Store(array, index, value):
                return [self.store(array, index, self.text(value))]
            case Accumulate(array, index, value):
                return [self.accumulate(array, index, value)]
            case Loop() | Repeat():
                return self.turns(s)
            case If(condition, body):
                return self.block(f"if {self.text(condition)}", body)
            case Titled(title, body):
                return self.titled(self.comment.format(title), body)
            case Comment(text):
                return [self.comment.format(text)]
            case Do(call):
                return [self.do(call)]
            case Return(values, remark):
                return [f"return {', '.join(map(self.text, values))}{f'  # {remark}' if remark else ''}"]

    def turns(self, s: Loop | Repeat) -> list[str]:
        """Statements that run again and again."""
        if isinstance(s, Loop):
            return self.block(self.loop(s.index, s.start, s.stop, s.step), s.body)
        return [*self.block("while True", s.body), f"    if not {self.text(s.condition)}:", "        break"]

    def array(self, name: str, size: str) -> str:
        """A new array."""
        return f"{name} = np.empty({size})"

    def identity(self, name: str, size: str) -> list[str]:
        """A new matrix."""
        return [f"{name} = np.eye({size})"]

    def titled(self, title: str, body: Iterable[Statement]) -> list[str]:
        """Statements behind a comment."""
        return [title, *self.lines(body)]

    def place(self, array: str, index: Index) -> str:
        """An element as the target of an assignment."""
        row_column = index if isinstance(index, tuple) else (index,)
        return f"{array}[{', '.join(map(self.text, row_column))}]"

    def do(self, call: Call) -> str:
        """A call as a statement."""
        return self.text(call)

    def store(self, array: str, index: Index, value: str) -> str:
        """An assignment to an element."""
        return f"{self.place(array, index)} = {value}"

    def accumulate(self, array: str, index: Index, value: Expression) -> str:
        """An addition to an element."""
        return f"{self.place(array, index)} += {self.text(value)}"

    def loop(self, index: str, start: Expression, stop: Expression, step: int) -> str:
        """The head of a loop."""
        begin = "" if start == Number(0) and step == 1 else f"{self.text(start)}, "
        return f"for {index} in range({begin}{self.text(stop)}{'' if step == 1 else f', {step}'})"


class Lanes(Printer):
    """Kernels: functions of registers."""

    functions = functions.LANES
    words: Mapping[str, str] = {"and": " & ", "or": " | ", "not": "~"}

    def piece(self, e: Expression) -> tuple[str, int]:
        """The text of an expression; both arguments of atan2 are registers."""
        if isinstance(e, Call) and e.function == "atan2" and any(isinstance(a, Number) for a in e.arguments):
            e = call("atan2", *(call("broadcast", a, "WIDTH") if isinstance(a, Number) else a for a in e.arguments))
        return super().piece(e)

    def choice(self, condition: str, yes: str, no: str) -> str:
        """Both values are computed, each lane takes its own."""
        return f"select({condition}, {yes}, {no})"

    def load(self, array: str, index: Expression, width: str | None) -> str:
        """A register, or a single number."""
        return super().load(array, index, width) if width is None else f"load({array}, {self.text(index)}, {width})"

    def store(self, array: str, index: Index, value: str) -> str:
        """A register goes to memory."""
        return f"store({array}, {self.text(index)}, {value})" if isinstance(index, Expression) else ""

    def accumulate(self, array: str, index: Index, value: Expression) -> str:
        """A register is added to one in memory."""
        if not isinstance(index, Expression):
            raise TypeError("arrays of lanes have one index; this is a mistake in the program")
        return self.store(array, index, self.text(plus(Load(array, index), value)))

    def statement(self, s: Statement) -> list[str]:
        """The lines of one statement; long sums and products are broken between words."""
        lines = super().statement(s)
        is_long = isinstance(s, Assign) and isinstance(s.value, Sum | Product) and len(lines[0]) > WIDEST
        return broken(lines[0]) if is_long else lines

    def function(self, f: Function) -> str:
        """A function with its head."""
        options = "error_model='numpy'" + OPTIONS[f.role]
        head = [f"@njit({options})", f"def {f.name}({', '.join(f.arguments)}):", f'    """{f.about}"""']
        return "\n".join([*head, *(f"    {line}" for line in self.lines(f.body))])


def broken(line: str) -> list[str]:
    """An assignment on several lines."""
    target, _, value = line.partition(" = ")
    lines, row = [f"{target} = ("], "   "
    for word in value.split(" "):
        if len(row) + 1 + len(word) > WIDEST and word not in "+-":
            sign = row[-2:] if row[-2:] in (" +", " -") else ""
            lines.append(row.removesuffix(sign) if sign else row)
            row = "   " + sign
        row += f" {word}"
    return [*lines, row, ")"]


class NumPy(Printer):
    """Functions of arrays or of numbers."""

    functions = functions.NUMPY
    words: Mapping[str, str] = {"and": " & ", "or": " | ", "not": "~"}

    def choice(self, condition: str, yes: str, no: str) -> str:
        """Both values are computed."""
        return f"np.where({condition}, {yes}, {no})"


class Math(Printer):
    """Functions of numbers that Numba compiles."""

    functions = functions.MATH
    words: Mapping[str, str] = {"and": " and ", "or": " or ", "not": "not "}

    def choice(self, condition: str, yes: str, no: str) -> str:
        """One value is computed."""
        return f"({yes} if {condition} else {no})"


class C(Printer):
    """Functions of C99."""

    functions = functions.C99
    words: Mapping[str, str] = {"and": " && ", "or": " || ", "not": "!"}
    comment = "/* {} */"
    assign, whole = "const double {} = {};", "const int {} = {};"

    def choice(self, condition: str, yes: str, no: str) -> str:
        """One value is computed."""
        return f"({condition} ? {yes} : {no})"

    def power(self, base: Expression, exponent: Expression) -> tuple[str, int]:
        """A call of pow, which takes doubles."""
        given = Number(float(exponent.value)) if isinstance(exponent, Number) else exponent
        return f"pow({self.text(base)}, {self.text(given)})", ATOM

    def place(self, array: str, index: Index) -> str:
        """An element; matrices are stored row by row."""
        if isinstance(index, Expression):
            return super().place(array, index)
        row, column = map(self.text, index)
        return f"{array}[{row}*DIMENSION + {column}]"

    def do(self, call: Call) -> str:
        """A call as a statement."""
        return super().do(call) + ";"

    def store(self, array: str, index: Index, value: str) -> str:
        """An assignment to an element."""
        return super().store(array, index, value) + ";"

    def accumulate(self, array: str, index: Index, value: Expression) -> str:
        """An addition to an element."""
        return super().accumulate(array, index, value) + ";"

    def loop(self, index: str, start: Expression, stop: Expression, step: int) -> str:
        """The head of a loop."""
        sign, by = "<" if step > 0 else ">", "++" if step == 1 else f" += {step}"
        return f"for (int {index} = {self.text(start)}; {index} {sign} {self.text(stop)}; {index}{by})"

    def turns(self, s: Loop | Repeat) -> list[str]:
        """Statements that run again and again."""
        if isinstance(s, Loop):
            return super().turns(s)
        *lines, end = self.block("do", s.body)
        return [*lines, f"{end} while ({self.text(s.condition)});"]

    def block(self, head: str, body: Iterable[Statement]) -> list[str]:
        """Statements in braces."""
        return [f"{head} {{", *(f"    {line}" for line in self.lines(body)), "}"]

    def array(self, name: str, size: str) -> str:
        """A new array."""
        return f"double {name}[{size}];"

    def identity(self, name: str, size: str) -> list[str]:
        """A new matrix."""
        diagonal = f"for (int k_ = 0; k_ < {size}; k_++) {name}[k_*{size} + k_] = 1.0;"
        return [f"double {name}[{size}*{size}] = {{0.0}};", diagonal]

    def titled(self, title: str, body: Iterable[Statement]) -> list[str]:
        """Statements in braces, with variables of their own."""
        return [f"{{ {title}", *(f"    {line}" for line in self.lines(body)), "}"]


LANES, NUMPY, MATH, C99 = Lanes(), NumPy(), Math(), C()
