"""Programs: what is read off their statements, and one program in the text of each language."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import pytest
import sympy as sp
from samples import real

from synchain.codegen.program import functions
from synchain.codegen.program.expressions import (
    ONE,
    ZERO,
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
    linear,
    negative,
    plus,
    scaled,
)
from synchain.codegen.program.lowering import Library, UnprintableError, lower
from synchain.codegen.program.printers import C99, LANES, MATH, NUMPY, Printer
from synchain.codegen.program.statements import (
    Accumulate,
    Array,
    Assign,
    Comment,
    Do,
    Function,
    Identity,
    If,
    Loop,
    Repeat,
    Return,
    Role,
    Titled,
    accumulate,
    called,
    let,
    mentioned,
    operations,
    store,
    whole,
)

A, B, C = map(Name, "abc")

BODY = (
    Comment("a remark - with + signs * and / words(of) = text"),
    whole("k", Load("where", 2 * Name("NODES") + "i", None)),
    let("a", Load("y", 3 * Name("NODES") + "k") * B + call("sin", C)),
    Loop("i", Number(0), Name("NODES"), (accumulate("out", Name("K") + "i", A * B), If(A, (store("out", 0, A / B),)))),
    Titled("part", (Do(call("solve", "dense", A - B)),)),
    Return((A, call("maximum", A, 2.0))),
)


# -- what is read off ----------------------------------------------------------------------------------------


def test_operations_are_those_of_values() -> None:
    """Neither those of indices nor signs in comments: product and sum, product and addition, quotient, difference."""
    assert operations(BODY) == 2 + 2 + 1 + 1
    assert operations([let("a", Negation(A))]) == 0
    assert operations([let("a", Sum((A, Negation(B), C)))]) == 2


def test_functions_and_names_are_found_at_any_depth() -> None:
    assert called(BODY) == {"sin", "solve", "maximum"}
    assert mentioned(BODY) == {"where", "y", "NODES", "K", "i", "k", "a", "b", "c", "out", "dense"}
    assert mentioned([Accumulate("rates", Name("i"), Load("state", Name("j"), None))]) == {"rates", "i", "state", "j"}


def test_what_is_repeated_is_read_off_too() -> None:
    repeated = Repeat((let("a", A * B), Do(call("tell", C))), call("any_lane", Compare(">", A, Number(0.5))))
    assert operations([repeated]) == 1
    assert called([repeated]) == {"tell"}
    assert mentioned([repeated]) == {"a", "b", "c"}


# -- expressions ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("e", "text"),
    [
        (A + B + C, "a + b + c"),
        (A + (B + C), "a + (b + c)"),
        (A - (B - C), "a - (b - c)"),
        (plus(A, B - C), "a + b - c"),
        (A * (B * C), "a*(b*c)"),
        ((A * B) * C, "a*b*c"),
        (A / (B * C), "a/(b*c)"),
        (A / B / C, "a/b/c"),
        ((A + B) / C, "(a + b)/c"),
        (A / (B / C), "a/(b/c)"),
        (Negation(A + B), "-(a + b)"),
        (A - Negation(B), "a - (-b)"),
        (A * Negation(B), "a*(-b)"),
        (plus(A, Number(-2.0)), "a - 2.0"),
        (Number(-2.0) * A, "-2.0*a"),
        (A * Number(-2.0), "a*(-2.0)"),
        (scaled("s", A * B), "s*a*b"),
        (scaled("s", Negation(A / B)), "-s*a/b"),
        (linear((0.5, 0.0, -1.0, -0.25), ["a", "b", "c", "d"], "y"), "y + 0.5*a - c - 0.25*d"),
        (linear((0.0, -1.0), ["a", "b"]), "-b"),
        (linear((0.0,), ["a"]), "0.0"),
    ],
)
def test_text_keeps_the_order_of_operations(e: Expression, text: str) -> None:
    assert LANES.text(e) == text
    values = {"a": 0.3, "b": 0.7, "c": -1.9, "d": 2.3, "y": 0.1, "s": 1.7}
    assert eval(text, dict(values)) == value(e, values)


def value(e: Expression, values: dict[str, float]) -> float:
    """The value of an expression, operation by operation."""
    match e:
        case Name(text):
            return values[text]
        case Number(number):
            return number
        case Negation(inner):
            return -value(inner, values)
        case Quotient(top, bottom):
            return value(top, values) / value(bottom, values)
        case Sum(terms):
            total = value(terms[0], values)
            for term in terms[1:]:
                total = total + value(term, values)
            return total
        case ProductExpr(factors):
            total = value(factors[0], values)
            for factor in factors[1:]:
                total = total * value(factor, values)
            return total
    raise TypeError(e)


def test_signs_are_folded() -> None:
    assert negative(negative(A)) == A
    assert negative(Number(2.0)) == Number(-2.0)
    assert negative(negative(ONE)) == ONE


def test_a_long_sum_of_lanes_is_broken_and_keeps_its_value() -> None:
    """A long call stands on one line."""
    terms = [Name(f"coefficient{k}") * B for k in range(9)]
    lines = LANES.lines([let("a", plus(*terms, Negation(C)))])
    values = {"b": 0.7, "c": 0.1} | {f"coefficient{k}": 1.0 / (k + 3.0) for k in range(9)}
    remaining = dict(values)
    exec("\n".join(lines), remaining)
    assert len(lines) > 3
    assert max(map(len, lines)) <= 114
    assert remaining["a"] == value(plus(*terms, Negation(C)), values)
    assert len(LANES.lines([let("a", call("maximum", plus(*terms), C))])) == 1
    assert len(NUMPY.lines([let("a", plus(*terms))])) == 1


# -- languages -----------------------------------------------------------------------------------------------

LANGUAGES: dict[str, Printer] = {"lanes": LANES, "numpy": NUMPY, "math": MATH, "c": C99}
PROGRAM = (
    Array("v", Number(3)),
    Identity("m", Number(2)),
    whole("k", Number(1)),
    let("w", PowerExpr(Name("x"), Number(3)) + 0.5),
    Loop(
        "i", Number(0), Number(3), (store("v", Name("i"), call("absolute", "x")), accumulate("v", Name("i"), Name("w")))
    ),
    let("z", Conditional(Junction("or", (Compare("<", Name("x"), ZERO), Compare(">=", Name("w"), ONE))), ONE, ZERO)),
)


@pytest.mark.parametrize(
    ("language", "lines"),
    [
        (
            "math",
            [
                "v = np.empty(3)",
                "m = np.eye(2)",
                "k = 1",
                "w = x**3 + 0.5",
                "for i in range(3):",
                "    v[i] = abs(x)",
                "    v[i] += w",
                "z = (1.0 if (x < 0.0) or (w >= 1.0) else 0.0)",
            ],
        ),
        (
            "c",
            [
                "double v[3];",
                "double m[2*2] = {0.0};",
                "for (int k_ = 0; k_ < 2; k_++) m[k_*2 + k_] = 1.0;",
                "const int k = 1;",
                "const double w = pow(x, 3.0) + 0.5;",
                "for (int i = 0; i < 3; i++) {",
                "    v[i] = fabs(x);",
                "    v[i] += w;",
                "}",
                "const double z = ((x < 0.0) || (w >= 1.0) ? 1.0 : 0.0);",
            ],
        ),
    ],
)
def test_one_program_in_two_languages(language: str, lines: list[str]) -> None:
    assert LANGUAGES[language].lines(PROGRAM) == lines


def test_lanes_load_and_store_registers() -> None:
    body = (
        let("a", Load("y", Number(0))),
        let("b", Load("shared", Number(1), None)),
        accumulate("dense", Name("K1") + "i", A - B),
        Return((A,), "a remark"),
    )
    text = LANES.function(Function("f", ("y", "shared", "dense"), "What it does.", body, role=Role.ENTRY))
    assert text.splitlines() == [
        "@njit(error_model='numpy', cache=True)",
        "def f(y, shared, dense):",
        '    """What it does."""',
        "    a = load(y, 0, WIDTH)",
        "    b = shared[1]",
        "    store(dense, K1 + i, load(dense, K1 + i, WIDTH) + a - b)",
        "    return a  # a remark",
    ]


def test_slices_of_arrays() -> None:
    assert NUMPY.text(Load("state", Slice(Number(0), Name("NODES")), None)) == "state[:NODES]"
    assert NUMPY.text(Load("state", Slice(Name("NODES"), 2 * Name("NODES")), None)) == "state[NODES:2*NODES]"


def test_every_function_has_a_name_in_every_language_or_is_refused() -> None:
    x, y = real("x", "y")
    for kind, name in functions.FUNCTIONS.items():
        e = kind(x, y) if kind in (sp.Max, sp.Min, sp.atan2) else kind(x)
        for printer in (NUMPY, MATH, C99):
            assert printer.text(Library()(e)).startswith(f"{printer.functions[name]}(")
        if name in functions.LANES:
            assert lower(e) == Call(name, Library()(e).parts)
        else:
            with pytest.raises(UnprintableError, match=f"no printing rule for {kind.__name__} in"):
                lower(e)


def test_python_texts_run_and_agree() -> None:
    x = sp.Symbol("x", real=True)
    e = sp.atan(x) / 3 + sp.sqrt(1 + x**2) - sp.Abs(x - 1) * sp.exp(-(x**2))
    import numpy as np

    for printer in (NUMPY, MATH):
        value = eval(printer.text(Library()(e)), {"np": np, "math": math, "x": 0.37})
        assert value == pytest.approx(float(e.subs(x, 0.37)), rel=1e-15)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_c_compiles(tmp_path: Path) -> None:
    text = ["#include <math.h>", "double f(double x) {", *C99.lines(PROGRAM), "return z + v[k] + m[0]; }"]
    (tmp_path / "f.c").write_text("\n".join(text) + "\n")
    done = subprocess.run(
        ["cc", "-std=c99", "-pedantic", "-Wall", "-Werror", "-c", "f.c"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_what_no_language_says_is_our_own_mistake() -> None:
    with pytest.raises(TypeError, match="mistake in the program"):
        LANES.text(Expression())
    with pytest.raises(TypeError, match="one index"):
        LANES.lines([Accumulate("a", (A, B), C)])
    assert LANES.lines([Assign(("a", "b"), call("f", C))]) == ["a, b = f(c)"]


DOWN = (
    Loop("i", Number(3), Number(-1), (store("v", Name("i"), Name("x")),), step=-1),
    Loop("i", Number(0), Number(4), (store("v", Name("i"), Name("x")),), step=2),
    Repeat((Do(call("turn", "v")),), Compare("<", Load("v", Number(0), None), ONE)),
)


@pytest.mark.parametrize(
    ("language", "lines"),
    [
        (
            "math",
            [
                "for i in range(3, -1, -1):",
                "    v[i] = x",
                "for i in range(0, 4, 2):",
                "    v[i] = x",
                "while True:",
                "    turn(v)",
                "    if not v[0] < 1.0:",
                "        break",
            ],
        ),
        (
            "c",
            [
                "for (int i = 3; i > -1; i += -1) {",
                "    v[i] = x;",
                "}",
                "for (int i = 0; i < 4; i += 2) {",
                "    v[i] = x;",
                "}",
                "do {",
                "    turn(v);",
                "} while (v[0] < 1.0);",
            ],
        ),
    ],
)
def test_loops_run_down_and_until_a_condition_fails(language: str, lines: list[str]) -> None:
    assert LANGUAGES[language].lines(DOWN) == lines


def test_the_opposite_of_a_condition() -> None:
    both = Junction("and", (Compare("<", A, B), Compare("<", B, C)))
    assert LANES.text(Not(both)) == "~((a < b) & (b < c))"
    assert LANES.text(Not(A)) == "~a"
    assert MATH.text(Not(call("open", A))) == "not open(a)"
