"""Functions that are read from their syntax tree: they have the bits that Numba's own way gives them, which is a way back."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numba import types
from numba.core import errors
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python, rtsys

from synchain import Lagrangian, Potential, Scene
from synchain.codegen.front_end import compiler, decorator, emitter, syntax_reader, syntax_trees
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.machine_code.compile import _compile
from synchain.codegen.simd.addresses import ADDRESS
from synchain.codegen.simd.lane_types import Lane
from synchain.graphs import chain

HEAD = """import math
import numpy as np
from synchain.codegen.simd import absolute, any_lane, broadcast, load, maximum, minimum, njit, select, sqrt, store
SIX, YES, NO, SEVERAL = 6, True, False, (1, 4)

@njit(error_model="numpy")
def both(x, y):
    return x + y, x * y

@njit(error_model="numpy")
def ones(n):
    a = np.empty(n)
    for k in range(n):
        a[k] = 1.0
    return a

@njit(error_model="numpy")
def total(a):
    b = a
    found = 0.0
    for k in range(len(b)):
        found += b[k]
    return found

"""
VECTOR = types.float64[::1]
ARGUMENTS = (VECTOR, VECTOR, types.int64, types.UniTuple(types.float64, 2))


def _module(bodies: dict[str, str]) -> tuple[list[str], str]:
    """The names of functions of these bodies, and their module."""
    names = [f"f{k}" for k in range(len(bodies))]
    text = HEAD
    for name, body in zip(names, bodies.values(), strict=True):
        lines = "\n".join("    " + line for line in body.splitlines())
        text += f'\n\n@njit(error_model="numpy", cache=True)\ndef {name}(x, out, n, pair):\n{lines}\n'
    return names, text


def _in_both_ways(bodies: dict[str, str], folder: Path) -> dict[str, tuple[Any, Any]]:
    """Functions of these bodies compiled from their syntax and by Numba itself, by name."""
    names, text = _module(bodies)
    path, wanted = folder / "text.py", dict.fromkeys(names, types.void(*ARGUMENTS))
    path.write_text(text)
    read = _compile(text, path, wanted)[0].functions
    space = {"numba": numba}
    exec(text.replace(" njit,", "").replace("@njit", "@numba.njit").replace(", cache=True", ""), space)
    return {body: (read[name], space[name]) for name, body in zip(names, bodies, strict=True)}


def _filled(function: Any, seed: int, n: int) -> bytes:
    """What a function makes of some numbers, to the bit."""
    draw = np.random.default_rng(seed)
    x, out = draw.normal(size=64), np.zeros(64)
    function(x, out, n, (0.3, -1.7))
    return out.tobytes()


READ = {
    "sums and products": "a, b = load(x, 0, 4), load(x, 1, 4)\nc = a*b\nstore(out, 0, c + b)\nstore(out, 1, -c - 2*a)",
    "a product of another block": "a = load(x, 0, 4)\nc = a*a\nif n > 2:\n    store(out, 0, c + a)\nstore(out, 1, a - c)",
    "products inside of blocks": "a = load(x, 0, 4)\nb = a*a\nif n > 2:\n    store(out, 0, b + a)\nc = 2.0*a\nif YES:\n    store(out, 1, c - a)",
    "a choice that is known": "a = x[0]*x[1]\nif YES:\n    b = a + 1.0\nelse:\n    b = nothing\nout[0] = a - b",
    "loops": "s = 0.0\nfor k in range(n):\n    for j in range(k, 0, -1):\n        s += x[k]*x[j] - j\n    out[k] = s",
    "loops in steps": "for k in range(1, n, 2):\n    out[k] = k*k\nfor k in range(n, 0, -3):\n    out[k + 9] = x[k]",
    "a loop that ends": "k = 0\nwhile True:\n    k = k + 1\n    if x[k] > 0.5:\n        continue\n    if k > n:\n        break\n    out[k] = k",
    "a condition": "k = n\nwhile k > 0 and x[k] < 0.9 or k == 5:\n    k -= 1\n    out[k] = 1.0 if x[k] > 0.0 else k",
    "masks": "a = load(x, 1, 4)\nm = (a > 0.0) & ~(a >= 1.0)\nif any_lane(m):\n    store(out, 1, select(m, a, 0.0))",
    "tuples": "a, b = both(x[0], x[1])\na, b = b, a\nout[0] = a\nout[1] = b - pair[1]",
    "numbers": "k = n % 4\nj = n // 3\nout[k] = (k << 2) | (j >> 1)\nout[j + 8] = -SIX + n**2 + x[0]**3 + math.pi",
    "the larger": "out[0] = max(x[0], 0.25, x[1])\nout[1] = min(n, 3) + x.shape[0] + len(out)",
    "a variable of two types": "a = 1\na = 2.5*a\nout[0] = a",
    "negations": "if not n == 3:\n    out[0] = -x[0]\nif n:\n    out[1] = ~n",
    "an early end": "if n > 4:\n    out[0] = 1.0\n    return\nout[0] = 2.0",
    "three conditions": "out[0] = 1.0 if 0 < n < 4 and x[0] <= x[1] != x[2] else 2.0",
    "one value for two": "a = out[1] = x[n]\nout[0] = a + out[1]",
    "values and elements": "a, out[n] = x[n], x[1]\nout[0], (b, c) = a, pair\nout[1] = b - c",
    "an element that is added to": "out[n] += 2.0\nout[n] *= x[n]",
    "loops over values": "for k, a in enumerate((1.0, x[3], 2.5)):\n    if k == n:\n        continue\n    if k > 1:\n        break\n"
    "    out[k] += a\nfor j in SEVERAL:\n    for k in range(j):\n        if k > 1:\n            break\n        out[k] -= j",
    "what cannot be reached": "if NO:\n    out[0] = nothing\nelse:\n    out[0] = n\n    return\nout.nothing(1)",
    "memory": "a = np.empty(n + 1)\nfor k in range(n + 1):\n    a[k] = x[k]\nout[0] = a[n]",
    "memory in turn": "a, b = np.zeros(4), np.full(4, 2.0)\nfor k in range(n):\n    a, b = b, a\n    a[1] += k\n    if k == 5:\n"
    "        b = np.zeros(4)\n        return\nb = a\nout[0] = a[1] + b[0]",
    "memory of functions": "a = ones(n + 2)\nout[0] = total(ones(n + 1)) + total(a[1:]) + total(x[n:])\nc = a[:2]\nout[1] = c[0]",
    "memory of an argument": "x = out\nx[n] = 2.0\nx = np.zeros(9)\nx[0] = n\nout[1] = x[0]",
    "parts of tuples": "a = (n, x[0], x[1], 7)[1:3]\nout[0] = a[1]",
    "what is not kept": "_, a = both(x[0], x[1])\nfor _ in range(n):\n    a += a\nout[0] = a",
    "a part that is not known": "out[0] = pair[n % 2]",
    "values from the end": "out[n - 10] = x[-1] + x[n - 12]",
}  # fmt: skip


@pytest.fixture(params=["", "numba"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The front end, which must not fail, or Numba's own pipeline, which must not call the front end."""
    monkeypatch.setenv("SYNCHAIN_FRONT_END", request.param)
    if request.param:
        monkeypatch.delattr(syntax_reader, "read")
    monkeypatch.setattr(decorator, "front_end_problems", problems := [])
    yield request.param
    assert problems == []


