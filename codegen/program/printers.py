"""Print programs as readable text with as few parentheses as possible; each language has a printer.

`Printer` holds the grammar of expressions and statements. The subclass of a language holds the names of functions,
templates of one-line statements, and methods for statements that need more than a template.
"""

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
    PowerExpr,
    ProductExpr,
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

# Precedence levels of a piece of text, from the loosest (a sum) to the tightest (a name or a call).
SUM, TERM, POWER, ATOM = range(4)
WIDEST = 110  # largest width of an assignment on one line; longer assignments of lanes are broken into lines. A choice.
# Options of `njit` for each role of a function.
OPTIONS = {Role.INLINED: ", forceinline=True", Role.CALLED: "", Role.ENTRY: ", cache=True"}


class Printer:
    """The grammar that all languages share; each language has other templates."""

    functions: Mapping[str, str]
    words: Mapping[str, str]  # "and", "or", "not"
    choice: str  # condition, value, other value
    comment = "# {}"
    assign = whole = "{} = {}"  # assignment of a number, of an index
    power = "{}**{}"
    array = "{} = np.empty({})"
    identity: tuple[str, ...] = ("{name} = np.eye({size})",)
    end = ""  # end of a statement that does not assign to a name

    # -- expressions ------------------------------------------------------------------------------------------

    def text(self, e: Expression, level: int = SUM) -> str:
        """Return the text of an expression, in parentheses if its precedence is lower than `level`."""
        text, tight = self.piece(e)
        return text if tight >= level else f"({text})"

    def piece(self, e: Expression) -> tuple[str, int]:
        """Return the text of an expression and its precedence level."""
        match e:
            case Name(text):
                return text, ATOM
            case Number(value):
                return repr(value), SUM if value < 0 else ATOM
            case Sum(terms):
                text = self.text(terms[0])
                for term in terms[1:]:
                    minus = isinstance(term, Negation) or (isinstance(term, Number) and term.value < 0)
                    text += f" - {self.text(negative(term), TERM)}" if minus else f" + {self.text(term, TERM)}"
                return text, SUM
            case Negation(value):
                return f"-{self.text(value, TERM)}", SUM
            case ProductExpr(factors):
                # a negative number needs no parentheses if it is the first factor
                first, *others = factors
                start = repr(first.value) if isinstance(first, Number) else self.text(first, TERM)
                return "*".join([start, *(self.text(f, POWER) for f in others)]), TERM
            case Quotient(top, bottom):
                return f"{self.text(top, TERM)}/{self.text(bottom, ATOM)}", TERM
            case PowerExpr(base, exponent):
                return self.power.format(self.text(base, ATOM), self.text(exponent, ATOM)), POWER
            case Call(function, arguments):
                name = self.functions.get(function, function)
                return f"{name}({', '.join(map(self.text, arguments))})", ATOM
            case Conditional(condition, yes, no):
                return self.choice.format(*map(self.text, (condition, yes, no))), ATOM
            case Slice(start, stop):
                return f"{'' if start == Number(0) else self.text(start)}:{self.text(stop)}", SUM
            case Load(array, index, width):
                return self.load(array, index, width), ATOM
        return self.condition(e), SUM

    def condition(self, e: Expression) -> str:
        match e:
            case Compare(sign, left, right):
                return f"{self.text(left, TERM)} {sign} {self.text(right, TERM)}"
            case Not(condition):
                return f"{self.words['not']}{self.text(condition, ATOM)}"
            case Junction(word, conditions):
                # in Python `&` binds more tightly than `<`: put comparisons, but not names, in parentheses
                named = ((isinstance(c, Name | Not), self.text(c)) for c in conditions)
                return self.words[word].join(text if name else f"({text})" for name, text in named)
        raise TypeError(f"no text for {type(e).__name__}; this is a mistake in the program")

    def load(self, array: str, index: Expression, width: str | None) -> str:
        return f"{array}[{self.text(index)}]"

    # -- statements -------------------------------------------------------------------------------------------

    def lines(self, statements: Iterable[Statement]) -> list[str]:
        return [line for statement in statements for line in self.statement(statement)]

    def indented(self, statements: Iterable[Statement]) -> list[str]:
        return [f"    {line}" for line in self.lines(statements)]

    def block(self, head: str, body: Iterable[Statement]) -> list[str]:
        """Return a head line, followed by indented statements."""
        return [f"{head}:", *(self.indented(body) or ["    pass"])]

    def statement(self, s: Statement) -> list[str]:
        match s:
            case Assign(targets, value, whole):
                return [(self.whole if whole else self.assign).format(", ".join(targets), self.text(value))]
            case Array(name, size):
                return [self.array.format(name, self.text(size))]
            case Identity(name, size):
                return [line.format(name=name, size=self.text(size)) for line in self.identity]
            case Store(array, index, value):
                return [self.store(array, index, value)]
            case Accumulate(array, index, value):
                return [self.accumulate(array, index, value)]
            case Loop(index, start, stop, body, step):
                return self.block(self.loop(index, start, stop, step), body)
            case Repeat(body, condition):
                return self.repeat(body, self.text(condition))
            case If(condition, body):
                return self.block(f"if {self.text(condition)}", body)
            case Titled(title, body):
                return self.titled(self.comment.format(title), body)
            case Comment(text):
                return [self.comment.format(text)]
            case Do(call):
                return [self.text(call) + self.end]
            case Return(values, remark):
                return [f"return {', '.join(map(self.text, values))}{f'  # {remark}' if remark else ''}"]

    def place(self, array: str, index: Index) -> str:
        """Return the text of an array element as the target of an assignment."""
        row_column = index if isinstance(index, tuple) else (index,)
        return f"{array}[{', '.join(map(self.text, row_column))}]"

    def store(self, array: str, index: Index, value: Expression) -> str:
        return f"{self.place(array, index)} = {self.text(value)}{self.end}"

    def accumulate(self, array: str, index: Index, value: Expression) -> str:
        return f"{self.place(array, index)} += {self.text(value)}{self.end}"

    def loop(self, index: str, start: Expression, stop: Expression, step: int) -> str:
        begin = "" if start == Number(0) and step == 1 else f"{self.text(start)}, "
        return f"for {index} in range({begin}{self.text(stop)}{'' if step == 1 else f', {step}'})"

    def repeat(self, body: Iterable[Statement], condition: str) -> list[str]:
        """Return statements that run once, and again while a condition holds."""
        return [*self.block("while True", body), f"    if not {condition}:", "        break"]

    def titled(self, title: str, body: Iterable[Statement]) -> list[str]:
        """Return a comment, followed by statements."""
        return [title, *self.lines(body)]