@pytest.mark.usefixtures("way")
def test_what_is_read_has_the_bits_of_numbas_own_way(tmp_path: Path) -> None:
    for name, (read, numbas) in _in_both_ways(READ, tmp_path).items():
        assert any(_filled(read, n, n).strip(b"\0") for n in range(9)), name
        for n in range(9):
            assert _filled(read, n, n) == _filled(numbas, n, n), name


def test_memory_is_given_back(tmp_path: Path) -> None:
    pairs = _in_both_ways({name: READ[name] for name in READ if name.startswith("memory")}, tmp_path)
    _nrt_python.memsys_enable_stats()
    for name, (read, _) in pairs.items():
        before = rtsys.get_allocation_stats()
        for n in range(9):
            _filled(read, n, n)
        after = rtsys.get_allocation_stats()
        assert after.alloc - before.alloc > 8, name
        assert after.alloc - before.alloc == after.free - before.free, name
    _nrt_python.memsys_disable_stats()


REFUSED = {
    "an argument by name": ("a, b = both(y=x[0], x=x[1])", "both(y=x[0], x=x[1])"),
    "a type for each block": ("a = 1\nif n > 2:\n    a = 2.5\nout[0] = a", "a of several types"),
    "a step that is not known": ("for k in range(0, 6, n + 1):\n    out[k] = x[k]", "for k in range(0, 6, n + 1)"),
    "a loop with another end": ("for k in range(n):\n    out[0] = 2.0\nelse:\n    out[0] = 1.0", "for k in range(n)"),
    "a comprehension": ("out[0] = sum([x[k] for k in range(n)])", "[x[k] for k in range(n)]"),
    "what may be nothing": ("out[0] = 1.0 if pair is None else 2.0", "pair is None"),
    "an unpacked array": ("a, b = x", "a, b = x"),
    "an unknown name": ("out[0] = nothing", "nothing"),
    "an unknown attribute": ("out[0] = x.nothing", "x.nothing"),
    "memory of nobody": ("np.empty(3)", "np.empty(3)"),
    "memory of a choice": ("a = x if n > 2 else np.empty(3)\nout[0] = a[0]", "x if n > 2 else np.empty(3)"),
    "an attribute of memory": ("out[0] = np.empty(3).size", "np.empty(3).size"),
    "memory of two": ("a = b = np.empty(3)", "a = b = np.empty(3)"),
}


@pytest.mark.parametrize(("body", "problem"), REFUSED.values(), ids=REFUSED)
def test_what_is_not_read_is_refused(body: str, problem: str) -> None:
    space: dict[str, Any] = {}
    syntax_trees.execute(_module({"one": body})[1], "<text>", space)
    cpu_target.typing_context.refresh()  # learn NumPy's functions, as Numba does before it compiles
    with pytest.raises(syntax_reader.UnreadError, match=re.escape(problem)):
        syntax_reader.read(cpu_target.typing_context, space["f0"].py_func, ARGUMENTS, types.void)


@pytest.mark.parametrize("method", ["rodas5p", "dop853"])
def test_steps_of_free_masses_are_read(method: str) -> None:
    """Nodes without forces have a rate that is a number, to which links add lanes."""
    mass = Lagrangian("m*v**2/2", "0", coordinates={"x": "v"}, parameters={"m": 5})
    toda = Potential("W*D*(exp(-(x_j-x_i)/a)+(x_j-x_i)/a)", {"a": 2, "D": 3})
    equations = Scene(mass, toda, chain(2), initial={"x": [0, 1], "v": 0}).equations
    space: dict[str, Any] = {}
    syntax_trees.execute(emit(equations, method, width=1).text, "<text>", space)
    cpu_target.typing_context.refresh()
    lane = Lane(1)
    arguments = (lane, lane, *[ADDRESS] * 4, types.float64, types.float64)
    assert syntax_reader.read(cpu_target.typing_context, space["step"].py_func, arguments, lane).result == lane


ONLY_NUMBA = ("an argument by name", "a type for each block", "a step that is not known", "a loop with another end")


def test_what_is_not_read_is_left_to_numba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decorator, "front_end_problems", problems := [])
    pairs = _in_both_ways({name: REFUSED[name][0] for name in ONLY_NUMBA}, tmp_path)
    for (name, (compiled, numbas)), problem in zip(pairs.items(), problems, strict=True):
        assert REFUSED[name][1] in problem
        for n in range(9):
            assert _filled(compiled, n, n) == _filled(numbas, n, n), name