class Lanes(Printer):
    """Print kernels, whose functions work on registers. A choice computes both values and selects in each lane."""

    functions = functions.LANES
    words: Mapping[str, str] = {"and": " & ", "or": " | ", "not": "~"}
    choice = "select({}, {}, {})"

    def piece(self, e: Expression) -> tuple[str, int]:
        """Return the text of an expression; broadcast numbers in atan2, both of whose arguments must be registers."""
        if isinstance(e, Call) and e.function == "atan2" and any(isinstance(a, Number) for a in e.arguments):
            e = call("atan2", *(call("broadcast", a, "WIDTH") if isinstance(a, Number) else a for a in e.arguments))
        return super().piece(e)

    def load(self, array: str, index: Expression, width: str | None) -> str:
        """Return the text that loads a register, or a single number."""
        return super().load(array, index, width) if width is None else f"load({array}, {self.text(index)}, {width})"

    def store(self, array: str, index: Index, value: Expression) -> str:
        if not isinstance(index, Expression):
            raise TypeError("arrays of lanes have one index; this is a mistake in the program")
        return f"store({array}, {self.text(index)}, {self.text(value)})"

    def accumulate(self, array: str, index: Index, value: Expression) -> str:
        return self.store(array, index, plus(Load(array, index), value) if isinstance(index, Expression) else value)

    def statement(self, s: Statement) -> list[str]:
        """Return the lines of one statement; break long sums and products at spaces."""
        lines = super().statement(s)
        is_long = isinstance(s, Assign) and isinstance(s.value, Sum | ProductExpr) and len(lines[0]) > WIDEST
        return broken(lines[0]) if is_long else lines

    def function(self, f: Function) -> str:
        head = [f"@njit(error_model='numpy'{OPTIONS[f.role]})", f"def {f.name}({', '.join(f.arguments)}):"]
        return "\n".join([*head, f'    """{f.about}"""', *self.indented(f.body)])


def broken(line: str) -> list[str]:
    """Break an assignment into lines of at most WIDEST columns; a sign stays on the line of the term behind it."""
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
    """Print functions of arrays or of numbers with NumPy; a choice computes both values."""

    functions = functions.NUMPY
    words: Mapping[str, str] = {"and": " & ", "or": " | ", "not": "~"}
    choice = "np.where({}, {}, {})"


class Math(Printer):
    """Print functions of numbers, with Python's module `math`, that Numba compiles."""

    functions = functions.MATH
    words: Mapping[str, str] = {"and": " and ", "or": " or ", "not": "not "}
    choice = "({1} if {0} else {2})"


class C(Printer):
    functions = functions.C99
    words: Mapping[str, str] = {"and": " && ", "or": " || ", "not": "!"}
    choice = "({} ? {} : {})"
    comment = "/* {} */"
    assign, whole = "const double {} = {};", "const int {} = {};"
    array = "double {}[{}];"
    identity = (
        "double {name}[{size}*{size}] = {{0.0}};",
        "for (int k_ = 0; k_ < {size}; k_++) {name}[k_*{size} + k_] = 1.0;",
    )
    end = ";"

    def piece(self, e: Expression) -> tuple[str, int]:
        """Return the text of an expression; a power becomes a call of pow with doubles."""
        match e:
            case PowerExpr(base, Number(value)):
                return super().piece(call("pow", base, float(value)))
            case PowerExpr(base, exponent):
                return super().piece(call("pow", base, exponent))
        return super().piece(e)

    def place(self, array: str, index: Index) -> str:
        """Return an element; matrices are stored row by row."""
        if isinstance(index, Expression):
            return super().place(array, index)
        row, column = map(self.text, index)
        return f"{array}[{row}*DIMENSION + {column}]"

    def loop(self, index: str, start: Expression, stop: Expression, step: int) -> str:
        sign, by = "<" if step > 0 else ">", "++" if step == 1 else f" += {step}"
        return f"for (int {index} = {self.text(start)}; {index} {sign} {self.text(stop)}; {index}{by})"

    def repeat(self, body: Iterable[Statement], condition: str) -> list[str]:
        """Return statements that run once, and again while a condition holds."""
        *lines, end = self.block("do", body)
        return [*lines, f"{end} while ({condition});"]

    def block(self, head: str, body: Iterable[Statement]) -> list[str]:
        return [f"{head} {{", *self.indented(body), "}"]

    def titled(self, title: str, body: Iterable[Statement]) -> list[str]:
        """Return statements in braces, so that their variables are local."""
        return [f"{{ {title}", *self.indented(body), "}"]


LANES, NUMPY, MATH, C99 = Lanes(), NumPy(), Math(), C()