@pytest.mark.parametrize(
    ("owner", "name", "fault"),
    [
        (syntax_reader, "read", AttributeError),
        (emitter.TypedFunction, "emit", TypeError),
        (compiler, "FrontEnd", ImportError),
        (compiler._Lower, "setup_function", KeyError),
    ],
)
def test_a_front_end_that_fails_is_left_out(
    owner: Any, name: str, fault: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> Any:
        raise fault("renamed in the next version")

    monkeypatch.setattr(decorator, "front_end_problems", problems := [])
    monkeypatch.setattr(owner, name, fail)
    ((read, numbas),) = _in_both_ways({"one": READ["tuples"]}, tmp_path).values()
    assert problems
    assert f"{fault.__name__}: " in problems[0]
    assert _filled(read, 3, 3) == _filled(numbas, 3, 3)


def test_operands_without_a_meaning_are_refused_by_numba(tmp_path: Path) -> None:
    with pytest.raises(errors.TypingError, match="No implementation of function"):
        _in_both_ways({"one": "out[0] = pair + 1.0"}, tmp_path)


class _Author:
    """Writes random functions: assignments, choices and loops over lanes, numbers and integers."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.products: list[str] = []
        self.count = 0

    def lane(self, depth: int = 3) -> str:
        pick = self.random.choice
        if depth == 0 or self.random.random() < 0.15:
            return pick(["a", "b", "c", "s", "2.0", "0.3", "pair[0]", "load(x, n % 3, 4)", *self.products])
        one, two = self.lane(depth - 1), self.lane(depth - 1)
        forms = ["{} + {}", "{} - {}", "{}*{}", "{}*{}", "maximum({}, b*{})", "select(a > {}, b, c*{})", "-{} - {}"]
        return "(" + pick(forms).format(one, two) + ")"

    def number(self) -> str:
        return self.random.choice(
            ["s", "x[k]", "0.5*s + x[n]", "s*x[k] - pair[1]", "max(s, x[2])", "s if k > 3 else x[1]"]
        )

    def statements(self, depth: int) -> list[str]:
        collected = []
        for _ in range(self.random.randint(2, 5)):
            kind = self.random.random()
            if depth and kind < 0.2:
                test = self.random.choice(["n > 3", "k < 2 or s > 0.0", "any_lane(a > b)", "not k == n", "YES", "NO"])
                collected += [f"if {test}:", *self.inner(depth), "else:", *self.inner(depth)]
            elif depth and kind < 0.35:
                bounds = self.random.choice(["k % 4", "1, 5", "5, 0, -2"])
                index = "ij"[depth % 2]
                collected += [f"for {index} in range({bounds}):", *self.inner(depth), f"    out[40 + {index}] = s"]
            elif kind < 0.5:
                collected.append(f"s = {self.number()}")
            elif kind < 0.6:
                collected.append(self.random.choice(["k = (k + 3) % 7", "k += 1", "k = min(k, n)"]))
            elif kind < 0.65:
                collected.append("a, b = b*c + a, a")
            elif kind < 0.8:
                self.count += 1
                collected.append(f"d{self.count} = {self.lane(2)}*b")
                self.products.append(f"d{self.count}")
            else:
                collected.append(f"{self.random.choice('abc')} = {self.lane()} + 0.0*a")
        return collected

    def inner(self, depth: int) -> list[str]:
        before = len(self.products)
        lines = ["    " + line for line in self.statements(depth - 1)]
        del self.products[before:]
        return lines

    def body(self) -> str:
        first = ["a, b, c = load(x, 0, 4), load(x, 1, 4), load(x, 2, 4)", "s, k = x[5], n", "k = k % 7"]
        last = ["store(out, 0, a)", "store(out, 1, b)", "store(out, 2, c)", "out[30] = s", "out[31] = k"]
        return "\n".join([*first, *self.statements(3), *last])


def test_random_functions_have_the_bits_of_numbas_own_way(tmp_path: Path) -> None:
    bodies = {str(seed): _Author(seed).body() for seed in range(8)}
    for seed, (read, numbas) in _in_both_ways(bodies, tmp_path).items():
        for n in range(7):
            assert _filled(read, n, n) == _filled(numbas, n, n), bodies[seed]
